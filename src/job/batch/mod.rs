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

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use rayon::prelude::*;

use assemble::MovieFile;

use super::{Depth, Still, check_alpha, check_side};
use crate::engine::exposure::exposed;
use crate::output::frame::{Exr, Format, Output, folder_of, real_file, remove_stale};
use crate::output::movie::{Codec, MovieKind, Video, fraction};
use crate::picture::Layer;
use crate::scene::{Animation, Place, Scene};
use crate::util::error::{Error, Result};
use crate::util::monitor::{Monitor, Unwarned};
use crate::util::window::Window;

/// Most pictures of one batch.
const MAX_PICTURES: usize = 1_000_000;
/// Most scenes that are checked before the work starts, spread evenly over the pictures. Checking more would
/// keep the user waiting for the first picture.
const CHECKED_FRAMES: usize = 2000;

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
    /// Plans a batch: checks the request, the scenes, the output names and folders, and the existing files.
    ///
    /// # Errors
    /// [`Error::Usage`] for a request that contradicts itself, [`Error::Input`] for an invalid scene,
    /// [`Error::CannotCreate`] for outputs that cannot be written or are other pictures, [`Error::Memory`]
    /// for pictures that do not fit, or an error of the monitor.
    pub fn plan(base: Animation, mut request: Request, monitor: &dyn Monitor) -> Result<Batch> {
        // The volume is made once more for the first picture and warns then.
        let (base, measured) = exposed(base, &Unwarned(monitor))?;
        // A scene that is not valid is reported before the sweeps are read.
        base.at(request.frames.as_ref().and_then(|f| f.first().copied()).unwrap_or(0))?;
        let sweeps = request
            .sweeps
            .iter()
            .map(|text| Sweep::parse(text, base.values()))
            .collect::<Result<Vec<Sweep>>>()?;
        if sweeps.iter().any(|sweep| sweep.key == "image.auto_exposure") {
            return Err(Error::Usage(
                "--sweep image.auto_exposure: a batch measures one exposure, on its first frame; sweep \
                 image.exposure instead"
                    .into(),
            ));
        }
        for (i, sweep) in sweeps.iter().enumerate() {
            if sweeps[..i].iter().any(|other| other.key == sweep.key) {
                return Err(Error::Usage(format!(
                    "--sweep {} is given twice; list all its values in one --sweep",
                    sweep.key
                )));
            }
        }
        let frames = match &request.frames {
            Some(frames) => frames.clone(),
            None if !sweeps.is_empty() => vec![0],
            None => (0..base.frames as i32).collect(),
        };
        let points = sweeps.iter().try_fold(1usize, |n, s| n.checked_mul(s.values.len()));
        let count = points.and_then(|n| n.checked_mul(frames.len())).filter(|&n| n <= MAX_PICTURES);
        let Some(count) = count else {
            return Err(Error::Usage(format!(
                "the sweep's grid times the frames makes more than {MAX_PICTURES} pictures; split the batch"
            )));
        };
        let names: Vec<Vec<String>> = sweeps.iter().map(Sweep::names).collect();
        request.exr.rate = Some(fraction(base.fps));
        request.exr.check(base.values().count("image.width"), base.values().is_on("image.alpha"))?;
        let (mut pictures, mut layers, mut movies) = (Vec::new(), Vec::new(), Vec::new());
        for (i, path) in request.outputs.iter().enumerate() {
            let pattern = Pattern::new(path, &names)?;
            if request.outputs[..i].contains(path) {
                return Err(Error::Usage(format!("-o {} is given twice", path.display())));
            }
            pattern.check_placeholders()?;
            Pattern::check_kind(path)?;
            match movie_kind(&pattern, frames.len()) {
                Some(kind) => {
                    check_pattern(&pattern, &sweeps, 1)?;
                    let video = kind.video(request.codec, request.movie_bits);
                    movies.push(MovieFile { pattern, kind, video });
                }
                None if pattern.is_exr() => {
                    for (path, own) in request.exr.files(path) {
                        let pattern = Pattern::new(&path, &names)?;
                        check_pattern(&pattern, &sweeps, frames.len())?;
                        pictures.push(pattern);
                        layers.push(own);
                    }
                }
                None => {
                    check_pattern(&pattern, &sweeps, frames.len())?;
                    pictures.push(pattern);
                    layers.push(Vec::new());
                }
            }
        }
        check_videos(&request, &movies)?;
        let (sheet, manifests) = sheet_and_manifests(&request, &base, &sweeps, &pictures, &movies)?;
        let mut batch = Batch {
            base,
            measured,
            request,
            sweeps,
            frames,
            pictures,
            layers,
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
        batch.check_depth(monitor)?;
        batch.check_bloom()?;
        batch.look(monitor)?;
        batch.check_movies()?;
        Ok(batch)
    }

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

    /// Scene of a picture.
    ///
    /// # Errors
    /// [`Error::Input`] if the scene is not valid at this frame and these values.
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

    /// Refuses outputs that share a name. Values of two sweeps can run into one another, values can differ
    /// only in characters that a file name cannot hold, and one path can be written in two ways.
    fn check_names(&self) -> Result<()> {
        let alone = self.sweeps.is_empty() && self.pictures.len() + self.movies.len() == 1;
        if alone && self.manifests.is_empty() {
            return Ok(());
        }
        let mut names: HashMap<PathBuf, String> = HashMap::new();
        let mut add = |file: PathBuf, what: String| match names.insert(plain(&file), what.clone()) {
            None => Ok(()),
            Some(other) if other == what => {
                Err(Error::Usage(format!("{} is given twice as {what}", file.display())))
            }
            Some(other) => Err(Error::Usage(format!(
                "{} would be both {other} and {what}; give them different names, such as {{h}}-{{alpha}} to \
                 separate two values",
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

    /// Checks the scenes of up to [`CHECKED_FRAMES`] pictures, spread evenly, and of the last one.
    fn check_scenes(&self, monitor: &dyn Monitor) -> Result<()> {
        let own: Vec<usize> = self.own().collect();
        let step = own.len().div_ceil(CHECKED_FRAMES).max(1);
        let mut some: Vec<usize> = own.iter().copied().step_by(step).collect();
        some.extend(own.last());
        let total = some.len() as u64;
        // Each chunk runs on all cores. Signals are noticed between chunks, and the first fault in order is
        // the one reported, whichever thread finds its fault first.
        for (part, numbers) in some.chunks(256).enumerate() {
            monitor.progress("checking", part as u64 * 256, total)?;
            let faults: Vec<Error> = numbers.par_iter().filter_map(|&n| self.scene(n).err()).collect();
            if let Some(first) = faults.into_iter().next() {
                return Err(first);
            }
        }
        Ok(())
    }

    /// Formats of the pictures.
    pub(super) fn formats(&self) -> Vec<Format> {
        self.pictures.iter().filter_map(Pattern::format).collect()
    }

    /// Checks that the formats can hold the pictures in the depth that is asked for. Warns of videos that get
    /// fewer bits than they could hold.
    fn check_depth(&self, monitor: &dyn Monitor) -> Result<()> {
        let scene = self.scene(self.own().next().unwrap_or(0))?;
        let (window, formats) = (self.window(&scene), self.formats());
        self.request.depth.check(&formats, &scene.image.look)?;
        let files = self.pictures.iter().filter_map(|pattern| Some((pattern.given(), pattern.format()?)));
        check_alpha(&scene.image, files)?;
        if let Some(movie) = self.movies.first().filter(|_| scene.image.alpha) {
            if movie.is_unnumbered() {
                return Err(movie.unnumbered("movies of taki have no alpha channel"));
            }
            return Err(Error::Usage(format!(
                "-o {}: movies of taki have no alpha channel, and image.alpha is true; write .png, .tif, \
                 .webp or .exr frames",
                movie.pattern.given().display()
            )));
        }
        for pattern in &self.pictures {
            pattern.format().map_or(Ok(()), |format| check_side(pattern.given(), format, window))?;
        }
        let deep = self.movies.iter().find(|movie| movie.video.is_some_and(|video| video.bits > 8));
        if let Some(movie) = deep.filter(|_| !formats.is_empty() && !self.has_deep_source()) {
            monitor.warn(&format!(
                "{} is made of pictures with 8 bits per channel; add --bits 16, or write .exr files",
                movie.pattern.given().display()
            ));
        }
        Ok(())
    }

    /// Checks that every folder exists and can be written. Removes temporary files that dead processes left
    /// there.
    fn check_folders(&self) -> Result<()> {
        // A shard may have no pictures; the batch's first picture then stands in.
        let mut files = self.files(self.own().next().unwrap_or(0));
        drop(Still::open(&files)?);
        let colour =
            self.request.exr.layers.contains(&Layer::Rgb) || self.pictures.iter().any(|p| !p.is_exr());
        let shown = self.sheet.is_some() || !self.movies.is_empty() && !self.pictures.is_empty();
        if !colour && shown && self.request.shard.is_none() {
            return Err(Error::Usage(
                "a sheet or a movie needs colour; add rgb to --layers, or write PNG files too with -o".into(),
            ));
        }
        files.extend(self.movies.iter().map(|movie| self.movie_path(movie, 0)));
        files.extend(self.sheet.iter().chain(&self.manifests).cloned());
        let Exr { layers, half, compression, split, .. } = &self.request.exr;
        let given = [
            ("--layers", *layers != Layer::ALL),
            ("--half", *half),
            ("--compression", compression.is_some()),
            ("--split-layers", *split),
        ];
        if let Some((option, _)) = given.into_iter().find(|(_, given)| *given && !self.has_exr()) {
            return Err(Error::Usage(format!("{option} is for EXR files; add -o FILE.####.exr")));
        }
        let files = files.iter().map(|file| real_file(file)).collect::<Result<Vec<PathBuf>>>()?;
        let folders: BTreeSet<&Path> = files.iter().map(|file| folder_of(file)).collect();
        folders.iter().for_each(|folder| remove_stale(folder, |_| true));
        Ok(())
    }
}

/// Refuses a codec and a depth that no movie has.
fn check_videos(request: &Request, movies: &[MovieFile]) -> Result<()> {
    let refuse = |option: &str, with: &str| Err(Error::Usage(format!("{option} is for {with}")));
    let videos: Vec<Video> = movies.iter().filter_map(|movie| movie.video).collect();
    if let Some(codec) = request.codec.filter(|codec| videos.iter().all(|video| video.codec != *codec)) {
        let kinds = MovieKind::ALL.into_iter().filter(|kind| kind.codecs().contains(&codec));
        let kinds: Vec<String> = kinds.map(|kind| format!(".{}", kind.extension())).collect();
        let with = format!("{} files; add -o FILE{}", kinds.join(" and "), kinds[0]);
        return refuse(&format!("--codec {}", codec.word()), &with);
    }
    if let Some(bits) = request.movie_bits.filter(|bits| videos.iter().all(|video| video.bits != *bits)) {
        let codecs = Codec::ALL.into_iter().filter(|codec| codec.depths().contains(&bits));
        let codecs: Vec<&str> = codecs.map(Codec::word).collect();
        let with = format!("videos in {}; add -o FILE.mp4 or choose --codec", codecs.join(", "));
        return refuse(&format!("--movie-bits {bits}"), &with);
    }
    Ok(())
}

/// Format of the movie that a pattern asks for; `None` for pictures. A .png without #### is an animated PNG
/// if there are several frames.
fn movie_kind(pattern: &Pattern, frames: usize) -> Option<MovieKind> {
    let path = pattern.given();
    let png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    match MovieKind::of(path) {
        None if png && frames > 1 && !pattern.has_frame() => Some(MovieKind::Apng),
        kind => kind,
    }
}

/// Paths of the contact sheet and the manifests, if there are any.
fn sheet_and_manifests(
    request: &Request,
    base: &Animation,
    sweeps: &[Sweep],
    pictures: &[Pattern],
    movies: &[MovieFile],
) -> Result<(Option<PathBuf>, Vec<PathBuf>)> {
    let (mut sheet, mut manifests) = (request.sheet.clone(), request.manifests.clone());
    let Some(first) = pictures.first() else {
        if sheet.is_some() || !manifests.is_empty() || !sweeps.is_empty() {
            let why = "a sweep, a sheet and a manifest need pictures";
            if let Some(movie) = movies.iter().find(|movie| movie.is_unnumbered()) {
                return Err(movie.unnumbered(why));
            }
            return Err(Error::Usage(format!("{why}; add -o with a .png or .exr")));
        }
        return Ok((None, Vec::new()));
    };
    if sweeps.is_empty() && sheet.is_some() {
        return Err(Error::Usage("--sheet needs a sweep; add --sweep KEY=VALUES".into()));
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
        && !Format::of(path).is_some_and(Format::is_developed)
    {
        let what = format!("--sheet {}: use .png, .jpg, .tif or .webp", path.display());
        return Err(Error::Usage(what));
    }
    // Opening and dropping each output finds a missing folder before the work starts.
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

/// A path without its `.` components.
fn plain(path: &Path) -> PathBuf {
    path.components().filter(|part| *part != std::path::Component::CurDir).collect()
}

/// Checks that a pattern gives different names to different frames and to different values of each sweep.
fn check_pattern(pattern: &Pattern, sweeps: &[Sweep], frames: usize) -> Result<()> {
    let given = pattern.given().display();
    if frames > 1 && !pattern.has_frame() {
        return Err(Error::Usage(format!(
            "-o {given}: {frames} frames would share one name; put #### (or %04d, $F4, @@@@) where the \
             frame's number goes, such as fall.####.png"
        )));
    }
    for (i, sweep) in sweeps.iter().enumerate() {
        if sweep.values.len() > 1 && !pattern.has_sweep(i) {
            return Err(Error::Usage(format!(
                "-o {given}: all values of {name} would share one name; put {{{name}}} where the value goes",
                name = sweep.name
            )));
        }
    }
    Ok(())
}
