//! Storage of a volume's cells: dense (all of them) or sparse (the non-empty ones, in bricks).

use std::ops::Index;
use std::sync::Arc;

use rayon::iter::Either;
use rayon::prelude::*;

use super::{Bricks, Cell};

/// Cells of a volume. They are shared: a copy costs nothing, and a copy of them on a device can be recognised
/// by their address.
///
/// Both forms have the same order, x fastest, then y, then z, and compare equal if their cells are equal.
#[derive(Clone, Debug)]
pub enum Cells {
    /// All cells.
    Dense(Arc<Vec<Cell>>),
    /// The cells that are not empty.
    Sparse(Arc<Bricks>),
}

impl Cells {
    /// Number of cells, empty ones included.
    pub fn len(&self) -> usize {
        match self {
            Cells::Dense(cells) => cells.len(),
            Cells::Sparse(bricks) => bricks.size().iter().map(|&n| n as usize).product(),
        }
    }

    /// Whether there are no cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The stored cells. Every non-empty cell is stored.
    pub fn stored(&self) -> &[Cell] {
        match self {
            Cells::Dense(cells) => cells,
            Cells::Sparse(bricks) => bricks.stored(),
        }
    }

    /// All cells, if the storage is dense.
    pub fn dense(&self) -> Option<&Arc<Vec<Cell>>> {
        match self {
            Cells::Dense(cells) => Some(cells),
            Cells::Sparse(_) => None,
        }
    }

    /// The bricks, if the storage is sparse.
    pub fn bricks(&self) -> Option<&Arc<Bricks>> {
        match self {
            Cells::Dense(_) => None,
            Cells::Sparse(bricks) => Some(bricks),
        }
    }

    /// Size of the cells on the host, bytes.
    pub fn bytes(&self) -> u64 {
        match self {
            Cells::Dense(cells) => size_of_val(cells.as_slice()) as u64,
            Cells::Sparse(bricks) => bricks.bytes(),
        }
    }

    /// Iterates over all cells in their order, empty ones included.
    pub fn iter(&self) -> impl Iterator<Item = &Cell> {
        match self {
            Cells::Dense(cells) => Either::Left(cells.iter()),
            Cells::Sparse(bricks) => {
                let [nx, ny, nz] = bricks.size();
                let row = move |y, z| (0..nx).map(move |x| bricks.at(x, y, z));
                Either::Right((0..nz).flat_map(move |z| (0..ny).flat_map(move |y| row(y, z))))
            }
        }
    }

    /// Whether both share one piece of memory.
    pub fn same(&self, other: &Cells) -> bool {
        match (self, other) {
            (Cells::Dense(a), Cells::Dense(b)) => Arc::ptr_eq(a, b),
            (Cells::Sparse(a), Cells::Sparse(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }

    /// Address of the cells in memory.
    pub fn address(&self) -> usize {
        match self {
            Cells::Dense(cells) => Arc::as_ptr(cells).addr(),
            Cells::Sparse(bricks) => Arc::as_ptr(bricks).addr(),
        }
    }

    /// Replaces every stored cell by `new(linear index in the volume, index among the stored cells, cell)`.
    pub fn change(&mut self, new: impl Fn(u64, usize, Cell) -> Cell + Sync) {
        match self {
            Cells::Dense(cells) => Arc::make_mut(cells)
                .par_iter_mut()
                .enumerate()
                .with_min_len(4096)
                .for_each(|(i, cell)| *cell = new(i as u64, i, *cell)),
            Cells::Sparse(bricks) => Arc::make_mut(bricks).change(new),
        }
    }

    /// Sums the ρ codes of each layer of `area` cells, from z = 0 on.
    pub fn layer_codes(&self, area: usize) -> Vec<u64> {
        match self {
            Cells::Dense(cells) => cells
                .par_chunks(area)
                .map(|layer| layer.iter().map(|cell| u64::from(cell.rho_code())).sum())
                .collect(),
            Cells::Sparse(bricks) => bricks.layer_codes(),
        }
    }

    /// Sums the ρ codes of each layer of `area` cells by the codes of k_s, from z = 0 on.
    pub fn layer_codes_by_k_s(&self, area: usize) -> Vec<[u64; 256]> {
        let of_layer = |layer: &[Cell]| {
            let mut sums = [0u64; 256];
            layer.iter().for_each(|cell| sums[cell.k_codes().1 as usize] += u64::from(cell.rho_code()));
            sums
        };
        match self {
            Cells::Dense(cells) => cells.par_chunks(area).map(of_layer).collect(),
            Cells::Sparse(bricks) => bricks.layer_codes_by_k_s(),
        }
    }

    /// CRC-32 of the bytes of all cells in their order.
    pub(super) fn checksum(&self) -> crc32fast::Hasher {
        match self {
            Cells::Dense(cells) => {
                let mut hasher = crc32fast::Hasher::new();
                hasher.update(bytemuck::cast_slice(cells));
                hasher
            }
            Cells::Sparse(bricks) => bricks.checksum(),
        }
    }
}

impl Default for Cells {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl From<Vec<Cell>> for Cells {
    fn from(cells: Vec<Cell>) -> Self {
        Cells::Dense(Arc::new(cells))
    }
}

impl From<Bricks> for Cells {
    fn from(bricks: Bricks) -> Self {
        Cells::Sparse(Arc::new(bricks))
    }
}

impl Index<usize> for Cells {
    type Output = Cell;

    /// Returns the cell with this linear index. In bricks this is slower than [`super::VolumeTexture::cell`],
    /// which takes x, y and z.
    #[inline]
    fn index(&self, index: usize) -> &Cell {
        match self {
            Cells::Dense(cells) => &cells[index],
            Cells::Sparse(bricks) => {
                let [nx, ny, _] = bricks.size().map(|n| n as usize);
                bricks.at((index % nx) as u32, (index / nx % ny) as u32, (index / nx / ny) as u32)
            }
        }
    }
}

impl PartialEq for Cells {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Cells::Dense(a), Cells::Dense(b)) => a == b,
            (Cells::Sparse(a), Cells::Sparse(b)) if a == b => true,
            _ => self.len() == other.len() && self.iter().eq(other.iter()),
        }
    }
}
