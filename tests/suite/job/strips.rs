//! Large pictures. A part of an image equals that part of the whole bit for bit. Files do not depend on how
//! their rows arrived, crops stitch to the file of the whole, and damaged files are detected.

use std::path::{Path, PathBuf};

use crate::cli::faults::{run, taki};
use crate::engine::gpu::{renderer, scene};
use rand::{RngExt, SeedableRng};
use taki::engine::{Engine, RenderOptions};
use taki::job::{Still, StitchOptions, stitch, stitch_with, strips};
use taki::output::frame::{Compression, Exr, Figures, figures_of, read_exr, read_picture, verify};
use taki::picture::camera::clip_to_window;
use taki::picture::{Frame, Grid, Layer, Surface};
use taki::place::Mesh;
use taki::scene::{Limits, Scene};
use taki::util::error::Error;
use taki::util::monitor::Unwatched;
use taki::util::window::Window;
use taki::volume::VolumeTexture;
use tempfile::{TempDir, tempdir};

/// A scene with the volume and mesh that the engines need.
struct Subject {
    scene: Scene,
    volume: VolumeTexture,
    mesh: Mesh,
}

impl Subject {
    fn new(preset: &str, sets: &[&str]) -> Subject {
        let scene = scene(preset, sets);
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        Subject { mesh: scene.mesh(), volume, scene }
    }

    /// A small scene with water, rock and background.
    fn small() -> Subject {
        let sets = ["image.width=97", "image.height=61", "image.samples=2", "rocks.foot.levels=5"];
        Subject::new("fig5", &sets)
    }

    fn whole(&self) -> Window {
        Window::whole([self.scene.image.width, self.scene.image.height])
    }

    fn render(&self, engine: &mut Engine, window: Option<Window>, grid: Grid) -> Frame {
        let options = RenderOptions { surface: true, window, grid, ..Default::default() };
        engine.render_volume(&self.scene, &self.volume, &self.mesh, &options, &Unwatched).expect("a frame")
    }

    /// Writes `window` to `path` in strips of the given heights. The last height repeats.
    fn write(&self, path: &Path, window: Window, rows: &[u32]) -> Figures {
        self.write_as(path, window, rows, &Exr::of(&Layer::ALL))
    }

    fn write_as(&self, path: &Path, window: Window, rows: &[u32], exr: &Exr) -> Figures {
        let still = Still::create(&[path.to_owned()]).expect("an output");
        let mut writer = still.begin(&self.scene, &self.volume, window, exr).expect("begun");
        let (mut y, mut rows) =
            (window.y, rows.iter().copied().chain(std::iter::repeat(rows[rows.len() - 1])));
        while y < window.bottom() {
            let height = rows.next().expect("endless").min(window.bottom() - y);
            let strip =
                self.render(&mut Engine::cpu(), Some(Window { y, height, ..window }), Grid::default());
            writer.push(&strip).expect("written");
            y += height;
        }
        writer.finish().expect("finished")
    }
}

fn part_of(frame: &Frame, window: Window) -> Frame {
    let whole = Window::whole([frame.width, frame.height]);
    let places: Vec<usize> = (window.y..window.bottom())
        .flat_map(|y| (window.x..window.right()).map(move |x| whole.index([x, y])))
        .collect();
    fn pick<T: Copy>(places: &[usize], from: &[T]) -> Vec<T> {
        places.iter().map(|&i| from[i]).collect()
    }
    let surface = frame.surface.as_ref().map(|s| Surface {
        depth: pick(&places, &s.depth),
        z: pick(&places, &s.z),
        uv: pick(&places, &s.uv),
        quad: pick(&places, &s.quad),
        normal: pick(&places, &s.normal),
    });
    Frame {
        width: window.width,
        height: window.height,
        radiance: pick(&places, &frame.radiance),
        counts: pick(&places, &frame.counts),
        alpha: frame.alpha.as_ref().map(|alpha| pick(&places, alpha)),
        picture: pick(&places, &frame.picture),
        surface,
        seconds: Default::default(),
    }
}

