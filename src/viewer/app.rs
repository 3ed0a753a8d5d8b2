//! The window: menus, panels and status bar around the picture, and their requests to the render thread.

mod input;
mod life;
mod panels;
mod pictures;
mod scenes;
mod windows;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use eframe::egui;
use egui::Ui;

use super::curves_panel::CurvesPanel;
use super::document::Document;
use super::drive::Drive;
use super::gallery::Gallery;
use super::lights::Lights;
use super::meshes::Meshes;
use super::navigate::Pose;
use super::parameters::{Costs, ParameterPanel};
use super::probe::Probe;
use super::settings::{Settings, Theme};
use super::transfer::{ExportDialog, PathDialog};
use super::viewport::{Selection, Tool};
use super::volume_panel::VolumePanel;
use super::worker::{Busy, Message, MessageKind, Picture, Worker};
use super::{Handover, Loss, Options, metrics};
use crate::engine::cpu::ray::RayReport;
use crate::picture::Layer;
use crate::scene::Scene;
use crate::util::error::Result;

/// The inspectors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Inspector {
    /// The ray of one pixel.
    #[default]
    Pixel,
    /// The volume's cells.
    Volume,
    /// The curves that the volume was built from.
    Curves,
}

/// Gestures that drag the handle of a light and that of a mesh.
const LIGHT: &str = "light";
const MESH: &str = "mesh";

/// An action that would lose unsaved changes, so that the user is asked first.
#[derive(Clone, Debug, PartialEq)]
enum Leaving {
    Close,
    Open(PathBuf),
}

/// The application.
pub struct Viewer {
    options: Options,
    document: Document,
    worker: Worker,
    settings: Settings,
    measured: metrics::Shared,
    loss: Loss,

    parameters: ParameterPanel,
    lights: Lights,
    meshes: Meshes,
    /// The light that was selected in the last frame.
    last_light: Option<String>,
    volume_panel: VolumePanel,
    /// Name of the volume that the inspectors show.
    inspected_volume: String,
    curves_panel: CurvesPanel,
    gallery: Gallery,
    paths: PathDialog,
    export: ExportDialog,
    exporting: bool,
    exports_done: usize,
    help: bool,
    leaving: Option<Leaving>,
    /// The action to take once the scene is saved.
    leave_after_save: Option<Leaving>,
    closing: bool,

    tool: Tool,
    layer: Layer,
    inspector: Inspector,
    /// The inspected position in the image, 0 to 1.
    marked: Option<[f32; 2]>,
    /// The ray through `marked`.
    ray: Option<RayReport>,
    probe: Probe,
    playing: bool,
    /// When the playing water was last moved.
    last_flow: Option<Instant>,
    /// The camera when the scene was opened.
    first_pose: Pose,

    /// Number of the last request.
    serial: u64,
    /// The last request: scene, size in pixels, samples, layer.
    asked: Option<(Arc<Scene>, [u32; 2], u32, Layer)>,
    picture: Option<Arc<Picture>>,
    texture: Option<egui::TextureHandle>,
    busy: Option<Busy>,
    banners: Vec<(Message, Instant)>,
    fault: Option<String>,
    engine: String,
    last_frame: Option<Instant>,
    drive: Option<Drive>,
    opened: Instant,
    screenshot: Screenshot,
    title: String,
}

/// State of the screenshot that is taken before the window closes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Screenshot {
    NotRequested,
    Requested,
    Done,
}

impl Viewer {
    /// Creates a viewer in a window's context. Continues with the scene that a lost window left in `loss`.
    ///
    /// # Errors
    /// If the scene cannot be opened.
    pub fn new(
        ctx: &egui::Context,
        mut options: Options,
        measured: metrics::Shared,
        loss: Loss,
    ) -> Result<Viewer> {
        let (mut settings, note) = Settings::load(options.settings.as_deref());
        let handover = loss.take_handover();
        let lost_before = handover.as_ref().map(|handover| handover.device_lost);
        if lost_before.is_some() {
            options.lose_window_after = None;
        }
        let document = match handover {
            Some(handover) => handover.document,
            None => Document::open(&options.scene, &options.sets, &options.limits)?,
        };
        if let Some(path) = &document.path {
            settings.remember(path);
        }
        let wake = ctx.clone();
        let worker = Worker::new(
            options.engine,
            options.device.clone(),
            options.limits.memory,
            options.limits.cache.clone(),
            move || {
                wake.request_repaint();
            },
        );
        ctx.set_theme(preference(settings.theme));
        ctx.set_zoom_factor(settings.zoom);
        // egui's own weak text is too faint to read.
        ctx.all_styles_mut(|style| style.visuals.weak_text_alpha = 0.8);
        let first_pose = document.pose();
        let mut viewer = Viewer {
            drive: options.measure.then(Drive::new),
            options,
            document,
            worker,
            settings,
            measured,
            loss,
            parameters: ParameterPanel::default(),
            lights: Lights::default(),
            meshes: Meshes::default(),
            last_light: None,
            volume_panel: VolumePanel::default(),
            inspected_volume: String::new(),
            curves_panel: CurvesPanel::default(),
            gallery: Gallery::default(),
            paths: PathDialog::default(),
            export: ExportDialog::default(),
            exporting: false,
            exports_done: 0,
            help: false,
            leaving: None,
            leave_after_save: None,
            closing: false,
            tool: Tool::default(),
            layer: Layer::Rgb,
            inspector: Inspector::default(),
            marked: None,
            ray: None,
            probe: Probe::default(),
            playing: false,
            last_flow: None,
            first_pose,
            serial: 0,
            asked: None,
            picture: None,
            texture: None,
            busy: None,
            banners: Vec::new(),
            fault: None,
            engine: String::new(),
            last_frame: None,
            opened: Instant::now(),
            screenshot: Screenshot::NotRequested,
            title: String::new(),
        };
        if let Some(note) = note {
            viewer.say(MessageKind::Warning, note);
        }
        if let Some(device_lost) = lost_before {
            let why = if device_lost { "the window's GPU device was lost" } else { "a bug ended the window" };
            let text = format!("{why}; the window was reopened with the scene and its history");
            viewer.say(MessageKind::Warning, text);
        }
        Ok(viewer)
    }

