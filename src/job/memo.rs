//! The volume of the last scene, so that the next one makes anew only what it does not share with it.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;

use crate::scene::{Cost, Scene};
use crate::util::cache::Cache;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::volume::{
    Storage, StorageChoice, Structure, VolumeTexture, WaterSpec, set_density_and_reflection,
};

/// Keeps one volume texture.
#[derive(Default)]
pub struct VolumeStock {
    last: Option<(Source, Arc<VolumeTexture>)>,
    cache: Option<Cache>,
}

/// What a volume was made from.
#[derive(Clone, PartialEq)]
enum Source {
    Water(WaterSpec, Storage),
    /// Path, how it is to be stored, and what tells one version of the file from the next.
    File(PathBuf, StorageChoice, Option<SystemTime>, u64),
}

impl VolumeStock {
    /// Takes what it has not from a cache, and leaves it there.
    pub fn with(cache: Option<Cache>) -> VolumeStock {
        VolumeStock { last: None, cache }
    }

    /// No more from now on: values that a hand tries out are not asked for again.
    pub fn forget_cache(&mut self) {
        self.cache = None;
    }

    /// The scene's volume, and what making it cost; no cost where it is the one in stock. If making it
    /// fails or is given up, the old one stays.
    pub fn volume(
        &mut self,
        scene: &Scene,
        memory: u64,
        monitor: &dyn Monitor,
    ) -> Result<(Arc<VolumeTexture>, Option<Cost>)> {
        let source = match &scene.volume_file {
            None => Source::Water(scene.water, scene.storage),
            Some(path) => {
                let meta = std::fs::metadata(path).ok();
                let changed = meta.as_ref().and_then(|m| m.modified().ok());
                Source::File(path.clone(), scene.asked_storage, changed, meta.map_or(0, |m| m.len()))
            }
        };
        let (volume, cost) = match (self.last.take(), &source) {
            (Some((old, volume)), new) if old == *new => {
                self.last = Some((old, volume.clone()));
                return Ok((volume, None));
            }
            (Some((Source::Water(old, stored), volume)), Source::Water(new, wanted))
                if stored == *wanted && same_curves(&old, new) =>
            {
                let mut changed = VolumeTexture { alpha: new.alpha, ..(*volume).clone() };
                if (WaterSpec { alpha: new.alpha, ..old }) == *new {
                    (changed, Cost::Uniform)
                } else {
                    set_density_and_reflection(new, &mut changed.cells);
                    (changed, Cost::Upload)
                }
            }
            (old, _) => {
                self.last = old;
                (scene.kept_volume(self.cache.as_ref(), memory, monitor)?, Cost::Volume)
            }
        };
        let volume = Arc::new(volume);
        self.last = Some((source, volume.clone()));
        Ok((volume, Some(cost)))
    }
}

/// Whether the two only differ in what [`set_density_and_reflection`] does, or in α.
fn same_curves(a: &WaterSpec, b: &WaterSpec) -> bool {
    let structure = Structure { crest: b.structure.crest, ..a.structure };
    WaterSpec { alpha: b.alpha, k_d: b.k_d, k_s: b.k_s, k_noise: b.k_noise, structure, ..*a } == *b
        && a.density_is_of_cells()
}
