//! Diffuse light in the shells of scenes: what it is made of, and how long it is kept.

use std::sync::Arc;

use glam::Vec3;
use taki::Unwatched;
use taki::light::ramp::Ramp;
use taki::light::scatter::shell::{DIFFUSE_BYTES, diffuse_work_bytes, layer_colors};
use taki::light::{Light, Scattering};
use taki::mapping::shell::Side;
use taki::place::{DiffuseOfShells, opposite};
use taki::scene::Scene;
use taki::volume::{Bricks, Cell, Cells, VolumeTexture};

use super::closed_forms::noise;
use super::shells::{scene, shell};
use crate::mapping::shell::sphere;

fn diffuse(scene: &Scene, volume: &VolumeTexture) -> Option<Arc<DiffuseOfShells>> {
    let mesh = scene.mesh();
    let shadows = scene.shadows_on_shells(&mesh, &Unwatched).expect("nobody stops it");
    let volumes = std::slice::from_ref(volume);
    scene.diffuse_on_shells(volumes, &mesh, shadows.as_ref(), &Unwatched).expect("nobody stops it")
}

fn ball() -> Scene {
    let mut ball = shell(&sphere(3, 0.3), Side::Outward);
    ball.skin = true;
    let mut scene = scene(ball, [0.0, 0.0, 5.0]);
    scene.edit().scattering = Scattering::Multiple;
    scene.edit().lights = vec![Light::Directional { to_light: Vec3::X, intensity: Vec3::ONE }];
    scene
}

#[test]
fn the_lit_side_of_a_ball_is_brighter_than_the_dark_one() {
    let (mut scene, volume) = (ball(), noise([6, 8, 5], 4));
    scene.edit().ambient = Vec3::ZERO;
    let solved = diffuse(&scene, &volume).expect("light scatters many times");
    let own = solved[0].as_ref().expect("in this shell too");
    let shell = &scene.shells[0];
    assert_eq!(own.layers, 3);
    assert_eq!(own.values.len(), shell.vertices() * 4);
    let mut sums = [Vec3::ZERO; 2];
    for (vertex, values) in own.values.chunks(4).enumerate() {
        let side = usize::from(shell.points[2 * vertex].x < 0.0);
        sums[side] += values[0];
    }
    assert!(sums[0].min_element() > 1.2 * sums[1].max_element(), "{sums:?}");
    // Light that scatters once has none of it.
    scene.edit().scattering = Scattering::Single;
    assert!(diffuse(&scene, &volume).is_none());
}

#[test]
fn diffuse_light_is_kept_while_only_the_camera_moves() {
    let (mut scene, volume) = (ball(), noise([6, 8, 5], 4));
    let mesh = scene.mesh();
    let of = |scene: &Scene, volume: &VolumeTexture| {
        let volumes = std::slice::from_ref(volume);
        scene.diffuse_on_shells(volumes, &mesh, None, &Unwatched).expect("nobody stops it").expect("some")
    };
    let first = of(&scene, &volume);
    scene.edit().camera.eye.x += 1.0;
    assert!(Arc::ptr_eq(&first, &of(&scene, &volume)));
    // Whatever else changes makes it anew: lights, ambient light, extinction, reflection, cells.
    scene.edit().lights[0] = scene.lights[0].with_intensity(Vec3::splat(2.0));
    let second = of(&scene, &volume);
    assert_ne!(first, second);
    scene.edit().ambient = Vec3::ONE;
    let third = of(&scene, &volume);
    assert_ne!(second, third);
    scene.edit().trace.attenuation = taki::trace::Attenuation::PathLength { sigma: 1.0 };
    let fourth = of(&scene, &volume);
    assert_ne!(third, fourth);
    assert_ne!(fourth, of(&scene, &noise([6, 8, 5], 5)));
    // A scene of the same run shares it.
    let again = scene.clone();
    assert!(Arc::ptr_eq(&of(&scene, &volume), &of(&again, &volume)));
}

#[test]
fn a_body_is_as_thick_below_its_shell_as_it_is() {
    // A ball of 1 m with a shell of 0.1 m inside; its facets lie up to a hundredth below the sphere.
    let shell = shell(&sphere(4, 0.1), Side::Inward);
    for (vertex, found) in opposite(&shell).into_iter().enumerate() {
        let found = found.expect("a ball is closed");
        assert!((found.distance - 1.8).abs() < 0.02, "{}", found.distance);
        let there: Vec3 = found
            .vertices
            .iter()
            .zip(found.shares.to_array())
            .map(|(&v, s)| shell.points[2 * v as usize] * s)
            .sum();
        assert!(there.distance(-shell.points[2 * vertex]) < 0.03);
    }
    // A shell that is thicker than half of the ball leaves no core.
    let full = super::shells::shell(&sphere(2, 1.5), Side::Inward);
    assert!(opposite(&full).iter().flatten().all(|found| found.distance == 0.0));
}

#[test]
fn colors_of_layers_are_means_over_their_matter() {
    let cell = |rho: f32, place: f32| Cell::from_direction(Vec3::Z).with_density(rho, 0.5, place);
    // Two layers: ink at both ends of the ramp, three times as dense at the first; and nothing.
    let cells = vec![cell(0.75, 0.0), cell(0.25, 1.0), Cell::default(), Cell::default()];
    let ramp = Ramp::new(&[Vec3::X, Vec3::Y], 0.5);
    let mut volume = VolumeTexture { size: [2, 1, 2], alpha: 1.0, cells: cells.clone().into() };
    let dense = layer_colors(&volume, &ramp);
    assert!(dense[0].distance(Vec3::new(0.75, 0.25, 0.0)) < 1e-3 && dense[1] == Vec3::ONE, "{dense:?}");
    volume.cells = Cells::Sparse(Arc::new(Bricks::of(volume.size, &cells)));
    assert_eq!(layer_colors(&volume, &ramp), dense);
    assert_eq!(layer_colors(&volume, &Ramp::new(&[Vec3::Z], 0.5)), [Vec3::Z; 2]);
}

#[test]
fn memory_of_diffuse_light_grows_with_the_layers_up_to_a_limit() {
    assert_eq!(DIFFUSE_BYTES, 12);
    let [few, many, more] = [4, 32, 500].map(diffuse_work_bytes);
    assert!(few < many && many == more);
}
