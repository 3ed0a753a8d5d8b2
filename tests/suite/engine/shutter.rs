//! An open shutter: the mean of still pictures at the times of the samples, on both engines.

use super::gpu::{COARSE_PLACE, SURFACE, assert_parity, assert_same_radiance, both, renderer, scene};
use crate::trace::shells::scene_with;
use taki::engine::RenderOptions;
use taki::engine::cpu::{self, LightVolumeCache};
use taki::light::Visibility;
use taki::mapping::shell::Side;
use taki::picture::camera::sample_numbers;
use taki::picture::{Frame, SampleTimes};
use taki::scene::Scene;
use taki::util::monitor::Unwatched;
use taki::util::window::Window;

const SMALL: [&str; 8] = [
    "image.width=40",
    "image.height=30",
    "image.samples=4",
    "volume.nx=32",
    "volume.ny=64",
    "volume.nz=10",
    "animate.speed=0.5",
    "volume.flow=0.3",
];

fn of(preset: &str, sets: &[&str]) -> Scene {
    scene(preset, &[&SMALL, sets].concat())
}

fn render(scene: &Scene, samples: Option<u32>, window: Option<Window>) -> Frame {
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    let samples = samples.map(|sample| sample..sample + 1);
    let options = RenderOptions { samples, window, ..Default::default() };
    cpu::render_with(scene, &volumes, &scene.mesh(), &options, &mut LightVolumeCache::default(), &Unwatched)
        .expect("a frame")
}

/// Mean over pictures of the same size.
fn mean(frames: &[Vec<[f32; 3]>]) -> Vec<[f32; 3]> {
    let count = frames.len() as f32;
    (0..frames[0].len())
        .map(|i| [0, 1, 2].map(|c| frames.iter().map(|frame| frame[i][c]).sum::<f32>() / count))
        .collect()
}

fn rgb(frame: &Frame) -> Vec<[f32; 3]> {
    frame.radiance.iter().map(|r| [r[0], r[1], r[2]]).collect()
}

/// Root of the mean squared difference.
fn rms(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    let squares = a.iter().zip(b).flat_map(|(a, b)| [0, 1, 2].map(|c| (a[c] - b[c]).powi(2)));
    (squares.sum::<f32>() / (3 * a.len()) as f32).sqrt()
}

#[test]
fn every_sample_has_its_own_part_of_the_time_and_neighbours_fill_the_gaps() {
    let mut image = scene("front", &[]).image;
    for n in 1..=17 {
        image.samples = n;
        for pixel in [[0, 0], [1, 0], [0, 1], [1279, 719], [70_000, 3]] {
            let times = sample_numbers(&image).map(|s| SampleTimes::new(&image, s).of(pixel));
            // A time at the beginning of its part may be rounded down.
            let mut parts: Vec<u32> = times.map(|t| ((t + 0.5) * n as f32 + 1e-5) as u32).collect();
            parts.sort_unstable();
            assert_eq!(parts, (0..n).collect::<Vec<_>>(), "{n} samples of {pixel:?}");
        }
        // Over 8×8 pixels the mean lies in the middle of each part to a fortieth of it.
        for (part, sample) in sample_numbers(&image).enumerate() {
            let times = SampleTimes::new(&image, sample);
            let sum: f32 = (0..64).map(|i| times.of([200 + i % 8, 96 + i / 8])).sum();
            let middle = times.first + 0.5 / n as f32;
            assert!((sum / 64.0 - middle).abs() * (n as f32) < 0.025, "{n} samples, sample {part}");
        }
    }
}

/// Settings without what stands still or moves along straight lines while the shutter is open, and without
/// strands, which the samples of a pixel see in turns.
const STEADY: [&str; 12] = [
    "pools.plunge.waves=sum",
    "camera.shutter=2.0",
    "rocks.wall.levels=2",
    "rocks.hills.levels=2",
    "trace.lookup=nearest",
    "materials.mist.billow=0",
    "sheets.main.surge=0",
    "sheets.main_left.surge=0",
    "sheets.main_right.surge=0",
    "sheets.leap.surge=0",
    "sheets.thread.surge=0",
    "sheets.far.surge=0",
];

#[test]
fn each_sample_sees_the_water_where_it_is_at_its_own_time() {
    // Quads with their light volumes and without, and the waves of a pool.
    let cases: [(&str, &[&str]); 3] = [
        ("fig5", &["camera.shutter=0.5"]),
        ("fig5", &["camera.shutter=0.5", "light.visibility=cached"]),
        ("waterfall", &STEADY),
    ];
    for (preset, sets) in cases {
        let open = of(preset, sets);
        let mut moving = 0;
        for (i, sample) in sample_numbers(&open.image).enumerate() {
            for pixel in [[20, 12], [23, 15], [18, 24], [21, 28]] {
                let window = Window { x: pixel[0], y: pixel[1] - i as u32, width: 1, height: 1 };
                let time = SampleTimes::new(&open.image, sample).of([window.x, window.y]);
                let moved = 0.3 + time * open.recipes[0].moves;
                let still =
                    of(preset, &[sets, &["camera.shutter=0", &format!("volume.flow={moved}")]].concat());
                let [a, b] = [&open, &still].map(|s| rgb(&render(s, Some(sample), Some(window))));
                assert!(rms(&a, &b) <= 1e-3 * b[0][1] + 1e-5, "{preset} {sets:?} {pixel:?}: {a:?} {b:?}");
                let frame = of(preset, &[sets, &["camera.shutter=0"]].concat());
                moving += u32::from(rgb(&render(&frame, Some(sample), Some(window))) != b);
            }
        }
        assert!(moving > 8, "{preset} {sets:?}: only {moving} of 16 pixels have moved");
    }
}

