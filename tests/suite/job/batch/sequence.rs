//! Batches of volumes that read another file for each frame.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Mutex;

use glam::{DAffine3, DVec3};
use taki::Result;
use taki::grid::{Grid, write_vdb};
use taki::job::VolumeMemo;
use taki::scene::{Animation, Limits};
use taki::util::monitor::Monitor;
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
