//! §4 and §5: rays with a known result. `truth` compares the whole trace of a ray with float64.

mod truth;

use std::path::Path;

use crate::tolerance::{CLOSED_FORM_RELATIVE, close};
use glam::{Vec2, Vec3};
use taki::engine::cpu::integrate::{Integrator, RayResult};
use taki::light::{Light, Visibility};
use taki::mapping::{Billow, Material, Quad};
use taki::scene::{Limits, Scene};
use taki::trace::Attenuation;
use taki::volume::{Cell, VolumeTexture};

/// The scene `front` with a single quad, without lights and ambient light. Every cell is walked.
fn scene(corners: [Vec3; 4], material: Material) -> Scene {
    let mut scene = Scene::load(Path::new("front"), &[], &Limits::default()).unwrap();
    scene.edit().quads = vec![Quad::new(corners, material).unwrap()];
    scene.edit().lights.clear();
    scene.edit().ambient = Vec3::ZERO;
    scene.edit().visibility = Visibility::None;
    scene.edit().trace.max_cells = 65536;
    scene.edit().trace.early_end = 0.0;
    scene
}

/// A rectangle of 2 m × 3 m in the plane z = 0, seen from +z.
fn rectangle(material: Material) -> Scene {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    scene([corner(0.0, 0.0), corner(2.0, 0.0), corner(2.0, 3.0), corner(0.0, 3.0)], material)
}

fn material(thickness_m: f32, repeat_u: f32, repeat_v: f32) -> Material {
    Material { thickness_m, repeat_u, repeat_v, volume: 0, billow: Billow::default() }
}

/// A volume with the same cell everywhere.
pub fn uniform(size: [u32; 3], v: Vec3, rho: f32, k_d: f32, k_s: f32) -> VolumeTexture {
    let cell = Cell::from_direction(v).with_density(rho, k_d, k_s);
    VolumeTexture { size, alpha: 1.0, cells: vec![cell; size.iter().product::<u32>() as usize].into() }
}

/// A volume of cells with and without flow, of every density and direction.
pub fn noise(size: [u32; 3], seed: u64) -> VolumeTexture {
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let mut cell = || {
        let mut x = || rng.random::<f32>();
        let v = Vec3::new(x() - 0.5, x() - 0.5, x() - 0.5);
        match x() < 0.3 {
            true => Cell::default(),
            false => Cell::from_direction(v).with_density(1.5 * x() - 0.25, x(), x()),
        }
    };
    let cells: Vec<Cell> = (0..size.iter().product::<u32>()).map(|_| cell()).collect();
    VolumeTexture { size, alpha: 0.8, cells: cells.into() }
}

/// Direction at `degrees` from the normal of `rectangle`, turned by `around` about that normal.
fn slanted(degrees: f64, around: f64) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vec3::new((sin * around.cos()) as f32, (sin * around.sin()) as f32, -cos as f32)
}

fn trace(scene: &Scene, volume: &VolumeTexture, d: Vec3, uv: [f32; 2], behind: Vec3) -> RayResult {
    Integrator::new(scene, volume).trace(0, d, [uv[0], uv[1], 3.0], behind, &mut ())
}

#[test]
fn an_empty_volume_shows_what_is_behind_unchanged() {
    let mut scene = rectangle(material(0.4, 2.0, 3.0));
    scene.edit().ambient = Vec3::ONE;
    scene.edit().lights = vec![Light::Directional { to_light: Vec3::Z, intensity: Vec3::ONE }];
    let behind = Vec3::new(0.1, 0.7, 12.5);
    // One volume has no directions. The other has directions but no density.
    for volume in [uniform([5, 7, 3], Vec3::ZERO, 0.0, 0.0, 0.0), uniform([5, 7, 3], Vec3::Y, 0.0, 1.0, 1.0)]
    {
        for degrees in [0.0, 30.0, 60.0, 85.0] {
            let traced = trace(&scene, &volume, slanted(degrees, 0.7), [0.3, 0.6], behind);
            assert_eq!((traced.radiance, traced.transmittance), (behind, 1.0));
            assert!(traced.cells[0] >= 3 && traced.cells[1] == 0);
        }
    }
}

