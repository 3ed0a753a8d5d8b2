//! Parity of the GPU engine with the CPU engine, stage by stage, in linear radiance.

use std::path::Path;

use crate::tolerance::Parity;
use taki::engine::gpu::{DeviceOptions, Filling, Gpu, GpuRenderer, adapters};
use taki::engine::{RenderOptions, cpu};
use taki::output::frame::{Difference, Tolerance};
use taki::picture::camera::sample_numbers;
use taki::picture::{Frame, Grid};
use taki::scene::{Limits, Scene};
use taki::util::error::Error;
use taki::util::monitor::Unwatched;
use taki::volume::Leaps;

/// Returns a renderer. On a machine without an adapter it prints that and returns `None`, and the test ends;
/// in continuous integration (CI set) that is a failure.
pub fn renderer(test: &str) -> Option<GpuRenderer> {
    match Gpu::open(&DeviceOptions::default()) {
        Ok(gpu) => Some(GpuRenderer::new(gpu)),
        Err(e) => {
            assert!(std::env::var("CI").is_err(), "continuous integration needs an adapter: {e}");
            eprintln!("{test}: not run: {e}");
            None
        }
    }
}

pub fn scene(preset: &str, sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    Scene::load(Path::new(preset), &sets, &Limits::default()).expect("a valid scene")
}

/// A coarse version of the default scene's place. On a fine mesh, the normals and the foam change so much
/// inside one pixel that the two engines' interpolations differ by more than their shading may.
pub const COARSE_PLACE: [&str; 12] = [
    "rocks.wall.levels=1",
    "rocks.left.levels=1",
    "rocks.right.levels=1",
    "rocks.far_right.levels=1",
    "rocks.bed.levels=1",
    "rocks.rim_left.levels=1",
    "rocks.rim_right.levels=1",
    "rocks.boulder_a.levels=1",
    "rocks.boulder_b.levels=1",
    "rocks.boulder_c.levels=1",
    "rocks.hills.levels=1",
    "pools.plunge.foam=0",
];

pub const SURFACE: RenderOptions = RenderOptions {
    keep_rasters: 0,
    surface: true,
    samples: None,
    tile_pixels: None,
    window: None,
    filling: Filling::Auto,
    grid: Grid { side: 4096, pixels: 1 << 21 },
    leaps: Leaps::Auto,
};

pub fn both(renderer: &mut GpuRenderer, scene: &Scene) -> [Frame; 2] {
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    let mesh = scene.mesh();
    let on_gpu = renderer.render(scene, &volumes, &mesh, &SURFACE, &Unwatched).expect("a frame");
    let on_cpu = cpu::render(scene, &volumes, &mesh, true, &Unwatched).expect("a frame");
    [on_gpu, on_cpu]
}

fn rgb(frame: &Frame) -> Vec<[f32; 3]> {
    frame.radiance.iter().map(|r| [r[0], r[1], r[2]]).collect()
}

/// Asserts that enough pixels are within the tolerance.
fn assert_near(what: &str, width: u32, a: &[[f32; 3]], b: &[[f32; 3]]) {
    let parity = Parity::of_adapter();
    let tolerance = Tolerance { relative: parity.relative, absolute: parity.absolute };
    let d = Difference::new(width, a, b, tolerance);
    assert!(1.0 - d.share_outside() >= parity.share, "{what}: {d:?}");
}

/// Asserts parity of the final radiance alone: where rays run along the edges of cells, rounding decides how
/// many they count.
pub fn assert_same_radiance(what: &str, [gpu, cpu]: &[Frame; 2]) {
    assert_near(what, gpu.width, &rgb(gpu), &rgb(cpu));
}

