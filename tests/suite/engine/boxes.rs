//! Boxes that a volume fills once: transmittance against its closed form on both engines, from outside and
//! from inside, and parity of everything else.

use glam::{DAffine3, DVec3, Vec3};
use taki::engine::cpu;
use taki::engine::cpu::ray::inspect;
use taki::engine::gpu::GpuRenderer;
use taki::picture::camera::{CENTRE, sample_offset};
use taki::picture::{Camera, Frame};
use taki::scene::Scene;
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, VolumeTexture};

use super::gpu::{SURFACE, assert_parity, renderer};
use crate::scene::meshes::{Folder, PLACE};
use crate::trace::closed_forms::{noise, uniform};

const SIGMA: f64 = 1.7;

/// A scene of one box, whose volume the caller brings.
pub fn scene(own: &str, sets: &[&str]) -> Scene {
    let text = format!("{PLACE}[volumes.smoke]\n[boxes.b]\nvolume = \"smoke\"\n{own}");
    let sigma = format!("trace.sigma={SIGMA}");
    let all = ["trace.max_cells=65536", "trace.early_end=0", "light.visibility=march", &sigma];
    Folder::new().scene(&text, &[&all[..], sets].concat())
}

fn both(renderer: &mut Option<GpuRenderer>, scene: &Scene, volumes: &[VolumeTexture]) -> Vec<Frame> {
    let mesh = scene.mesh();
    let on_cpu = cpu::render(scene, volumes, &mesh, true, &Unwatched).expect("a frame");
    let on_gpu = renderer
        .as_mut()
        .map(|renderer| renderer.render(scene, volumes, &mesh, &SURFACE, &Unwatched).expect("a frame"));
    on_gpu.into_iter().chain([on_cpu]).collect()
}

/// Metres of each pixel's ray inside a box, in float64.
pub fn chords(scene: &Scene, world_from_texture: DAffine3) -> Vec<f64> {
    let image = &scene.image;
    let texture_from_world = world_from_texture.inverse();
    let [forward, right, up] = scene.camera.rays(image.width, image.height);
    let offset = sample_offset(image, CENTRE);
    let pixels = (0..image.height).flat_map(|y| (0..image.width).map(move |x| [x, y]));
    let chord = |pixel: [u32; 2]| {
        let at = Camera::image_point(image.width, image.height, pixel, offset).as_dvec2();
        let d = (forward + right * at.x + up * at.y).normalize();
        let from = texture_from_world.transform_point3(scene.camera.eye);
        let along = texture_from_world.transform_vector3(d);
        let (mut low, mut high) = (0f64, f64::INFINITY);
        for axis in 0..3 {
            let ends = [0.0, 1.0].map(|end| (end - from[axis]) / along[axis]);
            low = low.max(ends[0].min(ends[1]));
            high = high.min(ends[0].max(ends[1]));
        }
        (high - low).max(0.0)
    };
    pixels.map(chord).collect()
}

/// Places of boxes and of eyes outside and inside.
const PLACES: [&str; 4] = [
    "position = [0.3, 0.2, -0.4]\nsize = [1.0, 2.0, 0.7]\n",
    "position = [0.3, 0.2, -0.4]\nsize = [1.3, 0.9, 1.6]\nturn = [20, 35, -50]\n",
    "size = [2.0, 2.0, 2.0]\nturn = [-90, 0, 0]\n",
    "position = [10000.0, -3000.0, 700.0]\nsize = [0.5, 2.0, 1.1]\nturn = [5, 6, 7]\n",
];

/// Cameras relative to the middle of the box: far and near outside, inside, at its middle, and near a face.
const EYES: [[f64; 3]; 6] =
    [[1.3, 1.9, 4.0], [-2.0, 0.1, 0.3], [0.11, -0.07, 0.06], [0.0; 3], [0.2, 0.1, -0.2], [0.0, 4.0, 0.001]];

fn seen_from(own: &str, eye: [f64; 3], sets: &[&str]) -> Scene {
    let plain = scene(own, &[]);
    let middle = plain.boxes[0].middle();
    let eye = middle + DVec3::from_array(eye);
    let target = middle + DVec3::new(0.03, 0.02, 0.01);
    let words = |p: DVec3| format!("[{},{},{}]", p.x, p.y, p.z);
    let [eye, target] = [format!("camera.eye={}", words(eye)), format!("camera.target={}", words(target))];
    scene(own, &[&[eye.as_str(), &target, "camera.fov=70"], sets].concat())
}

#[test]
fn transmittance_of_even_matter_is_the_exponential_of_the_chord() {
    let mut renderer = renderer("boxes");
    let rho = 0.6;
    let volumes = [uniform([5, 7, 4], Vec3::Y, rho, 0.5, 0.5)];
    let rho = f64::from(volumes[0].cell(0, 0, 0).rho());
    let variants: [&[&str]; 4] = [
        &["trace.filter=none"],
        &["trace.filter=none", "trace.lookup=trilinear"],
        &["trace.filter=pyramid"],
        &["trace.filter=none", "light.visibility=cached"],
    ];
    for (i, own) in PLACES.iter().enumerate() {
        for (k, eye) in EYES.into_iter().enumerate() {
            let scene = seen_from(own, eye, variants[(i + k) % 4]);
            let chords = chords(&scene, scene.boxes[0].world_from_texture);
            assert!(chords.iter().filter(|chord| **chord > 0.0).count() * 50 > chords.len(), "{own} {eye:?}");
            for (engine, frame) in both(&mut renderer, &scene, &volumes).iter().enumerate() {
                let wrong = chords.iter().enumerate().filter(|&(i, chord)| {
                    let truth = (-SIGMA * rho * chord).exp();
                    let found = f64::from(frame.radiance[i][3]);
                    (found - truth).abs() > 2e-4
                });
                let wrong: Vec<_> = wrong
                    .map(|(i, chord)| (i, *chord, (-SIGMA * rho * chord).exp(), frame.radiance[i][3]))
                    .collect();
                // A ray that touches an edge of the box within rounding may miss it.
                assert!(wrong.len() <= 1, "{own} {eye:?} engine {engine}: {} {:?}", wrong.len(), &wrong[..1]);
            }
        }
    }
}

