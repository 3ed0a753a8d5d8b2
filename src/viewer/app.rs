//! The window: menus, panels and status around the picture, and what they ask of the renderer.

mod panels;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use eframe::egui;
use egui::{Key, KeyboardShortcut, Modifiers, Ui};

use super::curves_panel::CurvesPanel;
use super::document::Document;
use super::drive::Drive;
use super::gallery::Gallery;
use super::layer_image::show_legend;
use super::metrics;
use super::navigate::Pose;
use super::parameters::{Costs, ParameterPanel};
use super::probe::{Aim, Probe};
use super::settings::{Settings, Theme};
use super::transfer::{ExportDialog, PathDialog, Purpose};
use super::viewport::{self, Shown, Tool};
use super::volume_panel::VolumePanel;
use super::worker::{Busy, Export, Message, MessageKind, Picture, Request, Worker};
use super::{Kept, Loss, Options};
use crate::cpu::ray::RayReport;
use crate::error::{Error, Result};
use crate::frame::Layer;
use crate::scene::{Raw, Scene};

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
            Some("hdr" | "exr") => {
                let set = self.document.use_environment_file(path);
                self.tell(set);
            }
            _ => {
                let what = format!(
                    "{} is neither a scene (.toml) nor a volume (.npz) nor an environment (.hdr, .exr)",
                    path.display()
                );
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
