//! EXR files: other programs read every row, and the scene comes back, whatever its length.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::process::Command;

use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{AttributeValue, SampleType, Text, Vec2};
use glam::{DVec3, DVec4};
use taki::output::frame::{
    Compression, Exr, ExrCamera, ExrHead, ExrLines, ExrWriter, SCENE_TEXT, channels_of, half_of, lines_of,
    read_exr, read_exr_picture,
};
use taki::picture::{Frame, Gamut, Layer};
use taki::scene::{Scene, presets};
use taki::util::window::Window;
use tempfile::tempdir;

/// A frame whose values tell their pixel and channel.
fn frame([width, height]: [u32; 2]) -> Frame {
    let mut frame = Frame::new(width, height, false);
    for (i, radiance) in frame.radiance.iter_mut().enumerate() {
        *radiance = [0.25, 0.5, 0.75, 1.0].map(|c| c + i as f32);
    }
    frame
}

/// A head with everything that a picture of a batch has.
fn head(compression: Compression, size: [u32; 2]) -> ExrHead {
    let scene = Scene::preset("fig5").expect("a scene");
    let camera = Some(ExrCamera::new(&scene.camera, size));
    ExrHead { compression, gamut: Gamut::Rec709, rate: Some([24000, 1001]), camera }
}

fn write(path: &Path, frame: &Frame, scene: &str) {
    write_as(path, frame, scene, &[Layer::Rgb], false, Compression::Zip);
}

fn write_as(path: &Path, frame: &Frame, scene: &str, layers: &[Layer], half: bool, compression: Compression) {
    let size = [frame.width, frame.height];
    let texts = [("Software", "taki"), (SCENE_TEXT, scene)].map(|(k, t)| (k.to_owned(), t.to_owned()));
    let out = BufWriter::new(File::create(path).expect("a file"));
    let channels = channels_of(layers, half);
    let head = head(compression, size);
    let mut writer =
        ExrWriter::new(out, size, Window::whole(size), &channels, &head, &texts).expect("a valid header");
    for line in lines_of(frame, layers, half, Gamut::Rec709, 0..frame.height) {
        writer.push(line).expect("a line");
    }
    writer.finish().expect("all lines");
}

/// The green, blue and red planes that FFmpeg reads.
fn planes_by_ffmpeg(path: &Path) -> Vec<f32> {
    let out = Command::new("ffmpeg")
        .args(["-v", "error", "-i"])
        .arg(path)
        .args(["-f", "rawvideo", "-pix_fmt", "gbrpf32le", "-"])
        .output()
        .expect("ffmpeg, which tests/run installs");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    out.stdout.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

#[test]
fn ffmpeg_reads_every_row_of_every_preset_at_three_sizes() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("p.exr");
    let methods = Compression::ALL.into_iter().cycle();
    for ((name, _), compression) in presets().zip(methods) {
        let scene = Scene::preset(name).expect("a scene");
        let text = scene.values().expect("as written").to_toml();
        for size in [[96, 54], [33, 65], [320, 180]] {
            let frame = frame(size);
            for layers in [&[Layer::Rgb][..], &Layer::ALL] {
                write_as(&path, &frame, &text, layers, false, compression);
                let plane = |channel: usize| frame.radiance.iter().map(move |c| c[channel]);
                let want: Vec<f32> = [1, 2, 0].into_iter().flat_map(plane).collect();
                assert!(planes_by_ffmpeg(&path) == want, "{name} at {size:?}, {compression:?}");
            }
        }
    }
}

#[test]
fn ffmpeg_reads_half_floats_in_every_compression() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("p.exr");
    let frame = frame([33, 65]);
    let plane = |channel: usize| frame.radiance.iter().map(move |c| half_of(c[channel]).to_f32());
    let want: Vec<f32> = [1, 2, 0].into_iter().flat_map(plane).collect();
    for compression in Compression::ALL {
        write_as(&path, &frame, "a = 1", &[Layer::Rgb], true, compression);
        assert!(planes_by_ffmpeg(&path) == want, "{compression:?}");
    }
}

