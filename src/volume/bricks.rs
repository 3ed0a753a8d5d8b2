//! Sparse storage: bricks of 4×4×4 cells, whose non-empty cells are stored in sequence.
//!
//! A brick is a mask of 64 bits, bit x + 4y + 16z set where that cell is stored, and a base: the cell is
//! number base + popcount(mask below its bit) of all that are stored. An empty brick stores none. Bricks
//! follow one another as cells do, x fastest, then y, then z, and so do their cells.
//!
//! Why cells and not whole bricks: strands through 1024³ cells that fill 2 % of them leave a column of 8×8
//! cells 1.3 strands each, so few bricks of 8³ are empty, and whole ones would store most of the 8 GiB. Masks
//! and bases of all bricks take 12 bytes for 64 cells, 0.2 GiB there, and the stored cells 8 bytes each. A
//! coarser grid above, of 16³ cells, would leave 2 % of that away (a column of 16×16 has 4 strands), for one
//! more look-up in every step of every walk.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::IVec3;
use rayon::prelude::*;

use super::Cell;

/// Cells of a brick along each axis.
pub const BRICK: u32 = 4;

/// Value of a cell that is not stored.
static EMPTY: Cell = Cell { x: 0, y: 0 };

/// Bricks of a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Bricks {
    size: [u32; 3],
    grid: [u32; 3],
    masks: Vec<u64>,
    bases: Vec<u32>,
    cells: Vec<Cell>,
}

/// Bricks along each axis of a volume of `size` cells.
pub fn grid(size: [u32; 3]) -> [u32; 3] {
    size.map(|n| n.div_ceil(BRICK))
}

/// The bit of a cell in its brick.
#[inline]
fn bit(x: u32, y: u32, z: u32) -> u32 {
    (x & 3) | (y & 3) << 2 | (z & 3) << 4
}

/// Iterates over the indices of the set bits, from the lowest.
fn bits(mut mask: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = (mask != 0).then(|| mask.trailing_zeros())?;
        mask &= mask - 1;
        Some(bit)
    })
}

impl Bricks {
    /// nx, ny, nz.
    pub fn size(&self) -> [u32; 3] {
        self.size
    }

    /// Bricks along each axis.
    pub fn grid(&self) -> [u32; 3] {
        self.grid
    }

    /// The stored cells, brick by brick.
    pub fn stored(&self) -> &[Cell] {
        &self.cells
    }

    /// Mask and base of every brick, as the shader reads them (`rgba32uint`): the mask's low and high half,
    /// and the numbers of the first cells of either half.
    pub fn texels(&self, bricks: std::ops::Range<usize>) -> Vec<[u32; 4]> {
        let of = |(&mask, &base): (&u64, &u32)| {
            let low = mask as u32;
            [low, (mask >> 32) as u32, base, base + low.count_ones()]
        };
        self.masks[bricks.clone()].par_iter().zip(&self.bases[bricks]).map(of).collect()
    }

    /// Bytes of a volume of `size` cells of which `stored` are: on the host, and on a device.
    pub fn bytes_of(size: [u32; 3], stored: u64) -> [u128; 2] {
        let bricks = grid(size).iter().map(|&n| u128::from(n)).product::<u128>();
        let cells = u128::from(stored) * size_of::<Cell>() as u128;
        [bricks * (8 + 4) + cells, bricks * size_of::<[u32; 4]>() as u128 + cells]
    }

    /// Bytes on the host.
    pub fn bytes(&self) -> u64 {
        Bricks::bytes_of(self.size, self.cells.len() as u64)[0] as u64
    }

    #[inline]
    fn number(&self, x: u32, y: u32, z: u32) -> usize {
        let [bx, by, bz] = [x / BRICK, y / BRICK, z / BRICK].map(|n| n as usize);
        (bz * self.grid[1] as usize + by) * self.grid[0] as usize + bx
    }

