//! PNG files: sRGB, 8 bits, with the resolved scene as text before the pixels and the figures after them.

use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

use super::{CROP_TEXT, FIGURES_TEXT, Figures, MAX_SIDE};
use crate::picture::Frame;
use crate::util::error::{Error, Result};
use crate::util::window::Window;

/// Memory limit of [`read_png`], in pixels of 8 bytes.
const MAX_PIXELS: u64 = 1 << 28;
/// Compressed bytes in an IDAT chunk.
const CHUNK_BYTES: usize = 1 << 18;
/// Memory for the texts and one row of a file that is read, bytes.
const READ_BYTES: usize = 64 << 20;

fn encoder<W: Write>(
    out: W,
    [width, height]: [u32; 2],
    texts: &[(String, String)],
) -> std::result::Result<png::Writer<W>, png::EncodingError> {
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    for (key, text) in texts {
        encoder.add_itxt_chunk(key.clone(), text.clone())?;
    }
    encoder.write_header()
}

/// Encodes a small picture in memory.
///
/// # Errors
/// Errors of the encoder, such as a text that PNG does not allow.
pub fn encode_png(frame: &Frame, texts: &[(&str, &str)]) -> std::result::Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let texts: Vec<_> = texts.iter().map(|(key, text)| (key.to_string(), text.to_string())).collect();
    let mut writer = encoder(&mut bytes, [frame.width, frame.height], &texts)?;
    writer.write_image_data(&rgb_rows(frame))?;
    writer.finish()?;
    Ok(bytes)
}

/// Returns the picture as R, G, B bytes.
pub fn rgb_rows(frame: &Frame) -> Vec<u8> {
    frame.picture.iter().flat_map(|p| [p[0], p[1], p[2]]).collect()
}

/// A writer that keeps its first error, because the encoder drops those of its destructors.
struct Checked<W> {
    inner: W,
    error: Option<io::Error>,
}

impl<W: Write> Write for Checked<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Some(e) = &self.error {
            return Err(io::Error::new(e.kind(), e.to_string()));
        }
        match self.inner.write(bytes) {
            Err(e) if e.kind() != io::ErrorKind::Interrupted => {
                self.error = Some(io::Error::new(e.kind(), e.to_string()));
                Err(e)
            }
            other => other,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

/// Writer of a picture, row by row. A thread of its own encodes them while the next rows are computed. The
/// bytes do not depend on how the rows are divided.
pub struct PngWriter {
    rows: Option<SyncSender<Message>>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

enum Message {
    Rows(Vec<u8>),
    /// The end of the picture, with the texts that follow the pixels.
    Finish(Vec<(String, String)>),
}

impl PngWriter {
    /// Begins a picture of `size` pixels. `texts` stand before the pixels.
    ///
    /// # Errors
    /// An error where the thread cannot be started.
    pub fn new(file: File, size: [u32; 2], texts: Vec<(String, String)>) -> io::Result<PngWriter> {
        // A queue of length 0: one piece is encoded while the next waits. A longer one would only take
        // memory.
        let (rows, queue) = sync_channel(0);
        let work = move || {
            let inner = BufWriter::with_capacity(1 << 16, file);
            let mut out = Checked { inner, error: None };
            let written = write(&mut out, size, &texts, &queue);
            match out.error.take() {
                Some(e) => Err(e),
                None => written.and_then(|()| out.inner.flush()),
            }
        };
        let thread = std::thread::Builder::new().name("png".into()).spawn(work)?;
        Ok(PngWriter { rows: Some(rows), thread: Some(thread) })
    }

    /// Writes the next rows: R, G, B bytes of any whole number of rows.
    ///
    /// # Errors
    /// Errors of the encoder and the file, also from rows written earlier.
    pub fn push(&mut self, rows: Vec<u8>) -> io::Result<()> {
        self.send(Message::Rows(rows))
    }

    /// Writes `texts` and ends the file. All rows must have been written.
    ///
    /// # Errors
    /// Errors of the encoder and the file.
    pub fn finish(mut self, texts: Vec<(String, String)>) -> io::Result<()> {
        self.send(Message::Finish(texts))?;
        self.join()
    }

    fn send(&mut self, message: Message) -> io::Result<()> {
        match &self.rows {
            Some(rows) if rows.send(message).is_ok() => Ok(()),
            // The thread ended early and returns the reason.
            _ => self.join().and(Err(io::Error::other("the picture has ended"))),
        }
    }

    fn join(&mut self) -> io::Result<()> {
        self.rows = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(done)) => done,
            Some(Err(_)) => Err(io::Error::other("the encoder failed")),
            None => Ok(()),
        }
    }
}

fn write(
    out: &mut Checked<BufWriter<File>>,
    size: [u32; 2],
    texts: &[(String, String)],
    queue: &std::sync::mpsc::Receiver<Message>,
) -> io::Result<()> {
    let mut writer = encoder(out, size, texts)?;
    let mut stream = writer.stream_writer_with_size(CHUNK_BYTES)?;
    let texts = loop {
        match queue.recv() {
            Ok(Message::Rows(rows)) => stream.write_all(&rows)?,
            Ok(Message::Finish(texts)) => break texts,
            // The picture was abandoned, and its file is removed.
            Err(_) => return Ok(()),
        }
    };
    stream.finish()?;
    for (key, text) in texts {
        writer.write_text_chunk(&png::text_metadata::ITXtChunk::new(key, text))?;
    }
    Ok(writer.finish()?)
}

