//! Movies of a batch, made from its picture files or while it renders.

use std::fs;

use image::AnimationDecoder;

use super::{batch, files, folder};
use crate::cli::faults::{Run, run, taki};

fn frames_of_gif(bytes: &[u8]) -> usize {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).expect("a GIF");
    let mut count = 0;
    while decoder.read_next_frame().expect("a frame").is_some() {
        count += 1;
    }
    count
}

/// The frames of an animated PNG as R, G, B, A.
fn frames_of_apng(bytes: &[u8]) -> Vec<image::RgbaImage> {
    let decoder = image::codecs::png::PngDecoder::new(std::io::Cursor::new(bytes)).expect("a PNG");
    let frames = decoder.apng().expect("animated").into_frames();
    frames.map(|frame| frame.expect("a frame").into_buffer()).collect()
}

#[test]
fn a_movie_has_the_frames_in_order_made_from_files_or_at_once() {
    let dir = folder();
    run(&mut batch(dir.path(), ["--loop", "5", "-o", "f.#.png", "-o", "kept.apng", "-o", "kept.gif"])).done();
    run(&mut batch(dir.path(), ["--loop", "5", "-o", "alone.png", "-o", "alone.gif"])).done();
    run(&mut batch(dir.path(), ["--loop", "5", "-o", "l.#.exr", "-o", "linear.apng"])).done();
    let made = files(dir.path());
    assert!(made["kept.apng"] == made["alone.png"] && made["kept.gif"] == made["alone.gif"]);
    assert!(made["linear.apng"] == made["kept.apng"], "the CPU's tone curve, from linear values");
    assert_eq!(frames_of_gif(&made["kept.gif"]), 5);
    let frames = frames_of_apng(&made["kept.apng"]);
    assert_eq!(frames.len(), 5);
    for (i, frame) in frames.iter().enumerate() {
        let still = image::load_from_memory(&made[&format!("f.{i}.png")]).unwrap().to_rgba8();
        assert!(*frame == still, "frame {i}");
    }
}

#[test]
fn a_movie_that_is_there_is_kept_if_it_shows_these_frames_and_never_replaced_unasked() {
    let dir = folder();
    let arguments = ["--loop", "3", "-o", "f.#.png", "-o", "f.gif"];
    run(&mut batch(dir.path(), arguments)).done();
    let made = fs::metadata(dir.path().join("f.gif")).unwrap().modified().unwrap();
    run(&mut batch(dir.path(), arguments)).done();
    assert_eq!(fs::metadata(dir.path().join("f.gif")).unwrap().modified().unwrap(), made, "made again");
    // A missing picture is rendered again. The movie is still right, so it is kept.
    fs::remove_file(dir.path().join("f.1.png")).unwrap();
    run(&mut batch(dir.path(), arguments)).done();
    run(&mut batch(dir.path(), ["--loop", "3", "-o", "f.gif"])).done();
    assert_eq!(fs::metadata(dir.path().join("f.gif")).unwrap().modified().unwrap(), made, "made again");
    let others: [&[&str]; 3] = [
        &["--loop", "3", "--fps", "12"],
        &["--loop", "3", "--frames", "0-1"],
        &["--loop", "3", "--set", "light.p=9"],
    ];
    for other in others {
        run(batch(dir.path(), other).args(["-o", "f.gif"])).refused(73, &["f.gif", "other frames"]);
    }
    fs::write(dir.path().join("g.gif"), "hello").unwrap();
    run(&mut batch(dir.path(), ["--loop", "3", "-o", "g.gif"]))
        .refused(73, &["g.gif", "not a movie that taki wrote"]);
    for kind in ["mp4", "webm", "apng"] {
        let movie = format!("x.{kind}");
        let alone = ["--loop", "3", "-o", &movie];
        run(&mut batch(dir.path(), alone)).done();
        let bytes = fs::read(dir.path().join(&movie)).unwrap();
        run(&mut batch(dir.path(), alone)).done();
        assert!(fs::read(dir.path().join(&movie)).unwrap() == bytes, "{kind}");
        run(batch(dir.path(), alone).args(["--fps", "12"])).refused(73, &[&movie, "other frames"]);
    }
    run(batch(dir.path(), arguments).arg("--overwrite")).done();
    assert!(fs::metadata(dir.path().join("f.gif")).unwrap().modified().unwrap() > made);
    run(batch(dir.path(), arguments).args(["--shard", "0/2"])).refused(2, &["a movie needs all frames"]);
}

#[test]
fn what_a_movie_needs_is_known_before_the_work() {
    let dir = folder();
    let videos = ["--loop", "3", "-o", "f.#.png", "-o", "f.mp4"];
    let missing: Run = run(batch(dir.path(), videos).env("PATH", dir.path()));
    missing.refused(69, &["ffmpeg"]);
    run(&mut batch(dir.path(), ["--loop", "3", "--fps", "60", "-o", "f.gif"])).refused(73, &["f.gif", "50"]);
    assert!(files(dir.path()).is_empty());
}

#[test]
fn a_movie_in_the_place_of_a_picture_is_called_one() {
    let dir = folder();
    run(&mut batch(dir.path(), ["--frames", "0-1", "-o", "w.png"])).done();
    let still = run(&mut batch(dir.path(), ["--frames", "0", "-o", "w.png"]));
    still.refused(73, &["w.png", "it is a movie that taki wrote"]);
    let render = run(taki(["render", "front", "-o", "w.mp4"]).current_dir(&dir));
    render.refused(2, &["-o w.mp4: taki batch makes movies"]);
}
