//! Maps from other programs: windows, colour spaces, compressions, channel names, suns and orientations.

use std::io::Cursor;
use std::path::Path;

use exr::prelude::*;
use taki::light::environment::{FileMap, read_map};
use taki::util::error::Error;
use tempfile::tempdir;

const BUDGET: u64 = 64 << 20;
const SIZE: (usize, usize) = (6, 3);
const REC709: [f32; 8] = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];
const AP0: [f32; 8] = [0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767];

fn read(name: &str, bytes: &[u8]) -> taki::Result<FileMap> {
    let folder = tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_map(&path, BUDGET)
}

/// Fault and advice of a refusal.
fn refusal(result: taki::Result<FileMap>) -> (String, String) {
    match result {
        Err(Error::Input { what, fix }) => (what, fix),
        other => panic!("{other:?}"),
    }
}

/// A part of 6×3 texels with one value per channel.
type Part = Layer<AnyChannels<FlatSamples>>;

fn part(name: &str, channels: &[(&str, f32)]) -> Part {
    let channel =
        |&(name, value): &(&str, f32)| AnyChannel::new(name, FlatSamples::F32(vec![value; SIZE.0 * SIZE.1]));
    let channels = AnyChannels::sort(channels.iter().map(channel).collect());
    let encoding = Encoding { compression: Compression::ZIP16, ..Encoding::UNCOMPRESSED };
    Layer::new(SIZE, LayerAttributes::named(name), encoding, channels)
}

fn with_text(mut part: Part, name: &str, value: &str) -> Part {
    part.attributes.other.insert(Text::from(name), AttributeValue::Text(Text::from(value)));
    part
}

fn with_chromaticities(mut attributes: ImageAttributes, c: [f32; 8]) -> ImageAttributes {
    let at = |i| Vec2(c[i], c[i + 1]);
    let chromaticities = attribute::Chromaticities { red: at(0), green: at(2), blue: at(4), white: at(6) };
    attributes.chromaticities = Some(chromaticities);
    attributes
}

fn plain() -> ImageAttributes {
    ImageAttributes::new(IntegerBounds::from_dimensions(SIZE))
}

fn exr(attributes: ImageAttributes, parts: Vec<Part>) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let layers: Layers<_> = parts.into_iter().collect();
    Image::from_layers(attributes, layers).write().to_buffered(&mut out).unwrap();
    out.into_inner()
}

fn first(result: taki::Result<FileMap>) -> [f32; 3] {
    let [r, g, b, _] = result.unwrap().map.texels[0];
    [r, g, b]
}

fn assert_near(got: [f32; 3], right: [f32; 3]) {
    let near = |(a, b): (&f32, &f32)| (a - b).abs() <= 2e-4 * right.iter().fold(1e-3, |m: f32, x| m.max(*x));
    assert!(got.iter().zip(&right).all(near), "{got:?} is not {right:?}");
}

const RGB: [(&str, f32); 3] = [("R", 1.0), ("G", 2.0), ("B", 3.0)];

#[test]
fn the_display_window_is_the_map_and_texels_outside_the_data_are_black() {
    let mut layer = part("rgb", &RGB);
    layer.attributes.layer_position = Vec2(3, 5);
    let display = IntegerBounds { position: Vec2(1, 4), size: Vec2(12, 6) };
    let small = read("a.exr", &exr(ImageAttributes::new(display), vec![layer])).unwrap();
    assert_eq!((small.map.width, small.map.height), (12, 6));
    for (i, texel) in small.map.texels.iter().enumerate() {
        let inside = (2..8).contains(&(i % 12)) && (1..4).contains(&(i / 12));
        assert_eq!(*texel, if inside { [1.0, 2.0, 3.0, 0.0] } else { [0.0; 4] }, "{i}");
    }
    assert!(small.notes.iter().any(|n| n.contains("6×3") && n.contains("12×6")), "{:?}", small.notes);
}

