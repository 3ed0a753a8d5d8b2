//! §5, beyond the paper: multiple scattering of light in the volume.
//!
//! Radiance that a cell sends to the eye for one light of intensity I (irradiance/π), per colour:
//!
//! ```text
//! I·[ w·V·Ψ  +  w'·(P(z) + b'·V')  −  w·b·V  +  w·V·ω Σ_{n=2}^{6} h_n (ω τ_l)^(n−1)/(n−1)! ]
//! ```
//!
//! w = T(1 − e^(−τ)) is the cell's weight in the view ray. V = e^(−τ_l) is the light's transmittance to the
//! cell. Ψ = ωπΦ is single scattering, which the program computes without this module too. The other terms
//! add light that scatters twice or more:
//!
//! - **Similarity.** A phase function of mean cosine g passes the share g straight on and scatters the rest
//!   isotropically (van de Hulst, "Multiple Light Scattering", 1980, chapter 14; Joseph, Wiscombe and Weinman
//!   1976, with a delta peak of weight g). The medium is therefore replaced by a reduced one with isotropic
//!   scattering, a = 1 − ωg times the extinction, and albedo ω' = ω(1 − g)/a. w' and V' are w and V in the
//!   reduced medium.
//! - **Slab.** Copies of the volume lie side by side, so on a large scale the volume is a slab. P is ω'/4 of
//!   the slab's mean diffuse intensity, from the equation of Schwarzschild and Milne for the layers' mean
//!   optical depths ([`slab`]). P depends only on the layer, the lit face and the light's cosine μ₀, so a
//!   small table holds it ([`Profile`]).
//! - **Single scattering counts once.** b' = ω'/4 is the reduced medium's single scattering. b = ω(1 − g)/4
//!   is the isotropic part of the true single scattering; it is subtracted because Ψ contains it (as in
//!   Nakajima and Tanaka 1988, TMS). With g = 0 the two cancel.
//! - **Forward peak.** n scatterings by small angles have a phase function of mean cosine gⁿ (Goudsmit and
//!   Saunderson 1940; exact for Henyey and Greenstein's function). Its excess over its own isotropic part is
//!   h_n = max(0, π·Φ_HG(gⁿ, cosθ) − (1 − gⁿ)/4), summed up to six scatterings along the light's path.
//!
//! P uses the mean depths of the layers, not the depths along the cell's own line, because scattered light
//! comes from a neighbourhood as wide as its free path, which is wider than the strands. Against a path
//! tracer (`tests/suite/light/scatter`) the local depths had 1.7 times the error. Attenuation series
//! (Wrenninge, Kulla and Lundqvist, "Oz: The Great and Volumetric", SIGGRAPH 2013) were wrong by at least a
//! third of the light. Zinke's dual scattering (2008) is made for fibres that scatter forward only, and
//! ignores the faces of a slab.
//!
//! `shaders/light/scatter.wgsl` is the twin of [`Row::new`], [`Profile::at`], [`forward_peak`] and
//! [`multiple`].

pub mod media;
pub mod slab;

use glam::Vec3;
use rayon::prelude::*;

use crate::trace::Attenuation;
use crate::volume::VolumeTexture;
use slab::Slab;

/// Number of rows of a [`Profile`] for one face; row i has μ₀ = (i / (COSINES − 1))². The diffuse light
/// behaves like μ₀ ln μ₀ at grazing incidence, so the rows are denser there.
pub const COSINES: u32 = 12;

/// Maximum number of small-angle scatterings in the forward peak. The sixth still matters at g = 0.85; a
/// seventh changes nothing.
pub const ORDERS: usize = 6;

/// Scattering properties of the matter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattering {
    /// Albedo ω per colour, 0 to 1: the share of the light that is scattered, not absorbed.
    pub albedo: Vec3,
    /// Mean cosine of the scattering angle, −1 < g < 1. Backward scattering (g < 0) is treated as isotropic.
    pub g: f32,
}

/// Constants of the reduced medium, per colour; the module's formula defines the symbols.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// a = 1 − ωg.
    pub extinction: Vec3,
    /// ω.
    pub albedo: Vec3,
    /// b' = ω'/4.
    pub reduced: Vec3,
    /// b = ω(1 − g)/4.
    pub isotropic: Vec3,
    /// Mean cosine g of the scattering angle, at least 0.
    pub g: f32,
}

