//! Batches: a picture depends only on its scene and its number, and none is lost, however the work ends.

mod crash;
mod formats;
mod moving;
mod numbers;
mod sequence;
mod sweep;

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::Command;

use tempfile::{TempDir, tempdir};

use crate::cli::faults::{Run, run, taki};

/// Pictures so small that a test can make hundreds of them.
const TINY: [&str; 6] = ["front", "--engine", "cpu", "--size", "16x12", "--samples=1"];

/// Command `taki batch` that renders tiny pictures into `folder`.
fn batch<A: AsRef<OsStr>>(folder: &Path, arguments: impl IntoIterator<Item = A>) -> Command {
    let mut command = taki(["batch"]);
    command.args(TINY).current_dir(folder).args(arguments);
    command
}

/// Files of a folder, by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    entries
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(path).unwrap()))
        .collect()
}

/// Last event of a run with `--events json`.
fn done(run: &Run) -> serde_json::Value {
    let last = run.stdout().lines().last().expect("events");
    let event: serde_json::Value = serde_json::from_str(last).expect("JSON");
    assert_eq!(event["event"], "done");
    event
}

fn counts(run: &Run) -> [u64; 5] {
    let event = done(run);
    ["pictures", "kept", "rendered", "failed", "left"].map(|what| event[what].as_u64().expect("a count"))
}

const EVENTS: [&str; 2] = ["--events", "json"];

fn folder() -> TempDir {
    tempdir().unwrap()
}

#[test]
fn a_frame_is_what_render_makes_of_it_to_the_byte() {
    let dir = folder();
    let patterns = ["--frames", "0-3", "-o", "f.####.png", "-o", "f.####.exr"];
    run(&mut batch(dir.path(), patterns)).done();
    let made = files(dir.path());
    assert_eq!(made.len(), 8, "{:?}", made.keys());
    for frame in 0..4 {
        let still = folder();
        let number = frame.to_string();
        let mut command = taki(["render"]);
        command.args(TINY).args(["--frame", &number, "-o", "s.png", "-o", "s.exr"]).current_dir(still.path());
        run(&mut command).done();
        for kind in ["png", "exr"] {
            let alone = fs::read(still.path().join(format!("s.{kind}"))).unwrap();
            assert!(made[&format!("f.{frame:04}.{kind}")] == alone, "frame {frame}.{kind}");
        }
    }
    // The pictures differ, because the water moves.
    assert!(made["f.0000.png"] != made["f.0001.png"]);
}

#[test]
fn order_threads_and_engine_reuse_change_no_byte() {
    let whole = folder();
    let auto = |folder: &Path| {
        let mut command = taki(["batch", "front", "--size", "64x48", "--frames", "0-5", "-o", "f.####.png"]);
        command.args(["--set", "curves.h=0.7"]).current_dir(folder);
        command
    };
    run(&mut auto(whole.path())).done();
    let expected = files(whole.path());
    for (threads, shards) in [("1", 2), ("3", 3)] {
        let dir = folder();
        for shard in (0..shards).rev() {
            let of = format!("{shard}/{shards}");
            run(auto(dir.path()).args(["--shard", &of]).env("RAYON_NUM_THREADS", threads)).done();
        }
        assert!(files(dir.path()) == expected, "{threads} threads, {shards} shards");
    }
}

#[test]
fn a_loop_closes_frame_n_is_frame_0() {
    let dir = folder();
    run(&mut batch(
        dir.path(),
        ["--loop", "6", "--set", "animate.turn=6", "--frames", "0-7", "-o", "f.#.png"],
    ))
    .done();
    let made = files(dir.path());
    assert!(made["f.0.png"] == made["f.6.png"] && made["f.1.png"] == made["f.7.png"]);
    let pictures: std::collections::BTreeSet<&Vec<u8>> = made.values().collect();
    assert_eq!(pictures.len(), 6);
}

#[test]
fn a_second_run_keeps_what_is_whole_and_makes_what_is_not() {
    let dir = folder();
    let arguments = ["--frames", "0-4", "-o", "f.####.png", "--events", "json"];
    assert_eq!(counts(&run(&mut batch(dir.path(), arguments))), [5, 0, 5, 0, 0]);
    let expected = files(dir.path());
    let again = run(&mut batch(dir.path(), arguments));
    assert_eq!(counts(&again), [5, 5, 0, 0, 0]);

    // One picture is missing, one is cut short and one is empty, so the names alone do not tell.
    fs::remove_file(dir.path().join("f.0001.png")).unwrap();
    let cut = &expected["f.0002.png"][..expected["f.0002.png"].len() - 20];
    fs::write(dir.path().join("f.0002.png"), cut).unwrap();
    fs::write(dir.path().join("f.0003.png"), "").unwrap();
    let mended = run(&mut batch(dir.path(), arguments));
    assert_eq!(counts(&mended), [5, 2, 3, 0, 0]);
    assert_eq!(mended.lines("taki: warning:").len(), 2, "{mended:?}");
    assert!(files(dir.path()) == expected);
}

