//! A texture with its coarser levels.

use std::sync::LazyLock;

use image::RgbImage;
use rayon::prelude::*;

/// Most textures' texels that a scene holds, bytes. WebGPU binds 128 MiB at once.
pub const MOST_BYTES: u64 = 64 << 20;

/// Image on a surface, with a pyramid of levels. Each texel of a level is the mean, in linear light, of the
/// texels that it covers in the finest level.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Width and height of the finest level that is held, texels.
    pub size: [u32; 2],
    /// Whether the codes are those of sRGB. Otherwise they are linear.
    pub is_srgb: bool,
    /// Levels of the image that are finer than the finest one held.
    pub dropped: u32,
    /// Texels of each level, row by row, the finest level first. Red is the lowest byte.
    pub levels: Vec<Vec<u32>>,
}

impl Texture {
    /// Makes the pyramid of an image without its `dropped` finest levels.
    ///
    /// # Panics
    /// If the image has no texels.
    pub fn new(image: &RgbImage, is_srgb: bool, dropped: u32) -> Texture {
        let finest = [image.width(), image.height()];
        let size = size_at(finest, dropped);
        let all = image.as_raw();
        let texel = |x: usize, y: usize| {
            let at = 3 * (y * finest[0] as usize + x);
            [0, 1, 2].map(|c| value(all[at + c], is_srgb))
        };
        let mut levels = Vec::new();
        if dropped == 0 {
            levels.push(all.as_chunks::<3>().0.iter().map(|&[r, g, b]| packed([r, g, b])).collect());
        }
        let mut above: Option<(Vec<[f32; 3]>, [u32; 2])> = None;
        for level in 1..level_count(finest) {
            let own = size_at(finest, level);
            let made = match &above {
                None => halved(finest, own, texel),
                Some((texels, size)) => halved(*size, own, |x, y| texels[y * size[0] as usize + x]),
            };
            if level >= dropped {
                let codes = made.iter().map(|t| packed(t.map(|x| code(x, is_srgb))));
                levels.push(codes.collect());
            }
            above = Some((made, own));
        }
        Texture { size, is_srgb, dropped, levels }
    }

    /// Bytes of the texels of all levels.
    pub fn bytes(&self) -> u64 {
        pyramid_bytes(self.size)
    }
}

/// Number of levels of an image, down to one texel.
pub fn level_count(size: [u32; 2]) -> u32 {
    32 - size[0].max(size[1]).max(1).leading_zeros()
}

/// Width and height of a level.
pub fn size_at(size: [u32; 2], level: u32) -> [u32; 2] {
    size.map(|n| n.checked_shr(level).unwrap_or(0).max(1))
}

/// Bytes of the texels of an image's levels.
pub fn pyramid_bytes(size: [u32; 2]) -> u64 {
    (0..level_count(size)).map(|level| size_at(size, level).map(u64::from)).map(|[w, h]| 4 * w * h).sum()
}

/// Returns how many of its finest levels each image drops, so that the levels of all take at most `most`
/// bytes. The largest image drops first; of equal ones the first does.
pub fn dropped(sizes: &[[u32; 2]], most: u64) -> Vec<u32> {
    let mut out = vec![0; sizes.len()];
    let bytes = |i: usize, out: &[u32]| pyramid_bytes(size_at(sizes[i], out[i]));
    let mut total: u64 = (0..sizes.len()).map(|i| bytes(i, &out)).sum();
    while total > most {
        let largest = (0..sizes.len()).rev().max_by_key(|&i| bytes(i, &out));
        let Some(i) = largest.filter(|&i| out[i] + 1 < level_count(sizes[i])) else { break };
        let before = bytes(i, &out);
        out[i] += 1;
        total -= before - bytes(i, &out);
    }
    out
}

/// Means of the texels under each texel of a level that is about half as large, weighted by the areas that
/// they share.
fn halved(size: [u32; 2], own: [u32; 2], texel: impl Fn(usize, usize) -> [f32; 3] + Sync) -> Vec<[f32; 3]> {
    let [across, down] = [0, 1].map(|axis| covered(size[axis], own[axis]));
    let row = |(first_y, weights_y): &(usize, [f32; 3])| {
        let at = |(first_x, weights_x): &(usize, [f32; 3])| {
            let mut sum = [0.0; 3];
            for (dy, wy) in weights_y.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                for (dx, wx) in weights_x.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                    let t = texel(first_x + dx, first_y + dy);
                    sum = [0, 1, 2].map(|c| sum[c] + wx * wy * t[c]);
                }
            }
            sum
        };
        across.iter().map(at).collect::<Vec<_>>()
    };
    down.par_iter().flat_map_iter(row).collect()
}

/// For each of `own` texels in a row, the first of the `n` finer texels that it covers, at most three, and
/// the shares of them in its area.
fn covered(n: u32, own: u32) -> Vec<(usize, [f32; 3])> {
    let width = f64::from(n) / f64::from(own);
    let shares = |i: u32| {
        let (low, high) = (f64::from(i) * width, f64::from(i + 1) * width);
        let first = low.floor();
        let share = |k: f64| ((high.min(first + k + 1.0) - low.max(first + k)).max(0.0) / width) as f32;
        // Rounding may leave a trace of a texel beyond the last.
        let weights = [0.0, 1.0, 2.0].map(|k| if first + k < f64::from(n) { share(k) } else { 0.0 });
        (first as usize, weights)
    };
    (0..own).map(shares).collect()
}

fn packed([r, g, b]: [u8; 3]) -> u32 {
    u32::from_le_bytes([r, g, b, 255])
}

/// Value of a code.
pub(super) fn value(code: u8, is_srgb: bool) -> f32 {
    if is_srgb { LINEAR[usize::from(code)] } else { f32::from(code) / 255.0 }
}

/// Code of a value from 0 to 1.
fn code(x: f32, is_srgb: bool) -> u8 {
    let coded = match is_srgb {
        false => x,
        true if x <= 0.003_130_8 => 12.92 * x,
        true => 1.055 * x.powf(1.0 / 2.4) - 0.055,
    };
    (255.0 * coded).round() as u8
}

/// Linear values of the codes of sRGB (IEC 61966-2-1).
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| {
        let x = code as f64 / 255.0;
        let linear = if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
        linear as f32
    })
});
