//! What the viewer remembers from one run to the next.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::output::frame::Output;
use crate::util::error::{Error, Result};

/// Files that are remembered.
const MAX_RECENT: usize = 12;

/// The settings file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Light or dark, or as the system has it.
    pub theme: Theme,
    /// The window's inner size, points.
    pub window: Option<[f32; 2]>,
    /// The window's place on the desktop, points.
    pub position: Option<[f32; 2]>,
    /// Enlargement of the whole interface.
    pub zoom: f32,
    /// Scene files, the latest first.
    pub recent: Vec<PathBuf>,
    /// Whether the parameters are shown.
    pub parameters: bool,
    /// Whether the inspectors are shown.
    pub inspectors: bool,
    /// Samples a pixel that a picture is refined to, if the scene asks for fewer.
    pub refine_to: u32,
    /// Volume lengths a second.
    pub flow_speed: f64,
}

/// Colours of the interface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Theme {
    /// As the system has it.
    #[default]
    System,
    /// Dark text on light ground.
    Light,
    /// Light text on dark ground.
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
    /// The user's settings file, if the system has a place for it.
    pub fn place() -> Option<PathBuf> {
        dirs::config_dir().map(|folder| folder.join("taki").join("viewer.json"))
    }

    /// Reads settings; a missing file gives the defaults, a damaged one the defaults and a note.
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

    /// Values a hand-edited file may hold and no window can take.
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

    /// Writes the settings, whole or not at all.
    pub fn save(&self, path: &Path) -> Result<()> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
        }
        let text = serde_json::to_string_pretty(self).map_err(|e| Error::write(path, e))?;
        Output::create(path)?.finish_with(text.as_bytes())
    }

    /// Puts a file first among the recent ones.
    pub fn remember(&mut self, file: &Path) {
        let file = file.canonicalize().unwrap_or(file.to_owned());
        self.recent.retain(|known| *known != file);
        self.recent.insert(0, file);
        self.recent.truncate(MAX_RECENT);
    }
}

fn note(path: &Path, e: impl std::fmt::Display) -> String {
    format!("the settings in {} could not be read ({e}); the defaults are used", path.display())
}