/// Asserts parity of the final radiance and transmittance, and of the raster pass's layers.
pub fn assert_parity(what: &str, frames: &[Frame; 2]) {
    assert_same_radiance(what, frames);
    let [gpu, cpu] = frames;
    let layer = |frame: &Frame, get: fn(&Frame, usize) -> [f32; 3]| {
        (0..frame.radiance.len()).map(|i| get(frame, i)).collect::<Vec<_>>()
    };
    type Get = fn(&Frame, usize) -> [f32; 3];
    let surfaces: [(&str, Get); 3] = [
        ("transmittance, cells", |f, i| [f.radiance[i][3], f.counts[i][0] as f32, 0.0]),
        ("uv, depth", |f, i| {
            let s = f.surface.as_ref().expect("asked for");
            [s.uv[i][0], s.uv[i][1], s.depth[i]]
        }),
        ("quad", |f, i| [f.surface.as_ref().expect("asked for").quad[i] as f32, 0.0, 0.0]),
    ];
    for (name, get) in surfaces {
        assert_near(&format!("{what}, {name}"), gpu.width, &layer(gpu, get), &layer(cpu, get));
    }
    assert_eq!((gpu.non_finite_pixels(), cpu.non_finite_pixels()), (0, 0), "{what}");
}

#[test]
fn continuous_integration_runs_on_software_vulkan() {
    if std::env::var("CI").is_ok() {
        let names: Vec<String> = adapters().iter().map(|a| a.get_info().name).collect();
        assert!(names.iter().any(|n| n.contains("llvmpipe")), "adapters: {names:?}");
        let renderer = renderer("software Vulkan").expect("an adapter");
        assert!(!renderer.gpu.timestamps, "its time stamps must not be trusted");
    }
}

#[test]
fn the_engines_agree_on_the_papers_figures() {
    let Some(mut renderer) = renderer("figures") else { return };
    for figure in ["fig5", "fig6", "fig7"] {
        let scene = scene(figure, &["image.samples=1"]);
        assert_parity(figure, &both(&mut renderer, &scene));
    }
}

#[test]
fn the_engines_agree_in_every_variant_of_the_integrate_pass() {
    let Some(mut renderer) = renderer("variants") else { return };
    let small = ["image.width=96", "image.height=80", "curves.across=12", "curves.deep=12"];
    let spot =
        ["lights.key.kind=spot", "lights.key.position=[0.4,0.5,1.5]", "lights.key.direction=[0.3,0.4,1.5]"];
    let (strand, multiple) = ("light.reflection=strand", "light.scattering=multiple");
    let hair = "light.reflection=hair";
    let variants: [&[&str]; 24] = [
        &["light.visibility=march"],
        &[hair, "hair.tilt=6", "light.visibility=march"],
        // Many cells run against the sense that coarser levels take them to have.
        &[hair, "hair.tilt=10", "trace.filter=pyramid", "curves.amplitude=1", "curves.h=0.1"],
        &[hair, "light.frame=texture", "trace.lookup=trilinear", "lights.key.direction=[0.4,0.2,-0.9]"],
        &[hair, multiple, "light.visibility=cached", "hair.melanin=0.3"],
        &[hair, multiple, "light.visibility=cached", "materials.water.mist=0.1", "hair.tilt=0"],
        &["trace.attenuation=per-cell", "trace.tau=0.3"],
        &["trace.attenuation=per-cell", "light.visibility=march", "light.frame=texture"],
        &["light.frame=texture", "light.p=7.5"],
        &["light.p=255", "trace.max_cells=9"],
        &["lights.key.kind=point", "lights.key.position=[0.4,0.5,1.5]", "light.visibility=march"],
        &[
            spot[0],
            spot[1],
            spot[2],
            "lights.key.angle=14",
            "lights.key.softness=0.5",
            "light.visibility=march",
        ],
        &[strand, "strand.aeration=0.3", "volume.k_noise=0.2"],
        &[strand, "light.frame=texture", "materials.water.thickness=2", "light.visibility=march"],
        &[strand, multiple, "light.visibility=cached", "strand.radius=0.05", "strand.g=0.9"],
        &[multiple, "light.visibility=march", "strand.g=0"],
        &[strand, multiple, "light.visibility=cached", "trace.attenuation=per-cell", "trace.tau=0.3"],
        &[strand, multiple, "light.visibility=cached", "lights.key.direction=[0.4,0.2,-0.9]"],
        &[strand, multiple, spot[0], spot[1], spot[2], "light.visibility=march", "camera.eye=[0.5,1,-3]"],
        &[multiple, "light.visibility=march", "materials.water.mist=0.4"],
        &[strand, multiple, "light.visibility=cached", "materials.water.mist=0.1", "trace.lookup=trilinear"],
        &["lights.key.intensity=0", "trace.early_end=0.2"],
        &["materials.water.repeat_u=2.5", "materials.water.repeat_v=0.6", "camera.eye=[1.5,-1.0,1.2]"],
        &["volume.flow=0.3", "materials.water.repeat_v=0.6", "light.visibility=march"],
    ];
    for variant in variants {
        let sets: Vec<&str> = small.iter().chain(variant).copied().collect();
        assert_parity(&variant.join(" "), &both(&mut renderer, &scene("front", &sets)));
    }
}

