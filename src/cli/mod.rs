//! The command line. Each subcommand has its own file.

mod batch;
mod bench;
mod choice;
mod compare;
mod devices;
mod farm;
mod new;
mod parse;
mod quiet;
mod render;
mod scene;
mod stitch;
mod terminal;
mod tips;
#[cfg(feature = "viewer")]
mod view;
mod volume;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::error::{ContextKind, ContextValue};
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::engine::gpu::DeviceOptions;
use crate::engine::{Engine, EngineChoice};
use crate::job::Depth;
use crate::output::frame::{Compression, Exr, Format};
use crate::picture::Layer;
use crate::scene::{
    Animation, DEFAULT_PRESET, Limits, REMOVE, STDIN, Scene, Values, presets, read_stdin,
    settings_without_effect,
};
use crate::util::cache::Cache;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::window::Window;
use parse::{crop, frame, memory, samples, seconds, size, wait, whole};
use quiet::without_noise;
use terminal::{Terminal, say};
use tips::with_tips;

const EXIT_CODES: &str = "Exit codes: 0 success · 1 comparison failed · 2 usage error · 33 out of memory · \
65 bad input · 69 no GPU adapter (with --engine gpu or --adapter), no window or no ffmpeg · \
73 cannot create an output · 74 I/O error · 75 GPU device lost, try again · 101 a bug, please report it · \
124 the GPU did not answer · 130/143 interrupted.";

/// Renders water, and other matter too fine for geometry, as volume textures on the GPU.
///
/// To start, run `taki render` for a first picture, `taki presets` for more scenes, `taki view` to try out
/// parameters, or `taki new my.toml` for a scene of your own. `taki COMMAND --help` explains the options of a
/// command.
#[derive(Parser)]
#[command(version, max_term_width = 100, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Renders one picture.
    Render(render::RenderArgs),
    /// Renders many pictures: the frames of an animation or the grid of a parameter sweep.
    Batch(batch::BatchArgs),
    /// Opens the viewer, where you change parameters and see the picture change.
    #[cfg(feature = "viewer")]
    View(view::ViewArgs),
    /// Writes a scene file to start from, with comments that explain it.
    New(new::NewArgs),
    /// Checks a scene and prints it with all its parameters.
    Scene(scene::SceneArgs),
    /// Builds a volume texture or prints its statistics.
    Volume(volume::VolumeArgs),
    /// Writes a job file that splits a batch over the machines of a farm.
    Farm(farm::FarmArgs),
    /// Measures how long the stages of rendering take on this machine.
    Bench(bench::BenchArgs),
    /// Joins crops of one picture to the whole picture.
    Stitch(stitch::StitchArgs),
    /// Compares two pictures (PNG or EXR) and fails if they differ too much.
    Compare(compare::CompareArgs),
    /// Lists the preset scenes that come with taki.
    Presets,
    /// Lists the GPU adapters of this machine.
    Devices,
    /// Prints a script that completes taki's commands and options in a shell.
    Completions {
        /// The shell to complete for.
        shell: clap_complete::Shell,
    },
}

/// Options of every command that reads a scene.
#[derive(Args, Clone)]
struct SceneOptions {
    /// Name of a preset (see `taki presets`), path of a scene file, such as fall.toml, or of a picture that
    /// taki wrote, or - to read the scene from stdin.
    #[arg(default_value = DEFAULT_PRESET)]
    scene: PathBuf,
    /// Sets a parameter of the scene, such as `--set curves.h=1.4`. The last part of a key is enough where it
    /// means one parameter: `--set h=1.4`. Can be given more than once. docs/parameters.md explains all
    /// parameters; `taki scene` prints their values.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Removes a part of the scene, such as `--remove rocks.wall` or `--remove pools`, before the settings of
    /// --set apply. Can be given more than once. Short for --set remove=NAME.
    #[arg(long = "remove", value_name = "NAME")]
    removes: Vec<String>,
    /// Seed of the volume's random numbers. Short for --set volume.seed=N.
    #[arg(long, value_name = "N", value_parser = whole::<u64>)]
    seed: Option<u64>,
    /// Allows the scene to read files in this folder too. Can be given more than once.
    #[arg(long = "allow-path", value_name = "DIR")]
    allow_paths: Vec<PathBuf>,
    /// Memory budget, such as 6GiB (2^30 bytes each), 6GB (10^9 bytes each) or 512MiB. A number alone counts
    /// MiB. Work that would need more is refused before it starts.
    #[arg(long, value_name = "SIZE", value_parser = memory, default_value = "4GiB")]
    memory: u64,
}

