// §5 The reflection model for flowing water and for hair: Ψ of the strands from a table, and Ψ of the air
// between them.
// Twin: src/light/strand/table.rs, which describes the table's axes; src/light/strand/mod.rs describes the
// model.

// Whether scales on the strands are tilted, so that the sign of t matters.
override TILTED: bool = false;

// Number of nodes of the table along each axis, and that along x with tilted scales.
const STRAND_X: f32 = 40.0;
const TILTED_X: f32 = 159.0;
// Share of the steps along x that begin at the mirror cone, with tilted scales.
const CONE_SHARE: f32 = 0.75;
const STRAND_Y: f32 = 48.0;
const STRAND_Z: f32 = 128.0;
// Way along which hairs run from root to tip, in the space of the texture. Twin: ROOT_TO_TIP of
// src/light/strand/mod.rs.
const ROOT_TO_TIP: vec3<f32> = vec3<f32>(0.0, 1.0, -1.0);
// Weight w of the table's z axis.
const SINE_SHARE: f32 = 0.75;

struct Strand {
    // Constants of the table: k of its x axis, and v_R/2 of its texels.
    squeeze: f32,
    spread: f32,
    // Share of air in a cell with k_d = k_s.
    aeration: f32,
    // Mean cosine of the scattering angle at air bubbles.
    g: f32,
}

// Ψ = π·Φ of a cell with the coefficients k_d and k_s, in any common unit, from the cosines between unit
// vectors: t along the flow, l to the light, e to the eye.
fn strand_psi(
    table: texture_3d<f32>,
    linear: sampler,
    strand: Strand,
    k_d: f32,
    k_s: f32,
    t_dot_l: f32,
    t_dot_e: f32,
    l_dot_e: f32,
) -> vec3<f32> {
    let sisi = t_dot_l * t_dot_e;
    let coco = sqrt(max(1.0 - t_dot_l * t_dot_l, 0.0) * max(1.0 - t_dot_e * t_dot_e, 0.0));
    var s = sqrt(clamp((1.0 - coco + sisi) * 0.5, 0.0, 1.0));
    let cos_d = sqrt(clamp((1.0 + coco + sisi) * 0.5, 0.0, 1.0));
    let sin2_half_phi = clamp((coco + sisi - l_dot_e) / (2.0 * max(coco, 1e-6)), 0.0, 1.0);
    if TILTED {
        s = min(abs(t_dot_l + t_dot_e) / (2.0 * max(cos_d, 1e-6)), 1.0);
    }
    var x = s * (1.0 + strand.squeeze) / (s + strand.squeeze);
    var size = vec3<f32>(STRAND_X, STRAND_Y, STRAND_Z);
    var near = coco;
    if TILTED {
        near = cos_d * cos_d;
        let cos_h = sqrt(1.0 - s * s);
        x = CONE_SHARE * x + (1.0 - CONE_SHARE) * (1.0 - cos_h);
        x = 0.5 + 0.5 * select(x, -x, t_dot_l + t_dot_e < 0.0);
        size.x = TILTED_X;
    }
    let z = SINE_SHARE * sqrt(sin2_half_phi) + (1.0 - SINE_SHARE) * (1.0 - sqrt(1.0 - sin2_half_phi));
    let node = vec3<f32>(x, cos_d, z) * (size - 1.0);
    let texel = textureSampleLevel(table, linear, (node + 0.5) / size, 0.0).rgb;
    let strands = texel / sqrt(near + strand.spread);

    let k = k_d + k_s;
    let a = select(strand.aeration, clamp(strand.aeration * (2.0 * k_d / k), 0.0, 1.0), k > 0.0);
    let g = strand.g;
    let turn = max(1.0 + g * g + 2.0 * g * l_dot_e, 1e-6);
    let air = a * (0.25 * (1.0 - g * g)) / (turn * sqrt(turn));
    return strands * (1.0 - a) + air;
}