#[test]
fn the_engines_agree_with_many_lights_and_a_volume_of_unequal_sides() {
    let Some(mut renderer) = renderer("lights") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("lights.toml");
    // One walk of a ray handles at most 16 lights.
    for count in [16, 17, 40] {
        let lights: String = (1..count)
            .map(|i| {
                format!(
                    "[lights.l{i}]\ndirection = [{}, 0.5, {}]\nintensity = 0.2\n",
                    (i % 16) as f32 / 8.0 - 1.0,
                    i % 3
                )
            })
            .collect();
        let text = format!(
            "version = 1\nbase = \"front\"\n{lights}[volume]\nnx = 17\nny = 40\nnz = 5\n\
             [image]\nwidth = 64\nheight = 64\n"
        );
        std::fs::write(&file, text).expect("written");
        let scene = Scene::load(&file, &[], &Limits::default()).expect("valid");
        assert_eq!(scene.lights.len(), count);
        let frames = both(&mut renderer, &scene);
        assert_parity(&format!("{count} lights"), &frames);
        assert_eq!(frames[0].counts, frames[1].counts, "{count} lights");
    }
}

#[test]
fn the_engines_agree_at_odd_sizes_and_with_several_samples() {
    let Some(mut renderer) = renderer("odd sizes") else { return };
    for (width, height) in [(1, 1), (1, 70), (63, 5), (65, 33), (257, 3)] {
        let (w, h) = (format!("image.width={width}"), format!("image.height={height}"));
        let frames =
            both(&mut renderer, &scene("front", &[&w, &h, "image.samples=3", "light.visibility=march"]));
        let [gpu, cpu] = &frames;
        assert_eq!(
            (gpu.radiance.len(), cpu.radiance.len()),
            ((width * height) as usize, (width * height) as usize)
        );
        // With so few pixels, a single one on an edge would exceed the allowed share. The mean detects a
        // shifted row.
        let mean =
            |f: &Frame| rgb(f).iter().flatten().map(|&x| x as f64).sum::<f64>() / (width * height) as f64;
        // Coarse corners may move an edge over the samples of a whole row or column.
        let coarse = Parity::of_adapter().is_coarse();
        let (share, row) = if coarse { (0.1, u64::from(width.max(height))) } else { (0.02, 0) };
        assert!((mean(gpu) - mean(cpu)).abs() <= share * mean(cpu).abs() + 1e-4, "{width}×{height}");
        let d = Difference::new(width, &rgb(gpu), &rgb(cpu), Tolerance { relative: 1e-3, absolute: 1e-4 });
        assert!(d.outside <= 2 + row, "{width}×{height}: {d:?}");
    }
}

