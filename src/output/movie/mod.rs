//! Moving pictures from frames: GIF and animated PNG by themselves, MP4 and WebM by the program ffmpeg.
//!
//! Frames come one after another and are not kept: memory stays flat however many there are. The file
//! appears under its name when it is whole, and not before.

mod apng_file;
mod ffmpeg;
mod gif_file;
mod palette;

use std::path::Path;

use super::frame::Output;
use crate::util::error::{Error, Result};
use crate::util::monitor::{Monitor, Unwatched};

/// The file's format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MovieKind {
    /// 255 colours for the whole movie, at most 50 frames a second. Plays everywhere.
    Gif,
    /// Animated PNG: every frame as it is, without loss.
    Apng,
    /// H.264 in MP4, 4:2:0, BT.709. Needs ffmpeg.
    Mp4,
    /// VP9 in WebM, 4:2:0, BT.709. Needs ffmpeg.
    Webm,
}

impl MovieKind {
    /// The kind that a file's extension says: `.gif`, `.apng`, `.mp4` or `.webm`, in any case. A `.png` may
    /// be an animated one; that is the caller's to say.
    pub fn of(path: &Path) -> Option<MovieKind> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "gif" => MovieKind::Gif,
            "apng" => MovieKind::Apng,
            "mp4" => MovieKind::Mp4,
            "webm" => MovieKind::Webm,
            _ => return None,
        })
    }

    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            MovieKind::Gif => "GIF",
            MovieKind::Apng => "animated PNG",
            MovieKind::Mp4 => "MP4",
            MovieKind::Webm => "WebM",
        }
    }

    /// Most pixels a side. GIF's are 16 bits; the encoders of the two videos stop at 2¹⁴.
    fn longest_side(self) -> u32 {
        match self {
            MovieKind::Gif => 65_535,
            MovieKind::Apng => i32::MAX as u32,
            MovieKind::Mp4 | MovieKind::Webm => 16_384,
        }
    }

    /// Slowest and fastest frames a second. A GIF shows a frame for 1 to 65535 hundredths of a second, and
    /// viewers take 1 for 10; an animated PNG for up to 65535 s.
    fn rates(self) -> [f64; 2] {
        match self {
            MovieKind::Gif => [0.01, 50.0],
            _ => [0.001, 1000.0],
        }
    }
}

/// What is known of a movie before its first frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovieOptions {
    /// Width and height of a frame, pixels. MP4 and WebM hold even sides only: an odd one gets one pixel
    /// more, the last column or row again.
    pub size: [u32; 2],
    /// Frames a second. GIF counts hundredths of a second: what a frame is shown too long or too short is
    /// made good by the next ones, so that the whole lasts as long as it should.
    pub fps: f64,
    /// Number of frames.
    pub frames: u64,
    /// Whether GIF and animated PNG start anew for ever, or play once. Videos leave that to the player.
    pub repeat: bool,
    /// Tells movies apart: it stands in the file, and [`mark_of`] finds it.
    pub mark: u64,
}

/// Stands before the mark in a file.
const MARK: &str = "taki-movie-";

/// As far as a mark is looked for: the index of an MP4 comes before it.
const MARK_WITHIN: u64 = 64 << 20;

/// The mark of a movie that this program made.
pub fn mark_of(path: &Path) -> Option<u64> {
    let file = std::fs::File::open(path).ok().filter(|f| f.metadata().is_ok_and(|m| m.is_file()))?;
    let mut bytes = Vec::new();
    std::io::Read::read_to_end(&mut std::io::Read::take(file, MARK_WITHIN), &mut bytes).ok()?;
    let at = bytes.windows(MARK.len()).position(|w| w == MARK.as_bytes())? + MARK.len();
    let digits = std::str::from_utf8(bytes.get(at..at + 16)?).ok()?;
    u64::from_str_radix(digits, 16).ok()
}

impl MovieOptions {
    /// What stands in the file for the mark.
    fn mark_text(&self) -> String {
        format!("{MARK}{:016x}", self.mark)
    }

    /// Bytes of one frame.
    fn frame_bytes(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize * 3
    }
}

/// A movie being written. Dropped without [`Movie::finish`] it leaves nothing.
pub struct Movie {
    writer: Writer,
    path: std::path::PathBuf,
    options: MovieOptions,
    pushed: u64,
}

