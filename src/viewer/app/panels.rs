//! The menus, toolbar, inspectors and status bar around the picture.

use std::path::Path;

use eframe::egui;
use egui::{RichText, Ui};

use super::input::PartCommand;
use super::{Inspector, Viewer};
use crate::picture::{AutoExposure, Layer};
use crate::scene::Recipe;
use crate::util::error::human_bytes;
use crate::viewer::parameters::lights::add_menu;
use crate::viewer::parameters::{cost_color, name};
use crate::viewer::ray_panel;
use crate::viewer::settings::Theme;
use crate::viewer::transfer::Purpose;
use crate::viewer::viewport::Tool;
use crate::viewer::worker::Picture;

/// Width of the renderer's progress bar and its Stop button, points.
const PROGRESS_WIDTH: f32 = 172.0;

impl Viewer {
    pub(super) fn menus(&mut self, ui: &mut Ui) {
        egui::MenuBar::new().ui(ui, |ui| {
            ui.menu_button("File", |ui| self.file_menu(ui));
            ui.menu_button("Edit", |ui| self.edit_menu(ui));
            ui.menu_button("View", |ui| self.view_menu(ui));
            if ui.button("Help").clicked() {
                self.help = !self.help;
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let mark = if self.document.is_changed() { " •" } else { "" };
                let title = ui.label(RichText::new(format!("{}{mark}", self.document.name)).strong());
                let origin = match &self.document.path {
                    Some(path) => path.display().to_string(),
                    None => "a preset".into(),
                };
                let changed = if self.document.is_changed() { ", changed" } else { "" };
                title.on_hover_text(format!("{origin}{changed}"));
            });
        });
    }

    fn file_menu(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
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
    }

    fn edit_menu(&mut self, ui: &mut Ui) {
        let (undo, redo) = (self.document.can_undo(), self.document.can_redo());
        if ui.add_enabled(undo, egui::Button::new("Undo").shortcut_text("Ctrl+Z")).clicked() {
            self.document.undo();
        }
        if ui.add_enabled(redo, egui::Button::new("Redo").shortcut_text("Ctrl+Shift+Z")).clicked() {
            self.document.redo();
        }
        ui.separator();
        ui.menu_button("Add a light", |ui| {
            if let Some(kind) = add_menu(ui) {
                self.add_light(kind);
            }
        });
        let (light, mesh) = (self.lights.selected().is_some(), self.meshes.selected().is_some());
        let noun = if mesh { "mesh" } else { "light" };
        for (command, verb, keys) in PartCommand::ALL {
            let button = egui::Button::new(format!("{verb} the {noun}")).shortcut_text(keys);
            if ui.add_enabled(light || mesh, button).clicked() {
                self.apply_to_selected(command);
            }
        }
    }

    fn view_menu(&mut self, ui: &mut Ui) {
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
        for (theme, text) in [(Theme::System, "System theme"), (Theme::Light, "Light"), (Theme::Dark, "Dark")]
        {
            if ui.radio(self.settings.theme == theme, text).clicked() {
                let ctx = ui.ctx().clone();
                self.set_theme(&ctx, theme);
            }
        }
    }

    pub(super) fn toolbar(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            for (tool, text, key, tip) in Tool::ALL {
                let enabled = tool != Tool::Light || !self.document.values().names("lights").is_empty();
                let button = ui.add_enabled(enabled, egui::Button::selectable(self.tool == tool, text));
                if button.on_hover_text(format!("{tip} ({})", key.name())).clicked() {
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
            self.flow_controls(ui);
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
            for (on, text, tip) in [
                (&mut self.settings.parameters, "Parameters", "Show or hide the parameters (Tab)"),
                (&mut self.settings.inspectors, "Inspectors", "Show or hide the inspectors (V)"),
            ] {
                if ui.selectable_label(*on, text).on_hover_text(tip).clicked() {
                    *on = !*on;
                }
            }
            ui.separator();
            // The room is the same while the renderer works and at rest. Otherwise the picture below would
            // change its size each time, and be rendered again without end.
            let room = egui::vec2(PROGRESS_WIDTH, ui.spacing().interact_size.y);
            let (rect, _) = ui.allocate_exact_size(room, egui::Sense::hover());
            let layout = egui::Layout::left_to_right(egui::Align::Center);
            self.progress(&mut ui.new_child(egui::UiBuilder::new().max_rect(rect).layout(layout)));
        });
    }

    /// The button that plays the water, and its speed.
    fn flow_controls(&mut self, ui: &mut Ui) {
        let (text, action) =
            if self.playing { ("⏸", "Pause the water") } else { ("▶", "Play the water") };
        let play = ui.button(text).on_hover_text(format!("{action} (Space)"));
        name(&play, action);
        if play.clicked() {
            self.playing = !self.playing;
        }
        ui.spacing_mut().slider_width = 70.0;
        let speed = egui::Slider::new(&mut self.settings.flow_speed, 0.0..=2.0)
            .logarithmic(true)
            .smallest_positive(0.01)
            .max_decimals(2);
        let speed = ui.add(speed).on_hover_text("Speed of the flow, volume lengths per second");
        name(&speed, "Flow speed");
    }

    /// The renderer's progress and its Stop button, or the samples of the picture.
    fn progress(&mut self, ui: &mut Ui) {
        let working = self.busy.is_some_and(|_| !self.is_settled());
        if let Some(busy) = self.busy
            && (working || self.exporting)
        {
            let text = RichText::new(busy.what).small();
            ui.add(egui::ProgressBar::new(busy.share).desired_width(110.0).text(text));
            let stop = ui.button("Stop").on_hover_text("Stop rendering and keep the picture (Esc)");
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
            // The table of cells scrolls by itself.
            match &self.ray {
                Some(ray) => ray_panel::show(ui, ray),
                None => {
                    ui.label("Click in the picture to see the ray of a pixel, cell by cell.");
                }
            }
            return;
        }
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            let scene = match (self.inspector, &self.picture) {
                // The volumes are those of the picture, which may lag behind the document.
                (Inspector::Volume, Some(picture)) => picture.scene.clone(),
                _ => self.document.scene().clone(),
            };
            let number = choose_volume(ui, &scene.recipes, &mut self.inspected_volume);
            match (self.inspector, &self.picture) {
                (Inspector::Volume, Some(picture)) => self.volume_panel.show(ui, &picture.volumes[number]),
                (Inspector::Volume, None) => {
                    ui.label("The volume is being built.");
                }
                _ if scene.recipes[number].file.is_some() => {
                    ui.label("This volume comes from a file, not from curves.");
                }
                _ => self.curves_panel.show(ui, &scene.recipes[number].water),
            }
        });
    }

    pub(super) fn status(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 14.0;
            ui.label(if self.engine.is_empty() { "opening the engine …" } else { &self.engine });
            if let Some(picture) = &self.picture {
                self.picture_status(ui, picture);
            }
            if let Some(bytes) = resident_memory() {
                ui.label(human_bytes(bytes.into())).on_hover_text("Memory of this process");
            }
            let frames = self.measured.recent_frames();
            let text = format!("window {:.0} ms", frames.median);
            ui.label(text).on_hover_text(format!(
                "The window's own work per frame: median {:.1} ms, 95th percentile {:.1} ms",
                frames.median, frames.p95
            ));
            if let (Some(ms), Some(picture)) = (self.measured.last_preview(), &self.picture) {
                let color = cost_color(ui, picture.cost);
                let text = format!("{}: preview in {ms:.0} ms", picture.cost.word());
                ui.label(RichText::new(text).color(color))
                    .on_hover_text("Cost of the last change, and the time until its first picture");
            }
        });
    }

    /// Size, exposure, times and cells of the picture in the window.
    fn picture_status(&self, ui: &mut Ui, picture: &Picture) {
        let frame = &picture.frame;
        let s = &frame.seconds;
        let ms = |x: f64| format!("{:.1}", x * 1e3);
        ui.label(format!(
            "{}×{}{}",
            frame.width,
            frame.height,
            if picture.scale > 1 { format!(" (1/{})", picture.scale) } else { String::new() }
        ));
        if self.document.scene().image.look.auto_exposure != AutoExposure::None {
            let exposure = picture.scene.image.look.exposure;
            ui.label(format!("exposure {exposure:+.2}"))
                .on_hover_text("Stops: image.exposure plus the automatic exposure");
        }
        let passes = format!("gbuffer {} · integrate {} ms", ms(s.gbuffer), ms(s.integrate));
        let all = format!(
            "Per sample on the device: gbuffer {}, integrate {}, resolve {} ms.\n\
             On the host: pipelines {}, upload {}, read-back {} ms.\nLast volume: {} ms.",
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
}

/// Shows a choice of the volume that the inspectors show, where the scene has several. Returns its number;
/// that of the first where the scene does not show the volume `chosen`.
pub fn choose_volume(ui: &mut Ui, recipes: &[Recipe], chosen: &mut String) -> usize {
    let number = recipes.iter().position(|recipe| recipe.name == *chosen).unwrap_or(0);
    if recipes.len() > 1 {
        ui.horizontal(|ui| {
            ui.label("Volume");
            let combo = egui::ComboBox::from_id_salt("inspected volume")
                .selected_text(&recipes[number].name)
                .show_ui(ui, |ui| {
                    for recipe in recipes {
                        ui.selectable_value(chosen, recipe.name.clone(), &recipe.name);
                    }
                });
            name(&combo.response, "Inspected volume");
        });
    }
    number
}

/// Shows a menu item with its keys. Returns whether it was clicked.
fn item(ui: &mut Ui, text: &str, keys: &str) -> bool {
    ui.add(egui::Button::new(text).shortcut_text(keys)).clicked()
}

/// A count in words, with at most three digits before a word.
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

/// Resident memory of this process in bytes, where the system reports it.
fn resident_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmRSS:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}