impl SceneOptions {
    /// Begins work that a signal asks to stop. A scene on stdin is read before: it may take any time to
    /// come, and until then a signal has nothing to clean up.
    fn begin(&self, terminal: &Terminal) {
        if self.scene == Path::new(STDIN) {
            read_stdin();
        }
        terminal.watch();
    }

    fn limits(&self) -> Limits {
        Limits { allow_paths: self.allow_paths.clone(), memory: self.memory, ..Limits::default() }
    }

    /// Loads the scene. `more` holds settings from other options; they override --set.
    fn load(&self, more: &[String]) -> Result<Scene> {
        self.check_sets()?;
        Scene::load(&self.scene, &self.all_sets(more), &self.limits())
    }

    /// Loads the scene's animation. `more` is as in [`SceneOptions::load`].
    fn animation(&self, more: &[String], limits: &Limits) -> Result<Animation> {
        self.check_sets()?;
        Animation::load(&self.scene, &self.all_sets(more), limits)
    }

    /// Refuses a setting written with a space, as in `--set h 1.2`, whose value was taken for the scene.
    fn check_sets(&self) -> Result<()> {
        let scene = self.scene.to_string_lossy();
        if presets().any(|(name, _)| name == scene) || scene == STDIN || self.scene.exists() {
            return Ok(());
        }
        match self.sets.iter().find(|set| !set.contains('=')) {
            Some(set) => Err(Error::Usage(format!("--set {set} has no value; write --set {set}={scene}"))),
            None => Ok(()),
        }
    }

    /// Warns of settings and sweeps that have no effect.
    fn warn_of_settings(&self, values: &Values, sweeps: &[String], terminal: &Terminal) {
        let seed = self.seed.map(|n| format!("volume.seed={n}"));
        let sets: Vec<String> = self.sets.iter().cloned().chain(seed).collect();
        let without = settings_without_effect(values, &sets, sweeps);
        // A map without effect is warned of by the scene itself, wherever it comes from.
        let said_later = |text: &&String| text.starts_with("environment.file ");
        without.iter().filter(|text| !said_later(text)).for_each(|text| terminal.warn(text));
    }

    /// Warns where a picture stands in place of its scene and is asked for another frame than its own.
    fn warn_of_moved(&self, frame: i32, terminal: &Terminal) {
        if frame != 0 && Format::of(&self.scene).is_some() {
            terminal.warn(&format!(
                "{} holds the scene of its own frame, and frame {frame} counts from there; leave the frame \
                 out to get that picture again, or give the scene file for a frame of its animation",
                self.scene.display()
            ));
        }
    }

    fn all_sets(&self, more: &[String]) -> Vec<String> {
        let mut sets: Vec<String> = self.removes.iter().map(|name| format!("{REMOVE}={name}")).collect();
        sets.extend_from_slice(&self.sets);
        sets.extend(self.seed.map(|n| format!("volume.seed={n}")));
        sets.extend_from_slice(more);
        sets
    }
}

/// Options of commands that render.
#[derive(Args, Clone)]
struct CacheOptions {
    /// Rebuilds volumes and meshes instead of reusing those of earlier runs, and stores none for later runs.
    #[arg(long)]
    no_cache: bool,
}

impl CacheOptions {
    fn add_to(&self, limits: Limits) -> Limits {
        let cache = (!self.no_cache).then(Cache::of_user).flatten();
        Limits { cache, ..limits }
    }
}

/// Options of commands that write developed pictures.
#[derive(Args, Clone)]
struct DepthOptions {
    /// Bits per channel of .png and .tif files: 8 or 16. Default: 8 for .png, 16 for .tif. The other formats
    /// of developed pictures always have 8.
    #[arg(long, value_name = "N", value_parser = choice::bits())]
    bits: Option<u8>,
    /// Writes .png and .tif files with 16 bits of linear light, for programs that grade or composite. Needs
    /// --set image.tone=none; light above 1 is cut off, so prefer .exr where you can.
    #[arg(long)]
    linear: bool,
}

impl DepthOptions {
    fn depth(&self) -> Depth {
        Depth { bits: self.bits, linear: self.linear }
    }
}

