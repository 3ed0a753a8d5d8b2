//! Makes the files that need all pictures: movies, the contact sheet, manifests.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use image::RgbImage;
use rayon::prelude::*;
use serde::Serialize;

use super::pattern::NUMBER_IT;
use super::report::{Event, Watcher, word, words};
use super::shown::Shown;
use super::{Batch, Pattern, Sweep, existing};
use crate::job::check_side;
use crate::job::still::{SOFTWARE, scene_text};
use crate::output::contact_sheet::{Axis, Sheet, draw};
use crate::output::frame::{Encoding, Format, Head, KnownFigures, Output, encode, figures_of, real_file};
use crate::output::movie::{Movie, MovieKind, MovieOptions, Video, mark_of};
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::util::window::Window;

/// A movie that the user asked for; each point of the sweep's grid gets one.
#[derive(Clone, Debug)]
pub struct MovieFile {
    /// Pattern of its name.
    pub pattern: Pattern,
    /// Format.
    pub kind: MovieKind,
    /// Codec and depth, if it is a video.
    pub video: Option<Video>,
}

impl MovieFile {
    /// Whether it is a movie only because a .png without the frame's number has several frames.
    pub fn is_unnumbered(&self) -> bool {
        self.kind == MovieKind::Apng && self.pattern.format() == Some(Format::Png)
    }

    /// The error where such a movie does not do.
    pub fn unnumbered(&self, why: &str) -> Error {
        Error::Usage(format!(
            "-o {}: without the frame's number in its name it is one animated PNG, and {why}; {NUMBER_IT}",
            self.pattern.given().display()
        ))
    }
}

/// A manifest's entry about one picture.
#[derive(Serialize)]
struct Row {
    number: usize,
    frame: i32,
    #[serde(skip_serializing_if = "serde_json::Map::is_empty")]
    parameters: serde_json::Map<String, serde_json::Value>,
    files: Vec<String>,
    mean_radiance: Option<[f64; 3]>,
    mean_transmittance: Option<f64>,
    covered_pixels: Option<u64>,
    cells_walked: Option<u64>,
    light_cells_walked: Option<u64>,
}

impl Batch {
    /// Number of points of the sweep's grid.
    fn points(&self) -> usize {
        self.count() / self.frames.len()
    }

    /// Path of a movie at a point of the grid.
    pub(super) fn movie_path(&self, movie: &MovieFile, point: usize) -> PathBuf {
        movie.pattern.at(0, &self.words(point * self.frames.len()))
    }

    /// Options of a movie whose pictures have the size of `scene`'s.
    pub(super) fn movie_options(&self, scene: &Scene) -> MovieOptions {
        let window = self.window(scene);
        MovieOptions {
            size: [window.width, window.height],
            fps: self.base.fps,
            frames: self.frames.len() as u64,
            repeat: true,
            mark: 0,
            video: None,
        }
    }

    /// Movies to start with picture `number`. Without picture files, movies are encoded while the frames are
    /// rendered; with them, [`Batch::assemble`] makes the movies.
    pub(super) fn movies_starting(
        &self,
        number: usize,
        scene: &Scene,
    ) -> Vec<(PathBuf, MovieKind, MovieOptions)> {
        if !self.pictures.is_empty() || !number.is_multiple_of(self.frames.len()) {
            return Vec::new();
        }
        let point = number / self.frames.len();
        let options = self.movie_options(scene);
        let movies = self.movies.iter().map(|m| (self.movie_path(m, point), m));
        let missing = movies.filter(|(path, _)| !self.fresh.contains(path));
        missing.map(|(path, m)| (path, m.kind, self.options_of(m, point, options))).collect()
    }

    /// Options of a movie at a point of the grid, from those of any movie there.
    fn options_of(&self, movie: &MovieFile, point: usize, options: MovieOptions) -> MovieOptions {
        let mut mark = self.marks.get(point).copied().unwrap_or(0);
        if let Some(Video { codec, bits }) = movie.video.filter(|v| Some(*v) != movie.kind.video(None, None))
        {
            mark ^= u64::from(crc32fast::hash(format!("{} {bits}", codec.word()).as_bytes()));
        }
        MovieOptions { mark, video: movie.video, ..options }
    }

