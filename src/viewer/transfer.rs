//! Dialogs for files: the path of a scene, the export of pictures, and unsaved changes.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};

use eframe::egui;

use super::parameters::name;
use crate::job::Depth;
use crate::output::frame::Format;

/// Purpose of the path that a dialog asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Opens a scene.
    Open,
    /// Saves the scene.
    Save,
}

/// A dialog that asks for a path, which the user types or picks in the system's file dialog. Typing also
/// works where the system has no file dialog.
#[derive(Default)]
pub struct PathDialog {
    /// Purpose of the open dialog. `None` while it is closed.
    open: Option<Purpose>,
    text: String,
    /// Why the last path could not be used.
    pub fault: Option<String>,
    /// Existing file that the user may replace: the dialog or the system's has asked.
    replaced: Option<PathBuf>,
    /// Answer of the system's file dialog, while that is open.
    picked: Option<Receiver<Option<PathBuf>>>,
    /// Whether the text field is to get the keyboard in the next frame.
    focus: bool,
}

impl PathDialog {
    /// Opens the dialog with a suggested path.
    pub fn ask(&mut self, purpose: Purpose, guess: &Path) {
        *self = PathDialog {
            open: Some(purpose),
            text: guess.display().to_string(),
            focus: true,
            ..Default::default()
        };
    }

    /// Closes the dialog.
    pub fn close(&mut self) {
        *self = PathDialog::default();
    }

    /// Whether the dialog is open.
    pub fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// Whether the user agreed to replace the existing file `path`. Otherwise asks and says `why`.
    pub fn may_replace(&mut self, path: &Path, why: &str) -> bool {
        if self.replaced.as_deref() == Some(path) {
            return true;
        }
        self.fault = Some(format!("{} {why}", path.display()));
        self.replaced = Some(path.to_owned());
        false
    }

    /// Shows the dialog. Returns the path that the user gave. `also` adds contents, such as recent files, and
    /// returns the path chosen there.
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
            self.replaced.clone_from(&path);
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
                let replaces = self.replaced.as_deref() == Some(Path::new(self.text.trim()));
                let verb = if replaces { "Replace" } else { verb };
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

/// Opens the system's file dialog on a thread of its own, so that the window continues to draw.
fn browse(ctx: &egui::Context, purpose: Purpose, guess: &Path) -> Receiver<Option<PathBuf>> {
    let (send, receive) = channel();
    let wake = ctx.clone();
    let folder = guess.parent().filter(|p| !p.as_os_str().is_empty()).map(Path::to_owned);
    let file = guess.file_name().map(|f| f.to_string_lossy().into_owned()).unwrap_or_default();
    // A dialog that cannot open counts as cancelled. The path can still be typed.
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

/// The dialog that exports pictures.
pub struct ExportDialog {
    /// Whether it is open.
    pub open: bool,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Samples per pixel.
    pub samples: u32,
    /// Path of the files without extension.
    pub path: String,
    /// Formats, and whether to write a file of each.
    pub formats: [(Format, bool); 5],
    /// Whether files of formats that have 16 bits get them.
    pub deep: bool,
    /// Whether a change of width or height keeps the picture's aspect.
    pub keep_aspect: bool,
    /// Files to write, while the dialog asks whether to replace those of them that exist.
    asked: Vec<PathBuf>,
}

impl Default for ExportDialog {
    fn default() -> Self {
        ExportDialog {
            open: false,
            size: [1280, 720],
            samples: 16,
            path: String::new(),
            formats: Format::ALL.map(|format| (format, format == Format::Png)),
            deep: false,
            keep_aspect: true,
            asked: Vec::new(),
        }
    }
}

impl ExportDialog {
    /// The files to write.
    pub fn paths(&self) -> Vec<PathBuf> {
        let path = self.path.trim();
        let named = Format::of(Path::new(path)).and_then(|_| path.rsplit_once('.'));
        let stem = named.map_or(path, |(stem, _)| stem);
        self.formats
            .into_iter()
            .filter(|(_, chosen)| *chosen && !stem.is_empty())
            .map(|(format, _)| PathBuf::from(format!("{stem}.{}", format.extension())))
            .collect()
    }

    /// The depth of developed pictures.
    pub fn depth(&self) -> Depth {
        let has = |bits| self.formats.iter().any(|(format, on)| *on && format.depths().contains(&bits));
        let bits = if self.deep { 16 } else { 8 };
        Depth { bits: Some(bits).filter(|bits| has(*bits)), linear: false }
    }

    /// Shows the dialog for a picture of this aspect. `exporting` is the finished share of a running export.
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
                    for (format, chosen) in &mut self.formats {
                        ui.checkbox(chosen, format.name()).on_hover_text(about(*format));
                    }
                });
                ui.end_row();
                ui.label("Depth");
                ui.checkbox(&mut self.deep, "16 bits").on_hover_text(
                    "PNG and TIFF files get 16 bits per channel, for programs that change the picture",
                );
                ui.end_row();
                ui.label("Size");
                ui.horizontal(|ui| self.size_fields(ui, aspect));
                ui.end_row();
                ui.label("Samples");
                let samples = ui.add(egui::Slider::new(&mut self.samples, 1..=256).logarithmic(true));
                name(&samples, "Export samples");
                ui.end_row();
            });
            ui.add_space(6.0);
            answer = match exporting {
                Some(share) => progress(ui, share),
                None => self.start_button(ui),
            };
        });
        self.open = open;
        answer
    }

    fn size_fields(&mut self, ui: &mut egui::Ui, aspect: f64) {
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
    }

    /// The names of the files to write, and the button that starts the export. Asks before files are
    /// replaced.
    fn start_button(&mut self, ui: &mut egui::Ui) -> ExportAnswer {
        let files = self.paths();
        let existing: Vec<PathBuf> = files.iter().filter(|path| path.exists()).cloned().collect();
        if files == self.asked && !existing.is_empty() {
            return self.replace_buttons(ui, &existing);
        }
        match files.is_empty() {
            true => ui.weak("Enter a file name and choose a kind."),
            false => ui.weak(format!("Writes {}", listed(&files))),
        };
        let start = ui.add_enabled(!files.is_empty(), egui::Button::new("Export")).clicked();
        match (start, existing.is_empty()) {
            (true, true) => return ExportAnswer::Start { overwrite: false },
            (true, false) => self.asked = files,
            (false, _) => self.asked.clear(),
        }
        ExportAnswer::Nothing
    }

    /// The question whether to replace `existing` files.
    fn replace_buttons(&mut self, ui: &mut egui::Ui, existing: &[PathBuf]) -> ExportAnswer {
        let exist = if existing.len() == 1 { "exists" } else { "exist" };
        ui.colored_label(ui.visuals().warn_fg_color, format!("{} {exist} already.", listed(existing)));
        let answers = ui.horizontal(|ui| [ui.button("Replace").clicked(), ui.button("Go back").clicked()]);
        match answers.inner {
            [false, false] => ExportAnswer::Nothing,
            [replace, _] => {
                self.asked.clear();
                if replace { ExportAnswer::Start { overwrite: true } } else { ExportAnswer::Nothing }
            }
        }
    }
}

