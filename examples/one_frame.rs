//! Renders one frame of a preset and writes it as a picture.
//!
//! `cargo run --release --example one_frame [PRESET]`

use taki::{Engine, EngineChoice, RenderOptions, Scene};

fn main() -> taki::Result<()> {
    let preset = std::env::args().nth(1).unwrap_or("fig5".into());
    let scene = Scene::preset(&preset)?;
    let mut engine = Engine::new(EngineChoice::Auto)?; // the GPU if there is one, or else the CPU
    let frame = engine.render(&scene, &RenderOptions::default())?;
    let path = std::env::temp_dir().join(format!("{preset}.png"));
    frame.write_png(&path)?;
    println!("{} on the {} engine", path.display(), engine.word());
    Ok(())
}
