//! Formats of developed pictures: what is in the files, and that other programs read it.

use std::fs;
use std::path::Path;
use std::process::Command;

use taki::output::frame::{Encoding, Format, ReadPicture, read_exr, read_picture, verify};
use taki::picture::Gamut;
use taki::picture::resolve::srgb;
use tempfile::tempdir;

use crate::cli::faults::{Run, run, taki};

/// Renders a small picture in a folder.
fn render(folder: &Path, more: &[&str]) -> Run {
    let small = ["render", "front", "--engine", "cpu", "--size", "40x30", "--samples", "2"];
    run(taki(small).args(more).current_dir(folder))
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).expect(name)
}

/// Samples as numbers of the file's depth.
fn numbers(picture: &ReadPicture) -> Vec<u16> {
    let most = if picture.encoding.bits == 16 { 65_535.0 } else { 255.0 };
    picture.pixels.iter().flatten().map(|x| (x * most).round() as u16).collect()
}

#[test]
fn the_extension_chooses_the_format_in_upper_or_lower_case() {
    let dir = tempdir().unwrap();
    let names = ["a.PNG", "a.Jpg", "a.JPEG", "a.TIFF", "a.tif", "a.WebP", "a.Exr"];
    let arguments: Vec<&str> = names.iter().flat_map(|name| ["-o", name]).collect();
    render(dir.path(), &arguments).done();
    for name in names {
        let path = dir.path().join(name);
        let format = Format::of(&path).expect("a format");
        assert_eq!(Format::of_file(&path).expect("a picture"), format, "{name}");
        let verified = verify(&path).expect("whole");
        assert_eq!((verified.format, verified.size), (format, [40, 30]), "{name}");
        let bits = match format {
            Format::Tiff => Some(16),
            Format::Exr => None,
            _ => Some(8),
        };
        assert_eq!(verified.encoding, bits.map(|bits| Encoding { bits, ..Encoding::DISPLAY }), "{name}");
        assert!(verified.scene.expect("a scene").contains("[camera]"), "{name}");
        // The name of the program is near the start, where other programs show it; in a WebP at the end.
        let start = &bytes(dir.path(), name)[..];
        let start = if format == Format::Webp { start } else { &start[..4096.min(start.len())] };
        assert!(start.windows(5).any(|w| w == b"taki "), "{name}");
    }
    for name in ["a.bmp", "a", "png", "a.png.txt"] {
        render(dir.path(), &["-o", name]).refused(2, &[name, ".png, .jpg, .tif, .webp or .exr"]);
    }
}

#[test]
fn sixteen_bits_are_the_picture_in_finer_steps() {
    let dir = tempdir().unwrap();
    let look = ["--set", "image.dither=none", "--set", "image.bloom=0.2"];
    let files = ["-o", "a.png", "-o", "a.tif", "-o", "a.webp"];
    render(dir.path(), &[&look[..], &files, &["--bits", "16"]].concat()).done();
    render(dir.path(), &[&look[..], &["-o", "b.png", "-o", "b.tif", "--bits", "8"]].concat()).done();
    let read = |name: &str| read_picture(&dir.path().join(name)).expect(name);
    let (deep, flat) = (read("a.png"), read("b.png"));
    assert_eq!([deep.encoding.bits, flat.encoding.bits], [16, 8]);
    assert_eq!(numbers(&read("a.tif")), numbers(&deep));
    assert_eq!(numbers(&read("b.tif")), numbers(&flat));
    assert_eq!(numbers(&read("a.webp")), numbers(&flat));
    for (deep, flat) in deep.pixels.iter().flatten().zip(flat.pixels.iter().flatten()) {
        assert!((deep - flat).abs() <= 0.5001 / 255.0, "{deep} {flat}");
    }
    let steps =
        |picture: &ReadPicture| numbers(picture).into_iter().collect::<std::collections::BTreeSet<_>>();
    assert!(steps(&deep).len() > 4 * steps(&flat).len(), "{} {}", steps(&deep).len(), steps(&flat).len());
}

