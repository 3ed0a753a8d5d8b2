//! EXR files: linear float32 in one part, with dotted channel names and the resolved scene in attributes.
//!
//! Scan lines are in increasing order, one per block, and compressed by run lengths. That is lossless and
//! fast, and the bytes do not depend on how the rows are divided.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use exr::block::{BlockIndex, UncompressedBlock};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData, magic_number};
use exr::prelude::{
    AttributeValue, ChannelDescription, Compression, IntegerBounds, LayerAttributes, LineOrder, ReadChannels,
    ReadLayers, SampleType, Text, Vec2,
};
use rayon::prelude::*;

use super::{MAX_SIDE, SCENE_TEXT};
use crate::picture::{Frame, Layer};
use crate::util::error::{Error, Result};
use crate::util::window::Window;

/// Bytes that are compressed at a time, on all cores.
const BATCH_BYTES: usize = 8 << 20;
/// Largest line of a file that is read, bytes. A line of the widest picture with all layers has 48 MB.
const LINE_BYTES: u64 = 64 << 20;
/// Longest text in an attribute that is written, bytes. FFmpeg before 6 loses its place in the header after a
/// longer attribute, takes what follows for the table of lines, and shows black rows without an error.
const TEXT_BYTES: usize = 255;
/// Largest header of a file that is read, bytes.
const HEADER_BYTES: u64 = 64 << 20;

/// Returns the names of the layers' channels, in the order of the file.
pub fn channel_names(layers: &[Layer]) -> Vec<String> {
    sorted(layers).into_iter().map(|(name, ..)| name.to_owned()).collect()
}

/// Returns the channels in the order of the file: name, layer, index in the layer.
fn sorted(layers: &[Layer]) -> Vec<(&'static str, Layer, usize)> {
    let channels =
        layers.iter().flat_map(|layer| layer.channels().iter().zip(0..).map(|(name, c)| (*name, *layer, c)));
    let mut channels: Vec<_> = channels.collect();
    channels.sort_unstable_by_key(|(name, ..)| *name);
    channels.dedup_by_key(|(name, ..)| *name);
    channels
}

/// Returns rows of a frame as lines of the file: channel by channel, native float32.
pub fn lines_of(frame: &Frame, layers: &[Layer], rows: Range<u32>) -> Vec<Vec<u8>> {
    rows.into_par_iter().map(|row| line_of(frame, layers, row)).collect()
}

fn line_of(frame: &Frame, layers: &[Layer], row: u32) -> Vec<u8> {
    let width = frame.width as usize;
    let first = row as usize * width;
    let channels = sorted(layers);
    let mut line = Vec::with_capacity(4 * width * channels.len());
    for (_, layer, c) in channels {
        for i in first..first + width {
            line.extend_from_slice(&layer.value(frame, c, i).to_ne_bytes());
        }
    }
    line
}

/// Writer of a picture, line by line.
pub struct ExrWriter<W> {
    out: W,
    headers: [Header; 1],
    /// Offset of the table of lines, bytes.
    table: u64,
    /// Offset of the next line, bytes.
    position: u64,
    offsets: Vec<u64>,
    lines: Vec<Vec<u8>>,
}

impl<W: Write + Seek> ExrWriter<W> {
    /// Begins a file with the part `window` of an image of `whole` pixels. `out` should be buffered and at
    /// its start.
    ///
    /// # Errors
    /// Errors of `out`, and of a header that EXR does not allow.
    pub fn new(
        mut out: W,
        whole: [u32; 2],
        window: Window,
        channels: &[String],
        texts: &[(String, String)],
    ) -> std::result::Result<Self, exr::error::Error> {
        let attributes = LayerAttributes {
            layer_position: Vec2(window.x as i32, window.y as i32),
            ..LayerAttributes::default()
        };
        let channels = channels.iter().map(|name| ChannelDescription::named(name.as_str(), SampleType::F32));
        let size = Vec2(window.width as usize, window.height as usize);
        let header = Header::new(Text::from(""), size, channels.collect())
            .with_encoding(Compression::RLE, BlockDescription::ScanLines, LineOrder::Increasing)
            .with_attributes(attributes)
            .with_display_window(IntegerBounds::from_dimensions((whole[0] as usize, whole[1] as usize)));
        let headers = [header];
        let requirements = MetaData::validate(&headers, true)?;
        magic_number::write(&mut out)?;
        requirements.write(&mut out)?;
        let mut bytes = Vec::new();
        Header::write_all(&headers, &mut bytes, false)?;
        // The header ends with an empty name. The texts are written here, because the library keeps further
        // attributes in a hash map and their order would be random.
        let end = bytes.pop();
        for (key, text) in texts {
            if key == "Software" {
                push_text(&mut bytes, "software", text);
                continue;
            }
            for (name, piece) in pieces(key, text) {
                push_text(&mut bytes, &name, piece);
            }
        }
        bytes.extend(end);
        out.write_all(&bytes)?;
        let table = out.stream_position()?;
        // Space for the offsets of the blocks, which are known once the blocks are written.
        let bytes = 8 * u64::from(window.height);
        std::io::copy(&mut std::io::repeat(0).take(bytes), &mut out)?;
        Ok(ExrWriter { out, headers, table, position: table + bytes, offsets: Vec::new(), lines: Vec::new() })
    }

