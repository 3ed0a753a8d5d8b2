//! The tree of a grid: its topology, and after it the values of all leaves in the same order.

use super::super::source::Source;
use super::super::tree::{REGION_BYTES, TILE_BYTES, leaf_bytes};
use super::super::{Builder, order::spread_leaf};
use super::TreeKind;
use super::values::{FINITE, ValueReader, bit};
use crate::util::budget::Budget;
use crate::util::error::{Error, Result};

/// Reads a tree from the start of its topology.
pub(super) fn read_tree(
    source: &mut Source,
    (kind, dims): TreeKind,
    flags: u32,
    budget: &mut Budget,
) -> Result<Builder> {
    let [upper, lower, leaf] = dims;
    let at = source.at();
    let buffers = source.i32()?;
    if buffers != 1 {
        return Err(source.fault(at, format!("the tree has {buffers} buffers, not 1")));
    }
    let mut values = ValueReader::new(kind, flags);
    let largest = 1 << (3 * upper.max(lower).max(leaf));
    budget.take(values.most_bytes(largest).into(), || source.place())?;
    let background = values.read_one(source)?;
    values.background = values.mended_one(background);
    let builder = Builder::new(kind.channels, values.background);
    let mut tree = Tree { source, budget, values, builder, dims, leaves: Vec::new(), masks: Vec::new() };
    tree.read_root()?;
    tree.read_leaves()?;
    tree.builder.mended = tree.values.mended;
    Ok(tree.builder)
}

/// Memory of the region that a tile may need, where no lower node has counted it, bytes.
fn region_of_tile(side: u32) -> u64 {
    if side < 128 { REGION_BYTES } else { 0 }
}

struct Tree<'a> {
    source: &'a mut Source,
    budget: &'a mut Budget,
    values: ValueReader,
    builder: Builder,
    dims: [u32; 3],
    /// Origins of the leaves in the order of the file.
    leaves: Vec<[i32; 3]>,
    /// Masks of the nodes above: child and active, for each level.
    masks: Vec<[Vec<u8>; 2]>,
}

impl Tree<'_> {
    /// log₂ of the side of the cube of a node: of an upper one at level 0, of a leaf at level 2.
    fn bits(&self, level: usize) -> u32 {
        self.dims[level..].iter().sum()
    }

    fn take(&mut self, bytes: u64) -> Result<()> {
        let source = &self.source;
        self.budget.take(bytes.into(), || source.place())
    }

    fn read_root(&mut self) -> Result<()> {
        let side = 1u32 << self.bits(0);
        let [tiles, children] = [self.source.u32()?, self.source.u32()?];
        for _ in 0..tiles {
            let at = self.source.at();
            let origin = self.source.index()?;
            let mut value = self.values.read_one(self.source)?;
            let is_active = self.source.u8()? != 0;
            if !is_active {
                value = self.values.mended_one(value);
            } else if value.iter().any(|x| !x.is_finite()) {
                return Err(self.not_finite(at, origin));
            }
            self.take(TILE_BYTES + region_of_tile(side))?;
            self.builder.tile(origin, side, value, is_active).map_err(|e| self.source.fault(at, e))?;
        }
        self.masks = vec![[Vec::new(), Vec::new()], [Vec::new(), Vec::new()]];
        for _ in 0..children {
            let at = self.source.at();
            let origin = self.source.index()?;
            if origin.iter().any(|x| x & (side - 1) as i32 != 0) {
                return Err(self.source.fault(at, format!("a node starts at {origin:?}")));
            }
            self.read_node(0, origin)?;
        }
        Ok(())
    }

    /// Reads an upper (0) or lower (1) node and all below it, but for the values of leaves.
    fn read_node(&mut self, level: usize, origin: [i32; 3]) -> Result<()> {
        let log = self.dims[level];
        let count = 1usize << (3 * log);
        let child_bits = self.bits(level + 1);
        let at = self.source.at();
        let [mut children, mut active] = std::mem::take(&mut self.masks[level]);
        self.source.bytes(count as u64 / 8, &mut children)?;
        self.source.bytes(count as u64 / 8, &mut active)?;
        self.values.read(self.source, &active)?;
        if level == 1 {
            let regions = 1u64 << (3 * self.bits(1).saturating_sub(7));
            self.take(regions * REGION_BYTES)?;
        }
        let channels = self.values.kind.channels;
        let place = |i: usize| {
            let local = [i >> (2 * log), i >> log, i].map(|x| (x & ((1 << log) - 1)) as i32);
            std::array::from_fn(|a| origin[a] + (local[a] << child_bits))
        };
        let background = self.values.background;
        self.values.mend(|i| !bit(&children, i) && !bit(&active, i));
        for i in (0..count).filter(|&i| !bit(&children, i)) {
            let own = &self.values.values[channels * i..][..channels];
            let is_active = bit(&active, i);
            if !is_active && *own == background[..channels] {
                continue;
            }
            let value: [f32; 3] = std::array::from_fn(|a| own.get(a).copied().unwrap_or(0.0));
            if value.iter().any(|x| !x.is_finite()) {
                return Err(self.not_finite(at, place(i)));
            }
            self.take(TILE_BYTES + if level == 0 { region_of_tile(1 << child_bits) } else { 0 })?;
            let placed = self.builder.tile(place(i), 1 << child_bits, value, is_active);
            placed.map_err(|e| self.source.fault(at, e))?;
        }
        for i in (0..count).filter(|&i| bit(&children, i)) {
            match level {
                0 => self.read_node(1, place(i))?,
                _ => {
                    // The mask stands once more beside the values.
                    self.source.skip(1 << (3 * child_bits - 3))?;
                    let parts = 1u64 << (3 * (child_bits - 3));
                    let list = 2 * size_of::<[i32; 3]>() as u64;
                    self.take(parts * leaf_bytes(channels) + list)?;
                    self.leaves.push(place(i));
                }
            }
        }
        self.masks[level] = [children, active];
        Ok(())
    }

    fn not_finite(&self, at: u64, index: [i32; 3]) -> Error {
        self.source.fault_with(at, format!("the sample {index:?} is not a finite number"), FINITE)
    }

    fn read_leaves(&mut self) -> Result<()> {
        let log = self.dims[2];
        let channels = self.values.kind.channels;
        let parts = 1usize << (3 * (log - 3));
        self.builder.reserve(self.leaves.len() * parts);
        let mut mask = Vec::new();
        for origin in std::mem::take(&mut self.leaves) {
            let at = self.source.at();
            self.source.bytes(1 << (3 * log - 3), &mut mask)?;
            self.values.read(self.source, &mask)?;
            self.values.mend(|i| !bit(&mask, i));
            if let Some(i) = self.values.values.iter().position(|x| !x.is_finite()) {
                let i = i / channels;
                let local = [i >> (2 * log), i >> log, i];
                let local = local.map(|x| (x & ((1 << log) - 1)) as i32);
                return Err(self.not_finite(at, std::array::from_fn(|a| origin[a] + local[a])));
            }
            let placed = spread_leaf(&mut self.builder, origin, log, &mask, &self.values.values, channels);
            placed.map_err(|e| self.source.fault(at, e))?;
        }
        Ok(())
    }
}
