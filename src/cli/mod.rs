//! The command line: one file per subcommand.

mod batch;
mod bench;
mod choice;
mod compare;
mod devices;
mod farm;
mod render;
mod scene;
mod stitch;
mod terminal;
#[cfg(feature = "viewer")]
mod view;
mod volume;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, CommandFactory, Parser, Subcommand};

use crate::engine::EngineChoice;
use crate::engine::gpu::DeviceOptions;
use crate::scene::{Animation, DEFAULT_PRESET, Limits, Scene, presets};
use crate::util::cache::Cache;
use crate::util::error::{Error, Result};
use crate::util::window::Window;
use terminal::{Terminal, say};

const EXIT_CODES: &str = "Exit codes: 0 ok · 1 comparison failed · 2 usage · 33 out of memory · 65 bad input · \
69 no adapter (only with --engine gpu), no window, or no ffmpeg · 73 cannot create output · 74 I/O error · 75 device lost, try again · \
124 the GPU did not answer · 130/143 interrupted · 101 a bug.";

/// Renders matter too fine for geometry, gushing water first, as volume textures on the GPU.
#[derive(Parser)]
#[command(version, max_term_width = 100, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Renders one image.
    Render(render::RenderArgs),
    /// Renders many images: the frames of an animation, the grid of a sweep.
    Batch(batch::BatchArgs),
    /// Opens the viewer: turn the parameters and see the picture change.
    #[cfg(feature = "viewer")]
    View(view::ViewArgs),
    /// Checks a scene and prints it fully resolved.
    Scene(scene::SceneArgs),
    /// Builds a volume texture or prints its statistics.
    Volume(volume::VolumeArgs),
    /// Writes a job file that splits a batch over the machines of a farm.
    Farm(farm::FarmArgs),
    /// Measures this machine: passes, engines, volumes, with the work each did.
    Bench(bench::BenchArgs),
    /// Joins crops of one picture to the file of the whole.
    Stitch(stitch::StitchArgs),
    /// Compares two images (PNG or EXR): error figures, a difference image, exit 1 past a threshold.
    Compare(compare::CompareArgs),
    /// Lists the scenes that come with the program.
    Presets,
    /// Lists the GPU adapters of this machine.
    Devices,
    /// Prints completions for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

/// What every command that reads a scene takes.
#[derive(Args, Clone)]
struct SceneOptions {
    /// A preset (see `taki presets`) or a scene file.
    #[arg(default_value = DEFAULT_PRESET)]
    scene: PathBuf,
    /// Sets any parameter, such as `--set curves.h=1.4`; may be given often. docs/parameters.md
    /// lists them all, and so does `taki scene`.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Seed of the volume's randomness: short for --set volume.seed=N.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Lets the scene refer to files in this folder too; may be given often.
    #[arg(long = "allow-path", value_name = "DIR")]
    allow_paths: Vec<PathBuf>,
    /// Most memory the work may use, MiB. What needs more is refused before it starts.
    #[arg(long, value_name = "MIB", default_value_t = 4096)]
    memory: u64,
}

impl SceneOptions {
    fn limits(&self) -> Limits {
        Limits {
            allow_paths: self.allow_paths.clone(),
            memory: self.memory.saturating_mul(1 << 20),
            ..Limits::default()
        }
    }

    /// Loads the scene; `more` are settings of other options, which come last.
    fn load(&self, more: &[String]) -> Result<Scene> {
        Scene::load(&self.scene, &self.all_sets(more), &self.limits())
    }

    /// Loads the scene as it moves.
    fn animation(&self, more: &[String], limits: &Limits) -> Result<Animation> {
        Animation::load(&self.scene, &self.all_sets(more), limits)
    }

    fn all_sets(&self, more: &[String]) -> Vec<String> {
        let mut sets = self.sets.clone();
        sets.extend(self.seed.map(|n| format!("volume.seed={n}")));
        sets.extend_from_slice(more);
        sets
    }
}

/// What commands take that render.
#[derive(Args, Clone)]
struct CacheOptions {
    /// Neither takes volumes and meshes from the cache of earlier runs nor leaves them there.
    #[arg(long)]
    no_cache: bool,
}

impl CacheOptions {
    fn add_to(&self, limits: Limits) -> Limits {
        let cache = (!self.no_cache).then(Cache::of_user).flatten();
        Limits { cache, ..limits }
    }
}

