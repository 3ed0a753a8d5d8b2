//! Many pictures from one scene: the frames of an animation, the grid of a sweep, or both.
//!
//! 1. [`Batch::plan`] checks everything before any work: the scene of every frame, every output's folder
//!    and name, and what is there already, by decoding it.
//! 2. [`Batch::run`] renders what is missing. It claims each picture, so that any number of processes may
//!    share a folder, and hands finished strips to a thread that encodes while the next are rendered.
//! 3. What is made of all pictures (movies, a sheet, manifests) is made at the end, from the files.
//!
//! A picture's bytes depend on the scene and the frame's number alone.

mod assemble;
mod existing;
mod needs;
mod pattern;
mod report;
mod run;
mod sweep;
mod writer;

pub use needs::Needs;
pub use pattern::Pattern;
pub use report::{Event, Name, Summary, Watcher};
pub use sweep::Sweep;

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use rayon::prelude::*;

use assemble::MovieFile;

use super::Still;
use crate::engine::exposure::exposed;
use crate::output::frame::{Output, folder_of, remove_stale};
use crate::output::movie::MovieKind;
use crate::picture::Layer;
use crate::scene::{Animation, Place, Scene};
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::window::Window;

/// Most pictures of one batch.
const MAX_PICTURES: usize = 1_000_000;
/// The scenes of so many frames, evenly chosen, are checked before the work; of more it would take longer
/// than people wait for a first picture.
const CHECKED_FRAMES: usize = 2000;

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Request {
    /// Numbers of frames; none: the animation's, or with a sweep frame 0.
    pub frames: Option<Vec<u32>>,
    /// `KEY=VALUES`.
    pub sweeps: Vec<String>,
    /// Patterns of the pictures' files and of movies.
    pub outputs: Vec<PathBuf>,
    /// The contact sheet of a sweep; none: beside the pictures.
    pub sheet: Option<PathBuf>,
    /// Tables of all pictures, .csv or .json; none given: beside the pictures of a sweep.
    pub manifests: Vec<PathBuf>,
    /// (i, n): of the pictures, numbered from 0, those whose number leaves i when divided by n.
    pub shard: Option<(u32, u32)>,
    /// Whether files that are there are replaced.
    pub overwrite: bool,
    /// Whether the others go on when one picture fails.
    pub keep_going: bool,
    /// How often a picture is tried again after a lost device.
    pub retries: u32,
    /// Only this part of every picture.
    pub crop: Option<Window>,
    /// Layers of EXR files.
    pub layers: Vec<Layer>,
    /// Claims of other machines not touched for so long are taken over.
    pub stale: Duration,
}

/// A batch that has been checked.
pub struct Batch {
    base: Animation,
    /// Stops of an automatic exposure, the same for all pictures.
    measured: Option<f32>,
    request: Request,
    sweeps: Vec<Sweep>,
    frames: Vec<u32>,
    pictures: Vec<Pattern>,
    movies: Vec<MovieFile>,
    sheet: Option<PathBuf>,
    manifests: Vec<PathBuf>,
    /// By number of the picture, whether it is there whole.
    whole: Vec<bool>,
    /// Files that were there before and are to be replaced.
    replaced: HashMap<PathBuf, Stamp>,
    /// Movies that are there, as new as their pictures.
    fresh: BTreeSet<PathBuf>,
    /// By point of the grid, what tells its movies from others.
    marks: Vec<u64>,
}

/// Tells one version of a file from the next.
type Stamp = (Option<SystemTime>, u64);

fn stamp(path: &Path) -> Option<Stamp> {
    let meta = std::fs::metadata(path).ok()?;
    Some((meta.modified().ok(), meta.len()))
}

