//! `taki scene`: checks a scene and prints it.

use clap::Args;

use super::SceneOptions;
use super::parse::frame;
use super::terminal::{Terminal, say};
use crate::util::error::Result;

#[derive(Args)]
pub struct SceneArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// Prints the scene at this frame of its animation, as a scene file without animation that gives the same
    /// picture.
    #[arg(long, value_name = "N", value_parser = frame, allow_negative_numbers = true)]
    frame: Option<i32>,
    /// Prints JSON, which also has what follows from the parameters: camera basis, lights, rock mesh.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &SceneArgs, terminal: &Terminal) -> Result<()> {
    // Without --frame, the scene is printed together with its animation, so check both.
    let animation = args.scene.animation(&[], &args.scene.limits())?;
    args.scene.warn_of_settings(animation.values(), &[], terminal);
    args.scene.warn_of_moved(args.frame.unwrap_or(0), terminal);
    let scene = match args.frame {
        Some(frame) => animation.at(frame)?,
        None => args.scene.load(&[])?,
    };
    say(&if args.json { scene.to_json().to_string() } else { scene.to_toml() + &scene.comments() })
}
