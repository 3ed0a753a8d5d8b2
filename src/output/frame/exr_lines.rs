//! Reader of the EXR files that this program writes, line by line in constant memory.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{AttributeValue, LineOrder, Text, Vec2};
use glam::{DMat3, DVec3};

use super::exr_head::{Channel, Compression, ExrHead};
use super::{MAX_SIDE, SCENE_TEXT};
use crate::util::error::{Error, Result};
use crate::util::window::Window;

/// Largest block of lines that is read, bytes. A line of the widest picture with all layers has 56 MB.
const BLOCK_BYTES: u64 = 64 << 20;
/// Largest header of a file that is read, bytes.
const HEADER_BYTES: u64 = 64 << 20;

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
    /// Offset of each block of lines in the file, bytes.
    offsets: Vec<u64>,
    position: u64,
    /// Number of the next line.
    next: usize,
    /// The block of the next line.
    block: Vec<u8>,
    /// Width and height of the whole image, pixels.
    pub whole: [u32; 2],
    /// Part of the image in the file.
    pub window: Window,
    /// Channels, in their order within a line.
    pub channels: Vec<Channel>,
    /// Compression, colour space, rate and camera.
    pub head: ExrHead,
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
        let foreign = || bad(path, "not a picture of taki (one part of scan lines in half or float)");
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
        let channels: Option<Vec<Channel>> = header.channels.list.iter().map(Channel::of).collect();
        let (Some(channels), Some(head)) = (channels, ExrHead::of(header)) else { return Err(foreign()) };
        let lines = head.compression.lines();
        if header.blocks != BlockDescription::ScanLines
            || header.line_order != LineOrder::Increasing
            || header.deep
            || display.position != Vec2(0, 0)
            || !Window::fits(whole, window)
            || header.chunk_count != window[3].div_ceil(lines) as usize
            || channels.is_empty()
        {
            return Err(foreign());
        }
        MetaData::validate(&meta.headers, true).map_err(|e| bad(path, e))?;
        let pixels = u64::from(window[2]) * u64::from(window[3]);
        let values = pixels.saturating_mul(channels.iter().map(|c| c.bytes() as u64).sum());
        if values / u64::from(window[3]) * u64::from(lines.min(window[3])) > BLOCK_BYTES {
            return Err(foreign());
        }
        // Bytes that one byte can expand to.
        let most = match head.compression {
            Compression::None => 1,
            Compression::Rle => 64,
            Compression::Zips | Compression::Zip => 1032,
            Compression::Piz => BLOCK_BYTES,
        };
        if values / most > bytes || 8 * header.chunk_count as u64 > bytes {
            return Err(bad(path, format!("{bytes} bytes cannot hold {}×{} pixels", window[2], window[3])));
        }
        let offsets = (0..header.chunk_count).map(|_| {
            let mut offset = [0; 8];
            file.read_exact(&mut offset).map(|()| u64::from_le_bytes(offset))
        });
        let offsets = offsets.collect::<std::io::Result<Vec<u64>>>().map_err(|e| unreadable(path, e))?;
        let position = file.stream_position().map_err(|e| Error::read(path, e))?;
        let [x, y, width, height] = window;
        let window = Window { x, y, width, height };
        Ok(ExrLines {
            path: path.to_owned(),
            file,
            bytes,
            meta,
            offsets,
            position,
            next: 0,
            block: Vec::new(),
            whole,
            window,
            channels,
            head,
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

    /// Size of a line, bytes.
    fn line_bytes(&self) -> usize {
        self.channels.iter().map(Channel::bytes).sum::<usize>() * self.window.width as usize
    }

    /// Reads the next line into `line`: channel by channel, in native byte order.
    ///
    /// # Errors
    /// [`Error::Input`] where the line is damaged, [`Error::Io`] where it cannot be read.
    pub fn read_line(&mut self, line: &mut Vec<u8>) -> Result<()> {
        let (bytes, lines) = (self.line_bytes(), self.head.compression.lines() as usize);
        if self.next.is_multiple_of(lines) {
            self.read_block()?;
        }
        line.clear();
        line.extend_from_slice(&self.block[self.next % lines * bytes..][..bytes]);
        self.next += 1;
        Ok(())
    }

    /// Reads the block that begins with the next line.
    fn read_block(&mut self) -> Result<()> {
        let fail = |why: &str| bad(&self.path, format!("line {}: {why}", self.next));
        let lines = self.head.compression.lines() as usize;
        let expected = lines.min(self.window.height as usize - self.next) * self.line_bytes();
        if self.offsets.get(self.next / lines) != Some(&self.position) {
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
        let packed = self.head.compression != Compression::None;
        if size == 0 || size > expected || !packed && size < expected || self.position > self.bytes {
            return Err(fail("it has a wrong length"));
        }
        let mut bytes = vec![0; size];
        self.file.read_exact(&mut bytes).map_err(|e| unreadable(&self.path, e))?;
        let lengths = || unpacked_length(&bytes) == Some(expected);
        if self.head.compression == Compression::Rle && size < expected && !lengths() {
            return Err(fail("its run lengths are wrong"));
        }
        let block = CompressedScanLineBlock { y_coordinate: y, compressed_pixels_le: bytes };
        let chunk = Chunk { layer_index: 0, compressed_block: CompressedBlock::ScanLine(block) };
        let block =
            UncompressedBlock::decompress_chunk(chunk, &self.meta, true).map_err(|e| fail(&e.to_string()))?;
        if block.data.len() != expected {
            return Err(fail("it has a wrong number of values"));
        }
        self.block = block.data;
        Ok(())
    }

    /// Returns a value of a line.
    pub fn value(&self, line: &[u8], channel: usize, x: usize) -> f32 {
        let first: usize = self.channels[..channel].iter().map(Channel::bytes).sum();
        let Channel { half, .. } = self.channels[channel];
        let at = first * self.window.width as usize + self.channels[channel].bytes() * x;
        match half {
            true => exr::prelude::f16::from_ne_bytes([line[at], line[at + 1]]).to_f32(),
            false => bytemuck::pod_read_unaligned(&line[at..at + 4]),
        }
    }

    /// Returns the index of a channel.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|c| c.name == name)
    }

    /// Returns the channels R, G and B, and the matrix from them to Rec. 709 unless they are in it.
    pub fn colours(&self) -> Option<([usize; 3], Option<DMat3>)> {
        let rgb = self.channel("R").zip(self.channel("G")).zip(self.channel("B"));
        rgb.map(|((r, g), b)| ([r, g, b], self.head.gamut.from_rec709().map(|m| m.inverse())))
    }

    /// Returns R, G and B of a pixel in Rec. 709; `colours` as from [`ExrLines::colours`].
    pub fn rec709(&self, line: &[u8], colours: &([usize; 3], Option<DMat3>), x: usize) -> [f32; 3] {
        let rgb = colours.0.map(|channel| self.value(line, channel, x));
        match colours.1 {
            Some(m) => (m * DVec3::from(rgb.map(f64::from))).as_vec3().to_array(),
            None => rgb,
        }
    }

    /// Checks that nothing follows the last line.
    ///
    /// # Errors
    /// [`Error::Input`] where something does, or not all lines have been read.
    pub fn finish(self) -> Result<()> {
        let whole = self.next == self.window.height as usize && self.position == self.bytes;
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
