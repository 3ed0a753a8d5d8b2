//! Renders the frames of a turn around a preset. The volume and the mesh are built only once.
//!
//! `cargo run --release --example orbit [PRESET] [FRAMES]`

use std::path::Path;

use taki::scene::Animation;
use taki::{Engine, EngineChoice, Limits, RenderOptions, Unwatched};

fn main() -> taki::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let preset = arguments.next().unwrap_or("fig5".into());
    let frames: i32 = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(8);

    let sets =
        [format!("animate.frames={frames}"), format!("animate.turn={frames}"), "animate.speed=0".into()];
    let limits = Limits::default();
    let animation = Animation::load(Path::new(&preset), &sets, &limits)?;

    let first = animation.at(0)?;
    let volume = first.volume(limits.memory, &Unwatched)?;
    let mesh = first.mesh();
    let mut engine = Engine::new(EngineChoice::Auto)?;
    let options = RenderOptions::default();
    for number in 0..frames {
        let scene = animation.at(number)?;
        let frame = engine.render_volume(&scene, &volume, &mesh, &options, &Unwatched)?;
        let path = std::env::temp_dir().join(format!("{preset}.{number:04}.png"));
        frame.write_png(&path)?;
        println!("{}", path.display());
    }
    Ok(())
}
