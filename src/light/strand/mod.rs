//! §5, beyond the paper: a reflection model for flowing water. Every cell of the volume holds strands of
//! water along the flow, with air between them.
//!
//! A strand is a dielectric cylinder along the cell's direction t. Light that meets it leaves by reflection
//! (R), by transmission (TT), after one internal reflection (TRT, which makes the rainbow) or after several.
//! The sum is a phase function
//!
//! Φ(l→e) = b(θ_i)·b(θ_o)·Σ_p M_p(θ_i, θ_o)·N_p(θ_d, φ),   θ_d = (θ_o − θ_i)/2
//!
//! in 1/sr. Its integral over all directions is the albedo, which is 1 without absorption. The vectors l and
//! e point outward; sin θ_i = t·l, sin θ_o = t·e, and φ is the angle between l and e around t. Φ does not
//! change when l and e are exchanged, when t is reversed, or for φ → −φ.
//!
//! The sum over lobes follows Marschner, Jensen, Cammarano, Worley and Hanrahan, "Light Scattering from Human
//! Hair Fibers", SIGGRAPH 2003. [`longitudinal`] follows d'Eon et al. 2011 and [`azimuthal`] Chiang et al.
//! 2016. [`cylinder`] and [`absorption`] describe water, and [`balance`] conserves energy. The air has a
//! Henyey–Greenstein phase function (1941), mixed in by the cell's own coefficients. [`table`] tabulates the
//! model for the renderers.
//!
//! Intensities are irradiance over π, so Ψ = π·Φ takes the place of the fibre model's Ψ.

pub mod absorption;
pub mod azimuthal;
pub mod balance;
pub mod cylinder;
pub mod longitudinal;
pub mod table;

use std::f64::consts::{FRAC_1_PI, PI};

use glam::DVec3;

use azimuthal::{Azimuth, logistic_scale};
use balance::Balance;
use cylinder::{ETA, LOBES};

/// Properties of a strand of water.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrandParams {
    /// Radius of the cylinder, metres.
    pub radius_m: f32,
    /// Roughness along the strand, β_m, 0.1 to 1.
    pub roughness_m: f32,
    /// Roughness around the strand, β_n, 0.1 to 1.
    pub roughness_n: f32,
    /// Absorption as a multiple of pure water's.
    pub absorption: f32,
    /// Share of the light that meets air bubbles instead of strands in a cell with k_d = k_s, 0 to 1.
    pub aeration: f32,
    /// Mean cosine of the scattering angle at air bubbles, −0.99 to 0.99.
    pub g: f32,
}

impl Default for StrandParams {
    fn default() -> Self {
        StrandParams {
            radius_m: 5e-4,
            roughness_m: 0.3,
            roughness_n: 0.2,
            absorption: 1.0,
            aeration: 0.5,
            g: 0.8,
        }
    }
}

impl StrandParams {
    /// Optical depth σ_a · 2r of a diameter, linear RGB.
    pub fn depth(&self) -> DVec3 {
        absorption::pure_water() * (2.0 * self.radius_m as f64 * self.absorption as f64)
    }
}

/// Values of the lobes for one pair of directions, 1/sr, linear RGB.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lobes {
    /// R: light reflected from the outside.
    pub r: DVec3,
    /// TT: light transmitted through the strand.
    pub tt: DVec3,
    /// TRT: light reflected once inside.
    pub trt: DVec3,
    /// Residual: light reflected inside twice or more.
    pub residual: DVec3,
    /// Light scattered by air bubbles.
    pub aerated: DVec3,
}

impl Lobes {
    /// Phase function Φ, the sum of all lobes.
    pub fn total(&self) -> DVec3 {
        self.r + self.tt + self.trt + self.residual + self.aerated
    }
}

/// Direct evaluation of the model in float64. The table is built from it and measured against it.
pub struct Strand {
    params: StrandParams,
    depth: DVec3,
    v: [f64; LOBES],
    s: f64,
    balance: Balance,
}

impl Strand {
    /// Model of a strand with these properties.
    pub fn new(params: &StrandParams) -> Self {
        let v = longitudinal::variances(params.roughness_m as f64);
        Strand {
            params: *params,
            depth: params.depth(),
            v,
            s: logistic_scale(params.roughness_n as f64),
            balance: Balance::new(&v),
        }
    }

    /// Lobes of Φ for the inclinations of light and eye (−π/2 to π/2) and the angle `phi` between them around
    /// the strand, in radians. The shares of strand and air are those of a cell with k_d = k_s.
    pub fn lobes(&self, theta_i: f64, theta_o: f64, phi: f64) -> Lobes {
        let ((sin_i, cos_i), (sin_o, cos_o)) = (theta_i.sin_cos(), theta_o.sin_cos());
        let a = self.params.aeration as f64;
        let m = self.along(theta_i, theta_o, cos_i * cos_o, sin_i * sin_o);
        let n = self.around((0.5 * (theta_o - theta_i)).cos()).at(phi);
        let [r, tt, trt, residual] = std::array::from_fn(|p| n[p] * ((1.0 - a) * m[p]));
        let cos = -(sin_i * sin_o + cos_i * cos_o * phi.cos());
        let aerated = DVec3::splat(a * henyey_greenstein(self.params.g as f64, cos));
        Lobes { r, tt, trt, residual, aerated }
    }

    /// Balanced longitudinal lobes b(θ_i)·b(θ_o)·M_p.
    fn along(&self, theta_i: f64, theta_o: f64, coco: f64, sisi: f64) -> [f64; LOBES] {
        let balance = self.balance.at(theta_i) * self.balance.at(theta_o);
        self.v.map(|v| balance * longitudinal::longitudinal(v, coco, sisi))
    }

    /// Azimuthal lobes N_p at inclination θ_d.
    fn around(&self, cos_d: f64) -> Azimuth {
        Azimuth::new(self.s, ETA, cos_d, self.depth)
    }
}

/// Henyey and Greenstein's phase function, 1/sr. `cos` is the cosine of the scattering angle.
pub fn henyey_greenstein(g: f64, cos: f64) -> f64 {
    0.25 * FRAC_1_PI * (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos).powf(1.5)
}

/// Share of air in a cell: `aeration` where k_d = k_s, and more where k_d is larger than k_s. The noise of k
/// thus becomes noise of the air.
pub fn cell_aeration(aeration: f32, k_d: f32, k_s: f32) -> f32 {
    let sum = k_d + k_s;
    if sum > 0.0 { (aeration * (2.0 * k_d / sum)).clamp(0.0, 1.0) } else { aeration }
}

/// Ratio Ψ/Φ. It is π because intensities are irradiance over π.
pub const PSI_PER_PHI: f64 = PI;