fn assert_same(what: &str, a: &Frame, b: &Frame) {
    let bits = |f: &Frame| f.radiance.iter().map(|r| r.map(f32::to_bits)).collect::<Vec<_>>();
    assert!(bits(a) == bits(b), "{what}: radiance");
    assert!(a.counts == b.counts, "{what}: counts");
    assert!(a.alpha == b.alpha, "{what}: alpha");
    assert!(a.picture == b.picture, "{what}: picture");
    assert!(a.surface == b.surface, "{what}: surface");
}

/// Windows of every kind, with the same numbers in every run.
fn crops(size: [u32; 2], count: usize) -> Vec<Window> {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(7);
    let mut some = |n: u32| {
        let first = random.random_range(0..n);
        (first, random.random_range(1..=n - first))
    };
    let mut crops = vec![
        Window { x: 0, y: 0, width: 1, height: 1 },
        Window { x: size[0] - 1, y: size[1] - 1, width: 1, height: 1 },
        Window { x: 0, y: 5, width: size[0], height: 40 },
    ];
    crops.extend((0..count).map(|_| {
        let ((x, width), (y, height)) = (some(size[0]), some(size[1]));
        Window { x, y, width, height }
    }));
    crops
}

#[test]
fn a_part_of_an_image_is_that_part_of_the_whole_bit_for_bit_on_both_engines() {
    let subject = Subject::small();
    let mut engines = vec![Engine::cpu()];
    engines.extend(renderer("crops").map(Engine::gpu));
    // The small grid gives as many device windows as a picture of gigapixels has.
    for grid in [Grid { side: 32, pixels: 32 * 16 }, Grid { side: 64, pixels: 64 * 64 }, Grid::default()] {
        for engine in &mut engines {
            let whole = subject.render(engine, None, grid);
            assert!(whole.covered_pixels() > 0 && whole.counts.iter().any(|c| c[0] == 0), "rock and water");
            for crop in crops([97, 61], 12) {
                let part = subject.render(engine, Some(crop), grid);
                assert_same(&format!("{} {grid:?} {crop}", engine.word()), &part, &part_of(&whole, crop));
            }
        }
    }
}

#[test]
fn a_window_that_is_the_whole_image_has_the_matrix_of_the_image() {
    let scene = scene("waterfall", &[]);
    let clip = scene.camera.clip_from_world(1280, 720, [0.25, 0.75], &scene.depth_range(&Mesh::default()));
    let bits = |m: glam::Mat4| m.to_cols_array().map(|x| (x + 0.0).to_bits());
    assert_eq!(bits(clip_to_window(clip, [1280, 720], Window::whole([1280, 720]))), bits(clip));
    // The corner of any other window is the corner of its clip space.
    let window = Window { x: 320, y: 90, width: 64, height: 40 };
    let moved = clip_to_window(glam::Mat4::IDENTITY, [1280, 720], window);
    let corner = moved * glam::Vec4::new(320.0 / 640.0 - 1.0, 1.0 - 90.0 / 360.0, 0.5, 1.0);
    assert!((corner - glam::Vec4::new(-1.0, 1.0, 0.5, 1.0)).length() < 1e-5, "{corner}");
}

#[test]
fn the_grid_depends_on_the_image_alone_and_covers_it_once() {
    let grid = Grid::default();
    assert_eq!(grid.size([1280, 720]), [1280, 720]);
    assert_eq!(grid.size([16384, 16384]), [4096, 512]);
    assert_eq!(grid.size([1, 1_000_000]), [1, 4096]);
    assert_eq!(grid.size([1_000_000, 1]), [4096, 1]);
    let image = [9000, 1100];
    let whole = grid.windows(image, Window::whole(image));
    assert_eq!(whole.iter().map(Window::pixels).sum::<u64>(), 9000 * 1100);
    let part = Window { x: 4095, y: 511, width: 2, height: 2 };
    let met = grid.windows(image, part);
    assert_eq!(met.len(), 4);
    assert!(met.iter().all(|w| whole.contains(w) && w.meet(&part).is_some()));
}

