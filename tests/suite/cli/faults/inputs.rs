//! Inputs that are missing or cannot be read.

use std::fs;
use std::os::unix::fs::symlink;

use tempfile::tempdir;

use super::{TINY, has_only, run, scene_with_volume, taki};

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
