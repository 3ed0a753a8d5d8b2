//! Files with strands of any kind, and what they say about their unit and axes.

use std::path::Path;

use super::strands::Strands;
use super::usd;
use crate::util::error::{Error, Result};

/// Endings of files with strands.
const ENDINGS: [&str; 5] = ["hair", "usd", "usda", "usdc", "usdz"];

/// Strands of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StrandFile {
    /// The strands, in the file's unit and axes.
    pub strands: Strands,
    /// Metres in the file's unit. `None`: the file does not say it.
    pub unit: Option<f64>,
    /// Whether z points up in the file, and not y. `None`: the file does not say it.
    pub is_z_up: Option<bool>,
    /// What the file has and the strands lack, one sentence each.
    pub notes: Vec<String>,
}

impl StrandFile {
    /// Whether the ending of a path is that of a file with strands.
    pub fn is_named(path: &Path) -> bool {
        ENDINGS.iter().any(|ending| has_ending(path, ending))
    }

    /// Reads a file within `budget` bytes: curves of USD (`.usd`, `.usda`, `.usdc`, `.usdz`), and others as
    /// `.hair`. `time` chooses among the samples in a file of USD: the last one that is not behind it, and
    /// the first without a time.
    ///
    /// # Errors
    /// [`Error::Input`] for a file of another kind, one that is broken, and one without strands;
    /// [`Error::Io`] where it cannot be read; [`Error::Memory`] for one that is too large.
    pub fn read(path: &Path, time: Option<f64>, budget: u64) -> Result<StrandFile> {
        if ENDINGS[1..].iter().any(|ending| has_ending(path, ending)) {
            return usd::read(path, time, budget);
        }
        let strands = Strands::read(path, budget)?;
        Ok(StrandFile { strands, ..StrandFile::default() })
    }
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending))
}

/// Refuses what is no regular file: a pipe would be waited for without end.
pub(super) fn check_is_file(path: &Path, fix: &str) -> Result<()> {
    let meta = std::fs::metadata(path).map_err(|e| Error::open(path, e))?;
    if meta.is_file() {
        return Ok(());
    }
    Err(Error::input(format!("{} is not a regular file", path.display()), fix))
}
