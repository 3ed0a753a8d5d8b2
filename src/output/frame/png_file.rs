//! PNG files: 8 or 16 bits, sRGB or linear, with the resolved scene as text before the pixels and the figures
//! after them.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::texts::{Texts, bad};
use super::writer::{Head, Rows, encode};
use super::{Encoding, Format, MAX_SIDE};
use crate::picture::{Frame, Gamut};
use crate::util::error::{Error, Result};

/// Compressed bytes in an IDAT chunk.
const CHUNK_BYTES: usize = 1 << 18;
/// Memory for the texts and one row of a file that is read, bytes.
const READ_BYTES: usize = 64 << 20;

/// Code point of linear light in the chunk cICP.
const LINEAR: u8 = 8;

/// Returns the code points of the chunk cICP for linear light: primaries, curve, RGB, full range. ACEScg has
/// none.
fn code_points(gamut: Gamut) -> Option<[u8; 4]> {
    let primaries = match gamut {
        Gamut::Rec709 => 1,
        Gamut::Rec2020 => 9,
        Gamut::Acescg => return None,
    };
    Some([primaries, LINEAR, 0, 1])
}

pub(super) fn write(out: impl Write, head: &Head, rows: &mut Rows) -> io::Result<()> {
    let [width, height] = head.size;
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(if head.encoding.alpha { png::ColorType::Rgba } else { png::ColorType::Rgb });
    encoder.set_compression(png::Compression::Fast);
    encoder.set_depth(if head.encoding.bits == 8 { png::BitDepth::Eight } else { png::BitDepth::Sixteen });
    if head.encoding.linear {
        encoder.set_source_gamma(png::ScaledFloat::new(1.0));
        let [rx, ry, gx, gy, bx, by, wx, wy] = head.encoding.gamut.chromaticities().map(|x| x as f32);
        let chromaticities = png::SourceChromaticities::new((wx, wy), (rx, ry), (gx, gy), (bx, by));
        encoder.set_source_chromaticities(chromaticities);
    } else {
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    }
    for (key, text) in &head.texts {
        encoder.add_itxt_chunk(key.clone(), text.clone())?;
    }
    let mut writer = encoder.write_header()?;
    let points = code_points(head.encoding.gamut).filter(|_| head.encoding.linear);
    if let Some(points) = points {
        // The encoder does not write this chunk by itself. It stands before the pixels.
        writer.write_chunk(png::chunk::ChunkType(*b"cICP"), &points)?;
    }
    let mut stream = writer.stream_writer_with_size(CHUNK_BYTES)?;
    while let Some(rows) = rows.next()? {
        stream.write_all(&rows)?;
    }
    stream.finish()?;
    for (key, text) in std::mem::take(&mut rows.texts) {
        writer.write_text_chunk(&png::text_metadata::ITXtChunk::new(key, text))?;
    }
    Ok(writer.finish()?)
}

/// Encodes a small picture in memory, with 8 bits.
///
/// # Errors
/// Errors of the encoder, such as a text that PNG does not allow.
pub fn encode_png(frame: &Frame, texts: &[(&str, &str)]) -> io::Result<Vec<u8>> {
    let encoding = Encoding { alpha: frame.alpha.is_some(), ..Encoding::DISPLAY };
    let head = Head {
        format: Format::Png,
        encoding,
        size: [frame.width, frame.height],
        texts: texts.iter().map(|(key, text)| (key.to_string(), text.to_string())).collect(),
    };
    let channels = encoding.channels();
    encode(&head, frame.picture.iter().flat_map(|p| p[..channels].iter().copied()).collect())
}

/// Returns the primaries of a PNG whose samples are linear; `None` if they are not.
pub(super) fn linear_gamut(path: &Path) -> Result<Option<Gamut>> {
    let file = File::open(path).map_err(|e| Error::read(path, e))?;
    let reader = png::Decoder::new(BufReader::new(file)).read_info().map_err(|e| decoding(path, e))?;
    Ok(said_gamut(reader.info()))
}

/// Returns what the colour chunks of a PNG say of linear samples; `None` if they are not linear.
fn said_gamut(info: &png::Info) -> Option<Gamut> {
    if let Some(points) = info.coding_independent_code_points {
        let known = |gamut: &Gamut| code_points(*gamut).is_some_and(|own| own[0] == points.color_primaries);
        let gamut = Gamut::ALL.into_iter().find(known).unwrap_or_default();
        return (points.transfer_function == LINEAR).then_some(gamut);
    }
    let linear = info.srgb.is_none() && info.gama_chunk.is_some_and(|gamma| gamma.into_value() == 1.0);
    let gamut = info.chrm_chunk.and_then(|chunk| {
        let all = [chunk.red, chunk.green, chunk.blue, chunk.white].map(|(x, y)| [x, y]);
        let all: Vec<f64> = all.iter().flatten().map(|x| f64::from(x.into_value())).collect();
        Gamut::of(&all.try_into().ok()?)
    });
    linear.then_some(gamut.unwrap_or_default())
}

