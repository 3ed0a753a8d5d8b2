//! Movies: GIF and animated PNG are written here, MP4 and WebM by the program ffmpeg.
//!
//! Frames arrive one after another and are not kept, so the memory does not grow with their number. The file
//! appears under its name only once it is complete.

mod apng_file;
mod ffmpeg;
mod gif_file;
mod palette;

use std::path::Path;

use super::frame::{Encoding, Output};
use crate::util::error::{Error, Result};
use crate::util::monitor::{Monitor, Unwatched};

/// Format of a movie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MovieKind {
    /// GIF: 255 colours for the whole movie, at most 50 frames per second. Plays everywhere.
    Gif,
    /// Animated PNG: lossless.
    Apng,
    /// MP4: H.264 or H.265. Needs ffmpeg.
    Mp4,
    /// QuickTime: ProRes, H.264 or H.265. Needs ffmpeg.
    Mov,
    /// WebM: VP9. Needs ffmpeg.
    Webm,
}

/// Codec of a video.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Codec {
    /// H.264, 4:2:0: plays everywhere.
    H264,
    /// H.265, 4:2:0: half as large.
    H265,
    /// ProRes 422 HQ: for editing.
    Prores,
    /// VP9, 4:2:0: for the web.
    Vp9,
}

/// Codec and depth of a video.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Video {
    /// Codec.
    pub codec: Codec,
    /// Bits per sample, 8 or 10.
    pub bits: u8,
}

impl Codec {
    /// All codecs.
    pub const ALL: [Codec; 4] = [Codec::H264, Codec::H265, Codec::Prores, Codec::Vp9];

    /// Returns the word on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Codec::H264 => "h264",
            Codec::H265 => "h265",
            Codec::Prores => "prores",
            Codec::Vp9 => "vp9",
        }
    }

    /// Returns the depths, bits per sample. The first is the default.
    pub fn depths(self) -> &'static [u8] {
        match self {
            Codec::H264 | Codec::H265 | Codec::Vp9 => &[8, 10],
            Codec::Prores => &[10],
        }
    }
}

impl MovieKind {
    /// All formats.
    pub const ALL: [MovieKind; 5] =
        [MovieKind::Gif, MovieKind::Apng, MovieKind::Mp4, MovieKind::Mov, MovieKind::Webm];

    /// Returns the format of a file extension: `.gif`, `.apng`, `.mp4`, `.mov` or `.webm`, in upper or lower
    /// case. The caller decides for `.png`, which may be animated or not.
    pub fn of(path: &Path) -> Option<MovieKind> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        MovieKind::ALL.into_iter().find(|kind| kind.extension() == extension)
    }

    /// Returns the file extension.
    pub fn extension(self) -> &'static str {
        match self {
            MovieKind::Gif => "gif",
            MovieKind::Apng => "apng",
            MovieKind::Mp4 => "mp4",
            MovieKind::Mov => "mov",
            MovieKind::Webm => "webm",
        }
    }

    /// Returns the name for messages.
    pub fn name(self) -> &'static str {
        match self {
            MovieKind::Gif => "GIF",
            MovieKind::Apng => "animated PNG",
            MovieKind::Mp4 => "MP4",
            MovieKind::Mov => "MOV",
            MovieKind::Webm => "WebM",
        }
    }

    /// Returns the codecs of a video that this program writes. The first is the default.
    pub fn codecs(self) -> &'static [Codec] {
        match self {
            MovieKind::Gif | MovieKind::Apng => &[],
            MovieKind::Mp4 => &[Codec::H264, Codec::H265],
            MovieKind::Mov => &[Codec::Prores, Codec::H264, Codec::H265],
            MovieKind::Webm => &[Codec::Vp9],
        }
    }

    /// Returns the video that a file of this format holds: with the wanted codec and depth where the format
    /// has them, otherwise with its defaults. `None` for a format that is no video.
    pub fn video(self, codec: Option<Codec>, bits: Option<u8>) -> Option<Video> {
        let codecs = self.codecs();
        let codec = codec.filter(|codec| codecs.contains(codec)).or(codecs.first().copied())?;
        let bits = bits.filter(|bits| codec.depths().contains(bits)).unwrap_or(codec.depths()[0]);
        Some(Video { codec, bits })
    }

    /// Returns the largest side, pixels. GIF stores 16 bits; the encoders of both videos stop at 2¹⁴.
    fn longest_side(self) -> u32 {
        match self {
            MovieKind::Gif => 65_535,
            MovieKind::Apng => i32::MAX as u32,
            MovieKind::Mp4 | MovieKind::Mov | MovieKind::Webm => 16_384,
        }
    }

    /// Returns the lowest and highest number of frames per second. A GIF shows a frame for 1 to 65535
    /// hundredths of a second, and viewers treat 1 as 10. An animated PNG shows a frame for up to 65535 s.
    fn rates(self) -> [f64; 2] {
        match self {
            MovieKind::Gif => [0.01, 50.0],
            _ => [0.001, 1000.0],
        }
    }
}