    /// Writes the next line: channel by channel, native float32.
    ///
    /// # Errors
    /// Errors of compression and of the output.
    pub fn push(&mut self, line: Vec<u8>) -> std::result::Result<(), exr::error::Error> {
        let most = (BATCH_BYTES / line.len().max(1)).max(1);
        self.lines.push(line);
        if self.lines.len() >= most { self.write_lines() } else { Ok(()) }
    }

    fn write_lines(&mut self) -> std::result::Result<(), exr::error::Error> {
        let (headers, first) = (&self.headers, self.offsets.len());
        let width = headers[0].layer_size.width();
        let chunks = std::mem::take(&mut self.lines).into_par_iter().enumerate().map(|(i, data)| {
            let index = BlockIndex {
                layer: 0,
                pixel_position: Vec2(0, first + i),
                pixel_size: Vec2(width, 1),
                level: Vec2(0, 0),
            };
            UncompressedBlock { index, data }.compress_to_chunk(headers)
        });
        for chunk in chunks.collect::<std::result::Result<Vec<_>, _>>()? {
            self.offsets.push(self.position);
            if let CompressedBlock::ScanLine(block) = &chunk.compressed_block {
                self.position += 8 + block.compressed_pixels_le.len() as u64;
            }
            chunk.write(&mut self.out, 1)?;
        }
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Errors of the output, and an error where lines are missing.
    pub fn finish(mut self) -> std::result::Result<(), exr::error::Error> {
        self.write_lines()?;
        if self.offsets.len() != self.headers[0].chunk_count {
            return Err(std::io::Error::other("some lines are missing").into());
        }
        self.out.seek(SeekFrom::Start(self.table))?;
        for offset in &self.offsets {
            self.out.write_all(&offset.to_le_bytes())?;
        }
        Ok(self.out.flush()?)
    }
}

/// Adds an attribute to the bytes of a header.
fn push_text(header: &mut Vec<u8>, name: &str, text: &str) {
    for word in [name, "string"] {
        header.extend_from_slice(word.as_bytes());
        header.push(0);
    }
    header.extend_from_slice(&(text.len() as u32).to_le_bytes());
    header.extend_from_slice(text.as_bytes());
}

/// Cuts a text into attributes of at most [`TEXT_BYTES`]: NAME if one is enough, otherwise NAME.0001 and so
/// on. Each piece ends with a line of the text, where a line fits.
fn pieces<'a>(name: &str, text: &'a str) -> Vec<(String, &'a str)> {
    if text.len() <= TEXT_BYTES {
        return vec![(name.to_owned(), text)];
    }
    let (mut out, mut rest) = (Vec::new(), text);
    while !rest.is_empty() {
        let most = rest.floor_char_boundary(TEXT_BYTES);
        let end = match rest[..most].rfind('\n') {
            Some(line_end) if most < rest.len() => line_end + 1,
            _ => most,
        };
        let (piece, after) = rest.split_at(end);
        out.push((format!("{name}.{:04}", out.len() + 1), piece));
        rest = after;
    }
    out
}

/// Names and values of an EXR file's channels; values row by row.
pub type Channels = Vec<(String, Vec<f32>)>;

