//! The volumes of the last scene, so that the next scene rebuilds only what differs.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;

use super::ahead::Ahead;
use crate::scene::{Cost, Recipe, Scene};
use crate::util::cache::Cache;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::volume::{
    Matter, MeasuredSpec, Storage, StorageChoice, Structure, VolumeTexture, WaterSpec, has_reflection,
    set_density_and_reflection,
};

/// Keeps the volume textures of the last scene.
#[derive(Default)]
pub struct VolumeMemo {
    last: Vec<Remembered>,
    all: Arc<Vec<VolumeTexture>>,
    cache: Option<Cache>,
    ahead: Ahead,
    makes_room: bool,
}

/// A volume of the last scene.
#[derive(Clone)]
struct Remembered {
    name: String,
    source: Source,
    volume: VolumeTexture,
}

/// The input that a volume was made from.
#[derive(Clone, PartialEq)]
pub(super) enum Source {
    Water(WaterSpec, Storage),
    Matter(Box<Matter>),
    File {
        path: PathBuf,
        /// Recipe of a measured volume.
        measured: Option<Box<MeasuredSpec>>,
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
        VolumeMemo { cache, ..VolumeMemo::default() }
    }

    /// Lets go of volumes that the next scene does not use before it builds that scene's. A budget then holds
    /// one scene's volumes, not two. A build that fails leaves nothing to go back to.
    pub fn making_room(self) -> VolumeMemo {
        VolumeMemo { makes_room: true, ..self }
    }

    /// Stops using the cache. Values that a user tries out by hand would only fill it.
    pub fn forget_cache(&mut self) {
        self.cache = None;
    }

    /// Starts to read the files of a scene that comes next, beside other work and within `memory` bytes.
    /// [`VolumeMemo::volumes`] takes what was read if the files are still the same then.
    pub fn read_ahead(&mut self, scene: Scene, memory: u64) {
        let is_new = |recipe: &Recipe| {
            let source = Source::of(recipe);
            !self.last.iter().any(|old| old.name == recipe.name && old.source == source)
        };
        let recipes = scene.recipes.iter().enumerate();
        let wanted: Vec<usize> =
            recipes.filter(|(_, recipe)| recipe.file.is_some() && is_new(recipe)).map(|(i, _)| i).collect();
        if !wanted.is_empty() && memory > 0 {
            self.ahead.start(scene, wanted, memory);
        }
    }

    /// Returns the scene's volumes and how much work they took, that of the costliest: `None` if the
    /// remembered volumes fit unchanged. `memory` is the budget for building them, bytes.
    ///
    /// # Errors
    /// Any error of building or reading a volume, or of the monitor. The remembered volumes stay, but for a
    /// memo that is [making room](VolumeMemo::making_room).
    pub fn volumes(
        &mut self,
        scene: &Scene,
        memory: u64,
        monitor: &dyn Monitor,
    ) -> Result<(Arc<Vec<VolumeTexture>>, Option<Cost>)> {
        let (mut now, mut made, mut dearest): (Vec<Remembered>, Vec<VolumeTexture>, _) =
            (Vec::new(), Vec::new(), None);
        let mut early = self.ahead.take();
        if self.makes_room {
            let sources: Vec<(&String, Source)> =
                scene.recipes.iter().map(|recipe| (&recipe.name, Source::of(recipe))).collect();
            let is_used = |old: &Remembered| {
                sources.iter().any(|(name, source)| **name == old.name && old.source.is_like(source))
            };
            if !self.last.iter().all(is_used) {
                self.last.retain(is_used);
                self.all = Arc::default();
            }
        }
        for (number, recipe) in scene.recipes.iter().enumerate() {
            let source = Source::of(recipe);
            let old = self.last.iter().find(|old| old.name == recipe.name);
            let (volume, cost) = match old.map(|old| (&old.source, &old.volume, &source)) {
                Some((old, volume, new)) if old == new => (volume.clone(), None),
                Some((Source::Water(old, stored), volume, Source::Water(new, wanted)))
                    if stored == wanted && same_curves(old, new) =>
                {
                    let mut changed = VolumeTexture { alpha: new.alpha, ..volume.clone() };
                    if (WaterSpec { alpha: new.alpha, ..*old }) == *new {
                        (changed, Some(Cost::Uniform))
                    } else {
                        set_density_and_reflection(new, &mut changed.cells);
                        (changed, Some(Cost::Upload))
                    }
                }
                _ if let Some(i) = early.iter().position(|e| e.name == recipe.name && e.source == source) => {
                    let own = early.swap_remove(i);
                    own.notes.iter().for_each(|note| monitor.warn(note));
                    (own.volume, Some(Cost::Volume))
                }
                _ => {
                    let memory = scene.memory_for(number, &made, memory);
                    let volume = scene.cached_volume(number, self.cache.as_ref(), memory, monitor)?;
                    (volume, Some(Cost::Volume))
                }
            };
            let rank = |cost: &Option<Cost>| match cost {
                None => 0,
                Some(Cost::Uniform) => 1,
                Some(Cost::Upload) => 2,
                Some(Cost::Volume) => 3,
            };
            dearest = [dearest, cost].into_iter().max_by_key(rank).flatten();
            made.push(volume.clone());
            now.push(Remembered { name: recipe.name.clone(), source, volume });
        }
        let is_same = |(a, b): (&Remembered, &Remembered)| a.name == b.name;
        if dearest.is_none() && now.len() == self.last.len() && now.iter().zip(&self.last).all(is_same) {
            return Ok((self.all.clone(), None));
        }
        (self.last, self.all) = (now, Arc::new(made));
        // Volumes that are only shown no more, or in another order, take an upload.
        Ok((self.all.clone(), dearest.or(Some(Cost::Upload))))
    }
}

impl Source {
    /// Whether the volume of this source is that of another, or that with other density and reflection.
    fn is_like(&self, other: &Source) -> bool {
        match (self, other) {
            (Source::Water(old, stored), Source::Water(new, wanted)) => {
                stored == wanted && same_curves(old, new)
            }
            (old, new) => old == new,
        }
    }

    /// The input of a scene's volume.
    pub fn of(recipe: &Recipe) -> Source {
        let Recipe { water, matter, measured, file, storage, asked_storage, .. } = recipe;
        match file {
            _ if let Some(matter) = matter => Source::Matter(Box::new(matter.clone())),
            None => Source::Water(*water, *storage),
            Some(path) => {
                let meta = std::fs::metadata(path).ok();
                Source::File {
                    path: path.clone(),
                    measured: measured.clone().map(Box::new),
                    storage: *asked_storage,
                    modified: meta.as_ref().and_then(|m| m.modified().ok()),
                    bytes: meta.map_or(0, |m| m.len()),
                    k: (measured.is_none() && !has_reflection(path)).then_some([water.k_d, water.k_s]),
                }
            }
        }
    }
}

/// Whether two specs differ only in α and in what [`set_density_and_reflection`] can change.
fn same_curves(a: &WaterSpec, b: &WaterSpec) -> bool {
    let structure = Structure { crest: b.structure.crest, ..a.structure };
    WaterSpec { alpha: b.alpha, k_d: b.k_d, k_s: b.k_s, k_noise: b.k_noise, structure, ..*a } == *b
        && a.density_is_of_cells()
}
