//! The viewer: a window in which the user changes parameters and watches the picture follow.
//!
//! Like the command line it is a client of the library, with the same scenes, passes and parameter table.
//! The window's thread never renders. The render thread ([`worker`]) does, and hands over finished pictures.

mod app;
mod canvas;
pub mod curves_panel;
pub mod document;
mod drive;
mod gallery;
pub mod layer_image;
pub mod lights;
pub mod lobes;
pub mod meshes;
pub mod metrics;
mod named;
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

/// Options of the viewer.
#[derive(Clone, Debug)]
pub struct Options {
    /// Name of a preset, or a scene file.
    pub scene: PathBuf,
    /// `--set` arguments. They count as changes to the scene.
    pub sets: Vec<String>,
    /// Memory budget and allowed folders.
    pub limits: Limits,
    /// Graphics API that draws the window.
    pub window: WindowChoice,
    /// The engine that renders.
    pub engine: EngineChoice,
    /// The device on which the engine renders.
    pub device: DeviceOptions,
    /// The settings file. With `None` no settings are kept.
    pub settings: Option<PathBuf>,
    /// Exit code of a received signal, 0 until one arrives. The window closes when it is no longer 0.
    pub signal: Arc<AtomicUsize>,
    /// Closes the window after this time.
    pub exit_after: Option<Duration>,
    /// PNG file of the window's picture, written when `exit_after` has passed.
    pub screenshot: Option<PathBuf>,
    /// Changes parameters by itself, measures how quickly the window answers, then closes it.
    pub measure: bool,
    /// Destroys the window's own device after this time, as a driver reset would. For tests.
    #[doc(hidden)]
    pub lose_window_after: Option<Duration>,
}

/// Most windows opened in one run, so that repeated losses of the window's GPU device end. Each loss takes
/// two attempts: the first window after it closes at once.
const MAX_WINDOWS: usize = 8;

/// Graphics API that draws the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WindowChoice {
    /// Vulkan, Metal or Direct3D on a GPU; OpenGL if these run only in software.
    #[default]
    Auto,
    /// Vulkan, Metal or Direct3D.
    Wgpu,
    /// OpenGL.
    Opengl,
}

