//! How the thread goes on after a fault: a lost device, a bug.

use std::time::{Duration, Instant};

use super::{Renderer, Speed};
use crate::engine::{Engine, EngineChoice};
use crate::util::error::{Error, Result};
use crate::viewer::worker::{Message, MessageKind, lock};

/// More than this many lost devices a minute, and the CPU takes over.
const MAX_REBUILDS: usize = 3;

impl Renderer {
    /// Works and deals with how it ends; true: try it again.
    pub(super) fn attempt(&mut self, work: impl FnOnce(&mut Self) -> Result<()>) -> bool {
        // A panic under the renderer is a bug of this program, but no reason to lose the user's work.
        match std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(self))) {
            Ok(Ok(())) => lock(&self.shared.state).fault = None,
            Ok(Err(Error::Interrupted { .. })) => {}
            Ok(Err(e @ (Error::DeviceLost(_) | Error::Watchdog { .. }))) => {
                self.lost(&e);
                return true;
            }
            Ok(Err(e)) => lock(&self.shared.state).fault = Some(e.to_string()),
            Err(panic) => {
                let text = panic.downcast_ref::<String>().map(String::as_str);
                let why = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no word why");
                let bug = format!("a bug ended the renderer ({why}); please report this");
                if matches!(self.engine, Some(Engine::Gpu(..))) {
                    self.say(MessageKind::Error, format!("{bug}. The CPU engine goes on"));
                    self.take_cpu();
                    return true;
                }
                lock(&self.shared.state).fault = Some(bug);
            }
        }
        false
    }

    /// Opens a new device after one was lost; past a few a minute the CPU takes over.
    fn lost(&mut self, e: &Error) {
        let now = Instant::now();
        self.losses.retain(|at| now - *at < Duration::from_secs(60));
        self.losses.push_back(now);
        lock(&self.shared.state).devices_lost += 1;
        if self.losses.len() > MAX_REBUILDS || matches!(e, Error::Watchdog { .. }) {
            self.say(MessageKind::Error, format!("{e}. The CPU engine goes on; save your work"));
            self.take_cpu();
        } else {
            self.say(
                MessageKind::Warning,
                format!("the GPU device was lost ({e}); a new one was opened, nothing of the scene is lost"),
            );
            self.engine = None;
            self.open_engine();
        }
    }

    fn take_cpu(&mut self) {
        self.choice = EngineChoice::Cpu;
        self.engine = None;
        self.speed = Speed::default();
        self.open_engine();
    }

    pub(super) fn open_engine(&mut self) {
        let opened = Engine::open(self.choice, &self.device);
        let (engine, line) = match opened {
            Ok(opened) => opened,
            Err(e) => {
                self.say(MessageKind::Error, format!("{e}. The CPU engine goes on"));
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
