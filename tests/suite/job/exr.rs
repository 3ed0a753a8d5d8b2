//! EXR files of the command line: halves, compressions, primaries and a file for each layer.

use std::fs;
use std::path::Path;

use taki::output::frame::{Compression, Verified, verify};
use taki::picture::{Gamut, Layer};
use tempfile::tempdir;

use crate::cli::faults::{run, taki};

const TINY: [&str; 5] = ["front", "--engine=cpu", "--size=24x18", "--samples=1", "--no-cache"];

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn verified(path: &Path) -> Verified {
    verify(path).expect("a whole picture")
}

#[test]
fn render_writes_what_its_options_say() {
    let dir = tempdir().expect("a folder");
    let at = |name: &str| dir.path().join(name);
    let render = |name: &str, more: &[&str]| {
        run(taki(["render"]).args(TINY).arg("-o").arg(at(name)).args(more)).done();
        verified(&at(name))
    };
    let plain = render("a.exr", &[]);
    let head = plain.head.expect("a head");
    assert_eq!((head.compression, head.gamut, head.rate), (Compression::Zip, Gamut::Rec709, Some([24, 1])));
    assert!(head.camera.is_some() && plain.channels.iter().all(|c| !c.half));
    let small = render("b.exr", &["--half", "--compression=piz", "--set", "image.primaries=acescg"]);
    let head = small.head.expect("a head");
    assert_eq!((head.compression, head.gamut), (Compression::Piz, Gamut::Acescg));
    assert_eq!(small.channels.iter().filter(|c| c.half).count(), 7);
    // It is the same picture, within the digits of a half.
    run(taki(["compare", "--relative=2e-3", "--share=0"]).arg(at("a.exr")).arg(at("b.exr"))).done();
    // Without heeding the primaries it would not be.
    let (_, _, stored) = taki::output::frame::read_exr(&at("b.exr"), 1 << 24).expect("an EXR");
    let (_, _, own) = taki::output::frame::read_exr(&at("a.exr"), 1 << 24).expect("an EXR");
    let green = |c: &[(String, Vec<f32>)]| c.iter().find(|(n, _)| n == "R").expect("R").1.iter().sum::<f32>();
    assert!((green(&stored) / green(&own) - 1.0).abs() > 0.01, "{} {}", green(&stored), green(&own));
}

#[test]
fn alpha_is_kept_in_halves_and_in_other_primaries() {
    let dir = tempdir().expect("a folder");
    let at = |name: &str| dir.path().join(name);
    let render = |name: &str, more: &[&str]| {
        let all = ["--alpha", "--layers=rgb"];
        run(taki(["render"]).args(TINY).arg("-o").arg(at(name)).args(all).args(more)).done();
        verified(&at(name))
    };
    render("a.exr", &[]);
    let other = render("b.exr", &["--half", "--set", "image.primaries=rec2020"]);
    assert_eq!(taki::output::frame::listed(&other.channels), "A (half), B (half), G (half), R (half)");
    // Alpha is compared over black and over white.
    run(taki(["compare", "--relative=2e-3", "--share=0"]).arg(at("a.exr")).arg(at("b.exr"))).done();
    // A tolerance of a twentieth of a half's step tells the two apart.
    run(taki(["compare", "--relative=2e-5", "--absolute=0", "--share=0"]).arg(at("a.exr")).arg(at("b.exr")))
        .refused(1, &["outside the tolerance"]);
}

#[test]
fn a_layer_of_its_own_is_that_of_the_whole_file() {
    let dir = tempdir().expect("a folder");
    let at = |name: &str| dir.path().join(name);
    let command =
        |name: &str, more: &[&str]| run(taki(["render"]).args(TINY).arg("-o").arg(at(name)).args(more));
    command("whole.exr", &[]).done();
    let json = command("fall.exr", &["--split-layers", "--json"]);
    let json: serde_json::Value = serde_json::from_str(json.done()).expect("JSON");
    assert_eq!(json["outputs"].as_array().expect("a list").len(), 7);
    assert!(!at("fall.exr").exists());
    let channels = |name: &str| taki::output::frame::read_exr(&at(name), 1 << 24).expect("an EXR").2;
    let mut all = Vec::new();
    for layer in Layer::ALL {
        let own = channels(&format!("fall.{}.exr", layer.name()));
        assert_eq!(own.len(), layer.channels().len(), "{}", layer.name());
        all.extend(own);
    }
    all.sort_by(|a, b| a.0.cmp(&b.0));
    assert!(all == channels("whole.exr"));
}