#[test]
fn strips_follow_one_another_and_shrink_with_the_memory() {
    let scene = scene("waterfall", &["image.width=16384", "image.height=16384"]);
    let whole = Window::whole([16384, 16384]);
    let of = |window, memory: u64| strips(&scene, window, true, memory << 20).expect("strips");
    let (large, small) = (of(whole, 4096), of(whole, 700));
    assert!(large.iter().all(|s| s.y % 512 == 0 && s.height == 512), "{large:?}");
    assert!(small.len() > large.len());
    for (window, list) in
        [(whole, large), (whole, small), (Window { x: 3, y: 700, width: 90, height: 900 }, vec![])]
    {
        let list = if list.is_empty() { of(window, 500) } else { list };
        let mut y = window.y;
        for strip in &list {
            assert_eq!(*strip, Window { y, height: strip.height, ..window });
            y += strip.height;
        }
        assert_eq!(y, window.bottom());
    }
    let refused = strips(&scene, whole, true, 100 << 20);
    assert!(matches!(&refused, Err(Error::Memory { .. })), "{refused:?}");
    let load = |size: u32, memory| {
        let sets = [format!("image.width={size}"), format!("image.height={size}")];
        Scene::load(Path::new("front"), &sets, &Limits { memory, ..Limits::default() })
    };
    assert!(load(262_144, 1 << 30).is_ok());
    assert!(matches!(load(262_145, u64::MAX), Err(Error::Memory { .. })), "2^36 pixels at most");
}

#[test]
fn a_file_does_not_depend_on_how_its_rows_came() {
    let (subject, dir) = (Subject::small(), tempdir().expect("a folder"));
    let crop = Window { x: 11, y: 4, width: 70, height: 50 };
    for window in [subject.whole(), crop] {
        for extension in ["png", "jpg", "tif", "webp", "exr"] {
            let file = |name: &str| dir.path().join(format!("{name}.{extension}"));
            let figures = subject.write(&file("a"), window, &[61]);
            for (name, rows) in [("b", &[1][..]), ("c", &[7, 1, 30, 2]), ("d", &[16])] {
                assert_eq!(subject.write(&file(name), window, rows), figures);
                let same =
                    std::fs::read(file("a")).expect("a") == std::fs::read(file(name)).expect("another");
                assert!(same, "{extension} {window} {name}");
            }
            let frame = subject.render(&mut Engine::cpu(), Some(window), Grid::default());
            assert_eq!(figures, Figures::of(&frame));
            let verified = verify(&file("a")).expect("whole");
            assert_eq!((verified.size, verified.window), ([97, 61], window));
            let scene = verified.scene.expect("a scene");
            assert!(scene.contains("[camera]") && scene.contains("width = 97"), "{scene}");
            assert_eq!(verified.figures, (extension != "exr").then_some(figures.clone()));
            check_contents(&file("a"), &frame, window);
            let known = figures_of(&file("a")).expect("figures");
            assert_eq!(known.mean_radiance(), Some(figures.mean_radiance()));
            assert_eq!(known.mean_transmittance(), Some(figures.mean_transmittance()));
            assert_eq!(known.covered_pixels, Some(figures.covered_pixels));
            assert_eq!(known.cells_walked, Some(figures.cells_walked));
        }
    }
}

