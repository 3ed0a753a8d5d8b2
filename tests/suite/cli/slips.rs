//! Options and arguments that a user types by slip: they are understood, or answered with the right way to
//! write them.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::faults::{Run, run, taki};
use tempfile::tempdir;

/// `taki batch --dry-run` of a small scene, whose report tells sizes and frames and whose work is refused
/// without memory.
fn planned(arguments: &[&str]) -> Run {
    run(taki(["batch", "front", "--frames", "0", "-o", "####.png", "--dry-run"]).args(arguments))
}

#[test]
fn a_size_may_have_any_of_three_signs_between_its_sides() {
    let plain = planned(&["--size", "320x200"]);
    assert!(plain.done().contains("320"), "{plain:?}");
    for size in ["320X200", "320×200", "320 x 200"] {
        assert_eq!(planned(&["--size", size]).done(), plain.done(), "{size}");
    }
    for size in ["320", "320,200", "320x", "x", "320x200x3", "-1x5"] {
        let refused = planned(&[&format!("--size={size}")]);
        assert_eq!(refused.exit_code(), Some(2), "{size}");
        assert!(refused.stderr().contains("give WIDTHxHEIGHT in pixels, such as 1280x720"), "{refused:?}");
    }
}

#[test]
fn memory_may_have_a_unit() {
    let needs = |memory: &str| {
        let mut command = taki(["volume", "build", "front", "-o", "/proc/v.npz"]);
        run(command.args(["--set=nx=100000", "--set=ny=100000", "--set=nz=100000", "--memory", memory]))
    };
    for (memory, budget) in [
        ("4096", "4.0 GiB"),
        ("4GiB", "4.0 GiB"),
        ("4g", "4.0 GiB"),
        ("4GB", "3.7 GiB"),
        ("4 gb", "3.7 GiB"),
        ("512MB", "488.3 MiB"),
        ("512MiB", "512.0 MiB"),
        ("1.5GiB", "1.5 GiB"),
        ("2T", "2.0 TiB"),
    ] {
        needs(memory).refused(33, &[&format!("the budget is {budget};")]);
    }
    run(&mut taki(["scene", "front", "--memory", "99999999999999999999GiB"])).done();
    let dir = tempdir().unwrap();
    let at = |arguments: &[&str]| run(taki(arguments).current_dir(&dir));
    at(&["volume", "build", "front", "-o", "v.npz", "--set=nx=8", "--set=ny=8", "--set=nz=8"]).done();
    at(&["volume", "info", "v.npz", "--memory", "1"]).done();
    at(&["volume", "info", "v.npz", "--memory", "1KiB"]).refused(33, &["the budget is 1.0 KiB"]);
    for memory in ["lots", "", "GiB", "-1", "4GiBs", "nan", "4,5GiB"] {
        let refused = run(taki(["scene", "front"]).arg(format!("--memory={memory}")));
        assert_eq!(refused.exit_code(), Some(2), "{memory:?}");
        assert!(refused.stderr().contains("4GiB, 4GB or 512MiB; a number alone counts MiB"), "{refused:?}");
    }
    let farm = |memory: &str| run(&mut taki(["farm", "slurm", "--memory", memory, "--", "front"]));
    for (memory, mib) in [("500", "--mem=500M"), ("8GiB", "--mem=8192M"), ("1GB", "--mem=954M")] {
        assert!(farm(memory).done().contains(mib), "{memory}");
    }
    assert_eq!(farm("0").exit_code(), Some(2));
}

#[test]
fn a_scene_in_place_of_a_command_is_told_how_to_be_rendered() {
    run(&mut taki(["fig5"])).refused(2, &["fig5 is a scene, not a command", "taki render fig5"]);
    let dir = tempdir().unwrap();
    fs::write(dir.path().join("my.toml"), "version = 1\n").unwrap();
    let given = run(taki(["my.toml", "--set", "h=1"]).current_dir(&dir));
    given.refused(2, &["to render it: taki render my.toml"]);
    // What is no scene keeps the usual message.
    for words in [&["fig55"][..], &["absent.toml"], &["volume", "fig5"], &["farm", "fig5"]] {
        let refused = run(&mut taki(words));
        assert_eq!(refused.exit_code(), Some(2), "{words:?}");
        assert!(refused.stderr().contains("unrecognized subcommand"), "{refused:?}");
    }
}

