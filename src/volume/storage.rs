//! Choice between dense and sparse storage, and the memory that each takes.

use super::{Bricks, Cell, WaterSpec};
use crate::util::error::{Error, Result};
use crate::util::words::words;

/// Form in which a volume's cells are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Storage {
    /// All cells are stored.
    #[default]
    Dense,
    /// The non-empty cells are stored, in bricks.
    Sparse,
}

/// Storage that a scene asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StorageChoice {
    /// Dense if that fits the memory, otherwise sparse.
    #[default]
    Auto,
    /// Always dense.
    Dense,
    /// Always sparse.
    Sparse,
}

words! { StorageChoice { Auto => "auto", Dense => "dense", Sparse => "sparse" } }

/// Bytes that a dense volume of `size` cells takes while a picture is rendered. The host holds the cells and
/// a copy whose empty cells hold boxes to leap over; the device holds one copy. Coarse levels (`pyramid`) add
/// a seventh on the host and up to three quarters on the device.
pub fn dense_bytes(size: [u32; 3], pyramid: bool) -> u128 {
    let per_cell = size_of::<Cell>() * if pyramid { 4 } else { 3 };
    cells(size) * per_cell as u128
}

/// Bytes that a sparse volume of `size` cells takes, of which `stored` are stored. This is the larger of two
/// needs: building takes `extra` bytes for each stored cell beside the volume on the host, and a picture
/// takes a copy on the device beside it.
pub fn sparse_bytes(size: [u32; 3], stored: u64, extra: usize) -> u128 {
    let [host, device] = Bricks::bytes_of(size, stored);
    host + device.max(u128::from(stored) * extra as u128)
}

/// Number of cells of a volume of `size`.
fn cells(size: [u32; 3]) -> u128 {
    size.iter().map(|&n| u128::from(n)).product()
}

/// Chooses the storage of a water volume within `memory` bytes, of which a picture needs `beside` for other
/// things. Allocates nothing of the volume's size.
///
/// # Errors
/// [`Error::Memory`] if the volume does not fit. The number of cells that curves pass is not known yet, so
/// [`super::build_sparse_water`] checks again.
pub fn storage_of(spec: &WaterSpec, asked: StorageChoice, memory: u64, beside: u64) -> Result<Storage> {
    let fits = check_budget(spec.size, spec.strand_bytes(), memory);
    let is_drawable = dense_bytes(spec.size, false) + u128::from(beside) <= u128::from(memory);
    choose(asked, fits, is_drawable, check_sparse(spec, 0, memory))
}

/// Chooses the storage of a volume file of `size` cells within `memory` bytes.
///
/// # Errors
/// [`Error::Memory`] if the volume does not fit.
pub(super) fn file_storage(size: [u32; 3], asked: StorageChoice, memory: u64) -> Result<Storage> {
    choose(asked, check_budget(size, 0, memory), true, check_stored(size, 0, 0, memory))
}

/// Chooses between the two forms. `dense` and `sparse` say whether each can be built, `is_drawable` whether a
/// dense volume can also be rendered. Auto is dense if both hold, or if sparse storage does not fit either.
fn choose(asked: StorageChoice, dense: Result<()>, is_drawable: bool, sparse: Result<()>) -> Result<Storage> {
    match asked {
        StorageChoice::Dense => dense.map(|()| Storage::Dense),
        StorageChoice::Sparse => sparse.map(|()| Storage::Sparse),
        StorageChoice::Auto if sparse.is_err() || (dense.is_ok() && is_drawable) => {
            dense.map(|()| Storage::Dense)
        }
        StorageChoice::Auto => Ok(Storage::Sparse),
    }
}

/// Checks, before anything is allocated, that a dense volume of `size` cells can be built within `budget`
/// bytes. Building takes the packed cell, one vector and `extra` bytes for each cell.
///
/// # Errors
/// [`Error::Memory`] if it does not fit.
pub fn check_budget(size: [u32; 3], extra: usize, budget: u64) -> Result<()> {
    let per_cell = (size_of::<Cell>() + size_of::<glam::Vec3>() + extra) as u128;
    let need = cells(size) * per_cell;
    if need > budget as u128 {
        let [nx, ny, nz] = size;
        return Err(Error::memory(
            format!("a volume of {nx}×{ny}×{nz} cells (volume.nx, ny, nz)"),
            need,
            budget,
            "lower volume.nx, volume.ny or volume.nz, or raise --memory; volume.storage=sparse (without \
             trace.filter=pyramid) takes less where most cells are empty",
        ));
    }
    Ok(())
}

/// Checks that a sparse water volume fits into `memory` bytes if curves pass at least `stored` of its cells.
///
/// # Errors
/// [`Error::Memory`] if it does not fit.
pub(super) fn check_sparse(spec: &WaterSpec, stored: u64, memory: u64) -> Result<()> {
    check_stored(spec.size, stored, size_of::<glam::Vec3>() + spec.strand_bytes(), memory)
}

/// Checks that a sparse volume fits into `memory` bytes. The other parameters are those of [`sparse_bytes`].
///
/// # Errors
/// [`Error::Memory`] if it does not fit, or if more than 2³² − 1 cells are stored.
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
            format!("{what}, {stored} of them stored sparsely,"),
            "lower curves.across, curves.deep, volume.nx, volume.ny or volume.nz, or raise --memory",
        ),
    };
    Err(Error::memory(what, need, memory, fix))
}
