//! Axes of the arrays in volume files: x across the fall, y down it, z into the water. They hold for the
//! place of a cell and for the direction of its flow.

use std::fs::File;

use crate::engine::gpu::renderer;
use glam::Vec3;
use taki::engine::{Engine, RenderOptions};
use taki::scene::{Limits, Scene};
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, ReadOptions, VolumeTexture, WaterSpec, build_water, read_npz, write_npz};
use tempfile::tempdir;

/// A quad of 1 m by 1 m that faces the eye, with its first two corners at the top, under one light.
const SCENE: &str = "version = 1
[materials.water]
[[quads]]
corners = [[-0.5, 0.5, 0], [0.5, 0.5, 0], [0.5, -0.5, 0], [-0.5, -0.5, 0]]
[trace]
sigma = 1e4
[light]
visibility = \"none\"
ambient = [0, 0, 0]
frame = \"world\"
[lights.one]
[camera]
eye = [0, 0, 10]
fov = 5.7248
[image]
width = 16
height = 16
samples = 1
";

/// Renders a volume, which was written and read as a file, with every engine. `light` is the direction to
/// the light, `thickness` that of the water in metres.
fn pictures(volume: &VolumeTexture, thickness: f32, light: [f64; 3]) -> Vec<Vec<[f32; 4]>> {
    let dir = tempdir().unwrap();
    let (scene, npz) = (dir.path().join("s.toml"), dir.path().join("v.npz"));
    write_npz(volume, File::create(&npz).unwrap()).unwrap();
    std::fs::write(&scene, SCENE).unwrap();
    let volume = read_npz(&npz, &ReadOptions::default(), &Unwatched).unwrap();
    let sets = [format!("lights.one.direction={light:?}"), format!("thickness={thickness}")];
    let scene = Scene::load(&scene, &sets, &Limits::default()).unwrap();
    let mut engines = vec![Engine::cpu()];
    engines.extend(renderer("axes").map(Engine::gpu));
    let render = |mut engine: Engine| {
        let options = RenderOptions::default();
        engine.render_volume(&scene, &volume, &scene.mesh(), &options, &Unwatched).unwrap().radiance
    };
    engines.into_iter().map(render).collect()
}

/// A volume in which a cell has density where `rho` says so, by x, y and z, and diffuse light `k_d`.
fn volume(size: [u32; 3], v: Vec3, cell: impl Fn([u32; 3]) -> (f32, f32)) -> VolumeTexture {
    let [nx, ny, nz] = size;
    let places = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
    let cells = places.map(|place| {
        let (rho, k_d) = cell(place);
        if rho > 0.0 { Cell::from_direction(v).with_density(rho, k_d, 0.0) } else { Cell::default() }
    });
    VolumeTexture { size, alpha: 1.0, cells: cells.collect::<Vec<_>>().into() }
}

#[test]
fn cells_lie_across_down_and_into_the_water() {
    let corner = volume([2, 2, 1], Vec3::Y, |place| (f32::from(place == [0, 0, 0]), 1.0));
    for picture in pictures(&corner, 0.01, [0.0, 0.0, 1.0]) {
        for (i, pixel) in picture.iter().enumerate() {
            let is_water = i % 16 < 8 && i / 16 < 8;
            assert_eq!(pixel[3] < 0.5, is_water, "column {}, row {}", i % 16, i / 16);
        }
    }
    // The first layer hides the second, which alone reflects light.
    let bright =
        [1, 0].map(|layer| volume([1, 1, 2], Vec3::Y, |[.., z]| (1.0, f32::from(u8::from(z == layer)))));
    let [hidden, open] = bright.map(|volume| pictures(&volume, 0.01, [0.0, 0.0, 1.0]));
    for (hidden, open) in hidden.iter().zip(&open) {
        assert!(open[0][0] > 0.1 && hidden[0][0] < 0.01 * open[0][0], "{:?} {:?}", hidden[0], open[0]);
    }
}

#[test]
fn directions_point_across_down_and_into_the_water() {
    // Cells are cubes, so that directions in the world are those in the volume. A thread reflects no light
    // that comes along it. Seen from the eye, which looks along −z, down is −y and into the water is −z.
    for (v, along, across) in [
        ([1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ([0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]),
        ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
        ([1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]),
        ([1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0]),
        ([0.0, 1.0, 1.0], [0.0, 1.0, 1.0], [0.0, -1.0, 1.0]),
    ] {
        let volume = volume([1, 1, 1], Vec3::from_array(v).normalize(), |_| (1.0, 1.0));
        for (dark, lit) in pictures(&volume, 1.0, along).iter().zip(&pictures(&volume, 1.0, across)) {
            assert!(lit[0][0] > 0.1 && dark[0][0] < 0.05 * lit[0][0], "{v:?}: {:?} {:?}", dark[0], lit[0]);
        }
    }
}

#[test]
fn built_water_flows_down() {
    let spec = WaterSpec { seed: 3, ..super::spec([16, 32, 16], 12) };
    let volume = build_water(&spec, &Unwatched).unwrap();
    let [across, down, into] = [0, 1, 2].map(|axis| super::mean(&volume, |cell| f64::from(cell.v()[axis])).0);
    assert!(down > 0.5 && across.abs() < 0.1 && into.abs() < 0.1, "{across} {down} {into}");
}
