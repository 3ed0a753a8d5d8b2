//! Preset scenes: the figures show what they promise, and pictures match snapshots, the weakest kind of test.
//!
//! `TAKI_BLESS=1 tests/run presets` rewrites the snapshots. Look at each before you keep it.

use std::path::{Path, PathBuf};

use crate::engine::gpu::{assert_parity, both, renderer, scene};
use taki::engine::{RenderOptions, cpu};
use taki::grid;
use taki::output::frame::{Difference, Tolerance, encode_png, read_png};
use taki::picture::Frame;
use taki::scene::{Limits, Scene, presets};
use taki::util::monitor::Unwatched;

/// Settings of a picture so small that its snapshot stays under 64 KiB.
const SMALL: [&str; 3] = ["image.width=96", "image.height=154", "image.samples=2"];
const FIGURES: [&str; 3] = ["fig5", "fig6", "fig7"];
const MAX_SNAPSHOT_BYTES: u64 = 64 << 10;

fn on_cpu(scene: &Scene) -> Frame {
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("volumes");
    cpu::render(scene, &volumes, &scene.mesh(), false, &Unwatched).expect("a frame")
}

fn encoded(frame: &Frame) -> Vec<[f32; 3]> {
    frame.picture.iter().map(|p| [p[0], p[1], p[2]].map(|x| x as f32 / 255.0)).collect()
}

fn snapshot(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots").join(format!("{name}.png"))
}

/// Asserts that a frame matches its snapshot, within two steps of 255 for the rounding of other compilers and
/// drivers. A hundredth of the pixels may differ more, because of edges.
fn assert_like_snapshot(name: &str, frame: &Frame) {
    let (width, height, golden) = read_png(&snapshot(name)).expect("a snapshot");
    assert_eq!((width, height), (frame.width, frame.height));
    let d =
        Difference::new(width, &encoded(frame), &golden, Tolerance { relative: 0.0, absolute: 2.5 / 255.0 });
    assert!(d.share_outside() <= 0.01, "{name}: {d:?}");
}

#[test]
fn the_figures_look_as_they_did_when_last_looked_at() {
    for name in FIGURES {
        let frame = on_cpu(&scene(name, &SMALL));
        if std::env::var_os("TAKI_BLESS").is_some() {
            std::fs::write(snapshot(name), encode_png(&frame, &[]).expect("a PNG")).expect("written");
        }
        assert_like_snapshot(name, &frame);
    }
}

#[test]
fn the_gpu_engine_gives_the_same_figures() {
    let Some(mut renderer) = renderer("snapshots") else { return };
    for name in FIGURES {
        let scene = scene(name, &SMALL);
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let options = RenderOptions::default();
        let frame = renderer.render(&scene, &volume, &scene.mesh(), &options, &Unwatched).expect("a frame");
        assert_like_snapshot(name, &frame);
    }
}

#[test]
fn a_snapshot_of_another_figure_does_not_pass() {
    let frame = on_cpu(&scene("fig6", &SMALL));
    assert!(std::panic::catch_unwind(|| assert_like_snapshot("fig5", &frame)).is_err());
}

#[test]
fn the_program_brings_the_grids_of_presets() {
    let file = Path::new("taki:pour.vdb");
    let named = |name: &str| {
        let grid = grid::read(file, name, 1 << 30).expect("a grid");
        (grid.channels(), grid.bounds().expect("water").size())
    };
    let listed = grid::list(file, 1 << 30).expect("grids");
    assert_eq!(listed.iter().map(|own| own.name.as_str()).collect::<Vec<_>>(), ["density", "velocity"]);
    // The velocity has half the voxels along each side.
    assert_eq!((named("density").0, named("velocity")), (1, (3, [46, 32, 55])));
    assert!(grid::list(Path::new("taki:none.vdb"), 1 << 30).is_err());
    // Without strands, a cell is a voxel.
    let scene = scene("pour", &["volumes.pour.strands=0", "volumes.pour.fine=1"]);
    assert_eq!(scene.references(), [], "none lies on the disk");
    let pour = scene.recipes.iter().find(|recipe| recipe.name == "pour").expect("its volume");
    assert_eq!(pour.water.size, named("density").1.map(|n| n as u32));
}

#[test]
fn snapshots_are_small() {
    for name in FIGURES {
        let bytes = std::fs::metadata(snapshot(name)).expect("a snapshot").len();
        assert!(bytes <= MAX_SNAPSHOT_BYTES, "{name}: {bytes} bytes");
    }
}

#[test]
fn every_preset_renders_light_and_no_pixel_that_is_not_finite() {
    for (name, _) in presets() {
        let frame = on_cpu(&scene(name, &["image.width=48", "image.height=40", "image.samples=1"]));
        assert_eq!(frame.non_finite_pixels(), 0, "{name}");
        assert!(frame.covered_pixels() > 40 * 48 / 20, "{name}: the water covers almost nothing");
        let brightest = encoded(&frame).into_iter().flatten().fold(0.0, f32::max);
        assert!(brightest > 0.5, "{name} is dark");
    }
}

/// The scenes of falling water besides the default one.
const PLACES: [&str; 4] = ["cascade", "curtain", "spout", "night"];

