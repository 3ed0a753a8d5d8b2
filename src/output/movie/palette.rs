//! 255 colours for a movie, and a dither with them that depends on nothing but colour and place.

use std::collections::BTreeSet;

use color_quant::NeuQuant;

/// The palette holds 256 entries; the last is left for pixels that stay.
const COLOURS: usize = 255;

/// Pixels that the palette is made from, spread evenly over all frames: 2 MiB. Twice as many change no
/// colour by more than a step or two.
const SAMPLE: u64 = 1 << 19;

/// What is kept of frames to choose the palette.
pub(super) struct PaletteSample {
    /// R, G, B, 255.
    pixels: Vec<u8>,
    /// Every how many-eth pixel is kept, counted through the frames.
    step: u64,
    until_next: u64,
    /// All colours, as long as the palette can hold them.
    exact: Option<BTreeSet<[u8; 3]>>,
}

impl PaletteSample {
    /// For `frames` frames of `pixels` pixels.
    pub(super) fn new(pixels: u64, frames: u64) -> Self {
        // Odd and no divisor of common widths' multiples, so that the sample is no column of the picture.
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

    /// The colours themselves where there are few; else those of a self-organising map of the sample
    /// (Dekker 1994), which follows smooth runs of colour such as water's well.
    pub(super) fn palette(self) -> Vec<[u8; 3]> {
        match self.exact {
            Some(exact) => exact.into_iter().collect(),
            None => {
                let map = NeuQuant::new(1, COLOURS, &self.pixels);
                let mut colours: Vec<[u8; 3]> = map.color_map_rgb().as_chunks::<3>().0.to_vec();
                // Neighbours in brightness are neighbours in number: it compresses better.
                colours.sort_by_key(|c| (luma(c), *c));
                colours
            }
        }
    }
}

/// Steps of the dither.
const LEVELS: usize = 16;

/// Entries of the table of colours dithered before.
const CACHE: usize = 1 << 16;

/// Dithers with a palette.
pub(super) struct Ditherer {
    palette: Vec<[u8; 3]>,
    /// The palette by channel, for the search.
    planes: [Vec<i32>; 3],
    /// Colour (top bit: filled) and its mixture.
    cache: Vec<(u32, [u8; LEVELS])>,
}

impl Ditherer {
    pub(super) fn new(palette: Vec<[u8; 3]>) -> Self {
        let planes = [0, 1, 2].map(|c| palette.iter().map(|colour| colour[c] as i32).collect());
        Ditherer { palette, planes, cache: vec![(0, [0; LEVELS]); CACHE] }
    }

    /// R, G, B of all entries in turn.
    pub(super) fn palette(&self) -> &[u8] {
        self.palette.as_flattened()
    }

    /// Indices of a picture.
    pub(super) fn dither(&mut self, rgb: &[u8], width: usize) -> Vec<u8> {
        let pixels = rgb.as_chunks::<3>().0;
        let at = |(i, colour): (usize, &[u8; 3])| self.mixture(*colour)[threshold(i % width, i / width)];
        pixels.iter().enumerate().map(at).collect()
    }

    /// The colours that mix to `colour`, from dark to bright, each as often as its share: Knoll's pattern
    /// dither. Each is the one nearest to what the ones before left undone.
    fn mixture(&mut self, colour: [u8; 3]) -> [u8; LEVELS] {
        let key = u32::from_be_bytes([128, colour[0], colour[1], colour[2]]);
        // Fibonacci hashing: the top bits of a product with 2³² over the golden ratio.
        let slot = (key.wrapping_mul(0x9E37_79B9) >> 16) as usize % CACHE;
        if self.cache[slot].0 == key {
            return self.cache[slot].1;
        }
        let wanted = colour.map(i32::from);
        let mut undone = [0; 3];
        let mut mixture = [0; LEVELS];
        for index in &mut mixture {
            *index = self.nearest([0, 1, 2].map(|c| wanted[c] + undone[c]));
            let taken = self.palette[*index as usize];
            undone = [0, 1, 2].map(|c| undone[c] + wanted[c] - taken[c] as i32);
        }
        mixture.sort_by_key(|&i| (luma(&self.palette[i as usize]), i));
        self.cache[slot] = (key, mixture);
        mixture
    }

    /// The nearest colour; channels weigh as the eye sees them, roughly.
    fn nearest(&self, [r, g, b]: [i32; 3]) -> u8 {
        let [reds, greens, blues] = &self.planes;
        let distance = |i: usize| {
            let [r, g, b] = [reds[i] - r, greens[i] - g, blues[i] - b];
            3 * r * r + 4 * g * g + 2 * b * b
        };
        (0..self.palette.len()).map(distance).enumerate().min_by_key(|&(_, d)| d).map_or(0, |(i, _)| i as u8)
    }
}

/// Brightness as the eye sees it, to sort by.
fn luma(c: &[u8; 3]) -> u32 {
    299 * c[0] as u32 + 587 * c[1] as u32 + 114 * c[2] as u32
}

/// The step of the dither at a pixel: interleaved gradient noise (Jimenez 2014). It stands still in all
/// frames, and its grain is finer to the eye than a Bayer matrix of as many steps.
fn threshold(x: usize, y: usize) -> usize {
    let noise = (52.982_918_9 * (0.067_110_56 * x as f64 + 0.005_837_15 * y as f64).fract()).fract();
    (noise * LEVELS as f64) as usize % LEVELS
}
