//! `taki batch`: renders the frames of an animation or the grid of a sweep.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use clap::Args;

use super::choice::{codec, movie_bits};
use super::parse::{LAST_FRAME, fps, period};
use super::quality::QualityOptions;
use super::terminal::{Terminal, say};
use super::{CacheOptions, DepthOptions, EngineOptions, LayerOptions, SceneOptions};
use super::{crop, measured_words, samples, seconds, size, whole, window};
use crate::job::batch::{Batch, Event, Request, Summary, Watcher};
use crate::output::frame::Format;
use crate::output::movie::Codec;
use crate::scene::Animation;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;

const EXAMPLES: &str = "\
Examples:
  A loop of four seconds, as a movie and as single frames, from which a stopped run can continue:
    taki batch waterfall --loop 96 -o out/fall.####.png -o fall.mp4
  Every tenth frame from 100 to 199, in linear light:
    taki batch waterfall --frames 100-199:10 -o out/fall.####.exr
  The effect of density and complexity, on one contact sheet:
    taki batch fig5 --sweep alpha=0.25:1:0.25 --sweep h=0.6,1,1.4 -o out/fig5-{alpha}-{h}.png
  The share of one of eight machines that write to one folder (without --shard, any number of machines
  divide the work among themselves):
    taki batch waterfall --loop 240 -o out/fall.####.exr --shard 3/8

To continue a stopped batch, run the same command again: complete pictures are kept, the others rendered.";

