//! Nodes of a grid, found from the root by their offsets.

use super::super::Builder;
use super::super::order::spread_leaf;
use super::super::tree::{REGION_BYTES, TILE_BYTES, leaf_bytes};
use super::layout::{GRID_BYTES, Memory, Values};
use crate::util::budget::Budget;
use crate::util::error::Error;

/// What ends the reading of a tree.
pub(super) enum Fault {
    /// Byte of the grid and what is wrong there.
    Broken(usize, String),
    Other(Error),
}

type Result<T> = std::result::Result<T, Fault>;

/// log₂ of the children of upper and lower nodes along an axis.
const UPPER: u32 = 5;
const LOWER: u32 = 4;
/// log₂ of the samples of a leaf.
const LEAF: u32 = 3;

/// Reads the tree of a grid.
pub(super) fn read_tree(bytes: &[u8], values: Values, budget: &mut Budget, place: &str) -> Result<Builder> {
    let memory = Memory(bytes);
    let tree = GRID_BYTES as usize;
    let broken = || Fault::Broken(tree, "the tree leads out of the grid".into());
    let offset = memory.u64(tree + 24).and_then(|root| usize::try_from(root).ok());
    let root = offset.and_then(|root| root.checked_add(tree)).ok_or_else(broken)?;
    let counted = memory.u32(tree + 32).unwrap_or(0) as usize;
    let leaves = counted.min(bytes.len() / values.leaf()[1]);
    let mut nodes = Nodes { memory, values, budget, place, left: bytes.len(), leaves, buffer: Vec::new() };
    nodes.take(leaves as u64 * leaf_bytes(values.channels()))?;
    nodes.read_root(root)
}

struct Nodes<'a> {
    memory: Memory<'a>,
    values: Values,
    budget: &'a mut Budget,
    place: &'a str,
    /// Bytes of the grid that no node has taken yet. Nodes do not share memory, so it bounds their number.
    left: usize,
    /// Leaves that there is memory for.
    leaves: usize,
    buffer: Vec<f32>,
}

