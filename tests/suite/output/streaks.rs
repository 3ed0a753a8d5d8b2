//! Streaks and flicker, tested on gratings with known gradients.

use std::f64::consts::PI;
use std::process::Command;

use taki::output::frame::encode_png;
use taki::output::frame::streaks::{Flicker, Streaks, bands, decoded, luminance, streaks};
use taki::picture::Frame;
use taki::util::window::Window;

const SIZE: [u32; 2] = [700, 500];

fn picture(value: impl Fn(f64, f64) -> f64) -> Vec<f32> {
    let [w, h] = SIZE;
    (0..w * h).map(|i| value(f64::from(i % w), f64::from(i / w)) as f32).collect()
}

fn of(value: impl Fn(f64, f64) -> f64, part: Window) -> Streaks {
    streaks(&picture(value), SIZE[0] as usize, part)
}

fn near(got: f64, want: f64, relative: f64) {
    assert!((got - want).abs() <= relative * want.abs(), "{got} for {want}");
}

#[test]
fn a_slope_has_its_gradients() {
    let s = of(|x, y| 0.25 + 0.003 * x - 0.0005 * y, Window::whole(SIZE));
    // Float32 values of up to 2.4 have steps of 2.4e-7. In the sums only the errors of both ends remain: 1e-3
    // of the smaller gradient.
    near(s.across, 0.003, 1e-3);
    near(s.along, 0.0005, 1e-3);
    near(s.ratio.expect("it changes along the flow"), 6.0, 1e-3);
}

#[test]
fn a_grating_has_the_gradients_of_its_waves() {
    // Neighbours of sin ωx differ by 2·sin(ω/2)·cos(ω(x+½)), whose mean size is 2/π of its amplitude. The
    // other wave contributes its own mean size, 2/π, in both directions. Over n waves the means are good to
    // 1/n.
    let (omega, upsilon) = (0.9, 0.13);
    let s = of(|x, y| (omega * x).sin() * (upsilon * y).sin(), Window::whole(SIZE));
    let two = (2.0 / PI).powi(2);
    near(s.across, 2.0 * (omega / 2.0).sin() * two, 0.05);
    near(s.along, 2.0 * (upsilon / 2.0).sin() * two, 0.05);
    near(s.ratio.expect("a number"), (omega / 2.0).sin() / (upsilon / 2.0).sin(), 0.05);
}

#[test]
fn streaks_down_the_picture_are_above_one_and_turned_by_a_quarter_the_inverse() {
    let whole = Window::whole([500, 500]);
    let threads = |x: f64, y: f64| (0.8 * x + 0.4 * (0.05 * y).sin()).sin();
    let square = |value: &dyn Fn(f64, f64) -> f64| -> Vec<f32> {
        (0..500 * 500).map(|i| value(f64::from(i % 500), f64::from(i / 500)) as f32).collect()
    };
    let upright = streaks(&square(&threads), 500, whole).ratio.expect("a number");
    let turned = streaks(&square(&|x, y| threads(y, x)), 500, whole).ratio.expect("a number");
    assert!(upright > 10.0, "{upright}");
    near(turned, 1.0 / upright, 1e-9);
}

#[test]
fn bands_are_the_region_and_each_has_its_own_streaks() {
    let part = Window { x: 100, y: 33, width: 300, height: 401 };
    let cut = bands(part, 4);
    assert_eq!((cut[0].y, cut[3].bottom()), (part.y, part.bottom()));
    assert!(
        cut.windows(2).all(|w| w[0].bottom() == w[1].y) && cut.iter().all(|b| b.height.abs_diff(100) <= 1)
    );
    // Threads that break up on the way down: from band to band, the wave along the flow becomes twice as
    // fast.
    let upsilon = |y: f64| 0.05 * f64::from(1 << cut.iter().filter(|b| f64::from(b.bottom()) <= y).count());
    for (k, band) in cut.iter().enumerate() {
        let s = of(|x, y| (0.9 * x).sin() * (upsilon(y) * y).sin(), *band);
        let want = (0.45f64).sin() / (0.025 * f64::from(1 << k)).sin();
        // A band has one to six waves, so its ends are up to a fifth of the sum.
        near(s.ratio.expect("a number"), want, 0.2);
    }
}

#[test]
fn what_does_not_change_has_no_streaks_and_no_flicker() {
    let s = of(|_, _| 0.4, Window::whole(SIZE));
    assert_eq!((s.across, s.along, s.ratio), (0.0, 0.0, None));
    assert_eq!(of(|x, _| x, Window::whole(SIZE)).ratio, None, "endless threads");
    let mut flicker = Flicker::default();
    (0..9).for_each(|_| flicker.push(vec![0.4; 50]));
    assert_eq!(flicker.share(), Some(0.0));
}

