//! `taki batch`: the frames of an animation, the grid of a sweep.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use clap::Args;

use super::choice::layer;
use super::terminal::{Terminal, say};
use super::{CacheOptions, EngineOptions, SceneOptions, crop, measured_words, seconds, size, window};
use crate::engine::Engine;
use crate::job::batch::{Batch, Event, Request, Summary, Watcher};
use crate::picture::Layer;
use crate::scene::Animation;
use crate::util::error::Result;
use crate::util::monitor::Monitor;

const EXAMPLES: &str = "\
Examples:
  A loop of four seconds, as a movie and as frames that a stopped run goes on from:
    taki batch waterfall --loop 96 -o out/fall.####.png -o fall.mp4
  Frames 100 to 199 in linear light, every tenth:
    taki batch waterfall --frames 100-199:10 -o out/fall.####.exr
  What density and complexity do, on one sheet:
    taki batch fig5 --sweep alpha=0.25:1:0.25 --sweep h=0.6,1,1.4 -o out/fig5-{alpha}-{h}.png
  One of eight machines that share a folder (or any number, without --shard):
    taki batch waterfall --loop 240 -o out/fall.####.exr --shard 3/8

Run the same command again to go on: pictures that are there are decoded, and kept if they are whole.";

#[derive(Args)]
#[command(after_long_help = EXAMPLES)]
pub struct BatchArgs {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    cache: CacheOptions,
    /// Pattern of the pictures' names, .png or .exr: #### is the frame's number, {NAME} a sweep's value; or a
    /// movie, .gif, .apng (or .png without ####), .mp4 or .webm. May be given often. Default: PNG files with
    /// the scene's name in the current folder.
    #[arg(short, long = "output", value_name = "PATTERN")]
    outputs: Vec<PathBuf>,
    /// Frames to render, such as 0-239, 7, or 0-239:10 for every tenth. Default: all of the animation; frame 0
    /// of a sweep.
    #[arg(long, value_name = "LIST", value_parser = frames)]
    frames: Option<FrameList>,
    /// Frames a second: short for --set animate.fps=N.
    #[arg(long, value_name = "N")]
    fps: Option<String>,
    /// A seamless loop of N frames: short for --set animate.loop=N.
    #[arg(long = "loop", value_name = "N")]
    period: Option<u32>,
    /// Tries values of a parameter: KEY=FIRST:LAST:STEP or KEY=VALUE,VALUE,…; several make a grid. The key's
    /// last part will do where it is one parameter's.
    #[arg(long = "sweep", value_name = "KEY=VALUES")]
    sweeps: Vec<String>,
    /// The labelled contact sheet of a sweep, .png. Default: SCENE.sheet.png beside the pictures.
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// A table of all pictures with parameters, files and figures, .csv or .json; may be given twice. Default
    /// of a sweep: SCENE.manifest.csv and .json beside the pictures.
    #[arg(long = "manifest", value_name = "FILE")]
    manifests: Vec<PathBuf>,
    /// Renders only every N-th picture, starting with number I (from 0): one of N machines' share.
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<(u32, u32)>,
    /// Renders and replaces pictures that are there.
    #[arg(long)]
    overwrite: bool,
    /// Goes on with the other pictures when one fails.
    #[arg(long)]
    keep_going: bool,
    /// How often a picture is tried again after the GPU device was lost.
    #[arg(long, value_name = "N", default_value_t = 2)]
    retries: u32,
    /// A picture that another process has claimed is taken over when it has not been heard of for so long, or
    /// is known to have ended.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = stale)]
    stale: f64,
    /// Size of the pictures in pixels.
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Jittered samples a pixel.
    #[arg(long, value_name = "N")]
    samples: Option<u32>,
    /// Renders this part of every picture only: column and row of its top left pixel, width, height.
    #[arg(long, value_name = "X,Y,W,H", value_parser = crop)]
    crop: Option<[u32; 4]>,
    #[command(flatten)]
    engine: EngineOptions,
    /// Layers of EXR files.
    #[arg(long, value_parser = layer(), value_delimiter = ',', value_name = "A,B,…")]
    layers: Option<Vec<Layer>>,
    /// Prints what happens on stdout, one JSON object a line.
    #[arg(long, value_enum, value_name = "FORMAT")]
    events: Option<EventFormat>,
    /// Prints what was done as one JSON object on stdout.
    #[arg(long, conflicts_with = "events")]
    json: bool,
    /// Checks everything, tells what would be rendered and what it needs, and ends.
    #[arg(long)]
    dry_run: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum EventFormat {
    /// One object a line.
    Json,
}

/// Numbers of frames. A type of its own: clap takes a bare Vec for an option given several times.
#[derive(Clone, Debug)]
struct FrameList(Vec<u32>);

/// Most frames of a list.
const MAX_FRAMES: u64 = 1_000_000;

/// `0-239`, `7`, `0-239:10`, and lists of them.
fn frames(text: &str) -> std::result::Result<FrameList, String> {
    let how = || "frames such as 0-239, 1,5,9 or 0-239:10, from 0 to 999999999".to_owned();
    let mut list = Vec::new();
    for part in text.split(',') {
        let number = |n: &str| n.trim().parse::<u32>().ok().filter(|&n| n <= 999_999_999).ok_or_else(how);
        let (range, step) = part.split_once(':').map_or((part, Ok(1)), |(range, step)| (range, number(step)));
        let step = step.ok().filter(|&s| s > 0).ok_or_else(how)?;
        let (first, last) = match range.split_once('-') {
            Some((a, b)) => (number(a)?, number(b)?),
            None => (number(range)?, number(range)?),
        };
        if last < first {
            return Err(format!("{part} ends before it begins"));
        }
        if u64::from((last - first) / step) + 1 + list.len() as u64 > MAX_FRAMES {
            return Err(format!("more than {MAX_FRAMES} frames; split them"));
        }
        list.extend((first..=last).step_by(step as usize));
    }
    list.sort_unstable();
    list.dedup();
    Ok(FrameList(list))
}

/// Seconds, one at least: claims are touched four times in so long.
fn stale(text: &str) -> std::result::Result<f64, String> {
    seconds(text).ok().filter(|&s| s >= 1.0).ok_or_else(|| "a number of seconds from 1 to 86400".into())
}

/// `I/N`.
fn shard(text: &str) -> std::result::Result<(u32, u32), String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    match parts {
        Some((i, n)) if i < n => Ok((i, n)),
        _ => Err("I/N with I from 0 to N−1, such as 0/8 for the first of eight".into()),
    }
}

