//! Factor that makes the sum of the lobes conserve energy at every inclination.
//!
//! M_p is normalised and Σ A_p = 1. A_p is evaluated at θ_d, though, which varies with θ_o over a wide lobe,
//! so the integral of their product differs from 1. The symmetric factor b(θ_i)·b(θ_o) corrects the integral
//! and keeps Φ reciprocal (Sinkhorn 1964, for a symmetric matrix).
//!
//! Where scales are tilted, the lobes alone cannot conserve energy. In even light on a white strand, the mean
//! of sin θ_i + sin θ_o over all light is 2·⟨sin θ_i⟩ = 0 if Φ is reciprocal and loses nothing: no light
//! moves along the strand on balance. But most of it goes through, and so moves towards the tip. A factor b
//! that mended this would be a large power of 10 at one end of the strand, and would move the lobes back.
//! Here b only makes the integral 1 in the mean over both senses of θ_i, and at most 1 for each. The rest d
//! stands for light that meets the edges of scales, and goes towards the root. It is spread as
//!
//! d(θ_i)·u(θ_o) + u(θ_i)·d(θ_o) − u(θ_i)·u(θ_o)·∫d
//!
//! where u is a density on the root's side: so it is reciprocal, and d in the sum over θ_o. With a tilt of 3°
//! it is 2 % of all light.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use rayon::prelude::*;

use super::azimuthal::Azimuth;
use super::cylinder::LOBES;
use super::longitudinal::shifted;

/// Number of inclinations from −90° to 90°. Their step, 0.7°, is a third of the narrowest lobe's standard
/// deviation.
const NODES: usize = 256;
/// Number of iterations. Each at least halves the error, which starts below a third.
const ROUNDS: usize = 24;

/// Factor b, and the light that meets the edges of scales, as functions of the inclination.
#[derive(Clone, Debug)]
pub struct Balance {
    /// Values of b at the midpoints of equal steps of θ: of |θ| from 0 to 90° if the two senses are alike,
    /// otherwise from −90° to 90°.
    b: Vec<f64>,
    /// d at the same inclinations; none if the two senses are alike.
    stray: Vec<f64>,
    /// Density u at the same inclinations.
    spread: Vec<f64>,
    /// Integral of d over sin θ.
    all: f64,
}