/// Checks that other programs can read what was rendered.
fn check_contents(path: &Path, frame: &Frame, window: Window) {
    if path.extension().is_some_and(|e| e != "exr") {
        let image = read_picture(path).expect("a picture");
        let want = frame.picture.iter().map(|p| [p[0], p[1], p[2]].map(|x| f32::from(x) / 255.0));
        let least = match path.extension().and_then(|e| e.to_str()) {
            // 16 bits are not dithered.
            Some("tif") => 1.01 / 255.0,
            Some("jpg") => 0.1,
            _ => 0.0,
        };
        let near = |p: [f32; 3], q: [f32; 3]| p.iter().zip(q).all(|(p, q)| (p - q).abs() <= least);
        assert!(image.pixels.len() == frame.picture.len());
        assert!(image.pixels.into_iter().zip(want).all(|(p, q)| near(p, q)), "{}", path.display());
        return;
    }
    let (width, height, channels) = read_exr(path, 1 << 30).expect("an EXR");
    // The picture is the display window, in which a crop has its place.
    assert_eq!((width, height, channels.len()), (97, 61, 13));
    let rows = window.y..window.bottom();
    let places: Vec<usize> = rows
        .flat_map(|y| (window.x..window.right()).map(move |x| Window::whole([97, 61]).index([x, y])))
        .collect();
    for (name, values) in channels {
        let (layer, c) = Layer::ALL
            .iter()
            .find_map(|l| l.channels().iter().position(|n| *n == name).map(|c| (*l, c)))
            .expect("a known channel");
        let want = (0..places.len()).map(|i| layer.value(frame, c, i).to_bits());
        assert!(places.iter().map(|&i| values[i].to_bits()).eq(want), "{name}");
        let inside =
            |i: &usize| window.meet(&Window { x: *i as u32 % 97, y: *i as u32 / 97, width: 1, height: 1 });
        let mut outside = (0..values.len()).filter(|i| inside(i).is_none());
        assert!(outside.all(|i| values[i] == 0.0), "{name}");
    }
    let meta = exr::prelude::MetaData::read_from_file(path, true).expect("a header");
    let header = &meta.headers[0];
    let (data, display) = (header.data_window(), header.shared_attributes.display_window);
    assert_eq!((data.position.0, data.position.1), (window.x as i32, window.y as i32));
    assert_eq!((display.size.0, display.size.1), (97, 61));
}

#[test]
fn figures_of_parts_add_up_to_those_of_the_whole() {
    let subject = Subject::small();
    let frame = subject.render(&mut Engine::cpu(), None, Grid::default());
    let whole = Figures::of(&frame);
    assert_eq!([whole.cells_walked, whole.light_cells_walked], frame.cells_walked());
    assert_eq!((whole.pixels, whole.covered_pixels), (97 * 61, frame.covered_pixels()));
    let mean = frame.radiance.iter().map(|r| f64::from(r[1])).sum::<f64>() / (97.0 * 61.0);
    assert!((whole.mean_radiance()[1] - mean).abs() < 1e-5);
    let parts = [(0, 0, 40, 61), (40, 0, 57, 20), (40, 20, 57, 41)];
    let mut sum = Figures::default();
    for (x, y, width, height) in parts {
        sum.add(&Figures::of(&part_of(&frame, Window { x, y, width, height })));
    }
    assert_eq!(sum, whole);
    let text = serde_json::to_string(&whole).expect("JSON");
    assert_eq!(serde_json::from_str::<Figures>(&text).expect("the same"), whole);
    let mut odd = frame;
    odd.radiance[0] = [f32::NAN, f32::INFINITY, -f32::INFINITY, 1.0];
    assert_eq!(Figures::of(&odd).non_finite_pixels, 1);
}

#[test]
fn halves_of_a_unit_round_away_from_zero() {
    // Numbers of half units about 0, and up to beyond the largest value that is added.
    let halves = (-9i64..=9).chain([(1 << 24) - 1, 1 - (1 << 24), 1 << 37, 1 << 39, -(1 << 39)]);
    for half in halves {
        let value = half as f32 / 131_072.0;
        let mut frame = Frame::new(1, 1, false);
        frame.radiance[0] = [value; 4];
        let figures = Figures::of(&frame);
        let expected = (f64::from(value).clamp(-1_048_576.0, 1_048_576.0) * 65_536.0).round() as i128;
        assert_eq!((figures.radiance_sum, figures.transmittance_sum), ([expected; 3], expected), "{half}");
    }
}

