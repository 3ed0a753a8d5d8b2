//! What stays valid is kept: samples that were taken are not taken again.

use super::*;
use taki::engine::cpu;
use taki::picture::{Frame, Layer};
use taki::util::monitor::Unwatched;

/// Samples of full-size pictures that the render thread has taken.
fn taken(window: &Window) -> u64 {
    window.viewer().worker().state().samples_taken
}

/// A window whose picture has 8 samples.
fn refined() -> Window {
    let window =
        Setup { settings: r#"{"refine_to": 8, "parameters": false}"#.into(), ..Setup::bare() }.open();
    assert_eq!(window.picture().samples, 8);
    assert_eq!(taken(&window), 9, "the centres and the samples of the picture");
    window
}

/// The picture in the window, rendered by the library.
fn rendered(window: &Window, samples: u32, surface: bool) -> Frame {
    let mut scene = (**window.viewer().document().scene()).clone();
    let frame = &window.picture().frame;
    let image = &mut scene.edit().image;
    (image.width, image.height, image.samples) = (frame.width, frame.height, samples);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    cpu::render(&scene, &volume, &scene.mesh(), surface, &Unwatched).expect("a frame")
}

/// Changes the window and returns how many samples that took, once the picture is complete.
fn cost(window: &mut Window, change: impl FnOnce(&mut Window)) -> u64 {
    let before = taken(window);
    change(window);
    window.settle();
    taken(window) - before
}

#[test]
fn layers_need_no_new_samples_and_are_those_of_a_render() {
    let mut window = refined();
    let first = window.picture().frame.radiance.clone();
    let keys = [Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num1];
    for key in keys {
        assert_eq!(cost(&mut window, |window| window.key(key)), 0, "{key:?}");
        assert_eq!(window.picture().samples, 8);
        assert!(window.picture().frame.radiance == first, "{key:?}");
    }
    let want = rendered(&window, 8, true);
    assert!(window.picture().frame.surface == want.surface && want.surface.is_some());
    assert_eq!(window.picture().layer, Layer::Rgb);
}

#[test]
fn layers_of_the_gpu_engine_need_no_new_samples_either() {
    if crate::engine::gpu::renderer("layers of the viewer").is_none() {
        return;
    }
    let settings = r#"{"refine_to": 4, "parameters": false}"#.into();
    let mut window = Setup { engine: EngineChoice::Gpu, settings, ..Setup::bare() }.open();
    let first = window.picture().frame.clone();
    assert_eq!(cost(&mut window, |window| window.key(Key::Num2)), 0);
    let shown = &window.picture().frame;
    assert!(shown.radiance == first.radiance && shown.counts == first.counts && first.surface.is_none());
    let depth = |frame: &Frame| frame.surface.as_ref().expect("layers").depth.clone();
    let (got, want) = (depth(shown), depth(&rendered(&window, 4, true)));
    let apart = got.iter().zip(&want).filter(|(a, b)| (**a - **b).abs() > 1e-3 * b.abs()).count();
    assert!(apart * 100 <= want.len(), "{apart} of {} depths differ", want.len());
}

#[test]
fn development_values_of_the_animation_and_a_new_name_need_no_new_samples() {
    let mut window = refined();
    let changes = [
        ("image.exposure", Raw::Float(2.0)),
        ("image.tone", Raw::Text("agx".into())),
        ("image.bloom", Raw::Float(0.3)),
        ("image.temperature", Raw::Float(4000.0)),
        ("image.auto_exposure", Raw::Text("highlights".into())),
        ("animate.frames", Raw::Int(12)),
    ];
    for (key, raw) in changes {
        assert_eq!(cost(&mut window, |window| window.set(key, raw)), 0, "{key}");
    }
    let other = window.path("other.toml");
    let saved = cost(&mut window, |window| {
        window.harness.state_mut().document_mut().save(&other).expect("saved");
    });
    assert_eq!(saved, 0, "saved under another name");
    assert!(window.picture().frame.radiance == rendered(&window, 8, false).radiance);
}

#[test]
fn a_picture_that_comes_back_has_its_samples() {
    let mut window = refined();
    let first = window.picture().frame.radiance.clone();
    let changes = [
        ("trace.sigma", Raw::Float(9.0)),
        ("camera.fov", Raw::Float(30.0)),
        ("volume.flow", Raw::Float(0.4)),
    ];
    for (key, raw) in changes {
        assert_eq!(cost(&mut window, |window| window.set(key, raw)), 9, "{key}");
        let changed = window.picture().frame.radiance.clone();
        assert!(changed != first, "{key}");
        assert_eq!(cost(&mut window, Window::undo), 0, "{key} is undone");
        assert!(window.picture().frame.radiance == first && window.picture().samples == 8);
        assert_eq!(cost(&mut window, Window::redo), 0, "{key} is redone");
        assert!(window.picture().frame.radiance == changed && window.picture().samples == 8);
        window.undo();
        window.settle();
    }
    assert_eq!(cost(&mut window, |window| window.key(Key::V)), 9, "the inspectors make the picture smaller");
    assert_eq!(cost(&mut window, |window| window.key(Key::V)), 0, "without them it is as large as before");
    assert!(window.picture().frame.radiance == first);
}

#[test]
fn more_samples_continue_fewer_and_fewer_are_kept() {
    let mut window = refined();
    let first = window.picture().frame.radiance.clone();
    let samples = |n: i64| move |window: &mut Window| window.set("image.samples", Raw::Int(n));
    assert_eq!(cost(&mut window, samples(12)), 4, "12 samples continue 8");
    assert_eq!(cost(&mut window, samples(13)), 13, "an odd number has other samples");
    assert_eq!(cost(&mut window, samples(15)), 2, "15 samples continue 13");
    assert!(window.picture().frame.radiance == rendered(&window, 15, false).radiance);
    assert_eq!(cost(&mut window, samples(12)), 0, "12 samples are kept");
    assert!(window.picture().frame.radiance == rendered(&window, 12, false).radiance);
    assert_eq!(cost(&mut window, samples(8)), 9, "a mean of 12 samples holds none of 8");
    assert!(window.picture().frame.radiance == first);
    assert_eq!(cost(&mut window, samples(12)), 0, "12 samples are still kept");
}

#[test]
fn an_interruption_keeps_the_samples_that_are_finished() {
    let mut window = Setup { size: [900.0, 500.0], ..Setup::bare() }.open();
    let before = taken(&window);
    window.set("image.samples", Raw::Int(96));
    let mut seen = Vec::new();
    for step in 1..=6u32 {
        let from = taken(&window);
        seen.push(from - before);
        window.until("a sample", |viewer| viewer.worker().state().samples_taken > from);
        window.set("image.exposure", Raw::Float(0.1 * f64::from(step)));
        window.harness.step();
    }
    assert!(taken(&window) < before + 96, "the changes came while samples were taken");
    let is_alone = |n: &u64| !n.is_power_of_two() && *n > 0;
    assert!(seen.iter().any(is_alone), "each sample is kept, not only whole steps: {seen:?}");
    window.settle();
    assert_eq!(window.picture().samples, 96);
    assert_eq!(taken(&window) - before, 96, "no sample was taken twice");
    let want = rendered(&window, 96, false);
    assert!(window.picture().frame.radiance == want.radiance && window.picture().frame.counts == want.counts);
}

#[test]
fn an_export_comes_between_two_samples_and_the_picture_is_completed_after_it() {
    let mut window = Setup { size: [900.0, 500.0], ..Setup::bare() }.open();
    let before = taken(&window);
    window.set("image.samples", Raw::Int(96));
    window.until("a sample", |viewer| viewer.worker().state().samples_taken > before + 2);
    let mut scene = (**window.viewer().document().scene()).clone();
    scene.edit().image.samples = 1;
    let export = taki::viewer::worker::Export {
        scene,
        paths: vec![window.path("x.png")],
        overwrite: false,
        depth: Default::default(),
    };
    window.viewer().worker().export(export);
    window.until("the export", |viewer| viewer.worker().state().exports_done == 1);
    assert!(taken(&window) < before + 96, "the export does not wait for all samples");
    window.settle();
    assert_eq!((window.picture().samples, taken(&window) - before), (96, 96));
}

#[test]
fn an_export_right_after_a_change_leaves_no_rough_picture() {
    let mut window = refined();
    let serial = window.picture().serial;
    window.set("trace.sigma", Raw::Float(9.0));
    window.until("the preview", |viewer| viewer.picture().is_some_and(|picture| picture.serial > serial));
    let scene = (**window.viewer().document().scene()).clone();
    let paths = vec![window.path("x.png")];
    let export = taki::viewer::worker::Export { scene, paths, overwrite: false, depth: Default::default() };
    window.viewer().worker().export(export);
    window.until("the export", |viewer| viewer.worker().state().exports_done == 1);
    window.settle();
    assert_eq!((window.picture().scale, window.picture().samples), (1, 8));
}

#[test]
fn a_picture_with_alpha_is_not_the_opaque_one() {
    let mut window = refined();
    let opaque = window.picture().frame.picture.clone();
    window.set("image.alpha", Raw::Switch(true));
    window.settle();
    let want = rendered(&window, 8, false);
    let frame = &window.picture().frame;
    assert!(frame.radiance == want.radiance && frame.alpha.is_some());
    assert!(frame.picture != opaque);
    window.undo();
    window.settle();
    assert!(window.picture().frame.alpha.is_none() && window.picture().frame.picture == opaque);
}
