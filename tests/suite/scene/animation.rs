//! Animated scenes: keyframes, loops, turntables, camera paths.

use std::path::PathBuf;

use glam::Vec3;
use taki::scene::{Animation, Limits, Source, Value};

fn source(text: &str) -> Source {
    Source { name: "s".into(), origin: "s.toml".into(), folder: PathBuf::from("."), text: text.into() }
}

fn animation(animate: &str) -> Result<Animation, String> {
    let text = format!("version = 1\nbase = \"fig5\"\n{animate}");
    let values = source(&text).values().map_err(|e| e.to_string())?;
    Animation::new("s", values, None, &Limits::default()).map_err(|e| {
        assert_eq!(e.exit_code(), 65, "{e}");
        e.to_string()
    })
}

fn float(animation: &Animation, frame: i32, key: &str) -> f32 {
    animation.at(frame).unwrap().values().unwrap().float(key)
}

fn track(interpolation: &str, more: &str) -> Animation {
    animation(&format!(
        "[animate]\nspeed = 0.0\n{more}\n[[animate.tracks]]\nkey = \"trace.tau\"\nframes = [10, 20, 40]\n\
         values = [1.0, 3.0, 2.0]\ninterpolation = \"{interpolation}\"\n"
    ))
    .unwrap()
}

#[test]
fn keyframes_are_met_and_between_them_lies_what_was_asked_for() {
    for interpolation in ["linear", "smooth", "hold"] {
        let a = track(interpolation, "");
        for (frame, value) in [(0, 1.0), (10, 1.0), (20, 3.0), (40, 2.0), (1000, 2.0)] {
            assert_eq!(float(&a, frame, "trace.tau"), value, "{interpolation} at {frame}");
        }
    }
    assert_eq!(float(&track("linear", ""), 15, "trace.tau"), 2.0);
    assert_eq!(float(&track("linear", ""), 25, "trace.tau"), 2.75);
    assert_eq!(float(&track("hold", ""), 19, "trace.tau"), 1.0);
    assert_eq!(float(&track("hold", ""), 39, "trace.tau"), 3.0);
    // With slopes of zero at both ends, the cubic is 3s² − 2s³.
    assert_eq!(float(&track("smooth", ""), 15, "trace.tau"), 2.0);
    let quarter = 1.0 + 2.0 * (3.0 * 0.04 - 2.0 * 0.008);
    assert!((float(&track("smooth", ""), 12, "trace.tau") - quarter).abs() < 1e-6);
}

#[test]
fn a_smooth_track_never_overshoots_and_has_no_corner() {
    let a = animation(
        "[[animate.tracks]]\nkey = \"trace.tau\"\nframes = [0, 40, 80, 120, 160]\n\
         values = [0, 1, 1.2, 5, 0]\ninterpolation = \"smooth\"\n",
    )
    .unwrap();
    let values: Vec<f32> = (0..=160).map(|f| float(&a, f, "trace.tau")).collect();
    assert!(values[..=120].is_sorted() && values[120..].is_sorted_by(|a, b| a >= b), "{values:?}");
    // At frame 80, a corner of a straight-line track would change the slope by 0.09 at once.
    for w in values.windows(3) {
        assert!((w[2] - 2.0 * w[1] + w[0]).abs() < 0.02, "{w:?}");
    }
}

#[test]
fn every_kind_of_number_can_move() {
    let a = animation(
        "[[animate.tracks]]\nkey = \"trace.max_cells\"\nframes = [0, 4]\nvalues = [1, 4]\n\
         [[animate.tracks]]\nkey = \"lights.sun.color\"\nframes = [0, 4]\nvalues = [[0, 0, 0], [1, 2, 4]]\n\
         [[animate.tracks]]\nkey = \"quads.0.corners\"\nframes = [0, 4]\n\
         values = [[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], \
         [[0, 0, 4], [1, 0, 4], [1, 1, 4], [0, 1, 4]]]\n",
    )
    .unwrap();
    let scene = a.at(1).unwrap();
    assert_eq!(scene.values().unwrap().get("trace.max_cells"), Value::Int(2));
    assert_eq!(scene.values().unwrap().get("lights.sun.color"), Value::Triple([0.25, 0.5, 1.0]));
    assert_eq!(scene.quads[0].corners[2], Vec3::new(1.0, 1.0, 1.0));
}