#[test]
fn linear_samples_are_the_radiance() {
    let dir = tempdir().unwrap();
    let sets = ["--set", "image.tone=none", "--set", "image.exposure=1", "--linear"];
    let files = ["-o", "a.png", "-o", "a.tif", "-o", "a.jpg", "-o", "a.exr", "--layers", "rgb"];
    render(dir.path(), &[&sets[..], &files].concat()).done();
    let (_, _, channels) = read_exr(&dir.path().join("a.exr"), 1 << 30).expect("an EXR");
    let radiance = (0..40 * 30).flat_map(|i| ["R", "G", "B"].map(|c| (c, i)));
    let radiance = radiance.map(|(c, i)| channels.iter().find(|(name, _)| name == c).expect("RGB").1[i]);
    let wanted: Vec<f32> = radiance.map(|x| (2.0 * x).clamp(0.0, 1.0)).collect();
    for name in ["a.png", "a.tif"] {
        let picture = read_picture(&dir.path().join(name)).expect(name);
        assert_eq!(picture.encoding, Encoding { bits: 16, linear: true, ..Encoding::DISPLAY }, "{name}");
        for (got, wanted) in picture.pixels.iter().flatten().zip(&wanted) {
            assert!((got - wanted).abs() <= 0.51 / 65_535.0, "{name}: {got} for {wanted}");
        }
        assert_eq!(verify(&dir.path().join(name)).expect("whole").encoding, Some(picture.encoding));
    }
    // A format of 8 bits shows the picture.
    let jpeg = read_picture(&dir.path().join("a.jpg")).expect("a JPEG");
    let error = jpeg.pixels.iter().flatten().zip(&wanted).map(|(x, l)| (x - srgb(*l)).abs()).sum::<f32>();
    assert!(!jpeg.encoding.linear && error / (wanted.len() as f32) < 0.01, "{error}");
    let refusals: [(&[&str], &[&str]); 5] = [
        (
            &["-o", "a.png", "--linear", "--set", "image.tone=filmic"],
            &["image.tone = \"filmic\"", "--set image.tone=none"],
        ),
        (&["-o", "a.png", "--linear", "--bits", "8"], &["--linear needs 16 bits"]),
        (&["-o", "a.jpg", "--linear"], &["--linear is for .png and .tif"]),
        (&["-o", "a.jpg", "--bits", "16"], &["--bits 16 is for .png, .tif files", "add -o FILE.png"]),
        (&["-o", "a.exr", "--bits", "8"], &["--bits 8 is for .png, .jpg, .tif, .webp files"]),
    ];
    for (arguments, words) in refusals {
        render(dir.path(), arguments).refused(2, words);
    }
}

