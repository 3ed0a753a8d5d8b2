//! Pictures in OpenEXR files of any program: half, float or integer values in lines or tiles, at the finest
//! level.
//!
//! The display window is the picture, of which any area can be read. Pixels outside the data window are
//! black, and data outside the area is cropped. `channels` finds the picture among the channels, and
//! [`super::colour`] leads from the file's colour space to linear Rec. 709.

mod channels;

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

use exr::block::UncompressedBlock;
use exr::block::reader::ChunksReader;
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::attribute::{ChannelList, Chromaticities};
use exr::prelude::{AttributeValue, IntegerBounds, SampleType, Text, Vec2, f16};

use super::colour::{self, Curve, Primaries, Space};
use channels::{Kind, Picture};

/// Maximum size of a file's headers, bytes.
const HEADER_BYTES: u64 = 1 << 20;

/// Reason why a file cannot be read.
#[derive(Debug)]
pub enum Fault {
    /// The file is broken, or of a kind that is not read.
    Bad {
        /// Description of the fault.
        why: String,
        /// Way out, where it is known.
        fix: Option<&'static str>,
    },
    /// The disk failed, or the file ends too early.
    Io(std::io::Error),
}

impl Fault {
    fn bad(why: impl Into<String>) -> Fault {
        Fault::Bad { why: why.into(), fix: None }
    }

    fn with(why: impl Into<String>, fix: &'static str) -> Fault {
        Fault::Bad { why: why.into(), fix: Some(fix) }
    }
}

impl From<exr::error::Error> for Fault {
    fn from(e: exr::error::Error) -> Fault {
        match e {
            exr::error::Error::Io(e) => Fault::Io(e),
            other => Fault::bad(other.to_string()),
        }
    }
}

/// A file whose headers have been read.
pub struct OpenExr {
    file: BufReader<File>,
    meta: MetaData,
}

impl OpenExr {
    /// Reads the headers of a file. `file` is at its start.
    ///
    /// # Errors
    /// [`Fault`], also where a part has a compression that is not read.
    pub fn open(mut file: BufReader<File>) -> Result<OpenExr, Fault> {
        let mut start = Vec::new();
        (&mut file).take(HEADER_BYTES).read_to_end(&mut start).map_err(Fault::Io)?;
        if let Some(name) = unread_compression(&start) {
            return Err(Fault::with(
                format!("it is compressed with {name}, which taki does not read"),
                "save it with ZIP compression, or convert it: oiiotool in.exr --compression zip -o out.exr",
            ));
        }
        let meta = MetaData::read_from_buffered(&start[..], false)?;
        Ok(OpenExr { file, meta })
    }

    /// Returns the headers of the parts.
    pub fn headers(&self) -> &[Header] {
        &self.meta.headers
    }

    /// Finds the colours of the picture.
    ///
    /// # Errors
    /// [`Fault::Bad`] where there are none, or it is not clear which channels they are.
    pub fn colours(self) -> Result<Colours, Fault> {
        let picture = channels::picture_of(&self.meta.headers).map_err(|(why, fix)| Fault::with(why, fix))?;
        Ok(Colours { picture, exr: self })
    }

    /// Returns the display window of a part, and its data window.
    ///
    /// # Errors
    /// [`Fault::Bad`] where there is no data inside the display window.
    pub fn windows(&self, part: usize) -> Result<[IntegerBounds; 2], Fault> {
        let header = &self.meta.headers[part];
        let (display, data) = (header.shared_attributes.display_window, header.data_window());
        if !overlap(display, data) {
            return Err(Fault::bad("its picture lies outside its display window"));
        }
        Ok([display, data])
    }

    /// Returns the memory that blocks of a part may take while they are read, bytes: one block may hold the
    /// whole data window, compressed and uncompressed.
    pub fn block_bytes(&self, part: usize) -> u128 {
        let header = &self.meta.headers[part];
        let pixel: u128 = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() as u128).sum();
        let size = header.data_window().size;
        pixel * size.0 as u128 * size.1 as u128 * 2
    }

    /// Reads a part. Calls `line` with the values of each line of a channel that lie in `area`: index of the
    /// channel, row and first column in the area, and values.
    ///
    /// # Errors
    /// [`Fault`] where the file is broken or cannot be read.
    pub fn lines(
        mut self,
        part: usize,
        area: IntegerBounds,
        mut line: impl FnMut(usize, usize, usize, &[f32]),
    ) -> Result<(), Fault> {
        self.file.seek(SeekFrom::Start(0)).map_err(Fault::Io)?;
        let data = self.meta.headers[part].data_window();
        let from = |data: i32, area: i32| i64::from(data) - i64::from(area);
        let offset = [from(data.position.0, area.position.0), from(data.position.1, area.position.1)];
        let size = [area.size.0, area.size.1];
        let rows = -offset[1]..size[1] as i64 - offset[1];
        let mut values = Vec::new();
        exr::block::read(self.file, false)
            .and_then(|reader| {
                reader.filter_chunks(false, |_, tile, block| {
                    let first = block.pixel_position.y() as i64;
                    block.layer == part
                        && tile.is_largest_resolution_level()
                        && first < rows.end
                        && first + block.pixel_size.height() as i64 > rows.start
                })
            })
            .and_then(|chunks| {
                chunks.decompress_parallel(false, |meta, block| {
                    let list = &meta.headers[part].channels;
                    if block.index.layer != part || block.index.level != Vec2(0, 0) {
                        return Err(exr::error::Error::Invalid("offset table".into()));
                    }
                    cropped(&block, list, size, offset, &mut values, &mut line);
                    Ok(())
                })
            })?;
        Ok(())
    }
}

