//! Inputs that are missing or cannot be read.

use std::fs;
use std::os::unix::fs::symlink;
use std::process::Command;

use tempfile::tempdir;

use super::{TINY, has_only, render, run, scene_with_volume, small_volume, taki};

#[test]
fn an_input_that_does_not_exist_is_bad_input_and_not_tried_again() {
    let dir = tempdir().unwrap();
    fs::write(dir.path().join("file"), "").unwrap();
    let volume = "--set=volume.file=";
    let map = "--set=environment.file=";
    for folder in ["", "absent/", "file/"] {
        let at = |before: &str, name: &str| format!("{before}{folder}{name}");
        let commands: [(String, &[&str]); 15] = [
            (at("", "no.toml"), &["render"]),
            (at("", "no.toml"), &["batch", "--frames=0"]),
            (at("", "no.toml"), &["scene"]),
            (at(volume, "no.npz"), &["render", "front"]),
            (at(volume, "no.npz"), &["batch", "front", "--frames=0"]),
            (at(volume, "no.npz"), &["volume", "build", "front"]),
            (at(volume, "no.npz"), &["scene", "front"]),
            (at(volume, "no.npz"), &["scene", "front", "--json"]),
            (at(volume, "no.npz"), &["batch", "front", "--frames=0", "--dry-run"]),
            (at("--volume=", "no.npz"), &["bench", "--engine=cpu", "--size=16x16", "--runs=1"]),
            (at("", "no.npz"), &["volume", "info"]),
            (at("", "no.hair"), &["volume", "info"]),
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
    if cfg!(feature = "viewer") {
        run(taki(["view", "front", "--exit-after=1", "--set=volume.file=no.npz"]).current_dir(&dir))
            .refused(65, &["no.npz"]);
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
    let commands: [(&str, &[&str]); 6] = [
        ("v.npz", &["render", "front", "--set=volume.file=v.npz", "-o=x.png"]),
        ("v.npz", &["scene", "front", "--set=volume.file=v.npz"]),
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
fn a_pipe_in_place_of_a_file_is_refused_and_not_waited_for() {
    let dir = tempdir().unwrap();
    assert!(Command::new("mkfifo").arg(dir.path().join("f")).status().unwrap().success());
    run(&mut render("front", dir.path().join("p.png"))).done();
    symlink("f", dir.path().join("f.hair")).unwrap();
    symlink("f", dir.path().join("f.usdc")).unwrap();
    for arguments in [
        &["compare", "f", "p.png"][..],
        &["compare", "p.png", "f"],
        &["compare", "--eye", "f"],
        &["stitch", "f", "-o", "x.png"],
        &["volume", "info", "f"],
        &["volume", "info", "f.hair"],
        &["volume", "info", "f.usdc"],
        &["scene", "f"],
        &["scene", "front", "--set=volume.file=f"],
        &["scene", "front", "--set=volume.builder=strands", "--set=volume.source=f"],
        &["scene", "front", "--set=environment.kind=file", "--set=environment.file=f"],
    ] {
        run(taki(arguments).current_dir(&dir)).refused(65, &["f", "not a regular file"]);
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
fn the_alpha_of_a_preset_is_no_setting_that_a_volume_file_silences() {
    let dir = tempdir().unwrap();
    small_volume(&dir.path().join("v.npz"));
    let said = |scene: &str, sets: &[&str]| {
        let run = run(render(scene, dir.path().join("x.png")).args(sets).current_dir(&dir));
        run.done();
        let lines = run.lines("taki: warning:");
        lines.into_iter().filter(|line| line.contains("volume.alpha")).map(str::to_owned).collect::<Vec<_>>()
    };
    let none: &[&str] = &[];
    let file = "--set=volume.file=v.npz";
    // Figure 5 has the alpha 0.3.
    assert_eq!(said("fig5", &[file]), none);
    let write = |text: &str| {
        fs::write(dir.path().join("s.toml"), "version = 1\nbase = \"fig5\"\n[volume]\n".to_owned() + text)
            .unwrap()
    };
    write("file = \"v.npz\"\n");
    assert_eq!(said("s.toml", &[]), none);
    // The picture of a scene without a file holds the preset's alpha too.
    assert_eq!(said("fig5", &[]), none);
    assert_eq!(said("x.png", &[file]), none);
    let words = "volume.alpha = 0.3 has no effect: volume.file gives the density as it is";
    write("file = \"v.npz\"\nalpha = 0.3\n");
    for said in [said("fig5", &[file, "--set=alpha=0.3"]), said("s.toml", &[])] {
        assert!(said.len() == 1 && said[0].contains(words), "{said:?}");
    }
}

#[test]
fn an_environment_map_that_is_not_used_is_warned_of() {
    let dir = tempdir().unwrap();
    let scene = dir.path().join("s.toml");
    fs::write(&scene, "version = 1\nbase = \"front\"\n[environment]\nfile = \"m.hdr\"\n").unwrap();
    let words = "environment.file has no effect while environment.kind is \"none\": it needs file";
    let set = ["front".into(), "--set=environment.file=m.hdr".into()];
    for arguments in [vec![scene.display().to_string()], set.to_vec()] {
        let mut command = render(&arguments[0], dir.path().join("x.png"));
        let run = run(command.args(&arguments[1..]).current_dir(&dir));
        run.done();
        assert_eq!(
            run.lines("taki: warning:").iter().filter(|line| line.contains(words)).count(),
            1,
            "{run:?}"
        );
    }
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
fn a_volume_is_not_built_onto_the_file_it_is_read_from() {
    let dir = tempdir().unwrap();
    small_volume(&dir.path().join("v.npz"));
    let before = fs::read(dir.path().join("v.npz")).unwrap();
    for output in ["v.npz", "./v.npz"] {
        let build = ["volume", "build", "front", "--set", "volume.file=v.npz", "-o", output];
        run(taki(build).current_dir(&dir)).refused(2, &[output, "reads its volume from this file"]);
    }
    assert!(fs::read(dir.path().join("v.npz")).unwrap() == before);
}

#[test]
fn an_empty_table_over_parts_of_the_base_is_refused_with_the_way_out() {
    let dir = tempdir().unwrap();
    let scene = dir.path().join("s.toml");
    for part in ["rocks", "lights", "sheets", "pools"] {
        fs::write(&scene, format!("version = 1\nbase = \"waterfall\"\n{part} = {{}}\n")).unwrap();
        let way_out = format!("remove = [\"{part}\"]");
        run(taki(["scene"]).arg(&scene)).refused(65, &["s.toml:3", part, "removes nothing", &way_out]);
        // The way out works.
        fs::write(&scene, format!("version = 1\nbase = \"waterfall\"\n{way_out}\n")).unwrap();
        let without = run(taki(["scene"]).arg(&scene)).done().to_owned();
        assert!(without.contains("[trace]") && !without.contains(&format!("[{part}.")), "{without}");
    }
    // Without parts in the base it is harmless.
    fs::write(&scene, "version = 1\nbase = \"front\"\n[rocks]\n[splashes]\n").unwrap();
    run(taki(["scene"]).arg(&scene)).done();
}

#[test]
fn parts_of_the_base_are_removed_by_their_names() {
    let dir = tempdir().unwrap();
    let scene = dir.path().join("s.toml");
    let printed = |command: &mut Command| run(command).done().to_owned();
    let write = |text: &str| fs::write(&scene, format!("version = 1\nbase = \"waterfall\"\n{text}")).unwrap();
    let of = |text: &str| {
        write(text);
        printed(taki(["scene"]).arg(&scene))
    };
    let whole = of("");
    let without = |sections: &[&str]| {
        let mut kept = true;
        let lines = whole.lines().filter(|line| {
            if line.starts_with('[') {
                kept = !sections.iter().any(|section| line.starts_with(&format!("[{section}")));
            }
            kept
        });
        lines.collect::<Vec<_>>().join("\n")
    };
    let rocks: Vec<&str> = whole.lines().filter(|line| line.starts_with("[rocks.")).collect();
    let first = rocks[0].trim_matches(['[', ']']);
    assert!(rocks.len() > 1);
    for (names, sections) in
        [(format!("[{first:?}, \"pools\"]"), vec![first, "pools"]), ("\"rocks\"".into(), vec!["rocks"])]
    {
        let bare = of(&format!("remove = {names}\n"));
        assert_eq!(bare.trim_end(), without(&sections).trim_end());
        // On the command line it means the same, and what is printed is read again as it is.
        let mut option = taki(["scene", "waterfall"]);
        sections.iter().for_each(|name| _ = option.args(["--remove", name]));
        assert_eq!(printed(&mut option), bare);
        assert_eq!(printed(&mut taki(["scene", "waterfall", "--remove", &sections.join(",")])), bare);
        let setting = format!("remove={names}");
        assert_eq!(printed(&mut taki(["scene", "waterfall", "--set", &setting])), bare);
        fs::write(&scene, &bare).unwrap();
        assert_eq!(printed(taki(["scene"]).arg(&scene)), bare);
    }
    // The file's own parts are added after the removal, and settings are applied after it.
    let own = format!("remove = [\"rocks\"]\n[rocks.mine]\ncorners = {CORNERS}\n");
    let mine = of(&own);
    assert_eq!(mine.lines().filter(|line| line.starts_with("[rocks.")).collect::<Vec<_>>(), ["[rocks.mine]"]);
    let bulge = printed(taki(["scene", "--remove", "pools", "--set", "rocks.mine.bulge=0.125"]).arg(&scene));
    assert!(bulge.contains("bulge = 0.125") && !bulge.contains("[pools."), "{bulge}");
    // A value that is removed is the default, and so is a whole section of values.
    assert!(whole.contains("\nny = 384\n") && of("remove = [\"volume.ny\"]\n").contains("\nny = 40\n"));
    assert!(of("remove = [\"haze\"]\n").contains("[haze]\ndensity = 0.0\n"));
    let tiny = dir.path().join("x.png");
    write("remove = [\"rocks\", \"pools\"]\n");
    run(&mut render(scene.to_str().unwrap(), tiny)).done();
}

const CORNERS: &str = "[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]";

#[test]
fn what_cannot_be_removed_is_told_with_the_nearest_that_can() {
    let dir = tempdir().unwrap();
    let scene = dir.path().join("s.toml");
    for (text, words) in [
        (
            "remove = [\"rocks.wal\"]",
            &["s.toml:3", "no \"rocks.wal\" to remove", "did you mean rocks.wall?"][..],
        ),
        ("remove = [\"pools\",\n\"Rocks\"]", &["s.toml:4", "did you mean rocks?"]),
        ("remove = [\"wall\"]", &["did you mean rocks.wall?"]),
        ("remove = [\"zzz\"]", &["there are ", "rocks, sheets"]),
        ("remove = [\"\"]", &["no \"\" to remove"]),
        ("remove = [\"splashes\"]", &["no \"splashes\" to remove"]),
        ("remove = [\"sky.elevation\"]", &["it has its default; leave it out"]),
        ("remove = [\"pools\", \"pools\"]", &["no \"pools\" to remove"]),
        ("remove = 3", &["s.toml:3", "a list of names", "remove = [\"rocks.wall\", \"pools\"]"]),
        ("remove = [[\"rocks\"]]", &["a list of names"]),
        ("[curves]\nremove = [\"rocks\"]", &["s.toml:4", "above the first table"]),
    ] {
        fs::write(&scene, format!("version = 1\nbase = \"waterfall\"\n{text}\n")).unwrap();
        run(taki(["scene"]).arg(&scene)).refused(65, words);
    }
    fs::write(&scene, "version = 1\nremove = [\"rocks\"]\n").unwrap();
    run(taki(["scene"]).arg(&scene)).refused(65, &["s.toml:2", "without a base"]);
    let option = |name: &str| run(&mut taki(["scene", "fig5", "--remove", name]));
    option("rocks.wal").refused(65, &["--remove: the scene has no \"rocks.wal\""]);
    option("quads.1").refused(65, &["numbered", "remove quads, and write those that stay"]);
    run(&mut taki(["scene", "fig5", "--set", "remove=3"])).refused(2, &["give names, such as remove=rocks"]);
    let sweep = ["batch", "fig5", "--sweep", "remove=quads,curves", "-o", "{remove}.png", "--dry-run"];
    run(&mut taki(sweep)).refused(65, &["--sweep", "unknown key", "give --remove NAME"]);
}
