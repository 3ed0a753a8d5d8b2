//! The strands that rays walk where they see less than a cell: both engines, and what they keep of the cells.

use crate::engine::gpu::{assert_parity, both, renderer, scene};
use glam::Vec3;
use taki::engine::cpu;
use taki::light::Light;
use taki::picture::Frame;
use taki::scene::Scene;
use taki::util::monitor::Unwatched;

/// A view so close that most rays see less than a cell.
const CLOSE: [&str; 6] = [
    "image.width=96",
    "image.height=80",
    "image.samples=1",
    "curves.across=12",
    "curves.deep=12",
    "trace.lookup=strand",
];

fn rendered(scene: &Scene) -> Frame {
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    cpu::render(scene, &volumes, &scene.mesh(), true, &Unwatched).expect("a frame")
}

fn mean(frame: &Frame, of: impl Fn(&[f32; 4]) -> f32) -> f64 {
    frame.radiance.iter().map(|r| f64::from(of(r))).sum::<f64>() / frame.radiance.len() as f64
}

#[test]
fn the_engines_agree_on_strands() {
    let Some(mut renderer) = renderer("strands") else { return };
    let variants: [&[&str]; 8] = [
        &[],
        &["trace.filter=pyramid"],
        &["light.visibility=march"],
        &["light.visibility=cached", "light.scattering=multiple"],
        &["light.reflection=strand", "trace.filter=pyramid", "camera.eye=[0.5,1,-3]"],
        &["trace.attenuation=per-cell", "trace.tau=0.3"],
        &["materials.water.repeat_u=0.6", "volume.flow=0.3", "materials.water.mist=0.1"],
        &["volume.storage=sparse", "trace.max_cells=9"],
    ];
    for variant in variants {
        let sets: Vec<&str> = CLOSE.iter().chain(variant).copied().collect();
        assert_parity(&variant.join(" "), &both(&mut renderer, &scene("front", &sets)));
    }
    let mut several = scene("front", &CLOSE);
    let lights = &mut several.edit().lights;
    lights.push(Light::Directional { to_light: Vec3::new(-0.4, 0.2, 0.9).normalize(), intensity: Vec3::ONE });
    assert_parity("two lights", &both(&mut renderer, &several));
}

#[test]
fn rays_that_see_a_cell_or_more_walk_the_cells() {
    let far = ["image.width=48", "image.height=40", "camera.fov=60", "trace.filter=none"];
    let with = |lookup: &str| {
        let lookup = format!("trace.lookup={lookup}");
        rendered(&scene("front", &far.iter().copied().chain([&*lookup]).collect::<Vec<_>>()))
    };
    let (cells, strands) = (with("nearest"), with("strand"));
    assert_eq!(cells.counts, strands.counts);
    // ρ is the cell's own; the direction is that of one strand in place of the mean.
    for (a, b) in cells.radiance.iter().zip(&strands.radiance) {
        assert_eq!(a[3], b[3]);
    }
    let [a, b] = [&cells, &strands].map(|frame| mean(frame, |r| r[1]));
    assert!((a / b - 1.0).abs() < 0.02, "{a} and {b}");
}
