//! Batches in every format: they keep what is whole, make what is not, and refuse what is other.

use std::fs;

use taki::output::frame::{Format, read_picture};

use super::{EVENTS, batch, counts, files, folder};
use crate::cli::faults::{run, taki};

const KINDS: [&str; 5] = ["png", "jpg", "tif", "webp", "exr"];

#[test]
fn a_second_run_keeps_whole_pictures_of_every_format_and_mends_damaged_ones() {
    for kind in KINDS {
        let dir = folder();
        let pattern = format!("f.####.{kind}");
        let arguments = [&["--frames", "0-3", "-o", &pattern][..], &EVENTS].concat();
        assert_eq!(counts(&run(&mut batch(dir.path(), &arguments))), [4, 0, 4, 0, 0], "{kind}");
        let expected = files(dir.path());
        assert_eq!(counts(&run(&mut batch(dir.path(), &arguments))), [4, 4, 0, 0, 0], "{kind}");
        let name = |frame: u32| format!("f.{frame:04}.{kind}");
        // A byte among the pixels, one that is missing, and a file that holds nothing.
        let mut wrong = expected[&name(1)].clone();
        let middle = match kind {
            // The texts of a JPEG come first, and those of the others are shorter than the rest.
            "jpg" => wrong.len() - 200,
            "exr" => wrong.len() - 5,
            "tif" => wrong.windows(2).position(|w| w == [0x78, 0x9c]).expect("deflate") + 20,
            "webp" => wrong.windows(4).position(|w| w == b"VP8L").expect("pixels") + 60,
            _ => wrong.len() / 2,
        };
        wrong[middle] ^= 255;
        if kind == "exr" {
            wrong.truncate(middle);
        }
        fs::write(dir.path().join(name(1)), wrong).unwrap();
        fs::remove_file(dir.path().join(name(2))).unwrap();
        fs::write(dir.path().join(name(3)), "").unwrap();
        let mended = run(&mut batch(dir.path(), &arguments));
        assert_eq!(counts(&mended), [4, 1, 3, 0, 0], "{kind}: {mended:?}");
        assert!(files(dir.path()) == expected, "{kind}");
        // Another scene, and pictures of another program.
        let other = [&arguments[..], &["--set", "trace.sigma=3"]].concat();
        assert!(run(&mut batch(dir.path(), &other)).stderr().contains("sigma = 3"), "{kind}");
        if kind != "exr" {
            let format = image::ImageFormat::from_extension(kind);
            let picture = image::RgbImage::new(16, 12);
            if kind == "tif" {
                let file = fs::File::create(dir.path().join(name(0))).unwrap();
                let mut encoder = tiff::encoder::TiffEncoder::new(file).unwrap();
                encoder.write_image::<tiff::encoder::colortype::RGB8>(16, 12, picture.as_raw()).unwrap();
            } else {
                picture.save_with_format(dir.path().join(name(0)), format.expect("a format")).unwrap();
            }
            let foreign = run(&mut batch(dir.path(), &arguments));
            let words = ["not a picture that taki wrote", "it does not name its scene"];
            assert!(words.iter().any(|w| foreign.stderr().contains(w)), "{kind}: {foreign:?}");
        }
    }
}

#[test]
fn depth_and_format_are_part_of_a_picture() {
    let dir = folder();
    let frames = ["--frames", "0-1", "-o", "f.####.png"];
    run(&mut batch(dir.path(), frames)).done();
    let deep = [&frames[..], &["--bits", "16"]].concat();
    run(&mut batch(dir.path(), &deep))
        .refused(73, &["f.0000.png", "it has 8 bits, but this picture has 16 bits"]);
    run(batch(dir.path(), &deep).arg("--overwrite")).done();
    assert_eq!(read_picture(&dir.path().join("f.0001.png")).unwrap().encoding.bits, 16);
    let linear = [&frames[..], &["--linear", "--set", "image.tone=none"]].concat();
    run(batch(dir.path(), &linear).arg("--overwrite")).done();
    let shown = [&frames[..], &["--bits", "16", "--set", "image.tone=none"]].concat();
    run(&mut batch(dir.path(), &shown)).refused(73, &["16 bits, linear"]);
    // A picture of another format under this name.
    let jpegs = ["--frames", "0-1", "-o", "g.####.jpg"];
    run(&mut batch(dir.path(), jpegs)).done();
    fs::rename(dir.path().join("g.0000.jpg"), dir.path().join("g.0000.png")).unwrap();
    run(&mut batch(dir.path(), ["--frames", "0-1", "-o", "g.####.png"])).refused(73, &["it is a JPEG"]);
    for (arguments, words) in [
        (["--bits", "16", "-o", "h.#.jpg"], "--bits 16 is for .png, .tif files"),
        (["--codec", "prores", "-o", "h.mp4"], "--codec prores is for .mov files; add -o FILE.mov"),
        (["--movie-bits", "10", "-o", "h.gif"], "--movie-bits 10 is for videos in h264, h265, prores, vp9"),
        (["--sheet", "h.bmp", "-o", "h.{h}.png"], "use .png, .jpg, .tif or .webp"),
    ] {
        let sweep = if words.contains("tif or") { ["--sweep", "h=1,2"] } else { ["--frames", "0-1"] };
        run(batch(dir.path(), arguments).args(sweep)).refused(2, &[words]);
    }
}

