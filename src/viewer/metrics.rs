//! How quickly the viewer answers: measured while it is used, printed at its end.

use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Instant;

use serde::Serialize;

use crate::scene::Cost;

/// Latencies and frames are kept up to this many of each.
const KEPT: usize = 20_000;

/// What was measured, milliseconds.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// From the window's first frame to the first picture in it.
    pub first_picture_ms: Option<f64>,
    /// From a change that costs uniforms to its first picture on the window.
    pub uniform_preview: Latency,
    /// From a change that costs an upload.
    pub upload_preview: Latency,
    /// From a change that builds the volume.
    pub volume_preview: Latency,
    /// The window's own frame: its thread's work from the start of one to its hand-over, in all states.
    pub own_frame: Latency,
    /// From frame to frame while the window drew without pause beside the renderer at work: work,
    /// hand-over and waiting for the screen.
    pub frame_while_rendering: Latency,
    /// Frames drawn.
    pub frames: u64,
    /// Pictures shown.
    pub pictures: u64,
}

/// A distribution, milliseconds.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Latency {
    /// Measurements.
    pub count: usize,
    /// Half are below it.
    pub median: f64,
    /// 95 in 100 are below it.
    pub p95: f64,
    /// The longest.
    pub max: f64,
}

#[derive(Default)]
struct Samples {
    start: Option<Instant>,
    first_picture: Option<f64>,
    previews: [Vec<f64>; 3],
    own: Vec<f64>,
    intervals: Vec<f64>,
    frames: u64,
    pictures: u64,
    /// Of a picture that the frame in hand draws.
    drawn: Option<(Instant, Cost)>,
    last_preview: Option<f64>,
}

/// Shared between the window, which measures, and its caller, who reports.
#[derive(Clone, Default)]
pub struct Shared(Arc<Mutex<Samples>>);

fn push(list: &mut Vec<f64>, x: f64) {
    if list.len() < KEPT {
        list.push(x);
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Samples> {
        self.0.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// A frame begins. `own` are the seconds of the last one's work; `interval` those since it began, if
    /// the renderer was at work and the window drew continuously.
    pub fn frame(&self, own: Option<f32>, interval: Option<f64>) {
        let mut s = self.lock();
        s.start.get_or_insert_with(Instant::now);
        s.frames += 1;
        if let Some((asked, cost)) = s.drawn.take() {
            let ms = asked.elapsed().as_secs_f64() * 1e3;
            s.last_preview = Some(ms);
            push(&mut s.previews[cost as usize], ms);
        }
        if let Some(own) = own {
            push(&mut s.own, f64::from(own) * 1e3);
        }
        if let Some(interval) = interval {
            push(&mut s.intervals, interval * 1e3);
        }
    }

    /// A picture is drawn in this frame; it counts as shown when the next one begins. `asked`: when its
    /// request was made, if it is the first for it.
    pub fn picture(&self, asked: Option<Instant>, cost: Cost) {
        let mut s = self.lock();
        s.pictures += 1;
        if s.first_picture.is_none() {
            s.first_picture = s.start.map(|start| start.elapsed().as_secs_f64() * 1e3);
        } else if let Some(asked) = asked {
            s.drawn = Some((asked, cost));
        }
    }

    /// Median and 95th percentile of the last frames' own work, milliseconds.
    pub fn recent_frames(&self) -> Latency {
        let s = self.lock();
        latency(&s.own[s.own.len().saturating_sub(300)..])
    }

    /// Milliseconds from the last change to its first picture.
    pub fn last_preview(&self) -> Option<f64> {
        self.lock().last_preview
    }

    /// Everything.
    pub fn report(&self) -> Report {
        let s = self.lock();
        Report {
            first_picture_ms: s.first_picture,
            uniform_preview: latency(&s.previews[Cost::Uniform as usize]),
            upload_preview: latency(&s.previews[Cost::Upload as usize]),
            volume_preview: latency(&s.previews[Cost::Volume as usize]),
            own_frame: latency(&s.own),
            frame_while_rendering: latency(&s.intervals),
            frames: s.frames,
            pictures: s.pictures,
        }
    }
}

fn latency(samples: &[f64]) -> Latency {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let i = (share * sorted.len() as f64).ceil() as usize;
        sorted.get(i.saturating_sub(1)).copied().unwrap_or(0.0)
    };
    Latency { count: sorted.len(), median: at(0.5), p95: at(0.95), max: at(1.0) }
}
