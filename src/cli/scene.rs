//! `taki scene`: checks a scene and prints it.

use clap::Args;

use super::SceneOptions;
use super::terminal::{Terminal, say};
use crate::util::error::Result;

#[derive(Args)]
pub struct SceneArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// Prints the scene at this frame of its animation, as a scene file without animation that gives the same
    /// picture.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    #[arg(value_parser = clap::value_parser!(i32).range(-999_999_999..=999_999_999))]
    frame: Option<i32>,
    /// Prints JSON, which also has what follows from the parameters: camera basis, lights, rock mesh.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &SceneArgs, terminal: &Terminal) -> Result<()> {
    // Without --frame, the scene is printed together with its animation, so check both.
    let animation = args.scene.animation(&[], &args.scene.limits())?;
    args.scene.warn_of_settings(animation.values(), &[], terminal);
    let scene = match args.frame {
        Some(frame) => animation.at(frame)?,
        None => args.scene.load(&[])?,
    };
    say(&if args.json { scene.to_json().to_string() } else { scene.to_toml() })
}
