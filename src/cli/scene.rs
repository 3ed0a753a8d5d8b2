//! `taki scene`: check and print.

use clap::Args;

use super::SceneOptions;
use super::terminal::say;
use crate::util::error::Result;

#[derive(Args)]
pub struct SceneArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// Prints this frame of its animation: a scene of its own, which gives the same picture.
    #[arg(long, value_name = "N")]
    frame: Option<u32>,
    /// Prints JSON with all that follows from the parameters too: camera basis, lights, rock mesh.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &SceneArgs) -> Result<()> {
    // The animation is checked even where the scene is printed with it.
    let animation = args.scene.animation(&[], &args.scene.limits())?;
    let scene = match args.frame {
        Some(frame) => animation.at(frame)?,
        None => args.scene.load(&[])?,
    };
    say(&if args.json { scene.to_json().to_string() } else { scene.to_toml() });
    Ok(())
}
