//! Events and results that a batch reports.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::picture::Seconds;
use crate::util::monitor::Monitor;

/// An event, as `--events json` prints it: one JSON object with the key `event` and the fields of the
/// variant.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event<'a> {
    /// The batch has been planned and rendering begins.
    Started {
        /// Number of pictures of this run's shard.
        pictures: u64,
        /// Number of them that already exist and are complete.
        kept: u64,
        /// Name of the GPU adapter, or `cpu`.
        engine: &'a str,
    },
    /// A picture is being rendered.
    Rendering {
        /// The picture.
        #[serde(flatten)]
        picture: &'a Name,
    },
    /// A picture is partly rendered.
    Progress {
        /// The picture.
        #[serde(flatten)]
        picture: &'a Name,
        /// Share that is done, 0 to 1.
        share: f64,
    },
    /// A picture's files are complete and have their names.
    Saved {
        /// The picture.
        #[serde(flatten)]
        picture: &'a Name,
        /// Paths of its files.
        files: Vec<String>,
        /// Time from the start of rendering to the finished files, seconds.
        elapsed: f64,
        /// Time of each stage, seconds.
        seconds: Seconds,
    },
    /// Another process has made a picture.
    Elsewhere {
        /// The picture.
        #[serde(flatten)]
        picture: &'a Name,
    },
    /// A picture failed and is tried again.
    Retry {
        /// The picture.
        #[serde(flatten)]
        picture: &'a Name,
        /// The error.
        error: String,
    },
    /// A picture failed for good.
    Failed {
        /// The picture.
        #[serde(flatten)]
        picture: &'a Name,
        /// The error.
        error: String,
        /// Exit code of that error.
        exit_code: u8,
    },
    /// Other processes have claimed all remaining pictures.
    Waiting {
        /// Number of remaining pictures.
        pictures: u64,
        /// One of the processes that hold claims.
        on: &'a str,
    },
    /// A file that needs all pictures has been written: a movie, the sheet or a manifest.
    Assembled {
        /// Path of the file.
        file: String,
    },
    /// The run has ended, with or without errors.
    Done(&'a Summary),
}

/// Identity of a picture: a frame at a point of the sweep's grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Name {
    /// Frame number.
    pub frame: i32,
    /// Values of the sweeps, each as `KEY=VALUE`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sweep: Vec<String>,
}

impl std::fmt::Display for Name {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.sweep.is_empty() {
            true => write!(f, "frame {}", self.frame),
            false => write!(f, "frame {} of {}", self.frame, self.sweep.join(" ")),
        }
    }
}

/// Result of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Number of pictures of this run's shard.
    pub pictures: u64,
    /// Number of pictures that were already complete.
    pub kept: u64,
    /// Number of pictures that this run rendered.
    pub rendered: u64,
    /// Number of pictures that other processes rendered during the run.
    pub elsewhere: u64,
    /// Number of pictures that failed.
    pub failed: u64,
    /// Number of pictures that the run did not reach.
    pub left: u64,
    /// Automatic exposure in stops, if it is on.
    pub auto_exposure: Option<f32>,
    /// Time of the whole run, seconds.
    pub elapsed: f64,
    /// Time of each stage, summed over the rendered pictures, seconds.
    pub seconds: Seconds,
    /// Exit code of the run.
    pub exit_code: u8,
}

/// Observer of a batch.
pub trait Watcher: Monitor {
    /// Called at each event.
    fn event(&self, event: &Event);
}

/// Paths as text, for messages and events.
pub fn words(files: &[PathBuf]) -> Vec<String> {
    files.iter().map(|f| word(f)).collect()
}

/// A path as text, for messages and events.
pub fn word(file: &Path) -> String {
    file.display().to_string()
}
