//! Choice between dense and sparse storage of a volume's cells, and the memory of each.

use super::{Bricks, Cell, WaterSpec};
use crate::util::error::{Error, Result};
use crate::util::words::words;

/// Storage of a volume's cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Storage {
    /// All cells are stored.
    #[default]
    Dense,
    /// Non-empty cells are stored in bricks.
    Sparse,
}

/// Storage that a scene asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StorageChoice {
    /// Dense if that fits into memory.
    #[default]
    Auto,
    /// All cells.
    Dense,
    /// In bricks.
    Sparse,
}

words! { StorageChoice { Auto => "auto", Dense => "dense", Sparse => "sparse" } }

/// Bytes of a volume of `size` cells, all stored, in a picture: on the host, there again where its empty
/// cells hold boxes to leap over, and on the device. Coarse levels (`pyramid`) take a seventh on the host,
/// and up to three quarters on the device.
pub fn dense_bytes(size: [u32; 3], pyramid: bool) -> u128 {
    let per_cell = size_of::<Cell>() * if pyramid { 4 } else { 3 };
    cells(size) * per_cell as u128
}

/// Bytes of a volume of `size` cells of which `stored` are stored in bricks: the most of building it, which
/// needs `extra` bytes for each of those, and of a picture, which needs it on host and device.
pub fn sparse_bytes(size: [u32; 3], stored: u64, extra: usize) -> u128 {
    let [host, device] = Bricks::bytes_of(size, stored);
    host + device.max(u128::from(stored) * extra as u128)
}

fn cells(size: [u32; 3]) -> u128 {
    size.iter().map(|&n| u128::from(n)).product()
}

/// Chooses the storage of a water volume within `memory` bytes. Allocates nothing of the volume's size.
///
/// # Errors
/// An error if it does not fit. The number of cells that the curves pass is not known yet;
/// [`super::build_sparse_water`] checks again.
pub fn storage_of(spec: &WaterSpec, asked: StorageChoice, memory: u64) -> Result<Storage> {
    let fits = check_budget(spec.size, spec.strand_bytes(), memory);
    let is_drawn = dense_bytes(spec.size, false) <= u128::from(memory);
    chosen(asked, fits, is_drawn, check_sparse(spec, 0, memory))
}

/// Chooses the storage of a volume file of `size` cells.
pub(super) fn file_storage(size: [u32; 3], asked: StorageChoice, memory: u64) -> Result<Storage> {
    chosen(asked, check_budget(size, 0, memory), true, check_stored(size, 0, 0, memory))
}

/// Resolves `Auto`: dense if that can be built and drawn, or if sparse storage does not help.
fn chosen(asked: StorageChoice, dense: Result<()>, is_drawn: bool, sparse: Result<()>) -> Result<Storage> {
    match asked {
        StorageChoice::Dense => dense.map(|()| Storage::Dense),
        StorageChoice::Sparse => sparse.map(|()| Storage::Sparse),
        StorageChoice::Auto if sparse.is_err() || (dense.is_ok() && is_drawn) => {
            dense.map(|()| Storage::Dense)
        }
        StorageChoice::Auto => Ok(Storage::Sparse),
    }
}

/// Checks before any allocation that a volume of `size` cells fits into `budget` bytes.
/// Building needs the packed cells and one vector per cell, and `extra` bytes more per cell.
pub fn check_budget(size: [u32; 3], extra: usize, budget: u64) -> Result<()> {
    let per_cell = (size_of::<Cell>() + size_of::<glam::Vec3>() + extra) as u128;
    let need = cells(size) * per_cell;
    if need > budget as u128 {
        let [nx, ny, nz] = size;
        return Err(Error::memory(
            format!("a volume of {nx}×{ny}×{nz} cells (volume.nx, ny, nz)"),
            need,
            budget,
            "lower volume.nx, volume.ny or volume.nz, or raise --memory; volume.storage=sparse \
             (without trace.filter=pyramid) takes less where most cells are empty",
        ));
    }
    Ok(())
}

/// Refuses a water volume whose curves pass at least `stored` cells, if these do not fit into `memory` bytes.
pub(super) fn check_sparse(spec: &WaterSpec, stored: u64, memory: u64) -> Result<()> {
    check_stored(spec.size, stored, size_of::<glam::Vec3>() + spec.strand_bytes(), memory)
}

/// Refuses sparse storage that needs more than `memory` bytes; parameters as in [`sparse_bytes`].
pub(super) fn check_stored(size: [u32; 3], stored: u64, extra: usize, memory: u64) -> Result<()> {
    let need = sparse_bytes(size, stored, extra);
    if need <= u128::from(memory) && stored <= u64::from(u32::MAX) {
        return Ok(());
    }
    let [nx, ny, nz] = size;
    let what = format!("a volume of {nx}×{ny}×{nz} cells (volume.nx, ny, nz)");
    let (what, fix) = match stored {
        0 => (what, "lower volume.nx, volume.ny or volume.nz, or raise --memory"),
        _ => (
            format!("{what}, stored sparse with {stored} of them,"),
            "lower curves.across, curves.deep, volume.nx, volume.ny or volume.nz, or raise --memory",
        ),
    };
    Err(Error::memory(what, need, memory, fix))
}
