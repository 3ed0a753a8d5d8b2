//! The list of lights: adding, removing, copying, renaming and switching them.

use std::collections::BTreeSet;

use super::*;
use taki::scene::{Place, Values};
use taki::viewer::lights::edit;

/// A window so large that the whole list is visible.
fn with_list() -> Setup {
    Setup { size: [700.0, 900.0], ..Setup::default() }
}

fn toml(window: &Window) -> String {
    window.viewer().document().scene().to_toml()
}

fn lights(window: &Window) -> Vec<String> {
    window.viewer().document().values().names("lights")
}

fn shown(window: &Window) -> (Vec<[f32; 4]>, Vec<[u8; 4]>) {
    let picture = window.picture();
    (picture.frame.radiance.clone(), picture.frame.picture.clone())
}

fn add(window: &mut Window, kind: &str) {
    window.press("Add a light");
    window.press(&format!("Add {kind}"));
    window.settle();
}

fn values(pairs: &[(&str, Raw)]) -> Values {
    let mut values = Values::default();
    for (key, raw) in pairs {
        values.set(key, raw, &Place("test".into())).expect("a value");
    }
    values
}

fn point() -> Raw {
    Raw::Text("point".into())
}

#[test]
fn a_light_of_each_kind_is_added_seen_and_undone_to_the_last_byte() {
    let mut window = with_list().open();
    for kind in edit::kinds() {
        let (text, picture) = (toml(&window), shown(&window));
        add(&mut window, kind);
        let added = toml(&window);
        assert_eq!(lights(&window).len(), 2);
        assert!(added.contains(&format!("kind = \"{kind}\"")), "{added}");
        assert!(window.viewer().document().fault().is_none());
        let lit = shown(&window);
        let brighter = lit.0.iter().zip(&picture.0).filter(|(new, old)| new[1] > old[1]).count();
        assert!(brighter * 10 > lit.0.len(), "{kind} shines on {brighter} pixels of {}", lit.0.len());
        window.undo();
        window.settle();
        assert!(toml(&window) == text && shown(&window) == picture, "{kind}: undo gives the old bytes");
        window.redo();
        window.settle();
        assert!(toml(&window) == added && shown(&window) == lit, "{kind}: redo");
        window.undo();
        window.settle();
        assert!(!window.viewer().document().can_undo(), "{kind}: one step");
    }
}

#[test]
fn a_light_with_every_default_counts_as_a_change() {
    let scene = "version = 1\nbase = \"front\"\n[image]\nwidth = 32\nheight = 18\n";
    let first = "[lights.a]\n";
    let open = |more: &str| Setup { scene: format!("{scene}{first}{more}"), ..with_list() }.open();
    let mut window = open("");
    window.press("Duplicate a");
    let document = window.viewer().document();
    let changed =
        taki::viewer::document::changed_keys(open("").viewer().document().values(), document.values());
    assert_eq!(changed, ["lights.a-2.kind"]);
    assert!(document.is_changed());
    window.press("Remove a-2");
    assert!(!window.viewer().document().is_changed());
}

#[test]
fn the_last_light_is_removed_and_comes_back() {
    let mut window = with_list().open();
    let (text, picture) = (toml(&window), shown(&window));
    window.press("Remove sun");
    window.settle();
    assert!(lights(&window).is_empty() && !toml(&window).contains("[lights"));
    assert!(window.reads("No lights except the surroundings"));
    assert!(window.viewer().document().fault().is_none() && window.viewer().document().is_changed());
    let dark = shown(&window);
    assert!(dark.0.iter().zip(&picture.0).all(|(new, old)| new[1] <= old[1]) && dark.0 != picture.0);
    // No light is left that a drag could turn.
    window.key(Key::L);
    let centre = window.image_rect().center();
    window.drag(centre, egui::vec2(40.0, 10.0), Modifiers::NONE);
    assert!(lights(&window).is_empty());
    window.undo();
    window.settle();
    assert!(toml(&window) == text && shown(&window) == picture);
    window.press("Remove sun");
    add(&mut window, "directional");
    assert_eq!(lights(&window), ["sun"], "its name is free");
    window.press("Reset Lights");
    window.settle();
    assert!(toml(&window) == text && !window.viewer().document().is_changed());
}

