//! Keeps lines of system libraries away from stderr that tell nothing about the work.
//!
//! Vulkan's device selection and the libraries of windows ask Wayland for its display. Where
//! `XDG_RUNTIME_DIR` is not set, as in most containers and on most servers, Wayland's library writes a line
//! that begins with `error:` each time, though nothing has failed.

/// The line of Wayland's library.
#[cfg(unix)]
const NOISE: &str = "error: XDG_RUNTIME_DIR is invalid or not set in the environment.";

/// Runs `work` while lines on stderr that say nothing are left out. All other lines are passed on as they
/// come.
#[cfg(unix)]
pub fn without_noise<T>(work: impl FnOnce() -> T) -> T {
    use std::path::Path;
    // Wayland's library wants an absolute path, and is silent then.
    let is_silent = std::env::var_os("XDG_RUNTIME_DIR").is_some_and(|dir| Path::new(&dir).is_absolute());
    // Without the filter the lines stay, which is no harm.
    let _filter = if is_silent { None } else { Filter::new().ok() };
    work()
}

/// Runs `work`.
#[cfg(not(unix))]
pub fn without_noise<T>(work: impl FnOnce() -> T) -> T {
    work()
}

/// Filter between everything that writes to stderr and stderr itself, until it is dropped.
#[cfg(unix)]
struct Filter {
    stderr: std::os::fd::OwnedFd,
    /// Is closed when all lines have been passed on.
    passed_on: std::sync::mpsc::Receiver<()>,
}

#[cfg(unix)]
impl Filter {
    fn new() -> std::io::Result<Filter> {
        use std::io::{BufRead, BufReader, Write};
        use std::os::fd::AsFd;
        let stderr = std::io::stderr().as_fd().try_clone_to_owned()?;
        let mut out = std::fs::File::from(stderr.try_clone()?);
        let (reader, writer) = std::io::pipe()?;
        let (done, passed_on) = std::sync::mpsc::channel();
        std::thread::Builder::new().name("stderr".into()).spawn(move || {
            let _done: std::sync::mpsc::Sender<()> = done;
            let mut lines = BufReader::new(reader);
            let mut line = Vec::new();
            while lines.read_until(b'\n', &mut line).is_ok_and(|bytes| bytes > 0) {
                if line.trim_ascii_end() != NOISE.as_bytes() {
                    // Where stderr is closed, the text is lost as it is without the filter.
                    let _ = out.write_all(&line);
                }
                line.clear();
            }
        })?;
        // The pipe's only writer is stderr from now on. When that is put back, the thread ends.
        rustix::stdio::dup2_stderr(&writer)?;
        Ok(Filter { stderr, passed_on })
    }
}

#[cfg(unix)]
impl Drop for Filter {
    fn drop(&mut self) {
        // A program that was started meanwhile still holds the pipe. It must not keep this one waiting.
        if rustix::stdio::dup2_stderr(&self.stderr).is_ok() {
            let _ = self.passed_on.recv_timeout(std::time::Duration::from_millis(200));
        }
    }
}
