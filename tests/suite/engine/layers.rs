//! Several sheets under one pixel, against closed forms and a float64 reference. The reference intersects
//! every quad with the ray, sorts the hits and composites them. `engines` tests what both engines must do
//! alike.

mod engines;

use super::gpu::scene as preset;
use crate::tolerance::{CLOSED_FORM_RELATIVE, close};
use glam::{DVec3, Vec3};
use rand::{RngExt, SeedableRng};
use taki::engine::cpu;
use taki::engine::cpu::gbuffer::{self, map_quad};
use taki::engine::cpu::integrate::{Integrator, RayResult};
use taki::engine::cpu::ray::inspect;
use taki::engine::overlap;
use taki::light::Light;
use taki::mapping::{Material, PlaneView, Quad};
use taki::picture::camera::sample_offset;
use taki::picture::{Camera, Frame, Image};
use taki::place::{Mesh, Vertex};
use taki::scene::Scene;
use taki::trace::Attenuation;
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, VolumeTexture};

/// Absolute tolerance of a composited pixel. A weight T − T′ is rounded to 2^-24. The reference traces each
/// sheet alone, so its rounding is relative to 1; behind other sheets the rounding is relative to the light
/// that they let through. Some 200 cells of Ψ·I ≤ 1 give 200 · 6e-8 = 1.2e-5 if all round the same way.
const COMPOSITE_ABSOLUTE: f64 = 1.2e-5;
/// Distance in metres from an edge, or between two faces, within which float32 and the raster's grid of 1/256
/// pixel may give another result. A pixel of these scenes is about 0.03 m wide.
const DOUBT_M: f64 = 1e-3;

fn quad(corners: [Vec3; 4], thickness_m: f32) -> Quad {
    let material =
        Material { thickness_m, repeat_u: 1.0, repeat_v: 1.0, volume: 0, billow: Default::default() };
    Quad::new(corners, material).expect("a quad")
}

/// An upright rectangle at `z`, from the corner `low` to the corner `high`.
fn upright(low: [f32; 2], high: [f32; 2], z: f32) -> Quad {
    let corner = |x, y| Vec3::new(x, y, z);
    let ([x0, y0], [x1, y1]) = (low, high);
    quad([corner(x0, y0), corner(x1, y0), corner(x1, y1), corner(x0, y1)], 0.2)
}

/// A scene of quads in front of the camera at z = 3.5, with a sun, a lamp and ambient light. Rays do not end
/// early.
fn sheets(quads: Vec<Quad>) -> Scene {
    let sets = ["image.width=64", "image.height=48", "volume.nx=12", "volume.ny=10", "volume.nz=8"];
    let mut scene = preset("front", &sets);
    scene.edit().quads = quads;
    scene.edit().trace.layers = 16;
    scene.edit().trace.attenuation = Attenuation::PathLength { sigma: 4.0 };
    let position = Vec3::new(0.5, 0.8, 1.5);
    scene.edit().lights.push(Light::Point { position, intensity: Vec3::splat(0.7) });
    scene.edit().background.zenith = Vec3::new(0.2, 0.5, 0.9);
    scene.edit().background.horizon = Vec3::new(0.9, 0.7, 0.3);
    scene
}

/// Sheets with random positions and orientations, one over another.
fn heap(count: usize, seed: u64) -> Scene {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let quads = (0..count).map(|i| {
        let mut x = |most: f32| (2.0 * rng.random::<f32>() - 1.0) * most;
        let middle = Vec3::new(x(0.4), x(0.3), x(1.0));
        let across = Vec3::new(0.5 + x(0.1), x(0.2), x(0.5));
        let down = Vec3::new(x(0.2), 0.4 + x(0.1), x(0.4));
        let shear = 1.0 + x(0.3);
        let corners = [
            middle - across - down,
            middle + across - down,
            middle + across * shear + down,
            middle - across + down,
        ];
        quad(corners, 0.1 + 0.05 * i as f32)
    });
    sheets(quads.collect())
}

