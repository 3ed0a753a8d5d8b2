//! Factors that give a homogeneous slab the flux of its exact solution.
//!
//! The formula of the module above is similarity, and similarity is an approximation: a slab of g = 0.8 and
//! optical depth 1 reflects a quarter too much. It also takes the light at the centres of layers, where a
//! thick layer has too little. Both errors are known for a homogeneous slab, from [`emergent`]. So for each
//! direction of light and of eye a table holds
//!
//! - the **gain** G, by which all light that scatters twice or more is multiplied, and
//! - the **fill** F, the light scattered once that the centres of the layers miss, over ω.
//!
//! With both, the radiance of a homogeneous slab, averaged over azimuths, is exact at the table's nodes.

use std::f64::consts::PI;

use super::doubling::{Emergent, MOMENTS, crossings, emergent};
use super::{COSINES, Layers, ORDERS, Similarity, VIEWS};

/// Maximum gain. It is reached only where light and eye graze layers of an optical depth of several, which
/// similarity leaves nearly dark; a gain of 100 there would turn gaps between strands into sparks. At 4
/// the flux of eight layers is 12 % low at worst.
const MOST: f64 = 8.0;

/// One colour of a slab.
pub struct Slab<'a> {
    /// Layers of the slab.
    pub layers: &'a Layers,
    /// Albedo ω.
    pub omega: f64,
    /// Mean cosine g, negative for backward scattering.
    pub g: f64,
    /// Extinction a, reduced b' and isotropic b, as in [`Similarity`].
    pub extinction: f64,
    /// b'.
    pub reduced: f64,
    /// b.
    pub isotropic: f64,
}

impl<'a> Slab<'a> {
    /// Colour `c` of a slab of mean cosine `g`.
    pub fn new(layers: &'a Layers, similarity: &Similarity, g: f32, c: usize) -> Self {
        Slab {
            layers,
            omega: similarity.albedo[c].into(),
            g: g.into(),
            extinction: similarity.extinction[c].into(),
            reduced: similarity.reduced[c].into(),
            isotropic: similarity.isotropic[c].into(),
        }
    }

    /// Gain and fill, in the order of [`Profile::values`](super::Profile::values). `profile` is P of this
    /// colour, by face, row and layer.
    pub fn gains(&self, profile: &[f64]) -> Vec<[f64; 2]> {
        let x: f64 = self.layers.depths.iter().sum();
        let lights: Vec<f64> = (0..COSINES).map(cosine_of_row).collect();
        let eyes: Vec<f64> = (0..VIEWS).map(cosine_of_view).collect();
        let moments: [f64; MOMENTS] = std::array::from_fn(|l| self.g.powi(l as i32));
        let truth = emergent(x, self.omega, &moments, &lights, &eyes);
        let weights: Vec<[Vec<f64>; 2]> = eyes.iter().map(|mu| self.weights(*mu)).collect();
        let mut gains = Vec::with_capacity(2 * lights.len() * eyes.len());
        for face in 0..2 {
            for (row, mu_0) in lights.iter().enumerate() {
                let first = (face * lights.len() + row) * self.layers.depths.len();
                let arriving = self.arriving(face, *mu_0, &profile[first..][..self.layers.depths.len()]);
                for (view, mu) in eyes.iter().enumerate() {
                    let at = row * eyes.len() + view;
                    gains.push(self.gain([face, at], x, [*mu_0, *mu], &weights[view], &arriving, &truth));
                }
            }
        }
        gains
    }

    /// Weights w and w' of the layers for an eye.
    fn weights(&self, mu: f64) -> [Vec<f64>; 2] {
        [1.0, self.extinction].map(|extinction| {
            let mut above = 0.0;
            let weight = |depth: &f64| {
                let passed = (-extinction * above / mu).exp();
                above += depth;
                passed * -(-extinction * depth / mu).exp_m1()
            };
            self.layers.depths.iter().map(weight).collect()
        })
    }

