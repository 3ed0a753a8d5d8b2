//! Recovery of the render thread after a fault: a lost device or a bug.

use std::time::{Duration, Instant};

use super::{Renderer, Speed};
use crate::engine::{Engine, EngineChoice};
use crate::util::error::{Error, Result};
use crate::viewer::worker::{Message, MessageKind, lock};

/// Most devices lost within a minute before the CPU takes over.
const MAX_REBUILDS: usize = 3;

impl Renderer {
    /// Runs `work` and handles its failure. Returns whether to try it again.
    pub(super) fn attempt(&mut self, work: impl FnOnce(&mut Self) -> Result<()>) -> bool {
        // A panic in the renderer is a bug of this program, but must not cost the user's work.
        match std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(self))) {
            Ok(Ok(())) => lock(&self.shared.state).fault = None,
            Ok(Err(Error::Interrupted { .. })) => {}
            Ok(Err(e @ (Error::DeviceLost(_) | Error::Watchdog { .. }))) => {
                self.lost(&e);
                return true;
            }
            Ok(Err(e @ Error::Device { .. })) if self.choice == EngineChoice::Auto => {
                self.say(MessageKind::Warning, format!("{}. The CPU engine takes over", e.cause()));
                self.take_cpu();
                return true;
            }
            Ok(Err(e)) => lock(&self.shared.state).fault = Some(e.to_string()),
            Err(panic) => {
                let text = panic.downcast_ref::<String>().map(String::as_str);
                let why = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
                let bug = format!("a bug ended the renderer ({why}); please report this");
                if matches!(self.engine, Some(Engine::Gpu { .. })) {
                    self.say(MessageKind::Error, format!("{bug}. The CPU engine takes over"));
                    self.take_cpu();
                    return true;
                }
                lock(&self.shared.state).fault = Some(bug);
            }
        }
        false
    }

    /// Opens a new device after one was lost. After too many losses or a time-out the CPU takes over.
    fn lost(&mut self, e: &Error) {
        let now = Instant::now();
        self.losses.retain(|at| now - *at < Duration::from_secs(60));
        self.losses.push_back(now);
        lock(&self.shared.state).devices_lost += 1;
        if self.losses.len() > MAX_REBUILDS || matches!(e, Error::Watchdog { .. }) {
            self.say(MessageKind::Error, format!("{}. The CPU engine takes over; save your work", e.cause()));
            self.take_cpu();
        } else {
            self.say(
                MessageKind::Warning,
                format!("the GPU device was lost ({e}); a new one was opened and the scene is unchanged"),
            );
            self.engine = None;
            self.open_engine();
        }
    }

    /// Replaces the engine by the CPU engine.
    fn take_cpu(&mut self) {
        self.choice = EngineChoice::Cpu;
        self.engine = None;
        self.speed = Speed::default();
        self.open_engine();
    }

    /// Opens the chosen engine, or the CPU engine if that fails.
    pub(super) fn open_engine(&mut self) {
        let opened = Engine::open(self.choice, &self.device);
        let (engine, line) = match opened {
            Ok(opened) => opened,
            Err(e) => {
                self.say(MessageKind::Error, format!("{e}. The CPU engine takes over"));
                (Engine::cpu(), "engine cpu".into())
            }
        };
        if matches!(engine, Engine::Cpu(_)) && self.choice != EngineChoice::Cpu {
            self.say(MessageKind::Warning, line.clone());
        }
        self.engine = Some(engine);
        lock(&self.shared.state).engine = line;
        (self.shared.wake)();
    }

    /// Sends a message to the window, unless it repeats the last one.
    pub(super) fn say(&self, kind: MessageKind, text: String) {
        let mut state = lock(&self.shared.state);
        let message = Message { kind, text };
        if state.messages.last() != Some(&message) {
            state.messages.push(message);
        }
        drop(state);
        (self.shared.wake)();
    }
}
