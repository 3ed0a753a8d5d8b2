//! The parameter panel: every value has a widget, and each widget changes the document.

use super::*;
use taki::scene::{Kind, Param, Values};

/// A window with all groups and all corners open.
fn open_groups() -> Window {
    let mut window = Setup::default().open();
    // Every description ends with a full stop, so this search finds all.
    window.enter("Search parameters", ".");
    let closed: Vec<_> = window.harness.query_all_by_label_contains("corners").collect();
    closed.iter().for_each(|header| header.click_accesskit());
    drop(closed);
    window.harness.run_steps(2);
    window
}

fn values(window: &Window) -> Values {
    window.viewer().document().values().clone()
}

/// All keys, except those of lights that have no meaning for their kind, and those of volumes that their
/// builder does not take.
fn keys(window: &Window) -> Vec<(String, &'static Param)> {
    let keys = window.viewer().document().scene().keys();
    let shown = |key: &String| {
        if taki::scene::is_of_other_builder(window.viewer().document().values(), key) {
            return false;
        }
        let mut parts = key.split('.');
        let (Some("lights"), Some(light), Some(what)) = (parts.next(), parts.next(), parts.next()) else {
            return true;
        };
        let kind = window.viewer().document().values().text(&format!("lights.{light}.kind"));
        taki::viewer::lights::edit::takes(&kind, what)
    };
    keys.into_iter().filter(shown).map(|key| (key.clone(), Param::find(&key).expect("a parameter"))).collect()
}

/// Whether the value is a name that the scene has.
fn is_name(key: &str) -> bool {
    key.ends_with(".material") || key.starts_with("materials.") && key.ends_with(".volume")
}

/// Whether a number has a slider, not just a number field.
fn has_slider(param: &Param) -> bool {
    match param.kind {
        Kind::Float(..) => true,
        Kind::Int(_, max, _) => param.slider.is_some() || max <= 64,
        _ => false,
    }
}

#[test]
fn every_parameter_has_a_widget_of_its_name() {
    let window = open_groups();
    let axes = ["x", "y", "z"];
    let mut count = 0;
    for (key, param) in keys(&window) {
        let wanted: Vec<(Role, String)> = match param.kind {
            Kind::Float(..) | Kind::Int(..) if has_slider(param) => vec![(Role::Slider, key.clone())],
            Kind::Float(..) | Kind::Int(..) => vec![(Role::SpinButton, key.clone())],
            Kind::Choice(_) => vec![(Role::ComboBox, key.clone())],
            Kind::Switch(_) => vec![(Role::CheckBox, key.clone())],
            Kind::Text(_) if is_name(&key) => vec![(Role::ComboBox, key.clone())],
            Kind::Text(_) => vec![(Role::TextInput, key.clone())],
            Kind::Color(_) => vec![(Role::ColorWell, key.clone())],
            Kind::Point(_) => axes.map(|axis| (Role::SpinButton, format!("{key} {axis}"))).into(),
            // These belong to keyframes, which no preset has.
            Kind::Frames | Kind::Series => Vec::new(),
            Kind::Corners => {
                let names = ["A", "B", "C", "D"].into_iter();
                let names = names.flat_map(|c| axes.map(|axis| format!("{key} {c} {axis}")));
                names.map(|name| (Role::SpinButton, name)).collect()
            }
        };
        for (role, name) in wanted {
            window.widget(role, &name);
            count += 1;
        }
    }
    assert!(count > 200, "{count} widgets");
    assert_eq!(window.harness.unnamed_widgets(), Vec::<String>::new());
}

/// A value slightly away from `now` on a slider from `low` to `high`.
fn another(now: f64, low: f64, high: f64, whole: bool) -> f64 {
    let step = if whole { 1.0 } else { ((high - low) * 0.01 * 1e3).round().max(1.0) / 1e3 };
    if now + step <= high { now + step } else { now - step }
}

#[test]
fn every_slider_changes_its_value_and_undo_restores_all_values() {
    let mut window = open_groups();
    let first = values(&window);
    let mut count = 0;
    for (key, param) in keys(&window) {
        let (min, max) = match param.kind {
            Kind::Float(min, max, _) => (min, max),
            Kind::Int(min, max, _) => (min as f64, max as f64),
            _ => continue,
        };
        let (low, high) = param.slider.unwrap_or((min, max));
        let whole = matches!(param.kind, Kind::Int(..));
        let now = match window.value(&key) {
            Value::Float(x) => x,
            Value::Int(x) => x as f64,
            other => panic!("{key}: {other:?}"),
        };
        let new = another(now, low, high, whole);
        let role = if has_slider(param) { Role::Slider } else { Role::SpinButton };
        window.widget(role, &key).set_value_accesskit(new);
        window.harness.run_steps(2);
        let got = match window.value(&key) {
            Value::Float(x) => x,
            Value::Int(x) => x as f64,
            other => panic!("{key}: {other:?}"),
        };
        assert!(got != now && (got - new).abs() <= 1e-3 * new.abs().max(0.1), "{key}: {got} for {new}");
        let changed = taki::viewer::document::changed_keys(&first, &values(&window));
        assert_eq!(changed, [key.as_str()], "nothing else changes");
        window.undo();
        assert!(values(&window) == first, "undo of {key}");
        count += 1;
    }
    assert!(count > 50, "{count} numbers");
}

