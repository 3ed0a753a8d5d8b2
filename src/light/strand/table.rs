//! Table of Ψ of a strand over three angles, for the renderers. `shaders/light/strand.wgsl` is the twin of
//! the lookup: the same operations in the same order.
//!
//! | axis | coordinate | nodes |
//! |---|---|---|
//! | x | S·(1 + k)/(S + k), S = sin(\|θ_i + θ_o\|/2), k = √v_R: starts at the mirror cone, with steps as fine as the cone is narrow | 40 |
//! | y | cos θ_d | 48 |
//! | z | w·sin(φ/2) + (1 − w)·(1 − cos(φ/2)): from the side of the light, where the rainbow is, to the far side | 128 |
//!
//! All three coordinates follow from the cosines between the directions by square roots and quotients alone.
//!
//! A texel holds Ψ·√(cos θ_i·cos θ_o + v_R/2). Near the mirror cone M is inversely proportional to that root,
//! within a factor of 1.8 over all inclinations. Without the factor the steps of y would be too coarse where
//! a strand is seen end on. Texels are linear RGB as `rgb9e5ufloat`, which software Vulkan filters in half
//! the time of float16.
//!
//! Where scales are tilted by α, x has the sign of θ_i + θ_o, which is that of sin θ_i + sin θ_o, and
//! [`TILTED_X`] nodes. k is √v_R + |sin α|, because the lobes stand beside the mirror cone. On the cone of
//! each of them M is inversely proportional to √(cos² θ_d + v_R/2), so that takes the place of the root
//! above.
//!
//! Against [`Strand::lobes`], over directions uniform on the sphere and near the mirror cone, the error in
//! units of Φ + 1/4π is at most 0.02 for the default roughnesses and 0.07 for the smallest ones. With scales
//! tilted by 3° the latter is 0.12, where light is sent back along the hair
//! (`tests/suite/light/strand/lookup.rs`).

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{PSI_PER_PHI, Strand, StrandParams, cell_aeration};
use crate::light::fibre::Spread;

/// Number of nodes along x, y and z.
pub const SIZE: [usize; 3] = [40, 48, 128];
/// Number of nodes along x where scales are tilted, for both signs.
pub const TILTED_X: usize = 159;
/// Share of the steps along x that begin at the mirror cone, where scales are tilted; the others are even in
/// the cosine of (θ_i + θ_o)/2, for light that they send back along the strand.
pub const CONE_SHARE: f32 = 0.75;
/// Weight w of the z axis. With w = 1 the steps of φ would grow without bound at the far side, with w = 0 at
/// the side of the light.
pub const SINE_SHARE: f32 = 0.75;
/// Exponent bits of the unit of a texel whose shared exponent is 0, 2^−24.
pub const UNIT_BITS: u32 = 127 - 24;
/// Number of cached tables, for a slider that moves back and forth or the scenes of a gallery.
const CACHED_TABLES: usize = 4;

/// Tabulated Ψ of the strands alone, without air.
pub struct StrandTable {
    key: StrandParams,
    /// Constant k of the x axis.
    pub squeeze: f32,
    /// v_R/2, with v_R the longitudinal variance of lobe R.
    pub spread: f32,
    /// Texels as `rgb9e5ufloat`; x runs fastest, then y.
    texels: Vec<u32>,
    moments: OnceLock<Moments>,
}

/// Means over all directions of light and eye, linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Albedo: share of the light that is scattered, 0 to 1.
    pub albedo: DVec3,
    /// Mean cosine of the scattering angle.
    pub mean_cosine: DVec3,
}

impl StrandTable {
    /// Table of a strand, taken from the cache or built.
    pub fn of(params: &StrandParams) -> Arc<StrandTable> {
        static CACHE: Mutex<Vec<Arc<StrandTable>>> = Mutex::new(Vec::new());
        let key = key(params);
        let mut cache = CACHE.lock().unwrap_or_else(PoisonError::into_inner);
        let table = match cache.iter().position(|t| t.key == key) {
            Some(i) => cache.remove(i),
            None => Arc::new(StrandTable::build(params)),
        };
        cache.insert(0, table.clone());
        cache.truncate(CACHED_TABLES);
        table
    }