fn flicker(frames: u32, value: impl Fn(f64, f64) -> f64) -> Option<f64> {
    let mut flicker = Flicker::default();
    for t in 0..frames {
        flicker.push((0..40).map(|i| value(f64::from(t), f64::from(i)) as f32).collect());
    }
    flicker.share()
}

#[test]
fn flicker_is_what_alternates_and_not_what_moves_steadily() {
    near(
        flicker(21, |t, _| 2.0 + if t % 2.0 == 0.0 { 0.5 } else { -0.5 }).expect("told"),
        0.5 / (2.0 + 0.5 / 21.0),
        1e-6,
    );
    assert!(flicker(20, |t, i| 1.0 + 0.01 * t + i).expect("told") < 1e-6, "a drift");
    // The filter (−¼, ½, −¼) leaves sin²(ω/2) of a·sin ωt. Its root mean square is a/√2, over 2000 frames to
    // 1e-3.
    for omega in [0.1f64, 1.0, 2.5] {
        let got = flicker(2000, |t, i| 3.0 + 0.3 * (omega * t + i).sin()).expect("told");
        near(got, 0.1 / 2f64.sqrt() * (omega / 2.0).sin().powi(2), 5e-3);
    }
    assert_eq!(flicker(2, |t, _| t), None, "two frames tell nothing");
    assert_eq!(flicker(5, |_, _| 0.0), None, "darkness tells nothing");
}

#[test]
fn luminance_is_of_linear_light() {
    assert!((luminance([1.0, 1.0, 1.0]) - 1.0).abs() < 1e-6);
    // Half of the encoded range is 21.4 % of the light (IEC 61966-2-1).
    assert!((decoded(0.5) - 0.21404).abs() < 1e-5 && decoded(1.0) == 1.0 && decoded(0.0) == 0.0);
}

#[test]
fn the_command_line_tells_them_of_the_region_and_refuses_what_has_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut frame = Frame::new(64, 48, false);
    for t in 0..3u8 {
        for (i, pixel) in frame.picture.iter_mut().enumerate() {
            // Threads on the left, cross-bars on the right. Every frame is a little brighter or darker.
            let (x, y) = (i % 64, i / 64);
            let on = if x < 32 { x % 2 == 0 } else { y % 2 == 0 };
            *pixel = [if on { 200 } else { 100 } + 20 * (t % 2) + (y / 8) as u8; 4];
        }
        std::fs::write(folder.path().join(format!("{t}.png")), encode_png(&frame, &[]).expect("PNG"))
            .expect("written");
    }
    std::fs::write(folder.path().join("a.exr"), []).expect("written");
    let run = |args: &[&str]| {
        let mut taki = Command::new(env!("CARGO_BIN_EXE_taki"));
        taki.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
        let out = taki.arg("compare").args(args).current_dir(folder.path()).output().expect("it runs");
        (out.status.code(), String::from_utf8(out.stdout).expect("UTF-8"))
    };
    let json = |args: &[&str]| -> serde_json::Value {
        let (code, out) = run(&[&["--eye", "--json", "0.png", "1.png", "2.png"], args].concat());
        assert_eq!(code, Some(0));
        serde_json::from_str(&out).expect("JSON")
    };
    let ratio = |of: &serde_json::Value| of["pictures"][0]["streaks"]["ratio"].as_f64().expect("a ratio");
    let (left, right) = (json(&["--region", "0,0,32,48", "--bands", "3"]), json(&["--region", "32,0,32,48"]));
    assert!(ratio(&left) > 10.0 && ratio(&right) < 0.1, "{left} {right}");
    assert_eq!(left["pictures"][0]["bands"].as_array().expect("bands").len(), 3);
    assert!(left["flicker"].as_f64().expect("a number") > 0.01);
    for (args, code) in [
        (&["0.png"][..], 2),
        (&["0.png", "1.png", "2.png"], 2),
        (&["--eye", "0.png", "a.exr"], 2),
        (&["--eye", "0.png", "--region", "60,0,8,8"], 2),
        (&["--eye", "0.png", "--bands", "25"], 2),
        (&["--eye", "0.png", "--bands", "0"], 2),
        (&["0.png", "1.png", "--bands", "2"], 2),
        (&["--eye", "0.png", "--share", "0.5"], 2),
        (&["--eye", "0.png"], 0),
        (&["0.png", "0.png"], 0),
        (&["0.png", "1.png"], 1),
    ] {
        assert_eq!(run(args).0, Some(code), "{args:?}");
    }
}