#[derive(Args)]
#[command(after_long_help = EXAMPLES)]
pub struct BatchArgs {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    cache: CacheOptions,
    /// Files to write. Pictures are .png, .jpg, .tif, .webp or .exr; in their names, #### stands for the
    /// frame's number and {NAME} for a sweep's value, such as `-o out/fall.####.png`. '%04d', '$F4' and
    /// '@@@@' stand for the number too. Movies are .gif, .apng (or .png without a number), .mp4, .mov or
    /// .webm. Can be given more than once. Default: PNG files with the scene's name in the current folder.
    #[arg(short, long = "output", value_name = "PATTERN")]
    outputs: Vec<PathBuf>,
    /// Frames to render, such as 0-239, or 0-239:10 for every tenth, or 1,5,9, or -10-10 to begin before
    /// frame 0. Default: all frames of the animation, or frame 0 if there is a sweep.
    #[arg(long, value_name = "LIST", value_parser = frames, allow_hyphen_values = true)]
    frames: Option<FrameList>,
    /// Frames per second, such as 25 or 24000/1001. Short for --set animate.fps=N.
    #[arg(long, value_name = "N", value_parser = fps)]
    fps: Option<String>,
    /// Makes the animation a seamless loop of N frames. Short for --set animate.loop=N.
    #[arg(long = "loop", value_name = "N", value_parser = period)]
    period: Option<u32>,
    /// Renders one picture for each of several values of a parameter: KEY=FIRST:LAST:STEP or
    /// KEY=VALUE,VALUE,…, such as `--sweep alpha=0.25:1:0.25`. Several sweeps make a grid. The last part of a
    /// key is enough if no other parameter has it.
    #[arg(long = "sweep", value_name = "KEY=VALUES")]
    sweeps: Vec<String>,
    /// File of a sweep's labelled contact sheet (.png, .jpg, .tif or .webp). Default: SCENE.sheet.png beside
    /// the pictures.
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// File of a table that lists every picture with its parameters, files and figures (.csv or .json). Can
    /// be given more than once. Default for a sweep: SCENE.manifest.csv and SCENE.manifest.json beside the
    /// pictures.
    #[arg(long = "manifest", value_name = "FILE")]
    manifests: Vec<PathBuf>,
    /// Renders only the share of one of N machines: every N-th picture, starting with picture I. Pictures are
    /// counted from 0, so the first of eight machines gets 0/8.
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<(u32, u32)>,
    /// Replaces existing files instead of keeping complete pictures and refusing other files.
    #[arg(long)]
    overwrite: bool,
    /// Continues with the other pictures after one fails.
    #[arg(long)]
    keep_going: bool,
    /// Number of times a picture is tried again after the GPU device was lost.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = whole::<u32>)]
    retries: u32,
    /// Takes over pictures of another process that has shown no sign of life for this number of seconds.
    /// Pictures of a process that has ended on this machine are taken over at once.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = stale)]
    stale: f64,
    /// Size of the pictures in pixels, such as 1280x720.
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Number of samples per pixel. More samples give smoother edges and take longer.
    #[arg(long, value_name = "N", value_parser = samples)]
    samples: Option<u32>,
    #[command(flatten)]
    quality: QualityOptions,
    /// Makes the backgrounds transparent: the same as --set image.alpha=true. They can then be put over
    /// a photograph.
    #[arg(long)]
    alpha: bool,
    /// Renders only this part of every picture: column and row of its top left pixel, width and height.
    #[arg(long, value_name = "X,Y,W,H", value_parser = crop)]
    crop: Option<[u32; 4]>,
    #[command(flatten)]
    depth: DepthOptions,
    /// Codec of .mp4 and .mov files. Default: h264 for .mp4, prores for .mov. A .webm is always vp9.
    #[arg(long, value_parser = codec())]
    codec: Option<Codec>,
    /// Bits per sample of videos: 8, or 10 for skies without bands. Default: 8; ProRes always has 10.
    #[arg(long, value_name = "N", value_parser = movie_bits())]
    movie_bits: Option<u8>,
    #[command(flatten)]
    engine: EngineOptions,
    #[command(flatten)]
    layers: LayerOptions,
    /// Prints events on stdout while the batch runs, for other programs to read.
    #[arg(long, value_enum, value_name = "FORMAT")]
    events: Option<EventFormat>,
    /// Prints a summary of the run as one JSON object on stdout at the end.
    #[arg(long, conflicts_with = "events")]
    json: bool,
    /// Checks everything and prints what would be rendered and how much memory and disk space it needs, but
    /// renders nothing.
    #[arg(long)]
    dry_run: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum EventFormat {
    /// One JSON object per line.
    Json,
}

/// Frame numbers. This is a type of its own because clap treats a plain Vec as an option given several times.
#[derive(Clone, Debug)]
struct FrameList(Vec<i32>);

/// Most frames in a list.
const MAX_FRAMES: u64 = 1_000_000;

/// Parses `0-239`, `7`, `-10-10`, `0-239:10` and lists of these, separated by commas. The result is sorted,
/// each frame once.
fn frames(text: &str) -> std::result::Result<FrameList, String> {
    let how = || {
        let range = format!("from -{LAST_FRAME} to {LAST_FRAME}");
        format!("give frames such as 0-239, -10-10, 1,5,9 or 0-239:10, {range}")
    };
    let number = |n: &str| {
        let within = |n: &i32| (-LAST_FRAME..=LAST_FRAME).contains(n);
        n.trim().parse::<i32>().ok().filter(within).ok_or_else(how)
    };
    let mut list = Vec::new();
    for part in text.split(',').map(str::trim) {
        let (range, step) = part.split_once(':').map_or((part, Ok(1)), |(range, step)| (range, number(step)));
        // A single frame has no step, so it is a range that is written as in a sweep.
        if part.contains(':') && number(range).is_ok() {
            return Err(format!("a range is written with a hyphen: {}", part.replacen(':', "-", 1)));
        }
        let step = step.ok().filter(|&s| s > 0).ok_or_else(how)?;
        // The first character may be the sign of the first frame.
        let dash = range.char_indices().skip(1).find(|(_, c)| *c == '-').map(|(at, _)| at);
        let (first, last) = match dash {
            Some(at) => (number(&range[..at])?, number(&range[at + 1..])?),
            None => (number(range)?, number(range)?),
        };
        if last < first {
            return Err(format!("{part} ends before it begins"));
        }
        let count = u64::from(last.abs_diff(first) / step.unsigned_abs()) + 1;
        if count + list.len() as u64 > MAX_FRAMES {
            return Err(format!("more than {MAX_FRAMES} frames; split the list"));
        }
        list.extend((first..=last).step_by(step as usize));
    }
    list.sort_unstable();
    list.dedup();
    Ok(FrameList(list))
}

/// Parses the stale time, at least one second: an owner touches its claims four times within it.
fn stale(text: &str) -> std::result::Result<f64, String> {
    seconds(text).ok().filter(|&s| s >= 1.0).ok_or_else(|| "give a number of seconds from 1 to 86400".into())
}

/// Parses `I/N`.
fn shard(text: &str) -> std::result::Result<(u32, u32), String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    match parts {
        Some((i, n)) if i < n => Ok((i, n)),
        _ => Err("give I/N with I from 0 to N−1, such as 0/8 for the first of eight".into()),
    }
}

impl BatchArgs {
    /// Settings of the scene that short options stand for.
    fn settings(&self) -> Vec<String> {
        let mut more = Vec::new();
        if let Some([w, h]) = self.size {
            more.extend([format!("image.width={w}"), format!("image.height={h}")]);
        }
        more.extend(self.samples.map(|n| format!("image.samples={n}")));
        more.extend(self.alpha.then(|| "image.alpha=true".to_owned()));
        more.extend(self.fps.as_ref().map(|n| format!("animate.fps={n}")));
        more.extend(self.period.map(|n| format!("animate.loop={n}")));
        more
    }