    /// Builds the table of a strand, which does not depend on aeration.
    pub fn build(params: &StrandParams) -> StrandTable {
        let strand = Strand::new(params);
        let is_tilted = params.is_tilted();
        let [nx, ny, nz] = size(is_tilted);
        let node = |i: usize, n: usize| i as f64 / (n - 1) as f64;
        let squeeze = (strand.v[0].sqrt() + params.tilt.sin().abs()).min(1.0) as f32;
        let spread = (strand.v[0] / 2.0) as f32;
        let (k, half_v) = (squeeze as f64, spread as f64);
        let rows: Vec<_> = (0..ny)
            .into_par_iter()
            .map(|iy| {
                let cos_d = node(iy, ny);
                let around = strand.around(cos_d);
                let n: Vec<_> = (0..nz).map(|iz| around.at(azimuth_of(node(iz, nz)))).collect();
                let edges = if is_tilted { around.stray() } else { DVec3::ZERO };
                let m: Vec<_> = (0..nx)
                    .map(|ix| {
                        let x = node(ix, nx);
                        let s = if is_tilted { tilted_sine(2.0 * x - 1.0, k) } else { x * k / (1.0 + k - x) };
                        // Nodes with S > cos θ_d belong to no pair of directions. They repeat the edge, or go
                        // on beyond it where scales may turn a lobe there.
                        let coco = cos_d * cos_d - s * s;
                        let coco = if is_tilted { coco } else { coco.max(0.0) };
                        let sisi = coco - 1.0 + 2.0 * s * s;
                        let near = if is_tilted { cos_d * cos_d } else { coco };
                        let (half_sum, theta_d) = (s.asin(), cos_d.acos());
                        let (theta_i, theta_o) = (half_sum - theta_d, half_sum + theta_d);
                        let scale = |m: f64| m * PSI_PER_PHI * (near + half_v).sqrt();
                        let stray = edges * scale(strand.balance.stray(theta_i, theta_o));
                        (strand.along(theta_i, theta_o, coco, sisi).map(scale), stray)
                    })
                    .collect();
                (n, m)
            })
            .collect();
        let texels = (0..nz * ny)
            .into_par_iter()
            .flat_map_iter(|i| {
                let (n, m) = &rows[i % ny];
                let n = n[i / ny];
                m.iter().map(move |(m, stray)| {
                    let psi: DVec3 = (0..n.len()).map(|p| n[p] * m[p]).sum();
                    pack_rgb9e5((psi + *stray).as_vec3())
                })
            })
            .collect();
        let key = key(params);
        StrandTable { key, squeeze, spread, texels, moments: OnceLock::new() }
    }

    /// Whether the sign of t matters, because scales on the strands are tilted.
    pub fn is_tilted(&self) -> bool {
        self.key.is_tilted()
    }

    /// Number of nodes along x, y and z.
    pub fn size(&self) -> [usize; 3] {
        size(self.is_tilted())
    }

    /// Returns the texels as `rgb9e5ufloat`; x runs fastest, then y, then z.
    pub fn texels(&self) -> &[u32] {
        &self.texels
    }

    /// Reflection Ψ of the strands alone, from the cosines t·l, t·e and l·e between unit vectors.
    pub fn psi(&self, t_dot_l: f32, t_dot_e: f32, l_dot_e: f32) -> Vec3 {
        let sisi = t_dot_l * t_dot_e;
        let coco = ((1.0 - t_dot_l * t_dot_l).max(0.0) * (1.0 - t_dot_e * t_dot_e).max(0.0)).sqrt();
        let mut s = ((1.0 - coco + sisi) * 0.5).clamp(0.0, 1.0).sqrt();
        let cos_d = ((1.0 + coco + sisi) * 0.5).clamp(0.0, 1.0).sqrt();
        let sin2_half_phi = ((coco + sisi - l_dot_e) / (2.0 * coco.max(1e-6))).clamp(0.0, 1.0);
        if self.is_tilted() {
            // Beside the cone the root above has few digits, which would decide on the side.
            s = ((t_dot_l + t_dot_e).abs() / (2.0 * cos_d.max(1e-6))).min(1.0);
        }
        let mut x = s * (1.0 + self.squeeze) / (s + self.squeeze);
        if self.is_tilted() {
            let cos_h = (1.0 - s * s).sqrt();
            x = CONE_SHARE * x + (1.0 - CONE_SHARE) * (1.0 - cos_h);
            x = 0.5 + 0.5 * if t_dot_l + t_dot_e < 0.0 { -x } else { x };
        }
        let z = SINE_SHARE * sin2_half_phi.sqrt() + (1.0 - SINE_SHARE) * (1.0 - (1.0 - sin2_half_phi).sqrt());
        let near = if self.is_tilted() { cos_d * cos_d } else { coco };
        self.sample(Vec3::new(x, cos_d, z)) / (near + self.spread).sqrt()
    }