#[test]
fn a_uniform_medium_transmits_by_the_length_of_the_ray_alone() {
    let (sigma, thickness) = (3.7f32, 0.45f32);
    for (size, repeat_u, repeat_v) in
        [([40, 40, 40], 1.0, 1.0), ([5, 7, 3], 2.5, 1.0), ([16, 64, 48], 0.3, 4.0), ([1, 1, 1], 1.0, 1.0)]
    {
        let mut scene = rectangle(material(thickness, repeat_u, repeat_v));
        scene.edit().trace.attenuation = Attenuation::PathLength { sigma };
        let volume = uniform(size, Vec3::new(0.1, 1.0, 0.2), 0.3, 0.5, 0.5);
        let rho = volume.cells[0].rho() as f64;
        for degrees in (0..=80).step_by(4).chain([82, 84, 85]) {
            for around in 0..7 {
                let d = slanted(degrees as f64, 0.1 + around as f64);
                let cos = (-d.z as f64) / d.as_dvec3().length();
                let want = (-(sigma as f64) * rho * thickness as f64 / cos).exp();
                let traced = trace(&scene, &volume, d, [0.21, 0.83], Vec3::ONE);
                let got = traced.transmittance as f64;
                assert!(
                    close(got, want, CLOSED_FORM_RELATIVE, 0.0),
                    "{size:?} at {degrees}°: {got}, not {want}"
                );
                // Without light, only the background is seen.
                assert_eq!(traced.radiance, Vec3::splat(traced.transmittance));
            }
        }
    }
}

#[test]
fn transmittance_does_not_depend_on_where_the_volume_is_seen_from() {
    let mut scene = rectangle(material(0.45, 1.0, 1.0));
    scene.edit().trace.attenuation = Attenuation::PathLength { sigma: 3.7 };
    let volume = uniform([8, 8, 8], Vec3::Y, 1.0, 0.5, 0.5);
    for degrees in [0.0, 40.0, 80.0] {
        let d = slanted(degrees, 1.3);
        let front = trace(&scene, &volume, d, [0.4, 0.4], Vec3::ONE).transmittance as f64;
        let back = trace(&scene, &volume, Vec3::new(d.x, d.y, -d.z), [0.4, 0.4], Vec3::ONE).transmittance;
        assert!(close(front, back as f64, CLOSED_FORM_RELATIVE, 0.0));
    }
}

#[test]
fn per_cell_attenuation_counts_cells_and_not_metres() {
    let tau = 0.13f32;
    let mut scene = rectangle(material(5.0, 1.0, 1.0));
    scene.edit().trace.attenuation = Attenuation::PerCell { tau };
    let volume = uniform([6, 6, 9], Vec3::Y, 1.0, 0.5, 0.5);
    for degrees in [0.0, 20.0, 55.0] {
        let traced = trace(&scene, &volume, slanted(degrees, 0.3), [0.413, 0.377], Vec3::ONE);
        let want = (-(tau as f64) * traced.cells[0] as f64).exp();
        assert!(close(traced.transmittance as f64, want, CLOSED_FORM_RELATIVE, 0.0));
        assert!(traced.cells[0] >= 9 && (degrees > 0.0 || traced.cells[0] == 9));
    }
}

#[test]
fn weights_and_end_transmittance_sum_to_one_on_every_ray() {
    for (i, attenuation) in
        [Attenuation::PathLength { sigma: 9.0 }, Attenuation::PerCell { tau: 0.4 }].into_iter().enumerate()
    {
        let mut scene = rectangle(material(0.4, 1.5, 2.0));
        scene.edit().trace.attenuation = attenuation;
        for seed in 0..200 {
            // The fibres lie along the flow and the light across them, so Ψ is k_d = 1 in every cell. The
            // light then adds up the bare weights one by one.
            let mut volume = noise([5, 7, 9], seed);
            volume.cells.change(|_, _, cell| match cell.has_direction() {
                true => Cell::from_direction(Vec3::Y).with_density(cell.rho(), 1.0, 0.0),
                false => Cell::default(),
            });
            let d = slanted(seed as f64 * 0.4, seed as f64);
            let uv = [0.37, 0.005 * seed as f32];
            scene.edit().ambient = Vec3::ZERO;
            scene.edit().lights = vec![Light::Directional { to_light: Vec3::Z, intensity: Vec3::ONE }];
            let lit = trace(&scene, &volume, d, uv, Vec3::ZERO);
            let sum = lit.radiance.x as f64 + lit.transmittance as f64;
            assert!(close(sum, 1.0, 2e-6, 0.0), "{i}, seed {seed}: the weights and T sum to {sum}");
            // Ambient light alone has the same weights.
            scene.edit().lights.clear();
            scene.edit().ambient = Vec3::ONE;
            let ambient = trace(&scene, &volume, d, uv, Vec3::ZERO);
            assert_eq!(ambient.transmittance, lit.transmittance);
            assert!(close(ambient.radiance.x as f64, 1.0 - lit.transmittance as f64, 1e-6, 1e-7));
            assert!(lit.transmittance < 0.9, "the ray meets water");
        }
    }
}

