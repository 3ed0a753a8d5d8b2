//! Whole pictures in memory, as values from 0 to 1, of this program or of others.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use super::{Encoding, Format, png_file, tiff_file};
use crate::util::error::{Error, Result};

/// Memory limit of a picture that is read, in pixels of 8 bytes.
const MAX_PIXELS: u64 = 1 << 28;

/// A developed picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadPicture {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Depth of the samples in the file, and whether they are linear.
    pub encoding: Encoding,
    /// R, G, B from 0 to 1, as they stand in the file, row by row.
    pub pixels: Vec<[f32; 3]>,
    /// Alpha from 0 to 1, if the file has it; `pixels` are not multiplied by it.
    pub alpha: Option<Vec<f32>>,
}

impl ReadPicture {
    /// Returns the pixels over a grey backdrop, 0 to 1, as viewers mix them: in the file's values.
    pub fn over(&self, grey: f32) -> Vec<[f32; 3]> {
        match &self.alpha {
            None => self.pixels.clone(),
            Some(alpha) => {
                let pixels = self.pixels.iter().zip(alpha);
                pixels.map(|(p, a)| p.map(|x| x * a + grey * (1.0 - a))).collect()
            }
        }
    }
}

/// Reads a PNG, JPEG, TIFF or WebP.
///
/// # Errors
/// [`Error::Input`] where the file is missing, damaged, too large or of another kind, [`Error::Io`] where it
/// cannot be read.
pub fn read_picture(path: &Path) -> Result<ReadPicture> {
    let kind = match Format::of_file(path)? {
        Format::Png => image::ImageFormat::Png,
        Format::Jpeg => image::ImageFormat::Jpeg,
        Format::Webp => image::ImageFormat::WebP,
        Format::Tiff => return tiff_file::read(path),
        Format::Exr => return Err(no_picture(path, "an EXR holds layers, not a developed picture")),
    };
    let file = File::open(path).map_err(|e| Error::read(path, e))?;
    let mut reader = image::ImageReader::with_format(BufReader::new(file), kind);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_PIXELS * 8);
    reader.limits(limits);
    let decoded = reader.decode().map_err(|e| no_picture(path, e))?;
    let bits = if decoded.color().bits_per_pixel() / u16::from(decoded.color().channel_count()) > 8 {
        16
    } else {
        8
    };
    let gamut = if kind == image::ImageFormat::Png { png_file::linear_gamut(path)? } else { None };
    let alpha = decoded
        .color()
        .has_alpha()
        .then(|| decoded.to_rgba32f().pixels().map(|p| p.0[3]).collect::<Vec<f32>>());
    let rgb = decoded.into_rgb32f();
    let (width, height) = rgb.dimensions();
    let pixels = rgb.pixels().map(|p| p.0).collect();
    let (linear, gamut) = (gamut.is_some(), gamut.unwrap_or_default());
    let encoding = Encoding { bits, linear, alpha: alpha.is_some(), gamut };
    Ok(ReadPicture { width, height, encoding, pixels, alpha })
}

/// Reads a picture as [`read_picture`] does. Returns width, height and pixels: RGB from 0 to 1, as they stand
/// in the file.
///
/// # Errors
/// The errors of [`read_picture`].
pub fn read_png(path: &Path) -> Result<(u32, u32, Vec<[f32; 3]>)> {
    let ReadPicture { width, height, pixels, .. } = read_picture(path)?;
    Ok((width, height, pixels))
}

fn no_picture(path: &Path, why: impl std::fmt::Display) -> Error {
    Error::input(format!("{}: {why}", path.display()), "give a PNG, JPEG, TIFF or WebP image")
}
