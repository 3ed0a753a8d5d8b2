//! Sparse storage of a grid.
//!
//! Leaves hold 8³ samples, tiles are constant cubes. A region of 128³ samples lists what lies in each of its
//! 16³ blocks; larger tiles stand in a table for each size.

use std::collections::HashMap;

use glam::DAffine3;

use super::{Bounds, Builder, Class};

/// Samples of a leaf along an axis.
pub(super) const LEAF: u32 = 8;
/// Samples of a leaf.
pub(super) const LEAF_SAMPLES: usize = 512;
/// log₂ of the samples of a region along an axis.
pub(super) const REGION_BITS: u32 = 7;
/// Blocks of a region.
pub(super) const REGION_BLOCKS: usize = 4096;

/// Slot of a region that holds nothing.
pub(super) const EMPTY: u32 = u32::MAX;
/// Bit of a slot that holds a tile.
pub(super) const TILE: u32 = 1 << 31;

/// Values on a regular grid with an affine transform. Sparse: see the [module](super).
#[derive(Clone, Debug)]
pub struct Grid {
    /// Name in the file.
    pub name: String,
    /// What the numbers mean.
    pub class: Class,
    /// Transform from an index to the place of its sample in the world.
    pub to_world: DAffine3,
    /// Value where no block is. A scalar stands in the first component, and the others are 0.
    pub background: [f32; 3],
    /// Numbers outside of the active samples that were not finite in the file: they became the background, or
    /// 0 if that was not finite itself.
    pub mended: u64,
    pub(super) channels: usize,
    pub(super) bounds: Option<Bounds>,
    pub(super) active: u64,
    pub(super) store: Store,
}

/// Blocks and their tables.
#[derive(Clone, Debug, Default)]
pub(super) struct Store {
    pub(super) origins: Vec<[i32; 3]>,
    pub(super) masks: Vec<[u64; 8]>,
    /// Samples of all leaves, each x fastest and with its channels side by side.
    pub(super) values: Vec<f32>,
    pub(super) tiles: Vec<Tile>,
    pub(super) regions: HashMap<[i32; 3], Box<[u32]>>,
    /// log₂ of the side, and the tiles of that size.
    pub(super) large: Vec<(u32, HashMap<[i32; 3], u32>)>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Tile {
    pub(super) origin: [i32; 3],
    pub(super) side: u32,
    pub(super) value: [f32; 3],
    pub(super) is_active: bool,
}

/// A part of a grid that its storage holds.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    /// Least index along each axis, a multiple of `side`.
    pub origin: [i32; 3],
    /// Samples along each axis: 8, or a larger power of two for a tile.
    pub side: u32,
    /// What the block holds.
    pub data: BlockData<'a>,
}

/// Values of a block.
#[derive(Clone, Copy, Debug)]
pub enum BlockData<'a> {
    /// 8³ samples. Sample (x, y, z) of the block has the number i = x + 8y + 64z.
    Leaf {
        /// Values, `channels` for each sample.
        values: &'a [f32],
        /// Bit i % 64 of word i / 64 tells whether sample i is active.
        active: &'a [u64; 8],
    },
    /// One value everywhere.
    Tile {
        /// The value; a scalar stands in the first component.
        value: [f32; 3],
        /// Whether all samples are active, or none.
        is_active: bool,
    },
}

impl Block<'_> {
    /// Active samples of the block.
    pub fn active_count(&self) -> u64 {
        match self.data {
            BlockData::Leaf { active, .. } => active.iter().map(|word| u64::from(word.count_ones())).sum(),
            BlockData::Tile { is_active: true, .. } => u64::from(self.side).saturating_pow(3),
            BlockData::Tile { .. } => 0,
        }
    }

    /// Bounds of the active samples of the block; `None` where it has none.
    pub fn bounds(&self) -> Option<Bounds> {
        match self.data {
            BlockData::Leaf { active, .. } => leaf_bounds(active).map(|[min, max]| Bounds {
                min: std::array::from_fn(|a| self.origin[a] + min[a]),
                max: std::array::from_fn(|a| self.origin[a] + max[a]),
            }),
            BlockData::Tile { is_active: true, .. } => {
                let last = (self.side - 1) as i32;
                Some(Bounds { min: self.origin, max: self.origin.map(|x| x + last) })
            }
            BlockData::Tile { .. } => None,
        }
    }
}