#[test]
fn linear_samples_are_in_the_primaries_asked_for_and_say_so() {
    let dir = tempdir().unwrap();
    let at = |gamut: Gamut, extension: &str| dir.path().join(format!("{}.{extension}", gamut.word()));
    for gamut in Gamut::ALL {
        let primaries = format!("image.primaries={}", gamut.word());
        let files = ["png", "tif", "exr"].map(|e| at(gamut, e).display().to_string());
        let outputs = files.iter().flat_map(|file| ["-o", file]);
        let sets = ["--set", "image.tone=none", "--set", &primaries, "--linear", "--layers", "rgb"];
        render(dir.path(), &sets.into_iter().chain(outputs).collect::<Vec<_>>()).done();
        let (_, _, channels) = read_exr(&at(gamut, "exr"), 1 << 30).expect("an EXR");
        let light = |c: &str, i: usize| channels.iter().find(|(name, _)| name == c).expect("RGB").1[i];
        for extension in ["png", "tif"] {
            let picture = read_picture(&at(gamut, extension)).expect("a picture");
            assert_eq!(picture.encoding, Encoding { bits: 16, linear: true, alpha: false, gamut });
            let verified = verify(&at(gamut, extension)).expect("whole");
            assert_eq!(verified.encoding, Some(picture.encoding));
            for (i, pixel) in picture.pixels.iter().enumerate() {
                for (got, c) in pixel.iter().zip(["R", "G", "B"]) {
                    let wanted = light(c, i).clamp(0.0, 1.0);
                    assert!((got - wanted).abs() <= 0.51 / 65_535.0, "{gamut:?}: {got} for {wanted}");
                }
            }
            // They show the same picture, except where light is cut off.
            let first = read_picture(&at(Gamut::Rec709, extension)).expect("a picture");
            let (shown, first_shown) = (picture.encoding.shown(), first.encoding.shown());
            for (a, b) in picture.pixels.iter().zip(&first.pixels) {
                if a.iter().chain(b).any(|x| *x > 0.99) {
                    continue;
                }
                let far = shown(*a).iter().zip(first_shown(*b)).any(|(a, b)| (a - b).abs() > 2e-3);
                assert!(!far, "{gamut:?} {extension}: {a:?} {b:?}");
            }
        }
        let png = fs::read(at(gamut, "png")).unwrap();
        let code = chunks(&png).into_iter().find(|(name, _)| name == "cICP").map(|(_, points)| points[0]);
        let known = [(Gamut::Rec709, Some(1)), (Gamut::Acescg, None), (Gamut::Rec2020, Some(9))];
        assert!(known.contains(&(gamut, code)), "{gamut:?}: {code:?}");
        // The profile has the primaries too: its columns add up to its white.
        let profile = profile(&at(gamut, "tif"));
        let sum = profile.red_colorant.x + profile.green_colorant.x + profile.blue_colorant.x;
        assert!((sum - 0.9642).abs() < 2e-3, "{gamut:?}: {sum}");
        let red = [(Gamut::Rec709, 0.436), (Gamut::Acescg, 0.690), (Gamut::Rec2020, 0.673)];
        let (_, red) = red.into_iter().find(|(known, _)| *known == gamut).expect("known");
        assert!((profile.red_colorant.x - red).abs() < 3e-3, "{gamut:?}: {}", profile.red_colorant.x);
    }
}

/// Chunks of a PNG before its pixels, by name.
fn chunks(png: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut rest = &png[8..];
    let mut chunks = Vec::new();
    loop {
        let length = u32::from_be_bytes(rest[..4].try_into().unwrap()) as usize;
        let name = String::from_utf8(rest[4..8].to_vec()).unwrap();
        if name == "IDAT" {
            return chunks;
        }
        chunks.push((name, rest[8..8 + length].to_vec()));
        rest = &rest[12 + length..];
    }
}

/// The profile of a JPEG, TIFF or WebP, of which strict readers such as libpng have nothing to complain.
fn profile(path: &Path) -> moxcms::ColorProfile {
    let icc = match Format::of(path).expect("a format") {
        Format::Tiff => {
            let mut decoder = tiff::decoder::Decoder::new(fs::File::open(path).unwrap()).unwrap();
            decoder.get_tag_u8_vec(tiff::tags::Tag::IccProfile).expect("a profile")
        }
        _ => {
            use image::ImageDecoder;
            let mut decoder = image::ImageReader::open(path).unwrap().into_decoder().unwrap();
            decoder.icc_profile().unwrap().expect("a profile")
        }
    };
    let number = |at: usize| u32::from_be_bytes(icc[at..at + 4].try_into().unwrap());
    assert_eq!(number(0) as usize, icc.len());
    assert_eq!([68, 72, 76].map(number), [0xf6d6, 0x10000, 0xd32d], "D50");
    for tag in 0..number(128) as usize {
        assert_eq!(number(132 + 12 * tag + 4) % 4, 0, "tag {tag} of {} is aligned", path.display());
    }
    moxcms::ColorProfile::new_from_slice(&icc).expect("a profile")
}

