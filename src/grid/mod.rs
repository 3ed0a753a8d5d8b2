//! Grids that simulations wrote: OpenVDB, NanoVDB and NumPy.
//!
//! A [`Grid`] has numbers or vectors at the integer points of an index space, and a transform that takes an
//! index to the place of its **sample** in the world: the centre of the cell of a fog volume. It is sparse:
//! [blocks](Grid::blocks) of 8×8×8 samples and constant tiles; what no block covers has the background.
//!
//! Files are not trusted. The memory that a grid takes is known before it is taken, all of its numbers are
//! finite (those that no active sample has are [mended](Grid::mended)), and a fault is reported with its
//! file, its grid and its byte.
//!
//! # Conventions
//!
//! - Units are those of the program that wrote the file. A transform may turn, shear and mirror.
//! - Component a of the vectors of a [staggered](Class::Staggered) grid belongs half a voxel lower along axis
//!   a.
//! - Numbers are float32. Other types are rounded to it on reading.

mod blosclz;
mod branches;
mod builder;
mod codec;
mod nanovdb;
mod npz;
mod openvdb;
mod order;
mod own;
mod save;
mod source;
mod statistics;
mod tree;

use std::io::Read;
use std::path::Path;

use glam::DAffine3;

pub use builder::{Builder, Misplaced};
pub use nanovdb::encode_nvdb;
pub use openvdb::encode_vdb;
pub use own::own;
pub(crate) use save::GridFile;
pub use save::{write_nvdb, write_vdb};
pub use statistics::Statistics;
pub use tree::{Block, BlockData, Grid, Reader};

use crate::util::error::{Error, Result};

/// Meaning of a grid's numbers, as far as its file says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Class {
    /// The file does not say.
    #[default]
    Unknown,
    /// Densities.
    FogVolume,
    /// Distances to a surface, negative inside.
    LevelSet,
    /// Vectors whose components belong to the lower faces of the cells.
    Staggered,
}

impl Class {
    /// The words of OpenVDB.
    pub fn words(self) -> &'static str {
        match self {
            Class::Unknown => "unknown",
            Class::FogVolume => "fog volume",
            Class::LevelSet => "level set",
            Class::Staggered => "staggered",
        }
    }
}

/// Box of indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Least index along each axis.
    pub min: [i32; 3],
    /// Greatest index along each axis, which is part of the box.
    pub max: [i32; 3],
}

impl Bounds {
    /// Number of indices along each axis.
    pub fn size(&self) -> [u64; 3] {
        std::array::from_fn(|a| (i64::from(self.max[a]) - i64::from(self.min[a]) + 1).max(0) as u64)
    }

    /// The smallest box that holds both.
    pub fn union(self, other: Bounds) -> Bounds {
        Bounds {
            min: std::array::from_fn(|a| self.min[a].min(other.min[a])),
            max: std::array::from_fn(|a| self.max[a].max(other.max[a])),
        }
    }
}

/// What a file tells about one of its grids without its voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Name by which [`read`] finds the grid.
    pub name: String,
    /// Type of the numbers in the words of the format, such as `float`, `vec3s` or `Fp16`.
    pub kind: String,
    /// What the numbers mean.
    pub class: Class,
    /// Active samples, where the file says how many.
    pub active: Option<u64>,
    /// Bounds of the active samples, where the file says.
    pub bounds: Option<Bounds>,
    /// Transform from index to world; `None` where it is not affine.
    pub to_world: Option<DAffine3>,
    /// Compression of the numbers in the file, such as `blosc + active mask`.
    pub compression: String,
    /// Why the grid cannot be read, and what to do; `None` where it can.
    pub refusal: Option<String>,
}

/// Tells whether a file is one from which grids are read: a .vdb or an .nvdb by its extension, an .npz by its
/// arrays, because it may hold a [volume texture](crate::volume) instead.
pub fn is_grid(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    match extension.to_str() {
        Some("vdb" | "nvdb") => true,
        Some("npz") => npz::has_grids(path),
        _ => false,
    }
}

/// Lists the grids of a file (.vdb, .nvdb, .npz) without reading their voxels. The content decides which
/// format it is. `budget` bounds the memory that this may take, bytes.
///
/// # Errors
/// [`Error::Input`] where there is no such file or it is broken, [`Error::Memory`] where the budget does not
/// suffice, [`Error::Io`] where the disk fails.
pub fn list(path: &Path, budget: u64) -> Result<Vec<Summary>> {
    match format(path)? {
        Format::OpenVdb => openvdb::list(path),
        Format::NanoVdb => nanovdb::list(path, budget),
        Format::Npz => npz::list(path),
    }
}

/// Reads one grid by its name. The file and the grid together take at most `budget` bytes.
///
/// # Errors
/// Those of [`list`], and [`Error::Input`] where there is no such grid or it is of a kind that is not read.
pub fn read(path: &Path, name: &str, budget: u64) -> Result<Grid> {
    match format(path)? {
        Format::OpenVdb => openvdb::read(path, name, budget),
        Format::NanoVdb => nanovdb::read(path, name, budget),
        Format::Npz => npz::read(path, name, budget),
    }
}

enum Format {
    OpenVdb,
    NanoVdb,
    Npz,
}

/// Format of a file by its first bytes.
fn format(path: &Path) -> Result<Format> {
    if own(path).is_some() {
        return Ok(Format::OpenVdb);
    }
    let mut start = Vec::new();
    source::open(path)?.take(8).read_to_end(&mut start).map_err(|e| Error::read(path, e))?;
    if start == openvdb::MAGIC {
        return Ok(Format::OpenVdb);
    }
    if nanovdb::is_magic(&start) {
        return Ok(Format::NanoVdb);
    }
    if start.starts_with(npz::MAGIC) {
        return Ok(Format::Npz);
    }
    Err(Error::input(
        format!("{} is neither OpenVDB, NanoVDB nor .npz", path.display()),
        "export the simulation as .vdb, or save arrays with numpy.savez(file, density=density)",
    ))
}

/// Name of a grid, also of one without.
fn named(name: String) -> String {
    if name.is_empty() { "grid".into() } else { name }
}

/// Number of the grid `wanted` among the names of a file.
fn find<'a>(path: &Path, wanted: &str, names: impl Iterator<Item = &'a str> + Clone) -> Result<usize> {
    if let Some(found) = names.clone().position(|name| name == wanted) {
        return Ok(found);
    }
    let listed: Vec<String> =
        names.clone().take(8).map(|name| name.chars().take(32).collect::<String>()).collect();
    let more = if names.count() > 8 { " and others" } else { "" };
    let fix = match listed.is_empty() {
        true => "the file has no grid".into(),
        false => format!("it has {}{more}", listed.join(", ")),
    };
    Err(Error::input(format!("{}: there is no grid {wanted:?}", path.display()), fix))
}

/// Refuses a transform that is not finite or takes a dimension away.
fn checked(transform: DAffine3) -> std::result::Result<DAffine3, (String, String)> {
    match transform.is_finite() && transform.matrix3.inverse().is_finite() {
        true => Ok(transform),
        false => Err((
            "its transform has no inverse".into(),
            "give its voxels a size other than 0 in the program that made it".into(),
        )),
    }
}