/// Crops of the small subject in a folder, and the file of the whole picture.
fn pieces(extension: &str, windows: &[(u32, u32, u32, u32)]) -> (TempDir, Vec<PathBuf>, PathBuf) {
    let (subject, dir) = (Subject::small(), tempdir().expect("a folder"));
    let file = |name: String| dir.path().join(format!("{name}.{extension}"));
    let parts = windows.iter().map(|&(x, y, width, height)| {
        let window = Window { x, y, width, height };
        let path = file(window.to_string());
        subject.write(&path, window, &[61]);
        path
    });
    let parts = parts.collect();
    let whole = file("whole".into());
    subject.write(&whole, subject.whole(), &[61]);
    (dir, parts, whole)
}

#[test]
fn crops_stitch_to_the_file_of_the_whole() {
    let tiles = [(40, 20, 57, 41), (0, 0, 40, 61), (40, 0, 57, 20)];
    let inside = [(0, 0, 97, 30), (0, 30, 97, 31), (5, 5, 10, 10), (0, 30, 97, 31)];
    let lapped = [(0, 0, 60, 61), (50, 0, 47, 61)];
    for extension in ["png", "tif", "webp", "exr"] {
        for (windows, figures) in [(&tiles[..], true), (&inside, true), (&lapped, false)] {
            let (dir, parts, whole) = pieces(extension, windows);
            let joined = dir.path().join(format!("joined.{extension}"));
            let known = stitch(&parts, &joined, false, &Unwatched).expect("stitched");
            let same = std::fs::read(&joined).expect("joined") == std::fs::read(&whole).expect("whole");
            // Where crops overlap, the sums of a developed picture cannot be derived from its parts.
            assert_eq!(same, figures || extension == "exr", "{extension} {windows:?}");
            assert_eq!(known.is_some(), figures && extension != "exr");
            let (a, b) = (verify(&joined).expect("whole"), verify(&whole).expect("whole"));
            assert_eq!((a.size, a.window, a.scene), (b.size, b.window, b.scene));
        }
    }
}

#[test]
fn crops_keep_their_numbers_and_compression_or_get_what_is_asked_for() {
    let (subject, dir) = (Subject::small(), tempdir().expect("a folder"));
    let file = |name: &str| dir.path().join(name);
    let as_of = |half, compression| Exr { half, compression, ..Exr::of(&Layer::ALL) };
    // Blocks of 16 and 32 lines begin elsewhere in the parts than in the whole.
    let windows = [(40, 0, 57, 20), (40, 20, 57, 41), (0, 0, 40, 61)];
    let parts = |half, compression| -> Vec<PathBuf> {
        let part = |(x, y, width, height)| {
            let path = file(&format!("{x}-{y}.exr"));
            subject.write_as(&path, Window { x, y, width, height }, &[13], &as_of(half, compression));
            path
        };
        windows.into_iter().map(part).collect()
    };
    let whole = |half, compression| {
        let path = file("whole.exr");
        subject.write_as(&path, subject.whole(), &[7, 61], &as_of(half, compression));
        verify(&path).expect("whole");
        std::fs::read(path).expect("read")
    };
    let joined = |parts: &[PathBuf], half, compression| {
        let options = StitchOptions { half, compression, ..Default::default() };
        stitch_with(parts, &file("joined.exr"), &options, &Unwatched).expect("stitched");
        std::fs::read(file("joined.exr")).expect("read")
    };
    for half in [false, true] {
        for compression in Compression::ALL.map(Some) {
            let parts = parts(half, compression);
            assert!(joined(&parts, false, None) == whole(half, compression), "{half} {compression:?}");
        }
    }
    let floats = parts(false, None);
    assert!(joined(&floats, true, Some(Compression::Piz)) == whole(true, Some(Compression::Piz)));
    // Halves of one crop and floats of another are no picture.
    let half = file("half.exr");
    subject.write_as(&half, Window { x: 40, y: 0, width: 57, height: 20 }, &[20], &as_of(true, None));
    let mixed = [half, floats[1].clone(), floats[2].clone()];
    let e = stitch(&mixed, &file("joined.exr"), false, &Unwatched).expect_err("refused").to_string();
    assert!(e.contains("different layers") && e.contains("B (half)"), "{e}");
}

