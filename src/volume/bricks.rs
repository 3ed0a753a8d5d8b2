//! Sparse storage: bricks of 4×4×4 cells, of which only the non-empty cells are stored, one after the other.
//!
//! A brick has a mask of 64 bits and a base. Bit x + 4y + 16z of the mask is set if that cell of the brick is
//! stored; the cell's index among all stored cells is then base + popcount(mask below its bit). Bricks have
//! the order of cells, x fastest, then y, then z, and so have the cells of a brick.
//!
//! Single cells are stored and not whole bricks, because most bricks are not empty. Strands that fill 2 % of
//! 1024³ cells pass each column of 8×8 cells 1.3 times on average, so few bricks of 8³ cells are empty, and
//! whole bricks would store most of the 8 GiB. Masks and bases take 12 bytes for 64 cells, 0.2 GiB in that
//! volume, and each stored cell takes 8 bytes. A coarser grid of 16³ cells above the bricks would save 2 % of
//! the 0.2 GiB (a column of 16×16 cells has 4 strands) and cost one more look-up in every step of every walk.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::IVec3;
use rayon::prelude::*;

use super::Cell;

/// Side of a brick, cells.
pub const BRICK: u32 = 4;

/// The cell that is read where none is stored.
static EMPTY: Cell = Cell { x: 0, y: 0 };

/// Cells of a volume in sparse storage.
#[derive(Clone, Debug, PartialEq)]
pub struct Bricks {
    size: [u32; 3],
    grid: [u32; 3],
    masks: Vec<u64>,
    bases: Vec<u32>,
    cells: Vec<Cell>,
}

/// Number of bricks along each axis of a volume of `size` cells.
pub fn grid(size: [u32; 3]) -> [u32; 3] {
    size.map(|n| n.div_ceil(BRICK))
}

/// Bit of a cell in the mask of its brick.
#[inline]
fn bit(x: u32, y: u32, z: u32) -> u32 {
    (x & 3) | (y & 3) << 2 | (z & 3) << 4
}

/// Iterates over the bits of `mask` that are set, from the lowest.
fn bits(mut mask: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = (mask != 0).then(|| mask.trailing_zeros())?;
        mask &= mask - 1;
        Some(bit)
    })
}

impl Bricks {
    /// nx, ny, nz, cells.
    pub fn size(&self) -> [u32; 3] {
        self.size
    }

    /// Number of bricks along each axis.
    pub fn grid(&self) -> [u32; 3] {
        self.grid
    }

    /// The stored cells, brick by brick.
    pub fn stored(&self) -> &[Cell] {
        &self.cells
    }

    /// Masks and bases of a range of bricks, as the shader reads them (`rgba32uint`): the low and the high
    /// half of the mask, and the index of the first stored cell of each half. The stored cells of this volume
    /// begin at index `first`.
    pub fn texels(&self, bricks: std::ops::Range<usize>, first: u32) -> Vec<[u32; 4]> {
        let texel = |(&mask, &base): (&u64, &u32)| {
            let low = mask as u32;
            [low, (mask >> 32) as u32, first + base, first + base + low.count_ones()]
        };
        self.masks[bricks.clone()].par_iter().zip(&self.bases[bricks]).map(texel).collect()
    }

    /// Bytes of a volume of `size` cells of which `stored` are stored: on the host, and on a device.
    pub fn bytes_of(size: [u32; 3], stored: u64) -> [u128; 2] {
        let bricks = grid(size).iter().map(|&n| u128::from(n)).product::<u128>();
        let cells = u128::from(stored) * size_of::<Cell>() as u128;
        [bricks * (8 + 4) + cells, bricks * size_of::<[u32; 4]>() as u128 + cells]
    }

    /// Size on the host, bytes.
    pub fn bytes(&self) -> u64 {
        Bricks::bytes_of(self.size, self.cells.len() as u64)[0] as u64
    }

    /// Index of the brick that holds a cell.
    #[inline]
    fn brick_index(&self, x: u32, y: u32, z: u32) -> usize {
        let [bx, by, bz] = [x / BRICK, y / BRICK, z / BRICK].map(|n| n as usize);
        (bz * self.grid[1] as usize + by) * self.grid[0] as usize + bx
    }

    /// Index of a cell among the stored cells, or `None` if it is not stored.
    #[inline]
    pub fn stored_index(&self, x: u32, y: u32, z: u32) -> Option<usize> {
        let brick = self.brick_index(x, y, z);
        let (mask, own) = (self.masks[brick], 1u64 << bit(x, y, z));
        (mask & own != 0).then(|| self.bases[brick] as usize + (mask & (own - 1)).count_ones() as usize)
    }

    /// The cell at x, y, z, which must lie inside the volume.
    #[inline]
    pub fn at(&self, x: u32, y: u32, z: u32) -> &Cell {
        self.stored_index(x, y, z).map_or(&EMPTY, |index| &self.cells[index])
    }