/// The colours of a file, not read yet.
pub struct Colours {
    picture: Picture,
    exr: OpenExr,
}

/// Colours in the file's own space.
pub struct Pixels {
    /// R, G, B, or the like, and 0, row by row from the top.
    pub values: Vec<[f32; 4]>,
    /// Alpha, by which R, G and B are multiplied, if the file has it.
    pub alpha: Option<Vec<f32>>,
    /// Notes on the file for the user, a sentence each.
    pub notes: Vec<String>,
    kind: Kind,
    space: Space,
}

impl Colours {
    /// Returns the header of the part with the colours.
    pub fn header(&self) -> &Header {
        &self.exr.meta.headers[self.picture.part]
    }

    /// Returns the display window, which is the picture, and the data window.
    ///
    /// # Errors
    /// [`Fault::Bad`] where there is no data inside the display window.
    pub fn windows(&self) -> Result<[IntegerBounds; 2], Fault> {
        self.exr.windows(self.picture.part)
    }

    /// Returns the bytes of [`OpenExr::block_bytes`].
    pub fn block_bytes(&self) -> u128 {
        self.exr.block_bytes(self.picture.part)
    }

    /// Reads the colours of `area`.
    ///
    /// # Errors
    /// [`Fault`] where the file is broken or cannot be read.
    pub fn read(self, area: IntegerBounds) -> Result<Pixels, Fault> {
        let header = self.header();
        let mut notes = Vec::new();
        notes.extend(black(area, header.data_window()));
        let space = space_of(&self.exr.meta.headers[0], header, &mut notes)
            .ok_or_else(|| Fault::bad("its chromaticities span no colours"))?;
        let Colours { picture, exr } = self;
        let mut values = vec![[0.0; 4]; area.size.area()];
        let mut alpha = picture.alpha.map(|_| vec![0.0; area.size.area()]);
        exr.lines(picture.part, area, |channel, y, first, line| {
            if let Some(alpha) = alpha.as_mut().filter(|_| picture.alpha == Some(channel)) {
                alpha[y * area.size.0 + first..][..line.len()].copy_from_slice(line);
            }
            let row = &mut values[y * area.size.0 + first..][..line.len()];
            for component in (0..3).filter(|c| picture.channels[*c] == channel) {
                row.iter_mut().zip(line).for_each(|(pixel, value)| pixel[component] = *value);
            }
        })?;
        Ok(Pixels { values, alpha, notes, kind: picture.kind, space })
    }
}

impl Pixels {
    /// Converts the colours to linear Rec. 709.
    pub fn to_rec709(&mut self) {
        if self.kind == Kind::Chroma {
            rgb_of_chroma(&mut self.values, &self.space);
        }
        let outside = self.space.convert(&mut self.values);
        self.notes.extend(colour::outside(outside));
    }
}

/// Name of a part's compression that the decoder does not know, from the attributes of the headers.
fn unread_compression(start: &[u8]) -> Option<String> {
    fn text(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
        let end = bytes.iter().position(|byte| *byte == 0)?;
        Some((&bytes[..end], &bytes[end + 1..]))
    }
    let several = start.get(5)? & 0x10 != 0;
    let mut rest = start.get(8..).filter(|_| start.starts_with(&[0x76, 0x2f, 0x31, 0x01]))?;
    loop {
        let (name, after) = text(rest)?;
        if name.is_empty() {
            if !several || *after.first()? == 0 {
                return None;
            }
            rest = after;
            continue;
        }
        let (kind, after) = text(after)?;
        let (size, after) = after.split_first_chunk()?;
        let size = usize::try_from(i32::from_le_bytes(*size)).ok()?;
        let (value, after) = after.split_at_checked(size)?;
        if (name, kind) == (b"compression", b"compression") {
            match value.first()? {
                0..=9 => {}
                10 | 11 => return Some("HTJ2K".into()),
                12 => return Some("LJ2K".into()),
                13 => return Some("ZSTD".into()),
                other => return Some(format!("a method of later versions of OpenEXR (number {other})")),
            }
        }
        rest = after;
    }
}

