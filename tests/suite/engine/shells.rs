//! Shells on the GPU engine: parity with the CPU engine.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use taki::engine::cpu;
use taki::engine::gpu::GpuRenderer;
use taki::light::{AngleFrame, Light};
use taki::mapping::shell::{Shell, Side, SurfaceMesh};
use taki::picture::Frame;
use taki::place::{MeshShade, Triangles, Vertex};
use taki::scene::Scene;
use taki::util::monitor::Unwatched;
use taki::volume::VolumeTexture;

use super::gpu::{COARSE_PLACE, SURFACE, assert_parity, renderer, scene as preset};
use crate::mapping::shell::{sphere, strip, torus};
use crate::trace::closed_forms::{noise, uniform};
use crate::trace::shell_shadows::walls;
use crate::trace::shells::scene_with;

/// The shell of a mesh. Its texture is moved, so that no edge lies between cells: there rounding decides
/// whether a ray counts one more cell, of length 0.
fn shell(mesh: &SurfaceMesh, side: Side) -> Shell {
    let mut mesh = mesh.clone();
    mesh.uv.iter_mut().for_each(|uv| *uv += Vec2::new(0.1371, 0.0713));
    Shell::new(&mesh, side).expect("a valid mesh")
}

/// A torus with opaque matter under it.
fn furred() -> Shell {
    let mut shell = shell(&torus(14, 9, 0.35), Side::Outward);
    shell.skin = true;
    shell
}

/// Eyes above the torus, and along its surface.
const EYES: [[f64; 3]; 2] = [[0.5, 4.5, 3.0], [0.2, 0.3, 4.4]];

fn both(renderer: &mut GpuRenderer, scene: &Scene, volumes: &[VolumeTexture]) -> [Frame; 2] {
    let mesh = scene.mesh();
    let on_gpu = renderer.render(scene, volumes, &mesh, &SURFACE, &Unwatched).expect("a frame");
    let on_cpu = cpu::render(scene, volumes, &mesh, true, &Unwatched).expect("a frame");
    [on_gpu, on_cpu]
}

/// Asserts parity, and that rays walk cells.
fn agree(renderer: &mut GpuRenderer, what: &str, scene: &Scene, volumes: &[VolumeTexture]) {
    let frames = both(renderer, scene, volumes);
    assert_parity(what, &frames);
    assert!(frames[0].covered_pixels() * 10 > frames[0].counts.len() as u64, "{what}: rays walk no cells");
    let [gpu, cpu] = frames.each_ref().map(Frame::cells_walked);
    for k in 0..2 {
        assert!(gpu[k].abs_diff(cpu[k]) * 500 <= cpu[k], "{what}: {gpu:?} {cpu:?} cells");
    }
}

#[test]
fn the_engines_agree_on_shells_from_above_and_along_their_surface() {
    let Some(mut renderer) = renderer("shells") else { return };
    let volume = noise([6, 8, 5], 4);
    let shells = [
        (furred(), EYES),
        (shell(&sphere(2, 0.4), Side::Outward), [[1.0, 2.0, 2.6], [0.1, 1.45, 3.2]]),
        (shell(&strip(9), Side::Inward), [[0.2, 1.2, 3.4], [-1.0, 0.05, 2.6]]),
    ];
    for (i, (shell, eyes)) in shells.into_iter().enumerate() {
        for (eye, angles) in eyes.into_iter().zip([AngleFrame::World, AngleFrame::Texture]) {
            let mut scene = scene_with(shell.clone(), eye, &[]);
            scene.edit().angles = angles;
            agree(&mut renderer, &format!("shell {i} from {eye:?}"), &scene, std::slice::from_ref(&volume));
        }
    }
}

