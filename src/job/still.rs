//! The files of a still: opened before the work, written row by row, named only when complete.

use std::fs::File;
use std::io::{BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::{Depth, check_alpha, check_side};
use crate::engine::RenderOptions;
use crate::grid::GridFile;
use crate::light::environment::Source;
use crate::output::frame::{
    CROP_TEXT, Channel, Compression, Encoding, Exr, ExrCamera, ExrHead, ExrWriter, FIGURES_TEXT, Figures,
    Format, Head, LINEAR_TEXT, Output, RowWriter, SCENE_TEXT, crop_text, lines_of, samples_of,
};
use crate::picture::{Frame, Gamut, Image, Layer, Look, Seconds};
use crate::scene::{MAP_COMMENT, Place, Raw, Scene, VOLUME_COMMENT, reference_keys};
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::window::Window;
use crate::volume::VolumeTexture;

/// Name and version of the program, as files store it.
pub(crate) const SOFTWARE: &str = concat!("taki ", env!("CARGO_PKG_VERSION"));

/// Lines of an EXR that are prepared at a time, on all cores.
const LINES: usize = 8;

/// Path that stands for stdout, which gets a PNG.
pub const STDOUT: &str = "-";

/// The open outputs of one still.
pub struct Still {
    outputs: Vec<(Format, Target)>,
    depth: Depth,
}

/// The place that a picture goes to.
pub(crate) enum Target {
    File(Output),
    /// A temporary file without a name, whose contents go to stdout once they are complete.
    Stdout(File),
}

impl Target {
    fn stdout() -> Result<Target> {
        let fail = |e: std::io::Error| Error::CannotCreate {
            path: std::env::temp_dir(),
            why: format!("no temporary file: {e}"),
            fix: "choose another folder with TMPDIR".into(),
        };
        tempfile::tempfile().map(Target::Stdout).map_err(fail)
    }

    fn path(&self) -> &Path {
        match self {
            Target::File(output) => output.path(),
            Target::Stdout(_) => Path::new("stdout"),
        }
    }

    /// Returns a second handle of the file that is written.
    fn handle(&mut self) -> Result<File> {
        let file = match self {
            Target::File(output) => output.file().try_clone(),
            Target::Stdout(file) => file.try_clone(),
        };
        file.map_err(|e| Error::write(self.path(), e))
    }

    fn finish(self) -> Result<()> {
        match self {
            Target::File(output) => output.finish(),
            Target::Stdout(mut file) => {
                let mut out = std::io::stdout().lock();
                let copied = file.rewind().and_then(|()| std::io::copy(&mut file, &mut out));
                copied.and_then(|_| out.flush()).map_err(Error::stdout)
            }
        }
    }
}

impl Still {
    /// Opens every output, so that a missing folder is noticed before any work. Removes temporary files that
    /// dead processes left in the folders. The path [`STDOUT`] is stdout, which gets a PNG.
    ///
    /// # Errors
    /// [`Error::Usage`] if a path has the extension of no format, [`Error::CannotCreate`] if a file cannot be
    /// created.
    pub fn create(paths: &[PathBuf]) -> Result<Still> {
        let target = |path: &PathBuf| match path.to_str() {
            Some(STDOUT) => Ok((Format::Png, Target::stdout()?)),
            _ => open(path, Output::create),
        };
        Ok(Still { outputs: paths.iter().map(target).collect::<Result<_>>()?, depth: Depth::default() })
    }

    /// Does as [`Still::create`], but leaves other files of the folders alone.
    ///
    /// # Errors
    /// As [`Still::create`].
    pub fn open(paths: &[PathBuf]) -> Result<Still> {
        let outputs = paths.iter().map(|path| open(path, Output::open)).collect::<Result<_>>()?;
        Ok(Still { outputs, depth: Depth::default() })
    }

    /// Chooses the depth of developed pictures.
    pub fn with_depth(self, depth: Depth) -> Still {
        Still { depth, ..self }
    }

    /// Checks that the formats can hold the part `window` of an image in the chosen depth, with its alpha.
    ///
    /// # Errors
    /// [`Error::Usage`] for a depth that does not suit, or a format without alpha, [`Error::CannotCreate`]
    /// for a part that is too large.
    pub fn check(&self, image: &Image, window: Window) -> Result<()> {
        self.depth.check(&self.formats(), &image.look)?;
        check_alpha(image, self.outputs.iter().map(|(format, target)| (target.path(), *format)))?;
        self.outputs.iter().try_for_each(|(format, target)| check_side(target.path(), *format, window))
    }

    /// Formats of the outputs.
    pub fn formats(&self) -> Vec<Format> {
        self.outputs.iter().map(|(format, _)| *format).collect()
    }

    /// Refuses to replace files that are no pictures.
    ///
    /// # Errors
    /// [`Error::CannotCreate`] if there is such a file.
    pub fn check_replaced(&self) -> Result<()> {
        self.outputs.iter().try_for_each(|(_, target)| match target {
            Target::File(output) => check_replaced(output.path()),
            Target::Stdout(_) => Ok(()),
        })
    }

    /// Whether an output is an EXR, which holds layers.
    pub fn has_exr(&self) -> bool {
        self.formats().contains(&Format::Exr)
    }

    /// Whether an output holds the developed picture, with bloom.
    pub fn has_developed(&self) -> bool {
        self.formats().into_iter().any(Format::is_developed)
    }

    /// Writes the heads of the files for the part `window` of a scene's image. EXR files get what `exr` says;
    /// where it splits the layers, the outputs are all files of one picture after another, as
    /// [`Exr::files`] lists them.
    ///
    /// # Errors
    /// [`Error::Io`] if writing fails, [`Error::Usage`] if [`Exr::check`] refuses the picture.
    pub fn begin(
        self,
        scene: &Scene,
        volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
        window: Window,
        exr: &Exr,
    ) -> Result<StillWriter> {
        let whole = [scene.image.width, scene.image.height];
        let alpha = scene.image.alpha;
        // An edited scene has no values, so the picture tells no scene.
        let text = scene.values().is_some().then(|| metadata(scene, volumes.as_ref()));
        let Depth { bits, linear } = self.depth;
        let files = exr.files(Path::new(""));
        let mut layers = files.iter().map(|(_, layers)| layers).cycle();
        let sinks = self.outputs.into_iter().map(|(format, output)| {
            let layers: Vec<Layer> = match format {
                Format::Exr => layers.next().into_iter().flatten().map(|l| l.of_picture(alpha)).collect(),
                _ => Vec::new(),
            };
            let channels = exr.channels(&layers, alpha);
            let head = ExrHead {
                compression: Compression::for_width(exr.compression, &channels, whole[0])?,
                gamut: scene.image.gamut,
                rate: exr.rate,
                camera: Some(ExrCamera::new(&scene.camera, whole)),
            };
            let about = About { whole, window, scene: text.clone(), channels, head };
            let encoding = format.encoding(bits, linear, alpha).in_gamut(scene.image.gamut);
            Ok((Sink::begin(format, output, encoding, &about)?, layers))
        });
        Ok(StillWriter {
            sinks: sinks.collect::<Result<_>>()?,
            whole,
            look: scene.image.look,
            window,
            half: exr.half,
            gamut: scene.image.gamut,
            rows: 0,
            figures: Figures::default(),
        })
    }

    /// Writes the frame of a scene's whole image and returns its figures. EXR files get what `exr` says.
    ///
    /// # Errors
    /// [`Error::Io`] if writing fails, [`Error::Usage`] if [`Exr::check`] refuses the picture.
    pub fn save(
        self,
        frame: &Frame,
        exr: &Exr,
        scene: &Scene,
        volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
    ) -> Result<Figures> {
        let mut writer = self.begin(scene, volumes, Window::whole([frame.width, frame.height]), exr)?;
        writer.push(frame)?;
        writer.finish()
    }
}

/// Refuses to replace a file that is no picture. An empty file may be replaced.
///
/// # Errors
/// [`Error::CannotCreate`] if the file is no picture.
pub(crate) fn check_replaced(path: &Path) -> Result<()> {
    check_kind(path, "picture", |start| Format::of_start(start).is_some() || start.starts_with(b"GIF8"))
}

/// Refuses to replace a file that is no volume. An empty file may be replaced.
///
/// # Errors
/// [`Error::CannotCreate`] if the file is no volume.
pub(crate) fn check_volume_replaced(path: &Path) -> Result<()> {
    if is_hair(path) {
        return check_kind(path, "file of hair", |start| start.starts_with(b"HAIR"));
    }
    match GridFile::of(path) {
        Some(own) => check_kind(path, &format!("{} file", own.words()), |start| own.starts(start)),
        None => check_kind(path, "volume", |start| start.starts_with(b"PK")),
    }
}

/// Whether a path has the ending of a file of hair.
pub(crate) fn is_hair(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("hair"))
}