impl Scattering {
    /// Reduced medium of this scattering.
    pub fn similarity(&self) -> Similarity {
        let g = self.g.max(0.0);
        let extinction = Vec3::ONE - self.albedo * g;
        let isotropic = self.albedo * (0.25 * (1.0 - g));
        Similarity { extinction, albedo: self.albedo, reduced: isotropic / extinction, isotropic, g }
    }

    /// Scattering by Kajiya and Kay's fibres with uniformly distributed directions.
    ///
    /// The albedo is the mean of Ψ/π over all fibres and all eyes. g comes from the specular cone, which
    /// keeps the light's angle with the fibre. Both are integrated by the midpoint rule, with an error of
    /// 1e-3.
    ///
    /// The model reflects more light than it receives once π·k_d + … exceeds 1; at the default k_d = ½ it is
    /// 1.6. A medium that gains light at every scattering has no finite solution, so the albedo is clamped to
    /// `max_albedo` < 1.
    pub fn kajiya_kay(k_d: f32, k_s: f32, p: f32, max_albedo: f32) -> Scattering {
        const N: usize = 256;
        let angles = || (0..N).map(|i| (i as f64 + 0.5) * std::f64::consts::PI / N as f64);
        let step = std::f64::consts::PI / N as f64;
        let (mut sum, mut forward) = (0.0, 0.0);
        for l in angles() {
            for e in angles() {
                // The mean of −l·e over a turn around the fibre is −(t·l)(t·e).
                let cone = (l.sin() * e.sin() - l.cos() * e.cos()).max(0.0).powf(p as f64);
                let psi = k_d as f64 * l.sin() + k_s as f64 * cone;
                let weight = psi * l.sin() * e.sin() * step * step;
                sum += weight;
                forward -= weight * l.cos() * e.cos();
            }
        }
        let g = if sum > 0.0 { forward / sum } else { 0.0 };
        Scattering { albedo: Vec3::splat((sum as f32).min(max_albedo)), g: g as f32 }
    }
}

/// Mean optical depth of each layer of a volume across the slab, starting at the seen side. `depth_m` is the
/// thickness of a layer in metres (H / nz); per-cell attenuation ignores it.
pub fn layer_depths(volume: &VolumeTexture, attenuation: &Attenuation, depth_m: f32) -> Vec<f64> {
    let [nx, ny, _] = volume.size.map(|n| n as usize);
    let full_depth = match *attenuation {
        Attenuation::PathLength { sigma } => sigma as f64 * depth_m as f64,
        Attenuation::PerCell { tau } => tau as f64,
    } * volume.alpha as f64;
    let mean = |codes: u64| full_depth * codes as f64 / (65535.0 * (nx * ny) as f64);
    volume.layer_codes().into_iter().map(mean).collect()
}

/// Table of P, the diffuse light of a slab, by lit face, cosine of the light and layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Number of layers nz.
    pub layers: u32,
    /// (ω'/4)·4π·J_diffuse/E per colour, in units of the light's intensity I; the fourth component is 0.
    ///
    /// The layer varies fastest, then the cosine, then the face (0: lit from the seen side, 1: from behind).
    /// There are 2·[`COSINES`]·nz entries, 15 KiB for 40 layers.
    pub values: Vec<[f32; 4]>,
}

impl Profile {
    /// Profile of a slab whose layers have the optical depths `depths` (each ≥ 0), starting at the seen side.
    pub fn new(depths: &[f64], scattering: &Scattering) -> Profile {
        let layers = depths.len();
        let similarity = scattering.similarity();
        let rows = COSINES as usize;
        let mut values = vec![[0.0; 4]; 2 * rows * layers];
        let mu_0: Vec<f64> = (1..rows).map(|i| (i as f64 / (rows - 1) as f64).powi(2)).collect();
        let colours: Vec<Vec<f64>> = (0..3)
            .into_par_iter()
            .map(|c| {
                let a = similarity.extinction[c] as f64;
                let omega = 4.0 * similarity.reduced[c] as f64;
                // Equal colours share one solution.
                let twin = (0..c).any(|d| similarity.albedo[d] == similarity.albedo[c]);
                let total: f64 = depths.iter().sum::<f64>() * a;
                if twin || omega <= 0.0 || total <= 1e-9 {
                    return Vec::new();
                }
                let slab = Slab::new(total);
                let solved = slab.mean_intensity(omega.min(1.0), &mu_0);
                let mut out = vec![0.0; 2 * rows * layers];
                let mut above = 0.0;
                for (z, depth) in depths.iter().enumerate() {
                    let middle = (above + 0.5 * depth) * a;
                    above += depth;
                    for (face, tau) in [middle, total - middle].into_iter().enumerate() {
                        let weights = slab.weights(tau.clamp(0.0, total));
                        for (row, j) in solved.iter().enumerate() {
                            let sum: f64 = weights.iter().zip(j).map(|(w, j)| w * j).sum();
                            out[(face * rows + row + 1) * layers + z] = 0.25 * omega * omega * sum;
                        }
                    }
                }
                out
            })
            .collect();
        for c in 0..3 {
            let source = (0..c).find(|&d| similarity.albedo[d] == similarity.albedo[c]).unwrap_or(c);
            for (value, new) in values.iter_mut().zip(&colours[source]) {
                value[c] = *new as f32;
            }
        }
        Profile { layers: layers as u32, values }
    }

