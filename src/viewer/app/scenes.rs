//! Opening, saving and exporting scenes.

use std::path::{Path, PathBuf};

use eframe::egui;

use super::{Leaving, Viewer};
use crate::scene::Raw;
use crate::viewer::document::Document;
use crate::viewer::lights::Lights;
use crate::viewer::navigate::Pose;
use crate::viewer::transfer::Purpose;
use crate::viewer::worker::{Export, MessageKind};

impl Viewer {
    /// Opens a scene, after asking about unsaved changes.
    pub fn open(&mut self, scene: &Path) {
        if self.document.is_changed() {
            self.leaving = Some(Leaving::Open(scene.to_owned()));
        } else {
            self.open_now(scene);
        }
    }

    pub(super) fn open_now(&mut self, scene: &Path) {
        match Document::open(scene, &[], &self.options.limits) {
            Ok(document) => {
                if let Some(path) = &document.path {
                    self.settings.remember(path);
                }
                self.first_pose = Pose::of(document.values());
                self.document = document;
                self.lights = Lights::default();
                self.marked = None;
                self.ray = None;
                self.playing = false;
                self.paths.close();
            }
            Err(e) if self.paths.is_open() => self.paths.fault = Some(e.to_string()),
            Err(e) => self.say(MessageKind::Error, e.to_string()),
        }
    }

    pub(super) fn save(&mut self) {
        match self.document.path.clone() {
            Some(path) => match self.document.lost_by_saving(&path) {
                Some(why) => {
                    self.ask_where_to_save();
                    self.paths.may_replace(&path, why);
                }
                None => self.save_to(&path),
            },
            None => self.ask_where_to_save(),
        }
    }

    pub(super) fn ask_where_to_save(&mut self) {
        let guess = match &self.document.path {
            Some(path) => path.clone(),
            None => PathBuf::from(format!("{}.toml", self.document.name)),
        };
        self.paths.ask(Purpose::Save, &guess);
    }

    /// Saves the scene to a path that the user gave, after asking whether to replace what is there.
    pub(super) fn save_as(&mut self, path: &Path) {
        match self.document.lost_by_saving(path) {
            Some(why) if !self.paths.may_replace(path, why) => {}
            _ => self.save_to(path),
        }
    }

    pub(super) fn save_to(&mut self, path: &Path) {
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

    pub(super) fn leave(&mut self, leaving: Leaving) {
        match leaving {
            Leaving::Close => self.closing = true,
            Leaving::Open(scene) => self.open_now(&scene),
        }
    }

    /// Opens a scene that was dropped on the window, or uses a dropped volume or environment in the scene.
    pub(super) fn drop_file(&mut self, path: &Path) {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("toml") => self.open(path),
            Some("npz") => {
                let set = self.document.use_volume_file(path);
                self.report(set);
            }
            Some("hdr" | "exr") => {
                let set = self.document.use_environment_file(path);
                self.report(set);
            }
            _ => {
                let text = format!(
                    "{} is neither a scene (.toml), a volume (.npz) nor an environment (.hdr, .exr)",
                    path.display()
                );
                self.say(MessageKind::Error, text);
            }
        }
    }

    pub(super) fn copy_command(&mut self, ctx: &egui::Context) {
        match self.document.command_line() {
            Ok(line) => {
                ctx.copy_text(line);
                let text = "the command line that renders this picture is on the clipboard";
                self.say(MessageKind::Note, text);
            }
            Err(e) => self.say(MessageKind::Error, e.to_string()),
        }
    }

    pub(super) fn open_export(&mut self) {
        let image = &self.document.scene().image;
        self.export.size = [image.width, image.height];
        self.export.samples = image.samples.max(self.settings.refine_to).min(256);
        if self.export.path.is_empty() {
            self.export.path = self.document.name.clone();
        }
        self.export.open = true;
    }

    pub(super) fn start_export(&mut self, overwrite: bool) {
        let edits = [
            ("image.width", i64::from(self.export.size[0])),
            ("image.height", i64::from(self.export.size[1])),
            ("image.samples", i64::from(self.export.samples)),
        ];
        match self.document.variant(&edits.map(|(key, value)| (key, Raw::Int(value)))) {
            Ok(scene) => {
                self.exporting = true;
                let (paths, depth) = (self.export.paths(), self.export.depth());
                self.worker.export(Export { scene, paths, overwrite, depth });
            }
            Err(e) => self.say(MessageKind::Error, e.to_string()),
        }
    }
}
