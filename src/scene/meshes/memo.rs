//! Files of meshes that were read, and what was built of them, so that the next frame or edit finds them
//! again.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};
use std::time::SystemTime;

use glam::DVec3;

use super::build::{Built, Key};
use crate::model::{self, Model, Summary};
use crate::place::ShadeMemo;
use crate::place::paint::texture::Texture;
use crate::scene::presets;
use crate::util::error::Result;
use crate::util::monitor::Unwatched;

/// A file, read whole.
#[derive(Debug)]
pub struct Loaded {
    /// Its content.
    pub model: Model,
    /// Bytes that the content takes, without decoded images.
    pub bytes: u64,
    summary: OnceLock<Summary>,
    /// Width and height of each image.
    image_sizes: Vec<OnceLock<[u32; 2]>>,
    /// Textures by the number of their image, whether it is sRGB, and the levels that they drop.
    textures: Mutex<HashMap<(usize, bool, u32), Arc<Texture>>>,
}

impl Loaded {
    fn new(model: Model) -> Loaded {
        let primitives = model.meshes.iter().flat_map(|mesh| &mesh.primitives);
        let bytes = primitives.map(|p| {
            let colors = if p.colors.is_some() { 16 } else { 0 };
            let normals = if p.normals.is_some() { 12 } else { 0 };
            p.positions.len() * (12 + normals + colors + 8 * p.uvs.len()) + 12 * p.triangles.len()
        });
        let bytes = bytes.sum::<usize>() as u64;
        let image_sizes = model.images.iter().map(|_| OnceLock::new()).collect();
        Loaded { model, bytes, summary: OnceLock::new(), image_sizes, textures: Mutex::default() }
    }

    /// Box around the nodes' meshes in the file's world, metres.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        self.summary().bounds
    }

    /// What the file holds, in numbers. They are counted once.
    pub fn summary(&self) -> &Summary {
        self.summary.get_or_init(|| self.model.summary())
    }

    /// Returns the width and height of an image of the file.
    ///
    /// # Errors
    /// Those of [`model::ImageSource::size`].
    pub(super) fn image_size(&self, number: usize, memory: u64) -> Result<[u32; 2]> {
        if let Some(size) = self.image_sizes[number].get() {
            return Ok(*size);
        }
        let size = self.model.images[number].size(memory)?;
        Ok(*self.image_sizes[number].get_or_init(|| size))
    }

    /// Returns a texture of the file without its `dropped` finest levels. It is made once, within `memory`
    /// bytes.
    ///
    /// # Errors
    /// Those of [`model::ImageSource::decode`].
    pub(super) fn texture(
        &self,
        image: usize,
        is_srgb: bool,
        dropped: u32,
        memory: u64,
    ) -> Result<Arc<Texture>> {
        let mut textures = lock(&self.textures);
        if let Some(known) = textures.get(&(image, is_srgb, dropped)) {
            return Ok(known.clone());
        }
        let decoded = self.model.images[image].decode(memory)?.into_rgb8();
        let texture = Arc::new(Texture::new(&decoded, is_srgb, dropped));
        textures.insert((image, is_srgb, dropped), texture.clone());
        Ok(texture)
    }
}

/// Path of a file with its modification time and its length in bytes, which tell versions of it apart.
type Version = (PathBuf, Option<SystemTime>, u64);

#[derive(Debug, Default)]
struct Memo {
    /// Files, the most recently used first.
    files: Vec<(Version, Arc<Loaded>)>,
    /// What was built, the most recently used first.
    built: Vec<(Key, Arc<Built>)>,
}

/// Cache of models. All clones share it, and with them the scenes of one run.
#[derive(Clone, Debug, Default)]
pub struct ModelMemo {
    memo: Arc<Mutex<Memo>>,
    /// What the shade of the meshes was made of.
    pub(in crate::scene) shades: ShadeMemo,
}

/// Entries of a kind that are kept besides those of the last scene: an edit and its undo alternate.
const SPARE: usize = 2;

impl ModelMemo {
    /// Returns the content of a file, from the cache if it is there. Reading may take `memory` bytes.
    ///
    /// # Errors
    /// Those of [`Model::read`].
    pub fn read(&self, path: &Path, memory: u64, allow_paths: &[PathBuf]) -> Result<Arc<Loaded>> {
        let meta = std::fs::metadata(path).ok();
        let changed = meta.as_ref().and_then(|m| m.modified().ok());
        let version = (path.to_owned(), changed, meta.map_or(0, |m| m.len()));
        // The lock is held while a file is read, so that other threads wait for it instead of reading it
        // again.
        let mut memo = lock(&self.memo);
        if let Some(i) = memo.files.iter().position(|(known, _)| *known == version) {
            let hit = memo.files.remove(i);
            memo.files.insert(0, hit);
            return Ok(memo.files[0].1.clone());
        }
        // An old version of the file is of no use any more.
        memo.files.retain(|((known, ..), _)| known != path);
        let limits = model::Limits { memory, allow_paths: allow_paths.to_vec() };
        let loaded = Arc::new(Loaded::new(match presets::mesh(path) {
            Some(bytes) => Model::from_bytes(path, bytes, &limits, &Unwatched)?,
            None => Model::read(path, &limits, &Unwatched)?,
        }));
        memo.files.insert(0, (version, loaded.clone()));
        Ok(loaded)
    }

    /// Returns what was built for `key`, or makes it.
    pub(super) fn built(&self, key: Key, make: impl FnOnce(&Key) -> Result<Built>) -> Result<Arc<Built>> {
        let mut memo = lock(&self.memo);
        if let Some(i) = memo.built.iter().position(|(known, _)| *known == key) {
            let hit = memo.built.remove(i);
            memo.built.insert(0, hit);
            return Ok(memo.built[0].1.clone());
        }
        let built = Arc::new(make(&key)?);
        memo.built.insert(0, (key, built.clone()));
        Ok(built)
    }

    /// Forgets all but the most recent entries, of which a scene with `meshes` meshes has just used some.
    pub(super) fn forget_others(&self, meshes: usize) {
        let mut memo = lock(&self.memo);
        memo.files.truncate(meshes + SPARE);
        memo.built.truncate(meshes + SPARE);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}
