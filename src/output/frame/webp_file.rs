//! WebP files: 8 bits, lossless, with a profile. Texts stand in the description of its Exif data, among them
//! the checksum of samples and texts.

use std::fs::File;
use std::io::{self, BufReader, Write};
use std::path::Path;

use crc32fast::Hasher;
use image::codecs::webp::{WebPDecoder, WebPEncoder};
use image::{ImageDecoder, ImageEncoder};

use super::icc::profile;
use super::texts::{Texts, bad};
use super::writer::{Head, Rows};
use super::{Encoding, tiff_file};
use crate::util::error::{Error, Result};

pub(super) fn write(out: impl Write, head: &Head, rows: &mut Rows) -> io::Result<()> {
    let samples = rows.all(head)?;
    let mut texts = head.texts.clone();
    texts.append(&mut rows.texts);
    let mut crc = Hasher::new();
    crc.update(&samples);
    Texts::seal(&mut texts, crc);
    let mut encoder = WebPEncoder::new_lossless(out);
    encoder.set_icc_profile(profile(Encoding::DISPLAY)?).map_err(io::Error::other)?;
    encoder.set_exif_metadata(tiff_file::exif(&texts)?).map_err(io::Error::other)?;
    let [width, height] = head.size;
    let color =
        if head.encoding.alpha { image::ExtendedColorType::Rgba8 } else { image::ExtendedColorType::Rgb8 };
    encoder.write_image(&samples, width, height, color).map_err(|e| match e {
        image::ImageError::IoError(e) => e,
        other => io::Error::other(other),
    })
}

/// Reads a picture of this program: its texts, width and height, samples and their encoding. Checks every
/// sample.
///
/// # Errors
/// [`Error::Input`] where the file is damaged or not of this program's kind, [`Error::Io`] where it cannot be
/// read.
pub(super) fn read(path: &Path) -> Result<(Texts, [u32; 2], Vec<u8>, Encoding)> {
    let file = File::open(path).map_err(|e| Error::read(path, e))?;
    let bytes = file.metadata().map_err(|e| Error::read(path, e))?.len();
    let mut decoder = WebPDecoder::new(BufReader::new(file)).map_err(|e| bad(path, e))?;
    let exif = decoder.exif_metadata().map_err(|e| bad(path, e))?;
    let texts = exif.as_deref().and_then(tiff_file::texts_of_exif);
    let texts = texts.ok_or_else(|| bad(path, "not a picture of taki (it has no description)"))?;
    let (width, height) = decoder.dimensions();
    let alpha = match decoder.color_type() {
        image::ColorType::Rgb8 => false,
        image::ColorType::Rgba8 => true,
        _ => return Err(bad(path, "not a picture of taki (8 bits RGB or RGBA)")),
    };
    let mut samples = vec![0; decoder.total_bytes() as usize];
    decoder.read_image(&mut samples).map_err(|e| bad(path, e))?;
    let mut crc = Hasher::new();
    crc.update(&samples);
    texts.check_seal(path, crc)?;
    if bytes != riff_bytes(path)? {
        return Err(bad(path, "there are bytes after its end"));
    }
    Ok((texts, [width, height], samples, Encoding { alpha, ..Encoding::DISPLAY }))
}

/// Returns the length of the file by its head.
fn riff_bytes(path: &Path) -> Result<u64> {
    let mut head = [0; 8];
    let read = File::open(path).and_then(|mut file| io::Read::read_exact(&mut file, &mut head));
    read.map_err(|e| Error::read(path, e))?;
    Ok(8 + u64::from(u32::from_le_bytes([head[4], head[5], head[6], head[7]])))
}