#[test]
fn files_say_which_colours_they_hold() {
    let dir = tempdir().unwrap();
    let files = ["-o", "a.png", "-o", "a.tif", "-o", "a.jpg", "-o", "a.webp"];
    render(dir.path(), &files).done();
    let linear = ["--linear", "--set", "image.tone=none", "-o", "b.png", "-o", "b.tif"];
    render(dir.path(), &linear).done();
    let find = |name: &str, chunk: &str| {
        let chunks = chunks(&bytes(dir.path(), name));
        chunks.into_iter().find(|(name, _)| name == chunk).map(|(_, data)| data)
    };
    assert_eq!(find("a.png", "sRGB"), Some(vec![1]));
    assert_eq!(find("a.png", "cICP"), None);
    assert_eq!(find("b.png", "sRGB"), None);
    // Primaries of Rec. 709, linear, RGB, full range.
    assert_eq!(find("b.png", "cICP"), Some(vec![1, 8, 0, 1]));
    assert_eq!(find("b.png", "gAMA"), Some(100_000u32.to_be_bytes().to_vec()));
    let chromaticities = [31270u32, 32900, 64000, 33000, 30000, 60000, 15000, 6000];
    assert_eq!(find("b.png", "cHRM"), Some(chromaticities.iter().flat_map(|n| n.to_be_bytes()).collect()));
    // A profile maps the middle of its curve and keeps the primaries of sRGB.
    let reference = moxcms::ColorProfile::new_srgb();
    for name in ["a.tif", "a.jpg", "a.webp", "b.tif"] {
        let profile = profile(&dir.path().join(name));
        let options = moxcms::TransformOptions::default();
        let transform = profile
            .create_transform_8bit(moxcms::Layout::Rgb, &reference, moxcms::Layout::Rgb, options)
            .expect("a transform");
        let mut out = [0; 6];
        transform.transform(&[128, 128, 128, 200, 50, 100], &mut out).expect("transformed");
        let wanted =
            |x: u8| if name == "b.tif" { (srgb(f32::from(x) / 255.0) * 255.0).round() as u8 } else { x };
        let near = out.iter().zip([128, 128, 128, 200, 50, 100]).all(|(got, x)| got.abs_diff(wanted(x)) <= 1);
        assert!(near, "{name}: {out:?}");
    }
    // No file holds a time.
    let again = tempdir().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(1100));
    render(again.path(), &files).done();
    for name in ["a.png", "a.tif", "a.jpg", "a.webp"] {
        assert!(bytes(dir.path(), name) == bytes(again.path(), name), "{name}");
    }
}

/// Decodes a picture with ffmpeg.
fn by_ffmpeg(path: &Path, format: &str) -> Vec<u8> {
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-loglevel", "error", "-nostdin", "-i"]).arg(path);
    ffmpeg.args(["-f", "rawvideo", "-pix_fmt", format, "pipe:1"]);
    let out = ffmpeg.output().expect("tests/run installs ffmpeg");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    out.stdout
}

