//! Making of a grid, block by block.

use std::collections::HashMap;

use glam::DAffine3;

use super::tree::{
    EMPTY, LEAF, LEAF_SAMPLES, REGION_BITS, REGION_BLOCKS, Store, TILE, Tile, padded, same_bits, slot,
};
use super::{Bounds, Class, Grid};

/// A block does not lie at a multiple of its side, overlaps another one, or there are too many blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the block lies askew or on another one")]
pub struct Misplaced;

/// Makes a grid of blocks.
#[derive(Debug)]
pub struct Builder {
    channels: usize,
    background: [f32; 3],
    /// See [`Grid::mended`].
    pub(super) mended: u64,
    store: Store,
}

impl Builder {
    /// An empty grid with 1 or 3 numbers a sample.
    ///
    /// # Panics
    /// Panics at any other number.
    pub fn new(channels: usize, background: [f32; 3]) -> Builder {
        assert!(channels == 1 || channels == 3, "{channels} channels");
        Builder { channels, background, mended: 0, store: Store::default() }
    }

    /// Value where no block is.
    pub(super) fn background(&self) -> [f32; 3] {
        self.background
    }

    /// Makes room for this many leaves, so that adding them takes no more memory.
    pub(super) fn reserve(&mut self, leaves: usize) {
        self.store.origins.reserve_exact(leaves);
        self.store.masks.reserve_exact(leaves);
        self.store.values.reserve_exact(leaves * LEAF_SAMPLES * self.channels);
    }

    /// Adds a leaf with its active samples. `fill` writes its values over the background, in the order of
    /// [`BlockData::Leaf`](super::BlockData::Leaf).
    ///
    /// # Errors
    /// [`Misplaced`] where `origin` is no multiple of 8 or another block lies there.
    pub fn leaf(
        &mut self,
        origin: [i32; 3],
        active: [u64; 8],
        fill: impl FnOnce(&mut [f32]),
    ) -> Result<(), Misplaced> {
        let number = self.store.origins.len();
        if origin.iter().any(|x| x & 7 != 0) || number >= TILE as usize {
            return Err(Misplaced);
        }
        self.take(origin, number as u32)?;
        self.store.origins.push(origin);
        self.store.masks.push(active);
        let start = self.store.values.len();
        let value = &self.background[..self.channels];
        self.store.values.extend(value.iter().copied().cycle().take(LEAF_SAMPLES * self.channels));
        fill(&mut self.store.values[start..]);
        Ok(())
    }

    /// Adds a tile: a cube whose side is 8 or a larger power of two. One that is not active and has the
    /// background as its value is left out.
    ///
    /// # Errors
    /// [`Misplaced`] where `origin` is no multiple of `side` or another block of the same size or smaller
    /// lies there.
    pub fn tile(
        &mut self,
        origin: [i32; 3],
        side: u32,
        value: [f32; 3],
        is_active: bool,
    ) -> Result<(), Misplaced> {
        let number = self.store.tiles.len();
        let is_aligned = origin.iter().all(|x| i64::from(*x) % i64::from(side.max(1)) == 0);
        let is_side = side.is_power_of_two() && (LEAF..1 << 31).contains(&side);
        if !is_side || !is_aligned || number >= (TILE - 1) as usize {
            return Err(Misplaced);
        }
        let same = value.iter().zip(&self.background).take(self.channels).all(same_bits);
        if !is_active && same {
            return Ok(());
        }
        let bits = side.trailing_zeros();
        if bits < REGION_BITS {
            let blocks = (side / LEAF) as i32;
            for i in 0..blocks * blocks * blocks {
                let local = [i % blocks, i / blocks % blocks, i / blocks / blocks];
                self.take(std::array::from_fn(|a| origin[a] + 8 * local[a]), TILE | number as u32)?;
            }
        } else {
            let large = &mut self.store.large;
            let level = large.iter().position(|(own, _)| *own >= bits).unwrap_or(large.len());
            if large.get(level).is_none_or(|(own, _)| *own != bits) {
                large.insert(level, (bits, HashMap::new()));
            }
            if large[level].1.insert(origin.map(|x| x >> bits), number as u32).is_some() {
                return Err(Misplaced);
            }
        }
        self.store.tiles.push(Tile { origin, side, value: padded(&value[..self.channels]), is_active });
        Ok(())
    }

    /// Enters a block of 8³ samples into its region.
    fn take(&mut self, origin: [i32; 3], entry: u32) -> Result<(), Misplaced> {
        let region = self.store.regions.entry(origin.map(|x| x >> REGION_BITS));
        let slots = region.or_insert_with(|| vec![EMPTY; REGION_BLOCKS].into());
        let slot = &mut slots[slot(origin)];
        match *slot {
            EMPTY => *slot = entry,
            _ => return Err(Misplaced),
        }
        Ok(())
    }

    /// Ends the grid.
    pub fn finish(mut self, name: impl Into<String>, class: Class, to_world: DAffine3) -> Grid {
        self.store.origins.shrink_to_fit();
        self.store.masks.shrink_to_fit();
        self.store.values.shrink_to_fit();
        self.store.tiles.shrink_to_fit();
        let mut grid = Grid {
            name: name.into(),
            class,
            to_world,
            background: self.background,
            mended: self.mended,
            channels: self.channels,
            bounds: None,
            active: 0,
            store: self.store,
        };
        grid.active = grid.blocks().fold(0, |sum, block| sum.saturating_add(block.active_count()));
        grid.bounds = grid.blocks().filter_map(|block| block.bounds()).reduce(Bounds::union);
        grid
    }
}