    /// The scene being edited.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// The scene being edited.
    pub fn document_mut(&mut self) -> &mut Document {
        &mut self.document
    }

    /// The render thread.
    pub fn worker(&self) -> &Worker {
        &self.worker
    }

    /// The picture in the window.
    pub fn picture(&self) -> Option<&Arc<Picture>> {
        self.picture.as_ref()
    }

    /// Whether the last request is finished, and no ray is being traced.
    pub fn is_settled(&self) -> bool {
        if self.probe.is_busy() {
            return false;
        }
        let settled = self.worker.state().settled;
        let shown = self.picture.as_ref().is_some_and(|p| p.serial == self.serial);
        self.asked.is_some() && settled >= self.serial && (shown || self.fault.is_some())
    }

    /// Whether the picture in the window shows the latest change.
    pub fn shows_latest(&self) -> bool {
        self.picture
            .as_ref()
            .is_some_and(|p| p.serial == self.serial && Arc::ptr_eq(&p.requested, self.document.scene()))
    }

    /// The inspected ray.
    pub fn ray(&self) -> Option<&RayReport> {
        self.ray.as_ref()
    }

    /// Shows a banner. A banner with the same message moves to the end instead.
    fn say(&mut self, kind: MessageKind, text: impl Into<String>) {
        let message = Message { kind, text: text.into() };
        self.banners.retain(|(known, _)| *known != message);
        self.banners.push((message, Instant::now()));
    }

    /// Shows the error, if there is one.
    fn report(&mut self, result: Result<()>) {
        if let Err(e) = result {
            self.say(MessageKind::Error, e.to_string());
        }
    }
}

fn preference(theme: Theme) -> egui::ThemePreference {
    match theme {
        Theme::System => egui::ThemePreference::System,
        Theme::Light => egui::ThemePreference::Light,
        Theme::Dark => egui::ThemePreference::Dark,
    }
}

impl eframe::App for Viewer {
    fn ui(&mut self, ui: &mut Ui, frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        let now = Instant::now();
        let continuous = self.drive.as_ref().is_some_and(Drive::draws_continuously);
        let interval = self.last_frame.take().map(|last| (now - last).as_secs_f64());
        self.measured.frame(frame.info().cpu_usage, interval);
        self.last_frame = (continuous && !self.is_settled()).then_some(now);
        self.show(ui);
        self.measure(&ctx);
        if self.options.lose_window_after.is_some_and(|after| self.opened.elapsed() > after)
            && let Some(state) = frame.wgpu_render_state()
        {
            self.options.lose_window_after = None;
            state.device.destroy();
        }
    }
}

impl Viewer {
    /// Runs one frame of the window.
    pub fn show(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        self.receive(&ctx);
        self.shortcuts(&ctx);
        let dropped: Vec<PathBuf> =
            ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect());
        self.drop_files(&dropped);
        self.play(&ctx);
        self.lights.follow(self.document.values());
        self.meshes.follow(self.document.values());
        self.select_one();

        egui::Panel::top("menus").show(ui, |ui| self.menus(ui));
        egui::Panel::top("toolbar").show(ui, |ui| self.toolbar(ui));
        egui::Panel::bottom("status").show(ui, |ui| self.status(ui));
        if self.settings.parameters {
            let costs = Costs { volume_seconds: self.worker.state().volume_seconds };
            egui::Panel::left("parameters").default_size(340.0).size_range(280.0..=560.0).show(ui, |ui| {
                ui.add_space(4.0);
                let selection = Selection { lights: &mut self.lights, meshes: &mut self.meshes };
                self.parameters.show(ui, &mut self.document, selection, costs);
            });
        }
        if self.settings.inspectors {
            // In a small window, leaves room for the picture.
            let most = (ui.available_width() * 0.55).max(200.0);
            egui::Panel::right("inspectors").default_size(480.0).size_range(200.0..=most).show(ui, |ui| {
                ui.add_space(4.0);
                self.inspectors(ui);
            });
        }
        let central = egui::CentralPanel::no_frame().show(ui, |ui| self.viewport(ui));
        self.show_banners(&ctx, central.response.rect);
        self.windows(&ctx);
        self.lifecycle(&ctx);
        // egui spreads one step of the wheel over several frames.
        let moving =
            |i: &egui::InputState| i.pointer.any_down() || i.smooth_scroll_delta() != egui::Vec2::ZERO;
        if !ctx.input(moving) {
            self.document.end_gesture();
        }
    }

    /// Continues `--measure`, and closes the window at its end.
    fn measure(&mut self, ctx: &egui::Context) {
        let Some(mut drive) = self.drive.take() else { return };
        match drive.step(self, ctx) {
            Ok(false) => self.drive = Some(drive),
            Ok(true) => self.closing = true,
            Err(e) => {
                eprintln!("taki: error: {e}");
                self.closing = true;
            }
        }
        if self.closing {
            ctx.request_repaint();
        }
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let device_lost = self.loss.happened();
            self.loss.hand_over(Handover { document: self.document.clone(), device_lost });
        }
        if let Some(path) = &self.options.settings
            && let Err(e) = self.settings.save(path)
        {
            eprintln!("taki: warning: the viewer's settings could not be saved: {e}");
        }
    }
}
