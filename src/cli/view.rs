//! `taki view`: opens the viewer.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::quiet::without_noise;
use super::terminal::{Terminal, say};
use super::{CacheOptions, EngineOptions, SceneOptions, choice, developed, seconds};
use crate::job::check_replaced;
use crate::output::frame::Output;
use crate::util::error::Result;
use crate::viewer::settings::Settings;
use crate::viewer::{self, Options, WindowChoice};

#[derive(Args)]
pub struct ViewArgs {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    cache: CacheOptions,
    #[command(flatten)]
    engine: EngineOptions,
    /// Graphics interface that draws the window. auto uses Vulkan, Metal or Direct3D on a GPU, otherwise
    /// OpenGL.
    #[arg(long, value_parser = choice::window(), default_value = "auto")]
    window: WindowChoice,
    /// Closes the window after this number of seconds.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    exit_after: Option<f64>,
    /// Saves a picture of the window (.png, .jpg, .tif or .webp) before --exit-after closes it.
    #[arg(long, value_name = "FILE", requires = "exit_after")]
    screenshot: Option<PathBuf>,
    /// Replaces an existing file of --screenshot even if it is no picture.
    #[arg(long, requires = "screenshot")]
    overwrite: bool,
    /// Measures how quickly the viewer responds: changes parameters by itself, draws while it renders, then
    /// closes the window and prints the times.
    #[arg(long, conflicts_with = "exit_after")]
    measure: bool,
    /// Destroys the window's GPU device after this number of seconds, as a driver reset does.
    #[arg(long, hide = true, value_name = "SECONDS", value_parser = seconds)]
    lose_window_after: Option<f64>,
    /// Prints how quickly the viewer responded as one JSON object on stdout when the window closes.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &ViewArgs, terminal: &Terminal) -> Result<()> {
    if let Some(path) = &args.screenshot {
        developed("--screenshot", path)?;
        if !args.overwrite {
            check_replaced(path)?;
        }
        // Opening and dropping the output finds a missing folder before the window opens.
        drop(Output::open(path)?);
    }
    args.scene.begin(terminal);
    args.engine.check()?;
    let options = Options {
        scene: args.scene.scene.clone(),
        sets: args.scene.all_sets(&[]),
        limits: args.cache.add_to(args.scene.limits()),
        window: args.window,
        engine: args.engine.engine,
        device: args.engine.device(),
        settings: Settings::place(),
        signal: terminal.signal(),
        exit_after: args.exit_after.map(Duration::from_secs_f64),
        screenshot: args.screenshot.clone(),
        measure: args.measure,
        lose_window_after: args.lose_window_after.map(Duration::from_secs_f64),
    };
    let report = without_noise(|| viewer::run(options))?;
    if args.json || args.measure {
        say(&serde_json::json!(report).to_string())?;
    }
    Ok(())
}
