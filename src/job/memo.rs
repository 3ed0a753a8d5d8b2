//! The volume of the last scene, so that the next scene rebuilds only what differs.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;

use crate::scene::{Cost, Scene};
use crate::util::cache::Cache;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::volume::{
    Storage, StorageChoice, Structure, VolumeTexture, WaterSpec, has_reflection, set_density_and_reflection,
};

/// Keeps the volume texture of the last scene.
#[derive(Default)]
pub struct VolumeMemo {
    last: Option<(Source, Arc<VolumeTexture>)>,
    cache: Option<Cache>,
}

/// The input that a volume was made from.
#[derive(Clone, PartialEq)]
enum Source {
    Water(WaterSpec, Storage),
    File {
        path: PathBuf,
        storage: StorageChoice,
        /// Modification time and size in bytes, to notice changes.
        modified: Option<SystemTime>,
        bytes: u64,
        /// k_d and k_s that the scene gives to a file without them.
        k: Option<[f32; 2]>,
    },
}

impl VolumeMemo {
    /// A memo that looks volumes up in `cache` and adds new ones to it.
    pub fn with(cache: Option<Cache>) -> VolumeMemo {
        VolumeMemo { last: None, cache }
    }

    /// Stops using the cache. Values that a user tries out by hand would only fill it.
    pub fn forget_cache(&mut self) {
        self.cache = None;
    }

    /// Returns the scene's volume and how much work it took: `None` if the remembered volume fits unchanged.
    /// `memory` is the budget for building it, bytes.
    ///
    /// # Errors
    /// Any error of building or reading the volume, or of the monitor. The remembered volume stays.
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
                Source::File {
                    path: path.clone(),
                    storage: scene.asked_storage,
                    modified: meta.as_ref().and_then(|m| m.modified().ok()),
                    bytes: meta.map_or(0, |m| m.len()),
                    k: (!has_reflection(path)).then_some([scene.water.k_d, scene.water.k_s]),
                }
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
                (scene.cached_volume(self.cache.as_ref(), memory, monitor)?, Cost::Volume)
            }
        };
        let volume = Arc::new(volume);
        self.last = Some((source, volume.clone()));
        Ok((volume, Some(cost)))
    }
}

/// Whether two specs differ only in α and in what [`set_density_and_reflection`] can change.
fn same_curves(a: &WaterSpec, b: &WaterSpec) -> bool {
    let structure = Structure { crest: b.structure.crest, ..a.structure };
    WaterSpec { alpha: b.alpha, k_d: b.k_d, k_s: b.k_s, k_noise: b.k_noise, structure, ..*a } == *b
        && a.density_is_of_cells()
}
