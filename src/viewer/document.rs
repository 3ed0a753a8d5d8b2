//! The scene being edited: its values, its file, and its undo history.

mod command;
mod files;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::navigate::Pose;
use crate::model::is_model;
use crate::output::frame::scene_in;
use crate::scene::{
    Key, Kind, Limits, Param, Place, Raw, Record, STDIN, Scene, Source, Value, Values, has_reference_by_hand,
};
use crate::util::error::Result;

/// Key of the mesh whose file has the camera.
const FROM: &str = "camera.from";

/// Threads that build scenes. The renderer keeps all others busy, and the window would wait for them.
static BUILDERS: LazyLock<Option<ThreadPool>> = LazyLock::new(|| ThreadPoolBuilder::new().build().ok());

/// Most steps that can be undone.
const MAX_UNDO: usize = 500;

/// A scene being edited, with its history.
#[derive(Clone)]
pub struct Document {
    /// Name of the preset, or stem of the file name.
    pub name: String,
    /// The file it was read from or last saved to. `None` for a preset, a picture and stdin.
    pub path: Option<PathBuf>,
    /// The folder that references are relative to and must lie in. `None` once the user has named a file by
    /// hand: references are then trusted.
    folder: Option<PathBuf>,
    limits: Limits,
    /// Record of the picture that the scene was read from.
    record: Option<Record>,
    /// The name of the scene for a command line. `None` if it has no file.
    source: Option<PathBuf>,
    values: Values,
    /// The values when the scene was last opened or saved.
    saved: Values,
    undo: Vec<Values>,
    redo: Vec<Values>,
    /// The gesture in progress. Its edits form one step of undo.
    gesture: Option<String>,
    /// Keys set by [`Document::set_quietly`] alone. They do not count as changes.
    quiet: BTreeSet<String>,
    /// The scene of the values when they were last valid.
    scene: Arc<Scene>,
    /// Why the values are not a valid scene, if they are not.
    fault: Option<String>,
}

impl Document {
    /// Opens a preset or a file; a mesh stands in a new scene. The `--set` arguments in `sets` count as
    /// edits.
    ///
    /// # Errors
    /// If the file cannot be read, or the scene is not valid.
    pub fn open(source: &Path, sets: &[String], limits: &Limits) -> Result<Document> {
        let is_preset = crate::scene::presets().any(|(name, _)| Path::new(name) == source);
        let is_stdin = source == Path::new(STDIN);
        let is_mesh = !is_preset && !is_stdin && source.is_file() && is_model(source);
        let origin = if is_mesh { files::around_mesh(source, limits)? } else { Source::find(source)? };
        let plain = Scene::of_source(&origin, &[], limits)?;
        let scene = if sets.is_empty() { plain.clone() } else { Scene::of_source(&origin, sets, limits)? };
        let is_file = !is_preset && !is_stdin && !is_mesh && scene_in(source).is_none();
        let by_hand = has_reference_by_hand(plain.written(), sets);
        Ok(Document {
            name: origin.name,
            path: is_file.then(|| source.to_owned()),
            folder: (!by_hand).then_some(origin.folder),
            limits: limits.clone(),
            record: scene.record(),
            source: (!is_stdin && !is_mesh).then(|| source.to_owned()),
            values: scene.written().clone(),
            saved: plain.written().clone(),
            undo: Vec::new(),
            redo: Vec::new(),
            gesture: None,
            quiet: BTreeSet::new(),
            scene: Arc::new(scene),
            fault: None,
        })
    }

    /// The last valid scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The values, which may not be a valid scene.
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// Pose of the camera, which `camera.from` may take from a mesh's file.
    pub fn pose(&self) -> Pose {
        let pose = Pose::of(&self.values);
        let mesh = self.scene.meshes.iter().find(|mesh| camera_in(&self.values, &mesh.name).is_some());
        // Of other values than those of the scene, nothing is known.
        match mesh.filter(|_| self.scene.written().text(FROM) == self.values.text(FROM)) {
            Some(mesh) => pose.with_camera(&self.scene.camera, mesh),
            None => pose,
        }
    }