#[test]
fn the_water_flows_by_itself_and_a_loop_of_it_closes_exactly() {
    let a = animation("[animate]\nfps = 10.0\nspeed = 0.5\n[volume]\nflow = 0.25\n").unwrap();
    assert_eq!(float(&a, 0, "volume.flow"), 0.25);
    assert_eq!(float(&a, 10, "volume.flow"), 0.75);
    // 2.4 s at half a length a second make 1.2 lengths. A loop rounds that to one.
    let a = animation("[animate]\nfps = 10.0\nspeed = 0.5\nloop = 24\n").unwrap();
    assert_eq!(a.frames, 24);
    assert_eq!(float(&a, 12, "volume.flow"), 0.5);
    assert_eq!(float(&a, 6, "volume.flow"), 0.25);
    for frame in [0, 1, 7, 23] {
        assert_eq!(a.at(frame).unwrap().to_toml(), a.at(frame + 24).unwrap().to_toml());
        assert_eq!(a.at(frame).unwrap().to_toml(), a.at(frame + 24_000_000).unwrap().to_toml());
    }
    // Slow water still moves, also upwards.
    let flow = |speed: &str| {
        let a = animation(&format!("[animate]\nspeed = {speed}\nloop = 24\n")).unwrap();
        float(&a, 12, "volume.flow")
    };
    assert_eq!([flow("0.01"), flow("-0.01"), flow("0.0")], [0.5, -0.5, 0.0]);
    let still = animation("[animate]\nspeed = 0.0\n").unwrap();
    assert_eq!(still.at(0).unwrap().to_toml(), still.at(50).unwrap().to_toml());
}

#[test]
fn a_track_of_a_loop_comes_round() {
    let a = track("linear", "loop = 60");
    // The track runs from 2 at frame 40 back to 1 at frame 60 + 10.
    for (frame, value) in [(40, 2.0), (55, 1.5), (60, 1.0 + 10.0 / 30.0), (0, 1.0 + 10.0 / 30.0), (70, 1.0)] {
        assert!((float(&a, frame, "trace.tau") - value).abs() < 1e-6, "{frame}");
    }
    let closed = "[animate]\nloop = 8\n[[animate.tracks]]\nkey = \"trace.tau\"\nframes = [0, 4, 8]\n";
    assert!(animation(&format!("{closed}values = [1, 2, 1]\n")).is_ok());
    let error = animation(&format!("{closed}values = [1, 2, 3]\n")).unwrap_err();
    assert!(error.contains("jump where the loop of 8 frames closes"), "{error}");
    let error = animation(&format!("{closed}values = [1, 2, 1]\n").replace("8]", "9]")).unwrap_err();
    assert!(error.contains("frame 9, which is past the loop of 8 frames"), "{error}");
}

#[test]
fn a_turntable_goes_round_its_target_at_one_distance() {
    let a = animation("[animate]\nturn = 24\n").unwrap();
    let place = |frame: i32| {
        let scene = a.at(frame).unwrap();
        let v = scene.values().unwrap();
        v.triple("camera.eye") - v.triple("camera.target")
    };
    assert_eq!(place(0), place(24));
    let start = place(0);
    for frame in 1..24 {
        let p = place(frame);
        assert!((p.length() - start.length()).abs() < 1e-4 && (p.y - start.y).abs() < 1e-4, "{frame}: {p}");
        let flat = |v: Vec3| Vec3::new(v.x, 0.0, v.z);
        let angle = flat(place(frame - 1)).angle_between(flat(p)).to_degrees();
        assert!((angle - 15.0).abs() < 0.01, "{frame}: {angle}");
    }
    assert!((place(12).x + start.x).abs() < 1e-4 && (place(12).z + start.z).abs() < 1e-4);
    let error = animation("[animate]\nturn = 24\nloop = 36\n").unwrap_err();
    assert!(error.contains("animate.loop = 36 does not hold whole turns"), "{error}");
}

const PATH: &str = "[animate.path]\neyes = [[0, 0, 10], [10, 0, 0], [0, 0, -10], [-10, 0, 0]]\n";