#[test]
fn pictures_of_another_scene_are_kept_unless_they_may_be_replaced() {
    let dir = folder();
    run(&mut batch(dir.path(), ["--frames", "0-2", "-o", "f.####.png"])).done();
    let before = files(dir.path());
    let other = ["--frames", "0-2", "-o", "f.####.png", "--set", "trace.sigma=3"];
    run(&mut batch(dir.path(), other)).refused(73, &["f.0000.png", "sigma = 3", "--overwrite"]);
    assert!(files(dir.path()) == before);
    run(batch(dir.path(), other).arg("--overwrite")).done();
    let after = files(dir.path());
    assert!(after.len() == 3 && after.iter().all(|(name, bytes)| before[name] != *bytes));
    // A file that is not a picture of this program is not replaced either.
    for foreign in [&b"not a picture"[..], b"", b"\x89PNG\r\n\x1a\n and more"] {
        let place = folder();
        fs::write(place.path().join("f.0001.png"), foreign).unwrap();
        let ended = run(&mut batch(place.path(), ["--frames", "0-2", "-o", "f.####.png"]));
        match foreign {
            b"" => drop(ended.done()),
            _ => ended.refused(73, &["f.0001.png", "not a picture that taki wrote"]),
        }
    }
    let sheets = folder();
    fs::write(sheets.path().join("front.manifest.csv"), "mine").unwrap();
    run(&mut batch(sheets.path(), ["--sweep", "h=1,2", "-o", "{h}.png"]))
        .refused(73, &["front.manifest.csv"]);
    // Neither is a picture of another part of the same scene.
    run(&mut batch(
        dir.path(),
        ["--frames", "0-2", "-o", "f.####.png", "--set", "trace.sigma=3", "--crop", "0,0,4,4"],
    ))
    .refused(73, &["another part"]);
    let mut plain = taki(["render"]);
    run(plain.args(TINY).args(["-o", "f.0001.exr", "--layers", "rgb"]).current_dir(dir.path())).done();
    run(&mut batch(dir.path(), ["--frames", "0-2", "-o", "f.####.exr"])).refused(73, &["f.0001.exr"]);
}

#[test]
fn faults_are_known_before_any_picture() {
    let dir = folder();
    fs::create_dir(dir.path().join("f.0002.png")).unwrap();
    fs::write(
        dir.path().join("bad.toml"),
        "version = 1\nbase = \"front\"\n[[animate.tracks]]\nkey = \"camera.eye\"\nframes = [0, 8]\n\
         values = [[0, 0, 2], [0, 0, -2]]\n",
    )
    .unwrap();
    let cases: [(&[&str], i32, &[&str]); 17] = [
        (&["--frames", "0-3", "-o", "absent/f.####.png"], 73, &["make the folder"]),
        (&["--frames", "0-3", "-o", "f.####.png"], 73, &["f.0002.png", "a folder has this name"]),
        (&["--frames", "0-3", "-o", "f.exr"], 2, &["4 frames would share one name", "fall.####.png"]),
        (&["--frames", "0-3", "-o", "f.####.bmp"], 2, &["unknown kind"]),
        (&["--frames", "3-0", "-o", "f.####.png"], 2, &["ends before it begins"]),
        (&["--frames", "x", "-o", "f.####.png"], 2, &["0-239"]),
        (&["--frames", "0:95", "-o", "f.####.png"], 2, &["written with a hyphen: 0-95"]),
        (&["--frames", "0-999999999", "-o", "f.####.png"], 2, &["more than 1000000 frames"]),
        (&["--shard", "8/8", "-o", "f.####.png"], 2, &["0/8"]),
        (&["--sweep", "h=0.5,0.7", "-o", "f.####.png"], 2, &["{h}"]),
        (&["--frames", "1", "-o", "f.#.png", "-o", "f.#.png"], 2, &["given twice"]),
        (&["--frames", "1", "-o", "f.#.png", "-o", "./f.1.png"], 2, &["f.1.png is given twice as frame 1"]),
        (&["--frames", "1-2", "-o", "f.#.exr", "-o", "f.gif", "--layers", "depth"], 2, &["needs colour"]),
        (&["--frames", "1", "-o", "absent/f.#.png", "--shard", "5/8"], 73, &["make the folder"]),
        (&["--frames", "1", "-o", "f.#.png", "--memory", "16"], 33, &["needs", "raise --memory"]),
        (&["--crop", "10,0,10,4", "--frames", "1", "-o", "g.#.png"], 2, &["columns 0 to 15, rows 0 to 11"]),
        (&["--loop", "0", "--set", "animate.frames=2000000", "-o", "f.#.png"], 65, &["animate.frames"]),
    ];
    for (arguments, code, words) in cases {
        let refused = run(&mut batch(dir.path(), arguments));
        assert_eq!(refused.exit_code(), Some(code), "{arguments:?}: {refused:?}");
        words.iter().for_each(|word| assert!(refused.stderr().contains(word), "no {word:?} in {refused:?}"));
    }
    // The camera passes its own target half-way.
    let mut command =
        taki(["batch", "bad.toml", "--size", "8x8", "--engine", "cpu", "--frames", "0-8", "-o", "g.#.png"]);
    run(command.current_dir(dir.path())).refused(65, &["frame 4", "same point"]);
    assert_eq!(files_but(dir.path(), &["f.0002.png", "bad.toml"]), Vec::<String>::new());
}