/// Reads a PNG. Returns width, height and pixels: RGB from 0 to 1, as encoded, not linear.
///
/// # Errors
/// [`Error::Io`] where the file cannot be opened, [`Error::Input`] where it is no PNG or too large.
pub fn read_png(path: &Path) -> Result<(u32, u32, Vec<[f32; 3]>)> {
    let file = File::open(path).map_err(|e| Error::read(path, e))?;
    let mut reader = image::ImageReader::with_format(BufReader::new(file), image::ImageFormat::Png);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_PIXELS * 8);
    reader.limits(limits);
    let decoded = reader.decode().map_err(|e| bad(path, e))?;
    let rgb = decoded.to_rgb32f();
    let pixels = rgb.pixels().map(|p| p.0).collect();
    Ok((rgb.width(), rgb.height(), pixels))
}

fn bad(path: &Path, why: impl std::fmt::Display) -> Error {
    Error::input(format!("{}: {why}", path.display()), "give a PNG image")
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

/// Reader of this program's pictures, row by row. It checks every checksum.
pub struct PngRows {
    path: PathBuf,
    reader: png::Reader<Counted>,
    /// Bytes read so far.
    read: Arc<AtomicU64>,
    /// Size of the file.
    bytes: u64,
    rows_left: u32,
    /// Width and height of the whole image, pixels.
    pub whole: [u32; 2],
    /// Part of the image in the file.
    pub window: Window,
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
        if info.color_type != png::ColorType::Rgb
            || info.bit_depth != png::BitDepth::Eight
            || info.interlaced
            || width.max(height) > MAX_SIDE
        {
            return Err(bad(path, "not a picture of taki (8 bits RGB, not interlaced)"));
        }
        // Deflate expands a byte to at most 1032.
        if (u64::from(width) * 3 + 1) * u64::from(height) > bytes.saturating_mul(1032) {
            return Err(bad(path, format!("{bytes} bytes cannot hold {width}×{height} pixels")));
        }
        let reader = decoder.read_info().map_err(|e| decoding(path, e))?;
        if reader.info().animation_control.is_some() {
            return Err(bad(path, "not a picture of taki (animated)"));
        }
        let size = [width, height];
        let mut rows = PngRows {
            path: path.to_owned(),
            reader,
            read,
            bytes,
            rows_left: height,
            whole: size,
            window: Window::whole(size),
        };
        if let Some(crop) = rows.text(CROP_TEXT) {
            let parsed = parse_crop(&crop).filter(|(window, _)| [window.width, window.height] == size);
            (rows.window, rows.whole) = parsed.ok_or_else(|| {
                bad(path, format!("the text taki.crop = {crop:?} does not fit the picture"))
            })?;
        }
        Ok(rows)
    }

    /// Returns a text, if it has been read so far.
    pub fn text(&self, key: &str) -> Option<String> {
        let chunks = &self.reader.info().utf8_text;
        chunks.iter().find(|chunk| chunk.keyword == key).and_then(|chunk| chunk.get_text().ok())
    }

    /// Reads the next row into `row`: R, G, B bytes of the window's width.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is damaged or has no more rows, [`Error::Io`] where it cannot be read.
    pub fn read_row(&mut self, row: &mut [u8]) -> Result<()> {
        match self.reader.read_row(row) {
            Ok(Some(_)) => {
                self.rows_left = self.rows_left.saturating_sub(1);
                Ok(())
            }
            Ok(None) => Err(bad(&self.path, "the pixels end too early")),
            Err(e) => Err(decoding(&self.path, e)),
        }
    }

    /// Reads the remaining rows.
    ///
    /// # Errors
    /// The errors of [`PngRows::read_row`].
    pub fn skip_rows(&mut self) -> Result<()> {
        let mut row = vec![0; 3 * self.window.width as usize];
        (0..self.rows_left).try_for_each(|_| self.read_row(&mut row))
    }

    /// Reads the rest of the file, to its last byte. Returns the figures, if the file has them.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is damaged or its figures do not fit it, [`Error::Io`] where it cannot
    /// be read.
    pub fn finish(mut self) -> Result<Option<Figures>> {
        self.reader.finish().map_err(|e| decoding(&self.path, e))?;
        if self.read.load(Ordering::Relaxed) != self.bytes {
            return Err(bad(&self.path, "there are bytes after its end"));
        }
        let Some(text) = self.text(FIGURES_TEXT) else { return Ok(None) };
        let figures: Figures = serde_json::from_str(&text)
            .map_err(|e| bad(&self.path, format!("the text taki.figures: {e}")))?;
        if figures.pixels != self.window.pixels() {
            return Err(bad(&self.path, "the text taki.figures belongs to another picture"));
        }
        Ok(Some(figures))
    }
}

/// Formats a part of an image: `X,Y,W,H of WxH`.
pub fn crop_text(window: Window, [width, height]: [u32; 2]) -> String {
    format!("{window} of {width}x{height}")
}

fn parse_crop(text: &str) -> Option<(Window, [u32; 2])> {
    let (window, whole) = text.split_once(" of ")?;
    let (width, height) = whole.split_once('x')?;
    let whole: [u32; 2] = [width.parse().ok()?, height.parse().ok()?];
    let numbers: Vec<u32> = window.split(',').map(|n| n.parse().ok()).collect::<Option<_>>()?;
    let numbers: [u32; 4] = numbers.try_into().ok()?;
    let [x, y, width, height] = numbers;
    let valid = whole[0].max(whole[1]) <= MAX_SIDE && Window::fits(whole, numbers);
    valid.then_some((Window { x, y, width, height }, whole))
}
