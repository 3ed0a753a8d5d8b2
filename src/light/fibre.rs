//! §5 The fibre reflection model and attenuation: physics only.
//!
//! Kajiya and Kay, "Rendering Fur with Three Dimensional Textures", SIGGRAPH 1989. Vectors point
//! outward from the cell. Twin: `shaders/light/fibre.wgsl`.

use glam::Vec3;

use crate::volume::Moments;

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

/// Light reflected by fibres of many directions, whose moments are S = Σ w·v·vᵀ: what one direction has as
/// squares and products of cosines the moments have as means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// S·e / tr(M·S), with the eye as for one direction.
    s_e: Vec3,
    moments: Moments,
    inverse_q: f32,
    /// Mean of (t·e)².
    cos2_e: f32,
    variance: f32,
}

impl Spread {
    /// Moments as seen by a ray.
    pub fn new(metric: &Metric, moments: Moments, e_v: Vec3) -> Self {
        let [a, b2, c, d] = metric.m;
        let (s, m, b) = (moments.diagonal, moments.mixed, 0.5 * b2);
        // P = M·S; t = J v, so that Σ w·t·tᵀ has the trace and the eigenvalues of P.
        let p = [
            Vec3::new(a * s.x + b * m.x, a * m.x + b * s.y, a * m.y + b * m.z),
            Vec3::new(b * s.x + c * m.x, b * m.x + c * s.y, b * m.y + c * m.z),
            Vec3::new(d * m.y, d * m.z, d * s.z),
        ];
        let inverse_q = 1.0 / (p[0].x + p[1].y + p[2].z).max(1e-30);
        let crossed = p[0].y * p[1].x + p[0].z * p[2].x + p[1].z * p[2].y;
        let squares = p[0].x * p[0].x + p[1].y * p[1].y + p[2].z * p[2].z + 2.0 * crossed;
        let s_e = moments.times(e_v) * inverse_q;
        Spread {
            s_e,
            moments,
            inverse_q,
            cos2_e: s_e.dot(e_v),
            variance: (0.5 - 0.5 * squares * inverse_q * inverse_q).max(0.0),
        }
    }

    /// How far directions part in the world: (1 − Σ λ²)/2 over the eigenvalues λ of Σ w·t·tᵀ; for a narrow
    /// bundle the variance of their angle from its axis, in radians squared.
    pub fn variance(&self) -> f32 {
        self.variance
    }

    /// Mean of (t·l)², and of (t·l)(t·e).
    pub fn cosines(&self, l_v: Vec3) -> [f32; 2] {
        [self.moments.times(l_v).dot(l_v) * self.inverse_q, self.s_e.dot(l_v)]
    }

    /// t·l and t·e of the one direction that would have these means, but for the sign of both.
    pub fn of_one(&self, l_v: Vec3) -> [f32; 2] {
        let [cos2_l, product] = self.cosines(l_v);
        let e = self.cos2_e.clamp(0.0, 1.0).sqrt();
        [cos2_l.clamp(0.0, 1.0).sqrt(), if product < 0.0 { -e } else { e }]
    }

    /// Ψ: the highlight is folded with the directions' spread. `l_dot_e` is the cosine between light and eye.
    ///
    /// x^p, with x the cosine of an angle δ, is about e^(−pδ²/2); folded with a Gaussian of variance s² it is
    /// that of p/(1 + p·s²), lower by the root. δ is the sum of the angles that light and eye make with the
    /// flow; it turns with the direction by the sum of their unit vectors across the flow, whose square
    /// is 2 + 2 cos φ.
    pub fn psi(&self, k_d: f32, k_s: f32, p: f32, l_v: Vec3, l_dot_e: f32) -> f32 {
        let [cos2_l, product] = self.cosines(l_v);
        let sin2_l = (1.0 - cos2_l).max(0.0);
        let sin2_e = (1.0 - self.cos2_e).max(0.0);
        let root = (sin2_l * sin2_e).sqrt();
        let cos_phi = ((l_dot_e - product) / root.max(1e-6)).clamp(-1.0, 1.0);
        let variance = self.variance * (1.0 + cos_phi);
        // The means have lost about half the variance at the highlight's middle, which the folding counts.
        let base = (root - product + 0.5 * variance).clamp(0.0, 1.0);
        let wide = 1.0 + p * variance;
        k_d * sin2_l.sqrt() + k_s * base.powf(p / wide) / wide.sqrt()
    }
}
