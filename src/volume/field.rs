//! §2 Fields of numbers over the columns of a volume that join without a seam: fractal relief and blocks.

use glam::Vec2;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::util::random::Family;

/// Fewest cells from one number of a level to the next. Finer levels would be noise from cell to cell.
const FINEST: usize = 2;
/// Levels of blocks whose borders are open cracks.
const CRACKED_LEVELS: usize = 3;
/// Width of a crack, in sizes of a block.
const CRACK_WIDTH: f32 = 0.07;
/// Standard deviations of a block's offset and of its tilt along x and y, in units of its level.
const BLOCK_OFFSET: f32 = 0.7;
const BLOCK_TILT: Vec2 = Vec2::new(0.8, 0.8);
/// Tilt along y of the blocks of beds, and how many times as long as high they are.
const BED_TILT: f32 = 2.2;
const BED_LENGTH: f32 = 3.0;
/// Halvings of both from level to level.
const BED_DECAY: f32 = 0.7;

/// One number for each column of cells, row by row. Both axes wrap around.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    /// nx, ny.
    pub size: [usize; 2],
    pub values: Vec<f32>,
}

impl Field {
    /// Computes the number of each column from its x and y.
    pub fn new(size: [usize; 2], of: impl Fn(usize, usize) -> f32 + Sync) -> Field {
        let mut values = vec![0.0; size[0] * size[1]];
        values.par_chunks_mut(size[0]).enumerate().for_each(|(y, row)| {
            row.iter_mut().enumerate().for_each(|(x, value)| *value = of(x, y));
        });
        Field { size, values }
    }

    /// The number at a place that may lie in another copy.
    pub fn at(&self, x: i64, y: i64) -> f32 {
        let [nx, ny] = self.size;
        self.values[y.rem_euclid(ny as i64) as usize * nx + x.rem_euclid(nx as i64) as usize]
    }

    /// The field of other numbers, made from each number and its column.
    pub fn map(&self, of: impl Fn(usize, f32) -> f32 + Sync) -> Field {
        let nx = self.size[0];
        Field::new(self.size, |x, y| of(y * nx + x, self.values[y * nx + x]))
    }

    /// Mean and standard deviation.
    pub fn moments(&self) -> [f32; 2] {
        let count = self.values.len() as f64;
        let mean = self.values.iter().map(|&x| f64::from(x)).sum::<f64>() / count;
        let square = self.values.iter().map(|&x| (f64::from(x) - mean).powi(2)).sum::<f64>() / count;
        [mean as f32, square.sqrt() as f32]
    }

    /// The field with mean 0 and standard deviation 1; an even field is 0.
    pub fn standard(self) -> Field {
        let [mean, deviation] = self.moments();
        let scale = if deviation > 1e-6 { 1.0 / deviation } else { 0.0 };
        self.map(|_, value| (value - mean) * scale)
    }

    /// Mean over a square that reaches `radius` cells to each side of a column, or as far as the field does.
    pub fn blurred(&self, radius: f32) -> Field {
        self.blurred_along_rows(radius).transposed().blurred_along_rows(radius).transposed()
    }

    fn blurred_along_rows(&self, radius: f32) -> Field {
        let nx = self.size[0];
        let reach = (radius.round().max(0.0) as usize).min((nx - 1) / 2);
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_mut(nx).zip(self.values.par_chunks(nx)).for_each(|(means, row)| {
            // The window moves on by one column: one comes in, another goes out.
            let at = |i: usize| f64::from(row[i % nx]);
            let mut sum: f64 = (nx - reach..=nx + reach).map(at).sum();
            for (x, mean) in means.iter_mut().enumerate() {
                *mean = (sum / (2 * reach + 1) as f64) as f32;
                sum += at(x + reach + 1) - at(x + nx - reach);
            }
        });
        Field { size: self.size, values }
    }

    fn transposed(&self) -> Field {
        let [nx, ny] = self.size;
        Field::new([ny, nx], |y, x| self.values[y * nx + x])
    }

    /// Changes from a column to the next along x and y, means of both sides.
    pub fn slope(&self, x: usize, y: usize) -> Vec2 {
        let (x, y) = (x as i64, y as i64);
        let along = |dx, dy| 0.5 * (self.at(x + dx, y + dy) - self.at(x - dx, y - dy));
        Vec2::new(along(1, 0), along(0, 1))
    }

    /// The number that the given share of the columns reach; infinite for none.
    pub fn quantile(&self, share: f32) -> f32 {
        let mut sorted = self.values.clone();
        let rank = ((1.0 - share) * sorted.len() as f32) as usize;
        match rank < sorted.len() {
            true => *sorted.select_nth_unstable_by(rank, f32::total_cmp).1,
            false => f32::INFINITY,
        }
    }
}

/// Numbers of lattice points across and along at a level. A level has twice as many as the one before, the
/// first has one every `size` widths. `None` where they would be finer than cells.
fn lattice(cells: [usize; 2], size: f32, level: usize) -> Option<[usize; 2]> {
    let first = |axis: usize| {
        let count = cells[axis] as f32 / (size * cells[0] as f32);
        count.round().clamp(1.0, (cells[axis] / FINEST).max(1) as f32) as usize
    };
    let counts = [0, 1].map(|axis| first(axis).checked_shl(level as u32).unwrap_or(usize::MAX));
    (level == 0 || (0..2).all(|axis| counts[axis].saturating_mul(FINEST) <= cells[axis])).then_some(counts)
}

