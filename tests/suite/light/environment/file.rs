//! Environment maps in files: maps that are written can be read back, and malformed files are refused.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use super::{map, uneven};
use exr::prelude::*;
use glam::{DVec3, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use taki::light::environment::{FileMap, Map, read_map};
use taki::util::error::Error;
use tempfile::{TempDir, tempdir};

const BUDGET: u64 = 64 << 20;

/// A small map with runs of equal pixels and rows without runs, so that both of the format's encodings occur.
fn small() -> Map {
    map(24, 12, |d| if d.y > 0.4 { DVec3::splat(0.5) } else { uneven(d) })
}

fn hdr_bytes(map: &Map) -> Vec<u8> {
    let pixels: Vec<image::Rgb<f32>> = map.texels.iter().map(|&[r, g, b, _]| image::Rgb([r, g, b])).collect();
    let mut out = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut out)
        .encode(&pixels, map.width as usize, map.height as usize)
        .unwrap();
    out
}

fn exr_bytes(map: &Map, compression: Compression, blocks: Blocks) -> Vec<u8> {
    let pixels = |at: Vec2<usize>| {
        let [r, g, b, _] = map.texels[at.1 * map.width as usize + at.0];
        (r, g, b)
    };
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let size = (map.width as usize, map.height as usize);
    let layer = Layer::new(size, LayerAttributes::named("rgb"), encoding, SpecificChannels::rgb(pixels));
    let mut out = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut out).unwrap();
    out.into_inner()
}

fn read_bytes(folder: &TempDir, name: &str, bytes: &[u8]) -> taki::Result<FileMap> {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_map(&path, BUDGET)
}

fn assert_close(got: &Map, right: &Map, relative: f32) {
    assert_eq!((got.width, got.height), (right.width, right.height));
    for (a, b) in got.texels.iter().zip(&right.texels) {
        let (a, b) = (Vec3::from_slice(a), Vec3::from_slice(b));
        assert!((a - b).abs().max_element() <= relative * b.max_element(), "{a} {b}");
    }
}

fn refused(what: &str, result: taki::Result<FileMap>, name: &str) {
    match result {
        Err(Error::Input { what: words, .. }) => assert!(words.contains(name), "{what}: {words}"),
        Err(other) => panic!("{what}: {other}"),
        Ok(_) => panic!("{what} was read"),
    }
}

#[test]
fn a_radiance_picture_is_read_to_the_digits_it_has() {
    let folder = tempdir().unwrap();
    let read = read_bytes(&folder, "small.hdr", &hdr_bytes(&small())).unwrap();
    // The format keeps eight bits of each component, at the largest component's exponent.
    assert_close(&read.map, &small(), 1.0 / 128.0);
    assert_eq!(read.negative, 0);
    // The stored pixels are already multiplied by the file's exposure. The radiance is the value before that.
    let text = "#?RGBE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nEXPOSURE=4\n\n-Y 1 +X 2\n";
    let bytes = [text.as_bytes(), &[128, 64, 0, 129, 255, 255, 255, 136]].concat();
    let read = read_bytes(&folder, "b.HDR", &bytes).unwrap().map;
    assert_eq!(read.texels, [[0.125, 0.0625, 0.0, 0.0], [31.875, 31.875, 31.875, 0.0]]);
}

#[test]
fn an_exr_is_read_in_lines_and_tiles_and_every_lossless_packing() {
    let folder = tempdir().unwrap();
    let tiles = |x, y| Blocks::Tiles(Vec2(x, y));
    let kinds = [
        (Compression::Uncompressed, Blocks::ScanLines),
        (Compression::RLE, Blocks::ScanLines),
        (Compression::ZIP1, tiles(7, 5)),
        (Compression::ZIP16, Blocks::ScanLines),
        (Compression::PIZ, Blocks::ScanLines),
        (Compression::PIZ, tiles(16, 64)),
        (Compression::RLE, tiles(1, 1)),
    ];
    for (compression, blocks) in kinds {
        let read = read_bytes(&folder, "small.exr", &exr_bytes(&small(), compression, blocks)).unwrap();
        assert_close(&read.map, &small(), 0.0);
    }
}

