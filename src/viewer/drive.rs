//! The viewer's `--measure`: changes parameters at the pace of a user, then draws without pause while a
//! picture is refined.

use std::time::{Duration, Instant};

use eframe::egui;

use super::app::Viewer;
use crate::scene::Raw;
use crate::util::error::Result;

/// Changes of a uniform, of an upload and of the volume: key, the two values to alternate, number of changes.
const CHANGES: [(&str, [f64; 2], usize); 3] =
    [("trace.sigma", [8.0, 8.5], 24), ("volume.k_d", [0.5, 0.55], 12), ("curves.h", [0.9, 0.95], 24)];
/// Pause between two changes, as a user makes it.
const REST: Duration = Duration::from_millis(150);
/// Time for which the window draws without pause while the renderer refines.
const DRAWING: Duration = Duration::from_secs(6);
/// Longest wait for a picture. After it the next change is made, and the report counts one picture less.
const GIVE_UP: Duration = Duration::from_secs(20);

/// Progress of the measurement.
pub struct Drive {
    /// 0 waits for the first full picture. Phase i makes the changes of `CHANGES[i - 1]`. The last one draws
    /// without pause.
    phase: usize,
    /// Changes made in this phase.
    change: usize,
    /// When the phase, the change or the pause began.
    since: Instant,
    /// Whether the picture of the last change is still to come.
    waiting: bool,
}

impl Drive {
    /// Starts a measurement, which waits for the first full picture.
    pub fn new() -> Self {
        Drive { phase: 0, change: 0, since: Instant::now(), waiting: true }
    }

    /// Whether the window is to draw without pause.
    pub fn draws_continuously(&self) -> bool {
        self.phase == CHANGES.len() + 1
    }

    /// Takes one frame's step. Returns whether everything is measured.
    ///
    /// # Errors
    /// If the parameter table does not allow a change.
    pub fn step(&mut self, viewer: &mut Viewer, ctx: &egui::Context) -> Result<bool> {
        ctx.request_repaint_after(Duration::from_millis(5));
        let timed_out = self.since.elapsed() > GIVE_UP;
        if self.phase == 0 {
            if viewer.picture().is_some_and(|p| p.scale == 1) || timed_out {
                self.enter(1);
            }
            return Ok(false);
        }
        let Some((key, values, count)) = CHANGES.get(self.phase - 1) else {
            ctx.request_repaint();
            return Ok(self.since.elapsed() > DRAWING);
        };
        if self.waiting {
            if viewer.shows_latest() || timed_out {
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