/// Reads every channel of the first part of an EXR file. Returns width, height and channels.
///
/// # Errors
/// [`Error::Io`] where the file cannot be read, [`Error::Input`] where it is no EXR.
pub fn read_exr(path: &Path) -> Result<(u32, u32, Channels)> {
    let file = File::open(path).map_err(|e| Error::read(path, e))?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(BufReader::new(file))
        .map_err(|e| bad(path, e))?;
    let size = image.layer_data.size;
    let channels = image.layer_data.channel_data.list;
    let channels =
        channels.into_iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()));
    Ok((size.width() as u32, size.height() as u32, channels.collect()))
}

fn bad(path: &Path, why: impl std::fmt::Display) -> Error {
    Error::input(format!("{}: {why}", path.display()), "give an EXR image")
}

/// Converts a read error. A file that ends too early is damaged; other errors come from the disk.
fn unreadable(path: &Path, e: std::io::Error) -> Error {
    match e.kind() {
        std::io::ErrorKind::UnexpectedEof => bad(path, "it ends too early"),
        _ => Error::read(path, e),
    }
}

/// Reader of this program's pictures, line by line.
pub struct ExrLines {
    path: PathBuf,
    file: BufReader<File>,
    /// Size of the file.
    bytes: u64,
    meta: MetaData,
    /// Offset of each line in the file, bytes.
    offsets: Vec<u64>,
    position: u64,
    next: usize,
    /// Width and height of the whole image, pixels.
    pub whole: [u32; 2],
    /// Part of the image in the file.
    pub window: Window,
    /// Names of the channels, in their order within a line.
    pub channels: Vec<String>,
}

impl ExrLines {
    /// Opens a file and reads everything before the pixels.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is damaged or not of this program's kind, [`Error::Io`] where it
    /// cannot be read.
    pub fn open(path: &Path) -> Result<ExrLines> {
        let file = File::open(path).map_err(|e| Error::read(path, e))?;
        let bytes = file.metadata().map_err(|e| Error::read(path, e))?.len();
        let mut file = BufReader::new(file);
        let foreign = || bad(path, "not a picture of taki (one part of float32 scan lines, run lengths)");
        // Only version 2 is parsed, with no flag except that of long names.
        let mut start = [0; 8];
        file.read_exact(&mut start).map_err(|e| unreadable(path, e))?;
        if start[..5] != [0x76, 0x2f, 0x31, 0x01, 2] || start[5] & !4 != 0 || start[6..] != [0, 0] {
            return Err(foreign());
        }
        file.seek(SeekFrom::Start(0)).map_err(|e| Error::read(path, e))?;
        let meta =
            MetaData::read_from_buffered((&mut file).take(HEADER_BYTES), true).map_err(|e| bad(path, e))?;
        let [header] = &meta.headers[..] else { return Err(foreign()) };
        let (data, display) = (header.data_window(), header.shared_attributes.display_window);
        let side = |n: usize| u32::try_from(n).ok().filter(|n| (1..=MAX_SIDE).contains(n));
        let at = |n: i32| u32::try_from(n).ok();
        let window = (|| {
            Some([at(data.position.x())?, at(data.position.y())?, side(data.size.x())?, side(data.size.y())?])
        })();
        let whole = (|| Some([side(display.size.x())?, side(display.size.y())?]))();
        let (Some(window), Some(whole)) = (window, whole) else { return Err(foreign()) };
        let plain = |c: &ChannelDescription| c.sample_type == SampleType::F32 && c.sampling == Vec2(1, 1);
        if header.compression != Compression::RLE
            || header.blocks != BlockDescription::ScanLines
            || header.line_order != LineOrder::Increasing
            || header.deep
            || display.position != Vec2(0, 0)
            || !Window::fits(whole, window)
            || header.chunk_count != window[3] as usize
            || header.channels.list.is_empty()
            || !header.channels.list.iter().all(plain)
        {
            return Err(foreign());
        }
        MetaData::validate(&meta.headers, true).map_err(|e| bad(path, e))?;
        // Run lengths expand a byte to at most 64.
        let pixels = u64::from(window[2]) * u64::from(window[3]);
        let values = pixels.saturating_mul(4 * header.channels.list.len() as u64);
        if values / u64::from(window[3]) > LINE_BYTES {
            return Err(foreign());
        }
        if values / 64 > bytes || 8 * u64::from(window[3]) > bytes {
            return Err(bad(path, format!("{bytes} bytes cannot hold {}×{} pixels", window[2], window[3])));
        }
        let offsets = (0..window[3]).map(|_| {
            let mut offset = [0; 8];
            file.read_exact(&mut offset).map(|()| u64::from_le_bytes(offset))
        });
        let offsets = offsets.collect::<std::io::Result<Vec<u64>>>().map_err(|e| unreadable(path, e))?;
        let position = file.stream_position().map_err(|e| Error::read(path, e))?;
        let [x, y, width, height] = window;
        let channels = header.channels.list.iter().map(|c| c.name.to_string()).collect();
        let window = Window { x, y, width, height };
        Ok(ExrLines {
            path: path.to_owned(),
            file,
            bytes,
            meta,
            offsets,
            position,
            next: 0,
            whole,
            window,
            channels,
        })
    }