#[test]
fn names_of_new_lights_and_copies_never_collide() {
    let mut some = values(&[]);
    let mut seen = BTreeSet::new();
    let wanted = ["sun", "sun-2", "point", "7", "a-b", "-3", "x-", "x-007", "滝", "sun-99999999999999999999"];
    for round in 0..7 {
        for name in wanted {
            let free = edit::free_name(&some, name);
            assert!(seen.insert(free.clone()), "{free} twice");
            assert!(round > 0 || free == name, "a free name is kept: {free} for {name}");
            some.set(&format!("lights.{free}.kind"), &point(), &Place("test".into())).expect("a light");
            assert_eq!(some.names("lights").len(), seen.len(), "{free} is a light of its own");
        }
    }
    let some = values(&[("lights.sun.kind", point()), ("lights.sun-2.kind", point())]);
    assert_eq!(edit::free_name(&some, "sun-2"), "sun-3", "a copy of a copy goes on counting");
    assert!(seen.contains("sun-3") && seen.contains("point-2") && seen.contains("7-2"), "{seen:?}");
}

#[test]
fn a_copy_is_alike_and_its_own() {
    let mut window = with_list().open();
    let text = toml(&window);
    window.set("lights.sun.color", Raw::List([1.0, 0.5, 3.0].map(Raw::Float).into()));
    window.harness.run_steps(2);
    window.press("Duplicate sun");
    assert_eq!(lights(&window), ["sun", "sun-2"]);
    for what in ["kind", "direction", "color", "intensity"] {
        assert_eq!(
            window.value(&format!("lights.sun-2.{what}")),
            window.value(&format!("lights.sun.{what}"))
        );
    }
    window.set("lights.sun-2.intensity", Raw::Float(9.0));
    assert!(window.float("lights.sun.intensity") != 9.0);
    (0..3).for_each(|_| window.undo());
    assert_eq!(toml(&window), text);
}

#[test]
fn a_light_is_renamed_in_the_list() {
    let mut window = with_list().open();
    let text = toml(&window);
    window.press("Light sun");
    window.press("Rename sun");
    window.enter("Name of sun", "  key light ");
    window.key(Key::Enter);
    assert_eq!(lights(&window), ["key light"]);
    assert_eq!(toml(&window), text.replace("[lights.sun]", "[lights.\"key light\"]"));
    assert_eq!(window.harness.query_all_by_label("Dial of key light").count(), 1, "it stays selected");
    window.undo();
    assert_eq!(toml(&window), text);
}

#[test]
fn a_name_that_is_taken_or_no_name_is_refused_with_the_reason() {
    let mut window = with_list().open();
    add(&mut window, "point");
    let text = toml(&window);
    for (name, why) in
        [("sun", "another light is named sun"), ("", "a light needs a name"), ("a.b", "cannot contain dots")]
    {
        window.press("Rename point");
        window.enter("Name of point", name);
        window.key(Key::Enter);
        window.harness.run_steps(2);
        assert!(window.reads(why), "{why}");
        assert_eq!(toml(&window), text, "{name:?}");
        window.key(Key::Escape);
        window.harness.run_steps(2);
        assert!(window.harness.query_by_label("Name of point").is_none(), "Escape keeps the name");
    }
    assert_eq!(lights(&window), ["point", "sun"]);
}

