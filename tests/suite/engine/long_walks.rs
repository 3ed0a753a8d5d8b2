//! Walks that the device would end early are refused before the work, or rendered by the CPU engine.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::engine::gpu::{renderer, scene};
use taki::engine::gpu::DeviceOptions;
use taki::engine::{Engine, EngineChoice, RenderOptions, cpu};
use taki::picture::Frame;
use taki::scene::Scene;
use taki::util::error::{Error, Result};
use taki::util::monitor::{Monitor, Unwatched};

/// Keeps the warnings, and whether there was any work.
#[derive(Default)]
struct Watch {
    warnings: Mutex<Vec<String>>,
    worked: AtomicBool,
}

impl Monitor for Watch {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        self.worked.store(true, Ordering::Relaxed);
        Ok(())
    }

    fn warn(&self, text: &str) {
        self.warnings.lock().unwrap().push(text.to_owned());
    }
}

/// A scene whose light runs along the face: from every cell of a view ray it meets `cells` cells.
fn along_the_face(cells: u64) -> Scene {
    let max_cells = format!("trace.max_cells={cells}");
    scene(
        "front",
        &[
            "lights.key.direction=[1,0,0]",
            "light.visibility=march",
            "image.width=9",
            "image.height=9",
            &max_cells,
        ],
    )
}

fn render(engine: &mut Engine, scene: &Scene, watch: &Watch) -> Result<Frame> {
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    engine.render_volume(scene, &volume, &scene.mesh(), &RenderOptions::default(), watch)
}

/// Turns of the longest walk of a pixel, as the integrate pass counts them.
fn turns(scene: &Scene) -> u64 {
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let frame = cpu::render(scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame");
    frame.counts.iter().map(|[own, light]| u64::from(*own) + u64::from(*light) / 4).max().expect("pixels")
}

#[test]
fn a_chosen_device_refuses_long_walks_before_the_work() {
    let Some(renderer) = renderer("long walks") else { return };
    if !renderer.gpu.is_software() {
        return;
    }
    let mut engine = Engine::gpu(renderer);
    let watch = Watch::default();
    let refused = render(&mut engine, &along_the_face(65536), &watch).expect_err("too long");
    assert!(matches!(refused, Error::Device { .. }), "{refused:?}");
    assert_eq!(refused.exit_code(), 65);
    assert!(refused.to_string().contains("--engine cpu"), "{refused}");
    assert!(!watch.worked.load(Ordering::Relaxed), "the device worked before it refused");
}

#[test]
fn the_cpu_renders_what_an_automatic_engine_cannot_and_says_so() {
    let (mut engine, _) = Engine::open(EngineChoice::Auto, &DeviceOptions::default()).expect("an engine");
    let scene = along_the_face(65536);
    let watch = Watch::default();
    let software = matches!(&engine, Engine::Gpu { renderer, .. } if renderer.gpu.is_software());
    let frame = render(&mut engine, &scene, &watch).expect("a frame");
    let warnings = watch.warnings.into_inner().unwrap();
    if software {
        assert_eq!(engine.word(), "cpu");
        let on_cpu = render(&mut Engine::cpu(), &scene, &Watch::default()).expect("a frame");
        assert!(frame.radiance == on_cpu.radiance && frame.counts == on_cpu.counts);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].ends_with("the CPU engine takes over"), "{warnings:?}");
    } else {
        assert!(warnings.is_empty(), "{warnings:?}");
    }
}

#[test]
fn the_limit_is_the_devices_own() {
    let Some(mut renderer) = renderer("turns") else { return };
    if !renderer.gpu.is_software() {
        return;
    }
    const MOST: f64 = 65535.0;
    let per_cell = turns(&along_the_face(1000)) as f64 / 1000.0;
    for (share, fits) in [(0.95, true), (1.1, false)] {
        let scene = along_the_face((MOST * share / per_cell) as u64);
        let count = turns(&scene) as f64 / MOST;
        assert!((count - share).abs() < 0.03, "{count} for {share}");
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let frame = renderer.render(&scene, &volume, &scene.mesh(), &RenderOptions::default(), &Unwatched);
        assert_eq!(frame.is_ok(), fits, "{share}: {:?}", frame.err());
        let checked = render(&mut Engine::gpu(renderer), &scene, &Watch::default());
        assert_eq!(checked.is_ok(), fits, "{share}: {:?}", checked.err());
        renderer = crate::engine::gpu::renderer("turns").expect("as before");
    }
}
