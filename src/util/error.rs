//! The crate's error type. Every variant says what happened and what the user can do.

use std::path::{Path, PathBuf};

/// Error that ends a command. Its text is one line: what happened, then what to do.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A comparison found more difference than its threshold allows.
    #[error("{0}")]
    Comparison(String),
    /// The command line cannot be understood.
    #[error("{0}")]
    Usage(String),
    /// The work needs more memory than its budget, or the device has none left.
    #[error("{what} needs {need}, the budget is {budget}; {fix}")]
    Memory {
        /// Name of what needs the memory, with the values that determine its size.
        what: String,
        /// Bytes needed, formatted by [`human_bytes`].
        need: String,
        /// Bytes allowed, formatted by [`human_bytes`].
        budget: String,
        /// Advice: how to mend it.
        fix: String,
    },
    /// A scene, parameter, volume or image is not valid.
    #[error("{what}; {fix}")]
    Input {
        /// Description of the fault, with its file, line or byte, key and value.
        what: String,
        /// Advice: how to mend it.
        fix: String,
    },
    /// The scene is valid, but beyond what the GPU device can do. The CPU engine can render it.
    #[error("{what}; {fix}")]
    Device {
        /// Description of the limit, with the device's name.
        what: String,
        /// Advice: how to mend it.
        fix: String,
    },
    /// The command asks for `--engine gpu` or for an adapter, and no such adapter can do the work.
    #[error("{what}; {fix}")]
    NoAdapter {
        /// Description of what is missing.
        what: String,
        /// Advice: how to mend it.
        fix: String,
    },
    /// The viewer's window cannot be opened.
    #[error(
        "no window could be opened ({0}); the viewer needs a display (DISPLAY or WAYLAND_DISPLAY) with \
         Vulkan or OpenGL (Debian: mesa-vulkan-drivers or libgl1-mesa-dri); taki render needs neither"
    )]
    NoWindow(String),
    /// The program that encodes a video is missing or cannot encode it.
    #[error("{0}; install ffmpeg (Debian: ffmpeg) or write .gif or .apng, which do not need it")]
    NoFfmpeg(String),
    /// An output cannot be created. Reported before any work is done.
    #[error("cannot create {}: {why}; {fix}", path.display())]
    CannotCreate {
        /// Path of the output.
        path: PathBuf,
        /// Reason.
        why: String,
        /// Advice: how to mend it.
        fix: String,
    },
    /// Reading or writing a file failed.
    #[error("{what} {}: {why}; {fix}", path.display())]
    Io {
        /// `cannot write` or `cannot read`.
        what: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// Reason that the system gives.
        why: String,
        /// Advice: how to mend it.
        fix: &'static str,
    },
    /// The GPU device was lost. Trying again may help.
    #[error("the GPU device was lost: {0}; run the command again, or use --engine cpu")]
    DeviceLost(String),
    /// A submission to the GPU did not finish in time.
    #[error(
        "the GPU did not answer for {seconds} s; raise --watchdog, lower the image size, or use --engine cpu"
    )]
    Watchdog {
        /// Length of the time-out that passed, s.
        seconds: f64,
    },
    /// A signal of the user or the system ended the program.
    #[error("interrupted: nothing unfinished was kept; run the same command again")]
    Interrupted {
        /// Exit code: 129 after SIGHUP, 130 after SIGINT, 143 after SIGTERM.
        code: u8,
    },
}

/// Result of the crate's functions.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// [`Error::Input`]: a fault in what the user gave.
    pub fn input(what: impl Into<String>, fix: impl Into<String>) -> Self {
        Error::Input { what: what.into(), fix: fix.into() }
    }

    /// The cause without the advice, for a message about what taki does by itself.
    pub fn cause(&self) -> String {
        match self {
            Error::Device { what, .. } => what.clone(),
            Error::DeviceLost(why) => format!("the GPU device was lost: {why}"),
            Error::Watchdog { seconds } => format!("the GPU did not answer for {seconds} s"),
            Error::Memory { what, need, budget, .. } => {
                format!("{what} needs {need}, the budget is {budget}")
            }
            other => other.to_string(),
        }
    }

    /// [`Error::Device`]: more than the device can do.
    pub fn device(what: impl Into<String>, fix: impl Into<String>) -> Self {
        Error::Device { what: what.into(), fix: fix.into() }
    }

    /// [`Error::Memory`]: more memory than allowed. `need` and `budget` are bytes.
    pub fn memory(what: impl Into<String>, need: u128, budget: u64, fix: impl Into<String>) -> Self {
        Error::Memory {
            what: what.into(),
            need: human_bytes(need),
            budget: human_bytes(budget as u128),
            fix: fix.into(),
        }
    }

    /// Error about an input that cannot be opened: [`Error::Input`] where there is none, because no later try
    /// will find it, and [`Error::Io`] where it is there.
    pub fn open(path: &Path, why: std::io::Error) -> Self {
        use std::io::ErrorKind::{NotADirectory, NotFound};
        match why.kind() {
            NotFound | NotADirectory => Error::input(
                format!("there is no file {}", path.display()),
                "check the path, which starts in the current folder or in that of the scene",
            ),
            _ => Error::read(path, why),
        }
    }

    /// [`Error::Io`] of a failed read.
    pub fn read(path: &Path, why: impl ToString) -> Self {
        Error::Io {
            what: "cannot read",
            path: path.to_owned(),
            why: why.to_string(),
            fix: "check that the file exists and may be read",
        }
    }

    /// [`Error::Io`] of a failed write.
    pub fn write(path: &Path, why: impl ToString) -> Self {
        Error::Io {
            what: "cannot write",
            path: path.to_owned(),
            why: why.to_string(),
            fix: "free some space or choose another place",
        }
    }

    /// [`Error::Io`] of a failed write to stdout.
    pub fn stdout(why: impl ToString) -> Self {
        Error::Io {
            what: "cannot write",
            path: "stdout".into(),
            why: why.to_string(),
            fix: "free some space or send it elsewhere",
        }
    }

    /// Exit code of the process, as docs/scenes-and-files.md lists them.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Comparison(_) => 1,
            Error::Usage(_) => 2,
            Error::Memory { .. } => 33,
            Error::Input { .. } | Error::Device { .. } => 65,
            Error::NoAdapter { .. } | Error::NoWindow(_) | Error::NoFfmpeg(_) => 69,
            Error::CannotCreate { .. } => 73,
            Error::Io { .. } => 74,
            Error::DeviceLost(_) => 75,
            Error::Watchdog { .. } => 124,
            Error::Interrupted { code } => *code,
        }
    }
}

/// Formats a number of bytes in binary units with one decimal.
pub fn human_bytes(bytes: u128) -> String {
    const UNITS: [&str; 7] = ["B", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
    let mut value = bytes as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    if unit == 0 { format!("{bytes} B") } else { format!("{value:.1} {}", UNITS[unit]) }
}
