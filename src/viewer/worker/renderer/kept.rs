//! Full-size pictures that are kept while they are valid, so that a later request continues them.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::Job;
use crate::picture::camera::CENTRE;
use crate::picture::resolve::develop_whole;
use crate::picture::{Frame, Image, Look, Surface};
use crate::scene::Scene;
use crate::viewer::document::changed_keys;
use crate::volume::VolumeTexture;

/// Number of kept pictures, besides the one in the window. An undo or two leads back to them.
const MOST_KEPT: usize = 8;

/// A full-size picture that refinement continues from.
pub struct Rendered {
    pub scene: Arc<Scene>,
    pub look: Look,
    pub size: [u32; 2],
    pub frame: Arc<Frame>,
    /// Samples per pixel of `frame`.
    pub samples: u32,
    /// Samples per pixel that were asked for.
    asked: u32,
    pub volumes: Arc<Vec<VolumeTexture>>,
    /// The samples taken so far, at least those of `frame` unless there are none.
    pub sums: Sums,
}

/// Sums over samples that follow one another from the first of an even, or an odd, number of samples.
#[derive(Default)]
pub struct Sums {
    /// Number of the first sample.
    first: u32,
    /// Number of samples.
    samples: u32,
    radiance: Vec<[f32; 4]>,
    counts: Vec<[u32; 2]>,
    alpha: Option<Vec<f32>>,
}

impl Sums {
    /// The sums of a frame that holds only the sample at the pixels' centres.
    fn of_centre(frame: &Frame) -> Sums {
        let (radiance, counts, alpha) = (frame.radiance.clone(), frame.counts.clone(), frame.alpha.clone());
        Sums { first: CENTRE, samples: 1, radiance, counts, alpha }
    }

    /// Adds the mean of samples `numbers`, which follow those that are there.
    fn add(&mut self, part: Frame, numbers: Range<u32>) {
        let more = numbers.len() as f32;
        let mean = |x: &mut f32| *x *= more;
        let Frame { mut radiance, counts, mut alpha, .. } = part;
        if more > 1.0 {
            radiance.par_iter_mut().flatten_iter().for_each(mean);
            alpha.par_iter_mut().flatten().for_each(mean);
        }
        self.samples += numbers.len() as u32;
        if self.radiance.is_empty() {
            (self.first, self.radiance, self.counts, self.alpha) = (numbers.start, radiance, counts, alpha);
            return;
        }
        // The order of a whole rendering: added one by one, samples give the bits of its radiance.
        self.radiance
            .par_iter_mut()
            .zip(radiance)
            .for_each(|(sum, new)| *sum = [0, 1, 2, 3].map(|c| new[c] + sum[c]));
        self.counts.par_iter_mut().zip(counts).for_each(|(sum, new)| *sum = [0, 1].map(|c| sum[c] + new[c]));
        if let (Some(sums), Some(alpha)) = (&mut self.alpha, alpha) {
            sums.par_iter_mut().zip(alpha).for_each(|(sum, new)| *sum += new);
        }
    }

    fn bytes(&self) -> usize {
        self.radiance.len() * 24 + self.alpha.as_ref().map_or(0, |alpha| alpha.len() * 4)
    }
}

/// Number of the first sample of a picture of `samples` samples.
fn first_of(samples: u32) -> u32 {
    u32::from(samples.is_multiple_of(2))
}

impl Rendered {
    /// A picture of the sample at the pixels' centres.
    pub fn first(job: &Job, frame: Frame) -> Rendered {
        Rendered {
            scene: job.request.scene.clone(),
            look: job.look,
            size: job.request.size,
            frame: Arc::new(frame),
            samples: 1,
            asked: job.request.samples,
            volumes: job.volumes.clone(),
            sums: Sums::default(),
        }
    }

    /// Whether the rays of this picture are those of a request: it may ask for another layer, more samples,
    /// or another development of the same radiance.
    fn serves(&self, job: &Job) -> bool {
        let (old, new) = (&self.scene, &job.request.scene);
        let Image { filter, alpha, rock_error, .. } = old.image;
        let map = |scene: &Scene| scene.environment.as_ref().map(|environment| Arc::as_ptr(&environment.map));
        let is_of_development = |key: &String| key.starts_with("image.") || key.starts_with("animate.");
        self.size == job.request.size
            && self.samples <= job.request.samples.max(1)
            && Arc::ptr_eq(&self.volumes, &job.volumes)
            && (filter, alpha, rock_error) == (new.image.filter, new.image.alpha, new.image.rock_error)
            // A file may have changed without its name.
            && map(old) == map(new)
            && changed_keys(old.written(), new.written()).iter().all(is_of_development)
            && old.wave_moves == new.wave_moves
            && (self.asked == job.request.samples || !new.counts_samples())
    }

