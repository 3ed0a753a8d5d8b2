//! EXR files: other programs read every row, and the scene comes back, whatever its length.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::process::Command;

use exr::meta::MetaData;
use exr::prelude::AttributeValue;
use taki::output::frame::{ExrLines, ExrWriter, SCENE_TEXT, channel_names, lines_of};
use taki::picture::{Frame, Layer};
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

fn write(path: &Path, frame: &Frame, scene: &str) {
    let layers = [Layer::Rgb];
    let size = [frame.width, frame.height];
    let texts = [("Software", "taki"), (SCENE_TEXT, scene)].map(|(k, t)| (k.to_owned(), t.to_owned()));
    let out = BufWriter::new(File::create(path).expect("a file"));
    let mut writer = ExrWriter::new(out, size, Window::whole(size), &channel_names(&layers), &texts)
        .expect("a valid header");
    for line in lines_of(frame, &layers, 0..frame.height) {
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
    for (name, _) in presets() {
        let scene = Scene::preset(name).expect("a scene");
        let text = scene.values().expect("as written").to_toml();
        for size in [[96, 54], [33, 65], [320, 180]] {
            let frame = frame(size);
            write(&path, &frame, &text);
            let plane = |channel: usize| frame.radiance.iter().map(move |c| c[channel]);
            let want: Vec<f32> = [1, 2, 0].into_iter().flat_map(plane).collect();
            assert!(planes_by_ffmpeg(&path) == want, "{name} at {size:?}");
        }
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
        assert_eq!(attributes.other.len(), if text.len() <= 255 { 1 } else { attributes.other.len().max(2) });
        for (name, value) in &attributes.other {
            let AttributeValue::Text(value) = value else { panic!("{name:?} is no text") };
            assert!(value.as_slice().len() <= 255, "{name:?}: {} bytes", value.as_slice().len());
        }
        let bytes = std::fs::read(&path).expect("a file");
        write(&path, &frame([3, 2]), &text);
        assert!(bytes == std::fs::read(&path).expect("a file"), "the order of the pieces changes");
    }
}
