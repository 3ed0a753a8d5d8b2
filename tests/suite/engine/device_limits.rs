//! Volumes that are larger than a device holds in one texture.

use std::process::Command;

use crate::engine::gpu::{assert_parity, both, renderer, scene};
use crate::engine::long_walks::Watch;
use taki::engine::gpu::{DeviceOptions, GpuRenderer};
use taki::engine::{Engine, RenderOptions, cpu};
use taki::util::error::Error;
use taki::util::monitor::Unwatched;

/// Cells along x, more than software Vulkan's largest 3-D texture has.
const LONG: u32 = 5000;

/// A renderer whose device does not hold [`LONG`] cells in one texture.
fn small_device(test: &str) -> Option<GpuRenderer> {
    let renderer = renderer(test)?;
    let most = renderer.gpu.device.limits().max_texture_dimension_3d;
    if most >= LONG {
        eprintln!("{test}: not run: the device holds {most} cells");
        return None;
    }
    Some(renderer)
}

fn long(sets: &[&str]) -> taki::scene::Scene {
    let nx = format!("volume.nx={LONG}");
    let small = ["image.width=48", "image.height=40", "volume.ny=9", "volume.nz=6", "curves.across=64"];
    scene("front", &[&[nx.as_str()], small.as_slice(), sets].concat())
}

#[test]
fn a_dense_volume_that_the_device_cannot_hold_is_stored_sparse_there() {
    let Some(mut renderer) = small_device("long volume") else { return };
    for sets in [
        &["light.visibility=none"][..],
        &["light.visibility=march", "image.samples=2"],
        &["light.visibility=march", "trace.lookup=trilinear"],
    ] {
        let frames = both(&mut renderer, &long(sets));
        assert!(frames[0].covered_pixels() > 500);
        assert_parity(&format!("{sets:?}"), &frames);
    }
    // The texture of light volumes has as many texels along x as the volume has cells.
    let cached = long(&["light.visibility=cached"]);
    let volume = cached.volume(1 << 30, &Unwatched).expect("a volume");
    let refused = renderer
        .render(&cached, &volume, &cached.mesh(), &RenderOptions::default(), &Unwatched)
        .expect_err("too long");
    assert!(matches!(refused, Error::Device { .. }), "{refused:?}");
    // The next volume is stored as before.
    assert_parity("short", &both(&mut renderer, &scene("front", &["image.width=48", "image.height=40"])));
}

#[test]
fn a_volume_that_is_to_be_dense_is_refused_with_the_way_out() {
    let Some(mut renderer) = small_device("dense volume") else { return };
    let scene = long(&["volume.storage=dense"]);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let refused = renderer
        .render(&scene, &volume, &scene.mesh(), &RenderOptions::default(), &Unwatched)
        .expect_err("too long");
    assert!(matches!(refused, Error::Device { .. }), "{refused:?}");
    assert!(refused.to_string().contains("volume.storage=sparse"), "{refused}");
}

#[test]
fn an_automatic_engine_leaves_what_the_device_cannot_hold_to_the_cpu() {
    let Some(renderer) = small_device("taking over") else { return };
    let scene = long(&["volume.storage=dense"]);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let mut engine = Engine::Gpu {
        renderer: Box::new(renderer),
        device: DeviceOptions::default(),
        falls_back: true,
        told: false,
    };
    let mut render = || {
        let watch = Watch::default();
        let options = RenderOptions::default();
        let frame = engine.render_volume(&scene, &volume, &scene.mesh(), &options, &watch).expect("a frame");
        (frame, engine.word(), watch.warnings.into_inner().unwrap())
    };
    let (frame, word, warnings) = render();
    assert_eq!(word, "cpu");
    let on_cpu = cpu::render(&scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame");
    assert!(frame.radiance == on_cpu.radiance && frame.counts == on_cpu.counts);
    assert!(warnings.len() == 1 && warnings[0].ends_with("the CPU engine takes over"), "{warnings:?}");
    // No advice stands beside what taki does by itself, and nothing is said twice.
    assert!(!warnings[0].contains("--engine cpu"), "{warnings:?}");
    assert!(render().2.is_empty());
}

#[test]
fn the_bench_says_which_rows_it_could_not_measure_and_keeps_the_others() {
    if small_device("bench").is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("long.npz");
    let taki = || Command::new(env!("CARGO_BIN_EXE_taki"));
    let size = [format!("volume.nx={LONG}"), "volume.ny=4".into(), "volume.nz=3".into()];
    let sets = size.iter().flat_map(|set| ["--set", set]);
    let built = taki().args(["volume", "build", "front"]).args(sets).arg("-o").arg(&file).output();
    assert!(built.expect("run").status.success());
    let bench = |more: &[&str]| {
        let out = taki().args(["bench", "--size=8x8", "--runs=1", "--volume"]).arg(&file).args(more).output();
        let out = out.expect("run");
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        String::from_utf8(out.stdout).expect("UTF-8")
    };
    let table: serde_json::Value = serde_json::from_str(&bench(&["--json"])).expect("JSON");
    let rows = table["rows"].as_array().expect("rows");
    let row = |engine, pass| {
        let mut found = rows.iter().filter(|row| row["engine"] == engine && row["pass"] == pass);
        (found.next().unwrap_or_else(|| panic!("{engine} {pass} in {table}")), found.count())
    };
    // Coarse levels need dense storage.
    let (failed, more) = row("gpu", "integrate pyramid");
    assert!(failed["error"].as_str().is_some_and(|why| why.contains("too large")) && more == 0, "{failed}");
    for (engine, pass) in [("gpu", "integrate"), ("gpu", "integrate trilinear"), ("cpu", "integrate pyramid")]
    {
        let (measured, _) = row(engine, pass);
        assert!(measured["error"].is_null() && measured["seconds"].as_f64() > Some(0.0), "{measured}");
    }
    let text = bench(&[]);
    let says = |line: &&str| line.contains("integrate pyramid") && line.contains("not measured");
    assert_eq!(text.lines().filter(says).count(), 1, "{text}");
}