impl WindowChoice {
    /// The renderers to try, in order.
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
                    // egui's shader takes four times as long on software Vulkan as on software OpenGL.
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
/// If the scene is not valid, if there is no display or nothing that can draw on it, if a signal ended the
/// viewer, or if the window's GPU device was lost too often.
pub fn run(options: Options) -> Result<metrics::Report> {
    // An invalid scene is reported on the terminal, before a window opens.
    document::Document::open(&options.scene, &options.sets, &options.limits)?;
    let measured = metrics::Shared::default();
    let mut handover = None;
    for _ in 0..MAX_WINDOWS {
        handover = open_window(&options, &measured, handover)?;
        let code = options.signal.load(Ordering::Relaxed);
        if code != 0 {
            return Err(Error::Interrupted { code: code as u8 });
        }
        if handover.is_none() {
            return Ok(measured.report());
        }
    }
    Err(Error::DeviceLost(match handover.map(rescue) {
        Some(Ok(path)) => format!("the window failed repeatedly; its scene was saved to {}", path.display()),
        Some(Err(e)) => format!("the window failed repeatedly, and its scene could not be saved: {e}"),
        None => "the window failed repeatedly".into(),
    }))
}

/// Opens one window and runs it until it is closed or lost. Returns what a lost window leaves to the next.
fn open_window(
    options: &Options,
    measured: &metrics::Shared,
    handover: Option<Handover>,
) -> Result<Option<Handover>> {
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
    if let Some(handover) = handover {
        loss.hand_over(handover);
    }
    let mut opened = Ok(Ok(()));
    let mut first_fault = None;
    for renderer in options.window.renderers() {
        let (loss_of_window, options, measured) = (loss.clone(), options.clone(), measured.clone());
        let create: eframe::AppCreator = Box::new(move |context| {
            wake_on_signal(&options.signal, &context.egui_ctx);
            if let Some(state) = &context.wgpu_render_state {
                loss_of_window.watch(&state.device, &context.egui_ctx);
            }
            Ok(Box::new(Viewer::new(&context.egui_ctx, options, measured, loss_of_window)?))
        });
        let viewport = viewport.clone();
        let native = NativeOptions {
            viewport,
            renderer,
            persist_window: false,
            dithering: false,
            ..Default::default()
        };
        // Drawing with a lost device panics inside egui's renderer. The event loop that this panic unwinds
        // still counts the window as open: the next call of `run_native` returns at once, the call after it
        // opens a window. The handover waits in `loss` meanwhile.
        let run = AssertUnwindSafe(|| eframe::run_native("taki", native, create));
        opened = loss.hush_panics(|| std::panic::catch_unwind(run));
        match &opened {
            // Another renderer may work. If none does, the error of the first is reported.
            Ok(Err(e)) => first_fault = first_fault.or_else(|| Some(cause(e))),
            _ => break,
        }
    }
    match opened {
        Ok(Ok(())) => Ok(loss.take_handover()),
        Ok(Err(e)) => Err(Error::NoWindow(first_fault.unwrap_or_else(|| cause(&e)))),
        Err(panic) => match loss.take_handover() {
            Some(handover) => {
                if handover.device_lost {
                    eprintln!("taki: warning: the window's GPU device was lost; the window is reopened");
                }
                Ok(Some(handover))
            }
            None => std::panic::resume_unwind(panic),
        },
    }
}

/// Wakes the window when a signal arrives: a window at rest runs no frames and would not notice it.
fn wake_on_signal(signal: &Arc<AtomicUsize>, ctx: &egui::Context) {
    let (signal, ctx) = (signal.clone(), ctx.clone());
    let watch = move || {
        while signal.load(Ordering::Relaxed) == 0 {
            std::thread::sleep(Duration::from_millis(100));
        }
        ctx.request_repaint();
    };
    // Without the thread a signal is noticed at the next input.
    let _ = std::thread::Builder::new().name("signals".into()).spawn(watch);
}

/// Last part of an error's text. The parts before it name the library code that passed the error on.
fn cause(e: &eframe::Error) -> String {
    let text = e.to_string();
    text.rsplit(": ").next().unwrap_or(&text).trim_end_matches('.').to_owned()
}

/// Saves the scene of a window that could not be reopened. Returns the file.
fn rescue(mut handover: Handover) -> Result<PathBuf> {
    let path = std::env::temp_dir().join(format!("{}-rescued.toml", handover.document.name));
    handover.document.save(&path)?;
    Ok(path)
}

/// State that a lost window leaves to the window opened after it.
#[derive(Clone)]
struct Handover {
    document: document::Document,
    /// Whether the window's device was lost. Otherwise a bug ended the window.
    device_lost: bool,
}

/// Watches for the loss of the window's own device, and carries the scene to the next window.
#[derive(Clone, Default)]
pub struct Loss {
    lost: Arc<AtomicBool>,
    device: Arc<Mutex<Option<wgpu::Device>>>,
    /// Set when a window is lost, until the next window takes it.
    handover: Arc<Mutex<Option<Handover>>>,
}

impl Loss {
    /// Records when `device` is lost. Without these callbacks wgpu would end the process.
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

    /// Runs `run` without printing the panics that follow the loss of the device: they are expected.
    fn hush_panics<T>(&self, run: impl FnOnce() -> T) -> T {
        let usual: Arc<dyn Fn(&PanicHookInfo) + Send + Sync> = std::panic::take_hook().into();
        let (loss, inner) = (self.clone(), usual.clone());
        std::panic::set_hook(Box::new(move |info| {
            loss.poll_device();
            if !loss.happened() {
                inner(info);
            }
        }));
        let result = run();
        std::panic::set_hook(Box::new(move |info| usual(info)));
        result
    }

    /// Polls the device, so that a lost one calls its callback. A lost device refuses work before it reports
    /// its loss.
    fn poll_device(&self) {
        if let Some(device) = &*self.device.lock().unwrap_or_else(|e| e.into_inner()) {
            // The callback reports a loss, so the result is not needed.
            let _ = device.poll(wgpu::PollType::Poll);
        }
    }

    fn happened(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    fn hand_over(&self, handover: Handover) {
        *self.handover.lock().unwrap_or_else(|e| e.into_inner()) = Some(handover);
    }

    fn take_handover(&self) -> Option<Handover> {
        self.handover.lock().unwrap_or_else(|e| e.into_inner()).take()
    }
}
