//! Bloom: its spread against closed forms, conservation of light, parity of the engines, and refusal of
//! crops.

use std::path::Path;
use std::process::Command;

use crate::engine::gpu::{both, renderer, scene};
use taki::job::check_bloom;
use taki::picture::bloom::{Bloom, OCTAVES, shares};
use taki::picture::resolve::{develop, develop_whole};
use taki::picture::{Frame, Look};
use taki::util::window::Window;

fn look(bloom: f32, bloom_radius: f32) -> Look {
    Look { bloom, bloom_radius, ..scene("front", &[]).image.look }
}

fn spread(radiance: &[[f32; 4]], width: usize, look: &Look) -> Vec<[f32; 3]> {
    let bloom = Bloom::new(radiance, [width, radiance.len() / width], look);
    (0..radiance.len()).map(|i| bloom.pixel(i)).collect()
}

/// Bright and dark pixels, the same in every run.
fn noise(pixels: usize) -> Vec<[f32; 4]> {
    let value = |i: usize| ((i * 7919 + 13) % 101) as f32 / 101.0;
    (0..pixels).map(|i| [value(i), 3.0 * value(i + 1), if i % 37 == 0 { 50.0 } else { 0.0 }, 0.5]).collect()
}

#[test]
fn a_points_light_is_spread_about_it_by_the_mean_of_the_octaves_variances_and_none_is_lost() {
    const N: usize = 256;
    for (x, y) in [(128, 128), (101, 90), (90, 133)] {
        for radius in [0.5, 2.3, 9.0] {
            let mut radiance = vec![[0.0, 0.0, 0.0, 1.0]; N * N];
            radiance[y * N + x] = [1.0, 2.0, 0.0, 1.0];
            let out = spread(&radiance, N, &look(1.0, radius as f32 / N as f32));
            let mut moments = [0.0f64; 5];
            for (i, pixel) in out.iter().enumerate() {
                let (dx, dy) = ((i % N) as f64 - x as f64, (i / N) as f64 - y as f64);
                let of = [1.0, dx, dy, dx * dx, dy * dy];
                (0..5).for_each(|k| moments[k] += f64::from(pixel[0]) * of[k]);
                assert_eq!(pixel[1], 2.0 * pixel[0], "channels are alike");
                assert_eq!(pixel[2], 0.0, "a dark channel gets no light from another");
            }
            let want: f64 =
                (0..OCTAVES).map(|j| (radius / f64::from(1 << j)).powi(2)).sum::<f64>() / f64::from(OCTAVES);
            // These are float32 sums of some 10⁴ values. Far values count with the square of some 50 pixels.
            assert!((moments[0] - 1.0).abs() < 1e-5, "light: {}", moments[0]);
            assert!(moments[1].abs() < 1e-3 && moments[2].abs() < 1e-3, "place: {moments:?}");
            for variance in [moments[3], moments[4]] {
                assert!(
                    (variance / want - 1.0).abs() < 1e-3,
                    "σ {radius} at ({x}, {y}): {variance} for {want}"
                );
            }
        }
    }
}

#[test]
fn the_levels_shares_are_one_light() {
    for radius in [0.0, 0.1, 0.7, 1.0, 3.0, 28.8, 1000.0] {
        let shares = shares(radius);
        assert!(
            (shares.iter().sum::<f64>() - 1.0).abs() < 1e-12 && shares.iter().all(|&s| s >= 0.0),
            "{shares:?}"
        );
    }
    assert_eq!(shares(0.0), [1.0]);
}

#[test]
fn an_even_picture_stays_as_it_is_at_every_size() {
    for (width, height) in [(1, 1), (1, 7), (33, 5), (63, 65), (128, 64)] {
        let out = spread(&vec![[0.25, 0.5, 4.0, 1.0]; width * height], width, &look(0.7, 0.2));
        for pixel in out {
            let near = |got: f32, want: f32| (got / want - 1.0).abs() < 1e-6;
            assert!(
                near(pixel[0], 0.25) && near(pixel[1], 0.5) && near(pixel[2], 4.0),
                "{width}×{height}: {pixel:?}"
            );
        }
    }
}

