//! The time of a sample: while the shutter is open, the water moves from sample to sample and from pixel to
//! pixel.
//!
//! The n samples of a pixel lie in n equal parts of the time that the shutter is open, one in each. Where in
//! its part a sample lies depends on the pixel alone: the golden ratio's multiples follow one another along a
//! Hilbert curve through the pixels, so that neighbours fill one another's gaps without a visible pattern.
//! With times common to all pixels, 16 samples would show 16 copies of every drop.

use super::Image;

/// Reciprocal of the golden ratio, in units of 2⁻³². Twin: `shutter_time` of `shaders/layout.wgsl`.
const GOLDEN: u32 = 0x9e37_79b9;

/// Side of the square that the Hilbert curve fills, pixels. It is repeated over the image.
const SQUARE: u32 = 256;

/// Times of one sample in all pixels, in units of the time that the shutter is open: −½ when it opens, ½ when
/// it closes, 0 at the time of the frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleTimes {
    /// Time at which the sample's part begins.
    pub first: f32,
    /// Length of the part, divided by 2²⁴.
    pub step: f32,
}

impl SampleTimes {
    /// Times of sample `sample` of an image. The parts follow one another as the samples' points do in the
    /// R2 sequence, so that places and times together fill their space evenly; see
    /// [`sample_offset`](super::camera::sample_offset).
    pub fn new(image: &Image, sample: u32) -> Self {
        let n = image.samples;
        let part = match sample % 2 {
            0 => (n / 2).saturating_sub(sample / 2),
            _ => n / 2 + (sample + n % 2) / 2,
        };
        let n = f64::from(n);
        SampleTimes { first: (f64::from(part) / n - 0.5) as f32, step: (2f64.powi(-24) / n) as f32 }
    }

    /// Time in a pixel, given by its column and row in the image.
    #[inline]
    pub fn of(&self, pixel: [u32; 2]) -> f32 {
        self.first + (hilbert(pixel).wrapping_mul(GOLDEN) >> 8) as f32 * self.step
    }
}

/// Number of a pixel along the Hilbert curve. Twin: `hilbert` of `shaders/layout.wgsl`.
#[inline]
fn hilbert(pixel: [u32; 2]) -> u32 {
    let [mut x, mut y] = pixel.map(|at| at % SQUARE);
    let mut number = 0;
    let mut side = SQUARE / 2;
    while side > 0 {
        let [right, down] = [x, y].map(|at| u32::from(at & side != 0));
        number += side * side * ((3 * right) ^ down);
        // The curve enters and leaves its first and its last quarter across its own direction.
        if down == 0 {
            if right == 1 {
                (x, y) = (SQUARE - 1 - x, SQUARE - 1 - y);
            }
            (x, y) = (y, x);
        }
        side /= 2;
    }
    number
}