impl Balance {
    /// Balance of lobes with the variances `v` and the shifts `shifts` in a strand of index `eta`. It is
    /// computed without absorption, so that absorbed light stays lost.
    pub fn new(v: &[f64; LOBES], shifts: &[f64; LOBES], eta: f64) -> Self {
        let step = PI / NODES as f64;
        let theta = |i: usize| (i as f64 + 0.5) * step - FRAC_PI_2;
        // Weight of an inclination: d sin θ.
        let weight: Vec<f64> =
            (0..NODES).map(|i| (theta(i) + 0.5 * step).sin() - (theta(i) - 0.5 * step).sin()).collect();
        // ⟨A_p⟩ by the difference of two inclinations, 2θ_d.
        let attenuation: Vec<[f64; LOBES]> = (0..NODES)
            .into_par_iter()
            .map(|i| {
                let cos_d = (0.5 * i as f64 * step).cos();
                Azimuth::new(1.0, eta, cos_d, DVec3::ZERO).attenuation().map(|a| a.x)
            })
            .collect();
        let energies = |i: usize| -> Vec<f64> {
            let (sin_i, cos_i) = theta(i).sin_cos();
            let energy = |o: usize| {
                let (sin_o, cos_o) = theta(o).sin_cos();
                let a = &attenuation[i.abs_diff(o)];
                let (coco, sisi, sum) = (cos_i * cos_o, sin_i * sin_o, theta(i) + theta(o));
                let m = |p: usize| shifted(v[p], shifts[p], sum, coco, sisi);
                (0..LOBES).map(|p| m(p) * a[p]).sum::<f64>() * weight[o]
            };
            (0..NODES).map(energy).collect()
        };
        let half = NODES / 2;
        // b is even in θ, so the rows and columns of −θ fold onto those of θ.
        let folded = |row: &[f64]| -> Vec<f64> { (0..half).map(|o| row[o] + row[NODES - 1 - o]).collect() };
        if shifts.iter().all(|shift| *shift == 0.0) {
            let rows: Vec<_> = (0..half).into_par_iter().map(|i| folded(&energies(i))).collect();
            let mut b = even(&rows);
            b.reverse();
            return Balance { b, stray: Vec::new(), spread: Vec::new(), all: 0.0 };
        }
        let rows: Vec<_> = (0..NODES).into_par_iter().map(energies).collect();
        let mean = |i: usize| -> Vec<f64> {
            let both = folded(&rows[i]).into_iter().zip(folded(&rows[NODES - 1 - i]));
            both.map(|(one, other)| 0.5 * (one + other)).collect()
        };
        let mut b = even(&(0..half).map(mean).collect::<Vec<_>>());
        b.extend(b.clone().into_iter().rev());
        for _ in 0..ROUNDS {
            let sums = sums(&rows, &b);
            b.iter_mut().zip(sums).for_each(|(b, sum)| *b *= (*b * sum).max(1.0).sqrt().recip());
        }
        let stray: Vec<f64> =
            b.iter().zip(sums(&rows, &b)).map(|(b, sum)| (1.0 - b * sum).max(0.0)).collect();
        let integral = |f: &[f64]| f.iter().zip(&weight).map(|(f, weight)| f * weight).sum::<f64>();
        // The scales turn what goes through by a positive shift towards the tip.
        let is_of_root = |i: usize| theta(i) * shifts[1] < 0.0;
        let mut spread: Vec<f64> =
            (0..NODES).map(|i| if is_of_root(i) { stray[i] * theta(i).cos() } else { 0.0 }).collect();
        let scale = integral(&spread).max(f64::MIN_POSITIVE).recip();
        spread.iter_mut().for_each(|u| *u *= scale);
        let all = integral(&stray);
        Balance { b, stray, spread, all }
    }

    /// Returns b(θ), θ in radians. Angles beyond 90° take the value at 90°.
    pub fn at(&self, theta: f64) -> f64 {
        let is_even = self.stray.is_empty();
        let share = if is_even { theta.abs() / FRAC_PI_2 } else { theta / PI + 0.5 };
        between(&self.b, share)
    }

    /// Light that meets the edges of scales, per unit of sin θ_o and summed over all azimuths, without
    /// absorption. θ_i and θ_o are in radians.
    pub fn stray(&self, theta_i: f64, theta_o: f64) -> f64 {
        if self.stray.is_empty() {
            return 0.0;
        }
        let at = |values: &[f64], theta: f64| between(values, theta / PI + 0.5);
        let [d_i, d_o] = [theta_i, theta_o].map(|theta| at(&self.stray, theta));
        let [u_i, u_o] = [theta_i, theta_o].map(|theta| at(&self.spread, theta));
        (d_i * u_o + u_i * d_o - u_i * u_o * self.all).max(0.0)
    }
}

/// Factor that makes all sums of `rows` 1, if it multiplies both rows and columns.
fn even(rows: &[Vec<f64>]) -> Vec<f64> {
    let mut b = vec![1.0; rows.len()];
    for _ in 0..ROUNDS {
        let sums = sums(rows, &b);
        for (b, sum) in b.iter_mut().zip(sums) {
            *b = (*b / sum).sqrt();
        }
    }
    b
}

/// Sums of all rows, whose columns are multiplied by `b`.
fn sums(rows: &[Vec<f64>], b: &[f64]) -> Vec<f64> {
    rows.iter().map(|row| row.iter().zip(b).map(|(k, b)| k * b).sum()).collect()
}

/// Interpolates between values at the midpoints of equal steps; `share` of the whole is passed.
fn between(values: &[f64], share: f64) -> f64 {
    let last = values.len() - 1;
    let x = (share * values.len() as f64 - 0.5).clamp(0.0, last as f64);
    let i = (x as usize).min(last - 1);
    let f = x - i as f64;
    values[i] * (1.0 - f) + values[i + 1] * f
}
