//! Environments that were made, so that the next scene, frame or stroke of a slider finds them again.

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

/// Environments that are kept: what a slider or a sweep goes to and fro between.
const KEPT: usize = 2;

/// A map with all that follows from it alone.
#[derive(Debug)]
pub struct Baked {
    /// Radiance.
    pub map: Arc<Map>,
    /// ∫ L·b dω of the terms of [`Irradiance`](super::Irradiance).
    pub moments: [DVec3; TERMS],
    /// The map in few cells.
    pub cells: Cells,
    /// Irradiance of the sun on a surface that faces it; zero without one.
    pub sun: DVec3,
    /// The largest component of a texel.
    pub brightest: f32,
    /// Values of the file that were below zero.
    pub negative: u64,
    lights: Mutex<Option<Lights>>,
}

/// Lights of a map.
#[derive(Debug)]
struct Lights {
    /// At most so many.
    count: u32,
    set: Arc<LightSet>,
    error: Option<f64>,
}

/// Fewest columns and rows that are summed over: smaller maps are enlarged for it.
const FINE: [u32; 2] = [128, 64];

impl Baked {
    /// What follows from a map.
    pub fn new(map: Map, sun: DVec3, negative: u64) -> Baked {
        // Sums over texels are good where these are small.
        let fine = map.enlarged(FINE[0], FINE[1]);
        let summed = fine.as_ref().unwrap_or(&map);
        Baked {
            moments: of_map(summed),
            cells: Cells::new(summed),
            sun,
            brightest: map.texels.iter().flatten().copied().fold(0.0, f32::max),
            negative,
            map: Arc::new(map),
            lights: Mutex::default(),
        }
    }

    /// At most `count` lights; the last ones that were asked for are kept.
    pub fn lights(&self, count: u32) -> Arc<LightSet> {
        self.with_lights(count, |lights| lights.set.clone())
    }

    /// How far they are off: see [`LightSet::error`].
    pub fn error(&self, count: u32) -> f64 {
        self.with_lights(count, |Lights { set, error, .. }| {
            *error.get_or_insert_with(|| set.error(&self.cells))
        })
    }

    fn with_lights<T>(&self, count: u32, get: impl FnOnce(&mut Lights) -> T) -> T {
        let mut kept = lock(&self.lights);
        if kept.as_ref().is_none_or(|lights| lights.count != count) {
            *kept = None;
        }
        let new = || Lights { count, set: Arc::new(LightSet::new(&self.cells, count)), error: None };
        get(kept.get_or_insert_with(new))
    }
}

/// What tells one environment from the next.
#[derive(Clone, Debug, PartialEq)]
enum Key {
    Sky(Sky),
    /// Path, and what tells one version of the file from the next.
    File(PathBuf, Option<SystemTime>, u64),
}

/// Shared by all copies: the scenes of one run.
#[derive(Clone, Debug, Default)]
pub struct EnvironmentStock(Arc<Mutex<Kept>>);

/// The latest first.
type Kept = Vec<(Key, Arc<Baked>)>;

impl EnvironmentStock {
    /// The source's map, from the stock if it is there. A file of at most `memory` bytes.
    pub fn baked(&self, source: &Source, memory: u64) -> Result<Arc<Baked>> {
        let key = match source {
            Source::Sky(sky) => Key::Sky(*sky),
            Source::File(path) => {
                let meta = std::fs::metadata(path).ok();
                let changed = meta.as_ref().and_then(|m| m.modified().ok());
                Key::File(path.clone(), changed, meta.map_or(0, |m| m.len()))
            }
        };
        // Held while it is made: whoever wants the same waits for it instead of making it again.
        let mut kept = lock(&self.0);
        if let Some(i) = kept.iter().position(|(of, _)| *of == key) {
            let found = kept.remove(i);
            kept.insert(0, found);
            return Ok(kept[0].1.clone());
        }
        // Old ones go first: two large ones might not fit.
        kept.truncate(KEPT - 1);
        let baked = Arc::new(match source {
            Source::Sky(sky) => {
                let baked = sky.bake();
                Baked::new(baked.map, baked.sun, 0)
            }
            Source::File(path) => {
                let read = file::read(path, memory)?;
                Baked::new(read.map, DVec3::ZERO, read.negative)
            }
        });
        kept.insert(0, (key, baked.clone()));
        Ok(baked)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}