/// Least and greatest position of the bits of a leaf.
fn leaf_bounds(mask: &[u64; 8]) -> Option<[[i32; 3]; 2]> {
    let first = mask.iter().position(|&layer| layer != 0)? as i32;
    let last = mask.iter().rposition(|&layer| layer != 0)? as i32;
    let all = mask.iter().fold(0, |all, layer| all | layer);
    let row = all.to_le_bytes().iter().fold(0, |row, byte| row | byte);
    let [y0, y1] = [all.trailing_zeros() / 8, 7 - all.leading_zeros() / 8].map(|y| y as i32);
    let [x0, x1] = [row.trailing_zeros(), 7 - row.leading_zeros()].map(|x| x as i32);
    Some([[x0, y0, first], [x1, y1, last]])
}

/// Position of a block in the list of its region.
pub(super) fn slot(index: [i32; 3]) -> usize {
    let [x, y, z] = index.map(|x| (x >> 3 & 15) as usize);
    x + 16 * y + 256 * z
}

/// Number of a sample in its leaf.
fn sample(index: [i32; 3]) -> usize {
    let [x, y, z] = index.map(|x| (x & 7) as usize);
    x + 8 * y + 64 * z
}

impl Grid {
    /// A grid of a dense array, whose samples are all active. The background is 0. Blocks of 8³ samples with
    /// one value become tiles.
    ///
    /// `values` has x fastest, then y, then z, and the `channels` (1 or 3) of a sample side by side. `origin`
    /// is the index of the first sample.
    ///
    /// # Panics
    /// Panics if `values` has another length than channels · size, or an index does not fit into an i32.
    pub fn from_dense(
        name: impl Into<String>,
        channels: usize,
        origin: [i32; 3],
        size: [u32; 3],
        values: Vec<f32>,
        to_world: DAffine3,
    ) -> Grid {
        let count = size.iter().try_fold(channels as u64, |n, &side| n.checked_mul(u64::from(side)));
        assert_eq!(count, Some(values.len() as u64), "{channels} channels of {size:?} samples");
        let end: [i64; 3] = std::array::from_fn(|a| i64::from(origin[a]) + i64::from(size[a]));
        assert!(end.iter().all(|&end| end <= i64::from(i32::MAX)), "indices up to {end:?}");
        let mut builder = Builder::new(channels, [0.0; 3]);
        if values.is_empty() {
            return builder.finish(name, Class::Unknown, to_world);
        }
        let first = origin.map(|x| x >> 3);
        let last = end.map(|end| ((end - 1) >> 3) as i32);
        let blocks = (0..3).map(|a| (last[a] - first[a] + 1) as usize).product();
        builder.reserve(blocks);
        let mut leaf = vec![0.0; LEAF_SAMPLES * channels];
        for bz in first[2]..=last[2] {
            for by in first[1]..=last[1] {
                for bx in first[0]..=last[0] {
                    let low = [bx, by, bz].map(|x| i64::from(x) * 8);
                    let mut mask = [0u64; 8];
                    leaf.fill(0.0);
                    for i in 0..LEAF_SAMPLES {
                        let local = [i & 7, i >> 3 & 7, i >> 6];
                        let at: [i64; 3] = std::array::from_fn(|a| low[a] + local[a] as i64);
                        if (0..3).any(|a| at[a] < i64::from(origin[a]) || at[a] >= end[a]) {
                            continue;
                        }
                        let [x, y, z] = std::array::from_fn(|a| (at[a] - i64::from(origin[a])) as usize);
                        let from = channels * (x + size[0] as usize * (y + size[1] as usize * z));
                        leaf[channels * i..][..channels].copy_from_slice(&values[from..][..channels]);
                        mask[i >> 6] |= 1 << (i & 63);
                    }
                    let low = low.map(|x| x as i32);
                    let first = leaf[..channels].to_vec();
                    let is_constant = mask == [u64::MAX; 8]
                        && leaf.chunks(channels).all(|v| v.iter().zip(&first).all(same_bits));
                    let placed = match is_constant {
                        true => builder.tile(low, LEAF, padded(&first), true),
                        false => builder.leaf(low, mask, |into| into.copy_from_slice(&leaf)),
                    };
                    placed.expect("blocks of an array do not overlap");
                }
            }
        }
        builder.finish(name, Class::Unknown, to_world)
    }

    /// Numbers of a sample: 1 or 3.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Bounds of the active samples; `None` where there are none.
    pub fn bounds(&self) -> Option<Bounds> {
        self.bounds
    }

    /// Active samples.
    pub fn active_count(&self) -> u64 {
        self.active
    }

