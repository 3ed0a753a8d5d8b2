//! Scenes opened and changed from code.

use std::path::Path;

use super::read::apply_set;
use super::{Limits, Place, Raw, Scene, presets};
use crate::util::error::{Error, Result};

impl Scene {
    /// Opens a preset by its name, such as `fig5`. [`presets`](super::presets()) lists the names.
    ///
    /// # Errors
    /// [`Error::Input`] where there is no preset of that name.
    pub fn preset(name: &str) -> Result<Scene> {
        if presets::text(name).is_none() {
            let known = presets::names().collect::<Vec<_>>().join(", ");
            return Err(Error::input(format!("there is no preset {name:?}"), format!("presets: {known}")));
        }
        Scene::load(Path::new(name), &[], &Limits::default())
    }

    /// Returns the scene with changed parameters, each written as for `--set`: `"trace.sigma=20"`. It is
    /// checked whole with [`Limits::default`].
    ///
    /// # Errors
    /// [`Error::Usage`] for a text without `=`; [`Error::Input`] for an unknown key, a value outside its
    /// range, or a scene that does not fit together; [`Error::Memory`] where it is larger than the limits
    /// allow.
    pub fn with(&self, sets: &[&str]) -> Result<Scene> {
        let Some(mut values) = self.values.clone() else {
            let what = "the scene was edited by code, and has no values that parameters could be changed in";
            return Err(Error::input(what, "change parameters first, and edit afterwards"));
        };
        // Relative paths were resolved in the folder of the scene's file, which is not known any more.
        for (key, path) in self.references() {
            values.set(&key, &Raw::Text(path.to_string_lossy().into_owned()), &Place(key.clone()))?;
        }
        sets.iter().try_for_each(|setting| apply_set(&mut values, setting))?;
        Ok(Scene::from_values(&self.name, values, None, &Limits::default())?.recorded(self.record.clone()))
    }
}