#[test]
fn a_changed_byte_does_no_harm_in_any_compression() {
    let (subject, dir) =
        (Subject::new("front", &["image.width=9", "image.height=7"]), tempdir().expect("a folder"));
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(5);
    let (path, wrong) = (dir.path().join("x.exr"), dir.path().join("wrong.exr"));
    for (half, compression) in [false, true].into_iter().zip(Compression::ALL.into_iter().cycle()).chain([
        (false, Compression::Piz),
        (true, Compression::Rle),
        (false, Compression::None),
    ]) {
        let exr = Exr { half, compression: Some(compression), ..Exr::of(&Layer::ALL) };
        subject.write_as(&path, subject.whole(), &[7], &exr);
        verify(&path).expect("whole");
        let bytes = std::fs::read(&path).expect("read");
        // The pixels stand at the end. ZIP has a checksum of them.
        for at in bytes.len() - 40..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 0x10;
            std::fs::write(&wrong, changed).expect("written");
            let zip = matches!(compression, Compression::Zip | Compression::Zips);
            // Some bits mean nothing, as those of codes that do not occur.
            let same = || read_exr(&wrong, 1 << 24).ok() == read_exr(&path, 1 << 24).ok();
            assert!(!zip || verify(&wrong).is_err() || same(), "{compression:?} byte {at}");
        }
        for length in (0..bytes.len()).step_by(31) {
            std::fs::write(&wrong, &bytes[..length]).expect("written");
            assert!(matches!(verify(&wrong), Err(Error::Input { .. })), "{compression:?} {length}");
        }
        for round in (0..bytes.len()).step_by(7) {
            let mut changed = bytes.clone();
            for _ in 0..=round % 3 {
                let at = random.random_range(0..bytes.len());
                changed[at] = random.random();
            }
            std::fs::write(&wrong, changed).expect("written");
            match verify(&wrong) {
                Ok(_) | Err(Error::Input { .. }) => {}
                Err(e) => panic!("{compression:?} {round}: {e}"),
            }
            let _ = read_exr(&wrong, 1 << 24);
        }
    }
}

#[test]
fn planar_depth_is_the_ray_s_share_along_the_view_on_both_engines() {
    let mut engines = vec![Engine::cpu()];
    engines.extend(renderer("planar depth").map(Engine::gpu));
    for engine in &mut engines {
        let subject = Subject::small();
        let frame = subject.render(engine, None, Grid::default());
        let (surface, camera) = (frame.surface.as_ref().expect("layers"), &subject.scene.camera);
        let (mut wet, mut dry, mut slanted) = (0, 0, 0);
        for i in 0..surface.z.len() {
            let (z, depth) = (surface.z[i], surface.depth[i]);
            assert!(z <= depth && (z > 0.0) == (depth > 0.0), "{i}: {z} {depth}");
            slanted += usize::from(z < 0.99 * depth);
            match surface.quad[i] {
                0 => dry += usize::from(depth > 0.0),
                quad => {
                    wet += 1;
                    let [u, v] = surface.uv[i];
                    let point = subject.scene.quads[quad as usize - 1].map.point_world(u, v);
                    let right = (point.as_dvec3() - camera.eye_local()).dot(camera.forward) as f32;
                    // A rasteriser's (u, v) leave the point some thousandths of a pixel off the ray.
                    assert!((z / right - 1.0).abs() < 1e-4, "{i}: {z} {right}");
                }
            }
        }
        assert!(wet > 100 && dry > 100 && slanted > 100, "{wet} {dry} {slanted}");
    }
}

