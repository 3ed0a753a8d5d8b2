//! Grids in NumPy's archives: every array of three axes, or of four with vectors.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};
use npyz::Order;
use zip::ZipArchive;

use super::source::{budget, open};
use super::tree::{REGION_BYTES, leaf_bytes};
use super::{Bounds, Class, Grid, Summary};
use crate::util::error::{Error, Result};
use crate::util::npy::{Number, Numbers, open_array};

/// First bytes of an archive.
pub(super) const MAGIC: &[u8] = b"PK\x03\x04";

const FORMAT: &str = "save density [nz,ny,nx], velocity [nz,ny,nx,3], origin [3] and voxel with numpy.savez";

type Zip = ZipArchive<BufReader<File>>;

/// An array that is a grid.
struct Array {
    name: String,
    number: Number,
    size: [u32; 3],
    channels: usize,
    is_fortran: bool,
    is_stored: bool,
}

fn fault(path: &Path, why: impl std::fmt::Display) -> Error {
    Error::input(format!("{}: {why}", path.display()), FORMAT)
}

fn archive(path: &Path) -> Result<Zip> {
    ZipArchive::new(BufReader::new(open(path)?)).map_err(|e| fault(path, format!("it is no .npz ({e})")))
}

/// Names of the arrays.
fn names(zip: &Zip) -> Vec<String> {
    let files = zip.file_names().filter_map(|file| file.ok());
    let mut names: Vec<String> =
        files.filter_map(|file| file.strip_suffix(".npy").map(str::to_owned)).collect();
    names.sort();
    names
}

/// Tells whether an archive has grids, and not a volume texture.
pub(super) fn has_grids(path: &Path) -> bool {
    archive(path).is_ok_and(|zip| {
        let names = names(&zip);
        let has = |wanted: &str| names.iter().any(|name| name == wanted);
        (has("density") || has("velocity")) && !has("rho")
    })
}

/// Reads the head of an array; `None` where it is no grid.
fn array(path: &Path, zip: &mut Zip, name: &str) -> Result<Option<Array>> {
    let file = zip.by_name(&npyz::npz::file_name_from_array_name(name));
    let file = file.map_err(|e| fault(path, format!("{name}: {e}")))?;
    let is_stored = file.compression() == zip::CompressionMethod::Stored;
    let (head, _) = open_array(file).map_err(|e| fault(path, format!("{name}: {e}")))?;
    let Some(number) = Number::of(&head.dtype()) else { return Ok(None) };
    let (shape, channels) = match *head.shape() {
        [nz, ny, nx] => ([nx, ny, nz], 1),
        [nz, ny, nx, 3] => ([nx, ny, nz], 3),
        _ => return Ok(None),
    };
    let [Ok(nx), Ok(ny), Ok(nz)] = shape.map(i32::try_from) else {
        return Err(fault(path, format!("{name}: its shape is {:?}", head.shape())));
    };
    let is_fortran = head.order() == Order::Fortran;
    let size = [nx, ny, nz].map(|n| n as u32);
    Ok(Some(Array { name: name.into(), number, size, channels, is_fortran, is_stored }))
}

/// Reads an array of 1 or 3 numbers; `None` where there is none.
fn numbers(path: &Path, zip: &mut Zip, name: &str) -> Result<Option<DVec3>> {
    let Ok(file) = zip.by_name(&npyz::npz::file_name_from_array_name(name)) else { return Ok(None) };
    let (head, bytes) = open_array(file).map_err(|e| fault(path, format!("{name}: {e}")))?;
    let count = head.shape().iter().product::<u64>();
    let number =
        Number::of(&head.dtype()).filter(|_| matches!((head.shape().len(), count), (0, 1) | (1, 1 | 3)));
    let Some(number) = number else {
        return Err(fault(path, format!("{name}: its shape is {:?}, not 1 or 3 numbers", head.shape())));
    };
    let mut read = Numbers::new(bytes, number, false, count);
    let mut next = || read.next().map(f64::from).map_err(|e| fault(path, format!("{name}: {e}")));
    let first = next()?;
    let found = if count == 3 { DVec3::new(first, next()?, next()?) } else { DVec3::splat(first) };
    Ok(Some(found))
}

