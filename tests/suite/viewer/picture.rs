//! Layers, pixels, faults, lost devices, and windows of any size.

use super::*;
use rand::{RngExt, SeedableRng};
use taki::engine::cpu;
use taki::picture::Layer;
use taki::trace::Attenuation;
use taki::util::monitor::Unwatched;
use taki::viewer::layer_image::Legend;

const NUMBERS: [Key; 7] = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7];

#[test]
fn each_layer_is_shown_by_its_number_and_by_its_name_with_a_legend() {
    let mut window = Setup { size: [900.0, 300.0], ..Setup::bare() }.open();
    for by_key in [true, false] {
        for (key, layer) in NUMBERS.into_iter().zip(Layer::ALL) {
            match by_key {
                true => window.key(key),
                false => window.choose("Layer", layer.name()),
            }
            window.settle();
            let picture = window.picture();
            assert_eq!(picture.layer, layer);
            let explained = !matches!(picture.legend, Legend::None);
            assert_eq!(explained, layer != Layer::Rgb, "{}", layer.name());
            let mut labels = window.harness.query_all_by_role_and_label(Role::Label, layer.name());
            assert_eq!(labels.next().is_some(), explained, "the legend of {}", layer.name());
        }
    }
}

#[test]
fn a_layer_is_the_layer_of_a_render() {
    let mut window = Setup::bare().open();
    window.key(Key::Num2);
    window.settle();
    let mut scene = (**window.viewer().document().scene()).clone();
    let frame = &window.picture().frame;
    [scene.edit().image.width, scene.edit().image.height] = [frame.width, frame.height];
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let want = cpu::render(&scene, &volume, &scene.mesh(), true, &Unwatched).expect("a frame");
    assert!(frame.surface == want.surface && frame.surface.is_some());
}

/// Whether a banner shows all of these words.
fn banner(window: &Window, words: &[&str]) -> bool {
    words.iter().all(|word| window.reads(word))
}

#[test]
fn a_scene_that_is_not_valid_is_told_and_undone_and_the_picture_stays() {
    let mut window = Setup { size: [700.0, 400.0], ..Setup::bare() }.open();
    let first = window.picture().serial;
    let eye = window.value("camera.eye");
    let target = window.point("camera.target").to_array().map(Raw::Float);
    window.set("camera.eye", Raw::List(target.into()));
    window.settle();
    let fault = window.viewer().document().fault().expect("a fault").to_string();
    assert!(fault.contains("camera"), "{fault}");
    assert!(banner(&window, &[&fault]), "{fault}");
    assert_eq!(window.picture().serial, first, "the old picture stays");
    window.press("Undo");
    window.settle();
    assert!(window.viewer().document().fault().is_none() && !banner(&window, &[&fault]));
    assert_eq!(window.value("camera.eye"), eye);
}

#[test]
fn a_volume_beyond_the_memory_budget_is_refused_and_undone() {
    let mut window = Setup { size: [700.0, 400.0], ..Setup::bare() }.open();
    let first = window.picture().frame.radiance.clone();
    // In sparse storage the volume would fit.
    window.set("volume.storage", Raw::Text("dense".into()));
    window.settle();
    for key in ["volume.nx", "volume.ny"] {
        window.set(key, Raw::Int(1_000_000));
        window.settle();
    }
    assert!(window.reads("budget") || window.reads("memory"), "why it is refused");
    assert!(window.picture().frame.radiance == first, "the old picture stays");
    for _ in ["volume.ny", "volume.nx"] {
        window.press("Undo");
        window.settle();
    }
    assert!(!window.reads("budget") && window.picture().frame.radiance == first);
    window.undo();
    assert!(!window.viewer().document().is_changed());
}

#[test]
fn without_the_adapter_that_was_asked_for_the_cpu_renders_and_the_window_says_so() {
    let device = DeviceOptions { adapter: Some("no such adapter".into()), ..DeviceOptions::default() };
    let setup = Setup { engine: EngineChoice::Auto, device, size: [700.0, 400.0], ..Setup::bare() };
    let window = setup.open();
    assert!(window.viewer().worker().state().engine.contains("cpu"));
    assert!(banner(&window, &["no such adapter"]));
    assert_eq!(window.picture().scale, 1);
}

