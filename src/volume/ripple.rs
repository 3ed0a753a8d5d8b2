//! Smooth periodic noise of one variable, which a strand of water carries along its length.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// Smallest weight that is kept, relative to the first. Smaller ones change the variance by less than 1e-4.
const MIN_WEIGHT: f64 = 1e-5;
/// Largest number of harmonics. With 0.005, the shortest length a scene accepts, the weights end at 153.
const MAX_HARMONICS: usize = 256;

/// Stationary normal process w(s) with period 1, mean 0 and variance 1. Its covariance is Σ_n e^(−(Δ +
/// n)²/2ℓ²) up to a factor: a Gaussian of width ℓ, wrapped around the period.
///
/// The process is computed as its Fourier series. By Poisson's summation the squared amplitudes are
/// a_m² ∝ e^(−(2πmℓ)²/2), and twice that for m > 0; each is multiplied by a normal coefficient.
#[derive(Clone, Debug)]
pub struct Ripple {
    /// Coefficients of cos 2πms and sin 2πms, from m = 0.
    coefficients: Vec<[f32; 2]>,
}

impl Ripple {
    /// Draws a process with the correlation length `length`, a fraction of the period.
    pub fn new(length: f32, rng: &mut impl Rng) -> Self {
        let weight = |m: usize| (-0.5 * (std::f64::consts::TAU * m as f64 * f64::from(length)).powi(2)).exp();
        let weights: Vec<f64> = (0..MAX_HARMONICS)
            .map(|m| weight(m) * if m == 0 { 1.0 } else { 2.0 })
            .take_while(|&w| w > MIN_WEIGHT)
            .collect();
        let sum: f64 = weights.iter().sum();
        let mut normal = || -> f64 { StandardNormal.sample(rng) };
        let coefficients =
            weights.iter().map(|w| [normal(), normal()].map(|n| (n * (w / sum).sqrt()) as f32)).collect();
        Ripple { coefficients }
    }

    /// Appends the `steps` values w(0), w(1/steps), w(2/steps), … to `values`.
    pub fn sample(&self, steps: usize, values: &mut Vec<f32>) {
        let step = std::f64::consts::TAU / steps as f64;
        let circle: Vec<[f32; 2]> = (0..steps)
            .map(|i| {
                let (sin, cos) = (step * i as f64).sin_cos();
                [cos as f32, sin as f32]
            })
            .collect();
        values.extend((0..steps).map(|i| {
            let terms = self.coefficients.iter().enumerate();
            terms
                .map(|(m, [a, b])| {
                    let [cos, sin] = circle[(m * i) % steps];
                    a * cos + b * sin
                })
                .sum::<f32>()
        }));
    }
}