impl Nodes<'_> {
    fn take(&mut self, bytes: u64) -> Result<()> {
        let place = self.place;
        self.budget.take(bytes.into(), || place.to_owned()).map_err(Fault::Other)
    }

    /// Counts a node of `bytes` at `at`, which must lie inside the grid.
    fn enter(&mut self, at: usize, bytes: usize) -> Result<()> {
        let is_inside = self.memory.bytes(at, bytes).is_some();
        match self.left.checked_sub(bytes) {
            Some(left) if is_inside => self.left = left,
            Some(_) => return Err(Fault::Broken(at, "a node lies outside the grid".into())),
            None => return Err(Fault::Broken(at, "nodes lie on one another".into())),
        }
        Ok(())
    }

    /// Reads a value, which need not be finite.
    fn any(&self, at: usize) -> Result<[f32; 3]> {
        let outside = || Fault::Broken(at, "a value lies outside the grid".into());
        let mut value = [0.0; 3];
        for (i, x) in value.iter_mut().take(self.values.channels()).enumerate() {
            *x = self.memory.f32(at + 4 * i).ok_or_else(outside)?;
        }
        Ok(value)
    }

    /// Reads the value of a tile. Numbers that are not finite are refused in an active one, and become the
    /// background in another.
    fn value(&self, at: usize, is_active: bool, builder: &mut Builder) -> Result<[f32; 3]> {
        let value = self.any(at)?;
        match value.iter().filter(|x| !x.is_finite()).count() {
            0 => Ok(value),
            _ if is_active => Err(Fault::Broken(at, format!("it has the value {value:?}"))),
            count => {
                builder.mended += count as u64;
                let background = builder.background();
                Ok(std::array::from_fn(|a| if value[a].is_finite() { value[a] } else { background[a] }))
            }
        }
    }

    fn read_root(mut self, root: usize) -> Result<Builder> {
        let [before, entry] = self.values.root();
        let outside = || Fault::Broken(root, "the root lies outside the grid".into());
        let count = root.checked_add(24).and_then(|at| self.memory.u32(at)).ok_or_else(outside)? as usize;
        let bytes =
            count.checked_mul(entry).and_then(|table| table.checked_add(before)).ok_or_else(outside)?;
        self.enter(root, bytes)?;
        let background = self.any(root + 28)?;
        let finite = background.map(|x| if x.is_finite() { x } else { 0.0 });
        let mut builder = Builder::new(self.values.channels(), finite);
        builder.mended = background.iter().filter(|x| !x.is_finite()).count() as u64;
        builder.reserve(self.leaves);
        for i in 0..count {
            let at = root + before + entry * i;
            let key = self.memory.u64(at).ok_or_else(outside)?;
            let child = self.memory.u64(at + 8).ok_or_else(outside)?;
            // 21 bits for each axis: z, y, x.
            let origin = [42, 21, 0].map(|shift| ((key >> shift) as u32) << 12).map(|x| x as i32);
            if child != 0 {
                let at = self.child(root, child)?;
                self.read_node(&mut builder, UPPER, at, origin)?;
            } else {
                let state = self.memory.u32(at + 16).ok_or_else(outside)?;
                let value = self.value(at + 20, state != 0, &mut builder)?;
                self.take(TILE_BYTES)?;
                let placed = builder.tile(origin, 1 << (UPPER + LOWER + LEAF), value, state != 0);
                placed.map_err(|e| Fault::Broken(at, e.to_string()))?;
            }
        }
        Ok(builder)
    }

    /// Position of a child that lies `offset` bytes behind its parent.
    fn child(&self, parent: usize, offset: u64) -> Result<usize> {
        let at = usize::try_from(offset).ok().and_then(|offset| parent.checked_add(offset));
        at.filter(|&at| at < self.memory.0.len())
            .ok_or_else(|| Fault::Broken(parent, "a child lies outside the grid".into()))
    }

    /// Reads an upper or a lower node and all below it.
    fn read_node(&mut self, builder: &mut Builder, log: u32, at: usize, origin: [i32; 3]) -> Result<()> {
        let outside = || Fault::Broken(at, "a node lies outside the grid".into());
        let [before, entry] = self.values.node(log);
        let count = 1usize << (3 * log);
        self.enter(at, before + entry * count)?;
        let memory = self.memory;
        let mask = count / 8;
        let background = builder.background();
        let active = memory.bytes(at + 32, mask).ok_or_else(outside)?;
        let children = memory.bytes(at + 32 + mask, mask).ok_or_else(outside)?;
        let child_bits = if log == UPPER { LOWER + LEAF } else { LEAF };
        if log == LOWER {
            self.take(REGION_BYTES)?;
        }
        let table = memory.bytes(at + before, entry * count).ok_or_else(outside)?;
        let channels = self.values.channels();
        for (i, own) in table.chunks_exact(entry).enumerate() {
            let bit = |mask: &[u8]| mask[i / 8] >> (i % 8) & 1 != 0;
            let place = || {
                let local = [i >> (2 * log), i >> log, i].map(|x| (x & ((1 << log) - 1)) as i32);
                std::array::from_fn(|a| origin[a].wrapping_add(local[a] << child_bits))
            };
            let item = at + before + entry * i;
            if !bit(children) {
                let numbers: &[[u8; 4]] = own.as_chunks().0;
                let same = |(bytes, x): (&[u8; 4], &f32)| f32::from_le_bytes(*bytes) == *x;
                if !bit(active) && numbers.iter().zip(&background[..channels]).all(same) {
                    continue;
                }
                let value = self.value(item, bit(active), builder)?;
                self.take(TILE_BYTES)?;
                let placed = builder.tile(place(), 1 << child_bits, value, bit(active));
                placed.map_err(|e| Fault::Broken(at, e.to_string()))?;
                continue;
            }
            let offset = memory.u64(item).ok_or_else(outside)?;
            let child = self.child(at, offset)?;
            match log {
                UPPER => self.read_node(builder, LOWER, child, place())?,
                _ => self.read_leaf(builder, child, place())?,
            }
        }
        Ok(())
    }

    fn read_leaf(&mut self, builder: &mut Builder, at: usize, origin: [i32; 3]) -> Result<()> {
        let outside = || Fault::Broken(at, "a leaf lies outside the grid".into());
        let memory = self.memory;
        let channels = self.values.channels();
        let [before, least] = self.values.leaf();
        let bits = match self.values {
            Values::Fixed(bits) => bits,
            // log₂ of the bits stands in the flags.
            Values::Adaptive => {
                let log = memory.bytes(at, 16).ok_or_else(outside)?[15] >> 5;
                if log > 4 {
                    return Err(Fault::Broken(at, format!("a leaf has codes of 2^{log} bits")));
                }
                1 << log
            }
            Values::Float | Values::Vec3f => 32,
        };
        let bytes = if self.values == Values::Adaptive { least + 64 * bits as usize } else { least };
        self.enter(at, bytes)?;
        match self.leaves {
            // While lists grow they take up to three times as much.
            0 => self.take(3 * leaf_bytes(channels))?,
            _ => self.leaves -= 1,
        }
        let mask = memory.bytes(at + 16, 64).ok_or_else(outside)?;
        let data = memory.bytes(at + before, bytes - before).ok_or_else(outside)?;
        self.buffer.clear();
        match self.values {
            Values::Float | Values::Vec3f => {
                self.buffer.extend(data.as_chunks().0.iter().map(|&x| f32::from_le_bytes(x)));
            }
            Values::Fixed(_) | Values::Adaptive => {
                let least = memory.f32(at + 80).ok_or_else(outside)?;
                let step = memory.f32(at + 84).ok_or_else(outside)?;
                let value = |i: usize| code(data, bits as usize, i) as f32 * step + least;
                self.buffer.extend((0..512).map(value));
            }
        }
        let background = builder.background();
        for (i, value) in self.buffer.iter_mut().enumerate().filter(|(_, x)| !x.is_finite()) {
            let n = i / channels;
            if mask[n / 8] >> (n % 8) & 1 == 0 {
                *value = background[i % channels];
                builder.mended += 1;
            }
        }
        if let Some(i) = self.buffer.iter().position(|x| !x.is_finite()) {
            let i = i / channels;
            let place: [i32; 3] = std::array::from_fn(|a| origin[a] + (i >> (6 - 3 * a) & 7) as i32);
            return Err(Fault::Broken(at, format!("the sample {place:?} is not a finite number")));
        }
        let placed = spread_leaf(builder, origin, LEAF, mask, &self.buffer, channels);
        placed.map_err(|e| Fault::Broken(at, e.to_string()))
    }
}

/// Code `i` of those of 1, 2, 4, 8 or 16 bits, the lowest first.
fn code(data: &[u8], bits: usize, i: usize) -> u32 {
    match bits {
        16 => u32::from(u16::from_le_bytes([data[2 * i], data[2 * i + 1]])),
        _ => {
            let at = bits * i;
            u32::from(data[at / 8]) >> (at % 8) & ((1 << bits) - 1)
        }
    }
}
