//! Azimuthal lobes N_p: the distribution of light around the strand, averaged over all offsets of a ray.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::cylinder::{LOBES, Passage};

/// Scale s of the logistic for a roughness from 0 to 1 (Chiang et al. 2016, eq. 8).
pub fn logistic_scale(roughness: f64) -> f64 {
    (PI / 8.0).sqrt() * (0.265 * roughness + 1.194 * roughness.powi(2) + 5.372 * roughness.powi(22))
}

/// Logistic distribution D of scale s, trimmed to −π..π.
#[derive(Clone, Copy, Debug)]
pub struct Logistic {
    s: f64,
    norm: f64,
}

impl Logistic {
    /// Distribution of scale `s`, in radians.
    pub fn new(s: f64) -> Self {
        // The norm divides by CDF(π) − CDF(−π).
        Logistic { s, norm: 1.0 / (s * (PI / (2.0 * s)).tanh()) }
    }

    /// Density at an angle in radians, which is wrapped into −π..π. The integral over a turn is 1.
    pub fn at(&self, angle: f64) -> f64 {
        let wrapped = (angle - TAU * (angle / TAU).round()).abs();
        let e = (-wrapped / self.s).exp();
        self.norm * e / ((1.0 + e) * (1.0 + e))
    }
}

/// Rays of one inclination at many offsets h in 0..1. The rays at −h are their mirror images.
pub struct Azimuth {
    d: Logistic,
    /// Share of the rays with their passage through the cylinder.
    passages: Vec<(f64, Passage)>,
}

impl Azimuth {
    /// Traces rays for the logistic scale `s`, the index of refraction `eta`, the cosine of the inclination
    /// θ_d and the optical depth of a diameter.
    pub fn new(s: f64, eta: f64, cos_d: f64, depth: DVec3) -> Self {
        // Equal steps of γ suit Φ_p, which turns by at most 2 radians per radian of γ. The logistic's poles
        // lie at ±iπs, so with steps of 1.6·s in Φ_p the sum is within e^(−2π²/1.6) of its integral.
        let count = (2.0 / s).ceil().clamp(64.0, 4096.0) as usize;
        let step = FRAC_PI_2 / count as f64;
        let passages = (0..count)
            .map(|i| {
                let gamma = (i as f64 + 0.5) * step;
                // The shares of the offsets are exact, so they add up to 1.
                let share = (gamma + 0.5 * step).sin() - (gamma - 0.5 * step).sin();
                (share, Passage::new(eta, cos_d, gamma.sin(), depth))
            })
            .collect();
        Azimuth { d: Logistic::new(s), passages }
    }

    /// Mean ⟨A_p⟩ over the offsets, which is the integral of N_p over a turn.
    pub fn attenuation(&self) -> [DVec3; LOBES] {
        let mut sum = [DVec3::ZERO; LOBES];
        for (share, passage) in &self.passages {
            for (sum, a) in sum.iter_mut().zip(passage.attenuation) {
                *sum += a * *share;
            }
        }
        sum
    }

    /// Share of light that leaves, per radian, in every direction alike: that of light that meets the edges
    /// of scales. It is absorbed as all other light in the mean.
    pub fn stray(&self) -> DVec3 {
        self.attenuation().into_iter().sum::<DVec3>() / TAU
    }

    /// Azimuthal lobes N_p(φ) = ½ ∫ A_p(h)·D(φ − Φ_p(h)) dh with h from −1 to 1, per radian. The residual
    /// lobe is uniform, 1/2π, because light that stays inside for longer than TRT leaves in every direction
    /// alike.
    pub fn at(&self, phi: f64) -> [DVec3; LOBES] {
        let mut sum = [DVec3::ZERO; LOBES];
        for (share, passage) in &self.passages {
            for ((sum, turn), a) in sum.iter_mut().zip(passage.azimuth).zip(passage.attenuation) {
                let both = self.d.at(phi - turn) + self.d.at(phi + turn);
                *sum += a * (0.5 * share * both);
            }
            sum[3] += passage.attenuation[3] * (share / TAU);
        }
        sum
    }
}
