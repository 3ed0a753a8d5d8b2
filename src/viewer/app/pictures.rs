//! Requests for pictures and rays, and their results.

use std::sync::Arc;
use std::time::Instant;

use eframe::egui;
use egui::Ui;

use super::{Inspector, LIGHT, MESH, Viewer};
use crate::picture::Layer;
use crate::scene::Raw;
use crate::viewer::document::camera_in;
use crate::viewer::layer_image::show_legend;
use crate::viewer::probe::Aim;
use crate::viewer::viewport::{self, Content, Selection, Tool};
use crate::viewer::worker::Request;

impl Viewer {
    /// Shows the picture with its handles and legend, and applies the user's actions in it.
    pub(super) fn viewport(&mut self, ui: &mut Ui) {
        let image = &self.document.scene().image;
        let content = Content {
            texture: self.texture.as_ref(),
            aspect: image.width as f32 / image.height as f32,
            marked: self.marked.filter(|_| self.settings.inspectors && self.inspector == Inspector::Pixel),
            tool: self.tool,
            pose: self.document.pose(),
            meshes: &self.document.scene().meshes,
        };
        let selection = Selection { lights: &mut self.lights, meshes: &mut self.meshes };
        let (rect, actions) = viewport::show(ui, &content, self.document.values(), selection);
        if let Some(picture) = &self.picture
            && picture.layer != Layer::Rgb
        {
            let at = rect.left_bottom() + egui::vec2(10.0, -10.0);
            egui::Area::new(egui::Id::unique("legend"))
                .pivot(egui::Align2::LEFT_BOTTOM)
                .fixed_pos(at)
                .order(egui::Order::Middle)
                .interactable(false)
                .show(ui.ctx(), |ui| show_legend(ui, picture.layer, &picture.legend));
        }
        if let Some(pose) = actions.pose {
            self.move_camera(pose, Some("camera"));
        }
        for (edits, gesture) in [(actions.lights, LIGHT), (actions.meshes, MESH)] {
            let mut edits: Vec<(&str, Raw)> = edits.iter().map(|(k, v)| (k.as_str(), v.clone())).collect();
            // A camera that moved with the mesh would take the pointer's place on it along.
            let mesh = self.meshes.selected().filter(|_| gesture == MESH && !edits.is_empty());
            if mesh.is_some_and(|mesh| camera_in(self.document.values(), mesh).is_some()) {
                edits.extend(self.document.camera_edits(&self.document.pose()));
            }
            if !edits.is_empty() {
                let set = self.document.set_all(&edits, Some(gesture));
                self.report(set);
            }
        }
        if actions.deselect {
            self.lights.select(None);
            self.meshes.select(None);
        }
        if let Some(position) = actions.inspect {
            if self.tool == Tool::Inspect {
                self.settings.inspectors = true;
                self.inspector = Inspector::Pixel;
            }
            self.marked = Some(position);
            self.inspect_again();
        }
        if let Some(position) = actions.focus {
            self.ask(Aim::Focus, position);
        }
        // After this frame's clicks, so that their rays are traced before the next frame.
        self.receive_rays(ui.ctx());
        let pixels = rect.size() * ui.ctx().pixels_per_point();
        self.request([pixels.x.round() as u32, pixels.y.round() as u32]);
    }

    /// Takes news from the render thread: its state, its messages and its newest picture.
    pub(super) fn receive(&mut self, ctx: &egui::Context) {
        let (picture, messages, exports_done) = {
            let mut state = self.worker.state();
            self.busy = state.busy;
            if self.engine != state.engine {
                self.engine = state.engine.clone();
            }
            self.fault = state.fault.clone();
            (state.picture.clone(), std::mem::take(&mut state.messages), state.exports_done)
        };
        for message in messages {
            self.say(message.kind, message.text);
        }
        if exports_done != self.exports_done {
            self.exports_done = exports_done;
            self.exporting = false;
        }
        let Some(picture) = picture else { return };
        if self.picture.as_ref().is_some_and(|old| Arc::ptr_eq(old, &picture)) {
            return;
        }
        let image = picture.image.clone();
        // Only colours may be interpolated: between two quads or two depths there is no value.
        let filter = match picture.layer {
            Layer::Rgb => egui::TextureOptions::LINEAR,
            _ => egui::TextureOptions::NEAREST,
        };
        match &mut self.texture {
            Some(texture) => texture.set(image, filter),
            None => self.texture = Some(ctx.load_texture("picture", image, filter)),
        }
        if picture.first {
            // The latency is measured when the next frame begins: only then was this one drawn.
            ctx.request_repaint();
        }
        self.measured.picture(picture.first.then_some(picture.asked), picture.cost);
        self.picture = Some(picture);
        self.inspect_again();
    }

    /// Requests a picture of `size` pixels of the current scene, unless it is the last request again.
    pub(super) fn request(&mut self, size: [u32; 2]) {
        if size.contains(&0) {
            return;
        }
        let scene = self.document.scene();
        let samples = scene.image.samples.max(self.settings.refine_to);
        let same = self.asked.as_ref().is_some_and(|(old, old_size, old_samples, old_layer)| {
            Arc::ptr_eq(old, scene) && (*old_size, *old_samples, *old_layer) == (size, samples, self.layer)
        });
        if same {
            return;
        }
        self.serial += 1;
        self.asked = Some((scene.clone(), size, samples, self.layer));
        self.worker.request(Request {
            serial: self.serial,
            asked: Instant::now(),
            scene: scene.clone(),
            size,
            samples,
            layer: self.layer,
        });
    }

    /// Requests the ray of the marked pixel again, if the pixel inspector is shown.
    pub(super) fn inspect_again(&mut self) {
        if let Some(position) = self.marked
            && self.settings.inspectors
            && self.inspector == Inspector::Pixel
        {
            self.ask(Aim::Inspect, position);
        }
    }

    /// Requests the ray through a position in the image (0 to 1), at full resolution.
    pub(super) fn ask(&mut self, aim: Aim, position: [f32; 2]) {
        if let (Some(picture), Some((_, size, ..))) = (&self.picture, &self.asked) {
            self.probe.ask(aim, picture, *size, position);
        }
    }

    /// Takes the ray that was traced, if there is one, for the inspector or the camera.
    pub(super) fn receive_rays(&mut self, ctx: &egui::Context) {
        match self.probe.answer(ctx) {
            Some((Aim::Inspect, ray)) => self.ray = Some(ray),
            Some((Aim::Focus, ray)) => {
                if let Some(point) = ray.surface_point() {
                    let pose = self.document.pose().focus(point);
                    self.move_camera(pose, None);
                }
            }
            None => {}
        }
    }
}