    /// Returns the index of a cell among the stored cells.
    #[inline]
    pub fn place(&self, x: u32, y: u32, z: u32) -> Option<usize> {
        let brick = self.number(x, y, z);
        let (mask, own) = (self.masks[brick], 1u64 << bit(x, y, z));
        (mask & own != 0).then(|| self.bases[brick] as usize + (mask & (own - 1)).count_ones() as usize)
    }

    /// The cell, inside the volume.
    #[inline]
    pub fn at(&self, x: u32, y: u32, z: u32) -> &Cell {
        self.place(x, y, z).map_or(&EMPTY, |place| &self.cells[place])
    }

    /// The cell, inside the volume, if it is stored.
    #[inline]
    pub(super) fn at_mut(&mut self, x: u32, y: u32, z: u32) -> Option<&mut Cell> {
        self.place(x, y, z).map(|place| &mut self.cells[place])
    }

    /// Stores the non-empty ones of `cells`, which holds all nx·ny·nz cells in index order.
    pub fn of(size: [u32; 3], cells: &[Cell]) -> Bricks {
        let area = size[0] as usize * size[1] as usize;
        let mut packer = Packer::new(size);
        cells.chunks(area * BRICK as usize).for_each(|layers| packer.push(layers));
        packer.finish()
    }

    /// First linear index of a brick's cells along x, y and z, cells.
    fn origin(&self, brick: usize) -> [u64; 3] {
        let [gx, gy, _] = self.grid.map(|n| n as usize);
        [brick % gx, brick / gx % gy, brick / gx / gy].map(|n| n as u64 * u64::from(BRICK))
    }

    /// Stored cells of each layer of bricks.
    pub(super) fn layers(&self) -> Vec<usize> {
        let area = self.grid[0] as usize * self.grid[1] as usize;
        let starts: Vec<usize> = self.bases.iter().step_by(area).map(|&base| base as usize).collect();
        let all = self.bases.last().zip(self.masks.last());
        let all = all.map_or(0, |(&base, mask)| (base + mask.count_ones()) as usize);
        let ends = starts.iter().skip(1).copied().chain([all]);
        starts.iter().zip(ends).map(|(start, end)| end - start).collect()
    }

    /// Implements [`super::Cells::change`].
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
                for (place, bit) in (base..).zip(bits(self.masks[brick])) {
                    let bit = u64::from(bit);
                    let index = ((z + (bit >> 4)) * ny + y + (bit >> 2 & 3)) * nx + x + (bit & 3);
                    let cell = &mut cells[place - first];
                    *cell = new(index, place, *cell);
                }
            }
        });
        self.cells = cells;
    }

    /// Σ ρ code of each layer of cells.
    pub(super) fn layer_codes(&self) -> Vec<u64> {
        let area = self.grid[0] as usize * self.grid[1] as usize;
        let of_layer = |layer: usize| {
            let mut sums = [0u64; BRICK as usize];
            for brick in layer * area..(layer + 1) * area {
                for (place, bit) in (self.bases[brick] as usize..).zip(bits(self.masks[brick])) {
                    sums[bit as usize >> 4] += u64::from(self.cells[place].rho_code());
                }
            }
            sums
        };
        let sums = (0..self.grid[2] as usize).into_par_iter().flat_map_iter(of_layer);
        let mut sums: Vec<u64> = sums.collect();
        sums.truncate(self.size[2] as usize);
        sums
    }

    /// Implements [`super::Cells::checksum`].
    pub(super) fn checksum(&self) -> crc32fast::Hasher {
        let [nx, ny, nz] = self.size;
        let of_layer = |z: u32| {
            let mut hasher = crc32fast::Hasher::new();
            let mut row = vec![EMPTY; nx as usize];
            for y in 0..ny {
                row.fill(EMPTY);
                for x in (0..nx).step_by(BRICK as usize) {
                    if self.masks[self.number(x, y, z)] >> bit(0, y, z) & 15 != 0 {
                        (x..nx.min(x + BRICK)).for_each(|x| row[x as usize] = *self.at(x, y, z));
                    }
                }
                hasher.update(bytemuck::cast_slice(&row));
            }
            hasher
        };
        let layers: Vec<crc32fast::Hasher> = (0..nz).into_par_iter().map(of_layer).collect();
        let mut all = crc32fast::Hasher::new();
        layers.iter().for_each(|layer| all.combine(layer));
        all
    }
}

