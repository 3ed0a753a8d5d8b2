//! Atomic outputs: a file is complete or absent. The data goes to a temporary file beside the target, which
//! is synced and renamed at the end. Symbolic links are followed first, so that a link stays and the file
//! behind it is replaced. A file that is replaced hands on its permissions.
//!
//! Temporary files are named `.taki-XXXXXX.MACHINE-PID.TARGET.tmp`, where TARGET is a hash of the target's
//! name: the name itself would make that of the temporary file longer than a file system allows.

use std::ffi::OsStr;
use std::fs::{File, Permissions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use tempfile::NamedTempFile;
use xxhash_rust::xxh3::xxh3_64;

use super::owner::{Life, Owner, life_of};
use crate::util::error::{Error, Result};

/// A file that appears under its name only once it is finished.
pub struct Output {
    /// Path as it was given, for messages.
    path: PathBuf,
    /// Path of the file that is written; see [`real_file`].
    real: PathBuf,
    /// Permissions of the file that is replaced.
    kept: Option<Permissions>,
    temp: NamedTempFile,
}

impl Output {
    /// Opens a temporary file beside `path`, so that a missing folder or permission is noticed before any
    /// work. Removes temporary files that dead processes left for the same target.
    ///
    /// # Errors
    /// [`Error::CannotCreate`] where the file cannot be created, [`Error::Io`] where the disk is full.
    pub fn create(path: &Path) -> Result<Output> {
        let real = real_file(path)?;
        if let Some(name) = real.file_name() {
            let own = target_hash(name);
            remove_stale(folder_of(&real), |target| target == own);
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
        let real = real_file(path)?;
        let Some(name) = real.file_name() else {
            return Err(fail("it has no file name".into(), "give the name of a file"));
        };
        if path.as_os_str().as_encoded_bytes().last().is_some_and(|&end| std::path::is_separator(end.into()))
        {
            return Err(fail("it is the name of a folder".into(), "give the name of a file in it"));
        }
        let kept = match std::fs::metadata(path) {
            Ok(meta) if meta.is_dir() => {
                return Err(fail("a folder has this name".into(), "choose another name"));
            }
            // A device or a pipe cannot be replaced by a file.
            Ok(meta) if !meta.is_file() => {
                return Err(fail("it is not a regular file".into(), "choose another name"));
            }
            Ok(meta) => Some(meta.permissions()),
            // The temporary name is short, so only the final one tells.
            Err(e) if e.kind() == std::io::ErrorKind::InvalidFilename => {
                return Err(fail(e.to_string(), "choose a shorter name"));
            }
            // Nothing is there yet. A folder that is missing is noticed below.
            Err(_) => None,
        };
        let (machine, process) = (&Owner::me().machine, std::process::id());
        let suffix = format!(".{machine}-{process}.{}.tmp", target_hash(name));
        let mut builder = tempfile::Builder::new();
        let made = builder
            .prefix(PREFIX)
            .suffix(&suffix)
            .make_in(folder_of(&real), |temp| new_file(kept.is_some()).open(temp));
        let temp = made.map_err(|e| {
            use std::io::ErrorKind::{NotFound, QuotaExceeded, StorageFull};
            if matches!(e.kind(), StorageFull | QuotaExceeded) {
                return Error::write(path, e);
            }
            let fix = match e.kind() {
                NotFound => "make the folder first, or choose another",
                _ => "choose a place you may write to",
            };
            fail(e.to_string(), fix)
        })?;
        Ok(Output { path: path.to_owned(), real, kept, temp })
    }

    /// Returns the path at which the file will appear.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the folder of the file that is written.
    pub fn folder(&self) -> &Path {
        folder_of(&self.real)
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
        let Output { path, real, kept, temp } = self;
        let done = (|| {
            if let Some(kept) = kept {
                keep(temp.as_file(), &kept);
            }
            temp.as_file().sync_all()?;
            temp.persist(&real).map_err(|e| e.error)?;
            // The new name is only safe once the folder is synced, which not every file system supports.
            let _ = File::open(folder_of(&real)).and_then(|f| f.sync_all());
            Ok::<(), std::io::Error>(())
        })();
        done.map_err(|e| Error::write(&path, e))
    }
}

/// Refuses a device or a pipe, whose name tells no format.
///
/// # Errors
/// [`Error::CannotCreate`] for such a path.
pub fn check_regular(path: &Path) -> Result<()> {
    match std::fs::metadata(path) {
        Ok(meta) if !meta.is_file() && !meta.is_dir() => Err(Error::CannotCreate {
            path: path.to_owned(),
            why: "it is not a regular file".into(),
            fix: "choose another name".into(),
        }),
        _ => Ok(()),
    }
}

/// Options that create a temporary file: with the permissions of any new file under the umask, or `private`
/// until it is known whose permissions it gets.
fn new_file(private: bool) -> std::fs::OpenOptions {
    let mut options = File::options();
    options.read(true).write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, if private { 0o600 } else { 0o666 });
    #[cfg(not(unix))]
    let _ = private;
    options
}

/// Gives a file the permissions of the one that it replaces. A file system that refuses has no permissions
/// of its own, or the file stays private.
#[cfg(unix)]
fn keep(file: &File, kept: &Permissions) {
    use std::os::unix::fs::PermissionsExt;
    // The bits that make a program run as another user are not for data.
    let _ = file.set_permissions(Permissions::from_mode(kept.mode() & 0o777));
}

#[cfg(not(unix))]
fn keep(_: &File, _: &Permissions) {}

/// Most symbolic links that are followed one after another, as on Linux.
const MAX_LINKS: u32 = 40;

/// Returns the file that an output's name stands for: follows symbolic links to a file, which need not exist.
///
/// # Errors
/// [`Error::CannotCreate`] where the links form a loop.
pub fn real_file(path: &Path) -> Result<PathBuf> {
    let mut real = path.to_owned();
    for _ in 0..=MAX_LINKS {
        match std::fs::read_link(&real) {
            Ok(target) => real = folder_of(&real).join(target),
            Err(_) => return Ok(real),
        }
    }
    Err(Error::CannotCreate {
        path: path.to_owned(),
        why: "its symbolic links form a loop".into(),
        fix: "remove the link, or choose another name".into(),
    })
}

/// Returns the folder of a file.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Age after which a temporary file of another machine is stale. Whether its process still runs cannot be
/// known.
const ELSEWHERE_STALE: Duration = Duration::from_secs(24 * 3600);

/// Start of the names of temporary files.
const PREFIX: &str = ".taki-";

/// Returns the hash that stands for a target's name in the names of its temporary files.
fn target_hash(name: &OsStr) -> String {
    format!("{:016x}", xxh3_64(name.as_encoded_bytes()))
}

/// Removes temporary files in `folder` that dead processes left for the targets whose hash `mine` accepts.
/// Files that cannot be removed are harmless and stay.
pub fn remove_stale(folder: &Path, mine: impl Fn(&str) -> bool) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some((target, machine, pid)) = name.to_str().and_then(parse) else { continue };
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
    let Ok(target) = real_file(target) else { return };
    let Ok(entries) = std::fs::read_dir(folder_of(&target)) else { return };
    let own = target_hash(target.file_name().unwrap_or_default());
    for entry in entries.flatten() {
        let name = entry.file_name();
        if name.to_str().and_then(parse) == Some((own.as_str(), owner.machine.as_str(), owner.pid)) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Parses the target's hash, machine and process number from the name of a temporary file.
fn parse(name: &str) -> Option<(&str, &str, u32)> {
    let (rest, target) = name.strip_prefix(PREFIX)?.strip_suffix(".tmp")?.rsplit_once('.')?;
    let (machine, pid) = rest.rsplit_once('.')?.1.split_once('-')?;
    Some((target, machine, pid.parse().ok()?))
}