    /// Checks that movies can be made, and that they replace only files that may be replaced. Existing
    /// movies of exactly these frames stay.
    pub(super) fn check_movies(&mut self) -> Result<()> {
        if self.movies.is_empty() {
            return Ok(());
        }
        if self.request.shard.is_some() {
            return Err(Error::Usage(
                "a movie needs all frames, but a shard renders only some; leave the movie out of the \
                 shards, and when all are done, run the command with the movie and without --shard"
                    .into(),
            ));
        }
        let scene = self.scene(0)?;
        let options = self.movie_options(&scene);
        self.marks = (0..self.points()).map(|point| self.mark(point, &options)).collect::<Result<_>>()?;
        for movie in &self.movies {
            for point in 0..self.points() {
                let path = self.movie_path(movie, point);
                let options = self.options_of(movie, point, options);
                if real_file(&path)?.symlink_metadata().is_ok() && !self.request.overwrite {
                    let why = match mark_of(&path) {
                        Some(mark) if mark == options.mark => {
                            self.fresh.insert(path);
                            continue;
                        }
                        Some(_) => {
                            "the movie exists with other frames, or of another scene, size, rate or codec"
                        }
                        None => "it exists and is not a movie that taki wrote",
                    };
                    return Err(Error::CannotCreate {
                        path,
                        why: why.into(),
                        fix: "remove it, choose another name with -o, or replace all with --overwrite".into(),
                    });
                }
                if point == 0 {
                    // Opening and dropping it checks the folder, ffmpeg and the format's limits.
                    drop(Movie::create(&path, movie.kind, &options)?);
                }
            }
        }
        if self.pictures.is_empty() && self.movies.len() * self.points() == self.fresh.len() {
            // Every movie exists, and no pictures are asked for, so no frame is needed.
            self.whole.fill(true);
        }
        Ok(())
    }

    /// Mark that identifies a movie: a hash of the scenes of all its frames, its size and its frame rate.
    fn mark(&self, point: usize, options: &MovieOptions) -> Result<u64> {
        let numbers = point * self.frames.len()..(point + 1) * self.frames.len();
        let scenes: Vec<u32> = numbers
            .into_par_iter()
            .map(|n| Ok(crc32fast::hash(scene_text(&self.scene(n)?).as_bytes())))
            .collect::<Result<_>>()?;
        let text = format!("{:?} {} {scenes:?}", options.size, options.fps);
        let halves = ["a", "b"].map(|salt| u64::from(crc32fast::hash(format!("{salt}{text}").as_bytes())));
        Ok(halves[0] << 32 | halves[1])
    }

    /// Makes the movies, the sheet and the manifests, once all pictures exist.
    pub(super) fn assemble(&self, watcher: &dyn Watcher) -> Result<()> {
        if self.request.shard.is_some() {
            return Ok(());
        }
        if !self.pictures.is_empty() {
            for movie in &self.movies {
                for point in 0..self.points() {
                    let path = self.movie_path(movie, point);
                    if !self.fresh.contains(&path) {
                        self.make_movie(movie, &path, point, watcher)?;
                        watcher.event(&Event::Assembled { file: word(&path) });
                    }
                }
            }
        }
        if let Some(path) = &self.sheet {
            let sheet = self.draw_sheet(watcher)?;
            let format = Format::wanted("--sheet", path)?;
            check_side(path, format, Window::whole([sheet.width(), sheet.height()]))?;
            let bytes = self.encoded(sheet, format).map_err(|e| Error::write(path, e))?;
            Output::create(path)?.finish_with(&bytes)?;
            watcher.event(&Event::Assembled { file: word(path) });
        }
        if !self.manifests.is_empty() {
            let rows = (0..self.count()).map(|n| self.row(n, watcher)).collect::<Result<Vec<Row>>>()?;
            for path in &self.manifests {
                let bytes = if is_csv(path) {
                    self.csv(&rows)
                } else {
                    serde_json::to_vec_pretty(&rows).map_err(Into::into)
                };
                let bytes = bytes.map_err(|e: std::io::Error| Error::write(path, e))?;
                Output::create(path)?.finish_with(&bytes)?;
                watcher.event(&Event::Assembled { file: word(path) });
            }
        }
        Ok(())
    }

