//! `taki bench`: measures the passes on this machine, and counts the work they do.
//!
//! Times are medians over rounds, each of which runs every pass once in one process. Other programs on the
//! machine then disturb all rows alike, so ratios between rows stay true even where single times do not.
//! `docs/speed.md` tells what was predicted and measured, what helped and what did not.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use super::parse::within;
use super::terminal::{Terminal, say};
use super::{EngineOptions, size};
use crate::engine::gpu::GpuBench;
use crate::engine::{Engine, EngineChoice, RenderOptions, cpu};
use crate::picture::resolve::develop_whole;
use crate::scene::{Limits, Scene};
use crate::util::error::{Error, Result};
use crate::util::monitor::{Monitor, Unwatched};
use crate::volume::VolumeTexture;

#[derive(Args, Clone)]
pub struct BenchArgs {
    /// Measures only the `front` scene with this volume file.
    #[arg(long, value_name = "V.npz")]
    volume: Option<PathBuf>,
    /// Measures only the `front` scene with a cube of N cells a side. A cube of more than 256 cells a side
    /// has the strands of one of 256, and is stored sparse if it does not fit the memory.
    #[arg(long, value_name = "N", conflicts_with = "volume")]
    #[arg(value_parser = within::<1, 8192>)]
    cells: Option<u32>,
    /// Measures only this picture size, such as 1280x720.
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Number of runs of each row. The table shows their median.
    #[arg(long, value_name = "N", default_value_t = 9)]
    #[arg(value_parser = within::<1, 1000>)]
    runs: u32,
    #[command(flatten)]
    engine: EngineOptions,
    /// Prints all rows as one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

/// One measured pass.
#[derive(Serialize)]
struct Row {
    scene: &'static str,
    volume: String,
    size: String,
    engine: &'static str,
    pass: &'static str,
    /// Median time of one run, seconds.
    seconds: f64,
    /// Time of the fastest run, seconds.
    fastest: f64,
    /// Number of cells that view and light rays walk in one run; 0 if the pass walks none.
    cells: u64,
    /// Core-nanoseconds per cell: wall time × cores / cells.
    ns_per_cell: f64,
    /// Why the row could not be measured; its times and cells are then 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

/// The rows of the table, and the first error of those that could not be measured.
#[derive(Default)]
struct Rows {
    rows: Vec<Row>,
    first: Option<Error>,
}

impl Rows {
    fn push(&mut self, row: Row) {
        self.rows.push(row);
    }