#[test]
fn texels_outside_the_display_window_are_cropped() {
    for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(4, 2))] {
        let mut layer = part("rgb", &RGB);
        layer.encoding.blocks = blocks;
        let ramp = (0..18).map(|i| i as f32).collect();
        layer.channel_data.list[2].sample_data = FlatSamples::F32(ramp);
        layer.attributes.layer_position = Vec2(-1, -1);
        let display = IntegerBounds { position: Vec2(0, 0), size: Vec2(4, 2) };
        let map = read("a.exr", &exr(ImageAttributes::new(display), vec![layer])).unwrap();
        let red: Vec<f32> = map.map.texels.iter().map(|t| t[0]).collect();
        assert_eq!(red, [7.0, 8.0, 9.0, 10.0, 13.0, 14.0, 15.0, 16.0], "{blocks:?}");
        assert_eq!(map.notes, [""; 0]);
    }
    let mut layer = part("rgb", &RGB);
    layer.attributes.layer_position = Vec2(60, 0);
    let (what, _) = refusal(read("a.exr", &exr(plain(), vec![layer])));
    assert!(what.contains("outside its display window"), "{what}");
}

#[test]
fn primaries_of_other_spaces_become_those_of_rec_709() {
    // Rec. 709's red in the primaries of AP0, adapted to its white; grey stays grey.
    let red = [("R", 0.439_633), ("G", 0.089_776_44), ("B", 0.017_541_17)];
    let file = exr(with_chromaticities(plain(), AP0), vec![part("rgb", &red)]);
    assert_near(first(read("a.exr", &file)), [1.0, 0.0, 0.0]);
    let grey = [("R", 2.0), ("G", 2.0), ("B", 2.0)];
    let file = exr(with_chromaticities(plain(), AP0), vec![part("rgb", &grey)]);
    assert_near(first(read("a.exr", &file)), [2.0, 2.0, 2.0]);
    // AP0's green lies outside Rec. 709.
    let green = [("R", 0.0), ("G", 1.0), ("B", 0.0)];
    let file = exr(with_chromaticities(plain(), AP0), vec![part("rgb", &green)]);
    let map = read("a.exr", &file).unwrap();
    assert_eq!(map.map.texels[0][0], 0.0);
    assert!(map.notes.iter().any(|n| n.contains("18 texels") && n.contains("Rec. 709")), "{:?}", map.notes);
    // Rec. 709 itself changes no bit.
    let file = exr(with_chromaticities(plain(), REC709), vec![part("rgb", &RGB)]);
    assert_eq!(first(read("a.exr", &file)), [1.0, 2.0, 3.0]);
    // CIE XYZ stored as primaries.
    let xyz = [("R", 0.950456), ("G", 1.0), ("B", 1.089058)];
    let axes = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0];
    let file = exr(with_chromaticities(plain(), axes), vec![part("rgb", &xyz)]);
    assert_near(first(read("a.exr", &file)), [1.0, 1.0, 1.0]);
    // No colour space at all.
    let file = exr(with_chromaticities(plain(), [0.0; 8]), vec![part("rgb", &RGB)]);
    assert!(refusal(read("a.exr", &file)).0.contains("chromaticities"));
}

#[test]
fn names_of_colour_spaces_are_heeded() {
    let value = |name: &str, word: &str, value: f32| {
        let grey = [("R", value), ("G", value), ("B", value)];
        read("a.exr", &exr(plain(), vec![with_text(part("rgb", &grey), name, word)])).unwrap()
    };
    // Half of sRGB's range is 0.214.
    for word in ["srgb_rec709_display", "srgb_rec709_scene", "sRGB", "srgb_texture"] {
        for name in ["colorInteropID", "oiio:ColorSpace"] {
            let map = value(name, word, 0.5);
            assert_near([map.map.texels[0][0]; 3], [0.214_041_14; 3]);
            assert!(map.notes.iter().any(|n| n.contains(word) && n.contains("decoded")), "{:?}", map.notes);
        }
    }
    assert_near([value("colorInteropID", "g22_rec709_scene", 0.5).map.texels[0][0]; 3], [0.217_637_64; 3]);
    for word in ["lin_rec709_scene", "lin_srgb", "Linear", "scene_linear"] {
        let map = value("oiio:ColorSpace", word, 0.5);
        assert_eq!((map.map.texels[0][0], map.notes), (0.5, vec![]), "{word}");
    }
    let map = value("oiio:ColorSpace", "Kodak Vision", 0.5);
    assert_eq!(map.map.texels[0][0], 0.5);
    assert!(map.notes.iter().any(|n| n.contains("Kodak Vision") && n.contains("linear")), "{:?}", map.notes);
    // Primaries by name.
    let red = [("R", 0.627_403_9), ("G", 0.069_097_29), ("B", 0.016_391_44)];
    let named = with_text(part("rgb", &red), "colorInteropID", "lin_rec2020_scene");
    assert_near(first(read("a.exr", &exr(plain(), vec![named]))), [1.0, 0.0, 0.0]);
}