#[test]
fn parts_that_make_no_whole_are_refused() {
    let windows = [(0, 0, 40, 61), (40, 0, 57, 20), (40, 20, 30, 41), (70, 20, 27, 11), (80, 31, 17, 30)];
    for extension in ["png", "exr"] {
        let (dir, parts, whole) = pieces(extension, &windows);
        let out = dir.path().join(format!("out.{extension}"));
        let refused = |parts: &[PathBuf], words: &[&str]| {
            let e = stitch(parts, &out, false, &Unwatched).expect_err("refused");
            assert_eq!(e.exit_code(), 65, "{e}");
            words.iter().for_each(|word| assert!(e.to_string().contains(word), "no {word} in {e}"));
            assert!(!out.exists());
        };
        refused(&parts, &["--crop 70,31,10,30"]);
        refused(&parts[1..], &["--crop 0,0,40,61"]);

        let other = Subject::new(
            "fig5",
            &["image.width=97", "image.height=61", "rocks.foot.levels=5", "image.samples=2", "light.p=7"],
        );
        let file = dir.path().join(format!("other.{extension}"));
        other.write(&file, other.whole(), &[61]);
        refused(&[whole.clone(), file.clone()], &["different scenes", "p = 7", "other."]);
        let size = Subject::new("fig5", &["image.width=60", "image.height=61", "rocks.foot.levels=5"]);
        size.write(&file, size.whole(), &[61]);
        refused(&[whole.clone(), file.clone()], &["97×61", "60×61"]);
        refused(
            &[whole.clone(), dir.path().join("absent.toml")]
                .map(|p| if p.exists() { p } else { file.clone() }),
            &["60×61"],
        );

        // This crop has the same scene text but another picture: it was tampered with.
        let mut wrong = Subject::small();
        wrong.mesh = Default::default();
        let window = Window { x: 30, y: 10, width: 50, height: 40 };
        wrong.write(&file, window, &[61]);
        refused(&[whole.clone(), file], &["whole.", "other.", "differ at the pixel ("]);
        let e = stitch(&[whole], &dir.path().join("out.jpg"), false, &Unwatched).expect_err("refused");
        assert_eq!(e.exit_code(), 2, "{e}");
    }
}

#[test]
fn a_file_that_is_cut_anywhere_is_refused() {
    let (subject, dir) =
        (Subject::new("front", &["image.width=9", "image.height=7"]), tempdir().expect("a folder"));
    for extension in ["png", "jpg", "tif", "webp", "exr"] {
        let path = dir.path().join(format!("x.{extension}"));
        subject.write(&path, subject.whole(), &[7]);
        verify(&path).expect("whole");
        let bytes = std::fs::read(&path).expect("read");
        let cut = dir.path().join("cut");
        for length in 0..bytes.len() {
            std::fs::write(&cut, &bytes[..length]).expect("written");
            let e = verify(&cut).expect_err("a prefix is not whole");
            assert!(matches!(e, Error::Input { .. }), "{extension} {length}: {e}");
        }
        std::fs::write(&cut, [&bytes[..], &[0]].concat()).expect("written");
        assert!(matches!(verify(&cut), Err(Error::Input { .. })), "{extension}: a byte too many");
    }
}

#[test]
fn a_changed_byte_is_seen_or_changes_nothing_or_belongs_to_an_exr_and_does_no_harm() {
    let (subject, dir) =
        (Subject::new("front", &["image.width=9", "image.height=7"]), tempdir().expect("a folder"));
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(3);
    for extension in ["png", "jpg", "tif", "webp", "exr"] {
        let path = dir.path().join(format!("x.{extension}"));
        subject.write(&path, subject.whole(), &[7]);
        let (whole, picture) = (verify(&path).expect("whole"), read_picture(&path).ok());
        let bytes = std::fs::read(&path).expect("read");
        let flipped = dir.path().join("flipped");
        let mut unseen = 0;
        for round in 0..bytes.len() {
            let mut wrong = bytes.clone();
            wrong[round] ^= 1 << random.random_range(0..8);
            // Several bytes change at once too, because one change alone rarely gives a header that is read
            // further.
            for _ in 0..round % 4 * usize::from(extension == "exr") {
                let at = random.random_range(0..bytes.len());
                wrong[at] = random.random();
            }
            std::fs::write(&flipped, wrong).expect("written");
            match verify(&flipped) {
                Err(Error::Input { .. }) => {}
                Err(e) => panic!("{extension} byte {round}: {e}"),
                Ok(verified) => {
                    unseen += 1;
                    let same = verified == whole && read_picture(&flipped).ok() == picture;
                    assert!(same || extension == "exr", "{extension} byte {round}");
                }
            }
            let _ = figures_of(&flipped);
        }
        let may_be_unseen = !["png", "jpg"].contains(&extension);
        assert!(may_be_unseen || unseen == 0, "{unseen} of {} unseen", bytes.len());
    }
}

