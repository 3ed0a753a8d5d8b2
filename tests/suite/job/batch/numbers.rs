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

#[test]
fn a_placeholder_that_is_none_is_refused_with_the_one_that_is() {
    let dir = folder();
    for (pattern, slip) in [
        ("R.<frame>.png", "<frame>"),
        ("frm.{frame}.png", "{frame}"),
        ("R.%04D.png", "%04D"),
        ("R.%4d.png", "%4d"),
        ("R.%i.png", "%i"),
        ("R.$FF.png", "$FF"),
        ("R.${F4}.png", "${F4}"),
        ("R.$f4.png", "$f4"),
        ("R.$FRAME.png", "$FRAME"),
        ("R.[0009-0010].png", "[0009-0010]"),
        ("R.*.png", "*"),
        ("R.????.png", "????"),
        ("R.%04.png", "%04"),
        ("R.%s.png", "%s"),
        ("R..png", "two dots"),
        ("R.{frame}.mp4", "{frame}"),
        ("R.<frame>.exr", "<frame>"),
    ] {
        for frames in ["9-10", "9"] {
            let refused = run(&mut batch(dir.path(), ["--frames", frames, "-o", pattern]));
            refused.refused(2, &[&format!("-o {pattern}: "), slip, "put #### where the frame's number goes"]);
        }
        let mut farm = taki(["farm", "slurm", "--", "front", "-o", pattern]);
        run(&mut farm).refused(2, &[slip, "put ####"]);
        let mut still = taki(["render"]);
        still.args(super::TINY).args(["-o", pattern]).current_dir(dir.path());
        run(&mut still).refused(2, &[slip, "put ####"]);
    }
    assert!(files(dir.path()).is_empty());
    // The frame's number beside a sweep has the same name.
    let swept = ["--sweep", "h=1,2", "--frames", "0-1", "-o", "T{h}.{frame}.png"];
    run(&mut batch(dir.path(), swept)).refused(2, &["no --sweep for {frame}", "####"]);
    // Movies and other names stay as they are.
    for name in [
        "fall.png",
        "50%.gif",
        "a[2].gif",
        "v1.2@2x.gif",
        "5%0.gif",
        "why?.gif",
        "a b's (1).png",
        "$Fall.gif",
    ] {
        run(&mut batch(dir.path(), ["--frames", "0-1", "-o", name])).done();
        assert!(dir.path().join(name).exists(), "{name}");
    }
}

#[test]
fn a_still_has_the_number_of_its_frame_in_its_name() {
    let dir = folder();
    let still = |more: &[&str]| {
        let mut command = taki(["render"]);
        run(command.args(super::TINY).args(more).current_dir(dir.path()))
    };
    still(&["--frame", "7", "-o", "w.####.png", "-o", "%03d.exr", "-o", "$F2.png"]).done();
    still(&["-o", "z.@@.png"]).done();
    still(&["--frame", "-3", "-o", "w.####.exr", "--split-layers", "--layers", "rgb,depth"]).done();
    let names = ["007.exr", "07.png", "w.0007.png", "w.depth.-003.exr", "w.rgb.-003.exr", "z.00.png"];
    assert_eq!(files(dir.path()).into_keys().collect::<Vec<_>>(), names);
    let swept = still(&["-o", "U{h}.png"]);
    swept.refused(2, &["-o U{h}.png", "taki batch --sweep h=", "put ####"]);
    still(&["-o", "w.##.png", "-o", "w.%02d.png"]).refused(2, &["are one file"]);
}

#[test]
fn a_batch_whose_names_lack_the_number_is_told_so_first() {
    let dir = folder();
    let refused = |arguments: &[&str], words: &[&str]| {
        run(&mut batch(dir.path(), arguments)).refused(2, words);
    };
    // A sweep needs pictures, and a .png without the number is a movie.
    refused(&["--sweep", "h=1,2", "--frames", "0-1", "-o", "T{h}.png"], &["T{h}.png", "put ####"]);
    refused(&["--frames", "0-1", "--alpha", "-o", "w.png"], &["-o w.png", "put ####"]);
    refused(&["--frames", "0-1", "--alpha", "-o", "w.gif"], &["-o w.gif", "no alpha channel", ".exr frames"]);
    // The ending comes before the number.
    for name in ["e.mkv", "e.####.mkv", "e", "e.####"] {
        for frames in ["0-5", "0"] {
            let words = [&format!("-o {name}: unknown kind"), ".png, .jpg", ".gif", ".mp4, .mov or .webm"];
            refused(&["--frames", frames, "-o", name], &words);
        }
    }
    assert!(files(dir.path()).is_empty());
}

#[test]
fn a_number_in_the_wrong_place_is_told() {
    let dir = folder();
    let frames = |name: &str| run(&mut batch(dir.path(), ["--frames", "0-1", "-o", name]));
    for name in ["out_####/w.####.png", "%04d/w.####.png", "a/$F4/w.png"] {
        frames(name).refused(2, &[name, "not in that of the folder", "put ####"]);
    }
    // A folder that is really called so may be meant.
    std::fs::create_dir(dir.path().join("##")).unwrap();
    frames("##/w.##.png").done();
    let one = frames("w.0000.png");
    one.done();
    assert!(
        one.stderr().contains("w.0000.png becomes one animated PNG, because 0000 is the same"),
        "{one:?}"
    );
    let plain = frames("w2.png");
    plain.done();
    assert!(plain.lines("taki: warning:").is_empty(), "{plain:?}");
}