#[test]
fn a_new_scene_renders_as_it_is_and_replaces_nothing_unasked() {
    let dir = tempdir().unwrap();
    let at = |arguments: &[&str]| run(taki(arguments).current_dir(&dir));
    let wrote = at(&["new", "my.toml"]);
    wrote.done();
    assert!(wrote.stderr().contains("taki render my.toml"), "{wrote:?}");
    let text = fs::read_to_string(dir.path().join("my.toml")).unwrap();
    assert_eq!(at(&["new", "-"]).done(), text);
    at(&["new", "-"]).done();
    let small = ["render", "my.toml", "--engine", "cpu", "--size", "64x36", "--samples", "1", "--json"];
    let rendered = at(&small);
    let report: serde_json::Value = serde_json::from_str(rendered.done()).unwrap();
    assert_eq!(rendered.lines("taki: warning"), [""; 0]);
    // Water is seen in a part of the picture that is neither small nor all of it.
    let covered = report["covered_pixels"].as_u64().unwrap();
    assert!((100..1500).contains(&covered), "{covered}");

    fs::write(dir.path().join("my.toml"), "mine").unwrap();
    at(&["new", "my.toml"]).refused(73, &["my.toml", "the file exists", "--overwrite"]);
    assert_eq!(fs::read_to_string(dir.path().join("my.toml")).unwrap(), "mine");
    at(&["new", "my.toml", "--overwrite"]).done();
    assert_eq!(fs::read_to_string(dir.path().join("my.toml")).unwrap(), text);
    at(&["new", "my"]).refused(2, &["ends with .toml; write taki new my.toml"]);
    at(&["new", "absent/my.toml"]).refused(73, &["absent/my.toml"]);
}

/// Runs with `input` on stdin; how it ended, its stdout and its stderr.
fn piped(arguments: &[&str], folder: &Path, input: &[u8]) -> (Option<i32>, Vec<u8>, String) {
    let given = folder.join("given");
    fs::write(&given, input).unwrap();
    let mut command = taki(arguments);
    let child = command.current_dir(folder).stdin(fs::File::open(given).unwrap());
    let out = child.output().unwrap();
    (out.status.code(), out.stdout, String::from_utf8(out.stderr).unwrap())
}

const TINY: [&str; 6] = ["--engine", "cpu", "--size", "16x16", "--samples", "1"];

#[test]
fn a_scene_is_read_from_stdin() {
    let dir = tempdir().unwrap();
    let input = b"version = 1\nbase = \"front\"\n[curves]\nh = 1.25\n";
    let (code, out, err) = piped(&["scene", "-"], dir.path(), input);
    assert_eq!(code, Some(0), "{err}");
    assert!(String::from_utf8(out).unwrap().contains("h = 1.25"));
    for arguments in [&["render", "-"][..], &["batch", "-", "--frames", "0"], &["volume", "build", "-"]] {
        let tiny = if arguments[0] == "volume" { &[][..] } else { &TINY };
        let (code, _, err) = piped(&[arguments, tiny].concat(), dir.path(), input);
        assert_eq!(code, Some(0), "{arguments:?}: {err}");
    }
    for made in ["stdin.png", "stdin.0000.png", "stdin.npz"] {
        assert!(dir.path().join(made).exists(), "{made}");
    }
    for (input, words) in [
        (&b""[..], "stdin: the scene has no version"),
        (b"version = 1\n[curves]\nh = 9\n", "stdin:3: curves.h = 9"),
        (b"version = 1\n# \xff\n", "stdin: byte 14 is not UTF-8"),
        (&vec![b'#'; 17 << 20], "stdin has more than 16777216 bytes"),
    ] {
        let (code, _, err) = piped(&["scene", "-"], dir.path(), input);
        assert_eq!(code, Some(65), "{err}");
        assert!(err.contains(words), "no {words:?} in {err}");
    }
    run(&mut taki(["farm", "slurm", "--", "-"])).refused(2, &["cannot read their scene from stdin"]);
}