#[test]
fn a_lost_device_is_replaced_and_after_four_in_a_minute_the_cpu_takes_over() {
    if crate::engine::gpu::renderer("lost devices of the viewer").is_none() {
        return;
    }
    let setup = Setup { engine: EngineChoice::Gpu, size: [700.0, 400.0], ..Setup::bare() };
    let mut window = setup.open();
    for loss in 1..=4 {
        window.viewer().worker().lose_device();
        let before = window.viewer().document().values().clone();
        let sigma = 3.0 + f64::from(loss);
        window.set("trace.sigma", Raw::Float(sigma));
        window.settle();
        assert_eq!(window.viewer().worker().state().devices_lost, loss as usize);
        assert!(window.viewer().worker().state().fault.is_none());
        let picture = window.picture();
        let shown = picture.scene.trace.attenuation;
        assert_eq!(shown, Attenuation::PathLength { sigma: sigma as f32 }, "a picture of the new value");
        assert_eq!(picture.scale, 1);
        let mut want = before;
        want.set("trace.sigma", &Raw::Float(sigma), &taki::scene::Place("test".into())).expect("a value");
        assert!(*window.viewer().document().values() == want, "the document is not touched");
        let engine = window.viewer().worker().state().engine.clone();
        assert_eq!(engine.contains("cpu"), loss == 4, "loss {loss}: {engine}");
        assert!(window.reads(if loss == 4 { "CPU engine takes over" } else { "device was lost" }));
    }
    window.viewer().worker().lose_device();
    window.set("trace.sigma", Raw::Float(1.0));
    window.settle();
    assert_eq!(window.viewer().worker().state().devices_lost, 4, "the CPU engine has no device to lose");
}

#[test]
fn a_lost_device_during_an_export_is_replaced_too() {
    if crate::engine::gpu::renderer("a lost device under an export").is_none() {
        return;
    }
    let mut window = Setup { engine: EngineChoice::Gpu, ..Setup::bare() }.open();
    let file = window.path("x.png");
    let scene = (**window.viewer().document().scene()).clone();
    window.viewer().worker().lose_device();
    window.viewer().worker().export(taki::viewer::worker::Export {
        scene,
        paths: vec![file.clone()],
        overwrite: false,
        depth: Default::default(),
    });
    window.until("the export", |viewer| viewer.worker().state().exports_done == 1);
    let (width, height, _) = taki::output::frame::read_png(&file).expect("a picture");
    assert_eq!((width, height), (160, 90));
}

#[test]
fn a_window_of_any_size_and_scale_ends_with_a_picture_of_its_size() {
    let mut window = Setup { size: [620.0, 420.0], ..Setup::default() }.open();
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(1);
    let odd = [[0.0, 0.0], [1.0, 1.0], [3000.0, 20.0], [20.0, 3000.0], [341.0, 200.0], [0.0, 500.0]];
    for i in 0..60 {
        let size = match odd.get(i / 2) {
            Some(size) if i % 2 == 0 => *size,
            _ => [rng.random_range(0.0..900.0), rng.random_range(0.0..700.0)],
        };
        window.harness.set_size(size.into());
        if i % 7 == 0 {
            window.harness.set_pixels_per_point([0.5, 1.0, 1.5, 2.0, 3.0][i / 7 % 5]);
        }
        window.harness.run_steps(2);
    }
    for scale in [1.0, 2.0, 1.25] {
        window.harness.set_pixels_per_point(scale);
        window.harness.run_steps(2);
        window.harness.set_size([620.0, 420.0].into());
        window.harness.run_steps(2);
        window.settle();
        let rect = window.image_rect();
        let frame = &window.picture().frame;
        let off = [frame.width as f32 - rect.width() * scale, frame.height as f32 - rect.height() * scale];
        assert!(
            off.iter().all(|d| d.abs() <= scale),
            "{}×{} in {rect}, scale {scale}",
            frame.width,
            frame.height
        );
        assert_eq!(window.picture().scale, 1);
    }
}