    /// The cell at x, y, z, which must lie inside the volume, or `None` if it is not stored.
    #[inline]
    pub(super) fn at_mut(&mut self, x: u32, y: u32, z: u32) -> Option<&mut Cell> {
        self.stored_index(x, y, z).map(|index| &mut self.cells[index])
    }

    /// Packs the nx·ny·nz `cells` of a dense volume. Stores those that are not empty.
    pub fn of(size: [u32; 3], cells: &[Cell]) -> Bricks {
        let area = size[0] as usize * size[1] as usize;
        let mut packer = Packer::new(size);
        cells.chunks(area * BRICK as usize).for_each(|layers| packer.push(layers));
        packer.finish()
    }

    /// Lowest x, y and z of a brick's cells.
    fn origin(&self, brick: usize) -> [u64; 3] {
        let [gx, gy, _] = self.grid.map(|n| n as usize);
        [brick % gx, brick / gx % gy, brick / gx / gy].map(|n| n as u64 * u64::from(BRICK))
    }

    /// Number of stored cells in each layer of bricks.
    pub(super) fn layers(&self) -> Vec<usize> {
        let area = self.grid[0] as usize * self.grid[1] as usize;
        let starts: Vec<usize> = self.bases.iter().step_by(area).map(|&base| base as usize).collect();
        let all = self.bases.last().zip(self.masks.last());
        let all = all.map_or(0, |(&base, mask)| (base + mask.count_ones()) as usize);
        let ends = starts.iter().skip(1).copied().chain([all]);
        starts.iter().zip(ends).map(|(start, end)| end - start).collect()
    }

    /// Replaces every stored cell, as [`super::Cells::change`] does.
    pub(super) fn change(&mut self, new: impl Fn(u64, usize, Cell) -> Cell + Sync) {
        let area = self.grid[0] as usize * self.grid[1] as usize;
        let [nx, ny, _] = self.size.map(u64::from);
        let lengths = self.layers();
        let mut cells = std::mem::take(&mut self.cells);
        let layers = parted(&mut cells, &lengths);
        layers.into_par_iter().enumerate().for_each(|(layer, cells)| {
            let first = self.bases[layer * area] as usize;
            for brick in layer * area..(layer + 1) * area {
                let ([x, y, z], base) = (self.origin(brick), self.bases[brick] as usize);
                for (stored, bit) in (base..).zip(bits(self.masks[brick])) {
                    let bit = u64::from(bit);
                    let index = ((z + (bit >> 4)) * ny + y + (bit >> 2 & 3)) * nx + x + (bit & 3);
                    let cell = &mut cells[stored - first];
                    *cell = new(index, stored, *cell);
                }
            }
        });
        self.cells = cells;
    }

    /// Sums the ρ codes of each layer of cells, from z = 0 on.
    pub(super) fn layer_codes(&self) -> Vec<u64> {
        let area = self.grid[0] as usize * self.grid[1] as usize;
        let sums_of_layer = |layer: usize| {
            let mut sums = [0u64; BRICK as usize];
            for brick in layer * area..(layer + 1) * area {
                for (stored, bit) in (self.bases[brick] as usize..).zip(bits(self.masks[brick])) {
                    sums[bit as usize >> 4] += u64::from(self.cells[stored].rho_code());
                }
            }
            sums
        };
        let sums = (0..self.grid[2] as usize).into_par_iter().flat_map_iter(sums_of_layer);
        let mut sums: Vec<u64> = sums.collect();
        sums.truncate(self.size[2] as usize);
        sums
    }

    /// Sums the ρ codes of each layer of cells by the codes of k_s.
    pub(super) fn layer_codes_by_k_s(&self) -> Vec<[u64; 256]> {
        let area = self.grid[0] as usize * self.grid[1] as usize;
        let sums_of_layer = |layer: usize| {
            let mut sums = [[0u64; 256]; BRICK as usize];
            for brick in layer * area..(layer + 1) * area {
                for (stored, bit) in (self.bases[brick] as usize..).zip(bits(self.masks[brick])) {
                    let cell = self.cells[stored];
                    sums[bit as usize >> 4][cell.k_codes().1 as usize] += u64::from(cell.rho_code());
                }
            }
            sums
        };
        let sums = (0..self.grid[2] as usize).into_par_iter().flat_map_iter(sums_of_layer);
        let mut sums: Vec<[u64; 256]> = sums.collect();
        sums.truncate(self.size[2] as usize);
        sums
    }

    /// CRC-32 of the bytes of all cells in the order of dense storage.
    pub(super) fn checksum(&self) -> crc32fast::Hasher {
        let [nx, ny, nz] = self.size;
        let hash_of_layer = |z: u32| {
            let mut hasher = crc32fast::Hasher::new();
            let mut row = vec![EMPTY; nx as usize];
            for y in 0..ny {
                row.fill(EMPTY);
                for x in (0..nx).step_by(BRICK as usize) {
                    if self.masks[self.brick_index(x, y, z)] >> bit(0, y, z) & 15 != 0 {
                        (x..nx.min(x + BRICK)).for_each(|x| row[x as usize] = *self.at(x, y, z));
                    }
                }
                hasher.update(bytemuck::cast_slice(&row));
            }
            hasher
        };
        let layers: Vec<crc32fast::Hasher> = (0..nz).into_par_iter().map(hash_of_layer).collect();
        let mut all = crc32fast::Hasher::new();
        layers.iter().for_each(|layer| all.combine(layer));
        all
    }
}

