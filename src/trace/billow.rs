//! §4 Billows of mist: noise that rises and thins and thickens a sheet of mist from ray to ray. Twin:
//! `shaders/trace/billow.wgsl`.
//!
//! Noise that is carried on and on would not come back to where a loop began. So two fields of noise rise
//! side by side, half a loop apart, and cross-fade; each begins anew while its share is 0 (Max and Becker
//! 1996).

use glam::Vec3;

use super::noise::lattice;
use crate::mapping::Billow;

/// Strength of the contrast: the standard deviation of the density is about 0.6 times [`Billow::strength`].
const CONTRAST: f32 = 4.5;
/// Standard deviation of the noise.
const DEVIATION: f32 = 0.136;
/// Largest factor of the density.
const MOST: f32 = 3.0;
/// How much finer the second octave is, and the shares of both.
const FINER: f32 = 2.7;
const SHARES: [f32; 2] = [0.65, 0.35];
/// Cells between the two fields.
const APART: f32 = 37.0;

/// Where both fields of noise are in a loop: how far each has risen, in loops from −½ to ½, and their
/// weights. The squares of the weights add up to 1, so that the contrast stays the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BillowTimes {
    /// Of the first field and the second.
    pub risen: [f32; 2],
    /// Weights.
    pub weights: [f32; 2],
}

impl BillowTimes {
    /// Times at a flow of the volume, in its lengths.
    pub fn new(flow: f32) -> Self {
        let risen = [0.0, 0.5].map(|phase| (flow.rem_euclid(1.0) + phase).fract() - 0.5);
        let shares = risen.map(|part| 1.0 - 2.0 * part.abs());
        let length = (shares[0] * shares[0] + shares[1] * shares[1]).sqrt();
        BillowTimes { risen, weights: shares.map(|share| share / length) }
    }
}

/// Value noise between the values of the lattice, 0 to 1.
#[inline]
fn noise(p: Vec3) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let s = f * f * (Vec3::splat(3.0) - f * 2.0);
    let [x, y, z] = cell.to_array().map(|at| at as i32 as u32);
    let [x1, y1, z1] = [x, y, z].map(|at| at.wrapping_add(1));
    let row = |y: u32, z: u32| {
        let near = lattice(x, y, z);
        near + (lattice(x1, y, z) - near) * s.x
    };
    let plane = |z: u32| {
        let near = row(y, z);
        near + (row(y1, z) - near) * s.y
    };
    let near = plane(z);
    near + (plane(z1) - near) * s.z
}

/// Returns the factor of mist's density at a point of the scene, metres; 1 without billows.
#[inline]
pub fn factor(billow: &Billow, times: &BillowTimes, point: Vec3) -> f32 {
    if billow.strength <= 0.0 {
        return 1.0;
    }
    let field = |i: usize| {
        let risen = billow.rise * times.risen[i];
        let p = Vec3::new(point.x, point.y - risen, point.z) * billow.inverse_size
            + Vec3::splat(APART * i as f32);
        let sum = SHARES[0] * noise(p) + SHARES[1] * noise(p * FINER);
        (sum - 0.5) * times.weights[i]
    };
    // The exponential of a normal number has this mean, and leaves no holes in the mist.
    let contrast = billow.strength * CONTRAST;
    let mean = 0.5 * (contrast * DEVIATION) * (contrast * DEVIATION);
    (contrast * (field(0) + field(1)) - mean).exp().min(MOST)
}