    /// Light that arrives at each layer: V, P + b'·V', and V·ω(ω τ_l)^(n−1)/(n−1)! for n = 2 … 6.
    fn arriving(&self, face: usize, mu_0: f64, profile: &[f64]) -> Vec<[f64; ORDERS + 1]> {
        let layer = |(z, p): (usize, &f64)| {
            let depth = self.layers.depth_to_light(face, z, mu_0);
            let seen = (-depth).exp();
            let mut out =
                [seen, p + self.reduced * (-self.extinction * depth).exp(), 0.0, 0.0, 0.0, 0.0, 0.0];
            let mut term = seen * self.omega;
            for (n, value) in (1..).zip(&mut out[2..]) {
                term *= self.omega * depth / n as f64;
                *value = term;
            }
            out
        };
        profile.iter().enumerate().map(layer).collect()
    }

    /// Gain and fill of one direction of light and eye. `at` is their place in the lists of `truth`.
    fn gain(
        &self,
        [face, at]: [usize; 2],
        x: f64,
        [mu_0, mu]: [f64; 2],
        [w, w_reduced]: &[Vec<f64>; 2],
        arriving: &[[f64; ORDERS + 1]],
        truth: &Emergent,
    ) -> [f64; 2] {
        let cos = |turn: f64| {
            let side = if face == 0 { -1.0 } else { 1.0 };
            side * mu * mu_0 + ((1.0 - mu * mu) * (1.0 - mu_0 * mu_0)).sqrt() * turn.cos()
        };
        let psi = 0.25 * self.omega * around(self.g, cos);
        let sum = |w: &[f64], k: usize| w.iter().zip(arriving).map(|(w, a)| w * a[k]).sum::<f64>();
        let lit = sum(w, 0);
        let once = psi * crossings(face, x, mu_0, mu);
        // The part of the light scattered once that the walk finds, and the part that it misses.
        let found = psi * lit;
        let fill = (once - found).max(0.0) / -(-x / mu).exp_m1();
        let mut twice = sum(w_reduced, 1) - self.isotropic * lit;
        for n in 2..=ORDERS {
            let g = self.g.max(0.0).powi(n as i32);
            twice += 0.25 * (around(g, cos) - (1.0 - g)) * sum(w, n);
        }
        let whole = truth.faces[face][at] - truth.once[face][at] + once;
        let gain = (whole - found.max(once)) / twice.max(1e-300);
        [gain.clamp(0.0, MOST), fill / self.omega]
    }
}

/// Cosine of the light in row `row` of a profile.
pub fn cosine_of_row(row: u32) -> f64 {
    ladder(row, COSINES)
}

/// Cosine of the eye in column `view` of the table of gains.
pub fn cosine_of_view(view: u32) -> f64 {
    ladder(view, VIEWS)
}

/// Squares of even steps from 0 to 1. The first stands for grazing directions, where nothing arrives at all.
fn ladder(i: u32, n: u32) -> f64 {
    (i as f64 / (n - 1) as f64).powi(2).max(1e-3)
}

/// Mean of 4πΦ of Henyey and Greenstein over the azimuth. `cos` is the cosine of the scattering angle at an
/// azimuth, which is a + b·cos φ.
///
/// ∫ (α − β cos φ)^(−3/2) dφ over half a turn is 2E(m)/((α − β)·√(α + β)), m = 2β/(α + β), with E the
/// complete elliptic integral of the second kind.
fn around(g: f64, cos: impl Fn(f64) -> f64) -> f64 {
    let [most, least] = [cos(0.0), cos(PI)];
    let alpha = 1.0 + g * g - g * (most + least);
    let beta = (g * (most - least)).abs();
    let e = elliptic_e(2.0 * beta / (alpha + beta));
    (1.0 - g * g) * 2.0 * e / (PI * (alpha - beta) * (alpha + beta).sqrt())
}

/// Complete elliptic integral of the second kind, by the arithmetic-geometric mean (Abramowitz and Stegun
/// 1964, 17.6).
fn elliptic_e(m: f64) -> f64 {
    let (mut a, mut b, mut sum, mut power) = (1.0, (1.0 - m).sqrt(), 0.5 * m, 1.0);
    for _ in 0..8 {
        let c: f64 = 0.5 * (a - b);
        sum += power * c * c;
        power *= 2.0;
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    0.5 * PI / a * (1.0 - sum)
}