#[test]
fn a_batch_of_split_layers_is_continued_and_makes_movie_and_manifest() {
    let dir = tempdir().expect("a folder");
    let batch = |more: &[&str]| {
        let mut command = taki(["batch"]);
        command.args(TINY).current_dir(dir.path());
        run(command.args(["--frames=0-1", "--split-layers", "--half", "--layers=rgb,depth"]).args(more))
    };
    let exr = ["-o", "f.####.exr", "-o", "f.gif", "--manifest", "m.csv", "--fps", "24000/1001"];
    let summary = batch(&[&exr[..], &["--json"]].concat());
    let summary: serde_json::Value = serde_json::from_str(summary.done()).expect("JSON");
    assert_eq!(summary["rendered"], 2);
    assert_eq!(
        names(dir.path()),
        ["f.depth.0000.exr", "f.depth.0001.exr", "f.gif", "f.rgb.0000.exr", "f.rgb.0001.exr", "m.csv"]
    );
    let table = fs::read_to_string(dir.path().join("m.csv")).expect("a table");
    assert!(table.starts_with("number,frame,exr.rgb,exr.depth,mean_r"), "{table}");
    let rate = verified(&dir.path().join("f.depth.0001.exr")).head.expect("a head").rate;
    assert_eq!(rate, Some([24000, 1001]));
    // Nothing is left to do, and one missing file of a picture is made again.
    let again = batch(&[&exr[..], &["--json"]].concat());
    assert!(again.done().contains("\"kept\":2"), "{}", again.stdout());
    fs::remove_file(dir.path().join("f.depth.0001.exr")).expect("removed");
    assert!(batch(&[&exr[..], &["--json"]].concat()).done().contains("\"rendered\":1"));
    // Other numbers, another compression and another rate are another picture.
    let other = |more: &[&str], words: &[&str]| batch(more).refused(73, words);
    other(&["-o", "f.####.exr", "--compression=rle", "--fps=24000/1001"], &["compression is zip"]);
    other(&["-o", "f.####.exr", "--fps=25"], &["24000/1001 frames per second"]);
    let mut float = taki(["batch"]);
    float.args(TINY).current_dir(dir.path()).args(["--frames=0-1", "--split-layers", "--layers=rgb,depth"]);
    run(float.args(["-o", "f.####.exr", "--fps=24000/1001"])).refused(73, &["channels B (half)"]);
}

#[test]
fn a_movie_of_exr_files_does_not_depend_on_their_primaries() {
    let dir = tempdir().expect("a folder");
    let batch = |name: &str, primaries: &str| {
        let mut command = taki(["batch"]);
        command.args(TINY).current_dir(dir.path()).args(["--frames=0-1", "--set", primaries]);
        run(command.args(["-o", &format!("{name}.####.exr"), "-o", &format!("{name}.apng")])).done();
        image::open(dir.path().join(format!("{name}.apng"))).expect("a picture").into_rgb8()
    };
    let own = batch("own", "image.primaries=rec709");
    for gamut in [Gamut::Acescg, Gamut::Rec2020] {
        let other = batch(gamut.word(), &format!("image.primaries={}", gamut.word()));
        let differ = own.iter().zip(other.iter()).filter(|(a, b)| a.abs_diff(**b) > 1).count();
        assert_eq!(differ, 0, "{gamut:?}");
    }
}

#[test]
fn a_movie_of_crops_shows_the_crop() {
    let dir = tempdir().expect("a folder");
    let mut command = taki(["batch"]);
    command.args(TINY).current_dir(dir.path()).args(["--frames=0-1", "--crop=4,6,12,8"]);
    run(command.args(["-o", "f.####.exr", "-o", "p.####.png", "-o", "p.apng"])).done();
    fs::remove_file(dir.path().join("p.apng")).expect("removed");
    let mut command = taki(["batch"]);
    command.args(TINY).current_dir(dir.path()).args(["--frames=0-1", "--crop=4,6,12,8"]);
    run(command.args(["-o", "f.####.exr", "-o", "p.apng"])).done();
    let picture = |name: &str| image::open(dir.path().join(name)).expect("a picture").into_rgb8();
    assert_eq!(picture("p.apng").dimensions(), (12, 8));
    assert!(picture("p.apng") == picture("p.0000.png"));
}

#[test]
fn options_of_exr_files_are_refused_where_none_is_written() {
    let dir = tempdir().expect("a folder");
    for option in ["--half", "--compression=piz", "--split-layers", "--layers=rgb"] {
        let name = option.split('=').next().expect("a name");
        for command in ["render", "batch"] {
            let mut command = taki([command]);
            command.args(TINY).current_dir(dir.path()).args(["-o", "x.png", option]);
            run(&mut command).refused(2, &[name, ".exr"]);
        }
    }
    let png = dir.path().join("x.png");
    run(taki(["render"]).args(TINY).arg("-o").arg(&png)).done();
    run(taki(["stitch", "--half"]).arg(&png).arg("-o").arg(dir.path().join("y.png"))).refused(2, &["--half"]);
    let wide = ["front", "--engine=cpu", "--size=100000x1", "--samples=1", "--compression=piz"];
    run(taki(["render"]).args(wide).arg("-o").arg(dir.path().join("x.exr"))).refused(2, &["use zips"]);
    assert_eq!(names(dir.path()), ["x.png"]);
}
