//! The window: menus, panels and status around the picture, and what they ask of the renderer.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use eframe::egui;
use egui::{Key, KeyboardShortcut, Modifiers, RichText, Ui};

use super::curves_panel::CurvesPanel;
use super::document::Document;
use super::drive::Drive;
use super::gallery::Gallery;
use super::layer_image::show_legend;
use super::metrics;
use super::navigate::Pose;
use super::parameters::{Costs, ParameterPanel, cost_color, name};
use super::probe::{Aim, Probe};
use super::settings::{Settings, Theme};
use super::transfer::{ExportAnswer, ExportDialog, PathDialog, Purpose, UnsavedAnswer, ask_unsaved};
use super::viewport::{self, Shown, Tool};
use super::volume_panel::VolumePanel;
use super::worker::{Busy, Export, Message, MessageKind, Picture, Request, Worker};
use super::{Kept, Loss, Options, ray_panel};
use crate::cpu::ray::RayReport;
use crate::error::{Error, Result, human_bytes};
use crate::frame::Layer;
use crate::scene::{Raw, Scene};

/// Messages shown at once; more are counted.
const MAX_BANNERS: usize = 4;
/// Notes vanish after this time, warnings and errors stay until they are closed.
const NOTE_TIME: Duration = Duration::from_secs(8);

/// The inspectors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Inspector {
    /// The ray of one pixel.
    #[default]
    Pixel,
    /// The volume's cells.
    Volume,
    /// The curves it was built from.
    Curves,
}

/// What is asked before something would be lost.
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
    volume_panel: VolumePanel,
    curves_panel: CurvesPanel,
    gallery: Gallery,
    paths: PathDialog,
    export: ExportDialog,
    exporting: bool,
    exports_done: usize,
    help: bool,
    leaving: Option<Leaving>,
    /// Leave once the save that is asked for is done.
    leave_after_save: Option<Leaving>,
    closing: bool,

    tool: Tool,
    layer: Layer,
    inspector: Inspector,
    /// The inspected place in the image, and its ray.
    marked: Option<[f32; 2]>,
    ray: Option<RayReport>,
    probe: Probe,
    playing: bool,
    /// When the water was moved last.
    flowed: Option<Instant>,
    /// The camera as the scene was opened.
    first_pose: Pose,

    serial: u64,
    /// What was asked for last: scene, size, samples, layer.
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
    shot: Shot,
    title: String,
}

/// The way of the screenshot before the window closes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shot {
    NotYet,
    Asked,
    Done,
}

