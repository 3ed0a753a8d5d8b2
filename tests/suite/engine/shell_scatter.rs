//! Light that scatters many times in shells: closed forms, and both engines beside one another.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use taki::engine::cpu;
use taki::light::scatter::optics::{ShellOptics, Surface};
use taki::light::{Light, Visibility};
use taki::mapping::shell::{Shell, Side, SurfaceMesh};
use taki::picture::Frame;
use taki::scene::Scene;
use taki::util::monitor::Unwatched;
use taki::volume::VolumeTexture;

use super::gpu::{SURFACE, assert_parity, renderer};
use crate::mapping::shell::{strip, torus};
use crate::trace::closed_forms::{noise, uniform};
use crate::trace::shells::scene_with;

const A: Vec3 = Vec3::new(0.5, 1.0, 1.6);

/// Optics of a medium that absorbs nothing.
fn white(surface: Option<Surface>) -> ShellOptics {
    ShellOptics { extinction: A, albedo: Vec3::ONE, isotropic: Vec3::ZERO, g: 0.0, surface }
}

/// Optics of skin.
pub fn skin() -> ShellOptics {
    let surface = Some(Surface { eta: 1.4, roughness: 0.35 });
    ShellOptics { extinction: A, albedo: Vec3::new(0.97, 0.8, 0.7), isotropic: Vec3::ZERO, g: 0.0, surface }
}

