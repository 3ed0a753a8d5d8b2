//! Measures how quickly the viewer answers. The command line prints the report when the window closes.

use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Instant;

use serde::Serialize;

use crate::scene::Cost;

/// Most samples kept per measurement.
const MAX_SAMPLES: usize = 20_000;

/// The measurements. All times are in milliseconds.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Time from the window's first frame to its first picture.
    pub first_picture_ms: Option<f64>,
    /// Time from a change that costs uniforms to its first picture in the window.
    pub uniform_preview: Latency,
    /// Time from a change that costs an upload to its first picture.
    pub upload_preview: Latency,
    /// Time from a change that builds the volume to its first picture.
    pub volume_preview: Latency,
    /// Work of the window's thread per frame, from the frame's start until it is handed to the system.
    pub own_frame: Latency,
    /// Time from frame to frame while the window drew without pause and the renderer was at work. It includes
    /// work, hand-over and waiting for the screen.
    pub frame_while_rendering: Latency,
    /// Frames drawn.
    pub frames: u64,
    /// Pictures shown.
    pub pictures: u64,
}

/// Distribution of a time, milliseconds.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Latency {
    /// Number of measurements.
    pub count: usize,
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Longest time.
    pub max: f64,
}

#[derive(Default)]
struct Samples {
    /// When the first frame began.
    start: Option<Instant>,
    first_picture: Option<f64>,
    /// Latencies of first pictures, by [`Cost`].
    previews: [Vec<f64>; 3],
    own: Vec<f64>,
    intervals: Vec<f64>,
    frames: u64,
    pictures: u64,
    /// Time of request and cost of the picture that the current frame draws.
    drawn: Option<(Instant, Cost)>,
    last_preview: Option<f64>,
}

/// Measurements shared between the window, which records them, and its caller, which reports them.
#[derive(Clone, Default)]
pub struct Shared(Arc<Mutex<Samples>>);

fn push(list: &mut Vec<f64>, x: f64) {
    if list.len() < MAX_SAMPLES {
        list.push(x);
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Samples> {
        self.0.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Records the beginning of a frame. `own` is the work of the last frame, seconds. `interval` is the time
    /// since that frame began, seconds, if the renderer was at work and the window drew without pause.
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

    /// Records that this frame draws a new picture, which counts as shown when the next frame begins. `asked`
    /// is the time of its request, if it is the request's first picture.
    pub fn picture(&self, asked: Option<Instant>, cost: Cost) {
        let mut s = self.lock();
        s.pictures += 1;
        if s.first_picture.is_none() {
            s.first_picture = s.start.map(|start| start.elapsed().as_secs_f64() * 1e3);
        } else if let Some(asked) = asked {
            s.drawn = Some((asked, cost));
        }
    }

    /// Distribution of the own work of the last 300 frames.
    pub fn recent_frames(&self) -> Latency {
        let s = self.lock();
        latency(&s.own[s.own.len().saturating_sub(300)..])
    }

    /// Time from the last change to its first picture, milliseconds.
    pub fn last_preview(&self) -> Option<f64> {
        self.lock().last_preview
    }

    /// All measurements so far.
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
