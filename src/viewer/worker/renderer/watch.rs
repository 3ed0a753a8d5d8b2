//! What work of the thread reports, and what ends it.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::Renderer;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::viewer::worker::{Busy, Message, MessageKind, Shared, lock};

impl Renderer {
    pub(super) fn watch(&self, what: &'static str, serial: u64, patience: Duration) -> Watch {
        Watch {
            shared: self.shared.clone(),
            what,
            serial,
            patience,
            start: Instant::now(),
            shown: Mutex::new(None),
        }
    }
}

/// Watches one piece of work for the render thread: ends it when something newer is wanted.
pub(super) struct Watch {
    shared: Arc<Shared>,
    what: &'static str,
    serial: u64,
    /// How long the work goes on though something newer is wanted.
    patience: Duration,
    start: Instant,
    /// When the window was last told.
    shown: Mutex<Option<Instant>>,
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
        let mut shown = lock(&self.shown);
        if shown.is_none_or(|at| at.elapsed() > Duration::from_millis(100)) {
            *shown = Some(Instant::now());
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
