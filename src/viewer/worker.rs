//! The render thread: takes the latest request, shows a coarse preview at once, then refines it.
//!
//! The window's thread only leaves requests and picks up pictures. It never waits. The renderer has a device
//! of its own, separate from the one that draws the window. A long tile does not delay the window's drawing,
//! and the loss of the renderer's device affects nothing else.

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
use crate::job::Depth;
use crate::picture::{Frame, Layer};
use crate::place::Mesh;
use crate::scene::{Cost, Scene};
use crate::util::cache::Cache;
use crate::volume::VolumeTexture;
use renderer::Renderer;

/// A picture that the window requests.
#[derive(Clone)]
pub struct Request {
    /// Number of the request, counted from 1.
    pub serial: u64,
    /// Time of the request.
    pub asked: Instant,
    /// Scene to render.
    pub scene: Arc<Scene>,
    /// Width and height at full resolution, pixels. They replace the scene's own.
    pub size: [u32; 2],
    /// Samples per pixel to refine to.
    pub samples: u32,
    /// The layer to show.
    pub layer: Layer,
}

/// A picture to render and write to files.
pub struct Export {
    /// The scene, with the picture's size and samples.
    pub scene: Scene,
    /// Files to write; their extensions choose the formats.
    pub paths: Vec<PathBuf>,
    /// Whether existing files are replaced even if they are no pictures.
    pub overwrite: bool,
    /// Depth of developed pictures.
    pub depth: Depth,
}

/// A picture for the window.
pub struct Picture {
    /// Number of its request.
    pub serial: u64,
    /// Time of its request.
    pub asked: Instant,
    /// The requested scene.
    pub requested: Arc<Scene>,
    /// The scene with the picture's size and exposure.
    pub scene: Arc<Scene>,
    /// The scene's volumes.
    pub volumes: Arc<Vec<VolumeTexture>>,
    /// The scene's opaque mesh.
    pub mesh: Mesh,
    /// The rendered frame.
    pub frame: Arc<Frame>,
    /// The requested layer as it is shown.
    pub image: Arc<egui::ColorImage>,
    /// The requested layer.
    pub layer: Layer,
    /// Meaning of the image's colours.
    pub legend: Legend,
    /// Pixels of the viewport per pixel of the picture, along one side.
    pub scale: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Whether this is the request's first picture.
    pub first: bool,
    /// Most expensive work that was needed before rendering.
    pub cost: Cost,
}

/// Work in progress on the render thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Busy {
    /// Kind of work: `curves`, `exposure`, `preview`, `refining` or `export`.
    pub what: &'static str,
    /// Finished share, 0 to 1.
    pub share: f32,
}

/// A message for the user.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Severity.
    pub kind: MessageKind,
    /// Text that says what happened and what to do.
    pub text: String,
}

/// Severity of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageKind {
    /// Work was done.
    Note,
    /// Something went wrong, and the work continues.
    Warning,
    /// Something failed.
    Error,
}

/// State of the render thread, as the window reads it.
#[derive(Default)]
pub struct State {
    /// Description of the engine in one line. Empty until the engine is open.
    pub engine: String,
    /// The newest picture.
    pub picture: Option<Arc<Picture>>,
    /// Work in progress. `None` while there is nothing to do.
    pub busy: Option<Busy>,
    /// New messages, oldest first.
    pub messages: Vec<Message>,
    /// Number of the last request that was finished, abandoned or failed.
    pub settled: u64,
    /// Why the last request could not be rendered.
    pub fault: Option<String>,
    /// Time that the last volume took to build or read, seconds.
    pub volume_seconds: f64,
    /// Number of samples of full-size pictures taken, by which tests see what is taken twice.
    pub samples_taken: u64,
    /// Number of devices lost.
    pub devices_lost: usize,
    /// Number of exports that ended, successfully or not.
    pub exports_done: usize,
}

/// Work that waits for the render thread.
#[derive(Default)]
struct Queue {
    /// The latest request of the window.
    view: Option<Request>,
    exports: VecDeque<Export>,
    lose_device: bool,
    quit: bool,
}

/// State shared between the window's thread and the render thread.
struct Shared {
    queue: Mutex<Queue>,
    /// Signalled when the queue changes.
    queue_changed: Condvar,
    /// Number of the newest request.
    newest: AtomicU64,
    /// Requests up to this number are not refined further.
    stopped: AtomicU64,
    cancel_export: AtomicBool,
    quit: AtomicBool,
    state: Mutex<State>,
    /// Called when there is something new to show.
    wake: Box<dyn Fn() + Send + Sync>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // The data stays valid when a thread panics: a picture is stored only when it is complete.
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}

/// The window's side of the render thread.
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts the render thread, which opens the engine. The first scene's volume and mesh may come from
    /// `cache`. `memory` is the budget in bytes. `wake` is called when there is something new to show.
    pub fn new(
        choice: EngineChoice,
        device: DeviceOptions,
        memory: u64,
        cache: Option<Cache>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Worker {
        let shared = Arc::new(Shared {
            queue: Mutex::default(),
            queue_changed: Condvar::new(),
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
            lock(&shared.state).fault = Some(format!("the render thread could not be started: {e}"));
        }
        Worker { shared, thread: thread.ok() }
    }

    /// Requests a picture. It replaces an older request that is still waiting.
    pub fn request(&self, request: Request) {
        self.shared.newest.store(request.serial, Ordering::Relaxed);
        lock(&self.shared.queue).view = Some(request);
        self.shared.queue_changed.notify_one();
    }

    /// Requests an export.
    pub fn export(&self, export: Export) {
        self.shared.cancel_export.store(false, Ordering::Relaxed);
        lock(&self.shared.queue).exports.push_back(export);
        self.shared.queue_changed.notify_one();
    }

    /// Stops refining. The picture in the window stays.
    pub fn stop(&self) {
        self.shared.stopped.store(self.shared.newest.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    /// Cancels the running export and the waiting ones.
    pub fn cancel_exports(&self) {
        lock(&self.shared.queue).exports.clear();
        self.shared.cancel_export.store(true, Ordering::Relaxed);
    }

    /// State of the render thread.
    pub fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.shared.state)
    }

    /// Destroys the renderer's device, as a driver reset would. For tests.
    #[doc(hidden)]
    pub fn lose_device(&self) {
        lock(&self.shared.queue).lose_device = true;
        self.shared.queue_changed.notify_one();
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.shared.quit.store(true, Ordering::Relaxed);
        lock(&self.shared.queue).quit = true;
        self.shared.queue_changed.notify_one();
        if let Some(thread) = self.thread.take() {
            // A panic of the thread was already reported when it happened.
            let _ = thread.join();
        }
    }
}
