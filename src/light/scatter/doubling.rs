//! Light that leaves a homogeneous plane-parallel slab, by doubling (van de Hulst, "Multiple Light
//! Scattering", 1980, chapter 4; Hansen, "Multiple Scattering of Polarized Light in Planetary Atmospheres",
//! J. Atmos. Sci. 28, 1971), in float64.
//!
//! The light of a layer so thin that it scatters at most once is known. Two equal layers on top of each other
//! reflect and transmit what follows from one of them, so some thirty doublings give any slab. Only the mean
//! over azimuths is computed; it carries all the flux. Energy is conserved up to the rounding of the
//! doublings: 1e-6 of the light at an optical depth of 50.
//!
//! Directions inside the slab are those of Gauss's quadrature. The directions of lights and eyes are further
//! nodes of weight 0.

use std::f64::consts::PI;

/// Number of Gauss points on each side of the slab. They integrate the first 2·POINTS Legendre moments of a
/// phase function exactly; the rest of its forward peak counts as light that goes straight on (delta-M,
/// Wiscombe 1977). That rest is 0.5 % at g = 0.85 and 19 % at g = 0.95.
const POINTS: usize = 16;

/// Number of Legendre moments that [`emergent`] needs.
pub const MOMENTS: usize = 2 * POINTS + 1;

/// Optical depth of the first layer. Light that scatters twice in it is neglected.
const THIN: f64 = 1e-8;

/// Radiance that leaves a slab, averaged over azimuths, for a light of intensity I = 1 (irradiance π).
pub struct Emergent {
    /// Radiance out of the lit face and out of the other one, without the beam: light by light, and within a
    /// light eye by eye.
    pub faces: [Vec<f64>; 2],
    /// Radiances as `faces`, of light scattered once, as the method itself has it: with the truncated phase
    /// function.
    pub once: [Vec<f64>; 2],
}

/// Light that leaves a slab of optical depth `x` > 0 and albedo `omega`. The phase function is
/// Σ (2l + 1)·`moments[l]`·P_l(cosθ)/4π. `lights` and `eyes` are cosines with the normal, above 0.
pub fn emergent(x: f64, omega: f64, moments: &[f64; MOMENTS], lights: &[f64], eyes: &[f64]) -> Emergent {
    let (nodes, weights) = gauss(POINTS);
    // Delta-M: the peak's share goes straight on, in a thinner slab with a lower albedo.
    let peak = moments[MOMENTS - 1];
    let x = x * (1.0 - omega * peak);
    let omega = omega * (1.0 - peak) / (1.0 - omega * peak);
    let kept: Vec<f64> = moments[..MOMENTS - 1].iter().map(|m| (m - peak) / (1.0 - peak)).collect();
    let out: Vec<f64> = nodes.iter().chain(eyes).copied().collect();
    let into: Vec<f64> = nodes.iter().chain(lights).copied().collect();
    // Mean over azimuths of 4πΦ between two cosines, turned back (0) and on (1).
    let phase = |side: usize| {
        let legendre = |mu: &f64| legendre(*mu, kept.len());
        let [from, to] = [&into, &out].map(|list| list.iter().map(legendre).collect::<Vec<_>>());
        let mut matrix = Matrix::zero(out.len(), into.len());
        for (i, to) in to.iter().enumerate() {
            for (j, from) in from.iter().enumerate() {
                let term = |l: usize| {
                    let sign = if side == 0 && l % 2 == 1 { -1.0 } else { 1.0 };
                    sign * (2 * l + 1) as f64 * kept[l] * to[l] * from[l]
                };
                matrix[(i, j)] = (0..kept.len()).map(term).sum();
            }
        }
        matrix
    };
    let [back, on] = [phase(0), phase(1)];

    let doublings = (x / THIN).log2().ceil().max(0.0) as i32;
    let thin = x / 2f64.powi(doublings);
    let first = |phase: &Matrix| {
        let mut layer = phase.clone();
        for (i, mu) in out.iter().enumerate() {
            layer.row_mut(i).iter_mut().for_each(|p| *p *= omega * thin / (2.0 * mu));
        }
        layer
    };
    let (mut reflected, mut transmitted) = (first(&back), first(&on));
    let direct = |list: &[f64]| list.iter().map(|mu| (-thin / mu).exp()).collect::<Vec<f64>>();
    let (mut beam_out, mut beam_in) = (direct(&out), direct(&into));
    for _ in 0..doublings {
        // Light at the boundary between two equal layers, going up and going down, without the beam.
        // up = r·beam + r·t + r·r·up is solved for the Gauss points; it then gives the eyes'.
        let source = {
            let mut source = reflected.times(&weights, &transmitted);
            for i in 0..out.len() {
                let row = source.row_mut(i).iter_mut().zip(reflected.row(i)).zip(&beam_in);
                row.for_each(|((s, r), beam)| *s += r * beam);
            }
            source
        };
        let twice = reflected.times(&weights, &reflected);
        let mut up = source.clone();
        solve(&twice, &weights, &mut up);
        let more = twice.times(&weights, &up);
        for i in POINTS..out.len() {
            let row = up.row_mut(i).iter_mut().zip(source.row(i)).zip(more.row(i));
            row.for_each(|((up, s), more)| *up = s + more);
        }
        let mut down = reflected.times(&weights, &up);
        down.values.iter_mut().zip(&transmitted.values).for_each(|(down, t)| *down += t);
        // The upper layer passes `up` on, and the lower layer `down` and the beam.
        let [through_up, through_down] = [&up, &down].map(|light| transmitted.times(&weights, light));
        for (i, own) in beam_out.iter().enumerate() {
            for (j, beam) in beam_in.iter().enumerate() {
                let at = (i, j);
                reflected[at] += own * up[at] + through_up[at];
                transmitted[at] = transmitted[at] * beam + own * down[at] + through_down[at];
            }
        }
        beam_out.iter_mut().chain(&mut beam_in).for_each(|beam| *beam *= *beam);
    }

    // A matrix element is the radiance for a beam of flux 2π.
    let list = |matrix: &dyn Fn(usize, usize) -> f64| {
        let pairs = (0..lights.len()).flat_map(|l| (0..eyes.len()).map(move |e| (l, e)));
        pairs.map(|(l, e)| matrix(POINTS + e, POINTS + l)).collect::<Vec<f64>>()
    };
    let once = |side: usize| {
        let phase = [&back, &on][side];
        list(&|i, j| 0.25 * omega * phase[(i, j)] * crossings(side, x, into[j], out[i]))
    };
    Emergent {
        faces: [list(&|i, j| 0.5 * reflected[(i, j)]), list(&|i, j| 0.5 * transmitted[(i, j)])],
        once: [once(0), once(1)],
    }
}

