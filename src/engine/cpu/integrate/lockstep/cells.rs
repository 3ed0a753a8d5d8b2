//! Cells of one level for eight rays: fetched ray by ray, decoded side by side.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, u32x8};

use super::walk::{NO_CELL, Units};
use crate::trace::lookup::Level;
use crate::util::lanes::{Floats, Ints, LANES, Lanes3, Words, signed};
use crate::volume::{Bricks, Cell, Cells};

/// Cells of `N` steps, as the walk passes them.
pub type Row<const N: usize> = [[Cell; LANES]; N];

/// The cells of a level, found by an index in the units of the walk.
#[derive(Clone, Copy)]
pub struct Store<'a> {
    cells: Stored<'a>,
    /// Units of the index.
    pub units: Units,
}

#[derive(Clone, Copy)]
enum Stored<'a> {
    Dense(&'a [Cell]),
    Sparse(&'a Bricks),
}

impl<'a> Store<'a> {
    /// Cells of a level. `None` if the level is too large for an index.
    pub fn new(level: &Level<'a>) -> Option<Self> {
        let size = level.volume.size;
        Some(match &level.volume.cells {
            Cells::Dense(cells) => Store { cells: Stored::Dense(cells), units: Units::linear(size)? },
            Cells::Sparse(bricks) => Store { cells: Stored::Sparse(bricks), units: Units::apart(size)? },
        })
    }

    /// Coordinates of the cell with this index.
    #[inline]
    pub fn coordinates(&self, index: i32) -> [u32; 3] {
        let index = index as u32;
        match self.cells {
            Stored::Dense(_) => {
                let [nx, ny, _] = self.units.size.as_uvec3().to_array();
                [index % nx, index / nx % ny, index / nx / ny]
            }
            Stored::Sparse(_) => {
                let side = (1 << Units::BITS) - 1;
                [index & side, index >> Units::BITS & side, index >> (2 * Units::BITS)]
            }
        }
    }

    /// Linear indices of cells, as light volumes have them; outside of them for no cell.
    #[inline(always)]
    pub fn linear(&self, index: &[i32; LANES]) -> [usize; LANES] {
        let mut out = [0; LANES];
        match self.cells {
            Stored::Dense(_) => out.iter_mut().zip(index).for_each(|(out, &i)| *out = i as u32 as usize),
            Stored::Sparse(bricks) => {
                let [nx, ny, _] = bricks.size().map(|n| n as usize);
                for (out, &index) in out.iter_mut().zip(index) {
                    let [x, y, z] = self.coordinates(index).map(|c| c as usize);
                    *out = (z * ny + y) * nx + x;
                }
            }
        }
        out
    }

    /// The cell with this index. No cell is an empty one.
    #[inline(always)]
    pub fn cell(&self, index: i32) -> Cell {
        match self.cells {
            Stored::Dense(cells) => dense(cells, index),
            Stored::Sparse(bricks) => self.sparse(bricks, index),
        }
    }

    /// Fetches the cells of one lane, one in each row of indices, and shows them in turn.
    #[inline(always)]
    pub fn lane(&self, rows: &[[i32; LANES]], lane: usize, mut show: impl FnMut(usize, Cell)) {
        match self.cells {
            Stored::Dense(cells) => {
                for (row, index) in rows.iter().enumerate() {
                    show(row, dense(cells, index[lane]));
                }
            }
            Stored::Sparse(bricks) => {
                for (row, index) in rows.iter().enumerate() {
                    show(row, self.sparse(bricks, index[lane]));
                }
            }
        }
    }

    /// Fetches the cells of some steps. No cell is an empty one.
    #[inline(always)]
    pub fn fetch(&self, index: &[[i32; LANES]], row: &mut [[Cell; LANES]]) {
        match self.cells {
            Stored::Dense(cells) => fetch_by(index, row, |index| dense(cells, index)),
            Stored::Sparse(bricks) => fetch_by(index, row, |index| self.sparse(bricks, index)),
        }
    }

    /// The cell with this index. Lanes that have left the volume look behind it.
    #[inline(always)]
    fn sparse(&self, bricks: &Bricks, index: i32) -> Cell {
        let [x, y, z] = self.coordinates(index);
        let [nx, ny, nz] = bricks.size();
        let is_inside = index != NO_CELL && x < nx && y < ny && z < nz;
        if is_inside { *bricks.at(x, y, z) } else { Cell::default() }
    }
}

#[inline(always)]
fn dense(cells: &[Cell], index: i32) -> Cell {
    cells.get(index as u32 as usize).copied().unwrap_or_default()
}

#[inline(always)]
fn fetch_by(index: &[[i32; LANES]], row: &mut [[Cell; LANES]], cell: impl Fn(i32) -> Cell) {
    for (i, cells) in index.iter().zip(row) {
        *cells =
            [cell(i[0]), cell(i[1]), cell(i[2]), cell(i[3]), cell(i[4]), cell(i[5]), cell(i[6]), cell(i[7])];
    }
}

/// Both words of eight cells.
#[inline(always)]
pub fn words<S: Simd>(simd: S, cells: &[Cell; LANES]) -> [Words<S>; 2] {
    let words: &[u32] = bytemuck::cast_slice(cells);
    let (low, high) = words.split_at(LANES);
    let (low, high) = (u32x8::from_slice(simd, low), u32x8::from_slice(simd, high));
    [low.unzip_low(high), low.unzip_high(high)]
}

/// ρ codes of the cells' first words.
#[inline(always)]
pub fn rho_codes<S: Simd>(first: Words<S>) -> Floats<S> {
    whole(signed(first & 0xffff))
}

/// Codes of k_d and k_s of the cells' first words.
#[inline(always)]
pub fn k_codes<S: Simd>(first: Words<S>) -> [Floats<S>; 2] {
    [whole(signed((first >> 16) & 0xff)), whole(signed(first >> 24))]
}

/// Codes of v of the cells' second words.
#[inline(always)]
pub fn v_codes<S: Simd>(second: Words<S>) -> Lanes3<S> {
    let component = |shift: u32| whole(signed(second << shift) >> 22);
    Lanes3 { x: component(22), y: component(12), z: component(2) }
}

/// Whole numbers as floats.
#[inline(always)]
fn whole<S: Simd>(ints: Ints<S>) -> Floats<S> {
    ints.to_float::<f32x8<S>>()
}
