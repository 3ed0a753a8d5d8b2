//! Depth of field: discs against the formula of the thin lens, and both engines.

use std::path::PathBuf;

use super::gpu::{COARSE_PLACE, assert_same_radiance, both, renderer, scene};
use crate::tolerance::close;
use taki::engine::RenderOptions;
use taki::engine::cpu;
use taki::picture::camera::sample_numbers;
use taki::picture::{Frame, Lens};
use taki::scene::{Limits, Scene, Source};
use taki::util::monitor::Unwatched;
use taki::util::window::Window;

/// A black wall from x = 0 to the left, `depth` metres in front of a white background. The plane in focus is
/// 4 m away.
fn edge(depth: f64, sets: &[&str]) -> Scene {
    let z = -depth;
    let text = format!(
        "version = 1\n[image]\nwidth = 128\nheight = 64\nsamples = 512\n[camera]\neye = [0, 0, 0]\n\
         target = [0, 0, -4]\nfov = 10.0\nf_number = 1.4\n[background]\nzenith = [1, 1, 1]\n\
         horizon = [1, 1, 1]\n[rocks.wall]\ncorners = [[-50, -50, {z}], [0, -50, {z}], [0, 50, {z}], \
         [-50, 50, {z}]]\ncolor = [0, 0, 0]\nlevels = 1\namplitude = 0.0\n"
    );
    let source = Source { name: "s".into(), origin: "s.toml".into(), folder: PathBuf::from("."), text };
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Scene::of_source(&source, &sets, &Limits::default()).expect("a valid scene")
}

fn render(scene: &Scene) -> Frame {
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    cpu::render(scene, &volumes, &scene.mesh(), false, &Unwatched).expect("a frame")
}

/// Mean and standard deviation of the place at which the picture's middle row turns from black to white,
/// pixels.
fn turn(frame: &Frame) -> [f64; 2] {
    let row = &frame.radiance[32 * frame.width as usize..][..frame.width as usize];
    let steps = row.windows(2).enumerate().map(|(i, w)| (i as f64 + 1.0, f64::from(w[1][1] - w[0][1])));
    let steps: Vec<(f64, f64)> = steps.collect();
    let whole: f64 = steps.iter().map(|(_, step)| step).sum();
    assert!((whole - 1.0).abs() < 1e-4, "the edge is from black to white: {whole}");
    let mean: f64 = steps.iter().map(|(at, step)| at * step).sum();
    let variance: f64 = steps.iter().map(|(at, step)| (at - mean).powi(2) * step).sum();
    [mean, variance.max(0.0).sqrt()]
}

#[test]
fn an_edge_is_as_wide_as_the_circle_of_confusion_of_the_thin_lens() {
    // The textbook's formula, with f of the sensor: c = A·|S₂ − S₁|/S₂·f/(S₁ − f).
    let circle = |depth: f64| {
        let v = 0.012 / 5f64.to_radians().tan();
        let f = 1.0 / (1.0 / v + 1.0 / 4.0);
        let on_sensor = f / 1.4 * (depth - 4.0).abs() / depth * f / (4.0 - f);
        on_sensor / 0.024 * 64.0
    };
    for depth in [2.0, 3.0, 6.0, 40.0] {
        let scene = edge(depth, &[]);
        let [at, width] = turn(&render(&scene));
        let blur = scene.lens.expect("a lens").blur(&scene.camera, &scene.image, depth);
        assert!(close(blur, circle(depth), 1e-5, 0.0), "{depth} m: {blur} and {}", circle(depth));
        // A disc of diameter c seen from the side has the deviation c/4; a pixel that of 1/√12.
        let truth = (circle(depth).powi(2) / 16.0 + 1.0 / 6.0).sqrt();
        assert!((width - truth).abs() < 0.02 * truth + 0.03, "{depth} m: {width} for {truth}");
        assert!((at - 64.0).abs() < 0.05, "{depth} m: the edge is at {at}");
    }
}

