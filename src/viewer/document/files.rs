//! Files that a scene refers to, and the file that it is saved to.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::Document;
use crate::scene::{
    Limits, Place, Raw, Scene, SceneMesh, Source, Values, box_corners, reference_keys, resolve,
};
use crate::util::error::{Error, Result};
use crate::viewer::named;
use crate::viewer::navigate::Pose;

/// Name of a mesh whose file has no usable one.
const MESH: &str = "mesh";

/// A mesh that was added.
#[derive(Debug)]
pub struct Added {
    /// Name in the scene.
    pub name: String,
    /// What to tell of the file.
    pub notes: Vec<String>,
}

impl Document {
    /// Takes the volume from a file that the user gave by hand. It may lie in any folder.
    ///
    /// # Errors
    /// If another reference of the scene cannot be resolved.
    pub fn use_volume_file(&mut self, path: &Path) -> Result<()> {
        self.use_files(&[("volume.file", Raw::Text(path.display().to_string()))])
    }

    /// Takes the environment from a file that the user gave by hand. It may lie in any folder.
    ///
    /// # Errors
    /// If another reference of the scene cannot be resolved.
    pub fn use_environment_file(&mut self, path: &Path) -> Result<()> {
        let file = Raw::Text(path.display().to_string());
        self.use_files(&[("environment.file", file), ("environment.kind", Raw::Text("file".into()))])
    }

    fn use_files(&mut self, edits: &[(&str, Raw)]) -> Result<()> {
        let mut values = self.values.clone();
        for (key, raw) in edits {
            set(&mut values, key, raw.clone())?;
        }
        // The other references are relative to the scene's folder, which is given up below.
        let is_edited = |key: &String| edits.iter().any(|(edited, _)| edited == key);
        for key in reference_keys(&values).iter().filter(|key| !is_edited(key)) {
            resolve(&mut values, key, self.folder.as_deref(), &self.limits.allow_paths)?;
        }
        self.folder = None;
        self.replace(values, None);
        Ok(())
    }

    /// Adds the mesh of a file that the user gave by hand, and frames it in a picture of this aspect, as one
    /// step of undo. The file may lie in any folder, which is allowed from then on.
    ///
    /// # Errors
    /// If the file cannot be read, or the scene is not valid with it. Nothing changes then.
    pub fn add_mesh(&mut self, path: &Path, aspect: f64) -> Result<Added> {
        let file = path.canonicalize().map_err(|e| Error::open(path, e))?;
        let mut limits = self.limits.clone();
        allow(&mut limits, &file);
        let loaded = limits.models.read(&file, limits.memory, &limits.allow_paths)?;
        let inside = self.folder.as_deref().and_then(|folder| inside(folder, &file));
        let text = inside.as_deref().unwrap_or(&file).to_str().ok_or_else(|| {
            Error::input(format!("{} is not UTF-8", file.display()), "rename it and its folders")
        })?;
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        let name = named::free_name(&self.values, "meshes", &named::key_part(&stem, MESH));
        let mut values = self.values.clone();
        set(&mut values, &format!("meshes.{name}.file"), Raw::Text(text.into()))?;
        let mut notes = loaded.model.notes.clone();
        match loaded.bounds() {
            Some(bounds) => {
                let corners = box_corners(bounds);
                let pose = self.pose().frame(&corners, aspect);
                for (key, raw) in self.camera_edits(&pose) {
                    set(&mut values, key, raw)?;
                }
                see_nearest(&mut values, &pose, corners)?;
            }
            None if !notes.is_empty() => {}
            None => notes.push(format!("{} shows nothing: its nodes have no triangles", path.display())),
        }
        let before = std::mem::replace(&mut self.limits, limits);
        // A scene that is not valid already says why by itself.
        if self.fault.is_none()
            && let Err(e) = self.scene_of(values.clone())
        {
            self.limits = before;
            return Err(e);
        }
        self.replace(values, None);
        Ok(Added { name, notes })
    }

