//! Sequences of files: volumes that read another file for each frame.
//!
//! The name of the file has `####` in the place of a number, and `volume.frame` gives the number. A file that
//! has such a name itself is taken as it is.

use std::path::{Path, PathBuf};

use super::build::confine;
use super::measured;
use super::param::key_of_volume;
use super::{Limits, Values};
use crate::util::error::{Error, Result};
use crate::util::numbering::{ends, numbered};

/// Most missing files that an error names.
const NAMED: usize = 4;

/// The sequence that a volume reads.
pub(super) struct Sequence {
    /// Key that names it.
    pub key: String,
    /// Key of its number.
    pub frame: String,
    /// Name with the place of a number.
    pattern: PathBuf,
}

/// Returns the key that names the file of the volume `name`.
pub(super) fn key_of(v: &Values, name: &str) -> String {
    let own = if measured::reads_source(v, name) { "volume.source" } else { "volume.file" };
    key_of_volume(name, own)
}

/// Returns a path with a number in its name; `None` if the name has no place for one, or is that of a file.
fn at(file: &Path, number: i64, folder: Option<&Path>) -> Option<PathBuf> {
    let name = numbered(file.file_name()?.to_str()?, number)?;
    let itself = folder.map_or_else(|| file.to_owned(), |folder| folder.join(file));
    (!itself.exists()).then(|| file.with_file_name(name))
}

impl Sequence {
    /// Returns the sequence that the volume `name` reads; `None` if it reads no file, or always the same.
    pub fn of(v: &Values, name: &str, folder: Option<&Path>) -> Option<Sequence> {
        let key = key_of(v, name);
        let pattern = PathBuf::from(v.text(&key));
        at(&pattern, 0, folder)?;
        Some(Sequence { key, frame: key_of_volume(name, "volume.frame"), pattern })
    }

    /// Path of the file with a number, as the scene gives it.
    pub fn file(&self, number: i64) -> PathBuf {
        at(&self.pattern, number, None).unwrap_or_else(|| self.pattern.clone())
    }

    /// Refuses numbers without a file, and names the first ones.
    ///
    /// # Errors
    /// [`Error::Input`] where a file is missing.
    pub fn check(&self, numbers: &[i64], folder: Option<&Path>) -> Result<()> {
        let is_missing = |file: &PathBuf| !folder.map_or_else(|| file.clone(), |f| f.join(file)).exists();
        let missing: Vec<PathBuf> = numbers.iter().map(|&n| self.file(n)).filter(is_missing).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let (count, all, frame) = (missing.len(), numbers.len(), &self.frame);
        let first: Vec<String> = missing.iter().take(NAMED).map(|file| file.display().to_string()).collect();
        let more = if count > NAMED { ", …" } else { "" };
        Err(Error::input(
            format!(
                "{} = {:?}: {count} of {all} files are missing: {}{more}",
                self.key,
                self.pattern.display().to_string(),
                first.join(", ")
            ),
            format!(
                "set {frame} to the number of the file for frame 0, choose frames that have files with \
                 --frames, or give {frame} a track in animate.tracks"
            ),
        ))
    }
}

/// Returns the numbers of the first and the last file in `folder` that have the name of the files of the
/// volume `name`; `None` where that name has no place for a number, or no file has it.
pub fn numbers_in(values: &Values, name: &str, folder: &Path) -> Option<[i64; 2]> {
    let pattern = PathBuf::from(values.text(&key_of(values, name)));
    let (before, behind) = ends(pattern.file_name()?.to_str()?)?;
    let number = |file: std::fs::DirEntry| {
        let own = file.file_name();
        own.to_str()?.strip_prefix(before)?.strip_suffix(behind)?.parse::<i64>().ok()
    };
    let numbers = std::fs::read_dir(folder).ok()?.flatten().filter_map(number);
    numbers.fold(None, |ends, n| Some(ends.map_or([n, n], |[low, high]: [i64; 2]| [low.min(n), high.max(n)])))
}

/// Returns the resolved path of the file of the volume `name`, whose key is `key`.
///
/// # Errors
/// Those of [`confine`].
pub(super) fn file(
    v: &Values,
    name: &str,
    key: &str,
    folder: Option<&Path>,
    limits: &Limits,
) -> Result<PathBuf> {
    let given = PathBuf::from(v.text(key));
    let frame = key_of_volume(name, "volume.frame");
    let number = v.int(&frame);
    let Some(file) = at(&given, number, folder) else {
        return confine(key, &given, folder, &limits.allow_paths);
    };
    confine(key, &file, folder, &limits.allow_paths).map_err(|error| match error {
        Error::Input { what, fix } => {
            Error::Input { what, fix: format!("{fix}, or set {frame} to the number of a file") }
        }
        other => other,
    })
}

/// Resolves the name of a sequence inside the scene's folder or an allowed one; `None` for a single file. No
/// file of the sequence may lead out of these folders.
///
/// # Errors
/// Those of [`confine`].
pub(super) fn resolve(
    key: &str,
    file: &Path,
    folder: Option<&Path>,
    allowed: &[PathBuf],
) -> Result<Option<PathBuf>> {
    let (Some(_), Some(name)) = (at(file, 0, folder), file.file_name()) else { return Ok(None) };
    let parent = file.parent().filter(|parent| !parent.as_os_str().is_empty());
    let parent = confine(key, parent.unwrap_or(Path::new(".")), folder, allowed)?;
    let (before, behind) = name.to_str().and_then(ends).unwrap_or_default();
    let files = std::fs::read_dir(&parent).map_err(|e| Error::read(&parent, e))?;
    for file in files.flatten() {
        let own = file.file_name();
        if own.to_str().is_some_and(|own| own.starts_with(before) && own.ends_with(behind)) {
            confine(key, &file.path(), folder, allowed)?;
        }
    }
    Ok(Some(parent.join(name)))
}