#[test]
fn what_is_in_focus_stays_as_sharp_as_through_a_pinhole() {
    let lens = render(&edge(4.0, &["image.samples=16"]));
    let pinhole = render(&edge(4.0, &["image.samples=16", "camera.f_number=0"]));
    let largest = lens.radiance.iter().zip(&pinhole.radiance).map(|(a, b)| (a[1] - b[1]).abs());
    assert!(largest.fold(0.0, f32::max) <= 1.0 / 16.0 + 1e-6, "one sample at most falls aside");
    // The focus may be set by itself.
    let set = render(&edge(6.0, &["image.samples=16", "camera.focus=6"]));
    let unset = render(&edge(6.0, &["image.samples=16"]));
    assert!(turn(&set)[1] < 0.6 && turn(&unset)[1] > 0.6, "{:?} {:?}", turn(&set), turn(&unset));
}

#[test]
fn points_of_the_lens_fill_its_disc_evenly_about_its_middle() {
    let mut image = edge(4.0, &[]).image;
    let lens = Lens { radius: 0.5, focus: 3.0 };
    for n in [1, 2, 3, 16, 33, 256] {
        image.samples = n;
        let points: Vec<[f64; 2]> = sample_numbers(&image).map(|s| lens.point(&image, s)).collect();
        let mean = [0, 1].map(|c| points.iter().map(|p| p[c]).sum::<f64>());
        assert!(mean.iter().all(|m| m.abs() < 1e-12), "{n}: {mean:?}");
        assert!(points.iter().all(|p| p[0].hypot(p[1]) <= 0.5), "{n}");
        if n >= 16 {
            // A disc has a quarter of its squared radius along each axis, and a quarter of its area within
            // half the radius.
            for c in 0..2 {
                let second = points.iter().map(|p| p[c] * p[c]).sum::<f64>() / f64::from(n);
                assert!(close(second, 0.25 * 0.25, 4.0 / f64::from(n), 0.0), "{n}: {second}");
            }
            let near = points.iter().filter(|p| p[0].hypot(p[1]) < 0.25).count() as f64 / f64::from(n);
            assert!((near - 0.25).abs() < 0.07, "{n}: {near}");
        }
    }
    image.samples = 1;
    assert_eq!(lens.point(&image, 0), [0.0; 2]);
}

/// The default scene, small, its rock coarse.
fn small(sets: &[&str]) -> Scene {
    let size = [
        "image.width=64",
        "image.height=48",
        "image.samples=4",
        "volume.nx=32",
        "volume.ny=64",
        "volume.nz=8",
        "trace.filter=none",
        "camera.f_number=0.05",
    ];
    scene("waterfall", &[&COARSE_PLACE, &size[..], sets].concat())
}

#[test]
fn the_engines_agree_through_a_lens() {
    let Some(mut renderer) = renderer("a lens") else { return };
    for sets in [&[][..], &["image.alpha=true", "image.bloom=0.1", "camera.shutter=0.5"]] {
        let frames = both(&mut renderer, &small(sets));
        assert_same_radiance(&format!("{sets:?}"), &frames);
        let near = |a: &[u8; 4], b: &[u8; 4]| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= 1);
        let pictures = frames[0].picture.iter().zip(&frames[1].picture);
        let apart = pictures.filter(|(a, b)| !near(a, b)).count();
        assert!(apart * 100 < frames[0].picture.len(), "{sets:?}: {apart} pixels");
    }
}

#[test]
fn layers_and_crops_through_a_lens_are_those_of_the_whole_picture() {
    let scene = small(&[]);
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    let mesh = scene.mesh();
    let render = |scene: &Scene, window| {
        let options = RenderOptions { surface: true, window, ..Default::default() };
        cpu::render_with(scene, &volumes, &mesh, &options, &mut Default::default(), &Unwatched)
            .expect("a frame")
    };
    let whole = render(&scene, None);
    let mut pinhole = scene.clone();
    pinhole.edit().lens = None;
    let sharp = render(&pinhole, None);
    assert!(whole.surface == sharp.surface && whole.radiance != sharp.radiance);
    let window = Window { x: 21, y: 9, width: 17, height: 20 };
    let part = render(&scene, Some(window));
    for (i, pixel) in window.each().enumerate() {
        let at = Window::whole([64, 48]).index(pixel);
        assert_eq!(part.radiance[i], whole.radiance[at], "{pixel:?}");
        assert_eq!(part.picture[i], whole.picture[at], "{pixel:?}");
    }
}
