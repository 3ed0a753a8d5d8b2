//! Every preset gives a picture on every engine, whatever its light and however long its walks.

use std::path::Path;

use glam::Vec3;

use crate::engine::gpu::renderer;
use crate::tolerance::Parity;
use taki::engine::{Engine, RenderOptions, cpu};
use taki::picture::Frame;
use taki::scene::{Limits, Scene, presets};
use taki::util::monitor::Unwatched;

const SETS: [&str; 3] = ["image.width=16", "image.height=9", "image.samples=1"];
/// Lamps of the scene that has many.
const LAMPS: usize = 64;

/// Loads a preset with more text of a scene file.
fn load(preset: &str, text: &str, sets: &[&str], folder: &Path) -> Scene {
    let file = folder.join("scene.toml");
    std::fs::write(&file, format!("version = 1\nbase = \"{preset}\"\n{text}")).expect("written");
    let sets: Vec<String> = SETS.iter().chain(sets).map(|set| set.to_string()).collect();
    Scene::load(&file, &sets, &Limits::default()).expect("a valid scene")
}

/// The middle of the first quad or hull face of a scene, and the axes of its plane.
fn first_face(scene: &Scene) -> (Vec3, [Vec3; 3]) {
    if let Some(map) = scene.quads.first().map(|quad| quad.map) {
        return (map.point_world(0.5, 0.5), [map.e1_world, map.e2_world, map.n_world]);
    }
    let shell = &scene.shells[0];
    let [a, b, c] = shell.corners(&shell.hull[0]);
    let (e1, n) = ((b - a).normalize(), (b - a).cross(c - a).normalize());
    ((a + b + c) / 3.0, [e1, n.cross(e1), n])
}

/// Lamps around the middle of the preset's first face.
fn lamps(preset: &str, folder: &Path) -> String {
    let (middle, _) = first_face(&load(preset, "", &[], folder));
    let lamp = |i: usize| {
        let (turn, height) = (i as f32 * 2.4, i as f32 / LAMPS as f32 - 0.5);
        let at = middle + Vec3::new(turn.cos(), 2.0 * height, turn.sin()) * 2.0;
        format!("[lights.lamp{i}]\nposition = [{}, {}, {}]\nintensity = 0.1\n", at.x, at.y, at.z)
    };
    (0..LAMPS).map(lamp).collect()
}

/// Moves the eye so that it looks at the middle of the first face at one degree to its plane.
fn graze(scene: &mut Scene) {
    let (middle, [e1, e2, n]) = first_face(scene);
    let (sin, cos) = 1f32.to_radians().sin_cos();
    let camera = &mut scene.edit().camera;
    camera.forward = -(e1 * cos + n * sin).as_dvec3();
    camera.right = e2.as_dvec3();
    camera.up = camera.right.cross(camera.forward);
    camera.eye = camera.origin + middle.as_dvec3() - camera.forward * 0.7;
}

/// Asserts that the frame is whole, and that its water has the brightness and the transmittance of `other`.
fn assert_picture(what: &str, frame: &Frame, other: &Frame) {
    let pixels = frame.radiance.len() as f64;
    assert_eq!(frame.non_finite_pixels(), 0, "{what}");
    assert!(frame.covered_pixels() > 0, "{what}: no water");
    let mean = |frame: &Frame, c: usize| frame.radiance.iter().map(|r| f64::from(r[c])).sum::<f64>() / pixels;
    // On small pictures, corners that are snapped coarsely move edges over many of the pixels.
    let share = if Parity::of_adapter().is_coarse() { 0.1 } else { 0.03 };
    for c in 0..4 {
        let (a, b) = (mean(frame, c), mean(other, c));
        assert!((a - b).abs() <= share * b.abs() + 1e-3, "{what}, channel {c}: {a} and {b}");
    }
}

#[test]
fn every_preset_gives_a_picture_under_every_light_and_at_every_length_of_walks() {
    let mut gpu = renderer("every preset").map(Engine::gpu);
    let folder = tempfile::tempdir().expect("a folder");
    let map = folder.path().join("map.hdr");
    let texels = (0..8).flat_map(|i| [100 + 20 * i as u8, 120, 200, 129]).collect::<Vec<u8>>();
    let head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".as_slice();
    std::fs::write(&map, [head, &texels].concat()).expect("written");
    for (preset, _) in presets() {
        let plain = load(preset, "", &[], folder.path());
        let volume = plain.volumes(1 << 30, &Unwatched).expect("volumes");
        let mesh = plain.mesh();
        let (march, most) = ("light.visibility=march", "trace.max_cells=65536");
        let lamps = lamps(preset, folder.path());
        let cases: [(&str, &str, &[&str], bool); 5] = [
            ("sky", "", &["environment.kind=sky", march], false),
            ("map", "[environment]\nkind = \"file\"\nfile = \"map.hdr\"\n", &[], false),
            ("lamps", &lamps, &[march], false),
            ("cells", "", &[most, march], false),
            ("grazing", "", &[most, march], true),
        ];
        for (case, text, sets, grazes) in cases {
            let mut scene = load(preset, text, sets, folder.path());
            if grazes {
                graze(&mut scene);
            }
            let what = format!("{preset}, {case}");
            let on_cpu = cpu::render(&scene, &volume, &mesh, false, &Unwatched).expect("a frame");
            assert_picture(&what, &on_cpu, &on_cpu);
            if let Some(engine) = &mut gpu {
                let options = RenderOptions::default();
                let frame = engine.render_volume(&scene, &volume, &mesh, &options, &Unwatched).expect(&what);
                assert_picture(&what, &frame, &on_cpu);
            }
        }
    }
}
