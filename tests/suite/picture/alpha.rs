//! Alpha: the picture over a backdrop is the picture with that backdrop, on both engines; holdouts, hidden
//! things, haze and bloom.

use crate::engine::gpu::{both, renderer, scene};
use crate::tolerance::Parity;
use taki::engine::{RenderOptions, cpu};
use taki::picture::Frame;
use taki::scene::{Scene, presets};
use taki::util::monitor::Unwatched;
use taki::util::window::Window;

/// A backdrop that a scene can have as its background too.
const BACKDROP: [f32; 3] = [0.3, 0.5, 0.9];
const EVEN: [&str; 2] = ["background.zenith=[0.3, 0.5, 0.9]", "background.horizon=[0.3, 0.5, 0.9]"];
const SMALL: [&str; 3] = ["image.width=96", "image.height=54", "image.samples=2"];

fn on_cpu(scene: &Scene) -> Frame {
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    cpu::render(scene, &volumes, &scene.mesh(), false, &Unwatched).expect("a frame")
}

/// Puts a frame with alpha over a backdrop, pixel by pixel.
fn over(frame: &Frame, backdrop: impl Fn(usize) -> [f32; 3]) -> Vec<[f32; 3]> {
    let alpha = frame.alpha.as_ref().expect("an alpha channel");
    let pixels = frame.radiance.iter().zip(alpha).enumerate();
    pixels.map(|(i, (r, a))| [0, 1, 2].map(|c| r[c] + (1.0 - a) * backdrop(i)[c])).collect()
}

/// Asserts that two pictures differ by no more than the rounding of sums of a few numbers near 1.
fn assert_equal(what: &str, got: &[[f32; 3]], want: &Frame) {
    for (i, (got, want)) in got.iter().zip(&want.radiance).enumerate() {
        for c in 0..3 {
            let near = (got[c] - want[c]).abs() <= 2e-6 * (1.0 + want[c].abs());
            assert!(near, "{what}, pixel {i}: {got:?} for {want:?}");
        }
    }
}

fn hazes() -> [Vec<&'static str>; 2] {
    let haze = ["haze.density=0.03", "haze.scale_height=5", "haze.far=40"];
    [Vec::new(), haze.to_vec()]
}

#[test]
fn every_preset_over_a_backdrop_is_the_preset_with_that_background() {
    for (preset, _) in presets() {
        for haze in hazes() {
            let sets = [&EVEN[..], &SMALL, &haze, &["environment.kind=none"]].concat();
            let want = on_cpu(&scene(preset, &sets));
            let got = on_cpu(&scene(preset, &[&sets[..], &["image.alpha=true"]].concat()));
            assert!(want.alpha.is_none() && want.picture.iter().all(|p| p[3] == 255), "{preset}");
            assert_equal(preset, &over(&got, |_| BACKDROP), &want);
            let alpha = got.alpha.expect("an alpha channel");
            assert!(alpha.iter().all(|a| (-1e-6..=1.0).contains(a)), "{preset}");
            assert!(alpha.iter().any(|&a| a > 0.2), "{preset} hides something");
        }
    }
}

#[test]
fn an_environment_gives_light_and_is_not_seen() {
    let sets = [&SMALL[..], &["environment.kind=sky", "environment.lights=2"]].concat();
    let seen = on_cpu(&scene("fig5", &sets));
    let frame = on_cpu(&scene("fig5", &[&sets[..], &["image.alpha=true"]].concat()));
    let alpha = frame.alpha.as_ref().expect("an alpha channel");
    let (mut clear, mut solid) = (0, 0);
    for ((a, b), &alpha) in frame.radiance.iter().zip(&seen.radiance).zip(alpha) {
        if alpha == 0.0 {
            assert_eq!(a[..3], [0.0; 3], "the sky is not seen");
            clear += 1;
        }
        if alpha == 1.0 {
            assert_eq!(a, b, "rock is lit as under the sky");
            solid += 1;
        }
    }
    assert!(clear > 100 && solid > 100, "{clear} pixels of sky, {solid} of rock");
}

#[test]
fn water_over_a_picture_of_the_rock_with_the_rock_held_out_is_the_picture_of_both() {
    let sets = ["image.width=96", "image.height=154", "image.samples=1", "haze.density=0"];
    let whole = on_cpu(&scene("fig5", &sets));
    let mut photo = scene("fig5", &sets);
    photo.edit().quads.clear();
    let photo = on_cpu(&photo);
    let plain = scene("fig5", &[]);
    let holdout = |rock: &taki::place::Rock| format!("rocks.{}.show=holdout", rock.name);
    let holdouts: Vec<String> = plain.rocks.iter().map(holdout).collect();
    let mut sets = [&sets[..], &["image.alpha=true"]].concat();
    sets.extend(holdouts.iter().map(String::as_str));
    let held_out = on_cpu(&scene("fig5", &sets));
    let backdrop = |i: usize| [0, 1, 2].map(|c| photo.radiance[i][c]);
    assert_equal("fig5", &over(&held_out, backdrop), &whole);
    let rock_alone =
        (0..photo.radiance.len()).filter(|&i| whole.counts[i][0] == 0 && photo.radiance[i][0] > 0.0);
    let alpha = held_out.alpha.as_ref().expect("an alpha channel");
    let mut count = 0;
    for i in rock_alone {
        assert_eq!((alpha[i], held_out.radiance[i][0]), (0.0, 0.0), "a hole where there is only rock");
        count += 1;
    }
    assert!(count > 500, "{count} pixels of rock");
}

