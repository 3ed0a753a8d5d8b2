//! The plan of a batch: everything that is checked before any work.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::assemble::{MovieFile, is_csv};
use super::{Batch, NUMBER_IT, Pattern, Request, Sweep};
use crate::engine::exposure::exposed;
use crate::job::{Still, check_alpha, check_side};
use crate::output::frame::{Exr, Format, Output, folder_of, real_file, remove_stale};
use crate::output::movie::{Codec, MovieKind, Video, fraction};
use crate::picture::Layer;
use crate::scene::Animation;
use crate::util::error::{Error, Result};
use crate::util::monitor::{Monitor, Unwarned};

/// Most pictures of one batch.
const MAX_PICTURES: usize = 1_000_000;
/// Most scenes that are checked before the work starts, spread evenly over the pictures. Checking more would
/// keep the user waiting for the first picture.
const CHECKED_FRAMES: usize = 2000;

impl Batch {
    /// Plans a batch: checks the request, the scenes, the output names and folders, and the existing files.
    ///
    /// # Errors
    /// [`Error::Usage`] for a request that contradicts itself, [`Error::Input`] for an invalid scene,
    /// [`Error::CannotCreate`] for outputs that cannot be written or are other pictures, [`Error::Memory`]
    /// for pictures that do not fit, or an error of the monitor.
    pub fn plan(base: Animation, mut request: Request, monitor: &dyn Monitor) -> Result<Batch> {
        let frames: Vec<i32> = match &request.frames {
            Some(frames) => frames.clone(),
            None if !request.sweeps.is_empty() => vec![0],
            None => (0..base.frames as i32).collect(),
        };
        // Measuring the exposure reads a file already.
        base.check_files(&frames)?;
        // The volumes are made once more for the first picture, and warn then.
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
                    if let Some(number) = number_in_name(&pattern).filter(|_| kind == MovieKind::Apng) {
                        monitor.warn(&format!(
                            "{} becomes one animated PNG, because {number} is the same for all frames; for a \
                             file of each frame {NUMBER_IT}",
                            path.display()
                        ));
                    }
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
        batch.check_overviews()?;
        batch.check_sequences()?;
        batch.check_scenes(monitor)?;
        batch.check_folders()?;
        batch.check_depth(monitor)?;
        batch.check_bloom()?;
        batch.look(monitor)?;
        batch.check_movies()?;
        Ok(batch)
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

    /// Checks that the sheet and the manifests can be written, and that they replace only those of an earlier
    /// run of this batch.
    fn check_overviews(&self) -> Result<()> {
        if self.request.shard.is_some() {
            return Ok(());
        }
        for path in self.sheet.iter().chain(&self.manifests) {
            if !self.request.overwrite {
                self.check_replaced(path)?;
            }
            // Opening and dropping each output finds a missing folder before the work starts.
            drop(Output::open(path)?);
        }
        Ok(())
    }

    /// Checks the files of sequences at every point of a grid that changes them.
    fn check_sequences(&self) -> Result<()> {
        let of_files = ["file", "source", "frame", "builder", "volume"];
        let changes_files =
            self.sweeps.iter().any(|s| of_files.iter().any(|own| s.key.rsplit('.').next() == Some(own)));
        if !changes_files {
            return Ok(());
        }
        (0..self.count())
            .step_by(self.frames.len())
            .try_for_each(|number| self.animation(number)?.check_files(&self.frames))
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
                "{} is made of pictures with 8 bits per channel; add --bits 16, or write .exr files (and \
                 --overwrite where the pictures exist)",
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

/// Returns the digits at the end of a name, where they look like the number of a frame.
fn number_in_name(pattern: &Pattern) -> Option<&str> {
    let stem = pattern.given().file_stem()?.to_str()?;
    let name = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    let digits = &stem[name.len()..];
    (digits.len() >= 3 && name.ends_with(['.', '_', '-'])).then_some(digits)
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
        if !is_csv(path) && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
            return Err(Error::Usage(format!("--manifest {}: use .csv or .json", path.display())));
        }
    }
    if let Some(path) = &sheet
        && !Format::of(path).is_some_and(Format::is_developed)
    {
        let what = format!("--sheet {}: use .png, .jpg, .tif or .webp", path.display());
        return Err(Error::Usage(what));
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
