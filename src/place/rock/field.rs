//! Fields on the points of a patch: midpoint displacement, and the hollows of a field.

use rand_distr::{Distribution, StandardNormal};

use super::MAX_LEVELS;
use crate::util::random::{Family, Stream};

/// Number of channels that share the numbers of a stream, for channels after the first two.
const CHANNELS: u64 = 8;

/// Makes a fractal field on (2^levels + 1)² points. Its deviation is 1 at the first level, and its corners
/// are 0.
///
/// Each level sets the middle of every square to the mean of its four corners, then the middle of every edge
/// to the mean of its neighbours (two of them on the border), and adds g·2^(−(n−1)·h) to each.
pub fn displace(levels: u32, h: f32, seed: u64, channel: u64) -> Vec<f32> {
    let n = 1usize << levels;
    let side = n + 1;
    let family = Family::new(seed, if channel < 2 { Stream::Rock } else { Stream::RockForm });
    // A point keeps its number and its g when finer levels are added, so the shape stays.
    let finest = |c: usize| (c as u64) << (MAX_LEVELS - levels);
    let g = |x: usize, y: usize| -> f32 {
        let number = finest(y) * ((1 << MAX_LEVELS) + 1) + finest(x);
        let index = if channel < 2 { 2 * number + channel } else { CHANNELS * number + channel };
        StandardNormal.sample(&mut family.member(index))
    };
    let mut field = vec![0.0f32; side * side];
    let mut stride = n;
    for level in 0..levels {
        let half = stride / 2;
        let scale = (-(level as f32) * h).exp2();
        for y in (half..side).step_by(stride) {
            for x in (half..side).step_by(stride) {
                let at = |dx: usize, dy: usize| field[(y - half + dy) * side + x - half + dx];
                let mean = (at(0, 0) + at(stride, 0) + at(0, stride) + at(stride, stride)) * 0.25;
                let i = y * side + x;
                field[i] = mean + g(x, y) * scale;
            }
        }
        for y in (0..side).step_by(half) {
            let first = if (y / half).is_multiple_of(2) { half } else { 0 };
            for x in (first..side).step_by(stride) {
                let (mut sum, mut count) = (0.0, 0.0);
                let mut add = |x: usize, y: usize| {
                    sum += field[y * side + x];
                    count += 1.0;
                };
                if x >= half {
                    add(x - half, y);
                }
                if x + half <= n {
                    add(x + half, y);
                }
                if y >= half {
                    add(x, y - half);
                }
                if y + half <= n {
                    add(x, y + half);
                }
                let i = y * side + x;
                // 2^(−h/2): the middle of an edge comes half a level after that of its square.
                field[i] = sum / count + g(x, y) * scale * (-0.5 * h).exp2();
            }
        }
        stride = half;
    }
    field
}

/// Returns how deep each point lies below its neighbourhood, from 0 (ridge) to 1 (deep hollow). The
/// neighbourhood extends by a sixteenth of the side.
pub fn hollows(height: &[f32], side: usize) -> Vec<f32> {
    let radius = (side / 16).max(1);
    let mean = box_mean(&box_mean(height, side, radius, false), side, radius, true);
    let difference: Vec<f32> = height.iter().zip(&mean).map(|(h, m)| h - m).collect();
    let variance = difference.iter().map(|d| d * d).sum::<f32>() / difference.len() as f32;
    let scale = 1.0 / variance.sqrt().max(1e-9);
    difference
        .iter()
        .map(|d| {
            let c = d * scale;
            0.5 - 0.5 * c / (1.0 + c * c).sqrt()
        })
        .collect()
}

/// Returns the mean over 2·radius + 1 points along x, or along y if `vertical`. At the border it is over
/// fewer points.
fn box_mean(field: &[f32], side: usize, radius: usize, vertical: bool) -> Vec<f32> {
    let at = |line: usize, i: usize| if vertical { field[i * side + line] } else { field[line * side + i] };
    let mut out = vec![0.0; field.len()];
    for line in 0..side {
        let mut prefix = vec![0.0f64; side + 1];
        for i in 0..side {
            prefix[i + 1] = prefix[i] + at(line, i) as f64;
        }
        for i in 0..side {
            let (low, high) = (i.saturating_sub(radius), (i + radius + 1).min(side));
            let mean = ((prefix[high] - prefix[low]) / (high - low) as f64) as f32;
            out[if vertical { i * side + line } else { line * side + i }] = mean;
        }
    }
    out
}