    /// Returns the text of the scene, from one attribute or from its pieces.
    pub fn scene(&self) -> Option<String> {
        let attributes = &self.meta.headers[0].own_attributes.other;
        let bytes = |name: &str| match attributes.get(&Text::from(name)) {
            Some(AttributeValue::Text(text)) => Some(text.as_slice().to_vec()),
            _ => None,
        };
        let text = bytes(SCENE_TEXT).or_else(|| {
            let pieces = (1..).map_while(|number| bytes(&format!("{SCENE_TEXT}.{number:04}")));
            Some(pieces.flatten().collect()).filter(|whole: &Vec<u8>| !whole.is_empty())
        })?;
        // The library takes every byte for a character.
        Some(String::from_utf8_lossy(&text).into_owned())
    }

    /// Reads the next line into `line`: channel by channel, native float32.
    ///
    /// # Errors
    /// [`Error::Input`] where the line is damaged, [`Error::Io`] where it cannot be read.
    pub fn read_line(&mut self, line: &mut Vec<u8>) -> Result<()> {
        let fail = |why: &str| bad(&self.path, format!("line {}: {why}", self.next));
        let header = &self.meta.headers[0];
        let expected = 4 * header.channels.list.len() * self.window.width as usize;
        if self.offsets.get(self.next) != Some(&self.position) {
            return Err(fail("the table of lines is wrong"));
        }
        let mut head = [0; 8];
        self.file.read_exact(&mut head).map_err(|e| unreadable(&self.path, e))?;
        let [y, size] = [0, 4].map(|i| i32::from_le_bytes([head[i], head[i + 1], head[i + 2], head[i + 3]]));
        let size = u32::try_from(size).unwrap_or(0) as usize;
        self.position += 8 + size as u64;
        if i64::from(y) != i64::from(self.window.y) + self.next as i64 {
            return Err(fail("its row number is wrong"));
        }
        if size == 0 || size > expected || self.position > self.bytes {
            return Err(fail("it has a wrong length"));
        }
        let mut packed = vec![0; size];
        self.file.read_exact(&mut packed).map_err(|e| unreadable(&self.path, e))?;
        if size < expected && unpacked_length(&packed) != Some(expected) {
            return Err(fail("its run lengths are wrong"));
        }
        let block = CompressedScanLineBlock { y_coordinate: y, compressed_pixels_le: packed };
        let chunk = Chunk { layer_index: 0, compressed_block: CompressedBlock::ScanLine(block) };
        let block =
            UncompressedBlock::decompress_chunk(chunk, &self.meta, true).map_err(|e| fail(&e.to_string()))?;
        *line = block.data;
        self.next += 1;
        Ok(())
    }

    /// Checks that nothing follows the last line.
    ///
    /// # Errors
    /// [`Error::Input`] where something does, or not all lines have been read.
    pub fn finish(self) -> Result<()> {
        let whole = self.next == self.offsets.len() && self.position == self.bytes;
        if whole { Ok(()) } else { Err(bad(&self.path, "there are bytes after its end")) }
    }
}

/// Returns the number of bytes that run lengths expand to, without expanding them; `None` where they are
/// malformed.
fn unpacked_length(packed: &[u8]) -> Option<usize> {
    let (mut i, mut length) = (0, 0);
    while i < packed.len() {
        let count = i32::from(packed[i] as i8);
        let (taken, made) =
            if count < 0 { (-count as usize, -count as usize) } else { (1, count as usize + 1) };
        i += 1 + taken;
        length += made;
    }
    (i == packed.len()).then_some(length)
}
