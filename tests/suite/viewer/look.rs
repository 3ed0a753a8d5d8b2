//! Appearance of the window.

use super::*;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use taki::output::frame::{Difference, Tolerance};

#[test]
fn every_sign_the_viewer_uses_is_in_the_fonts_it_brings() {
    let context = egui::Context::default();
    let mut missing = Vec::new();
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    let mut folders = ["viewer", "scene/param"].map(|folder| sources.join(folder)).to_vec();
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(folder).expect("sources");
        let (inner, found): (Vec<PathBuf>, Vec<PathBuf>) =
            entries.map(|e| e.expect("an entry").path()).partition(|path| path.is_dir());
        folders.extend(inner);
        files.extend(found);
    }
    assert!(files.len() > 20, "{files:?}");
    files.extend(["engine/mod.rs", "util/error.rs"].map(|file| sources.join(file)));
    let _ = context.run_ui(egui::RawInput::default(), |ui| {
        for file in &files {
            let text = std::fs::read_to_string(file).expect("text");
            let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
            for sign in code.flat_map(str::chars).filter(|c| !c.is_ascii()) {
                let font = egui::FontId::proportional(13.0);
                if !ui.ctx().fonts_mut(|fonts| fonts.has_glyph(&font, sign)) {
                    missing.push((file.file_name().expect("a name").to_owned(), sign));
                }
            }
        }
    });
    assert!(missing.is_empty(), "a system without fonts shows boxes for {missing:?}");
}

#[test]
fn the_picture_has_the_same_place_while_the_renderer_works_and_at_rest() {
    for width in (8..=20).map(|n| n as f32 * 75.0) {
        let mut window = Setup { size: [width, 240.0], ..Setup::bare() }.open();
        let rest = window.image_rect();
        window.set("curves.h", Raw::Float(0.3));
        let mut works = false;
        for _ in 0..20 {
            window.harness.step();
            works |= !window.viewer().is_settled();
            assert_eq!(window.image_rect(), rest, "{width} wide");
        }
        assert!(works, "it was seen at work");
        window.settle();
        assert_eq!(window.image_rect(), rest, "{width} wide");
    }
}

/// Size of a window so small that its snapshot stays under 64 KiB.
const SIZE: [f32; 2] = [860.0, 520.0];
const MAX_SNAPSHOT_BYTES: u64 = 64 << 10;