impl BatchArgs {
    fn settings(&self) -> Vec<String> {
        let mut more = Vec::new();
        if let Some([w, h]) = self.size {
            more.extend([format!("image.width={w}"), format!("image.height={h}")]);
        }
        more.extend(self.samples.map(|n| format!("image.samples={n}")));
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
            layers: self.layers.clone().unwrap_or(Layer::ALL.to_vec()),
            stale: Duration::from_secs_f64(self.stale),
        })
    }
}

/// The scene's name with the frame's number, or with the sweeps' values.
fn default_pattern(scene: &str, sweeps: &[String]) -> PathBuf {
    if sweeps.is_empty() {
        return PathBuf::from(format!("{scene}.####.png"));
    }
    let names = sweeps.iter().map(|s| s.split('=').next().unwrap_or("").trim());
    let places: Vec<String> = names.map(|name| format!("{name}{{{name}}}")).collect();
    PathBuf::from(format!("{scene}.{}.png", places.join("-")))
}

pub fn run(args: &BatchArgs, terminal: &Terminal) -> Result<()> {
    let animation = args.scene.animation(&args.settings(), &args.cache.add_to(args.scene.limits()))?;
    let request = args.request(&animation)?;
    let batch = Batch::plan(animation, request, terminal)?;
    terminal.close();
    if args.dry_run {
        return dry_run(args, &batch);
    }
    if let Some(stops) = batch.measured() {
        terminal.note(&measured_words(stops));
    }
    let (mut engine, line) = Engine::open(args.engine.engine, &args.engine.device())?;
    terminal.note(&format!("taki: {line}"));
    let screen = Screen::new(terminal, args.events.is_some());
    let result = batch.run(&mut engine, &screen);
    terminal.close();
    if args.json
        && let Some(summary) = screen.summary()
    {
        say(&serde_json::json!(summary).to_string());
    }
    result.map(|_| ())
}

