//! `taki bench`: what the passes cost on this machine, with the work they did.
//!
//! Times are medians of runs in turn in one process: other programs on the machine disturb all rows
//! alike, so ratios between rows hold where single times do not.
//!
//! # Notes on the integrate pass
//!
//! Measured on software Vulkan (Mesa 22.3.6, 8 SIMD lanes) in instructions per step of 8 rays, read off the
//! compiled shader, since counts have no noise. The least a step needs there is the fetch: bounds, address,
//! eight 64-bit loads and their transposition, about 60. The bare walk (fetch, step, one addition) needs 120.
//!
//! | integrate, direct light | instructions a step |
//! |---|--:|
//! | one cell a loop turn, uniforms read in the loop (each is gathered lane by lane, about 25 instructions) | 326 |
//! | two cells a turn: mask blends and loop bounds are paid once | 290 |
//! | four cells a turn, uniforms read before the loop | 222 |
//!
//! Of the 222 about 60 are fetch, 55 step and 25 `exp2`, read off the listing; the fibre model and spilled
//! registers are the rest. Keeping the first light out of indexed arrays was worth 7 %. With `march`, rays of a SIMD
//! group that found an occupied cell wait for the others before all walk to the light: 2.4 times faster at 8 %
//! occupied cells.
//!
//! What did not help: seeking the next occupied cell before shading it *without* `march` (1.7 times slower:
//! an inner loop costs more than shading an empty cell); eight cells a turn (no better than four in the bare walk); `min` for
//! the exit (it minds NaN: three instructions to `select`'s two); leaving out any one of `exp2`, the power, the
//! roots or the division gains 6 % each, so none of them is the bottleneck.
//!
//! The limit, 222 instructions a step: one thread alone (`LP_NUM_THREADS=1`)
//! needs 6.8 ns a cell, two threads 7.1 (fastest run) to 12.8 (median) core-nanoseconds: what is lost when
//! both cores of the shared machine work was not found out. A scalar kernel compiled by Numba needs 13 to 17 per
//! cell. Time per frame is therefore alike, for the reason below; half as much again would take about 150
//! instructions a step, less than fetch, step and `exp2` leave for a fibre model.
//!
//! In `fig5` a tile of the whole picture (47 ms a sample) takes three quarters of what two tiles of half of it do
//! (62 ms): llvmpipe deals the workgroups of a dispatch out to its threads in two fixed halves, and of a half
//! picture one half has more water. Submissions stay at 30 ms for the viewer's sake.
//!
//! With `trace.max_cells=1` a sample of the default scene at 1280×720 still took 0.156 s of 0.38: SIMD groups without water go once through
//! the whole shader, walks and all, for llvmpipe has no branch where all lanes are off. Predicted for walking only the workgroups that a quad's
//! image touches, and dealing them out every other one first: 0.28 s. Measured, fastest of two in turn, four samples: default 1.66 to 1.22 s,
//! `cascade` 2.38 to 1.71, `night` 4.68 to 3.70, `fig5` 0.22 to 0.16. Rows of lanes that go down the image in place of across it: 3 % better on
//! the default, 2 % worse on `night`, not kept.
//!
//! Time stamps of software Vulkan cannot be trusted: the first one of a compute pass is written late unless a
//! render pass came before (0.03 ms told, 40 taken). Passes are timed by the host's clock there.
//!
//! # Notes on the raster pass
//!
//! The default scene has 720,896 triangles of rock for 921,600 pixels. On software Vulkan, relative to the integrate pass of the same
//! run, for the machine is shared (medians of three runs of seven frames, after the first): 1.9 with the mesh row by row in one
//! draw, rock and pool in one shader; 1.04 in parts of 341 triangles, the nearest first, those out of view left out, a pipeline for pools alone and
//! submissions that overlap; 1.02 with vertices read from a storage buffer as three full vectors. One shader for both made each fragment
//! of rock pay for a pool, and each of a pool for rock: there are no branches between lanes. Where only the
//! waves move, the pool alone takes a tenth of the whole pass.
//!
//! Rock is shaded after it is drawn: the pass writes where on which tile of the mesh a sample lies, and one more over the picture
//! shades each sample once. A triangle of three pixels fills a fifth of the block of 4×4 that is shaded for it, and some are
//! covered again. Seconds of all cores a run, for the machine was too busy for its clock: 0.455 before, 0.33 with vertices of 48
//! bytes, 0.30 with 24 and without the loop over a single light. Of those 0.135 are the mesh (0.09 of that the
//! triangles themselves, the same at 320×180), 0.045 the shading, 0.04 the pool, 0.03 three layers of peeling, 0.03 clearing and background.
//!
//! Drawing every 2nd, 4th … vertex of tiles was expected to halve the triangles at one sample. Counted, triangles of the default scene (rock and pool) by
//! `image.rock_error`: 0: 720,896, 0.5: 717,616, 1: 653,756, 2: 559,625, 4: 397,268 at 1280×720. The rock is rough down to its last
//! level: half of its vertices leave a line between their neighbours by more than a pixel. RMSE of the linear picture against 0:
//! 0.0002, 0.0017, 0.008, 0.021; at 2 a ledge here and there shows a pale rim, at 4 the far hills have dark dashes: places of the full mesh that face away. So the gain is
//! in small pictures, previews and far rock; edges no longer than a pixel would have been no criterion, for they are 2 to 6 pixels.
//!
//! What did not help: leaving out, on the host, the third of the triangles that no pixel's centre lies in: 25 ms of 550 for 25 ms of work.
//!
//! # Notes on light in water
//!
//! Light volumes of float optical depths cost 1.27 times `none` on `front` and 1.6 times on `fig5`, whose 60 patches
//! (15 MB) are read about once a frame, so past the caches. √T in a byte, four cells a word, saves the `exp2` and three
//! quarters of the lines: predicted 1.2 and 1.3; three runs of the bench gave 1.10, 1.20 and 1.12, and 1.27, 1.17 and 1.32. Filling them costs half as much again, for lanes wait for
//! one another over the four cells of a word.
//!
//! Several lights: what a ray knows of each stood in private arrays indexed in a loop, 30 floats a light. llvmpipe makes trees
//! of selects of that, 7 to 10 s to compile and 2.0 s a sample for `fig5` under 25 lights. Working it out again in every occupied
//! cell, from a buffer, compiles in 0.2 s and takes 0.5 s a sample.
//!
//! # Notes on leaps
//!
//! Counted first, in loop turns of SIMD groups of 8 pixels over those of the plain walk, view rays of `fig5` and of the water of
//! `waterfall`: the distance to the nearest occupied cell in any direction, 0.74 and 0.94 (with mist); one cube for each octant 0.47 and 0.72; for each octant
//! a box whose sides are powers of two, doubled in turn, 0.37 and 0.58. The same 48 bits hold the last two. On the device
//! they were found again: 291,607 turns of groups became 107,461 in `fig5`, 404,604 became 330,746 in `front`.
//!
//! Predicted from instructions (228 a step of integrate without leaps, 317 with them, read off the compiled shader): 0.5 of the
//! time in `fig5`. Measured, fastest of 5 to 12 runs in turn: `fig5` 0.9 to 1.1, `waterfall` (march) 1.4 to 1.7, `front` 1.2 to 1.5. A step of the
//! plain walk does not wait for its fetch, since where it goes does not depend on it, and fetches of several steps are under way at once. A
//! leap does, and its arithmetic comes after: a turn is a chain of some 200 cycles, of which nothing overlaps. GPUs that
//! hide latency with other groups should come nearer to the count; none was at hand. So leaps are taken where volumes are emptier than in any preset
//! (`src/volume/leaps.rs`, WORTH): `fig5` with 128³ cells, 97 % of its 2×2×2 boxes empty, took 0.45 of the time with `march` (267 to 119 ms) and
//! 0.59 with `none` (77 to 45 ms); with 4×4 curves at 40³, 96 %, 1.0 and 0.84.
//!
//! What did not help: bits of floats put together by hand in place of conversions (314 instructions to 317; the compiler had done it).
//! On the CPU the same chain takes as long as five steps, so there only boxes whose exponents add up to 6 are leapt over: 0.74 (`march`) and
//! 0.84 (`none`) of the time at 128³, 0.73 and 0.76 with 4×4 curves. Four lanes of SSE in place of three floats took twice as long as those.
//!
//! # Notes on storage
//!
//! Summed first, for strands in 2 % of 1024³ cells: a column of 8×8 cells has 1.3 strands, so that bricks of 8³ kept whole would store most
//! of 8 GiB; with a mask and a base for 4³ cells, and the stored cells alone, 0.20 + 0.25 GB on the host and 0.27 + 0.25 on the device. Measured
//! (`/usr/bin/time -v`, 31.1 million stored, software Vulkan's own 0.15 GB and the picture included): 1.32 GiB. Predicted for a fetch of four words and a popcount
//! in front of every cell's own: 345 instructions a step for 222. Measured at 256³, where nothing is gained by it, user seconds of four samples
//! less those of one: 1.25 times the dense pass. At 512³ with the same strands it is 0.7 to 0.8 times the dense one's: the dense bare walk takes 17 ns a cell
//! there for 8 at 256³, for layers are 2 MiB apart and every step along z meets another page. Predicted from instructions was 1.71, the ratio of cells, and
//! without other work on the machine that was measured (1.04 to 1.74 s).
//!
//! What was not done, by sums: leaping over empty bricks. At 2 % seven in ten bricks are empty, and turns would fall to 0.46 of the walk's; leaps
//! gain nothing at that share (above: 0.37 of the turns took 0.9 to 1.1 of the time). Keeping the last brick in registers saves no fetch where all
//! lanes fetch.
//!
//! The walk goes on through the tiled copies where other programs' rays leave the box: 46.7 cells a ray in
//! `front` at 40³ against their 34.5. Compare nanoseconds per cell as well as times.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use super::terminal::{Terminal, say};
use super::{EngineOptions, size};
use crate::cpu::{self, resolve::develop};
use crate::error::{Error, Result};
use crate::frame::Window;
use crate::gpu::GpuBench;
use crate::job::{Engine, EngineChoice, Monitor, Unwatched};
use crate::scene::{Limits, Scene};
use crate::volume::VolumeTexture;

