//! §5, beyond the paper: multiple scattering of light in the volume.
//!
//! Radiance that a cell sends to the eye for one light of intensity I (irradiance/π), per colour:
//!
//! ```text
//! I·[ w·V·Ψ  +  G·( w'·(P(z) + b'·V')  −  w·b·V  +  w·V·ω Σ_{n=2}^{6} h_n (ω τ_l)^(n−1)/(n−1)! )  +  w·ω·F ]
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
//!   h_n = π·Φ_HG(gⁿ, cosθ) − (1 − gⁿ)/4, summed up to six scatterings along the light's path. Backwards it
//!   is negative; without that part the error at g = 0.7 was twice as large.
//! - **Flux.** The terms so far follow the strands, but their sum is not the flux of a slab. G(μ₀, μ) is the
//!   factor on it with which a homogeneous slab is exact, and F(μ₀, μ) the light scattered once that the
//!   centres of thick layers miss (`gain.rs`). What G multiplies counts as 0 where it is negative, in dark
//!   cells between bright ones.
//!
//! Mist is such a medium of its own, with g = 0 and four times its Ψ as the albedo.
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

pub mod doubling;
mod gain;
pub mod media;
pub mod optics;
pub mod shell;
pub mod slab;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::trace::Attenuation;
use crate::util::powers::exp2;
use crate::volume::VolumeTexture;
use gain::cosine_of_row;
use slab::Slab;

/// Number of rows of a [`Profile`] for one face; row i has μ₀ = (i / (COSINES − 1))². The diffuse light
/// behaves like μ₀ ln μ₀ at grazing incidence, so the rows are denser there.
pub const COSINES: u32 = 16;

/// Number of directions of the eye in the table of gains; its cosines are spread like the rows'.
pub const VIEWS: u32 = 12;

/// Maximum optical depth of a step in the mean of P over a layer, and the maximum number of steps.
const STEP: f64 = 0.05;
const MOST_STEPS: f64 = 32.0;

/// Cosine of the eye for which P is averaged over a layer. G makes up for all others.
const MEAN_VIEW: f64 = 0.5;

/// Maximum number of small-angle scatterings in the forward peak. The sixth still matters at g = 0.85; a
/// seventh changes nothing.
pub const ORDERS: usize = 6;

/// Scattering properties of the matter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattering {
    /// Albedo ω per colour, 0 to 1: the share of the light that is scattered, not absorbed.
    pub albedo: Vec3,
    /// Mean cosine of the scattering angle, −1 < g < 1. With g < 0 the reduced medium is isotropic, and only
    /// the gain knows of it.
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

    /// Scattering by mist, which is isotropic. Ψ = `psi` is ω/4; the paper's units allow more than the ¼ of
    /// white mist, and the excess then counts for light scattered once only.
    pub fn mist(psi: f32) -> Scattering {
        Scattering { albedo: Vec3::splat((4.0 * psi).min(1.0)), g: 0.0 }
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

/// Mean ρ of each layer of a volume, 0 to 1, starting at the seen side.
pub fn layer_means(volume: &VolumeTexture) -> Vec<f64> {
    let [nx, ny, _] = volume.size.map(|n| n as usize);
    let mean = |codes: u64| codes as f64 / (65535.0 * (nx * ny) as f64);
    volume.layer_codes().into_iter().map(mean).collect()
}

/// Optical depth across a layer of ρ = 1. `depth_m` is the thickness of a layer in metres (H / nz); per-cell
/// attenuation ignores it.
pub fn full_depth(volume: &VolumeTexture, attenuation: &Attenuation, depth_m: f32) -> f64 {
    let depth = match *attenuation {
        Attenuation::PathLength { sigma } => sigma as f64 * depth_m as f64,
        Attenuation::PerCell { tau } => tau as f64,
    };
    depth * volume.alpha as f64
}

/// Layers of a slab, starting at the seen side, as view rays and as light rays meet them.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    /// Optical depth of each layer (≥ 0).
    pub depths: Vec<f64>,
    /// Optical depth of each layer for light rays. It differs for mist alone, where it is even.
    pub lit: Vec<f64>,
    /// Share of its own depth that hides a cell's centre from the light, too much by this: ½ with per-cell
    /// attenuation, otherwise 0.
    pub own: f64,
}

