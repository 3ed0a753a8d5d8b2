//! §5 The fibre reflection model and attenuation: physics only.
//!
//! Kajiya and Kay, "Rendering Fur with Three Dimensional Textures", SIGGRAPH 1989. Vectors point
//! outward from the cell. `shaders/shading.wgsl` holds the twin.

use glam::Vec3;

/// What a cell's direction is measured with: constant along one ray (method §3).
///
/// `world` frame: `metric` = JᵀJ and the vectors are Jᵀl, Jᵀe, so that the angles are those of
/// t = normalize(J v) in the world. `texture` frame: the identity, and J⁻¹l, J⁻¹e normalised.
/// JᵀJ is block-diagonal, for z is perpendicular to the face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metric {
    /// (M₀₀, 2·M₀₁, M₁₁, M₂₂).
    pub m: [f32; 4],
}

impl Metric {
    /// vᵀ M v.
    pub fn squared(&self, v: Vec3) -> f32 {
        let [m00, m01x2, m11, m22] = self.m;
        (m00 * v.x + m01x2 * v.y) * v.x + m11 * v.y * v.y + m22 * v.z * v.z
    }
}

/// sin(t,l) and the base of the specular term sin(t,l)·sin(t,e) − (t·l)(t·e), before clamping at 0.
/// `t_dot_l` = (J v)·l and `t_dot_e` are not normalised; `inverse_q` = 1 / |J v|².
pub fn fibre_angles(t_dot_l: f32, t_dot_e: f32, inverse_q: f32) -> (f32, f32) {
    let sin2_l = (1.0 - t_dot_l * t_dot_l * inverse_q).max(0.0);
    let sin2_e = (1.0 - t_dot_e * t_dot_e * inverse_q).max(0.0);
    (sin2_l.sqrt(), (sin2_l * sin2_e).sqrt() - t_dot_l * t_dot_e * inverse_q)
}

/// x^p for x ≥ 0: by repeated squaring where p is a whole number up to 255, for that is what the
/// shader is specialised to (it costs a third of `pow` there), else by `powf`.
pub fn specular_power(x: f32, p: f32) -> f32 {
    let Some(mut bits) = whole_exponent(p) else {
        return x.powf(p);
    };
    let (mut power, mut result) = (x, 1.0);
    while bits != 0 {
        if bits & 1 == 1 {
            result *= power;
        }
        power *= power;
        bits >>= 1;
    }
    result
}

/// p as the whole exponent that [`specular_power`] squares up to, if it is one.
pub fn whole_exponent(p: f32) -> Option<u32> {
    (p.fract() == 0.0 && (1.0..=255.0).contains(&p)).then_some(p as u32)
}

/// Ψ = k_d·sin(t,l) + k_s·max(0, sin(t,l)·sin(t,e) − (t·l)(t·e))^p.
pub fn psi(k_d: f32, k_s: f32, p: f32, t_dot_l: f32, t_dot_e: f32, inverse_q: f32) -> f32 {
    let (sin_l, base) = fibre_angles(t_dot_l, t_dot_e, inverse_q);
    k_d * sin_l + k_s * specular_power(base.max(0.0), p)
}