/// Which engine, on which device.
#[derive(Args, Clone)]
struct EngineOptions {
    /// auto takes a GPU adapter if there is one, else the CPU.
    #[arg(long, value_parser = choice::engine(), default_value = "auto")]
    engine: EngineChoice,
    /// Takes the adapter whose name contains this (see `taki devices`).
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Longest wait for one piece of GPU work, seconds; then the program ends with 124.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = seconds)]
    watchdog: f64,
}

impl EngineOptions {
    fn device(&self) -> DeviceOptions {
        DeviceOptions { adapter: self.adapter.clone(), watchdog: Duration::from_secs_f64(self.watchdog) }
    }
}

fn seconds(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(s) if (0.0..=86_400.0).contains(&s) => Ok(s),
        _ => Err("a number of seconds from 0 to 86400".into()),
    }
}

/// `WIDTHxHEIGHT`.
fn size(text: &str) -> std::result::Result<[u32; 2], String> {
    let parts = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    parts.ok_or_else(|| "WIDTHxHEIGHT in pixels, such as 1280x720".into())
}

/// `X,Y,W,H`.
fn crop(text: &str) -> std::result::Result<[u32; 4], String> {
    let numbers = text.split(',').map(|n| n.trim().parse().ok()).collect::<Option<Vec<u32>>>();
    numbers
        .and_then(|n| n.try_into().ok())
        .ok_or_else(|| "column, row, width and height in pixels, such as 0,0,640,360".into())
}

/// What an automatic exposure has chosen.
fn measured_words(stops: f32) -> String {
    format!("taki: automatic exposure: {stops:+.2} stops")
}

/// The part of the image that is asked for by `option`.
fn window(option: &str, crop: Option<[u32; 4]>, size: [u32; 2]) -> Result<Window> {
    let Some(crop) = crop else { return Ok(Window::whole(size)) };
    let [x, y, width, height] = crop;
    if !Window::fits(size, crop) {
        return Err(Error::Usage(format!(
            "{option} {x},{y},{width},{height} does not lie in the picture; allowed: columns 0 to {}, rows 0 to {}, and \
             at least one of each",
            size[0] - 1,
            size[1] - 1
        )));
    }
    Ok(Window { x, y, width, height })
}

/// Where a command writes when -o is not given: the scene's name in the current folder.
fn default_output(scene: &Scene, extension: &str) -> PathBuf {
    // Not `with_extension`: the scene v1.2 would become v1.png.
    PathBuf::from(format!("{}.{extension}", scene.name))
}

/// Runs the program; the exit codes are listed in docs/scenes-and-files.md.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            // Help and version go to stdout and are no error.
            let text = e.render().to_string();
            if e.use_stderr() {
                terminal::complain_raw(&text)
            } else {
                say(text.trim_end())
            }
            return ExitCode::from(e.exit_code() as u8);
        }
    };
    let terminal = Terminal::new();
    let result = run(cli, &terminal);
    terminal.close();
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            terminal.error(&e);
            if matches!(e, Error::Watchdog { .. }) {
                // The driver's threads are still at work: exit handlers would take their memory away under
                // them, and the process end by a fault. Outputs and temporary files are settled by now.
                signal_hook::low_level::exit(e.exit_code().into());
            }
            ExitCode::from(e.exit_code())
        }
    }
}

fn run(cli: Cli, terminal: &Terminal) -> Result<()> {
    match cli.command {
        Command::Render(args) => render::run(&args, terminal),
        Command::Batch(args) => batch::run(&args, terminal),
        #[cfg(feature = "viewer")]
        Command::View(args) => view::run(&args, terminal),
        Command::Scene(args) => scene::run(&args),
        Command::Volume(args) => volume::run(&args, terminal),
        Command::Farm(args) => farm::run(&args),
        Command::Bench(args) => bench::run(&args, terminal),
        Command::Stitch(args) => stitch::run(&args, terminal),
        Command::Compare(args) => compare::run(&args),
        Command::Devices => devices::run(),
        Command::Presets => {
            presets().for_each(|(name, what)| say(&format!("{name:<12} {what}")));
            Ok(())
        }
        Command::Completions { shell } => {
            let mut bytes = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "taki", &mut bytes);
            say(String::from_utf8_lossy(&bytes).trim_end());
            Ok(())
        }
    }
}