#[test]
fn light_reaches_a_uniform_slab_by_the_depth_of_each_cells_centre() {
    // The light comes along the normal, with the fibres across it: the sum has a closed form.
    let (sigma, thickness, nz) = (4.0f64, 0.5f64, 20);
    let mut scene = rectangle(material(thickness as f32, 1.0, 1.0));
    scene.edit().trace.attenuation = Attenuation::PathLength { sigma: sigma as f32 };
    scene.edit().visibility = Visibility::March;
    scene.edit().lights = vec![Light::Directional { to_light: Vec3::Z, intensity: Vec3::new(2.0, 1.0, 0.5) }];
    let volume = uniform([4, 4, nz], Vec3::Y, 1.0, 1.0, 0.0);
    let layer = sigma * thickness / nz as f64;
    for degrees in [0.0, 35.0, 70.0] {
        let d = slanted(degrees, 0.9);
        let cos = -d.z as f64 / d.as_dvec3().length();
        let passed = |layers: f64| (-layer * layers / cos).exp();
        let want: f64 = (0..nz)
            .map(|k| k as f64)
            .map(|k| (passed(k) - passed(k + 1.0)) * (-layer * (k + 0.5)).exp())
            .sum();
        let traced = trace(&scene, &volume, d, [0.5, 0.5], Vec3::ZERO);
        for (got, intensity) in traced.radiance.to_array().into_iter().zip([2.0, 1.0, 0.5]) {
            assert!(close(got as f64, want * intensity, CLOSED_FORM_RELATIVE, 0.0), "{got} at {degrees}°");
        }
    }
}

#[test]
fn max_cells_ends_a_ray_and_a_light_ray() {
    let mut scene = rectangle(material(1.0, 1.0, 1.0));
    scene.edit().trace.attenuation = Attenuation::PerCell { tau: 0.2 };
    let volume = uniform([4, 4, 30], Vec3::Y, 1.0, 1.0, 0.0);
    for most in [1, 3, 29, 30, 31, 1000] {
        scene.edit().trace.max_cells = most;
        let traced = trace(&scene, &volume, Vec3::NEG_Z, [0.4, 0.4], Vec3::ONE);
        assert_eq!(traced.cells[0], most.min(30));
        let want = (-0.2f32 as f64 * most.min(30) as f64).exp();
        assert!(close(traced.transmittance as f64, want, CLOSED_FORM_RELATIVE, 0.0));
    }
    scene.edit().trace.max_cells = 3;
    scene.edit().visibility = Visibility::March;
    scene.edit().lights = vec![Light::Directional { to_light: Vec3::NEG_Z, intensity: Vec3::ONE }];
    // The light comes from behind the slab, so each of the three cells looks through three cells.
    assert_eq!(trace(&scene, &volume, Vec3::NEG_Z, [0.4, 0.4], Vec3::ONE).cells, [3, 9]);
}

#[test]
fn early_end_stops_a_dark_ray_and_zero_turns_it_off() {
    let mut scene = rectangle(material(1.0, 1.0, 1.0));
    scene.edit().trace.attenuation = Attenuation::PerCell { tau: 0.5 };
    let volume = uniform([4, 4, 100], Vec3::Y, 1.0, 1.0, 0.0);
    let walk = |early_end: f32| {
        let mut scene = scene.clone();
        scene.edit().trace.early_end = early_end;
        trace(&scene, &volume, Vec3::NEG_Z, [0.4, 0.4], Vec3::ONE)
    };
    let whole = walk(0.0);
    assert_eq!(whole.cells[0], 100);
    assert!(close(whole.transmittance as f64, (-50.0f64).exp(), 2.0 * CLOSED_FORM_RELATIVE, 0.0));
    // e^(−n/2) falls below 0.01 after ten cells and below 0.5 after two.
    for (early_end, cells) in [(0.01, 10), (0.5, 2), (1.0, 1)] {
        let ended = walk(early_end);
        assert_eq!(ended.cells[0], cells);
        assert!(ended.transmittance < early_end);
    }
}

#[test]
fn the_frame_of_a_quads_corner_is_as_good_as_its_middle() {
    let corners =
        [Vec3::ZERO, Vec3::new(2.0, 0.0, 0.3), Vec3::new(1.7, 2.0, 0.255), Vec3::new(0.2, 1.5, 0.03)];
    let mut scene = scene(corners, material(0.4, 2.0, 2.0));
    scene.edit().trace.attenuation = Attenuation::PathLength { sigma: 2.0 };
    let volume = uniform([5, 7, 3], Vec3::Y, 1.0, 1.0, 0.0);
    let d = Vec3::new(0.3, -0.2, -1.0).normalize();
    let cos = -(d.dot(scene.quads[0].map.n_world)) as f64;
    let want = (-2.0 * 0.4f32 as f64 / cos).exp();
    for uv in [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE, Vec2::splat(0.5)] {
        let got = trace(&scene, &volume, d, uv.to_array(), Vec3::ONE).transmittance as f64;
        assert!(close(got, want, CLOSED_FORM_RELATIVE, 0.0), "at {uv}: {got}, not {want}");
    }
}
