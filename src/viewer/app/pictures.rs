//! Pictures and rays: asked for, taken from the render thread, shown.

use std::sync::Arc;
use std::time::Instant;

use eframe::egui;

use super::{Inspector, Viewer};
use crate::picture::Layer;
use crate::viewer::navigate::Pose;
use crate::viewer::probe::Aim;
use crate::viewer::worker::Request;

impl Viewer {
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
        // Between two quads or two depths there is nothing.
        let smooth = match picture.layer {
            Layer::Rgb => egui::TextureOptions::LINEAR,
            _ => egui::TextureOptions::NEAREST,
        };
        match &mut self.texture {
            Some(texture) => texture.set(image, smooth),
            None => self.texture = Some(ctx.load_texture("picture", image, smooth)),
        }
        if picture.first {
            // The next frame knows that this one was drawn.
            ctx.request_repaint();
        }
        self.measured.picture(picture.first.then_some(picture.asked), picture.cost);
        self.picture = Some(picture);
        self.inspect_again();
    }

    /// Asks for what the window shows now, if that is something new.
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

    pub(super) fn inspect_again(&mut self) {
        if let Some(place) = self.marked
            && self.settings.inspectors
            && self.inspector == Inspector::Pixel
        {
            self.ask(Aim::Inspect, place);
        }
    }

    /// Asks for the ray through a place in the image, at full resolution.
    pub(super) fn ask(&mut self, aim: Aim, place: [f32; 2]) {
        if let (Some(picture), Some((_, size, ..))) = (&self.picture, &self.asked) {
            self.probe.ask(aim, picture, *size, place);
        }
    }

    pub(super) fn receive_rays(&mut self, ctx: &egui::Context) {
        match self.probe.answer(ctx) {
            Some((Aim::Inspect, ray)) => self.ray = Some(ray),
            Some((Aim::Focus, ray)) => {
                if let Some(point) = ray.surface_point() {
                    let pose = Pose::of(self.document.values()).focus(point.as_dvec3());
                    self.move_camera(pose, None);
                }
            }
            None => {}
        }
    }
}