    fn make_movie(&self, file: &MovieFile, path: &Path, point: usize, watcher: &dyn Watcher) -> Result<()> {
        let first = point * self.frames.len();
        let scene = self.scene(first)?;
        let options = self.options_of(file, point, self.movie_options(&scene));
        let mut movie = Movie::create(path, file.kind, &options)?;
        let bits = movie.encoding().bits;
        for (i, number) in (first..first + self.frames.len()).enumerate() {
            watcher.progress("movie", i as u64, self.frames.len() as u64)?;
            movie.push(&self.shown(number, bits)?.samples)?;
        }
        movie.finish_watched(watcher)
    }

    fn draw_sheet(&self, watcher: &dyn Watcher) -> Result<RgbImage> {
        let scene = self.scene(0)?;
        let window = self.window(&scene);
        let axis = |sweep: &Sweep| Axis {
            name: sweep.axis(),
            values: sweep.values.iter().map(|(_, word)| word.clone()).collect(),
        };
        let axes: Vec<Axis> = self.sweeps.iter().map(axis).collect();
        let samples = scene.image.samples;
        let subtitle = format!(
            "frame {} · {}×{} pixels · {samples} {}",
            self.frames[0],
            window.width,
            window.height,
            if samples == 1 { "sample" } else { "samples" }
        );
        let sheet = Sheet::of(self.base.name(), &subtitle, &axes, [window.width, window.height]);
        // The first sweep runs across the sheet; the others run down, the last one fastest. Points are
        // ordered with the first sweep slowest, so a column's points are consecutive.
        let rows = self.points() / self.sweeps[0].values.len();
        draw(&sheet, |row, column| {
            watcher.progress(
                "sheet",
                (row * self.sweeps[0].values.len() + column) as u64,
                self.points() as u64,
            )?;
            let number = (column * rows + row) * self.frames.len();
            let Shown { size: [width, height], samples } = self.shown(number, 8)?;
            Ok(RgbImage::from_raw(width, height, samples))
        })
    }

    /// Encodes the sheet with the texts by which [`Batch::check_replaced`] knows it.
    fn encoded(&self, sheet: RgbImage, format: Format) -> std::io::Result<Vec<u8>> {
        let (width, height) = sheet.dimensions();
        let texts =
            vec![("Software".to_owned(), SOFTWARE.to_owned()), (SHEET_TEXT.to_owned(), self.sheet_text())];
        let head = Head { format, encoding: Encoding::DISPLAY, size: [width, height], texts };
        encode(&head, sheet.into_raw())
    }

    /// Text of the sheet: what it shows. More values of the same sweeps make another sheet of the same text.
    fn sheet_text(&self) -> String {
        let keys: Vec<&str> = self.sweeps.iter().map(|sweep| sweep.key.as_str()).collect();
        let name = self.pictures.first().and_then(|p| p.given().file_name()).unwrap_or_default();
        format!("{} by {}", name.display(), keys.join(", "))
    }

    /// Refuses to replace a file that is not the sheet or a manifest of an earlier run of this batch.
    pub(super) fn check_replaced(&self, path: &Path) -> Result<()> {
        if real_file(path)?.symlink_metadata().is_err() {
            return Ok(());
        }
        let start = existing::start_of(path).unwrap_or_default();
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let (known, own) = match extension.as_deref() {
            Some("csv") => (start.starts_with(b"number,frame,"), self.is_named_in(path)),
            Some("json") => (start.starts_with(b"[\n  {\n    \"number\": "), self.is_named_in(path)),
            _ => (existing::is_ours(path), existing::holds(path, self.sheet_text().as_bytes())),
        };
        if known && own || start.is_empty() && path.is_file() {
            return Ok(());
        }
        let why = match known {
            true => "a file of another batch has this name",
            false => "a file that taki did not write has this name",
        };
        Err(Error::CannotCreate {
            path: path.to_owned(),
            why: why.into(),
            fix: "choose other names with --sheet and --manifest, or replace the files with --overwrite"
                .into(),
        })
    }

