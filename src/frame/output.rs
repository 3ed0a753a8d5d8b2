//! Outputs that are whole or absent: a temporary file beside the target, synced, renamed.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// A file that appears under its name when it is finished, and not before.
pub struct Output {
    path: PathBuf,
    temp: NamedTempFile,
}

impl Output {
    /// Opens a temporary file beside `path`, so that a missing folder or right is known before any
    /// work. Removes temporary files that dead processes left for the same target.
    pub fn create(path: &Path) -> Result<Output> {
        let fail =
            |why: String, fix: &str| Error::CannotCreate { path: path.to_owned(), why, fix: fix.into() };
        let Some(name) = path.file_name() else {
            return Err(fail("it has no file name".into(), "give a file, such as -o fall.png"));
        };
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if path.is_dir() {
            return Err(fail("a folder has this name".into(), "choose another name with -o"));
        }
        let mut prefix = std::ffi::OsString::from(".");
        prefix.push(name);
        prefix.push(".taki-");
        remove_stale(folder, &prefix);
        let mut builder = tempfile::Builder::new();
        readable(&mut builder);
        let temp = builder
            .prefix(&prefix)
            .suffix(&format!(".{}.tmp", std::process::id()))
            .tempfile_in(folder)
            .map_err(|e| {
                let fix = match e.kind() {
                    std::io::ErrorKind::NotFound => "make the folder first, or choose another with -o",
                    _ => "choose a place you may write to with -o",
                };
                fail(e.to_string(), fix)
            })?;
        Ok(Output { path: path.to_owned(), temp })
    }

    /// Where it will appear.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The open temporary file.
    pub fn file(&mut self) -> &mut File {
        self.temp.as_file_mut()
    }

    /// Writes `bytes` and finishes.
    pub fn finish_with(mut self, bytes: &[u8]) -> Result<()> {
        self.file().write_all(bytes).map_err(|e| Error::write(&self.path, e))?;
        self.finish()
    }

    /// Flushes, syncs and renames.
    pub fn finish(self) -> Result<()> {
        let Output { path, temp } = self;
        let done = (|| {
            temp.as_file().sync_all()?;
            temp.persist(&path).map_err(|e| e.error)?;
            // The name itself is only safe once the folder is on disk; not every file system can.
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let _ = File::open(folder).and_then(|f| f.sync_all());
            Ok::<(), std::io::Error>(())
        })();
        done.map_err(|e| Error::write(&path, e))
    }
}

/// Temporary files are private; this one becomes a picture, readable as the umask lets any new file be.
#[cfg(unix)]
fn readable(builder: &mut tempfile::Builder) {
    use std::os::unix::fs::PermissionsExt;
    builder.permissions(std::fs::Permissions::from_mode(0o666));
}

#[cfg(not(unix))]
fn readable(_: &mut tempfile::Builder) {}

/// Removes `PREFIX….PID.tmp` in `folder` where no process PID lives. Best effort: a file that cannot
/// be removed harms nobody.
fn remove_stale(folder: &Path, prefix: &std::ffi::OsStr) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let bytes = name.as_encoded_bytes();
        let Some(rest) = bytes.strip_prefix(prefix.as_encoded_bytes()) else { continue };
        let pid = std::str::from_utf8(rest)
            .ok()
            .and_then(|rest| rest.strip_suffix(".tmp"))
            .and_then(|rest| rest.rsplit('.').next())
            .and_then(|pid| pid.parse::<u32>().ok());
        if pid.is_some_and(|pid| !alive(pid)) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Whether a process lives, as far as this system tells; when in doubt it does.
fn alive(pid: u32) -> bool {
    let proc = Path::new("/proc");
    !proc.join("self").exists() || proc.join(pid.to_string()).exists()
}