/// Two sheets that cross in the line x = 0, z = 0. The first is nearer on the right.
pub fn crossing() -> Scene {
    let plane = |slope: f32| {
        let corner = |x: f32, y: f32| Vec3::new(x, y, slope * x);
        quad([corner(-0.7, -0.6), corner(0.7, -0.6), corner(0.7, 0.6), corner(-0.7, 0.6)], 0.3)
    };
    sheets(vec![plane(0.5), plane(-0.5)])
}

/// A strip with the profile of a Z: folded over itself twice.
fn folded() -> Scene {
    let at = |x: f32, z: f32| [Vec3::new(x, -0.5, z), Vec3::new(x, 0.5, z)];
    let fold = [at(-0.6, 0.0), at(0.6, 0.3), at(-0.6, 0.6), at(0.5, 0.9)];
    sheets(fold.windows(2).map(|s| quad([s[0][0], s[1][0], s[1][1], s[0][1]], 0.15)).collect())
}

/// A rock: one rectangle at `z`.
fn rock([x0, y0]: [f32; 2], [x1, y1]: [f32; 2], z: f32) -> Mesh {
    let corner = |x, y| Vertex {
        position: [x, y, z],
        normal: [0.0, 0.0, 1.0],
        albedo: [0.4, 0.3, 0.2],
        ..Vertex::default()
    };
    Mesh::new(vec![corner(x0, y0), corner(x1, y0), corner(x0, y1), corner(x1, y1)], [(1, false)])
}

pub fn no_rock() -> Mesh {
    Mesh::default()
}

fn curves(scene: &Scene) -> VolumeTexture {
    scene.volume(1 << 30, &Unwatched).expect("a volume")
}

/// A volume with the same cell everywhere.
fn uniform() -> VolumeTexture {
    let cell = Cell::from_direction(Vec3::Y).with_density(0.6, 0.5, 0.5);
    VolumeTexture { size: [3, 4, 5], alpha: 1.0, cells: vec![cell; 60].into() }
}

fn on_cpu(scene: &Scene, volume: &VolumeTexture, mesh: &Mesh) -> Frame {
    cpu::render(scene, volume, mesh, true, &Unwatched).expect("a frame")
}

fn view_ray(scene: &Scene, i: usize) -> Vec3 {
    let image = &scene.image;
    let pixel = [i as u32 % image.width, i as u32 / image.width];
    scene.camera.view_ray(image.width, image.height, pixel, sample_offset(image, 0))
}

