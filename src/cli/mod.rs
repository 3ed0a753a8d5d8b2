//! The command line. Each subcommand has its own file.

mod batch;
mod bench;
mod choice;
mod compare;
mod devices;
mod farm;
mod grids;
mod new;
mod options;
mod parse;
mod quality;
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

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::output::frame::Format;
use crate::scene::{Scene, presets};
use crate::util::error::{Error, Result};
use crate::util::window::Window;
use options::{CacheOptions, DepthOptions, EngineOptions, ExrOptions, LayerOptions, SceneOptions};
use parse::{crop, frame, samples, seconds, size, whole};
use terminal::{Terminal, say};
use tips::with_tips;

const EXIT_CODES: &str = "Exit codes: 0 success · 1 comparison failed · 2 usage error · 33 out of memory · \
65 bad input · 69 no GPU adapter (with --engine gpu or --adapter), no window or no ffmpeg · \
73 cannot create an output · 74 I/O error · 75 GPU device lost, try again · 101 a bug, please report it · \
124 the GPU did not answer · 129/130/143 interrupted.";

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
