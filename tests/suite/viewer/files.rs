//! Scenes, pictures and settings that the viewer loads and saves.

use std::process::Command;

use super::*;
use taki::output::frame::read_png;
use taki::viewer::document::{Document, changed_keys};
use taki::viewer::settings::{Settings, Theme};

/// A window wide enough for its dialogs.
fn wide() -> Setup {
    Setup { size: [760.0, 480.0], ..Setup::bare() }
}

pub fn taki(arguments: &[&str]) -> Vec<u8> {
    let out = Command::new(env!("CARGO_BIN_EXE_taki"))
        .args(arguments)
        .env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"))
        .output()
        .expect("it runs");
    assert!(out.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&out.stderr));
    out.stdout
}

fn text(path: &Path) -> String {
    path.to_str().expect("UTF-8").to_owned()
}

fn open(window: &mut Window, path: &Path) {
    window.chord(Modifiers::COMMAND, Key::O);
    window.enter("Path", &text(path));
    window.press("Open");
}

pub fn save_as(window: &mut Window, path: &Path) {
    window.chord(Modifiers::COMMAND | Modifiers::SHIFT, Key::S);
    window.enter("Path", &text(path));
    window.press("Save");
}

fn is_changed(window: &Window) -> bool {
    window.viewer().document().is_changed()
}

#[test]
fn what_is_saved_opens_with_the_same_values() {
    let mut window = wide().open();
    window.set("curves.h", Raw::Float(0.33));
    window.set("lights.sun.color", Raw::List([0.1, 0.2, 3.5].map(Raw::Float).into()));
    window.set("trace.attenuation", Raw::Text("per-cell".into()));
    window.harness.run_steps(2);
    assert!(is_changed(&window) && window.reads("small •"));
    let file = window.path("mine.toml");
    save_as(&mut window, &file);
    let values = window.viewer().document().values().clone();
    let toml = window.viewer().document().scene().to_toml();
    assert!(!is_changed(&window) && window.viewer().document().name == "mine");
    assert!(!window.reads("mine •") && window.reads("saved "));
    open(&mut window, &file);
    window.settle();
    let opened = window.viewer().document().values();
    assert_eq!(changed_keys(&values, opened), Vec::<String>::new());
    assert!(window.viewer().document().scene().to_toml() == toml && !is_changed(&window));
    window.set("curves.h", Raw::Float(0.44));
    window.chord(Modifiers::COMMAND, Key::S);
    let written = std::fs::read_to_string(&file).expect("a file");
    assert!(written.contains("h = 0.44") && !is_changed(&window));
    let printed = String::from_utf8(taki(&["scene", &text(&file)])).expect("UTF-8");
    assert_eq!(printed.trim_end(), window.viewer().document().scene().to_toml().trim_end());
}

#[test]
fn a_value_turned_away_and_back_by_hand_is_no_change() {
    let mut window = wide().open();
    // The scene leaves this value at its default.
    let Value::Float(first) = window.value("volume.k_noise") else { panic!("a number") };
    window.set("volume.k_noise", Raw::Float(0.7));
    assert!(is_changed(&window));
    window.set("volume.k_noise", Raw::Float(first));
    assert!(!is_changed(&window), "there is nothing to save");
}

#[test]
fn a_scene_that_cannot_be_opened_or_saved_says_why_and_keeps_the_old_one() {
    let mut window = wide().open();
    let values = window.viewer().document().values().clone();
    let broken = window.path("broken.toml");
    std::fs::write(&broken, "version = 1\n[curves]\nh = \"rough\"\n").expect("written");
    open(&mut window, &broken);
    assert!(window.reads("broken.toml:3"), "the line of the fault");
    window.enter("Path", &text(&window.path("none.toml")));
    window.press("Open");
    assert!(window.reads("no preset and no file"));
    window.press("Cancel");
    assert!(*window.viewer().document().values() == values);
    let nowhere = window.path("no/such/folder/x.toml");
    save_as(&mut window, &nowhere);
    assert!(window.reads("no/such/folder"), "why it was not saved");
    window.press("Cancel");
    assert_eq!(window.viewer().document().name, "small");
}

