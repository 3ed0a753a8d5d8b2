//! Inputs that are missing or cannot be read.

use std::fs;
use std::os::unix::fs::symlink;

use tempfile::tempdir;

use super::{TINY, has_only, names, render, run, scene_with_volume, small_volume, taki};

#[test]
fn an_input_that_does_not_exist_is_bad_input_and_not_tried_again() {
    let dir = tempdir().unwrap();
    fs::write(dir.path().join("file"), "").unwrap();
    let volume = "--set=volume.file=";
    let map = "--set=environment.file=";
    for folder in ["", "absent/", "file/"] {
        let at = |before: &str, name: &str| format!("{before}{folder}{name}");
        let commands: [(String, &[&str]); 10] = [
            (at("", "no.toml"), &["render"]),
            (at("", "no.toml"), &["batch", "--frames=0"]),
            (at("", "no.toml"), &["scene"]),
            (at(volume, "no.npz"), &["render", "front"]),
            (at(volume, "no.npz"), &["batch", "front", "--frames=0"]),
            (at(volume, "no.npz"), &["volume", "build", "front"]),
            (at("", "no.npz"), &["volume", "info"]),
            (at(map, "no.hdr"), &["render", "front", "--set=environment.kind=file"]),
            (at("", "no.png"), &["compare", "no.png"]),
            (at("", "no.png"), &["stitch", "-o", "whole.png"]),
        ];
        for (missing, arguments) in commands {
            let mut command = taki(arguments);
            if ["render", "batch"].contains(&arguments[0]) {
                command.args(TINY);
            }
            let run = run(command.arg(&missing).current_dir(&dir));
            run.refused(65, &[missing.rsplit('/').next().unwrap().rsplit('=').next().unwrap()]);
        }
    }
    let (folder, scene) = scene_with_volume("nowhere.npz");
    run(taki(["render"]).args(TINY).arg(scene.join("s.toml")).current_dir(&folder))
        .refused(65, &["nowhere.npz"]);
    has_only(dir.path(), &["file"]);
}

#[test]
fn an_input_that_is_there_and_cannot_be_read_is_an_io_error() {
    let dir = tempdir().unwrap();
    for name in ["v.npz", "s.toml", "p.png", "m.hdr"] {
        symlink(name, dir.path().join(name)).unwrap();
    }
    let commands: [(&str, &[&str]); 5] = [
        ("v.npz", &["render", "front", "--set=volume.file=v.npz", "-o=x.png"]),
        ("v.npz", &["volume", "info", "v.npz"]),
        ("s.toml", &["render", "s.toml", "-o=x.png"]),
        ("m.hdr", &["render", "front", "--set=environment.kind=file", "--set=environment.file=m.hdr"]),
        ("p.png", &["compare", "p.png", "p.png"]),
    ];
    for (name, arguments) in commands {
        run(taki(arguments).current_dir(&dir)).refused(74, &["cannot read", name]);
    }
}

#[test]
fn an_alpha_beside_a_volume_file_that_brings_its_own_is_warned_of() {
    let dir = tempdir().unwrap();
    small_volume(&dir.path().join("v.npz"));
    let said = |sets: &[&str]| {
        let mut command = render("front", dir.path().join("x.png"));
        let run = run(command.arg("--set=volume.file=v.npz").args(sets).current_dir(&dir));
        run.done();
        run.lines("taki: warning:").iter().filter(|line| line.contains("volume.alpha")).count()
    };
    assert_eq!(said(&[]), 0);
    assert_eq!(said(&["--set=volume.alpha=1"]), 0, "the file has the same");
    assert_eq!(said(&["--set=volume.alpha=0.5"]), 1);
}

#[test]
fn a_volume_is_built_only_under_its_own_ending() {
    let dir = tempdir().unwrap();
    for (name, way) in [("v.txt", "use -o v.npz"), ("v", "use -o v.npz"), ("v.npz.gz", "use -o v.npz.npz")] {
        run(taki(["volume", "build", "front", "-o", name]).current_dir(&dir)).refused(2, &[name, way]);
    }
    run(taki(["volume", "build", "front", "-o", "v.NPZ"]).current_dir(&dir)).done();
    has_only(dir.path(), &["v.NPZ"]);
}

#[test]
fn an_empty_table_over_parts_of_the_base_is_refused_with_the_way_out() {
    let dir = tempdir().unwrap();
    let scene = dir.path().join("s.toml");
    for part in ["rocks", "lights", "sheets", "pools"] {
        fs::write(&scene, format!("version = 1\nbase = \"waterfall\"\n{part} = {{}}\n")).unwrap();
        let words = ["s.toml:3", part, "removes nothing", "taki scene waterfall"];
        run(taki(["scene"]).arg(&scene)).refused(65, &words);
    }
    // Without parts in the base it is harmless.
    fs::write(&scene, "version = 1\nbase = \"front\"\n[rocks]\n[splashes]\n").unwrap();
    run(taki(["scene"]).arg(&scene)).done();
    // The way out works.
    let printed = run(&mut taki(["scene", "waterfall"])).done().to_owned();
    let mut kept = true;
    let bare: Vec<&str> = printed
        .lines()
        .filter(|line| {
            if line.starts_with('[') {
                kept = !line.starts_with("[rocks");
            }
            kept
        })
        .collect();
    fs::write(&scene, bare.join("\n")).unwrap();
    let without = run(taki(["scene"]).arg(&scene)).done().to_owned();
    assert!(printed.contains("[rocks") && !without.contains("[rocks"), "{without}");
    assert_eq!(names(dir.path()).len(), 1);
}