    /// Says why saving to `path` loses something, if it does: another file, or comments, a base or changes
    /// from outside in the scene's own.
    pub fn lost_by_saving(&self, path: &Path) -> Option<&'static str> {
        let text = std::fs::read(path).ok()?;
        match self.path.as_deref() == Some(path) {
            true if text == self.saved.to_toml().as_bytes() => None,
            true => Some("holds comments, a base or changes from outside, which saving leaves out"),
            false => Some("exists already"),
        }
    }

    /// Writes the scene to a file, completely or not at all.
    ///
    /// # Errors
    /// If the values are not a valid scene, if a file that the scene uses lies outside the new folder and is
    /// no mesh, or if the file cannot be written.
    pub fn save(&mut self, path: &Path) -> Result<()> {
        if let Some(fault) = &self.fault {
            return Err(Error::input(
                format!("the scene is not valid: {fault}"),
                "undo the last change first",
            ));
        }
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned();
        // References are relative to the scene's folder: in another folder they must lead to the same files.
        let mut values = self.scene.written().clone();
        let moved = self.folder.as_ref() != Some(&folder);
        let is_of_mesh = |key: &str| key.starts_with("meshes.");
        let others = self.scene.references().into_iter().filter(|(key, _)| !is_of_mesh(key));
        let mut limits = self.limits.clone();
        for (key, file) in others.chain(self.mesh_files()).filter(|_| moved) {
            let absolute = file.canonicalize().map_err(|e| Error::read(&file, e))?;
            let path = match inside(&folder, &absolute) {
                Some(inside) => inside,
                // Meshes are shared between scenes, so they may stay where they are.
                None if is_of_mesh(&key) => {
                    allow(&mut limits, &absolute);
                    absolute
                }
                None => {
                    return Err(Error::input(
                        format!(
                            "the scene uses {}, which is not in {}",
                            absolute.display(),
                            folder.display()
                        ),
                        format!("save the scene beside the {} file", key.trim_end_matches(".file")),
                    ));
                }
            };
            set(&mut values, &key, Raw::Text(path.display().to_string()))?;
        }
        crate::output::frame::Output::create(path)?.finish_with(values.to_toml().as_bytes())?;
        self.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        (self.path, self.source) = (Some(path.to_owned()), Some(path.to_owned()));
        self.folder = Some(folder);
        self.limits = limits;
        self.values = values;
        self.saved = self.values.clone();
        self.check();
        Ok(())
    }

    /// Files of all meshes with their keys, as real paths. Those that do not exist are left out, and so are
    /// the presets' own.
    fn mesh_files(&self) -> Vec<(String, PathBuf)> {
        let folder = self.folder.as_deref().unwrap_or(Path::new(""));
        let keys = self.values.names("meshes").into_iter().map(|name| format!("meshes.{name}.file"));
        keys.filter_map(|key| {
            let file = folder.join(self.values.text(&key)).canonicalize().ok()?;
            file.is_file().then_some((key, file))
        })
        .collect()
    }

    /// Folders outside the scene's own in which its meshes lie. `taki render` must be allowed to read them.
    pub fn folders_to_allow(&self) -> Vec<PathBuf> {
        let Some(folder) = &self.folder else { return Vec::new() };
        let outside = self.mesh_files().into_iter().filter(|(_, file)| inside(folder, file).is_none());
        let folders: BTreeSet<PathBuf> =
            outside.filter_map(|(_, file)| file.parent().map(Path::to_owned)).collect();
        folders.into_iter().collect()
    }
}

/// Returns a new scene around the mesh of a file, which the camera looks at.
pub(super) fn around_mesh(path: &Path, limits: &Limits) -> Result<Source> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut source = Source::around_mesh(path, &named::key_part(&stem, MESH))?;
    let scene = Scene::of_source(&source, &[], limits)?;
    let mut values = scene.written().clone();
    if let Some(corners) = scene.meshes.first().and_then(SceneMesh::corners) {
        let aspect = f64::from(scene.image.width) / f64::from(scene.image.height);
        let pose = Pose::of(&values).frame(&corners, aspect);
        for (key, raw) in pose.edits() {
            set(&mut values, key, raw)?;
        }
        see_nearest(&mut values, &pose, corners)?;
    }
    source.text = values.to_toml();
    Ok(source)
}

/// Brings the nearest depth of the camera before all corners of a box.
fn see_nearest(values: &mut Values, pose: &Pose, corners: [DVec3; 8]) -> Result<()> {
    let forward = (pose.target - pose.eye).normalize_or(DVec3::NEG_Z);
    let nearest = corners.map(|corner| (corner - pose.eye).dot(forward)).into_iter();
    let near = nearest.fold(f64::INFINITY, f64::min) * 0.5;
    if near < values.coordinate("camera.near") {
        set(values, "camera.near", Raw::Float(near.max(1e-4)))?;
    }
    Ok(())
}

fn set(values: &mut Values, key: &str, raw: Raw) -> Result<()> {
    values.set(key, &raw, &Place("viewer".into()))
}

/// Allows the folder of a file.
fn allow(limits: &mut Limits, file: &Path) {
    let folder = file.parent().unwrap_or(file);
    if !limits.allow_paths.iter().any(|allowed| allowed == folder) {
        limits.allow_paths.push(folder.to_owned());
    }
}

/// Path of a file relative to a folder, if the file lies in it. `file` is a real path.
fn inside(folder: &Path, file: &Path) -> Option<PathBuf> {
    // An empty path is the current folder.
    let folder = Path::new(".").join(folder).canonicalize().ok()?;
    file.strip_prefix(folder).ok().map(Path::to_owned)
}