#[test]
fn a_scene_of_any_length_is_kept_in_attributes_of_at_most_255_bytes() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("p.exr");
    let lines = |n: usize| (0..n).map(|i| format!("key_{i} = {i}\n")).collect::<String>();
    for text in [
        "a = 1".to_owned(),
        "x".repeat(255),
        "x".repeat(256),
        // The cut falls inside a character.
        format!("{}{}", "x".repeat(254), "滝".repeat(300)),
        lines(2000),
        format!("{}{}\n{}", lines(3), "long ".repeat(200), lines(40)),
    ] {
        write(&path, &frame([3, 2]), &text);
        assert_eq!(ExrLines::open(&path).expect("a picture").scene().as_deref(), Some(text.as_str()));
        let meta = MetaData::read_from_file(&path, true).expect("a header");
        let attributes = &meta.headers[0].own_attributes;
        assert_eq!(attributes.software_name.as_ref().map(ToString::to_string).as_deref(), Some("taki"));
        let pieces = attributes.other.keys().filter(|name| name.to_string().starts_with(SCENE_TEXT)).count();
        assert_eq!(pieces == 1, text.len() <= 255, "{pieces}");
        for (name, value) in attributes.other.iter().chain(&meta.headers[0].shared_attributes.other) {
            assert!(value.byte_size() <= 255, "{name:?}: {} bytes", value.byte_size());
        }
        let bytes = std::fs::read(&path).expect("a file");
        write(&path, &frame([3, 2]), &text);
        assert!(bytes == std::fs::read(&path).expect("a file"), "the order of the pieces changes");
    }
}

fn header_of(path: &Path) -> Header {
    MetaData::read_from_file(path, true).expect("a header").headers[0].clone()
}