/// A square of 2 m with its middle in the origin, seen from +z.
fn square() -> Shell {
    const N: u32 = 8;
    let mut mesh = SurfaceMesh::default();
    for i in 0..=N {
        for j in 0..=N {
            let at = Vec2::new(i as f32, j as f32) / N as f32;
            mesh.positions.push((2.0 * at - 1.0).extend(0.0));
            mesh.uv.push(2.0 * at + 0.013);
            mesh.thickness.push(0.3);
        }
    }
    for i in 0..N {
        for j in 0..N {
            let at = |i: u32, j: u32| i * (N + 1) + j;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Shell::new(&mesh, Side::Outward).expect("a valid mesh")
}

fn scene_of(shell: Shell, eye: [f64; 3], sets: &[&str], optics: ShellOptics) -> Scene {
    let mut scene = scene_with(shell, eye, sets);
    scene.edit().recipes[0].skin = Some(optics);
    scene
}

fn on_cpu(scene: &Scene, volumes: &[VolumeTexture]) -> Frame {
    cpu::render(scene, volumes, &scene.mesh(), true, &Unwatched).expect("a frame")
}

/// Frames of both engines, or that of the CPU engine alone.
fn frames(what: &str, scene: &Scene, volumes: &[VolumeTexture]) -> Vec<Frame> {
    let mut frames = vec![on_cpu(scene, volumes)];
    if let Some(mut renderer) = renderer(what) {
        let mesh = scene.mesh();
        frames.push(renderer.render(scene, volumes, &mesh, &SURFACE, &Unwatched).expect("a frame"));
    }
    frames
}

#[test]
fn a_white_medium_under_an_even_sky_is_as_bright_as_the_sky() {
    // Without absorption J is the sky's radiance everywhere, so a ray sees (1 − T^a) of it by colour.
    let volume = uniform([8, 8, 6], Vec3::new(0.6, 0.8, 0.0), 0.5, 0.5, 0.2);
    for (i, eye) in [[0.0, 0.0, 4.0], [2.2, 1.5, 2.5], [0.3, -0.4, -4.0]].into_iter().enumerate() {
        let filter = ["trace.filter=none", "trace.filter=pyramid"][i % 2];
        let mut scene = scene_of(square(), eye, &[filter], white(None));
        scene.edit().lights.clear();
        for frame in frames("white shells", &scene, std::slice::from_ref(&volume)) {
            let mut compared = 0;
            for own in frame.radiance.iter().filter(|own| own[3] < 0.9) {
                for c in 0..3 {
                    let shown = scene.background.zenith[c] * own[3];
                    let truth = scene.ambient[c] * (1.0 - own[3].powf(A[c])) + shown;
                    assert!((own[c] - truth).abs() < 2e-3 * truth, "{eye:?}, {c}: {own:?}, not {truth}");
                }
                compared += 1;
            }
            assert!(compared > 200, "{eye:?}: {compared}");
        }
    }
}

#[test]
fn nothing_is_lost_behind_the_end_of_a_ray() {
    // In the red the medium has half the walk's extinction, and much of its light comes from behind.
    let volume = uniform([8, 8, 6], Vec3::new(0.6, 0.8, 0.0), 1.0, 0.5, 0.2);
    let mut scene = scene_of(square(), [0.0, 0.0, 4.0], &["trace.early_end=0.1"], white(None));
    let parts = scene.edit();
    parts.lights.clear();
    parts.trace.attenuation = taki::trace::Attenuation::PathLength { sigma: 40.0 };
    for frame in frames("ended rays", &scene, std::slice::from_ref(&volume)) {
        let middle = frame.radiance[24 * 72 + 36];
        assert!(middle[3] < 0.1 && middle[3] > 1e-3, "{middle:?}");
        for c in 0..3 {
            let truth = scene.ambient[c] + scene.background.zenith[c] * middle[3];
            assert!((middle[c] - truth).abs() < 5e-3 * truth, "{c}: {middle:?}, not {truth}");
        }
    }
}

#[test]
fn black_matter_without_a_step_of_the_index_only_hides_what_is_behind() {
    let volume = noise([8, 8, 6], 3);
    let surface = Some(Surface { eta: 1.0, roughness: 0.4 });
    let optics = ShellOptics { albedo: Vec3::ZERO, ..white(surface) };
    let scene = scene_of(square(), [1.2, 0.5, 3.0], &[], optics);
    for frame in frames("black matter", &scene, std::slice::from_ref(&volume)) {
        for own in &frame.radiance {
            let truth = scene.background.zenith * own[3];
            assert!((Vec3::from_slice(own) - truth).abs().max_element() < 1e-5, "{own:?}, not {truth}");
        }
        assert!(frame.radiance.iter().filter(|own| own[3] < 0.9).count() > 200);
    }
}

#[test]
fn the_surface_shines_where_it_mirrors_a_light() {
    // Flat cells whose normals are those of the square: the highlight lies halfway between eye and light.
    let volume = uniform([8, 8, 6], Vec3::NEG_Z, 1.0, 0.5, 0.2);
    let black = ShellOptics { albedo: Vec3::ZERO, ..skin() };
    let mut scene = scene_of(square(), [0.0, 0.0, 4.0], &["light.visibility=none"], black);
    let parts = scene.edit();
    parts.ambient = Vec3::ZERO;
    parts.trace.attenuation = taki::trace::Attenuation::PathLength { sigma: 400.0 };
    parts.lights = vec![Light::Directional { to_light: Vec3::Z, intensity: Vec3::splat(2.0) }];
    for frame in frames("a highlight", &scene, std::slice::from_ref(&volume)) {
        // Head on, π·f is F·(α²/α⁴)/4.
        let surface = black.surface.expect("a surface");
        let truth = 2.0 * surface.fresnel(1.0) / (4.0 * surface.roughness.powi(2));
        let [middle, side] = [36, 54].map(|x| frame.radiance[24 * 72 + x][1]);
        assert!((middle - truth).abs() < 0.02 * truth, "{middle}, not {truth}");
        assert!(side < 0.8 * middle, "{side} beside {middle}");
    }
    // From behind it shows nothing.
    scene.edit().lights = vec![Light::Directional { to_light: Vec3::NEG_Z, intensity: Vec3::ONE }];
    let dark = on_cpu(&scene, std::slice::from_ref(&volume));
    assert!(dark.radiance[24 * 72 + 36][1] < 1e-4);
}

#[test]
fn fibres_that_scatter_many_times_are_brighter_in_the_shade() {
    let volume = noise([8, 8, 6], 3);
    let of = |sets: &[&str]| {
        let mut scene = scene_with(square(), [0.0, 0.5, 4.0], sets);
        let parts = scene.edit();
        parts.ambient = Vec3::ZERO;
        parts.trace.attenuation = taki::trace::Attenuation::PathLength { sigma: 30.0 };
        parts.lights =
            vec![Light::Directional { to_light: Vec3::new(0.9, 0.1, 0.2).normalize(), intensity: Vec3::ONE }];
        on_cpu(&scene, std::slice::from_ref(&volume)).radiance
    };
    let mean = |pixels: Vec<[f32; 4]>| pixels.iter().filter(|p| p[3] < 0.5).map(|p| p[0]).sum::<f32>();
    let [once, many] = [&[][..], &["light.scattering=multiple"]].map(|sets| mean(of(sets)));
    assert!(many > 1.05 * once, "{many} {once}");
}

#[test]
fn the_engines_agree_where_light_scatters_many_times() {
    let Some(mut renderer) = renderer("shells that scatter") else { return };
    let volumes = [noise([12, 16, 10], 4)];
    let (multiple, cached) = ("light.scattering=multiple", "light.visibility=cached");
    let (pyramid, trilinear) = ("trace.filter=pyramid", "trace.lookup=trilinear");
    let hair = "light.reflection=hair";
    let variants: [&[&str]; 9] = [
        &[multiple],
        &[multiple, pyramid, cached, "camera.fov=80"],
        &[multiple, hair, pyramid, cached],
        &[multiple, trilinear, "light.frame=texture", "light.p=7.5"],
        &[multiple, "trace.early_end=0.2", "image.samples=2"],
        &["trace.early_end=0.2"],
        &[],
        &[pyramid, cached, "camera.fov=80"],
        &[trilinear, "light.visibility=none"],
    ];
    for (i, sets) in variants.into_iter().enumerate() {
        let eye = [[0.5, 4.5, 3.0], [0.2, 0.3, 4.4]][i % 2];
        let mut shell = torus(14, 9, 0.35);
        shell.uv.iter_mut().for_each(|uv| *uv += Vec2::new(0.1371, 0.0713));
        let mut shell = Shell::new(&shell, Side::Outward).expect("a valid mesh");
        shell.skin = true;
        let mut scene = scene_with(shell, eye, sets);
        if !sets.contains(&multiple) {
            scene.edit().recipes[0].skin = Some(skin());
        }
        for lights in [2, 1, 0] {
            scene.edit().lights.truncate(lights);
            let mesh = scene.mesh();
            let on_gpu = renderer.render(&scene, &volumes, &mesh, &SURFACE, &Unwatched).expect("a frame");
            assert_parity(&format!("{sets:?}, {lights} lights"), &[on_gpu, on_cpu(&scene, &volumes)]);
        }
    }
}

#[test]
fn the_engines_agree_on_skin_beside_fur_and_beside_cells_that_scatter_once() {
    let Some(mut renderer) = renderer("skin beside fur") else { return };
    let volumes = [noise([12, 16, 10], 4), noise([9, 8, 7], 5)];
    for sets in [&["light.scattering=multiple"][..], &["light.visibility=cached"]] {
        // No edge of the texture lies between cells; there rounding decides.
        let moved = |mut mesh: SurfaceMesh| {
            mesh.uv.iter_mut().for_each(|uv| *uv += Vec2::new(0.1371, 0.0713));
            mesh
        };
        let ring = moved(torus(14, 9, 0.35));
        let mut scene =
            scene_of(Shell::new(&ring, Side::Outward).expect("valid"), [0.5, 4.5, 3.0], sets, skin());
        let parts = scene.edit();
        let recipe = parts.recipes[0].clone();
        parts.recipes.push(taki::scene::Recipe { skin: None, ..recipe });
        let mut bent = Shell::new(&moved(strip(9)), Side::Inward).expect("valid");
        bent.volume = 1;
        parts.shells.push(Arc::new(bent));
        assert_eq!(scene.visibility == Visibility::Cached, sets[0].ends_with("cached"));
        let mesh = scene.mesh();
        let on_gpu = renderer.render(&scene, &volumes, &mesh, &SURFACE, &Unwatched).expect("a frame");
        assert_parity(&format!("{sets:?}"), &[on_gpu, on_cpu(&scene, &volumes)]);
    }
}