    /// Adds a row that could not be measured, so that the others stand.
    ///
    /// # Errors
    /// Returns `error` if a signal ended the measurement.
    fn failed(&mut self, row: Row, error: Error) -> Result<()> {
        if matches!(error, Error::Interrupted { .. }) {
            return Err(error);
        }
        self.rows.push(Row { error: Some(error.to_string()), ..row });
        self.first.get_or_insert(error);
        Ok(())
    }
}

/// Deepest volume, in cells, for rows that walk towards the light from every cell. Their cost grows with the
/// square of the depth: 256 layers take minutes per frame.
const MARCH_LAYERS: u32 = 64;

/// The name of a pass and the settings that it needs.
type Step = (&'static str, &'static [&'static str]);

/// Integrate passes that are measured on `front`.
const PASSES: &[Step] = &[
    ("integrate", &[]),
    ("integrate march", &["light.visibility=march"]),
    ("integrate cached", &["light.visibility=cached"]),
    ("integrate pyramid", &["trace.filter=pyramid"]),
    ("integrate trilinear", &["trace.lookup=trilinear"]),
];

/// Steps of light in water, measured on `fig5` with ten times its density. Each step adds its settings to
/// those of the steps before it. `docs/method.md` shows their pictures.
const STEPS: &[Step] = &[
    ("no attenuation", &["light.visibility=none"]),
    ("march", &["light.visibility=march"]),
    ("cached", &["light.visibility=cached"]),
    ("multiple", &["light.scattering=multiple"]),
    ("strand", &["light.reflection=strand", "strand.aeration=0"]),
    ("aerated", &["strand.aeration=0.5"]),
    ("sky", &["environment.kind=sky", "light.ambient=[0,0,0]", "lights.sun.intensity=0"]),
];

/// Scenes whose frames are measured.
const SCENES: [&str; 6] = ["waterfall", "cascade", "curtain", "spout", "night", "evening"];

/// Cells a side of the largest cube measured by default. It is measured only at the larger picture size.
const LARGE: u32 = 512;

/// Picture sizes measured by default, pixels.
const SIZES: [[u32; 2]; 2] = [[266, 426], [1280, 720]];

pub fn run(args: &BenchArgs, terminal: &Terminal) -> Result<()> {
    terminal.watch();
    let sizes = args.size.map_or(SIZES.to_vec(), |s| vec![s]);
    let mut rows = Rows::default();
    let (mut gpu, line) = open_gpu(args)?;
    terminal.note(&format!("taki: {line}"));
    let volumes: Vec<Vec<String>> = match &args.volume {
        Some(file) => {
            let file = file.to_str().ok_or_else(|| Error::Usage("--volume: the path is not UTF-8".into()))?;
            vec![vec![format!("volume.file={file:?}")]]
        }
        None => args.cells.map_or([40, 256, LARGE].map(cube).to_vec(), |n| vec![cube(n)]),
    };
    let alone = args.volume.is_some() || args.cells.is_some();
    for sets in &volumes {
        for &size in &sizes {
            if !alone && args.size.is_none() && *sets == cube(LARGE) && size != SIZES[1] {
                continue;
            }
            let mut sets = sets.clone();
            sets.extend(front(size));
            let front = load("front", &sets)?;
            let volume = match front.volume(direct_limits().memory, terminal) {
                Ok(volume) => volume,
                Err(e) => {
                    let [nx, ny, nz] = front.recipes[0].water.size;
                    let cells = format!("{nx}×{ny}×{nz}");
                    let none = row("front", cells, &front, "cpu", "volume build", [0.0; 2], 0);
                    rows.failed(none, e)?;
                    continue;
                }
            };
            let shallow = volume.size[2] <= MARCH_LAYERS;
            let mut scenes = Vec::new();
            for (pass, more) in PASSES {
                let sets = sets.iter().cloned().chain(more.iter().map(|&set| set.into())).collect::<Vec<_>>();
                if shallow || more.is_empty() {
                    scenes.push((*pass, load("front", &sets)?));
                }
            }
            passes(args, terminal, &mut gpu, "front", &scenes, &volume, &mut rows)?;
        }
    }
    if !alone {
        steps(args, terminal, &mut gpu, &mut rows)?;
        scenes(args, terminal, &mut gpu, &mut rows)?;
        pictures(args, terminal, &mut rows)?;
        builds(args, terminal, &mut rows)?;
        processes(args, terminal, &mut rows)?;
    }
    terminal.close();
    match rows.first {
        Some(e) if rows.rows.iter().all(|row| row.error.is_some()) => Err(e),
        _ => print(args.json, &line, &rows.rows),
    }
}

/// Opens the device to measure, also where it is software, which an automatic choice leaves to the CPU
/// engine. Returns it with a line that tells what it is; `None` with `--engine cpu`, or without a device.
fn open_gpu(args: &BenchArgs) -> Result<(Option<GpuBench>, String)> {
    let wanted = match args.engine.engine {
        EngineChoice::Auto => EngineOptions { engine: EngineChoice::Gpu, ..args.engine.clone() },
        _ => args.engine.clone(),
    };
    match wanted.open() {
        Ok((Engine::Gpu { renderer, .. }, line)) => Ok((Some(GpuBench::new(*renderer)), line)),
        Ok((Engine::Cpu(_), line)) => Ok((None, line)),
        Err(Error::NoAdapter { .. })
            if args.engine.engine == EngineChoice::Auto && wanted.adapter.is_none() =>
        {
            Ok((None, args.engine.open()?.1))
        }
        Err(e) => Err(e),
    }
}

fn direct_limits() -> Limits {
    Limits::default()
}

fn load(preset: &'static str, sets: &[String]) -> Result<Scene> {
    Scene::load(preset.as_ref(), sets, &direct_limits())
}

/// Settings of a cubic volume of `n` cells a side. Up to 256³ it has as many strands per face area as 32 ×
/// 32 strands at 40³. A larger one has the strands of 256³: the same water with finer cells.
fn cube(n: u32) -> Vec<String> {
    let strands = (32.0 * n.min(256) as f64 / 40.0).round();
    let mut sets: Vec<String> = ["nx", "ny", "nz"].map(|axis| format!("volume.{axis}={n}")).to_vec();
    sets.extend(["across", "deep"].map(|axis| format!("curves.{axis}={strands}")));
    sets
}

/// Settings of the `front` scene at a picture size: the quad spans 0.98 of the picture's smaller side.
fn front([width, height]: [u32; 2]) -> Vec<String> {
    let half_height = 0.5 / 0.98 * height as f64 / width.min(height) as f64;
    let fov = 2.0 * (half_height / 3.0).atan().to_degrees();
    vec![format!("image.width={width}"), format!("image.height={height}"), format!("camera.fov={fov}")]
}

/// Returns the median and the smallest of `times`.
fn summary(mut times: Vec<f64>) -> [f64; 2] {
    times.sort_by(f64::total_cmp);
    [times[times.len() / 2], times[0]]
}

/// Measures the steps of light in water, at the figure's own size with one sample.
fn steps(args: &BenchArgs, terminal: &Terminal, gpu: &mut Option<GpuBench>, rows: &mut Rows) -> Result<()> {
    let mut scenes = Vec::new();
    let mut sets: Vec<String> = ["image.samples=1", "trace.tau=4"].map(String::from).to_vec();
    for (pass, more) in STEPS {
        sets.extend(more.iter().map(|&set| set.into()));
        scenes.push((*pass, load("fig5", &sets)?));
    }
    let volume = scenes[0].1.volume(direct_limits().memory, terminal)?;
    passes(args, terminal, gpu, "fig5", &scenes, &volume, rows)
}

/// Measures frames of [`SCENES`] at 1280×720 pixels with one sample.
fn scenes(args: &BenchArgs, terminal: &Terminal, gpu: &mut Option<GpuBench>, rows: &mut Rows) -> Result<()> {
    let size = ["image.width=1280", "image.height=720", "image.samples=1"].map(String::from);
    for name in SCENES {
        let scene = load(name, &size)?;
        let volume = scene.volume(direct_limits().memory, terminal)?;
        let few = BenchArgs { runs: args.runs.min(3), ..args.clone() };
        passes(&few, terminal, gpu, name, &[("integrate", scene)], &volume, rows)?;
    }
    Ok(())
}

/// Measures scenes that differ only in their passes' settings: all passes in turn, `runs` times.
fn passes(
    args: &BenchArgs,
    terminal: &Terminal,
    gpu: &mut Option<GpuBench>,
    name: &'static str,
    scenes: &[(&'static str, Scene)],
    volume: &VolumeTexture,
    rows: &mut Rows,
) -> Result<()> {
    let direct = &scenes[0].1;
    let mesh = direct.mesh();
    let mut measured: Vec<(&'static str, &'static str, Vec<f64>, u64)> = Vec::new();
    let mut add =
        |engine, pass, seconds, cells| match measured.iter_mut().find(|m| m.0 == engine && m.1 == pass) {
            Some(m) => m.2.push(seconds),
            None => measured.push((engine, pass, vec![seconds], cells)),
        };
    let [nx, ny, nz] = volume.size;
    let cells = format!("{nx}×{ny}×{nz}");
    let mut failed: Vec<(&'static str, Error)> = Vec::new();
    let mut is_ready = false;
    if let Some(bench) = gpu {
        let scenes: Vec<_> = scenes.iter().map(|(name, scene)| (*name, scene)).collect();
        match bench.prepare(&scenes, volume, &mesh) {
            Ok(others) => (failed, is_ready) = (others, true),
            Err(e) => failed = vec![("all", e)],
        }
    }
    let mut light_volumes = cpu::LightVolumeCache::default();
    // The first round warms caches and settles tile sizes, so it does not count.
    for round in 0..=args.runs {
        terminal.progress("rounds", round as u64, args.runs as u64)?;
        let counted = round > 0;
        if let Some(bench) = gpu.as_mut().filter(|_| is_ready) {
            for (number, name) in bench.names().into_iter().enumerate() {
                match bench.run(number) {
                    Ok((seconds, cells)) if counted => add("gpu", name, seconds, cells),
                    Ok(_) => {}
                    Err(e) => {
                        failed.push((name, e));
                        is_ready = false;
                        break;
                    }
                }
            }
        }
        // With `--engine gpu`, only the device is measured.
        let on_cpu = match args.engine.engine {
            EngineChoice::Gpu => 0,
            _ => scenes.len(),
        };
        let options = RenderOptions { samples: Some(0..1), ..Default::default() };
        // Threads that have slept since the last round wake up first.
        for (_, scene) in scenes.iter().take(on_cpu.min(1)) {
            cpu::render_with(scene, volume, &mesh, &options, &mut light_volumes, &Unwatched)?;
        }
        for (pass, scene) in scenes.iter().take(on_cpu) {
            let frame = cpu::render_with(scene, volume, &mesh, &options, &mut light_volumes, &Unwatched)?;
            if counted {
                add("cpu", *pass, frame.seconds.integrate, frame.cells_walked().iter().sum());
                if *pass == scenes[0].0 {
                    add("cpu", "gbuffer", frame.seconds.gbuffer, 0);
                }
            }
        }
    }
    if gpu.is_some() && !is_ready {
        // A device that has failed once is not trusted with the next scene.
        *gpu = open_gpu(args)?.0;
    }
    for (pass, e) in failed {
        rows.failed(row(name, cells.clone(), direct, "gpu", pass, [0.0; 2], 0), e)?;
    }
    for (engine, pass, times, walked) in measured {
        rows.push(row(name, cells.clone(), direct, engine, pass, summary(times), walked));
    }
    Ok(())
}

fn row(
    scene: &'static str,
    volume: String,
    measured: &Scene,
    engine: &'static str,
    pass: &'static str,
    [seconds, fastest]: [f64; 2],
    cells: u64,
) -> Row {
    let cores = rayon::current_num_threads() as f64;
    let ns_per_cell = if cells == 0 { 0.0 } else { seconds * cores / cells as f64 * 1e9 };
    let size = format!("{}×{}", measured.image.width, measured.image.height);
    Row { scene, volume, size, engine, pass, seconds, fastest, cells, ns_per_cell, error: None }
}

/// Measures how long the host takes to turn radiance into a picture, without and with bloom.
fn pictures(args: &BenchArgs, terminal: &Terminal, rows: &mut Rows) -> Result<()> {
    let sets = |bloom: f32| [front([1280, 720]), vec![format!("image.bloom={bloom}")]].concat();
    let scenes = [("resolve", load("front", &sets(0.0))?), ("resolve bloom", load("front", &sets(0.1))?)];
    let volume = scenes[0].1.volume(direct_limits().memory, terminal)?;
    let mut frame = cpu::render(&scenes[0].1, &volume, &scenes[0].1.mesh(), false, &Unwatched)?;
    let mut times = [Vec::new(), Vec::new()];
    for round in 0..=args.runs {
        terminal.progress("pictures", round as u64, args.runs as u64)?;
        for ((_, scene), times) in scenes.iter().zip(&mut times) {
            let clock = Instant::now();
            develop_whole(&mut frame, &scene.image.look);
            if round > 0 {
                times.push(clock.elapsed().as_secs_f64());
            }
        }
    }
    for ((pass, scene), times) in scenes.iter().zip(times) {
        rows.push(row("front", "–".into(), scene, "cpu", pass, summary(times), 0));
    }
    Ok(())
}

/// Measures how long volumes take to build. The rows' cells are the cells of the volume.
fn builds(args: &BenchArgs, terminal: &Terminal, rows: &mut Rows) -> Result<()> {
    for n in [40, 256] {
        let scene = load("front", &cube(n))?;
        let mut times = Vec::new();
        for round in 0..args.runs.min(5) {
            terminal.progress("builds", round as u64, args.runs as u64)?;
            let clock = Instant::now();
            let volume = scene.volume(direct_limits().memory, &Unwatched)?;
            times.push(clock.elapsed().as_secs_f64());
            drop(volume);
        }
        let cells = (n as u64).pow(3);
        rows.push(Row {
            size: "–".into(),
            ..row("front", format!("{n}×{n}×{n}"), &scene, "cpu", "volume build", summary(times), cells)
        });
    }
    Ok(())
}

/// Measures whole processes, from start to written PNG: a figure, and the default scene with one sample.
fn processes(args: &BenchArgs, terminal: &Terminal, rows: &mut Rows) -> Result<()> {
    let folder = tempfile::tempdir().map_err(|e| Error::write(&std::env::temp_dir(), e.kind()))?;
    let program = std::env::current_exe().map_err(|e| Error::read("taki".as_ref(), e))?;
    let engine = match args.engine.engine {
        EngineChoice::Auto => "auto",
        EngineChoice::Gpu => "gpu",
        EngineChoice::Cpu => "cpu",
    };
    for (preset, more) in [("fig5", &[][..]), ("waterfall", &["--size", "1280x720", "--samples", "1"])] {
        let scene = load(preset, &[])?;
        let [nx, ny, nz] = scene.recipes[0].water.size;
        let whole = |times| {
            row(preset, format!("{nx}×{ny}×{nz}"), &scene, engine, "whole process", summary(times), 0)
        };
        let mut times = Vec::new();
        let mut failed = None;
        for round in 0..args.runs.min(5) {
            terminal.progress("processes", round as u64, args.runs as u64)?;
            let clock = Instant::now();
            let status = std::process::Command::new(&program)
                .args(["render", preset, "--no-cache", "--engine", engine, "-o"])
                .arg(folder.path().join("out.png"))
                .args(more)
                .stderr(std::process::Stdio::null())
                .status();
            match status {
                Ok(status) if status.success() => times.push(clock.elapsed().as_secs_f64()),
                other => {
                    let what = format!("taki render {preset} failed ({other:?})");
                    failed = Some(Error::input(what, "run it by hand to see why"));
                    break;
                }
            }
        }
        match failed {
            None => rows.push(whole(times)),
            Some(e) => rows.failed(whole(vec![0.0]), e)?,
        }
    }
    Ok(())
}

fn print(json: bool, line: &str, rows: &[Row]) -> Result<()> {
    if json {
        let table = serde_json::json!({"engine": line, "cores": rayon::current_num_threads(), "rows": rows});
        return say(&table.to_string());
    }
    say("| scene | volume | size | engine | pass | ms | fastest | cells | core-ns per cell |")?;
    say("|---|---|---|---|---|--:|--:|--:|--:|")?;
    for r in rows {
        if let Some(why) = &r.error {
            let place = [r.scene, &r.volume, &r.size, r.engine, r.pass].join(" | ");
            say(&format!("| {place} | not measured: {why} |||||"))?;
            continue;
        }
        let cells = if r.cells == 0 { "–".into() } else { r.cells.to_string() };
        let ns = if r.cells == 0 { "–".into() } else { format!("{:.2}", r.ns_per_cell) };
        say(&format!(
            "| {} | {} | {} | {} | {} | {:.2} | {:.2} | {cells} | {ns} |",
            r.scene,
            r.volume,
            r.size,
            r.engine,
            r.pass,
            r.seconds * 1e3,
            r.fastest * 1e3
        ))?;
    }
    let integrate_of_cube = |n: u32| {
        let volume = format!("{n}×{n}×{n}");
        let is = move |r: &&Row| {
            r.volume == volume && (r.engine, r.pass) == ("gpu", "integrate") && r.error.is_none()
        };
        rows.iter().filter(is)
    };
    for large in integrate_of_cube(LARGE) {
        if let Some(row) = integrate_of_cube(256).find(|r| r.size == large.size) {
            say(&format!(
                "\n{LARGE}³ and 256³ with the same strands, {}: {:.2} times the time for {:.2} times the \
                 cells",
                large.size,
                large.seconds / row.seconds,
                large.cells as f64 / row.cells as f64
            ))?;
        }
    }
    for bare in rows.iter().filter(|r| ["bare walk", "bare leaping walk"].contains(&r.pass)) {
        let same = |r: &&Row| {
            let subject = (bare.scene, &bare.volume, &bare.size);
            r.pass == "integrate" && r.engine == "gpu" && (r.scene, &r.volume, &r.size) == subject
        };
        if let Some(integrate) = rows.iter().find(same) {
            let ratio = integrate.seconds / bare.seconds;
            say(&format!(
                "\n{} {}: integrate is {ratio:.2} times the {}",
                bare.volume, bare.size, bare.pass
            ))?;
        }
    }
    Ok(())
}