/// Returns frames per second as a fraction: 1000/1001 of a whole number where the rate is one of film and
/// television.
pub fn fraction(fps: f64) -> [u32; 2] {
    match ffmpeg::film_rate(fps) {
        Some(whole) => [whole * 1000, 1001],
        None => {
            let [seconds, parts] = apng_file::delay(fps).map(u32::from);
            [parts, seconds]
        }
    }
}

/// Properties of a movie that are known before its first frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovieOptions {
    /// Width and height of a frame, pixels. MP4 and WebM need even sides: an odd side is extended by
    /// repeating its last column or row.
    pub size: [u32; 2],
    /// Frames per second. GIF counts in hundredths of a second; later frames compensate the rounding, so that
    /// the whole movie has the right length.
    pub fps: f64,
    /// Number of frames.
    pub frames: u64,
    /// Whether a GIF or animated PNG repeats for ever or plays once. For videos the player decides.
    pub repeat: bool,
    /// Number that identifies the movie. It is stored in the file, and [`mark_of`] reads it.
    pub mark: u64,
    /// Codec and depth of a video. `None`: the defaults of its format.
    pub video: Option<Video>,
}

/// Text that precedes the mark in a file.
const MARK: &str = "taki-movie-";

/// Bytes of a file in which the mark is searched. The index of an MP4 stands before the mark.
const MARK_WITHIN: u64 = 64 << 20;

/// Returns the mark of a movie that this program made.
pub fn mark_of(path: &Path) -> Option<u64> {
    let file = std::fs::File::open(path).ok().filter(|f| f.metadata().is_ok_and(|m| m.is_file()))?;
    let mut bytes = Vec::new();
    std::io::Read::read_to_end(&mut std::io::Read::take(file, MARK_WITHIN), &mut bytes).ok()?;
    let at = bytes.windows(MARK.len()).position(|w| w == MARK.as_bytes())? + MARK.len();
    let digits = std::str::from_utf8(bytes.get(at..at + 16)?).ok()?;
    u64::from_str_radix(digits, 16).ok()
}

impl MovieOptions {
    /// Returns the text that stores the mark in the file.
    fn mark_text(&self) -> String {
        format!("{MARK}{:016x}", self.mark)
    }

    /// Returns the encoding of the samples that frames are given in. A video of more than 8 bits gets 16.
    pub fn encoding(&self) -> Encoding {
        let bits = if self.video.is_some_and(|video| video.bits > 8) { 16 } else { 8 };
        Encoding { bits, ..Encoding::DISPLAY }
    }

    /// Returns the size of a frame, bytes.
    fn frame_bytes(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize * self.encoding().pixel_bytes()
    }
}