#[test]
fn a_picture_goes_to_stdout_alone_and_whole() {
    let dir = tempdir().unwrap();
    let render = |more: &[&str]| piped(&[&["render", "front"], &TINY[..], more].concat(), dir.path(), b"");
    let (code, out, err) = render(&["-o", "-", "-o", "x.png"]);
    assert_eq!(code, Some(0), "{err}");
    // Nothing else is on stdout: the bytes are those of the file.
    assert!(out == fs::read(dir.path().join("x.png")).unwrap());
    assert_eq!(image::load_from_memory(&out).unwrap().width(), 16);
    assert!(err.contains("wrote stdout, x.png"), "{err}");
    for (more, words) in [
        (&["-o", "-", "--json"][..], "-o - and --json would both write to stdout"),
        (&["-o", "-", "-o", "-"], "-o - is given twice"),
        (&["-o", "-", "--layers", "rgb"], "--layers needs an EXR file"),
    ] {
        let (code, out, err) = render(more);
        assert_eq!((code, out.len()), (Some(2), 0), "{err}");
        assert!(err.contains(words), "no {words:?} in {err}");
    }
    // An error leaves stdout empty too.
    let (code, out, _) = render(&["-o", "-", "--memory", "0"]);
    assert_eq!((code, out.len()), (Some(33), 0));
    assert!(!dir.path().join("-").exists());
}

#[test]
fn a_picture_that_stdout_does_not_take_is_an_error() {
    let full = fs::File::create("/dev/full").unwrap();
    let mut command = taki(["render", "front"]);
    let out = command.args(TINY).args(["-o", "-"]).stdout(full).output().unwrap();
    let err = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(74), "{err}");
    assert!(err.contains("cannot write stdout"), "{err}");
}

#[test]
fn a_rate_may_be_a_fraction() {
    let dir = tempdir().unwrap();
    let file = dir.path().join("s.toml");
    fs::write(&file, "version = 1\n[animate]\nfps = \"24000/1001\"\n").unwrap();
    let printed = |command: &mut Command| {
        let text = run(command).done().to_owned();
        text.lines().find(|line| line.starts_with("fps = ")).unwrap_or_default().to_owned()
    };
    assert_eq!(printed(taki(["scene"]).arg(&file)), "fps = 23.976025");
    assert_eq!(printed(&mut taki(["scene", "front", "--set", "fps=30000/1001"])), "fps = 29.97003");
    assert_eq!(printed(&mut taki(["scene", "front", "--set", "fps=25"])), "fps = 25.0");
    planned(&["--fps", "24000/1001"]).done();
    for wrong in ["24/0", "1e9/1", "/1001", "24/", "a/b", "-24/1"] {
        let refused = planned(&[&format!("--fps={wrong}")]);
        assert_eq!(refused.exit_code(), Some(2), "{wrong}: {refused:?}");
        assert!(refused.stderr().contains("give a rate from 0.01 to 1000"), "{refused:?}");
        let set = planned(&["--set", &format!("fps={wrong}")]);
        set.refused(65, &["animate.fps", "allowed: 0.01 to 1000"]);
    }
    // Only a rate is a fraction.
    planned(&["--set", "h=1/2"]).refused(65, &["curves.h", "allowed: 0 to 8"]);
}

