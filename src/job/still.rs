//! A still's files: opened before the work, written while it goes on, whole or not at all.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::engine::RenderOptions;
use crate::light::environment::Source;
use crate::output::frame::{
    CROP_TEXT, ExrWriter, FIGURES_TEXT, Figures, Output, PngWriter, SCENE_TEXT, channel_names, crop_text,
    lines_of, rgb_rows,
};
use crate::picture::{Frame, Layer, Seconds};
use crate::scene::{REFERENCES, Scene};
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::window::Window;
use crate::volume::VolumeTexture;

/// The program that wrote a file.
pub(crate) const SOFTWARE: &str = concat!("taki ", env!("CARGO_PKG_VERSION"));

/// Lines of an EXR made at a time, on all cores.
const LINES: usize = 8;

/// The outputs of one still, open.
pub struct Still(Vec<(Kind, Output)>);

/// How an output is written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Png,
    Exr,
}

impl Still {
    /// Opens every output, so that a folder that is not there is known before any work.
    pub fn create(paths: &[PathBuf]) -> Result<Still> {
        paths.iter().map(|path| open(path, Output::create)).collect::<Result<Vec<_>>>().map(Still)
    }

    /// As [`Still::create`], but looks at no other file of the folders.
    pub fn open(paths: &[PathBuf]) -> Result<Still> {
        paths.iter().map(|path| open(path, Output::open)).collect::<Result<Vec<_>>>().map(Still)
    }

    /// Whether one of them holds layers.
    pub fn has_exr(&self) -> bool {
        self.0.iter().any(|(kind, _)| *kind == Kind::Exr)
    }

    /// Whether one of them is a picture as it is seen.
    pub fn has_png(&self) -> bool {
        self.0.iter().any(|(kind, _)| *kind == Kind::Png)
    }

    /// Starts the files of the part `window` of a scene's image; EXR files get `layers`.
    pub fn begin(
        self,
        scene: &Scene,
        volume: &VolumeTexture,
        window: Window,
        layers: &[Layer],
    ) -> Result<StillWriter> {
        let about = About {
            whole: [scene.image.width, scene.image.height],
            window,
            // What describes no scene would only mislead: an edited one has no values.
            scene: scene.values().is_some().then(|| metadata(scene, volume)),
            channels: channel_names(layers),
        };
        let sinks = self.0.into_iter().map(|(kind, output)| Sink::begin(kind, output, &about));
        Ok(StillWriter {
            sinks: sinks.collect::<Result<_>>()?,
            window,
            layers: layers.to_vec(),
            rows: 0,
            figures: Figures::default(),
        })
    }

    /// Writes the frame of a scene's whole image; EXR files get `layers`.
    pub fn save(
        self,
        frame: &Frame,
        layers: &[Layer],
        scene: &Scene,
        volume: &VolumeTexture,
    ) -> Result<Figures> {
        let mut writer = self.begin(scene, volume, Window::whole([frame.width, frame.height]), layers)?;
        writer.push(frame)?;
        writer.finish()
    }
}

/// What a file says of the scene that made it: a scene file, with the volume's checksum in front.
fn metadata(scene: &Scene, volume: &VolumeTexture) -> String {
    format!("{}\n{}", volume_line(volume), scene_text(scene))
}

/// The first line of a picture's scene: equal volumes have equal ones.
pub(crate) fn volume_line(volume: &VolumeTexture) -> String {
    format!("# volume texture: crc32 {:08x}", volume.checksum())
}

/// The scene that made a picture, as a scene file. A volume or environment from a file stands in a picture by
/// its contents, not by its path: equal pictures are equal files, and nobody's folders are published.
pub(crate) fn scene_text(scene: &Scene) -> String {
    let map = scene.environment.as_ref().filter(|e| matches!(e.source, Source::File(_)));
    let map = map.map(|e| format!("# environment map: crc32 {:08x}\n", e.map.checksum()));
    let mut values = scene.written().clone();
    REFERENCES.iter().for_each(|key| values.clear_under(key));
    map.unwrap_or_default() + &values.to_toml()
}

fn open(path: &Path, open: impl Fn(&Path) -> Result<Output>) -> Result<(Kind, Output)> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let kind = match extension.as_deref() {
        Some("png") => Kind::Png,
        Some("exr") => Kind::Exr,
        _ => {
            let what = format!("-o {}: unknown kind of picture; use .png or .exr", path.display());
            return Err(Error::Usage(what));
        }
    };
    Ok((kind, open(path)?))
}

