//! Results of the raster pass, kept for later frames: while only the water moves, or a parameter of the walk,
//! rock and quads stay where they are.

use std::cell::Cell;
use std::collections::VecDeque;
use std::hash::{DefaultHasher, Hash, Hasher};

use super::device::Gpu;
use super::layout::FrameUniforms;
use super::targets::Targets;
use crate::picture::target_bytes;

/// Keys of passes that are remembered: what was drawn twice is kept the second time.
const REMEMBERED: usize = 1024;

/// Kept targets.
#[derive(Default)]
pub struct Rasters {
    kept: Vec<Kept>,
    /// The latest last.
    seen: VecDeque<Key>,
    /// Counts frames.
    turn: u64,
}

/// All that the raster pass of one sample of one window depends on but the pools' waves, as two hashes of 64 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key([u64; 2]);

/// Targets, and whether they hold what their key says.
pub struct Kept {
    key: Key,
    /// The targets.
    pub targets: Targets,
    /// Set once the pass has filled them: hash of the pools' waves.
    pub waves: Cell<Option<[u64; 2]>>,
    bytes: u64,
    /// The last frame that used them.
    used: u64,
}

impl Key {
    /// Of a pass with these uniforms over geometry and lights that have this `geometry` hash.
    pub fn new(frame: &FrameUniforms, geometry: &[u64; 2]) -> Key {
        // What the pass does not read; shaders/gbuffer.wgsl.
        let frame = FrameUniforms {
            sample_index: 0,
            samples: 0,
            p: 0.0,
            early_end: 0.0,
            cells: [0; 3],
            max_cells: 0,
            extinction: 0.0,
            texture_frame: 0,
            flow_cells: 0.0,
            levels: 0,
            footprint: 0.0,
            ..*frame
        };
        Key(hash_twice(&(bytemuck::bytes_of(&frame), geometry)))
    }
}

/// Two hashes that start differently.
pub fn hash_twice(value: &impl Hash) -> [u64; 2] {
    [0u8, 1].map(|start| {
        let mut hasher = DefaultHasher::new();
        start.hash(&mut hasher);
        value.hash(&mut hasher);
        hasher.finish()
    })
}

impl Rasters {
    /// A new frame begins.
    pub fn begin(&mut self) {
        self.turn += 1;
    }

    /// The place for a pass of `size` pixels and `layers` layers: kept targets, filled or to be filled; none if the pass is new, or
    /// there is no room in `most` bytes. Targets that neither this frame nor the last has used make room.
    pub fn place(
        &mut self,
        gpu: &Gpu,
        key: Key,
        size: [u32; 2],
        layers: u32,
        pools: bool,
        most: u64,
    ) -> Option<&Kept> {
        if let Some(i) = self.kept.iter().position(|kept| kept.key == key) {
            self.kept[i].used = self.turn;
            return Some(&self.kept[i]);
        }
        if !self.seen.contains(&key) {
            self.seen.truncate(REMEMBERED - 1);
            self.seen.push_front(key);
            return None;
        }
        let bytes = u64::from(size[0]) * u64::from(size[1]) * target_bytes(layers);
        let total = |kept: &[Kept]| kept.iter().map(|k| k.bytes).sum::<u64>();
        if total(&self.kept) + bytes > most {
            let turn = self.turn;
            self.kept.retain(|kept| kept.used + 1 >= turn);
        }
        if total(&self.kept) + bytes > most {
            return None;
        }
        let targets = Targets::new(gpu, size[0], size[1], layers, pools);
        self.kept.push(Kept { key, targets, waves: Cell::new(None), bytes, used: self.turn });
        self.kept.last()
    }
}