/// Options of commands that write EXR files.
#[derive(Args, Clone)]
struct ExrOptions {
    /// Stores colours, transmittance and normals of EXR files as half floats: half of the size, three digits.
    /// Depths, numbers and texture coordinates stay floats.
    #[arg(long)]
    half: bool,
    /// Compression of EXR files. All methods are lossless. Default: zip; zips where 16 lines of the picture
    /// take more than 8 MiB.
    #[arg(long, value_parser = choice::compression(), value_name = "METHOD")]
    compression: Option<Compression>,
}

/// Options that choose the layers of EXR files.
#[derive(Args, Clone)]
struct LayerOptions {
    /// Layers of EXR files, separated by commas. Default: all. Example: --layers rgb,depth
    #[arg(long, value_parser = choice::layer(), value_delimiter = ',', value_name = "A,B,…")]
    layers: Option<Vec<Layer>>,
    /// Writes each layer into an EXR file of its own: -o fall.exr gives fall.rgb.exr, fall.depth.exr and so
    /// on.
    #[arg(long)]
    split_layers: bool,
    #[command(flatten)]
    pixels: ExrOptions,
}

impl LayerOptions {
    fn exr(&self) -> Exr {
        let ExrOptions { half, compression } = self.pixels;
        let mut layers = Vec::new();
        for layer in self.layers.as_deref().unwrap_or(&Layer::ALL) {
            // A layer given twice is written once.
            if !layers.contains(layer) {
                layers.push(*layer);
            }
        }
        Exr { half, compression, split: self.split_layers, ..Exr::of(&layers) }
    }

    /// Refuses the options where no EXR is written.
    fn check(&self, has_exr: bool) -> Result<()> {
        let given = [
            ("--layers", self.layers.is_some()),
            ("--half", self.pixels.half),
            ("--compression", self.pixels.compression.is_some()),
            ("--split-layers", self.split_layers),
        ];
        match given.into_iter().find(|(_, given)| *given && !has_exr) {
            Some((option, _)) => Err(Error::Usage(format!("{option} needs an EXR file; add -o FILE.exr"))),
            None => Ok(()),
        }
    }
}

/// Options that choose the engine and its device.
#[derive(Args, Clone)]
struct EngineOptions {
    /// Engine that renders. auto uses a GPU adapter if there is one, otherwise the CPU.
    #[arg(long, value_parser = choice::engine(), default_value = "auto")]
    engine: EngineChoice,
    /// Uses the GPU adapter whose name contains this text, such as `--adapter nvidia`. `taki devices` lists
    /// all.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Longest wait for one piece of GPU work, in seconds. After that, taki exits with code 124.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = wait)]
    watchdog: f64,
}

impl EngineOptions {
    /// Opens the engine. Returns it with a line that tells what it runs on.
    fn open(&self) -> Result<(Engine, String)> {
        self.check()?;
        without_noise(|| Engine::open(self.engine, &self.device()))
    }

    /// Checks that the options fit one another.
    fn check(&self) -> Result<()> {
        if self.engine == EngineChoice::Cpu && self.adapter.is_some() {
            let what = "--adapter chooses a GPU, which --engine cpu does not use; leave out one of them";
            return Err(Error::Usage(what.into()));
        }
        Ok(())
    }

    fn device(&self) -> DeviceOptions {
        DeviceOptions { adapter: self.adapter.clone(), watchdog: Duration::from_secs_f64(self.watchdog) }
    }
}

/// Returns the format of a developed picture, which `option` names.
fn developed(option: &str, path: &Path) -> Result<Format> {
    Format::of(path).filter(|format| format.is_developed()).ok_or_else(|| {
        let what = format!("{option} {}: use .png, .jpg, .tif or .webp", path.display());
        Error::Usage(what)
    })
}

/// Formats the exposure that was measured automatically.
fn measured_words(stops: f32) -> String {
    format!("taki: automatic exposure: {stops:+.2} stops")
}

/// Returns the part of an image of this size that `option` asks for; all of it without the option.
fn window(option: &str, crop: Option<[u32; 4]>, size: [u32; 2]) -> Result<Window> {
    let Some(crop) = crop else { return Ok(Window::whole(size)) };
    let [x, y, width, height] = crop;
    if !Window::fits(size, crop) {
        return Err(Error::Usage(format!(
            "{option} {x},{y},{width},{height} does not lie in the picture; allowed: columns 0 to {}, \
             rows 0 to {}, and at least one of each",
            size[0] - 1,
            size[1] - 1
        )));
    }
    Ok(Window { x, y, width, height })
}

