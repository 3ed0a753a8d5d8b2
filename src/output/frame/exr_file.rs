//! EXR files: linear light in one part, with dotted channel names and the resolved scene in attributes.
//!
//! Scan lines are in increasing order, and their bytes do not depend on how the rows are divided.

use std::io::{Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use exr::block::chunk::CompressedBlock;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData, magic_number};
use exr::prelude::{LineOrder, Text, Vec2, f16};
use rayon::prelude::*;

use super::exr_head::{Channel, Compression, ExrHead, fits_half};
use crate::picture::{Frame, Gamut, Layer};
use crate::util::error::Result;
use crate::util::window::Window;

/// Bytes that are compressed at a time, on all cores.
const BATCH_BYTES: usize = 8 << 20;
/// Longest text in an attribute that is written, bytes. FFmpeg before 6 loses its place in the header after a
/// longer attribute, takes what follows for the table of lines, and shows black rows without an error.
const TEXT_BYTES: usize = 255;
/// Meaning of the layer depth, for those who read the header. The two depths have different prefixes, because
/// Blender takes a layer of two channels for a vector and one of a single channel for a number.
const DEPTHS: &str = "metres to the first surface, 0: none; depth.Z along the camera's axis (planar), \
                      distance.D along the ray";
/// Largest finite half float.
const HALF_MAX: f32 = 65504.0;

/// Settings of EXR files.
#[derive(Clone, Debug, PartialEq)]
pub struct Exr {
    /// Layers.
    pub layers: Vec<Layer>,
    /// Whether colours, transmittance and normals are half floats.
    pub half: bool,
    /// Compression that is asked for; see [`Compression::for_width`].
    pub compression: Option<Compression>,
    /// Whether each layer gets a file of its own.
    pub split: bool,
    /// Frames per second as a fraction, if the picture is one of a sequence.
    pub rate: Option<[u32; 2]>,
}

impl Exr {
    /// Layers in one file, as floats.
    pub fn of(layers: &[Layer]) -> Exr {
        Exr { layers: layers.to_vec(), half: false, compression: None, split: false, rate: None }
    }

    /// Returns the files of a picture that is written to `path`, each with its layers.
    pub fn files(&self, path: &Path) -> Vec<(PathBuf, Vec<Layer>)> {
        if !self.split {
            return vec![(path.to_owned(), self.layers.clone())];
        }
        self.layers.iter().map(|layer| (path_of_layer(path, *layer), vec![*layer])).collect()
    }

    /// Returns the channels of a file with these layers, of a picture with or without `alpha`.
    pub fn channels(&self, layers: &[Layer], alpha: bool) -> Vec<Channel> {
        let layers: Vec<Layer> = layers.iter().map(|layer| layer.of_picture(alpha)).collect();
        channels_of(&layers, self.half)
    }

    /// Refuses what cannot be written of pictures of this width, with or without `alpha`.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::Error::Usage) if the compression needs too much memory.
    pub fn check(&self, width: u32, alpha: bool) -> Result<()> {
        let files = self.files(Path::new(""));
        files.iter().try_for_each(|(_, layers)| {
            Compression::for_width(self.compression, &self.channels(layers, alpha), width).map(drop)
        })
    }
}

/// Returns the path of a layer's own file: its name stands before the number of the frame, if there is one,
/// and before the extension, as in `fall.depth.0001.exr`.
fn path_of_layer(path: &Path, layer: Layer) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut parts: Vec<&str> = name.split('.').collect();
    let is_frame = |part: &str| {
        let numbered = part.chars().all(|c| c.is_ascii_digit() || "#@%$Fd".contains(c));
        numbered && part.contains(|c: char| c.is_ascii_digit() || "#@%$".contains(c))
    };
    let at = match parts.len() {
        n @ 3.. if is_frame(parts[n - 2]) => n - 2,
        n => n.saturating_sub(1),
    };
    parts.insert(at, layer.name());
    path.with_file_name(parts.join("."))
}

