//! Boxes of empty cells that rays of the GPU engine leap over. Every empty cell holds the size of an empty
//! box ahead of it.
//!
//! A cell has one box for each octant of directions. The box begins with the cell, extends along the octant,
//! and is 1, 2, 4 or 8 cells long along each axis. It continues into the copies of the volume in x and y, but
//! no side is longer than the tile; above and below the slab everything is empty. Sides are doubled in turn
//! along y, z and x as long as the box stays empty. y comes first because strands, and so the gaps between
//! them, lie along y.
//!
//! The exponents of the sides are stored in place of k and v, which a cell without density does not need:
//!
//! | word | bits | value |
//! |---|---|---|
//! | x | 0–15 | 0: no density |
//! | x | 16–31 | exponents along z, two bits for each octant |
//! | y | 0–15 | exponents along x |
//! | y | 16–31 | exponents along y |
//!
//! The number of an octant has bit 0 set if x decreases, bit 1 if y does and bit 2 if z does. Only the levels
//! that walks read ([`super::Pyramid`]) hold boxes; the volume's own cells stay unchanged.
//!
//! Measured share of their cells that view rays still visit:
//!
//! | stored in empty cells | `fig5` | water of `waterfall` |
//! |---|---|---|
//! | distance to the nearest occupied cell in any direction, 8 bits | 0.66 | 0.83 |
//! | one distance for each octant | 0.40 | 0.60 |
//! | these boxes | 0.29 | 0.46 |
//!
//! Distances do less because the occupied cell nearest to a ray behind a strand is the strand itself, and
//! because gaps are long and thin.

use rayon::prelude::*;

use super::{Cell, VolumeTexture};

/// Exponents (0 to 3) along x, y and z of the sides of an empty cell's box for an octant.
#[inline]
pub fn box_exponents(cell: Cell, octant: u32) -> [u32; 3] {
    let shift = 2 * octant;
    [cell.y >> shift & 3, cell.y >> (16 + shift) & 3, cell.x >> (16 + shift) & 3]
}

/// Number of layers whose boxes are computed at once, with 8 bytes of memory per cell.
const SLAB: usize = 32;
/// Number of layers on either side of a slab that its boxes reach into.
const REACH: usize = 7;

/// Share of boxes of 2×2×2 cells that must be empty for leaps to be worth their cost in every step of a walk.
const WORTHWHILE_SHARE: f64 = 0.9;
/// Approximate number of boxes that are examined to measure that share.
const SAMPLE_BOXES: usize = 1 << 18;

/// Whether walks through a volume are faster with leaps.
pub fn worth_leaping(volume: &VolumeTexture) -> bool {
    empty_share(volume) >= WORTHWHILE_SHARE
}

/// Share of the boxes of 2×2×2 cells that are empty, measured in some of the rows along x.
pub fn empty_share(volume: &VolumeTexture) -> f64 {
    let [nx, ny, nz] = volume.size.map(|n| n as usize);
    let rows = ny * nz;
    let stride = (rows * nx / SAMPLE_BOXES).max(1);
    // A step without a common factor with ny, so that the rows of successive layers differ in y.
    let stride = (stride..).find(|s| gcd(*s, ny) == 1).unwrap_or(1);
    let count = |row: usize| {
        let (y, z) = (row % ny, row / ny);
        let (next_y, next_z) = ((y + 1) % ny, (z + 1).min(nz - 1));
        let starts = [(y, z), (next_y, z), (y, next_z), (next_y, next_z)].map(|(y, z)| (z * ny + y) * nx);
        let is_empty = |x: usize| starts.iter().all(|start| volume.cells[start + x].rho_code() == 0);
        (0..nx).filter(|&x| is_empty(x) && is_empty((x + 1) % nx)).count()
    };
    let examined = rows.div_ceil(stride) * nx;
    let empty: usize = (0..rows).into_par_iter().step_by(stride).map(count).sum();
    empty as f64 / examined as f64
}