/// Splits `all` into parts of these lengths.
pub(super) fn parted<'a, T>(mut all: &'a mut [T], lengths: &[usize]) -> Vec<&'a mut [T]> {
    let mut parts = Vec::with_capacity(lengths.len());
    for &length in lengths {
        let (part, rest) = all.split_at_mut(length);
        parts.push(part);
        all = rest;
    }
    parts
}

/// Marks of the cells that a volume will store, set from many threads.
pub(super) struct Marks {
    size: [u32; 3],
    masks: Vec<AtomicU64>,
}

impl Marks {
    /// Marks of a volume of `size` cells, none of them set.
    pub fn new(size: [u32; 3]) -> Marks {
        let count = grid(size).iter().map(|&n| n as usize).product();
        Marks { size, masks: (0..count).into_par_iter().map(|_| AtomicU64::new(0)).collect() }
    }

    /// Marks `cell`, which must lie inside the volume.
    #[inline]
    pub fn add(&self, cell: IVec3) {
        let [gx, gy, _] = grid(self.size).map(|n| n as usize);
        let [x, y, z] = cell.to_array().map(|c| c as u32);
        let [bx, by, bz] = [x / BRICK, y / BRICK, z / BRICK].map(|n| n as usize);
        let (mask, own) = (&self.masks[(bz * gy + by) * gx + bx], 1 << bit(x, y, z));
        // Most cells are already marked, and reading a mark takes less time than setting it.
        if mask.load(Ordering::Relaxed) & own == 0 {
            mask.fetch_or(own, Ordering::Relaxed);
        }
    }

    /// Number of marked cells.
    pub fn count(&self) -> u64 {
        self.masks.par_iter().map(|mask| u64::from(mask.load(Ordering::Relaxed).count_ones())).sum()
    }

    /// Bricks that will store the marked cells. [`Bricks::fill`] adds the cells themselves.
    ///
    /// # Panics
    /// Panics if more than 2³² − 1 cells are marked.
    pub fn bricks(self) -> Bricks {
        let masks: Vec<u64> = self.masks.into_iter().map(AtomicU64::into_inner).collect();
        let mut bases = Vec::with_capacity(masks.len());
        let mut sum = 0u32;
        for mask in &masks {
            bases.push(sum);
            sum = sum.checked_add(mask.count_ones()).expect("fewer than 2³² cells are stored");
        }
        Bricks { size: self.size, grid: grid(self.size), masks, bases, cells: Vec::new() }
    }
}

impl Bricks {
    /// Adds the stored cells, in the order of the bricks.
    pub(super) fn fill(&mut self, cells: Vec<Cell>) {
        self.cells = cells;
    }
}

/// Packer of a dense volume that arrives four layers at a time.
pub(super) struct Packer {
    bricks: Bricks,
}

impl Packer {
    /// Packer of a volume of `size` cells that has received no layers.
    pub fn new(size: [u32; 3]) -> Packer {
        let grid = grid(size);
        Packer { bricks: Bricks { size, grid, masks: Vec::new(), bases: Vec::new(), cells: Vec::new() } }
    }

    /// Number of cells stored so far.
    pub fn count(&self) -> u64 {
        self.bricks.cells.len() as u64
    }

    /// Packs the next four layers, or the last ones if fewer are left. At most 2³² − 1 cells may be stored in
    /// all.
    pub fn push(&mut self, layers: &[Cell]) {
        let Bricks { size, grid, masks, bases, cells } = &mut self.bricks;
        let [nx, ny] = [size[0], size[1]].map(|n| n as usize);
        let depth = layers.len() / (nx * ny);
        for (by, bx) in (0..grid[1] as usize).flat_map(|by| (0..grid[0] as usize).map(move |bx| (by, bx))) {
            bases.push(cells.len() as u32);
            let mut mask = 0u64;
            let cells_along = |b: usize, n: usize| 4 * b..n.min(4 * b + 4);
            for z in 0..depth {
                for y in cells_along(by, ny) {
                    for x in cells_along(bx, nx) {
                        let cell = layers[(z * ny + y) * nx + x];
                        if cell != EMPTY {
                            mask |= 1 << bit(x as u32, y as u32, z as u32);
                            cells.push(cell);
                        }
                    }
                }
            }
            masks.push(mask);
        }
    }

    /// Returns the packed volume.
    pub fn finish(mut self) -> Bricks {
        self.bricks.cells.shrink_to_fit();
        self.bricks
    }
}
