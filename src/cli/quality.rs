//! `--quality`: settings of samples and of the walk that go together, under one word.

use clap::Args;

use super::choice;
use super::options::SceneOptions;
use super::terminal::Terminal;
use crate::scene::{Values, full_key};

/// Settings of each word. What they leave out stays as the scene says: a lookup that interpolates may be its
/// look, and one that does not loses density by it.
const DRAFT: &[&str] = &[
    "image.samples=1",
    "image.filter=box",
    "trace.filter=pyramid",
    "trace.lookup=nearest",
    "trace.layers=2",
];
const PREVIEW: &[&str] =
    &["image.samples=4", "image.filter=gaussian", "trace.filter=pyramid", "trace.layers=4"];
const FINAL: &[&str] =
    &["image.samples=64", "image.filter=blackman-harris", "trace.filter=pyramid", "trace.layers=8"];

/// A word of `--quality`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    Draft,
    Preview,
    Final,
}

impl Quality {
    /// Returns the settings.
    pub fn settings(self) -> &'static [&'static str] {
        match self {
            Quality::Draft => DRAFT,
            Quality::Preview => PREVIEW,
            Quality::Final => FINAL,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Quality::Draft => "draft",
            Quality::Preview => "preview",
            Quality::Final => "final",
        }
    }
}

/// Option of commands that render pictures.
#[derive(Args, Clone)]
pub struct QualityOptions {
    /// Sets the samples, the filters and the layers together: image.samples, image.filter, trace.filter and
    /// trace.layers; draft sets trace.lookup=nearest too. --set, --samples and --sweep win over it.
    #[arg(long, value_parser = choice::quality(), value_name = "WORD")]
    pub quality: Option<Quality>,
}

impl QualityOptions {
    /// Returns the options of the scene with those of the quality before all others.
    pub fn before(&self, scene: &SceneOptions) -> SceneOptions {
        let first = self.quality.map_or(Vec::new(), |q| q.settings().iter().map(|&s| s.into()).collect());
        SceneOptions { first, ..scene.clone() }
    }

    /// Tells what the quality has set; `others` are the settings that win over it.
    pub fn tell(&self, values: &Values, others: &[String], terminal: &Terminal) {
        let Some(quality) = self.quality else { return };
        let key = |setting: &str| full_key(setting.split('=').next()?.trim(), values).ok();
        let wins = |setting: &&&str| others.iter().any(|other| key(other) == key(setting));
        let own: Vec<&str> = quality.settings().iter().filter(|setting| !wins(setting)).copied().collect();
        terminal.note(&format!("taki: quality {}: {}", quality.word(), own.join(", ")));
    }
}
