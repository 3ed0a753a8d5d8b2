//! Estimates what a batch would render and need, without rendering.

use serde::Serialize;

use super::Batch;
use super::report::word;
use crate::engine::overlap;
use crate::job::{beside_encoders, check_bloom, held_bytes, memory_of, spare_for_rasters};
use crate::output::frame::{Channel, Format};
use crate::picture::camera::{CENTRE, sample_numbers};
use crate::picture::{Layer, canvas_bytes};
use crate::util::error::{Result, human_bytes};

/// The work and needs of a run, as `--dry-run` prints them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Needs {
    /// Number of pictures of the run.
    pub pictures: u64,
    /// Number of pictures that are missing or incomplete.
    pub to_render: u64,
    /// Files of the first picture.
    pub first: Vec<String>,
    /// Files of the last picture.
    pub last: Vec<String>,
    /// Width and height of each picture, pixels.
    pub size: [u32; 2],
    /// Samples per pixel.
    pub samples: u32,
    /// Automatic exposure in stops, if it is on.
    pub auto_exposure: Option<f32>,
    /// Number of strips that each picture is rendered in.
    pub strips: u64,
    /// Memory of the work on host and device, without the program itself, bytes.
    pub memory_bytes: u64,
    /// Upper bound of the disk space of missing pictures and movies, bytes: their size before compression.
    pub disk_bytes: u64,
}

impl Batch {
    /// Estimates what [`Batch::run`] would do and need.
    ///
    /// # Errors
    /// If the scene is not valid or does not fit the memory.
    pub fn needs(&self) -> Result<Needs> {
        let own: Vec<usize> = self.own().collect();
        let to_render = own.iter().filter(|&&n| !self.whole[n]).count() as u64;
        let files = |number: Option<&usize>| {
            number.map_or(Vec::new(), |&n| self.files(n).iter().map(|f| word(f)).collect())
        };
        let scene = self.scene(own.first().copied().unwrap_or(0))?;
        let window = self.window(&scene);
        let surface = self.has_exr() && self.request.exr.layers.iter().any(|l| l.of_surface());
        let formats = self.formats();
        let memory = beside_encoders(self.base.limits().memory, &formats, window)?;
        let (needed, strips) = memory_of(&scene, window, surface, memory)?;
        let passes =
            scene.image.samples + u32::from(surface && !sample_numbers(&scene.image).contains(&CENTRE));
        let rasters = canvas_bytes(overlap::sheets(&scene)) * window.pixels() * u64::from(passes);
        let kept_rasters = if strips.len() > 1 || to_render < 2 {
            0
        } else {
            spare_for_rasters(memory, needed).min(rasters)
        };
        let memory_bytes = needed + kept_rasters + held_bytes(&formats, window);
        let alpha = scene.image.alpha;
        let exr = |layers: &[Layer]| {
            self.request.exr.channels(layers, alpha).iter().map(Channel::bytes).sum::<usize>()
        };
        let bytes = formats.into_iter().zip(&self.layers).map(|(format, layers)| match format {
            Format::Exr => exr(layers),
            developed => self.encoding(developed, alpha).pixel_bytes(),
        });
        let pixel = bytes.sum::<usize>() as u64;
        // While a GIF is made, its frames wait uncompressed in a file beside it. Other movies are smaller
        // than their frames.
        let movies = (self.movies.len() * (self.count() / self.frames.len()) - self.fresh.len()) as u64;
        let movie_bytes = movies * self.frames.len() as u64 * window.pixels() * 3;
        Ok(Needs {
            pictures: own.len() as u64,
            to_render,
            first: files(own.first()),
            last: files(own.last()),
            size: [window.width, window.height],
            samples: scene.image.samples,
            auto_exposure: self.measured,
            strips: strips.len() as u64,
            memory_bytes,
            disk_bytes: window.pixels() * pixel * to_render + movie_bytes,
        })
    }

    /// Refuses bloom if a PNG or movie cannot be rendered in one piece.
    pub(super) fn check_bloom(&self) -> Result<()> {
        let seen = self.pictures.iter().any(|p| !p.is_exr()) || !self.movies.is_empty();
        let Some(number) = self.own().next().filter(|_| seen) else { return Ok(()) };
        let scene = self.scene(number)?;
        let window = self.window(&scene);
        let memory = beside_encoders(self.base.limits().memory, &self.formats(), window)?;
        let (_, strips) = memory_of(&scene, window, self.has_exr(), memory)?;
        check_bloom(&scene, window, strips.len())
    }

    /// Whether EXR files, which hold layers, are written.
    pub(super) fn has_exr(&self) -> bool {
        self.pictures.iter().any(super::Pattern::is_exr)
    }
}

impl std::fmt::Display for Needs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [width, height] = self.size;
        let samples = if self.samples == 1 { "1 sample".into() } else { format!("{} samples", self.samples) };
        writeln!(
            f,
            "{} pictures of {width}×{height} pixels, {samples} each: {} to render, {} already complete",
            self.pictures,
            self.to_render,
            self.pictures - self.to_render
        )?;
        writeln!(f, "first   {}", self.first.join(", "))?;
        writeln!(f, "last    {}", self.last.join(", "))?;
        let parts =
            if self.strips > 1 { format!(", each picture in {} strips", self.strips) } else { String::new() };
        writeln!(f, "memory  {} on host and device{parts}", human_bytes(self.memory_bytes.into()))?;
        write!(f, "disk    at most {}", human_bytes(self.disk_bytes.into()))
    }
}
