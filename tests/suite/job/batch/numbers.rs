//! The frame's number in file names, in the notations of several programs, and frames before the first.

use std::path::Path;

use taki::job::batch::Pattern;

use super::{batch, files, folder};
use crate::cli::faults::{run, taki};

fn name(pattern: &str, frame: i32) -> String {
    let pattern = Pattern::new(Path::new(pattern), &[]).expect("a pattern");
    pattern.at(frame, &[]).display().to_string()
}

#[test]
fn numbers_are_written_in_the_notations_of_other_programs() {
    let cases = [
        ("f.####.png", "f.0007.png"),
        ("f.#.png", "f.7.png"),
        ("f.%04d.png", "f.0007.png"),
        ("f.%d.png", "f.7.png"),
        ("f.%010d.png", "f.0000000007.png"),
        ("f.$F4.exr", "f.0007.exr"),
        ("f$F.exr", "f7.exr"),
        ("out.d/f.@@@@.png", "out.d/f.0007.png"),
        ("@@_@@.png", "07_07.png"),
        // What is no notation stays as it is.
        ("f@2x.png", "f@2x.png"),
        ("100%.png", "100%.png"),
        ("f.%4d%s.png", "f.%4d%s.png"),
        ("$Fall.png", "$Fall.png"),
        ("$FF.png", "$FF.png"),
        // One notation counts: # before %d before $F before @.
        ("f@@-%02d.#.png", "f@@-%02d.7.png"),
        ("f@@-$F2-%02d.png", "f@@-$F2-07.png"),
        ("f@@-$F2.png", "f@@-07.png"),
    ];
    for (pattern, file) in cases {
        assert_eq!(name(pattern, 7), file, "{pattern}");
        let has_frame = Pattern::new(Path::new(pattern), &[]).expect("a pattern").has_frame();
        assert_eq!(has_frame, pattern != file, "{pattern}");
    }
    // The digits are as many as C's printf writes: the sign counts.
    for pattern in ["f.####.png", "f.%04d.png", "f.$F4.png", "f.@@@@.png"] {
        assert_eq!(name(pattern, -10), "f.-010.png");
        assert_eq!(name(pattern, 12345), "f.12345.png");
    }
}

#[test]
fn a_batch_writes_one_file_for_each_frame_whatever_the_notation() {
    let patterns = ["f.####.png", "f.%04d.png", "f.$F4.png", "f.@@@@.png"];
    let made = patterns.map(|pattern| {
        let dir = folder();
        run(&mut batch(dir.path(), ["--frames", "0-1", "-o", pattern])).done();
        files(dir.path())
    });
    assert_eq!(made[0].keys().collect::<Vec<_>>(), ["f.0000.png", "f.0001.png"]);
    assert!(made.iter().all(|others| *others == made[0]));
    for pattern in patterns {
        run(taki(["farm", "slurm", "--", "front"]).args(["-o", pattern])).done();
    }
}

#[test]
fn frames_before_the_first_are_rendered_too() {
    let dir = folder();
    let loops = ["--loop", "8", "--set", "animate.turn=8"];
    let part = |frames: &'static str| [&loops[..], &["--frames", frames, "-o", "f.####.png"]].concat();
    run(&mut batch(dir.path(), part("-10-2"))).done();
    let made = files(dir.path());
    assert_eq!(made.len(), 13, "{:?}", made.keys());
    // A loop goes on to both sides.
    for frame in -10..3i32 {
        let same = frame + if frame > -6 { -8 } else { 8 };
        if let Some(other) = made.get(&format!("f.{same:04}.png")) {
            assert!(*other == made[&format!("f.{frame:04}.png")], "{frame} and {same}");
        }
    }
    assert!(made["f.-001.png"] != made["f.0000.png"]);
    // Without a loop the water falls before frame 0 too, and what is rendered alone is the same.
    let open = ["front", "--engine", "cpu", "--size", "16x12", "--samples=1"];
    let alone = dir.path().join("alone.png");
    run(taki(["render"]).args(open).args(["--frame", "-3", "-o"]).arg(&alone)).done();
    run(&mut batch(dir.path(), ["--frames", "-4--2:2,-3", "-o", "g.%d.png"])).done();
    let made = files(dir.path());
    assert!(made["g.-3.png"] == made["alone.png"]);
    assert!(made["g.-4.png"] != made["g.-3.png"] && made["g.-2.png"] != made["g.-3.png"]);
    for (frames, words) in [("-2--4", "ends before it begins"), ("-1000000000", "from -999999999")] {
        let refused = run(&mut batch(dir.path(), ["--frames", frames, "-o", "g.#.png"]));
        assert!(refused.exit_code() == Some(2) && refused.stderr().contains(words), "{refused:?}");
    }
    assert!(run(&mut taki(["scene", "front", "--frame", "-3"])).done().contains("flow"));
}

#[test]
fn keyframes_may_lie_before_frame_0_but_not_before_a_loop() {
    let dir = folder();
    let track = |more: &str| {
        let text = format!(
            "version = 1\nbase = \"front\"\n[animate]\n{more}\n[[animate.tracks]]\nkey = \"curves.h\"\n\
             frames = [-4, 4]\nvalues = [1.0, 2.0]\ninterpolation = \"linear\"\n"
        );
        std::fs::write(dir.path().join("s.toml"), text).unwrap();
        run(taki(["scene", "s.toml", "--frame", "-2"]).current_dir(dir.path()))
    };
    assert!(track("").done().contains("\nh = 1.25\n"));
    track("loop = 8").refused(65, &["frame -4, which is before the loop"]);
}
