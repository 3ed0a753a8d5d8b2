//! References of one file to another, which must not lead out of the folders that the user named.

use std::io;
use std::path::{Path, PathBuf};

/// Resolves `file` in `folder` and follows links. Returns the real path, or `None` where it lies outside
/// `folder` and outside all folders of `allowed`.
///
/// # Errors
/// The system's error where there is no such file.
pub fn confine(file: &Path, folder: &Path, allowed: &[PathBuf]) -> io::Result<Option<PathBuf>> {
    let real = folder.join(file).canonicalize()?;
    let inside = std::iter::once(folder)
        .chain(allowed.iter().map(PathBuf::as_path))
        .filter_map(|dir| dir.canonicalize().ok())
        .any(|dir| real.starts_with(dir));
    Ok(inside.then_some(real))
}