#[test]
fn another_program_reads_the_same_samples() {
    let dir = tempdir().unwrap();
    render(dir.path(), &["-o", "a.png", "-o", "a.webp", "-o", "a.jpg", "-o", "b.tif"]).done();
    render(dir.path(), &["-o", "a.tif", "--bits", "8"]).done();
    render(dir.path(), &["-o", "b.png", "--bits", "16"]).done();
    for name in ["a.png", "a.tif", "a.webp"] {
        let own: Vec<u8> =
            numbers(&read_picture(&dir.path().join(name)).unwrap()).iter().map(|x| *x as u8).collect();
        let theirs = by_ffmpeg(&dir.path().join(name), if name == "a.webp" { "bgra" } else { "rgb24" });
        let theirs: Vec<u8> = match name {
            "a.webp" => theirs.as_chunks::<4>().0.iter().flat_map(|[b, g, r, _]| [*r, *g, *b]).collect(),
            _ => theirs,
        };
        assert!(own == theirs, "{name}");
    }
    for name in ["b.png", "b.tif"] {
        let own: Vec<u8> = numbers(&read_picture(&dir.path().join(name)).unwrap())
            .iter()
            .flat_map(|x| x.to_be_bytes())
            .collect();
        assert!(own == by_ffmpeg(&dir.path().join(name), "rgb48be"), "{name}");
    }
    let (own, theirs) =
        (read_picture(&dir.path().join("a.jpg")).unwrap(), by_ffmpeg(&dir.path().join("a.jpg"), "rgb24"));
    let error = numbers(&own).iter().zip(&theirs).map(|(a, b)| a.abs_diff(u16::from(*b))).max();
    assert!(error <= Some(3), "{error:?}");
    let picture = numbers(&read_picture(&dir.path().join("a.png")).unwrap());
    let lossy = numbers(&own).iter().zip(&picture).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>();
    assert!(lossy / (picture.len() as f64) < 2.0, "{}", lossy / picture.len() as f64);
}

#[test]
fn what_a_format_cannot_hold_is_refused_before_the_work() {
    let dir = tempdir().unwrap();
    let wide = ["render", "front", "--engine", "cpu", "--samples", "1"];
    let wide = |more: &[&str]| run(taki(wide).args(more).current_dir(dir.path()));
    wide(&["--size", "65536x1", "-o", "a.jpg"]).refused(73, &["a.jpg", "65535", "write a .png"]);
    wide(&["--size", "1x16385", "-o", "a.webp"]).refused(73, &["a.webp", "16384", "write a .png"]);
    wide(&["--size", "16384x16384", "-o", "a.webp", "--memory", "2GiB"])
        .refused(33, &["encoding a JPEG or WebP", "write a .png"]);
    // A part counts, not the whole.
    wide(&["--size", "65536x2", "--crop", "65530,0,6,2", "-o", "a.jpg"]).done();
    wide(&["--size", "16384x1", "-o", "a.webp"]).done();
    assert_eq!(read_picture(&dir.path().join("a.webp")).unwrap().width, 16_384);
}

#[test]
fn a_scene_of_any_length_fits_and_so_do_its_letters() {
    let dir = tempdir().unwrap();
    let many: String = (0..4000).map(|i| format!("[{i}, 0, 0], ")).collect();
    let scene = format!(
        "version = 1\nbase = \"front\"\n[lights.\"späte Sonne\"]\nkind = \"directional\"\n\
         direction = [0, 1, 0]\nintensity = 1.0\n# {many}\n"
    );
    fs::write(dir.path().join("s.toml"), scene).unwrap();
    let mut lamps = String::from("version = 1\nbase = \"front\"\n");
    (0..900).for_each(|i| {
        lamps +=
            &format!("[rocks.rock{i}]\ncorners = [[9,9,-9],[10,9,-9],[10,10,-9],[9,10,-9]]\nlevels = 1\n");
    });
    fs::write(dir.path().join("m.toml"), lamps).unwrap();
    for (scene, word) in [("s.toml", "späte Sonne"), ("m.toml", "rock899")] {
        let files = ["-o", "a.png", "-o", "a.tif", "-o", "a.jpg", "-o", "a.webp"];
        let small = ["render", scene, "--engine", "cpu", "--size", "8x8", "--samples", "1"];
        run(taki(small).args(files).current_dir(dir.path())).done();
        let texts: Vec<String> = ["a.png", "a.tif", "a.jpg", "a.webp"]
            .map(|name| verify(&dir.path().join(name)).expect(name).scene.expect("a scene"))
            .into();
        assert!(texts.iter().all(|text| *text == texts[0] && text.contains(word)), "{scene}");
        assert!(scene == "s.toml" || texts[0].len() > 100_000, "{}", texts[0].len());
    }
}