impl Batch {
    /// Checks what is asked for and what is there.
    pub fn plan(base: Animation, request: Request, monitor: &dyn Monitor) -> Result<Batch> {
        let (base, measured) = exposed(base, monitor)?;
        let first = base.at(request.frames.as_ref().and_then(|f| f.first().copied()).unwrap_or(0))?;
        let keys = first.keys();
        let sweeps = request
            .sweeps
            .iter()
            .map(|text| Sweep::parse(text, &keys, base.values()))
            .collect::<Result<Vec<Sweep>>>()?;
        if sweeps.iter().any(|sweep| sweep.key == "image.auto_exposure") {
            return Err(Error::Usage(
                "--sweep image.auto_exposure: a batch has one exposure, measured on its first frame; sweep \
                 image.exposure"
                    .into(),
            ));
        }
        for (i, sweep) in sweeps.iter().enumerate() {
            if sweeps[..i].iter().any(|other| other.key == sweep.key) {
                return Err(Error::Usage(format!(
                    "--sweep {} is given twice; list all values in one",
                    sweep.key
                )));
            }
        }
        let frames = match &request.frames {
            Some(frames) => frames.clone(),
            None if !sweeps.is_empty() => vec![0],
            None => (0..base.frames).collect(),
        };
        let points = sweeps.iter().try_fold(1usize, |n, s| n.checked_mul(s.values.len()));
        let count = points.and_then(|n| n.checked_mul(frames.len())).filter(|&n| n <= MAX_PICTURES);
        let Some(count) = count else {
            return Err(Error::Usage(format!(
                "the sweep's grid times the frames is more than {MAX_PICTURES} pictures; split it"
            )));
        };
        let names: Vec<Vec<String>> = sweeps.iter().map(Sweep::names).collect();
        let (mut pictures, mut movies) = (Vec::new(), Vec::new());
        for (i, path) in request.outputs.iter().enumerate() {
            let pattern = Pattern::new(path, &names)?;
            if request.outputs[..i].contains(path) {
                return Err(Error::Usage(format!("-o {} is given twice", path.display())));
            }
            match movie_kind(&pattern, frames.len()) {
                Some(kind) => {
                    check_pattern(&pattern, &sweeps, 1)?;
                    movies.push(MovieFile { pattern, kind });
                }
                None => {
                    check_pattern(&pattern, &sweeps, frames.len())?;
                    pictures.push(pattern);
                }
            }
        }
        let (sheet, manifests) = about_all(&request, &base, &sweeps, &pictures)?;
        let mut batch = Batch {
            base,
            measured,
            request,
            sweeps,
            frames,
            pictures,
            movies,
            sheet,
            manifests,
            whole: vec![false; count],
            replaced: HashMap::new(),
            fresh: BTreeSet::new(),
            marks: Vec::new(),
        };
        batch.check_names()?;
        batch.check_scenes(monitor)?;
        batch.check_folders()?;
        batch.check_bloom()?;
        batch.look(monitor)?;
        batch.check_movies()?;
        Ok(batch)
    }

    /// Stops that the automatic exposure has chosen, where there is one.
    pub fn measured(&self) -> Option<f32> {
        self.measured
    }

    /// How many pictures there are, of all shards.
    pub fn count(&self) -> usize {
        self.whole.len()
    }

    /// The numbers of this run's pictures.
    fn own(&self) -> impl Iterator<Item = usize> + use<> {
        let (shard, of) = self.request.shard.unwrap_or((0, 1));
        (shard as usize..self.count()).step_by(of as usize)
    }

    /// The values of the sweeps, by number, at a picture: the last sweep changes fastest, and within each
    /// point of the grid the frames.
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

    fn words(&self, number: usize) -> Vec<String> {
        self.choice(number).iter().zip(&self.sweeps).map(|(&v, sweep)| sweep.values[v].1.clone()).collect()
    }

    /// The frame's number of a picture.
    pub fn frame(&self, number: usize) -> u32 {
        self.frames[number % self.frames.len()]
    }

    /// What a picture is called in messages.
    pub fn name(&self, number: usize) -> Name {
        let sweep =
            self.words(number).iter().zip(&self.sweeps).map(|(v, s)| format!("{}={v}", s.key)).collect();
        Name { frame: self.frame(number), sweep }
    }

    /// The files of a picture.
    pub fn files(&self, number: usize) -> Vec<PathBuf> {
        let words = self.words(number);
        self.pictures.iter().map(|p| p.at(self.frame(number), &words)).collect()
    }

    /// The scene of a picture.
    pub fn scene(&self, number: usize) -> Result<Scene> {
        if self.sweeps.is_empty() {
            return self.base.at(self.frame(number));
        }
        let choice = self.choice(number);
        let changes: Vec<_> = choice
            .iter()
            .zip(&self.sweeps)
            .map(|(&v, sweep)| (sweep.key.clone(), sweep.values[v].0.clone(), Place("--sweep".into())))
            .collect();
        self.base.with(&changes)?.at(self.frame(number))
    }

    /// No two outputs have one name: values of a sweep may run into one another, or differ in what no file's
    /// name can hold; one file may be written in two ways.
    fn check_names(&self) -> Result<()> {
        let alone = self.sweeps.is_empty() && self.pictures.len() + self.movies.len() == 1;
        if alone && self.manifests.is_empty() {
            return Ok(());
        }
        let mut names: HashMap<PathBuf, String> = HashMap::new();
        let mut add = |file: PathBuf, what: String| match names.insert(plain(&file), what.clone()) {
            None => Ok(()),
            Some(other) => Err(Error::Usage(format!(
                "{} would be {other} and {what}; give them different names, such as {{h}}-{{alpha}} for values that \
                 run into one another",
                file.display()
            ))),
        };
        for path in &self.manifests {
            add(path.clone(), "the manifest".into())?;
        }
        if let Some(path) = &self.sheet {
            add(path.clone(), "the sheet".into())?;
        }
        for movie in &self.movies {
            for point in 0..self.count() / self.frames.len() {
                add(self.movie_path(movie, point), format!("the {}", movie.kind.name()))?;
            }
        }
        (0..self.count())
            .try_for_each(|n| self.files(n).into_iter().try_for_each(|f| add(f, self.name(n).to_string())))
    }