impl Viewer {
    /// A viewer in a window's context, with what an earlier window left in `loss`.
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
        let kept = loss.take();
        let again = kept.as_ref().map(|kept| kept.device_lost);
        if again.is_some() {
            options.lose_window_after = None;
        }
        let document = match kept {
            Some(kept) => kept.document,
            None => Document::open(&options.scene, &options.sets, &options.limits)?,
        };
        if let Some(path) = &document.path {
            settings.remember(path);
        }
        let wake = ctx.clone();
        let worker = Worker::new(options.engine, options.device.clone(), options.limits.memory, move || {
            wake.request_repaint();
        });
        ctx.set_theme(preference(settings.theme));
        ctx.set_zoom_factor(settings.zoom);
        // Weak text is to be read too.
        ctx.all_styles_mut(|style| style.visuals.weak_text_alpha = 0.8);
        let first_pose = Pose::of(document.values());
        let mut viewer = Viewer {
            drive: options.measure.then(Drive::new),
            options,
            document,
            worker,
            settings,
            measured,
            loss,
            parameters: ParameterPanel::default(),
            volume_panel: VolumePanel::default(),
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
            flowed: None,
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
            shot: Shot::NotYet,
            title: String::new(),
        };
        if let Some(note) = note {
            viewer.say(MessageKind::Warning, note);
        }
        if let Some(device_lost) = again {
            let why = if device_lost { "the window's GPU device was lost" } else { "a bug ended the window" };
            let text = format!("{why}; it was opened anew with all of the scene");
            viewer.say(MessageKind::Warning, text);
        }
        Ok(viewer)
    }

    /// The scene under edit.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// The scene under edit.
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

    /// Whether everything that was asked for is shown.
    pub fn is_settled(&self) -> bool {
        if self.probe.is_busy() {
            return false;
        }
        let settled = self.worker.state().settled;
        let shown = self.picture.as_ref().is_some_and(|p| p.serial == self.serial);
        self.asked.is_some() && settled >= self.serial && (shown || self.fault.is_some())
    }

    /// Whether the picture in the window is of the latest change.
    pub fn shows_latest(&self) -> bool {
        self.picture
            .as_ref()
            .is_some_and(|p| p.serial == self.serial && Arc::ptr_eq(&p.of, self.document.scene()))
    }

    /// The ray that is inspected.
    pub fn ray(&self) -> Option<&RayReport> {
        self.ray.as_ref()
    }

    fn say(&mut self, kind: MessageKind, text: impl Into<String>) {
        let message = Message { kind, text: text.into() };
        self.banners.retain(|(known, _)| *known != message);
        self.banners.push((message, Instant::now()));
    }

    /// Tells of a failure, if there was one.
    fn tell(&mut self, result: Result<()>) {
        if let Err(e) = result {
            self.say(MessageKind::Error, e.to_string());
        }
    }

    // ---- Pictures -------------------------------------------------------------------------------------

    fn receive(&mut self, ctx: &egui::Context) {
        let (picture, messages, exports_done) = {
            let mut state = self.worker.state();
            self.busy = state.busy;
            if self.engine != state.engine {
                self.engine = state.engine.clone();
            }
            self.fault = state.fault.clone();
            (state.picture.clone(), std::mem::take(&mut state.messages), state.exports_done)
        };
        for message in messages {
            self.say(message.kind, message.text);
        }
        if exports_done != self.exports_done {
            self.exports_done = exports_done;
            self.exporting = false;
        }
        let Some(picture) = picture else { return };
        if self.picture.as_ref().is_some_and(|old| Arc::ptr_eq(old, &picture)) {
            return;
        }
        let image = picture.image.clone();
        // Between two quads or two depths there is nothing.
        let smooth = match picture.layer {
            Layer::Rgb => egui::TextureOptions::LINEAR,
            _ => egui::TextureOptions::NEAREST,
        };
        match &mut self.texture {
            Some(texture) => texture.set(image, smooth),
            None => self.texture = Some(ctx.load_texture("picture", image, smooth)),
        }
        if picture.first {
            // The next frame knows that this one was drawn.
            ctx.request_repaint();
        }
        self.measured.picture(picture.first.then_some(picture.asked), picture.cost);
        self.picture = Some(picture);
        self.inspect_again();
    }

    /// Asks for what the window shows now, if that is something new.
    fn request(&mut self, size: [u32; 2]) {
        if size.contains(&0) {
            return;
        }
        let scene = self.document.scene();
        let samples = scene.image.samples.max(self.settings.refine_to);
        let same = self.asked.as_ref().is_some_and(|(old, old_size, old_samples, old_layer)| {
            Arc::ptr_eq(old, scene) && (*old_size, *old_samples, *old_layer) == (size, samples, self.layer)
        });
        if same {
            return;
        }
        self.serial += 1;
        self.asked = Some((scene.clone(), size, samples, self.layer));
        self.worker.request(Request {
            serial: self.serial,
            asked: Instant::now(),
            scene: scene.clone(),
            size,
            samples,
            layer: self.layer,
        });
    }

    fn inspect_again(&mut self) {
        if let Some(place) = self.marked
            && self.settings.inspectors
            && self.inspector == Inspector::Pixel
        {
            self.ask(Aim::Inspect, place);
        }
    }

    /// Asks for the ray through a place in the image, at full resolution.
    fn ask(&mut self, aim: Aim, place: [f32; 2]) {
        if let (Some(picture), Some((_, size, ..))) = (&self.picture, &self.asked) {
            self.probe.ask(aim, picture, *size, place);
        }
    }

    fn receive_rays(&mut self, ctx: &egui::Context) {
        match self.probe.answer(ctx) {
            Some((Aim::Inspect, ray)) => self.ray = Some(ray),
            Some((Aim::Focus, ray)) => {
                if let Some(point) = ray.surface_point() {
                    let pose = Pose::of(self.document.values()).focus(point.as_dvec3());
                    self.move_camera(pose, None);
                }
            }
            None => {}
        }
    }

    // ---- Scenes ---------------------------------------------------------------------------------------

    /// Opens a scene, after asking about changes that would be lost.
    pub fn open(&mut self, scene: &Path) {
        if self.document.is_changed() {
            self.leaving = Some(Leaving::Open(scene.to_owned()));
        } else {
            self.open_now(scene);
        }
    }

    fn open_now(&mut self, scene: &Path) {
        match Document::open(scene, &[], &self.options.limits) {
            Ok(document) => {
                if let Some(path) = &document.path {
                    self.settings.remember(path);
                }
                self.first_pose = Pose::of(document.values());
                self.document = document;
                self.marked = None;
                self.ray = None;
                self.playing = false;
                self.paths.close();
            }
            Err(e) if self.paths.is_open() => self.paths.fault = Some(e.to_string()),
            Err(e) => self.say(MessageKind::Error, e.to_string()),
        }
    }

    fn save(&mut self) {
        match self.document.path.clone() {
            Some(path) => self.save_to(&path),
            None => self.ask_where_to_save(),
        }
    }

    fn ask_where_to_save(&mut self) {
        let guess = match &self.document.path {
            Some(path) => path.clone(),
            None => PathBuf::from(format!("{}.toml", self.document.name)),
        };
        self.paths.ask(Purpose::Save, &guess);
    }

    fn save_to(&mut self, path: &Path) {
        match self.document.save(path) {
            Ok(()) => {
                self.settings.remember(path);
                self.paths.close();
                self.say(MessageKind::Note, format!("saved {}", path.display()));
                if let Some(leaving) = self.leave_after_save.take() {
                    self.leave(leaving);
                }
            }
            Err(e) if self.paths.is_open() => self.paths.fault = Some(e.to_string()),
            Err(e) => self.say(MessageKind::Error, e.to_string()),
        }
    }

    fn leave(&mut self, leaving: Leaving) {
        match leaving {
            Leaving::Close => self.closing = true,
            Leaving::Open(scene) => self.open_now(&scene),
        }
    }

    /// A file that was dropped on the window.
    fn drop_file(&mut self, path: &Path) {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("toml") => self.open(path),
            Some("npz") => {
                let set = self.document.use_volume_file(path);
                self.tell(set);
            }
            _ => {
                let what = format!("{} is neither a scene (.toml) nor a volume (.npz)", path.display());
                self.say(MessageKind::Error, what);
            }
        }
    }

    fn copy_command(&mut self, ctx: &egui::Context) {
        ctx.copy_text(self.document.command_line());
        self.say(MessageKind::Note, "the command line that renders this picture is on the clipboard");
    }

    fn open_export(&mut self) {
        let image = &self.document.scene().image;
        self.export.size = [image.width, image.height];
        self.export.samples = image.samples.max(self.settings.refine_to).min(256);
        if self.export.path.is_empty() {
            self.export.path = self.document.name.clone();
        }
        self.export.open = true;
    }

    fn start_export(&mut self) {
        let edits = [
            ("image.width", i64::from(self.export.size[0])),
            ("image.height", i64::from(self.export.size[1])),
            ("image.samples", i64::from(self.export.samples)),
        ];
        match self.document.variant(&edits.map(|(key, value)| (key, Raw::Int(value)))) {
            Ok(scene) => {
                self.exporting = true;
                self.worker.export(Export { scene, paths: self.export.paths() });
            }
            Err(e) => self.say(MessageKind::Error, e.to_string()),
        }
    }

    // ---- Input ----------------------------------------------------------------------------------------

    fn shortcuts(&mut self, ctx: &egui::Context) {
        // The question about unsaved changes comes first, and Esc is an answer to it.
        if self.leaving.is_some() {
            return;
        }
        let hit =
            |key, modifiers| ctx.input_mut(|i| i.consume_shortcut(&KeyboardShortcut::new(modifiers, key)));
        const CTRL: Modifiers = Modifiers::COMMAND;
        let ctrl_shift = Modifiers::COMMAND | Modifiers::SHIFT;
        // The longer ones first: Ctrl+Z would also take Ctrl+Shift+Z.
        if hit(Key::S, ctrl_shift) {
            self.ask_where_to_save();
        } else if hit(Key::S, CTRL) {
            self.save();
        } else if hit(Key::Z, ctrl_shift) || hit(Key::Y, CTRL) {
            self.document.redo();
        } else if hit(Key::Z, CTRL) {
            self.document.undo();
        } else if hit(Key::C, ctrl_shift) {
            self.copy_command(ctx);
        } else if hit(Key::O, CTRL) {
            self.paths.ask(Purpose::Open, Path::new(""));
        } else if hit(Key::E, CTRL) {
            self.open_export();
        } else if hit(Key::Q, CTRL) {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        // Plain keys belong to a text field while one is being edited.
        if ctx.egui_wants_keyboard_input() || self.paths.is_open() {
            return;
        }
        let plain = |key| ctx.input_mut(|i| i.consume_key(Modifiers::NONE, key));
        for (tool, _, key, _) in Tool::ALL {
            if plain(key) {
                self.tool = tool;
            }
        }
        const NUMBERS: [Key; 7] =
            [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7];
        for (key, layer) in NUMBERS.into_iter().zip(Layer::ALL) {
            if plain(key) {
                self.layer = layer;
            }
        }
        if plain(Key::Space) {
            self.playing = !self.playing;
        }
        if plain(Key::G) {
            self.gallery.open = !self.gallery.open;
        }
        if plain(Key::Tab) {
            self.settings.parameters = !self.settings.parameters;
        }
        if plain(Key::V) {
            self.settings.inspectors = !self.settings.inspectors;
        }
        if plain(Key::Home) {
            self.move_camera(self.first_pose, None);
        }
        if plain(Key::F) {
            self.frame_all();
        }
        if plain(Key::T) {
            let dark = ctx.theme() == egui::Theme::Dark;
            self.set_theme(ctx, if dark { Theme::Light } else { Theme::Dark });
        }
        let question =
            ctx.input_mut(|i| i.consume_key(Modifiers::SHIFT, Key::Questionmark)) || plain(Key::Questionmark);
        if question || plain(Key::F1) {
            self.help = !self.help;
        }
        if plain(Key::Escape) {
            self.worker.stop();
        }
    }

    fn set_theme(&mut self, ctx: &egui::Context, theme: Theme) {
        self.settings.theme = theme;
        ctx.set_theme(preference(theme));
    }

    fn move_camera(&mut self, pose: Pose, gesture: Option<&str>) {
        let set = self.document.set_all(&pose.edits(), gesture);
        self.tell(set);
    }

    fn frame_all(&mut self) {
        let scene = self.document.scene();
        let aspect = f64::from(scene.image.width) / f64::from(scene.image.height);
        let pose = Pose::of(self.document.values()).frame_all(scene, aspect);
        self.move_camera(pose, None);
    }

    fn flow(&mut self, ctx: &egui::Context) {
        if !self.playing {
            self.flowed = None;
            return;
        }
        let now = Instant::now();
        let seconds = self.flowed.replace(now).map_or(0.0, |last| (now - last).as_secs_f64());
        let flow = f64::from(self.document.values().float("volume.flow"));
        // Whole lengths give the same picture: the loop has no seam. After a pause of the whole window the
        // water goes on from where it was.
        let next = (flow + seconds.min(0.5) * self.settings.flow_speed).rem_euclid(1.0);
        let set = self.document.set_quietly("volume.flow", &Raw::Float(f64::from(next as f32)));
        self.tell(set);
        // Oftener than a screen shows would only take time from the renderer.
        ctx.request_repaint_after(Duration::from_millis(16));
    }

    // ---- Panels ---------------------------------------------------------------------------------------

    fn menus(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        egui::MenuBar::new().ui(ui, |ui| {
            ui.menu_button("File", |ui| {
                if item(ui, "Scenes …", "G") {
                    self.gallery.open = true;
                }
                if item(ui, "Open …", "Ctrl+O") {
                    self.paths.ask(Purpose::Open, Path::new(""));
                }
                ui.menu_button("Open recent", |ui| {
                    if self.settings.recent.is_empty() {
                        ui.weak("none yet");
                    }
                    for path in self.settings.recent.clone() {
                        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                        if ui.button(file).on_hover_text(path.display().to_string()).clicked() {
                            self.open(&path);
                        }
                    }
                });
                ui.separator();
                if item(ui, "Save", "Ctrl+S") {
                    self.save();
                }
                if item(ui, "Save as …", "Ctrl+Shift+S") {
                    self.ask_where_to_save();
                }
                ui.separator();
                if item(ui, "Export …", "Ctrl+E") {
                    self.open_export();
                }
                if item(ui, "Copy as command line", "Ctrl+Shift+C") {
                    self.copy_command(&ctx);
                }
                ui.separator();
                if item(ui, "Quit", "Ctrl+Q") {
                    ctx.send_viewport_cmd(egui::ViewportCommand::Close);
                }
            });
            ui.menu_button("Edit", |ui| {
                let (undo, redo) = (self.document.can_undo(), self.document.can_redo());
                if ui.add_enabled(undo, egui::Button::new("Undo").shortcut_text("Ctrl+Z")).clicked() {
                    self.document.undo();
                }
                if ui.add_enabled(redo, egui::Button::new("Redo").shortcut_text("Ctrl+Shift+Z")).clicked() {
                    self.document.redo();
                }
            });
            ui.menu_button("View", |ui| {
                ui.checkbox(&mut self.settings.parameters, "Parameters");
                ui.checkbox(&mut self.settings.inspectors, "Inspectors");
                ui.separator();
                if item(ui, "Frame all", "F") {
                    self.frame_all();
                }
                if item(ui, "Reset the camera", "Home") {
                    self.move_camera(self.first_pose, None);
                }
                ui.separator();
                for (theme, text) in
                    [(Theme::System, "As the system"), (Theme::Light, "Light"), (Theme::Dark, "Dark")]
                {
                    if ui.radio(self.settings.theme == theme, text).clicked() {
                        self.set_theme(&ctx, theme);
                    }
                }
            });
            if ui.button("Help").clicked() {
                self.help = !self.help;
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let mark = if self.document.is_changed() { " •" } else { "" };
                let title = ui.label(RichText::new(format!("{}{mark}", self.document.name)).strong());
                let place = match &self.document.path {
                    Some(path) => path.display().to_string(),
                    None => "a preset".into(),
                };
                let changed = if self.document.is_changed() { ", changed" } else { "" };
                title.on_hover_text(format!("{place}{changed}"));
            });
        });
    }

    fn toolbar(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            for (tool, text, key, what) in Tool::ALL {
                let able = tool != Tool::Light || viewport::has_directional(self.document.scene());
                let button = ui.add_enabled(able, egui::Button::selectable(self.tool == tool, text));
                if button.on_hover_text(format!("{what} ({})", key.name())).clicked() {
                    self.tool = tool;
                }
            }
            ui.separator();
            ui.label("Layer");
            let combo =
                egui::ComboBox::from_id_salt("layer").selected_text(self.layer.name()).show_ui(ui, |ui| {
                    for layer in Layer::ALL {
                        ui.selectable_value(&mut self.layer, layer, layer.name());
                    }
                });
            name(&combo.response, "Layer");
            ui.separator();
            let (text, what) =
                if self.playing { ("⏸", "Pause the water") } else { ("▶", "Play the water") };
            let play = ui.button(text).on_hover_text(format!("{what} (Space)"));
            name(&play, what);
            if play.clicked() {
                self.playing = !self.playing;
            }
            ui.spacing_mut().slider_width = 70.0;
            let speed = egui::Slider::new(&mut self.settings.flow_speed, 0.0..=2.0)
                .logarithmic(true)
                .smallest_positive(0.01)
                .max_decimals(2);
            let speed = ui.add(speed).on_hover_text("Speed of the flow, lengths of the volume a second");
            name(&speed, "Flow speed");
            ui.separator();
            ui.label("Refine to");
            let combo = egui::ComboBox::from_id_salt("refine")
                .selected_text(samples_text(self.settings.refine_to))
                .show_ui(ui, |ui| {
                    for samples in [1, 4, 16, 64, 256] {
                        ui.selectable_value(&mut self.settings.refine_to, samples, samples_text(samples));
                    }
                });
            name(&combo.response, "Refine to");
            ui.separator();
            for (on, text, what) in [
                (&mut self.settings.parameters, "Parameters", "Show or hide the parameters (Tab)"),
                (&mut self.settings.inspectors, "Inspectors", "Show or hide the inspectors (V)"),
            ] {
                if ui.selectable_label(*on, text).on_hover_text(what).clicked() {
                    *on = !*on;
                }
            }
            ui.separator();
            self.progress(ui);
        });
    }

    /// What the renderer is at, with a stop.
    fn progress(&mut self, ui: &mut Ui) {
        let working = self.busy.is_some_and(|_| !self.is_settled());
        if let Some(busy) = self.busy
            && (working || self.exporting)
        {
            let text = RichText::new(busy.what).small();
            ui.add(egui::ProgressBar::new(busy.share).desired_width(110.0).text(text));
            let stop = ui.button("Stop").on_hover_text("Stop the work in hand (Esc)");
            if stop.clicked() {
                if self.exporting {
                    self.worker.cancel_exports();
                } else {
                    self.worker.stop();
                }
            }
        } else if let Some(picture) = &self.picture {
            ui.weak(samples_text(picture.samples));
        }
    }

    fn inspectors(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            for (inspector, text) in
                [(Inspector::Pixel, "Pixel"), (Inspector::Volume, "Volume"), (Inspector::Curves, "Curves")]
            {
                if ui.selectable_label(self.inspector == inspector, text).clicked() {
                    self.inspector = inspector;
                    self.inspect_again();
                }
            }
        });
        ui.separator();
        if self.inspector == Inspector::Pixel {
            // Its table scrolls by itself.
            match &self.ray {
                Some(ray) => ray_panel::show(ui, ray),
                None => {
                    ui.label("Click in the picture to see the ray of a pixel, cell by cell.");
                }
            }
            return;
        }
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            match (self.inspector, &self.picture) {
                (Inspector::Volume, Some(picture)) => self.volume_panel.show(ui, &picture.volume),
                (Inspector::Volume, None) => {
                    ui.label("The volume is being built.");
                }
                _ if self.document.scene().volume_file.is_some() => {
                    ui.label("This volume comes from a file, not from curves.");
                }
                _ => self.curves_panel.show(ui, &self.document.scene().water),
            }
        });
    }

    fn status(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 14.0;
            ui.label(if self.engine.is_empty() { "opening the engine …" } else { &self.engine });
            if let Some(picture) = &self.picture {
                let frame = &picture.frame;
                let s = &frame.seconds;
                let ms = |x: f64| format!("{:.1}", x * 1e3);
                ui.label(format!(
                    "{}×{}{}",
                    frame.width,
                    frame.height,
                    if picture.scale > 1 { format!(" (1/{})", picture.scale) } else { String::new() }
                ));
                let passes = format!("gbuffer {} · integrate {} ms", ms(s.gbuffer), ms(s.integrate));
                let all = format!(
                    "Of one sample: gbuffer {}, integrate {}, resolve {} ms on the device; pipelines {}, \
                     upload {}, read-back {} ms on the host.\nLast volume {} ms.",
                    ms(s.gbuffer),
                    ms(s.integrate),
                    ms(s.resolve),
                    ms(s.pipelines),
                    ms(s.upload),
                    ms(s.readback),
                    ms(self.worker.state().volume_seconds),
                );
                ui.label(passes).on_hover_text(all);
                let [view, light] = frame.cells_walked();
                let cells = ui.label(format!("{} cells", counted(view + light)));
                cells.on_hover_text(format!("{view} cells walked by view rays, {light} by light rays"));
            }
            if let Some(bytes) = resident_memory() {
                ui.label(human_bytes(bytes.into())).on_hover_text("Memory of this process");
            }
            let frames = self.measured.recent_frames();
            let text = format!("window {:.0} ms", frames.median);
            ui.label(text).on_hover_text(format!(
                "The window's own work a frame: median {:.1} ms, 95 in 100 below {:.1} ms",
                frames.median, frames.p95
            ));
            if let (Some(ms), Some(picture)) = (self.measured.last_preview(), &self.picture) {
                let color = cost_color(ui, picture.cost);
                let text = format!("{}: preview in {ms:.0} ms", picture.cost.word());
                ui.label(RichText::new(text).color(color))
                    .on_hover_text("What the last change cost, and the time to its first picture");
            }
        });
    }

    fn show_banners(&mut self, ctx: &egui::Context, at: egui::Rect) {
        self.banners.retain(|(m, since)| m.kind != MessageKind::Note || since.elapsed() < NOTE_TIME);
        let mut lines: Vec<(MessageKind, String, Option<usize>)> = Vec::new();
        let faults = self.document.fault().map(str::to_owned).into_iter().chain(self.fault.clone());
        lines.extend(faults.map(|fault| (MessageKind::Error, fault, None)));
        let first = self.banners.len().saturating_sub(MAX_BANNERS);
        let newest = self.banners.iter().enumerate().skip(first);
        lines.extend(newest.map(|(i, (m, _))| (m.kind, m.text.clone(), Some(i))));
        if lines.is_empty() {
            return;
        }
        if self.banners.iter().any(|(m, _)| m.kind == MessageKind::Note) {
            ctx.request_repaint_after(Duration::from_millis(500));
        }
        let mut closed = None;
        let mut undo = false;
        egui::Area::new(egui::Id::unique("banners"))
            .fixed_pos(at.left_top() + egui::vec2(8.0, 8.0))
            .order(egui::Order::Middle)
            .show(ctx, |ui| {
                ui.set_max_width((at.width() - 16.0).max(120.0));
                for (kind, text, index) in &lines {
                    let (sign, color) = match kind {
                        MessageKind::Note => ("ℹ", ui.visuals().hyperlink_color),
                        MessageKind::Warning => ("⚠", ui.visuals().warn_fg_color),
                        MessageKind::Error => ("⛔", ui.visuals().error_fg_color),
                    };
                    egui::Frame::popup(ui.style()).show(ui, |ui| {
                        ui.horizontal(|ui| {
                            ui.colored_label(color, sign);
                            let width = (at.width() - 110.0).clamp(80.0, 620.0);
                            ui.scope(|ui| {
                                ui.set_max_width(width);
                                ui.add(egui::Label::new(text).wrap());
                            });
                            if let Some(i) = index {
                                let close = ui.small_button("✖").on_hover_text("Close");
                                closed = close.clicked().then_some(*i).or(closed);
                            } else if self.document.can_undo() {
                                undo |= ui.button("Undo").clicked();
                            }
                        });
                    });
                }
            });
        if let Some(i) = closed {
            self.banners.remove(i);
        }
        if undo {
            self.document.undo();
        }
    }

    fn help_window(&mut self, ctx: &egui::Context) {
        let mut open = self.help;
        let window = egui::Window::new("Keys and mouse").open(&mut open).resizable(false).collapsible(false);
        let middle = ctx.content_rect().center();
        window.pivot(egui::Align2::CENTER_CENTER).default_pos(middle).show(ctx, |ui| {
            let height = (ctx.content_rect().height() - 90.0).max(120.0);
            egui::ScrollArea::vertical().max_height(height).show(ui, |ui| {
                egui::Grid::new("keys").num_columns(2).spacing([24.0, 4.0]).striped(true).show(ui, |ui| {
                    for (keys, what) in HELP {
                        ui.monospace(*keys);
                        ui.label(*what);
                        ui.end_row();
                    }
                });
            });
        });
        self.help = open;
    }

    fn windows(&mut self, ctx: &egui::Context) {
        if let Some(preset) = self.gallery.show(ctx) {
            self.open(Path::new(preset));
        }
        if self.help {
            self.help_window(ctx);
        }
        if self.export.open {
            let exporting = self.exporting.then(|| self.busy.map_or(0.0, |b| b.share));
            let image = &self.document.scene().image;
            let aspect = f64::from(image.width) / f64::from(image.height);
            match self.export.show(ctx, aspect, exporting) {
                ExportAnswer::Start => self.start_export(),
                ExportAnswer::Cancel => self.worker.cancel_exports(),
                ExportAnswer::Nothing => {}
            }
        }
        let recent = self.settings.recent.clone();
        let opening = self.paths.show(ctx, |ui| {
            let mut chosen = None;
            for path in recent.iter().take(6) {
                if ui.link(path.display().to_string()).clicked() {
                    chosen = Some(path.clone());
                }
            }
            chosen
        });
        match opening {
            Some((Purpose::Open, path)) => self.open(&path),
            Some((Purpose::Save, path)) => self.save_to(&path),
            None => {}
        }
        // A save that was given up takes what was to follow it along.
        if !self.paths.is_open() {
            self.leave_after_save = None;
        }
        if let Some(leaving) = self.leaving.clone()
            && let Some(answer) = ask_unsaved(ctx, &self.document.name)
        {
            self.leaving = None;
            match answer {
                UnsavedAnswer::Stay => {}
                UnsavedAnswer::Discard => self.leave(leaving),
                UnsavedAnswer::Save => {
                    self.leave_after_save = Some(leaving);
                    self.save();
                }
            }
        }
    }

    // ---- The window's life ----------------------------------------------------------------------------

    fn life(&mut self, ctx: &egui::Context) {
        if self.options.signal.load(Ordering::Relaxed) != 0 {
            self.closing = true;
        }
        if self.loss.happened() && !self.closing {
            self.loss.keep(Kept { document: self.document.clone(), device_lost: true });
            self.closing = true;
        }
        let title =
            format!("{}{} — taki", if self.document.is_changed() { "• " } else { "" }, self.document.name);
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
        let (close, inner, outer) = ctx.input(|i| {
            let v = i.viewport();
            (v.close_requested(), v.inner_rect, v.outer_rect)
        });
        if let Some(rect) = inner {
            self.settings.window = Some(rect.size().into());
        }
        if let Some(rect) = outer {
            self.settings.position = Some(rect.min.into());
        }
        self.settings.zoom = ctx.zoom_factor();
        if close && self.document.is_changed() && !self.closing {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.leaving = Some(Leaving::Close);
        }
        if let Some(after) = self.options.exit_after {
            let left = after.saturating_sub(self.opened.elapsed());
            if !left.is_zero() {
                ctx.request_repaint_after(left);
            } else if self.take_screenshot(ctx) {
                self.closing = true;
            }
        }
        if self.closing {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    /// Asks for the window's picture; true when it is written, or none is wanted.
    fn take_screenshot(&mut self, ctx: &egui::Context) -> bool {
        let Some(path) = &self.options.screenshot else { return true };
        let id = egui::Id::unique("screenshot");
        match self.shot {
            Shot::Done => true,
            Shot::NotYet => {
                let ctx_of_callback = ctx.clone();
                ctx.request_screenshot(move |image| {
                    ctx_of_callback.data_mut(|d| d.insert_temp(id, image));
                    ctx_of_callback.request_repaint();
                });
                self.shot = Shot::Asked;
                ctx.request_repaint();
                false
            }
            Shot::Asked => {
                let Some(image) = ctx.data_mut(|d| d.remove_temp::<Arc<egui::ColorImage>>(id)) else {
                    ctx.request_repaint();
                    return false;
                };
                let written = write_image(&image, path);
                self.shot = Shot::Done;
                if let Err(e) = written {
                    // There is no one to read a banner any more.
                    eprintln!("taki: error: {e}");
                }
                true
            }
        }
    }
}

/// Writes the window's picture.
fn write_image(image: &egui::ColorImage, path: &Path) -> Result<()> {
    let [width, height] = image.size.map(|n| n as u32);
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|p| p.to_array()).collect();
    let picture = image::RgbaImage::from_raw(width, height, bytes)
        .ok_or_else(|| Error::write(path, "the window has no picture"))?;
    picture.save_with_format(path, image::ImageFormat::Png).map_err(|e| Error::write(path, e))
}