/// The output if -o is not given: the scene's name in the current folder.
fn default_output(scene: &Scene, extension: &str) -> PathBuf {
    // `with_extension` would turn the scene v1.2 into v1.png.
    PathBuf::from(format!("{}.{extension}", scene.name))
}

/// Returns the command line's grammar. A number below 0 is a value, which its parser refuses in plain words;
/// otherwise clap takes it for an option and gives advice that leads to the next refusal.
fn grammar() -> clap::Command {
    // Several numbers, or a number with a unit, are none to clap.
    const SEVERAL: [&str; 4] = ["crop", "memory", "region", "size"];
    fn with_negatives(command: clap::Command) -> clap::Command {
        let option = |arg: clap::Arg| match arg.get_action().takes_values() && !arg.is_positional() {
            true if SEVERAL.contains(&arg.get_id().as_str()) => arg.allow_hyphen_values(true),
            true => arg.allow_negative_numbers(true),
            false => arg,
        };
        command.mut_args(option).mut_subcommands(with_negatives)
    }
    with_negatives(Cli::command())
}

/// Parses the command line.
fn parsed() -> std::result::Result<Cli, clap::Error> {
    let mut grammar = grammar();
    let matches = grammar.try_get_matches_from_mut(std::env::args_os()).map_err(with_tips)?;
    Cli::from_arg_matches(&matches).map_err(|e| e.format(&mut grammar))
}

/// Runs the program and returns its exit code. docs/scenes-and-files.md lists the exit codes.
pub fn main() -> ExitCode {
    let cli = match parsed() {
        Ok(cli) => cli,
        Err(e) => {
            if let Some(scene) = scene_as_command(&e) {
                let what = format!("{scene} is a scene, not a command; to render it: taki render {scene}");
                Terminal::new().error(&Error::Usage(what));
                return ExitCode::from(2);
            }
            // Help and version are not errors and go to stdout.
            let text = e.render().to_string();
            if e.use_stderr() {
                terminal::complain_raw(&text);
            } else if let Err(e) = say(text.trim_end()) {
                terminal::complain(&e);
                return ExitCode::from(e.exit_code());
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
                // The driver's threads are still running. Exit handlers would free memory that they use, and
                // the process would crash. Outputs and temporary files are finished by now, so exit without
                // handlers.
                signal_hook::low_level::exit(e.exit_code().into());
            }
            ExitCode::from(e.exit_code())
        }
    }
}

/// The scene that stands where a command is expected: a preset, or a scene file that exists.
fn scene_as_command(e: &clap::Error) -> Option<String> {
    let Some(ContextValue::String(word)) = e.get(ContextKind::InvalidSubcommand) else { return None };
    // A command's own subcommands have the same error.
    let first = std::env::args_os().nth(1)? == word.as_str();
    let path = Path::new(word);
    let is_file = || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) && path.is_file();
    (first && (presets().any(|(name, _)| name == word) || is_file())).then(|| word.clone())
}

fn run(cli: Cli, terminal: &Terminal) -> Result<()> {
    match cli.command {
        Command::Render(args) => render::run(&args, terminal),
        Command::Batch(args) => batch::run(&args, terminal),
        #[cfg(feature = "viewer")]
        Command::View(args) => view::run(&args, terminal),
        Command::New(args) => new::run(&args, terminal),
        Command::Scene(args) => scene::run(&args, terminal),
        Command::Volume(args) => volume::run(&args, terminal),
        Command::Farm(args) => farm::run(&args, terminal),
        Command::Bench(args) => bench::run(&args, terminal),
        Command::Stitch(args) => stitch::run(&args, terminal),
        Command::Compare(args) => compare::run(&args, terminal),
        Command::Devices => devices::run(),
        Command::Presets => presets().try_for_each(|(name, what)| say(&format!("{name:<12} {what}"))),
        Command::Completions { shell } => {
            let mut bytes = Vec::new();
            clap_complete::generate(shell, &mut grammar(), "taki", &mut bytes);
            say(String::from_utf8_lossy(&bytes).trim_end())
        }
    }
}