/// Converts a decoding error. Damage is a fault of the file, other input errors come from the disk.
fn decoding(path: &Path, e: png::DecodingError) -> Error {
    match e {
        png::DecodingError::IoError(e) if e.kind() != io::ErrorKind::UnexpectedEof => Error::read(path, e),
        other => bad(path, other),
    }
}

/// A file that counts the bytes read.
struct Counted {
    inner: BufReader<File>,
    read: Arc<AtomicU64>,
}

impl Read for Counted {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(out)?;
        self.read.fetch_add(read as u64, Ordering::Relaxed);
        Ok(read)
    }
}

impl BufRead for Counted {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.inner.fill_buf()
    }

    fn consume(&mut self, bytes: usize) {
        self.read.fetch_add(bytes as u64, Ordering::Relaxed);
        self.inner.consume(bytes);
    }
}

impl Seek for Counted {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        let position = self.inner.seek(to)?;
        self.read.store(position, Ordering::Relaxed);
        Ok(position)
    }
}

/// Reader of a picture of this program, row by row. It checks every checksum.
pub(super) struct PngRows {
    path: PathBuf,
    reader: png::Reader<Counted>,
    /// Bytes read so far.
    read: Arc<AtomicU64>,
    /// Size of the file.
    bytes: u64,
    pub encoding: Encoding,
    pub size: [u32; 2],
}

impl PngRows {
    /// Opens a file and reads everything before the pixels.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is damaged or not of this program's kind, [`Error::Io`] where it
    /// cannot be read.
    pub fn open(path: &Path) -> Result<PngRows> {
        let file = File::open(path).map_err(|e| Error::read(path, e))?;
        let bytes = file.metadata().map_err(|e| Error::read(path, e))?.len();
        let read = Arc::new(AtomicU64::new(0));
        let counted = Counted { inner: BufReader::new(file), read: read.clone() };
        let mut options = png::DecodeOptions::default();
        options.set_ignore_checksums(false);
        options.set_skip_ancillary_crc_failures(false);
        let mut decoder = png::Decoder::new_with_options(counted, options);
        decoder.set_limits(png::Limits { bytes: READ_BYTES });
        let info = decoder.read_header_info().map_err(|e| decoding(path, e))?;
        let [width, height] = [info.width, info.height];
        let bits = info.bit_depth as u8;
        let alpha = info.color_type == png::ColorType::Rgba;
        if !(alpha || info.color_type == png::ColorType::Rgb)
            || !Format::Png.depths().contains(&bits)
            || info.interlaced
            || width.max(height) > MAX_SIDE
        {
            return Err(bad(path, "not a picture of taki (8 or 16 bits RGB or RGBA, not interlaced)"));
        }
        // Deflate expands a byte to at most 1032.
        let row_bytes =
            u64::from(width) * Encoding { bits, alpha, ..Encoding::DISPLAY }.pixel_bytes() as u64 + 1;
        if row_bytes * u64::from(height) > bytes.saturating_mul(1032) {
            return Err(bad(path, format!("{bytes} bytes cannot hold {width}×{height} pixels")));
        }
        let reader = decoder.read_info().map_err(|e| decoding(path, e))?;
        if reader.info().animation_control.is_some() {
            return Err(bad(path, "not a picture of taki (animated)"));
        }
        let gamut = said_gamut(reader.info());
        let encoding = Encoding { bits, linear: gamut.is_some(), alpha, gamut: gamut.unwrap_or_default() };
        Ok(PngRows { path: path.to_owned(), reader, read, bytes, encoding, size: [width, height] })
    }

    /// Returns the texts that have been read so far.
    pub fn texts(&self) -> Texts {
        let chunks = &self.reader.info().utf8_text;
        let texts = chunks.iter().filter_map(|c| Some((c.keyword.clone(), c.get_text().ok()?)));
        Texts(texts.collect())
    }

    /// Reads the next row of samples into `row`.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is damaged or has no more rows, [`Error::Io`] where it cannot be read.
    pub fn read_row(&mut self, row: &mut [u8]) -> Result<()> {
        match self.reader.read_row(row) {
            Ok(Some(_)) => Ok(()),
            Ok(None) => Err(bad(&self.path, "the pixels end too early")),
            Err(e) => Err(decoding(&self.path, e)),
        }
    }

    /// Reads the rest of the file, to its last byte. Returns all texts.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is damaged, [`Error::Io`] where it cannot be read.
    pub fn finish(mut self) -> Result<Texts> {
        self.reader.finish().map_err(|e| decoding(&self.path, e))?;
        if self.read.load(Ordering::Relaxed) != self.bytes {
            return Err(bad(&self.path, "there are bytes after its end"));
        }
        Ok(self.texts())
    }
}