fn overlap(a: IntegerBounds, b: IntegerBounds) -> bool {
    let along = |a: i32, n: usize, b: i32, m: usize| {
        i64::from(a) < i64::from(b) + m as i64 && i64::from(b) < i64::from(a) + n as i64
    };
    along(a.position.0, a.size.0, b.position.0, b.size.0)
        && along(a.position.1, a.size.1, b.position.1, b.size.1)
}

/// Says that a part of the area is black.
fn black(area: IntegerBounds, data: IntegerBounds) -> Option<String> {
    if data.contains(area) {
        return None;
    }
    let size = |w: IntegerBounds| format!("{}×{}", w.size.0, w.size.1);
    Some(format!(
        "its data window of {} texels leaves a part of the {} that are read black",
        size(data),
        size(area)
    ))
}

/// Calls `line` with the values of a block's lines that lie in an area of `size`. `offset` is the place of
/// the data window in it.
fn cropped(
    block: &UncompressedBlock,
    list: &ChannelList,
    size: [usize; 2],
    offset: [i64; 2],
    values: &mut Vec<f32>,
    line: &mut impl FnMut(usize, usize, usize, &[f32]),
) {
    let [width, height] = size.map(|n| n as i64);
    for own in block.lines(list) {
        let y = own.location.position.y() as i64 + offset[1];
        if !(0..height).contains(&y) {
            continue;
        }
        let first = own.location.position.x() as i64 + offset[0];
        let skipped = (-first).clamp(0, own.location.sample_count as i64);
        let taken = (width - first - skipped).clamp(0, own.location.sample_count as i64 - skipped) as usize;
        if taken == 0 {
            continue;
        }
        let sample_type = list.list[own.location.channel].sample_type;
        let samples = own.value.chunks_exact(sample_type.bytes_per_sample()).skip(skipped as usize);
        values.clear();
        values.extend(samples.take(taken).map(|sample| value_of(sample, sample_type)));
        line(own.location.channel, y as usize, (first + skipped) as usize, values);
    }
}

fn value_of(bytes: &[u8], sample_type: SampleType) -> f32 {
    match (sample_type, bytes) {
        (SampleType::F16, &[a, b]) => f16::from_ne_bytes([a, b]).to_f32(),
        (SampleType::F32, &[a, b, c, d]) => f32::from_ne_bytes([a, b, c, d]),
        (SampleType::U32, &[a, b, c, d]) => u32::from_ne_bytes([a, b, c, d]) as f32,
        _ => f32::NAN,
    }
}

/// Turns (R − Y)/Y, Y and (B − Y)/Y into R, G and B.
fn rgb_of_chroma(values: &mut [[f32; 4]], space: &Space) {
    let weights = space.luminance.as_vec3();
    for texel in values {
        let [ry, y, by, _] = *texel;
        let (r, b) = ((ry + 1.0) * y, (by + 1.0) * y);
        *texel = [r, (y - weights.x * r - weights.z * b) / weights.y, b, 0.0];
    }
}

/// Colour space of a part. The attribute `colorInteropID` comes before `chromaticities`, and these before
/// `oiio:ColorSpace`. Returns `None` if the chromaticities span no space.
fn space_of(first: &Header, header: &Header, notes: &mut Vec<String>) -> Option<Space> {
    let text = |name: &str| match header.own_attributes.other.get(&Text::from(name)) {
        Some(AttributeValue::Text(text)) => Some(text.to_string()),
        _ => None,
    };
    let stored = header.shared_attributes.chromaticities.or(first.shared_attributes.chromaticities);
    let stored = stored.map(|Chromaticities { red, green, blue, white }| -> Primaries {
        [red.0, red.1, green.0, green.1, blue.0, blue.1, white.0, white.1].map(f64::from)
    });
    let id = text("colorInteropID");
    let has_id = id.is_some();
    let word = id.or_else(|| text("oiio:ColorSpace"));
    let named = word.as_deref().map(colour::named);
    let word = word.unwrap_or_default();
    let (curve, primaries) = match named {
        Some(Some(named)) => (named.curve, named.primaries),
        Some(None) => {
            notes.push(format!("its colour space \"{word}\" is unknown: its values are taken as linear"));
            (Curve::Linear, None)
        }
        None => (Curve::Linear, None),
    };
    match curve {
        Curve::Linear => {}
        Curve::Srgb => {
            notes.push(format!("its values are coded for display ({word}): decoded by sRGB's curve"))
        }
        Curve::Gamma(gamma) => {
            notes.push(format!("its values are coded ({word}): decoded by the power {gamma}"));
        }
    }
    if let (Some(named), Some(stored), true) = (&primaries, &stored, has_id)
        && !colour::same(named, stored)
    {
        notes.push(format!("its chromaticities are not those of its colour space {word}, which is used"));
    }
    let primaries = if has_id { primaries.or(stored) } else { stored.or(primaries) };
    Space::new(curve, &primaries.unwrap_or(colour::REC709))
}
