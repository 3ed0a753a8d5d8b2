//! OpenVDB's files (.vdb), versions 222 to 225.
//!
//! A file is a header, and then each grid: a descriptor that says where the grid ends, its metadata, its
//! transform, the topology of its tree, and the values of its leaves. So one grid can be read without the
//! others, whatever those hold.

mod head;
mod node;
mod transform;
mod values;
mod write;

use std::path::Path;

use super::source::{Source, budget};
use super::{Bounds, Grid, Summary};
use crate::util::error::{Error, Result};
use head::{Descriptor, GridHead, read_descriptors, read_grid_head};
use values::{Kind, compression_words};
pub use write::encode_vdb;

/// First bytes of a file.
pub(super) const MAGIC: [u8; 8] = [0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0];

pub(super) fn list(path: &Path) -> Result<Vec<Summary>> {
    let mut source = Source::open(path)?;
    let descriptors = read_descriptors(&mut source)?;
    let mut summaries = Vec::new();
    for descriptor in &descriptors {
        source.enter(&descriptor.name);
        let head = read_grid_head(&mut source, descriptor)?;
        summaries.push(summary(descriptor, head));
    }
    Ok(summaries)
}

fn summary(descriptor: &Descriptor, head: GridHead) -> Summary {
    let is_known = descriptor.kind().is_ok();
    let refusal = refusal(descriptor, &head).map(|(why, fix)| format!("{why}; {fix}"));
    let bounds = match (head.meta.least, head.meta.greatest) {
        // An empty grid has a box turned inside out.
        (Some(min), Some(max)) if (0..3).all(|a| min[a] <= max[a]) => Some(Bounds { min, max }),
        _ => None,
    };
    Summary {
        name: descriptor.name.clone(),
        kind: descriptor.kind_words(),
        class: head.meta.class,
        active: head.meta.active.filter(|_| is_known),
        bounds,
        to_world: head.transform.ok(),
        compression: compression_words(head.flags),
        refusal,
    }
}

/// Why a grid is not read, and what to do.
fn refusal(descriptor: &Descriptor, head: &GridHead) -> Option<(String, String)> {
    if let Err(why) = descriptor.kind() {
        return Some(why);
    }
    if let Err(why) = values::check_compression(head.flags) {
        return Some(why);
    }
    head.transform.as_ref().err().cloned()
}

pub(super) fn read(path: &Path, name: &str, bytes: u64) -> Result<Grid> {
    let mut budget = budget(bytes);
    let mut source = Source::open(path)?;
    let descriptors = read_descriptors(&mut source)?;
    let names = descriptors.iter().map(|descriptor| descriptor.name.as_str());
    let number = super::find(path, name, names)?;
    let descriptor = &descriptors[number];
    source.enter(&descriptor.name);
    let head = read_grid_head(&mut source, descriptor)?;
    let fail = |source: &Source, (why, fix): (String, String)| {
        Err(Error::input(format!("{}: {why}", source.place()), fix))
    };
    if let Some(refusal) = refusal(descriptor, &head) {
        return fail(&source, refusal);
    }
    let (meta, transform) = (head.meta, head.transform);
    let (kind, dims) = match descriptor.kind() {
        Ok(found) => found,
        Err(why) => return fail(&source, why),
    };
    let flags = match descriptor.parent.is_empty() {
        true => head.flags,
        // The tree is another grid's.
        false => {
            let parent = descriptors.iter().find(|other| {
                other.unique == descriptor.parent
                    && other.parent.is_empty()
                    && other.kind() == Ok((kind, dims))
            });
            let Some(parent) = parent else {
                let why = format!("it shares the tree of {:?}, which is not there", descriptor.parent);
                return fail(&source, (why, super::source::WRITE_AGAIN.into()));
            };
            let flags = read_grid_head(&mut source, parent)?.flags;
            if let Err(why) = values::check_compression(flags) {
                return fail(&source, why);
            }
            flags
        }
    };
    let builder = node::read_tree(&mut source, (kind, dims), flags, &mut budget)?;
    match transform {
        Ok(to_world) => Ok(builder.finish(descriptor.name.clone(), meta.class, to_world)),
        Err(why) => fail(&source, why),
    }
}

/// Type of the values of a tree, and log₂ of the branches of its nodes from the top.
type TreeKind = (Kind, [u32; 3]);