/// Refuses to replace a file whose first 4096 bytes are not those of a `kind`. An empty file may be replaced.
///
/// # Errors
/// [`Error::CannotCreate`] if the file is of another kind.
pub(crate) fn check_kind(path: &Path, kind: &str, is: impl Fn(&[u8]) -> bool) -> Result<()> {
    // Whatever is no file is refused where the output is opened.
    if !path.is_file() {
        return Ok(());
    }
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(4096).read_to_end(&mut start));
    if read.is_ok() && (start.is_empty() || is(&start)) {
        return Ok(());
    }
    Err(Error::CannotCreate {
        path: path.to_owned(),
        why: format!("the file of this name is no {kind}"),
        fix: "choose another name, or remove the file; taki replaces it with --overwrite".into(),
    })
}

/// The text that a file stores about its scene: the volumes' checksums, then the scene file.
fn metadata(scene: &Scene, volumes: &[VolumeTexture]) -> String {
    format!("{}\n{}", volume_line(volumes), scene_text(scene))
}

/// The first line of that text, with the checksum of each volume. Equal volumes have equal lines.
pub(crate) fn volume_line(volumes: &[VolumeTexture]) -> String {
    let checksums: Vec<String> = volumes.iter().map(|volume| format!("{:08x}", volume.checksum())).collect();
    format!("{VOLUME_COMMENT}{}", checksums.join(" "))
}