#[test]
fn compressions_that_cannot_be_read_are_named_with_the_way_out() {
    for (code, name) in [(10, "HTJ2K"), (11, "HTJ2K"), (12, "LJ2K"), (13, "ZSTD"), (14, "number 14")] {
        for parts in [vec![part("rgb", &RGB)], vec![part("z", &[("Z", 1.0)]), part("rgb", &RGB)]] {
            let mut file = exr(plain(), parts);
            let mark = b"compression\0compression\0\x01\0\0\0";
            let at = file.windows(mark.len()).rposition(|w| w == mark).unwrap() + mark.len();
            file[at] = code;
            let (what, fix) = refusal(read("a.exr", &file));
            assert!(what.contains(name), "{code}: {what}");
            assert!(fix.contains("--compression zip"), "{code}: {fix}");
        }
    }
}

#[test]
fn dwa_is_read() {
    for compression in [Compression::DWAA(None), Compression::DWAB(None)] {
        let mut layer = part("rgb", &RGB);
        layer.encoding.compression = compression;
        let [r, g, b] = first(read("a.exr", &exr(plain(), vec![layer])));
        assert!((r - 1.0).abs() < 0.02 && (g - 2.0).abs() < 0.04 && (b - 3.0).abs() < 0.06, "{r} {g} {b}");
    }
}

#[test]
fn the_combined_pass_is_the_picture() {
    let pass = |name: &str, value: f32| -> Vec<(String, f32)> {
        ["R", "G", "B", "A"].iter().map(|c| (format!("{name}.{c}"), value)).collect()
    };
    let named = |name: &str, channels: &[(String, f32)]| {
        part(name, &channels.iter().map(|(n, v)| (n.as_str(), *v)).collect::<Vec<_>>())
    };
    // Blender: one part per pass.
    let parts = ["ViewLayer.DiffCol", "ViewLayer.Combined", "ViewLayer.Emit"];
    let parts = parts.iter().zip([1.0, 2.0, 3.0]).map(|(name, v)| named(name, &pass(name, v)));
    assert_eq!(first(read("a.exr", &exr(plain(), parts.collect()))), [2.0; 3]);
    // All in one part.
    let both = [pass("ViewLayer.AO", 1.0), pass("ViewLayer.Combined", 4.0)].concat();
    assert_eq!(first(read("a.exr", &exr(plain(), vec![named("", &both)]))), [4.0; 3]);
    // R, G and B alone come before passes with names.
    let both = [pass("ViewLayer.Combined", 4.0), RGB.map(|(n, v)| (n.to_owned(), v)).to_vec()].concat();
    assert_eq!(first(read("a.exr", &exr(plain(), vec![named("", &both)]))), [1.0, 2.0, 3.0]);
    // One pass only; parts with names.
    assert_eq!(first(read("a.exr", &exr(plain(), vec![named("", &pass("Sky", 5.0))]))), [5.0; 3]);
    let rgb = |v| [("R", v), ("G", v), ("B", v)];
    let parts = vec![part("diffuse", &rgb(1.0)), part("beauty", &rgb(7.0))];
    assert_eq!(first(read("a.exr", &exr(plain(), parts))), [7.0; 3]);
    // Two passes of equal rank.
    let both = [pass("Emit", 1.0), pass("Gloss", 2.0)].concat();
    let (what, fix) = refusal(read("a.exr", &exr(plain(), vec![named("", &both)])));
    assert!(what.contains("Emit.R") && what.contains("Gloss.B"), "{what}");
    assert!(fix.contains("R, G, B") && fix.contains("Combined"), "{fix}");
}