/// Greatest common divisor.
fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Returns a copy of the volume with boxes in its empty cells. If rays interpolate between cells (`between`),
/// a cell counts as empty only if its 26 neighbours are empty too.
///
/// # Panics
/// Panics if the storage is sparse: cells that are not stored have no room for boxes.
pub fn with_boxes(volume: &VolumeTexture, between: bool) -> VolumeTexture {
    let cells = volume.cells.dense().expect("the storage is dense");
    let mut full: Vec<bool> = cells.par_iter().map(|cell| cell.rho_code() > 0).collect();
    if between {
        full = widened(volume.size, full);
    }
    let [nx, ny, nz] = volume.size.map(|n| n as usize);
    let mut cells = cells.to_vec();
    for first in (0..nz).step_by(SLAB) {
        let layers = SLAB.min(nz - first);
        let masks = Masks::new(volume.size, &full, first, layers);
        let slab = first * nx * ny..(first + layers) * nx * ny;
        cells[slab.clone()]
            .par_chunks_mut(nx)
            .zip(full[slab].par_chunks(nx))
            .enumerate()
            .for_each(|(row, (cells, full))| masks.row(row % ny, row / ny, cells, full));
    }
    VolumeTexture { cells: cells.into(), ..volume.clone() }
}

/// Marks the cells that are full or have a full neighbour among the 26 around them.
fn widened(size: [u32; 3], mut full: Vec<bool>) -> Vec<bool> {
    let [nx, ny, nz] = size.map(|n| n as usize);
    for (stride, n, wraps) in [(1, nx, true), (nx, ny, true), (nx * ny, nz, false)] {
        let is_near_full = |i: usize| {
            let c = i / stride % n;
            let before = if c > 0 {
                i - stride
            } else if wraps {
                i + (n - 1) * stride
            } else {
                i
            };
            let after = if c + 1 < n {
                i + stride
            } else if wraps {
                i - (n - 1) * stride
            } else {
                i
            };
            full[i] || full[before] || full[after]
        };
        full = (0..full.len()).into_par_iter().map(is_near_full).collect();
    }
    full
}

/// Empty boxes of a slab of layers. Bit lx + 4·ly + 16·lz of a cell's word is set if the box that begins at
/// the cell, extends upwards along every axis and has the sides 2^lx, 2^ly and 2^lz is empty.
struct Masks {
    /// nx, ny, nz of the volume, cells.
    size: [usize; 3],
    /// One word for each cell of the slab and of [`REACH`] layers on either side of it.
    words: Vec<u64>,
}

impl Masks {
    /// Masks of the `layers` layers from `first` on. `full` marks the occupied cells of the whole volume.
    fn new(size: [u32; 3], full: &[bool], first: usize, layers: usize) -> Self {
        let size @ [nx, ny, nz] = size.map(|n| n as usize);
        let layer = nx * ny;
        let mut words = vec![0u64; (layers + 2 * REACH) * layer];
        words.par_chunks_mut(layer).enumerate().for_each(|(i, words)| {
            match (first + i).checked_sub(REACH).filter(|&z| z < nz) {
                None => words.fill(1),
                Some(z) => {
                    let full = &full[z * layer..(z + 1) * layer];
                    words.iter_mut().zip(full).for_each(|(word, &full)| *word = u64::from(!full));
                }
            }
            double_along_x(words, nx);
            double_along_y(words, nx, ny);
        });
        double_along_z(&mut words, nx, layer);
        Masks { size, words }
    }

    /// Offsets in `words`, along one axis, at which the boxes of the four sides begin that extend upwards
    /// from coordinate `at` and downwards from it. Cells are `stride` words apart, and coordinates wrap
    /// around at `n`; 0 is an axis that does not wrap. The offset of a side longer than the tile does not
    /// matter, because no bit is set for such a side.
    fn starts(at: usize, n: usize, stride: usize) -> [[usize; 4]; 2] {
        [
            [at * stride; 4],
            [1, 2, 4, 8].map(|side| (at + n * usize::from(at + 1 < side)).saturating_sub(side - 1) * stride),
        ]
    }