impl Layers {
    /// Layers in which light and eye meet the same depths.
    pub fn new(depths: Vec<f64>) -> Self {
        Layers { lit: depths.clone(), depths, own: 0.0 }
    }

    /// Optical depth from the middle of layer `z` to a light of cosine `mu_0` on the seen side (`face` 0) or
    /// behind.
    fn depth_to_light(&self, face: usize, z: usize, mu_0: f64) -> f64 {
        let between = if face == 0 { &self.lit[..z] } else { &self.lit[z + 1..] };
        let middle = between.iter().sum::<f64>() + 0.5 * self.lit[z];
        (middle / mu_0 - self.own * self.lit[z]).max(0.0)
    }
}

/// Tables of a slab: P, the diffuse light by lit face, cosine of the light and layer, and the gains.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Number of layers nz.
    pub layers: u32,
    /// First P = (ω'/4)·4π·J_diffuse/E per colour, in units of the light's intensity I; the fourth component
    /// is 0. The layer varies fastest, then the cosine, then the face (0: lit from the seen side, 1: from
    /// behind). There are 2·[`COSINES`]·nz entries, 20 KiB for 40 layers.
    ///
    /// Then G per colour, and F as the fourth component. The eye varies fastest, then the light's cosine,
    /// then the face. There are 2·[`COSINES`]·[`VIEWS`] entries, 6 KiB.
    pub values: Vec<[f32; 4]>,
}

impl Profile {
    /// Tables of a slab of matter.
    pub fn new(layers: &Layers, scattering: &Scattering) -> Profile {
        let similarity = scattering.similarity();
        let count = layers.depths.len();
        let total: f64 = layers.depths.iter().sum();
        let twin = |c: usize| (0..c).find(|&d| similarity.albedo[d] == similarity.albedo[c]);
        let colours: Vec<(Vec<f64>, Vec<[f64; 2]>)> = (0..3)
            .into_par_iter()
            .map(|c| {
                // Equal colours share one solution.
                if twin(c).is_some() || similarity.albedo[c] <= 0.0 || total <= 1e-9 {
                    return Default::default();
                }
                let diffuse = diffuse(layers, &similarity, c);
                let gains = gain::Slab::new(layers, &similarity, scattering.g, c).gains(&diffuse);
                (diffuse, gains)
            })
            .collect();
        let mut values = vec![[0.0; 4]; (2 * COSINES * (count as u32 + VIEWS)) as usize];
        let (diffuse, gains) = values.split_at_mut(2 * COSINES as usize * count);
        for c in 0..3 {
            let colour = &colours[twin(c).unwrap_or(c)];
            diffuse.iter_mut().zip(&colour.0).for_each(|(value, new)| value[c] = *new as f32);
            for (value, [gain, fill]) in gains.iter_mut().zip(&colour.1) {
                value[c] = *gain as f32;
                // The fill is the same for all colours, but one that scatters nothing has none.
                value[3] = value[3].max(*fill as f32);
            }
        }
        Profile { layers: count as u32, values }
    }

    /// P of layer `z`, interpolated between a light's two rows.
    #[inline]
    pub fn at(&self, row: &Row, z: u32) -> Vec3 {
        let value = |first: u32| Vec4::from_array(self.values[(first + z) as usize]).truncate();
        let (near, far) = (value(row.near), value(row.far));
        near + (far - near) * row.share
    }

    /// G per colour and F, interpolated between the rows of the light and the columns of the eye, whose
    /// direction has the cosine `e_n` with the seen face's normal.
    pub fn gain(&self, row: &Row, e_n: f32) -> Vec4 {
        let position = e_n.abs().min(1.0).sqrt() * (VIEWS - 1) as f32;
        let below = (position as u32).min(VIEWS - 2);
        let share = position - below as f32;
        let value = |first: u32| {
            let first = (first + below) as usize;
            let [near, far] = [first, first + 1].map(|i| Vec4::from_array(self.values[i]));
            near + (far - near) * share
        };
        let (near, far) = (value(row.gain), value(row.gain + VIEWS));
        near + (far - near) * row.share
    }
}

