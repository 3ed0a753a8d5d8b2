//! EXR pictures of other programs, as `taki compare` reads them: windows, names, colour spaces, memory.

use std::path::Path;

use exr::prelude::*;
use taki::output::frame::{ExrColours, ExrPicture, read_exr, read_exr_picture};
use taki::util::error::Error;
use taki::util::window::Window;
use tempfile::tempdir;

const BUDGET: u64 = 64 << 20;

/// Writes a part of 6×3 pixels with the channels R, G, B behind a prefix. R counts the pixels.
fn write(path: &Path, prefix: &str, position: [i32; 2], display: IntegerBounds, encoding: Encoding) {
    let ramp = (0..18).map(|i| f16::from_f32(i as f32)).collect();
    let one = |value: f32| FlatSamples::F32(vec![value; 18]);
    let channels = AnyChannels::sort(
        [("R", FlatSamples::F16(ramp)), ("G", one(0.5)), ("B", one(0.25))]
            .map(|(name, values)| AnyChannel::new(format!("{prefix}{name}").as_str(), values))
            .into_iter()
            .collect(),
    );
    let mut attributes = LayerAttributes::named("a part");
    attributes.layer_position = Vec2(position[0], position[1]);
    let layer = Layer::new((6, 3), attributes, encoding, channels);
    let mut image = Image::from_layer(layer);
    image.attributes.display_window = display;
    image.write().to_file(path).expect("written");
}

fn bounds(position: [i32; 2], size: [usize; 2]) -> IntegerBounds {
    IntegerBounds { position: Vec2(position[0], position[1]), size: Vec2(size[0], size[1]) }
}

fn encoding(compression: Compression, blocks: Blocks) -> Encoding {
    Encoding { compression, blocks, line_order: LineOrder::Increasing }
}

fn red(picture: &ExrPicture) -> Vec<f32> {
    picture.pixels.iter().map(|p| p[0]).collect()
}

#[test]
fn the_display_window_is_the_picture() {
    let dir = tempdir().expect("a folder");
    let path = dir.path().join("x.exr");
    let zip = encoding(Compression::ZIP16, Blocks::ScanLines);
    // Data inside a larger display window.
    write(&path, "", [3, 5], bounds([1, 4], [12, 6]), zip);
    let read = read_exr_picture(&path, BUDGET).expect("a picture");
    assert_eq!((read.width, read.height), (12, 6));
    for (i, pixel) in read.pixels.iter().enumerate() {
        let (x, y) = (i % 12, i / 12);
        let inside = (2..8).contains(&x) && (1..4).contains(&y);
        let want = if inside { [((y - 1) * 6 + x - 2) as f32, 0.5, 0.25] } else { [0.0; 3] };
        assert_eq!(*pixel, want, "{i}");
    }
    assert!(read.notes.iter().any(|n| n.contains("6×3") && n.contains("12×6")), "{:?}", read.notes);
    let (width, height, channels) = read_exr(&path, BUDGET).expect("channels");
    assert_eq!((width, height, channels[2].1[12 + 2], channels[2].1[0]), (12, 6, 0.0, 0.0));
    assert_eq!(channels[2].1[2 * 12 + 3], 7.0);
    // Data that leads out of the display window.
    for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(4, 2))] {
        write(&path, "", [-1, -1], bounds([0, 0], [4, 2]), encoding(Compression::PIZ, blocks));
        let read = read_exr_picture(&path, BUDGET).expect("a picture");
        assert_eq!(red(&read), [7.0, 8.0, 9.0, 10.0, 13.0, 14.0, 15.0, 16.0], "{blocks:?}");
        assert_eq!(read.notes, [""; 0]);
    }
}

#[test]
fn every_lossless_compression_and_a_pass_of_another_program_are_read() {
    let dir = tempdir().expect("a folder");
    let path = dir.path().join("x.exr");
    for compression in
        [Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::ZIP16, Compression::PIZ]
    {
        write(
            &path,
            "ViewLayer.Combined.",
            [0, 0],
            bounds([0, 0], [6, 3]),
            encoding(compression, Blocks::ScanLines),
        );
        let read = read_exr_picture(&path, BUDGET).expect("a picture");
        assert_eq!(red(&read), (0..18).map(|i| i as f32).collect::<Vec<_>>(), "{compression:?}");
    }
}

