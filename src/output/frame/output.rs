//! Atomic outputs: a file is complete or absent. The data goes to a temporary file beside the target, which
//! is synced and renamed at the end.
//!
//! The temporary file of `fall.png` is `.fall.png.taki-XXXXXX.MACHINE-PID.tmp`.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use tempfile::NamedTempFile;

use super::owner::{Life, Owner, life_of};
use crate::util::error::{Error, Result};

/// A file that appears under its name only once it is finished.
pub struct Output {
    path: PathBuf,
    temp: NamedTempFile,
}

impl Output {
    /// Opens a temporary file beside `path`, so that a missing folder or permission is noticed before any
    /// work. Removes temporary files that dead processes left for the same target.
    ///
    /// # Errors
    /// [`Error::CannotCreate`] where the file cannot be created, [`Error::Io`] where the disk is full.
    pub fn create(path: &Path) -> Result<Output> {
        if let Some(name) = path.file_name() {
            remove_stale(folder_of(path), |target| target == name.as_encoded_bytes());
        }
        Output::open(path)
    }

    /// Opens a temporary file as [`Output::create`] does, but leaves other files in the folder alone.
    ///
    /// # Errors
    /// The errors of [`Output::create`].
    pub fn open(path: &Path) -> Result<Output> {
        let fail =
            |why: String, fix: &str| Error::CannotCreate { path: path.to_owned(), why, fix: fix.into() };
        let Some(name) = path.file_name() else {
            return Err(fail("it has no file name".into(), "give a file, such as -o fall.png"));
        };
        let folder = folder_of(path);
        if path.is_dir() {
            return Err(fail("a folder has this name".into(), "choose another name with -o"));
        }
        let mut prefix = std::ffi::OsString::from(".");
        prefix.push(name);
        prefix.push(".taki-");
        let mut builder = tempfile::Builder::new();
        readable(&mut builder);
        let temp = builder
            .prefix(&prefix)
            .suffix(&format!(".{}-{}.tmp", Owner::me().machine, std::process::id()))
            .tempfile_in(folder)
            .map_err(|e| {
                use std::io::ErrorKind::{QuotaExceeded, StorageFull};
                if matches!(e.kind(), StorageFull | QuotaExceeded) {
                    return Error::write(path, e);
                }
                let fix = match e.kind() {
                    std::io::ErrorKind::NotFound => "make the folder first, or choose another with -o",
                    _ => "choose a place you may write to with -o",
                };
                fail(e.to_string(), fix)
            })?;
        Ok(Output { path: path.to_owned(), temp })
    }

    /// Returns the path at which the file will appear.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the open temporary file.
    pub fn file(&mut self) -> &mut File {
        self.temp.as_file_mut()
    }

    /// Writes `bytes` and finishes the file.
    ///
    /// # Errors
    /// [`Error::Io`] where the file cannot be written.
    pub fn finish_with(mut self, bytes: &[u8]) -> Result<()> {
        self.file().write_all(bytes).map_err(|e| Error::write(&self.path, e))?;
        self.finish()
    }

    /// Syncs the file and gives it its name.
    ///
    /// # Errors
    /// [`Error::Io`] where the disk fails.
    pub fn finish(self) -> Result<()> {
        let Output { path, temp } = self;
        let done = (|| {
            temp.as_file().sync_all()?;
            temp.persist(&path).map_err(|e| e.error)?;
            // The new name is only safe once the folder is synced, which not every file system supports.
            let _ = File::open(folder_of(&path)).and_then(|f| f.sync_all());
            Ok::<(), std::io::Error>(())
        })();
        done.map_err(|e| Error::write(&path, e))
    }
}

/// Gives a temporary file the permissions of any new file under the umask. Temporary files are private by
/// default, but this one becomes a picture.
#[cfg(unix)]
fn readable(builder: &mut tempfile::Builder) {
    use std::os::unix::fs::PermissionsExt;
    builder.permissions(std::fs::Permissions::from_mode(0o666));
}

#[cfg(not(unix))]
fn readable(_: &mut tempfile::Builder) {}

/// Returns the folder of a file.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Age after which a temporary file of another machine is stale. Whether its process still runs cannot be
/// known.
const ELSEWHERE_STALE: Duration = Duration::from_secs(24 * 3600);

/// Removes temporary files in `folder` that dead processes left for the targets that `mine` accepts (file
/// names as encoded bytes). Files that cannot be removed are harmless and stay.
pub fn remove_stale(folder: &Path, mine: impl Fn(&[u8]) -> bool) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some((target, machine, pid)) = parse(name.as_encoded_bytes()) else { continue };
        let stale = || match life_of(machine, pid) {
            Life::Alive => false,
            Life::Dead => true,
            Life::Elsewhere => {
                let age = entry.metadata().and_then(|m| m.modified()).ok().and_then(|t| t.elapsed().ok());
                age.is_some_and(|age| age > ELSEWHERE_STALE)
            }
        };
        if mine(target) && stale() {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Removes the temporary files for `target` of a process that is known to have ended.
pub fn remove_left_by(owner: &Owner, target: &Path) {
    let Ok(entries) = std::fs::read_dir(folder_of(target)) else { return };
    let target_name = target.file_name().unwrap_or_default().as_encoded_bytes();
    for entry in entries.flatten() {
        let name = entry.file_name();
        if parse(name.as_encoded_bytes()) == Some((target_name, owner.machine.as_str(), owner.pid)) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Parses target, machine and process number from the name of a temporary file.
fn parse(name: &[u8]) -> Option<(&[u8], &str, u32)> {
    let rest = name.strip_prefix(b".")?.strip_suffix(b".tmp")?;
    let dot = rest.iter().rposition(|&b| b == b'.')?;
    let (machine, pid) = std::str::from_utf8(&rest[dot + 1..]).ok()?.split_once('-')?;
    let infix = b".taki-";
    let at = rest[..dot].windows(infix.len()).rposition(|w| w == infix)?;
    Some((&rest[..at], machine, pid.parse().ok()?))
}
