//! Boxes for leaps: every empty cell stores which box of cells ahead of it is also empty.
//!
//! There is a box for each octant of directions. It begins with the cell and is 1, 2, 4 or 8 cells long along
//! each axis, the way the octant goes; copies of the volume go on in x and y (a side is never longer than a
//! tile), and nothing lies above or below the slab. Sides are doubled in turn, along y, z and x, as long as
//! the box stays empty: strands lie along y, so do the gaps between them. The exponents of the sides stand
//! where a cell without density has no use for k and v:
//!
//! | word | bits | what |
//! |---|---|---|
//! | x | 0–15 | 0: no density |
//! | x | 16–31 | along z: two bits for each octant |
//! | y | 0–15 | along x |
//! | y | 16–31 | along y |
//!
//! The number of an octant has bit 0 set where x goes down, bit 1 for y and bit 2 for z. Only levels as walks
//! read them ([`super::Pyramid`]) hold boxes; the volume's own cells keep what they are.
//!
//! One distance to the nearest occupied cell in any direction, 8 bits, makes view rays through `fig5` and the
//! water of `waterfall` meet 0.66 and 0.83 of their cells, one for each octant 0.40 and 0.60, these boxes
//! 0.29 and 0.46: behind a strand the nearest occupied cell is the strand itself, and gaps are long and thin.

use rayon::prelude::*;

use super::{Cell, VolumeTexture};

/// Returns the exponents of the sides, 0 to 3, of an empty cell's box for an octant.
#[inline]
pub fn box_exponents(cell: Cell, octant: u32) -> [u32; 3] {
    let shift = 2 * octant;
    [cell.y >> shift & 3, cell.y >> (16 + shift) & 3, cell.x >> (16 + shift) & 3]
}

/// Returns the exponents as [`box_exponents`] if a leap costs a CPU less than the steps it saves.
#[inline]
pub fn large_box(cell: Cell, octant: u32) -> Option<[u32; 3]> {
    let exponents = box_exponents(cell, octant);
    (exponents.iter().sum::<u32>() >= LARGE).then_some(exponents)
}

/// Sum of exponents of boxes that processors leap over: of 4×4×4 cells and the like. A leap waits for the
/// cell and takes as long as some five steps, which go ahead before it is known.
const LARGE: u32 = 6;

/// Layers whose boxes are worked out at once: eight bytes a cell.
const SLAB: usize = 32;
/// Layers on either side that their boxes extend into.
const REACH: usize = 7;

/// Share of boxes of 2×2×2 cells that have to be empty for leaps to be worth their cost in every turn of a
/// walk.
const WORTH: f64 = 0.9;
/// Approximate number of boxes sampled to estimate that fraction.
const LOOKS: usize = 1 << 18;

/// Returns whether walks through a volume gain by leaping.
pub fn worth_leaping(volume: &VolumeTexture) -> bool {
    empty_share(volume) >= WORTH
}