#[test]
fn a_long_exposure_is_the_mean_of_still_pictures_of_its_time() {
    // A narrow view, in which a pixel is smaller than a cell.
    let sets = ["image.width=20", "image.height=15", "camera.fov=3"];
    let many = [&sets[..], &["image.samples=256"]].concat();
    let stills: Vec<Vec<[f32; 3]>> = (0..32)
        .map(|i| {
            let flow = format!("volume.flow={}", 0.3 + 0.25 * ((i as f32 + 0.5) / 32.0 - 0.5));
            rgb(&render(&of("fig5", &[&many[..], &[&flow]].concat()), None, None))
        })
        .collect();
    let truth = mean(&stills);
    let open = |samples: u32| {
        let samples = format!("image.samples={samples}");
        rgb(&render(&of("fig5", &[&sets[..], &["camera.shutter=0.5", &samples]].concat()), None, None))
    };
    // A still picture, which has the same points in its pixels, differs by what moves.
    let [still, error] = [rms(&stills[16], &truth), rms(&open(256), &truth)];
    assert!(still > 1e-3 && error < 0.1 * still, "{error} beside {still}");
}

#[test]
fn a_shutter_that_meets_no_motion_leaves_every_bit() {
    for (preset, sets) in [("fig5", &[][..]), ("waterfall", &["rocks.wall.levels=2"][..])] {
        let of = |more: &[&str]| rgb(&render(&of(preset, &[sets, more].concat()), None, None));
        assert!(of(&[]) == of(&["camera.shutter=0.5", "animate.speed=0"]), "{preset}");
        assert!(of(&[]) != of(&["camera.shutter=0.5"]), "{preset}");
    }
}

#[test]
fn a_crop_has_the_times_of_the_whole_picture() {
    let scene = of("fig5", &["camera.shutter=0.5"]);
    let whole = render(&scene, None, None);
    let window = Window { x: 13, y: 7, width: 11, height: 9 };
    let part = render(&scene, None, Some(window));
    for (i, pixel) in window.each().enumerate() {
        let at = Window::whole([40, 30]).index(pixel);
        assert_eq!(part.radiance[i], whole.radiance[at], "{pixel:?}");
    }
}

#[test]
fn the_engines_agree_on_long_exposures() {
    let Some(mut renderer) = renderer("long exposures") else { return };
    let march = ["camera.shutter=0.5", "light.visibility=march", "trace.filter=pyramid"];
    for sets in [&["camera.shutter=0.5"][..], &march[..]] {
        assert_parity(&format!("{sets:?}"), &both(&mut renderer, &of("front", sets)));
    }
    // One stream of the fall makes the waves. At the lip of the others a few rays run along edges of cells.
    let one = ["remove=sheets.main_left", "remove=sheets.main_right", "remove=sheets.veil"];
    let pool = [&one[..], &COARSE_PLACE[..], &["camera.shutter=2.0", "trace.filter=none"]].concat();
    assert_same_radiance("a pool", &both(&mut renderer, &of("waterfall", &pool)));
}

#[test]
fn the_engines_agree_on_long_exposures_of_shells() {
    let Some(mut renderer) = renderer("long exposures of shells") else { return };
    let shell = taki::mapping::shell::Shell::new(&crate::mapping::shell::strip(9), Side::Inward);
    let volume = crate::trace::closed_forms::noise([6, 8, 5], 4);
    for visibility in [Visibility::March, Visibility::None] {
        let mut scene = scene_with(shell.clone().expect("a shell"), [0.2, 1.2, 3.4], &[]);
        let parts = scene.edit();
        parts.visibility = visibility;
        parts.image.samples = 4;
        parts.recipes[0].flow = 0.2;
        parts.recipes[0].moves = 0.5;
        let mesh = scene.mesh();
        let volumes = std::slice::from_ref(&volume);
        let on_gpu = renderer.render(&scene, volumes, &mesh, &SURFACE, &Unwatched).expect("a frame");
        let on_cpu = cpu::render(&scene, volumes, &mesh, true, &Unwatched).expect("a frame");
        assert_same_radiance(&format!("{visibility:?}"), &[on_gpu, on_cpu.clone()]);
        scene.edit().recipes[0].moves = 0.0;
        let still = cpu::render(&scene, volumes, &mesh, true, &Unwatched).expect("a frame");
        assert!(rms(&rgb(&still), &rgb(&on_cpu)) > 1e-3, "{visibility:?}: the shell does not move");
    }
}