    /// P of layer `z`, interpolated between a light's two rows.
    #[inline]
    pub fn at(&self, row: &Row, z: u32) -> Vec3 {
        let value = |first: u32| {
            let [r, g, b, _] = self.values[(first + z) as usize];
            Vec3::new(r, g, b)
        };
        let (near, far) = (value(row.near), value(row.far));
        near + (far - near) * row.share
    }
}

/// Position of a light in a [`Profile`]: two rows and the share between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Index of the first layer's value in the row below μ₀.
    pub near: u32,
    /// Index of the first layer's value in the row above μ₀.
    pub far: u32,
    /// Share of the row above, 0 to 1.
    pub share: f32,
}

impl Row {
    /// Position of a light whose direction has the cosine `l_n` with the seen face's normal. The light comes
    /// from behind if `l_n` is negative.
    ///
    /// With per-cell attenuation a slanted line meets more cells instead of more metres, so the caller passes
    /// −z/(|x| + |y| + |z|) of the direction in cells in place of the cosine.
    pub fn new(l_n: f32, layers: u32) -> Row {
        let position = l_n.abs().min(1.0).sqrt() * (COSINES - 1) as f32;
        let below = (position as u32).min(COSINES - 2);
        let face = if l_n < 0.0 { COSINES } else { 0 };
        let near = (face + below) * layers;
        Row { near, far: near + layers, share: position - below as f32 }
    }
}

/// Forward peak h₂ … h₆ for one ray and light. `cos` is the cosine −e·l of the scattering angle.
pub fn forward_peak(g: f32, cos: f32) -> [f32; ORDERS - 1] {
    let mut power = g;
    std::array::from_fn(|_| {
        power *= g;
        let s = 1.0 + power * power - 2.0 * power * cos;
        // π·Φ_HG = (1 − g²) / (4 s^1.5).
        let peak = (1.0 - power * power) / (s * s.sqrt()) - (1.0 - power);
        0.25 * peak.max(0.0)
    })
}

/// Radiance that a cell sends to the eye for a light of I = 1, without the single scattering w·V·Ψ.
///
/// Depths are in bits (optical depth · log₂e), as the walk computes them: `view` from the face to the point
/// where the ray enters the cell, `cell` inside the cell, `light` from the cell's centre to the light.
/// `diffuse` is P.
#[inline]
pub fn multiple(
    similarity: &Similarity,
    peak: &[f32; ORDERS - 1],
    diffuse: Vec3,
    view: f32,
    cell: f32,
    light: f32,
) -> Vec3 {
    let exp2 = |v: Vec3| Vec3::new(v.x.exp2(), v.y.exp2(), v.z.exp2());
    let passed = exp2(similarity.extinction * -view);
    let weight_reduced = passed - exp2(similarity.extinction * -(view + cell));
    let seen_reduced = exp2(similarity.extinction * -light);
    let once = (-(view + light)).exp2() * (1.0 - (-cell).exp2());
    let s = similarity.albedo * (light * std::f32::consts::LN_2);
    // Σ h_n s^(n−1)/(n−1)! by Horner's rule.
    let mut forward = Vec3::splat(peak[4] * 0.2);
    forward = (forward * s + peak[3]) * 0.25;
    forward = (forward * s + peak[2]) * (1.0 / 3.0);
    forward = (forward * s + peak[1]) * 0.5;
    forward = (forward * s + peak[0]) * s;
    weight_reduced * (diffuse + similarity.reduced * seen_reduced)
        + (similarity.albedo * forward - similarity.isotropic) * once
}
