//! The lights of the scene being edited: which one is selected, and the commands that add, copy, rename,
//! switch and remove them.
//!
//! Each change is one step of undo.

pub mod edit;
mod handles;
pub mod projection;

use std::collections::HashMap;

use glam::Vec3;

pub use handles::show as show_handles;

use super::document::Document;
use super::named::Renaming;
use crate::scene::{Raw, Values};
use crate::util::error::Result;

/// State of the lights that is not part of the scene.
#[derive(Default)]
pub struct Lights {
    /// The selected light, which has handles in the picture.
    selected: Option<String>,
    /// Last nonzero intensity of each light. A light gets it back when it is switched on again.
    last_intensity: HashMap<String, f64>,
    /// The light being renamed.
    pub(super) renaming: Option<Renaming>,
    /// The light whose entry in the list is to be unfolded in the next frame.
    pub(super) unfold: Option<String>,
    /// The handle being dragged.
    grip: Option<handles::Grip>,
    /// Distance from the selected spot light to the point at which it is aimed, metres.
    aim_distance: Option<f64>,
}

/// Whether a light has an intensity above 0 and a colour other than black.
pub fn shines(values: &Values, name: &str) -> bool {
    values.float(&format!("lights.{name}.intensity")) > 0.0
        && values.triple(&format!("lights.{name}.color")) != Vec3::ZERO
}

impl Lights {
    /// The selected light.
    pub fn selected(&self) -> Option<&str> {
        self.selected.as_deref()
    }

    /// Selects a light, or with `None` deselects.
    pub fn select(&mut self, name: Option<&str>) {
        if self.selected.as_deref() != name {
            self.grip = None;
            self.aim_distance = None;
        }
        self.selected = name.map(str::to_owned);
    }

    /// Adapts to changes of the lights by an undo, a slider or another scene: forgets lights that are gone,
    /// and records intensities.
    pub fn follow(&mut self, values: &Values) {
        let gone = |name: &str| !values.has_under(&format!("lights.{name}"));
        if self.selected.as_deref().is_some_and(gone) {
            self.select(None);
        }
        if self.renaming.as_ref().is_some_and(|renaming| gone(&renaming.name)) {
            self.renaming = None;
        }
        for name in values.names("lights") {
            let intensity = f64::from(values.float(&format!("lights.{name}.intensity")));
            if intensity > 0.0 {
                self.last_intensity.insert(name, intensity);
            }
        }
    }

    /// Adds a light of a kind at a position where the camera sees its effect, and selects it.
    ///
    /// # Errors
    /// If there is no such kind, or the position is out of range.
    pub fn add(&mut self, document: &mut Document, kind: &str) -> Result<()> {
        let (values, name) = edit::add(document.values(), kind, &document.pose())?;
        document.edit(values);
        self.show(&name);
        Ok(())
    }

    /// Removes a light.
    pub fn remove(&mut self, document: &mut Document, name: &str) {
        document.edit(edit::remove(document.values(), name));
        self.follow(document.values());
    }

    /// Duplicates a light and selects the copy.
    pub fn duplicate(&mut self, document: &mut Document, name: &str) {
        let (values, copy) = edit::duplicate(document.values(), name);
        document.edit(values);
        if let Some(intensity) = self.last_intensity.get(name) {
            self.last_intensity.insert(copy.clone(), *intensity);
        }
        self.show(&copy);
    }

    /// Renames a light.
    ///
    /// # Errors
    /// Why the light cannot have this name, as a sentence for the user.
    pub fn rename(
        &mut self,
        document: &mut Document,
        name: &str,
        new: &str,
    ) -> std::result::Result<(), String> {
        document.edit(edit::rename(document.values(), name, new)?);
        if let Some(intensity) = self.last_intensity.get(name) {
            self.last_intensity.insert(new.to_owned(), *intensity);
        }
        if self.selected.as_deref() == Some(name) {
            self.select(Some(new));
        }
        Ok(())
    }

    /// Whether a handle is being dragged.
    pub(super) fn is_dragging(&self) -> bool {
        self.grip.is_some()
    }

    /// Starts renaming a light in the list.
    pub fn begin_renaming(&mut self, name: &str) {
        self.renaming = Some(Renaming::new(name));
    }

    /// Switches a light off, or on again with its last intensity.
    ///
    /// # Errors
    /// If the intensity is out of range.
    pub fn switch(&mut self, document: &mut Document, name: &str) -> Result<()> {
        let key = format!("lights.{name}.intensity");
        self.follow(document.values());
        let on = document.values().float(&key) > 0.0;
        let intensity = if on { 0.0 } else { self.last_intensity.get(name).copied().unwrap_or(1.0) };
        document.set(&key, &Raw::Float(intensity), None)
    }

    /// Selects a new light and unfolds its entry.
    fn show(&mut self, name: &str) {
        self.select(Some(name));
        self.unfold = Some(name.into());
    }
}

/// The light that a drag in the picture turns: the selected light if it has a direction, otherwise the first
/// directional light that shines.
pub fn turned(values: &Values, selected: Option<&str>) -> Option<String> {
    let kind = |light: &str| values.text(&format!("lights.{light}.kind"));
    if let Some(light) = selected.filter(|light| edit::takes(&kind(light), "direction")) {
        return Some(light.into());
    }
    let mut names = values.names("lights").into_iter();
    names.find(|light| kind(light) == "directional" && shines(values, light))
}