    fn request(&self, animation: &Animation) -> Result<Request> {
        let outputs = match self.outputs.as_slice() {
            [] => vec![default_pattern(animation.name(), &self.sweeps)],
            given => given.to_vec(),
        };
        let size = ["image.width", "image.height"].map(|side| animation.values().count(side));
        let crop = self.crop.map(|crop| window("--crop", Some(crop), size)).transpose()?;
        Ok(Request {
            frames: self.frames.clone().map(|f| f.0),
            sweeps: self.sweeps.clone(),
            outputs,
            sheet: self.sheet.clone(),
            manifests: self.manifests.clone(),
            shard: self.shard,
            overwrite: self.overwrite,
            keep_going: self.keep_going,
            retries: self.retries,
            crop,
            exr: self.layers.exr(),
            depth: self.depth.depth(),
            codec: self.codec,
            movie_bits: self.movie_bits,
            stale: Duration::from_secs_f64(self.stale),
        })
    }
}

/// The output pattern if -o is not given: the scene's name with the frame's number, or with the sweeps'
/// values.
fn default_pattern(scene: &str, sweeps: &[String]) -> PathBuf {
    if sweeps.is_empty() {
        return PathBuf::from(format!("{scene}.####.png"));
    }
    let names = sweeps.iter().map(|s| s.split('=').next().unwrap_or("").trim());
    let places: Vec<String> = names.map(|name| format!("{name}{{{name}}}")).collect();
    PathBuf::from(format!("{scene}.{}.png", places.join("-")))
}

pub fn run(args: &BatchArgs, terminal: &Terminal) -> Result<()> {
    args.scene.begin(terminal);
    args.engine.check()?;
    let scene = args.quality.before(&args.scene);
    let animation = scene.animation(&args.settings(), &args.cache.add_to(args.scene.limits()))?;
    let others = [args.scene.own_sets(), args.settings()].concat();
    args.quality.tell(animation.values(), &others, terminal);
    args.scene.warn_of_settings(animation.values(), &args.sweeps, terminal);
    args.scene.warn_of_replaced(animation.values(), &args.settings(), terminal);
    // Frames from 0 on continue from the picture.
    let first = args.frames.as_ref().and_then(|frames| frames.0.first().copied()).unwrap_or(0);
    args.scene.warn_of_moved(first, terminal);
    let request = args.request(&animation)?;
    // Sheets and movies show the pictures.
    let as_shown = !args.sweeps.is_empty() || request.outputs.iter().any(|path| !is_exr(path));
    let linear = request.depth.linear || request.outputs.iter().any(|path| is_exr(path));
    args.scene.warn_of_files(animation.values(), as_shown, linear, terminal);
    let batch = Batch::plan(animation, request, terminal)?;
    terminal.close();
    if args.dry_run {
        return dry_run(args, &batch);
    }
    if let Some(stops) = batch.measured() {
        terminal.note(&measured_words(stops));
    }
    let (mut engine, line) = args.engine.open()?;
    terminal.note(&format!("taki: {line}"));
    let screen = Screen::new(terminal, args.events.is_some(), batch.keeps_pictures());
    let result = batch.run(&mut engine, &screen);
    terminal.close();
    if args.json
        && let Some(summary) = screen.summary()
    {
        screen.say(&serde_json::json!(summary));
    }
    result.and(screen.unsaid())
}

fn is_exr(path: &Path) -> bool {
    Format::of(path) == Some(Format::Exr)
}

fn dry_run(args: &BatchArgs, batch: &Batch) -> Result<()> {
    let needs = batch.needs()?;
    let as_json = args.json || args.events.is_some();
    say(&if as_json { serde_json::json!(needs).to_string() } else { needs.to_string() })
}

/// Shows the progress of a batch: a bar on a terminal, otherwise one line per picture. With --events, prints
/// events instead of the bar.
struct Screen<'a> {
    terminal: &'a Terminal,
    events: bool,
    /// Whether pictures are kept, so that a stopped run can continue.
    keeps: bool,
    state: Mutex<State>,
    /// The first error of writing to stdout. The batch goes on to write its files.
    unsaid: Mutex<Option<Error>>,
}

struct State {
    begun: Instant,
    /// Number of pictures of the run.
    pictures: u64,
    /// Number of pictures that need no more work: kept, rendered, failed or rendered elsewhere.
    settled: u64,
    /// Number of pictures that this run has rendered.
    rendered: u64,
    /// Share of the current picture that is done, 0 to 1.
    share: f64,
    /// Time of the last progress event.
    told: Option<Instant>,
    summary: Option<Summary>,
}

