//! §5 The fibre reflection model of Kajiya and Kay, "Rendering Fur with Three Dimensional Textures",
//! SIGGRAPH 1989.
//!
//! All vectors point outward from the cell. Twins: `shaders/light/fibre.wgsl`, and for [`Spread`]
//! `shaders/trace/lookup.wgsl`.
//!
//! The CPU engine does not call [`psi`]. It calls [`fibre_angles`] and [`specular_power`] for each cell in
//! `src/engine/cpu/integrate/walk.rs`.

use glam::Vec3;

use crate::util::powers::pow;
use crate::volume::Moments;

/// Metric in which a cell's direction v is measured, constant along one ray (§3).
///
/// - [`AngleFrame::World`](super::AngleFrame::World): M = JᵀJ, used with Jᵀl and Jᵀe. The angles are those of
///   t = normalize(J v) in the world. M is block-diagonal because z is perpendicular to the face.
/// - [`AngleFrame::Texture`](super::AngleFrame::Texture): M is the identity, used with the normalised J⁻¹l
///   and J⁻¹e.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metric {
    /// Entries of M: (M₀₀, 2·M₀₁, M₁₁, M₂₂).
    pub m: [f32; 4],
}

impl Metric {
    /// The identity.
    pub const IDENTITY: Metric = Metric { m: [1.0, 0.0, 1.0, 1.0] };

    /// Returns vᵀ M v.
    pub fn squared(&self, v: Vec3) -> f32 {
        let [m00, m01x2, m11, m22] = self.m;
        (m00 * v.x + m01x2 * v.y) * v.x + m11 * v.y * v.y + m22 * v.z * v.z
    }
}

/// Returns sin(t,l), and the base sin(t,l)·sin(t,e) − (t·l)(t·e) of the specular term, not yet clamped at 0.
///
/// `t_dot_l` = (J v)·l and `t_dot_e` = (J v)·e are not normalised; `inverse_q` = 1 / |J v|².
pub fn fibre_angles(t_dot_l: f32, t_dot_e: f32, inverse_q: f32) -> (f32, f32) {
    let sin2_l = (1.0 - t_dot_l * t_dot_l * inverse_q).max(0.0);
    let sin2_e = (1.0 - t_dot_e * t_dot_e * inverse_q).max(0.0);
    (sin2_l.sqrt(), (sin2_l * sin2_e).sqrt() - t_dot_l * t_dot_e * inverse_q)
}