#[test]
fn the_picture_is_the_tone_curve_of_the_radiance_on_both_engines() {
    let Some(mut renderer) = renderer("resolve") else { return };
    for sets in [
        ["image.tone=filmic", "image.dither=none"],
        ["image.tone=filmic", "image.exposure=1.5"],
        ["image.tone=none", "image.exposure=-2"],
        ["image.tone=agx", "image.exposure=1"],
        ["image.temperature=3200", "image.tint=8"],
        ["image.vignette=1.5", "image.grain=0.05"],
    ] {
        let scene = scene("front", &["image.width=64", "image.height=64", sets[0], sets[1]]);
        let resolver = taki::picture::resolve::Resolver::over(&scene.image.look, [64, 64]);
        for frame in both(&mut renderer, &scene) {
            let mut other = 0;
            for ((linear, picture), i) in frame.radiance.iter().zip(&frame.picture).zip(0..) {
                let want = resolver.pixel([linear[0], linear[1], linear[2], 1.0], [i % 64, i / 64]);
                let near = (0..4).all(|c| picture[c].abs_diff(want[c]) <= 1);
                assert!(near, "{linear:?} became {picture:?}, not {want:?}");
                other += u32::from(*picture != want);
            }
            // Another dither, or one that is off by a pixel, would round a third of the pixels otherwise.
            assert!(other <= 4096 / 100, "{sets:?}: {other} pixels are rounded otherwise");
        }
    }
}

#[test]
fn tiles_do_not_change_a_single_bit_and_the_grid_no_more_than_rounding() {
    let Some(mut renderer) = renderer("tiles") else { return };
    let scene =
        scene("fig5", &["image.width=101", "image.height=67", "image.samples=2", "rocks.foot.levels=5"]);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let mesh = scene.mesh();
    let mut render = |tile_pixels, grid: Option<Grid>| {
        let grid = grid.unwrap_or_default();
        let options = RenderOptions { surface: true, tile_pixels, grid, ..Default::default() };
        renderer.render(&scene, &volume, &mesh, &options, &Unwatched).expect("a frame")
    };
    let whole = render(None, None);
    for tile in [64, 900, 5000] {
        let other = render(Some(tile), None);
        assert!(whole.radiance == other.radiance && whole.counts == other.counts, "tiles of {tile}");
        assert!(whole.picture == other.picture && whole.surface == other.surface, "tiles of {tile}");
    }
    for grid in [Grid { side: 4096, pixels: 101 * 7 }, Grid { side: 40, pixels: 40 * 32 }] {
        let other = render(None, Some(grid));
        // A corner of a rock may snap to the next 256th of a pixel, which changes a few pixels on edges.
        let tolerance = Tolerance { relative: 1e-4, absolute: 1e-5 };
        let d = Difference::new(101, &rgb(&whole), &rgb(&other), tolerance);
        eprintln!("{grid:?}: {d:?}, counts equal: {}", whole.counts == other.counts);
        assert!(d.share_outside() < 2e-3, "{grid:?}: {d:?}");
    }
}

#[test]
fn scenes_without_quads_are_drawn_by_both_engines() {
    let Some(mut renderer) = renderer("scenes without quads") else { return };
    let mut rocks = scene("waterfall", &[&COARSE_PLACE[..], &["image.width=96", "image.height=54"]].concat());
    rocks.edit().quads.clear();
    let mut nothing = rocks.clone();
    nothing.edit().rocks.clear();
    for (name, scene) in [("rocks", rocks), ("nothing", nothing)] {
        assert_parity(name, &both(&mut renderer, &scene));
    }
}

