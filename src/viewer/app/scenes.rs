//! Opening, saving and exporting scenes.

use std::path::{Path, PathBuf};

use eframe::egui;

use super::{Leaving, Viewer};
use crate::scene::Raw;
use crate::viewer::document::Document;
use crate::viewer::lights::Lights;
use crate::viewer::meshes::Meshes;
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
        let mut limits = self.document.limits().clone();
        // Folders of meshes that were dropped may be gone by now.
        limits.allow_paths.retain(|folder| folder.is_dir());
        match Document::open(scene, &[], &limits) {
            Ok(document) => {
                if let Some(path) = &document.path {
                    self.settings.remember(path);
                }
                self.first_pose = document.pose();
                self.document = document;
                self.lights = Lights::default();
                self.meshes = Meshes::default();
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
                self.say_saved(path);
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

    /// Says that the scene was saved, and what `taki render` needs for meshes outside its folder.
    fn say_saved(&mut self, path: &Path) {
        let folders = self.document.folders_to_allow();
        if folders.is_empty() {
            self.say(MessageKind::Note, format!("saved {}", path.display()));
            return;
        }
        let options = folders.iter().map(|folder| format!(" --allow-path {}", folder.display()));
        let text = format!(
            "saved {0}; it uses meshes outside its folder, so render it with taki render {0}{1}",
            path.display(),
            options.collect::<String>()
        );
        self.say(MessageKind::Warning, text);
    }

    /// Uses files that were dropped on the window. Files that come with a mesh, such as its textures, are
    /// read when it is.
    pub(super) fn drop_files(&mut self, paths: &[PathBuf]) {
        let with_mesh = paths.iter().any(|path| is_mesh(path));
        for path in paths.iter().filter(|path| !(with_mesh && comes_with_mesh(path))) {
            self.drop_file(path);
        }
    }

    /// Opens a scene that was dropped on the window, or uses a dropped volume, environment or mesh in the
    /// scene.
    fn drop_file(&mut self, path: &Path) {
        match extension(path).as_str() {
            "toml" => self.open(path),
            "npz" => {
                let set = self.document.use_volume_file(path);
                self.report(set);
            }
            "hdr" | "exr" => {
                let set = self.document.use_environment_file(path);
                self.report(set);
            }
            _ if is_mesh(path) => self.add_mesh(path),
            _ => {
                let text = format!(
                    "{} is neither a scene (.toml), a volume (.npz), an environment (.hdr, .exr) nor a mesh \
                     (.glb, .gltf, .obj)",
                    path.display()
                );
                self.say(MessageKind::Error, text);
            }
        }
    }

    /// Adds the mesh of a file, frames it and selects it.
    fn add_mesh(&mut self, path: &Path) {
        let image = &self.document.scene().image;
        let aspect = f64::from(image.width) / f64::from(image.height);
        match self.document.add_mesh(path, aspect) {
            Ok(added) => {
                self.meshes.show(&added.name);
                added.notes.into_iter().for_each(|note| self.say(MessageKind::Warning, note));
            }
            Err(e) => self.say(MessageKind::Error, e.to_string()),
        }
    }

    /// Opens what the user named in the dialog: a scene, or a mesh to add to this one.
    pub(super) fn open_named(&mut self, path: &Path) {
        if is_mesh(path) {
            self.paths.close();
            self.add_mesh(path);
        } else {
            self.open(path);
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

/// Extension of a file in lower case.
fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Whether a file is one of those from which meshes are read.
fn is_mesh(path: &Path) -> bool {
    ["glb", "gltf", "obj"].contains(&extension(path).as_str())
}

/// Whether a file is one that a mesh's file refers to.
fn comes_with_mesh(path: &Path) -> bool {
    ["bin", "jpeg", "jpg", "mtl", "png"].contains(&extension(path).as_str())
}