#[test]
fn a_volume_file_and_its_scene_stay_in_one_folder() {
    let mut window = wide().open();
    let here = window.folder.path().to_owned();
    let npz = window.path("v.npz");
    taki(&["volume", "build", &text(&window.path("small.toml")), "-o", &text(&npz)]);
    let first = window.picture().frame.radiance.clone();
    window.harness.state_mut().document_mut().use_volume_file(&npz).expect("a volume");
    window.settle();
    assert!(window.picture().frame.radiance == first, "the same volume from its file");
    let other = tempfile::tempdir().expect("a folder");
    save_as(&mut window, &other.path().join("x.toml"));
    assert!(window.reads("save the scene beside the volume file"));
    assert_eq!(std::fs::read_dir(other.path()).expect("a folder").count(), 0);
    window.press("Cancel");
    save_as(&mut window, &here.join("beside.toml"));
    assert_eq!(window.value("volume.file"), Value::Text("v.npz".into()));
    window.settle();
    assert!(window.picture().frame.radiance == first);
    assert!(window.viewer().worker().state().fault.is_none());
}

#[test]
fn a_volume_file_that_is_none_is_told_and_undone() {
    let mut window = wide().open();
    let npz = window.path("v.npz");
    std::fs::write(&npz, b"not a zip").expect("written");
    window.harness.state_mut().document_mut().use_volume_file(&npz).expect("a path");
    window.settle();
    assert!(window.reads("v.npz"), "a banner names the file");
    window.press("Undo");
    window.settle();
    assert!(!is_changed(&window) && !window.reads("v.npz"));
}

#[test]
fn changes_are_asked_about_before_another_scene_is_opened() {
    let mut window = wide().open();
    let other = window.path("other.toml");
    std::fs::write(&other, "version = 1\nbase = \"front\"\n[image]\nwidth = 64\nheight = 36\n")
        .expect("written");
    window.set("curves.h", Raw::Float(0.1));
    open(&mut window, &other);
    assert!(window.reads("Save the changes?"));
    window.press("Go back");
    assert_eq!((window.viewer().document().name.as_str(), is_changed(&window)), ("small", true));
    if window.harness.query_by_role_and_label(Role::TextInput, "Path").is_some() {
        window.press("Cancel");
    }
    open(&mut window, &other);
    window.press("Discard");
    assert_eq!((window.viewer().document().name.as_str(), is_changed(&window)), ("other", false));
    assert!(!std::fs::read_to_string(window.path("small.toml")).expect("a file").contains("0.1"));
    let small = window.path("small.toml");
    open(&mut window, &small);
    window.set("curves.h", Raw::Float(0.1));
    open(&mut window, &other);
    window.press("Save");
    // The file is written by hand.
    assert!(window.reads("holds comments, a base or changes from outside"));
    assert_eq!(window.viewer().document().name, "small");
    window.press("Replace");
    assert_eq!(window.viewer().document().name, "other");
    assert!(std::fs::read_to_string(small).expect("a file").contains("h = 0.1"));
    window.settle();
}

#[test]
fn escape_goes_back_from_the_question_about_changes() {
    let mut window = wide().open();
    window.set("curves.h", Raw::Float(0.1));
    window.harness.state_mut().open(Path::new("front"));
    window.harness.run_steps(4);
    assert!(window.reads("Save the changes?"));
    // No other key has an effect while the question is open.
    window.chord(Modifiers::COMMAND, Key::Z);
    assert!(is_changed(&window));
    window.key(Key::Escape);
    window.harness.run_steps(2);
    assert!(!window.reads("Save the changes?") && is_changed(&window));
    assert_eq!(window.viewer().document().name, "small");
}

#[test]
fn a_save_that_was_cancelled_leaves_nothing_for_the_next_one_to_do() {
    let mut window = wide().open();
    window.harness.state_mut().open(Path::new("front"));
    window.settle();
    window.set("curves.h", Raw::Float(0.1));
    let small = window.path("small.toml");
    open(&mut window, &small);
    // The preset has no file, so the viewer asks for one, and the user cancels.
    window.press("Save");
    window.press("Cancel");
    assert_eq!(window.viewer().document().name, "front");
    let mine = window.path("mine.toml");
    save_as(&mut window, &mine);
    assert_eq!(window.viewer().document().name, "mine", "a plain save does not open another scene");
}

