//! One error type; every variant says what happened and what the user can do.

use std::path::{Path, PathBuf};

/// Everything that can end a command. The text is one line: what happened, then what to do.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A comparison found more difference than its threshold allows.
    #[error("{0}")]
    Comparison(String),
    /// The command line cannot be understood.
    #[error("{0}")]
    Usage(String),
    /// The work needs more memory than its budget, or the device is out of memory.
    #[error("{what} needs {need}, the budget is {budget}; {fix}")]
    Memory {
        /// Item that needs the memory, with the values that determine its size.
        what: String,
        /// Bytes needed, for people.
        need: String,
        /// Bytes allowed, for people.
        budget: String,
        /// What to do.
        fix: String,
    },
    /// A scene, parameter, volume or image is not valid.
    #[error("{what}; {fix}")]
    Input {
        /// The fault with its file, line or byte, key and value.
        what: String,
        /// What to do.
        fix: String,
    },
    /// `--engine gpu` was asked for and no adapter can do the work.
    #[error("{0}; install a Vulkan driver (Debian: mesa-vulkan-drivers) or use --engine cpu")]
    NoAdapter(String),
    /// The viewer's window cannot be opened.
    #[error(
        "no window could be opened ({0}); the viewer needs a display (DISPLAY or WAYLAND_DISPLAY) \
         with Vulkan or OpenGL (Debian: mesa-vulkan-drivers or libgl1-mesa-dri); taki render needs neither"
    )]
    NoWindow(String),
    /// A video was asked for, and ffmpeg is missing or cannot encode it.
    #[error("{0}; install ffmpeg (Debian: ffmpeg) or write .gif or .apng, which need none")]
    NoFfmpeg(String),
    /// An output cannot be created. Reported before any work is done.
    #[error("cannot create {}: {why}; {fix}", path.display())]
    CannotCreate {
        /// The output.
        path: PathBuf,
        /// Why not.
        why: String,
        /// What to do.
        fix: String,
    },
    /// Reading or writing failed half-way.
    #[error("{what} {}: {why}; {fix}", path.display())]
    Io {
        /// `cannot write` or `cannot read`.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// Reason given by the system.
        why: String,
        /// What to do.
        fix: &'static str,
    },
    /// The device was lost: trying again may help.
    #[error("the GPU device was lost: {0}; run the command again, or use --engine cpu")]
    DeviceLost(String),
    /// A submission did not finish in time.
    #[error(
        "the GPU did not answer for {seconds} s; raise --watchdog, lower the image size, or use --engine cpu"
    )]
    Watchdog {
        /// Time-out that passed, seconds.
        seconds: f64,
    },
    /// The user or the system asked the program to end.
    #[error("interrupted: nothing unfinished was kept; run the same command again")]
    Interrupted {
        /// Exit code: 130 after SIGINT, 143 after SIGTERM.
        code: u8,
    },
}

/// Result with the crate's [`enum@Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Returns an error of invalid input; exit code 65.
    pub fn input(what: impl Into<String>, fix: impl Into<String>) -> Self {
        Error::Input { what: what.into(), fix: fix.into() }
    }

    /// Returns an error of too little memory, `need` and `budget` in bytes; exit code 33.
    pub fn memory(what: impl Into<String>, need: u128, budget: u64, fix: impl Into<String>) -> Self {
        Error::Memory {
            what: what.into(),
            need: human_bytes(need),
            budget: human_bytes(budget as u128),
            fix: fix.into(),
        }
    }

    /// Returns an error of a failed read; exit code 74.
    pub fn read(path: &Path, why: impl ToString) -> Self {
        Error::Io {
            what: "cannot read",
            path: path.to_owned(),
            why: why.to_string(),
            fix: "check that the file exists and may be read",
        }
    }

    /// Returns an error of a failed write; exit code 74.
    pub fn write(path: &Path, why: impl ToString) -> Self {
        Error::Io {
            what: "cannot write",
            path: path.to_owned(),
            why: why.to_string(),
            fix: "free some space or choose another place with -o",
        }
    }

    /// Returns the exit code of the process, as listed in docs/scenes-and-files.md.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Comparison(_) => 1,
            Error::Usage(_) => 2,
            Error::Memory { .. } => 33,
            Error::Input { .. } => 65,
            Error::NoAdapter(_) | Error::NoWindow(_) | Error::NoFfmpeg(_) => 69,
            Error::CannotCreate { .. } => 73,
            Error::Io { .. } => 74,
            Error::DeviceLost(_) => 75,
            Error::Watchdog { .. } => 124,
            Error::Interrupted { code } => *code,
        }
    }
}

/// Formats bytes in binary units with one decimal.
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