#[test]
fn other_parts_and_channels_of_an_exr_do_not_matter() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("layers.exr");
    let (width, height) = (6usize, 3usize);
    let channel = |name: &str, value: f32| {
        let samples = FlatSamples::F16(vec![f16::from_f32(value); width * height]);
        AnyChannel::new(name, samples)
    };
    let part = |name: &str, channels: Vec<AnyChannel<FlatSamples>>| {
        let channels = AnyChannels::sort(channels.into());
        Layer::new((width, height), LayerAttributes::named(name), Encoding::FAST_LOSSLESS, channels)
    };
    let parts = [
        part("depth", vec![channel("Z", 7.0)]),
        part("light", vec![channel("A", 0.5), channel("B", 3.0), channel("G", 2.0), channel("R", 1.0)]),
    ]
    .into_iter()
    .collect::<Layers<_>>();
    let image =
        Image::from_layers(ImageAttributes::new(IntegerBounds::from_dimensions((width, height))), parts);
    image.write().to_file(&path).unwrap();
    let read = read_map(&path, BUDGET).unwrap().map;
    assert_eq!((read.width, read.height, read.texels[0]), (6, 3, [1.0, 2.0, 3.0, 0.0]));
    // A file without colours is not a map.
    let part = part("depth", vec![channel("Z", 7.0)]);
    Image::from_layer(part).write().to_file(&path).unwrap();
    refused("no colours", read_map(&path, BUDGET), "layers.exr");
}

#[test]
fn a_picture_of_this_program_is_an_environment() {
    let folder = tempdir().unwrap();
    let out = folder.path().join("own.exr");
    let mut command = crate::cli::faults::taki(["render", "front", "--engine=cpu", "--size=16x8", "-o"]);
    crate::cli::faults::run(command.arg(&out)).done();
    let read = read_map(&out, BUDGET).unwrap().map;
    assert_eq!((read.width, read.height), (16, 8));
    assert!(read.texels.iter().any(|t| t[0] > 0.0));
}

#[test]
fn values_below_zero_count_as_zero_and_what_is_no_radiance_refuses_the_file() {
    let folder = tempdir().unwrap();
    let with = |value: f32| {
        let mut map = small();
        map.texels[24 * 3 + 5][1] = value;
        read_bytes(&folder, "odd.exr", &exr_bytes(&map, Compression::ZIP16, Blocks::ScanLines))
    };
    let read = with(-0.25).unwrap();
    assert_eq!((read.negative, read.map.texels[24 * 3 + 5][1]), (1, 0.0));
    assert_eq!(with(1e-40).unwrap().map.texels[24 * 3 + 5][1], 0.0);
    assert_eq!(with(1e9).unwrap().map.texels[24 * 3 + 5][1], 1e9);
    for value in [f32::NAN, f32::NEG_INFINITY, 2e9] {
        refused("no radiance", with(value), "odd.exr: texel (5, 3) has the radiance");
    }
}

#[test]
fn every_part_of_a_file_from_its_start_is_refused() {
    let folder = tempdir().unwrap();
    let tiled = exr_bytes(&small(), Compression::ZIP1, Blocks::Tiles(Vec2(8, 8)));
    let files = [
        ("a.hdr", hdr_bytes(&small())),
        ("b.exr", exr_bytes(&small(), Compression::PIZ, Blocks::ScanLines)),
        ("c.exr", tiled),
    ];
    for (name, bytes) in files {
        assert!(read_bytes(&folder, name, &bytes).is_ok());
        for length in 0..bytes.len() {
            let result = read_bytes(&folder, name, &bytes[..length]);
            refused(&format!("{length} of {} bytes", bytes.len()), result, name);
        }
    }
}

#[test]
fn flipped_bytes_give_another_map_or_a_refusal_and_never_more() {
    let folder = tempdir().unwrap();
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let exr = |compression, blocks| exr_bytes(&small(), compression, blocks);
    let files = [
        ("a.hdr", hdr_bytes(&small())),
        ("b.exr", exr(Compression::PIZ, Blocks::ScanLines)),
        ("c.exr", exr(Compression::ZIP1, Blocks::Tiles(Vec2(8, 8)))),
        ("d.exr", exr(Compression::RLE, Blocks::ScanLines)),
        ("e.exr", exr(Compression::B44, Blocks::ScanLines)),
        ("f.exr", exr(Compression::PXR24, Blocks::ScanLines)),
    ];
    for (name, bytes) in files {
        for _ in 0..1500 {
            let mut bytes = bytes.clone();
            for _ in 0..rng.random_range(1..4) {
                // Half of the changes fall where sizes and counts are stored.
                let end = if rng.random() { bytes.len() } else { bytes.len().min(400) };
                let at = rng.random_range(0..end);
                bytes[at] =
                    if rng.random() { rng.random() } else { bytes[at] ^ (1 << rng.random_range(0..8)) };
            }
            match read_bytes(&folder, name, &bytes) {
                Ok(read) => {
                    let texels = u64::from(read.map.width) * u64::from(read.map.height);
                    assert!(texels * 16 <= BUDGET && texels == read.map.texels.len() as u64);
                    assert!(read.map.texels.iter().flatten().all(|x| (0.0..=1e9).contains(x)));
                }
                Err(Error::Input { what, .. } | Error::Memory { what, .. }) => {
                    assert!(what.contains(name), "{what}");
                }
                Err(other) => panic!("{name}: {other}"),
            }
        }
    }
}