#[test]
fn the_engines_agree_on_boxes_in_every_variant() {
    let mut renderer = renderer("variants of boxes");
    let volumes = [noise([16, 24, 10], 4)];
    let (strand, pyramid) = ("light.reflection=strand", "trace.filter=pyramid");
    let (trilinear, cached) = ("trace.lookup=trilinear", "light.visibility=cached");
    let hair = "light.reflection=hair";
    let variants: [&[&str]; 12] = [
        &["light.visibility=none", "trace.filter=none"],
        &[hair, "trace.filter=none"],
        &[hair, trilinear, cached, "hair.tilt=-8"],
        &[cached, "trace.filter=none"],
        &[trilinear, "trace.filter=none"],
        &[pyramid],
        &[pyramid, cached],
        &[pyramid, trilinear, cached],
        &[strand, "trace.filter=none"],
        &[strand, trilinear, "light.frame=texture", "trace.filter=none"],
        &["image.samples=4", cached, "trace.layers=1", "trace.filter=none"],
        &["trace.early_end=0.3", "trace.max_cells=40", "trace.filter=none"],
    ];
    let size = ["volumes.smoke.nx=16", "volumes.smoke.ny=24", "volumes.smoke.nz=10"];
    for (i, sets) in variants.into_iter().enumerate() {
        for eye in [EYES[i % 2], EYES[2 + i % 3]] {
            let scene = seen_from(PLACES[1], eye, &[&size[..], sets].concat());
            let mut frames = both(&mut renderer, &scene, &volumes);
            // Faces of a box lie between cells, where rounding decides whether a ray counts one more cell, of
            // length 0.
            frames.iter_mut().for_each(|frame| frame.counts.iter_mut().for_each(|count| count[0] = 0));
            let lit = frames[0].radiance.iter().filter(|r| r[0] > 0.0 && r[3] < 0.9).count();
            assert!(lit > 40, "{sets:?} {eye:?}: {lit} lit");
            if let Ok(frames) = <[Frame; 2]>::try_from(frames) {
                assert_parity(&format!("{sets:?} from {eye:?}"), &frames);
            }
        }
    }
}

#[test]
fn what_lies_at_one_end_of_a_box_is_not_seen_at_the_other() {
    let mut renderer = renderer("ends of boxes");
    // Matter in the last cells along x alone; a ray along the first cells sees none, however it is looked up.
    let size = [8, 8, 8];
    let mut cells = vec![Cell::default(); 512];
    for (i, cell) in cells.iter_mut().enumerate() {
        if i % 8 == 7 {
            *cell = Cell::from_direction(Vec3::Y).with_density(1.0, 0.5, 0.5);
        }
    }
    let volumes = [VolumeTexture { size, alpha: 1.0, cells: cells.into() }];
    let own = "size = [2.0, 2.0, 2.0]\n";
    let sets = [
        "trace.lookup=trilinear",
        "trace.filter=none",
        "camera.eye=[-0.98,0.013,5]",
        "camera.target=[-0.98,0.013,0]",
        "camera.fov=0.3",
    ];
    for frame in both(&mut renderer, &scene(own, &sets), &volumes) {
        assert!(frame.radiance.iter().all(|r| r[3] > 1.0 - 2e-6), "{:?}", frame.radiance[0]);
    }
    // The last cells are as dense up to their end.
    let sets = [&sets[..2], &["camera.eye=[0.98,0.013,5]", "camera.target=[0.98,0.013,0]", "camera.fov=0.1"]];
    let truth = (-SIGMA * 2.0).exp();
    for frame in both(&mut renderer, &scene(own, &sets.concat()), &volumes) {
        assert!(
            frame.radiance.iter().all(|r| (f64::from(r[3]) - truth).abs() < 1e-3),
            "{:?}",
            frame.radiance
        );
    }
}

#[test]
fn a_single_ray_has_the_bits_of_its_pixel_from_inside_too() {
    let volumes = [noise([16, 24, 10], 4)];
    let sets = ["volumes.smoke.nx=16", "volumes.smoke.ny=24", "volumes.smoke.nz=10", "trace.filter=none"];
    for eye in [EYES[0], EYES[2], EYES[3]] {
        let scene = seen_from(PLACES[1], eye, &sets);
        let mesh = scene.mesh();
        let frame = cpu::render(&scene, &volumes, &mesh, true, &Unwatched).expect("a frame");
        for i in (0..frame.radiance.len()).step_by(37) {
            let pixel = [i as u32 % frame.width, i as u32 / frame.width];
            let report = inspect(&scene, &volumes, &mesh, pixel);
            let found = report.radiance.extend(report.transmittance).to_array();
            assert_eq!(found, frame.radiance[i], "{eye:?} {pixel:?}");
        }
    }
}