    /// Keys and values that give the camera a pose. A camera that came from a mesh's file is the scene's own
    /// from then on.
    pub fn camera_edits(&self, pose: &Pose) -> Vec<(&'static str, Raw)> {
        let mut edits = pose.edits().to_vec();
        if !self.values.text(FROM).is_empty() {
            edits.extend(pose.lens_edits());
            edits.push((FROM, Raw::Text(String::new())));
        }
        edits
    }

    /// The memory budget and the folders that references may point into.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Why the values are not a valid scene, if they are not. [`Document::scene`] is then an older one.
    pub fn fault(&self) -> Option<&str> {
        self.fault.as_deref()
    }

    /// Whether there are changes to save. Keys set by [`Document::set_quietly`] do not count.
    pub fn is_changed(&self) -> bool {
        // Unequal values may still mean the same: a key set to its default equals a key left out.
        self.values != self.saved
            && changed_keys(&self.saved, &self.values).iter().any(|key| !self.quiet.contains(key))
    }

    /// The value a key had when the scene was opened or saved.
    pub fn saved_value(&self, key: &str) -> Value {
        self.saved.get(key)
    }

    /// Whether the value of `key` differs from when the scene was opened or saved. Always false for a key of
    /// a light or mesh that was added since.
    pub fn differs(&self, key: &str) -> bool {
        owner_exists(&self.saved, key) && self.values.get(key) != self.saved.get(key)
    }

    /// Whether a section's names or values differ from when the scene was opened or saved.
    pub fn section_differs(&self, section: &str) -> bool {
        let in_section = |key: &String| key.split('.').next() == Some(section);
        self.values != self.saved && changed_keys(&self.saved, &self.values).iter().any(in_section)
    }

    /// Sets one value. Edits of the same `gesture`, such as one drag of a slider, are one step of undo.
    ///
    /// # Errors
    /// If the parameter table has no such key, or does not allow the value.
    pub fn set(&mut self, key: &str, raw: &Raw, gesture: Option<&str>) -> Result<()> {
        self.set_all(&[(key, raw.clone())], gesture)
    }

    /// Sets several values as one step of undo.
    ///
    /// # Errors
    /// If the parameter table lacks a key, or does not allow a value. Nothing is set then.
    pub fn set_all(&mut self, edits: &[(&str, Raw)], gesture: Option<&str>) -> Result<()> {
        let mut values = self.values.clone();
        for (key, raw) in edits {
            values.set(key, raw, &Place("viewer".into()))?;
            self.quiet.remove(*key);
        }
        self.replace(values, gesture);
        Ok(())
    }

    /// Sets a value that changes by itself, such as the flow while the water plays. It is no step of undo.
    ///
    /// # Errors
    /// If the parameter table has no such key, or does not allow the value.
    pub fn set_quietly(&mut self, key: &str, raw: &Raw) -> Result<()> {
        self.values.set(key, raw, &Place("viewer".into()))?;
        self.quiet.insert(key.to_owned());
        self.check();
        Ok(())
    }

    /// Returns the scene with `edits` applied, without changing the document.
    ///
    /// # Errors
    /// If an edit is not allowed, or the scene is not valid with the edits.
    pub fn variant(&self, edits: &[(&str, Raw)]) -> Result<Scene> {
        let mut values = self.values.clone();
        for (key, raw) in edits {
            values.set(key, raw, &Place("viewer".into()))?;
        }
        self.scene_of(values)
    }

    fn scene_of(&self, values: Values) -> Result<Scene> {
        let build = || Scene::from_values(&self.name, values, self.folder.as_deref(), &self.limits);
        let scene = match &*BUILDERS {
            Some(threads) => threads.install(build),
            None => build(),
        }?;
        Ok(scene.recorded(self.record.clone()))
    }

    /// Resets the values of `keys` to those of when the scene was opened or saved.
    pub fn reset(&mut self, keys: &[String]) {
        let mut values = self.values.clone();
        for key in keys {
            values.copy_from(&self.saved, key);
        }
        self.replace(values, None);
    }