#[test]
fn a_picture_beyond_the_memory_is_refused_before_it_is_read() {
    let dir = tempdir().expect("a folder");
    let path = dir.path().join("x.exr");
    let zip = encoding(Compression::ZIP16, Blocks::ScanLines);
    write(&path, "", [0, 0], bounds([0, 0], [30_000, 30_000]), zip);
    for refused in [read_exr_picture(&path, BUDGET).map(drop), read_exr(&path, BUDGET).map(drop)] {
        let Err(Error::Memory { what, .. }) = refused else { panic!("{refused:?}") };
        assert!(what.contains("30000×30000"), "{what}");
    }
    // A file that is not there, and one that is no EXR.
    assert!(matches!(read_exr_picture(&dir.path().join("absent.exr"), BUDGET), Err(Error::Io { .. })));
    std::fs::write(&path, b"\x89PNG").expect("written");
    assert!(matches!(read_exr_picture(&path, BUDGET), Err(Error::Input { .. })));
}

#[test]
fn any_part_of_a_picture_is_read() {
    let dir = tempdir().expect("a folder");
    let path = dir.path().join("x.exr");
    write(&path, "", [3, 5], bounds([1, 4], [12, 6]), encoding(Compression::ZIP16, Blocks::ScanLines));
    let file = ExrColours::open(&path).expect("an EXR");
    assert_eq!((file.size, file.data), ([12, 6], Window { x: 2, y: 1, width: 6, height: 3 }));
    let read = file.read(Window { x: 6, y: 2, width: 3, height: 1 }, BUDGET).expect("a part");
    assert_eq!((read.width, read.height, red(&read)), (3, 1, vec![10.0, 11.0, 0.0]));
    let file = ExrColours::open(&path).expect("an EXR");
    let data = file.data;
    let read = file.read(data, BUDGET).expect("a part");
    assert_eq!((red(&read).len(), read.notes), (18, vec![]));
    // A part takes the memory of a part.
    write(
        &path,
        "",
        [0, 0],
        bounds([0, 0], [30_000, 30_000]),
        encoding(Compression::ZIP16, Blocks::ScanLines),
    );
    ExrColours::open(&path).expect("an EXR").read(data, BUDGET).expect("a part");
}

#[test]
fn compare_reads_where_there_is_data_warns_of_black_and_heeds_the_memory() {
    use crate::cli::faults::{run, taki};
    let dir = tempdir().expect("a folder");
    let (a, b) = (dir.path().join("a.exr"), dir.path().join("b.exr"));
    let zip = encoding(Compression::ZIP16, Blocks::ScanLines);
    write(&a, "", [0, 0], bounds([0, 0], [12, 6]), zip);
    let same = run(taki(["compare"]).arg(&a).arg(&a));
    assert!(same.done().contains("0 of 18 pixels"), "{}", same.stdout());
    assert_eq!(same.lines("taki: warning:").len(), 0, "{}", same.stderr());
    write(&b, "", [3, 2], bounds([0, 0], [12, 6]), zip);
    let moved = run(taki(["compare"]).arg(&a).arg(&b));
    assert!(moved.stdout().contains("of 45 pixels"), "{}", moved.stdout());
    assert_eq!(moved.lines("taki: warning:").len(), 2, "{}", moved.stderr());
    moved.refused(1, &["lie outside the tolerance"]);
    // The same pixels about another origin are the same picture.
    write(&b, "", [7, 8], bounds([7, 8], [12, 6]), zip);
    run(taki(["compare", "--share=0"]).arg(&a).arg(&b)).done();
    write(&b, "", [0, 0], bounds([0, 0], [6, 3]), zip);
    run(taki(["compare"]).arg(&a).arg(&b)).refused(1, &["12×6", "6×3"]);
    write(&a, "", [0, 0], bounds([0, 0], [9000, 9000]), zip);
    write(&b, "", [8990, 8990], bounds([0, 0], [9000, 9000]), zip);
    run(taki(["compare", "--memory=64MiB"]).arg(&a).arg(&b)).refused(33, &["8996×8993", "--memory"]);
}
