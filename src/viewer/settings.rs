//! Settings that the viewer keeps from one run to the next.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::output::frame::Output;
use crate::util::error::{Error, Result};

/// Most recent files kept.
const MAX_RECENT: usize = 12;

/// Contents of the settings file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Colours of the interface.
    pub theme: Theme,
    /// Inner size of the window, points.
    pub window: Option<[f32; 2]>,
    /// Position of the window on the desktop, points.
    pub position: Option<[f32; 2]>,
    /// Scale of the whole interface, 1 for normal size.
    pub zoom: f32,
    /// Recent scene files, the latest first.
    pub recent: Vec<PathBuf>,
    /// Whether the parameters are shown.
    pub parameters: bool,
    /// Whether the inspectors are shown.
    pub inspectors: bool,
    /// Samples per pixel to refine a picture to, if the scene asks for fewer.
    pub refine_to: u32,
    /// Speed of the playing water, volume lengths per second.
    pub flow_speed: f64,
}

/// Colours of the interface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Theme {
    /// The system's theme.
    #[default]
    System,
    /// Dark text on a light background.
    Light,
    /// Light text on a dark background.
    Dark,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            theme: Theme::default(),
            window: None,
            position: None,
            zoom: 1.0,
            recent: Vec::new(),
            parameters: true,
            inspectors: false,
            refine_to: 16,
            flow_speed: 0.25,
        }
    }
}

impl Settings {
    /// Path of the user's settings file, if the system has a folder for settings.
    pub fn place() -> Option<PathBuf> {
        dirs::config_dir().map(|folder| folder.join("taki").join("viewer.json"))
    }

    /// Reads the settings. A missing file gives the defaults. A damaged one gives the defaults and a note for
    /// the user.
    pub fn load(path: Option<&Path>) -> (Settings, Option<String>) {
        let Some(path) = path else { return (Settings::default(), None) };
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return (Settings::default(), None),
            Err(e) => return (Settings::default(), Some(note(path, e))),
        };
        match serde_json::from_str::<Settings>(&text) {
            Ok(settings) => (settings.bounded(), None),
            Err(e) => (Settings::default(), Some(note(path, e))),
        }
    }

    /// Limits values that a hand-edited file may contain and that a window cannot take.
    fn bounded(mut self) -> Self {
        let finite = |pair: &[f32; 2]| pair.iter().all(|x| x.is_finite() && x.abs() < 1e5);
        self.window = self.window.filter(finite).map(|w| w.map(|x| x.max(200.0)));
        self.position = self.position.filter(finite);
        self.zoom = if self.zoom.is_finite() { self.zoom.clamp(0.5, 3.0) } else { 1.0 };
        self.refine_to = self.refine_to.clamp(1, 4096);
        self.flow_speed = if self.flow_speed.is_finite() { self.flow_speed.clamp(0.0, 4.0) } else { 0.25 };
        self.recent.truncate(MAX_RECENT);
        self
    }

    /// Writes the settings, completely or not at all.
    ///
    /// # Errors
    /// If the file or its folder cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
        }
        let text = serde_json::to_string_pretty(self).map_err(|e| Error::write(path, e))?;
        Output::create(path)?.finish_with(text.as_bytes())
    }

    /// Puts a file first among the recent files.
    pub fn remember(&mut self, file: &Path) {
        let file = file.canonicalize().unwrap_or(file.to_owned());
        self.recent.retain(|known| *known != file);
        self.recent.insert(0, file);
        self.recent.truncate(MAX_RECENT);
    }
}

/// Tells the user that the settings could not be read.
fn note(path: &Path, e: impl std::fmt::Display) -> String {
    format!("the settings in {} could not be read ({e}); the defaults are used", path.display())
}
