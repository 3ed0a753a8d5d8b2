// The picture from the linear frame: mean of the samples, exposure, tone curve, sRGB, 8 bits.
// CPU twin: src/cpu/resolve.rs.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> radiance: array<vec4<f32>>;
// One pixel a word: red in the lowest byte, alpha 255 in the highest.
@group(0) @binding(2) var<storage, read_write> picture: array<u32>;
@group(0) @binding(3) var<uniform> tile: Tile;

// Narkowicz, "ACES Filmic Tone Mapping Curve", 2015.
fn filmic(x: f32) -> f32 {
    return (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
}

// IEC 61966-2-1.
fn srgb(x: f32) -> f32 {
    return select(1.055 * pow(x, 1.0 / 2.4) - 0.055, 12.92 * x, x <= 0.0031308);
}

fn channel(linear: f32) -> u32 {
    // Past 10⁴ both curves are flat; the bound keeps their squares finite.
    var x = clamp(linear * frame.exposure, 0.0, 1e4);
    if frame.filmic != 0u {
        x = filmic(x);
    }
    return u32(srgb(clamp(x, 0.0, 1.0)) * 255.0 + 0.5);
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= tile.width || id.y >= tile.height {
        return;
    }
    let index = (tile.y + id.y) * frame.window_width + tile.x + id.x;
    let linear = radiance[index].rgb / f32(frame.samples);
    picture[index] = channel(linear.r) | (channel(linear.g) << 8u) | (channel(linear.b) << 16u) | 0xff000000u;
}
