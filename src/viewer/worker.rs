//! The render thread: takes the latest request, shows a coarse preview at once, then refines.
//!
//! The window's thread only leaves requests and picks up pictures; it waits for nothing. The renderer has
//! a device of its own, beside the one that draws the window: a long tile does not hold up the window's
//! own drawing, and a device lost under the renderer takes nothing else with it.

mod renderer;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Instant;

use eframe::egui;

use super::layer_image::Legend;
use crate::engine::EngineChoice;
use crate::engine::gpu::DeviceOptions;
use crate::picture::{Frame, Layer};
use crate::place::Mesh;
use crate::scene::{Cost, Scene};
use crate::util::cache::Cache;
use crate::volume::VolumeTexture;
use renderer::Renderer;

/// What the window wants to see.
#[derive(Clone)]
pub struct Request {
    /// Counts the requests.
    pub serial: u64,
    /// When it was asked for.
    pub asked: Instant,
    /// The scene.
    pub scene: Arc<Scene>,
    /// Pixels at full resolution; the scene's own size does not count.
    pub size: [u32; 2],
    /// Samples a pixel to refine to.
    pub samples: u32,
    /// The layer that is shown.
    pub layer: Layer,
}

/// A picture to be written to files.
pub struct Export {
    /// The scene, with the picture's size and samples.
    pub scene: Scene,
    /// Files, .png or .exr.
    pub paths: Vec<PathBuf>,
}

/// A picture for the window.
pub struct Picture {
    /// Of which request.
    pub serial: u64,
    /// When that was asked for.
    pub asked: Instant,
    /// The scene that was asked for.
    pub of: Arc<Scene>,
    /// The same with the picture's size.
    pub scene: Arc<Scene>,
    /// Its volume.
    pub volume: Arc<VolumeTexture>,
    /// Its opaque mesh.
    pub mesh: Mesh,
    /// The frame.
    pub frame: Arc<Frame>,
    /// The layer that was asked for, as it is shown.
    pub image: Arc<egui::ColorImage>,
    /// That layer.
    pub layer: Layer,
    /// What its colours mean.
    pub legend: Legend,
    /// Pixels of the viewport per pixel, along a side.
    pub scale: u32,
    /// Samples in it.
    pub samples: u32,
    /// Whether this request's first.
    pub first: bool,
    /// What had to be done for it.
    pub cost: Cost,
}

/// What the renderer is at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Busy {
    /// In a word: `curves`, `preview`, `refining`, `export`.
    pub what: &'static str,
    /// 0 to 1.
    pub share: f32,
}

/// Something the user should read.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// How bad it is.
    pub kind: MessageKind,
    /// What happened and what to do.
    pub text: String,
}

/// How bad a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageKind {
    /// Good news.
    Note,
    /// The work goes on.
    Warning,
    /// It does not.
    Error,
}

/// What the renderer shows of itself.
#[derive(Default)]
pub struct State {
    /// The engine in one line; empty until it is open.
    pub engine: String,
    /// The newest picture.
    pub picture: Option<Arc<Picture>>,
    /// What it is at; none when there is nothing to do.
    pub busy: Option<Busy>,
    /// New messages, oldest first.
    pub messages: Vec<Message>,
    /// The last request that was finished, given up or failed.
    pub settled: u64,
    /// Why the last request could not be rendered.
    pub fault: Option<String>,
    /// Seconds of the last volume that was built or read.
    pub volume_seconds: f64,
    /// Devices that were lost.
    pub devices_lost: usize,
    /// Exports that ended, well or not.
    pub exports_done: usize,
}

#[derive(Default)]
struct Queue {
    view: Option<Request>,
    exports: VecDeque<Export>,
    lose_device: bool,
    quit: bool,
}

struct Shared {
    queue: Mutex<Queue>,
    news: Condvar,
    /// Serial of the newest request.
    newest: AtomicU64,
    /// Requests up to this one are not to be refined further.
    stopped: AtomicU64,
    cancel_export: AtomicBool,
    quit: AtomicBool,
    state: Mutex<State>,
    wake: Box<dyn Fn() + Send + Sync>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A panic elsewhere leaves plain data behind, never a half-made picture.
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}

/// The window's side of the render thread.
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread; it opens the engine, and takes the first scene from `cache`. `wake` is called when
    /// there is something new to show.
    pub fn new(
        choice: EngineChoice,
        device: DeviceOptions,
        memory: u64,
        cache: Option<Cache>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Worker {
        let shared = Arc::new(Shared {
            queue: Mutex::default(),
            news: Condvar::new(),
            newest: AtomicU64::new(0),
            stopped: AtomicU64::new(0),
            cancel_export: AtomicBool::new(false),
            quit: AtomicBool::new(false),
            state: Mutex::default(),
            wake: Box::new(wake),
        });
        let renderer = Renderer::new(shared.clone(), choice, device, memory, cache);
        let thread = std::thread::Builder::new().name("render".into()).spawn(move || renderer.run());
        if let Err(e) = &thread {
            lock(&shared.state).fault = Some(format!("the render thread did not start: {e}"));
        }
        Worker { shared, thread: thread.ok() }
    }

    /// Asks for a picture; an older wish is forgotten.
    pub fn request(&self, request: Request) {
        self.shared.newest.store(request.serial, Ordering::Relaxed);
        lock(&self.shared.queue).view = Some(request);
        self.shared.news.notify_one();
    }

    /// Asks for a picture in files.
    pub fn export(&self, export: Export) {
        self.shared.cancel_export.store(false, Ordering::Relaxed);
        lock(&self.shared.queue).exports.push_back(export);
        self.shared.news.notify_one();
    }

    /// Stops the work in hand; what is shown stays.
    pub fn stop(&self) {
        self.shared.stopped.store(self.shared.newest.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    /// Stops the export in hand and those that wait.
    pub fn cancel_exports(&self) {
        lock(&self.shared.queue).exports.clear();
        self.shared.cancel_export.store(true, Ordering::Relaxed);
    }

    /// What the renderer shows of itself.
    pub fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.shared.state)
    }

    /// Takes the device away as a driver's reset does. For tests.
    #[doc(hidden)]
    pub fn lose_device(&self) {
        lock(&self.shared.queue).lose_device = true;
        self.shared.news.notify_one();
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.shared.quit.store(true, Ordering::Relaxed);
        lock(&self.shared.queue).quit = true;
        self.shared.news.notify_one();
        if let Some(thread) = self.thread.take() {
            // A panic of the thread was reported when it happened.
            let _ = thread.join();
        }
    }
}
