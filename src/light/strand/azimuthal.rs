//! N_p: how the lobes spread around the strand, the mean over all offsets of what leaves there.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::cylinder::{LOBES, Passage};

/// Scale s of the logistic for a roughness from 0 to 1 (Chiang et al. 2016, eq. 8).
pub fn logistic_scale(roughness: f64) -> f64 {
    (PI / 8.0).sqrt() * (0.265 * roughness + 1.194 * roughness.powi(2) + 5.372 * roughness.powi(22))
}

/// D: the logistic distribution of scale s, trimmed to −π..π.
#[derive(Clone, Copy, Debug)]
pub struct Logistic {
    s: f64,
    norm: f64,
}

impl Logistic {
    /// Of scale `s`.
    pub fn new(s: f64) -> Self {
        // CDF(π) − CDF(−π).
        Logistic { s, norm: 1.0 / (s * (PI / (2.0 * s)).tanh()) }
    }

    /// D of an angle, wrapped into −π..π first; its integral over a turn is 1.
    pub fn at(&self, angle: f64) -> f64 {
        let wrapped = (angle - TAU * (angle / TAU).round()).abs();
        let e = (-wrapped / self.s).exp();
        self.norm * e / ((1.0 + e) * (1.0 + e))
    }
}

/// The rays of one inclination, at many offsets h of 0..1; those of −h are their mirror images.
pub struct Azimuth {
    d: Logistic,
    /// Share of the rays, and what becomes of them.
    passages: Vec<(f64, Passage)>,
}

impl Azimuth {
    /// For a scale `s` of the logistic, index `eta`, inclination θ_d and optical depth of a diameter.
    pub fn new(s: f64, eta: f64, cos_d: f64, depth: DVec3) -> Self {
        // Equal steps of γ, for Φ_p turns by at most 2 radians per radian of γ. The logistic's poles lie at
        // ±iπs, so with steps of 1.6·s in Φ_p the sum is within e^(−2π²/1.6) of its integral.
        let count = (2.0 / s).ceil().clamp(64.0, 4096.0) as usize;
        let step = FRAC_PI_2 / count as f64;
        let passages = (0..count)
            .map(|i| {
                let gamma = (i as f64 + 0.5) * step;
                // The exact share of the offsets: the shares add up to 1.
                let share = (gamma + 0.5 * step).sin() - (gamma - 0.5 * step).sin();
                (share, Passage::new(eta, cos_d, gamma.sin(), depth))
            })
            .collect();
        Azimuth { d: Logistic::new(s), passages }
    }

    /// ⟨A_p⟩, the mean over the offsets; the integral of N_p over a turn.
    pub fn attenuation(&self) -> [DVec3; LOBES] {
        let mut sum = [DVec3::ZERO; LOBES];
        for (share, passage) in &self.passages {
            for (sum, a) in sum.iter_mut().zip(passage.attenuation) {
                *sum += a * *share;
            }
        }
        sum
    }

    /// N_p(φ) = ½ ∫ A_p(h)·D(φ − Φ_p(h)) dh, h from −1 to 1, per radian. What has been inside for longer than
    /// TRT has forgotten where it came from: 1/2π.
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