/// What stands in a file besides its pixels.
pub(crate) struct About {
    /// Size of the whole image.
    pub whole: [u32; 2],
    /// The part in the file.
    pub window: Window,
    /// The scene that made it.
    pub scene: Option<String>,
    /// Channels of an EXR.
    pub channels: Vec<String>,
}

impl About {
    fn texts(&self, kind: Kind) -> Vec<(String, String)> {
        let mut texts = vec![("Software".to_owned(), SOFTWARE.to_owned())];
        texts.extend(self.scene.iter().map(|scene| (SCENE_TEXT.to_owned(), scene.clone())));
        if kind == Kind::Png && self.window != Window::whole(self.whole) {
            texts.push((CROP_TEXT.to_owned(), crop_text(self.window, self.whole)));
        }
        texts
    }
}

/// One file that is being written.
pub(crate) enum Sink {
    Png(Output, PngWriter),
    Exr(Output, Box<ExrWriter<BufWriter<File>>>),
}

impl Sink {
    /// Opens an output of the kind its name tells, and starts it.
    pub fn create(path: &Path, about: &About) -> Result<Sink> {
        let (kind, output) = open(path, Output::create)?;
        Sink::begin(kind, output, about)
    }

    fn begin(kind: Kind, mut output: Output, about: &About) -> Result<Sink> {
        let file = output.file().try_clone().map_err(|e| Error::write(output.path(), e))?;
        let texts = about.texts(kind);
        match kind {
            Kind::Png => {
                let size = [about.window.width, about.window.height];
                let writer = PngWriter::new(file, size, texts).map_err(|e| Error::write(output.path(), e))?;
                Ok(Sink::Png(output, writer))
            }
            Kind::Exr => {
                let file = BufWriter::with_capacity(1 << 20, file);
                let writer = ExrWriter::new(file, about.whole, about.window, &about.channels, &texts)
                    .map_err(|e| Error::write(output.path(), e))?;
                Ok(Sink::Exr(output, Box::new(writer)))
            }
        }
    }

    /// Writes the next rows as the file holds them: R, G, B bytes of any number of rows, or one line of
    /// native float32, channel by channel.
    pub fn push(&mut self, rows: Vec<u8>) -> Result<()> {
        match self {
            Sink::Png(output, writer) => writer.push(rows).map_err(|e| Error::write(output.path(), e)),
            Sink::Exr(output, writer) => writer.push(rows).map_err(|e| Error::write(output.path(), e)),
        }
    }

    /// Ends the file, with figures if it is a PNG and they are known, and gives it its name.
    pub fn finish(self, figures: Option<&Figures>) -> Result<()> {
        let output = match self {
            Sink::Png(output, writer) => {
                // Whole numbers only: they always are JSON.
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

/// The files of a still while its rows come. Dropped before [`StillWriter::finish`] it leaves nothing.
pub struct StillWriter {
    sinks: Vec<Sink>,
    window: Window,
    layers: Vec<Layer>,
    /// Rows written.
    rows: u32,
    figures: Figures,
}

impl StillWriter {
    /// Writes the next rows of the window at its full width, from the top; any number of them.
    ///
    /// # Panics
    /// If the strip is not as wide as the window, or has more rows than are left.
    pub fn push(&mut self, strip: &Frame) -> Result<()> {
        assert_eq!(strip.width, self.window.width, "whole rows");
        assert!(strip.height <= self.window.height - self.rows, "no more rows than the window has");
        for sink in &mut self.sinks {
            match sink {
                Sink::Png(..) => sink.push(rgb_rows(strip))?,
                Sink::Exr(..) => {
                    // Few at a time: they take as much memory as the frame.
                    for first in (0..strip.height).step_by(LINES) {
                        let rows = first..strip.height.min(first + LINES as u32);
                        lines_of(strip, &self.layers, rows)
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

    /// Renders strips with `render` and writes them; the seconds of all. Progress is told over the whole,
    /// in pixels times `samples`.
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

    /// The figures of what has been written.
    pub fn figures(&self) -> &Figures {
        &self.figures
    }

    /// Ends the files, syncs them and gives them their names; the figures of the window.
    ///
    /// # Panics
    /// If rows are missing.
    pub fn finish(self) -> Result<Figures> {
        assert_eq!(self.rows, self.window.height, "all rows");
        let StillWriter { sinks, figures, .. } = self;
        sinks.into_iter().try_for_each(|sink| sink.finish(Some(&figures)))?;
        Ok(figures)
    }
}

/// Tells the progress of a part as that of the whole.
struct Share<'a> {
    monitor: &'a dyn Monitor,
    before: u64,
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
