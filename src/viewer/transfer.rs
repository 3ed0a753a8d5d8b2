//! Files in and out: asking for a path, exporting pictures, and what would be lost by closing.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};

use eframe::egui;

use super::parameters::name;

/// What a path is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Opening a scene.
    Open,
    /// Saving the scene.
    Save,
}

/// A small window that asks for a path: typed, or picked in the system's own dialog. Typing works where
/// the system has no dialog.
#[derive(Default)]
pub struct PathDialog {
    open: Option<Purpose>,
    text: String,
    /// What the last try said.
    pub fault: Option<String>,
    picked: Option<Receiver<Option<PathBuf>>>,
    focus: bool,
}

impl PathDialog {
    /// Opens the window with a first guess.
    pub fn ask(&mut self, purpose: Purpose, guess: &Path) {
        *self = PathDialog {
            open: Some(purpose),
            text: guess.display().to_string(),
            focus: true,
            ..Default::default()
        };
    }

    /// Closes it.
    pub fn close(&mut self) {
        *self = PathDialog::default();
    }

    /// Whether it is shown.
    pub fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// Shows it; the path that was given. `also` adds to it (recent files).
    pub fn show(
        &mut self,
        ctx: &egui::Context,
        also: impl FnOnce(&mut egui::Ui) -> Option<PathBuf>,
    ) -> Option<(Purpose, PathBuf)> {
        let purpose = self.open?;
        let mut given = None;
        let (title, verb) = match purpose {
            Purpose::Open => ("Open a scene", "Open"),
            Purpose::Save => ("Save the scene as", "Save"),
        };
        if let Some(picked) = &self.picked
            && let Ok(path) = picked.try_recv()
        {
            self.picked = None;
            given = path;
        }
        let shown = egui::Modal::new(egui::Id::unique("path dialog")).show(ctx, |ui| {
            ui.set_width(460.0);
            ui.heading(title);
            ui.add_space(4.0);
            let field = ui.add(
                egui::TextEdit::singleline(&mut self.text)
                    .hint_text("Path of a scene file (.toml)")
                    .desired_width(f32::INFINITY),
            );
            name(&field, "Path");
            if std::mem::take(&mut self.focus) {
                field.request_focus();
            }
            let entered = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
            if let Some(fault) = &self.fault {
                ui.colored_label(ui.visuals().error_fg_color, fault);
            }
            ui.add_space(4.0);
            ui.horizontal(|ui| {
                let ready = !self.text.trim().is_empty();
                if (ui.add_enabled(ready, egui::Button::new(verb)).clicked() || entered) && ready {
                    given = Some(PathBuf::from(self.text.trim()));
                }
                let idle = self.picked.is_none();
                if ui.add_enabled(idle, egui::Button::new("Browse…")).clicked() {
                    self.picked = Some(browse(ui.ctx(), purpose, Path::new(self.text.trim())));
                }
                if ui.button("Cancel").clicked() {
                    ui.close();
                }
            });
            also(ui)
        });
        if let Some(path) = shown.inner.clone() {
            given = Some(path);
        }
        if shown.should_close() && given.is_none() {
            self.close();
        }
        given.map(|path| (purpose, path))
    }
}

/// The system's own file dialog, on a thread of its own: the window goes on drawing.
fn browse(ctx: &egui::Context, purpose: Purpose, guess: &Path) -> Receiver<Option<PathBuf>> {
    let (send, receive) = channel();
    let wake = ctx.clone();
    let folder = guess.parent().filter(|p| !p.as_os_str().is_empty()).map(Path::to_owned);
    let file = guess.file_name().map(|f| f.to_string_lossy().into_owned()).unwrap_or_default();
    // A dialog that cannot open is a dialog that was cancelled: the path can still be typed.
    let _ = std::thread::Builder::new().name("file dialog".into()).spawn(move || {
        let mut dialog = rfd::FileDialog::new().add_filter("taki scenes", &["toml"]);
        if let Some(folder) = folder {
            dialog = dialog.set_directory(folder);
        }
        let path = match purpose {
            Purpose::Open => dialog.pick_file(),
            Purpose::Save => dialog.set_file_name(file).save_file(),
        };
        let _ = send.send(path);
        wake.request_repaint();
    });
    receive
}

/// The window that exports pictures.
pub struct ExportDialog {
    /// Whether it is shown.
    pub open: bool,
    /// Pixels.
    pub size: [u32; 2],
    /// Samples a pixel.
    pub samples: u32,
    /// File without extension.
    pub path: String,
    /// Which files.
    pub png: bool,
    /// Linear, with layers.
    pub exr: bool,
    /// Whether the size keeps the picture's aspect.
    pub keep_aspect: bool,
}

impl Default for ExportDialog {
    fn default() -> Self {
        ExportDialog {
            open: false,
            size: [1280, 720],
            samples: 16,
            path: String::new(),
            png: true,
            exr: false,
            keep_aspect: true,
        }
    }
}