/// Weights of the four lattice points around a place that lies `t` behind the second: a cubic B-spline.
fn spline(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    let (t2, s2) = (t * t, s * s);
    [s2 * s, 4.0 - 6.0 * t2 + 3.0 * t2 * t, 4.0 - 6.0 * s2 + 3.0 * s2 * s, t2 * t].map(|w| w / 6.0)
}

/// Fractal surface of complexity h: level n adds normal numbers times S(n) = 2^(−n·h), as the midpoints of
/// the paper's curves, on a lattice that is twice as fine as that of level n − 1. Between lattice points lie
/// cubic splines. Successive additions, unlike displaced midpoints, show no creases (Saupe 1988).
pub(super) fn fractal(cells: [usize; 2], size: f32, h: f32, family: Family) -> Field {
    let mut levels = Vec::new();
    while let Some(counts) = lattice(cells, size, levels.len()) {
        let mut rng = family.member(levels.len() as u64);
        let scale = (-(levels.len() as f32) * h).exp2();
        let heights: Vec<f32> = (0..counts[0] * counts[1])
            .map(|_| {
                let g: f32 = StandardNormal.sample(&mut rng);
                g * scale
            })
            .collect();
        levels.push(Field { size: counts, values: heights });
    }
    Field::new(cells, |x, y| {
        levels
            .iter()
            .map(|level| {
                let at =
                    |i: usize, axis: usize| (i as f32 + 0.5) / cells[axis] as f32 * level.size[axis] as f32;
                let (x, y) = (at(x, 0), at(y, 1));
                let (wx, wy) = (spline(x.fract()), spline(y.fract()));
                let row = |j: usize| {
                    let value = |i: usize| wx[i] * level.at(x as i64 + i as i64 - 1, y as i64 + j as i64 - 1);
                    wy[j] * (0..4).map(value).sum::<f32>()
                };
                (0..4).map(row).sum::<f32>()
            })
            .sum()
    })
}

/// A block of rock: its middle in its field, its offset and its tilt.
#[derive(Clone, Copy)]
struct Block {
    middle: Vec2,
    offset: f32,
    tilt: Vec2,
}

/// Blocks of one level, one in each field of a grid.
struct Blocks {
    counts: [usize; 2],
    blocks: Vec<Block>,
}

impl Blocks {
    /// Height of the block at a place, in units of its level, and nearness to its border, 0 to 1. The place
    /// is counted in fields.
    fn at(&self, place: Vec2) -> [f32; 2] {
        let [columns, rows] = self.counts.map(|n| n as i64);
        let field = place.floor();
        let (mut nearest, mut second) = ((f32::INFINITY, 0.0), f32::INFINITY);
        for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
            let [i, j] = [(field.x as i64 + dx).rem_euclid(columns), (field.y as i64 + dy).rem_euclid(rows)];
            let block = &self.blocks[(j * columns + i) as usize];
            let way = place - field - Vec2::new(dx as f32, dy as f32) - block.middle;
            let distance = way.length();
            if distance < nearest.0 {
                second = nearest.0;
                nearest = (distance, block.offset + block.tilt.dot(way));
            } else {
                second = second.min(distance);
            }
        }
        let gap = (second - nearest.0) / CRACK_WIDTH;
        [nearest.1, (-gap * gap).exp()]
    }
}

/// Broken rock: blocks with flat, tilted faces, on levels as those of [`fractal`], and nearness to open
/// cracks, 0 to 1. `beds` is the share by which blocks are long and tilt alike, as layers are that come out
/// of a slope.
pub(super) fn blocks(cells: [usize; 2], size: f32, h: f32, beds: f32, family: Family) -> [Field; 2] {
    let mut levels = Vec::new();
    while let Some(counts) = lattice(cells, size, levels.len()) {
        // Small pieces of a bed are as long as high, and tilt to any side.
        let beds = beds * (-(levels.len() as f32) * BED_DECAY).exp2();
        let long = 1.0 + beds * (BED_LENGTH - 1.0);
        let counts = [((counts[0] as f32 / long).round() as usize).max(1), counts[1]];
        let mut rng = family.member(levels.len() as u64);
        let mut draw = || {
            let middle = Vec2::new(rng.random(), rng.random());
            let [a, b, c]: [f32; 3] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            let tilt = Vec2::new(a, b * (1.0 - 0.6 * beds)) * BLOCK_TILT + Vec2::Y * (BED_TILT * beds);
            Block { middle, offset: c * BLOCK_OFFSET, tilt }
        };
        let blocks = (0..counts[0] * counts[1]).map(|_| draw()).collect();
        levels.push(Blocks { counts, blocks });
    }
    let place = |level: &Blocks, x: usize, y: usize| {
        let at = |i: usize, axis: usize| (i as f32 + 0.5) / cells[axis] as f32 * level.counts[axis] as f32;
        Vec2::new(at(x, 0), at(y, 1))
    };
    let height = Field::new(cells, |x, y| {
        let of = |(n, level): (usize, &Blocks)| (-(n as f32) * h).exp2() * level.at(place(level, x, y))[0];
        levels.iter().enumerate().map(of).sum()
    });
    let crack = Field::new(cells, |x, y| {
        let of = |(n, level): (usize, &Blocks)| (-(n as f32) * h).exp2() * level.at(place(level, x, y))[1];
        levels.iter().take(CRACKED_LEVELS).enumerate().map(of).fold(0.0, f32::max)
    });
    [height, crack]
}