fn assert_command_line_gives_the_scene(window: &Window) {
    let line = window.viewer().document().command_line().expect("a line");
    let mut words = shlex::split(&line).expect("words");
    assert_eq!(words[..2], ["taki", "render"]);
    words[1] = "scene".into();
    let words: Vec<&str> = words[1..].iter().map(String::as_str).collect();
    let printed = String::from_utf8(taki(&words)).expect("UTF-8");
    assert_eq!(printed.trim_end(), window.viewer().document().scene().to_toml().trim_end(), "{line}");
}

#[test]
fn the_command_line_gives_the_same_scene() {
    let mut window = wide().open();
    assert_command_line_gives_the_scene(&window);
    window.set("curves.h", Raw::Float(1.0 / 3.0));
    window.set("volume.seed", Raw::Int(i64::MAX));
    window.set("lights.sun.color", Raw::List([1e-3, 1e4, 0.0].map(Raw::Float).into()));
    window.set("camera.eye", Raw::List([-1e-6, 12.25, 9e6].map(Raw::Float).into()));
    window.set("light.frame", Raw::Text("world".into()));
    window.set("background.zenith", Raw::List([0.0, 0.1, 1e-7].map(Raw::Float).into()));
    let corners = [[0.0, 1.5, 0.0], [1.0, 1.5, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]];
    let corners = corners.map(|p| Raw::List(p.map(Raw::Float).into()));
    window.set("quads.1.corners", Raw::List(corners.into()));
    assert!(window.viewer().document().fault().is_none());
    assert_command_line_gives_the_scene(&window);
    window.harness.run_steps(2);
    window.chord(Modifiers::COMMAND | Modifiers::SHIFT, Key::C);
    assert!(window.reads("clipboard"));
}

#[test]
fn what_a_scene_removes_stays_away_in_the_viewer() {
    let folder = tempfile::tempdir().expect("a folder");
    let (scene, saved) = (folder.path().join("bare.toml"), folder.path().join("saved.toml"));
    std::fs::write(&scene, "version = 1\nbase = \"waterfall\"\nremove = [\"rocks\", \"pools\"]\n")
        .expect("written");
    let limits = Limits::default();
    let mut bare = Document::open(&scene, &[], &limits).expect("a scene");
    assert!(bare.scene().rocks.is_empty() && bare.scene().pools.is_empty() && !bare.is_changed());
    bare.save(&saved).expect("saved");
    let again = Document::open(&saved, &[], &limits).expect("a scene");
    assert_eq!(again.scene().to_toml(), bare.scene().to_toml());
    // Removed on the command line, they are a change, and the copied command line removes them again.
    let sets: Vec<String> = ["remove=pools", "remove=rocks", "h=1.5"].map(String::from).to_vec();
    let mut removed = Document::open(Path::new("waterfall"), &sets, &limits).expect("a scene");
    assert!(removed.is_changed());
    let line = removed.command_line().expect("a line");
    assert_eq!(line, "taki render waterfall --remove pools --remove rocks --set 'curves.h=1.5'");
    let line = line.replace('\'', "");
    let printed = taki(&[&["scene"], &line.split(' ').skip(2).collect::<Vec<_>>()[..]].concat());
    assert_eq!(String::from_utf8(printed).expect("UTF-8"), removed.scene().to_toml() + "\n");
    removed.reset_section("rocks");
    removed.reset_section("pools");
    assert_eq!(removed.command_line().expect("a line"), "taki render waterfall --set 'curves.h=1.5'");
}

