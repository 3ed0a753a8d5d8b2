//! NanoVDB's files (.nvdb), versions 32.
//!
//! A file is a row of segments, each a header, a record with a name for each of its grids, and the grids. A
//! grid is the memory of the program that wrote it: nodes that lead to one another by offsets.

mod layout;
mod nodes;
mod plan;
mod segment;
mod stats;
mod write;

use std::collections::HashMap;
use std::path::Path;

use super::codec::Decoder;
use super::source::{Source, WRITE_AGAIN, budget};
use super::{Bounds, Class, Grid, Summary};
use crate::util::error::{Error, Result};
use layout::{GRID_BYTES, GridData, Kind, TREE_BYTES};
use segment::{Codec, Record, read_records};

pub use write::encode_nvdb;

/// First bytes of a file or of a segment.
const MAGICS: [&[u8; 8]; 3] = [b"NanoVDB0", b"NanoVDB1", b"NanoVDB2"];
/// Most bytes of a grid that its list needs.
const HEAD: u64 = GRID_BYTES + TREE_BYTES + 24;

/// Tells whether a file starts as one of NanoVDB.
pub(super) fn is_magic(start: &[u8]) -> bool {
    MAGICS.iter().any(|magic| start == &magic[..])
}

pub(super) fn list(path: &Path, bytes: u64) -> Result<Vec<Summary>> {
    let mut source = Source::open(path)?;
    let records = read_records(&mut source)?;
    let mut summaries: Vec<Summary> = Vec::new();
    for record in &records {
        // What the record says suffices, unless its writer left it empty.
        let head = match record.kind.is_known() && record.codec.is_known() {
            true => Some(read_grid(&mut source, record, HEAD.min(record.size), bytes)?),
            false => None,
        };
        let grid = match &head {
            Some(head) => Some(GridData::of(head).map_err(|why| source.fault(record.start, why))?),
            None => None,
        };
        summaries.push(summary(record, grid));
    }
    number_twins(&mut summaries);
    Ok(summaries)
}

/// Adds a number to each name that several grids have.
fn number_twins(summaries: &mut [Summary]) {
    let mut counts: HashMap<String, [usize; 2]> = HashMap::new();
    for summary in summaries.iter() {
        counts.entry(summary.name.clone()).or_default()[0] += 1;
    }
    for summary in summaries {
        if let Some([count, number]) = counts.get_mut(&summary.name)
            && *count > 1
        {
            summary.name = format!("{}[{number}]", summary.name);
            *number += 1;
        }
    }
}

fn summary(record: &Record, grid: Option<GridData>) -> Summary {
    let refusal = match (record.kind.is_known(), record.codec, &grid) {
        (false, ..) => Some((
            format!("its type is {}, which is not read", record.kind.words()),
            "convert it to Float, Fp16 or Vec3f with nanovdb_convert or vdb_tool".to_owned(),
        )),
        (true, Codec::Unknown(_), _) => Some((
            format!("its codec is {}, which is not read", record.codec.words()),
            "write it with blosc, zip or none".to_owned(),
        )),
        (true, _, Some(grid)) => grid.to_world.clone().err(),
        (true, _, None) => None,
    };
    let name = match (record.name.is_empty(), &grid) {
        (true, Some(grid)) => grid.name.clone(),
        _ => record.name.clone(),
    };
    let name = super::named(name);
    let bounds = Bounds { min: record.bounds[0], max: record.bounds[1] };
    let is_box = record.active > 0 && (0..3).all(|a| bounds.min[a] <= bounds.max[a]);
    let (active, bounds) = match &grid {
        // A writer that leaves the count empty leaves the box empty too.
        Some(grid) if record.active == 0 => (Some(grid.active), grid.bounds.filter(|_| grid.active > 0)),
        _ => (Some(record.active), is_box.then_some(bounds)),
    };
    Summary {
        name,
        kind: record.kind.words(),
        class: match record.class {
            1 => Class::LevelSet,
            2 => Class::FogVolume,
            3 => Class::Staggered,
            _ => Class::Unknown,
        },
        active,
        bounds,
        to_world: grid.and_then(|grid| grid.to_world.ok()),
        compression: record.codec.words(),
        refusal: refusal.map(|(why, fix)| format!("{why}; {fix}")),
    }
}

