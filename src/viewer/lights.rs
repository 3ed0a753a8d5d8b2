//! The lights of the scene under edit: which one is selected, and what is done to them as a whole.
//!
//! Every change is one step of the document's history.

pub mod edit;
mod handles;
pub mod projection;

use std::collections::HashMap;

use glam::Vec3;

pub use handles::{Drawn, show as show_handles};

use super::document::Document;
use super::navigate::Pose;
use crate::scene::{Raw, Values};
use crate::util::error::Result;

/// What the viewer knows about lights beside the scene.
#[derive(Default)]
pub struct Lights {
    /// The one with handles in the picture.
    selected: Option<String>,
    /// The intensity each had when it last shone: it comes back when the light is switched on again.
    shone: HashMap<String, f64>,
    /// The light whose name is being written.
    pub(super) renaming: Option<Renaming>,
    /// The light whose entry is to be unfolded.
    pub(super) unfold: Option<String>,
    grip: Option<handles::Grip>,
    /// From the selected spot light to the point it is aimed at, metres.
    reach: Option<f64>,
}

/// A name being written.
pub(super) struct Renaming {
    pub light: String,
    pub text: String,
    pub fault: Option<String>,
    /// Whether its field has the keyboard.
    pub begun: bool,
}

/// Whether a light shines at all.
pub fn shines(values: &Values, name: &str) -> bool {
    values.float(&format!("lights.{name}.intensity")) > 0.0
        && values.triple(&format!("lights.{name}.color")) != Vec3::ZERO
}

impl Lights {
    /// The light that is selected.
    pub fn selected(&self) -> Option<&str> {
        self.selected.as_deref()
    }

    /// Selects a light, or none.
    pub fn select(&mut self, name: Option<&str>) {
        if self.selected.as_deref() != name {
            self.grip = None;
            self.reach = None;
        }
        self.selected = name.map(str::to_owned);
    }

    /// Takes note of what an undo, a slider or another scene did to the lights.
    pub fn follow(&mut self, values: &Values) {
        let gone = |name: &str| !values.has_under(&format!("lights.{name}"));
        if self.selected.as_deref().is_some_and(gone) {
            self.select(None);
        }
        if self.renaming.as_ref().is_some_and(|renaming| gone(&renaming.light)) {
            self.renaming = None;
        }
        for name in values.names("lights") {
            let intensity = f64::from(values.float(&format!("lights.{name}.intensity")));
            if intensity > 0.0 {
                self.shone.insert(name, intensity);
            }
        }
    }

    /// Adds a light of a kind where the camera sees what it does, and selects it.
    ///
    /// # Errors
    /// If the scene does not take it.
    pub fn add(&mut self, document: &mut Document, kind: &str) -> Result<()> {
        let (values, name) = edit::add(document.values(), kind, &Pose::of(document.values()))?;
        document.edit(values);
        self.show(&name);
        Ok(())
    }

    /// Removes a light.
    pub fn remove(&mut self, document: &mut Document, name: &str) {
        document.edit(edit::remove(document.values(), name));
        self.follow(document.values());
    }

    /// Copies a light, and selects the copy.
    pub fn duplicate(&mut self, document: &mut Document, name: &str) {
        let (values, copy) = edit::duplicate(document.values(), name);
        document.edit(values);
        if let Some(intensity) = self.shone.get(name) {
            self.shone.insert(copy.clone(), *intensity);
        }
        self.show(&copy);
    }

    /// Gives a light another name.
    ///
    /// # Errors
    /// Why it cannot have this name, in words.
    pub fn rename(
        &mut self,
        document: &mut Document,
        name: &str,
        new: &str,
    ) -> std::result::Result<(), String> {
        document.edit(edit::rename(document.values(), name, new)?);
        if let Some(intensity) = self.shone.get(name) {
            self.shone.insert(new.to_owned(), *intensity);
        }
        if self.selected.as_deref() == Some(name) {
            self.select(Some(new));
        }
        Ok(())
    }

    /// Begins to write a light's name.
    pub fn begin_renaming(&mut self, name: &str) {
        self.renaming = Some(Renaming { light: name.into(), text: name.into(), fault: None, begun: false });
    }

    /// Switches a light off, or on again as bright as it was.
    ///
    /// # Errors
    /// If the scene does not take the intensity.
    pub fn switch(&mut self, document: &mut Document, name: &str) -> Result<()> {
        let key = format!("lights.{name}.intensity");
        self.follow(document.values());
        let on = document.values().float(&key) > 0.0;
        let intensity = if on { 0.0 } else { self.shone.get(name).copied().unwrap_or(1.0) };
        document.set(&key, &Raw::Float(intensity), None)
    }

    fn show(&mut self, name: &str) {
        self.select(Some(name));
        self.unfold = Some(name.into());
    }
}

/// The light that a drag in the picture turns: the selected one if it has a direction, else the first
/// directional one that shines.
pub fn turned(values: &Values, selected: Option<&str>) -> Option<String> {
    let kind = |light: &str| values.text(&format!("lights.{light}.kind"));
    if let Some(light) = selected.filter(|light| edit::takes(&kind(light), "direction")) {
        return Some(light.into());
    }
    let mut names = values.names("lights").into_iter();
    names.find(|light| kind(light) == "directional" && shines(values, light))
}