/// The scene that made a picture, as a scene file. A volume or environment that was read from a file is
/// identified by its checksum, not by its path: equal pictures give equal files, and no folder names are
/// published.
pub(crate) fn scene_text(scene: &Scene) -> String {
    let map = scene.environment.as_ref().filter(|e| matches!(e.source, Source::File(_)));
    let map = map.map(|e| format!("{MAP_COMMENT}{:08x}\n", e.map.checksum()));
    let mut values = scene.written().clone();
    for key in reference_keys(&values) {
        // A volume of which only the file is given stays a volume.
        match key.starts_with("volumes.") || key.starts_with("meshes.") {
            true => values.set(&key, &Raw::Text(String::new()), &Place(key.clone())).expect("a text"),
            false => values.clear_under(&key),
        }
    }
    map.unwrap_or_default() + &values.to_toml()
}

fn open(path: &Path, open: impl Fn(&Path) -> Result<Output>) -> Result<(Format, Target)> {
    Ok((Format::wanted("-o", path)?, Target::File(open(path)?)))
}

/// Description of a file besides its pixels.
pub(crate) struct About {
    /// Width and height of the whole image, pixels.
    pub whole: [u32; 2],
    /// The part of the image that the file holds.
    pub window: Window,
    /// The scene's text, if known.
    pub scene: Option<String>,
    /// Channels of an EXR.
    pub channels: Vec<Channel>,
    /// Head of an EXR.
    pub head: ExrHead,
}

impl About {
    fn texts(&self, format: Format, encoding: Encoding) -> Vec<(String, String)> {
        let mut texts = vec![("Software".to_owned(), SOFTWARE.to_owned())];
        texts.extend(self.scene.iter().map(|scene| (SCENE_TEXT.to_owned(), scene.clone())));
        if format.is_developed() && self.window != Window::whole(self.whole) {
            texts.push((CROP_TEXT.to_owned(), crop_text(self.window, self.whole)));
        }
        if format.is_developed() && encoding.linear {
            texts.push((LINEAR_TEXT.to_owned(), encoding.gamut.name().to_owned()));
        }
        texts
    }
}

/// A file that is being written.
pub(crate) enum Sink {
    Rows(Target, Encoding, RowWriter),
    Exr(Target, Box<ExrWriter<BufWriter<File>>>),
}

impl Sink {
    /// Opens an output in the format that its extension names, and writes the file's head. A developed
    /// picture has this `encoding`.
    pub fn create(path: &Path, encoding: Encoding, about: &About) -> Result<Sink> {
        let (format, output) = open(path, Output::create)?;
        Sink::begin(format, output, encoding, about)
    }

    fn begin(format: Format, mut output: Target, encoding: Encoding, about: &About) -> Result<Sink> {
        let file = output.handle()?;
        let texts = about.texts(format, encoding);
        match format {
            Format::Png | Format::Jpeg | Format::Tiff | Format::Webp => {
                let size = [about.window.width, about.window.height];
                let head = Head { format, encoding, size, texts };
                let writer = RowWriter::new(file, head).map_err(|e| Error::write(output.path(), e))?;
                Ok(Sink::Rows(output, encoding, writer))
            }
            Format::Exr => {
                let file = BufWriter::with_capacity(1 << 20, file);
                let About { whole, window, channels, head, .. } = about;
                let writer = ExrWriter::new(file, *whole, *window, channels, head, &texts)
                    .map_err(|e| Error::write(output.path(), e))?;
                Ok(Sink::Exr(output, Box::new(writer)))
            }
        }
    }

    /// Writes the next rows in the file's own layout. A developed picture takes samples of any number of
    /// rows; an EXR takes one line in native byte order, channel by channel.
    pub fn push(&mut self, rows: Vec<u8>) -> Result<()> {
        match self {
            Sink::Rows(output, _, writer) => writer.push(rows).map_err(|e| Error::write(output.path(), e)),
            Sink::Exr(output, writer) => writer.push(rows).map_err(|e| Error::write(output.path(), e)),
        }
    }