#[test]
fn walks_that_the_device_ends_early_are_refused_and_not_shown() {
    let Some(mut renderer) = renderer("long walks") else { return };
    // The light runs along the face from every cell of a ray: more than 262,000 cells per pixel, four per
    // loop turn.
    let long = ["lights.key.direction=[1,0,0]", "trace.max_cells=65536", "image.width=9", "image.height=9"];
    let render = |renderer: &mut GpuRenderer, more: &[&str]| {
        let scene = scene("front", &[&long[..], more].concat());
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        (renderer.render(&scene, &volume, &scene.mesh(), &SURFACE, &Unwatched), scene, volume)
    };
    let (frame, scene, volume) = render(&mut renderer, &["light.visibility=march"]);
    let right = cpu::render(&scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame");
    match frame {
        Ok(frame) => assert_eq!(frame.counts, right.counts, "a device that walks to the end"),
        Err(e) => {
            assert_eq!(e.exit_code(), 65);
            assert!(e.to_string().contains("light.visibility=cached"), "{e}");
        }
    }
    let (frame, scene, volume) = render(&mut renderer, &["light.visibility=cached"]);
    let right = cpu::render(&scene, &volume, &scene.mesh(), true, &Unwatched).expect("a frame");
    assert_parity("the same light, kept", &[frame.expect("a frame"), right]);
}

#[test]
fn parity_fails_when_sigma_or_a_quad_changes() {
    let Some(mut renderer) = renderer("harness") else { return };
    let base = ["image.width=64", "image.height=64"];
    let frame = |renderer: &mut GpuRenderer, more: &str| {
        let [gpu, _] = both(renderer, &scene("front", &[base[0], base[1], more]));
        gpu
    };
    let reference = frame(&mut renderer, "trace.sigma=10");
    // Where more is tolerated, only larger changes are seen.
    let changes = match Parity::of_adapter().is_coarse() {
        false => ["trace.sigma=10.2", "materials.water.thickness=1.02", "light.p=21", "volume.seed=2"],
        true => ["trace.sigma=13", "materials.water.thickness=1.3", "light.p=4", "volume.seed=2"],
    };
    for change in changes {
        let other = frame(&mut renderer, change);
        let failed = std::panic::catch_unwind(|| assert_parity(change, &[reference.clone(), other.clone()]));
        assert!(failed.is_err(), "{change} went unseen");
    }
}

#[test]
fn a_destroyed_device_is_an_error_and_the_engine_recovers_on_a_new_one() {
    let Some(renderer) = renderer("device lost") else { return };
    renderer.gpu.device.destroy();
    let scene = scene("front", &["image.width=32", "image.height=32"]);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let mesh = scene.mesh();
    let mut engine = taki::engine::Engine::gpu(renderer);
    if let taki::engine::Engine::Gpu { renderer, .. } = &mut engine {
        let lost = renderer.render(&scene, &volume, &mesh, &SURFACE, &Unwatched);
        assert!(matches!(lost, Err(Error::DeviceLost(_))), "{lost:?}");
    }
    let frame = engine
        .render_volume(&scene, &volume, &mesh, &SURFACE, &Unwatched)
        .expect("a frame on the new device");
    assert!(frame.covered_pixels() > 0);
}

#[test]
fn samples_rendered_in_parts_have_the_mean_of_the_whole() {
    let scene = scene("fig5", &["image.width=65", "image.height=63", "image.samples=4"]);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let mesh = scene.mesh();
    let mut engines = vec![taki::engine::Engine::cpu()];
    engines.extend(renderer("parts").map(taki::engine::Engine::gpu));
    for engine in &mut engines {
        let mut part = |samples| {
            let options = RenderOptions { samples, ..Default::default() };
            engine.render_volume(&scene, &volume, &mesh, &options, &Unwatched).expect("a frame")
        };
        let whole = part(None);
        let numbers = sample_numbers(&scene.image);
        let middle = numbers.start + 1;
        let parts = [part(Some(numbers.start..middle)), part(Some(middle..numbers.end))];
        for i in 0..whole.radiance.len() {
            let counts = [0, 1].map(|c| parts[0].counts[i][c] + parts[1].counts[i][c]);
            assert_eq!(whole.counts[i], counts, "pixel {i}");
            for c in 0..4 {
                let mean = (parts[0].radiance[i][c] + 3.0 * parts[1].radiance[i][c]) / 4.0;
                let want = whole.radiance[i][c];
                assert!((mean - want).abs() <= 1e-5 * want.abs() + 1e-6, "pixel {i}: {mean} for {want}");
            }
        }
        assert_ne!(parts[0].radiance, whole.radiance);
    }
}

#[test]
fn what_stays_on_the_device_is_never_stale() {
    let Some(mut kept) = renderer("resident") else { return };
    let size = ["image.width=64", "image.height=48"];
    // Each change differs from the one before in something that a renderer keeps: cells, α, mesh, size,
    // lights, exponent.
    let changes: [&[&str]; 8] = [
        &[],
        &["volume.seed=9"],
        &["volume.seed=9", "volume.alpha=0.4"],
        &["rocks.foot.seed=5"],
        &["image.width=32", "image.height=32"],
        &["light.p=7", "light.visibility=march"],
        &["camera.fov=30", "lights.sun.direction=[1, 0.2, 0.1]"],
        &[],
    ];
    for change in changes {
        let sets = [&size[..], &["rocks.foot.levels=4"], change].concat();
        let scene = scene("fig5", &sets);
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let mesh = scene.mesh();
        let frame = |renderer: &mut GpuRenderer| {
            renderer.render(&scene, &volume, &mesh, &SURFACE, &Unwatched).expect("a frame")
        };
        // Rendered twice: the second frame finds everything on the device.
        let [first, again] = [frame(&mut kept), frame(&mut kept)];
        let fresh = frame(&mut renderer("resident").expect("an adapter"));
        for (name, other) in [("first", &first), ("again", &again)] {
            assert!(fresh.radiance == other.radiance && fresh.picture == other.picture, "{change:?} {name}");
            assert!(fresh.surface == other.surface && fresh.counts == other.counts, "{change:?} {name}");
        }
    }
}

#[test]
fn kept_results_of_the_raster_pass_change_no_bit_and_are_never_stale() {
    let Some(mut keeping) = renderer("rasters") else { return };
    let Some(mut fresh) = renderer("rasters") else { return };
    let base = ["image.width=70", "image.height=50", "image.samples=2", "rocks.foot.levels=5"];
    let changes = [
        "volume.flow=0.25",
        "volume.flow=0.5",
        "volume.flow=0.75",
        "trace.tau=0.2",
        "image.exposure=1",
        "light.ambient=[0.5,0.1,0.1]",
        "lights.sun.intensity=3",
        "lights.sun.direction=[1,1,1]",
        "lights.sun.kind=point",
        "camera.eye=[0.5,-5,12.5]",
        "camera.up=[0.1,1,0]",
        "camera.fov=30",
        "camera.near=11.5",
        "background.zenith=[1,0,0]",
        "background.horizon=[0,1,0]",
        "materials.water.thickness=0.7",
        "rocks.wall.seed=4",
        "rocks.wall.color=[0.5,0.5,0.5]",
        "image.samples=3",
        "image.width=71",
        "quads.0.corners=[[-1.27,3.9,-0.0583],[-0.83,4.02,-0.0723],[-0.94,0.5,0.35],[-1.43,0.5,0.35]]",
    ];
    let options = RenderOptions { keep_rasters: 64 << 20, ..SURFACE };
    let mut spared = 0;
    let mut meshes: Vec<(taki::place::Ground, taki::place::Mesh)> = Vec::new();
    let volume = scene("fig5", &base).volume(1 << 30, &Unwatched).expect("a volume");
    // Each change is rendered three times: drawn, kept, and used again. Then the first scene is rendered
    // again.
    for change in changes.iter().flat_map(|c| [Some(c), Some(c), Some(c), None, None]) {
        let sets: Vec<&str> = base.iter().chain(change).copied().collect();
        let scene = scene("fig5", &sets);
        let ground = scene.ground();
        let mesh = match meshes.iter().find(|(known, _)| *known == ground) {
            Some((_, mesh)) => mesh.clone(),
            None => {
                meshes.push((ground, scene.mesh()));
                meshes[meshes.len() - 1].1.clone()
            }
        };
        let kept = keeping.render(&scene, &volume, &mesh, &options, &Unwatched).expect("a frame");
        let drawn = fresh.render(&scene, &volume, &mesh, &SURFACE, &Unwatched).expect("a frame");
        spared += u32::from(kept.seconds.gbuffer == 0.0);
        assert!(drawn.seconds.gbuffer > 0.0);
        assert!(kept.radiance == drawn.radiance && kept.counts == drawn.counts, "{change:?}");
        assert!(kept.picture == drawn.picture && kept.surface == drawn.surface, "{change:?}");
    }
    assert!(spared > 40, "only {spared} of 105 frames were spared the raster pass");
}
