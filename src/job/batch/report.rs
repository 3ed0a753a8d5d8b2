//! What a batch tells while it works.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::picture::Seconds;
use crate::util::monitor::Monitor;

/// Something that happened, as `--events json` prints it: one object with `event` and what belongs to it.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event<'a> {
    /// The plan stands.
    Started {
        /// Pictures of this run: its shard's.
        pictures: u64,
        /// Of these, whole already.
        kept: u64,
        /// Engine and adapter.
        engine: &'a str,
    },
    /// A picture is being rendered.
    Rendering {
        /// Which.
        #[serde(flatten)]
        picture: &'a Name,
    },
    /// So much of it is done.
    Progress {
        /// Which.
        #[serde(flatten)]
        picture: &'a Name,
        /// 0 to 1.
        share: f64,
    },
    /// A picture's files have their names.
    Saved {
        /// Which.
        #[serde(flatten)]
        picture: &'a Name,
        /// Its files.
        files: Vec<String>,
        /// From its begin to its files, seconds.
        elapsed: f64,
        /// Seconds of each stage.
        seconds: Seconds,
    },
    /// Another process has made a picture.
    Elsewhere {
        /// Which.
        #[serde(flatten)]
        picture: &'a Name,
    },
    /// A picture is tried again.
    Retry {
        /// Which.
        #[serde(flatten)]
        picture: &'a Name,
        /// Why.
        error: String,
    },
    /// A picture failed for good.
    Failed {
        /// Which.
        #[serde(flatten)]
        picture: &'a Name,
        /// Why.
        error: String,
        /// The exit code of that error.
        exit_code: u8,
    },
    /// All that is left is claimed by others.
    Waiting {
        /// How many pictures.
        pictures: u64,
        /// One who has claimed one.
        on: &'a str,
    },
    /// A file made of all pictures is written: a movie, a sheet, a manifest.
    Assembled {
        /// The file.
        file: String,
    },
    /// The end, good or bad.
    Done(&'a Summary),
}

/// Which picture: a frame of a point of the sweep.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Name {
    /// The frame's number.
    pub frame: u32,
    /// The sweep's values, `KEY=VALUE`.
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

/// What a run did.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Pictures of this run.
    pub pictures: u64,
    /// Found whole and kept.
    pub kept: u64,
    /// Rendered.
    pub rendered: u64,
    /// Made meanwhile by other processes.
    pub elsewhere: u64,
    /// Failed.
    pub failed: u64,
    /// Neither: the run ended before.
    pub left: u64,
    /// Stops of the automatic exposure, where there is one.
    pub auto_exposure: Option<f32>,
    /// Whole run, seconds.
    pub elapsed: f64,
    /// Sum over the rendered pictures of their stages' seconds.
    pub seconds: Seconds,
    /// The exit code that stands for the run.
    pub exit_code: u8,
}

/// Watches a batch.
pub trait Watcher: Monitor {
    /// Something happened.
    fn event(&self, event: &Event);
}

/// Paths for people and events.
pub fn words(files: &[PathBuf]) -> Vec<String> {
    files.iter().map(|f| word(f)).collect()
}

/// A path for people and events.
pub fn word(file: &Path) -> String {
    file.display().to_string()
}