/// The names of files, in words.
fn listed(files: &[PathBuf]) -> String {
    let names: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    names.join(" and ")
}

/// Says what a format is for.
fn about(format: Format) -> &'static str {
    match format {
        Format::Png => "sRGB, as shown, exact; 8 or 16 bits per channel",
        Format::Jpeg => "sRGB, as shown, small; 8 bits per channel",
        Format::Tiff => "sRGB, as shown, exact; 8 or 16 bits per channel, for print and retouching",
        Format::Webp => "sRGB, as shown, exact and smaller than PNG; 8 bits per channel",
        Format::Exr => "Linear float32, with depth, uv, quad, normal and more as layers",
    }
}

/// The progress of a running export, with a button that cancels it.
fn progress(ui: &mut egui::Ui, share: f32) -> ExportAnswer {
    let cancel = ui.horizontal(|ui| {
        ui.add(egui::ProgressBar::new(share).desired_width(280.0).show_percentage());
        ui.button("Cancel").clicked()
    });
    if cancel.inner { ExportAnswer::Cancel } else { ExportAnswer::Nothing }
}

/// The user's action in the export dialog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportAnswer {
    /// No action.
    Nothing,
    /// Starts the export.
    Start {
        /// Whether the user agreed to replace existing files.
        overwrite: bool,
    },
    /// Cancels the running export.
    Cancel,
}

/// Shows the dialog about unsaved changes. Returns the user's answer once it is given.
pub fn ask_unsaved(ctx: &egui::Context, scene: &str) -> Option<UnsavedAnswer> {
    let mut answer = None;
    let shown = egui::Modal::new(egui::Id::unique("unsaved")).show(ctx, |ui| {
        ui.set_width(360.0);
        ui.heading("Save the changes?");
        ui.label(format!("The scene {scene} has unsaved changes."));
        ui.add_space(6.0);
        ui.horizontal(|ui| {
            for (text, choice) in [
                ("Save", UnsavedAnswer::Save),
                ("Discard", UnsavedAnswer::Discard),
                ("Go back", UnsavedAnswer::Stay),
            ] {
                if ui.button(text).clicked() {
                    answer = Some(choice);
                }
            }
        });
    });
    if shown.should_close() { Some(UnsavedAnswer::Stay) } else { answer }
}

/// The user's answer to the dialog about unsaved changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnsavedAnswer {
    /// Saves the scene, then continues.
    Save,
    /// Continues without saving.
    Discard,
    /// Returns to the scene.
    Stay,
}
