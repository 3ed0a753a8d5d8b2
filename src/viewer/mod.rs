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
pub mod metrics;
mod navigate;
pub mod parameters;
pub mod ray_panel;
pub mod settings;
mod transfer;
mod viewport;
pub mod volume_panel;
pub mod worker;

use std::path::PathBuf;
use std::time::Duration;

use eframe::{NativeOptions, Renderer, egui};

pub use app::Viewer;

use crate::error::{Error, Result};
use crate::gpu::{DeviceOptions, adapters};
use crate::job::EngineChoice;
use crate::scene::Limits;

/// How to open the viewer.
#[derive(Clone, Debug)]
pub struct Options {
    /// A preset or a scene file.
    pub scene: PathBuf,
    /// `--set`s; they count as changes to the scene.
    pub sets: Vec<String>,
    /// Memory budget and allowed folders.
    pub limits: Limits,
    /// Which engine renders.
    pub engine: EngineChoice,
    /// On which device.
    pub device: DeviceOptions,
    /// The settings file; none keeps nothing.
    pub settings: Option<PathBuf>,
    /// Closes the window after this time.
    pub exit_after: Option<Duration>,
    /// Where the window's picture is written before it closes.
    pub screenshot: Option<PathBuf>,
    /// Drives itself through changes, measures how quickly the window answers, and closes it.
    pub measure: bool,
}

/// Opens the window and returns when it is closed.
///
/// # Errors
/// If the scene is not valid, or there is no display or nothing that can draw on it.
pub fn run(options: Options) -> Result<metrics::Report> {
    // A wrong scene is told on the terminal, before any window.
    document::Document::open(&options.scene, &options.sets, &options.limits)?;
    let (settings, _) = settings::Settings::load(options.settings.as_deref());
    let mut viewport = egui::ViewportBuilder::default()
        .with_title("taki")
        .with_app_id("taki")
        .with_inner_size(settings.window.unwrap_or([1660.0, 900.0]))
        .with_min_inner_size([480.0, 320.0])
        .with_drag_and_drop(true);
    if let Some(position) = settings.position {
        viewport = viewport.with_position(position);
    }
    // The window needs something to draw with even where the CPU renders: Vulkan, Metal or Direct3D, else
    // OpenGL.
    let renderer = if adapters().is_empty() { Renderer::Glow } else { Renderer::Wgpu };
    let native =
        NativeOptions { viewport, renderer, persist_window: false, dithering: false, ..Default::default() };
    let report = metrics::Shared::default();
    let handed = report.clone();
    let opened = eframe::run_native(
        "taki",
        native,
        Box::new(move |context| {
            let viewer = Viewer::new(&context.egui_ctx, options, handed)?;
            Ok(Box::new(viewer))
        }),
    );
    opened.map_err(|e| Error::NoAdapter(format!("no window could be opened ({e})")))?;
    Ok(report.report())
}
