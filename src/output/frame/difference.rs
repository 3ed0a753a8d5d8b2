//! Comparison of two pictures.

use serde::Serialize;

/// Tolerance within which two pixels count as the same: every channel differs by at most
/// absolute + relative·max(|a|, |b|).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Tolerated difference as a share of the larger value.
    pub relative: f32,
    /// Tolerated difference in the picture's units.
    pub absolute: f32,
}

/// Error figures over all channels of all pixels, in the picture's units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Mean absolute difference.
    pub mean: f64,
    /// Largest absolute difference.
    pub max: f64,
    /// Number of pixels outside the tolerance or not finite in either picture.
    pub outside: u64,
    /// Number of pixels.
    pub pixels: u64,
    /// Column and row of the pixel with the largest difference.
    pub worst: [u32; 2],
}

impl Difference {
    /// Compares two pictures of the same size, row by row.
    ///
    /// # Panics
    /// If the lengths differ or are not a multiple of `width`.
    pub fn new(width: u32, a: &[[f32; 3]], b: &[[f32; 3]], tolerance: Tolerance) -> Self {
        assert_eq!(a.len(), b.len(), "pictures of one size");
        assert!(a.len().is_multiple_of(width.max(1) as usize), "whole rows");
        let (mut squares, mut sum, mut max, mut outside, mut worst) = (0.0f64, 0.0f64, 0.0f64, 0, 0);
        for (i, (p, q)) in a.iter().zip(b).enumerate() {
            let mut same = true;
            for (&x, &y) in p.iter().zip(q) {
                let d = (x - y).abs();
                // NaN and infinity are outside the tolerance even where both pictures have them.
                same &= d.is_finite() && d <= tolerance.absolute + tolerance.relative * x.abs().max(y.abs());
                let d = if d.is_finite() { d as f64 } else { f64::from(f32::MAX) };
                squares += d * d;
                sum += d;
                if d > max {
                    (max, worst) = (d, i);
                }
            }
            outside += u64::from(!same);
        }
        let values = (a.len() * 3).max(1) as f64;
        let index = worst as u32;
        Difference {
            rmse: (squares / values).sqrt(),
            mean: sum / values,
            max,
            outside,
            pixels: a.len() as u64,
            worst: [index % width.max(1), index / width.max(1)],
        }
    }

    /// Returns the share of the pixels outside the tolerance.
    pub fn share_outside(&self) -> f64 {
        self.outside as f64 / self.pixels.max(1) as f64
    }
}
