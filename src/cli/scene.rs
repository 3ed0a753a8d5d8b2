//! `taki scene`: check and print.

use clap::Args;

use super::SceneOptions;
use super::terminal::say;
use crate::error::Result;

#[derive(Args)]
pub struct SceneArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// Prints JSON with all that follows from the parameters too: camera basis, lights, rock mesh.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &SceneArgs) -> Result<()> {
    let scene = args.scene.load(&[])?;
    say(&if args.json { scene.to_json().to_string() } else { scene.to_toml() });
    Ok(())
}