    /// Completes the file and gives it its name. A developed picture also gets `figures`, if given.
    pub fn finish(self, figures: Option<&Figures>) -> Result<()> {
        let output = match self {
            Sink::Rows(output, _, writer) => {
                // Figures are whole numbers, so this serialisation cannot fail.
                let text = figures.and_then(|figures| serde_json::to_string(figures).ok());
                let texts = text.map(|text| (FIGURES_TEXT.to_owned(), text));
                writer.finish(texts.into_iter().collect()).map_err(|e| Error::write(output.path(), e))?;
                output
            }
            Sink::Exr(output, writer) => {
                writer.finish().map_err(|e| Error::write(output.path(), e))?;
                output
            }
        };
        output.finish()
    }
}

/// The files of a still while rows are written. Dropping it before [`StillWriter::finish`] leaves no file.
pub struct StillWriter {
    /// Files, and the layers of an EXR.
    sinks: Vec<(Sink, Vec<Layer>)>,
    window: Window,
    /// Width and height of the whole image, pixels.
    whole: [u32; 2],
    look: Look,
    half: bool,
    gamut: Gamut,
    /// Number of rows written.
    rows: u32,
    figures: Figures,
}

impl StillWriter {
    /// Writes the next rows of the window, from the top. A strip has the window's full width and any number
    /// of rows.
    ///
    /// # Errors
    /// [`Error::Io`] if writing fails.
    ///
    /// # Panics
    /// If the strip is not as wide as the window, or has more rows than remain.
    pub fn push(&mut self, strip: &Frame) -> Result<()> {
        assert_eq!(strip.width, self.window.width, "whole rows");
        assert!(strip.height <= self.window.height - self.rows, "no more rows than the window has");
        let window = Window { y: self.window.y + self.rows, height: strip.height, ..self.window };
        for (sink, layers) in &mut self.sinks {
            match sink {
                Sink::Rows(_, encoding, _) => {
                    let samples = samples_of(strip, *encoding, &self.look, window, self.whole);
                    sink.push(samples)?;
                }
                Sink::Exr(..) => {
                    // All lines at once would take as much memory as the frame itself.
                    for first in (0..strip.height).step_by(LINES) {
                        let rows = first..strip.height.min(first + LINES as u32);
                        lines_of(strip, layers, self.half, self.gamut, rows)
                            .into_iter()
                            .try_for_each(|line| sink.push(line))?;
                    }
                }
            }
        }
        self.figures.add(&Figures::of(strip));
        self.rows += strip.height;
        Ok(())
    }

    /// Renders the strips with `render` and writes them. Returns the seconds of each stage, summed over the
    /// strips. Progress counts pixels times `samples`, over all strips.
    ///
    /// # Errors
    /// An error of `render`, or [`Error::Io`] if writing fails.
    pub fn fill(
        &mut self,
        strips: &[Window],
        samples: u32,
        options: &RenderOptions,
        monitor: &dyn Monitor,
        mut render: impl FnMut(&RenderOptions, &dyn Monitor) -> Result<Frame>,
    ) -> Result<Seconds> {
        let rays = |strips: &[Window]| strips.iter().map(Window::pixels).sum::<u64>() * u64::from(samples);
        let total = rays(strips);
        let mut seconds = Seconds::default();
        for (i, strip) in strips.iter().enumerate() {
            let share = Share { monitor, before: rays(&strips[..i]), total };
            let frame = render(&RenderOptions { window: Some(*strip), ..options.clone() }, &share)?;
            seconds += frame.seconds;
            let clock = Instant::now();
            self.push(&frame)?;
            seconds.output += clock.elapsed().as_secs_f64();
        }
        Ok(seconds)
    }

    /// Figures of the rows written so far.
    pub fn figures(&self) -> &Figures {
        &self.figures
    }

    /// Completes the files, syncs them to the disk and gives them their names. Returns the figures of the
    /// window.
    ///
    /// # Errors
    /// [`Error::Io`] if writing, syncing or renaming fails.
    ///
    /// # Panics
    /// If rows are missing.
    pub fn finish(self) -> Result<Figures> {
        assert_eq!(self.rows, self.window.height, "all rows");
        let StillWriter { sinks, figures, .. } = self;
        sinks.into_iter().try_for_each(|(sink, _)| sink.finish(Some(&figures)))?;
        Ok(figures)
    }
}

/// Reports the progress of one strip as progress of the whole picture.
struct Share<'a> {
    monitor: &'a dyn Monitor,
    /// Rays of the strips before this one.
    before: u64,
    /// Rays of all strips.
    total: u64,
}

impl Monitor for Share<'_> {
    fn progress(&self, stage: &'static str, done: u64, _: u64) -> Result<()> {
        self.monitor.progress(stage, self.before + done, self.total)
    }

    fn warn(&self, text: &str) {
        self.monitor.warn(text);
    }
}