#[test]
fn numbers_that_options_do_not_take_are_refused_in_plain_words() {
    for (arguments, words) in [
        (&["render", "front", "--samples", "-1"][..], "give a whole number from 1 to 4096"),
        (&["render", "front", "--samples", "1.5"], "give a whole number"),
        (&["render", "front", "--seed", "-1"], "give a whole number"),
        (&["render", "front", "--seed", "1e3"], "give a whole number"),
        (&["render", "front", "--watchdog", "-1"], "give a number of seconds above 0"),
        (&["render", "front", "--watchdog", "0"], "give a number of seconds above 0"),
        (&["render", "front", "--watchdog", "nan"], "give a number of seconds above 0"),
        (&["render", "front", "--memory", "-1GiB"], "give an amount such as 4GiB"),
        (&["render", "front", "--size", "-1x5"], "give WIDTHxHEIGHT"),
        (&["render", "front", "--crop", "-1,0,5,5"], "give column, row, width and height"),
        (&["batch", "front", "--loop", "-5"], "give a whole number"),
        (&["batch", "front", "--retries", "-1"], "give a whole number"),
        (&["batch", "front", "--stale", "-1"], "give a number of seconds from 1"),
        (&["farm", "slurm", "--shards", "-1", "--", "front"], "give a whole number from 1 to 10000"),
        (&["bench", "--runs", "-1"], "give a whole number from 1 to 1000"),
        (&["compare", "a.png", "b.png", "--share", "-1"], "give a share from 0 to 1"),
        (&["compare", "a.png", "b.png", "--share", "2"], "give a share from 0 to 1"),
        (&["compare", "a.png", "b.png", "--share", "nan"], "give a share from 0 to 1"),
        (&["compare", "a.png", "b.png", "--relative", "nan"], "give a number, 0 or more"),
        (&["compare", "a.png", "b.png", "--absolute", "-1"], "give a number, 0 or more"),
        (&["compare", "a.png", "b.png", "--rmse", "nan"], "give a number, 0 or more"),
        (&["compare", "--eye", "a.png", "--bands", "-1"], "give a whole number"),
    ] {
        let refused = run(&mut taki(arguments));
        assert_eq!(refused.exit_code(), Some(2), "{arguments:?}: {refused:?}");
        assert!(refused.stderr().contains(words), "{arguments:?}: {refused:?}");
    }
    // What begins with a hyphen and is no number is still no value.
    let refused = run(&mut taki(["render", "front", "--samples", "--json"]));
    assert!(refused.stderr().contains("a value is required"), "{refused:?}");
    // A parameter below 0 is a value.
    run(&mut taki(["scene", "front", "--set", "exposure=-1.5"])).done();
}

#[test]
fn options_that_would_be_ignored_are_refused() {
    let dir = tempdir().unwrap();
    let at = |arguments: &[&str]| run(taki(arguments).current_dir(&dir));
    for command in ["render", "batch", "bench", "view"] {
        if command == "view" && !cfg!(feature = "viewer") {
            continue;
        }
        let refused = at(&[command, "--engine=cpu", "--adapter=nvidia"]);
        refused.refused(2, &["--adapter chooses a GPU, which --engine cpu does not use"]);
    }
    at(&["scene", "front", "--allow-path=absent"]).refused(65, &["--allow-path absent: there is no folder"]);
    at(&["scene", "front", "--allow-path=."]).done();
    let tiny = |more: &[&str]| at(&[&["render", "front"], &TINY[..], more].concat());
    tiny(&["-o", "p.png", "-o", "./p.png"]).refused(2, &["-o p.png and -o ./p.png are one file"]);
    std::os::unix::fs::symlink("p.png", dir.path().join("link.png")).unwrap();
    tiny(&["-o", "p.png", "-o", "link.png"]).refused(2, &["are one file"]);
    tiny(&["-o", "p.png", "-o", "p.exr"]).done();
    // A layer that is named twice is written once.
    tiny(&["-o", "q.exr", "--layers=depth,rgb,depth", "--json"]).done();
    let layers = taki::output::frame::read_exr(&dir.path().join("q.exr"), 1 << 30).unwrap().2;
    let mut names: Vec<String> = layers.into_iter().map(|(name, _)| name).collect();
    names.sort_unstable();
    assert_eq!(names, ["B", "G", "R", "depth.Z", "distance.D"]);
    let twice = ["batch", "front", "--manifest=m.csv", "--manifest=m.csv", "--dry-run"];
    at(&twice).refused(2, &["m.csv is given twice"]);
}

