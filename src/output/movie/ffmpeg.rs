//! MP4 and WebM by the program ffmpeg: frames go to its stdin, the file comes out of its stdout.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use super::{MovieKind, MovieOptions};
use crate::output::frame::Output;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;

/// Bytes kept of what ffmpeg says.
const WORDS: usize = 4096;

/// Longest wait for ffmpeg's last words after it ended: a child of its own may hold its stderr open.
const LAST_WORDS: Duration = Duration::from_secs(2);

pub(super) struct VideoWriter {
    /// Before the output: the process ends first, then its file goes.
    encoder: Encoder,
    output: Output,
    size: [u32; 2],
    frames: u64,
    /// A frame with even sides, where the movie's are not.
    padded: Vec<u8>,
}

impl VideoWriter {
    pub(super) fn create(
        mut output: Output,
        kind: MovieKind,
        options: &MovieOptions,
        program: &Path,
    ) -> Result<Self> {
        has_encoder(kind, program)?;
        let file = output.file().try_clone().map_err(|e| Error::write(output.path(), e))?;
        let even = options.size.map(|side| side.next_multiple_of(2));
        let mut command = quiet(program);
        command.args(arguments(kind, even, options)).stdin(Stdio::piped()).stdout(file);
        let encoder = Encoder::start(command, program, output.path())?;
        let bytes = if even == options.size { 0 } else { even[0] as usize * even[1] as usize * 3 };
        let padded = Vec::with_capacity(bytes);
        Ok(VideoWriter { encoder, output, size: options.size, frames: options.frames, padded })
    }