#[derive(Args, Clone)]
pub struct BenchArgs {
    /// Measures the `front` scene with this volume file only.
    #[arg(long, value_name = "V.npz")]
    volume: Option<PathBuf>,
    /// Measures the `front` scene with a cube of so many cells a side only. Beyond 256 it has the strands of 256,
    /// and is stored sparse where the memory does not hold it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8192), conflicts_with = "volume")]
    cells: Option<u32>,
    /// Measures this image size only.
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Runs of each row, of which the median counts.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,
    #[command(flatten)]
    engine: EngineOptions,
    /// Prints one JSON object with all rows.
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
    /// Median.
    seconds: f64,
    /// Fastest run.
    fastest: f64,
    /// Cells walked in one run, by view and light rays.
    cells: u64,
    /// Core-nanoseconds per cell: wall seconds × cores / cells.
    ns_per_cell: f64,
}

/// Deepest volume that rows with a light walk from every cell are measured on: their cost grows with the
/// square of the depth, and 256 layers take minutes a frame.
const MARCH_LAYERS: u32 = 64;

/// A pass, and what is set for it.
type Step = (&'static str, &'static [&'static str]);

/// The integrate passes that are measured on `front`.
const PASSES: &[Step] = &[
    ("integrate", &[]),
    ("integrate march", &["light.visibility=march"]),
    ("integrate cached", &["light.visibility=cached"]),
    ("integrate pyramid", &["trace.filter=pyramid"]),
    ("integrate trilinear", &["trace.lookup=trilinear"]),
];

/// The steps of light in water, on `fig5` with ten times its density: each is the one before and more. The README
/// shows their pictures.
const STEPS: &[Step] = &[
    ("no attenuation", &["light.visibility=none"]),
    ("march", &["light.visibility=march"]),
    ("cached", &["light.visibility=cached"]),
    ("multiple", &["light.scattering=multiple"]),
    ("strand", &["light.reflection=strand", "strand.aeration=0"]),
    ("aerated", &["strand.aeration=0.5"]),
    ("sky", &["environment.kind=sky", "light.ambient=[0,0,0]", "lights.sun.intensity=0"]),
];

/// The scenes whose frames are measured.
const SCENES: [&str; 6] = ["waterfall", "cascade", "curtain", "spout", "night", "evening"];

/// The largest cube that is measured unless asked for, at the larger size alone.
const LARGE: u32 = 512;

const SIZES: [[u32; 2]; 2] = [[266, 426], [1280, 720]];

pub fn run(args: &BenchArgs, terminal: &Terminal) -> Result<()> {
    let sizes = args.size.map_or(SIZES.to_vec(), |s| vec![s]);
    let mut rows = Vec::new();
    let (engine, line) = Engine::open(args.engine.engine, &args.engine.device())?;
    terminal.note(&format!("taki: {line}"));
    let mut gpu = match engine {
        Engine::Gpu(renderer, _) => Some(GpuBench::new(*renderer)),
        Engine::Cpu(_) => None,
    };
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
            let volume = load("front", &sets)?.volume(direct_limits().memory, terminal)?;
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
    print(args.json, &line, &rows);
    Ok(())
}

fn direct_limits() -> Limits {
    Limits::default()
}

fn load(preset: &'static str, sets: &[String]) -> Result<Scene> {
    Scene::load(preset.as_ref(), sets, &direct_limits())
}

/// A cubic volume with as many strands per face area as 32 × 32 at 40³, up to 256³; a larger one has those of 256³: the same
/// water, finer.
fn cube(n: u32) -> Vec<String> {
    let strands = (32.0 * n.min(256) as f64 / 40.0).round();
    let mut sets: Vec<String> = ["nx", "ny", "nz"].map(|axis| format!("volume.{axis}={n}")).to_vec();
    sets.extend(["across", "deep"].map(|axis| format!("curves.{axis}={strands}")));
    sets
}

/// The front scene at a size: the quad spans 0.98 of the smaller side of the image.
fn front([width, height]: [u32; 2]) -> Vec<String> {
    let half_height = 0.5 / 0.98 * height as f64 / width.min(height) as f64;
    let fov = 2.0 * (half_height / 3.0).atan().to_degrees();
    vec![format!("image.width={width}"), format!("image.height={height}"), format!("camera.fov={fov}")]
}

/// Median and fastest.
fn summary(mut times: Vec<f64>) -> [f64; 2] {
    times.sort_by(f64::total_cmp);
    [times[times.len() / 2], times[0]]
}

/// Rows of light in water, at the figure's own size with one sample.
fn steps(
    args: &BenchArgs,
    terminal: &Terminal,
    gpu: &mut Option<GpuBench>,
    rows: &mut Vec<Row>,
) -> Result<()> {
    let mut scenes = Vec::new();
    let mut sets: Vec<String> = ["image.samples=1", "trace.tau=4"].map(String::from).to_vec();
    for (pass, more) in STEPS {
        sets.extend(more.iter().map(|&set| set.into()));
        scenes.push((*pass, load("fig5", &sets)?));
    }
    let volume = scenes[0].1.volume(direct_limits().memory, terminal)?;
    passes(args, terminal, gpu, "fig5", &scenes, &volume, rows)
}

/// Rows of the scenes with a place of their own, with one sample.
fn scenes(
    args: &BenchArgs,
    terminal: &Terminal,
    gpu: &mut Option<GpuBench>,
    rows: &mut Vec<Row>,
) -> Result<()> {
    let size = ["image.width=1280", "image.height=720", "image.samples=1"].map(String::from);
    for name in SCENES {
        let scene = load(name, &size)?;
        let volume = scene.volume(direct_limits().memory, terminal)?;
        let few = BenchArgs { runs: args.runs.min(3), ..args.clone() };
        passes(&few, terminal, gpu, name, &[("integrate", scene)], &volume, rows)?;
    }
    Ok(())
}

/// Rows of scenes that differ in their light: all passes in turn, `runs` times.
fn passes(
    args: &BenchArgs,
    terminal: &Terminal,
    gpu: &mut Option<GpuBench>,
    name: &'static str,
    scenes: &[(&'static str, Scene)],
    volume: &VolumeTexture,
    rows: &mut Vec<Row>,
) -> Result<()> {
    let direct = &scenes[0].1;
    let mesh = direct.mesh();
    let mut measured: Vec<(&'static str, &'static str, Vec<f64>, u64)> = Vec::new();
    let mut add =
        |engine, pass, seconds, cells| match measured.iter_mut().find(|m| m.0 == engine && m.1 == pass) {
            Some(m) => m.2.push(seconds),
            None => measured.push((engine, pass, vec![seconds], cells)),
        };
    if let Some(gpu) = gpu {
        let scenes: Vec<_> = scenes.iter().map(|(name, scene)| (*name, scene)).collect();
        gpu.prepare(&scenes, volume, &mesh)?;
    }
    let mut kept = cpu::KeptVolumes::default();
    // The first round warms caches and tile sizes and is not counted.
    for round in 0..=args.runs {
        terminal.progress("rounds", round as u64, args.runs as u64)?;
        let counted = round > 0;
        if let Some(gpu) = gpu {
            for (number, name) in gpu.names().into_iter().enumerate() {
                let (seconds, cells) = gpu.run(number)?;
                if counted {
                    add("gpu", name, seconds, cells);
                }
            }
        }
        // `--engine gpu` asks for the device's rows alone.
        let on_cpu = match args.engine.engine {
            EngineChoice::Gpu => 0,
            _ => scenes.len(),
        };
        for (pass, scene) in scenes.iter().take(on_cpu) {
            let (whole, samples) = (Window::whole([scene.image.width, scene.image.height]), 0..1);
            let frame =
                cpu::render_samples(scene, volume, &mesh, whole, samples, false, &mut kept, &Unwatched)?;
            if counted {
                add("cpu", *pass, frame.seconds.integrate, frame.cells_walked().iter().sum());
                if *pass == scenes[0].0 {
                    add("cpu", "gbuffer", frame.seconds.gbuffer, 0);
                }
            }
        }
    }
    let [nx, ny, nz] = volume.size;
    for (engine, pass, times, cells) in measured {
        rows.push(row(name, format!("{nx}×{ny}×{nz}"), direct, engine, pass, summary(times), cells));
    }
    Ok(())
}

fn row(
    scene: &'static str,
    volume: String,
    of: &Scene,
    engine: &'static str,
    pass: &'static str,
    [seconds, fastest]: [f64; 2],
    cells: u64,
) -> Row {
    let cores = rayon::current_num_threads() as f64;
    let ns_per_cell = if cells == 0 { 0.0 } else { seconds * cores / cells as f64 * 1e9 };
    let size = format!("{}×{}", of.image.width, of.image.height);
    Row { scene, volume, size, engine, pass, seconds, fastest, cells, ns_per_cell }
}

/// Rows for making a picture of its radiance on the host: pixel by pixel, and with bloom.
fn pictures(args: &BenchArgs, terminal: &Terminal, rows: &mut Vec<Row>) -> Result<()> {
    let sets = |bloom: f32| [front([1280, 720]), vec![format!("image.bloom={bloom}")]].concat();
    let scenes = [("resolve", load("front", &sets(0.0))?), ("resolve bloom", load("front", &sets(0.1))?)];
    let volume = scenes[0].1.volume(direct_limits().memory, terminal)?;
    let mut frame = cpu::render(&scenes[0].1, &volume, &scenes[0].1.mesh(), false, &Unwatched)?;
    let mut times = [Vec::new(), Vec::new()];
    for round in 0..=args.runs {
        terminal.progress("pictures", round as u64, args.runs as u64)?;
        for ((_, scene), times) in scenes.iter().zip(&mut times) {
            let clock = Instant::now();
            develop(&mut frame, &scene.image.look, true);
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

/// Rows for building volumes; cells are those of the volume.
fn builds(args: &BenchArgs, terminal: &Terminal, rows: &mut Vec<Row>) -> Result<()> {
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

/// Rows for whole processes, from start to written PNG: a figure, and the default scene's first light.
fn processes(args: &BenchArgs, terminal: &Terminal, rows: &mut Vec<Row>) -> Result<()> {
    let folder = tempfile::tempdir().map_err(|e| Error::write(&std::env::temp_dir(), e))?;
    let program = std::env::current_exe().map_err(|e| Error::read("taki".as_ref(), e))?;
    let engine = match args.engine.engine {
        EngineChoice::Auto => "auto",
        EngineChoice::Gpu => "gpu",
        EngineChoice::Cpu => "cpu",
    };
    for (preset, more) in [("fig5", &[][..]), ("waterfall", &["--size", "1280x720", "--samples", "1"])] {
        let scene = load(preset, &[])?;
        let mut times = Vec::new();
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
                    return Err(Error::input(
                        format!("taki render {preset} failed ({other:?})"),
                        "run it by hand",
                    ));
                }
            }
        }
        let [nx, ny, nz] = scene.water.size;
        let row = row(preset, format!("{nx}×{ny}×{nz}"), &scene, engine, "whole process", summary(times), 0);
        rows.push(row);
    }
    Ok(())
}

fn print(json: bool, line: &str, rows: &[Row]) {
    if json {
        say(&serde_json::json!({"engine": line, "cores": rayon::current_num_threads(), "rows": rows})
            .to_string());
        return;
    }
    say("| scene | volume | size | engine | pass | ms | fastest | cells | core-ns per cell |");
    say("|---|---|---|---|---|--:|--:|--:|--:|");
    for r in rows {
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
        ));
    }
    let of_size = |n: u32| {
        let volume = format!("{n}×{n}×{n}");
        let is = move |r: &&Row| r.volume == volume && (r.engine, r.pass) == ("gpu", "integrate");
        rows.iter().filter(is)
    };
    for large in of_size(LARGE) {
        if let Some(row) = of_size(256).find(|r| r.size == large.size) {
            say(&format!(
                "\n{LARGE}³ and 256³ with the same strands, {}: {:.2} times the time for {:.2} times the cells",
                large.size,
                large.seconds / row.seconds,
                large.cells as f64 / row.cells as f64
            ));
        }
    }
    for bare in rows.iter().filter(|r| ["bare walk", "bare leaping walk"].contains(&r.pass)) {
        let same = |r: &&Row| {
            let of = (bare.scene, &bare.volume, &bare.size);
            r.pass == "integrate" && r.engine == "gpu" && (r.scene, &r.volume, &r.size) == of
        };
        if let Some(integrate) = rows.iter().find(same) {
            let ratio = integrate.seconds / bare.seconds;
            say(&format!("\n{} {}: integrate is {ratio:.2} times the {}", bare.volume, bare.size, bare.pass));
        }
    }
}