/// Distances in metres and numbers of the quads that the ray of pixel i meets, sorted by distance. Returns
/// `None` if an edge or another face is too close to decide.
fn met(scene: &Scene, i: usize, opaque_m: f32) -> Option<Vec<(f64, usize)>> {
    let (eye, d) = (scene.camera.eye_local(), view_ray(scene, i).as_dvec3());
    let mut all = Vec::new();
    for (number, quad) in scene.quads.iter().enumerate() {
        let corners = quad.corners.map(Vec3::as_dvec3);
        let n = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalize();
        let t = (corners[0] - eye).dot(n) / d.dot(n);
        let inside = |k: usize| {
            let (a, b) = (corners[k], corners[(k + 1) % 4]);
            n.cross(b - a).normalize().dot(eye + d * t - a)
        };
        let least = (0..4).map(inside).fold(f64::INFINITY, f64::min);
        // A face seen at a grazing angle spans the rays of several pixels.
        let doubt = DOUBT_M / d.dot(n).abs();
        if least.abs() < doubt || (t - f64::from(opaque_m)).abs() < doubt {
            return None;
        }
        if least > 0.0 && (opaque_m == 0.0 || t < f64::from(opaque_m)) {
            all.push((t, number));
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.windows(2).all(|pair| pair[1].0 - pair[0].0 > DOUBT_M).then_some(all)
}

/// Traces one sheet under pixel i alone, with nothing in front of it.
fn alone(scene: &Scene, volume: &VolumeTexture, quad: usize, i: usize) -> RayResult {
    let (own, camera) = (&scene.quads[quad], &scene.camera);
    let Image { width, height, .. } = scene.image;
    let pixel = [i as u32 % width, i as u32 / width];
    let at = Camera::image_point(width, height, pixel, sample_offset(&scene.image, 0));
    let plane = PlaneView::of_quad(&own.map, camera.eye_local(), camera.rays(width, height));
    let hit = map_quad(own, &plane, at, camera.ray_to(width, height, at).length());
    Integrator::new(scene, volume).trace(quad, view_ray(scene, i), hit, Vec3::ZERO, &mut ())
}

/// Compares every pixel that can be decided with the reference. Returns the number of such pixels by their
/// number of sheets.
fn assert_composited(
    what: &str,
    scene: &Scene,
    volume: &VolumeTexture,
    mesh: &Mesh,
    frame: &Frame,
) -> [usize; 12] {
    let opaque = gbuffer::run(scene, mesh, 0).opaque;
    let mut told = [0; 12];
    for (i, got) in frame.radiance.iter().enumerate() {
        let Some(faces) = met(scene, i, opaque[i][3]) else { continue };
        told[faces.len()] += 1;
        let (mut radiance, mut transmittance) = (DVec3::ZERO, 1.0);
        for &(_, quad) in faces.iter().take(scene.trace.layers as usize) {
            let sheet = alone(scene, volume, quad, i);
            radiance += sheet.radiance.as_dvec3() * transmittance;
            transmittance *= f64::from(sheet.transmittance);
        }
        radiance += Vec3::from_slice(&opaque[i]).as_dvec3() * transmittance;
        for (got, want) in got.iter().zip([radiance.x, radiance.y, radiance.z, transmittance]) {
            let absolute = COMPOSITE_ABSOLUTE;
            let near = close(f64::from(*got), want, CLOSED_FORM_RELATIVE, absolute);
            assert!(near, "{what}, pixel {i} of {faces:?}: {got}, not {want}");
        }
    }
    told
}

#[test]
fn every_pixel_composites_all_quads_under_it_in_order_of_their_faces() {
    let mut deep = [0; 12];
    for seed in 0..6 {
        let scene = heap(6, seed);
        let volume = curves(&scene);
        let frame = on_cpu(&scene, &volume, &no_rock());
        let told = assert_composited(&format!("heap {seed}"), &scene, &volume, &no_rock(), &frame);
        deep = std::array::from_fn(|n| deep[n] + told[n]);
    }
    assert!((0..=4).all(|n| deep[n] > 100), "pixels by number of sheets: {deep:?}");
}

#[test]
fn sheets_that_cross_change_places_in_the_line_where_they_do() {
    let scene = crossing();
    let volume = curves(&scene);
    let frame = on_cpu(&scene, &volume, &no_rock());
    let told = assert_composited("crossing", &scene, &volume, &no_rock(), &frame);
    assert!(told[2] > 800, "{told:?}");
    let targets = gbuffer::run(&scene, &no_rock(), 0);
    for (x, order) in [(20, [1, 0]), (43, [0, 1])] {
        let faces: Vec<usize> = targets.faces(24 * 64 + x).map(|(quad, _)| quad).collect();
        assert_eq!(faces, order, "column {x}");
    }
}

#[test]
fn a_strip_folded_over_itself_is_gone_through_fold_by_fold() {
    let scene = folded();
    let volume = curves(&scene);
    let frame = on_cpu(&scene, &volume, &no_rock());
    let told = assert_composited("folded", &scene, &volume, &no_rock(), &frame);
    assert!(told[3] > 500 && overlap::sheets(&scene) == 3, "{told:?}");
}

#[test]
fn rock_between_two_sheets_cuts_the_second() {
    let full = [[-0.9, -0.7], [0.9, 0.7]];
    let scene = sheets(vec![upright(full[0], full[1], -0.5), upright(full[0], full[1], 0.5)]);
    let mesh = rock([-0.9, -0.9], [0.0, 0.9], 0.0);
    let volume = uniform();
    let frame = on_cpu(&scene, &volume, &mesh);
    let told = assert_composited("rock", &scene, &volume, &mesh, &frame);
    assert!(told[1] > 800 && told[2] > 500, "{told:?}");
    // Left of the middle the rock lies behind the nearer sheet; right of it, the farther sheet does.
    let at = |x: usize| frame.radiance[24 * 64 + x][3];
    assert!(close((at(20) * at(20)).into(), at(43).into(), 0.01, 0.0), "{} {}", at(20), at(43));
}

#[test]
fn uniform_sheets_transmit_the_product_of_what_each_does_and_a_shared_edge_counts_once() {
    // At z = 2.5 the camera is 1 m away, so the edges of four quads meet at pixel centres.
    let mut scene = sheets(Vec::new());
    let pixel = 2.0 * (scene.camera.tan_half_fov / 48.0);
    let at = |x: f32, y: f32| [(x - 31.5) * pixel, (y - 23.5) * pixel];
    let (low, middle, high) = (at(8.0, 8.0), at(30.0, 21.0), at(58.0, 40.0));
    scene.edit().quads = vec![
        upright(low, middle, 2.5),
        upright([middle[0], low[1]], [high[0], middle[1]], 2.5),
        upright([low[0], middle[1]], [middle[0], high[1]], 2.5),
        upright(middle, high, 2.5),
    ];
    assert_eq!(overlap::sheets(&scene), 1, "side by side");
    scene.edit().quads.push(upright([-2.0, -2.0], [2.0, 2.0], 1.0));
    assert_eq!(overlap::sheets(&scene), 2);
    let volume = uniform();
    let frame = on_cpu(&scene, &volume, &no_rock());
    let depth = 4.0 * f64::from(volume.cells[0].rho()) * f64::from(0.2f32);
    for y in 12..36 {
        for x in 12..54 {
            let i = y * 64 + x;
            let cos = -f64::from(view_ray(&scene, i).z);
            let want = (-2.0 * depth / cos).exp();
            let got = f64::from(frame.radiance[i][3]);
            assert!(close(got, want, CLOSED_FORM_RELATIVE, 0.0), "{x} {y}: {got}, not {want}");
        }
    }
}

#[test]
fn faces_of_equal_depth_come_in_the_order_of_the_quads() {
    let same = || upright([-0.5, -0.5], [0.5, 0.5], 0.0);
    let scene = sheets(vec![same(), same(), same()]);
    let targets = gbuffer::run(&scene, &no_rock(), 0);
    let faces: Vec<usize> = targets.faces(24 * 64 + 32).map(|(quad, _)| quad).collect();
    assert_eq!(faces, [0, 1, 2]);
    let volume = uniform();
    let frame = on_cpu(&scene, &volume, &no_rock());
    let one = alone(&scene, &volume, 0, 24 * 64 + 32).transmittance;
    let got = f64::from(frame.radiance[24 * 64 + 32][3]);
    assert!(close(got, f64::from(one).powi(3), CLOSED_FORM_RELATIVE, 0.0));
}

#[test]
fn with_one_layer_the_nearest_sheet_is_traced_alone_to_the_bit() {
    let mut scene = heap(6, 3);
    scene.edit().trace.layers = 1;
    let volume = curves(&scene);
    let mesh = rock([-0.3, -0.2], [0.6, 0.6], -0.2);
    let frame = on_cpu(&scene, &volume, &mesh);
    let targets = gbuffer::run(&scene, &mesh, 0);
    assert_eq!((targets.layers, targets.quad_id.len()), (1, 64 * 48));
    let mut wet = 0;
    for (i, got) in frame.radiance.iter().enumerate().filter(|(i, _)| targets.quad_id[*i] != 0) {
        let behind = Vec3::from_slice(&targets.opaque[i]);
        let quad = targets.quad_id[i] as usize - 1;
        let integrator = Integrator::new(&scene, &volume);
        let one = integrator.trace(quad, view_ray(&scene, i), targets.surface[i], behind, &mut ());
        assert_eq!((*got, frame.counts[i]), (one.radiance.extend(one.transmittance).to_array(), one.cells));
        wet += 1;
    }
    assert!(wet > 500);
    scene.edit().trace.layers = 16;
    assert_ne!(frame.radiance, on_cpu(&scene, &volume, &mesh).radiance);
}

#[test]
fn of_more_sheets_than_layers_the_farthest_are_left_out() {
    let mut scene = heap(6, 4);
    let volume = curves(&scene);
    let all = gbuffer::run(&scene, &no_rock(), 0);
    for layers in [1, 2, 3] {
        scene.edit().trace.layers = layers;
        let some = gbuffer::run(&scene, &no_rock(), 0);
        assert!((0..64 * 48).all(|i| some.faces(i).eq(all.faces(i).take(layers as usize))));
        let frame = on_cpu(&scene, &volume, &no_rock());
        let told = assert_composited(&format!("{layers}"), &scene, &volume, &no_rock(), &frame);
        assert!(told[4] + told[5] > 50, "{told:?}");
    }
}

#[test]
fn an_early_end_ends_all_sheets_and_max_cells_counts_for_each() {
    let full = |z| upright([-0.9, -0.7], [0.9, 0.7], z);
    let mut scene = sheets(vec![full(0.6), full(0.0), full(-0.6)]);
    let volume = uniform();
    let middle = 24 * 64 + 32;
    let cells = |scene: &Scene| on_cpu(scene, &volume, &no_rock()).counts[middle][0];
    assert_eq!(cells(&scene), 15);
    scene.edit().trace.max_cells = 2;
    assert_eq!(cells(&scene), 6);
    scene.edit().trace.max_cells = 512;
    // Each sheet lets e^(−0.48) = 0.62 through, so 0.5 is passed in the second cell of the second sheet.
    scene.edit().trace.early_end = 0.5;
    let ended = on_cpu(&scene, &volume, &no_rock());
    assert_eq!(ended.counts[middle][0], 7 + 1);
    let [radiance @ .., transmittance] = ended.radiance[middle];
    assert!(transmittance < 0.5);
    scene.edit().background.horizon += 1.0;
    let brighter = on_cpu(&scene, &volume, &no_rock()).radiance[middle];
    // The remaining transmittance still shows the background.
    assert!(close((brighter[0] - radiance[0]).into(), transmittance.into(), 1e-5, 0.0));
}

#[test]
fn layers_are_as_many_as_quads_overlap_and_never_fewer() {
    for (name, want) in [("fig5", 1), ("front", 1)] {
        assert_eq!(overlap::sheets(&preset(name, &[])), want, "{name}");
    }
    for seed in 0..20 {
        let mut scene = heap(8, 100 + seed);
        let deepest =
            (0..64 * 48).filter_map(|i| Some(met(&scene, i, 0.0)?.len())).max().expect("pixels") as u32;
        let got = overlap::sheets(&scene);
        assert!((deepest..=deepest + 1).contains(&got), "heap {seed}: {got}, {deepest} are seen");
        scene.edit().trace.layers = 2;
        assert_eq!(overlap::sheets(&scene), got.min(2));
    }
    // These are too many to compare one by one, so the largest number is taken.
    let full = (0..3000).map(|i| upright([-0.5, -0.5], [0.5, 0.5], i as f32 * -0.01));
    assert_eq!(overlap::sheets(&sheets(full.collect())), 16);
    // One sheet reaches from before the eye to behind it.
    let corner = |x, z| Vec3::new(x, -0.2, z);
    let floor = quad([corner(-1.0, 9.0), corner(1.0, 9.0), corner(1.0, -9.0), corner(-1.0, -9.0)], 0.1);
    assert_eq!(overlap::sheets(&sheets(vec![floor, upright([-0.5, -0.5], [0.5, 0.5], 0.0)])), 2);
}

#[test]
fn the_report_of_a_ray_tells_every_face_and_the_cells_of_each() {
    let scene = heap(6, 5);
    let volume = curves(&scene);
    let frame = on_cpu(&scene, &volume, &no_rock());
    let mut most = 0;
    for i in (0..64 * 48).step_by(7) {
        let report = inspect(&scene, &volume, &no_rock(), [i as u32 % 64, i as u32 / 64]);
        super::ray::assert_whole(&format!("pixel {i}"), &report);
        assert_eq!(report.radiance.extend(report.transmittance).to_array(), frame.radiance[i]);
        let Some(faces) = met(&scene, i, 0.0) else { continue };
        assert!(report.faces.iter().map(|f| f.quad).eq(faces.iter().map(|f| f.1)), "pixel {i}");
        assert!(report.faces.is_sorted_by(|a, b| a.depth_m < b.depth_m));
        let walked = report.steps.iter().map(|s| s.face);
        assert!((0..faces.len()).all(|face| walked.clone().any(|f| f == face)), "pixel {i}");
        most = most.max(faces.len());
    }
    assert!(most > 3);
}
