//! Cache of baked environments, so that the next scene, frame or slider movement finds them again.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::SystemTime;

use glam::DVec3;

use super::lights::LightSet;
use super::map::Map;
use super::moments::{Cells, TERMS, of_map};
use super::sky::Sky;
use super::{Source, file};
use crate::util::error::Result;

/// Number of cached environments: a slider or a sweep alternates between two.
const CACHED_ENVIRONMENTS: usize = 2;

/// Map with everything that is computed from it alone.
#[derive(Debug)]
pub struct Baked {
    /// Radiance map.
    pub map: Arc<Map>,
    /// Integrals ∫ L·b dω for the terms b of [`Irradiance`](super::Irradiance).
    pub moments: [DVec3; TERMS],
    /// The map at the coarse resolution from which lights are chosen.
    pub cells: Cells,
    /// Irradiance of the sun on a surface that faces it; zero without a sun.
    pub sun: DVec3,
    /// Largest component of any texel.
    pub brightest: f32,
    /// Number of values in the file that were below zero.
    pub negative: u64,
    /// Notes on the file for the user, a sentence each.
    pub notes: Vec<String>,
    lights: Mutex<Option<Lights>>,
}

/// Lights of a map, with their error once it has been measured.
#[derive(Debug)]
struct Lights {
    /// Requested maximum number of lights.
    count: u32,
    set: Arc<LightSet>,
    error: Option<f64>,
}

/// Minimum number of columns and rows of a map whose texels are summed. Smaller maps are enlarged first,
/// because sums over large texels are inaccurate.
const MIN_SUMMED: [u32; 2] = [128, 64];

impl Baked {
    /// Computes everything that depends on the map alone.
    pub fn new(map: Map, sun: DVec3, negative: u64, notes: Vec<String>) -> Baked {
        let enlarged = map.enlarged(MIN_SUMMED[0], MIN_SUMMED[1]);
        let summed = enlarged.as_ref().unwrap_or(&map);
        Baked {
            moments: of_map(summed),
            cells: Cells::new(summed),
            sun,
            brightest: map.texels.iter().flatten().copied().fold(0.0, f32::max),
            negative,
            notes,
            map: Arc::new(map),
            lights: Mutex::default(),
        }
    }

    /// At most `count` lights that approximate the map. The last set is cached.
    pub fn lights(&self, count: u32) -> Arc<LightSet> {
        self.with_lights(count, |lights| lights.set.clone())
    }

    /// Relative error of those lights; see [`LightSet::error`].
    pub fn error(&self, count: u32) -> f64 {
        self.with_lights(count, |Lights { set, error, .. }| {
            *error.get_or_insert_with(|| set.error(&self.cells))
        })
    }

    fn with_lights<T>(&self, count: u32, get: impl FnOnce(&mut Lights) -> T) -> T {
        let mut cached = lock(&self.lights);
        if cached.as_ref().is_none_or(|lights| lights.count != count) {
            *cached = None;
        }
        let new = || Lights { count, set: Arc::new(LightSet::new(&self.cells, count)), error: None };
        get(cached.get_or_insert_with(new))
    }
}

/// Key of an environment in the cache.
#[derive(Clone, Debug, PartialEq)]
enum Key {
    Sky(Sky),
    /// Path of a file with its modification time and its size in bytes, which tell versions of it apart.
    File(PathBuf, Option<SystemTime>, u64),
}

/// Cache of environments. All clones share it, and with them the scenes of one run.
#[derive(Clone, Debug, Default)]
pub struct EnvironmentMemo(Arc<Mutex<EnvironmentCache>>);

/// Cached environments, the most recently used first.
type EnvironmentCache = Vec<(Key, Arc<Baked>)>;

impl EnvironmentMemo {
    /// Returns the source's baked map, from the cache if it is there. Reading a file may take at most
    /// `memory` bytes.
    ///
    /// # Errors
    /// Returns the errors of [`read_map`](super::read_map) if the source is a file.
    pub fn baked(&self, source: &Source, memory: u64) -> Result<Arc<Baked>> {
        let key = match source {
            Source::Sky(sky) => Key::Sky(*sky),
            Source::File(path) => {
                let meta = std::fs::metadata(path).ok();
                let changed = meta.as_ref().and_then(|m| m.modified().ok());
                Key::File(path.clone(), changed, meta.map_or(0, |m| m.len()))
            }
        };
        // The lock is held while an environment is baked, so that other threads wait for it instead of baking
        // it again.
        let mut cache = lock(&self.0);
        if let Some(i) = cache.iter().position(|(cached, _)| *cached == key) {
            let hit = cache.remove(i);
            cache.insert(0, hit);
            return Ok(cache[0].1.clone());
        }
        // Old entries are dropped first, because two large ones beside a new one might not fit.
        cache.truncate(CACHED_ENVIRONMENTS - 1);
        let baked = Arc::new(match source {
            Source::Sky(sky) => {
                let baked = sky.bake();
                Baked::new(baked.map, baked.sun, 0, Vec::new())
            }
            Source::File(path) => {
                let read = file::read(path, memory)?;
                Baked::new(read.map, DVec3::ZERO, read.negative, read.notes)
            }
        });
        cache.insert(0, (key, baked.clone()));
        Ok(baked)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}