/// A movie that is being written. If it is dropped without [`Movie::finish`], no file remains.
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
    /// Opens a movie, and checks everything that can be checked before the first frame.
    ///
    /// # Errors
    /// [`Error::CannotCreate`] (exit 73) where the file cannot be created or the format cannot store the
    /// frames, [`Error::NoFfmpeg`] (exit 69) where ffmpeg or its encoder is missing.
    pub fn create(path: &Path, kind: MovieKind, options: &MovieOptions) -> Result<Movie> {
        Movie::create_with(path, kind, options, Path::new("ffmpeg"))
    }

    /// Opens a movie as [`Movie::create`] does, with the given ffmpeg. A name without a folder is searched on
    /// PATH.
    ///
    /// # Errors
    /// The errors of [`Movie::create`].
    pub fn create_with(path: &Path, kind: MovieKind, options: &MovieOptions, ffmpeg: &Path) -> Result<Movie> {
        let video = options.video.or(kind.video(None, None));
        let options = &MovieOptions { video, ..*options };
        check(path, kind, options)?;
        let output = Output::create(path)?;
        let writer = match kind {
            MovieKind::Gif => Writer::Gif(Box::new(gif_file::GifWriter::create(output, options)?)),
            MovieKind::Apng => Writer::Apng(Box::new(apng_file::ApngWriter::create(output, options)?)),
            MovieKind::Mp4 | MovieKind::Mov | MovieKind::Webm => {
                Writer::Video(Box::new(ffmpeg::VideoWriter::create(output, kind, options, ffmpeg)?))
            }
        };
        Ok(Movie { writer, path: path.to_owned(), options: *options, pushed: 0 })
    }

    /// Returns the encoding of the samples that frames are given in.
    pub fn encoding(&self) -> Encoding {
        self.options.encoding()
    }

    /// Adds a frame: sRGB samples R, G, B, row by row from the top left, in the depth of [`Movie::encoding`];
    /// those of 16 bits with the higher byte first. After an error the movie can only be dropped.
    ///
    /// # Errors
    /// [`Error::Io`] (exit 74) where the disk is full, ffmpeg failed, or the frame does not fit the options.
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
    ///
    /// # Errors
    /// [`Error::Io`] where frames are missing or the file cannot be written.
    pub fn finish(self) -> Result<()> {
        self.finish_watched(&Unwatched)
    }

    /// Completes the file as [`Movie::finish`] does, with a monitor that may stop it. A GIF is encoded only
    /// here, and a video encoder still has many frames to encode. The stage is `encoding`.
    ///
    /// # Errors
    /// The errors of [`Movie::finish`] and of `monitor`.
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

/// Refuses a movie that the format cannot store.
fn check(path: &Path, kind: MovieKind, options: &MovieOptions) -> Result<()> {
    let fail = |why: String, fix: String| Err(Error::CannotCreate { path: path.to_owned(), why, fix });
    let MovieOptions { size: [width, height], fps, frames, video, .. } = *options;
    if let Some(Video { codec, bits }) = video
        && !(kind.codecs().contains(&codec) && codec.depths().contains(&bits))
    {
        let why = format!("{} cannot hold {} with {bits} bits", kind.name(), codec.word());
        return fail(why, "choose another codec, depth or extension".into());
    }
    let (name, side, [slow, fast]) = (kind.name(), kind.longest_side(), kind.rates());
    if width == 0 || height == 0 || frames == 0 {
        return fail(
            format!("{frames} frames of {width}x{height} are no movie"),
            "give at least 1 of each".into(),
        );
    }
    let least = if video.is_some_and(|video| video.codec == Codec::H265) { 16 } else { 1 };
    if width.min(height) < least {
        let why = format!("{width}x{height} is less than the {least} pixels a side that H.265 needs");
        return fail(why, "make the frames larger, or choose another codec".into());
    }
    if width.max(height) > side {
        let why = format!("{width}x{height} is more than the {side} pixels a side of {name}");
        return fail(why, "make the frames smaller".into());
    }
    if !(slow..=fast).contains(&fps) {
        let why = format!("{name} cannot show {fps} frames a second");
        return fail(why, format!("choose {slow} to {fast}"));
    }
    // An animated PNG has at most 2³¹ − 1 frames, which is more than a year of any video.
    if frames > i32::MAX as u64 {
        return fail(
            format!("{frames} frames are more than {name} holds"),
            format!("give at most {}", i32::MAX),
        );
    }
    Ok(())
}
