//! Meshes that are dropped on the window, their list, and what their parts become.

use std::fs;

use glam::DVec3;
use taki::engine::cpu;
use taki::model::Model;
use taki::scene::Scene;
use taki::util::monitor::Unwatched;

use super::files::{drop_on, save_as, taki};
use super::*;
use crate::model::Doc;

/// A window so large that the whole list is visible.
pub fn with_list() -> Window {
    Setup { size: [760.0, 900.0], ..Setup::default() }.open()
}

pub fn toml(window: &Window) -> String {
    window.viewer().document().scene().to_toml()
}

fn text(window: &Window, key: &str) -> String {
    window.viewer().document().values().text(key)
}

fn names(window: &Window) -> Vec<String> {
    window.viewer().document().values().names("meshes")
}

/// Puts a file that Blender exported into a folder.
fn exported(folder: &Path) -> PathBuf {
    let file = folder.join("blender.glb");
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/model/blender.glb"), &file)
        .expect("a copy");
    file
}

/// A window with the cliff that Blender exported, and what it was before.
fn with_cliff() -> (Window, String) {
    let mut window = with_list();
    let before = toml(&window);
    let file = exported(window.folder.path());
    drop_on(&mut window, &file);
    window.settle();
    (window, before)
}

/// Place of a point in the picture: −1 to 1 from edge to edge along both axes.
fn in_picture(window: &Window, point: DVec3) -> [f64; 2] {
    let (eye, target) = (window.point("camera.eye"), window.point("camera.target"));
    let forward = (target - eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let tan = (window.float("camera.fov").to_radians() * 0.5).tan();
    let d = point - eye;
    let depth = d.dot(forward);
    assert!(depth > 0.0, "{point} lies before the eye");
    [d.dot(right) / (depth * tan * f64::from(ASPECT)), d.dot(up) / (depth * tan)]
}

#[test]
fn a_dropped_mesh_is_there_framed_and_undone_to_the_last_byte_in_one_step() {
    let mut window = with_list();
    let before = (toml(&window), window.picture().frame.radiance.clone());
    let away = (window.point("camera.eye") - window.point("camera.target")).normalize();
    fs::create_dir(window.path("models")).expect("a folder");
    let file = window.path("models/Wet cliff.v2.glb");
    fs::write(&file, Doc::square().glb()).expect("written");
    drop_on(&mut window, &file);
    window.settle();
    assert_eq!(names(&window), ["Wet_cliff_v2"]);
    assert_eq!(text(&window, "meshes.Wet_cliff_v2.file"), "models/Wet cliff.v2.glb");
    assert!(window.viewer().document().fault().is_none());
    let parts = window.viewer().document().scene().meshes[0].parts();
    assert_eq!(parts[0].becomes, "opaque");

    let after = (window.point("camera.eye") - window.point("camera.target")).normalize();
    assert!(after.distance(away) < 1e-5, "the same direction: {after} for {away}");
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let places = corners.map(|[x, y]| in_picture(&window, DVec3::new(x, y, 0.0)));
    let most = places.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    assert!((0.9..1.0).contains(&most), "it fills most of the picture: {places:?}");
    // The pixel in the middle shows the square, not what is behind it.
    window.key(Key::Num2);
    window.settle();
    let added = toml(&window);

    window.undo();
    window.settle();
    assert!((toml(&window), window.picture().frame.radiance.clone()) == before);
    assert!(!window.viewer().document().can_undo(), "one step");
    window.redo();
    window.settle();
    assert!(toml(&window) == added);
    drop_on(&mut window, &file);
    assert_eq!(names(&window), ["Wet_cliff_v2", "Wet_cliff_v2-2"], "a key of its own");
}

#[test]
fn a_tiny_mesh_is_not_cut_off_by_the_near_plane() {
    let mut window = with_list();
    let mut doc = Doc::square();
    doc.json["nodes"][0]["scale"] = serde_json::json!([0.002, 0.002, 0.002]);
    let file = window.path("tiny.glb");
    fs::write(&file, doc.glb()).expect("written");
    drop_on(&mut window, &file);
    let near = window.float("camera.near");
    let forward = (window.point("camera.target") - window.point("camera.eye")).normalize();
    for corner in [[0.0, 0.0], [0.002, 0.002]] {
        let depth = (DVec3::new(corner[0], corner[1], 0.0) - window.point("camera.eye")).dot(forward);
        assert!(depth > near, "{depth} m deep, cut off at {near}");
    }
}

#[test]
fn a_file_that_cannot_be_read_says_why_and_changes_nothing() {
    let mut window = with_list();
    let before = toml(&window);
    let file = window.path("broken.glb");
    fs::write(&file, b"glTF\x02\0\0\0nothing").expect("written");
    let own = Model::read(&file.canonicalize().expect("a path"), &Default::default(), &Unwatched);
    let own = own.expect_err("broken").to_string();
    drop_on(&mut window, &file);
    assert!(window.reads(&own), "the reader's own words: {own}");
    let mut draco = Doc::square();
    draco.json["extensionsRequired"] = serde_json::json!(["KHR_draco_mesh_compression"]);
    fs::write(window.path("packed.glb"), draco.glb()).expect("written");
    let packed = window.path("packed.glb");
    drop_on(&mut window, &packed);
    assert!(window.reads("KHR_draco_mesh_compression"));
    let absent = window.path("absent.obj");
    drop_on(&mut window, &absent);
    assert!(window.reads("there is no file"));
    assert!(toml(&window) == before && names(&window).is_empty());
    assert!(!window.viewer().document().can_undo() && window.viewer().document().fault().is_none());
    assert!(window.viewer().document().limits().allow_paths.is_empty());
}

#[test]
fn a_mesh_from_elsewhere_is_allowed_while_the_window_is_open_and_saving_says_what_rendering_needs() {
    let mut window = with_list();
    let other = tempfile::tempdir().expect("a folder");
    let file = exported(other.path());
    drop_on(&mut window, &file);
    window.settle();
    let real = file.canonicalize().expect("a path");
    assert_eq!(text(&window, "meshes.blender.file"), real.to_str().expect("UTF-8"));
    assert!(window.viewer().document().fault().is_none());
    window.choose("meshes.blender.materials.Fall", "water");
    window.settle();
    let picture = window.picture().frame.radiance.clone();

    let saved = window.path("saved.toml");
    save_as(&mut window, &saved);
    window.harness.run_steps(2);
    let folder = real.parent().expect("a folder").to_str().expect("UTF-8").to_owned();
    assert!(window.reads(&format!("--allow-path {folder}")), "what is needed");
    window.settle();
    assert!(window.picture().frame.radiance == picture && window.viewer().document().fault().is_none());
    window.set("image.exposure", Raw::Float(0.5));
    let line = window.viewer().document().command_line().expect("a command");
    assert!(line.contains(&format!("--allow-path {folder}")), "{line}");

    let saved = saved.to_str().expect("UTF-8");
    let load = |folders: &[PathBuf]| {
        Scene::load(Path::new(saved), &[], &Limits { allow_paths: folders.into(), ..Limits::default() })
    };
    let refused = load(&[]).expect_err("refused").to_string();
    assert!(refused.contains("--allow-path"), "{refused}");
    let mut scene = load(&[PathBuf::from(&folder)]).expect("a scene");
    let frame = &window.picture().frame;
    let image = &mut scene.edit().image;
    (image.width, image.height, image.samples) = (frame.width, frame.height, 1);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let rendered = cpu::render(&scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame");
    assert!(rendered.radiance == picture, "the saved file gives the same picture");
    let out = window.path("out.png");
    taki(&["render", saved, "--allow-path", &folder, "--engine", "cpu", "-o", out.to_str().expect("UTF-8")]);

    // In this window the folder stays allowed, also for a scene that is opened later.
    window.undo();
    window.harness.state_mut().open(Path::new(saved));
    window.settle();
    assert!(window.picture().frame.radiance == picture);
}

#[test]
fn a_mesh_stays_with_its_scene_when_that_is_saved_elsewhere() {
    let (mut window, _) = with_cliff();
    assert_eq!(text(&window, "meshes.blender.file"), "blender.glb");
    window.press("Hide blender");
    let other = tempfile::tempdir().expect("a folder");
    let saved = other.path().join("far.toml");
    save_as(&mut window, &saved);
    window.settle();
    let real = window.path("blender.glb").canonicalize().expect("a path");
    assert_eq!(text(&window, "meshes.blender.file"), real.to_str().expect("UTF-8"), "even a hidden one");
    window.press("Show blender");
    window.settle();
    assert!(window.viewer().document().fault().is_none());
    assert_eq!(window.viewer().document().scene().meshes.len(), 1);
}

#[test]
fn textures_that_are_dropped_with_a_mesh_are_no_error() {
    let mut window = with_list();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/model");
    for name in ["blender.obj", "blender.mtl"] {
        fs::copy(data.join(name), window.path(name)).expect("a copy");
    }
    let dropped = ["blender.mtl", "blender.obj"].map(|name| window.path(name));
    let files = dropped.iter().map(|path| super::files::dropped(path));
    window.harness.input_mut().dropped_files.extend(files);
    window.harness.run_steps(2);
    assert_eq!(names(&window), ["blender"]);
    assert!(!window.reads("neither a scene"));
    // The dialog of files takes a mesh too, where nothing can be dropped.
    window.undo();
    window.chord(Modifiers::COMMAND, Key::O);
    window.enter("Path", dropped[1].to_str().expect("UTF-8"));
    window.press("Open");
    assert_eq!(names(&window), ["blender"]);
    assert_eq!(window.viewer().document().name, "small");
}

#[test]
fn each_part_becomes_what_is_chosen_in_one_step() {
    let (mut window, _) = with_cliff();
    for (part, count) in [("Wet stone", "16 triangles"), ("Fall", "16 triangles"), ("Leaf", "36 triangles")] {
        assert!(window.reads(part) && window.reads(count), "{part}");
    }
    let key = "meshes.blender.materials.Wet_stone";
    let before = toml(&window);
    let triangles = |window: &Window| {
        let scene = window.viewer().document().scene();
        scene.triangles.iter().map(|own| own.vertices.len() / 3).sum::<usize>()
    };
    assert_eq!(triangles(&window), 16 + 16 + 36);
    window.choose(key, "none");
    assert_eq!((text(&window, key), triangles(&window)), ("none".into(), 16 + 36));
    window.undo();
    assert!(toml(&window) == before);
    let fall = "meshes.blender.materials.Fall";
    let quads = window.viewer().document().scene().quads.len();
    window.choose(fall, "water");
    assert_eq!(window.viewer().document().scene().quads.len(), quads + 8);
    window.choose(fall, "opaque");
    assert_eq!(triangles(&window), 16 + 16 + 36);
    window.undo();
    window.undo();
    assert!(toml(&window) == before);
    // A part takes over what the whole mesh becomes.
    window.choose("meshes.blender.material", "none");
    assert_eq!(triangles(&window), 0);
    let combo = window.widget(Role::ComboBox, fall);
    assert_eq!(combo.accesskit_node().value().as_deref(), Some("none"));
}

#[test]
fn a_new_shell_is_a_material_of_its_own() {
    let (mut window, _) = with_cliff();
    window.set("meshes.blender.scale", Raw::Float(2.0));
    window.harness.run_steps(2);
    let before = toml(&window);
    let key = "meshes.blender.materials.Leaf";
    window.choose(key, "new shell…");
    window.settle();
    assert!(window.viewer().document().fault().is_none(), "{:?}", window.viewer().document().fault());
    assert_eq!(text(&window, key), "Leaf");
    assert_eq!(text(&window, "materials.Leaf.carrier"), "shell");
    let [low, high] = window.viewer().document().scene().meshes[0].loaded.bounds().expect("a box");
    let wanted = (high - low).max_element() * 2.0 / 30.0;
    let thickness = window.float("materials.Leaf.thickness");
    assert!((thickness / wanted - 1.0).abs() < 0.06, "{thickness} m for {wanted} m");
    assert_eq!(window.viewer().document().scene().shells.len(), 1);
    let first = toml(&window);
    window.choose("meshes.blender.materials.Fall", "Leaf");
    window.choose("meshes.blender.materials.Fall", "new shell…");
    window.choose(key, "new shell…");
    assert_eq!(text(&window, key), "shell", "the name Leaf is taken");
    (0..3).for_each(|_| window.undo());
    assert!(toml(&window) == first);
    window.undo();
    assert!(toml(&window) == before, "one step");
}

#[test]
fn a_part_without_texture_coordinates_says_what_to_do_and_can_be_undone() {
    let mut window = with_list();
    let mut doc = Doc::square();
    doc.primitive()["attributes"].as_object_mut().expect("a table").remove("TEXCOORD_0");
    doc.primitive().as_object_mut().expect("a table").remove("material");
    let file = window.path("bare.glb");
    fs::write(&file, doc.glb()).expect("written");
    drop_on(&mut window, &file);
    assert!(window.reads("without a material"));
    let before = toml(&window);
    window.widget(Role::ComboBox, "meshes.bare.material");
    window.choose("Parts of bare without a material", "none");
    assert_eq!(text(&window, "meshes.bare.material"), "none");
    window.undo();
    window.choose("Parts of bare without a material", "new shell…");
    assert!(window.reads("projection"), "the way out");
    window.press("Undo");
    assert!(window.viewer().document().fault().is_none() && toml(&window) == before);
}

#[test]
fn meshes_are_hidden_renamed_duplicated_and_removed() {
    let (mut window, without) = with_cliff();
    let before = toml(&window);
    window.press("Hide blender");
    assert_eq!(text(&window, "meshes.blender.show"), "hidden");
    assert!(window.reads("Hidden: its parts are listed"));
    window.press("Show blender");
    assert_eq!(text(&window, "meshes.blender.show"), "visible");
    window.set("meshes.blender.show", Raw::Text("holdout".into()));
    window.harness.run_steps(2);
    window.press("Hide blender");
    window.press("Show blender");
    assert_eq!(text(&window, "meshes.blender.show"), "holdout", "as it was");
    (0..5).for_each(|_| window.undo());
    assert!(toml(&window) == before);

    window.key(Key::F2);
    window.enter("Name of blender", "my cliff");
    window.key(Key::Enter);
    assert_eq!(names(&window), ["my cliff"]);
    window.chord(Modifiers::COMMAND, Key::D);
    assert_eq!(names(&window), ["my cliff", "my cliff-2"]);
    assert_eq!(text(&window, "meshes.my cliff-2.file"), "blender.glb");
    // The copy is selected.
    window.key(Key::Delete);
    assert_eq!(names(&window), ["my cliff"]);
    window.press("Remove my cliff");
    assert!(names(&window).is_empty() && window.reads("Drop a .glb"));
    (0..4).for_each(|_| window.undo());
    assert!(toml(&window) == before);
    window.press("Reset Meshes");
    assert!(names(&window).is_empty() && without.lines().count() < before.lines().count());
}

#[test]
fn only_one_thing_is_selected() {
    let (mut window, _) = with_cliff();
    let shown = |window: &Window| {
        ["Handle of blender", "Dial of sun"].map(|label| window.harness.query_by_label(label).is_some())
    };
    assert_eq!(shown(&window), [true, false], "what was dropped is selected");
    window.press("Light sun");
    assert_eq!(shown(&window), [false, true]);
    window.press("Mesh blender");
    assert_eq!(shown(&window), [true, false]);
    window.press("Hide blender");
    assert_eq!(shown(&window), [false, false], "a hidden mesh has no handles");
}

#[test]
fn a_camera_from_a_file_can_be_moved_and_outlives_its_mesh() {
    let (mut window, _) = with_cliff();
    window.set("camera.from", Raw::Text("blender".into()));
    window.settle();
    let camera = window.viewer().document().scene().camera;
    let centre = window.image_rect().center();
    let corner = window.image_rect().left_bottom() + egui::vec2(6.0, -6.0);
    let before = toml(&window);
    window.drag(corner, egui::vec2(10.0, 0.0), Modifiers::SHIFT);
    let moved = window.viewer().document().scene().camera;
    let step = moved.eye - camera.eye;
    assert!(step.dot(camera.right) < -1e-3 && step.reject_from(camera.right).length() < 1e-4, "{step}");
    assert!(moved.forward.distance(camera.forward) < 1e-5, "a pan from where the camera was");
    assert!((moved.tan_half_fov - camera.tan_half_fov).abs() < 1e-5);
    window.undo();
    assert!(toml(&window) == before && centre.x > corner.x);
    // Its name is kept, and it stays when the mesh goes.
    window.key(Key::F2);
    window.enter("Name of blender", "cliff");
    window.key(Key::Enter);
    assert_eq!(text(&window, "camera.from"), "cliff");
    for press in ["Hide cliff", "Remove cliff"] {
        window.press(press);
        assert!(window.viewer().document().fault().is_none(), "{press}");
        let now = window.viewer().document().scene().camera;
        assert!(now.eye.distance(camera.eye) < 1e-5 && now.forward.distance(camera.forward) < 1e-5);
        window.undo();
    }
}

#[test]
fn what_no_surface_shows_comes_last_in_the_panel() {
    let top = |window: &Window, label: &str| {
        window.harness.query_all_by_label(label).map(|node| node.rect().top()).fold(f32::INFINITY, f32::min)
    };
    let window = with_list();
    assert!(
        top(&window, "Curves") < top(&window, "Mapping") && top(&window, "Volume") < top(&window, "Mapping")
    );
    window.widget(Role::Slider, "curves.h");
    let scene = "version = 1\nbase = \"torus\"\n[image]\nwidth = 64\nheight = 36\nsamples = 1\n";
    let setup = Setup { scene: scene.into(), size: [760.0, 900.0], ..Setup::default() };
    let window = setup.open();
    let sliders = window.names(Role::Slider);
    assert!(sliders.contains(&"volumes.fur.alpha".into()) && !sliders.contains(&"curves.h".into()));
    for group in ["Curves", "Volume"] {
        assert!(top(&window, group) > top(&window, "Animation"), "{group}");
    }
    assert!(window.reads("Fur") || window.names(Role::ComboBox).contains(&"meshes.ring.material".into()));
}
