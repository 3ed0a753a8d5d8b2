//! Traces the ray through a clicked pixel on a thread of its own, because finely subdivided rock takes a
//! tenth of a second.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use eframe::egui;

use super::worker::Picture;
use crate::engine::cpu::ray::{RayReport, inspect};

/// Purpose of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// Shows the ray in the pixel inspector.
    Inspect,
    /// Moves the camera's target to the surface that the ray hits.
    Focus,
}

struct Question {
    aim: Aim,
    picture: Arc<Picture>,
    /// Size of the picture at full resolution, pixels.
    size: [u32; 2],
    /// Position in the image, 0 to 1.
    position: [f32; 2],
}

/// Answers the latest question of each [`Aim`], one at a time.
#[derive(Default)]
pub struct Probe {
    running: Option<Receiver<(Aim, RayReport)>>,
    waiting: Vec<Question>,
}

impl Probe {
    /// Requests the ray through a position (0 to 1) of a picture that has `size` pixels at full resolution.
    pub fn ask(&mut self, aim: Aim, picture: &Arc<Picture>, size: [u32; 2], position: [f32; 2]) {
        self.waiting.retain(|question| question.aim != aim);
        self.waiting.push(Question { aim, picture: picture.clone(), size, position });
    }

    /// Whether an answer is pending.
    pub fn is_busy(&self) -> bool {
        self.running.is_some() || !self.waiting.is_empty()
    }

    /// Returns the next answer if it is ready, and starts on the next question.
    pub fn answer(&mut self, ctx: &egui::Context) -> Option<(Aim, RayReport)> {
        let answer = match self.running.as_ref().map(Receiver::try_recv) {
            Some(Err(TryRecvError::Empty)) => return None,
            Some(Ok(answer)) => Some(answer),
            Some(Err(TryRecvError::Disconnected)) | None => None,
        };
        self.running = None;
        if !self.waiting.is_empty() {
            let question = self.waiting.remove(0);
            let (send, receive) = channel();
            let wake = ctx.clone();
            // If the thread cannot start, there is no answer. The next click asks again.
            let _ = std::thread::Builder::new().name("probe".into()).spawn(move || {
                // Sending fails if the window was closed meanwhile.
                let _ = send.send((question.aim, trace(&question)));
                wake.request_repaint();
            });
            self.running = Some(receive);
        }
        answer
    }
}

fn trace(question: &Question) -> RayReport {
    let Question { picture, size, position: [x, y], .. } = question;
    let mut scene = (*picture.scene).clone();
    let image = &mut scene.edit().image;
    [image.width, image.height] = *size;
    let pixel = [(x * size[0] as f32) as u32, (y * size[1] as f32) as u32];
    inspect(&scene, &*picture.volumes, &picture.mesh, pixel)
}
