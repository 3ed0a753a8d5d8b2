//! Batches of volumes that read another file for each frame.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

use glam::{DAffine3, DVec3};
use taki::Result;
use taki::grid::{Grid, write_vdb};
use taki::job::batch::{Batch, Request};
use taki::job::{Depth, VolumeMemo};
use taki::output::frame::Exr;
use taki::picture::Layer;
use taki::scene::{Animation, Limits};
use taki::util::monitor::Monitor;
use taki::volume::VolumeTexture;
use tempfile::TempDir;

use super::{counts, files, folder};
use crate::cli::faults::{run, taki};

const SCENE: &str = "version = 1
base = \"front\"
remove = [\"quads\"]
[camera]
eye = [0, 0, 6]
target = [0, 0, 0]
[trace]
sigma = 5
[volumes.s]
builder = \"flow\"
source = \"sim/a.####.vdb\"
frame = 1
[boxes.b]
volume = \"s\"
[animate]
frames = 4
speed = 0
";

/// A folder with a scene and the files 1 to 4 of its sequence, each larger than the one before.
fn sequence() -> TempDir {
    let dir = folder();
    fs::create_dir(dir.path().join("sim")).unwrap();
    fs::write(dir.path().join("s.toml"), SCENE).unwrap();
    for number in 1..5u32 {
        let side = 2 + 3 * number;
        let values = (0..side.pow(3)).map(|i| 0.2 + 0.8 * (i as f32 * 0.7).sin().abs()).collect();
        let first = [-(side as i32) / 2; 3];
        let to_world = DAffine3::from_scale(DVec3::splat(0.2));
        let grid = Grid::from_dense("density", 1, first, [side; 3], values, to_world);
        write_vdb(&dir.path().join(format!("sim/a.{number:04}.vdb")), &[grid]).unwrap();
    }
    dir
}

fn command(folder: &Path, kind: &str, arguments: &[&str]) -> Command {
    let mut command = taki([kind]);
    command.args(["s.toml", "--engine", "cpu", "--size", "24x18", "--samples=1"]);
    command.args(arguments).current_dir(folder);
    command
}

#[test]
fn a_frame_of_a_sequence_is_what_render_makes_of_its_file_to_the_byte() {
    let dir = sequence();
    run(&mut command(dir.path(), "batch", &["-o", "f.####.png"])).done();
    let made = files_of_batch(dir.path());
    assert_eq!(made.len(), 4);
    assert!(made.windows(2).all(|pair| pair[0] != pair[1]), "the pictures differ");
    for (frame, batched) in made.iter().enumerate() {
        let alone = dir.path().join("alone.png");
        let number = frame.to_string();
        run(&mut command(dir.path(), "render", &["--frame", &number, "-o", "alone.png"])).done();
        assert!(fs::read(&alone).unwrap() == *batched, "frame {frame}");
        let file = format!("volumes.s.frame={}", frame + 1);
        run(&mut command(dir.path(), "render", &["--set", &file, "-o", "alone.png"])).done();
        assert!(fs::read(&alone).unwrap() == *batched, "file {}", frame + 1);
    }
    // Kept pictures stay, a lost one is made again, and shards make the same.
    fs::remove_file(dir.path().join("f.0002.png")).unwrap();
    let again = run(&mut command(dir.path(), "batch", &["-o", "f.####.png", "--events", "json"]));
    assert_eq!(counts(&again), [4, 3, 1, 0, 0]);
    assert!(files_of_batch(dir.path()) == made);
    for frame in 0..4 {
        fs::remove_file(dir.path().join(format!("f.{frame:04}.png"))).unwrap();
    }
    for shard in ["1/2", "0/2"] {
        run(&mut command(dir.path(), "batch", &["-o", "f.####.png", "--shard", shard])).done();
    }
    assert!(files_of_batch(dir.path()) == made);
}

/// Bytes of the pictures in the order of their frames.
fn files_of_batch(folder: &Path) -> Vec<Vec<u8>> {
    (0..4).map(|frame| fs::read(folder.join(format!("f.{frame:04}.png"))).unwrap()).collect()
}

#[test]
fn missing_files_are_told_before_any_work() {
    let dir = sequence();
    fs::create_dir(dir.path().join("out")).unwrap();
    for auto in ["image.auto_exposure=none", "image.auto_exposure=average"] {
        let arguments = ["--frames", "0-9", "-o", "out/f.####.png", "--set", auto];
        let words =
            ["6 of 10 files are missing", "a.0005.vdb", "a.0008.vdb, …", "volumes.s.frame", "--frames"];
        run(&mut command(dir.path(), "batch", &arguments)).refused(65, &words);
        assert!(files(&dir.path().join("out")).is_empty());
    }
    let sweep = ["--sweep", "volumes.s.frame=1,3", "--frames", "0-2", "-o", "out/f.{frame}.####.png"];
    run(&mut command(dir.path(), "batch", &sweep)).refused(65, &["1 of 3 files are missing", "a.0005.vdb"]);
    assert!(files(&dir.path().join("out")).is_empty());
}

/// Monitor that counts the stages it is told of.
#[derive(Default)]
struct Stages(Mutex<Vec<&'static str>>);

impl Monitor for Stages {
    fn progress(&self, stage: &'static str, _: u64, _: u64) -> Result<()> {
        self.0.lock().unwrap().push(stage);
        Ok(())
    }
    fn warn(&self, _: &str) {}
}

#[test]
fn volumes_that_were_read_ahead_are_taken_unless_their_file_changed() {
    let dir = sequence();
    let animation = Animation::load(&dir.path().join("s.toml"), &[], &Limits::default()).unwrap();
    let scene = |frame: i32| animation.at(frame).unwrap();
    let mut memo = VolumeMemo::default();
    let take = |memo: &mut VolumeMemo, frame: i32| {
        let stages = Stages::default();
        let (volumes, _) = memo.volumes(&scene(frame), 1 << 30, &stages).unwrap();
        let truth = scene(frame).volume(1 << 30, &Stages::default()).unwrap();
        assert_eq!(volumes[0].checksum(), truth.checksum());
        !stages.0.into_inner().unwrap().is_empty()
    };
    assert!(take(&mut memo, 0), "nothing was read before");
    memo.read_ahead(scene(1), 1 << 30);
    assert!(!take(&mut memo, 1), "it was read ahead");
    memo.read_ahead(scene(2), 1 << 30);
    assert!(take(&mut memo, 3), "another frame came");
    // Too little memory to read ahead: it is read when its turn comes.
    memo.read_ahead(scene(0), 1 << 10);
    assert!(take(&mut memo, 0));
    memo.read_ahead(scene(1), 1 << 30);
    std::thread::sleep(std::time::Duration::from_millis(300));
    fs::copy(dir.path().join("sim/a.0004.vdb"), dir.path().join("sim/a.0002.vdb")).unwrap();
    assert!(take(&mut memo, 1), "the file has changed since");
}

#[test]
fn a_batch_that_continues_reads_only_files_that_changed() {
    let dir = sequence();
    let plan = || {
        let sets = ["image.width=24", "image.height=18", "image.samples=1"].map(String::from);
        let animation = Animation::load(&dir.path().join("s.toml"), &sets, &Limits::default()).unwrap();
        let request = Request {
            frames: None,
            sweeps: Vec::new(),
            outputs: vec![dir.path().join("f.####.png")],
            sheet: None,
            manifests: Vec::new(),
            shard: None,
            overwrite: false,
            keep_going: false,
            retries: 0,
            crop: None,
            exr: Exr::of(&Layer::ALL),
            depth: Depth::default(),
            codec: None,
            movie_bits: None,
            stale: Duration::from_secs(60),
        };
        let stages = Stages::default();
        let batch = Batch::plan(animation, request, &stages)?;
        let read = stages.0.into_inner().unwrap().iter().filter(|stage| **stage == "density").count();
        Ok::<_, taki::Error>((batch.needs()?.to_render, read))
    };
    assert_eq!(plan().unwrap(), (4, 0));
    run(&mut command(dir.path(), "batch", &["-o", "f.####.png"])).done();
    assert_eq!(plan().unwrap(), (0, 0), "no file is read");
    // The same contents, written again, are read and found to be the same.
    let file = dir.path().join("sim/a.0003.vdb");
    let contents = fs::read(&file).unwrap();
    fs::write(&file, &contents).unwrap();
    let (missing, read) = plan().unwrap();
    assert!(missing == 0 && read > 0, "{missing} {read}");
    // Other contents with the time of the old ones.
    let time = fs::metadata(dir.path().join("sim/a.0001.vdb")).unwrap().modified().unwrap();
    fs::copy(dir.path().join("sim/a.0002.vdb"), &file).unwrap();
    fs::File::options().append(true).open(&file).unwrap().set_modified(time).unwrap();
    let said = plan().unwrap_err().to_string();
    assert!(said.contains("f.0002.png") && said.contains("other contents"), "{said}");
}

/// Monitor that notes, at every step of building, whether the last volumes are still held.
struct Held(Weak<Vec<VolumeTexture>>, Mutex<Vec<bool>>);

impl Monitor for Held {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        self.1.lock().unwrap().push(self.0.strong_count() > 0);
        Ok(())
    }
    fn warn(&self, _: &str) {}
}

#[test]
fn a_memo_that_makes_room_lets_the_last_volume_go_before_it_builds_the_next() {
    let dir = sequence();
    let animation = Animation::load(&dir.path().join("s.toml"), &[], &Limits::default()).unwrap();
    for (mut memo, is_held) in [(VolumeMemo::default(), true), (VolumeMemo::default().making_room(), false)] {
        let (first, _) = memo.volumes(&animation.at(2).unwrap(), 1 << 30, &Stages::default()).unwrap();
        // The same volume again takes no work.
        assert_eq!(memo.volumes(&animation.at(2).unwrap(), 1 << 30, &Stages::default()).unwrap().1, None);
        let held = Held(Arc::downgrade(&first), Mutex::default());
        drop(first);
        let (second, _) = memo.volumes(&animation.at(3).unwrap(), 1 << 30, &held).unwrap();
        let truth = animation.at(3).unwrap().volume(1 << 30, &Stages::default()).unwrap();
        assert_eq!(second[0].checksum(), truth.checksum());
        let steps = held.1.into_inner().unwrap();
        assert!(!steps.is_empty() && steps.iter().all(|step| *step == is_held), "{steps:?}");
    }
}
