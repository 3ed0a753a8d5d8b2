//! What the user sees: progress on a terminal, warnings, the error line; and the signals that stop work.

use std::io::{IsTerminal, Write};
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;

/// Prints a line on stdout. A closed stdout loses the line and nothing else: files are still written.
pub fn say(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// Prints text on stderr as it is; a closed stderr loses it.
pub fn complain_raw(text: &str) {
    let _ = write!(std::io::stderr(), "{text}");
}

/// The terminal of one command.
pub struct Terminal {
    bar: Mutex<Option<(&'static str, ProgressBar)>>,
    /// 0, or the exit code of the signal that came.
    signal: Arc<AtomicUsize>,
}

impl Terminal {
    /// Takes over Ctrl-C and SIGTERM: the first asks the work to stop, the second ends the process.
    pub fn new() -> Self {
        let signal = Arc::new(AtomicUsize::new(0));
        let again = Arc::new(AtomicBool::new(false));
        use signal_hook::consts::{SIGINT, SIGTERM};
        for (number, code) in [(SIGINT, 130), (SIGTERM, 143)] {
            // In this order: the shutdown acts only when the flag was already set by a signal before.
            // Without handlers the system's default ends the process, which is no worse.
            let _ = signal_hook::flag::register_conditional_shutdown(number, code, again.clone());
            let _ = signal_hook::flag::register(number, again.clone());
            let _ = signal_hook::flag::register_usize(number, signal.clone(), code as usize);
        }
        Terminal { bar: Mutex::new(None), signal }
    }

    /// 0, or the exit code of the signal that came.
    #[cfg(feature = "viewer")]
    pub fn signal(&self) -> Arc<AtomicUsize> {
        self.signal.clone()
    }

    /// One line that tells what is being done, on a terminal only.
    pub fn note(&self, line: &str) {
        self.print(line);
    }

    /// The error line.
    pub fn error(&self, e: &Error) {
        self.print(&format!("taki: error: {e}"));
    }

    /// Removes the progress bar.
    pub fn close(&self) {
        if let Some((_, bar)) = self.lock().take() {
            bar.finish_and_clear();
        }
    }

    /// Prints one line. Names of files and keys of scenes may hold what would end it or steer the terminal.
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

impl Terminal {
    /// Whether someone may look at it: progress is then drawn, and not told line by line.
    pub fn is_interactive(&self) -> bool {
        std::io::stderr().is_terminal()
    }

    /// An error once a signal has come.
    pub fn check(&self) -> Result<()> {
        match self.signal.load(Ordering::Relaxed) {
            0 => Ok(()),
            code => Err(Error::Interrupted { code: code as u8 }),
        }
    }

    /// Draws the bar of many pictures, `done` of `total`, and what `pace` says of them.
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
            // In thousandths of a picture.
            bar.set_length((total * 1e3) as u64);
            bar.set_position((done * 1e3) as u64);
            bar.set_message(pace.to_owned());
        }
    }
}

/// The bar of many pictures.
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
        self.print(&format!("taki: warning: {text}"));
    }
}