#[test]
fn a_picture_opens_as_its_scene_and_is_not_saved_over() {
    let folder = tempfile::tempdir().expect("a folder");
    let (scene, picture) = (folder.path().join("s.toml"), folder.path().join("fig5.png"));
    std::fs::write(&scene, SCENE).expect("written");
    let at = |path: &Path| text(path);
    taki(&["render", &at(&scene), "--engine=cpu", "--size=16x16", "--seed=9", "-o", &at(&picture)]);
    let mut window = wide().open();
    open(&mut window, &picture);
    window.settle();
    let document = window.viewer().document();
    assert_eq!((document.name.as_str(), document.path.as_ref()), ("fig5", None));
    assert_eq!(document.values().int("volume.seed"), 9);
    assert_command_line_gives_the_scene(&window);
    window.set("volume.seed", Raw::Int(10));
    assert_command_line_gives_the_scene(&window);
}

#[test]
fn odd_names_and_paths_survive_the_command_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let odd = folder.path().join("it's a \"place\" for $HOME & ünïcode 滝");
    std::fs::create_dir(&odd).expect("a folder");
    let scene = odd.join("-my scene.toml");
    let more = "[lights.\"slütlicht 滝\"]\nintensity = 0.5\n[lights.\"key light's\"]\nintensity = 0.25\n";
    std::fs::write(&scene, format!("{SCENE}{more}")).expect("written");
    taki(&["volume", "build", &text(&scene), "-o", &text(&odd.join("a \\ volume.npz"))]);
    let mut window = wide().open_with(|builder| builder.allow_missing_glyphs());
    window.harness.state_mut().open(&scene);
    window.settle();
    for light in ["slütlicht 滝", "key light's"] {
        window.set(&format!("lights.{light}.intensity"), Raw::Float(0.75));
    }
    assert_command_line_gives_the_scene(&window);
    let npz = odd.join("a \\ volume.npz");
    window.harness.state_mut().document_mut().use_volume_file(&npz).expect("a volume");
    window.settle();
    assert!(window.viewer().worker().state().fault.is_none());
    assert_command_line_gives_the_scene(&window);
}

fn exported(window: &mut Window, count: usize) {
    window.until("the export", |viewer| viewer.worker().state().exports_done >= count);
    window.harness.run_steps(3);
}

/// Opens the export window and fills it in.
fn ask_export(window: &mut Window, file: &Path, size: [u32; 2], samples: u32) {
    window.chord(Modifiers::COMMAND, Key::E);
    window.enter("Export file", &text(file));
    let keep = window.widget(Role::CheckBox, "keep aspect");
    if keep.accesskit_node().toggled() == Some(egui::accesskit::Toggled::True) {
        keep.click_accesskit();
    }
    window.harness.run_steps(2);
    for (label, value) in [("Export width", size[0]), ("Export height", size[1])] {
        window.widget(Role::SpinButton, label).set_value_accesskit(f64::from(value));
        window.harness.run_steps(2);
    }
    window.widget(Role::Slider, "Export samples").set_value_accesskit(f64::from(samples));
    window.harness.run_steps(2);
}

fn an_export_is_what_the_command_line_renders(engine: EngineChoice, name: &str) {
    let mut window = Setup { engine, ..wide() }.open();
    window.set("curves.h", Raw::Float(0.3));
    window.set("lights.sun.intensity", Raw::Float(3.0));
    window.settle();
    let file = window.path("out");
    ask_export(&mut window, &file, [75, 44], 3);
    window.widget(Role::CheckBox, "EXR").click_accesskit();
    window.harness.run_steps(2);
    window.press("Export");
    exported(&mut window, 1);
    let (width, height, _) = read_png(&window.path("out.png")).expect("a PNG");
    assert_eq!((width, height), (75, 44));
    let (width, height, channels) =
        taki::output::frame::read_exr(&window.path("out.exr"), 1 << 30).expect("an EXR");
    assert_eq!((width, height), (75, 44));
    assert!(channels.len() > 4, "layers beside the colours");
    assert!(window.reads("wrote "));
    let line = window.viewer().document().command_line().expect("a line");
    let words = shlex::split(&line).expect("words");
    for kind in ["png", "exr"] {
        let again = text(&window.path(&format!("again.{kind}")));
        let mut words: Vec<&str> = words[1..].iter().map(String::as_str).collect();
        words.extend(["--size", "75x44", "--samples", "3", "--engine", name, "-o", &again]);
        if kind == "exr" {
            continue;
        }
        taki(&words);
        let ours = std::fs::read(window.path(&format!("out.{kind}"))).expect("a file");
        assert!(ours == std::fs::read(&again).expect("a file"), "{kind} of {name}, byte by byte");
    }
}