/// Returns x^p for x ≥ 0.
///
/// A whole p from 1 to 255 is computed by repeated squaring, as the shader specialised to p does; there it
/// costs a third of `pow`.
pub fn specular_power(x: f32, p: f32) -> f32 {
    let Some(mut bits) = whole_exponent(p) else {
        return pow(x, p);
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

/// Returns p as an integer if [`specular_power`] computes it by repeated squaring.
pub fn whole_exponent(p: f32) -> Option<u32> {
    (p.fract() == 0.0 && (1.0..=255.0).contains(&p)).then_some(p as u32)
}

/// Reflection Ψ = k_d·sin(t,l) + k_s·max(0, sin(t,l)·sin(t,e) − (t·l)(t·e))^p. Arguments as in
/// [`fibre_angles`].
pub fn psi(k_d: f32, k_s: f32, p: f32, t_dot_l: f32, t_dot_e: f32, inverse_q: f32) -> f32 {
    let [diffuse, specular] = psi_parts([k_d, k_s], p, t_dot_l, t_dot_e, inverse_q);
    diffuse + specular
}

/// Returns the two summands of [`psi`], the diffuse one first.
pub fn psi_parts([k_d, k_s]: [f32; 2], p: f32, t_dot_l: f32, t_dot_e: f32, inverse_q: f32) -> [f32; 2] {
    let (sin_l, base) = fibre_angles(t_dot_l, t_dot_e, inverse_q);
    [k_d * sin_l, k_s * specular_power(base.max(0.0), p)]
}

/// Reflection by fibres with a distribution of directions, given by its second moments S = Σ w·v·vᵀ.
///
/// Squares and products of cosines of a single direction are replaced by their means over the distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// S·e / tr(M·S), with e the vector to the eye as [`Metric`] takes it.
    s_e: Vec3,
    moments: Moments,
    /// 1 / tr(M·S).
    inverse_q: f32,
    /// Mean of (t·e)².
    cos2_e: f32,
    variance: f32,
}

impl Spread {
    /// Prepares the terms that all lights of a ray share. `e_v` is Jᵀe, or the normalised J⁻¹e.
    pub fn new(metric: &Metric, moments: Moments, e_v: Vec3) -> Self {
        let [a, b2, c, d] = metric.m;
        let (s, m, b) = (moments.diagonal, moments.mixed, 0.5 * b2);
        // P = M·S. With t = J v, the matrix Σ w·t·tᵀ has the trace and the eigenvalues of P.
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

    /// Spread of the directions in the world: (1 − Σ λ²)/2 over the eigenvalues λ of Σ w·t·tᵀ, scaled to
    /// trace 1. For a narrow bundle it is the variance of the angle from the bundle's axis, in radians².
    pub fn variance(&self) -> f32 {
        self.variance
    }

    /// Means of (t·l)² and of (t·l)(t·e) over the distribution.
    pub fn cosines(&self, l_v: Vec3) -> [f32; 2] {
        [self.moments.times(l_v).dot(l_v) * self.inverse_q, self.s_e.dot(l_v)]
    }

    /// Returns t·l and t·e of a single direction with these means. The sign common to both is arbitrary.
    pub fn of_one(&self, l_v: Vec3) -> [f32; 2] {
        let [cos2_l, product] = self.cosines(l_v);
        let e = self.cos2_e.clamp(0.0, 1.0).sqrt();
        [cos2_l.clamp(0.0, 1.0).sqrt(), if product < 0.0 { -e } else { e }]
    }

    /// Returns the cosines of [`Spread::of_one`] with the sign by which the direction runs along `way`, a
    /// covector as `l_v`. The mean of v·(v·(l + e)) tells it.
    pub fn along(&self, [t_dot_l, t_dot_e]: [f32; 2], l_v: Vec3, way: Vec3) -> [f32; 2] {
        let mean = self.moments.times(l_v) * self.inverse_q + self.s_e;
        let is_against = (mean.dot(way) < 0.0) != (t_dot_l + t_dot_e < 0.0);
        if is_against { [-t_dot_l, -t_dot_e] } else { [t_dot_l, t_dot_e] }
    }

    /// Reflection Ψ, the sum of [`Spread::psi_parts`].
    pub fn psi(&self, k_d: f32, k_s: f32, p: f32, l_v: Vec3, l_dot_e: f32) -> f32 {
        let [diffuse, specular] = self.psi_parts([k_d, k_s], p, l_v, l_dot_e);
        diffuse + specular
    }

    /// Diffuse and specular part of the reflection Ψ, with the highlight convolved with the spread of the
    /// directions. `l_dot_e` is the cosine of the angle between light and eye.
    ///
    /// With x the cosine of an angle δ, x^p is about e^(−pδ²/2). Its convolution with a Gaussian of variance
    /// s² is the same function with the exponent p/(1 + p·s²), divided by √(1 + p·s²). δ is the sum of the
    /// angles that light and eye make with the plane across the flow. A turn of the flow's direction changes
    /// δ in proportion to the sum of the unit vectors of light and eye across the flow. That sum has the
    /// square 2 + 2 cos φ.
    pub fn psi_parts(&self, [k_d, k_s]: [f32; 2], p: f32, l_v: Vec3, l_dot_e: f32) -> [f32; 2] {
        let [cos2_l, product] = self.cosines(l_v);
        let sin2_l = (1.0 - cos2_l).max(0.0);
        let sin2_e = (1.0 - self.cos2_e).max(0.0);
        let root = (sin2_l * sin2_e).sqrt();
        let cos_phi = ((l_dot_e - product) / root.max(1e-6)).clamp(-1.0, 1.0);
        let variance = self.variance * (1.0 + cos_phi);
        // At the centre of the highlight the means are low by about half the variance. The convolution
        // accounts for the variance already, so it is added back here.
        let base = (root - product + 0.5 * variance).clamp(0.0, 1.0);
        let wide = 1.0 + p * variance;
        [k_d * sin2_l.sqrt(), k_s * pow(base, p / wide) / wide.sqrt()]
    }
}