fn hdr_of_size(width: u64, height: u64) -> Vec<u8> {
    format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes()
}

/// Bytes of an EXR file whose windows claim another size.
fn exr_of_size(width: i32, height: i32) -> Vec<u8> {
    let mut bytes = exr_bytes(&small(), Compression::ZIP16, Blocks::ScanLines);
    for name in [b"dataWindow\0box2i\0", b"displayWindow\0box2i\0".as_slice()] {
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
        for (i, value) in [0, 0, width - 1, height - 1].into_iter().enumerate() {
            bytes[at + 4 * i..][..4].copy_from_slice(&value.to_le_bytes());
        }
    }
    bytes
}

#[test]
fn sizes_are_compared_with_the_budget_before_anything_is_allocated() {
    let folder = tempdir().unwrap();
    for size in [(0, 0), (0, 4), (4, 0)] {
        refused("nothing", read_bytes(&folder, "none.hdr", &hdr_of_size(size.0, size.1)), "none.hdr");
    }
    refused("nothing", read_bytes(&folder, "none.exr", &exr_of_size(0, 0)), "none.exr");
    let huge = [
        ("huge.hdr", hdr_of_size(1_000_000, 1_000_000)),
        ("huge.exr", exr_of_size(1_000_000, 1_000_000)),
        ("big.hdr", hdr_of_size(4096, 2048)),
        ("big.exr", exr_of_size(4096, 2048)),
    ];
    for (name, bytes) in huge {
        match read_bytes(&folder, name, &bytes) {
            Err(Error::Memory { what, .. }) => assert!(what.contains(name), "{what}"),
            other => panic!("{name}: {other:?}"),
        }
    }
    // This size exceeds what the decoder can count.
    let endless = read_bytes(&folder, "endless.hdr", &hdr_of_size(4_000_000_000, 4_000_000_000));
    refused("endless", endless, "endless.hdr");
    // The memory suffices for this size, but the file ends too early.
    let path = folder.path().join("big.hdr");
    std::fs::write(&path, hdr_of_size(4096, 2048)).unwrap();
    refused("short", read_map(&path, 1 << 30), "big.hdr");
    refused("wide", read_bytes(&folder, "wide.hdr", &hdr_of_size(200_000, 1)), "wide.hdr");
}

#[test]
fn only_regular_files_with_the_two_names_are_read() {
    let folder = tempdir().unwrap();
    let at = |name: &str| -> PathBuf { folder.path().join(name) };
    std::fs::create_dir(at("folder.hdr")).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(at("fifo.exr")).status().unwrap().success());
    for name in ["folder.hdr", "fifo.exr"] {
        refused(name, read_map(&at(name), BUDGET), "not a regular file");
    }
    refused("missing", read_map(&at("missing.hdr"), BUDGET), "missing.hdr");
    refused("device", read_map(Path::new("/dev/zero"), BUDGET), "not a regular file");
    for name in ["map.png", "map", "map.hdr.gz"] {
        refused(name, read_bytes(&folder, name, &hdr_bytes(&small())), "neither .hdr nor .exr");
    }
    refused("exr", read_bytes(&folder, "a.exr", &hdr_bytes(&small())), "a.exr");
    let exr = exr_bytes(&small(), Compression::ZIP16, Blocks::ScanLines);
    refused("hdr", read_bytes(&folder, "a.hdr", &exr), "does not start with #?RADIANCE");
    let endless = [b"#?RADIANCE\n".as_slice(), &vec![b'a'; 4 << 20]].concat();
    refused("hdr", read_bytes(&folder, "endless.hdr", &endless), "its header has no end");
}