#[test]
fn an_export_is_byte_by_byte_what_the_command_line_renders() {
    an_export_is_what_the_command_line_renders(EngineChoice::Cpu, "cpu");
}

#[test]
fn an_export_on_the_gpu_is_what_the_command_line_renders_there() {
    if crate::engine::gpu::renderer("viewer export").is_some() {
        an_export_is_what_the_command_line_renders(EngineChoice::Gpu, "gpu");
    }
}

#[test]
fn a_cancelled_export_leaves_no_file() {
    let mut window = wide().open();
    let before = std::fs::read_dir(window.folder.path()).expect("a folder").count();
    let file = window.path("big");
    ask_export(&mut window, &file, [3000, 2000], 200);
    window.press("Export");
    window.until("the work", |viewer| viewer.worker().state().busy.is_some_and(|b| b.what == "export"));
    window.harness.run_steps(2);
    window.press("Cancel");
    exported(&mut window, 1);
    assert!(window.reads("export cancelled"));
    assert_eq!(std::fs::read_dir(window.folder.path()).expect("a folder").count(), before);
    assert!(
        window.harness.query_by_role_and_label(Role::Button, "Export").is_some(),
        "it can be tried again"
    );
}

#[test]
fn an_export_into_no_folder_is_told() {
    let mut window = wide().open();
    let file = window.path("no/such/out");
    ask_export(&mut window, &file, [32, 18], 1);
    window.press("Export");
    exported(&mut window, 1);
    assert!(window.reads("export failed") && window.reads("no/such"));
    window.set("trace.sigma", Raw::Float(7.0));
    window.settle();
    assert_eq!(window.picture().scale, 1, "and the viewer goes on");
}

#[test]
fn what_exists_is_replaced_only_after_a_question() {
    let mut window = wide().open();
    let (picture, other) = (window.path("out.png"), window.path("notes.toml"));
    std::fs::write(&picture, "no picture").expect("written");
    std::fs::write(&other, "notes").expect("written");
    let old = |path: &Path| std::fs::read(path).expect("a file").len() < 20;
    let stem = window.path("out");
    ask_export(&mut window, &stem, [32, 18], 1);
    window.press("Export");
    assert!(window.reads("out.png exists already.") && !window.reads("Writes "));
    window.press("Go back");
    assert!(window.reads("Writes ") && old(&picture) && window.viewer().worker().state().exports_done == 0);
    // The answer holds for the files that were asked about.
    window.press("Export");
    window.widget(Role::CheckBox, "EXR").click_accesskit();
    window.harness.run_steps(3);
    assert!(window.reads("Writes "));
    window.widget(Role::CheckBox, "EXR").click_accesskit();
    window.harness.run_steps(3);
    window.press("Export");
    window.press("Replace");
    exported(&mut window, 1);
    assert!(read_png(&picture).is_ok_and(|(width, height, _)| (width, height) == (32, 18)));
    window.harness.state_mut().document_mut().set("curves.h", &Raw::Float(0.2), None).expect("valid");
    save_as(&mut window, &other);
    assert!(window.reads("notes.toml exists already") && old(&other));
    window.press("Replace");
    assert!(!old(&other) && window.reads("saved "));
    // A scene's own file is saved without a question, as long as it is what was saved last.
    window.set("curves.h", Raw::Float(0.4));
    save_as(&mut window, &other);
    assert!(!is_changed(&window));
    for more in ["# by hand\n", ""] {
        let text = std::fs::read_to_string(&other).expect("a scene");
        std::fs::write(&other, format!("{more}{text}")).expect("written");
        window.set("curves.h", Raw::Float(0.5 + more.len() as f64 / 100.0));
        window.chord(Modifiers::COMMAND, Key::S);
        assert_eq!(window.reads("changes from outside"), !more.is_empty());
        if !more.is_empty() {
            assert!(is_changed(&window) && std::fs::read_to_string(&other).unwrap().starts_with(more));
            window.press("Replace");
        }
        assert!(!is_changed(&window) && !std::fs::read_to_string(&other).unwrap().starts_with('#'));
    }
}

