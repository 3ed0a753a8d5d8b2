// Development of the picture from the linear frame: mean of the samples, division by alpha, white balance,
// exposure, tone curve, sRGB encoding and rounding to 8 bits. Twin: src/picture/resolve.rs; Develop is in
// src/picture/develop.rs.

#import layout

struct Develop {
    // Rows of the white balance matrix, used if `balanced` is not 0.
    balance: array<vec4<f32>, 3>,
    exposure: f32,
    tone: u32,
    balanced: u32,
    // 1: rounded by a pattern. 0: rounded to the nearest value.
    dither: u32,
    // Turns pixels of the whole image into points that are 1 from its middle in the corners: factors along x
    // and y, and what is subtracted.
    place: vec4<f32>,
    // Squared tangent of the angle at which a corner would be as dark by the cos^4 law; 0 without a vignette.
    vignette: f32,
    // Standard deviation of the grain in the middle greys; 0 without grain.
    grain: f32,
    // Number of the grain's pattern.
    grain_seed: u32,
    pad: u32,
}

const TONE_FILMIC: u32 = 1u;
const TONE_AGX: u32 = 2u;
// Alpha below which a pixel keeps its premultiplied colour: it rounds to 0 in 8 and in 16 bits.
const LEAST_ALPHA: f32 = 1e-6;

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<storage, read> radiance: array<vec4<f32>>;
// One pixel per word, with red in the lowest byte and alpha in the highest.
@group(0) @binding(2) var<storage, read_write> picture: array<u32>;
@group(0) @binding(3) var<uniform> tile: Tile;
@group(0) @binding(4) var<uniform> develop: Develop;
// Sums of the share of a backdrop that shows, 1 − alpha; used if the picture has an alpha channel.
@group(0) @binding(5) var<storage, read> uncovered: array<f32>;

// Filmic tone curve (Narkowicz, "ACES Filmic Tone Mapping Curve", 2015).
fn filmic(x: f32) -> f32 {
    return (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
}

// sRGB encoding (IEC 61966-2-1).
fn srgb(x: f32) -> f32 {
    return select(1.055 * pow(x, 1.0 / 2.4) - 0.055, 12.92 * x, x <= 0.0031308);
}

// AgX tone curve (Sobotka, "AgX", 2022, in the form of Wrensch, "Minimal AgX Implementation", 2023).
fn agx(x: vec3<f32>) -> vec3<f32> {
    let least_ev = -12.47393;
    let most_ev = 4.026069;
    let drawn_in = vec3<f32>(
        0.842479 * x.r + 0.0784336 * x.g + 0.079223745 * x.b,
        0.04232824 * x.r + 0.8784686 * x.g + 0.07916613 * x.b,
        0.042375655 * x.r + 0.0784336 * x.g + 0.879143 * x.b,
    );
    let ev = clamp(log2(max(drawn_in, vec3<f32>(1e-10))), vec3<f32>(least_ev), vec3<f32>(most_ev));
    let s = (ev - least_ev) / (most_ev - least_ev);
    let v = (((((15.5 * s - 40.14) * s + 31.96) * s - 6.868) * s + 0.4298) * s + 0.1191) * s - 0.00232;
    return vec3<f32>(
        1.196879 * v.r - 0.09802088 * v.g - 0.09902974 * v.b,
        -0.05289685 * v.r + 1.1519031 * v.g - 0.09896118 * v.b,
        -0.052971635 * v.r - 0.09804345 * v.g + 1.1510737 * v.b,
    );
}

fn channel(exposed: f32) -> f32 {
    var x = exposed;
    if develop.tone == TONE_FILMIC {
        x = filmic(x);
    }
    return srgb(clamp(x, 0.0, 1.0));
}

// Factor by which the vignette darkens a pixel of the whole image. Twin: Resolver::vignette.
fn vignette_at(x: u32, y: u32) -> f32 {
    let px = (f32(x) + 0.5) * develop.place.x - develop.place.z;
    let py = (f32(y) + 0.5) * develop.place.y - develop.place.w;
    let fall = 1.0 + develop.vignette * (px * px + py * py);
    return 1.0 / (fall * fall);
}

// Grain of a pixel of the whole image. Twin: grain of src/picture/resolve.rs.
fn grain_at(x: u32, y: u32) -> f32 {
    var h = (x * 0x8da6b343u) ^ (y * 0xd8163841u) ^ (develop.grain_seed * 0xcb1ab31fu);
    h = (h ^ (h >> 16u)) * 0x7feb352du;
    h = (h ^ (h >> 15u)) * 0x846ca68bu;
    h = h ^ (h >> 16u);
    let sum = (h & 0xffu) + ((h >> 8u) & 0xffu) + ((h >> 16u) & 0xffu) + (h >> 24u);
    return (f32(sum) - 510.0) * (1.0 / 147.80054);
}

fn byte(encoded: f32, rounding: f32) -> u32 {
    return u32(clamp(encoded, 0.0, 1.0) * 255.0 + rounding);
}

// Threshold of the dither at a pixel of the whole image.
fn threshold(x: u32, y: u32) -> f32 {
    let u = x * 288237660u + y * 25070368u;
    let noise = u * 52u + (u >> 16u) * 64417u;
    return (f32(noise >> 24u) + 0.5) / 256.0;
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= tile.width || id.y >= tile.height {
        return;
    }
    let index = (tile.y + id.y) * frame.window_width + tile.x + id.x;
    var linear = radiance[index].rgb / f32(frame.samples);
    var alpha = 1.0;
    if frame.alpha != 0u {
        alpha = 1.0 - uncovered[index] / f32(frame.samples);
        linear /= max(alpha, LEAST_ALPHA);
    }
    if develop.balanced != 0u {
        linear = vec3<f32>(
            dot3(develop.balance[0].xyz, linear),
            dot3(develop.balance[1].xyz, linear),
            dot3(develop.balance[2].xyz, linear),
        );
    }
    let at = vec2<u32>(frame.window_x + tile.x + id.x, frame.window_y + tile.y + id.y);
    if develop.vignette > 0.0 {
        linear *= vignette_at(at.x, at.y);
    }
    // All curves are flat above 10⁴. The bound keeps their squares finite.
    let x = clamp(linear * develop.exposure, vec3<f32>(0.0), vec3<f32>(1e4));
    var t = 0.5;
    if develop.dither != 0u {
        t = threshold(at.x, at.y);
    }
    var v = vec3<f32>(channel(x.r), channel(x.g), channel(x.b));
    if develop.tone == TONE_AGX {
        v = agx(x);
    }
    if develop.grain > 0.0 {
        v += develop.grain * grain_at(at.x, at.y) * (4.0 * v * (1.0 - v));
    }
    let bytes = vec3<u32>(byte(v.r, t), byte(v.g, t), byte(v.b, t));
    picture[index] = bytes.r | (bytes.g << 8u) | (bytes.b << 16u) | (byte(alpha, 0.5) << 24u);
}
