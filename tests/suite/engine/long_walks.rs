//! Walks that the device ends early are finished by the CPU engine.

use std::sync::Mutex;

use crate::engine::gpu::{SURFACE, assert_parity, renderer, scene};
use taki::engine::{Engine, RenderOptions, cpu};
use taki::picture::Frame;
use taki::scene::Scene;
use taki::util::error::Result;
use taki::util::monitor::{Monitor, Unwatched};
use taki::util::window::Window;

/// Keeps the warnings.
#[derive(Default)]
pub struct Watch {
    pub warnings: Mutex<Vec<String>>,
}

impl Monitor for Watch {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        Ok(())
    }

    fn warn(&self, text: &str) {
        self.warnings.lock().unwrap().push(text.to_owned());
    }
}

/// `front` whose rays walk to the light, because light volumes have no budget.
fn walked(sets: &[&str]) -> Scene {
    let mut scene = scene("front", sets);
    scene.edit().light_cache = 0;
    scene
}

/// A scene whose light runs along the face: from every cell of a view ray it meets `cells` cells.
fn along_the_face(cells: u64) -> Scene {
    let max_cells = format!("trace.max_cells={cells}");
    walked(&[
        "lights.key.direction=[1,0,0]",
        "light.visibility=march",
        "image.width=9",
        "image.height=9",
        &max_cells,
    ])
}

/// Turns of the longest walk of a pixel, as the integrate pass counts them.
fn turns(scene: &Scene) -> u64 {
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let frame = cpu::render(scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame");
    frame.counts.iter().map(|[own, light]| u64::from(*own) + u64::from(*light) / 4).max().expect("pixels")
}

/// A device that ends long walks, as a chosen engine. `None`, with the reason, where there is none.
fn limited(test: &str) -> Option<Engine> {
    let renderer = renderer(test)?;
    if !renderer.gpu.limits_loops() {
        eprintln!("{test}: not run: {} ends no walks", renderer.gpu.name());
        return None;
    }
    Some(Engine::gpu(renderer))
}

/// As [`along_the_face`], with walks on both sides of the limit and more than one sample.
fn around_the_limit(sets: &[&str]) -> Scene {
    const SETS: [&str; 8] = [
        "lights.key.direction=[1,0,0]",
        "light.visibility=march",
        "image.width=37",
        "image.height=29",
        "image.samples=2",
        "volume.nz=24",
        "trace.max_cells=16384",
        "trace.tau=0.05",
    ];
    walked(&[&SETS, sets].concat())
}

/// Renders with the device alone. Returns the indices of the pixels that it left.
fn cut(engine: &mut Engine, scene: &Scene, options: &RenderOptions) -> (Frame, Vec<usize>) {
    let Engine::Gpu { renderer, .. } = engine else { panic!("a device") };
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    renderer.render_marked(scene, &volume, &scene.mesh(), options, &Unwatched).expect("a frame")
}

#[test]
fn the_cpu_finishes_the_pixels_that_a_chosen_device_leaves() {
    let Some(mut engine) = limited("finished pixels") else { return };
    for look in [[].as_slice(), &["image.bloom=0.1", "image.alpha=true", "trace.filter=pyramid"]] {
        let scene = around_the_limit(look);
        let (alone, left) = cut(&mut engine, &scene, &SURFACE);
        let all = alone.radiance.len();
        assert!(left.len() > all / 20 && left.len() < all - all / 20, "{} of {all}", left.len());
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let watch = Watch::default();
        let (mesh, watched) = (scene.mesh(), &watch);
        let frame = engine.render_volume(&scene, &volume, &mesh, &SURFACE, watched).expect("a frame");
        let on_cpu = cpu::render(&scene, &volume, &mesh, true, &Unwatched).expect("a frame");
        for &i in &left {
            assert_eq!((frame.radiance[i], frame.counts[i]), (on_cpu.radiance[i], on_cpu.counts[i]), "{i}");
            assert_eq!(frame.alpha.as_ref().map(|a| a[i]), on_cpu.alpha.as_ref().map(|a| a[i]), "{i}");
        }
        let others = (0..all).filter(|i| left.binary_search(i).is_err());
        others.for_each(|i| assert_eq!(frame.radiance[i], alone.radiance[i], "{i}"));
        for (a, b) in frame.picture.iter().zip(&on_cpu.picture) {
            // A colour counts as far as its alpha lets it be seen: a step of both in 255 × 255.
            let seen = |p: &[u8; 4], c: usize| u32::from(p[c]) * u32::from(p[3]);
            let near = |c: usize| seen(a, c).abs_diff(seen(b, c)) <= 2 * 255;
            assert!(a[3].abs_diff(b[3]) <= 1 && (0..3).all(near), "{look:?}: {a:?} for {b:?}");
        }
        assert_parity("finished pixels", &[frame, on_cpu]);
        let warnings = watch.warnings.into_inner().unwrap();
        match look.len() {
            0 => assert!(warnings.len() == 1 && warnings[0].contains(&format!("{} of {all}", left.len()))),
            // A second picture does not say it again.
            _ => assert!(warnings.is_empty(), "{warnings:?}"),
        }
    }
}

#[test]
fn crops_with_finished_pixels_equal_the_whole() {
    let Some(mut engine) = limited("finished crops") else { return };
    let scene = around_the_limit(&[]);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let mut render = |window| {
        let options = RenderOptions { window, ..SURFACE };
        engine.render_volume(&scene, &volume, &scene.mesh(), &options, &Unwatched).expect("a frame")
    };
    let whole = render(None);
    for window in [
        Window { x: 3, y: 5, width: 13, height: 11 },
        Window { x: 12, y: 0, width: 25, height: 29 },
        Window { x: 0, y: 17, width: 37, height: 4 },
    ] {
        let crop = render(Some(window));
        for y in 0..window.height {
            let row = |x: u32, y: u32, width: u32| (y * width + x) as usize;
            let (a, b) = (row(0, y, window.width), row(window.x, window.y + y, 37));
            let n = window.width as usize;
            assert!(crop.radiance[a..a + n] == whole.radiance[b..b + n], "{window}, row {y}");
            assert!(crop.counts[a..a + n] == whole.counts[b..b + n], "{window}, row {y}");
            assert!(crop.picture[a..a + n] == whole.picture[b..b + n], "{window}, row {y}");
        }
    }
}

#[test]
fn the_limit_is_the_devices_own() {
    let Some(mut engine) = limited("turns") else { return };
    const MOST: f64 = 65535.0;
    let per_cell = turns(&along_the_face(1000)) as f64 / 1000.0;
    for (share, fits) in [(0.95, true), (1.1, false)] {
        let scene = along_the_face((MOST * share / per_cell) as u64);
        let count = turns(&scene) as f64 / MOST;
        assert!((count - share).abs() < 0.03, "{count} for {share}");
        let (_, left) = cut(&mut engine, &scene, &RenderOptions::default());
        assert_eq!(left.is_empty(), fits, "{share}: {left:?}");
    }
}
