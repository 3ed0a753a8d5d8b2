//! Environment maps in files: Radiance `.hdr` (RGBE) and OpenEXR `.exr`.
//!
//! An `.exr` file may store half, float or integer values in lines or tiles, with any compression but DWA.
//! The reader takes R, G and B at the finest level of the first part that has them.
//!
//! Values are linear radiance with the primaries of Rec. 709. Values of an `.hdr` file are divided by its
//! EXPOSURE and COLORCORR. An alpha channel is ignored, because the colours of an EXR are multiplied by it
//! already. Values below zero, which resampling leaves beside bright texels, are replaced by 0 and counted. A
//! file with a value that is not a number, infinite or larger than [`MAX_RADIANCE`] is refused.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers, Text, Vec2};
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;

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
        ErrorKind::NotFound | ErrorKind::NotADirectory => bad(path, e),
        _ => Error::read(path, e),
    })?;
    if !meta.is_file() {
        return Err(bad(path, "not a regular file"));
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let file = || File::open(path).map(BufReader::new).map_err(|e| Error::read(path, e));
    match extension.as_deref() {
        Some("hdr") => read_hdr(path, file()?, budget),
        Some("exr") => read_exr(path, file()?, budget),
        _ => Err(bad(path, "its name ends in neither .hdr nor .exr")),
    }
}

fn bad(path: &Path, why: impl std::fmt::Display) -> Error {
    // Messages of libraries may span several lines.
    let why = why.to_string().replace(['\n', '\r'], " ");
    Error::input(
        format!("environment map {}: {why}", path.display()),
        "give an equirectangular map as Radiance .hdr or as .exr with channels R, G and B",
    )
}

/// Turns an error of reading into one of the program. A file that ends too early or contains impossible
/// offsets is broken; any other failure is an I/O error.
fn unreadable(path: &Path, e: std::io::Error) -> Error {
    match e.kind() {
        ErrorKind::UnexpectedEof | ErrorKind::InvalidInput | ErrorKind::InvalidData => bad(path, e),
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
        return Err(bad(path, format!("{width}×{height} texels: at most {MAX_SIDE} on a side")));
    }
    Ok(())
}

fn read_hdr(path: &Path, mut file: BufReader<File>, budget: u64) -> Result<FileMap> {
    let io = |e| Error::read(path, e);
    let mut start = Vec::new();
    (&mut file).take(HEADER_BYTES).read_to_end(&mut start).map_err(io)?;
    if !start.starts_with(b"#?RADIANCE") && !start.starts_with(b"#?RGBE") {
        return Err(bad(path, "it does not start with #?RADIANCE or #?RGBE"));
    }
    // The decoder does not limit the length of a header line, so the end of the header is checked here.
    if !start.windows(2).any(|pair| pair == b"\n\n") {
        return Err(bad(path, "its header has no end"));
    }
    file.seek(SeekFrom::Start(0)).map_err(io)?;
    let fault = |e: image::ImageError| match e {
        image::ImageError::IoError(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => {
            Error::read(path, e)
        }
        other => bad(path, other),
    };
    let decoder = HdrDecoder::new_nonstrict(file).map_err(fault)?;
    let meta = decoder.metadata();
    let (width, height) = decoder.dimensions();
    check_size(path, width.into(), height.into(), 0, budget)?;
    let exposure = meta.exposure.unwrap_or(1.0);
    let (r, g, b) = meta.color_correction.unwrap_or((1.0, 1.0, 1.0));
    let divisors = [r * exposure, g * exposure, b * exposure];
    if !divisors.iter().all(|d| d.is_normal() && *d > 0.0) {
        return Err(bad(path, format!("its EXPOSURE and COLORCORR give the divisors {divisors:?}")));
    }
    let mut values = vec![0.0f32; width as usize * height as usize * 3];
    decoder.read_image(bytemuck::cast_slice_mut(&mut values)).map_err(fault)?;
    let texels = values
        .chunks_exact(3)
        .map(|t| [t[0] / divisors[0], t[1] / divisors[1], t[2] / divisors[2], 0.0])
        .collect();
    checked(path, Map { width, height, texels })
}

fn read_exr(path: &Path, mut file: BufReader<File>, budget: u64) -> Result<FileMap> {
    let fault = |e: exr::error::Error| match e {
        exr::error::Error::Io(e) => unreadable(path, e),
        other => bad(path, other),
    };
    let meta = MetaData::read_from_buffered((&mut file).take(HEADER_BYTES), false).map_err(fault)?;
    let has_rgb = |h: &&exr::meta::header::Header| {
        let has = |name: &str| h.channels.find_index_of_channel(&Text::from(name)).is_some();
        !h.deep && has("R") && has("G") && has("B")
    };
    let Some(header) = meta.headers.iter().find(has_rgb) else {
        return Err(bad(path, "no part of it has channels R, G and B"));
    };
    let size = header.layer_size;
    // One block may hold the whole image, compressed and uncompressed.
    let bytes: u128 = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() as u128).sum();
    let bytes = bytes * size.0 as u128 * size.1 as u128 * 2;
    check_size(path, size.0 as u64, size.1 as u64, bytes, budget)?;
    file.seek(SeekFrom::Start(0)).map_err(|e| Error::read(path, e))?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size: Vec2<usize>, _| (size.0, vec![[0.0f32; 4]; size.0 * size.1]),
            |(width, texels): &mut (usize, Vec<[f32; 4]>), position, (r, g, b): (f32, f32, f32)| {
                texels[position.1 * *width + position.0] = [r, g, b, 0.0];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(file)
        .map_err(fault)?;
    let size = image.layer_data.size;
    let (_, texels) = image.layer_data.channel_data.pixels;
    checked(path, Map { width: size.0 as u32, height: size.1 as u32, texels })
}

/// Replaces negative and subnormal values by 0, and refuses a map with a value that is not a radiance.
fn checked(path: &Path, mut map: Map) -> Result<FileMap> {
    let mut negative = 0;
    for (i, texel) in map.texels.iter_mut().enumerate() {
        for value in &mut texel[..3] {
            if !value.is_finite() || *value > MAX_RADIANCE {
                let (x, y) = (i % map.width as usize, i / map.width as usize);
                return Err(bad(
                    path,
                    format!("texel ({x}, {y}) has the radiance {value}: 0 to {MAX_RADIANCE:e} are allowed"),
                ));
            }
            negative += u64::from(*value < 0.0);
            *value = value.max(0.0);
            if !value.is_normal() {
                *value = 0.0;
            }
        }
    }
    Ok(FileMap { map, negative })
}
