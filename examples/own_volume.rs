//! Fills the cells of a volume by hand and renders it on the quad of the preset `front`.
//!
//! The cells hold a rope of two strands that wind around each other along the flow.
//!
//! `cargo run --release --example own_volume`

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use taki::volume::{Cell, VolumeTexture};
use taki::{Engine, EngineChoice, RenderOptions, Scene, Unwatched};

/// Cells along each axis: x across the flow, y down the flow, z into the surface.
const SIZE: u32 = 48;
/// Radius of the rope and of each strand, in cells.
const ROPE: f32 = 9.0;
const STRAND: f32 = 6.0;

/// Flow direction in the cell at `p`: along the axis of the first strand that contains it.
fn rope(p: Vec3) -> Option<Vec3> {
    let turn = TAU * p.y / SIZE as f32;
    let middle = SIZE as f32 / 2.0;
    [0.0, TAU / 2.0].into_iter().find_map(|phase| {
        let (sin, cos) = (turn + phase).sin_cos();
        let axis = Vec2::new(middle + ROPE * cos, middle + ROPE * sin);
        let tangent = Vec3::new(-ROPE * sin * TAU / SIZE as f32, 1.0, ROPE * cos * TAU / SIZE as f32);
        (Vec2::new(p.x, p.z).distance(axis) < STRAND).then(|| tangent.normalize())
    })
}

fn main() -> taki::Result<()> {
    let mut cells = Vec::new();
    for z in 0..SIZE {
        for y in 0..SIZE {
            for x in 0..SIZE {
                let p = Vec3::new(x as f32, y as f32, z as f32) + 0.5;
                cells.push(match rope(p) {
                    // ρ = 1, k_d = 0.6, k_s = 0.4.
                    Some(v) => Cell::from_direction(v).with_density(1.0, 0.6, 0.4),
                    None => Cell::default(),
                });
            }
        }
    }
    let volume = VolumeTexture { size: [SIZE; 3], alpha: 1.0, cells: cells.into() };

    let scene = Scene::preset("front")?.with(&["trace.sigma=40", "light.visibility=march"])?;
    let mut engine = Engine::new(EngineChoice::Auto)?;
    let frame =
        engine.render_volume(&scene, &volume, &scene.mesh(), &RenderOptions::default(), &Unwatched)?;
    let path = std::env::temp_dir().join("own_volume.png");
    frame.write_png(&path)?;
    println!("{}: {} of {} cells hold the rope", path.display(), volume.flow_cells().count(), SIZE.pow(3));
    Ok(())
}