    /// Trilinear interpolation at coordinates from 0 to 1, as a texture sampler does it.
    fn sample(&self, position: Vec3) -> Vec3 {
        let [nx, ny, nz] = self.size();
        let split = |x: f32, n: usize| {
            let x = x * (n - 1) as f32;
            let i = (x as usize).min(n - 2);
            (i, x - i as f32)
        };
        let (ix, fx) = split(position.x, nx);
        let (iy, fy) = split(position.y, ny);
        let (iz, fz) = split(position.z, nz);
        let texel = |i: usize| unpack_rgb9e5(self.texels[i]);
        let along_x = |i: usize| texel(i).lerp(texel(i + 1), fx);
        let along_y = |i: usize| along_x(i).lerp(along_x(i + nx), fy);
        let i = (iz * ny + iy) * nx + ix;
        along_y(i).lerp(along_y(i + nx * ny), fz)
    }

    /// Albedo and mean cosine of the strands alone, integrated over the table.
    pub fn moments(&self) -> Moments {
        *self.moments.get_or_init(|| self.quadrature())
    }

    fn quadrature(&self) -> Moments {
        use std::f64::consts::{FRAC_PI_2, PI};
        const THETA: usize = 160;
        const PHI: usize = 64;
        let step = PI / THETA as f64;
        let theta = |i: usize| (i as f64 + 0.5) * step - FRAC_PI_2;
        let weight = |i: usize| (theta(i) + 0.5 * step).sin() - (theta(i) - 0.5 * step).sin();
        let cos_phi: Vec<f64> = (0..PHI).map(|i| ((i as f64 + 0.5) * PI / PHI as f64).cos()).collect();
        // Where reversing t changes nothing, light from one side is enough.
        let first = if self.is_tilted() { 0 } else { THETA / 2 };
        let (albedo, cosine) = (first..THETA)
            .into_par_iter()
            .map(|i| {
                let (sin_i, cos_i) = theta(i).sin_cos();
                let (mut albedo, mut cosine) = (DVec3::ZERO, DVec3::ZERO);
                for o in 0..THETA {
                    let (sin_o, cos_o) = theta(o).sin_cos();
                    for cos_phi in &cos_phi {
                        let l_dot_e = sin_i * sin_o + cos_i * cos_o * cos_phi;
                        let psi = self.psi(sin_i as f32, sin_o as f32, l_dot_e as f32).as_dvec3();
                        albedo += psi * (weight(i) * weight(o));
                        cosine -= psi * (weight(i) * weight(o) * l_dot_e);
                    }
                }
                (albedo, cosine)
            })
            .collect::<Vec<_>>()
            .into_iter()
            .fold((DVec3::ZERO, DVec3::ZERO), |a, b| (a.0 + b.0, a.1 + b.1));
        let per_direction = if self.is_tilted() { 1.0 } else { 2.0 } / PHI as f64;
        // The bound keeps the table's error from adding energy.
        Moments { albedo: (albedo * per_direction).min(DVec3::ONE), mean_cosine: cosine / albedo }
    }
}

/// Sine of (θ_i + θ_o)/2 at the coordinate x from −1 to 1 of the x axis where scales are tilted.
fn tilted_sine(x: f64, k: f64) -> f64 {
    let share = CONE_SHARE as f64;
    let at = |s: f64| share * s * (1.0 + k) / (s + k) + (1.0 - share) * (1.0 - (1.0 - s * s).sqrt());
    // The coordinate grows with the sine.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at(middle) < x.abs() {
            low = middle;
        } else {
            high = middle;
        }
    }
    (0.5 * (low + high)).copysign(x)
}