    /// Resets a whole section to its state when the scene was opened or saved: removes what was added and
    /// restores what was removed.
    pub fn reset_section(&mut self, section: &str) {
        let mut values = self.values.clone();
        values.clear_under(section);
        values.copy_under(&self.saved, section, section);
        self.replace(values, None);
    }

    /// Sets a value to the parameter table's default.
    pub fn reset_to_default(&mut self, key: &str) {
        let mut values = self.values.clone();
        values.clear_under(key);
        if !owner_exists(&values, key) {
            // A light exists only while it has a key, so its last key is set to the default instead of
            // removed.
            let default = values.get(key);
            values.0.insert(Key::new(key), default);
        }
        self.replace(values, None);
    }

    /// Replaces all values, as one step of undo.
    pub fn edit(&mut self, values: Values) {
        self.replace(values, None);
    }

    /// Ends the gesture in progress: the next edit is a step of its own.
    pub fn end_gesture(&mut self) {
        self.gesture = None;
    }

    fn replace(&mut self, values: Values, gesture: Option<&str>) {
        if values == self.values {
            return;
        }
        let continues = gesture.is_some() && self.gesture.as_deref() == gesture;
        if !continues {
            self.undo.push(std::mem::take(&mut self.values));
            if self.undo.len() > MAX_UNDO {
                self.undo.remove(0);
            }
        }
        self.gesture = gesture.map(str::to_owned);
        self.redo.clear();
        self.values = values;
        self.check();
    }

    /// Rebuilds the scene from the values, or records why they are not valid.
    fn check(&mut self) {
        match self.scene_of(self.values.clone()) {
            Ok(scene) => {
                self.scene = Arc::new(scene);
                self.fault = None;
            }
            Err(e) => self.fault = Some(e.to_string()),
        }
    }

    /// Whether there is a step to undo.
    pub fn can_undo(&self) -> bool {
        !self.undo.is_empty()
    }

    /// Whether there is a step to redo.
    pub fn can_redo(&self) -> bool {
        !self.redo.is_empty()
    }

    /// Takes the gesture in progress back, if it is `gesture`. It cannot be redone.
    pub fn cancel(&mut self, gesture: &str) {
        if self.gesture.as_deref() == Some(gesture) {
            self.undo();
            self.redo.clear();
        }
    }

    /// Undoes the last step.
    pub fn undo(&mut self) {
        if let Some(values) = self.undo.pop() {
            self.redo.push(std::mem::replace(&mut self.values, values));
            self.gesture = None;
            self.check();
        }
    }

    /// Redoes the step that was undone last.
    pub fn redo(&mut self) {
        if let Some(values) = self.redo.pop() {
            self.undo.push(std::mem::replace(&mut self.values, values));
            self.gesture = None;
            self.check();
        }
    }
}

/// Whether the light, mesh or volume that `key` belongs to exists; true for other keys. A light whose values
/// are all defaults still differs from no light.
fn owner_exists(values: &Values, key: &str) -> bool {
    let mut parts = key.split('.');
    match (parts.next(), parts.next()) {
        (Some(section @ ("boxes" | "lights" | "meshes" | "volumes")), Some(name)) => {
            values.has_under(&format!("{section}.{name}"))
        }
        _ => true,
    }
}

/// Which camera of the file of the mesh `name` the scene's camera is, with a slash before it; empty for the
/// first. `None` if the camera does not come from that file.
pub fn camera_in(values: &Values, name: &str) -> Option<String> {
    let from = values.text(FROM);
    let camera = from.strip_prefix(name)?;
    (camera.is_empty() || camera.starts_with('/')).then(|| camera.to_owned())
}

/// Returns the keys whose values differ between `a` and `b`.
pub fn changed_keys(a: &Values, b: &Values) -> Vec<String> {
    let keys: BTreeSet<&Key> = a.0.keys().chain(b.0.keys()).collect();
    // A key set to its default equals a key left out.
    let value = |values: &Values, key: &str| {
        let has_default = Param::find(key).is_some_and(|p| p.kind != Kind::Corners);
        (values.is_set(key) || has_default && owner_exists(values, key)).then(|| values.get(key))
    };
    keys.iter().map(ToString::to_string).filter(|key| value(a, key) != value(b, key)).collect()
}