fn preference(theme: Theme) -> egui::ThemePreference {
    match theme {
        Theme::System => egui::ThemePreference::System,
        Theme::Light => egui::ThemePreference::Light,
        Theme::Dark => egui::ThemePreference::Dark,
    }
}

fn item(ui: &mut Ui, text: &str, keys: &str) -> bool {
    ui.add(egui::Button::new(text).shortcut_text(keys)).clicked()
}

/// A count with three digits.
fn counted(n: u64) -> String {
    match n {
        0..=9_999 => n.to_string(),
        10_000..=999_999 => format!("{:.0} thousand", n as f64 / 1e3),
        1_000_000..=99_999_999 => format!("{:.1} million", n as f64 / 1e6),
        _ => format!("{:.0} million", n as f64 / 1e6),
    }
}

fn samples_text(samples: u32) -> String {
    if samples == 1 { "1 sample".into() } else { format!("{samples} samples") }
}

/// Bytes of this process in memory, where the system tells.
fn resident_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmRSS:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

/// Keys and mouse, for the help window and the README.
pub const HELP: &[(&str, &str)] = &[
    ("drag", "the tool in hand: orbit, pan, light or inspect"),
    ("Shift+drag, right drag", "pan"),
    ("Ctrl+drag", "turn the first directional light"),
    ("wheel, pinch", "zoom"),
    ("click", "inspect the ray of a pixel"),
    ("double click", "focus on the point under the pointer"),
    ("O  P  L  I", "tools: orbit, pan, light, inspect"),
    ("1 … 7", "layers: rgb, depth, uv, quad, transmittance, cells, normal"),
    ("Space", "play or pause the water"),
    ("F", "frame all"),
    ("Home", "the camera as the scene was opened"),
    ("Esc", "stop the work in hand"),
    ("Tab", "parameters"),
    ("V", "inspectors"),
    ("G", "gallery of scenes"),
    ("T", "light or dark"),
    ("Ctrl+Z, Ctrl+Shift+Z", "undo, redo"),
    ("Ctrl+O, Ctrl+S", "open, save (Ctrl+Shift+S: save as)"),
    ("Ctrl+E", "export PNG and EXR"),
    ("Ctrl+Shift+C", "copy as command line"),
    ("Ctrl +, Ctrl −, Ctrl 0", "size of the interface"),
    ("?", "this list"),
];

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
    /// One frame of the window.
    pub fn show(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        self.receive(&ctx);
        self.shortcuts(&ctx);
        let dropped: Vec<PathBuf> =
            ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect());
        dropped.iter().for_each(|path| self.drop_file(path));
        self.flow(&ctx);

        egui::Panel::top("menus").show(ui, |ui| self.menus(ui));
        egui::Panel::top("toolbar").show(ui, |ui| self.toolbar(ui));
        egui::Panel::bottom("status").show(ui, |ui| self.status(ui));
        if self.settings.parameters {
            let costs = Costs { volume_seconds: self.worker.state().volume_seconds };
            egui::Panel::left("parameters").default_size(340.0).size_range(280.0..=560.0).show(ui, |ui| {
                ui.add_space(4.0);
                self.parameters.show(ui, &mut self.document, costs);
            });
        }
        if self.settings.inspectors {
            // A small window keeps room for the picture.
            let most = (ui.available_width() * 0.55).max(200.0);
            egui::Panel::right("inspectors").default_size(480.0).size_range(200.0..=most).show(ui, |ui| {
                ui.add_space(4.0);
                self.inspectors(ui);
            });
        }
        let central = egui::CentralPanel::no_frame().show(ui, |ui| self.viewport(ui));
        self.show_banners(&ctx, central.response.rect);
        self.windows(&ctx);
        self.life(&ctx);
        // A step of the wheel is spread over some frames.
        let moving =
            |i: &egui::InputState| i.pointer.any_down() || i.smooth_scroll_delta() != egui::Vec2::ZERO;
        if !ctx.input(moving) {
            self.document.end_gesture();
        }
    }

    /// Goes on with measuring, and closes the window at its end.
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

    fn viewport(&mut self, ui: &mut Ui) {
        let image = &self.document.scene().image;
        let shown = Shown {
            texture: self.texture.as_ref(),
            aspect: image.width as f32 / image.height as f32,
            marked: self.marked.filter(|_| self.settings.inspectors && self.inspector == Inspector::Pixel),
            tool: self.tool,
        };
        let (rect, actions) = viewport::show(ui, &shown, self.document.values());
        if let Some(picture) = &self.picture
            && picture.layer != Layer::Rgb
        {
            let at = rect.left_bottom() + egui::vec2(10.0, -10.0);
            egui::Area::new(egui::Id::unique("legend"))
                .pivot(egui::Align2::LEFT_BOTTOM)
                .fixed_pos(at)
                .order(egui::Order::Middle)
                .interactable(false)
                .show(ui.ctx(), |ui| show_legend(ui, picture.layer, &picture.legend));
        }
        if let Some(pose) = actions.pose {
            self.move_camera(pose, Some("camera"));
        }
        if let Some((key, direction)) = actions.light {
            let set = self.document.set(&key, &super::navigate::raw(direction), Some("light"));
            self.tell(set);
        }
        if let Some(place) = actions.inspect {
            if self.tool == Tool::Inspect {
                self.settings.inspectors = true;
                self.inspector = Inspector::Pixel;
            }
            self.marked = Some(place);
            self.inspect_again();
        }
        if let Some(place) = actions.focus {
            self.ask(Aim::Focus, place);
        }
        // After the clicks of this frame: an answer is on its way before the next.
        self.receive_rays(ui.ctx());
        let pixels = rect.size() * ui.ctx().pixels_per_point();
        self.request([pixels.x.round() as u32, pixels.y.round() as u32]);
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let device_lost = self.loss.happened();
            self.loss.keep(Kept { document: self.document.clone(), device_lost });
        }
        if let Some(path) = &self.options.settings
            && let Err(e) = self.settings.save(path)
        {
            eprintln!("taki: warning: the viewer's settings were not kept: {e}");
        }
    }
}