#[test]
fn every_point_and_corner_changes_and_undo_restores_it() {
    let mut window = open_groups();
    let first = values(&window);
    let names: Vec<String> = window.names(Role::SpinButton);
    let spins = names.iter().filter(|name| [" x", " y", " z"].iter().any(|axis| name.ends_with(axis)));
    let mut count = 0;
    for name in spins {
        let key = name.split(' ').next().expect("a key");
        window.widget(Role::SpinButton, name).increment_accesskit();
        window.harness.run_steps(2);
        assert_ne!(window.value(key), first.get(key), "{name}");
        window.undo();
        assert!(values(&window) == first, "undo of {name}");
        count += 1;
    }
    assert!(count > 150, "{count} coordinates");
}

#[test]
fn the_angles_of_a_light_turn_it_and_nothing_else_does() {
    let mut window = open_groups();
    let first = window.point("lights.sun.direction");
    window.widget(Role::Slider, "lights.sun.direction azimuth").set_value_accesskit(90.0);
    window.harness.run_steps(3);
    let turned = window.point("lights.sun.direction");
    assert!(turned.x > 0.3 && turned.z.abs() < 1e-3, "{turned}");
    assert!((turned.y - first.normalize().y).abs() < 1e-3, "the height stays: {turned}");
    window.widget(Role::Slider, "lights.sun.direction elevation").set_value_accesskit(0.0);
    window.harness.run_steps(3);
    assert!(window.point("lights.sun.direction").y.abs() < 1e-3);
    window.undo();
    window.undo();
    assert_eq!(window.point("lights.sun.direction"), first);
    assert!(!window.viewer().document().can_undo(), "a slider that rounds is no change");
}

#[test]
fn every_choice_and_material_can_be_chosen() {
    let mut window = open_groups();
    let first = values(&window);
    for (key, param) in keys(&window) {
        let Kind::Choice(words) = param.kind else { continue };
        let Value::Text(now) = window.value(&key) else { panic!("{key} is a word") };
        for word in words.iter().filter(|word| **word != now) {
            window.choose(&key, word);
            assert_eq!(window.value(&key), Value::Text((*word).into()));
            window.undo();
            assert!(values(&window) == first, "undo of {key}");
        }
    }
    window.widget(Role::ComboBox, "quads.3.material");
}

#[test]
fn a_typed_number_is_taken_when_the_field_is_left_and_may_lie_beyond_the_slider() {
    let mut window = open_groups();
    for (text, want) in [("17.5", 17.5), ("0,5", 0.5), ("450", 450.0), ("-3", 0.0)] {
        window.widget(Role::SpinButton, "trace.sigma").focus();
        window.harness.run_steps(2);
        window.chord(Modifiers::COMMAND, Key::A);
        window.harness.event(egui::Event::Text(text.into()));
        window.harness.step();
        let before = window.float("trace.sigma");
        window.key(Key::Enter);
        assert_ne!(before, want, "half a number is not accepted");
        assert_eq!(window.float("trace.sigma"), want);
    }
}

#[test]
fn arrow_keys_move_a_slider_that_has_the_focus() {
    let mut window = open_groups();
    let before = window.float("volume.alpha");
    window.widget(Role::Slider, "volume.alpha").focus();
    window.harness.run_steps(2);
    window.key(Key::ArrowRight);
    assert!(window.float("volume.alpha") > before);
    window.key(Key::ArrowLeft);
    assert!((window.float("volume.alpha") - before).abs() < 1e-3);
}

#[test]
fn the_dice_give_another_seed() {
    let mut window = open_groups();
    let names = window.names(Role::Button);
    let dice: Vec<&String> = names.iter().filter(|name| name.starts_with("Dice ")).collect();
    assert_eq!(dice.len(), 5, "the volume's and four rocks': {dice:?}");
    for name in dice {
        let key = name.trim_start_matches("Dice ");
        let before = window.value(key);
        window.press(name);
        assert_ne!(window.value(key), before, "{key}");
        window.undo();
        assert_eq!(window.value(key), before, "{key}");
    }
}