fn files_but(folder: &Path, but: &[&str]) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned());
    names.filter(|name| !but.contains(&name.as_str())).collect()
}

#[test]
fn a_dry_run_tells_what_would_be_made_and_makes_nothing() {
    let dir = folder();
    let arguments = ["--frames", "0-9", "-o", "f.####.png", "-o", "f.####.exr", "--dry-run"];
    let told = run(&mut batch(dir.path(), arguments));
    for word in ["10 pictures", "f.0000.png", "f.0009.exr", "memory", "disk"] {
        assert!(told.done().contains(word), "no {word:?} in {}", told.done());
    }
    assert!(files(dir.path()).is_empty());
    let json: serde_json::Value =
        serde_json::from_str(run(batch(dir.path(), arguments).arg("--json")).done()).unwrap();
    assert_eq!((json["pictures"].as_u64(), json["to_render"].as_u64()), (Some(10), Some(10)));
    // A picture has thirteen channels and a PNG of 16×12 pixels.
    assert_eq!(json["disk_bytes"].as_u64(), Some(10 * 16 * 12 * (13 * 4 + 3)));
}

#[test]
fn events_tell_every_picture_once_in_lines_of_json() {
    let dir = folder();
    let run = run(batch(dir.path(), ["--frames", "4-6", "-o", "f.#.png"]).args(EVENTS));
    let events: Vec<serde_json::Value> =
        run.done().lines().map(|line| serde_json::from_str(line).expect("one object a line")).collect();
    let of = |what: &str| events.iter().filter(|e| e["event"] == what).collect::<Vec<_>>();
    assert_eq!((of("started").len(), of("done").len()), (1, 1));
    for what in ["rendering", "saved"] {
        let frames: Vec<u64> = of(what).iter().map(|e| e["frame"].as_u64().unwrap()).collect();
        assert_eq!(frames, [4, 5, 6], "{what}");
    }
    assert_eq!(of("saved")[1]["files"], serde_json::json!(["f.5.png"]));
    assert!(of("saved")[1]["seconds"]["integrate"].as_f64().unwrap() > 0.0);
    assert_eq!(events[0]["event"], "started");
    assert_eq!(events.last().unwrap()["event"], "done");
}

#[test]
fn one_failure_ends_the_run_or_with_keep_going_does_not() {
    let dir = folder();
    let small = ["nx", "ny", "nz"].map(|axis| format!("--set=volume.{axis}=4"));
    run(taki(["volume", "build", "front", "-o", "a.npz"]).args(small).current_dir(dir.path())).done();
    fs::copy(dir.path().join("a.npz"), dir.path().join("c.npz")).unwrap();
    fs::write(dir.path().join("b.npz"), "no volume").unwrap();
    let arguments = ["--sweep", "volume.file=a.npz,b.npz,c.npz", "-o", "f-{file}.png", "--events", "json"];
    let stopped = run(&mut batch(dir.path(), arguments));
    stopped.refused(65, &["b.npz"]);
    // The next picture may have been in progress, but not both.
    let [_, _, rendered, failed, left] = counts(&stopped);
    assert_eq!((rendered, failed, left), (1, 1, 1));
    let on = run(batch(dir.path(), arguments).arg("--keep-going"));
    on.refused(65, &["b.npz"]);
    assert_eq!(counts(&on), [3, 1, 1, 1, 0]);
    assert_eq!(done(&on)["exit_code"], 65);
    let mut made = files_but(dir.path(), &["a.npz", "b.npz", "c.npz"]);
    made.sort();
    assert_eq!(made, ["f-a.npz.png", "f-c.npz.png"]);
}