/// Transform of all grids of the archive.
fn to_world(path: &Path, zip: &mut Zip) -> Result<std::result::Result<DAffine3, (String, String)>> {
    let voxel = numbers(path, zip, "voxel")?.unwrap_or(DVec3::ONE);
    let origin = numbers(path, zip, "origin")?.unwrap_or(DVec3::ZERO);
    Ok(super::checked(DAffine3::from_mat3_translation(DMat3::from_diagonal(voxel), origin)))
}

fn arrays(path: &Path, zip: &mut Zip) -> Result<Vec<Array>> {
    let mut found = Vec::new();
    for name in names(zip) {
        found.extend(array(path, zip, &name)?);
    }
    Ok(found)
}

pub(super) fn list(path: &Path) -> Result<Vec<Summary>> {
    let mut zip = archive(path)?;
    let to_world = to_world(path, &mut zip)?;
    let summary = |array: Array| {
        let [nx, ny, nz] = array.size;
        let is_empty = array.size.contains(&0);
        Summary {
            kind: format!("{}{}", array.number.words(), if array.channels == 3 { " × 3" } else { "" }),
            class: class(&array.name),
            active: u64::from(nx).checked_mul(u64::from(ny)).and_then(|n| n.checked_mul(u64::from(nz))),
            bounds: (!is_empty).then(|| Bounds { min: [0; 3], max: array.size.map(|n| n as i32 - 1) }),
            to_world: to_world.as_ref().ok().copied(),
            compression: if array.is_stored { "none" } else { "zip" }.into(),
            refusal: to_world.as_ref().err().map(|(why, fix)| format!("{why}; {fix}")),
            name: array.name,
        }
    };
    Ok(arrays(path, &mut zip)?.into_iter().map(summary).collect())
}

fn class(name: &str) -> Class {
    if name == "density" { Class::FogVolume } else { Class::Unknown }
}

pub(super) fn read(path: &Path, name: &str, bytes: u64) -> Result<Grid> {
    let mut zip = archive(path)?;
    let arrays = arrays(path, &mut zip)?;
    let array = &arrays[super::find(path, name, arrays.iter().map(|array| array.name.as_str()))?];
    let to_world = to_world(path, &mut zip)?
        .map_err(|(why, fix)| Error::input(format!("{}: {why}", path.display()), fix))?;
    let [nx, ny, nz] = array.size.map(|n| n as usize);
    let blocks = array.size.iter().fold(1u128, |n, side| n * u128::from(side.div_ceil(8)));
    let regions = array.size.iter().fold(1u128, |n, side| n * u128::from(side.div_ceil(128)));
    let count = array.size.iter().fold(array.channels as u128, |n, side| n * u128::from(*side));
    let leaves = blocks * u128::from(leaf_bytes(array.channels));
    let size = format!("{nx}×{ny}×{nz}");
    budget(bytes).take(4 * count + leaves + regions * u128::from(REGION_BYTES), || {
        format!("{}: {name} of {size} samples", path.display())
    })?;
    let file = zip.by_name(&npyz::npz::file_name_from_array_name(name));
    let file = file.map_err(|e| fault(path, format!("{name}: {e}")))?;
    let broken = |e: std::io::Error| fault(path, format!("{name}: {e}"));
    let (_, reader) = open_array(file).map_err(broken)?;
    let (count, channels) = (count as usize, array.channels);
    let mut read = Numbers::new(reader, array.number, false, count as u64);
    let mut values = Vec::new();
    if array.is_fortran {
        values.resize(count, 0.0);
    }
    for i in 0..count {
        let value = read.next().map_err(broken)?;
        // In Fortran order z is fastest and the channel slowest.
        let at = if array.is_fortran {
            let [z, y, x, channel] = [i % nz, i / nz % ny, i / nz / ny % nx, i / nz / ny / nx];
            channel + channels * (x + nx * (y + ny * z))
        } else {
            i
        };
        if !value.is_finite() {
            let cell = at / channels;
            let place = [cell / nx / ny, cell / nx % ny, cell % nx];
            let what = format!("{}: {name}: at {place:?}: it is {value}", path.display());
            return Err(Error::input(what, format!("{name} = numpy.nan_to_num({name}) mends it")));
        }
        if array.is_fortran {
            values[at] = value;
        } else {
            values.push(value);
        }
    }
    read.finish().map_err(broken)?;
    let mut grid = Grid::from_dense(name, channels, [0; 3], array.size, values, to_world);
    grid.class = class(name);
    Ok(grid)
}
