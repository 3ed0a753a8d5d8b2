//! Alpha in files: every format that can hold it does, other programs read it, and the rest is refused.

use std::fs;
use std::path::Path;
use std::process::Command;

use taki::output::frame::{ReadPicture, read_exr, read_picture, verify};
use tempfile::tempdir;

use crate::cli::faults::{Run, run, taki};

/// Renders a small picture in a folder. The backdrop of pictures without alpha is even.
fn render(folder: &Path, more: &[&str]) -> Run {
    let small = ["render", "front", "--engine", "cpu", "--size", "40x30", "--samples", "2"];
    let look = ["--set", "image.tone=none", "--set", "image.exposure=0", "--set", "image.dither=none"];
    let grey = "background.zenith=[0.25, 0.25, 0.25]";
    let even = ["--set", grey, "--set", "background.horizon=[0.25, 0.25, 0.25]"];
    run(taki(small).args(look).args(even).args(more).current_dir(folder))
}

fn read(folder: &Path, name: &str) -> ReadPicture {
    read_picture(&folder.join(name)).expect(name)
}

#[test]
fn formats_hold_colour_and_alpha_apart_and_all_the_same() {
    let dir = tempdir().unwrap();
    let all = ["-o", "a.png", "-o", "a.webp", "-o", "a.tif"];
    render(dir.path(), &[&all[..], &["--alpha"]].concat()).done();
    render(dir.path(), &["-o", "deep.png", "--bits", "16", "--alpha"]).done();
    let small = read(dir.path(), "a.png");
    let alpha = small.alpha.clone().expect("alpha");
    assert!(alpha.contains(&0.0) && alpha.iter().any(|&a| a > 0.5), "empty and dense pixels");
    assert_eq!(read(dir.path(), "a.webp"), small);
    let (deep, tiff) = (read(dir.path(), "deep.png"), read(dir.path(), "a.tif"));
    assert_eq!((deep.encoding.bits, tiff.encoding.bits), (16, 16));
    assert_eq!((&deep.pixels, &deep.alpha), (&tiff.pixels, &tiff.alpha));
    for ((fine, coarse), a) in deep.alpha.as_ref().unwrap().iter().zip(&alpha).zip(&small.pixels) {
        assert!((fine - coarse).abs() <= 0.51 / 255.0, "{fine} and {coarse}, {a:?}");
    }
    for name in ["a.png", "a.webp", "a.tif", "deep.png"] {
        let verified = verify(&dir.path().join(name)).expect("whole");
        assert!(verified.encoding.expect("a developed picture").alpha, "{name}");
        // Another program reads four channels.
        let out = Command::new("ffmpeg")
            .args(["-v", "error", "-i", name, "-f", "rawvideo", "-pix_fmt", "rgba", "-"])
            .current_dir(dir.path())
            .output()
            .expect("ffmpeg");
        assert!(out.status.success() && out.stdout.len() == 40 * 30 * 4, "{name}");
        for (got, want) in out.stdout.as_chunks::<4>().0.iter().zip(&alpha) {
            assert!((f32::from(got[3]) / 255.0 - want).abs() <= 1.01 / 255.0, "{name}: {got:?} for {want}");
        }
    }
}

#[test]
fn a_linear_picture_over_a_backdrop_is_the_picture_with_it() {
    let dir = tempdir().unwrap();
    let linear = ["--bits", "16", "--linear"];
    render(dir.path(), &[&linear[..], &["-o", "with.png"]].concat()).done();
    render(dir.path(), &[&linear[..], &["-o", "apart.png", "--alpha"]].concat()).done();
    let (want, got) = (read(dir.path(), "with.png"), read(dir.path(), "apart.png"));
    for (got, want) in got.over(0.25).iter().zip(&want.pixels) {
        let near = (0..3).all(|c| (got[c] - want[c]).abs() <= 2.0 / 65_535.0);
        assert!(near, "{got:?} for {want:?}");
    }
}

