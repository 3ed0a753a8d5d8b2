//! TIFF files: 8 or 16 bits in compressed strips, with a profile. Texts stand in the description at the end,
//! among them the checksum of samples and texts; the program's name stands at the start.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufReader, Cursor, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crc32fast::Hasher;
use tiff::TiffError;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::encoder::compression::{CompressionAlgorithm, Deflate, DeflateLevel};
use tiff::encoder::{
    DirectoryEncoder, Rational, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, TiffValue,
};
use tiff::tags::{
    CompressionMethod, PhotometricInterpretation, PlanarConfiguration, Predictor, ResolutionUnit,
    SampleFormat, Tag, Type,
};

use super::icc::profile;
use super::texts::{Texts, bad};
use super::writer::{Head, Rows};
use super::{Encoding, LINEAR_TEXT, MAX_SIDE, ReadPicture};
use crate::picture::Gamut;
use crate::util::error::{Error, Result};

/// Bytes of samples in a strip, if a row is not longer.
const STRIP_BYTES: usize = 1 << 20;
/// Bytes of samples from which a file gets offsets of 64 bits. It leaves room for what compression adds and
/// for the texts.
const LARGE_BYTES: u64 = 0xF000_0000;
/// Value of the tag of extra samples: colours are not multiplied by alpha.
const UNASSOCIATED_ALPHA: u16 = 2;
/// Memory limit for the texts and one strip of a file that is read, bytes.
const READ_BYTES: usize = 256 << 20;
/// Memory limit for the samples of a picture that is read as a whole, bytes.
const WHOLE_BYTES: usize = 2 << 30;

/// A value of a tag, as bytes of a type.
struct Tagged<'a>(&'a [u8]);

/// A text, with the zero at its end.
struct Ascii(Vec<u8>);

impl TiffValue for Tagged<'_> {
    const BYTE_LEN: u8 = 1;
    const FIELD_TYPE: Type = Type::UNDEFINED;

    fn count(&self) -> usize {
        self.0.len()
    }

    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(self.0)
    }
}

impl TiffValue for Ascii {
    const BYTE_LEN: u8 = 1;
    const FIELD_TYPE: Type = Type::ASCII;

    fn count(&self) -> usize {
        self.0.len()
    }

    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(&self.0)
    }
}

/// Returns the value of the description tag.
fn description(texts: &[(String, String)]) -> Ascii {
    Ascii([Texts::pack(texts).as_bytes(), &[0]].concat())
}

/// Returns the value of the software tag.
fn software(texts: &[(String, String)]) -> Ascii {
    let name = texts.iter().find(|(key, _)| key == "Software").map_or("", |(_, name)| name);
    Ascii([name.as_bytes(), &[0]].concat())
}

fn io_error(e: TiffError) -> io::Error {
    match e {
        TiffError::IoError(e) => e,
        other => io::Error::other(other),
    }
}

pub(super) fn write(out: impl Write + Seek, head: &Head, rows: &mut Rows) -> io::Result<()> {
    let bytes = head.row_bytes() as u64 * u64::from(head.size[1]);
    let written = if bytes < LARGE_BYTES {
        let narrow = |offsets: &[u64]| offsets.iter().map(|&x| x as u32).collect::<Vec<u32>>();
        write_strips::<TiffKindStandard, u32>(out, head, rows, narrow)
    } else {
        write_strips::<TiffKindBig, u64>(out, head, rows, <[u64]>::to_vec)
    };
    written.map_err(io_error)
}