#[test]
fn a_folder_in_place_of_an_output_is_refused_before_the_work() {
    let dir = tempdir().unwrap();
    fs::create_dir(dir.path().join("d.toml")).unwrap();
    let at = |arguments: &[&str]| run(taki(arguments).current_dir(&dir));
    let tiny = |more: &[&str]| at(&[&["render", "front"], &TINY[..], more].concat());
    tiny(&["-o", "x.png/"])
        .refused(73, &["x.png/: it is the name of a folder", "give the name of a file in it"]);
    at(&["volume", "build", "front", "-o", "x.npz/"]).refused(73, &["it is the name of a folder"]);
    at(&["new", "x.toml/"]).refused(73, &["it is the name of a folder"]);
    // No advice leads to the next refusal.
    for (arguments, words) in
        [(&["new", "d.toml"][..], "a folder has this name"), (&["new", "."], "no file name")]
    {
        let refused = at(arguments);
        refused.refused(73, &[words]);
        for wrong in ["-o", "--overwrite", "..toml"] {
            assert!(!refused.stderr().contains(wrong), "{refused:?}");
        }
    }
}

#[test]
fn a_part_is_not_replaced_by_the_whole_unasked() {
    let dir = tempdir().unwrap();
    let at = |arguments: &[&str]| run(taki(arguments).current_dir(&dir));
    for (name, crop) in [("a.png", "0,0,16,8"), ("b.png", "0,8,16,8")] {
        at(&[&["render", "front"], &TINY[..], &["--crop", crop, "-o", name]].concat()).done();
    }
    let part = fs::read(dir.path().join("a.png")).unwrap();
    for output in ["a.png", "./b.png"] {
        at(&["stitch", "a.png", "b.png", "-o", output]).refused(2, &[output, "is one of the parts"]);
    }
    assert!(fs::read(dir.path().join("a.png")).unwrap() == part);
    at(&["stitch", "a.png", "b.png", "-o", "a.png", "--overwrite"]).done();
    assert!(fs::read(dir.path().join("a.png")).unwrap() != part);
}

#[test]
fn a_job_file_replaces_nothing_else_unasked() {
    let dir = tempdir().unwrap();
    let scene = dir.path().join("s.toml");
    let farm = |more: &[&str]| {
        let mut command = taki(["farm", "slurm", "-o", "s.toml"]);
        run(command.args(more).args(["--", "front", "-o", "x.####.png"]).current_dir(&dir))
    };
    fs::write(&scene, "version = 1\n").unwrap();
    farm(&[]).refused(73, &["s.toml", "no job file", "--overwrite"]);
    assert_eq!(fs::read_to_string(&scene).unwrap(), "version = 1\n");
    farm(&["--overwrite"]).done();
    farm(&[]).done();
    for kind in [&["openjd"][..], &["kubernetes", "--image=i", "--claim=c"]] {
        for _ in 0..2 {
            let mut command =
                taki([&["farm"], kind, &["-o", "j.yaml", "--", "front", "-o", "x.####.png"]].concat());
            run(command.current_dir(&dir)).done();
        }
    }
}

#[test]
fn a_compared_picture_is_not_replaced_by_the_difference_unasked() {
    let dir = tempdir().unwrap();
    let at = |arguments: &[&str]| run(taki(arguments).current_dir(&dir));
    for (name, seed) in [("a.png", "1"), ("b.png", "2")] {
        at(&[&["render", "front"], &TINY[..], &["--seed", seed, "-o", name]].concat()).done();
    }
    std::os::unix::fs::symlink("b.png", dir.path().join("link.png")).unwrap();
    let read = || ["a.png", "b.png"].map(|name| fs::read(dir.path().join(name)).unwrap());
    let before = read();
    for output in ["a.png", "./b.png", "link.png"] {
        let refused = at(&["compare", "a.png", "b.png", "--difference", output]);
        refused.refused(2, &[&format!("--difference {output}"), "is one of the pictures"]);
        assert!(read() == before, "{output}");
    }
    at(&["compare", "a.png", "b.png", "--share", "1", "--difference", "d.png"]).done();
    at(&["compare", "a.png", "b.png", "--share", "1", "--difference", "a.png", "--overwrite"]).done();
    assert!(read()[0] != before[0]);
}