impl<'a> Screen<'a> {
    fn new(terminal: &'a Terminal, events: bool, keeps: bool) -> Self {
        let state = State {
            begun: Instant::now(),
            pictures: 0,
            settled: 0,
            rendered: 0,
            share: 0.0,
            told: None,
            summary: None,
        };
        Screen { terminal, events, keeps, state: Mutex::new(state), unsaid: Mutex::new(None) }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn summary(&self) -> Option<Summary> {
        self.lock().summary.clone()
    }

    /// Prints an event or the summary, and keeps the first error.
    fn say(&self, value: &serde_json::Value) {
        if let Err(e) = say(&value.to_string()) {
            self.unsaid.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(e);
        }
    }

    /// Returns the first error of [`Screen::say`].
    fn unsaid(&self) -> Result<()> {
        self.unsaid.lock().unwrap_or_else(|e| e.into_inner()).take().map_or(Ok(()), Err)
    }

    fn bar(&self, state: &State) {
        let done = state.settled as f64 + state.share;
        self.terminal.bar(done, state.pictures as f64, &state.pace());
    }
}

impl State {
    /// Formats the number of pictures done and, once this run has rendered one, the rate and the time left.
    fn pace(&self) -> String {
        let seconds = self.begun.elapsed().as_secs_f64();
        let made = self.rendered as f64 + self.share;
        let counts = format!("{}/{}", self.settled, self.pictures);
        if self.rendered == 0 || seconds <= 0.0 {
            return counts;
        }
        let rate = made / seconds;
        let pictures_left = self.pictures as f64 - self.settled as f64 - self.share;
        let pace = if rate >= 1.0 { format!("{rate:.1}/s") } else { format!("{:.1} s each", 1.0 / rate) };
        if pictures_left <= 0.0 {
            return format!("{counts} · {pace}");
        }
        let left = indicatif::HumanDuration(Duration::from_secs_f64(pictures_left / rate));
        format!("{counts} · {pace} · {left} left")
    }
}

impl Monitor for Screen<'_> {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        self.terminal.check()
    }

    fn warn(&self, text: &str) {
        if self.events {
            self.say(&serde_json::json!({"event": "warning", "text": text}));
        }
        self.terminal.warn(text);
    }
}

/// Least time between progress events.
const TELL: Duration = Duration::from_millis(500);

impl Watcher for Screen<'_> {
    fn event(&self, event: &Event) {
        let mut state = self.lock();
        let mut line = None;
        match event {
            Event::Started { pictures, kept, .. } => {
                (state.pictures, state.settled) = (*pictures, *kept);
                state.begun = Instant::now();
                if *kept > 0 {
                    line = Some(format!("{kept} of {pictures} pictures are already complete"));
                }
            }
            Event::Rendering { .. } => state.share = 0.0,
            Event::Progress { share, .. } => {
                state.share = *share;
                if self.events && state.told.is_some_and(|at| at.elapsed() < TELL) {
                    return;
                }
                state.told = Some(Instant::now());
            }
            Event::Saved { files, elapsed, .. } => {
                state.settled += 1;
                state.rendered += 1;
                state.share = 0.0;
                if !self.terminal.is_interactive() && !files.is_empty() {
                    line = Some(format!("{}, {elapsed:.2} s ({})", files.join(", "), state.pace()));
                }
            }
            Event::Elsewhere { .. } => state.settled += 1,
            Event::Retry { picture, error } => line = Some(format!("{picture}: {error}; trying again")),
            Event::Failed { picture, error, .. } => {
                state.settled += 1;
                line = Some(format!("{picture} failed: {error}"));
            }
            Event::Waiting { pictures, on } => {
                line = Some(format!(
                    "waiting for {pictures} pictures that other processes render, such as {on}"
                ));
            }
            Event::Assembled { file } => line = Some(format!("wrote {file}")),
            Event::Done(summary) => {
                state.summary = Some((*summary).clone());
                line = Some(outcome(summary, self.keeps));
            }
        }
        if self.events {
            self.say(&serde_json::json!(event));
        } else {
            self.bar(&state);
        }
        if let Event::Done(_) = event {
            self.terminal.close();
        }
        if let Some(line) = line {
            self.terminal.note(&format!("taki: {line}"));
        }
    }
}

/// Formats the summary as one line. `keeps` tells whether the run kept pictures.
fn outcome(s: &Summary, keeps: bool) -> String {
    let mut parts = vec![format!("{} of {} pictures rendered", s.rendered, s.pictures)];
    let mut add = |count: u64, what: &str| {
        if count > 0 {
            parts.push(format!("{count} {what}"));
        }
    };
    add(s.kept, "kept");
    add(s.elsewhere, "rendered by other processes");
    add(s.failed, "failed");
    add(
        s.left,
        match keeps {
            true => "left (run the same command again to continue)",
            false => "left (a movie alone begins anew; with -o NAME.####.png too, a stopped run continues)",
        },
    );
    format!("{} in {:.1} s", parts.join(", "), s.elapsed)
}
