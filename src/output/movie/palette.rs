//! A palette of 255 colours for a movie, and a dither that depends only on the colour and position of a
//! pixel.

use std::collections::BTreeSet;

use color_quant::NeuQuant;

/// Colours of the palette. It has 256 entries; the last marks pixels that do not change.
const COLOURS: usize = 255;

/// Number of pixels from which the palette is made, spread evenly over all frames; they take 2 MiB. Twice as
/// many change no colour by more than a step or two.
const SAMPLE: u64 = 1 << 19;

/// Sample of the frames' pixels, from which the palette is chosen.
pub(super) struct PaletteSample {
    /// Sampled pixels: R, G, B, 255.
    pixels: Vec<u8>,
    /// Distance between sampled pixels, counted through all frames.
    step: u64,
    /// Pixels to skip before the next sampled one.
    until_next: u64,
    /// All colours, as long as they fit into the palette.
    exact: Option<BTreeSet<[u8; 3]>>,
}

impl PaletteSample {
    /// Makes a sample for `frames` frames of `pixels` pixels.
    pub(super) fn new(pixels: u64, frames: u64) -> Self {
        // An odd step shares few factors with common widths, so the sample does not fall into a few columns.
        let step = (pixels as u128 * frames as u128).div_ceil(SAMPLE as u128) as u64 | 1;
        PaletteSample { pixels: Vec::new(), step, until_next: step / 2, exact: Some(BTreeSet::new()) }
    }

    pub(super) fn add(&mut self, rgb: &[u8]) {
        if let Some(exact) = &mut self.exact {
            let mut last = None;
            for pixel in rgb.as_chunks::<3>().0 {
                if last != Some(pixel) && exact.insert(*pixel) && exact.len() > COLOURS {
                    self.exact = None;
                    break;
                }
                last = Some(pixel);
            }
        }
        let count = rgb.len() as u64 / 3;
        while self.until_next < count {
            let i = self.until_next as usize * 3;
            self.pixels.extend_from_slice(&[rgb[i], rgb[i + 1], rgb[i + 2], 255]);
            self.until_next += self.step;
        }
        self.until_next -= count;
    }

    /// Returns all colours if they fit into the palette, otherwise those of a self-organising map of the
    /// sample (Dekker 1994). Such a map follows smooth gradients, as in water, well.
    pub(super) fn palette(self) -> Vec<[u8; 3]> {
        match self.exact {
            Some(exact) => exact.into_iter().collect(),
            None => {
                let map = NeuQuant::new(1, COLOURS, &self.pixels);
                let mut colours: Vec<[u8; 3]> = map.color_map_rgb().as_chunks::<3>().0.to_vec();
                // Sorted by brightness, similar colours have similar indices, which compress better.
                colours.sort_by_key(|c| (luma(c), *c));
                colours
            }
        }
    }
}

/// Number of steps of the dither.
const LEVELS: usize = 16;

/// Entries of the cache of dithered colours.
const CACHE: usize = 1 << 16;

/// Dither with a palette.
pub(super) struct Ditherer {
    palette: Vec<[u8; 3]>,
    /// Palette by channel, for the search.
    planes: [Vec<i32>; 3],
    /// Colours and their mixtures. The top bit of a colour marks a filled entry.
    cache: Vec<(u32, [u8; LEVELS])>,
}

impl Ditherer {
    pub(super) fn new(palette: Vec<[u8; 3]>) -> Self {
        let planes = [0, 1, 2].map(|c| palette.iter().map(|colour| colour[c] as i32).collect());
        Ditherer { palette, planes, cache: vec![(0, [0; LEVELS]); CACHE] }
    }

    /// Returns R, G, B of all entries in turn.
    pub(super) fn palette(&self) -> &[u8] {
        self.palette.as_flattened()
    }

    /// Dithers a picture. Returns its indices into the palette.
    pub(super) fn dither(&mut self, rgb: &[u8], width: usize) -> Vec<u8> {
        let pixels = rgb.as_chunks::<3>().0;
        let at = |(i, colour): (usize, &[u8; 3])| self.mixture(*colour)[threshold(i % width, i / width)];
        pixels.iter().enumerate().map(at).collect()
    }

    /// Returns the palette colours that mix to `colour`, from dark to bright, each as often as its share
    /// (Knoll's pattern dither). Each is chosen nearest to `colour` plus the error of those before.
    fn mixture(&mut self, colour: [u8; 3]) -> [u8; LEVELS] {
        let key = u32::from_be_bytes([128, colour[0], colour[1], colour[2]]);
        // Fibonacci hashing takes the top bits of the product with 2³² / golden ratio.
        let slot = (key.wrapping_mul(0x9E37_79B9) >> 16) as usize % CACHE;
        if self.cache[slot].0 == key {
            return self.cache[slot].1;
        }
        let wanted = colour.map(i32::from);
        let mut error = [0; 3];
        let mut mixture = [0; LEVELS];
        for index in &mut mixture {
            *index = self.nearest([0, 1, 2].map(|c| wanted[c] + error[c]));
            let taken = self.palette[*index as usize];
            error = [0, 1, 2].map(|c| error[c] + wanted[c] - taken[c] as i32);
        }
        mixture.sort_by_key(|&i| (luma(&self.palette[i as usize]), i));
        self.cache[slot] = (key, mixture);
        mixture
    }

    /// Returns the index of the nearest colour. Channels are weighted roughly as the eye sees them.
    fn nearest(&self, [r, g, b]: [i32; 3]) -> u8 {
        let [reds, greens, blues] = &self.planes;
        let distance = |i: usize| {
            let [r, g, b] = [reds[i] - r, greens[i] - g, blues[i] - b];
            3 * r * r + 4 * g * g + 2 * b * b
        };
        (0..self.palette.len()).map(distance).enumerate().min_by_key(|&(_, d)| d).map_or(0, |(i, _)| i as u8)
    }
}

/// Returns the perceived brightness, for sorting.
fn luma(c: &[u8; 3]) -> u32 {
    299 * c[0] as u32 + 587 * c[1] as u32 + 114 * c[2] as u32
}

/// Returns the step of the dither at a pixel, from interleaved gradient noise (Jimenez 2014). It is the same
/// in all frames, and its grain looks finer than that of a Bayer matrix with as many steps.
fn threshold(x: usize, y: usize) -> usize {
    let noise = (52.982_918_9 * (0.067_110_56 * x as f64 + 0.005_837_15 * y as f64).fract()).fract();
    (noise * LEVELS as f64) as usize % LEVELS
}