#[test]
fn tracks_go_with_their_light() {
    let track = |key: &str| {
        let list = |x: f64, y: f64| Raw::List(vec![Raw::Float(x), Raw::Float(y)]);
        [
            ("key", Raw::Text(key.into())),
            ("frames", Raw::List(vec![Raw::Int(0), Raw::Int(9)])),
            ("values", list(1.0, 2.0)),
        ]
    };
    let mut some = values(&[("lights.sun.kind", point()), ("lights.sun-2.kind", point())]);
    for (i, key) in ["lights.sun.intensity", "curves.h", "lights.sun-2.intensity"].into_iter().enumerate() {
        for (what, raw) in track(key) {
            some.set(&format!("animate.tracks.{i}.{what}"), &raw, &Place("test".into())).expect("a track");
        }
    }
    let keys = |values: &Values| -> Vec<String> {
        let names = values.names("animate.tracks").into_iter();
        names.map(|i| values.text(&format!("animate.tracks.{i}.key"))).collect()
    };
    let renamed = edit::rename(&some, "sun", "moon").expect("a free name");
    assert_eq!(keys(&renamed), ["lights.moon.intensity", "curves.h", "lights.sun-2.intensity"]);
    let left = edit::remove(&some, "sun");
    assert_eq!(keys(&left), ["curves.h", "lights.sun-2.intensity"]);
    let (more, copy) = edit::duplicate(&some, "sun");
    assert_eq!((keys(&more), copy.as_str()), (keys(&some), "sun-3"));
    assert!(edit::rename(&renamed, "moon", "sun").expect("a free name") == some);
}

#[test]
fn a_light_switched_off_and_on_is_as_bright_as_before() {
    let mut window = with_list().open();
    let (text, picture) = (toml(&window), shown(&window));
    window.set("lights.sun.intensity", Raw::Float(2.75));
    window.harness.run_steps(2);
    window.press("Switch sun off");
    assert_eq!(window.float("lights.sun.intensity"), 0.0);
    window.press("Duplicate sun");
    window.press("Switch sun-2 on");
    assert_eq!(window.float("lights.sun-2.intensity"), 2.75, "a copy remembers too");
    window.undo();
    window.undo();
    window.press("Switch sun on");
    assert_eq!(window.float("lights.sun.intensity"), 2.75);
    window.undo();
    assert_eq!(window.float("lights.sun.intensity"), 0.0, "one step");
    window.undo();
    assert_eq!(window.float("lights.sun.intensity"), 2.75);
    window.undo();
    window.settle();
    assert!(toml(&window) == text && shown(&window) == picture);
}

#[test]
fn a_light_shows_the_parameters_of_its_kind_only() {
    let mut window = with_list().open();
    let parts = |window: &Window, light: &str| -> BTreeSet<String> {
        let roles = [Role::Slider, Role::SpinButton, Role::ComboBox, Role::ColorWell];
        let names = roles.into_iter().flat_map(|role| window.names(role));
        let of_light =
            names.filter_map(|name| Some(name.strip_prefix(&format!("lights.{light}."))?.to_owned()));
        of_light.map(|what| what.split(' ').next().unwrap_or("").to_owned()).collect()
    };
    let set = |words: &[&str]| -> BTreeSet<String> { words.iter().map(ToString::to_string).collect() };
    assert_eq!(parts(&window, "sun"), set(&["kind", "direction", "color", "intensity"]));
    window.choose("lights.sun.kind", "point");
    assert_eq!(parts(&window, "sun"), set(&["kind", "position", "color", "intensity"]));
    window.choose("lights.sun.kind", "spot");
    let all = ["kind", "direction", "position", "angle", "softness", "color", "intensity"];
    assert_eq!(parts(&window, "sun"), set(&all));
    window.undo();
    window.undo();
    assert_eq!(parts(&window, "sun"), set(&["kind", "direction", "color", "intensity"]));
}

#[test]
fn of_a_thousand_lights_those_in_sight_are_laid_out() {
    let mut scene: String = SCENE.into();
    for i in 0..1000 {
        scene += &format!("[lights.l{i}]\nkind = \"point\"\nintensity = 0.0\n");
    }
    let mut window = Setup { scene, size: [700.0, 1800.0], ..with_list() }.open();
    let drawn = window.names(Role::Button).iter().filter(|name| name.starts_with("Remove l")).count();
    assert!(drawn > 3 && drawn < 200, "{drawn} of 1000 entries are laid out");
    assert_eq!(lights(&window).len(), 1001);
    add(&mut window, "spot");
    window.widget(Role::Button, "Remove spot");
    window.press("Remove spot");
    assert_eq!(lights(&window).len(), 1001);
}