/// Estimates from some rows the fraction of boxes of 2×2×2 cells that are empty.
pub fn empty_share(volume: &VolumeTexture) -> f64 {
    let [nx, ny, nz] = volume.size.map(|n| n as usize);
    let rows = ny * nz;
    let stride = (rows * nx / LOOKS).max(1);
    // Rows far apart, by a step that has no factor in common with their number of a layer.
    let stride = (stride..).find(|s| gcd(*s, ny) == 1).unwrap_or(1);
    let count = |row: usize| {
        let (y, z) = (row % ny, row / ny);
        let (next_y, next_z) = ((y + 1) % ny, (z + 1).min(nz - 1));
        let starts = [(y, z), (next_y, z), (y, next_z), (next_y, next_z)].map(|(y, z)| (z * ny + y) * nx);
        let empty = |x: usize| starts.iter().all(|start| volume.cells[start + x].rho_code() == 0);
        (0..nx).filter(|&x| empty(x) && empty((x + 1) % nx)).count()
    };
    let looked = rows.div_ceil(stride) * nx;
    let empty: usize = (0..rows).into_par_iter().step_by(stride).map(count).sum();
    empty as f64 / looked as f64
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// The volume with boxes in its empty cells. `between`: for rays that look up what lies between cells, to
/// whom a cell is empty if its neighbours are, too.
///
/// # Panics
/// If not all cells are stored: there is no room for boxes in what is not.
pub fn with_boxes(volume: &VolumeTexture, between: bool) -> VolumeTexture {
    let cells = volume.cells.dense().expect("all cells are stored");
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

/// Marks the cells that are full or have a full one among their 26 neighbours.
fn widened(size: [u32; 3], mut full: Vec<bool>) -> Vec<bool> {
    let [nx, ny, nz] = size.map(|n| n as usize);
    for (stride, n, wraps) in [(1, nx, true), (nx, ny, true), (nx * ny, nz, false)] {
        let at = |i: usize| {
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
        full = (0..full.len()).into_par_iter().map(at).collect();
    }
    full
}

/// Which boxes are empty, of those that begin at a cell and go up along every axis: bit lx + 4·ly + 16·lz of
/// a cell's word stands for the sides 2^lx, 2^ly and 2^lz.
struct Masks {
    size: [usize; 3],
    /// [`REACH`] layers more than the slab on either side.
    words: Vec<u64>,
}

impl Masks {
    /// Computes the masks of a slab of layers.
    fn new(size: [u32; 3], full: &[bool], first: usize, layers: usize) -> Self {
        let size @ [nx, ny, nz] = size.map(|n| n as usize);
        let layer = nx * ny;
        // Bits of the boxes whose exponent along the axis is `l`.
        let along_x = |l: u32| 0x1111_1111_1111_1111u64 << l;
        let along_y = |l: u32| 0x000f_000f_000f_000fu64 << (4 * l);
        let along_z = |l: u32| 0xffffu64 << (16 * l);
        // A side is no longer than the tile.
        let fits = |n: usize| (0..3u32).take_while(move |&l| 2usize << l <= n);
        let mut words = vec![0u64; (layers + 2 * REACH) * layer];
        words.par_chunks_mut(layer).enumerate().for_each(|(i, words)| {
            match (first + i).checked_sub(REACH).filter(|&z| z < nz) {
                None => words.fill(1),
                Some(z) => {
                    let full = &full[z * layer..(z + 1) * layer];
                    words.iter_mut().zip(full).for_each(|(word, &full)| *word = u64::from(!full));
                }
            }
            for l in fits(nx) {
                for row in words.chunks_mut(nx) {
                    for x in 0..nx {
                        let next = row[(x + (1 << l)) % nx];
                        row[x] |= (row[x] & next & along_x(l)) << 1;
                    }
                }
            }
            for l in fits(ny) {
                for y in 0..ny {
                    let (row, next) = (y * nx, (y + (1 << l)) % ny * nx);
                    for x in 0..nx {
                        words[row + x] |= (words[row + x] & words[next + x] & along_y(l)) << 4;
                    }
                }
            }
        });
        for l in 0..3 {
            for z in 0..(layers + 2 * REACH).saturating_sub(1 << l) {
                let (own, next) = words[z * layer..].split_at_mut(layer << l);
                own[..layer].par_chunks_mut(nx).zip(next[..layer].par_chunks(nx)).for_each(|(own, next)| {
                    own.iter_mut().zip(next).for_each(|(own, next)| *own |= (*own & next & along_z(l)) << 16);
                });
            }
        }
        Masks { size, words }
    }

    /// Where in `words` a box of each side begins that goes up from place `at` of an axis, and one that goes
    /// down; cells are `stride` apart. A side longer than the tile is of no box: no bit is set for it.
    fn starts(at: usize, n: usize, stride: usize) -> [[usize; 4]; 2] {
        [
            [at * stride; 4],
            [1, 2, 4, 8].map(|side| (at + n * usize::from(at + 1 < side)).saturating_sub(side - 1) * stride),
        ]
    }

    /// The boxes of the empty cells of a row, its layer counted from the slab's first.
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
                let mut l = [0usize; 3];
                if is_empty([3; 3]) {
                    l = [3; 3];
                }
                let mut grows = [l[0] == 0; 3];
                while grows != [false; 3] {
                    for axis in [1, 2, 0] {
                        let mut longer = l;
                        longer[axis] += 1;
                        grows[axis] = grows[axis] && longer[axis] < 4 && is_empty(longer);
                        l = if grows[axis] { longer } else { l };
                    }
                }
                cell.y |= ((l[0] | l[1] << 16) << (2 * octant)) as u32;
                cell.x |= (l[2] << (16 + 2 * octant)) as u32;
            }
        }
    }
}