#[test]
fn every_file_names_its_colour_space_rate_and_camera() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("p.exr");
    let size = [96, 54];
    write(&path, &frame(size), "a = 1");
    let header = header_of(&path);
    let own = &header.own_attributes;
    let text = |name: &str| match own.other.get(&Text::from(name)) {
        Some(AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(text("colorInteropID"), "lin_rec709_scene");
    let colours = header.shared_attributes.chromaticities.expect("chromaticities");
    assert_eq!((colours.red, colours.white), (Vec2(0.64, 0.33), Vec2(0.3127, 0.329)));
    assert_eq!(own.frames_per_second, Some((24000, 1001)));
    // A vector is a row: it is multiplied from the left.
    let by = |point: DVec3, m: [f32; 16]| {
        let p = point.extend(1.0).to_array();
        let column = |c: usize| (0..4).map(|r| p[r] * f64::from(m[4 * r + c])).sum::<f64>();
        DVec4::new(column(0), column(1), column(2), column(3))
    };
    let camera = Scene::preset("fig5").expect("a scene").camera;
    let (to_camera, to_ndc) =
        (own.world_to_camera.expect("one"), own.world_to_normalized_device.expect("one"));
    let near = |a: DVec3, b: DVec3| (a - b).length() < 1e-5;
    let ahead = camera.eye + 2.0 * camera.forward + 3.0 * camera.right + 4.0 * camera.up;
    assert!(near(by(ahead, to_camera).truncate(), DVec3::new(3.0, 4.0, 2.0)), "{}", by(ahead, to_camera));
    for (pixel, offset) in [([0, 0], [0.0, 0.0]), ([95, 53], [1.0, 1.0]), ([30, 7], [0.25, 0.5])] {
        let ray = camera.view_ray(size[0], size[1], pixel, offset);
        let p = by(camera.eye + 7.0 * ray.as_dvec3(), to_ndc);
        let want = [0, 1].map(|i| (f64::from(pixel[i]) + f64::from(offset[i])) / f64::from(size[i]));
        assert!((p.x / p.w - want[0]).abs() < 1e-5 && (p.y / p.w - want[1]).abs() < 1e-5, "{p} {want:?}");
        let cosine = camera.cosine(size[0], size[1], pixel, offset);
        assert!((cosine - ray.dot(camera.forward.as_vec3())).abs() < 1e-6, "{cosine}");
        assert!((p.w / f64::from(7.0 * cosine) - 1.0).abs() < 1e-5);
    }
    let width = 2.0 * camera.tan_half_fov * 96.0 / 54.0;
    assert!((own.screen_window_width - width).abs() < 1e-6);
    let float = |name: &str| match own.other.get(&Text::from(name)) {
        Some(AttributeValue::F32(x)) => *x,
        other => panic!("{name}: {other:?}"),
    };
    let fov = 2.0 * (width / 2.0).atan().to_degrees();
    assert!((float("cameraFov") - fov).abs() < 1e-4);
    let film = [float("CameraFilmApertureHorizontal"), float("CameraFilmApertureVertical")];
    assert!((film[0] / film[1] - 96.0 / 54.0).abs() < 1e-6);
    assert!((film[0] / float("CameraFocalLength") - width).abs() < 1e-5);
}

#[test]
fn halves_keep_colours_to_three_digits_and_depths_and_numbers_whole() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("p.exr");
    let mut frame = Frame::new(4, 1, true);
    frame.radiance =
        [[1e6, 0.1, 1e-9, 0.3], [f32::INFINITY, -1e6, 65519.0, 1.0], [2049.0; 4], [0.0; 4]].into();
    frame.counts = vec![[1_234_567, 0]; 4];
    let surface = frame.surface.as_mut().expect("layers");
    (surface.depth, surface.z) = (vec![123_456.79; 4], vec![0.1; 4]);
    (surface.quad, surface.uv) = (vec![4097; 4], vec![[0.123_456_7, 0.9]; 4]);
    write_as(&path, &frame, "", &Layer::ALL, true, Compression::Zip);
    let (_, _, channels) = read_exr(&path, 1 << 20).expect("an EXR");
    let value = |name: &str, i: usize| channels.iter().find(|(n, _)| n == name).expect("a channel").1[i];
    // The largest half stands for what is brighter.
    assert_eq!((value("R", 0), value("R", 1), value("G", 1)), (65504.0, f32::INFINITY, -65504.0));
    assert_eq!((value("B", 1), value("R", 2)), (65504.0, 2048.0));
    assert!((value("G", 0) / 0.1 - 1.0).abs() < 0.5 / 1024.0 && value("G", 0) != 0.1);
    assert_eq!((value("distance.D", 0), value("depth.Z", 0)), (123_456.79, 0.1));
    assert_eq!((value("quad.ID", 0), value("cells.N", 0)), (4097.0, 1_234_567.0));
    assert_eq!((value("uv.U", 0), value("uv.V", 0)), (0.123_456_7, 0.9));
    let list = header_of(&path).channels.list;
    for channel in list {
        let name = channel.name.to_string();
        let half = ["R", "G", "B"].contains(&name.as_str()) || name.contains("normal") || name.ends_with('T');
        assert_eq!(channel.sample_type == SampleType::F16, half, "{name}");
    }
}

#[test]
fn what_is_a_number_is_a_layer_of_one_channel() {
    // Programs that put layers together take two channels of one prefix for a vector.
    let names: Vec<String> = channels_of(&Layer::ALL, false).into_iter().map(|c| c.name).collect();
    for (prefix, count) in [
        ("depth", 1),
        ("distance", 1),
        ("quad", 1),
        ("cells", 1),
        ("transmittance", 1),
        ("uv", 2),
        ("normal", 3),
    ] {
        let own = names.iter().filter(|name| name.split('.').next() == Some(prefix)).count();
        assert_eq!(own, count, "{prefix}");
    }
}