#[test]
fn luminance_with_and_without_chroma_is_colour() {
    assert_eq!(first(read("a.exr", &exr(plain(), vec![part("y", &[("Y", 0.25), ("A", 1.0)])]))), [0.25; 3]);
    // Y of (1, 2, 3) by Rec. 709.
    let y = 0.212_639 + 2.0 * 0.715_168_7 + 3.0 * 0.072_192_3;
    let channels = [("Y", y), ("RY", (1.0 - y) / y), ("BY", (3.0 - y) / y)];
    assert_near(first(read("a.exr", &exr(plain(), vec![part("yc", &channels)]))), [1.0, 2.0, 3.0]);
    // Chroma at half the resolution.
    let mut file = exr(plain(), vec![part("yc", &channels)]);
    let mark = b"BY\0\x02\0\0\0";
    let at = file.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len() + 4;
    assert_eq!(file[at], 1);
    file[at] = 2;
    let (what, fix) = refusal(read("a.exr", &file));
    assert!(what.contains("channel BY") && fix.contains("full size"), "{what}: {fix}");
    // X, Y and Z of a normal are no picture.
    let normal = [("Normal.X", 0.0), ("Normal.Y", 1.0), ("Normal.Z", 0.0)];
    let (what, fix) = refusal(read("a.exr", &exr(plain(), vec![part("n", &normal)])));
    assert!(what.contains("Normal.X, Normal.Y, Normal.Z"), "{what}");
    assert!(fix.contains("Y, RY, BY"), "{fix}");
}

#[test]
fn an_infinite_sun_is_clamped_and_what_is_no_number_is_refused() {
    let with = |value: f32| {
        let mut layer = part("rgb", &RGB);
        let mut samples = vec![f16::from_f32(1.0); 18];
        samples[7] = f16::from_f32(value);
        layer.channel_data.list[2].sample_data = FlatSamples::F16(samples);
        read("a.exr", &exr(plain(), vec![layer]))
    };
    let map = with(f32::INFINITY).unwrap();
    assert_eq!(map.map.texels[7], [65504.0, 2.0, 3.0, 0.0]);
    assert!(map.notes.iter().any(|n| n.contains("infinite") && n.contains("65504")), "{:?}", map.notes);
    for value in [f32::NAN, f32::NEG_INFINITY] {
        assert!(refusal(with(value)).0.contains("texel (1, 1) has the radiance"));
    }
}

#[test]
fn every_fault_of_a_map_has_its_own_way_out() {
    let whole = exr(plain(), vec![part("rgb", &RGB)]);
    let odd = |value: f32| exr(plain(), vec![part("rgb", &[("R", 1.0), ("G", 2.0), ("B", value)])]);
    let hdr = |size: &str| [b"#?RADIANCE\n\n".as_slice(), size.as_bytes(), b"\n\x02\x02"].concat();
    for (name, bytes, cure) in [
        ("nan.exr", odd(f32::NAN), "replace what is no number, by 0 for example"),
        ("bright.exr", odd(2e9), "divide the map by a number, and raise environment.intensity"),
        ("short.exr", whole[..whole.len() - 9].to_vec(), "copy or export it again"),
        ("short.hdr", hdr("-Y 4 +X 8"), "copy or export it again"),
        ("map.png", whole.clone(), "save it as .hdr or .exr"),
        ("map.hdr", whole.clone(), "an OpenEXR file: name it .exr"),
        ("map.exr", hdr("-Y 4 +X 8"), "a Radiance file: name it .hdr"),
        ("wide.hdr", hdr("-Y 1 +X 200000"), "scale it down"),
    ] {
        let (what, fix) = refusal(read(name, &bytes));
        assert!(fix.contains(cure), "{name}: {what}: {fix}");
        assert!(!fix.contains("give an equirectangular map"), "{name}: {fix}");
    }
    let (what, fix) = refusal(read_map(Path::new("/nowhere/map.exr"), BUDGET));
    assert!(fix.contains("check the path"), "{what}: {fix}");
    let (what, fix) = refusal(read_map(Path::new("/"), BUDGET));
    assert!(fix.contains("give the path of the map's file"), "{what}: {fix}");
}

#[test]
fn a_cube_is_refused_as_one() {
    let mut layer = part("rgb", &RGB);
    layer.attributes.environment_map = Some(attribute::EnvironmentMap::Cube);
    let (what, fix) = refusal(read("a.exr", &exr(plain(), vec![layer])));
    assert!(what.contains("cube") && fix.contains("-latlong"), "{what}: {fix}");
}