#[test]
fn a_holdout_hides_what_is_behind_it_and_is_seen_without_alpha() {
    let sets = [&SMALL[..], &["rocks.foot.show=holdout"]].concat();
    assert_eq!(on_cpu(&scene("fig5", &sets)).radiance, on_cpu(&scene("fig5", &SMALL)).radiance);
    // The whole pool is a hole, though the ground and the wall lie behind it.
    let coarse = |more: &[&str]| {
        let all = [&crate::engine::gpu::COARSE_PLACE[..], &SMALL, &["image.alpha=true"], more].concat();
        let mut scene = scene("waterfall", &all);
        scene.edit().quads.clear();
        on_cpu(&scene)
    };
    let (seen, held_out) = (coarse(&[]), coarse(&["pools.plunge.show=holdout", "haze.density=0"]));
    let (seen, held_out) = (seen.alpha.expect("alpha"), held_out.alpha.expect("alpha"));
    let holes = seen.iter().zip(&held_out).filter(|(seen, held)| **seen == 1.0 && **held == 0.0).count();
    assert!(holes > 100, "{holes} pixels of pool are a hole");
}

#[test]
fn what_is_hidden_is_left_out_of_the_scene() {
    let hidden = scene("fig5", &[&SMALL[..], &["rocks.foot.show=hidden"]].concat());
    let mut removed = scene("fig5", &SMALL);
    removed.edit().rocks.retain(|rock| rock.name != "foot");
    assert_eq!(hidden.rocks, removed.rocks);
    assert_eq!(on_cpu(&hidden).radiance, on_cpu(&removed).radiance);
    let dry = scene("waterfall", &["pools.plunge.show=hidden"]);
    assert!(dry.pools.is_empty());
}

#[test]
fn both_engines_have_the_same_alpha_and_picture() {
    let Some(mut renderer) = renderer("alpha") else { return };
    let coarse = crate::engine::gpu::COARSE_PLACE;
    let holdouts = ["rocks.wall.show=holdout", "pools.plunge.show=holdout", "haze.density=0.02"];
    let cases = [
        ("fig5", ["image.alpha=true", "rocks.foot.show=holdout"].to_vec()),
        ("front", ["image.alpha=true", "image.bloom=0.4"].to_vec()),
        ("waterfall", [&coarse[..], &holdouts, &["image.alpha=true"]].concat()),
        ("night", [&["image.alpha=true", "haze.far=20"][..]].concat()),
    ];
    let parity = Parity::of_adapter();
    for (preset, sets) in cases {
        let frames = both(&mut renderer, &scene(preset, &[&SMALL[..], &sets].concat()));
        let [a, b] = frames.each_ref().map(|frame| frame.alpha.as_ref().expect("an alpha channel"));
        let far = a.iter().zip(b).filter(|(a, b)| (**a - **b).abs() > parity.relative).count();
        assert!(
            far as f64 <= 3.0 * (1.0 - parity.share) * a.len() as f64,
            "{preset}: {far} of {} differ",
            a.len()
        );
        let [a, b] = frames.each_ref().map(|frame| &frame.picture);
        let far = a.iter().zip(b).filter(|(a, b)| (0..4).any(|c| a[c].abs_diff(b[c]) > 2 && a[3] > 8));
        let far = far.count();
        assert!(far as f64 <= 10.0 * (1.0 - parity.share) * a.len() as f64, "{preset}: {far} pixels differ");
    }
}

#[test]
fn a_crop_has_the_alpha_of_the_whole_bit_for_bit() {
    let scene = scene("fig5", &[&SMALL[..], &["image.alpha=true"]].concat());
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let mesh = scene.mesh();
    let window = Window { x: 21, y: 13, width: 40, height: 30 };
    let whole = on_cpu(&scene);
    let options = RenderOptions { window: Some(window), ..Default::default() };
    let crop = cpu::render_with(&scene, &volume, &mesh, &options, &mut Default::default(), &Unwatched)
        .expect("a crop");
    let size = Window::whole([whole.width, whole.height]);
    for y in 0..window.height {
        for x in 0..window.width {
            let (i, j) = (size.index([window.x + x, window.y + y]), (y * window.width + x) as usize);
            assert_eq!(crop.picture[j], whole.picture[i]);
            assert_eq!(crop.alpha.as_ref().unwrap()[j], whole.alpha.as_ref().unwrap()[i]);
        }
    }
}

/// Decodes an sRGB byte.
fn linear(byte: u8) -> f64 {
    let x = f64::from(byte) / 255.0;
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

#[test]
fn the_developed_picture_over_a_backdrop_is_the_picture_with_it_also_with_bloom() {
    for bloom in ["image.bloom=0", "image.bloom=0.5"] {
        let look = ["image.tone=none", "image.exposure=0", "image.bloom_radius=0.05", bloom];
        let sets = [&EVEN[..], &SMALL, &look].concat();
        let want = on_cpu(&scene("front", &sets));
        let got = on_cpu(&scene("front", &[&sets[..], &["image.alpha=true"]].concat()));
        let mut between = 0;
        for (got, want) in got.picture.iter().zip(&want.picture) {
            let alpha = f64::from(got[3]) / 255.0;
            between += u32::from(got[3] > 0 && got[3] < 255);
            for c in 0..3 {
                let mixed = alpha * linear(got[c]) + (1.0 - alpha) * f64::from(BACKDROP[c]);
                // Half a step of alpha, and half a step of each colour where sRGB is steepest.
                let most = 0.5 / 255.0 * (1.0 + 2.0 * 2.3);
                assert!((mixed - linear(want[c])).abs() <= most, "{bloom}: {got:?} for {want:?}");
            }
        }
        assert!(between > 100, "{between} pixels are half transparent");
    }
}
