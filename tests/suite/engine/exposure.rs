//! Automatic exposure: its measurement against closed forms, and one exposure for all frames and parts.

use std::path::Path;
use std::process::Command;

use super::gpu::scene;
use taki::engine::exposure::{exposed, measure, stops};
use taki::picture::AutoExposure::{self, Average, Highlights};
use taki::scene::{Animation, Limits};
use taki::util::monitor::Unwatched;

fn noise() -> Vec<[f32; 3]> {
    (0..1000).map(|i| [((i * 7919) % 101) as f32 / 50.0, ((i * 31) % 17) as f32, 0.1]).collect()
}

#[test]
fn an_even_grey_is_brought_to_middle_grey_or_to_one() {
    for k in [-9, -1, 0, 3, 8] {
        let grey = |x: f32| vec![[x * (k as f32).exp2(); 3]; 50];
        assert_eq!(stops(Average, grey(0.18).into_iter()), -k as f32);
        assert_eq!(stops(Highlights, grey(1.0).into_iter()), -k as f32);
    }
}

#[test]
fn twice_the_light_is_one_stop_less() {
    for method in [Average, Highlights] {
        let once = stops(method, noise().into_iter());
        let twice = stops(method, noise().into_iter().map(|p| p.map(|x| 2.0 * x)));
        assert_eq!(twice, once - 1.0, "{method:?}");
    }
}

#[test]
fn the_average_is_that_of_the_logarithm_of_luminance() {
    // Half of the pixels are at 2^-1 and half at 2^-5, so the logarithmic mean is 2^-3; the arithmetic mean
    // would be above 2^-2. The measurement works in 64ths of a stop. The dark floor adds 1e-3 of the mean,
    // which is 0.012 stops for the dark half.
    let pixels = (0..100).map(|i| [if i % 2 == 0 { 0.5 } else { 0.03125 }; 3]);
    let got = stops(Average, pixels);
    let want = 0.18f32.log2() + 3.0;
    assert!((got - want).abs() < 0.5 / 64.0 + 0.007, "{got} for {want}");
}

#[test]
fn a_hundredth_of_the_pixels_may_be_brighter_than_one() {
    let with = |bright: usize| (0..200).map(move |i| [if i < bright { 8.0 } else { 2.0 }; 3]);
    assert_eq!((stops(Highlights, with(2)), stops(Highlights, with(3))), (-1.0, -3.0));
}

#[test]
fn darkness_is_left_as_it_is() {
    for method in [Average, Highlights] {
        assert_eq!(stops(method, vec![[0.0; 3]; 9].into_iter()), 0.0);
        assert_eq!(stops(method, [[f32::NAN; 3]; 9].into_iter()), 0.0);
        assert_eq!(stops(method, std::iter::empty()), 0.0);
    }
    assert_eq!(stops(AutoExposure::None, noise().into_iter()), 0.0);
}

#[test]
fn a_scene_in_four_times_the_light_gets_two_stops_less_at_every_size() {
    let of = |sets: &[&str]| {
        let scene = scene(
            "front",
            &[&["image.auto_exposure=average", "image.width=300", "image.height=200"], sets].concat(),
        );
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        measure(&scene, &volume, &scene.mesh(), &Unwatched).expect("measured")
    };
    let once = of(&["lights.key.intensity=1", "light.ambient=[0.1,0.1,0.1]"]);
    assert_eq!(of(&["lights.key.intensity=4", "light.ambient=[0.4,0.4,0.4]"]), once - 2.0);
    assert_eq!(
        of(&[
            "lights.key.intensity=1",
            "light.ambient=[0.1,0.1,0.1]",
            "image.width=1200",
            "image.height=800"
        ]),
        once
    );
}

#[test]
fn every_frame_has_the_exposure_of_the_first_and_its_scene_alone_gives_the_same_picture() {
    let sets = ["image.auto_exposure=highlights", "image.exposure=0.5", "animate.turn=8"].map(String::from);
    let animation = Animation::load(Path::new("front"), &sets, &Limits::default()).expect("an animation");
    let (animation, chosen) = exposed(animation, &Unwatched).expect("measured");
    let chosen = chosen.expect("asked for");
    for frame in [0, 1, 5] {
        let scene = animation.at(frame).expect("a scene");
        let look = scene.image.look;
        assert_eq!((look.exposure, look.auto_exposure), (0.5 + chosen, AutoExposure::None));
        assert!(
            scene.to_toml().contains("auto_exposure = \"none\""),
            "the scene that a picture contains is not measured again"
        );
    }
    let changed = animation.with(&[]).expect("the same");
    assert_eq!(changed.at(3).expect("a scene").image.look.exposure, 0.5 + chosen);
}

#[test]
fn the_command_line_tells_what_was_chosen_and_parts_agree_with_the_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |args: &[&str]| {
        let mut taki = Command::new(env!("CARGO_BIN_EXE_taki"));
        taki.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
        let out = taki.args(args).current_dir(folder.path()).output().expect("it runs");
        (
            out.status.code(),
            String::from_utf8(out.stdout).expect("UTF-8"),
            String::from_utf8_lossy(&out.stderr).into_owned(),
        )
    };
    let auto = ["--set", "image.auto_exposure=average", "--size", "64x40", "--engine", "cpu", "--json"];
    let json = |args: &[&str]| -> serde_json::Value {
        let (code, out, err) = run(&[&["render", "front"], &auto[..], args].concat());
        assert_eq!(code, Some(0), "{err}");
        serde_json::from_str(&out).expect("JSON")
    };
    let whole = json(&["-o", "whole.png"]);
    let chosen = whole["auto_exposure"].as_f64().expect("a number");
    assert!(chosen != 0.0 && whole["exposure"].as_f64() == Some(chosen));
    json(&["-o", "a.png", "--crop", "0,0,64,15"]);
    json(&["-o", "b.png", "--crop", "0,15,64,25"]);
    assert_eq!(run(&["stitch", "a.png", "b.png", "-o", "joined.png"]).0, Some(0));
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).expect("a file");
    assert!(bytes("joined.png") == bytes("whole.png"));
    let (code, _, text) = run(&[
        "batch",
        "front",
        "--sweep",
        "image.auto_exposure=average,highlights",
        "-o",
        "{auto_exposure}.png",
    ]);
    assert!(code == Some(2) && text.contains("sweep image.exposure"), "{text}");
}
