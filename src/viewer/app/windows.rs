//! Banners and dialogs over the picture.

use std::path::Path;
use std::time::Duration;

use eframe::egui;
use egui::Ui;

use super::Viewer;
use crate::viewer::transfer::{ExportAnswer, Purpose, UnsavedAnswer, ask_unsaved};
use crate::viewer::worker::MessageKind;

/// Most messages shown at once. Older ones appear as newer ones are closed.
const MAX_BANNERS: usize = 4;
/// Notes disappear after this time. Warnings and errors stay until they are closed.
const NOTE_TIME: Duration = Duration::from_secs(8);

impl Viewer {
    /// Shows the messages over the picture: faults first, then the newest banners.
    pub(super) fn show_banners(&mut self, ctx: &egui::Context, at: egui::Rect) {
        self.banners.retain(|(m, since)| m.kind != MessageKind::Note || since.elapsed() < NOTE_TIME);
        // Kind, text and number of each banner; a fault has no number, it stays until it is mended.
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
                let width = (at.width() - 110.0).clamp(80.0, 620.0);
                for (kind, text, index) in &lines {
                    banner(ui, *kind, text, width, |ui| {
                        if let Some(i) = index {
                            let close = ui.small_button("✖").on_hover_text("Close");
                            closed = close.clicked().then_some(*i).or(closed);
                        } else if self.document.can_undo() {
                            undo |= ui.button("Undo").clicked();
                        }
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
                    for (keys, action) in HELP {
                        ui.monospace(*keys);
                        ui.label(*action);
                        ui.end_row();
                    }
                });
            });
        });
        self.help = open;
    }

    /// Shows the dialogs that are open, and acts on their answers.
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
                ExportAnswer::Start { overwrite } => self.start_export(overwrite),
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
            Some((Purpose::Open, path)) => self.open_named(&path),
            Some((Purpose::Save, path)) => self.save_as(&path),
            None => {}
        }
        // A cancelled save also cancels the action that was to follow it.
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

/// One message, at most `width` points wide, with `buttons` after it.
fn banner(ui: &mut Ui, kind: MessageKind, text: &str, width: f32, buttons: impl FnOnce(&mut Ui)) {
    let (sign, color) = match kind {
        MessageKind::Note => ("ℹ", ui.visuals().hyperlink_color),
        MessageKind::Warning => ("⚠", ui.visuals().warn_fg_color),
        MessageKind::Error => ("⛔", ui.visuals().error_fg_color),
    };
    egui::Frame::popup(ui.style()).show(ui, |ui| {
        ui.horizontal(|ui| {
            ui.colored_label(color, sign);
            ui.scope(|ui| {
                ui.set_max_width(width);
                ui.add(egui::Label::new(text).wrap());
            });
            buttons(ui);
        });
    });
}

/// Keys and mouse actions listed in the help window, with what they do.
const HELP: &[(&str, &str)] = &[
    ("drag", "use the selected tool: orbit, pan, light or inspect"),
    ("Shift+drag, right drag", "pan"),
    ("Ctrl+drag", "turn the selected light, or the first directional one"),
    ("drag a light's handle", "move it parallel to the image, with Shift in depth"),
    ("drag a mesh's handle", "move it, turn it (with Shift in steps of 15°) or size it"),
    ("wheel, pinch", "zoom"),
    ("click", "inspect the ray of a pixel, and deselect"),
    ("double click", "focus on the point under the pointer"),
    ("O  P  L  I", "select a tool: orbit, pan, light, inspect"),
    ("1 … 7", "show a layer: rgb, depth, uv, quad, transmittance, cells, normal"),
    ("F2  Ctrl+D  Del", "rename, duplicate, remove the selected light or mesh"),
    ("Space", "play or pause the water"),
    ("F", "frame everything"),
    ("Home", "reset the camera"),
    ("Esc", "take back the drag of a handle, or stop rendering"),
    ("Tab", "show or hide the parameters"),
    ("V", "show or hide the inspectors"),
    ("G", "open the gallery of scenes"),
    ("T", "light or dark theme"),
    ("Ctrl+Z, Ctrl+Shift+Z", "undo, redo"),
    ("Ctrl+O, Ctrl+S", "open, save (Ctrl+Shift+S: save as)"),
    ("Ctrl+E", "export pictures"),
    ("Ctrl+Shift+C", "copy as command line"),
    ("Ctrl +, Ctrl −, Ctrl 0", "size of the interface"),
    ("?", "show this list"),
];
