//! Rays asked for by a click: traced on a thread of their own, for a fine rock takes a tenth of a second.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use eframe::egui;

use super::worker::Picture;
use crate::engine::cpu::ray::{RayReport, inspect};

/// What the ray is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// The pixel inspector.
    Inspect,
    /// The camera's new target.
    Focus,
}

struct Question {
    aim: Aim,
    picture: Arc<Picture>,
    /// Pixels at full resolution.
    size: [u32; 2],
    /// 0 to 1.
    place: [f32; 2],
}

/// Answers the latest question of each kind, one at a time.
#[derive(Default)]
pub struct Probe {
    running: Option<Receiver<(Aim, RayReport)>>,
    waiting: Vec<Question>,
}

impl Probe {
    /// Asks for the ray through a place (0 to 1) of a picture that has `size` pixels at full resolution.
    pub fn ask(&mut self, aim: Aim, picture: &Arc<Picture>, size: [u32; 2], place: [f32; 2]) {
        self.waiting.retain(|question| question.aim != aim);
        self.waiting.push(Question { aim, picture: picture.clone(), size, place });
    }

    /// Whether an answer is still to come.
    pub fn is_busy(&self) -> bool {
        self.running.is_some() || !self.waiting.is_empty()
    }

    /// The next answer, if there is one.
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
            // Without a thread there is no answer, and the next click asks again.
            let _ = std::thread::Builder::new().name("probe".into()).spawn(move || {
                // The window may have gone meanwhile.
                let _ = send.send((question.aim, trace(&question)));
                wake.request_repaint();
            });
            self.running = Some(receive);
        }
        answer
    }
}

fn trace(question: &Question) -> RayReport {
    let Question { picture, size, place: [x, y], .. } = question;
    let mut scene = (*picture.scene).clone();
    let image = &mut scene.edit().image;
    [image.width, image.height] = *size;
    let pixel = [(x * size[0] as f32) as u32, (y * size[1] as f32) as u32];
    inspect(&scene, &picture.volume, &picture.mesh, pixel)
}