/// Angle φ, in radians, at the coordinate z from 0 to 1 of the z axis.
fn azimuth_of(z: f64) -> f64 {
    let (w, rest) = (SINE_SHARE as f64, 1.0 - SINE_SHARE as f64);
    2.0 * (rest.atan2(w) + ((z - rest) / w.hypot(rest)).clamp(-1.0, 1.0).asin())
}

/// Packs three numbers from 0 to 65408 into 9 bits each with a shared exponent of 5 bits (the OpenGL
/// extension EXT_texture_shared_exponent). The error is at most 0.2 % of the largest number.
fn pack_rgb9e5(rgb: Vec3) -> u32 {
    let rgb = rgb.clamp(Vec3::ZERO, Vec3::splat(65408.0));
    let largest = rgb.max_element();
    let mut exponent = ((largest.to_bits() >> 23) as i32 - 127 + 16).max(0);
    if (largest * unit(-exponent)).round() >= 512.0 {
        exponent += 1;
    }
    let [r, g, b] = (rgb * unit(-exponent)).to_array().map(|c| c.round() as u32);
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

fn unpack_rgb9e5(word: u32) -> Vec3 {
    let bits = |shift: u32| (word >> shift & 0x1ff) as f32;
    Vec3::new(bits(0), bits(9), bits(18)) * f32::from_bits(((word >> 27) + UNIT_BITS) << 23)
}

/// Factor 2^(24 + e), exact, that scales a number with the shared exponent −e to a 9-bit integer.
fn unit(e: i32) -> f32 {
    ((24 + e) as f32).exp2()
}

/// Number of nodes along x, y and z, for strands with tilted scales or without.
fn size(is_tilted: bool) -> [usize; 3] {
    let [nx, ny, nz] = SIZE;
    [if is_tilted { TILTED_X } else { nx }, ny, nz]
}

/// Properties that the table depends on: all but the air.
fn key(params: &StrandParams) -> StrandParams {
    StrandParams { aeration: 0.0, g: 0.0, ..*params }
}

/// Complete model as the renderers evaluate it: strands from the table, and air.
pub struct StrandShading {
    /// Table of the strands.
    pub table: Arc<StrandTable>,
    /// Share of air in a cell with k_d = k_s.
    pub aeration: f32,
    /// Mean cosine of the scattering angle at air bubbles.
    pub g: f32,
}

impl StrandShading {
    /// Model of a strand with these properties.
    pub fn new(params: &StrandParams) -> Self {
        StrandShading { table: StrandTable::of(params), aeration: params.aeration, g: params.g }
    }

    /// Cosines t·l and t·e of the single direction t that stands for those of `spread`, given the direction
    /// to the light and the way from root to tip ([`ROOT_TO_TIP`](super::ROOT_TO_TIP)) as the spread takes
    /// them.
    pub fn cosines(&self, spread: &Spread, l_v: Vec3, way: Vec3) -> [f32; 2] {
        let cosines = spread.of_one(l_v);
        if self.table.is_tilted() { spread.along(cosines, l_v, way) } else { cosines }
    }

    /// Reflection Ψ = π·Φ of a cell with the coefficients k_d and k_s, in any common unit, from the cosines
    /// between unit vectors.
    pub fn psi(&self, k_d: f32, k_s: f32, t_dot_l: f32, t_dot_e: f32, l_dot_e: f32) -> Vec3 {
        let a = cell_aeration(self.aeration, k_d, k_s);
        let g = self.g;
        // The scattering angle has the cosine −l·e.
        let x = (1.0 + g * g + 2.0 * g * l_dot_e).max(1e-6);
        let air = a * (0.25 * (1.0 - g * g)) / (x * x.sqrt());
        self.table.psi(t_dot_l, t_dot_e, l_dot_e) * (1.0 - a) + Vec3::splat(air)
    }

    /// Albedo and mean cosine of strands and air together, in a cell with k_d = k_s.
    pub fn moments(&self) -> Moments {
        let strand = self.table.moments();
        let (a, g) = (self.aeration as f64, self.g as f64);
        let albedo = strand.albedo * (1.0 - a) + DVec3::splat(a);
        let cosine = strand.albedo * strand.mean_cosine * (1.0 - a) + DVec3::splat(a * g);
        Moments { albedo, mean_cosine: cosine / albedo }
    }
}
