//! §5, beyond the paper: a reflection model for matter of round, clear strands. Every cell of the volume
//! holds strands along its direction: water with air between them, or hair.
//!
//! A strand is a dielectric cylinder along the cell's direction t. Light that meets it leaves by reflection
//! (R), by transmission (TT), after one internal reflection (TRT, which makes the rainbow) or after several.
//! The sum is a phase function
//!
//! Φ(l→e) = b(θ_i)·b(θ_o)·Σ_p M_p(θ_i − s_p/2, θ_o − s_p/2)·N_p(θ_d, φ),   θ_d = (θ_o − θ_i)/2
//!
//! in 1/sr. Its integral over all directions is the albedo, which is 1 without absorption. The vectors l and
//! e point outward; sin θ_i = t·l, sin θ_o = t·e, and φ is the angle between l and e around t. Φ does not
//! change when l and e are exchanged, or for φ → −φ.
//!
//! The surface of a hair is covered with scales that are tilted by α against it. They turn lobe p by s_p
//! along the strand ([`longitudinal::shifts`]), which makes two highlights of one. A little light is spread
//! by their edges ([`balance`]). With α = 0, as in water, Φ does not change either when t is reversed.
//! Otherwise t runs from root to tip.
//!
//! The sum over lobes and their shifts follow Marschner, Jensen, Cammarano, Worley and Hanrahan, "Light
//! Scattering from Human Hair Fibers", SIGGRAPH 2003. [`longitudinal`] follows d'Eon et al. 2011 and
//! [`azimuthal`] Chiang et al. 2016. [`cylinder`] has the optics, [`water`] and [`hair`] describe what the
//! strands are of, and [`balance`] conserves energy. The air has a Henyey–Greenstein phase function (1941),
//! mixed in by the cell's own coefficients. [`table`] tabulates the model for the renderers.
//!
//! Intensities are irradiance over π, so Ψ = π·Φ takes the place of the fibre model's Ψ.

pub mod azimuthal;
pub mod balance;
pub mod cylinder;
pub mod hair;
pub mod longitudinal;
pub mod table;
pub mod water;

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec3, Vec3};

use azimuthal::{Azimuth, logistic_scale};
use balance::Balance;
use cylinder::LOBES;

/// Way in the space of the texture along which hairs run from root to tip, where only the second moments of
/// directions are known: down the texture (+y) and out of the surface (−z). A covector.
pub const ROOT_TO_TIP: Vec3 = Vec3::new(0.0, 1.0, -1.0);

/// Strands as the model takes them, and the air between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrandParams {
    /// Index of refraction, above 1.
    pub eta: f64,
    /// Angle α by which scales on the surface are tilted, radians. Where it is positive, their outer ends
    /// point to the tip.
    pub tilt: f64,
    /// Optical depth σ_a · 2r of a diameter, linear RGB.
    pub depth: DVec3,
    /// Roughness along the strand, β_m, 0.1 to 1.
    pub roughness_m: f32,
    /// Roughness around the strand, β_n, 0.1 to 1.
    pub roughness_n: f32,
    /// Share of the light that meets air bubbles instead of strands in a cell with k_d = k_s, 0 to 1.
    pub aeration: f32,
    /// Mean cosine of the scattering angle at air bubbles, −0.99 to 0.99.
    pub g: f32,
}

impl StrandParams {
    /// Whether the sign of t matters, because scales on the strands are tilted.
    pub fn is_tilted(&self) -> bool {
        self.tilt != 0.0
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
    /// Residual: light reflected inside twice or more, and light that meets the edges of tilted scales.
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
    v: [f64; LOBES],
    /// Sums θ_i + θ_o at which the lobes have their middle, radians.
    shifts: [f64; LOBES],
    s: f64,
    balance: Balance,
}

impl Strand {
    /// Model of a strand with these properties.
    pub fn new(params: &StrandParams) -> Self {
        let v = longitudinal::variances(params.roughness_m as f64);
        let shifts = longitudinal::shifts(params.tilt);
        Strand {
            params: *params,
            v,
            shifts,
            s: logistic_scale(params.roughness_n as f64),
            balance: Balance::new(&v, &shifts, params.eta),
        }
    }

    /// Lobes of Φ for the inclinations of light and eye (−π/2 to π/2) and the angle `phi` between them around
    /// the strand, in radians. The shares of strand and air are those of a cell with k_d = k_s.
    pub fn lobes(&self, theta_i: f64, theta_o: f64, phi: f64) -> Lobes {
        let ((sin_i, cos_i), (sin_o, cos_o)) = (theta_i.sin_cos(), theta_o.sin_cos());
        let a = self.params.aeration as f64;
        let m = self.along(theta_i, theta_o, cos_i * cos_o, sin_i * sin_o);
        let around = self.around((0.5 * (theta_o - theta_i)).cos());
        let n = around.at(phi);
        let [r, tt, trt, later] = std::array::from_fn(|p| n[p] * ((1.0 - a) * m[p]));
        let residual = later + around.stray() * ((1.0 - a) * self.balance.stray(theta_i, theta_o));
        let cos = -(sin_i * sin_o + cos_i * cos_o * phi.cos());
        let aerated = DVec3::splat(a * henyey_greenstein(self.params.g as f64, cos));
        Lobes { r, tt, trt, residual, aerated }
    }

    /// Balanced longitudinal lobes b(θ_i)·b(θ_o)·M_p.
    fn along(&self, theta_i: f64, theta_o: f64, coco: f64, sisi: f64) -> [f64; LOBES] {
        let balance = self.balance.at(theta_i) * self.balance.at(theta_o);
        let m = |p| longitudinal::shifted(self.v[p], self.shifts[p], theta_i + theta_o, coco, sisi);
        std::array::from_fn(|p| balance * m(p))
    }

    /// Azimuthal lobes N_p at inclination θ_d.
    fn around(&self, cos_d: f64) -> Azimuth {
        Azimuth::new(self.s, self.params.eta, cos_d, self.params.depth)
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
