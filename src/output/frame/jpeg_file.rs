//! JPEG files: 8 bits, chroma at full resolution, with a profile. Texts stand in comments after the first
//! segment, among them the checksum of everything.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, Write};
use std::path::Path;

use crc32fast::Hasher;
use image::ImageEncoder;
use image::codecs::jpeg::JpegEncoder;

use super::Encoding;
use super::icc::profile;
use super::texts::{Texts, bad};
use super::writer::{Head, Rows};
use crate::util::error::{Error, Result};

/// Quality from 1 to 100. At 95 no error is seen beside the picture; 100 doubles the file.
const QUALITY: u8 = 95;
/// Longest comment, bytes. A segment has at most 65535 with its length.
const COMMENT_BYTES: usize = 65_000;
/// Longest texts of a file that is read, bytes.
const MOST_TEXT: usize = 64 << 20;
/// Bytes of the markers SOI and of a comment.
const SOI: [u8; 2] = [0xff, 0xd8];
const COM: [u8; 2] = [0xff, 0xfe];

pub(super) fn write(mut out: impl Write, head: &Head, rows: &mut Rows) -> io::Result<()> {
    let samples = rows.all(head)?;
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
    encoder.set_icc_profile(profile(Encoding::DISPLAY)?).map_err(io::Error::other)?;
    let [width, height] = head.size;
    encoder.write_image(&samples, width, height, image::ExtendedColorType::Rgb8).map_err(io::Error::other)?;
    drop(samples);
    // The segment APP0 of JFIF is the first one.
    let first = 4 + usize::from(u16::from_be_bytes([bytes[4], bytes[5]]));
    let (start, rest) = bytes.split_at(first);
    let mut texts = head.texts.clone();
    texts.append(&mut rows.texts);
    let mut crc = Hasher::new();
    [start, rest].into_iter().for_each(|bytes| crc.update(bytes));
    Texts::seal(&mut texts, crc);
    out.write_all(start)?;
    for comment in Texts::pack(&texts).as_bytes().chunks(COMMENT_BYTES) {
        out.write_all(&COM)?;
        out.write_all(&(comment.len() as u16 + 2).to_be_bytes())?;
        out.write_all(comment)?;
    }
    out.write_all(rest)
}

/// Reads the texts of a picture of this program, and its width and height. Checks every byte.
///
/// # Errors
/// [`Error::Input`] where the file is damaged or not of this program's kind, [`Error::Io`] where it cannot be
/// read.
pub(super) fn verify(path: &Path) -> Result<(Texts, [u32; 2])> {
    let mut file = BufReader::new(File::open(path).map_err(|e| Error::read(path, e))?);
    let failed = |e: io::Error| match e.kind() {
        io::ErrorKind::UnexpectedEof => bad(path, "it ends too early"),
        _ => Error::read(path, e),
    };
    let foreign = || bad(path, "not a picture of taki (its comments are missing)");
    let mut start = [0; 6];
    file.read_exact(&mut start).map_err(failed)?;
    let length = usize::from(u16::from_be_bytes([start[4], start[5]]));
    let mut first = vec![0; length.checked_sub(2).filter(|_| start[..2] == SOI).ok_or_else(foreign)?];
    file.read_exact(&mut first).map_err(failed)?;
    let (mut packed, mut head) = (Vec::new(), [0; 4]);
    loop {
        file.read_exact(&mut head).map_err(failed)?;
        if head[..2] != COM {
            break;
        }
        let length =
            usize::from(u16::from_be_bytes([head[2], head[3]])).checked_sub(2).ok_or_else(foreign)?;
        let before = packed.len();
        if before > MOST_TEXT {
            return Err(bad(path, "its comments are too long"));
        }
        packed.resize(before + length, 0);
        file.read_exact(&mut packed[before..]).map_err(failed)?;
    }
    let texts = std::str::from_utf8(&packed).ok().and_then(Texts::unpack).ok_or_else(foreign)?;
    let mut crc = Hasher::new();
    [&start[..], &first, &head].into_iter().for_each(|bytes| crc.update(bytes));
    loop {
        let bytes = file.fill_buf().map_err(failed)?;
        if bytes.is_empty() {
            break;
        }
        crc.update(bytes);
        let read = bytes.len();
        file.consume(read);
    }
    texts.check_seal(path, crc)?;
    file.rewind().map_err(failed)?;
    let reader = image::ImageReader::with_format(file, image::ImageFormat::Jpeg);
    let size = reader.into_dimensions().map_err(|e| bad(path, e))?;
    Ok((texts, size.into()))
}
