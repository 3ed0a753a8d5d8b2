//! OpenEXR files: half, float or integer values in lines or tiles, at the finest level.
//!
//! The display window is the map. Texels outside the data window are black.

use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::Path;

use exr::block::UncompressedBlock;
use exr::block::reader::ChunksReader;
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::attribute::{ChannelList, Chromaticities, EnvironmentMap};
use exr::prelude::{AttributeValue, IntegerBounds, SampleType, Text, Vec2, f16};

use super::channels::{self, Kind, Picture};
use super::colour::{self, Curve, Primaries, Space};
use super::{FileMap, bad, bad_with, check_size, checked, outside, start_of, unreadable};
use crate::light::environment::map::Map;
use crate::util::error::{Error, Result};

/// Value that an infinite one becomes: the largest that a half can hold.
const HALF_MAX: f32 = 65504.0;

pub fn read(path: &Path, mut file: BufReader<File>, budget: u64) -> Result<FileMap> {
    let fault = |e: exr::error::Error| match e {
        exr::error::Error::Io(e) => unreadable(path, e),
        other => bad(path, other),
    };
    let start = start_of(path, &mut file)?;
    if let Some(name) = unread_compression(&start) {
        return Err(bad_with(
            path,
            format!("it is compressed with {name}, which taki does not read"),
            "save it with ZIP compression, or convert it: oiiotool map.exr --compression zip -o new.exr",
        ));
    }
    let meta = MetaData::read_from_buffered(&start[..], false).map_err(fault)?;
    drop(start);
    let picture = channels::picture_of(&meta.headers).map_err(|(why, fix)| bad_with(path, why, fix))?;
    let header = &meta.headers[picture.part];
    if header.own_attributes.environment_map == Some(EnvironmentMap::Cube) {
        return Err(bad_with(
            path,
            "its envmap attribute says that it is a cube",
            "make it equirectangular: exrenvmap -latlong map.exr new.exr",
        ));
    }
    let mut notes = Vec::new();
    let (display, data) = (header.shared_attributes.display_window, header.data_window());
    if !overlap(display, data) {
        return Err(bad(path, "its picture lies outside its display window"));
    }
    notes.extend(black(display, data));
    let size = display.size;
    // One block may hold the whole data window, compressed and uncompressed.
    let bytes: u128 = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() as u128).sum();
    let bytes = bytes * data.size.0 as u128 * data.size.1 as u128 * 2;
    check_size(path, size.0 as u64, size.1 as u64, bytes, budget)?;
    let space = space_of(&meta.headers[0], header, &mut notes)
        .ok_or_else(|| bad(path, "its chromaticities span no colours"))?;
    file.seek(SeekFrom::Start(0)).map_err(|e| Error::read(path, e))?;

    let mut map = Map { width: size.0 as u32, height: size.1 as u32, texels: vec![[0.0; 4]; size.area()] };
    let from = |data: i32, display: i32| i64::from(data) - i64::from(display);
    let offset = [from(data.position.0, display.position.0), from(data.position.1, display.position.1)];
    let rows = -offset[1]..i64::from(map.height) - offset[1];
    exr::block::read(file, false)
        .and_then(|reader| {
            reader.filter_chunks(false, |_, tile, block| {
                let first = block.pixel_position.y() as i64;
                block.layer == picture.part
                    && tile.is_largest_resolution_level()
                    && first < rows.end
                    && first + block.pixel_size.height() as i64 > rows.start
            })
        })
        .and_then(|chunks| {
            chunks.decompress_parallel(false, |meta, block| {
                let list = &meta.headers[picture.part].channels;
                if block.index.layer != picture.part || block.index.level != Vec2(0, 0) {
                    return Err(exr::error::Error::Invalid("offset table".into()));
                }
                insert(&mut map, &block, &picture, list, offset);
                Ok(())
            })
        })
        .map_err(fault)?;

    notes.extend(clamp_infinite(&mut map));
    if picture.kind == Kind::Chroma {
        rgb_of_chroma(&mut map, &space);
    }
    notes.extend(outside(space.convert(&mut map.texels)));
    checked(path, map, notes)
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

/// Says that a part of the map is black.
fn black(display: IntegerBounds, data: IntegerBounds) -> Option<String> {
    if data.contains(display) {
        return None;
    }
    let size = |w: IntegerBounds| format!("{}×{}", w.size.0, w.size.1);
    Some(format!(
        "its data window of {} texels leaves a part of its display window of {} black",
        size(data),
        size(display)
    ))
}

/// Puts a block's values into the map. `offset` is the place of the data window in it.
fn insert(map: &mut Map, block: &UncompressedBlock, picture: &Picture, list: &ChannelList, offset: [i64; 2]) {
    let width = i64::from(map.width);
    for line in block.lines(list) {
        let y = line.location.position.y() as i64 + offset[1];
        if !(0..i64::from(map.height)).contains(&y) {
            continue;
        }
        let first = line.location.position.x() as i64 + offset[0];
        let skipped = (-first).clamp(0, line.location.sample_count as i64);
        let taken = (width - first - skipped).clamp(0, line.location.sample_count as i64 - skipped) as usize;
        let row = &mut map.texels[(y * width) as usize..][..width as usize];
        let sample_type = list.list[line.location.channel].sample_type;
        let components = (0..3).filter(|c| picture.channels[*c] == line.location.channel);
        for component in components {
            let samples = line.value.chunks_exact(sample_type.bytes_per_sample()).skip(skipped as usize);
            for (i, sample) in samples.take(taken).enumerate() {
                row[(first + skipped) as usize + i][component] = value_of(sample, sample_type);
            }
        }
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

/// Replaces infinite values, which a half makes of a bright sun, by the largest that it can hold.
fn clamp_infinite(map: &mut Map) -> Option<String> {
    let mut count = 0u64;
    for value in map.texels.iter_mut().flatten().filter(|value| **value == f32::INFINITY) {
        *value = HALF_MAX;
        count += 1;
    }
    (count > 0).then(|| format!("{count} infinite values were replaced by {HALF_MAX}"))
}

/// Turns (R − Y)/Y, Y and (B − Y)/Y into R, G and B.
fn rgb_of_chroma(map: &mut Map, space: &Space) {
    let weights = space.luminance.as_vec3();
    for texel in &mut map.texels {
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
