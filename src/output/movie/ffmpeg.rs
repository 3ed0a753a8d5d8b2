//! MP4, MOV and WebM by the program ffmpeg: it reads frames from its stdin and writes the file to its stdout.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use super::{Codec, MovieKind, MovieOptions, Video};
use crate::output::frame::Output;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;

/// Bytes that are kept of ffmpeg's stderr.
const STDERR_BYTES: usize = 4096;

/// Longest wait for the end of stderr after ffmpeg ended: a child process of ffmpeg may keep it open.
const STDERR_WAIT: Duration = Duration::from_secs(2);

pub(super) struct VideoWriter {
    /// Declared before the output, so that the process ends before its file is removed.
    encoder: Encoder,
    output: Output,
    size: [u32; 2],
    /// Bytes of a pixel.
    pixel_bytes: usize,
    frames: u64,
    /// Buffer of a frame with even sides, used where the movie's sides are odd.
    padded: Vec<u8>,
}

impl VideoWriter {
    pub(super) fn create(
        mut output: Output,
        kind: MovieKind,
        options: &MovieOptions,
        program: &Path,
    ) -> Result<Self> {
        let Some(video) = options.video else {
            return Err(Error::write(output.path(), format!("{} is no video", kind.name())));
        };
        has_encoder(video.codec, program)?;
        let file = output.file().try_clone().map_err(|e| Error::write(output.path(), e))?;
        let even = options.size.map(|side| side.next_multiple_of(2));
        let mut command = quiet(program);
        command.args(arguments(kind, video, even, options)).stdin(Stdio::piped()).stdout(file);
        let encoder = Encoder::start(command, program, output.path())?;
        let pixel_bytes = options.encoding().pixel_bytes();
        let bytes = if even == options.size { 0 } else { even[0] as usize * even[1] as usize * pixel_bytes };
        let padded = Vec::with_capacity(bytes);
        let (size, frames) = (options.size, options.frames);
        Ok(VideoWriter { encoder, output, size, pixel_bytes, frames, padded })
    }

    pub(super) fn push(&mut self, rgb: &[u8]) -> Result<()> {
        let [width, height] = self.size.map(|side| side as usize);
        if width % 2 == 0 && height % 2 == 0 {
            return self.encoder.write(rgb);
        }
        self.padded.clear();
        let row_bytes = width * self.pixel_bytes;
        for y in 0..height.next_multiple_of(2) {
            let row = &rgb[y.min(height - 1) * row_bytes..][..row_bytes];
            self.padded.extend_from_slice(row);
            if width % 2 == 1 {
                self.padded.extend_from_slice(&row[row_bytes - self.pixel_bytes..]);
            }
        }
        self.encoder.write(&self.padded)
    }

    pub(super) fn finish(self, monitor: &dyn Monitor) -> Result<()> {
        let VideoWriter { encoder, output, frames, .. } = self;
        encoder.finish(frames, monitor)?;
        output.finish()
    }
}

/// Makes a command for ffmpeg without questions, banner or progress. It has its own process group, so that
/// Ctrl-C in the terminal reaches only this program.
fn quiet(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.args(["-nostdin", "-hide_banner", "-nostats", "-loglevel", "error"]);
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command
}

/// Returns the encoder's name in ffmpeg.
fn encoder_name(codec: Codec) -> &'static str {
    match codec {
        Codec::H264 => "libx264",
        Codec::H265 => "libx265",
        Codec::Prores => "prores_ks",
        Codec::Vp9 => "libvpx-vp9",
    }
}

/// Options of x265 that make it silent but for errors, and leave out the text about itself.
const QUIET_X265: &str = "log-level=error:info=0";

/// Checks that ffmpeg exists and can encode this format.
fn has_encoder(codec: Codec, program: &Path) -> Result<()> {
    let run = quiet(program).arg("-encoders").stdin(Stdio::null()).output();
    let list = run.map_err(|e| absent(program, &e))?;
    let codec = encoder_name(codec);
    let encoders = String::from_utf8_lossy(&list.stdout);
    // A line of the list has flags, name and description.
    if encoders.lines().any(|line| line.split_whitespace().nth(1) == Some(codec)) {
        return Ok(());
    }
    Err(Error::NoFfmpeg(format!("{} has no encoder {codec}", program.display())))
}