    /// Whether a manifest lists a picture of this batch.
    fn is_named_in(&self, manifest: &Path) -> bool {
        let Ok(text) = std::fs::read_to_string(manifest) else { return false };
        // JSON and CSV quote names differently, but both end them with a quote or a comma.
        let names: HashSet<&str> = text.split(['"', ',', '/', '\\', '\n']).collect();
        let name = |file: PathBuf| Some(file.file_name()?.to_str()?.to_owned());
        (0..self.count()).flat_map(|n| self.files(n)).filter_map(name).any(|name| names.contains(&*name))
    }

    fn row(&self, number: usize, watcher: &dyn Watcher) -> Result<Row> {
        watcher.progress("manifest", number as u64, self.count() as u64)?;
        let scene = self.scene(number)?;
        let values = scene.written();
        let parameters = self.sweeps.iter().map(|s| (s.key.clone(), values.get(&s.key).to_json())).collect();
        let files = self.files(number);
        // A developed picture carries all figures in its text; an EXR's layers yield only some.
        let figures = match self.pictures.iter().position(|p| !p.is_exr()) {
            Some(developed) => figures_of(&files[developed])?,
            None => {
                let own = self.request.exr.files(Path::new("")).len();
                let all = files[..own].iter().map(|file| figures_of(file)).collect::<Result<Vec<_>>>()?;
                all.into_iter().reduce(KnownFigures::join).unwrap_or_default()
            }
        };
        Ok(Row {
            number,
            frame: self.frame(number),
            parameters,
            files: words(&files),
            mean_radiance: figures.mean_radiance(),
            mean_transmittance: figures.mean_transmittance(),
            covered_pixels: figures.covered_pixels,
            cells_walked: figures.cells_walked,
            light_cells_walked: figures.light_cells_walked,
        })
    }

    fn csv(&self, rows: &[Row]) -> std::io::Result<Vec<u8>> {
        let mut out = csv::Writer::from_writer(Vec::new());
        let mut head = vec!["number".to_owned(), "frame".into()];
        head.extend(self.sweeps.iter().map(|s| s.key.clone()));
        head.extend(self.formats().into_iter().zip(&self.layers).map(|(format, own)| match own.as_slice() {
            [layer] if self.request.exr.split => format!("exr.{}", layer.name()),
            _ => format.extension().to_owned(),
        }));
        let figures = [
            "mean_r",
            "mean_g",
            "mean_b",
            "mean_transmittance",
            "covered_pixels",
            "cells_walked",
            "light_cells_walked",
        ];
        head.extend(figures.map(str::to_owned));
        out.write_record(&head)?;
        for row in rows {
            let float = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
            let count = |x: Option<u64>| x.map_or(String::new(), |x| x.to_string());
            let mut record = vec![row.number.to_string(), row.frame.to_string()];
            // The columns follow the head's order, which the map does not keep.
            let parameters = self.sweeps.iter().map(|s| &row.parameters[&s.key]);
            record.extend(parameters.map(|v| v.as_str().map_or_else(|| v.to_string(), str::to_owned)));
            record.extend(row.files.iter().cloned());
            record.extend((0..3).map(|c| float(row.mean_radiance.map(|m| m[c]))));
            record.push(float(row.mean_transmittance));
            record.extend([row.covered_pixels, row.cells_walked, row.light_cells_walked].map(count));
            out.write_record(&record)?;
        }
        out.into_inner().map_err(|e| e.into_error())
    }
}

/// Key of the text by which a sheet is told from those of other batches.
const SHEET_TEXT: &str = "taki.sheet";

/// Whether a manifest is CSV; otherwise it is JSON.
pub(super) fn is_csv(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"))
}
