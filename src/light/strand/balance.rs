//! Factor that makes the sum of the lobes conserve energy at every inclination.
//!
//! M_p is normalised and Σ A_p = 1. A_p is evaluated at θ_d, though, which varies with θ_o over a wide lobe,
//! so the integral of their product differs from 1. Tilted scales turn a part of a lobe beyond the ends of the
//! strand, too. The symmetric factor b(θ_i)·b(θ_o) corrects the integral and keeps Φ reciprocal (Sinkhorn 1964,
//! for a symmetric matrix).

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

/// Factor b as a function of the inclination.
#[derive(Clone, Debug)]
pub struct Balance {
    /// Values of b at the midpoints of equal steps of θ from `first` to 90°.
    b: Vec<f64>,
    /// −90°, or 0 if b is even in θ.
    first: f64,
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
        let is_even = shifts.iter().all(|shift| *shift == 0.0);
        let count = if is_even { NODES / 2 } else { NODES };
        let rows: Vec<Vec<f64>> = (0..count)
            .into_par_iter()
            .map(|i| {
                let (sin_i, cos_i) = theta(i).sin_cos();
                let energy = |o: usize| {
                    let (sin_o, cos_o) = theta(o).sin_cos();
                    let a = &attenuation[i.abs_diff(o)];
                    let (coco, sisi, sum) = (cos_i * cos_o, sin_i * sin_o, theta(i) + theta(o));
                    let m = |p: usize| shifted(v[p], shifts[p], sum, coco, sisi);
                    (0..LOBES).map(|p| m(p) * a[p]).sum::<f64>() * weight[o]
                };
                // If b is even in θ, the rows and columns of −θ fold onto those of θ.
                let folded = |o: usize| if is_even { energy(o) + energy(NODES - 1 - o) } else { energy(o) };
                (0..count).map(folded).collect()
            })
            .collect();
        let mut b = vec![1.0; count];
        for _ in 0..ROUNDS {
            let sums: Vec<f64> =
                rows.iter().map(|row| row.iter().zip(&b).map(|(k, b)| k * b).sum()).collect();
            for (b, sum) in b.iter_mut().zip(sums) {
                *b = (*b / sum).sqrt();
            }
        }
        if is_even {
            b.reverse();
        }
        Balance { b, first: if is_even { 0.0 } else { -FRAC_PI_2 } }
    }

    /// Returns b(θ), θ in radians. Angles beyond 90° take the value at 90°.
    pub fn at(&self, theta: f64) -> f64 {
        let last = self.b.len() - 1;
        let theta = if self.first == 0.0 { theta.abs() } else { theta };
        let share = (theta - self.first) / (FRAC_PI_2 - self.first);
        let x = (share * self.b.len() as f64 - 0.5).clamp(0.0, last as f64);
        let i = (x as usize).min(last - 1);
        let f = x - i as f64;
        self.b[i] * (1.0 - f) + self.b[i + 1] * f
    }
}
