//! Batches: many pictures of one scene, as frames of an animation, points of a sweep's grid, or both.
//!
//! 1. [`Batch::plan`] checks everything before any work: the scenes of the frames, the folder and name of
//!    every output, and the files that already exist, by decoding them.
//! 2. [`Batch::run`] renders the missing pictures. It claims each picture, so that any number of processes
//!    can share a folder. Finished strips go to a thread that encodes them while the next strips are
//!    rendered.
//! 3. Files that need all pictures (movies, contact sheet, manifests) are made last, from the pictures'
//!    files.
//!
//! The bytes of a picture depend on the scene and the frame's number alone.

mod assemble;
mod existing;
mod needs;
mod pattern;
mod plan;
mod report;
mod run;
mod shown;
mod sweep;
mod writer;

pub use needs::Needs;
pub(crate) use pattern::NUMBER_IT;
pub use pattern::Pattern;
pub use report::{Event, Name, Summary, Watcher};
pub use sweep::Sweep;

use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use assemble::MovieFile;

use super::Depth;
use crate::output::frame::{Exr, Format};
use crate::output::movie::Codec;
use crate::picture::Layer;
use crate::scene::{Animation, Place, Scene};
use crate::util::error::Result;
use crate::util::window::Window;

/// A request for a batch.
#[derive(Clone, Debug)]
pub struct Request {
    /// Frames to render. `None`: all frames of the animation, or frame 0 if there is a sweep.
    pub frames: Option<Vec<i32>>,
    /// Sweeps, as `KEY=VALUES`; see [`Sweep::parse`].
    pub sweeps: Vec<String>,
    /// Name patterns of pictures and movies; see [`Pattern`].
    pub outputs: Vec<PathBuf>,
    /// File of a sweep's contact sheet. `None`: a file beside the pictures.
    pub sheet: Option<PathBuf>,
    /// Tables of all pictures, .csv or .json. If empty, a sweep writes both beside its pictures.
    pub manifests: Vec<PathBuf>,
    /// (i, n): renders only pictures whose number modulo n is i. Numbers start at 0.
    pub shard: Option<(u32, u32)>,
    /// Whether to replace existing files.
    pub overwrite: bool,
    /// Whether to go on with other pictures after one fails.
    pub keep_going: bool,
    /// Number of times a picture is tried again after the GPU device was lost.
    pub retries: u32,
    /// The part of every picture to render; `None`: all of it.
    pub crop: Option<Window>,
    /// Settings of EXR files. The rate is that of the animation.
    pub exr: Exr,
    /// Depth of developed pictures.
    pub depth: Depth,
    /// Codec of videos whose format has it.
    pub codec: Option<Codec>,
    /// Bits per sample of videos whose codec has that depth.
    pub movie_bits: Option<u8>,
    /// Claims that their owner has not touched for this time are taken over.
    pub stale: Duration,
}

/// A batch that has been checked.
pub struct Batch {
    base: Animation,
    /// Automatic exposure in stops, the same for all pictures; `None` if it is off.
    measured: Option<f32>,
    request: Request,
    sweeps: Vec<Sweep>,
    frames: Vec<i32>,
    pictures: Vec<Pattern>,
    /// Layers of each pattern that is an EXR; none of the others.
    layers: Vec<Vec<Layer>>,
    movies: Vec<MovieFile>,
    sheet: Option<PathBuf>,
    manifests: Vec<PathBuf>,
    /// By picture number, whether its files exist and are complete.
    whole: Vec<bool>,
    /// Existing files that will be replaced.
    replaced: HashMap<PathBuf, Stamp>,
    /// Existing movies that show exactly these frames.
    fresh: BTreeSet<PathBuf>,
    /// By point of the grid, the mark that identifies its movies; see [`MovieOptions`].
    ///
    /// [`MovieOptions`]: crate::output::movie::MovieOptions
    marks: Vec<u64>,
}

/// Modification time and size in bytes, which tell one version of a file from the next.
type Stamp = (Option<SystemTime>, u64);

fn stamp(path: &Path) -> Option<Stamp> {
    let meta = std::fs::metadata(path).ok()?;
    Some((meta.modified().ok(), meta.len()))
}

impl Batch {
    /// Exposure that was measured automatically, in stops; `None` if automatic exposure is off.
    pub fn measured(&self) -> Option<f32> {
        self.measured
    }

    /// Whether the batch keeps pictures, from which a stopped run continues. A movie alone keeps none.
    pub fn keeps_pictures(&self) -> bool {
        !self.pictures.is_empty()
    }

    /// Number of pictures, over all shards.
    pub fn count(&self) -> usize {
        self.whole.len()
    }

    /// Numbers of the pictures of this run's shard.
    fn own(&self) -> impl Iterator<Item = usize> + use<> {
        let (shard, shards) = self.request.shard.unwrap_or((0, 1));
        (shard as usize..self.count()).step_by(shards as usize)
    }

    /// By sweep, the index of its value at a picture. Pictures are ordered by point of the grid, then by
    /// frame; from point to point, the last sweep changes fastest.
    fn choice(&self, number: usize) -> Vec<usize> {
        let mut point = number / self.frames.len();
        let mut choice: Vec<usize> = self
            .sweeps
            .iter()
            .rev()
            .map(|sweep| {
                let n = sweep.values.len();
                let value = point % n;
                point /= n;
                value
            })
            .collect();
        choice.reverse();
        choice
    }

    /// The sweeps' values at a picture, as text.
    fn words(&self, number: usize) -> Vec<String> {
        self.choice(number).iter().zip(&self.sweeps).map(|(&v, sweep)| sweep.values[v].1.clone()).collect()
    }

    /// Frame number of a picture.
    pub fn frame(&self, number: usize) -> i32 {
        self.frames[number % self.frames.len()]
    }

    /// Name of a picture for messages.
    pub fn name(&self, number: usize) -> Name {
        let sweep =
            self.words(number).iter().zip(&self.sweeps).map(|(v, s)| format!("{}={v}", s.key)).collect();
        Name { frame: self.frame(number), sweep }
    }

    /// Paths of a picture's files, one for each pattern.
    pub fn files(&self, number: usize) -> Vec<PathBuf> {
        let words = self.words(number);
        self.pictures.iter().map(|p| p.at(self.frame(number), &words)).collect()
    }

    /// Animation with the sweeps' values at a picture.
    fn animation(&self, number: usize) -> Result<Cow<'_, Animation>> {
        if self.sweeps.is_empty() {
            return Ok(Cow::Borrowed(&self.base));
        }
        let choice = self.choice(number);
        let changes: Vec<_> = choice
            .iter()
            .zip(&self.sweeps)
            .map(|(&v, sweep)| (sweep.key.clone(), sweep.values[v].0.clone(), Place("--sweep".into())))
            .collect();
        self.base.with(&changes).map(Cow::Owned)
    }

    /// Scene of a picture.
    ///
    /// # Errors
    /// [`Error::Input`] if the scene is not valid at this frame and these values.
    pub fn scene(&self, number: usize) -> Result<Scene> {
        self.animation(number)?.at(self.frame(number))
    }

    /// Formats of the pictures.
    pub(super) fn formats(&self) -> Vec<Format> {
        self.pictures.iter().filter_map(Pattern::format).collect()
    }
}