/// A preset with a coarse place, for the same reason as `COARSE_PLACE`.
fn coarse(name: &str, more: &[&str]) -> Scene {
    let scene_of_all = scene(name, &[]);
    let values = scene_of_all.values().expect("a preset has values");
    // The film's lobe is a 32nd power, which magnifies the remaining differences.
    let rock = |rock: String| [format!("rocks.{rock}.levels=1"), format!("rocks.{rock}.wet=0")];
    let rocks = values.names("rocks").into_iter().flat_map(rock);
    let pools = values.names("pools").into_iter().map(|pool| format!("pools.{pool}.foam=0"));
    let sets: Vec<String> = rocks.chain(pools).chain(more.iter().map(|s| s.to_string())).collect();
    scene(name, &sets.iter().map(String::as_str).collect::<Vec<_>>())
}

#[test]
fn the_engines_agree_on_every_scene_of_falling_water() {
    let Some(mut renderer) = renderer("scenes of falling water") else { return };
    for name in PLACES {
        let scene = coarse(name, &["image.width=96", "image.height=54", "image.samples=1"]);
        assert_parity(name, &both(&mut renderer, &scene));
    }
}

#[test]
fn every_scene_of_falling_water_flows_and_comes_round() {
    for name in PLACES {
        let at = |flow: &str| {
            on_cpu(&coarse(name, &["image.width=64", "image.height=36", "image.samples=1", flow])).picture
        };
        let start = at("volume.flow=0");
        assert!(start == at("volume.flow=1"), "{name} comes round");
        let moved = start.iter().zip(&at("volume.flow=0.37")).filter(|(a, b)| a != b).count();
        assert!(moved > 64 * 36 / 50, "{name}: only {moved} pixels change while it flows");
    }
}

#[test]
fn figure_six_is_denser_and_figure_seven_smoother_than_figure_five() {
    let [five, six, seven] = FIGURES.map(|name| scene(name, &SMALL));
    let mean_t = |s: &Scene| {
        let f = on_cpu(s);
        let water: Vec<f32> =
            f.radiance.iter().zip(&f.counts).filter(|(_, c)| c[0] > 0).map(|(r, _)| r[3]).collect();
        water.iter().sum::<f32>() / water.len() as f32
    };
    assert!(mean_t(&six) < 0.8 * mean_t(&five), "6 lets less light through");
    // Less complex curves stay closer to the flow.
    let along = |s: &Scene| s.volume(1 << 30, &Unwatched).expect("a volume").statistics().v_mean[1];
    assert!(along(&seven) > along(&five) + 0.02, "{} against {}", along(&seven), along(&five));
}

#[test]
fn a_scene_that_takes_its_volume_from_a_file_gives_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let taki = |args: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_taki"));
        command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
        let out = command.current_dir(folder.path()).args(args).output().expect("it runs");
        assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    };
    taki(&["volume", "build", "fig5", "-o", "v.npz"]);
    let text = "version = 1\nbase = \"fig5\"\n[volume]\nfile = \"v.npz\"\n";
    std::fs::write(folder.path().join("mine.toml"), text).expect("written");
    let picture = |scene: &str, engine: &str, file: &str| {
        taki(&["render", scene, "--engine", engine, "--size", "80x128", "--samples", "1", "-o", file]);
        std::fs::read(folder.path().join(file)).expect("a picture")
    };
    for file in ["a.png", "b.exr"] {
        assert!(picture("fig5", "cpu", file) == picture("mine.toml", "cpu", file), "cpu {file}");
        if renderer("bytes").is_some() {
            assert!(picture("fig5", "gpu", file) == picture("mine.toml", "gpu", file), "gpu {file}");
        }
    }
}

#[test]
fn the_base_water_has_the_look_of_the_default_scene_and_nothing_of_its_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("own.toml");
    let sheet = "[sheets.own]\npoints = [[0, 3, 0], [0, -3, 1]]\nwidths = [2]\n";
    std::fs::write(&file, format!("version = 1\nbase = \"water\"\n{sheet}")).expect("written");
    let own = Scene::load(&file, &[], &Limits::default()).expect("a scene");
    // The base shows strands near by, too.
    let default =
        Scene::preset("waterfall").expect("a preset").with(&["trace.lookup=strand"]).expect("valid");
    assert_eq!(own.recipes[0].water, default.recipes[0].water);
    assert_eq!((own.trace, own.p, own.ambient), (default.trace, default.p, default.ambient));
    assert_eq!(own.lights, default.lights);
    assert_eq!(own.quads[0].material.thickness_m, 0.8);
    assert!(own.rocks.is_empty() && own.pools.is_empty() && !own.quads.is_empty());
    let names = own.values().expect("not edited").names("sheets");
    assert_eq!(names, ["own"]);
    // Without the base, the sheet shows the volume that it always showed.
    std::fs::write(&file, format!("version = 1\n{sheet}")).expect("written");
    let plain = Scene::load(&file, &[], &Limits::default()).expect("a scene");
    assert_eq!(plain.recipes[0].water.size, [40, 40, 40]);
    // It is no preset: nothing renders it by itself.
    assert!(Scene::preset("water").is_err());
}