#[test]
fn a_moved_picture_is_not_moved_again_unsaid() {
    let dir = tempdir().unwrap();
    let at = |arguments: &[&str]| run(taki(arguments).current_dir(&dir));
    let warned = |run: &Run| {
        run.done();
        run.lines("taki: warning").iter().any(|line| line.contains("f5.png holds the scene of its own frame"))
    };
    at(&[&["render", "front"], &TINY[..], &["--frame", "5", "-o", "f5.png"]].concat()).done();
    let again = |more: &[&str]| at(&[&["render", "f5.png", "--engine", "cpu"], more].concat());
    assert!(warned(&again(&["--frame", "5", "-o", "x.png"])));
    assert!(!warned(&again(&["-o", "x.png"])));
    assert!(warned(&at(&["scene", "f5.png", "--frame", "5"])));
    assert!(!warned(&at(&["scene", "f5.png"])));
    let batch =
        |frames| at(&["batch", "f5.png", "--engine=cpu", "--dry-run", "-o=####.png", "--frames", frames]);
    assert!(warned(&batch("5-6")));
    // Frames that begin with that of the picture go on from it.
    assert!(!warned(&batch("0-6")));
    assert!(!warned(&at(&["scene", "front", "--frame", "5"])));
}

#[test]
fn parameters_that_options_set_are_refused_by_the_option() {
    for (option, values, words) in [
        ("--size", &["0x0", "0x5", "5x1000001"][..], "1 to 1000000 for each side"),
        ("--samples", &["0", "4097"], "1 to 4096"),
        ("--loop", &["1000001"], "0 to 1000000"),
        ("--fps", &["0", "abc", "-24", "1001", "inf"], "0.01 to 1000"),
        ("--fps", &["23,976"], "23.976"),
    ] {
        for value in values {
            let refused = planned(&[option, value]);
            assert_eq!(refused.exit_code(), Some(2), "{option} {value}: {refused:?}");
            assert!(refused.stderr().contains(words), "{option} {value}: {refused:?}");
            assert!(refused.stderr().contains(option) && !refused.stderr().contains("--set"), "{refused:?}");
        }
    }
    for (option, value) in [("--samples", "4096"), ("--loop", "0"), ("--fps", " 23.976 "), ("--fps", "1e2")] {
        planned(&[option, value, "--size", "8x8"]).done();
    }
    let still = run(&mut taki(["render", "front", "--samples", "0"]));
    assert!(still.exit_code() == Some(2) && still.stderr().contains("1 to 4096"), "{still:?}");
}

#[test]
fn a_decimal_comma_in_a_range_is_told_to_be_a_point() {
    let swept = |values: &str| planned(&["--sweep", values, "-o", "x{h}.png"]);
    swept("h=0,5:1:0,25").refused(2, &["--sweep h=0,5:1:0,25", "write h=0.5:1:0.25"]);
    swept("h=1:2:0,5").refused(2, &["write h=1:2:0.5"]);
}

#[test]
fn numbers_of_frames_and_tasks_are_refused_in_plain_words() {
    for (arguments, words) in [
        (&["render", "front", "--frame", "7.5"][..], "give a whole number from -999999999 to 999999999"),
        (&["scene", "front", "--frame", "x"], "give a whole number from -999999999 to 999999999"),
        (
            &["farm", "slurm", "--time", "1h", "--", "front"],
            "give a whole number of minutes from 1 to 1000000",
        ),
        (&["farm", "slurm", "--time", "01:00:00", "--", "front"], "minutes"),
        (&["farm", "slurm", "--gpus", "one", "--", "front"], "give a whole number from 1 to 1000"),
        (&["farm", "slurm", "--shards", "0", "--", "front"], "give a whole number from 1 to 10000"),
        (&["bench", "--cells", "1.5"], "give a whole number from 1 to 8192"),
    ] {
        let refused = run(&mut taki(arguments));
        assert_eq!(refused.exit_code(), Some(2), "{arguments:?}: {refused:?}");
        assert!(refused.stderr().contains(words), "{arguments:?}: {refused:?}");
    }
}

