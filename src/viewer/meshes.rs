//! The meshes of the scene being edited: which one is selected, and the commands that copy, rename, hide and
//! remove them and that choose what their parts become.
//!
//! Each change is one step of undo.

mod gizmo;
mod handles;

use std::collections::HashMap;

use glam::DVec3;

pub use handles::show as show_handles;

use super::document::{Document, camera_in};
use super::lights::edit::two_digits;
use super::named::{self, Renaming};
use crate::place::Show;
use crate::scene::{PartSummary, Place, Raw, SceneMesh, Values};
use crate::util::error::Result;

/// Section of scene files that holds the meshes.
const SECTION: &str = "meshes";
/// Thickness of a new shell, as a share of the mesh's largest extent.
const SHELL_SHARE: f64 = 1.0 / 30.0;

/// State of the meshes that is not part of the scene.
#[derive(Default)]
pub struct Meshes {
    /// The selected mesh, which has handles in the picture.
    selected: Option<String>,
    /// What was last shown of each mesh. A mesh gets it back when it is shown again.
    last_show: HashMap<String, String>,
    /// The mesh being renamed.
    pub(super) renaming: Option<Renaming>,
    /// The mesh whose entry in the list is to be unfolded in the next frame.
    pub(super) unfold: Option<String>,
    /// The handle being dragged.
    grip: Option<handles::Grip>,
}

impl Meshes {
    /// The selected mesh.
    pub fn selected(&self) -> Option<&str> {
        self.selected.as_deref()
    }

    /// Selects a mesh, or with `None` deselects.
    pub fn select(&mut self, name: Option<&str>) {
        if self.selected.as_deref() != name {
            self.grip = None;
        }
        self.selected = name.map(str::to_owned);
    }

    /// Selects a mesh and unfolds its entry.
    pub(super) fn show(&mut self, name: &str) {
        self.select(Some(name));
        self.unfold = Some(name.into());
    }

    /// Whether a handle is being dragged.
    pub(super) fn is_dragging(&self) -> bool {
        self.grip.is_some()
    }

    /// Adapts to changes of the meshes by an undo, a menu or another scene: forgets meshes that are gone, and
    /// records what is shown of each.
    pub fn follow(&mut self, values: &Values) {
        let gone = |name: &str| !values.has_under(&format!("{SECTION}.{name}"));
        if self.selected.as_deref().is_some_and(gone) {
            self.select(None);
        }
        if self.renaming.as_ref().is_some_and(|renaming| gone(&renaming.name)) {
            self.renaming = None;
        }
        for name in values.names(SECTION) {
            let show = values.text(&format!("{SECTION}.{name}.show"));
            if show != Show::Hidden.word() {
                self.last_show.insert(name, show);
            }
        }
    }

    /// Removes a mesh.
    ///
    /// # Errors
    /// If the camera came from its file, and cannot stay where it is.
    pub fn remove(&mut self, document: &mut Document, name: &str) -> Result<()> {
        let values = without_its_camera(document, name)?;
        document.edit(named::remove(&values, SECTION, name));
        self.follow(document.values());
        Ok(())
    }

    /// Duplicates a mesh and selects the copy.
    pub fn duplicate(&mut self, document: &mut Document, name: &str) {
        let (values, copy) = named::duplicate(document.values(), SECTION, name);
        document.edit(values);
        self.show(&copy);
    }

    /// Renames a mesh, also where the camera comes from its file.
    ///
    /// # Errors
    /// Why the mesh cannot have this name, as a sentence for the user.
    pub fn rename(
        &mut self,
        document: &mut Document,
        name: &str,
        new: &str,
    ) -> std::result::Result<(), String> {
        if new.contains('/') {
            return Err("a name cannot contain a slash".into());
        }
        let mut values = named::rename(document.values(), SECTION, "mesh", name, new)?;
        if let Some(camera) = camera_in(document.values(), name) {
            let from = Raw::Text(format!("{new}{camera}"));
            set(&mut values, "camera.from", from).map_err(|e| e.to_string())?;
        }
        document.edit(values);
        if self.selected.as_deref() == Some(name) {
            self.select(Some(new));
        }
        Ok(())
    }

    /// Starts renaming a mesh in the list.
    pub fn begin_renaming(&mut self, name: &str) {
        self.renaming = Some(Renaming::new(name));
    }

    /// Hides a mesh, or shows it again as it was.
    ///
    /// # Errors
    /// If the camera came from its file, and cannot stay where it is.
    pub fn switch(&mut self, document: &mut Document, name: &str) -> Result<()> {
        self.follow(document.values());
        let hide = is_shown(document.values(), name);
        let mut values = if hide { without_its_camera(document, name)? } else { document.values().clone() };
        let last = self.last_show.get(name).map_or(Show::Visible.word(), String::as_str);
        let word = if hide { Show::Hidden.word() } else { last };
        set(&mut values, &format!("{SECTION}.{name}.show"), Raw::Text(word.into()))?;
        document.edit(values);
        Ok(())
    }
}

/// Whether a mesh is not hidden.
pub fn is_shown(values: &Values, name: &str) -> bool {
    values.text(&format!("{SECTION}.{name}.show")) != Show::Hidden.word()
}

/// The mesh `name` of the last valid scene. `None` if it is hidden.
pub fn find<'a>(document: &'a Document, name: &str) -> Option<&'a SceneMesh> {
    document.scene().meshes.iter().find(|mesh| mesh.name == name)
}

/// Words and materials of the scene that a part can become.
pub fn choices(values: &Values) -> Vec<String> {
    let mut materials = values.names("materials");
    if !materials.iter().any(|material| material == "water") {
        materials.push("water".into());
    }
    ["opaque", "none"].map(str::to_owned).into_iter().chain(materials).collect()
}

/// Key of what a part becomes.
pub fn key_of(mesh: &str, part: &PartSummary) -> String {
    part.key.clone().unwrap_or_else(|| format!("{SECTION}.{mesh}.material"))
}

/// Adds a material for a shell, and puts it on a part of a mesh.
///
/// # Errors
/// If the parameter table does not allow a value.
pub fn add_shell(document: &mut Document, mesh: &SceneMesh, part: &PartSummary) -> Result<()> {
    let mut values = document.values().clone();
    let wanted = match named::key_part(&part.material, "shell") {
        word if choices(&values).contains(&word) => "shell".into(),
        name => name,
    };
    let name = named::free_name(&values, "materials", &wanted);
    let [low, high] = mesh.loaded.bounds().unwrap_or([DVec3::ZERO, DVec3::ONE]);
    let size = ((high - low) * mesh.scale).max_element();
    let thickness = two_digits(size * SHELL_SHARE).clamp(1e-4, 1e4);
    set(&mut values, &format!("materials.{name}.carrier"), Raw::Text("shell".into()))?;
    set(&mut values, &format!("materials.{name}.thickness"), Raw::Float(thickness))?;
    set(&mut values, &key_of(&mesh.name, part), Raw::Text(name))?;
    document.edit(values);
    Ok(())
}

/// The values of a scene with its camera where it is, but not from the file of the mesh `name`.
fn without_its_camera(document: &Document, name: &str) -> Result<Values> {
    let mut values = document.values().clone();
    if camera_in(&values, name).is_some() {
        for (key, raw) in document.camera_edits(&document.pose()) {
            set(&mut values, key, raw)?;
        }
    }
    Ok(values)
}

fn set(values: &mut Values, key: &str, raw: Raw) -> Result<()> {
    values.set(key, &raw, &Place("viewer".into()))
}
