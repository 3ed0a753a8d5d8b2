//! The panels around the picture and the windows over it.

use std::path::Path;
use std::time::Duration;

use eframe::egui;
use egui::{RichText, Ui};

use super::{Inspector, Viewer};
use crate::error::human_bytes;
use crate::frame::Layer;
use crate::viewer::parameters::{cost_color, name};
use crate::viewer::ray_panel;
use crate::viewer::settings::Theme;
use crate::viewer::transfer::{ExportAnswer, Purpose, UnsavedAnswer, ask_unsaved};
use crate::viewer::viewport::{self, Tool};
use crate::viewer::worker::MessageKind;

/// Messages shown at once, the newest; older ones come forth as these are closed.
const MAX_BANNERS: usize = 4;
/// Notes vanish after this time, warnings and errors stay until they are closed.
const NOTE_TIME: Duration = Duration::from_secs(8);

impl Viewer {
    pub(super) fn menus(&mut self, ui: &mut Ui) {
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

    pub(super) fn toolbar(&mut self, ui: &mut Ui) {
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

    pub(super) fn inspectors(&mut self, ui: &mut Ui) {
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

    pub(super) fn status(&mut self, ui: &mut Ui) {
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

    pub(super) fn show_banners(&mut self, ctx: &egui::Context, at: egui::Rect) {
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

    pub(super) fn windows(&mut self, ctx: &egui::Context) {
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

/// Keys and mouse, for the help window.
const HELP: &[(&str, &str)] = &[
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