/// Six texels, 3 wide and 2 high, whose red is 1 to 6 in the order of the file.
fn hdr(header: &str, size: &str) -> Vec<u8> {
    let texels = (1..=6u8).flat_map(|i| [i * 32, 64, 128, 128]);
    format!("#?RADIANCE\n{header}\n{size}").into_bytes().into_iter().chain(texels).collect()
}

#[test]
fn a_radiance_picture_is_read_in_its_eight_orientations() {
    let orientations = [
        ("-Y 2 +X 3", [1, 2, 3, 4, 5, 6]),
        ("-Y 2 -X 3", [3, 2, 1, 6, 5, 4]),
        ("+Y 2 +X 3", [4, 5, 6, 1, 2, 3]),
        ("+Y 2 -X 3", [6, 5, 4, 3, 2, 1]),
        ("+X 3 -Y 2", [1, 3, 5, 2, 4, 6]),
        ("-X 3 -Y 2", [5, 3, 1, 6, 4, 2]),
        ("+X 3 +Y 2", [2, 4, 6, 1, 3, 5]),
        ("-X 3 +Y 2", [6, 4, 2, 5, 3, 1]),
    ];
    for (size, right) in orientations {
        let map = read("a.hdr", &hdr("FORMAT=32-bit_rle_rgbe\n", &format!("{size}\n"))).unwrap().map;
        assert_eq!((map.width, map.height), (3, 2), "{size}");
        let red: Vec<u8> = map.texels.iter().map(|t| (t[0] * 8.0) as u8).collect();
        assert_eq!(red, right, "{size}");
    }
    for size in ["-Y 2 +Y 3", "Y 2 X 3", "-Y 2", "-Y 2 +X 3 4", "-Y -2 +X 3"] {
        let (what, _) = refusal(read("a.hdr", &hdr("", &format!("{size}\n"))));
        assert!(what.contains(size), "{what}");
    }
}

#[test]
fn line_ends_of_other_systems_end_a_line() {
    let header = "FORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n";
    let plain = read("a.hdr", &hdr(header, "-Y 2 +X 3\n")).unwrap().map;
    let text = "#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\nEXPOSURE=2\r\n\r\n-Y 2 +X 3\r\n";
    let file: Vec<u8> = text.bytes().chain((1..=6u8).flat_map(|i| [i * 32, 64, 128, 128])).collect();
    assert_eq!(read("a.hdr", &file).unwrap().map.texels, plain.texels);
}

#[test]
fn xyze_and_primaries_become_rec_709() {
    // An equal X, Y and Z is white. Luminance is in cd/m², 179 to a unit of radiance.
    let text = "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 2\n";
    let texels = [179, 179, 179, 136, 100, 50, 20, 136];
    let map = read("a.hdr", &[text.as_bytes(), &texels].concat()).unwrap();
    assert_near([map.map.texels[0][0], map.map.texels[0][1], map.map.texels[0][2]], [1.0; 3]);
    let [r, g, b, _] = map.map.texels[1];
    assert!(r > 1.0 && g < 0.3 && b < 0.2, "{r} {g} {b}");
    // Another white: grey stays grey. Zeros say nothing.
    let with = |line: &str| first(read("a.hdr", &hdr(line, "-Y 2 +X 3\n")));
    let grey = |line: &str| {
        let text = format!("#?RADIANCE\n{line}\n-Y 1 +X 1\n");
        first(read("a.hdr", &[text.as_bytes(), &[128, 128, 128, 129]].concat()))
    };
    assert_near(grey("PRIMARIES=.64 .33 .29 .6 .15 .06 .333333 .333333\n"), [1.0; 3]);
    assert_eq!(with("PRIMARIES=0 0 0 0 0 0 0 0\n"), with(""));
    assert_eq!(with("PRIMARIES= .64 .33 .3 .6 .15 .06 .3127 .329\n"), with(""));
    let wide = with("PRIMARIES=.708 .292 .17 .797 .131 .046 .3127 .329\n");
    assert!(wide[2] > with("")[2], "{wide:?}");
    let (what, _) = refusal(read("a.hdr", &hdr("FORMAT=16-bit_cmyk\n", "-Y 2 +X 3\n")));
    assert!(what.contains("16-bit_cmyk"), "{what}");
}