    /// Every frame's scene is valid, or the first that is not says so.
    fn check_scenes(&self, monitor: &dyn Monitor) -> Result<()> {
        let own: Vec<usize> = self.own().collect();
        let step = own.len().div_ceil(CHECKED_FRAMES).max(1);
        let mut some: Vec<usize> = own.iter().copied().step_by(step).collect();
        some.extend(own.last());
        let total = some.len() as u64;
        // In parts, each on all cores: a signal is heard between them, and the first fault is always the same.
        for (part, numbers) in some.chunks(256).enumerate() {
            monitor.progress("checking", part as u64 * 256, total)?;
            let faults: Vec<Error> = numbers.par_iter().filter_map(|&n| self.scene(n).err()).collect();
            if let Some(first) = faults.into_iter().next() {
                return Err(first);
            }
        }
        Ok(())
    }

    /// Every folder is there and can be written; what dead processes left in it goes.
    fn check_folders(&self) -> Result<()> {
        // A shard may have no picture of its own: the first of all tells for it.
        let mut files = self.files(self.own().next().unwrap_or(0));
        drop(Still::open(&files)?);
        let colour = self.request.layers.contains(&Layer::Rgb) || self.pictures.iter().any(|p| !p.is_exr());
        let shown = self.sheet.is_some() || !self.movies.is_empty() && !self.pictures.is_empty();
        if !colour && shown && self.request.shard.is_none() {
            return Err(Error::Usage(
                "a sheet or a movie needs colour; add rgb to --layers, or PNG files with -o".into(),
            ));
        }
        files.extend(self.movies.iter().map(|movie| self.movie_path(movie, 0)));
        files.extend(self.sheet.iter().chain(&self.manifests).cloned());
        if self.request.layers != Layer::ALL && !self.has_exr() {
            return Err(Error::Usage("--layers is for EXR files; add -o FILE.####.exr".into()));
        }
        let folders: BTreeSet<&Path> = files.iter().map(|file| folder_of(file)).collect();
        folders.iter().for_each(|folder| remove_stale(folder, |_| true));
        Ok(())
    }
}

/// The format of a movie that a name asks for. A .png of many frames without a place for their numbers is an
/// animated one.
fn movie_kind(pattern: &Pattern, frames: usize) -> Option<MovieKind> {
    let path = pattern.given();
    let png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    match MovieKind::of(path) {
        None if png && frames > 1 && !pattern.has_frame() => Some(MovieKind::Apng),
        kind => kind,
    }
}

/// Where the sheet and the manifests go, if there are any.
fn about_all(
    request: &Request,
    base: &Animation,
    sweeps: &[Sweep],
    pictures: &[Pattern],
) -> Result<(Option<PathBuf>, Vec<PathBuf>)> {
    let (mut sheet, mut manifests) = (request.sheet.clone(), request.manifests.clone());
    let Some(first) = pictures.first() else {
        if sheet.is_some() || !manifests.is_empty() || !sweeps.is_empty() {
            return Err(Error::Usage(
                "a sweep, a sheet and a manifest need pictures; add -o with a .png or .exr".into(),
            ));
        }
        return Ok((None, Vec::new()));
    };
    if sweeps.is_empty() && sheet.is_some() {
        return Err(Error::Usage("--sheet shows a sweep; add --sweep KEY=VALUES".into()));
    }
    if !sweeps.is_empty() {
        let beside = |what: &str| first.given().with_file_name(format!("{}.{what}", base.name()));
        sheet = sheet.or_else(|| Some(beside("sheet.png")));
        if manifests.is_empty() {
            manifests = vec![beside("manifest.csv"), beside("manifest.json")];
        }
    }
    for path in &manifests {
        if !assemble::is_csv(path) && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
            return Err(Error::Usage(format!("--manifest {}: use .csv or .json", path.display())));
        }
    }
    if let Some(path) = &sheet
        && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"))
    {
        return Err(Error::Usage(format!("--sheet {}: use .png", path.display())));
    }
    // Opened and dropped: a folder that is not there is known before the work.
    if request.shard.is_none() {
        for path in sheet.iter().chain(&manifests) {
            if !request.overwrite {
                assemble::check_replaced(path)?;
            }
            drop(Output::open(path)?);
        }
    }
    Ok((sheet, manifests))
}

/// A path without `.` in it.
fn plain(path: &Path) -> PathBuf {
    path.components().filter(|part| *part != std::path::Component::CurDir).collect()
}

/// Different pictures have different names.
fn check_pattern(pattern: &Pattern, sweeps: &[Sweep], frames: usize) -> Result<()> {
    let given = pattern.given().display();
    if frames > 1 && !pattern.has_frame() {
        return Err(Error::Usage(format!(
            "-o {given}: {frames} frames would have one name; put #### where the frame's number goes, such as fall.####.png"
        )));
    }
    for (i, sweep) in sweeps.iter().enumerate() {
        if sweep.values.len() > 1 && !pattern.has_sweep(i) {
            return Err(Error::Usage(format!(
                "-o {given}: all values of {name} would have one name; put {{{name}}} where the value goes",
                name = sweep.name
            )));
        }
    }
    Ok(())
}