enum Writer {
    Gif(Box<gif_file::GifWriter>),
    Apng(Box<apng_file::ApngWriter>),
    Video(Box<ffmpeg::VideoWriter>),
}

impl Movie {
    /// Opens the movie. What can be known before the work is known here: whether the file can be made
    /// (exit 73), whether the format can hold the frames (73), whether ffmpeg and its encoder are there
    /// (69, [`Error::NoFfmpeg`]).
    pub fn create(path: &Path, kind: MovieKind, options: &MovieOptions) -> Result<Movie> {
        Movie::create_with(path, kind, options, Path::new("ffmpeg"))
    }

    /// As [`Movie::create`] with an ffmpeg of one's own; a name without a folder is looked for on PATH.
    pub fn create_with(path: &Path, kind: MovieKind, options: &MovieOptions, ffmpeg: &Path) -> Result<Movie> {
        check(path, kind, options)?;
        let output = Output::create(path)?;
        let writer = match kind {
            MovieKind::Gif => Writer::Gif(Box::new(gif_file::GifWriter::create(output, options)?)),
            MovieKind::Apng => Writer::Apng(Box::new(apng_file::ApngWriter::create(output, options)?)),
            MovieKind::Mp4 | MovieKind::Webm => {
                Writer::Video(Box::new(ffmpeg::VideoWriter::create(output, kind, options, ffmpeg)?))
            }
        };
        Ok(Movie { writer, path: path.to_owned(), options: *options, pushed: 0 })
    }

    /// Adds a frame: sRGB bytes R, G, B, row by row from the top left. Fails with 74 where the disk is full
    /// or ffmpeg gave up; the movie can then only be dropped.
    pub fn push(&mut self, rgb: &[u8]) -> Result<()> {
        let expected = self.options.frame_bytes();
        if rgb.len() != expected {
            return Err(Error::write(&self.path, format!("a frame of {} bytes, not {expected}", rgb.len())));
        }
        if self.pushed == self.options.frames {
            return Err(Error::write(&self.path, format!("more than the {} frames announced", self.pushed)));
        }
        match &mut self.writer {
            Writer::Gif(w) => w.push(rgb)?,
            Writer::Apng(w) => w.push(rgb)?,
            Writer::Video(w) => w.push(rgb)?,
        }
        self.pushed += 1;
        Ok(())
    }

    /// Completes the file and gives it its name.
    pub fn finish(self) -> Result<()> {
        self.finish_watched(&Unwatched)
    }

    /// As [`Movie::finish`], with a monitor that may stop it: a GIF is made from its frames here, and a
    /// video encoder has many frames in hand. Stages told: `encoding`.
    pub fn finish_watched(self, monitor: &dyn Monitor) -> Result<()> {
        let Movie { writer, path, options, pushed } = self;
        if pushed != options.frames {
            return Err(Error::write(&path, format!("{pushed} of {} frames came", options.frames)));
        }
        match writer {
            Writer::Gif(w) => w.finish(monitor),
            Writer::Apng(w) => w.finish(),
            Writer::Video(w) => w.finish(monitor),
        }
    }
}

/// Refuses what the format cannot hold.
fn check(path: &Path, kind: MovieKind, options: &MovieOptions) -> Result<()> {
    let fail = |why: String, fix: String| Err(Error::CannotCreate { path: path.to_owned(), why, fix });
    let MovieOptions { size: [width, height], fps, frames, .. } = *options;
    let (name, side, [slow, fast]) = (kind.name(), kind.longest_side(), kind.rates());
    if width == 0 || height == 0 || frames == 0 {
        return fail(
            format!("{frames} frames of {width}x{height} are no movie"),
            "give at least 1 of each".into(),
        );
    }
    if width.max(height) > side {
        let why = format!("{width}x{height} is more than the {side} pixels a side of {name}");
        return fail(why, "make the frames smaller".into());
    }
    if !(slow..=fast).contains(&fps) {
        let why = format!("{name} cannot show {fps} frames a second");
        return fail(why, format!("choose {slow} to {fast}"));
    }
    // 2³¹ frames are the animated PNG's limit, and more than a year of any video.
    if frames > i32::MAX as u64 {
        return fail(
            format!("{frames} frames are more than {name} holds"),
            format!("give at most {}", i32::MAX),
        );
    }
    Ok(())
}