#[test]
fn a_path_goes_through_its_points_smoothly() {
    let a = animation(&format!("[animate]\nframes = 91\n{PATH}")).unwrap();
    let eye = |frame: i32| a.at(frame).unwrap().values().unwrap().triple("camera.eye");
    let points = [[0, 0, 10], [10, 0, 0], [0, 0, -10], [-10, 0, 0]];
    for (i, p) in points.into_iter().enumerate() {
        let want = Vec3::from_array(p.map(|x: i32| x as f32));
        assert!(eye(30 * i as i32).distance(want) < 1e-4, "{i}: {}", eye(30 * i as i32));
    }
    let steps: Vec<Vec3> = (0..90).map(|f| eye(f + 1) - eye(f)).collect();
    for (f, w) in steps.windows(2).enumerate() {
        // The camera rests at both ends. Elsewhere neither its speed nor its direction jumps.
        assert!((w[1] - w[0]).length() < 0.12, "{f}: {w:?}");
    }
    assert!(steps[0].length() < 0.2 && steps[45].length() > 0.4);
}

#[test]
fn a_path_in_a_loop_is_closed_and_targets_move_with_it() {
    let targets = "targets = [[0, 0, 0], [0, 1, 0], [0, 2, 0], [0, 1, 0]]\n";
    let a = animation(&format!("[animate]\nloop = 80\n{PATH}{targets}")).unwrap();
    let eye = |frame: i32| a.at(frame).unwrap().values().unwrap().triple("camera.eye");
    let steps: Vec<Vec3> = (0..80).map(|f| eye(f + 1) - eye(f)).collect();
    let turn = |a: Vec3, b: Vec3| a.angle_between(b).to_degrees();
    for f in 0..80 {
        // The path has four points of a circle. A step turns by 4.5° on average, and by more at the points.
        // With straight lines it would turn by 90°.
        let angle = turn(steps[f], steps[(f + 1) % 80]);
        assert!(angle < 15.0, "{f}: {angle}");
        assert!((8.5..10.1).contains(&eye(f as i32).length()), "{f}: {}", eye(f as i32));
    }
    assert_eq!(a.at(40).unwrap().values().unwrap().triple("camera.target"), Vec3::new(0.0, 2.0, 0.0));
}

#[test]
fn a_frame_is_a_scene_of_its_own() {
    let a = animation(
        "[animate]\nloop = 24\nturn = 24\n[[animate.tracks]]\nkey = \"curves.h\"\nframes = [0, 12]\n\
         values = [0.5, 1.5]\n",
    )
    .unwrap();
    let scene = a.at(7).unwrap();
    assert!(!scene.to_toml().contains("tracks") && scene.to_toml().contains("turn = 0\n"));
    let again =
        Animation::new("s", source(&scene.to_toml()).values().unwrap(), None, &Limits::default()).unwrap();
    assert_eq!(again.at(0).unwrap().to_toml(), scene.to_toml());
    // The animation as a whole can be written and read back, too.
    let whole =
        animation("[[animate.tracks]]\nkey = \"curves.h\"\nframes = [0, 12]\nvalues = [0.5, 1.5]\n").unwrap();
    let printed =
        taki::scene::Scene::from_values("s", whole.values().clone(), None, &Limits::default()).unwrap();
    let read =
        Animation::new("s", source(&printed.to_toml()).values().unwrap(), None, &Limits::default()).unwrap();
    assert_eq!(read.at(6).unwrap().to_toml(), whole.at(6).unwrap().to_toml());
}

#[test]
fn an_open_shutter_takes_the_speed_of_the_flow_along() {
    let moves = |text: &str, frame: i32| {
        let scene = animation(text).unwrap().at(frame).unwrap();
        // The frame's scene by itself moves as far.
        let again = Animation::new("s", source(&scene.to_toml()).values().unwrap(), None, &Limits::default())
            .unwrap();
        assert_eq!(again.at(0).unwrap().recipes[0].moves, scene.recipes[0].moves, "{text}");
        assert_eq!(scene.wave_moves, scene.recipes[0].moves, "{text}");
        scene.recipes[0].moves
    };
    let open = "[camera]\nshutter = 0.25\n";
    assert_eq!(moves(&format!("{open}[animate]\nspeed = 0.8\n"), 7), 0.2);
    assert_eq!(moves("[animate]\nspeed = 0.8\n", 7), 0.0);
    // A loop of two seconds rounds 1.6 lengths to two.
    assert_eq!(moves(&format!("{open}[animate]\nspeed = 0.8\nfps = 24\nloop = 48\n"), 7), 0.25);
    // A track moves the flow by a tenth in a frame, and by another length where the loop closes.
    let track = format!(
        "{open}[animate]\nfps = 10\nloop = 20\n[[animate.tracks]]\nkey = \"volume.flow\"\nframes = [0, 20]\n\
         values = [0, 2]\n"
    );
    for frame in [0, 3, 19, 20] {
        assert!((moves(&track, frame) - 0.25).abs() < 1e-6, "frame {frame}: {}", moves(&track, frame));
    }
    let slow = format!(
        "{open}[animate]\nfps = 10\n[[animate.tracks]]\nkey = \"volume.flow\"\nframes = [0, 10, 20]\n\
         values = [0, 0, 5]\n"
    );
    assert_eq!(moves(&slow, 3), 0.0);
    assert!((moves(&slow, 15) - 1.25).abs() < 1e-6);
}

