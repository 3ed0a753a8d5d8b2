//! Results of the raster pass that later frames reuse: rock and quads stay the same while only the water
//! moves or a parameter of the walk changes.

use std::cell::Cell;
use std::collections::VecDeque;
use std::hash::{DefaultHasher, Hash, Hasher};

use super::device::Gpu;
use super::layout::FrameUniforms;
use super::targets::{TargetShape, Targets};
use crate::picture::target_bytes;

/// Number of keys that are remembered. A pass is kept only when its key comes up a second time.
const REMEMBERED: usize = 1024;

/// The kept targets, by the key of their pass.
#[derive(Default)]
pub struct Rasters {
    kept: Vec<KeptRaster>,
    /// Keys of passes that were not kept, the latest first.
    seen: VecDeque<Key>,
    /// Number of the current frame.
    turn: u64,
}

/// Everything the raster pass of one sample of one window depends on, except the pools' waves, as two 64-bit
/// hashes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key([u64; 2]);

/// Targets, and whether they hold the pass that their key describes.
pub struct KeptRaster {
    key: Key,
    /// The targets.
    pub targets: Targets,
    /// Hash of the pools' waves that are drawn; `None` until the pass has filled the targets.
    pub waves: Cell<Option<[u64; 2]>>,
    bytes: u64,
    /// Number of the last frame that used them.
    used: u64,
}

impl Key {
    /// Returns the key of a pass with the uniforms `frame`; `geometry` is the hash of geometry and lights.
    pub fn new(frame: &FrameUniforms, geometry: &[u64; 2]) -> Key {
        // shaders/engine/gbuffer.wgsl does not read these fields.
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
            flow_moves: 0.0,
            levels: 0,
            strand_scale: 0.0,
            strand_shift: 0.0,
            billow: [0.0; 4],
            ..*frame
        };
        Key(hash_twice(&(bytemuck::bytes_of(&frame), geometry)))
    }
}

/// Returns two hashes of a value with different seeds.
pub fn hash_twice(value: &impl Hash) -> [u64; 2] {
    [0u8, 1].map(|start| {
        let mut hasher = DefaultHasher::new();
        start.hash(&mut hasher);
        value.hash(&mut hasher);
        hasher.finish()
    })
}

impl Rasters {
    /// Begins a new frame.
    pub fn begin(&mut self) {
        self.turn += 1;
    }

    /// Returns the kept targets of a pass, filled or still to be filled. Returns `None` if the pass is new,
    /// or if its targets do not fit into `most` bytes. Targets that neither this frame nor the last one has
    /// used are dropped to make room.
    pub fn get(&mut self, gpu: &Gpu, key: Key, shape: TargetShape, most: u64) -> Option<&KeptRaster> {
        if let Some(i) = self.kept.iter().position(|kept| kept.key == key) {
            self.kept[i].used = self.turn;
            return Some(&self.kept[i]);
        }
        if !self.seen.contains(&key) {
            self.seen.truncate(REMEMBERED - 1);
            self.seen.push_front(key);
            return None;
        }
        let bytes = u64::from(shape.size[0]) * u64::from(shape.size[1]) * target_bytes(shape.layers);
        let total = |kept: &[KeptRaster]| kept.iter().map(|k| k.bytes).sum::<u64>();
        if total(&self.kept) + bytes > most {
            let turn = self.turn;
            self.kept.retain(|kept| kept.used + 1 >= turn);
        }
        if total(&self.kept) + bytes > most {
            return None;
        }
        let targets = Targets::new(gpu, shape);
        self.kept.push(KeptRaster { key, targets, waves: Cell::new(None), bytes, used: self.turn });
        self.kept.last()
    }
}
