//! Pictures in place of scenes: rendered again, they are the same files.

use std::fs;
use std::path::Path;

use super::faults::{Run, render, run, small_volume, taki};
use tempfile::tempdir;

/// Runs `taki render SCENE -o OUTPUT` on the CPU with more arguments.
fn again(folder: &Path, scene: &str, output: &str, more: &[&str]) -> Run {
    let arguments = ["render", scene, "--engine", "cpu", "-o", output];
    run(taki(arguments).args(more).current_dir(folder))
}

/// Renders a preset very small.
fn small(folder: &Path, scene: &str, output: &str, more: &[&str]) {
    run(render(scene, folder.join(output)).args(more).current_dir(folder)).done();
}

fn assert_equal(folder: &Path, a: &str, b: &str) {
    assert!(fs::read(folder.join(a)).unwrap() == fs::read(folder.join(b)).unwrap(), "{a} and {b} differ");
}

#[test]
fn a_picture_is_rendered_again_from_the_scene_in_it() {
    let dir = tempdir().unwrap();
    let folder = dir.path();
    for scene in ["fig5", "waterfall"] {
        for name in ["p.png", "p.exr"] {
            small(folder, scene, name, &["--set=h=1.3", "--set=exposure=-0.5"]);
            let extension = &name[1..];
            again(folder, name, &format!("q{extension}"), &[]).done();
            assert_equal(folder, name, &format!("q{extension}"));
        }
    }
    // A part tells the scene of the whole, in which settings can be changed.
    small(folder, "fig5", "whole.png", &["--seed=9"]);
    small(folder, "fig5", "part.png", &["--crop=4,4,8,8"]);
    again(folder, "part.png", "changed.png", &["--seed=9"]).done();
    assert_equal(folder, "whole.png", "changed.png");
    let other =
        run(taki(["batch", "whole.png", "--engine=cpu", "--frames=0", "-o=b.####.png"]).current_dir(folder));
    other.done();
    assert_equal(folder, "whole.png", "b.0000.png");
    let printed = run(taki(["scene", "whole.png"]).current_dir(folder)).done().to_owned();
    assert!(printed.contains("seed = 9"), "{printed}");
}

#[test]
fn the_picture_that_a_scene_is_read_from_is_replaced_only_by_name() {
    let dir = tempdir().unwrap();
    small(dir.path(), "fig5", "p.png", &[]);
    let before = fs::read(dir.path().join("p.png")).unwrap();
    let changed = ["--engine=cpu", "--seed=9"];
    let refused = run(taki(["render", "p.png"]).args(changed).current_dir(&dir));
    refused.refused(2, &["p.png holds the scene", "-o"]);
    assert!(fs::read(dir.path().join("p.png")).unwrap() == before);
    again(dir.path(), "p.png", "p.png", &["--seed=9"]).done();
    assert!(fs::read(dir.path().join("p.png")).unwrap() != before);
}

#[test]
fn a_volume_file_is_given_again_and_recognised() {
    let dir = tempdir().unwrap();
    let folder = dir.path();
    small_volume(&folder.join("v.npz"));
    run(taki(["volume", "build", "front", "--seed=77", "-o", "w.npz"]).current_dir(folder)).done();
    small(folder, "front", "p.png", &["--set=volume.file=v.npz"]);
    again(folder, "p.png", "q.png", &[]).refused(
        65,
        &["shows another volume", "--set volume.file=FILE", "taki scene PICTURE | taki render -"],
    );
    run(taki(["volume", "build", "p.png"]).current_dir(folder)).refused(65, &["shows another volume"]);
    let given = again(folder, "p.png", "q.png", &["--set=volume.file=v.npz"]);
    given.done();
    assert_eq!(given.lines("taki: warning"), [""; 0]);
    assert_equal(folder, "p.png", "q.png");
    let other = again(folder, "p.png", "q.png", &["--set=volume.file=w.npz"]);
    other.done();
    assert!(other.stderr().contains("volume.file is not that of the picture"), "{other:?}");
    // Another recipe is meant to make another volume.
    again(folder, "p.png", "q.png", &["--seed=5"]).done();
    // The way out works.
    let printed = run(taki(["scene", "p.png"]).current_dir(folder)).done().to_owned();
    fs::write(folder.join("s.toml"), printed).unwrap();
    again(folder, "s.toml", "q.png", &[]).done();
}

#[test]
fn an_environment_map_is_given_again_and_recognised() {
    let dir = tempdir().unwrap();
    let folder = dir.path();
    for (name, texel) in [("m.hdr", [128, 128, 128, 128]), ("n.hdr", [128, 64, 32, 128])] {
        let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n".to_vec();
        bytes.extend(texel.repeat(8 * 16));
        fs::write(folder.join(name), bytes).unwrap();
    }
    small(folder, "front", "p.png", &["--set=environment.kind=file", "--set=environment.file=m.hdr"]);
    again(folder, "p.png", "q.png", &[]).refused(65, &["lit by an environment map", "environment.file=FILE"]);
    run(taki(["scene", "p.png"]).current_dir(folder)).refused(65, &["lit by an environment map"]);
    let given = again(folder, "p.png", "q.png", &["--set=environment.file=m.hdr"]);
    given.done();
    assert!(!given.stderr().contains("not that of the picture"), "{given:?}");
    assert_equal(folder, "p.png", "q.png");
    let other = again(folder, "p.png", "q.png", &["--set=environment.file=n.hdr"]);
    other.done();
    assert!(other.stderr().contains("environment.file is not that of the picture"), "{other:?}");
    again(folder, "p.png", "q.png", &["--set=environment.kind=none"]).done();
}

#[test]
fn a_picture_without_a_scene_is_no_scene() {
    let dir = tempdir().unwrap();
    let folder = dir.path();
    image::RgbImage::new(4, 4).save(folder.join("plain.png")).unwrap();
    exr::prelude::write_rgb_file(folder.join("plain.exr"), 4, 4, |_, _| (0.5f32, 0.5f32, 0.5f32)).unwrap();
    image::RgbaImage::new(4, 4).save(folder.join("alpha.png")).unwrap();
    small(folder, "fig5", "p.png", &[]);
    let bytes = fs::read(folder.join("p.png")).unwrap();
    fs::write(folder.join("cut.png"), &bytes[..40]).unwrap();
    for name in ["plain.png", "plain.exr", "alpha.png", "cut.png"] {
        let refused = run(taki(["render", name, "-o", "x.png"]).current_dir(folder));
        refused.refused(65, &[name, "one that taki wrote"]);
    }
}
