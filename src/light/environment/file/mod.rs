//! Environment maps in files: Radiance `.hdr` (RGBE, XYZE) and OpenEXR `.exr`.
//!
//! [`radiance`] and [`open_exr`] decode. [`crate::util::colour`] leads from the file's colour space to linear
//! Rec. 709, which a file without a word about its colours is taken for.
//!
//! Values of an `.hdr` file are divided by its EXPOSURE and COLORCORR. An alpha channel is ignored, because
//! the colours of an EXR are multiplied by it already. Values below zero, which resampling leaves beside
//! bright texels, are replaced by 0 and counted. An infinite value of an EXR becomes the largest that a half
//! can hold. A file with a value that is not a number or larger than [`MAX_RADIANCE`] is refused.

mod open_exr;
mod radiance;

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::Path;

use super::map::Map;
use crate::util::error::{Error, Result};

/// Maximum radiance of a texel. The sun's disc has 2e5.
pub const MAX_RADIANCE: f32 = 1e9;
/// Maximum size of a file's header, bytes.
const HEADER_BYTES: u64 = 1 << 20;
/// Maximum number of columns or rows. A texture coordinate in float32 cannot distinguish more.
const MAX_SIDE: u64 = 1 << 17;
/// Memory per texel, bytes: on the host, on the device, and in the decoder's own copy.
const TEXEL_BYTES: u128 = 16 + 16 + 16;

/// Map read from a file.
#[derive(Debug)]
pub struct FileMap {
    /// The map.
    pub map: Map,
    /// Number of values below zero that were replaced by 0.
    pub negative: u64,
    /// Notes on the file for the user, a sentence each.
    pub notes: Vec<String>,
}

/// Reads a map. The size that the file states is compared with `budget`, in bytes, before memory is allocated
/// for it.
///
/// # Errors
/// - [`Error::Input`], which names the file, if the file is missing, of another format or broken, or if it
///   holds a value that is not a radiance.
/// - [`Error::Memory`] if the map is too large.
/// - [`Error::Io`] if the file cannot be read.
pub fn read(path: &Path, budget: u64) -> Result<FileMap> {
    let meta = std::fs::metadata(path).map_err(|e| match e.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => bad_with(path, e, "check the path"),
        _ => Error::read(path, e),
    })?;
    if !meta.is_file() {
        return Err(bad_with(path, "not a regular file", "give the path of the map's file"));
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let file = || File::open(path).map(BufReader::new).map_err(|e| Error::read(path, e));
    match extension.as_deref() {
        Some("hdr") => radiance::read(path, file()?, budget),
        Some("exr") => {
            let mut file = file()?;
            if file.fill_buf().map_err(|e| Error::read(path, e))?.starts_with(b"#?") {
                return Err(bad_with(path, "it starts with #?", "it is a Radiance file: name it .hdr"));
            }
            open_exr::read(path, file, budget)
        }
        _ => Err(bad_with(
            path,
            "its name ends in neither .hdr nor .exr",
            "open the map in a program that knows its format, and save it as .hdr or .exr, which also hold \
             light brighter than white",
        )),
    }
}

/// Advice on a file that ends too early or holds what is impossible.
const DAMAGED: &str = "the file is cut short or damaged: copy or export it again";

fn bad(path: &Path, why: impl std::fmt::Display) -> Error {
    bad_with(path, why, "give an equirectangular map as Radiance .hdr or as .exr with channels R, G and B")
}

/// An error with its own way out.
fn bad_with(path: &Path, why: impl std::fmt::Display, fix: &str) -> Error {
    // Messages of libraries may span several lines.
    let why = why.to_string().replace(['\n', '\r'], " ");
    Error::input(format!("environment map {}: {why}", path.display()), fix)
}

/// Reads the bytes that may hold the header.
fn start_of(path: &Path, file: &mut BufReader<File>) -> Result<Vec<u8>> {
    let mut start = Vec::new();
    file.take(HEADER_BYTES).read_to_end(&mut start).map_err(|e| Error::read(path, e))?;
    Ok(start)
}

/// Turns an error of reading into one of the program. A file that ends too early or contains impossible
/// offsets is broken; any other failure is an I/O error.
fn unreadable(path: &Path, e: std::io::Error) -> Error {
    match e.kind() {
        ErrorKind::UnexpectedEof | ErrorKind::InvalidInput | ErrorKind::InvalidData => {
            bad_with(path, e, DAMAGED)
        }
        _ => Error::read(path, e),
    }
}

fn check_size(path: &Path, width: u64, height: u64, more_bytes: u128, budget: u64) -> Result<()> {
    if width == 0 || height == 0 {
        return Err(bad(path, format!("{width}×{height} texels")));
    }
    let need = u128::from(width) * u128::from(height) * TEXEL_BYTES + more_bytes;
    if need > u128::from(budget) {
        return Err(Error::memory(
            format!("environment map {} of {width}×{height} texels", path.display()),
            need,
            budget,
            "make it smaller or raise --memory",
        ));
    }
    if width.max(height) > MAX_SIDE {
        let what = format!("{width}×{height} texels: at most {MAX_SIDE} on a side");
        return Err(bad_with(path, what, "scale it down"));
    }
    Ok(())
}

/// Replaces negative and subnormal values by 0, and refuses a map with a value that is not a radiance.
fn checked(path: &Path, mut map: Map, notes: Vec<String>) -> Result<FileMap> {
    let mut negative = 0;
    for (i, texel) in map.texels.iter_mut().enumerate() {
        for value in &mut texel[..3] {
            if !value.is_finite() || *value > MAX_RADIANCE {
                let (x, y) = (i % map.width as usize, i / map.width as usize);
                return Err(bad_with(
                    path,
                    format!("texel ({x}, {y}) has the radiance {value}: 0 to {MAX_RADIANCE:e} are allowed"),
                    match value.is_finite() {
                        true => "divide the map by a number, and raise environment.intensity by it",
                        false => "replace what is no number, by 0 for example, and save the map again",
                    },
                ));
            }
            negative += u64::from(*value < 0.0);
            *value = value.max(0.0);
            if !value.is_normal() {
                *value = 0.0;
            }
        }
    }
    Ok(FileMap { map, negative, notes })
}
