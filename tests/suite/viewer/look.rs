//! How the window looks.

use super::*;

#[test]
fn every_sign_the_viewer_uses_is_in_the_fonts_it_brings() {
    let context = egui::Context::default();
    let mut missing = Vec::new();
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let viewer = std::fs::read_dir(sources.join("viewer"))
        .expect("sources")
        .map(|e| e.expect("a file").path())
        .filter(|path| path.is_file());
    let mut files: Vec<PathBuf> = viewer.collect();
    files.extend(["scene/param.rs", "job/engine.rs", "error.rs"].map(|file| sources.join(file)));
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
