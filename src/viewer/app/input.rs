//! Keys, and what moves camera and water.

use std::path::Path;
use std::time::{Duration, Instant};

use eframe::egui;
use egui::{Key, KeyboardShortcut, Modifiers};

use super::{Viewer, preference};
use crate::picture::Layer;
use crate::scene::Raw;
use crate::viewer::navigate::Pose;
use crate::viewer::settings::Theme;
use crate::viewer::transfer::Purpose;
use crate::viewer::viewport::Tool;

/// What the Edit menu and keys do with the selected light.
#[derive(Clone, Copy, Debug)]
pub(super) enum LightCommand {
    Rename,
    Duplicate,
    Remove,
}

impl LightCommand {
    /// All, with their words and keys.
    pub(super) const ALL: [(LightCommand, &'static str, &'static str); 3] = [
        (LightCommand::Rename, "Rename the light", "F2"),
        (LightCommand::Duplicate, "Duplicate the light", "Ctrl+D"),
        (LightCommand::Remove, "Remove the light", "Delete"),
    ];
}

impl Viewer {
    pub(super) fn add_light(&mut self, kind: &str) {
        let added = self.lights.add(&mut self.document, kind);
        self.tell(added);
    }

    /// Does something with the selected light, if there is one.
    pub(super) fn with_light(&mut self, command: LightCommand) {
        let Some(light) = self.lights.selected().map(str::to_owned) else { return };
        match command {
            LightCommand::Rename => {
                // Its name is written in the list.
                self.settings.parameters = true;
                self.parameters.search.clear();
                self.lights.begin_renaming(&light);
            }
            LightCommand::Duplicate => self.lights.duplicate(&mut self.document, &light),
            LightCommand::Remove => self.lights.remove(&mut self.document, &light),
        }
    }

    pub(super) fn shortcuts(&mut self, ctx: &egui::Context) {
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
        } else if hit(Key::D, CTRL) {
            self.with_light(LightCommand::Duplicate);
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
        if plain(Key::F2) {
            self.with_light(LightCommand::Rename);
        }
        if plain(Key::Delete) {
            self.with_light(LightCommand::Remove);
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

    pub(super) fn set_theme(&mut self, ctx: &egui::Context, theme: Theme) {
        self.settings.theme = theme;
        ctx.set_theme(preference(theme));
    }

    pub(super) fn move_camera(&mut self, pose: Pose, gesture: Option<&str>) {
        let set = self.document.set_all(&pose.edits(), gesture);
        self.tell(set);
    }

    pub(super) fn frame_all(&mut self) {
        let scene = self.document.scene();
        let aspect = f64::from(scene.image.width) / f64::from(scene.image.height);
        let pose = Pose::of(self.document.values()).frame_all(scene, aspect);
        self.move_camera(pose, None);
    }

    pub(super) fn flow(&mut self, ctx: &egui::Context) {
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
}
