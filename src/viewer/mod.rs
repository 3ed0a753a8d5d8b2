//! The viewer: a window in which parameters are turned and the picture follows.
//!
//! A client of the library like the command line: the same scenes, passes and parameter table. The window's
//! thread never renders; [`worker`] does, and hands over finished pictures.

mod app;
pub mod curves_panel;
pub mod document;
mod drive;
mod gallery;
pub mod layer_image;
pub mod lights;
pub mod lobes;
pub mod metrics;
pub mod navigate;
pub mod parameters;
mod probe;
pub mod ray_panel;
pub mod settings;
mod transfer;
mod viewport;
pub mod volume_panel;
pub mod worker;

use std::panic::{AssertUnwindSafe, PanicHookInfo};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use eframe::{NativeOptions, Renderer, egui};

pub use app::Viewer;

use crate::engine::EngineChoice;
use crate::engine::gpu::{DeviceOptions, adapters};
use crate::scene::Limits;
use crate::util::error::{Error, Result};

/// How to open the viewer.
#[derive(Clone, Debug)]
pub struct Options {
    /// A preset or a scene file.
    pub scene: PathBuf,
    /// `--set`s; they count as changes to the scene.
    pub sets: Vec<String>,
    /// Memory budget and allowed folders.
    pub limits: Limits,
    /// What draws the window.
    pub window: WindowChoice,
    /// Which engine renders.
    pub engine: EngineChoice,
    /// On which device.
    pub device: DeviceOptions,
    /// The settings file; none keeps nothing.
    pub settings: Option<PathBuf>,
    /// Closes the window once this is not 0: the exit code of a signal that came.
    pub signal: Arc<AtomicUsize>,
    /// Closes the window after this time.
    pub exit_after: Option<Duration>,
    /// Where the window's picture is written before it closes.
    pub screenshot: Option<PathBuf>,
    /// Drives itself through changes, measures how quickly the window answers, and closes it.
    pub measure: bool,
    /// Takes the window's own device away after this time, as a driver's reset does. For tests.
    #[doc(hidden)]
    pub lose_window_after: Option<Duration>,
}

/// The window is opened anew after its own GPU device was lost, but not for ever. A loss takes two tries.
const MAX_WINDOWS: usize = 8;

/// What draws the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WindowChoice {
    /// Vulkan, Metal or Direct3D on a GPU; OpenGL where they would be software.
    #[default]
    Auto,
    /// Vulkan, Metal or Direct3D.
    Wgpu,
    /// OpenGL.
    Opengl,
}

impl WindowChoice {
    /// In the order to try them.
    fn renderers(self) -> Vec<Renderer> {
        match self {
            WindowChoice::Wgpu => vec![Renderer::Wgpu],
            WindowChoice::Opengl => vec![Renderer::Glow],
            WindowChoice::Auto => {
                let software = |a: &wgpu::Adapter| a.get_info().device_type == wgpu::DeviceType::Cpu;
                let adapters = adapters();
                if adapters.is_empty() {
                    vec![Renderer::Glow]
                } else if adapters.iter().all(software) {
                    // egui's shader takes software Vulkan four times as long as the one for OpenGL.
                    vec![Renderer::Glow, Renderer::Wgpu]
                } else {
                    vec![Renderer::Wgpu, Renderer::Glow]
                }
            }
        }
    }
}

/// Opens the window and returns when it is closed.
///
/// # Errors
/// If the scene is not valid, or there is no display or nothing that can draw on it.
pub fn run(options: Options) -> Result<metrics::Report> {
    // A wrong scene is told on the terminal, before any window.
    document::Document::open(&options.scene, &options.sets, &options.limits)?;
    let measured = metrics::Shared::default();
    let mut kept = None;
    for _ in 0..MAX_WINDOWS {
        kept = open_window(&options, &measured, kept)?;
        let code = options.signal.load(Ordering::Relaxed);
        if code != 0 {
            return Err(Error::Interrupted { code: code as u8 });
        }
        if kept.is_none() {
            return Ok(measured.report());
        }
    }
    Err(Error::DeviceLost(match kept.map(rescue) {
        Some(Ok(path)) => format!("the window was lost again and again; its scene is in {}", path.display()),
        Some(Err(e)) => format!("the window was lost again and again, and its scene was not kept: {e}"),
        None => "the window was lost again and again".into(),
    }))
}