impl ExportDialog {
    /// The files it will write.
    pub fn paths(&self) -> Vec<PathBuf> {
        let path = self.path.trim();
        let stem = path.strip_suffix(".png").or(path.strip_suffix(".exr")).unwrap_or(path);
        [(self.png, "png"), (self.exr, "exr")]
            .into_iter()
            .filter(|(wanted, _)| *wanted && !stem.is_empty())
            .map(|(_, extension)| PathBuf::from(format!("{stem}.{extension}")))
            .collect()
    }

    /// Shows the window; true when the export is to start. `exporting`: the share that is done.
    pub fn show(&mut self, ctx: &egui::Context, aspect: f64, exporting: Option<f32>) -> ExportAnswer {
        let mut answer = ExportAnswer::Nothing;
        let mut open = self.open;
        let window = egui::Window::new("Export").open(&mut open).resizable(false).collapsible(false);
        let middle = ctx.content_rect().center();
        window.pivot(egui::Align2::CENTER_CENTER).default_pos(middle).show(ctx, |ui| {
            ui.set_width(380.0);
            egui::Grid::new("export").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
                ui.label("File");
                let field = egui::TextEdit::singleline(&mut self.path).hint_text("without extension");
                name(&ui.add(field.desired_width(280.0)), "Export file");
                ui.end_row();
                ui.label("Kind");
                ui.horizontal(|ui| {
                    ui.checkbox(&mut self.png, "PNG").on_hover_text("sRGB, 8 bits, as shown");
                    ui.checkbox(&mut self.exr, "EXR")
                        .on_hover_text("float32, linear, with depth, uv, quad, normal and more as layers");
                });
                ui.end_row();
                ui.label("Size");
                ui.horizontal(|ui| {
                    let [w, h] = &mut self.size;
                    let width = ui.add(egui::DragValue::new(w).range(1..=65536).suffix(" px"));
                    name(&width, "Export width");
                    ui.label("×");
                    let height = ui.add(egui::DragValue::new(h).range(1..=65536).suffix(" px"));
                    name(&height, "Export height");
                    ui.checkbox(&mut self.keep_aspect, "keep aspect");
                    if self.keep_aspect && width.changed() {
                        *h = (f64::from(*w) / aspect).round().max(1.0) as u32;
                    } else if self.keep_aspect && height.changed() {
                        *w = (f64::from(*h) * aspect).round().max(1.0) as u32;
                    }
                });
                ui.end_row();
                ui.label("Samples");
                let samples = ui.add(egui::Slider::new(&mut self.samples, 1..=256).logarithmic(true));
                name(&samples, "Export samples");
                ui.end_row();
            });
            ui.add_space(6.0);
            match exporting {
                Some(share) => {
                    ui.horizontal(|ui| {
                        ui.add(egui::ProgressBar::new(share).desired_width(280.0).show_percentage());
                        if ui.button("Cancel").clicked() {
                            answer = ExportAnswer::Cancel;
                        }
                    });
                }
                None => {
                    let files = self.paths();
                    let text = match files.as_slice() {
                        [] => "Name a file and choose a kind.".to_owned(),
                        files => {
                            let names: Vec<String> = files.iter().map(|p| p.display().to_string()).collect();
                            format!("Writes {}", names.join(" and "))
                        }
                    };
                    ui.weak(text);
                    if ui.add_enabled(!files.is_empty(), egui::Button::new("Export")).clicked() {
                        answer = ExportAnswer::Start;
                    }
                }
            }
        });
        self.open = open;
        answer
    }
}

/// What the user wants of the export window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportAnswer {
    /// Nothing yet.
    Nothing,
    /// Begin.
    Start,
    /// Stop.
    Cancel,
}

/// Asks what to do with changes that are not saved.
pub fn ask_unsaved(ctx: &egui::Context, scene: &str) -> Option<UnsavedAnswer> {
    let mut answer = None;
    let shown = egui::Modal::new(egui::Id::unique("unsaved")).show(ctx, |ui| {
        ui.set_width(360.0);
        ui.heading("Save the changes?");
        ui.label(format!("The scene {scene} has changes that are not saved."));
        ui.add_space(6.0);
        ui.horizontal(|ui| {
            for (text, what) in [
                ("Save", UnsavedAnswer::Save),
                ("Discard", UnsavedAnswer::Discard),
                ("Go back", UnsavedAnswer::Stay),
            ] {
                if ui.button(text).clicked() {
                    answer = Some(what);
                }
            }
        });
    });
    if shown.should_close() { Some(UnsavedAnswer::Stay) } else { answer }
}

/// What to do with changes that are not saved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnsavedAnswer {
    /// Save, then go on.
    Save,
    /// Go on without them.
    Discard,
    /// Do not go on.
    Stay,
}