#[test]
fn hostile_headers_are_refused_without_much_memory() {
    let dir = tempdir().expect("a folder");
    let path = dir.path().join("x");
    // A PNG of a million pixels a side without data, but with a correct checksum.
    let mut ihdr = b"IHDR".to_vec();
    ihdr.extend(1_000_000u32.to_be_bytes());
    ihdr.extend(1_000_000u32.to_be_bytes());
    ihdr.extend([8, 2, 0, 0, 0]);
    let crc = crc32fast::hash(&ihdr).to_be_bytes();
    let png = [b"\x89PNG\r\n\x1a\n\0\0\0\x0d", &ihdr[..], &crc].concat();
    for bytes in [&png[..], b"", b"\x89PN", b"GIF89a", b"version = 1\n"] {
        std::fs::write(&path, bytes).expect("written");
        assert!(matches!(verify(&path), Err(Error::Input { .. })));
    }
    assert!(matches!(verify(dir.path()), Err(Error::Input { .. })));
    assert!(matches!(verify(&dir.path().join("absent")), Err(Error::Input { .. })));
}

#[test]
fn the_command_line_crops_and_stitches() {
    let dir = tempdir().expect("a folder");
    let at = |name: &str| dir.path().join(name);
    let render = |crop: Option<&str>, name: &str| {
        let mut command = taki(["render", "front", "--engine=cpu", "--size=48x40", "--json", "-o"]);
        command.arg(at(name));
        command.args(crop.map(|crop| format!("--crop={crop}")));
        command
    };
    run(&mut render(None, "whole.png")).done();
    let text = run(&mut render(Some("0,0,48,25"), "a.png"));
    let json: serde_json::Value = serde_json::from_str(text.done()).expect("JSON");
    assert_eq!((&json["width"], &json["height"], &json["rays"]), (&48.into(), &25.into(), &1200.into()));
    assert_eq!(json["crop"], serde_json::json!({"x": 0, "y": 0, "of": {"width": 48, "height": 40}}));
    run(&mut render(Some("0, 25, 48, 15"), "b.png")).done();
    run(taki(["stitch"]).arg(at("a.png")).arg(at("b.png")).arg("-o").arg(at("joined.png"))).done();
    assert!(
        std::fs::read(at("joined.png")).expect("joined") == std::fs::read(at("whole.png")).expect("whole")
    );
    run(taki(["stitch"]).arg(at("b.png")).arg("-o").arg(at("x.png"))).refused(65, &["--crop 0,0,48,25"]);
    for crop in ["0,0,49,1", "47,0,2,1", "0,39,1,2", "0,0,0,1", "4294967295,0,4294967295,1"] {
        run(&mut render(Some(crop), "x.png")).refused(2, &["--crop", "columns 0 to 47", "rows 0 to 39"]);
    }
    assert_eq!(std::fs::read_dir(dir.path()).expect("a folder").count(), 4);
}

#[test]
fn a_disk_that_fills_up_in_the_middle_of_a_picture_leaves_no_file() {
    let dir = tempdir().expect("a folder");
    for name in ["x.png", "x.exr"] {
        let render = taki(["render", "fig5", "--engine=cpu", "--size=300x300", "--samples=1", "-o"]);
        // The limit lets 64 KiB through and no more.
        let mut shell = std::process::Command::new("bash");
        shell.args(["-c", "trap '' XFSZ; ulimit -f 64; exec \"$@\"", "bash"]).arg(render.get_program());
        shell.args(render.get_args()).arg(dir.path().join(name));
        run(&mut shell).refused(74, &["cannot write", name, "free some space"]);
        assert_eq!(std::fs::read_dir(dir.path()).expect("a folder").count(), 0, "{name}");
    }
}