#[test]
fn keys_rename_copy_and_remove_the_selected_light_only() {
    let mut window = with_list().open();
    let text = toml(&window);
    for (modifiers, key) in
        [(Modifiers::NONE, Key::Delete), (Modifiers::COMMAND, Key::D), (Modifiers::NONE, Key::F2)]
    {
        window.chord(modifiers, key);
        assert_eq!(toml(&window), text, "{key:?}: none is selected");
    }
    window.press("Light sun");
    window.chord(Modifiers::COMMAND, Key::D);
    assert_eq!(lights(&window), ["sun", "sun-2"]);
    window.key(Key::Delete);
    assert_eq!(lights(&window), ["sun"], "the copy was selected");
    window.key(Key::Delete);
    assert_eq!(lights(&window), ["sun"], "and none after it is gone");
    window.press("Light sun");
    window.key(Key::F2);
    window.enter("Name of sun", "moon");
    // While the field is edited, the key belongs to its text.
    window.key(Key::Delete);
    window.key(Key::Enter);
    assert_eq!(lights(&window), ["moon"]);
    window.undo();
    window.press("Light sun");
    window.press("Light sun");
    window.key(Key::Delete);
    assert_eq!(lights(&window), ["sun"], "a second click deselects");
}

#[test]
fn what_is_saved_holds_the_lights_as_they_are() {
    let mut window = with_list().open();
    add(&mut window, "point");
    window.press("Rename point");
    window.enter("Name of point", "tür \"7\"");
    window.key(Key::Enter);
    window.press("Remove sun");
    let file = window.path("mine.toml");
    window.harness.state_mut().document_mut().save(&file).expect("saved");
    let (text, values) = (toml(&window), window.viewer().document().values().clone());
    window.harness.state_mut().open(&file);
    window.settle();
    assert_eq!(toml(&window), text);
    assert_eq!(
        taki::viewer::document::changed_keys(&values, window.viewer().document().values()),
        Vec::<String>::new()
    );
    assert_eq!(lights(&window), ["tür \"7\""]);
}

#[test]
fn a_command_line_is_not_given_for_what_it_cannot_say() {
    let mut window = with_list().open();
    assert!(window.viewer().document().command_line().is_ok());
    window.press("Duplicate sun");
    window.chord(Modifiers::COMMAND | Modifiers::SHIFT, Key::C);
    assert!(window.reads("save the scene, then copy the command line"));
    window.press("Remove sun-2");
    assert!(window.viewer().document().command_line().is_ok());
    window.press("Remove sun");
    let line = window.viewer().document().command_line().expect("a line");
    assert!(line.ends_with(" --remove lights"), "{line}");
}

#[test]
fn the_list_fits_the_narrowest_window() {
    for width in [420.0, 480.0, 760.0, 1600.0] {
        let mut setup = Setup { size: [width, 700.0], ..Setup::default() };
        setup.scene += "[lights.\"a light with a very long name indeed, longer than the panel\"]\n";
        let mut window = setup.open();
        window.press("Light sun");
        let panel = window.widget(Role::TextInput, "Search parameters").rect();
        let button = |label: &str| window.widget(Role::Button, label).rect();
        for light in lights(&window) {
            let words = ["Switch # off", "Light #", "Rename #", "Duplicate #", "Remove #"];
            let mut rects: Vec<Rect> = words.iter().map(|w| button(&w.replace('#', &light))).collect();
            rects.push(window.widget(Role::ColorWell, &format!("Colour of {light}")).rect());
            rects.sort_by(|a, b| a.left().total_cmp(&b.left()));
            for pair in rects.windows(2) {
                assert!(pair[0].right() <= pair[1].left() + 0.1, "{width}: {light}: {pair:?} overlap");
                let apart = (pair[0].center().y - pair[1].center().y).abs();
                assert!(apart < 4.0, "{width}: {light}: one line");
            }
            let last = rects.last().expect("rects");
            assert!(last.right() <= panel.left() + 560.0 && last.right() <= width, "{width}: {last:?}");
            assert!(rects[0].left() >= 0.0);
        }
        assert_eq!(window.harness.unnamed_widgets(), Vec::<String>::new());
    }
}