/// Returns the layers' channels, in the order of the file.
pub fn channels_of(layers: &[Layer], half: bool) -> Vec<Channel> {
    let channel = |name: &str| Channel { name: name.to_owned(), half: half && fits_half(name) };
    sorted(layers).into_iter().map(|(name, ..)| channel(name)).collect()
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

/// Returns rows of a frame as lines of the file, channel by channel in native byte order: R, G and B in the
/// primaries of `gamut`, and half floats where [`channels_of`] says so.
pub fn lines_of(frame: &Frame, layers: &[Layer], half: bool, gamut: Gamut, rows: Range<u32>) -> Vec<Vec<u8>> {
    rows.into_par_iter().map(|row| line_of(frame, layers, half, gamut, row)).collect()
}

fn line_of(frame: &Frame, layers: &[Layer], half: bool, gamut: Gamut, row: u32) -> Vec<u8> {
    let width = frame.width as usize;
    let first = row as usize * width;
    let channels = sorted(layers);
    let from_rec709 = gamut.from_rec709();
    let mut line = Vec::with_capacity(4 * width * channels.len());
    for (name, layer, c) in channels {
        let weights =
            from_rec709.filter(|_| matches!(layer, Layer::Rgb | Layer::Rgba) && c < 3).map(|m| m.row(c));
        let value = |i: usize| match weights {
            Some(weights) => {
                let rgb = [0, 1, 2].map(|c| f64::from(layer.value(frame, c, i)));
                weights.dot(rgb.into()) as f32
            }
            None => layer.value(frame, c, i),
        };
        let half = half && fits_half(name);
        for value in (first..first + width).map(value) {
            if half {
                line.extend_from_slice(&half_of(value).to_ne_bytes());
            } else {
                line.extend_from_slice(&value.to_ne_bytes());
            }
        }
    }
    line
}

/// Rounds to a half float. A value beyond the largest one becomes that, because programs add up what they
/// read, and an infinite value would spread.
pub fn half_of(value: f32) -> f16 {
    f16::from_f32(if value.is_finite() { value.clamp(-HALF_MAX, HALF_MAX) } else { value })
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
        channels: &[Channel],
        head: &ExrHead,
        texts: &[(String, String)],
    ) -> std::result::Result<Self, exr::error::Error> {
        let (image, mut attributes) = head.attributes(whole);
        attributes.layer_position = Vec2(window.x as i32, window.y as i32);
        let size = Vec2(window.width as usize, window.height as usize);
        let mut header =
            Header::new(Text::from(""), size, channels.iter().map(Channel::description).collect())
                .with_encoding(head.compression.method(), BlockDescription::ScanLines, LineOrder::Increasing)
                .with_attributes(attributes);
        header.shared_attributes = image;
        let headers = [header];
        let requirements = MetaData::validate(&headers, true)?;
        magic_number::write(&mut out)?;
        requirements.write(&mut out)?;
        let mut bytes = Vec::new();
        Header::write_all(&headers, &mut bytes, false)?;
        // The header ends with an empty name. The texts are written here, because the library keeps further
        // attributes in a hash map and their order would be random.
        let end = bytes.pop();
        push_text(&mut bytes, "colorInteropID", head.gamut.interop_id());
        for (name, value) in head.camera.iter().flat_map(|camera| camera.lens(whole)) {
            push(&mut bytes, name, "float", &value.to_le_bytes());
        }
        if channels.iter().any(|c| c.name.starts_with("depth.")) {
            push_text(&mut bytes, "taki.depth", DEPTHS);
        }
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
        let bytes = 8 * headers[0].chunk_count as u64;
        std::io::copy(&mut std::io::repeat(0).take(bytes), &mut out)?;
        Ok(ExrWriter { out, headers, table, position: table + bytes, offsets: Vec::new(), lines: Vec::new() })
    }

    /// Writes the next line: channel by channel, in native byte order.
    ///
    /// # Errors
    /// Errors of compression and of the output.
    pub fn push(&mut self, line: Vec<u8>) -> std::result::Result<(), exr::error::Error> {
        let block = self.headers[0].compression.scan_lines_per_block();
        let most = (BATCH_BYTES / line.len().max(1) / block).max(1) * block;
        self.lines.push(line);
        if self.lines.len() >= most { self.write_lines() } else { Ok(()) }
    }

    fn write_lines(&mut self) -> std::result::Result<(), exr::error::Error> {
        let headers = &self.headers;
        let (width, block) = (headers[0].layer_size.width(), headers[0].compression.scan_lines_per_block());
        let first = self.offsets.len() * block;
        let lines = std::mem::take(&mut self.lines);
        let chunks = lines.par_chunks(block).enumerate().map(|(i, lines)| {
            let index = BlockIndex {
                layer: 0,
                pixel_position: Vec2(0, first + i * block),
                pixel_size: Vec2(width, lines.len()),
                level: Vec2(0, 0),
            };
            UncompressedBlock { index, data: lines.concat() }.compress_to_chunk(headers)
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

/// Adds a text to the bytes of a header.
fn push_text(header: &mut Vec<u8>, name: &str, text: &str) {
    push(header, name, "string", text.as_bytes());
}

/// Adds an attribute to the bytes of a header.
fn push(header: &mut Vec<u8>, name: &str, kind: &str, value: &[u8]) {
    for word in [name, kind] {
        header.extend_from_slice(word.as_bytes());
        header.push(0);
    }
    header.extend_from_slice(&(value.len() as u32).to_le_bytes());
    header.extend_from_slice(value);
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