#[test]
fn no_light_leaks_past_a_skin_where_rays_run_in_the_plane_of_a_face() {
    // View rays of the middle column and the light lie in the plane that parts the two prisms.
    let mesh = SurfaceMesh {
        positions: [[0, -1], [1, 0], [0, 1], [-1, 0]].map(|[x, y]| Vec3::new(x as f32, y as f32, 0.0)).into(),
        uv: [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| Vec2::new(u as f32, v as f32)).into(),
        thickness: vec![0.3; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let volume = uniform([8, 8, 6], Vec3::new(0.6, 0.8, 0.0), 0.5, 0.5, 0.2);
    let mut renderer = renderer("skins");
    for (behind, skin) in [(-1.0, true), (-1.0, false), (1.0, true)] {
        let mut shell = Shell::new(&mesh, Side::Outward).expect("a valid mesh");
        shell.skin = skin;
        let mut scene = scene_with(shell, [0.0, 0.0, 4.0], &["image.width=81", "image.height=81"]);
        let parts = scene.edit();
        parts.ambient = Vec3::ZERO;
        parts.background.zenith = Vec3::ZERO;
        parts.background.horizon = Vec3::ZERO;
        parts.lights = vec![Light::Directional { to_light: Vec3::Z * behind, intensity: Vec3::ONE }];
        let frames = match &mut renderer {
            Some(renderer) => both(renderer, &scene, std::slice::from_ref(&volume)).to_vec(),
            None => vec![cpu::render(&scene, &volume, &scene.mesh(), true, &Unwatched).expect("a frame")],
        };
        for frame in frames {
            let lit = !(skin && behind < 0.0);
            for y in 20..60 {
                let [left, middle, right] = [39, 40, 41].map(|x| frame.radiance[y * 81 + x][0]);
                assert_eq!(left > 0.0, lit, "{behind} {skin}, row {y}: {left}");
                let near = 0.5 * (left + right);
                assert!(
                    (middle - near).abs() <= 0.02 * near,
                    "{behind} {skin}, row {y}: {middle}, beside {near}"
                );
            }
        }
    }
}

#[test]
fn the_engines_agree_on_shells_in_every_variant_of_the_integrate_pass() {
    let Some(mut renderer) = renderer("variants of shells") else { return };
    let volumes = [noise([12, 16, 10], 4)];
    let (strand, pyramid) = ("light.reflection=strand", "trace.filter=pyramid");
    let (trilinear, cached) = ("trace.lookup=trilinear", "light.visibility=cached");
    let hair = "light.reflection=hair";
    let variants: [&[&str]; 18] = [
        &["light.visibility=none"],
        &[hair, "hair.tilt=6"],
        &[hair, trilinear, "light.frame=texture"],
        &[hair, pyramid, cached, "camera.fov=80"],
        &[hair, pyramid, cached, "hair.tilt=0"],
        &[cached],
        &[trilinear],
        &[pyramid],
        &[pyramid, cached, "camera.fov=80"],
        &[pyramid, trilinear, cached],
        &[strand, "strand.aeration=0.3"],
        &[strand, trilinear, "light.frame=texture"],
        &[strand, pyramid, cached],
        &["trace.max_cells=9"],
        &["trace.early_end=0.3"],
        &["light.p=7.5", cached, "trace.layers=1"],
        &["image.alpha=true", "trace.layers=2"],
        &["image.samples=4", cached, "trace.layers=3"],
    ];
    for (i, sets) in variants.into_iter().enumerate() {
        let mut scene = scene_with(furred(), EYES[i % 2], sets);
        agree(&mut renderer, &format!("{sets:?}"), &scene, &volumes);
        scene.edit().lights.truncate(1 - i % 2);
        agree(&mut renderer, &format!("{sets:?}, fewer lights"), &scene, &volumes);
    }
}

#[test]
fn the_engines_agree_where_vertices_are_too_far_from_one_another_to_keep_light() {
    let Some(mut renderer) = renderer("coarse shells") else { return };
    let volumes = [noise([20, 60, 6], 4)];
    let strip = shell(&strip(9), Side::Outward);
    let scene = scene_with(strip, [0.2, 1.2, 3.4], &["light.visibility=cached"]);
    assert_eq!(scene.shells[0].light_layers(volumes[0].size), None);
    agree(&mut renderer, "walked", &scene, &volumes);
    // A shell of either kind in one scene.
    let mut two = scene.clone();
    let mut fine = torus(40, 30, 0.3);
    fine.positions.iter_mut().for_each(|p| *p += Vec3::new(0.4, -0.8, 0.2));
    two.edit().shells.push(Arc::new(shell(&fine, Side::Outward)));
    assert_eq!(two.shells[1].light_layers(volumes[0].size), Some(3));
    agree(&mut renderer, "walked and kept", &two, &volumes);
    // A frame with the same shells takes V from the one before, and one with other lights does not.
    agree(&mut renderer, "kept again", &two, &volumes);
    two.edit().lights[0] = Light::Directional { to_light: Vec3::X, intensity: Vec3::ONE };
    agree(&mut renderer, "another light", &two, &volumes);
}

/// Adds a ring to the scene of `volumes::two` for each of its volumes.
pub fn add_rings(scene: &mut Scene) {
    for number in 0..2 {
        let mut mesh = torus(20, 12, 0.4);
        for p in &mut mesh.positions {
            *p = *p * 0.2 + Vec3::new(0.5 * number as f32 - 0.3, 0.1, 0.35 * number as f32);
        }
        mesh.thickness.fill(0.07);
        let mut own = shell(&mesh, Side::Outward);
        own.volume = number;
        scene.edit().shells.push(Arc::new(own));
    }
}

#[test]
fn the_engines_agree_on_shells_of_two_volumes_among_quads() {
    let Some(mut renderer) = renderer("two volumes in shells") else { return };
    for sets in
        [["light.visibility=march", "image.alpha=false"], ["light.visibility=cached", "image.alpha=true"]]
    {
        let mut scene = super::volumes::two(&sets);
        let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
        add_rings(&mut scene);
        agree(&mut renderer, &format!("{sets:?}"), &scene, &volumes);
    }
}

#[test]
fn the_engines_agree_on_shells_among_rock_and_water() {
    let Some(mut renderer) = renderer("shells in a place") else { return };
    let size = ["image.width=96", "image.height=54", "image.samples=1", "curves.across=12", "curves.deep=12"];
    let mut scene = preset("waterfall", &[&COARSE_PLACE[..], &size].concat());
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    let mut mesh = sphere(2, 0.4);
    let middle = scene.camera.eye_local() + scene.camera.forward * 6.0;
    mesh.positions.iter_mut().for_each(|p| *p = *p * 0.8 + middle.as_vec3());
    scene.edit().shells.push(Arc::new(shell(&mesh, Side::Outward)));
    agree(&mut renderer, "waterfall", &scene, &volumes);
}

#[test]
fn the_engines_agree_where_opaque_triangles_cut_a_shell() {
    let Some(mut renderer) = renderer("opaque ends in shells") else { return };
    let volumes = [noise([6, 8, 5], 4)];
    for eye in EYES {
        let mut scene = scene_with(furred(), eye, &[]);
        // A wall through the middle, across the line of sight.
        let eye = DVec3::from_array(eye);
        let (right, up) = eye.any_orthonormal_pair();
        let corner = |[x, y]: [f64; 2]| {
            let at = eye.normalize() * 0.1 + (right.normalize() * x + up.normalize() * y) * 4.0;
            Vertex {
                position: at.as_vec3().to_array(),
                normal: eye.normalize().as_vec3().to_array(),
                albedo: [0.3, 0.6, 0.5],
                ..Default::default()
            }
        };
        let vertices = [[-1.0, -1.0], [1.0, -1.0], [0.2, 1.0]].map(corner).to_vec();
        scene.edit().triangles = vec![Triangles {
            vertices: Arc::new(vertices),
            holdout: false,
            shade: MeshShade::default(),
            painting: None,
        }];
        agree(&mut renderer, &format!("a wall, from {eye:?}"), &scene, &volumes);
    }
}

#[test]
fn rays_at_edges_and_vertices_go_on_as_on_the_cpu() {
    let Some(mut renderer) = renderer("edges") else { return };
    let volumes = [noise([6, 8, 5], 4)];
    // The pixels in the middle look along edges of the mesh and sides of its prisms, and the very middle at a
    // vertex. What a ray passes is continuous there, although each of its faces will do.
    let odd = ["image.width=49", "image.height=49", "light.visibility=none"];
    let cross = || (0..49).flat_map(|k| [24 * 49 + k, k * 49 + 24]);
    let transmittance = |frame: &Frame| cross().map(|i| frame.radiance[i][3]).collect::<Vec<f32>>();
    for eye in [[4.5, 0.0, 0.0], [0.0, 0.0, 4.5], [-4.5, 0.0, 0.0]] {
        let at = |aside: [f64; 3]| {
            let eye = [0, 1, 2].map(|k| eye[k] + aside[k]);
            let target = format!("camera.target=[{},{},{}]", aside[0], aside[1], aside[2]);
            let sets = [&odd[..], &[&target]].concat();
            scene_with(shell(&torus(16, 8, 0.35), Side::Outward), eye, &sets)
        };
        let [gpu, cpu] = both(&mut renderer, &at([0.0; 3]), &volumes).map(|frame| transmittance(&frame));
        // A ray that passes by the face of its pixel is moved onto it, by a thousandth of the face: 1 m.
        let step = 1e-3;
        let beside = [[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]].map(|[x, y]| {
            let scene = at(if eye[0] == 0.0 { [x, y, 0.0] } else { [0.0, y, x] });
            let frame = cpu::render(&scene, &volumes, &scene.mesh(), false, &Unwatched).expect("a frame");
            transmittance(&frame)
        });
        let wrong = (0..gpu.len()).filter(|&i| {
            let own = beside.iter().map(|all| all[i]).fold([cpu[i]; 2], |[a, b], t| [a.min(t), b.max(t)]);
            gpu[i] < own[0] - 1e-3 || gpu[i] > own[1] + 1e-3
        });
        let wrong: Vec<_> = wrong.map(|i| (i, gpu[i], cpu[i])).collect();
        assert!(wrong.len() <= 1, "{} of 98 rays from {eye:?}: {wrong:?}", wrong.len());
        assert!(cpu.iter().filter(|t| **t < 0.99).count() > 40, "{cpu:?}");
    }
}

#[test]
fn the_engines_agree_on_shadows_of_opaque_matter_on_shells() {
    let Some(mut renderer) = renderer("shadows on shells") else { return };
    let volumes = [noise([12, 16, 10], 4)];
    let (pyramid, cached) = ("trace.filter=pyramid", "light.visibility=cached");
    let variants: [&[&str]; 6] = [
        &[],
        &[cached],
        &[pyramid],
        &[pyramid, cached, "camera.fov=80"],
        &["light.reflection=strand", cached],
        &["trace.lookup=trilinear", "light.frame=texture"],
    ];
    // Half of each shell is hidden from the sun, and a part from the lamp.
    let wall = |at: Vec3| {
        let (u, v) = at.any_orthonormal_pair();
        [at - v * 6.0, at + (u - v) * 6.0, at + (u + v) * 6.0, at + v * 6.0]
    };
    let walls = walls(&[wall(Vec3::new(2.6, 5.2, 1.3)), wall(Vec3::new(-1.6, 2.6, 1.8)).map(|p| p * 0.9)]);
    for (i, sets) in variants.into_iter().enumerate() {
        let mut scene = scene_with(furred(), EYES[i % 2], sets);
        let mut strip = strip(9);
        strip.positions.iter_mut().for_each(|p| *p += Vec3::new(0.4, 0.8, 0.2));
        scene.edit().shells.push(Arc::new(shell(&strip, Side::Inward)));
        let [_, open] = both(&mut renderer, &scene, &volumes);
        scene.edit().triangles = vec![walls.clone()];
        agree(&mut renderer, &format!("{sets:?}"), &scene, &volumes);
        // The light at the vertices is kept, and the shadows with it.
        agree(&mut renderer, &format!("{sets:?} again"), &scene, &volumes);
        let [shaded, _] = both(&mut renderer, &scene, &volumes);
        let darker = shaded.radiance.iter().zip(&open.radiance).filter(|(a, b)| a[0] < 0.9 * b[0]).count();
        assert!(darker > 50, "{sets:?}: {darker} pixels are darker");
        // Without the walls the device has other values, and without skins none.
        scene.edit().triangles.clear();
        agree(&mut renderer, &format!("{sets:?} without walls"), &scene, &volumes);
        let parts = scene.edit();
        parts.shells.iter_mut().for_each(|shell| Arc::make_mut(shell).skin = false);
        agree(&mut renderer, &format!("{sets:?} without casters"), &scene, &volumes);
    }
}