#[test]
fn panels_windows_and_inspectors_open_without_a_nameless_widget() {
    let mut window = Setup { size: [1100.0, 700.0], ..Setup::default() }.open();
    let named = |window: &Window, what: &str| {
        assert_eq!(window.harness.unnamed_widgets(), Vec::<String>::new(), "{what}");
    };
    for inspector in ["Volume", "Curves", "Pixel"] {
        if !window.reads("Curves") || window.harness.query_by_role_and_label(Role::Button, "Pixel").is_none()
        {
            window.key(Key::V);
        }
        window.press(inspector);
        named(&window, inspector);
    }
    window.key(Key::V);
    window.key(Key::F1);
    assert!(window.reads("Keys and mouse"));
    named(&window, "help");
    window.key(Key::F1);
    window.chord(Modifiers::COMMAND, Key::E);
    named(&window, "export");
    window.chord(Modifiers::COMMAND, Key::O);
    named(&window, "open");
    window.key(Key::Escape);
    for menu in ["File", "Edit", "View"] {
        window.press(menu);
        named(&window, menu);
        window.key(Key::Escape);
    }
    window.key(Key::Tab);
    named(&window, "no parameters");
}

#[test]
fn the_gallery_shows_every_preset_and_opens_it() {
    let mut window = Setup { size: [700.0, 500.0], ..Setup::bare() }.open();
    window.key(Key::G);
    for (preset, what) in taki::scene::presets() {
        window.widget(Role::Button, &format!("Open {preset}"));
        assert!(window.reads(what), "{preset}");
    }
    window.press("Open front");
    window.settle();
    assert_eq!(window.viewer().document().name, "front");
    assert!(window.harness.query_by_label("Open front").is_none(), "the gallery closes");
}

#[test]
fn a_click_shows_the_ray_of_its_pixel_and_a_drag_of_the_inspector_follows() {
    let mut window = Setup { size: [900.0, 400.0], ..Setup::bare() }.open();
    assert!(window.viewer().ray().is_none());
    window.key(Key::I);
    let centre = window.image_rect().center();
    window.drag(centre - egui::vec2(20.0, 0.0), egui::vec2(20.0, 0.0), Modifiers::NONE);
    window.settle();
    // The inspector takes some of the picture's room, but the place stays at the same point of the scene.
    let ray = window.viewer().ray().expect("a ray");
    let picture = window.picture();
    let i = (ray.pixel[1] * picture.frame.width + ray.pixel[0]) as usize;
    let want = picture.frame.radiance[i];
    assert_eq!([ray.radiance.x, ray.radiance.y, ray.radiance.z, ray.transmittance], want);
    assert_eq!(ray.cells, picture.frame.counts[i]);
    assert!(!ray.steps.is_empty(), "the water is in the middle");
    let centre = window.image_rect().center();
    window.press_at(centre, Modifiers::NONE);
    window.release_at(centre, Modifiers::NONE);
    window.settle();
    let at = window.viewer().ray().expect("a ray").pixel;
    let frame = &window.picture().frame;
    let middle = [frame.width / 2, frame.height / 2];
    assert!(at.iter().zip(middle).all(|(a, b)| a.abs_diff(b) <= 1), "{at:?} is the middle, {middle:?}");
    let before = window.viewer().ray().cloned();
    window.set("trace.sigma", Raw::Float(9.0));
    window.settle();
    assert_ne!(window.viewer().ray().cloned(), before, "the ray follows the values");
}

#[test]
fn a_double_click_brings_what_is_under_the_pointer_to_the_middle() {
    let setup = Setup { size: [500.0, 300.0], ..Setup::bare() };
    let mut window = setup.open_with(|builder| builder.with_step_dt(0.02));
    let rect = window.image_rect();
    let at = rect.center() + egui::vec2(0.0, rect.height() * 0.2);
    let before = window.point("camera.target");
    for _ in 0..2 {
        window.press_at(at, Modifiers::NONE);
        window.harness.event(egui::Event::PointerButton {
            pos: at,
            button: egui::PointerButton::Primary,
            pressed: false,
            modifiers: Modifiers::NONE,
        });
    }
    window.harness.run_steps(2);
    window.until("the focus", |viewer| viewer.document().values().point("camera.target") != before);
    assert!(window.point("camera.target").y < before.y - 0.3, "the part below is now in the middle");
    window.undo();
    assert_eq!(window.point("camera.target"), before);
}