#[test]
fn movies_and_sheets_are_made_of_any_format() {
    let dir = folder();
    let frames = ["--frames", "0-2", "-o"];
    run(&mut batch(dir.path(), [&frames[..], &["a.####.png", "-o", "png.apng"]].concat())).done();
    let all = files(dir.path());
    for (kind, more, exact) in [
        ("webp", &[][..], true),
        ("tif", &[], false),
        ("png", &["--bits", "16"], false),
        ("exr", &[], true),
        ("tif", &["--linear", "--set", "image.tone=none"], false),
        ("jpg", &[], false),
    ] {
        let place = folder();
        let pattern = format!("a.####.{kind}");
        let arguments = [&frames[..], &[&pattern, "-o", "m.apng"], more].concat();
        run(&mut batch(place.path(), &arguments)).done();
        let frame =
            |bytes: &[u8]| image::load_from_memory_with_format(bytes, image::ImageFormat::Png).unwrap();
        let (made, wanted) = (files(place.path())["m.apng"].clone(), all["png.apng"].clone());
        // The same pixels make the same file, but for its mark.
        let (made, wanted) = (frame(&made).into_rgb8(), frame(&wanted).into_rgb8());
        let apart = made.as_raw().iter().zip(wanted.as_raw()).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
        let bound = if exact {
            0
        } else if kind == "jpg" {
            40
        } else {
            1
        };
        // Another tone makes another picture.
        assert!(more.contains(&"--linear") || apart <= bound, "{kind} {more:?}: {apart}");
    }
    let sheets = folder();
    for kind in ["png", "jpg", "tif", "webp"] {
        let (pattern, sheet) = (format!("{kind}.{{h}}.{kind}"), format!("sheet.{kind}"));
        let arguments = ["--sweep", "h=0.5,1", "-o", &pattern, "--sheet", &sheet, "--manifest", "m.csv"];
        run(batch(sheets.path(), arguments).arg("--overwrite")).done();
        let path = sheets.path().join(&sheet);
        assert_eq!(Format::of_file(&path).unwrap(), Format::of(&path).unwrap());
        let drawn = read_picture(&path).expect("a sheet");
        assert!(drawn.encoding.bits == 8 && drawn.width > 32, "{drawn:?}");
        let table = fs::read_to_string(sheets.path().join("m.csv")).unwrap();
        assert!(table.starts_with(&format!("number,frame,curves.h,{kind},")), "{table}");
        assert!(table.lines().nth(1).is_some_and(|row| !row.contains(",,")), "{table}");
        // The same batch replaces its sheet without being asked, and another one does not.
        let more = ["--sweep", "h=0.5,1,1.5", "-o", &pattern, "--sheet", &sheet, "--manifest", "m.csv"];
        run(&mut batch(sheets.path(), more)).done();
        assert!(read_picture(&path).expect("a sheet") != drawn);
        let other = format!("b{pattern}");
        let again = ["--sweep", "h=0.5,1", "-o", &other, "--sheet", &sheet, "--manifest", "m.csv"];
        run(&mut batch(sheets.path(), again)).refused(73, &["a file of another batch has this name"]);
    }
}

#[test]
fn a_video_of_ten_bits_is_made_of_deep_pictures_or_warned_of() {
    let dir = folder();
    let movie = |more: &[&str]| {
        let small = ["batch", "front", "--engine", "cpu", "--size", "16x16", "--samples=1"];
        let mut command = taki(small);
        let made = run(command.args(["--frames", "0-1", "-o", "m.mov"]).args(more).current_dir(dir.path()));
        let warned =
            made.stderr().contains("m.mov is made of pictures with 8 bits per channel; add --bits 16");
        (made.exit_code(), warned)
    };
    assert_eq!(movie(&[]), (Some(0), false), "straight from the renderer");
    let straight = fs::read(dir.path().join("m.mov")).unwrap();
    assert_eq!(movie(&[]), (Some(0), false), "the same movie is kept");
    assert_eq!(movie(&["--codec", "h265"]).0, Some(73), "another codec is another movie");
    assert_eq!(movie(&["--codec", "h265", "--overwrite"]), (Some(0), false));
    assert_eq!(movie(&["-o", "a.####.png", "--overwrite"]), (Some(0), true));
    assert_ne!(fs::read(dir.path().join("m.mov")).unwrap(), straight, "the steps of 8 bits");
    for deep in [&["-o", "b.####.png", "--bits", "16"][..], &["-o", "b.####.tif"], &["-o", "b.####.exr"]] {
        assert_eq!(movie(&[deep, &["--overwrite"]].concat()), (Some(0), false), "{deep:?}");
        assert!(fs::read(dir.path().join("m.mov")).unwrap() == straight, "{deep:?}");
    }
}
