//! Keyboard shortcuts, and the actions on lights, camera and water.

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

/// Commands of the Edit menu and of keys for the selected light.
#[derive(Clone, Copy, Debug)]
pub(super) enum LightCommand {
    Rename,
    Duplicate,
    Remove,
}

impl LightCommand {
    /// All commands, with their menu texts and keys.
    pub(super) const ALL: [(LightCommand, &'static str, &'static str); 3] = [
        (LightCommand::Rename, "Rename the light", "F2"),
        (LightCommand::Duplicate, "Duplicate the light", "Ctrl+D"),
        (LightCommand::Remove, "Remove the light", "Delete"),
    ];
}

impl Viewer {
    pub(super) fn add_light(&mut self, kind: &str) {
        let added = self.lights.add(&mut self.document, kind);
        self.report(added);
    }

    /// Applies a command to the selected light, if there is one.
    pub(super) fn apply_to_light(&mut self, command: LightCommand) {
        let Some(light) = self.lights.selected().map(str::to_owned) else { return };
        match command {
            LightCommand::Rename => {
                // The name is edited in the list of lights, so that must be visible.
                self.settings.parameters = true;
                self.parameters.search.clear();
                self.lights.begin_renaming(&light);
            }
            LightCommand::Duplicate => self.lights.duplicate(&mut self.document, &light),
            LightCommand::Remove => self.lights.remove(&mut self.document, &light),
        }
    }

    /// Handles the shortcuts pressed in this frame.
    pub(super) fn shortcuts(&mut self, ctx: &egui::Context) {
        // The dialog about unsaved changes takes all keys; Esc answers it.
        if self.leaving.is_some() {
            return;
        }
        self.command_keys(ctx);
        // A text field that is being edited takes the plain keys.
        if !ctx.egui_wants_keyboard_input() && !self.paths.is_open() {
            self.choice_keys(ctx);
            self.action_keys(ctx);
        }
    }

    /// Shortcuts with Ctrl.
    fn command_keys(&mut self, ctx: &egui::Context) {
        let hit =
            |key, modifiers| ctx.input_mut(|i| i.consume_shortcut(&KeyboardShortcut::new(modifiers, key)));
        const CTRL: Modifiers = Modifiers::COMMAND;
        let ctrl_shift = Modifiers::COMMAND | Modifiers::SHIFT;
        // Shortcuts with Shift first: Ctrl+Z also matches Ctrl+Shift+Z.
        if hit(Key::S, ctrl_shift) {
            self.ask_where_to_save();
        } else if hit(Key::S, CTRL) {
            self.save();
        } else if hit(Key::Z, ctrl_shift) || hit(Key::Y, CTRL) {
            self.document.redo();
        } else if hit(Key::Z, CTRL) {
            self.document.undo();
        } else if hit(Key::D, CTRL) {
            self.apply_to_light(LightCommand::Duplicate);
        } else if hit(Key::C, ctrl_shift) {
            self.copy_command(ctx);
        } else if hit(Key::O, CTRL) {
            self.paths.ask(Purpose::Open, Path::new(""));
        } else if hit(Key::E, CTRL) {
            self.open_export();
        } else if hit(Key::Q, CTRL) {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    /// Plain keys that choose a tool, a layer or what is shown.
    fn choice_keys(&mut self, ctx: &egui::Context) {
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
        if plain(Key::G) {
            self.gallery.open = !self.gallery.open;
        }
        if plain(Key::Tab) {
            self.settings.parameters = !self.settings.parameters;
        }
        if plain(Key::V) {
            self.settings.inspectors = !self.settings.inspectors;
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
    }

    /// Plain keys that act on lights, camera, water and renderer.
    fn action_keys(&mut self, ctx: &egui::Context) {
        let plain = |key| ctx.input_mut(|i| i.consume_key(Modifiers::NONE, key));
        if plain(Key::F2) {
            self.apply_to_light(LightCommand::Rename);
        }
        if plain(Key::Delete) {
            self.apply_to_light(LightCommand::Remove);
        }
        if plain(Key::Home) {
            self.move_camera(self.first_pose, None);
        }
        if plain(Key::F) {
            self.frame_all();
        }
        if plain(Key::Space) {
            self.playing = !self.playing;
        }
        if plain(Key::Escape) {
            self.worker.stop();
        }
    }

    pub(super) fn set_theme(&mut self, ctx: &egui::Context, theme: Theme) {
        self.settings.theme = theme;
        ctx.set_theme(preference(theme));
    }

    /// Moves the camera. Moves of the same `gesture` are one step of undo.
    pub(super) fn move_camera(&mut self, pose: Pose, gesture: Option<&str>) {
        let set = self.document.set_all(&pose.edits(), gesture);
        self.report(set);
    }

    /// Moves the camera so that the whole scene is in the picture.
    pub(super) fn frame_all(&mut self) {
        let scene = self.document.scene();
        let aspect = f64::from(scene.image.width) / f64::from(scene.image.height);
        let pose = Pose::of(self.document.values()).frame_all(scene, aspect);
        self.move_camera(pose, None);
    }

    /// Moves the water by the time since the last frame, while it plays.
    pub(super) fn play(&mut self, ctx: &egui::Context) {
        if !self.playing {
            self.last_flow = None;
            return;
        }
        let now = Instant::now();
        let seconds = self.last_flow.replace(now).map_or(0.0, |last| (now - last).as_secs_f64());
        let flow = f64::from(self.document.values().float("volume.flow"));
        // A shift by a whole length gives the same picture, so the loop has no seam. The step is limited so
        // that the water does not jump after the window has been idle.
        let next = (flow + seconds.min(0.5) * self.settings.flow_speed).rem_euclid(1.0);
        let set = self.document.set_quietly("volume.flow", &Raw::Float(f64::from(next as f32)));
        self.report(set);
        // More steps than the screen shows would only take time from the renderer.
        ctx.request_repaint_after(Duration::from_millis(16));
    }
}
