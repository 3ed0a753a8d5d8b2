//! What the shade of meshes needs again when only the sun, the water or a strength has changed.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard};

use glam::{DVec3, Vec3};

use super::bake::Welded;
use crate::place::bvh::Bvh;
use crate::place::{Rock, Triangles};

/// All that shade depends on besides the sun.
#[derive(PartialEq)]
pub struct Key {
    /// Meshes, with strengths of 1 where there is some.
    pub triangles: Vec<Triangles>,
    /// Rocks that cast or take shade.
    pub rocks: Vec<Rock>,
    /// Place in the world from which positions are measured, metres.
    pub origin: DVec3,
}

/// What was made for a key.
pub struct Kept {
    /// Meshes with triangles fine enough for shade.
    pub refined: Vec<Triangles>,
    /// Ways from their vertices to the curved surface, metres; empty for a mesh that was fine enough.
    pub lifts: Vec<Vec<Vec3>>,
    welded: Slot<Vec<Welded>>,
    casters: Slot<Bvh>,
    occlusion: Slot<Vec<Vec<f32>>>,
}

/// A part that is made when it is first asked for. It is made without the lock: the work runs on all threads,
/// and one that waits for the lock could not help.
struct Slot<T>(Mutex<Option<Arc<T>>>);

impl<T> Slot<T> {
    fn get(&self, make: impl FnOnce() -> T) -> Arc<T> {
        if let Some(known) = &*lock(&self.0) {
            return known.clone();
        }
        let made = Arc::new(make());
        lock(&self.0).get_or_insert(made).clone()
    }
}

impl<T> Default for Slot<T> {
    fn default() -> Self {
        Slot(Mutex::new(None))
    }
}

impl Kept {
    /// Equal vertices of each mesh.
    pub fn welded(&self) -> Arc<Vec<Welded>> {
        self.welded.get(|| self.refined.iter().map(|own| Welded::new(&own.vertices)).collect())
    }

    /// Everything that blocks light.
    pub fn casters(&self, make: impl FnOnce() -> Bvh) -> Arc<Bvh> {
        self.casters.get(make)
    }

    /// Occlusion of each mesh's vertices, with strength 1.
    pub fn occlusion(&self, make: impl FnOnce() -> Vec<Vec<f32>>) -> Arc<Vec<Vec<f32>>> {
        self.occlusion.get(make)
    }
}

/// Memory of the shade of meshes. All clones share it, and with them the scenes of one run.
#[derive(Clone, Default)]
pub struct ShadeMemo(Arc<Mutex<Option<Entry>>>);

/// A key, and what is kept for it.
type Entry = (Key, Arc<Kept>);

impl ShadeMemo {
    /// Returns what is kept for `key`. What was kept for another one is forgotten.
    pub fn kept(&self, key: Key, refine: impl FnOnce(&Key) -> (Vec<Triangles>, Vec<Vec<Vec3>>)) -> Arc<Kept> {
        if let Some((known, kept)) = &*lock(&self.0)
            && *known == key
        {
            return kept.clone();
        }
        let (refined, lifts) = refine(&key);
        let kept = Kept {
            refined,
            lifts,
            welded: Slot::default(),
            casters: Slot::default(),
            occlusion: Slot::default(),
        };
        lock(&self.0).insert((key, Arc::new(kept))).1.clone()
    }
}

impl fmt::Debug for ShadeMemo {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("ShadeMemo")
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}