/// One window, until it is closed or its device is lost; then what is to be kept.
fn open_window(options: &Options, measured: &metrics::Shared, kept: Option<Kept>) -> Result<Option<Kept>> {
    let (settings, _) = settings::Settings::load(options.settings.as_deref());
    let mut viewport = egui::ViewportBuilder::default()
        .with_title("taki")
        .with_app_id("taki")
        .with_inner_size(settings.window.unwrap_or([1660.0, 900.0]))
        .with_min_inner_size([760.0, 480.0])
        .with_drag_and_drop(true);
    if let Some(position) = settings.position {
        viewport = viewport.with_position(position);
    }
    let loss = Loss::default();
    if let Some(kept) = kept {
        loss.keep(kept);
    }
    let mut opened = Ok(Ok(()));
    let mut first_fault = None;
    for renderer in options.window.renderers() {
        let (seen, options, measured) = (loss.clone(), options.clone(), measured.clone());
        let create: eframe::AppCreator = Box::new(move |context| {
            wake_on_signal(&options.signal, &context.egui_ctx);
            if let Some(state) = &context.wgpu_render_state {
                seen.watch(&state.device, &context.egui_ctx);
            }
            Ok(Box::new(Viewer::new(&context.egui_ctx, options, measured, seen)?))
        });
        let viewport = viewport.clone();
        let native = NativeOptions {
            viewport,
            renderer,
            persist_window: false,
            dithering: false,
            ..Default::default()
        };
        // Drawing with a lost device ends in a panic inside egui's renderer. The event loop that it went
        // through takes the next window for one that is open already and ends at once; the one after that
        // opens. What is kept waits meanwhile.
        let run = AssertUnwindSafe(|| eframe::run_native("taki", native, create));
        opened = loss.without_noise(|| std::panic::catch_unwind(run));
        match &opened {
            // The next way to draw may do; what keeps all of them from it is told by the first.
            Ok(Err(e)) => first_fault = first_fault.or_else(|| Some(cause(e))),
            _ => break,
        }
    }
    match opened {
        Ok(Ok(())) => Ok(loss.take()),
        Ok(Err(e)) => Err(Error::NoWindow(first_fault.unwrap_or_else(|| cause(&e)))),
        Err(panic) => match loss.take() {
            Some(kept) => {
                if kept.device_lost {
                    eprintln!("taki: warning: the window's GPU device was lost; the window is opened anew");
                }
                Ok(Some(kept))
            }
            None => std::panic::resume_unwind(panic),
        },
    }
}

/// A window at rest draws nothing and notices nothing: a signal wakes it.
fn wake_on_signal(signal: &Arc<AtomicUsize>, ctx: &egui::Context) {
    let (signal, ctx) = (signal.clone(), ctx.clone());
    let watch = move || {
        while signal.load(Ordering::Relaxed) == 0 {
            std::thread::sleep(Duration::from_millis(100));
        }
        ctx.request_repaint();
    };
    // Without the thread a signal is noticed when the mouse moves.
    let _ = std::thread::Builder::new().name("signals".into()).spawn(watch);
}

/// The last part of an error: before it stand the places in libraries that it came through.
fn cause(e: &eframe::Error) -> String {
    let text = e.to_string();
    text.rsplit(": ").next().unwrap_or(&text).trim_end_matches('.').to_owned()
}

/// Saves what no window could show any more.
fn rescue(mut kept: Kept) -> Result<PathBuf> {
    let path = std::env::temp_dir().join(format!("{}-rescued.toml", kept.document.name));
    kept.document.save(&path)?;
    Ok(path)
}

/// What outlives a window that was lost.
#[derive(Clone)]
pub struct Kept {
    document: document::Document,
    /// Whether its device was lost; else a bug ended it.
    device_lost: bool,
}

/// The loss of the window's own device, and what was kept.
#[derive(Clone, Default)]
pub struct Loss {
    lost: Arc<AtomicBool>,
    device: Arc<Mutex<Option<wgpu::Device>>>,
    /// Until the next window takes it.
    kept: Arc<Mutex<Option<Kept>>>,
}

impl Loss {
    /// Notes when `device` is lost, in place of wgpu's own way of ending the process.
    fn watch(&self, device: &wgpu::Device, ctx: &egui::Context) {
        let note = |lost: &Arc<AtomicBool>| {
            let (lost, ctx) = (lost.clone(), ctx.clone());
            move || {
                lost.store(true, Ordering::Relaxed);
                ctx.request_repaint();
            }
        };
        let (on_loss, on_error) = (note(&self.lost), note(&self.lost));
        *self.device.lock().unwrap_or_else(|e| e.into_inner()) = Some(device.clone());
        device.set_device_lost_callback(move |_, _| on_loss());
        device.on_uncaptured_error(Arc::new(move |_| on_error()));
    }

    /// Runs something whose panics are expected, and not printed, once the device is lost.
    fn without_noise<T>(&self, run: impl FnOnce() -> T) -> T {
        let usual: Arc<dyn Fn(&PanicHookInfo) + Send + Sync> = std::panic::take_hook().into();
        let (loss, inner) = (self.clone(), usual.clone());
        std::panic::set_hook(Box::new(move |info| {
            loss.ask_device();
            if !loss.happened() {
                inner(info);
            }
        }));
        let result = run();
        std::panic::set_hook(Box::new(move |info| usual(info)));
        result
    }

    /// Lets a lost device tell of its loss: it does so when it is polled, but refuses work before.
    fn ask_device(&self) {
        if let Some(device) = &*self.device.lock().unwrap_or_else(|e| e.into_inner()) {
            // Its own answer is what the callback says.
            let _ = device.poll(wgpu::PollType::Poll);
        }
    }

    fn happened(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    fn keep(&self, kept: Kept) {
        *self.kept.lock().unwrap_or_else(|e| e.into_inner()) = Some(kept);
    }

    fn take(&self) -> Option<Kept> {
        self.kept.lock().unwrap_or_else(|e| e.into_inner()).take()
    }
}
