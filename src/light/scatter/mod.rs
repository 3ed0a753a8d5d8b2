//! §5 beyond the paper: light that is scattered more than once in the volume.
//!
//! Radiance of a cell towards the eye, for one light of intensity I (irradiance/π), per colour:
//!
//! ```text
//! I·[ w·V·Ψ  +  w'·(P(z) + b'·V')  −  w·b·V  +  w·V·ω Σ_{n=2}^{6} h_n (ω τ_l)^(n−1)/(n−1)! ]
//! ```
//!
//! w = T(1 − e^(−τ)) is the cell's weight in the view ray, V = e^(−τ_l) what is left of the light there, Ψ =
//! ωπΦ the single scattering that is there without this module. The rest is light scattered twice and more:
//!
//! - **Similarity.** A phase function of mean cosine g passes the share g straight on, the rest in all
//!   directions alike (van de Hulst, "Multiple Light Scattering", 1980, chapter 14; Joseph, Wiscombe and
//!   Weinman 1976, with a delta peak of weight g). So the medium is replaced by one with isotropic
//!   scattering, extinction a = 1 − ωg times the true one and albedo ω' = ω(1 − g)/a. w' and V' are w and V
//!   at that extinction.
//! - **Slab.** Copies of the volume lie side by side, so on the large scale it is a slab. ω'/4 of its mean
//!   diffuse intensity is P, from the equation of Schwarzschild and Milne for the layers' mean optical depths
//!   ([`slab`]). It depends on the layer, the face that is lit and the light's cosine μ₀ alone: a small table
//!   ([`Profile`]).
//! - **Once is once.** b' = ω'/4 is the reduced medium's single scattering; b = ω(1 − g)/4, the isotropic
//!   part of the true one, is taken off again, for Ψ holds it (as in Nakajima and Tanaka 1988, TMS). With g =
//!   0 the two cancel.
//! - **Forward peak.** n scatterings by small angles make a phase function of mean cosine gⁿ (Goudsmit and
//!   Saunderson 1940; exact for Henyey and Greenstein's). What it has above its own isotropic part is
//!   h_n = max(0, π·Φ_HG(gⁿ, cosθ) − (1 − gⁿ)/4), summed up to six scatterings along the light's way.
//!
//! Why the *layers'* mean depths and not the depths along the cell's own line: scattered light comes from a
//! neighbourhood as wide as its free path, which is wider than the strands. Against a path tracer
//! (`tests/suite/scatter`) the local depths had 1.7 times the error. Attenuation series (Wrenninge, Kulla and
//! Lundqvist, "Oz: The Great and Volumetric", SIGGRAPH 2013) were wrong by a third of the light at best;
//! Zinke's dual scattering (2008) is made for fibres that scatter forward only, and knows nothing of a slab's
//! faces.
//!
//! `shaders/light/scatter.wgsl` is the twin of what works along a ray.

pub mod media;
pub mod slab;

use glam::Vec3;
use rayon::prelude::*;

use crate::trace::Attenuation;
use crate::volume::VolumeTexture;
use slab::Slab;

/// Rows of a [`Profile`] for one face: μ₀ = (i / (COSINES − 1))². The diffuse light bends like μ₀ ln μ₀ at
/// grazing incidence, so the rows are closer there.
pub const COSINES: u32 = 12;

/// Scatterings by small angles that are summed. The sixth still matters at g = 0.85, more change nothing.
pub const ORDERS: usize = 6;

/// How the matter scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattering {
    /// ω per colour, 0 to 1: the share of the light that is scattered and not absorbed.
    pub albedo: Vec3,
    /// Mean cosine of the scattering angle, −1 < g < 1. Backward scattering (g < 0) is taken as isotropic.
    pub g: f32,
}

/// The constants of the formula above that a scene has, per colour.
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
    /// g, not less than 0.
    pub g: f32,
}

impl Scattering {
    /// Its reduced medium.
    pub fn similarity(&self) -> Similarity {
        let g = self.g.max(0.0);
        let extinction = Vec3::ONE - self.albedo * g;
        let isotropic = self.albedo * (0.25 * (1.0 - g));
        Similarity { extinction, albedo: self.albedo, reduced: isotropic / extinction, isotropic, g }
    }