/// Weight ∫ e^(−τ_l/μ₀)·e^(−τ/μ) dτ/μ of the first scattering, over a slab of optical depth `x`. The eye is
/// on the lit side (`side` 0) or on the other one.
pub fn crossings(side: usize, x: f64, mu_0: f64, mu: f64) -> f64 {
    if side == 0 {
        return mu_0 / (mu + mu_0) * -(-x / mu - x / mu_0).exp_m1();
    }
    // (e^(−x/μ₀) − e^(−x/μ))·μ₀/(μ₀ − μ), which has a limit where both are equal.
    let (eye, light) = (x / mu, x / mu_0);
    let apart = (eye - light).abs();
    let share = if apart < 1e-6 { 1.0 - 0.5 * apart } else { -(-apart).exp_m1() / apart };
    eye * (-eye.min(light)).exp() * share
}

/// Nodes and weights of Gauss's quadrature over 0..1, by Newton's method on the Legendre polynomial.
pub(super) fn gauss(n: usize) -> (Vec<f64>, Vec<f64>) {
    let rule = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let p = legendre(x, n + 1);
            slope = n as f64 * (x * p[n] - p[n - 1]) / (x * x - 1.0);
            x -= p[n] / slope;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(rule).unzip()
}

/// The first `n` ≥ 2 Legendre polynomials at `x`.
fn legendre(x: f64, n: usize) -> Vec<f64> {
    let mut p = vec![1.0, x];
    for l in 2..n {
        let k = l as f64;
        p.push(((2.0 * k - 1.0) * x * p[l - 1] - (k - 1.0) * p[l - 2]) / k);
    }
    p
}

/// Solves up = up₀ + m·up for the Gauss points' rows of `up`, which hold up₀ (Gauss's elimination; m's norm
/// is below 1, so the diagonal never vanishes).
fn solve(m: &Matrix, weights: &[f64], up: &mut Matrix) {
    let n = weights.len();
    let mut a = Matrix::zero(n, n);
    for i in 0..n {
        for j in 0..n {
            a[(i, j)] = f64::from(i == j) - m[(i, j)] * weights[j];
        }
    }
    for k in 0..n {
        for i in (0..n).filter(|&i| i != k) {
            let factor = a[(i, k)] / a[(k, k)];
            for matrix in [&mut a, &mut *up] {
                let columns = matrix.columns;
                for j in 0..columns {
                    let pivot = matrix[(k, j)];
                    matrix[(i, j)] -= factor * pivot;
                }
            }
        }
    }
    for i in 0..n {
        let pivot = a[(i, i)];
        up.row_mut(i).iter_mut().for_each(|value| *value /= pivot);
    }
}

/// Matrix of outgoing directions (rows) by incoming ones (columns); the Gauss points come first in both.
#[derive(Clone)]
struct Matrix {
    columns: usize,
    values: Vec<f64>,
}

impl Matrix {
    fn zero(rows: usize, columns: usize) -> Self {
        Matrix { columns, values: vec![0.0; rows * columns] }
    }

    fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.columns..][..self.columns]
    }

    fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.values[i * self.columns..][..self.columns]
    }

    /// Integral over the directions between this matrix and `other`, one after the other.
    fn times(&self, weights: &[f64], other: &Matrix) -> Matrix {
        let mut product = Matrix::zero(self.values.len() / self.columns, other.columns);
        for i in 0..product.values.len() / product.columns {
            for (k, weight) in weights.iter().enumerate() {
                let factor = self.row(i)[k] * weight;
                product.row_mut(i).iter_mut().zip(other.row(k)).for_each(|(p, o)| *p += factor * o);
            }
        }
        product
    }
}

impl std::ops::Index<(usize, usize)> for Matrix {
    type Output = f64;

    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.values[i * self.columns + j]
    }
}

impl std::ops::IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.values[i * self.columns + j]
    }
}