    /// Makes the picture that of a request which it serves: develops it anew if the look is another.
    fn take_over(&mut self, job: &Job) {
        self.scene = job.request.scene.clone();
        self.asked = job.request.samples;
        if self.look != job.look {
            self.look = job.look;
            develop_whole(Arc::make_mut(&mut self.frame), &job.look);
        }
    }

    /// Adds the layers of the raster pass.
    pub fn set_surface(&mut self, surface: Option<Surface>) {
        Arc::make_mut(&mut self.frame).surface = surface;
    }

    /// Returns a picture of its own with the samples so far, if one of `most` samples has none of them.
    pub fn fork(&mut self, most: u32) -> Option<Rendered> {
        let shares = self.sums.samples == 0 || self.sums.first == first_of(most);
        (!shares && self.samples > 1).then(|| Rendered {
            scene: self.scene.clone(),
            look: self.look,
            size: self.size,
            frame: self.frame.clone(),
            samples: self.samples,
            asked: self.asked,
            volumes: self.volumes.clone(),
            sums: std::mem::take(&mut self.sums),
        })
    }

    /// Returns the samples to take next on the way to a picture of `most` samples, at most `at_once`. Begins
    /// the sums anew if they hold other samples than such a picture has.
    pub fn next_samples(&mut self, most: u32, at_once: u32) -> Range<u32> {
        let first = first_of(most);
        if self.sums.samples == 0 || self.sums.first != first {
            let has_centre = self.samples == 1 && first == CENTRE;
            self.sums = if has_centre { Sums::of_centre(&self.frame) } else { Sums::default() };
        }
        let from = first + self.sums.samples;
        from..(first + self.next_shown(most)).min(from.saturating_add(at_once))
    }

    /// Number of samples of the next picture to show on the way to `most`. Each step doubles the number, so
    /// that the last one takes half of the time.
    fn next_shown(&self, most: u32) -> u32 {
        match self.samples {
            // A picture with an even number of samples shares none with one that has an odd number.
            samples if samples % 2 == most % 2 => most.min(2 * samples + samples % 2),
            samples => samples + 1,
        }
    }

    /// Adds the mean of samples `numbers`. Returns whether these complete the next picture on the way to
    /// `most` samples, which is then made.
    pub fn add(&mut self, part: Frame, numbers: Range<u32>, most: u32) -> bool {
        let seconds = part.seconds;
        self.sums.add(part, numbers);
        if self.sums.samples < self.next_shown(most) {
            return false;
        }
        self.samples = self.sums.samples;
        let inverse = 1.0 / self.samples as f32;
        let frame = Arc::make_mut(&mut self.frame);
        let sums = &self.sums;
        frame
            .radiance
            .par_iter_mut()
            .zip(&sums.radiance)
            .for_each(|(mean, sum)| *mean = sum.map(|x| x * inverse));
        frame.counts.copy_from_slice(&sums.counts);
        if let (Some(alpha), Some(sums)) = (&mut frame.alpha, &sums.alpha) {
            alpha.par_iter_mut().zip(sums).for_each(|(mean, sum)| *mean = sum * inverse);
        }
        frame.seconds = seconds;
        develop_whole(frame, &self.look);
        true
    }

    fn bytes(&self) -> usize {
        let surface = if self.frame.surface.is_some() { 32 } else { 0 };
        self.frame.radiance.len() * (28 + surface) + self.sums.bytes()
    }
}

/// Pictures that were refined and are not in the window, the latest first.
#[derive(Default)]
pub struct Kept(Vec<Rendered>);

impl Kept {
    /// Takes the picture that serves a request with the most samples, from those that are kept and `old`, the
    /// last one in the window. Keeps the others in `budget` bytes. Those of a single sample are dropped: they
    /// are as quickly made again.
    pub fn exchange(&mut self, old: Option<Rendered>, job: &Job, budget: u64) -> Option<Rendered> {
        self.0.splice(0..0, old);
        let serving = self.0.iter().enumerate().filter(|(_, kept)| kept.serves(job));
        let best = serving.max_by_key(|(_, kept)| kept.samples).map(|(i, _)| i);
        let mut taken = best.map(|i| self.0.remove(i));
        if let Some(taken) = &mut taken {
            taken.take_over(job);
        }
        let mut bytes = 0;
        self.0.retain(|kept| {
            bytes +=
                if kept.samples > 1 || kept.sums.samples > 1 { kept.bytes() as u64 } else { return false };
            bytes <= budget
        });
        self.0.truncate(MOST_KEPT);
        taken
    }

    /// Keeps a picture as it is while the window goes on with another number of samples.
    pub fn put(&mut self, rendered: Rendered) {
        self.0.insert(0, rendered);
    }
}