fn dry_run(args: &BatchArgs, batch: &Batch) -> Result<()> {
    let needs = batch.needs()?;
    if args.json || args.events.is_some() {
        say(&serde_json::json!(needs).to_string());
    } else {
        say(&needs.to_string());
    }
    Ok(())
}

/// What the user sees of a batch: a bar on a terminal, else a line a picture; or events.
struct Screen<'a> {
    terminal: &'a Terminal,
    events: bool,
    state: Mutex<State>,
}

struct State {
    begun: Instant,
    /// Pictures of the run, those that need not be rendered, those that were.
    pictures: u64,
    settled: u64,
    rendered: u64,
    /// Of the picture in work.
    share: f64,
    /// When progress was last told.
    told: Option<Instant>,
    summary: Option<Summary>,
}

impl<'a> Screen<'a> {
    fn new(terminal: &'a Terminal, events: bool) -> Self {
        let state = State {
            begun: Instant::now(),
            pictures: 0,
            settled: 0,
            rendered: 0,
            share: 0.0,
            told: None,
            summary: None,
        };
        Screen { terminal, events, state: Mutex::new(state) }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn summary(&self) -> Option<Summary> {
        self.lock().summary.clone()
    }

    fn bar(&self, state: &State) {
        let done = state.settled as f64 + state.share;
        self.terminal.bar(done, state.pictures as f64, &state.pace());
    }
}

impl State {
    /// Pictures done, their rate, and when the rest will be: by what this run has rendered.
    fn pace(&self) -> String {
        let seconds = self.begun.elapsed().as_secs_f64();
        let made = self.rendered as f64 + self.share;
        let counts = format!("{}/{}", self.settled, self.pictures);
        if self.rendered == 0 || seconds <= 0.0 {
            return counts;
        }
        let rate = made / seconds;
        let left = (self.pictures as f64 - self.settled as f64 - self.share).max(0.0) / rate;
        let pace = if rate >= 1.0 { format!("{rate:.1}/s") } else { format!("{:.1} s each", 1.0 / rate) };
        format!("{counts} · {pace} · {} left", indicatif::HumanDuration(Duration::from_secs_f64(left)))
    }
}

impl Monitor for Screen<'_> {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        self.terminal.check()
    }

    fn warn(&self, text: &str) {
        if self.events {
            print_event(&serde_json::json!({"event": "warning", "text": text}));
        }
        self.terminal.warn(text);
    }
}

/// Events of progress of one picture come at most so often.
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
                    line = Some(format!("{kept} of {pictures} pictures are there and whole"));
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
            Event::Retry { picture, error } => line = Some(format!("{picture}: {error}: once more")),
            Event::Failed { picture, error, .. } => {
                state.settled += 1;
                line = Some(format!("{picture} failed: {error}"));
            }
            Event::Waiting { pictures, on } => {
                line = Some(format!("waiting for {pictures} pictures of others, such as {on}"));
            }
            Event::Assembled { file } => line = Some(format!("wrote {file}")),
            Event::Done(summary) => {
                state.summary = Some((*summary).clone());
                line = Some(outcome(summary));
            }
        }
        if self.events {
            print_event(&serde_json::json!(event));
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

/// A line of events; whoever reads them wants each at once.
fn print_event(event: &serde_json::Value) {
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "{event}").and_then(|()| out.flush());
}

fn outcome(s: &Summary) -> String {
    let mut parts = vec![format!("{} of {} pictures rendered", s.rendered, s.pictures)];
    let mut add = |count: u64, what: &str| {
        if count > 0 {
            parts.push(format!("{count} {what}"));
        }
    };
    add(s.kept, "kept");
    add(s.elsewhere, "made by others");
    add(s.failed, "failed");
    add(s.left, "left: run the same command again to go on");
    format!("{} in {:.1} s", parts.join(", "), s.elapsed)
}
