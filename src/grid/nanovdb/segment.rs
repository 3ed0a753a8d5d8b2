//! Segments of a file: where its grids are, and what they are called.

use super::super::source::Source;
use super::layout::Kind;
use super::{HEAD, is_magic};
use crate::util::error::Result;

/// Bytes of the record of a grid.
const RECORD_BYTES: u64 = 176;
/// Longest name, bytes.
const LONGEST_NAME: u32 = 1 << 16;
/// Most grids of a file.
const MOST_GRIDS: usize = 1 << 16;

/// Codec of the grids of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Codec {
    None,
    Zip,
    Blosc,
    Unknown(u16),
}

impl Codec {
    fn of(number: u16) -> Codec {
        match number {
            0 => Codec::None,
            1 => Codec::Zip,
            2 => Codec::Blosc,
            other => Codec::Unknown(other),
        }
    }

    pub fn is_known(self) -> bool {
        !matches!(self, Codec::Unknown(_))
    }

    pub fn words(self) -> String {
        match self {
            Codec::None => "none".into(),
            Codec::Zip => "zip".into(),
            Codec::Blosc => "blosc".into(),
            Codec::Unknown(number) => format!("number {number}"),
        }
    }
}

/// Record of a grid.
pub(super) struct Record {
    pub name: String,
    pub kind: Kind,
    pub class: u32,
    pub codec: Codec,
    /// Active samples, or 0 where the writer did not count them.
    pub active: u64,
    pub bounds: [[i32; 3]; 2],
    /// Position of the grid in the file, and its bytes there.
    pub start: u64,
    pub stored: u64,
    /// Bytes of the grid in memory.
    pub size: u64,
}

/// Words of a version, which is packed to 11, 11 and 10 bits.
fn version_words(version: u32) -> String {
    format!("{}.{}.{}", version >> 21, version >> 10 & 0x7ff, version & 0x3ff)
}

/// Reads the records of all segments.
pub(super) fn read_records(source: &mut Source) -> Result<Vec<Record>> {
    let mut records = Vec::new();
    while source.at() < source.end() {
        let at = source.at();
        if !is_magic(&source.array::<8>()?) {
            return Err(source.fault(at, "a segment does not start as NanoVDB does"));
        }
        let version = source.u32()?;
        if version >> 21 != 32 {
            let why = format!("the segment is of version {}, where 32 is read", version_words(version));
            let fix = "write it again with a NanoVDB of today, or export it as .vdb";
            return Err(source.fault_with(at + 8, why, fix));
        }
        let [count, codec] = [u16::from_le_bytes(source.array()?), u16::from_le_bytes(source.array()?)];
        let codec = Codec::of(codec);
        let first = records.len();
        for _ in 0..count {
            if records.len() == MOST_GRIDS {
                return Err(source.fault(source.at(), "it has too many grids"));
            }
            records.push(read_record(source, codec)?);
        }
        for record in &mut records[first..] {
            record.start = source.at();
            if codec != Codec::None {
                // Warp leaves the length of the block out of the bytes that it counts.
                let block = u64::from_le_bytes(source.array()?);
                record.stored = record.stored.saturating_add(if block == record.stored { 8 } else { 0 });
                source.seek(record.start)?;
            }
            source.skip(record.stored)?;
        }
        if source.at() == at + 16 {
            return Err(source.fault(at, "a segment without grids"));
        }
    }
    Ok(records)
}

fn read_record(source: &mut Source, codec: Codec) -> Result<Record> {
    let at = source.at();
    source.check_left(RECORD_BYTES)?;
    let u64 = |source: &mut Source| source.array().map(u64::from_le_bytes);
    let [size, stored, _, active] = [u64(source)?, u64(source)?, u64(source)?, u64(source)?];
    let [kind, class] = [source.u32()?, source.u32()?];
    source.skip(48)?;
    let bounds = [source.index()?, source.index()?];
    source.skip(24)?;
    let name_length = source.u32()?;
    source.seek(at + RECORD_BYTES)?;
    if name_length > LONGEST_NAME {
        return Err(source.fault(at, format!("a name of {name_length} bytes")));
    }
    let mut name = Vec::new();
    source.bytes(name_length.into(), &mut name)?;
    let name = name.split(|&byte| byte == 0).next().unwrap_or_default();
    let name = String::from_utf8_lossy(name).into_owned();
    let is_plain = codec != Codec::None || size == stored;
    if size < HEAD || !is_plain {
        return Err(source.fault(at, format!("a grid of {size} bytes, {stored} in the file")));
    }
    Ok(Record { name, kind: Kind::of(kind), class, codec, active, bounds, start: 0, stored, size })
}