#[test]
fn an_exr_holds_colour_multiplied_by_alpha() {
    let dir = tempdir().unwrap();
    render(dir.path(), &["-o", "with.exr"]).done();
    render(dir.path(), &["-o", "apart.exr", "--alpha"]).done();
    let read = |name: &str| {
        let (_, _, channels) = read_exr(&dir.path().join(name), 1 << 30).expect(name);
        move |wanted: &str| channels.iter().find(|(name, _)| name == wanted).map(|(_, values)| values.clone())
    };
    let (with, apart) = (read("with.exr"), read("apart.exr"));
    assert!(with("A").is_none());
    let alpha = apart("A").expect("alpha");
    for name in ["R", "G", "B"] {
        let (want, got) = (with(name).unwrap(), apart(name).unwrap());
        for ((got, alpha), want) in got.iter().zip(&alpha).zip(&want) {
            assert!((got + (1.0 - alpha) * 0.25 - want).abs() < 2e-6, "{name}: {got}, {alpha} for {want}");
        }
    }
    let compare = |a: &str, b: &str| run(taki(["compare", a, b]).current_dir(dir.path()));
    compare("apart.exr", "apart.exr").done();
    compare("with.exr", "apart.exr").refused(1, &["tolerance"]);
}

#[test]
fn what_has_no_alpha_is_refused_before_the_work() {
    let dir = tempdir().unwrap();
    render(dir.path(), &["-o", "a.jpg", "--alpha"]).refused(2, &["a.jpg", "JPEG", "alpha", ".png"]);
    let batch = ["batch", "front", "--engine", "cpu", "--size", "16x12", "--frames", "0-1", "--alpha"];
    for movie in ["a.gif", "a.png", "a.mp4"] {
        // A picture's ending without the frame's number names a movie too.
        let way_out = if movie.ends_with(".png") { "####" } else { "frames" };
        run(taki(batch).args(["-o", movie]).current_dir(dir.path())).refused(2, &[movie, "alpha", way_out]);
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn crops_with_alpha_stitch_to_the_file_of_the_whole() {
    let dir = tempdir().unwrap();
    for name in ["png", "tif", "webp"] {
        let file = |part: &str| format!("{part}.{name}");
        render(dir.path(), &["--alpha", "-o", &file("whole")]).done();
        render(dir.path(), &["--alpha", "-o", &file("top"), "--crop", "0,0,40,13"]).done();
        render(dir.path(), &["--alpha", "-o", &file("low"), "--crop", "0,13,40,17"]).done();
        let parts = [file("top"), file("low")];
        run(taki(["stitch"]).args(&parts).args(["-o", &file("joined")]).current_dir(dir.path())).done();
        let read = |part: &str| fs::read(dir.path().join(file(part))).unwrap();
        assert!(read("joined") == read("whole"), "{name}");
    }
}

#[test]
fn a_batch_knows_its_pictures_with_alpha_and_makes_those_without_anew() {
    let dir = tempdir().unwrap();
    let batch = |more: &[&str]| {
        let base =
            ["batch", "front", "--engine", "cpu", "--size", "16x12", "--frames", "0-1", "-o", "f.##.png"];
        run(taki(base).args(more).current_dir(dir.path()))
    };
    let file = dir.path().join("f.01.png");
    batch(&["--alpha"]).done();
    let first = fs::metadata(&file).unwrap().modified().unwrap();
    batch(&["--alpha"]).done();
    assert_eq!(fs::metadata(&file).unwrap().modified().unwrap(), first, "it is complete and kept");
    batch(&["--overwrite"]).done();
    assert!(read(dir.path(), "f.01.png").alpha.is_none());
}

#[test]
fn compare_sees_a_difference_of_alpha_alone() {
    let dir = tempdir().unwrap();
    let save = |name: &str, pixels: [[u8; 4]; 2]| {
        image::RgbaImage::from_raw(2, 1, pixels.concat()).unwrap().save(dir.path().join(name)).unwrap();
    };
    save("a.png", [[0, 0, 0, 255], [255, 255, 255, 255]]);
    save("b.png", [[0, 0, 0, 0], [255, 255, 255, 255]]);
    save("c.png", [[0, 0, 0, 255], [255, 255, 255, 0]]);
    let compare = |a: &str, b: &str| run(taki(["compare", a, b]).current_dir(dir.path()));
    compare("a.png", "a.png").done();
    compare("a.png", "b.png").refused(1, &["tolerance"]);
    compare("a.png", "c.png").refused(1, &["tolerance"]);
}