/// Cuts `all` into parts of these lengths.
pub(super) fn parted<'a, T>(mut all: &'a mut [T], lengths: &[usize]) -> Vec<&'a mut [T]> {
    let mut parts = Vec::with_capacity(lengths.len());
    for &length in lengths {
        let (part, rest) = all.split_at_mut(length);
        parts.push(part);
        all = rest;
    }
    parts
}

/// Marks the cells that a volume will store, from many threads.
pub(super) struct Marks {
    size: [u32; 3],
    masks: Vec<AtomicU64>,
}

impl Marks {
    /// None yet.
    pub fn new(size: [u32; 3]) -> Marks {
        let count = grid(size).iter().map(|&n| n as usize).product();
        Marks { size, masks: (0..count).into_par_iter().map(|_| AtomicU64::new(0)).collect() }
    }

    /// One inside the volume.
    #[inline]
    pub fn add(&self, cell: IVec3) {
        let [gx, gy, _] = grid(self.size).map(|n| n as usize);
        let [x, y, z] = cell.to_array().map(|c| c as u32);
        let [bx, by, bz] = [x / BRICK, y / BRICK, z / BRICK].map(|n| n as usize);
        let (mask, own) = (&self.masks[(bz * gy + by) * gx + bx], 1 << bit(x, y, z));
        // Most are noted before: a look takes less than a change.
        if mask.load(Ordering::Relaxed) & own == 0 {
            mask.fetch_or(own, Ordering::Relaxed);
        }
    }

    /// How many are noted.
    pub fn count(&self) -> u64 {
        self.masks.par_iter().map(|mask| u64::from(mask.load(Ordering::Relaxed).count_ones())).sum()
    }

    /// Bricks that will store them; the cells themselves come later ([`Bricks::fill`]).
    ///
    /// # Panics
    /// If they are more than 2³² − 1.
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
    /// Sets the stored cells, in storage order.
    pub(super) fn fill(&mut self, cells: Vec<Cell>) {
        self.cells = cells;
    }
}

/// Packs a volume that arrives four layers at a time.
pub(super) struct Packer {
    bricks: Bricks,
}

impl Packer {
    /// Nothing yet, of nx·ny·nz cells.
    pub fn new(size: [u32; 3]) -> Packer {
        let grid = grid(size);
        Packer { bricks: Bricks { size, grid, masks: Vec::new(), bases: Vec::new(), cells: Vec::new() } }
    }

    /// Cells stored so far.
    pub fn count(&self) -> u64 {
        self.bricks.cells.len() as u64
    }

    /// The next four layers, or the last few; at most 2³² − 1 cells are stored in all.
    pub fn push(&mut self, layers: &[Cell]) {
        let Bricks { size, grid, masks, bases, cells } = &mut self.bricks;
        let [nx, ny] = [size[0], size[1]].map(|n| n as usize);
        let deep = layers.len() / (nx * ny);
        for (by, bx) in (0..grid[1] as usize).flat_map(|by| (0..grid[0] as usize).map(move |bx| (by, bx))) {
            bases.push(cells.len() as u32);
            let mut mask = 0u64;
            let far = |b: usize, n: usize| 4 * b..n.min(4 * b + 4);
            for z in 0..deep {
                for y in far(by, ny) {
                    for x in far(bx, nx) {
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

    /// The whole.
    pub fn finish(mut self) -> Bricks {
        self.bricks.cells.shrink_to_fit();
        self.bricks
    }
}