#[test]
fn a_farm_is_told_what_its_shards_would_refuse() {
    let farm = |batch: &[&str]| run(&mut taki([&["farm", "slurm", "--"], batch].concat()));
    let f = farm(&["fig5", "-o", "f.exr"]);
    f.refused(2, &["f.exr", "share one name", "put ####"]);
    assert!(!f.stderr().contains("without --shard"), "{f:?}");
    farm(&["fig5", "-o", "f.png"]).refused(2, &["f.png needs all pictures", "without --shard"]);
    farm(&["fig5", "-o", "f.mp4"]).refused(2, &["f.mp4 needs all pictures"]);
    farm(&["fig5", "-o", "f.####.mkv"]).refused(2, &["unknown kind", ".webm"]);
    farm(&["fig5", "-o", "f.####.png", "--overwrite"]).refused(2, &["--overwrite after --", "anew"]);
    for (word, rest) in [
        ("render", &["render", "fig5", "-o", "f.####.exr"][..]),
        ("batch", &["batch", "fig5"]),
        ("taki batch", &["taki", "batch", "fig5"]),
        ("./taki render", &["./taki", "render", "fig5"]),
        ("render", &["render"]),
    ] {
        farm(rest).refused(2, &[&format!("leave out {word} after --")]);
    }
}

#[test]
fn a_job_file_that_was_written_is_named() {
    let dir = tempdir().unwrap();
    for kind in [&["slurm"][..], &["openjd"], &["kubernetes", "--image=i", "--claim=c"]] {
        let rest = ["-o", "job", "--overwrite", "--", "front", "-o", "x.####.png"];
        let wrote = run(taki([&["farm"], kind, &rest].concat()).current_dir(&dir));
        wrote.done();
        assert_eq!(wrote.lines("taki: wrote job"), ["taki: wrote job"]);
        let printed = run(&mut taki([&["farm"], kind, &["--", "front"]].concat()));
        assert!(printed.stderr().is_empty() && !printed.done().is_empty(), "{printed:?}");
    }
}

#[test]
fn parts_that_cannot_become_the_file_are_not_asked_for_more() {
    let dir = tempdir().unwrap();
    let at = |arguments: &[&str]| run(taki(arguments).current_dir(&dir));
    at(&[&["render", "front"], &TINY[..], &["--crop", "0,0,16,8", "-o", "c1.png"]].concat()).done();
    at(&["stitch", "c1.png", "-o", "c.exr"]).refused(2, &["must end with .png"]);
    at(&["stitch", "c1.png", "-o", "c.png", "--half"]).refused(2, &["--half"]);
    at(&["stitch", "c1.png", "-o", "c.png"]).refused(65, &["leave a gap"]);
}

#[test]
fn tips_lead_to_what_works() {
    for (arguments, tip) in [
        (&["render", "front", "--loop", "10"][..], "--loop belongs to taki batch"),
        (&["render", "--sweep=h=1,2"], "--sweep belongs to taki batch"),
        (&["scene", "front", "--crop", "0,0,1,1"], "--crop belongs to taki render and taki batch"),
        (&["compare", "a.png", "--frame", "3"], "--frame belongs to taki render and taki scene"),
        (&["render", "front", "x.png"], "use -o x.png"),
        (&["batch", "front", "x.####.exr"], "use -o x.####.exr"),
        (&["batch", "front", "x.mp4"], "use -o x.mp4"),
        (&["render", "front", "--set", "h", "1.2"], "use --set h=1.2"),
        (&["render", "front", "--set", "h=", "1.2"], "use --set h=1.2"),
        (&["render", "front", "--set", "h", "=1.2"], "use --set h=1.2"),
        (&["render", "front", "--set", "h", "=", "1.2"], "use --set h=1.2"),
        (&["batch", "front", "--sweep", "h", "1,2"], "use --sweep h=1,2"),
        (
            &["farm", "slurm", "--frames", "0-9", "--", "front"],
            "--frames belongs to taki batch: write it after --",
        ),
        // Other tips stay.
        (&["render", "front", "--sizes", "8x8"], "a similar argument exists: '--size'"),
    ] {
        let refused = run(&mut taki(arguments));
        assert_eq!(refused.exit_code(), Some(2), "{arguments:?}: {refused:?}");
        assert!(refused.stderr().contains(tip), "{arguments:?}: {refused:?}");
        assert!(!refused.stderr().contains("as a value"), "{arguments:?}: {refused:?}");
    }
    // The value is taken for the scene here.
    run(&mut taki(["render", "--set", "h", "1.2"]))
        .refused(2, &["--set h has no value", "write --set h=1.2"]);
    let refused = run(&mut taki(["render", "--nonsense"]));
    assert!(!refused.stderr().contains("tip:"), "{refused:?}");
}