/// Writes strips and their directory; `narrow` converts offsets to the file's type.
fn write_strips<K: TiffKind, O>(
    out: impl Write + Seek,
    head: &Head,
    rows: &mut Rows,
    narrow: impl Fn(&[u64]) -> Vec<O>,
) -> std::result::Result<(), TiffError>
where
    [O]: TiffValue,
{
    let [width, height] = head.size;
    let channels = head.encoding.channels();
    let mut encoder = TiffEncoder::<_, K>::new_generic(out)?;
    let mut directory = encoder.image_directory()?;
    directory.write_tag(Tag::Software, software(&head.texts))?;
    directory.write_tag(Tag::IccProfile, Tagged(&profile(head.encoding)?))?;
    let strip_rows = (STRIP_BYTES / head.row_bytes().max(1)).clamp(1, height as usize);
    let strip_bytes = strip_rows * head.row_bytes();
    let (mut waiting, mut crc) = (Vec::new(), Hasher::new());
    let (mut offsets, mut lengths) = (Vec::new(), Vec::new());
    // The library's own writer of strips says that they are compressed, but compresses only whole pictures.
    let mut push = |directory: &mut DirectoryEncoder<_, K>, strip: &[u8]| {
        let mut packed = Vec::new();
        let mut deflate = Deflate::with_level(DeflateLevel::Balanced);
        deflate.write_to(&mut packed, &differences(strip, head))?;
        lengths.push(packed.len() as u64);
        offsets.push(directory.write_data(&packed[..])?);
        Ok::<(), TiffError>(())
    };
    let mut bytes = 0;
    while let Some(rows) = rows.next()? {
        crc.update(&rows);
        bytes += rows.len();
        waiting.extend(rows);
        let whole = waiting.len() / strip_bytes * strip_bytes;
        waiting[..whole].chunks(strip_bytes).try_for_each(|strip| push(&mut directory, strip))?;
        waiting.drain(..whole);
    }
    if !waiting.is_empty() {
        push(&mut directory, &waiting)?;
    }
    if bytes != head.row_bytes() * height as usize {
        return Err(io::Error::other("some rows are missing").into());
    }
    let mut texts = head.texts.clone();
    texts.append(&mut rows.texts);
    Texts::seal(&mut texts, crc);
    directory.write_tag(Tag::ImageDescription, description(&texts))?;
    directory.write_tag(Tag::ImageWidth, width)?;
    directory.write_tag(Tag::ImageLength, height)?;
    directory.write_tag(Tag::BitsPerSample, &vec![u16::from(head.encoding.bits); channels][..])?;
    directory.write_tag(Tag::SampleFormat, &vec![SampleFormat::Uint.to_u16(); channels][..])?;
    directory.write_tag(Tag::SamplesPerPixel, channels as u16)?;
    if head.encoding.alpha {
        directory.write_tag(Tag::ExtraSamples, UNASSOCIATED_ALPHA)?;
    }
    directory.write_tag(Tag::PhotometricInterpretation, PhotometricInterpretation::RGB.to_u16())?;
    directory.write_tag(Tag::PlanarConfiguration, PlanarConfiguration::Chunky.to_u16())?;
    directory.write_tag(Tag::Compression, CompressionMethod::Deflate.to_u16())?;
    directory.write_tag(Tag::Predictor, Predictor::Horizontal.to_u16())?;
    directory.write_tag(Tag::RowsPerStrip, strip_rows as u32)?;
    directory.write_tag(Tag::StripOffsets, &narrow(&offsets)[..])?;
    directory.write_tag(Tag::StripByteCounts, &narrow(&lengths)[..])?;
    // Readers want a resolution; without a unit it gives the shape of a pixel.
    directory.write_tag(Tag::XResolution, Rational { n: 1, d: 1 })?;
    directory.write_tag(Tag::YResolution, Rational { n: 1, d: 1 })?;
    directory.write_tag(Tag::ResolutionUnit, ResolutionUnit::None.to_u16())?;
    directory.finish()
}

/// Replaces each sample of whole rows by its difference from the pixel before, in the byte order of the file.
fn differences(rows: &[u8], head: &Head) -> Vec<u8> {
    let channels = head.encoding.channels();
    let mut out = Vec::with_capacity(rows.len());
    for row in rows.chunks_exact(head.row_bytes()) {
        if head.encoding.bits == 8 {
            let before = |i: usize| i.checked_sub(channels).map_or(0, |i| row[i]);
            out.extend((0..row.len()).map(|i| row[i].wrapping_sub(before(i))));
        } else {
            let row: Vec<u16> = row.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect();
            let before = |i: usize| i.checked_sub(channels).map_or(0, |i| row[i]);
            out.extend((0..row.len()).flat_map(|i| row[i].wrapping_sub(before(i)).to_ne_bytes()));
        }
    }
    out
}

/// Returns Exif data with texts.
pub(super) fn exif(texts: &[(String, String)]) -> io::Result<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    let written = (|| {
        let mut encoder = TiffEncoder::new(&mut bytes)?;
        let mut directory = encoder.image_directory()?;
        directory.write_tag(Tag::Software, software(texts))?;
        directory.write_tag(Tag::ImageDescription, description(texts))?;
        directory.finish()
    })();
    written.map_err(io_error)?;
    Ok(bytes.into_inner())
}