    /// That of Kajiya and Kay's fibres whose directions are spread evenly. Their model reflects more than it
    /// receives once π·k_d + … passes 1 (at the default k_d = ½ it is 1.6), and what gains light at every
    /// scattering has no end: the albedo is clamped to `most` < 1.
    ///
    /// Averages of Ψ/π over all fibres and all eyes; g from the specular cone, which sends light on
    /// by its angle with the fibre. Quadrature by midpoints, good to 1e-3.
    pub fn kajiya_kay(k_d: f32, k_s: f32, p: f32, most: f32) -> Scattering {
        const N: usize = 256;
        let angles = || (0..N).map(|i| (i as f64 + 0.5) * std::f64::consts::PI / N as f64);
        let step = std::f64::consts::PI / N as f64;
        let (mut sum, mut forward) = (0.0, 0.0);
        for l in angles() {
            for e in angles() {
                // −(t·l)(t·e) is what is left of −l·e after a turn around the fibre.
                let cone = (l.sin() * e.sin() - l.cos() * e.cos()).max(0.0).powf(p as f64);
                let psi = k_d as f64 * l.sin() + k_s as f64 * cone;
                let weight = psi * l.sin() * e.sin() * step * step;
                sum += weight;
                forward -= weight * l.cos() * e.cos();
            }
        }
        let g = if sum > 0.0 { forward / sum } else { 0.0 };
        Scattering { albedo: Vec3::splat((sum as f32).min(most)), g: g as f32 }
    }
}

/// Mean optical depth of each layer of a volume across the slab, seen side first. `depth_m` is the
/// thickness of a layer in metres (H / nz); with per-cell attenuation it is not asked for.
pub fn layer_depths(volume: &VolumeTexture, attenuation: &Attenuation, depth_m: f32) -> Vec<f64> {
    let [nx, ny, _] = volume.size.map(|n| n as usize);
    let whole = match *attenuation {
        Attenuation::PathLength { sigma } => sigma as f64 * depth_m as f64,
        Attenuation::PerCell { tau } => tau as f64,
    } * volume.alpha as f64;
    let mean = |codes: u64| whole * codes as f64 / (65535.0 * (nx * ny) as f64);
    volume.layer_codes().into_iter().map(mean).collect()
}

/// P: what the diffuse light of a slab gives to each layer, by the lit face, the light's cosine and the
/// layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Layers nz.
    pub layers: u32,
    /// (ω'/4)·4π·J_diffuse/E per colour (the fourth is 0), in units of the light's intensity I:
    /// layer fastest, then cosine, then face (0: lit from the seen side, 1: from behind). 2·[`COSINES`]·nz
    /// of them: 15 KiB for 40 layers.
    pub values: Vec<[f32; 4]>,
}

impl Profile {
    /// For layers of the optical depths `depths` (each ≥ 0), seen side first.
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
                // Equal colours are solved once.
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

    /// P of layer `z` for a light's row.
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

/// Where a light's values stand in a [`Profile`]: between two rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Index of the first layer's value at the row below μ₀.
    pub near: u32,
    /// At the row above.
    pub far: u32,
    /// From the one to the other, 0 to 1.
    pub share: f32,
}

impl Row {
    /// For a light whose direction has the cosine `l_n` with the seen face's normal; less than 0: it comes
    /// from behind. With per-cell attenuation a slanted line meets more cells instead of more metres:
    /// −z/(|x| + |y| + |z|) of the direction in cells takes the cosine's place.
    pub fn new(l_n: f32, layers: u32) -> Row {
        let place = l_n.abs().min(1.0).sqrt() * (COSINES - 1) as f32;
        let below = (place as u32).min(COSINES - 2);
        let face = if l_n < 0.0 { COSINES } else { 0 };
        let near = (face + below) * layers;
        Row { near, far: near + layers, share: place - below as f32 }
    }
}

/// h₂ … h₆ for one ray and light; `cos` is that of the scattering angle, −e·l.
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

/// What one cell sends to the eye of one light of I = 1, besides w·V·Ψ.
///
/// Depths are in powers of two (optical depth · log₂e, as the walk has them): `view` from the face to where
/// the ray enters the cell, `cell` inside it, `light` from its middle to the light. `diffuse` is P.
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
