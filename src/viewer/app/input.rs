//! Keyboard shortcuts, and the actions on lights, meshes, camera and water.

use std::path::Path;
use std::time::{Duration, Instant};

use eframe::egui;
use egui::{Key, KeyboardShortcut, Modifiers};

use super::{LIGHT, MESH, Viewer, preference};
use crate::picture::Layer;
use crate::scene::Raw;
use crate::viewer::navigate::Pose;
use crate::viewer::settings::Theme;
use crate::viewer::transfer::Purpose;
use crate::viewer::viewport::Tool;

/// Commands of the Edit menu and of keys for the selected light or mesh.
#[derive(Clone, Copy, Debug)]
pub(super) enum PartCommand {
    Rename,
    Duplicate,
    Remove,
}

impl PartCommand {
    /// All commands, with their verbs in the menu and their keys.
    pub(super) const ALL: [(PartCommand, &'static str, &'static str); 3] = [
        (PartCommand::Rename, "Rename", "F2"),
        (PartCommand::Duplicate, "Duplicate", "Ctrl+D"),
        (PartCommand::Remove, "Remove", "Delete"),
    ];
}

impl Viewer {
    pub(super) fn add_light(&mut self, kind: &str) {
        let added = self.lights.add(&mut self.document, kind);
        self.report(added);
    }

    /// Deselects the light or the mesh that was selected before the other: keys and handles are for one
    /// thing.
    pub(super) fn select_one(&mut self) {
        let light = self.lights.selected().map(str::to_owned);
        if light.is_some() && self.meshes.selected().is_some() {
            match light == self.last_light {
                true => self.lights.select(None),
                false => self.meshes.select(None),
            }
        }
        self.last_light = light;
    }

    /// Applies a command to the selected light or mesh, if there is one.
    pub(super) fn apply_to_selected(&mut self, command: PartCommand) {
        self.select_one();
        let (light, mesh) = (self.lights.selected(), self.meshes.selected());
        let Some(name) = light.or(mesh).map(str::to_owned) else { return };
        let (is_light, document) = (light.is_some(), &mut self.document);
        match command {
            PartCommand::Rename => {
                // The name is edited in its list, so that must be visible.
                self.settings.parameters = true;
                self.parameters.search.clear();
                match is_light {
                    true => self.lights.begin_renaming(&name),
                    false => self.meshes.begin_renaming(&name),
                }
            }
            PartCommand::Duplicate if is_light => self.lights.duplicate(document, &name),
            PartCommand::Duplicate => self.meshes.duplicate(document, &name),
            PartCommand::Remove if is_light => self.lights.remove(document, &name),
            PartCommand::Remove => {
                let removed = self.meshes.remove(document, &name);
                self.report(removed);
            }
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
            self.apply_to_selected(PartCommand::Duplicate);
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

    /// Plain keys that act on lights, meshes, camera, water and renderer.
    fn action_keys(&mut self, ctx: &egui::Context) {
        let plain = |key| ctx.input_mut(|i| i.consume_key(Modifiers::NONE, key));
        if plain(Key::F2) {
            self.apply_to_selected(PartCommand::Rename);
        }
        if plain(Key::Delete) {
            self.apply_to_selected(PartCommand::Remove);
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
            match (self.lights.is_dragging(), self.meshes.is_dragging()) {
                // egui ends the drag by itself.
                (true, _) => self.document.cancel(LIGHT),
                (_, true) => self.document.cancel(MESH),
                _ => self.worker.stop(),
            }
        }
    }

    pub(super) fn set_theme(&mut self, ctx: &egui::Context, theme: Theme) {
        self.settings.theme = theme;
        ctx.set_theme(preference(theme));
    }

    /// Moves the camera. Moves of the same `gesture` are one step of undo.
    pub(super) fn move_camera(&mut self, pose: Pose, gesture: Option<&str>) {
        let set = self.document.set_all(&self.document.camera_edits(&pose), gesture);
        self.report(set);
    }

    /// Moves the camera so that the whole scene is in the picture.
    pub(super) fn frame_all(&mut self) {
        let scene = self.document.scene();
        let aspect = f64::from(scene.image.width) / f64::from(scene.image.height);
        let pose = self.document.pose().frame_all(scene, aspect);
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
