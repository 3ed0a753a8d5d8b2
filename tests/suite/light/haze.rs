//! Haze against closed forms, and parity of the engines.

use crate::engine::gpu::{COARSE_PLACE, assert_parity, both, renderer, scene};
use crate::tolerance::{CLOSED_FORM_RELATIVE, close};
use glam::{DVec3, Vec3};
use taki::engine::cpu;
use taki::light::haze::Haze;
use taki::picture::Frame;
use taki::util::monitor::Unwatched;

fn haze(density: f32, height: f32, level: f32) -> Haze {
    Haze { density, color: Vec3::ONE, height, level, far: 0.0 }
}

/// Optical depth by Simpson's rule in float64.
fn depth(haze: &Haze, eye_y: f64, d_y: f64, t: f64) -> f64 {
    const N: usize = 20_000;
    let beta = |s: f64| {
        let above = (eye_y + d_y * s - f64::from(haze.level)) / f64::from(haze.height);
        f64::from(haze.density) * (-above).exp()
    };
    let h = t / N as f64;
    let weight = |i: usize| if i == 0 || i == N { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
    (0..=N).map(|i| weight(i) * beta(i as f64 * h)).sum::<f64>() * h / 3.0
}

#[test]
fn even_haze_dims_by_the_exponential_of_the_metres() {
    let seen = haze(0.2, 0.0, 0.0).seen_from(DVec3::new(0.0, 50.0, 0.0));
    for t in [0.0f32, 0.5, 3.0, 40.0] {
        let want = (-0.2 * f64::from(t)).exp();
        assert!(close(seen.transmittance(0.7, t).into(), want, CLOSED_FORM_RELATIVE, 0.0), "{t} m");
    }
}

#[test]
fn haze_that_thins_upwards_dims_by_the_integral_along_the_ray() {
    for height in [0.7f32, 3.0, 500.0] {
        let haze = haze(0.05, height, -2.0);
        let eye = DVec3::new(0.0, 1.5, 0.0);
        for d_y in [-0.9f32, -0.1, -1e-4, 0.0, 1e-4, 0.3, 1.0] {
            for t in [0.01f32, 1.0, 4.0] {
                let tau = depth(&haze, eye.y, d_y.into(), t.into());
                let got = f64::from(haze.seen_from(eye).transmittance(d_y, t));
                // Next to the range of its series, the quotient loses up to 6e-8/1e-2 of τ.
                let tolerance = CLOSED_FORM_RELATIVE * (1.0 + tau);
                assert!(close(got, (-tau).exp(), tolerance, 1e-30), "H {height}, d_y {d_y}, {t} m: {got}");
            }
        }
    }
}

#[test]
fn no_height_of_eye_or_ray_makes_haze_that_is_no_number() {
    for y in [-1e7f64, -5.0, 0.0, 1e7] {
        let seen = haze(1000.0, 1e-3, 0.0).seen_from(DVec3::new(0.0, y, 0.0));
        for d_y in [-1.0f32, 0.0, 1.0] {
            let t = seen.transmittance(d_y, 1e7);
            assert!((0.0..=1.0).contains(&t), "{y} {d_y}: {t}");
        }
    }
}

fn frame(preset: &str, sets: &[&str]) -> Frame {
    let scene = scene(preset, sets);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    cpu::render(&scene, &volume, &scene.mesh(), true, &Unwatched).expect("a frame")
}

const SMALL: [&str; 3] = ["image.width=96", "image.height=54", "image.samples=1"];

#[test]
fn rock_and_water_too_dense_to_look_through_dim_by_their_distance_and_the_background_stays() {
    let of = |more: &[&str]| {
        frame("waterfall", &[&SMALL[..], &["trace.sigma=1e5", "volume.alpha=1"], more].concat())
    };
    let (clear, hazy) = (
        of(&["haze.density=0"]),
        of(&["haze.density=0.06", "haze.color=[0.5,0.6,0.9]", "haze.scale_height=0"]),
    );
    let surface = clear.surface.as_ref().expect("asked for");
    let mut seen = [0; 3];
    for (i, (a, b)) in clear.radiance.iter().zip(&hazy.radiance).enumerate() {
        let distance = f64::from(surface.depth[i]);
        let t = if distance > 0.0 { (-0.06 * distance).exp() } else { 1.0 };
        let kind = if surface.quad[i] != 0 { 0 } else { 1 + usize::from(distance == 0.0) };
        // Cells without density let some water pixels through.
        if kind == 0 && a[3] > 1e-6 {
            continue;
        }
        seen[kind] += 1;
        for (c, colour) in [0.5, 0.6, 0.9].into_iter().enumerate() {
            let want = f64::from(a[c]) * t + colour * (1.0 - t);
            assert!(close(b[c].into(), want, 1e-5, 1e-6), "pixel {i}, kind {kind}: {} for {want}", b[c]);
        }
    }
    assert!(seen.iter().all(|&n| n > 20), "water, rock and background: {seen:?}");
}

#[test]
fn haze_of_the_colour_of_all_it_hides_is_not_seen() {
    let furnace = [
        "lights.key.intensity=0",
        "light.ambient=[0.3,0.5,0.7]",
        "background.zenith=[0.3,0.5,0.7]",
        "background.horizon=[0.3,0.5,0.7]",
        "haze.color=[0.3,0.5,0.7]",
        "haze.density=0.4",
        "haze.scale_height=2",
        "haze.far=9",
        "image.width=64",
        "image.height=64",
    ];
    let frame = frame("front", &furnace);
    let through = frame.radiance.iter().filter(|r| r[3] > 0.05 && r[3] < 0.95).count();
    assert!(through > 100, "see-through water: {through} pixels");
    for radiance in &frame.radiance {
        for (c, want) in [0.3, 0.5, 0.7].into_iter().enumerate() {
            // The walk rounds, and the haze rounds again what it removes and adds.
            assert!(close(radiance[c].into(), want, 2.0 * CLOSED_FORM_RELATIVE, 0.0), "{radiance:?}");
        }
    }
}

#[test]
fn the_engines_agree_in_haze() {
    let Some(mut renderer) = renderer("haze") else { return };
    let haze = ["haze.density=0.05", "haze.scale_height=3", "haze.level=-5", "haze.far=60"];
    for preset in ["waterfall", "evening"] {
        let sets = [&SMALL[..], &haze[..], &COARSE_PLACE[..], &["environment.lights=2"]].concat();
        assert_parity(preset, &both(&mut renderer, &scene(preset, &sets)));
    }
}