/// Returns the texts of Exif data of this program.
pub(super) fn texts_of_exif(exif: &[u8]) -> Option<Texts> {
    // A little-endian directory of entries of 12 bytes; a description does not fit into its entry.
    let number = |at: usize, bytes: usize| -> Option<usize> {
        let bytes = exif.get(at..at + bytes)?;
        Some(bytes.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
    };
    let directory = number(4, 4).filter(|_| exif.starts_with(b"II\x2a\0"))?;
    let entry = (0..number(directory, 2)?)
        .map(|i| directory + 2 + 12 * i)
        .find(|at| number(*at, 2) == Some(usize::from(Tag::ImageDescription.to_u16())))?;
    let (length, at) = (number(entry + 4, 4)?, number(entry + 8, 4)?);
    let text = exif.get(at..at.checked_add(length)?)?.strip_suffix(&[0])?;
    Texts::unpack(std::str::from_utf8(text).ok()?)
}

/// Reader of a picture of this program, row by row.
pub(super) struct TiffRows {
    path: PathBuf,
    decoder: Decoder<BufReader<File>>,
    pub encoding: Encoding,
    pub size: [u32; 2],
    pub texts: Texts,
    /// Samples of the strip that is being read, and the bytes of it that are used up.
    strip: Vec<u8>,
    used: usize,
    next_strip: u32,
    crc: Hasher,
}

impl TiffRows {
    /// Opens a file and reads everything but the pixels.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is damaged or not of this program's kind, [`Error::Io`] where it
    /// cannot be read.
    pub fn open(path: &Path) -> Result<TiffRows> {
        let mut decoder = open(path, READ_BYTES)?;
        let (width, height) = decoder.dimensions().map_err(|e| decoding(path, e))?;
        let (bits, alpha) = match decoder.colortype().map_err(|e| decoding(path, e))? {
            tiff::ColorType::RGB(bits @ (8 | 16)) if width.max(height) <= MAX_SIDE => (bits, false),
            tiff::ColorType::RGBA(bits @ (8 | 16)) if width.max(height) <= MAX_SIDE => (bits, true),
            _ => return Err(bad(path, "not a picture of taki (8 or 16 bits RGB or RGBA)")),
        };
        let texts = texts_of(&mut decoder);
        let texts = texts.ok_or_else(|| bad(path, "not a picture of taki (it has no description)"))?;
        let gamut = gamut_of(&texts);
        let encoding = Encoding { bits, linear: gamut.is_some(), alpha, gamut: gamut.unwrap_or_default() };
        Ok(TiffRows {
            path: path.to_owned(),
            decoder,
            encoding,
            size: [width, height],
            texts,
            strip: Vec::new(),
            used: 0,
            next_strip: 0,
            crc: Hasher::new(),
        })
    }

    /// Reads the next row of samples into `row`.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is damaged or has no more rows, [`Error::Io`] where it cannot be read.
    pub fn read_row(&mut self, row: &mut [u8]) -> Result<()> {
        if self.used == self.strip.len() {
            let strip = self.decoder.read_chunk(self.next_strip).map_err(|e| decoding(&self.path, e))?;
            self.strip = match strip {
                DecodingResult::U8(samples) => samples,
                DecodingResult::U16(samples) => samples.iter().flat_map(|x| x.to_be_bytes()).collect(),
                _ => return Err(bad(&self.path, "its samples are of another kind")),
            };
            self.crc.update(&self.strip);
            (self.used, self.next_strip) = (0, self.next_strip + 1);
        }
        let samples = self.strip.get(self.used..self.used + row.len());
        row.copy_from_slice(samples.ok_or_else(|| bad(&self.path, "a strip has no whole rows"))?);
        self.used += row.len();
        Ok(())
    }

    /// Checks the checksum and the length, once all rows are read.
    ///
    /// # Errors
    /// [`Error::Input`] where one is wrong.
    pub fn finish(mut self) -> Result<Texts> {
        let path = &self.path;
        self.texts.check_seal(path, self.crc)?;
        // The directory is the last part of the file: a count, the entries, and the place of the next one.
        let directory = self.decoder.ifd_pointer().map_or(0, |pointer| pointer.0);
        let file = self.decoder.inner();
        let length = (|| {
            let mut start = [0; 10];
            file.rewind()?;
            file.read_exact(&mut start)?;
            let big = start[2..4].contains(&43);
            file.seek(SeekFrom::Start(directory))?;
            file.read_exact(&mut start[..if big { 8 } else { 2 }])?;
            let count = u64::from(u16::from_le_bytes([start[0], start[1]]));
            let [head, entry, next] = if big { [8, 20, 8] } else { [2, 12, 4] };
            Ok::<_, io::Error>((directory + head + entry * count + next, file.get_ref().metadata()?.len()))
        })();
        match length.map_err(|e| Error::read(path, e))? {
            (wanted, length) if wanted == length => Ok(self.texts),
            _ => Err(bad(path, "there are bytes after its end, or it was written on another machine")),
        }
    }
}

/// Converts a decoding error. Damage is a fault of the file, other input errors come from the disk.
fn decoding(path: &Path, e: TiffError) -> Error {
    match e {
        // Errors of decompression have no number of the system.
        TiffError::IoError(e) if e.raw_os_error().is_some() => Error::read(path, e),
        other => bad(path, other),
    }
}

/// Reads a picture in RGB or grey, of other programs too.
///
/// # Errors
/// [`Error::Input`] where the file is damaged or of another kind, [`Error::Io`] where it cannot be read.
pub(super) fn read(path: &Path) -> Result<ReadPicture> {
    let mut decoder = open(path, WHOLE_BYTES)?;
    let (width, height) = decoder.dimensions().map_err(|e| decoding(path, e))?;
    let channels = match decoder.colortype().map_err(|e| decoding(path, e))? {
        tiff::ColorType::Gray(_) => 1,
        tiff::ColorType::RGB(_) => 3,
        tiff::ColorType::RGBA(_) => 4,
        other => return Err(bad(path, format!("its colours are {other:?}, not RGB"))),
    };
    let gamut = texts_of(&mut decoder).and_then(|texts| gamut_of(&texts));
    let (bits, samples): (u8, Vec<f32>) = match decoder.read_image().map_err(|e| decoding(path, e))? {
        DecodingResult::U8(samples) => (8, samples.into_iter().map(|x| f32::from(x) / 255.0).collect()),
        DecodingResult::U16(samples) => (16, samples.into_iter().map(|x| f32::from(x) / 65_535.0).collect()),
        _ => return Err(bad(path, "its samples have neither 8 nor 16 bits")),
    };
    let pixel = |pixel: &[f32]| if channels == 1 { [pixel[0]; 3] } else { [pixel[0], pixel[1], pixel[2]] };
    let pixels = samples.chunks_exact(channels).map(pixel).collect();
    let alpha = (channels == 4).then(|| samples.chunks_exact(4).map(|pixel| pixel[3]).collect());
    let (linear, gamut) = (gamut.is_some(), gamut.unwrap_or_default());
    let encoding = Encoding { bits, linear, alpha: alpha.is_some(), gamut };
    Ok(ReadPicture { width, height, encoding, pixels, alpha })
}

/// Returns the primaries of linear samples; `None` if they are not linear.
fn gamut_of(texts: &Texts) -> Option<Gamut> {
    let name = texts.get(LINEAR_TEXT)?;
    Some(Gamut::ALL.into_iter().find(|gamut| gamut.name() == name).unwrap_or_default())
}

/// Opens a file whose texts, and whose strips or whole picture, take at most `bytes` of memory.
fn open(path: &Path, bytes: usize) -> Result<Decoder<BufReader<File>>> {
    let file = File::open(path).map_err(|e| Error::read(path, e))?;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = bytes;
    limits.ifd_value_size = bytes;
    limits.intermediate_buffer_size = bytes;
    let decoder = Decoder::new(BufReader::new(file)).map_err(|e| decoding(path, e))?;
    Ok(decoder.with_limits(limits))
}

/// Returns the texts of a picture of this program.
fn texts_of(decoder: &mut Decoder<BufReader<File>>) -> Option<Texts> {
    Texts::unpack(&decoder.get_tag_ascii_string(Tag::ImageDescription).ok()?)
}