    pub(super) fn push(&mut self, rgb: &[u8]) -> Result<()> {
        let [width, height] = self.size.map(|side| side as usize);
        if width % 2 == 0 && height % 2 == 0 {
            return self.encoder.write(rgb);
        }
        self.padded.clear();
        let row_bytes = width * 3;
        for y in 0..height.next_multiple_of(2) {
            let row = &rgb[y.min(height - 1) * row_bytes..][..row_bytes];
            self.padded.extend_from_slice(row);
            if width % 2 == 1 {
                self.padded.extend_from_slice(&row[row_bytes - 3..]);
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

/// ffmpeg without questions, banner or progress; in a process group of its own, so that the terminal's
/// Ctrl-C comes to us alone.
fn quiet(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.args(["-nostdin", "-hide_banner", "-nostats", "-loglevel", "error"]);
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command
}

/// The encoder's name in ffmpeg.
fn codec(kind: MovieKind) -> &'static str {
    if kind == MovieKind::Webm { "libvpx-vp9" } else { "libx264" }
}

/// Refuses an ffmpeg that is not there or cannot encode this kind.
fn has_encoder(kind: MovieKind, program: &Path) -> Result<()> {
    let run = quiet(program).arg("-encoders").stdin(Stdio::null()).output();
    let list = run.map_err(|e| absent(program, &e))?;
    let codec = codec(kind);
    let words = String::from_utf8_lossy(&list.stdout);
    // A line of the list: flags, name, what it is.
    if words.lines().any(|line| line.split_whitespace().nth(1) == Some(codec)) {
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

/// What follows [`quiet`]: frames in on stdin, the file out.
fn arguments(kind: MovieKind, [width, height]: [u32; 2], options: &MovieOptions) -> Vec<String> {
    let (codec, size, fps) = (codec(kind), format!("{width}x{height}"), options.fps.to_string());
    let comment = format!("comment={}", options.mark_text());
    let mut all: Vec<&str> = Vec::new();
    all.extend([
        "-f",
        "rawvideo",
        "-pixel_format",
        "rgb24",
        "-video_size",
        &size,
        "-framerate",
        &fps,
        "-i",
        "pipe:0",
    ]);
    // ffmpeg would convert with BT.601's matrix and say nothing; players take untagged video for BT.709.
    let convert = "scale=in_range=full:out_range=limited:out_color_matrix=bt709:\
                   flags=bicubic+accurate_rnd+full_chroma_int,format=yuv420p";
    all.extend(["-vf", convert, "-color_range", "tv", "-colorspace", "bt709", "-color_primaries", "bt709"]);
    all.extend(["-color_trc", "bt709", "-c:v", codec]);
    // The number of threads is fixed: the file is then the same on any machine with the same ffmpeg.
    all.extend(["-threads", "4", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"]);
    all.extend(["-metadata", &comment]);
    all.extend(match kind {
        // Water is fine grain: at ffmpeg's own 23 it turns to mud.
        MovieKind::Webm => &["-crf", "24", "-b:v", "0", "-deadline", "good", "-cpu-used", "3"][..],
        _ => &["-crf", "16", "-preset", "medium", "-profile:v", "high"],
    });
    if kind == MovieKind::Webm {
        all.extend(["-f", "webm", "-y", OUT]);
    } else {
        all.extend(["-movflags", MOVFLAGS, "-f", "mp4", "-y", OUT]);
    }
    all.into_iter().map(String::from).collect()
}

/// The output is open already, as ffmpeg's stdout: no name has to pass through its syntax. On Linux
/// /dev/stdout opens the file itself anew, so that it can be sought in and the index moved to its start.
/// Elsewhere it is written in one go, an MP4 in fragments.
const OUT: &str = if cfg!(target_os = "linux") { "/dev/stdout" } else { "pipe:1" };
const MOVFLAGS: &str =
    if cfg!(target_os = "linux") { "+faststart" } else { "+frag_keyframe+empty_moov+default_base_moof" };

/// A running ffmpeg. Dropped it is killed.
struct Encoder {
    child: Child,
    /// Open while frames come. If we are killed the system closes it, and ffmpeg ends.
    stdin: Option<ChildStdin>,
    /// The end of what it said, sent when it stopped speaking.
    words: Receiver<VecDeque<u8>>,
    path: PathBuf,
}

impl Encoder {
    fn start(mut command: Command, program: &Path, path: &Path) -> Result<Encoder> {
        let mut child = command.stderr(Stdio::piped()).spawn().map_err(|e| absent(program, &e))?;
        let (sender, words) = channel();
        let stdin = child.stdin.take();
        if let Some(mut stderr) = child.stderr.take() {
            // It ends when ffmpeg does: an unread stderr would stop an ffmpeg with much to say.
            std::thread::spawn(move || {
                let (mut tail, mut bytes) = (VecDeque::new(), [0; 1024]);
                while let Ok(n @ 1..) = stderr.read(&mut bytes) {
                    tail.extend(&bytes[..n]);
                    tail.drain(..tail.len().saturating_sub(WORDS));
                }
                let _ = sender.send(tail);
            });
        }
        Ok(Encoder { child, stdin, words, path: path.to_owned() })
    }

    /// Gives it a frame. Rust's programs ignore SIGPIPE: an ffmpeg that ended is an error here.
    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        let Some(stdin) = &mut self.stdin else { return Err(self.failed("it has ended")) };
        match stdin.write_all(bytes) {
            Ok(()) => Ok(()),
            Err(e) => {
                self.stdin = None;
                // It closed its end: it is about to end, and to say why.
                Err(self.failed(&e.to_string()))
            }
        }
    }

    /// Ends its input and waits until it has encoded everything.
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
        // ffmpeg 5 ends with 0 where the disk is full just when it writes its last bytes, but says so: at
        // this log level a word is an error.
        match self.last_line() {
            None if status.success() => Ok(()),
            line => Err(self.error(line.as_deref().unwrap_or(&status.to_string()))),
        }
    }

    /// The error with ffmpeg's last line, or `otherwise` if it said nothing.
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

    /// What ffmpeg said last, once it has ended.
    fn last_line(&mut self) -> Option<String> {
        let words = Vec::from(self.words.recv_timeout(LAST_WORDS).unwrap_or_default());
        let words = String::from_utf8_lossy(&words);
        let said = |line: &&str| !line.trim().is_empty() && !line.contains("Last message repeated");
        words.lines().rfind(said).map(|line| line.trim().to_owned())
    }
}

impl Drop for Encoder {
    fn drop(&mut self) {
        self.stdin = None;
        // It may have ended; waiting takes its entry from the process table.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