#[test]
fn the_size_of_an_export_keeps_the_aspect() {
    let mut window = wide().open();
    window.chord(Modifiers::COMMAND, Key::E);
    window.widget(Role::SpinButton, "Export width").set_value_accesskit(1600.0);
    window.harness.run_steps(2);
    assert_eq!(window.widget(Role::SpinButton, "Export height").value().as_deref(), Some("900 px"));
}

#[test]
fn settings_are_written_at_the_end_and_read_at_the_start() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path().join("deep/in/viewer.json");
    let scene = folder.path().join("small.toml");
    std::fs::write(&scene, SCENE).expect("written");
    let options = options(&scene, &place);
    let mut window = Window::new(folder, options, [760.0, 480.0], |b| b);
    window.key(Key::V);
    window.choose("Refine to", "4 samples");
    let theme = window.harness.ctx.theme();
    window.key(Key::T);
    assert_ne!(window.harness.ctx.theme(), theme);
    let Window { harness, folder: _folder } = window;
    drop(harness);
    let (settings, note) = Settings::load(Some(&place));
    assert_eq!(note, None);
    assert!(settings.inspectors && settings.refine_to == 4 && settings.theme != Theme::System);
    assert_eq!(settings.recent, [scene.canonicalize().expect("a file")]);
}

#[test]
fn damaged_settings_give_the_defaults_and_a_banner() {
    for damaged in ["{", "[1]", r#"{"zoom": "big"}"#, r#"{"unknown": 1}"#, "\u{0}\u{1}"] {
        let window = Setup { settings: damaged.into(), ..wide() }.open();
        assert!(window.reads("viewer.json could not be read"), "{damaged}");
    }
    let wild =
        r#"{"zoom": 1e30, "window": [1e30, -5], "refine_to": 0, "flow_speed": -1e300, "parameters": false}"#;
    let window = Setup { settings: wild.into(), ..wide() }.open();
    assert!(!window.reads("could not be read"));
}

#[test]
fn recent_files_are_offered() {
    let mut window = wide().open();
    let other = window.path("other.toml");
    std::fs::write(&other, SCENE).expect("written");
    open(&mut window, &other);
    window.settle();
    window.chord(Modifiers::COMMAND, Key::O);
    let links = window.names(Role::Link);
    assert!(
        links.len() == 2 && links[0].ends_with("other.toml") && links[1].ends_with("small.toml"),
        "{links:?}"
    );
    let small = links[1].clone();
    window.widget(Role::Link, &small).click_accesskit();
    window.harness.run_steps(3);
    window.settle();
    assert_eq!(window.viewer().document().name, "small");
}

#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }
    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

/// A file as a window gives it to egui.
pub fn dropped(path: &Path) -> egui::DroppedFileHandle {
    std::sync::Arc::new(Dropped(path.to_owned()))
}

pub fn drop_on(window: &mut Window, path: &Path) {
    window.harness.input_mut().dropped_files.push(dropped(path));
    window.harness.run_steps(2);
}

#[test]
fn an_environment_is_opened_by_dropping_its_map_on_the_window_and_saved_beside_it() {
    let mut window = wide().open();
    let map = window.path("even.hdr");
    let text = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n".as_slice();
    std::fs::write(&map, [text, &[128, 128, 128, 129, 128, 128, 128, 129]].concat()).expect("written");
    drop_on(&mut window, &map);
    window.settle();
    let environment = |window: &Window| window.viewer().document().scene().environment.is_some();
    assert!(environment(&window));
    let background = |window: &Window| window.picture().frame.radiance.iter().any(|p| p[..3] == [1.0; 3]);
    assert!(background(&window), "a radiance of 1 is seen where nothing is");
    let other = tempfile::tempdir().expect("a folder");
    save_as(&mut window, &other.path().join("x.toml"));
    assert!(window.reads("save the scene beside the environment file"));
    window.press("Cancel");
    let beside = window.path("beside.toml");
    save_as(&mut window, &beside);
    assert_eq!(window.value("environment.file"), Value::Text("even.hdr".into()));
    window.settle();
    assert!(environment(&window) && background(&window));
    // A volume given by hand does not break the path of the map.
    let npz = window.path("v.npz");
    taki(&["volume", "build", beside.to_str().expect("UTF-8"), "-o", npz.to_str().expect("UTF-8")]);
    drop_on(&mut window, &npz);
    window.settle();
    assert!(environment(&window) && window.viewer().document().fault().is_none());
}

