//! Progress reports and cancellation of the render thread's work.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::Renderer;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::viewer::worker::{Busy, Message, MessageKind, Shared, lock};

impl Renderer {
    /// Creates the monitor of one piece of work for request `serial`. See [`Watch`].
    pub(super) fn watch(&self, what: &'static str, serial: u64, patience: Duration) -> Watch {
        Watch {
            shared: self.shared.clone(),
            what,
            serial,
            patience,
            start: Instant::now(),
            last_report: Mutex::new(None),
        }
    }
}

/// Monitor of one piece of work: reports its progress, and ends it when it is stopped or a newer request
/// waits.
pub(super) struct Watch {
    shared: Arc<Shared>,
    /// Kind of work, see [`Busy`].
    what: &'static str,
    /// Number of the request, `u64::MAX` for an export.
    serial: u64,
    /// Time for which the work continues although a newer request waits.
    patience: Duration,
    start: Instant,
    /// When progress was last reported to the window.
    last_report: Mutex<Option<Instant>>,
}

impl Monitor for Watch {
    fn progress(&self, _: &'static str, done: u64, total: u64) -> Result<()> {
        let export = self.serial == u64::MAX;
        let newer = self.shared.newest.load(Ordering::Relaxed) > self.serial;
        let stopped = !export && self.shared.stopped.load(Ordering::Relaxed) >= self.serial;
        let cancelled = export && self.shared.cancel_export.load(Ordering::Relaxed);
        let quit = self.shared.quit.load(Ordering::Relaxed);
        if quit || stopped || cancelled || (newer && self.start.elapsed() >= self.patience) {
            return Err(Error::Interrupted { code: 130 });
        }
        let mut last_report = lock(&self.last_report);
        if last_report.is_none_or(|at| at.elapsed() > Duration::from_millis(100)) {
            *last_report = Some(Instant::now());
            let share = done as f32 / total.max(1) as f32;
            lock(&self.shared.state).busy = Some(Busy { what: self.what, share });
            (self.shared.wake)();
        }
        Ok(())
    }

    fn warn(&self, text: &str) {
        let message = Message { kind: MessageKind::Warning, text: text.into() };
        lock(&self.shared.state).messages.push(message);
        (self.shared.wake)();
    }
}