#[test]
fn wide_pictures_are_compressed_line_by_line_unless_another_way_fits() {
    let channels = channels_of(&Layer::ALL, false);
    let of = |asked, width| Compression::for_width(asked, &channels, width);
    assert_eq!(of(None, 1280).expect("one"), Compression::Zip);
    assert_eq!(of(None, 1_000_000).expect("one"), Compression::Zips);
    for asked in [Compression::None, Compression::Rle, Compression::Zips] {
        assert_eq!(of(Some(asked), 1_000_000).expect("one"), asked);
    }
    for asked in [Compression::Zip, Compression::Piz] {
        assert_eq!(of(Some(asked), 16_384).expect("one"), asked);
        let refused = of(Some(asked), 1_000_000).expect_err("too much memory").to_string();
        assert!(refused.contains(asked.word()) && refused.contains("use zips"), "{refused}");
    }
}

#[test]
fn colours_in_other_primaries_come_back_as_they_were() {
    let dir = tempdir().unwrap();
    let frame = frame([5, 4]);
    let mut want = Vec::new();
    for gamut in Gamut::ALL {
        let path = dir.path().join(format!("{}.exr", gamut.word()));
        let out = BufWriter::new(File::create(&path).expect("a file"));
        let head = ExrHead { gamut, ..head(Compression::Zip, [5, 4]) };
        let channels = channels_of(&[Layer::Rgb], false);
        let mut writer =
            ExrWriter::new(out, [5, 4], Window::whole([5, 4]), &channels, &head, &[]).expect("a header");
        for line in lines_of(&frame, &[Layer::Rgb], false, gamut, 0..4) {
            writer.push(line).expect("a line");
        }
        writer.finish().expect("all lines");
        let read = read_exr_picture(&path, 1 << 20).expect("a picture");
        assert_eq!(((read.width, read.height), read.notes), ((5, 4), Vec::<String>::new()));
        for (got, right) in read.pixels.iter().zip(&frame.radiance) {
            let near = (0..3).all(|c| (got[c] - right[c]).abs() <= 1e-6 * right[2]);
            assert!(near, "{gamut:?}: {got:?} is not {right:?}");
        }
        let (_, _, stored) = read_exr(&path, 1 << 20).expect("an EXR");
        assert!(!want.contains(&stored), "{gamut:?} stores what another one stores");
        want.push(stored);
        let id = header_of(&path).own_attributes.other[&Text::from("colorInteropID")].clone();
        assert_eq!(id, AttributeValue::Text(Text::from(gamut.interop_id())));
        // The figures of a file are those of the radiance, whatever its primaries.
        let mean = taki::output::frame::figures_of(&path).expect("figures").mean_radiance().expect("colours");
        assert!((mean[1] - 10.0).abs() < 1e-4, "{gamut:?}: {mean:?}");
    }
}

#[test]
fn each_layer_has_a_file_whose_name_tells_it() {
    let split = Exr { split: true, ..Exr::of(&[Layer::Rgb, Layer::Depth]) };
    let names = |path: &str| -> Vec<String> {
        split.files(Path::new(path)).iter().map(|(path, _)| path.display().to_string()).collect()
    };
    assert_eq!(names("out/fall.exr"), ["out/fall.rgb.exr", "out/fall.depth.exr"]);
    assert_eq!(names("fall.0007.exr"), ["fall.rgb.0007.exr", "fall.depth.0007.exr"]);
    assert_eq!(names("fall.####.EXR")[1], "fall.depth.####.EXR");
    assert_eq!(names("fall.%04d.exr")[1], "fall.depth.%04d.exr");
    assert_eq!(names("fall.$F4.exr")[1], "fall.depth.$F4.exr");
    assert_eq!(names("fall.v2.exr")[1], "fall.v2.depth.exr");
    assert_eq!(names("0007.exr")[1], "0007.depth.exr");
    let whole = Exr::of(&Layer::ALL).files(Path::new("a.exr"));
    assert_eq!(whole, [(Path::new("a.exr").to_owned(), Layer::ALL.to_vec())]);
}
