//! Output for the user (progress bar, warnings, error line) and the signals that stop work.

use std::collections::HashSet;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;

/// Prints a line on stdout at once. A reader that has gone wants no more of it, so a broken pipe is no error.
///
/// # Errors
/// [`Error::Io`] where the line cannot be written.
pub fn say(line: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{line}").and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::stdout(e)),
        _ => Ok(()),
    }
}

/// Prints text on stderr unchanged. If stderr is closed, the text is lost.
pub fn complain_raw(text: &str) {
    let _ = write!(std::io::stderr(), "{text}");
}

/// Prints an error line before there is a [`Terminal`].
pub fn complain(e: &Error) {
    complain_raw(&format!("taki: error: {e}\n"));
}

/// The terminal, shared by all that one command prints.
pub struct Terminal {
    /// The current progress bar and the stage it shows.
    bar: Mutex<Option<(&'static str, ProgressBar)>>,
    /// Exit code of the signal that was received; 0 if there was none.
    signal: Arc<AtomicUsize>,
    /// Whether the next signal ends the process.
    at_once: Arc<AtomicBool>,
    /// Warnings so far. A setting of the command line may be told by itself, and by its scene.
    warned: Mutex<HashSet<String>>,
}

impl Terminal {
    /// Handles SIGINT (Ctrl-C), SIGTERM and SIGHUP (a closed terminal). They end the process at once until
    /// [`Terminal::watch`] is called.
    pub fn new() -> Self {
        let signal = Arc::new(AtomicUsize::new(0));
        let at_once = Arc::new(AtomicBool::new(true));
        use signal_hook::consts::{SIGINT, SIGTERM};
        let mut signals = vec![(SIGINT, 130), (SIGTERM, 143)];
        #[cfg(unix)]
        if !ignores_hangup() {
            signals.push((signal_hook::consts::SIGHUP, 129));
        }
        for (number, code) in signals {
            // The shutdown must be registered before the flag, so that it acts only if the flag was set
            // before this signal. If registering fails, the system's default action ends the process, which
            // is acceptable.
            let _ = signal_hook::flag::register_conditional_shutdown(number, code, at_once.clone());
            let _ = signal_hook::flag::register(number, at_once.clone());
            let _ = signal_hook::flag::register_usize(number, signal.clone(), code as usize);
        }
        // A file that grows past the user's limit (ulimit -f) shall be an error of its write, which removes
        // the file. By default the signal ends the process and leaves the file.
        #[cfg(unix)]
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
        Terminal { bar: Mutex::new(None), signal, at_once, warned: Mutex::default() }
    }

    /// From now on the first signal asks the work to stop, and the second ends the process. Work that calls
    /// this asks [`Terminal::check`] often.
    pub fn watch(&self) {
        self.at_once.store(false, Ordering::Relaxed);
    }

    /// Exit code of the signal that was received; 0 if there was none.
    #[cfg(feature = "viewer")]
    pub fn signal(&self) -> Arc<AtomicUsize> {
        self.signal.clone()
    }

    /// Prints a line about the progress of the work.
    pub fn note(&self, line: &str) {
        self.print(line);
    }

    /// Prints the error line.
    pub fn error(&self, e: &Error) {
        self.print(&format!("taki: error: {e}"));
    }

    /// Removes the progress bar.
    pub fn close(&self) {
        if let Some((_, bar)) = self.lock().take() {
            bar.finish_and_clear();
        }
    }

    /// Prints one line without its control characters: file names and scene keys may contain characters that
    /// break the line or steer the terminal.
    fn print(&self, line: &str) {
        let line = line.replace(char::is_control, " ");
        let write = || complain_raw(&format!("{line}\n"));
        match &*self.lock() {
            Some((_, bar)) => bar.suspend(write),
            None => write(),
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<(&'static str, ProgressBar)>> {
        self.bar.lock().unwrap_or_else(|e| e.into_inner())
    }
}

/// Whether the process was started to go on without its terminal, as by `nohup`. Only Linux tells it.
#[cfg(unix)]
fn ignores_hangup() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    ignored.is_none_or(|mask| mask & 1 << (signal_hook::consts::SIGHUP - 1) != 0)
}

impl Terminal {
    /// Whether stderr is a terminal. Progress is then drawn as a bar instead of printed line by line.
    pub fn is_interactive(&self) -> bool {
        std::io::stderr().is_terminal()
    }

    /// Returns an error once a signal has been received.
    pub fn check(&self) -> Result<()> {
        match self.signal.load(Ordering::Relaxed) {
            0 => Ok(()),
            code => Err(Error::Interrupted { code: code as u8 }),
        }
    }

    /// Draws the bar of a batch: `done` of `total` pictures, and the text `pace` behind it.
    pub fn bar(&self, done: f64, total: f64, pace: &str) {
        if !self.is_interactive() {
            return;
        }
        let mut slot = self.lock();
        if slot.as_ref().is_none_or(|(name, _)| *name != PICTURES) {
            if let Some((_, old)) = slot.take() {
                old.finish_and_clear();
            }
            let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{prefix:>8} {wide_bar} {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.set_prefix(PICTURES);
            *slot = Some((PICTURES, bar));
        }
        if let Some((_, bar)) = &*slot {
            // The bar counts thousandths of a picture.
            bar.set_length((total * 1e3) as u64);
            bar.set_position((done * 1e3) as u64);
            bar.set_message(pace.to_owned());
        }
    }
}

/// Name of a batch's progress bar.
const PICTURES: &str = "pictures";

impl Monitor for Terminal {
    fn progress(&self, stage: &'static str, done: u64, total: u64) -> Result<()> {
        self.check()?;
        if self.is_interactive() {
            let mut slot = self.lock();
            if slot.as_ref().is_none_or(|(name, _)| *name != stage) {
                if let Some((_, old)) = slot.take() {
                    old.finish_and_clear();
                }
                let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
                let style = ProgressStyle::with_template("{prefix:>8} {wide_bar} {percent:>3}% {eta:>4}");
                bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
                bar.set_prefix(stage);
                *slot = Some((stage, bar));
            }
            if let Some((_, bar)) = &*slot {
                bar.set_position(done);
            }
        }
        Ok(())
    }

    fn warn(&self, text: &str) {
        let is_new = self.warned.lock().unwrap_or_else(|e| e.into_inner()).insert(text.to_owned());
        if is_new {
            self.print(&format!("taki: warning: {text}"));
        }
    }
}
