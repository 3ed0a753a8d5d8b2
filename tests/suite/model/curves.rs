//! Curves of USD that other programs wrote (`tests/data/curves`), what their numbers must become, and that
//! broken files are told.

use std::io::Write;
use std::path::PathBuf;

use glam::{Vec3, Vec4};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use serde_json::Value;
use taki::model::StrandFile;
use taki::{Error, Result};

use super::Folder;

/// Bytes that every file of the tests may take.
const BUDGET: u64 = 1 << 26;

fn sample(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/curves").join(name)
}

fn read(name: &str, time: Option<f64>) -> StrandFile {
    StrandFile::read(&sample(name), time, BUDGET).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Reads text behind the first line of a file.
fn text(folder: &Folder, text: &str) -> Result<StrandFile> {
    folder.write("a.usda", format!("#usda 1.0\n{text}").as_bytes());
    StrandFile::read(&folder.path("a.usda"), None, BUDGET)
}

/// Points of all strands that Pixar's library and numpy computed, with widths.
fn known(key: &str) -> Vec<Vec<Vec4>> {
    let all: Value =
        serde_json::from_slice(&std::fs::read(sample("points.json")).expect("points")).expect("JSON");
    let points = |strand: &Value| -> Vec<Vec4> {
        let row = |row: &Value| -> Vec<f32> {
            row.as_array().expect("a row").iter().map(|x| x.as_f64().expect("a number") as f32).collect()
        };
        strand.as_array().expect("a strand").iter().map(|own| Vec4::from_slice(&row(own))).collect()
    };
    all[key].as_array().expect("strands").iter().map(points).collect()
}

/// Greatest distance of a known point from the straight pieces of its strand, and of its width from theirs.
fn worst(file: &StrandFile, known: &[Vec<Vec4>]) -> [f32; 2] {
    assert_eq!(file.strands.count(), known.len());
    let mut worst = [0.0f32; 2];
    for (number, points) in known.iter().enumerate() {
        let (own, widths) = file.strands.strand(number);
        for point in points {
            let near = own.windows(2).zip(widths.windows(2)).map(|(ends, widths)| {
                let along = ends[1] - ends[0];
                let t = (point.truncate() - ends[0]).dot(along) / along.length_squared().max(1e-12);
                let t = t.clamp(0.0, 1.0);
                let width = widths[0] + (widths[1] - widths[0]) * t;
                [(ends[0] + along * t).distance(point.truncate()), (width - point.w).abs()]
            });
            let [far, width] = near.min_by(|a, b| a[0].total_cmp(&b[0])).expect("a piece");
            worst = [worst[0].max(far), worst[1].max(width)];
        }
    }
    worst
}

#[test]
fn curves_of_every_basis_lie_where_pixars_library_has_them() {
    for (name, key, time) in [
        ("blender.usdc", "blender.usdc 0", None),
        ("blender.usdz", "blender.usdc 0", None),
        ("pixar.usdc", "pixar.usdc 0", None),
        ("pixar.usda", "pixar.usdc 0", Some(-3.0)),
        ("pixar.usdc", "pixar.usdc 8", Some(8.0)),
        ("pixar.usda", "pixar.usdc 8", Some(100.0)),
    ] {
        let file = read(name, time);
        let [low, high] = file.strands.bounds().expect("points");
        // What the straight pieces may deviate, and the digits of the file of points.
        let allowed = (high - low).max_element() / 8192.0 + 3e-6;
        let [far, width] = worst(&file, &known(key));
        assert!(far < allowed, "{name}: {far} of {allowed}");
        assert!(width < 1e-4, "{name}: {width}");
    }
    // At another time the curve that moves lies elsewhere.
    let [far, _] = worst(&read("pixar.usdc", Some(8.0)), &known("pixar.usdc 0"));
    assert!(far > 1.0, "{far}");
}

#[test]
fn a_file_says_its_unit_and_axes_and_what_is_left_out() {
    let blender = read("blender.usdc", None);
    assert_eq!((blender.unit, blender.is_z_up, blender.strands.count()), (Some(1.0), Some(true), 6));
    assert_eq!(blender.notes, Vec::<String>::new());
    let [usda, usdc] = ["pixar.usda", "pixar.usdc"].map(|name| read(name, None));
    assert_eq!((usdc.unit, usdc.is_z_up), (Some(0.01), Some(false)));
    assert_eq!(usda, usdc);
    let notes = usdc.notes.join("\n");
    assert!(notes.contains("2 prims are hidden or guides, the first /guide"), "{notes}");
    assert!(notes.contains("/turned is made of references") && notes.contains("--flatten"), "{notes}");

    let folder = Folder::new(&[]);
    let line = "{ uniform token type = \"linear\" int[] curveVertexCounts = [2] \
                point3f[] points = [(0,0,0), (0,0,1)] float[] widths = [0.5, 0.25] }";
    let bare = text(&folder, &format!("def BasisCurves \"a\" {line}")).expect("curves");
    assert_eq!((bare.unit, bare.is_z_up), (Some(0.01), Some(false)));
    assert!(bare.notes[0].contains("metersPerUnit"), "{:?}", bare.notes);
    assert_eq!(bare.strands.strand(0), (&[Vec3::ZERO, Vec3::Z][..], &[0.5, 0.25][..]));
    // Abstract prims, and what they hold, are no part of the scene.
    let class = format!("class Xform \"c\" {{ def BasisCurves \"a\" {line} }}\ndef BasisCurves \"b\" {line}");
    assert_eq!(text(&folder, &class).expect("curves").strands.count(), 1);
    let placed = format!("def PointInstancer \"p\" {{ def BasisCurves \"a\" {line} }}\n{class}");
    let placed = text(&folder, &placed).expect("curves");
    assert!(placed.strands.count() == 1 && placed.notes.join(" ").contains("/p is a point instancer"));
}

#[test]
fn straight_curves_keep_their_points_and_bends_have_more() {
    let folder = Folder::new(&[]);
    let cubic = |points: &str| {
        let own = format!(
            "(metersPerUnit = 1)\ndef BasisCurves \"a\" {{ uniform token basis = \"catmullRom\" uniform \
             token wrap = \"pinned\" int[] curveVertexCounts = [4] point3f[] points = [{points}] float[] \
             widths = [0.1] (interpolation = \"constant\") }}"
        );
        text(&folder, &own).expect("curves").strands
    };
    assert_eq!(cubic("(0,0,0), (0,0,1), (0,0,2), (0,0,3)").points, [0.0, 1.0, 2.0, 3.0].map(|z| Vec3::Z * z));
    let bent = cubic("(0,0,0), (0,1,0), (1,1,0), (1,0,0)").points;
    // The same number of pieces between all points.
    assert!(bent.len() > 30 && (bent.len() - 1) % 3 == 0, "{}", bent.len());
    // The middle of such a curve rises by an eighth over its points.
    assert!(bent.iter().any(|p| (p.y - 1.125).abs() < 1e-3));
}

#[test]
fn points_behind_the_last_bezier_segment_are_told() {
    let folder = Folder::new(&[]);
    let told = |points: usize, wrap: &str| {
        let list: Vec<String> = (0..points).map(|i| format!("({i},{},0)", i % 3)).collect();
        let text = text(
            &folder,
            &format!(
                "def BasisCurves \"a\" {{ uniform token wrap = \"{wrap}\" \
                 int[] curveVertexCounts = [{points}] \
                 point3f[] points = [{}] float[] widths = [1] (interpolation = \"constant\") }}",
                list.join(",")
            ),
        );
        text.expect("curves").notes.iter().any(|note| note.starts_with("1 Bézier curves have points behind"))
    };
    for (points, wrap, is_told) in [
        (4, "nonperiodic", false),
        (5, "nonperiodic", true),
        (6, "nonperiodic", true),
        (7, "nonperiodic", false),
        (6, "periodic", false),
        (7, "periodic", true),
    ] {
        assert_eq!(told(points, wrap), is_told, "{points} {wrap}");
    }
}

#[test]
fn a_bracket_that_nothing_closes_is_told_with_its_line() {
    let folder = Folder::new(&[]);
    for (own, words) in [
        ("def \"a\"\n{\n float[] widths = [1, 2\n int n = 3\n}\n", "line 4: nothing closes the bracket ["),
        ("def \"a\" {\n point3f[] points = [(1, 2, 3), (4,\n", "line 3: nothing closes the bracket ("),
        ("def \"a\" (\n doc = \"]\"\n) {\n", "line 4: nothing closes the bracket {"),
    ] {
        let error = text(&folder, own).expect_err("broken").to_string();
        assert!(error.contains(words), "no {words:?} in: {error}");
    }
}

#[test]
fn broken_curves_are_told() {
    let folder = Folder::new(&[]);
    let with = |own: &str| {
        let text = text(&folder, &format!("def BasisCurves \"a\" {{ {own} }}"));
        let error = text.expect_err(own);
        assert_eq!(error.exit_code(), 65, "{error}");
        error.to_string()
    };
    let points = "uniform token type = \"linear\" point3f[] points = [(0,0,0), (0,0,1)]";
    for (own, words) in [
        ("", "it has no curves"),
        ("int[] curveVertexCounts = [3]", "add up to 3, there are 0 points"),
        ("float[] points = [1]", "not of the type point3f[]"),
        (&format!("{points} int[] curveVertexCounts = [-2, 4]"), "a number is negative"),
        (&format!("{points} int[] curveVertexCounts = [1, 1]"), "2 curves have too few points"),
        (
            &format!("{points} int[] curveVertexCounts = [2] float[] widths = [1, 2, 3]"),
            "3 widths for 1 curves",
        ),
        (&format!("{points} int[] curveVertexCounts = [2] float[] widths = [1, -2]"), "width 1 is -2"),
        (&format!("{points} int[] curveVertexCounts = [2] uniform token wrap = \"x\""), "wrap = \"x\""),
        (&points.replace("linear", "x"), "add up to 0"),
        ("point3f[] points = [(0,0,1e30)] int[] curveVertexCounts = [1]", "point 0 is [0, 0, 1000000"),
        ("point3f[] points = [(0,0,nan)] int[] curveVertexCounts = [1]", "point 0 is"),
        ("uniform token[] xformOpOrder = [\"xformOp:bend\"] float xformOp:bend = 1", "xformOp:bend"),
    ] {
        let error = with(own);
        assert!(error.contains(words) && error.contains("a.usda"), "no {words:?} in: {error}");
    }
    for (name, bytes, words) in [
        ("a.usdc", &b"PXR-USDC"[..], "damaged"),
        ("a.usd", b"", "no USD"),
        ("a.usdz", b"PK\x03\x04", "the package"),
        ("a.usda", b"#usda 1.0\ndef", "a.usda"),
        ("a.usda", b"#usda 1.0\n\xff", "UTF-8"),
        ("a.USDC", b"PXR-USDC\0\x03\0\0\0\0\0\0\0\0\0\0\0\0\0\0", "usdcat"),
    ] {
        folder.write(name, bytes);
        let error = StrandFile::read(&folder.path(name), None, BUDGET).expect_err(words).to_string();
        assert!(error.contains(words), "no {words:?} in: {error}");
    }
}

#[test]
fn texts_that_would_fill_the_stack_or_the_memory_are_refused() {
    let folder = Folder::new(&[]);
    let deep = "def \"a\" {".repeat(5000);
    let error = text(&folder, &deep).expect_err("deep").to_string();
    assert!(error.contains("5000 brackets"), "{error}");
    // The parser would double what it keeps with each bracket.
    let nested = format!("def \"a\" ( foo = {}1{} ) {{}}", "[".repeat(100), "]".repeat(100));
    let error = text(&folder, &nested).expect_err("nested").to_string();
    assert!(error.contains("an array begins inside an array"), "{error}");
    // Brackets in strings and comments do not count.
    let quoted =
        "def \"a\" (doc = \"\"\"((((\"\"\") { string s = \"((\\\"(\" # ((((\n string t = '(' }".repeat(200);
    let error = text(&folder, &quoted).expect_err("no curves").to_string();
    assert!(!error.contains("brackets"), "{error}");
    let many = (0..60_000).map(|i| format!("def \"a{i}\" {{}}\n")).collect::<String>();
    assert!(matches!(text(&folder, &many), Err(Error::Memory { .. })));
    let told = StrandFile::read(&sample("pixar.usdc"), None, 1000).expect_err("too large");
    assert!(matches!(told, Error::Memory { .. }), "{told}");
}

#[test]
fn a_package_that_is_compressed_or_holds_a_package_is_refused() {
    let folder = Folder::new(&[]);
    let packed = |name: &str, bytes: &[u8], method| {
        let mut package = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        let options = zip::write::SimpleFileOptions::default().compression_method(method);
        package.start_file(name, options).expect("begun");
        package.write_all(bytes).expect("written");
        let bytes = package.finish().expect("finished").into_inner();
        folder.write("a.usdz", &bytes);
        StrandFile::read(&folder.path("a.usdz"), None, BUDGET)
    };
    let bytes = std::fs::read(sample("blender.usdc")).expect("a sample");
    let [stored, small] = [zip::CompressionMethod::Stored, zip::CompressionMethod::Deflated];
    assert_eq!(packed("a.usdc", &bytes, stored).expect("curves").strands.count(), 6);
    assert!(packed("a.usdc", &bytes, small).expect_err("compressed").to_string().contains("first file"));
    assert!(packed("a.png", &bytes, stored).expect_err("no layer").to_string().contains("first file"));
    let package = std::fs::read(sample("blender.usdz")).expect("a sample");
    assert!(packed("a.usdc", &package, stored).expect_err("a package").to_string().contains("no USD"));
}

#[test]
fn mutations_give_curves_or_an_error() {
    for (name, rounds) in [("blender.usdc", 3000), ("pixar.usdc", 3000), ("pixar.usda", 800)] {
        let whole = std::fs::read(sample(name)).expect("a sample");
        let (folder, mut random) = (Folder::new(&[]), Pcg64Mcg::seed_from_u64(11));
        let mut refused = 0;
        for _ in 0..rounds {
            let mut bytes = whole.clone();
            for _ in 0..1 + random.next_u64() % 4 {
                let at = (random.next_u64() % bytes.len() as u64) as usize;
                let value = random.next_u64();
                match random.next_u64() % 4 {
                    0 => bytes[at] ^= 1 << (value % 8),
                    1 => bytes[at..].iter_mut().take(8).for_each(|byte| *byte = 0xff),
                    _ => bytes[at] = value as u8,
                }
            }
            if random.next_u64() % 8 == 0 {
                bytes.truncate((random.next_u64() % bytes.len() as u64) as usize);
            }
            folder.write(name, &bytes);
            match StrandFile::read(&folder.path(name), None, BUDGET) {
                Ok(file) => {
                    let points = &file.strands.points;
                    assert!(
                        points.iter().all(|p| p.is_finite()) && points.len() == file.strands.widths.len()
                    );
                }
                Err(Error::Input { .. } | Error::Memory { .. }) => refused += 1,
                Err(other) => panic!("{other}"),
            }
        }
        assert!((rounds / 8..rounds).contains(&refused), "{name}: {refused} refused");
    }
}
