// §5 Decoding of a cell's direction, and the fibre model of Kajiya and Kay 1989. Twins: v_code in
// src/volume/cell.rs, and src/light/fibre.rs. shaders/engine/integrate_light.wgsl calls psi_parts for each
// cell.

#import layout

// Specular exponent if it is a whole number from 1 to 255, else 0. `pow` costs three times as much as the
// squarings.
override EXPONENT: u32 = 0u;

fn v_code(word: u32) -> vec3<f32> {
    let bits = vec3<u32>(word << 22u, word << 12u, word << 2u);
    return vec3<f32>(bitcast<vec3<i32>>(bits) >> vec3<u32>(22u));
}

fn specular_power(x: f32, p: f32) -> f32 {
    if EXPONENT == 0u {
        return pow(x, p);
    }
    var power = x;
    var result = 1.0;
    if (EXPONENT & 1u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 2u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 4u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 8u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 16u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 32u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 64u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 128u) != 0u { result *= power; }
    return result;
}

// The summands of Ψ = k_d·sin(t,l) + k_s·max(0, sin(t,l)·sin(t,e) − (t·l)(t·e))^p, with t = v/√q in the
// view's metric.
fn psi_parts(
    p: f32,
    k_d: f32,
    k_s: f32,
    v: vec3<f32>,
    l_v: vec3<f32>,
    t_dot_e: f32,
    sin2_e: f32,
    inverse_q: f32,
) -> vec2<f32> {
    let t_dot_l = dot3(v, l_v);
    let sin2_l = max(1.0 - t_dot_l * t_dot_l * inverse_q, 0.0);
    let base = sqrt(sin2_l * sin2_e) - t_dot_l * t_dot_e * inverse_q;
    return vec2<f32>(k_d * sqrt(sin2_l), k_s * specular_power(max(base, 0.0), p));
}
