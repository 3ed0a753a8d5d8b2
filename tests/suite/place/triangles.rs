//! Opaque triangles of other programs' meshes, against rays cut with all of them in float64.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use taki::Unwatched;
use taki::engine::cpu;
use taki::picture::Camera;
use taki::place::{MeshShade, Triangles, Vertex};
use taki::scene::Scene;
use taki::volume::VolumeTexture;

use crate::engine::gpu;
use crate::mapping::shell::sphere;

const SIZE: [u32; 2] = [96, 64];

/// Many triangles in all directions around the origin, more than one tile of them.
fn heap(count: usize, size: f32) -> Vec<Vertex> {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let mut number = || rng.random::<f32>();
    let mut out = Vec::new();
    for _ in 0..count {
        let middle = Vec3::new(number(), number(), number()) * 2.0 - 1.0;
        for _ in 0..3 {
            let corner = middle + (Vec3::new(number(), number(), number()) - 0.5) * size;
            out.push(Vertex {
                position: corner.to_array(),
                normal: (corner - middle).normalize_or(Vec3::Y).to_array(),
                albedo: [number(), number(), number()],
                ..Default::default()
            });
        }
    }
    out
}

fn scene(vertices: Vec<Vertex>) -> Scene {
    let size = [format!("image.width={}", SIZE[0]), format!("image.height={}", SIZE[1])];
    let sets = ["camera.eye=[0.3,1.2,4]", "camera.target=[0,0,0]", "image.samples=1", &size[0], &size[1]];
    let mut scene = Scene::preset("front").expect("a preset").with(&sets).expect("valid settings");
    let parts = scene.edit();
    parts.quads.clear();
    parts.lights.clear();
    parts.ambient = Vec3::new(0.5, 0.8, 1.0);
    parts.background.zenith = Vec3::new(0.0, 0.0, 2.0);
    parts.background.horizon = parts.background.zenith;
    parts.triangles = vec![Triangles {
        vertices: Arc::new(vertices),
        holdout: false,
        shade: MeshShade::default(),
        painting: None,
    }];
    scene
}

fn volumes(scene: &Scene) -> Vec<VolumeTexture> {
    scene.volumes(1 << 30, &Unwatched).expect("volumes")
}

/// The nearest triangle on a ray: its distance, and the albedo there.
fn nearest(vertices: &[Vertex], eye: DVec3, d: DVec3) -> Option<(f64, DVec3)> {
    let mut best: Option<(f64, DVec3)> = None;
    for corners in vertices.as_chunks::<3>().0 {
        let [a, b, c] = corners.map(|v| Vec3::from(v.position).as_dvec3());
        let normal = (b - a).cross(c - a);
        let t = normal.dot(a - eye) / normal.dot(d);
        let p = eye + d * t;
        let weights = [(b, c), (c, a), (a, b)].map(|(q, r)| (q - p).cross(r - p).dot(normal));
        if t > 0.0 && weights.iter().all(|w| *w >= 0.0) && best.is_none_or(|(nearest, _)| t < nearest) {
            let sum: f64 = weights.iter().sum();
            let albedo = (0..3).map(|k| Vec3::from(corners[k].albedo).as_dvec3() * (weights[k] / sum)).sum();
            best = Some((t, albedo));
        }
    }
    best
}

#[test]
fn a_pixel_shows_the_nearest_triangle() {
    let vertices = heap(700, 0.5);
    let scene = scene(vertices.clone());
    let frame = cpu::render(&scene, &volumes(&scene), &scene.mesh(), true, &Unwatched).expect("a frame");
    let [forward, right, up] = scene.camera.rays(SIZE[0], SIZE[1]);
    let (mut wrong, mut hits) = (0, 0);
    for (i, own) in frame.radiance.iter().enumerate() {
        let pixel = [i as u32 % SIZE[0], i as u32 / SIZE[0]];
        let at = Camera::image_point(SIZE[0], SIZE[1], pixel, [0.5; 2]).as_dvec2();
        let d = (forward + right * at.x + up * at.y).normalize();
        let truth = match nearest(&vertices, scene.camera.eye_local(), d) {
            Some((_, albedo)) => {
                hits += 1;
                albedo * scene.ambient.as_dvec3()
            }
            None => DVec3::new(0.0, 0.0, 2.0),
        };
        // Corners snap to 1/256 pixel, which moves a point of a small triangle by some thousandths of it.
        let own = DVec3::new(own[0].into(), own[1].into(), own[2].into());
        wrong += u32::from((own - truth).abs().max_element() > 0.01);
    }
    assert!(hits > 3000, "{hits}");
    assert!(wrong * 100 < hits, "{wrong} of {hits}");
}

#[test]
fn both_engines_draw_the_same_triangles() {
    // Slivers, as in a heap, would turn the rounding of interpolation into whole steps of albedo.
    let mesh = sphere(4, 0.0);
    let vertex = |i: &u32| {
        let position = mesh.positions[*i as usize];
        let wave = |axis: Vec3| 0.5 + 0.4 * (5.0 * position.dot(axis)).sin();
        Vertex {
            position: (position * 1.3).to_array(),
            normal: position.to_array(),
            albedo: [wave(Vec3::X), wave(Vec3::Y), wave(Vec3::Z)],
            ..Default::default()
        }
    };
    let mut scene = scene(mesh.triangles.as_flattened().iter().map(vertex).collect());
    scene.edit().lights = Scene::preset("front").expect("a preset").lights.clone();
    let Some(mut renderer) = gpu::renderer("both_engines_draw_the_same_triangles") else { return };
    gpu::assert_parity("triangles", &gpu::both(&mut renderer, &scene));
}

#[test]
fn a_holdout_of_triangles_is_a_hole() {
    let mut scene = scene(heap(300, 0.7));
    let parts = scene.edit();
    parts.image.alpha = true;
    parts.triangles[0].holdout = true;
    let frame = cpu::render(&scene, &volumes(&scene), &scene.mesh(), false, &Unwatched).expect("a frame");
    assert!(frame.alpha.expect("an alpha channel").iter().all(|a| *a == 0.0));
    assert!(frame.radiance.iter().all(|r| r[..3] == [0.0; 3]));
}
