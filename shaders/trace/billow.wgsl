// §4 Billows of mist. Twin: src/trace/billow.rs, which holds the reasoning.

#import layout
#import trace::noise

// Whether any mist billows.
override BILLOWS: bool = false;

const BILLOW_CONTRAST: f32 = 4.5;
const BILLOW_DEVIATION: f32 = 0.136;
const BILLOW_MOST: f32 = 3.0;

fn billow_row(x: u32, y: u32, z: u32, s: f32) -> f32 {
    let near = lattice(x, y, z);
    return near + (lattice(x + 1u, y, z) - near) * s;
}

// Value noise between the values of the lattice, 0 to 1.
fn billow_noise(p: vec3<f32>) -> f32 {
    let cell = floor(p);
    let f = p - cell;
    let s = f * f * (vec3<f32>(3.0) - f * 2.0);
    let x = bitcast<u32>(i32(cell.x));
    let y = bitcast<u32>(i32(cell.y));
    let z = bitcast<u32>(i32(cell.z));
    let low = billow_row(x, y, z, s.x);
    let near = low + (billow_row(x, y + 1u, z, s.x) - low) * s.y;
    let high = billow_row(x, y, z + 1u, s.x);
    let far = high + (billow_row(x, y + 1u, z + 1u, s.x) - high) * s.y;
    return near + (far - near) * s.z;
}

fn billow_field(billow: vec4<f32>, point: vec3<f32>, risen: f32, apart: f32) -> f32 {
    let p = vec3<f32>(point.x, point.y - billow.z * risen, point.z) * billow.y + vec3<f32>(apart);
    return 0.65 * billow_noise(p) + 0.35 * billow_noise(p * 2.7) - 0.5;
}

// Factor of mist's density at a point of the scene.
fn billow_factor(billow: vec4<f32>, times: vec4<f32>, point: vec3<f32>) -> f32 {
    if billow.x <= 0.0 {
        return 1.0;
    }
    let both = billow_field(billow, point, times.x, 0.0) * times.z
        + billow_field(billow, point, times.y, 37.0) * times.w;
    let contrast = billow.x * BILLOW_CONTRAST;
    let mean = 0.5 * (contrast * BILLOW_DEVIATION) * (contrast * BILLOW_DEVIATION);
    return min(exp(contrast * both - mean), BILLOW_MOST);
}