/// Compares the window with its snapshot. Other tests check the picture itself; the snapshot shows only some
/// of it, to check that it is there.
fn snapshot(theme: egui::Theme, name: &str, prepare: impl FnOnce(&mut Window)) {
    if crate::engine::gpu::renderer(name).is_none() {
        return;
    }
    let word = if theme == egui::Theme::Dark { "dark" } else { "light" };
    let settings = format!(r#"{{"refine_to": 1, "theme": "{word}"}}"#);
    let setup = Setup { settings, size: SIZE, ..Setup::default() };
    let mut window = setup.open_with(|builder| builder.wgpu().with_render_cursor(false).with_theme(theme));
    prepare(&mut window);
    window.settle();
    window.harness.run_steps(3);
    if let Some(folder) = std::env::var_os("TAKI_LOOK") {
        let whole = window.harness.render().expect("an adapter to draw with");
        whole.save(Path::new(&folder).join(format!("{name}.png"))).expect("saved");
    }
    // Times and memory differ in every run.
    let status = Rect::from_min_max(pos2(0.0, SIZE[1] - 26.0), pos2(SIZE[0], SIZE[1]));
    window.harness.mask(status);
    let image = window.harness.render().expect("an adapter to draw with");
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots").join(format!("{name}.png"));
    if std::env::var_os("TAKI_BLESS").is_some() {
        let file = std::fs::File::create(&place).expect("a file");
        let (kind, filter) = (CompressionType::Best, FilterType::Adaptive);
        image.write_with_encoder(PngEncoder::new_with_quality(file, kind, filter)).expect("written");
    }
    assert!(
        std::fs::metadata(&place).expect("a snapshot").len() <= MAX_SNAPSHOT_BYTES,
        "{name} is too large"
    );
    let (width, height, golden) = taki::output::frame::read_png(&place).expect("a snapshot");
    assert_eq!((width, height), image.dimensions());
    let shown: Vec<[f32; 3]> =
        image.pixels().map(|p| [p.0[0], p.0[1], p.0[2]].map(|x| f32::from(x) / 255.0)).collect();
    assert!(is_alike(width, &shown, &golden), "{name}: TAKI_BLESS=1 tests/run viewer::look writes it anew");
}

#[test]
fn the_dark_window_looks_as_it_did_when_last_looked_at() {
    snapshot(egui::Theme::Dark, "viewer_dark", |window| {
        window.set("curves.h", Raw::Float(0.9));
        window.key(Key::Num4);
    });
}

#[test]
fn the_light_window_looks_as_it_did_when_last_looked_at() {
    snapshot(egui::Theme::Light, "viewer_light", |window| {
        window.key(Key::Num3);
        window.settle();
        let eye = window.point("camera.target").to_array().map(Raw::Float);
        window.set("camera.eye", Raw::List(eye.into()));
    });
}

#[test]
fn the_snapshot_of_one_theme_is_not_that_of_the_other() {
    let place = |name| Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots").join(name);
    let [dark, light] =
        ["viewer_dark.png", "viewer_light.png"].map(|name| taki::output::frame::read_png(&place(name)));
    let ((width, _, dark), (_, _, light)) = (dark.expect("a snapshot"), light.expect("a snapshot"));
    assert!(!is_alike(width, &dark, &light));
}

fn is_alike(width: u32, a: &[[f32; 3]], b: &[[f32; 3]]) -> bool {
    // Another driver may draw text a step of grey differently. A moved widget changes hundreds of pixels.
    let tolerance = Tolerance { relative: 0.0, absolute: 6.5 / 255.0 };
    Difference::new(width, a, b, tolerance).share_outside() <= 0.002
}

/// `TAKI_LOOK=FOLDER cargo test --release -- look` writes pictures of the window to that folder.
#[test]
fn pictures_of_the_window_on_demand() {
    let Some(folder) = std::env::var_os("TAKI_LOOK").map(PathBuf::from) else { return };
    for (theme, size) in [
        ("dark", [1660.0, 900.0]),
        ("light", [1660.0, 900.0]),
        ("dark", [480.0, 320.0]),
        ("light", [900.0, 560.0]),
    ] {
        let settings = format!(r#"{{"refine_to": 4, "theme": "{theme}", "inspectors": true}}"#);
        let setup = Setup { settings, size, ..Setup::default() };
        let look = if theme == "dark" { egui::Theme::Dark } else { egui::Theme::Light };
        let mut window = setup.open_with(|builder| builder.wgpu().with_render_cursor(false).with_theme(look));
        let save = |window: &mut Window, what: &str| {
            window.settle();
            window.harness.run_steps(4);
            let image = window.harness.render().expect("an adapter");
            let name = format!("window_{theme}_{}_{what}.png", size[0]);
            image.save(folder.join(name)).expect("saved");
        };
        let centre = window.image_rect().center();
        window.press_at(centre, Modifiers::NONE);
        window.release_at(centre, Modifiers::NONE);
        window.settle();
        window.set("curves.h", Raw::Float(1.2));
        window.set("lights.sun.color", Raw::List([3.0, 1.0, 0.5].map(Raw::Float).into()));
        save(&mut window, "pixel");
        window.key(Key::V);
        window.key(Key::F1);
        save(&mut window, "help");
        window.key(Key::F1);
        window.chord(Modifiers::COMMAND, Key::E);
        save(&mut window, "export");
        window.key(Key::G);
        std::thread::sleep(Duration::from_secs(6));
        save(&mut window, "gallery");
        window.key(Key::G);
        window.chord(Modifiers::COMMAND | Modifiers::SHIFT, Key::S);
        save(&mut window, "save");
        window.press("Cancel");
        window.harness.state_mut().open(Path::new("front"));
        save(&mut window, "unsaved");
        window.press("Go back");
        window.enter("Search parameters", "corners light");
        window.set("volume.nx", Raw::Int(1_000_000));
        save(&mut window, "fault");
    }
}