    /// Writes the boxes of the empty cells of one row. `z` counts layers from the first of the slab.
    fn row(&self, y: usize, z: usize, cells: &mut [Cell], full: &[bool]) {
        let [nx, ny, _] = self.size;
        let ys = Self::starts(y, ny, nx);
        let zs = Self::starts(z + REACH, 0, nx * ny);
        for (x, cell) in cells.iter_mut().enumerate().filter(|(_, cell)| cell.rho_code() == 0) {
            *cell = Cell::default();
            if full[x] {
                continue;
            }
            let xs = Self::starts(x, nx, 1);
            for octant in 0..8 {
                let [xs, ys, zs] = [xs[octant & 1], ys[octant >> 1 & 1], zs[octant >> 2]];
                let is_empty = |[x, y, z]: [usize; 3]| {
                    self.words[xs[x] + ys[y] + zs[z]] >> (x + 4 * y + 16 * z) & 1 == 1
                };
                let l = largest_box(is_empty);
                cell.y |= ((l[0] | l[1] << 16) << (2 * octant)) as u32;
                cell.x |= (l[2] << (16 + 2 * octant)) as u32;
            }
        }
    }
}

/// Exponents along x, y and z of the sides of the largest empty box. Sides are doubled in turn along y, z and
/// x, and an axis whose doubling fails once is not tried again.
fn largest_box(is_empty: impl Fn([usize; 3]) -> bool) -> [usize; 3] {
    if is_empty([3; 3]) {
        return [3; 3];
    }
    let mut l = [0usize; 3];
    let mut grows = [true; 3];
    while grows != [false; 3] {
        for axis in [1, 2, 0] {
            let mut longer = l;
            longer[axis] += 1;
            grows[axis] = grows[axis] && longer[axis] < 4 && is_empty(longer);
            l = if grows[axis] { longer } else { l };
        }
    }
    l
}

/// Exponents l whose side 2^l can be doubled without becoming longer than a tile of `n` cells.
fn doublings(n: usize) -> impl Iterator<Item = u32> {
    (0..3u32).take_while(move |&l| 2usize << l <= n)
}

/// Sets the bits of boxes that are longer along x, in one layer: a box is empty if both its halves are.
fn double_along_x(words: &mut [u64], nx: usize) {
    for l in doublings(nx) {
        let with_side = 0x1111_1111_1111_1111u64 << l;
        for row in words.chunks_mut(nx) {
            for x in 0..nx {
                let next = row[(x + (1 << l)) % nx];
                row[x] |= (row[x] & next & with_side) << 1;
            }
        }
    }
}

/// Sets the bits of boxes that are longer along y, in one layer.
fn double_along_y(words: &mut [u64], nx: usize, ny: usize) {
    for l in doublings(ny) {
        let with_side = 0x000f_000f_000f_000fu64 << (4 * l);
        for y in 0..ny {
            let (row, next) = (y * nx, (y + (1 << l)) % ny * nx);
            for x in 0..nx {
                words[row + x] |= (words[row + x] & words[next + x] & with_side) << 4;
            }
        }
    }
}

/// Sets the bits of boxes that are longer along z, in layers of `layer` words. z does not wrap around.
fn double_along_z(words: &mut [u64], nx: usize, layer: usize) {
    let layers = words.len() / layer;
    for l in 0..3 {
        let with_side = 0xffffu64 << (16 * l);
        for z in 0..layers.saturating_sub(1 << l) {
            let (own, next) = words[z * layer..].split_at_mut(layer << l);
            own[..layer].par_chunks_mut(nx).zip(next[..layer].par_chunks(nx)).for_each(|(own, next)| {
                own.iter_mut().zip(next).for_each(|(own, next)| *own |= (*own & next & with_side) << 16);
            });
        }
    }
}
