//! What the shade of meshes needs again when only the sun, the water or a strength has changed, and what the
//! shadows on shells and the diffuse light in them need again when only the camera or the lights have.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard};

use glam::{DVec3, Vec3};

use super::bake::Welded;
use crate::light::Light;
use crate::mapping::shell::Shell;
use crate::place::bvh::Bvh;
use crate::place::shell_shadows::{ShellShadows, casters};
use crate::place::{DiffuseKey, DiffuseOfShells, Mesh, Rock, Triangles, Vertex};
use crate::util::error::Result;
use crate::util::monitor::Monitor;

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

/// Memory of the shade of meshes and of the shadows on shells. All clones share it, and with them the scenes
/// of one run.
#[derive(Clone, Default)]
pub struct ShadeMemo(Arc<Memories>);

#[derive(Default)]
struct Memories {
    of_meshes: Mutex<Option<Entry>>,
    on_shells: Mutex<Option<OnShells>>,
    in_shells: Mutex<Option<(DiffuseKey, Arc<DiffuseOfShells>)>>,
}

/// A key, and what is kept for it.
type Entry = (Key, Arc<Kept>);

impl ShadeMemo {
    /// Returns what is kept for `key`. What was kept for another one is forgotten.
    pub fn kept(&self, key: Key, refine: impl FnOnce(&Key) -> (Vec<Triangles>, Vec<Vec<Vec3>>)) -> Arc<Kept> {
        if let Some((known, kept)) = &*lock(&self.0.of_meshes)
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
        lock(&self.0.of_meshes).insert((key, Arc::new(kept))).1.clone()
    }

    /// Returns the shadows on shells. They are made unless mesh, shells and lights are those of the last
    /// call, whatever the lights' intensities. `None` where nothing hides any light.
    ///
    /// # Errors
    /// Errors of `monitor`, which may stop the work.
    pub fn shadows_on_shells(
        &self,
        mesh: &Mesh,
        shells: &[Arc<Shell>],
        lights: &[Light],
        monitor: &dyn Monitor,
    ) -> Result<Option<Arc<ShellShadows>>> {
        let lights: Vec<Light> = lights.iter().map(|light| light.with_intensity(Vec3::ONE)).collect();
        let known = match &*lock(&self.0.on_shells) {
            Some(known) if known.is_of(mesh, shells) && known.lights == lights => {
                return Ok(known.shadows.clone());
            }
            Some(known) if known.is_of(mesh, shells) => Some(known.casters.clone()),
            _ => None,
        };
        let casters = known.unwrap_or_else(|| Arc::new(casters(mesh, shells)));
        let shadows = ShellShadows::new(&casters, shells, &lights, monitor)?.map(Arc::new);
        *lock(&self.0.on_shells) = Some(OnShells {
            vertices: mesh.vertices.clone(),
            shells: shells.to_vec(),
            casters,
            lights,
            shadows: shadows.clone(),
        });
        Ok(shadows)
    }

    /// Returns the diffuse light in shells. It is made unless it was asked for with the same key last.
    ///
    /// # Errors
    /// Errors of `monitor`, which may stop the work.
    pub fn diffuse_in_shells(&self, key: DiffuseKey, monitor: &dyn Monitor) -> Result<Arc<DiffuseOfShells>> {
        if let Some((known, made)) = &*lock(&self.0.in_shells)
            && known.is_same(&key)
        {
            return Ok(made.clone());
        }
        let made = Arc::new(key.solve(monitor)?);
        *lock(&self.0.in_shells) = Some((key, made.clone()));
        Ok(made)
    }
}

/// Shadows on shells, and what they were made of.
struct OnShells {
    vertices: Arc<Vec<Vertex>>,
    shells: Vec<Arc<Shell>>,
    casters: Arc<Bvh>,
    lights: Vec<Light>,
    shadows: Option<Arc<ShellShadows>>,
}

impl OnShells {
    /// Whether the casters and shells are these.
    fn is_of(&self, mesh: &Mesh, shells: &[Arc<Shell>]) -> bool {
        Arc::ptr_eq(&self.vertices, &mesh.vertices)
            && self.shells.len() == shells.len()
            && self.shells.iter().zip(shells).all(|(a, b)| Shell::is_same(a, b))
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