    /// Memory that the grid takes, bytes.
    pub fn bytes(&self) -> u64 {
        let store = &self.store;
        let large: usize = store.large.iter().map(|(_, table)| table.capacity() * LARGE_ENTRY).sum();
        let bytes = store.origins.capacity() * size_of::<[i32; 3]>()
            + store.masks.capacity() * size_of::<[u64; 8]>()
            + store.values.capacity() * size_of::<f32>()
            + store.tiles.capacity() * size_of::<Tile>()
            + store.regions.len() * REGION_BYTES as usize
            + large;
        bytes as u64
    }

    /// Value at an index; the background outside all blocks. A scalar stands in the first component.
    pub fn at(&self, index: [i32; 3]) -> [f32; 3] {
        self.reader().at(index)
    }

    /// Multiplies all values and the background by a factor.
    pub(crate) fn scale(&mut self, factor: f32) {
        if factor == 1.0 {
            return;
        }
        self.background = self.background.map(|x| x * factor);
        self.store.values.iter_mut().for_each(|x| *x *= factor);
        self.store.tiles.iter_mut().for_each(|tile| tile.value = tile.value.map(|x| x * factor));
    }

    /// A reader that remembers where it read last, for indices that lie near one another.
    pub fn reader(&self) -> Reader<'_> {
        Reader { grid: self, region: [i32::MAX; 3], slots: None }
    }

    /// All blocks: the leaves, then the tiles, each in the order of the file. No two overlap. Tiles that are
    /// not active are among them where their value is not the background, such as the inside of a level set.
    pub fn blocks(&self) -> impl Iterator<Item = Block<'_>> {
        let store = &self.store;
        let length = LEAF_SAMPLES * self.channels;
        let leaves = store.origins.iter().zip(&store.masks).zip(store.values.chunks_exact(length));
        let leaves = leaves.map(|((&origin, active), values)| Block {
            origin,
            side: LEAF,
            data: BlockData::Leaf { values, active },
        });
        let tiles = store.tiles.iter().map(|tile| Block {
            origin: tile.origin,
            side: tile.side,
            data: BlockData::Tile { value: tile.value, is_active: tile.is_active },
        });
        leaves.chain(tiles)
    }

    /// Value of an index that lies in no region.
    fn at_large(&self, index: [i32; 3]) -> [f32; 3] {
        let found = self.store.large.iter().find_map(|(bits, table)| table.get(&index.map(|x| x >> bits)));
        found.map_or(self.background, |&tile| self.store.tiles[tile as usize].value)
    }
}

pub(super) fn same_bits((a, b): (&f32, &f32)) -> bool {
    a.to_bits() == b.to_bits()
}

/// One or three numbers as three.
pub(super) fn padded(value: &[f32]) -> [f32; 3] {
    std::array::from_fn(|a| value.get(a).copied().unwrap_or(0.0))
}

/// Looks values up in a grid, and remembers the region of the last.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    grid: &'a Grid,
    /// The last region, and what lies in it. No index lies in the region of the start.
    region: [i32; 3],
    slots: Option<&'a [u32]>,
}

impl Reader<'_> {
    /// Value at an index, as [`Grid::at`] gives it.
    #[inline]
    pub fn at(&mut self, index: [i32; 3]) -> [f32; 3] {
        let region = index.map(|x| x >> REGION_BITS);
        let store = &self.grid.store;
        if region != self.region {
            self.region = region;
            self.slots = store.regions.get(&region).map(|slots| &slots[..]);
        }
        match self.slots.map_or(EMPTY, |slots| slots[slot(index)]) {
            EMPTY => self.grid.at_large(index),
            tile if tile & TILE != 0 => store.tiles[(tile & !TILE) as usize].value,
            leaf => {
                let channels = self.grid.channels;
                let start = (leaf as usize * LEAF_SAMPLES + sample(index)) * channels;
                padded(&store.values[start..start + channels])
            }
        }
    }
}

/// Memory of a region with its entry in the table, bytes.
pub(super) const REGION_BYTES: u64 = (REGION_BLOCKS * 4 + 64) as u64;
/// Memory of the entry of a large tile in its table, bytes.
const LARGE_ENTRY: usize = 20;
/// Memory that a tile takes at most while the list of them grows, bytes.
pub(super) const TILE_BYTES: u64 = 3 * (size_of::<Tile>() + LARGE_ENTRY) as u64;

/// Memory of a leaf with `channels` numbers a sample, bytes.
pub(super) const fn leaf_bytes(channels: usize) -> u64 {
    (LEAF_SAMPLES * channels * 4 + size_of::<[i32; 3]>() + size_of::<[u64; 8]>()) as u64
}