#[test]
fn a_scene_or_a_volume_is_opened_by_dropping_it_on_the_window() {
    let mut window = wide().open();
    let scene = window.path("dropped.toml");
    std::fs::write(&scene, window.viewer().document().scene().to_toml()).expect("written");
    drop_on(&mut window, &scene);
    window.settle();
    assert_eq!(window.viewer().document().name, "dropped");

    // The volume has another seed than the scene, so that the picture shows where the volume comes from.
    let volume = window.path("v.npz");
    let output = ["volume", "build", &text(&scene), "--seed", "99", "-o", &text(&volume)];
    taki(&output);
    let before = window.picture().frame.radiance.clone();
    drop_on(&mut window, &volume);
    window.settle();
    assert!(window.viewer().document().scene().recipes[0].file.is_some());
    let by_file = window.picture().frame.radiance.clone();
    assert_ne!(by_file, before);
    window.undo();
    window.set("volume.seed", Raw::Int(99));
    window.settle();
    assert_eq!(window.picture().frame.radiance, by_file, "the file holds the volume of this seed");

    let other = window.path("notes.txt");
    std::fs::write(&other, "x").expect("written");
    drop_on(&mut window, &other);
    assert!(window.reads("neither a scene"));
}

#[test]
fn the_command_line_is_copied_to_the_clipboard() {
    let mut window = wide().open();
    window.set("trace.sigma", Raw::Float(3.5));
    window.harness.run_steps(1);
    // The event is sent in a single frame, because the harness keeps only the last frame's output.
    let (key, modifiers) = (Key::C, Modifiers::COMMAND | Modifiers::SHIFT);
    let event = egui::Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers };
    window.harness.input_mut().events.push(event);
    window.harness.step();
    let commands = &window.harness.output().platform_output.commands;
    let copied = commands.iter().find_map(|command| match command {
        egui::OutputCommand::CopyText(text) => Some(text.clone()),
        _ => None,
    });
    let copied = copied.expect("something was copied");
    assert_eq!(copied, window.viewer().document().command_line().expect("a line"));
    assert!(copied.starts_with("taki render ") && copied.contains("trace.sigma=3.5"), "{copied}");
}

#[test]
fn a_mesh_opens_in_a_new_scene_that_frames_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("old cliff.glb");
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/model/blender.glb");
    std::fs::copy(data, &file).expect("a copy");
    let limits = Limits::default();
    let mut document = Document::open(&file, &[], &limits).expect("a scene");
    assert!(!document.is_changed() && document.path.is_none());
    let [mesh] = &document.scene().meshes[..] else { panic!("one mesh") };
    // Every corner of the mesh is in the picture, whose height the nearest of them nearly fills.
    let camera = &document.scene().camera;
    let most = mesh.corners().expect("triangles").map(|corner| {
        let d = corner - camera.eye;
        let depth = d.dot(camera.forward) * f64::from(camera.tan_half_fov);
        assert!(depth > 0.0);
        let across = d.dot(camera.right) / (depth * 960.0 / 540.0);
        across.abs().max((d.dot(camera.up) / depth).abs())
    });
    let most = most.into_iter().fold(0.0, f64::max);
    assert!((0.5..1.0).contains(&most), "{most}");
    assert!(document.command_line().expect_err("no file").to_string().contains("no file"));
    let saved = folder.path().join("saved.toml");
    document.save(&saved).expect("saved");
    let again = Document::open(&saved, &[], &limits).expect("a scene");
    assert_eq!(again.scene().triangles.len(), 1);
    let sets = ["camera.fov=20".to_owned()];
    assert!(Document::open(&file, &sets, &limits).expect("a scene").is_changed());
}