fn absent(program: &Path, e: &std::io::Error) -> Error {
    match e.kind() {
        ErrorKind::NotFound => Error::NoFfmpeg(format!("there is no program {}", program.display())),
        _ => Error::NoFfmpeg(format!("{} does not start: {e}", program.display())),
    }
}

/// Formats frames per second. Those of film and television are written as a fraction, which ffmpeg would not
/// find in the float32 of the scene.
fn rate(fps: f64) -> String {
    film_rate(fps).map_or_else(|| fps.to_string(), |whole| format!("{whole}000/1001"))
}

/// Returns the whole number of which a rate of film and television is 1000/1001, such as 24; `None` for other
/// rates.
pub(super) fn film_rate(fps: f64) -> Option<u32> {
    let whole = (fps * 1.001).round();
    let is_fraction = fps.fract() != 0.0 && (whole * 1000.0 / 1001.0) as f32 == fps as f32;
    is_fraction.then_some(whole as u32)
}

/// Returns the arguments after those of [`quiet`]: frames on stdin, the file on stdout.
fn arguments(
    kind: MovieKind,
    Video { codec, bits }: Video,
    [width, height]: [u32; 2],
    options: &MovieOptions,
) -> Vec<String> {
    let (size, fps) = (format!("{width}x{height}"), rate(options.fps));
    let comment = format!("comment={}", options.mark_text());
    let given = if options.encoding().bits == 8 { "rgb24" } else { "rgb48be" };
    let stored = match (codec, bits) {
        (Codec::Prores, _) => "yuv422p10le",
        (_, 8) => "yuv420p",
        _ => "yuv420p10le",
    };
    let mut all: Vec<&str> = Vec::new();
    all.extend(["-f", "rawvideo", "-pixel_format", given, "-video_size", &size, "-framerate", &fps]);
    all.extend(["-i", "pipe:0"]);
    // By default ffmpeg converts with the matrix of BT.601 and does not tag it; players assume BT.709.
    let convert = format!(
        "scale=in_range=full:out_range=limited:out_color_matrix=bt709:\
         flags=bicubic+accurate_rnd+full_chroma_int,format={stored},\
         setparams=range=tv:colorspace=bt709:color_primaries=bt709:color_trc=bt709"
    );
    all.extend(["-vf", &convert, "-color_range", "tv", "-colorspace", "bt709", "-color_primaries", "bt709"]);
    all.extend(["-color_trc", "bt709", "-c:v", encoder_name(codec)]);
    // With a fixed number of threads the file is the same on every machine with the same ffmpeg.
    all.extend(["-threads", "4", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"]);
    all.extend(["-metadata", &comment]);
    // Water has fine grain, which ffmpeg's default qualities blur.
    all.extend(match codec {
        Codec::Vp9 => &["-crf", "24", "-b:v", "0", "-deadline", "good", "-cpu-used", "3"][..],
        Codec::H264 if bits == 8 => &["-crf", "16", "-preset", "medium", "-profile:v", "high"],
        Codec::H264 => &["-crf", "16", "-preset", "medium", "-profile:v", "high10"],
        // The tag is the one that QuickTime plays.
        Codec::H265 => &["-crf", "18", "-preset", "medium", "-tag:v", "hvc1", "-x265-params", QUIET_X265],
        // Profile 3 is 422 HQ.
        Codec::Prores => &["-profile:v", "3", "-vendor", "apl0"],
    });
    all.extend(match kind {
        MovieKind::Webm => &["-f", "webm", "-y", OUT][..],
        MovieKind::Mov => &["-movflags", MOVFLAGS, "-f", "mov", "-y", OUT],
        _ => &["-movflags", MOVFLAGS, "-f", "mp4", "-y", OUT],
    });
    all.into_iter().map(String::from).collect()
}

/// Output of ffmpeg. The file is already open as its stdout, so no name has to pass through ffmpeg's syntax.
/// On Linux, /dev/stdout opens the file itself again; ffmpeg can then seek in it and move the index to its
/// start. Elsewhere the file is written sequentially, an MP4 in fragments.
const OUT: &str = if cfg!(target_os = "linux") { "/dev/stdout" } else { "pipe:1" };
const MOVFLAGS: &str =
    if cfg!(target_os = "linux") { "+faststart" } else { "+frag_keyframe+empty_moov+default_base_moof" };

/// A running ffmpeg. Dropping it kills the process.
struct Encoder {
    child: Child,
    /// Open while frames arrive. If this process is killed, the system closes it and ffmpeg ends.
    stdin: Option<ChildStdin>,
    /// The end of stderr, sent once stderr is closed.
    stderr_tail: Receiver<VecDeque<u8>>,
    path: PathBuf,
}

impl Encoder {
    fn start(mut command: Command, program: &Path, path: &Path) -> Result<Encoder> {
        let mut child = command.stderr(Stdio::piped()).spawn().map_err(|e| absent(program, &e))?;
        let (sender, stderr_tail) = channel();
        let stdin = child.stdin.take();
        if let Some(mut stderr) = child.stderr.take() {
            // Reads until ffmpeg ends. If nobody read stderr, a full pipe would block ffmpeg.
            std::thread::spawn(move || {
                let (mut tail, mut bytes) = (VecDeque::new(), [0; 1024]);
                while let Ok(n @ 1..) = stderr.read(&mut bytes) {
                    tail.extend(&bytes[..n]);
                    tail.drain(..tail.len().saturating_sub(STDERR_BYTES));
                }
                let _ = sender.send(tail);
            });
        }
        Ok(Encoder { child, stdin, stderr_tail, path: path.to_owned() })
    }

    /// Sends a frame to ffmpeg. Rust programs ignore SIGPIPE, so an ffmpeg that ended is reported as an error
    /// here.
    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        let Some(stdin) = &mut self.stdin else { return Err(self.failed("it has ended")) };
        match stdin.write_all(bytes) {
            Ok(()) => Ok(()),
            Err(e) => {
                self.stdin = None;
                // ffmpeg closed its end of the pipe: it is about to end and to print the reason.
                Err(self.failed(&e.to_string()))
            }
        }
    }

    /// Ends the input and waits until ffmpeg has encoded everything.
    fn finish(mut self, frames: u64, monitor: &dyn Monitor) -> Result<()> {
        self.stdin = None;
        let status = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) => monitor.progress("encoding", frames, frames)?,
                Err(e) => return Err(self.failed(&e.to_string())),
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        // ffmpeg 5 exits with 0 if the disk is full when it writes its last bytes, but prints an error. At
        // this log level it prints nothing else.
        match self.last_line() {
            None if status.success() => Ok(()),
            line => Err(self.error(line.as_deref().unwrap_or(&status.to_string()))),
        }
    }

    /// Returns an error with ffmpeg's last line, or with `otherwise` if it printed nothing.
    fn failed(&mut self, otherwise: &str) -> Error {
        let line = self.last_line();
        self.error(line.as_deref().unwrap_or(otherwise))
    }

    fn error(&self, why: &str) -> Error {
        Error::Io {
            what: "cannot write",
            path: self.path.clone(),
            why: format!("ffmpeg: {why}"),
            fix: "free some space or choose another place with -o; .gif and .apng need no ffmpeg",
        }
    }

    /// Returns the last line that ffmpeg printed, once it has ended.
    fn last_line(&mut self) -> Option<String> {
        let tail = Vec::from(self.stderr_tail.recv_timeout(STDERR_WAIT).unwrap_or_default());
        let tail = String::from_utf8_lossy(&tail);
        let has_text = |line: &&str| !line.trim().is_empty() && !line.contains("Last message repeated");
        tail.lines().rfind(has_text).map(|line| line.trim().to_owned())
    }
}

impl Drop for Encoder {
    fn drop(&mut self) {
        self.stdin = None;
        // The process may have ended already; `wait` removes its entry from the process table.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