#[test]
fn grain_changes_from_frame_to_frame_and_nothing_else_counts_frames() {
    let seed = |text: &str, frame| animation(text).unwrap().at(frame).unwrap().image.look.grain_seed;
    let grain = "[image]\ngrain = 0.02\ngrain_seed = 5\n";
    assert_eq!([0, 1, 9].map(|frame| seed(grain, frame)), [5, 6, 14]);
    assert_eq!([0, 9].map(|frame| seed("[image]\ngrain_seed = 5\n", frame)), [5, 5]);
    let looped = format!("{grain}[animate]\nloop = 4\n");
    assert_eq!([1, 5, -3].map(|frame| seed(&looped, frame)), [6, 6, 6]);
}

#[test]
fn what_cannot_move_is_refused_with_the_reason() {
    let one = |key: &str, frames: &str, values: &str| {
        animation(&format!("[[animate.tracks]]\nkey = \"{key}\"\nframes = {frames}\nvalues = {values}\n"))
    };
    let cases = [
        (one("", "[0]", "[1]"), "the track has no key"),
        (one("curves.g", "[0]", "[1]"), "did you mean curves.h?"),
        (one("light.frame", "[0]", "[1]"), "light.frame is no number"),
        (one("image.width", "[0]", "[100]"), "image.width cannot move"),
        (one("animate.fps", "[0]", "[100]"), "animate.fps cannot move"),
        (one("lights.moon.intensity", "[0]", "[1]"), "the scene has no moon in lights; there are: sun"),
        (one("curves.h", "[0, 1]", "[1]"), "2 frames and 1 values"),
        (one("curves.h", "[]", "[]"), "0 frames and 0 values"),
        (one("curves.h", "[0, 7]", "[1, 9]"), "animate.tracks.0.values at frame 7: curves.h = 9"),
        (one("curves.h", "[0]", "[[1, 2, 3]]"), "allowed: 0 to 8"),
        (one("curves.h", "[3, 2]", "[1, 2]"), "each larger than the one before"),
        (
            animation(&format!("[animate]\nturn = 9\n{PATH}")),
            "animate.path and animate.turn both move the camera",
        ),
        (
            animation(&format!(
                "{PATH}[[animate.tracks]]\nkey = \"camera.eye\"\nframes = [0]\nvalues = [[1, 1, 1]]\n"
            )),
            "both move the camera",
        ),
        (animation("[animate.path]\neyes = [[0, 0, 1]]\n"), "1 eyes, 0 targets"),
        (animation("[animate.path]\ntargets = [[0, 0, 1]]\n"), "animate.path has no eyes"),
        (animation("[animate]\nlop = 5\n"), "did you mean animate.loop?"),
    ];
    for (result, words) in cases {
        let error = result.expect_err(words);
        assert!(error.contains(words), "no {words:?} in: {error}");
    }
    // The error of a frame that cannot be rendered names the frame.
    let a = animation(
        "[[animate.tracks]]\nkey = \"camera.eye\"\nframes = [0, 10]\nvalues = [[0, 0, 5], [0, -1.5, -5]]\n",
    )
    .unwrap();
    let eye_on_target = a.at(5).map(|_| ()).map_err(|e| e.to_string());
    assert!(eye_on_target.clone().is_err_and(|e| e.contains("frame 5: ")), "{eye_on_target:?}");
}
