//! The viewer measuring itself: it changes parameters as a hand would, and draws without pause while a
//! picture is refined.

use std::time::{Duration, Instant};

use eframe::egui;

use super::app::Viewer;
use crate::scene::Raw;
use crate::util::error::Result;

/// Changes of a uniform, of an upload, of the volume.
const CHANGES: [(&str, [f64; 2], usize); 3] =
    [("trace.sigma", [8.0, 8.5], 24), ("volume.k_d", [0.5, 0.55], 12), ("curves.h", [0.9, 0.95], 24)];
/// A hand rests this long between two changes.
const REST: Duration = Duration::from_millis(150);
/// How long the window draws without pause while the renderer refines.
const DRAWING: Duration = Duration::from_secs(6);
/// A picture that takes longer than this is given up: the report then has fewer of them.
const GIVE_UP: Duration = Duration::from_secs(20);

/// Where the measurement is.
pub struct Drive {
    phase: usize,
    change: usize,
    since: Instant,
    waiting: bool,
}

impl Drive {
    /// Begins with the first full picture.
    pub fn new() -> Self {
        Drive { phase: 0, change: 0, since: Instant::now(), waiting: true }
    }

    /// Whether the window is to draw without pause.
    pub fn draws_continuously(&self) -> bool {
        self.phase == CHANGES.len() + 1
    }

    /// One frame's step; true when all is measured.
    ///
    /// # Errors
    /// If the scene does not take the changes.
    pub fn step(&mut self, viewer: &mut Viewer, ctx: &egui::Context) -> Result<bool> {
        ctx.request_repaint_after(Duration::from_millis(5));
        let over = self.since.elapsed() > GIVE_UP;
        if self.phase == 0 {
            if viewer.picture().is_some_and(|p| p.scale == 1) || over {
                self.enter(1);
            }
            return Ok(false);
        }
        let Some((key, values, count)) = CHANGES.get(self.phase - 1) else {
            ctx.request_repaint();
            return Ok(self.since.elapsed() > DRAWING);
        };
        if self.waiting {
            if viewer.shows_latest() || over {
                self.waiting = false;
                self.since = Instant::now();
            }
        } else if self.since.elapsed() > REST {
            if self.change == *count {
                self.enter(self.phase + 1);
                return Ok(false);
            }
            viewer.document_mut().set(key, &Raw::Float(values[self.change % 2]), None)?;
            self.change += 1;
            self.waiting = true;
            self.since = Instant::now();
        }
        Ok(false)
    }

    fn enter(&mut self, phase: usize) {
        *self = Drive { phase, change: 0, since: Instant::now(), waiting: false };
    }
}