#[test]
fn a_picture_of_whole_levels_keeps_the_sum_of_its_light() {
    let radiance = noise(256 * 128);
    let sum = |channel: &mut dyn Iterator<Item = f32>| channel.map(f64::from).sum::<f64>();
    let out = spread(&radiance, 256, &look(0.6, 0.1));
    for c in 0..3 {
        let before = sum(&mut radiance.iter().map(|p| p[c]));
        let after = sum(&mut out.iter().map(|p| p[c]));
        assert!((after / before - 1.0).abs() < 1e-6, "channel {c}: {before} became {after}");
    }
}

#[test]
fn bloom_is_a_share_and_none_of_it_changes_no_byte() {
    let radiance = noise(96 * 54);
    let (all, half) = (spread(&radiance, 96, &look(1.0, 0.05)), spread(&radiance, 96, &look(0.5, 0.05)));
    for ((own, all), half) in radiance.iter().zip(&all).zip(&half) {
        for c in 0..3 {
            let want = 0.5 * (own[c] + all[c]);
            assert!((half[c] - want).abs() <= 1e-5 * (1.0 + want), "{} for {want}", half[c]);
        }
    }
    let picture = |bloom: f32, whole: bool| {
        let mut frame = Frame::new(96, 54, false);
        frame.radiance = radiance.clone();
        let image = [96, if whole { 54 } else { 55 }];
        develop(&mut frame, &look(bloom, 0.05), Window::whole([96, 54]), image);
        frame.picture
    };
    assert_eq!(picture(0.0, true), picture(0.3, false));
    assert_ne!(picture(0.0, true), picture(0.3, true));
}

#[test]
fn a_pixel_that_is_no_number_does_not_blind_the_others() {
    let mut radiance = vec![[1.0, 1.0, 1.0, 1.0]; 64 * 64];
    radiance[64 * 20 + 20] = [f32::NAN, f32::INFINITY, 1.0, 1.0];
    let out = spread(&radiance, 64, &look(0.5, 0.1));
    assert_eq!(out.iter().filter(|p| !p.iter().all(|x| x.is_finite())).count(), 1);
}

#[test]
fn both_engines_bloom_the_picture_and_leave_the_radiance() {
    let Some(mut renderer) = renderer("bloom") else { return };
    let of =
        |bloom: &str| scene("front", &["image.width=64", "image.height=48", bloom, "image.bloom_radius=0.1"]);
    let (plain, blooming) =
        (both(&mut renderer, &of("image.bloom=0")), both(&mut renderer, &of("image.bloom=0.4")));
    for (plain, blooming) in plain.into_iter().zip(blooming) {
        assert_eq!(plain.radiance, blooming.radiance);
        assert_ne!(plain.picture, blooming.picture);
        let mut again = plain.clone();
        develop_whole(&mut again, &of("image.bloom=0.4").image.look);
        assert_eq!(again.picture, blooming.picture);
    }
}

#[test]
fn parts_of_a_picture_with_bloom_are_refused_and_of_an_exr_are_not() {
    let scene = scene("front", &["image.bloom=0.1", "image.width=64", "image.height=48"]);
    let part = Window { x: 0, y: 0, width: 64, height: 20 };
    let whole = Window::whole([64, 48]);
    assert!(check_bloom(&scene, whole, 1).is_ok());
    for (window, strips, word) in [(part, 1, "render the whole"), (whole, 3, "raise --memory")] {
        let text = check_bloom(&scene, window, strips).expect_err("refused").to_string();
        assert!(text.contains("image.bloom = 0.1") && text.contains(word), "{text}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let run = |command: &str, name: &str, sets: &[&str]| {
        let mut taki = Command::new(env!("CARGO_BIN_EXE_taki"));
        taki.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
        taki.args([command, "front", "--engine", "cpu", "--size", "64x48", "-o", name]).args(sets);
        let out = taki.current_dir(folder.path()).output().expect("it runs");
        (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let bloom = ["--set", "image.bloom=0.1"];
    let crop = ["--set", "image.bloom=0.1", "--crop", "0,0,64,20"];
    assert_eq!(run("render", "part.exr", &crop).0, Some(0));
    assert_eq!(run("render", "whole.png", &bloom).0, Some(0));
    for (command, name) in [("render", "part.png"), ("batch", "part.####.png")] {
        let (code, text) = run(command, name, &crop);
        assert_eq!(code, Some(65), "{text}");
        assert!(text.contains("image.bloom = 0.1 spreads light over the whole picture"), "{text}");
    }
    assert!(!Path::new(&folder.path().join("part.png")).exists());
}
