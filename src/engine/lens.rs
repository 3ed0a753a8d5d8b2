//! A picture through a lens: the mean of pictures through pinholes on it, one for each sample.
//!
//! Rasterisers project all pixels of a pass from one eye, so the point of the lens belongs to the sample and
//! not to the pixel. What does not depend on the eye, such as light volumes, is kept from sample to sample.

use super::options::RenderOptions;
use crate::picture::camera::sample_numbers;
use crate::picture::resolve::develop;
use crate::picture::{Frame, Look, Tone};
use crate::scene::Scene;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::window::Window;

/// Renders a scene by `render`, which knows pinholes alone: once, or once for each sample where the scene has
/// a lens. The layers of the surface are those of the pinhole in the middle of the lens.
///
/// # Errors
/// Errors of `render`.
pub fn through(
    scene: &Scene,
    options: &RenderOptions,
    monitor: &dyn Monitor,
    mut render: impl FnMut(&Scene, &RenderOptions, &dyn Monitor) -> Result<Frame>,
) -> Result<Frame> {
    let Some(lens) = scene.lens else { return render(scene, options, monitor) };
    let image = &scene.image;
    let samples = options.samples.clone().unwrap_or(sample_numbers(image));
    let whole = [image.width, image.height];
    let window = options.window.unwrap_or(Window::whole(whole));
    let mut pinhole = scene.clone();
    let parts = pinhole.edit();
    // Only the mean is developed.
    let look = Look { bloom: 0.0, tone: Tone::None, vignette: 0.0, grain: 0.0, ..parts.image.look };
    (parts.lens, parts.image.look) = (None, look);
    let mut mean = match options.surface {
        true => render(&pinhole, &RenderOptions { samples: Some(0..0), ..options.clone() }, monitor)?,
        false => Frame::new(window.width, window.height, false),
    };
    mean.alpha = image.alpha.then(|| vec![0.0; mean.radiance.len()]);
    let count = samples.len() as u64;
    for (done, sample) in (0..).zip(samples) {
        let parts = pinhole.edit();
        (parts.camera, parts.image) = lens.seen(&scene.camera, &parts.image, sample);
        let one = RenderOptions { surface: false, samples: Some(sample..sample + 1), ..options.clone() };
        add(&mut mean, &render(&pinhole, &one, &OneOf { monitor, done, count })?);
    }
    if count == 0 {
        return Ok(mean);
    }
    let inverse = 1.0 / count as f32;
    mean.radiance.iter_mut().for_each(|sum| *sum = sum.map(|x| x * inverse));
    mean.alpha.iter_mut().flatten().for_each(|sum| *sum *= inverse);
    develop(&mut mean, &image.look, window, whole);
    Ok(mean)
}

/// Adds a frame to a sum of frames.
fn add(sum: &mut Frame, frame: &Frame) {
    sum.radiance.iter_mut().zip(&frame.radiance).for_each(|(sum, new)| {
        *sum = [0, 1, 2, 3].map(|c| sum[c] + new[c]);
    });
    sum.counts.iter_mut().zip(&frame.counts).for_each(|(sum, new)| {
        *sum = [0, 1].map(|c| sum[c].saturating_add(new[c]));
    });
    if let (Some(sum), Some(new)) = (&mut sum.alpha, &frame.alpha) {
        sum.iter_mut().zip(new).for_each(|(sum, new)| *sum += new);
    }
    sum.seconds += frame.seconds;
}

/// Monitor of one of `count` equal parts of a picture, of which `done` are finished.
struct OneOf<'a> {
    monitor: &'a dyn Monitor,
    done: u64,
    count: u64,
}

impl Monitor for OneOf<'_> {
    fn progress(&self, stage: &'static str, done: u64, total: u64) -> Result<()> {
        match stage {
            "pixels" => self.monitor.progress(stage, self.done * total + done, self.count * total),
            _ => self.monitor.progress(stage, done, total),
        }
    }

    fn warn(&self, text: &str) {
        self.monitor.warn(text);
    }
}