/// P of colour `c`, by face, row and layer. It includes what the mean of b'·V' over a layer exceeds its value
/// at the middle.
fn diffuse(layers: &Layers, similarity: &Similarity, c: usize) -> Vec<f64> {
    let a = similarity.extinction[c] as f64;
    let reduced = similarity.reduced[c] as f64;
    let omega = (4.0 * reduced).min(1.0);
    let [count, rows] = [layers.depths.len(), COSINES as usize];
    let mu_0: Vec<f64> = (0..COSINES).map(cosine_of_row).collect();
    let total = layers.depths.iter().sum::<f64>() * a;
    let slab = Slab::new(total);
    let solved = slab.mean_intensity(omega, &mu_0);
    let mut out = vec![0.0; 2 * rows * count];
    let mut above = 0.0;
    for (z, depth) in layers.depths.iter().enumerate() {
        let depth = depth * a;
        let steps = (depth / STEP).ceil().clamp(1.0, MOST_STEPS);
        // Depths within the layer and their shares, as an eye at MEAN_VIEW weights them.
        let within = |i: usize| depth * (i as f64 + 0.5) / steps;
        let share = |i: usize| ((within(0) - within(i)) / MEAN_VIEW).exp();
        let shares: Vec<f64> = (0..steps as usize).map(share).collect();
        let whole: f64 = shares.iter().sum();
        let parts: Vec<(f64, f64)> =
            shares.iter().enumerate().map(|(i, share)| (above + within(i), share / whole)).collect();
        above += depth;
        let mut weights = vec![0.0; slab.boundaries.len() - 1];
        for (tau, share) in &parts {
            let part = slab.weights(tau.clamp(0.0, total));
            weights.iter_mut().zip(part).for_each(|(sum, weight)| *sum += weight * share);
        }
        for face in 0..2 {
            // Turned over, the slab is the same.
            for (row, (j, mu)) in solved.iter().zip(&mu_0).enumerate() {
                let sum: f64 = match face {
                    0 => weights.iter().zip(j).map(|(w, j)| w * j).sum(),
                    _ => weights.iter().rev().zip(j).map(|(w, j)| w * j).sum(),
                };
                let seen = |(tau, share): &(f64, f64)| {
                    let tau = if face == 0 { *tau } else { total - tau };
                    share * (-tau / mu).exp()
                };
                let middle = (-a * layers.depth_to_light(face, z, *mu)).exp();
                let missed = reduced * (parts.iter().map(seen).sum::<f64>() - middle).max(0.0);
                out[(face * rows + row) * count + z] = 0.25 * omega * omega * sum + missed;
            }
        }
    }
    out
}

/// Position of a light in a [`Profile`]: two rows and the share between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Index of the first layer's value in the row below μ₀.
    pub near: u32,
    /// Index of the first layer's value in the row above μ₀.
    pub far: u32,
    /// Index of the first gain in the row below μ₀.
    pub gain: u32,
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
        let row = if l_n < 0.0 { COSINES } else { 0 } + below;
        let near = row * layers;
        let gain = 2 * COSINES * layers + row * VIEWS;
        Row { near, far: near + layers, gain, share: position - below as f32 }
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
        0.25 * peak
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
    let passed = (similarity.extinction * -view).map(exp2);
    let weight_reduced = passed - (similarity.extinction * -(view + cell)).map(exp2);
    let seen_reduced = (similarity.extinction * -light).map(exp2);
    let once = exp2(-(view + light)) * (1.0 - exp2(-cell));
    let s = similarity.albedo * (light * std::f32::consts::LN_2);
    // Σ h_n s^(n−1)/(n−1)! by Horner's rule.
    let mut forward = Vec3::splat(peak[4] * 0.2);
    forward = (forward * s + peak[3]) * 0.25;
    forward = (forward * s + peak[2]) * (1.0 / 3.0);
    forward = (forward * s + peak[1]) * 0.5;
    forward = (forward * s + peak[0]) * s;
    let sum = weight_reduced * (diffuse + similarity.reduced * seen_reduced)
        + (similarity.albedo * forward - similarity.isotropic) * once;
    sum.max(Vec3::ZERO)
}
