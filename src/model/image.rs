//! Images of a model, which are decoded only when they are asked for.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::budget::{Budget, SMALLER};
use super::paths::read_whole;
use crate::util::error::{Error, Result};

/// Image of a model, not yet decoded.
#[derive(Clone, Debug, PartialEq)]
pub enum ImageSource {
    /// Bytes of a PNG, JPEG or WebP file.
    Bytes {
        /// The model's file, and the image's place in it.
        place: String,
        /// Content of the image's file.
        bytes: Arc<Vec<u8>>,
    },
    /// Path of a file in the model's folder.
    File(PathBuf),
    /// An image that cannot be had. Only a scene that needs it fails.
    Refused {
        /// Description of the fault, with its place.
        what: String,
        /// Advice: how to mend it.
        fix: String,
    },
}

impl ImageSource {
    /// Decodes the image. `memory` are the bytes that the file, its pixels and the coarser levels that are
    /// made of them may take.
    ///
    /// # Errors
    /// [`Error::Input`] where there is no image or it is broken, [`Error::Memory`] where it is too large.
    pub fn decode(&self, memory: u64) -> Result<DynamicImage> {
        match self {
            ImageSource::Refused { what, fix } => Err(Error::input(what, fix)),
            ImageSource::Bytes { place, bytes } => decode(place, bytes, memory),
            ImageSource::File(path) => decode_file(path, memory),
        }
    }

    /// Returns the width and height of the image, texels. `memory` are the bytes that the file may take.
    ///
    /// # Errors
    /// [`Error::Input`] where there is no image or it is broken, [`Error::Memory`] where the file is too
    /// large.
    pub fn size(&self, memory: u64) -> Result<[u32; 2]> {
        let (width, height) = match self {
            ImageSource::Refused { what, fix } => return Err(Error::input(what, fix)),
            ImageSource::Bytes { place, bytes } => size(place, bytes)?,
            ImageSource::File(path) => {
                size(&path.display().to_string(), &read_whole(path, &mut Budget::new(memory, SMALLER))?)?
            }
        };
        Ok([width, height])
    }
}

fn decode_file(path: &Path, memory: u64) -> Result<DynamicImage> {
    let bytes = read_whole(path, &mut Budget::new(memory, SMALLER))?;
    decode(&path.display().to_string(), &bytes, memory.saturating_sub(bytes.len() as u64))
}

fn fault(place: &str, why: String) -> Error {
    Error::input(format!("{place}: {why}"), "export the images as PNG, JPEG or WebP files")
}

fn reader(bytes: &[u8]) -> ImageReader<Cursor<&[u8]>> {
    ImageReader::new(Cursor::new(bytes)).with_guessed_format().expect("bytes in memory")
}

/// Width and height of an image.
fn size(place: &str, bytes: &[u8]) -> Result<(u32, u32)> {
    if bytes.is_empty() {
        return Err(fault(place, "the image is empty".into()));
    }
    let (width, height) = reader(bytes).into_dimensions().map_err(|e| fault(place, e.to_string()))?;
    if width == 0 || height == 0 {
        return Err(fault(place, format!("an image of {width}×{height}")));
    }
    Ok((width, height))
}

/// Bytes that a decoder takes by itself: the window of inflate, and buffers of rows.
const DECODER_BYTES: u128 = 128 << 10;

/// Bytes for each texel that a decoder takes besides the picture, unless it goes row by row: the coefficients
/// of a progressive JPEG, or the planes of a WebP.
const PLANES_BYTES: u128 = 8;

/// Bytes for each texel while an image becomes a texture. Red, green and blue are one each; the first coarser
/// level has twelve for each of a quarter of the texels, and the next one is made beside it.
const TEXTURE_BYTES: u128 = 3 + 3 + 1;

/// Most bytes that an image takes at a time, until its texture is made. `texel` is the size of a texel as
/// decoded.
fn need(texels: u128, texel: u128, format: Option<ImageFormat>, is_rgb: bool) -> u128 {
    let decoder = if format == Some(ImageFormat::Png) { 0 } else { PLANES_BYTES };
    let other = if is_rgb { 0 } else { 3 };
    texels * (texel + decoder).max(texel + other).max(TEXTURE_BYTES) + DECODER_BYTES
}

fn decode(place: &str, bytes: &[u8], memory: u64) -> Result<DynamicImage> {
    let (width, height) = size(place, bytes)?;
    let format = reader(bytes).format();
    let decoder = reader(bytes).into_decoder().map_err(|e| fault(place, e.to_string()))?;
    let color = decoder.color_type();
    let texels = u128::from(width) * u128::from(height);
    let need = need(texels, color.bytes_per_pixel().into(), format, color == ColorType::Rgb8);
    if need > u128::from(memory) {
        let what = format!("{place}: an image of {width}×{height}");
        return Err(Error::memory(what, need, memory, "scale the image down, or allow more with --memory"));
    }
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(memory);
    let mut reader = reader(bytes);
    reader.limits(limits);
    reader.decode().map_err(|e| fault(place, e.to_string()))
}