#[test]
fn a_device_is_no_picture_to_be_replaced() {
    for path in ["/dev/full", "/dev/null"] {
        let words = [path, "not a regular file"];
        run(taki(["render", "front"]).args(TINY).args(["-o", path])).refused(73, &words);
        planned(&["-o", path]).refused(73, &words);
    }
}

#[test]
fn a_new_scene_in_place_of_a_picture_is_named_after_it() {
    for (given, wanted) in [
        ("p.png", "p.toml"),
        ("d/p.EXR", "d/p.toml"),
        ("p.mp4", "p.toml"),
        ("p.txt", "p.toml"),
        ("p.json", "p.toml"),
        ("v1.2", "v1.2.toml"),
        ("p", "p.toml"),
    ] {
        run(&mut taki(["new", given])).refused(2, &[&format!("write taki new {wanted}")]);
    }
}

#[test]
fn a_seed_beside_a_volume_file_is_told_to_have_no_effect() {
    let dir = tempdir().unwrap();
    let at = |arguments: &[&str]| run(taki(arguments).current_dir(&dir));
    let small = ["--set=nx=8", "--set=ny=8", "--set=nz=8"];
    at(&[&["volume", "build", "front", "-o", "v.npz"], &small[..]].concat()).done();
    for seed in [&["--seed", "5"][..], &["--set", "volume.seed=5"], &["--seed=5", "--set=seed=4"]] {
        let told = at(&[&["scene", "front", "--set", "volume.file=v.npz"], seed].concat());
        told.done();
        let warnings = told.lines("taki: warning");
        let [warning] = warnings[..] else { panic!("{seed:?}: {warnings:?}") };
        assert!(warning.contains("volume.seed has no effect"), "{warning}");
    }
    assert!(at(&["scene", "front", "--seed", "5"]).lines("taki: warning").is_empty());
}

#[test]
fn settings_that_no_file_of_the_run_holds_are_told() {
    let dir = tempdir().unwrap();
    let said = |arguments: &[&str]| {
        let small = ["--engine=cpu", "--size=8x8", "--samples=1", "--overwrite"];
        let run = run(taki(arguments).args(small).current_dir(&dir));
        run.done();
        run.lines("taki: warning:").concat()
    };
    for setting in ["exposure=1", "tone=none", "dither=none", "image.temperature=5000"] {
        let only = said(&["render", "front", "-o", "a.exr", "--set", setting]);
        assert!(only.contains("has no effect: EXR files hold the light before it"), "{setting}: {only}");
        assert_eq!(said(&["render", "front", "-o", "a.exr", "-o", "a.png", "--set", setting]), "");
        let batch = said(&["batch", "front", "--frames=0", "-o", "b.#.exr", "--set", setting]);
        assert!(batch.contains("has no effect"), "{setting}: {batch}");
    }
    let wide = "image.primaries=rec2020";
    assert!(said(&["render", "front", "-o", "a.png", "--set", wide]).contains("sRGB; add --linear"));
    assert_eq!(said(&["render", "front", "-o", "a.exr", "--set", wide]), "");
    let linear = ["--linear", "--set", "tone=none"];
    assert_eq!(said(&[&["render", "front", "-o", "a.png", "--set", wide][..], &linear].concat()), "");
}

#[test]
fn a_setting_that_another_option_replaces_is_told() {
    let said = |more: &[&str]| {
        let run = run(taki(["batch", "front", "--dry-run", "-o", "x.##.png"]).args(more));
        run.done();
        run.lines("taki: warning:").concat()
    };
    let both = said(&["--set", "width=64", "--size", "16x16"]);
    assert!(both.contains("width=64 has no effect: another option sets image.width=16"), "{both}");
    assert!(said(&["--set", "image.samples=4", "--samples", "1"]).contains("image.samples=1"));
    assert_eq!(said(&["--set", "image.samples=4", "--size", "16x16"]), "");
}
