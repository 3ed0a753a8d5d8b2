// §5 Colours of a volume's cells. Twin: src/light/ramp.rs, which holds the reasoning.

// Whether any volume has colours.
override COLORED: bool = false;

struct Ramp {
    first: vec3<f32>,
    // Number of colours after the first.
    count: f32,
    // Differences from colour to colour, and factor and summand that make k_s of a cell's byte.
    step_0: vec3<f32>,
    k_s_factor: f32,
    step_1: vec3<f32>,
    k_s_summand: f32,
    step_2: vec3<f32>,
    pad: f32,
}

// Colour, and k_s in 255ths, of a cell with this byte in the place of k_s.
fn ramp_ink(ramp: Ramp, code: f32) -> vec4<f32> {
    let at = code * (1.0 / 255.0) * ramp.count;
    var color = ramp.first;
    color += ramp.step_0 * clamp(at, 0.0, 1.0);
    color += ramp.step_1 * clamp(at - 1.0, 0.0, 1.0);
    color += ramp.step_2 * clamp(at - 2.0, 0.0, 1.0);
    return vec4<f32>(color, code * ramp.k_s_factor + ramp.k_s_summand);
}
