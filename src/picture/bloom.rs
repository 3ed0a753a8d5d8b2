//! Bloom: the light that lenses and eyes scatter around bright things.
//!
//! Light is spread by a sum of near-Gaussians an octave apart, each with the same share. Around a point the
//! light falls with the square of the distance, like glare in the eye (Stiles and Holladay 1926; Spencer et
//! al., "Physically-Based Glare Effects for Digital Images", 1995). There is no threshold, and energy is
//! conserved: other pixels receive the light that a pixel loses.
//!
//! The near-Gaussians come from a pyramid (Burt and Adelson 1983). A level is the one below it, convolved
//! with the weights 1 3 3 1 and sampled at every second pixel. On the way back, each pixel blends its nearest
//! pixels in the level above by 3 to 1. Both ways together spread a point by a variance of (4^k − 1)/2
//! pixels² for level k, wherever the point lies. A blend of two neighbouring levels has any variance between
//! theirs. Mirror images continue the picture beyond its edges.

use rayon::prelude::*;

use super::Look;

/// Number of near-Gaussians. The first has σ = radius, and each next one half the σ.
pub const OCTAVES: u32 = 6;

/// Shares of the pyramid's levels, starting with the picture itself, for a largest σ of `radius` pixels. They
/// add up to 1.
pub fn shares(radius: f64) -> Vec<f64> {
    let mut shares = vec![0.0; 1];
    for octave in 0..OCTAVES {
        let sigma = radius / f64::from(1 << octave);
        let s = 2.0 * sigma * sigma + 1.0;
        let level = (s.log2() * 0.5).floor().max(0.0);
        let above = ((s / 4f64.powf(level) - 1.0) / 3.0).clamp(0.0, 1.0);
        let level = level as usize;
        shares.resize(shares.len().max(level + 2), 0.0);
        shares[level] += 1.0 - above;
        shares[level + 1] += above;
    }
    while shares.len() > 1 && shares.last() == Some(&0.0) {
        shares.pop();
    }
    shares.into_iter().map(|share| share / f64::from(OCTAVES)).collect()
}

/// Radiance of a picture with bloom, evaluated pixel by pixel.
pub struct Bloom<'a> {
    radiance: &'a [[f32; 4]],
    width: usize,
    /// Share of its own light that a pixel keeps.
    own_share: f32,
    /// Spread light at half the picture's size; `None` if no light is spread beyond a pixel.
    glow: Option<Level>,
}

/// One level of the pyramid.
struct Level {
    size: [usize; 2],
    pixels: Vec<[f32; 3]>,
}

impl Level {
    /// Value at pixel (x, y) of the level below, blended from four pixels of this level.
    fn up(&self, x: usize, y: usize) -> [f32; 3] {
        // The first and the last pixel are their own mirror images.
        let near = |i: usize, n: usize| {
            let other = if i.is_multiple_of(2) { (i / 2).saturating_sub(1) } else { (i / 2 + 1).min(n - 1) };
            (i / 2, other)
        };
        let ((x0, x1), (y0, y1)) = (near(x, self.size[0]), near(y, self.size[1]));
        let at = |x: usize, y: usize| self.pixels[y * self.size[0] + x];
        let [a, b, c, d] = [at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1)];
        [0, 1, 2].map(|i| 0.75 * (0.75 * a[i] + 0.25 * b[i]) + 0.25 * (0.75 * c[i] + 0.25 * d[i]))
    }

    /// Level of `size` pixels from the level `below` it, of `below_size` pixels.
    fn down(size: [usize; 2], below_size: [usize; 2], below: impl Fn(usize) -> [f32; 3] + Sync) -> Level {
        const WEIGHTS: [f32; 4] = [0.125, 0.375, 0.375, 0.125];
        let taps = |i: usize, n: usize| [0, 1, 2, 3].map(|k| mirrored((2 * i + k) as isize - 1, n));
        let columns: Vec<[usize; 4]> = (0..size[0]).map(|x| taps(x, below_size[0])).collect();
        let mut pixels = vec![[0.0; 3]; size[0] * size[1]];
        pixels.par_chunks_mut(size[0]).enumerate().for_each(|(y, row)| {
            let rows = taps(y, below_size[1]).map(|y| y * below_size[0]);
            for (out, columns) in row.iter_mut().zip(&columns) {
                for (row, wy) in rows.into_iter().zip(WEIGHTS) {
                    let mut sum = [0.0; 3];
                    for (&column, wx) in columns.iter().zip(WEIGHTS) {
                        let p = below(row + column);
                        sum = [0, 1, 2].map(|c| sum[c] + wx * p[c]);
                    }
                    *out = [0, 1, 2].map(|c| out[c] + wy * sum[c]);
                }
            }
        });
        Level { size, pixels }
    }
}

/// Index of pixel `i` in a row of `n` pixels that its mirror images continue on both sides.
fn mirrored(i: isize, n: usize) -> usize {
    let index = i.rem_euclid(2 * n as isize) as usize;
    if index < n { index } else { 2 * n - 1 - index }
}

impl<'a> Bloom<'a> {
    /// Bloom of a whole picture of `width`×`height` pixels.
    pub fn new(radiance: &'a [[f32; 4]], [width, height]: [usize; 2], look: &Look) -> Self {
        let shares = shares(f64::from(look.bloom_radius) * height as f64);
        let share = |level: usize| (shares[level] * f64::from(look.bloom)) as f32;
        let own_share = (1.0 - f64::from(look.bloom) * (1.0 - shares[0])) as f32;
        let levels = shares.len() - 1;
        if levels == 0 {
            return Bloom { radiance, width, own_share, glow: None };
        }
        let source = |i: usize| {
            let [r, g, b, _] = radiance[i];
            // A single NaN or infinite pixel would spread over the whole picture.
            [r, g, b].map(|x| if x.is_finite() { x } else { 0.0 })
        };
        // The size is rounded up so that it halves without a remainder at every level.
        let whole = [width, height].map(|n| n.next_multiple_of(1 << levels));
        let size = |level: usize| whole.map(|n| n >> level);
        let mut pyramid = vec![Level::down(size(1), [width, height], source)];
        for level in 2..=levels {
            let below = &pyramid[level - 2];
            pyramid.push(Level::down(size(level), below.size, |i| below.pixels[i]));
        }
        let mut glow: Option<Level> = None;
        for (i, mut level) in pyramid.into_iter().enumerate().rev() {
            let own = share(i + 1);
            let columns = level.size[0];
            level.pixels.par_chunks_mut(columns).enumerate().for_each(|(y, row)| {
                for (x, out) in row.iter_mut().enumerate() {
                    let above = glow.as_ref().map_or([0.0; 3], |glow| glow.up(x, y));
                    *out = [0, 1, 2].map(|c| own * out[c] + above[c]);
                }
            });
            glow = Some(level);
        }
        Bloom { radiance, width, own_share, glow }
    }

    /// Radiance of pixel `i` with bloom.
    pub fn pixel(&self, i: usize) -> [f32; 3] {
        let [r, g, b, _] = self.radiance[i];
        let glow = self.glow.as_ref().map_or([0.0; 3], |glow| glow.up(i % self.width, i / self.width));
        [(r, glow[0]), (g, glow[1]), (b, glow[2])].map(|(own, glow)| self.own_share * own + glow)
    }
}