pub(super) fn read(path: &Path, name: &str, bytes: u64) -> Result<Grid> {
    let summaries = list(path, bytes)?;
    let number = super::find(path, name, summaries.iter().map(|summary| summary.name.as_str()))?;
    let summary = &summaries[number];
    let mut source = Source::open(path)?;
    let records = read_records(&mut source)?;
    source.enter(name);
    let (Some(record), None) = (records.get(number), &summary.refusal) else {
        let why = summary.refusal.as_deref().unwrap_or("the file has changed");
        return Err(Error::input(
            format!("{}: {}", source.place(), why.split("; ").next().unwrap_or(why)),
            why.split_once("; ").map_or(WRITE_AGAIN, |(_, fix)| fix),
        ));
    };
    let mut budget = budget(bytes);
    budget.take(u128::from(record.size) + u128::from(record.stored), || source.place())?;
    let data = read_grid(&mut source, record, record.size, bytes)?;
    let (start, kind) = (record.start, record.kind);
    let fault = |why: String| source.fault(start, why);
    let head = GridData::of(&data).map_err(fault)?;
    let to_world = match head.to_world {
        Ok(transform) => transform,
        Err((why, fix)) => return Err(Error::input(format!("{}: {why}", source.place()), fix)),
    };
    if head.kind != kind {
        return Err(fault(format!("it is {}, and listed as {}", head.kind.words(), kind.words())));
    }
    let Kind::Known(values) = kind else { return Err(fault("its type is not read".into())) };
    let place = source.place();
    let builder = nodes::read_tree(&data, values, &mut budget, &place).map_err(|e| match e {
        nodes::Fault::Broken(at, why) => {
            source.fault_with(start, format!("{why} (byte {at} of the grid)"), WRITE_AGAIN)
        }
        nodes::Fault::Other(error) => error,
    })?;
    Ok(builder.finish(summary.name.clone(), summary.class, to_world))
}

/// Most compressed bytes that are read for the head of a grid.
const MOST_START: u64 = 16 << 20;

/// Reads the first `wanted` bytes of a grid.
fn read_grid(source: &mut Source, record: &Record, wanted: u64, bytes: u64) -> Result<Vec<u8>> {
    source.seek(record.start)?;
    let mut data = Vec::new();
    if record.codec == Codec::None {
        source.bytes(wanted, &mut data)?;
        return Ok(data);
    }
    let mut stored = Vec::new();
    let mut decoder = Decoder::new();
    let end = record.start + record.stored;
    while (data.len() as u64) < wanted {
        let at = source.at();
        let length = u64::from_le_bytes(source.array()?);
        if length == 0 || length > end.saturating_sub(source.at()) {
            return Err(source.fault(at, format!("a block of {length} compressed bytes")));
        }
        let read = if wanted < record.size { length.min(MOST_START) } else { length };
        budget(bytes).take(u128::from(read) + u128::from(wanted), || source.place())?;
        source.bytes(read, &mut stored)?;
        source.skip(length - read)?;
        let start = data.len();
        let left = wanted - start as u64;
        let done = match record.codec {
            Codec::Zip => {
                data.resize(wanted as usize, 0);
                decoder.zlib_start(&stored, &mut data[start..]).map(|done| data.truncate(start + done))
            }
            _ => {
                let block = Decoder::blosc_length(&stored).unwrap_or(0).min(left);
                data.resize(start + block as usize, 0);
                decoder.blosc(&stored, &mut data[start..])
            }
        };
        done.map_err(|why| source.fault_with(at, why, "copy the file again, or write it with zip or none"))?;
        if data.len() == start {
            return Err(source.fault(at, "a compressed block holds nothing"));
        }
    }
    Ok(data)
}