#[test]
fn a_colour_is_picked_and_undone() {
    let mut window = open_groups();
    let first = values(&window);
    window.enter("Search parameters", "light.ambient");
    window.widget(Role::ColorWell, "light.ambient").click();
    window.harness.run_steps(4);
    assert!(values(&window) == first, "looking at a colour does not change it");
    assert_eq!(window.harness.unnamed_widgets(), Vec::<String>::new());
    let red = window.names(Role::SpinButton).into_iter().find(|name| name == "R").expect("red");
    window.widget(Role::SpinButton, &red).set_value_accesskit(200.0);
    window.harness.run_steps(3);
    let Value::Triple([red, green, blue]) = window.value("light.ambient") else { panic!("a colour") };
    assert!((0.5..0.65).contains(&red), "200 of sRGB's 255 is {red}");
    assert!((green - 0.1).abs() < 1e-3 && (blue - 0.12).abs() < 1e-3, "{green} {blue}");
    window.key(Key::Escape);
    window.undo();
    assert!(values(&window) == first);
}

#[test]
fn a_drag_of_a_slider_is_one_step() {
    let mut window = Setup::default().open();
    let first = values(&window);
    let at = window.widget(Role::Slider, "curves.h").rect();
    let from = pos2(at.left() + at.width() * 0.3, at.center().y);
    window.drag(from, egui::vec2(30.0, 0.0), Modifiers::NONE);
    let dragged = window.float("curves.h");
    window.drag(from, egui::vec2(-10.0, 0.0), Modifiers::NONE);
    let again = window.float("curves.h");
    assert!(dragged != again && again < dragged, "{dragged} then {again}");
    window.undo();
    assert_eq!(window.float("curves.h"), dragged, "the second drag");
    window.undo();
    assert!(values(&window) == first, "the first drag");
    window.redo();
    window.redo();
    assert_eq!(window.float("curves.h"), again, "both again");
}

#[test]
fn what_is_changed_is_marked_and_goes_back_one_by_one_or_by_groups() {
    let mut window = open_groups();
    let first = values(&window);
    let reset = |window: &Window| -> Vec<String> {
        window.names(Role::Button).into_iter().filter(|name| name.starts_with("Reset ")).collect()
    };
    assert!(reset(&window).is_empty());
    window.set("curves.h", Raw::Float(0.2));
    window.set("curves.across", Raw::Int(9));
    window.set("light.p", Raw::Float(3.0));
    window.harness.run_steps(2);
    let marked = ["Reset Curves", "Reset curves.across", "Reset curves.h", "Reset Light", "Reset light.p"];
    assert_eq!(reset(&window), marked);
    window.press("Reset curves.h");
    assert_eq!(window.value("curves.h"), first.get("curves.h"));
    assert_eq!(window.value("curves.across"), Value::Int(9));
    window.undo();
    assert_eq!(window.float("curves.h"), f64::from(0.2f32));
    window.press("Reset Curves");
    assert_eq!(taki::viewer::document::changed_keys(&first, &values(&window)), ["light.p"]);
    window.press("Reset light.p");
    assert!(values(&window) == first && !window.viewer().document().is_changed());
}

#[test]
fn what_belongs_to_one_light_or_rock_stands_together() {
    let mut setup = Setup::default();
    setup.scene += "\n[lights.moon]\ncolor = [0.2, 0.3, 0.6]\n";
    let mut window = setup.open();
    for section in ["lights", "rocks"] {
        window.enter("Search parameters", section);
        let all = window.names(Role::Slider);
        let owners =
            all.iter().filter(|name| name.starts_with(section)).filter_map(|name| name.split('.').nth(1));
        let mut runs: Vec<&str> = owners.collect();
        runs.dedup();
        let mut once = runs.clone();
        once.sort_unstable();
        once.dedup();
        assert!(runs.len() > 1 && runs.len() == once.len(), "{section}: {runs:?}");
    }
}

#[test]
fn the_search_shows_matches_only() {
    let mut window = open_groups();
    let shown = |window: &Window| window.names(Role::Slider);
    window.enter("Search parameters", "sigma");
    assert!(shown(&window).contains(&"trace.sigma".to_owned()));
    assert!(!shown(&window).contains(&"curves.h".to_owned()));
    window.enter("Search parameters", "upload roughness");
    let found = shown(&window);
    let rocks = found.iter().filter(|name| name.ends_with(".h") && name.starts_with("rocks.")).count();
    assert_eq!(rocks, 4, "cost and description are searched: {found:?}");
    window.enter("Search parameters", "glassy threads");
    let found = shown(&window);
    let has = |key: &str| found.iter().any(|name| name == key);
    assert!(has("curves.h") && !has("curves.amplitude"), "its advice is searched: {found:?}");
    window.enter("Search parameters", "no such thing");
    assert!(window.reads("No parameter matches"));
    window.press("✖");
    assert!(shown(&window).contains(&"curves.h".to_owned()));
}

#[test]
fn hovering_a_name_tells_what_the_parameter_is_and_when_to_turn_it() {
    let mut window = open_groups();
    window.enter("Search parameters", "glassy threads");
    window.harness.get_by_label("h").hover();
    window.harness.run_steps(60);
    let param = Param::find("curves.h").expect("a parameter");
    assert!(window.reads(param.doc) && window.reads(param.when));
}
