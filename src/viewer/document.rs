//! The scene being edited: its values, where they came from, what was undone.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::scene::{
    Cost, Key, Kind, Limits, Param, Place, REFERENCES, Raw, Scene, Source, Value, Values, resolve,
    set_by_hand,
};
use crate::util::error::{Error, Result};

/// Steps that can be undone.
const MAX_UNDO: usize = 500;

/// A scene under edit.
#[derive(Clone)]
pub struct Document {
    /// Its name: the preset's, or the file's stem.
    pub name: String,
    /// The file it was read from or saved to; none for a preset.
    pub path: Option<PathBuf>,
    /// References resolve inside it; without one they are trusted.
    folder: Option<PathBuf>,
    limits: Limits,
    values: Values,
    /// As last opened or saved.
    saved: Values,
    undo: Vec<Values>,
    redo: Vec<Values>,
    /// The gesture whose edits are one step.
    gesture: Option<String>,
    /// Keys that changed by themselves.
    quiet: BTreeSet<String>,
    /// The last valid scene of the values.
    scene: Arc<Scene>,
    /// Why the values make no scene.
    fault: Option<String>,
}

impl Document {
    /// Opens a preset or a file, with `--set`s that count as edits.
    pub fn open(source: &Path, sets: &[String], limits: &Limits) -> Result<Document> {
        let found = Source::find(source)?;
        let plain = Scene::load(source, &[], limits)?;
        let scene = if sets.is_empty() { plain.clone() } else { Scene::load(source, sets, limits)? };
        let is_preset = crate::scene::presets().any(|(name, _)| Path::new(name) == source);
        let by_hand = REFERENCES.iter().any(|key| set_by_hand(sets, key));
        Ok(Document {
            name: found.name,
            path: (!is_preset).then(|| source.to_owned()),
            folder: (!by_hand).then_some(found.folder),
            limits: limits.clone(),
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

    /// The values, valid or not.
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// The memory budget and the folders that references may lead into.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Why the values make no scene, if they do not; [`Document::scene`] is then an older one.
    pub fn fault(&self) -> Option<&str> {
        self.fault.as_deref()
    }

    /// Whether there is anything to save; what changed by itself is not.
    pub fn is_changed(&self) -> bool {
        // Set to its default or left out is the same.
        self.values != self.saved
            && changed_keys(&self.saved, &self.values).iter().any(|key| !self.quiet.contains(key))
    }

    /// The value a key had when the scene was opened or saved.
    pub fn saved_value(&self, key: &str) -> Value {
        self.saved.get(key)
    }

    /// Whether `key` has another value than when the scene was opened or saved. What belongs to a light that
    /// was not there then has nothing to differ from.
    pub fn differs(&self, key: &str) -> bool {
        is_of_values(&self.saved, key) && self.values.get(key) != self.saved.get(key)
    }

    /// Whether a section's names or values are others than when the scene was opened or saved.
    pub fn section_differs(&self, section: &str) -> bool {
        let of_section = |key: &String| key.split('.').next() == Some(section);
        self.values != self.saved && changed_keys(&self.saved, &self.values).iter().any(of_section)
    }

    /// Sets one value. Edits of the same `gesture` (one drag of a slider) are one step of undo.
    pub fn set(&mut self, key: &str, raw: &Raw, gesture: Option<&str>) -> Result<()> {
        self.set_all(&[(key, raw.clone())], gesture)
    }

    /// Sets several values as one step.
    pub fn set_all(&mut self, edits: &[(&str, Raw)], gesture: Option<&str>) -> Result<()> {
        let mut values = self.values.clone();
        for (key, raw) in edits {
            values.set(key, raw, &Place("viewer".into()))?;
            self.quiet.remove(*key);
        }
        self.replace(values, gesture);
        Ok(())
    }

    /// Sets a value that changes by itself, without a step of undo.
    pub fn set_quietly(&mut self, key: &str, raw: &Raw) -> Result<()> {
        self.values.set(key, raw, &Place("viewer".into()))?;
        self.quiet.insert(key.to_owned());
        self.check();
        Ok(())
    }

    /// Takes the volume from a file that the user gave by hand: it may lie anywhere.
    pub fn use_volume_file(&mut self, path: &Path) -> Result<()> {
        self.use_files(&[("volume.file", Raw::Text(path.display().to_string()))])
    }

    /// Takes the environment from a file that the user gave by hand: it may lie anywhere.
    pub fn use_environment_file(&mut self, path: &Path) -> Result<()> {
        let file = Raw::Text(path.display().to_string());
        self.use_files(&[("environment.file", file), ("environment.kind", Raw::Text("file".into()))])
    }

    fn use_files(&mut self, edits: &[(&str, Raw)]) -> Result<()> {
        let mut values = self.values.clone();
        for (key, raw) in edits {
            values.set(key, raw, &Place("viewer".into()))?;
        }
        // What lay in the scene's folder stays there.
        for key in REFERENCES.iter().filter(|key| edits.iter().all(|(edited, _)| edited != *key)) {
            resolve(&mut values, key, self.folder.as_deref(), &self.limits.allow_paths)?;
        }
        self.folder = None;
        self.replace(values, None);
        Ok(())
    }

    /// The scene with some other values, which the document does not keep.
    pub fn variant(&self, edits: &[(&str, Raw)]) -> Result<Scene> {
        let mut values = self.values.clone();
        for (key, raw) in edits {
            values.set(key, raw, &Place("viewer".into()))?;
        }
        Scene::from_values(&self.name, values, self.folder.as_deref(), &self.limits)
    }

    /// Puts one value back to what it was when the scene was opened or saved.
    pub fn reset(&mut self, keys: &[String]) {
        let mut values = self.values.clone();
        for key in keys {
            values.copy_from(&self.saved, key);
        }
        self.replace(values, None);
    }

    /// Puts a whole section back to what it was when the scene was opened or saved: what was added goes,
    /// what was removed comes back.
    pub fn reset_section(&mut self, section: &str) {
        let mut values = self.values.clone();
        values.clear_under(section);
        values.copy_under(&self.saved, section, section);
        self.replace(values, None);
    }

    /// Gives a value the table's default.
    pub fn reset_to_default(&mut self, key: &str) {
        let mut values = self.values.clone();
        values.clear_under(key);
        if !is_of_values(&values, key) {
            // A light without a key would be no light.
            let default = values.get(key);
            values.0.insert(Key::new(key), default);
        }
        self.replace(values, None);
    }

    /// Takes all values anew, as one step.
    pub fn edit(&mut self, values: Values) {
        self.replace(values, None);
    }

    /// The drag has ended: the next edit is a step of its own.
    pub fn end_gesture(&mut self) {
        self.gesture = None;
    }

    fn replace(&mut self, values: Values, gesture: Option<&str>) {
        if values == self.values {
            return;
        }
        let goes_on = gesture.is_some() && self.gesture.as_deref() == gesture;
        if !goes_on {
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

    fn check(&mut self) {
        match Scene::from_values(&self.name, self.values.clone(), self.folder.as_deref(), &self.limits) {
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

    /// Whether there is a step to do again.
    pub fn can_redo(&self) -> bool {
        !self.redo.is_empty()
    }

    /// Takes the last step back.
    pub fn undo(&mut self) {
        if let Some(values) = self.undo.pop() {
            self.redo.push(std::mem::replace(&mut self.values, values));
            self.gesture = None;
            self.check();
        }
    }

    /// Does the step again that was undone last.
    pub fn redo(&mut self) {
        if let Some(values) = self.redo.pop() {
            self.undo.push(std::mem::replace(&mut self.values, values));
            self.gesture = None;
            self.check();
        }
    }

    /// Writes the scene to a file: whole or not at all.
    pub fn save(&mut self, path: &Path) -> Result<()> {
        if let Some(fault) = &self.fault {
            return Err(Error::input(
                format!("the scene is not valid: {fault}"),
                "undo the last change first",
            ));
        }
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned();
        // A reference is relative to the scene's folder: in another folder it must lead to the same file.
        let mut values = self.scene.written().clone();
        let moved = self.folder.as_ref() != Some(&folder);
        for (key, file) in self.scene.references().into_iter().filter(|_| moved) {
            let whole = file.canonicalize().map_err(|e| Error::read(&file, e))?;
            let inside =
                folder.canonicalize().ok().and_then(|f| whole.strip_prefix(f).ok().map(Path::to_owned));
            let Some(inside) = inside else {
                return Err(Error::input(
                    format!("the scene uses {}, which is not in {}", whole.display(), folder.display()),
                    format!("save the scene beside the {} file", key.trim_end_matches(".file")),
                ));
            };
            let raw = Raw::Text(inside.display().to_string());
            values.set(key, &raw, &Place("viewer".into()))?;
        }
        crate::output::frame::Output::create(path)?.finish_with(values.to_toml().as_bytes())?;
        self.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        self.path = Some(path.to_owned());
        self.folder = Some(folder);
        self.values = values;
        self.saved = self.values.clone();
        self.check();
        Ok(())
    }

    /// The command that renders this picture: the file or preset, and a `--set` for each change.
    ///
    /// # Errors
    /// If lights were added, removed or renamed: no `--set` does that.
    pub fn command_line(&self) -> Result<String> {
        if self.values.names("lights") != self.saved.names("lights") {
            return Err(Error::input(
                "a command line cannot add, remove or rename lights",
                "save the scene, then copy the command line",
            ));
        }
        let scene = self.path.as_ref().map_or(self.name.clone(), |p| p.display().to_string());
        let mut words = vec!["taki".to_owned(), "render".into(), scene];
        for key in changed_keys(&self.saved, &self.values) {
            words.push("--set".into());
            words.push(format!("{key}={}", self.values.get(&key).to_toml()));
        }
        let quoted = |word: &String| match shlex::try_quote(word) {
            Ok(word) => word.into_owned(),
            // Only a NUL cannot be quoted, and no path or value holds one.
            Err(_) => String::new(),
        };
        Ok(words.iter().map(quoted).collect::<Vec<_>>().join(" "))
    }
}

/// Whether the light that a key belongs to is there; a light with every default is not the same as none.
fn is_of_values(values: &Values, key: &str) -> bool {
    let mut parts = key.split('.');
    match (parts.next(), parts.next()) {
        (Some("lights"), Some(name)) => values.has_under(&format!("lights.{name}")),
        _ => true,
    }
}

/// The keys whose values differ.
pub fn changed_keys(a: &Values, b: &Values) -> Vec<String> {
    let keys: BTreeSet<&Key> = a.0.keys().chain(b.0.keys()).collect();
    // Set to its default or left out is the same.
    let value = |values: &Values, key: &str| {
        let has_default = Param::find(key).is_some_and(|p| p.kind != Kind::Corners);
        (values.is_set(key) || has_default && is_of_values(values, key)).then(|| values.get(key))
    };
    keys.iter().map(ToString::to_string).filter(|key| value(a, key) != value(b, key)).collect()
}

/// The dearest cost among the changes from `a` to `b`; none if nothing changed.
pub fn cost_of(a: &Values, b: &Values) -> Option<Cost> {
    let costs = changed_keys(a, b).into_iter().filter_map(|key| Param::find(&key).map(|p| p.cost));
    costs.max_by_key(|cost| match cost {
        Cost::Uniform => 0,
        Cost::Upload => 1,
        Cost::Volume => 2,
    })
}
