//! Lights that are dragged in the picture.

use super::*;
use glam::DVec3;
use taki::viewer::navigate::Pose;

const LAMP: &str = r#"
[lights.lamp]
kind = "point"
position = [0.5, 1.0, 2.0]
intensity = 3.0
"#;

/// A window with a lamp and a sun, and with room for the handles of both.
fn window(select: &str) -> Window {
    let mut setup = Setup { size: [1000.0, 700.0], ..Setup::default() };
    setup.scene += LAMP;
    let mut window = setup.open();
    if !select.is_empty() {
        window.press(&format!("Light {select}"));
    }
    window
}

fn pose(window: &Window) -> Pose {
    Pose::of(window.viewer().document().values())
}

fn depth(window: &Window, point: DVec3) -> f64 {
    let pose = pose(window);
    (point - pose.eye).dot((pose.target - pose.eye).normalize())
}

fn handle(window: &Window, label: &str) -> Rect {
    window.harness.get_by_label(label).rect()
}

const LAMP_AT: &str = "lights.lamp.position";
const SUN_TO: &str = "lights.sun.direction";

#[test]
fn a_dragged_lamp_stays_under_the_pointer_and_at_its_depth() {
    let mut window = window("lamp");
    let text = window.viewer().document().scene().to_toml();
    for by in [egui::vec2(60.0, 0.0), egui::vec2(0.0, 45.0), egui::vec2(-33.0, -21.0)] {
        let (from, before) = (handle(&window, "Handle of lamp").center(), window.point(LAMP_AT));
        // A handle that is grabbed off its centre does not jump.
        window.drag(from + egui::vec2(4.0, -3.0), by, Modifiers::NONE);
        let (to, after) = (handle(&window, "Handle of lamp").center(), window.point(LAMP_AT));
        // Positions are float32 metres in a scene of ten metres: a thousandth of a point.
        assert!((to - from - by).length() < 0.01, "{to} for {}", from + by);
        assert!((depth(&window, after) - depth(&window, before)).abs() < 1e-5, "the plane of the image");
        let (moved, pose) = (after - before, pose(&window));
        let metres =
            2.0 * pose.tan_half_fov * depth(&window, before) / f64::from(window.image_rect().height());
        let want = f64::from(by.length()) * metres;
        // The harness computes the picture's height without rounding to whole points.
        assert!((moved.length() - want).abs() < 0.01 * want, "{moved} for {want} m");
        assert_eq!(window.point("camera.eye"), pose.eye, "the camera stays");
        window.undo();
        assert_eq!(window.viewer().document().scene().to_toml(), text, "one drag is one step");
        assert!(!window.viewer().document().can_undo());
    }
}

#[test]
fn with_shift_a_lamp_moves_along_the_line_of_sight() {
    let mut window = window("lamp");
    let (from, before) = (handle(&window, "Handle of lamp").center(), window.point(LAMP_AT));
    let height = window.image_rect().height();
    let mut last = depth(&window, before);
    for up in [40.0, -90.0] {
        let start = handle(&window, "Handle of lamp").center();
        window.drag(start, egui::vec2(0.0, -up), Modifiers::SHIFT);
        let after = window.point(LAMP_AT);
        assert!(
            (handle(&window, "Handle of lamp").center() - from).length() < 0.01,
            "it stays at the same place in the picture"
        );
        let now = depth(&window, after);
        let want = (3.0 * f64::from(up / height)).exp();
        assert!((now / last / want - 1.0).abs() < 0.02, "{now} from {last}: up is away, e³ over the height");
        last = now;
    }
    window.undo();
    window.undo();
    assert_eq!(window.point(LAMP_AT), before);
}

#[test]
fn the_sun_is_turned_on_its_dial_under_the_pointer() {
    let mut window = window("sun");
    let before = window.point(SUN_TO);
    let dial = handle(&window, "Dial of sun");
    let radius = f64::from(dial.width() * 0.5);
    let pose = pose(&window);
    let forward = (pose.target - pose.eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    for by in [egui::vec2(20.0, 0.0), egui::vec2(0.0, -20.0), egui::vec2(-25.0, 25.0)] {
        window.drag(dial.center() + by * 0.2, by * 0.8, Modifiers::NONE);
        let after = window.point(SUN_TO);
        assert!((after.length() - 1.0).abs() < 1e-6, "unit");
        // The angle from the eye grows with the distance from the middle, up to 180° at the rim.
        let angle = f64::from(by.length()) / radius * std::f64::consts::PI;
        let across = (right * f64::from(by.x) - up * f64::from(by.y)).normalize();
        let want = across * angle.sin() - forward * angle.cos();
        assert!(after.distance(want) < 1e-5, "{after} for {want}");
        assert_eq!(window.point("camera.eye"), pose.eye);
        window.undo();
        assert_eq!(window.point(SUN_TO), before, "one drag is one step");
    }
    window.drag(dial.center(), egui::vec2(-900.0, 300.0), Modifiers::NONE);
    assert!(window.point(SUN_TO).distance(forward) < 1e-5, "beyond the rim the light comes from behind");
}

#[test]
fn previews_follow_while_a_handle_is_dragged() {
    let mut window = window("lamp");
    let from = handle(&window, "Handle of lamp").center();
    let mut last = window.picture().frame.radiance.clone();
    window.press_at(from, Modifiers::NONE);
    for step in 1..=3 {
        window.harness.hover_at(from + egui::vec2(30.0, -10.0) * step as f32);
        window.harness.step();
        window.settle();
        let now = window.picture().frame.radiance.clone();
        assert!(now != last, "step {step}");
        last = now;
    }
    assert!(window.reads("m deep") || !window.viewer().document().can_redo());
    window.release_at(from, Modifiers::NONE);
}

#[test]
fn beside_the_handles_a_drag_orbits_as_ever() {
    let mut window = window("lamp");
    window.key(Key::L);
    window.key(Key::O);
    let image = window.image_rect();
    let taken = [handle(&window, "Handle of lamp")];
    let mut count = 0;
    for y in [0.05, 0.3, 0.6, 0.95] {
        for x in [0.05, 0.35, 0.65, 0.95] {
            let at = image.min + image.size() * egui::vec2(x, y);
            if taken.iter().any(|rect| rect.expand(8.0).contains(at)) {
                continue;
            }
            let (eye, lamp) = (window.point("camera.eye"), window.point(LAMP_AT));
            window.drag(at, egui::vec2(12.0, 0.0), Modifiers::NONE);
            assert!(window.point("camera.eye") != eye, "from {at}");
            assert_eq!((window.point(LAMP_AT), window.point("camera.target")), (lamp, pose(&window).target));
            window.undo();
            count += 1;
        }
    }
    assert!(count > 12, "{count}");
}

#[test]
fn no_handle_is_shown_unless_a_light_is_selected_or_the_tool_is_in_hand() {
    let mut window = window("");
    let shown = |window: &Window| {
        ["Handle of lamp", "Dial of sun"].map(|label| window.harness.query_by_label(label).is_some())
    };
    assert_eq!(shown(&window), [false, false]);
    window.key(Key::L);
    assert_eq!(shown(&window), [true, true]);
    window.key(Key::O);
    window.press("Light lamp");
    assert_eq!(shown(&window), [true, false]);
    window.press("Light sun");
    assert_eq!(shown(&window), [false, true]);
    window.press("Light sun");
    assert_eq!(shown(&window), [false, false]);
    window.press("Light lamp");
    window.press("Remove lamp");
    assert_eq!(shown(&window), [false, false]);
    window.undo();
    assert_eq!(shown(&window), [false, false]);
}

#[test]
fn a_handle_clicked_with_the_tool_selects_its_light() {
    let mut window = window("");
    window.key(Key::L);
    let at = handle(&window, "Handle of lamp").center();
    window.press_at(at, Modifiers::NONE);
    window.release_at(at, Modifiers::NONE);
    window.key(Key::O);
    handle(&window, "Handle of lamp");
    assert!(!window.viewer().document().can_undo(), "a click moves nothing");
}

#[test]
fn a_lamp_out_of_sight_has_its_handle_at_the_border_and_can_be_brought_in() {
    let mut window = window("lamp");
    let image = window.image_rect();
    let pose = pose(&window);
    let forward = (pose.target - pose.eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    for away in [pose.target + right * 50.0, pose.eye - forward * 4.0 + right * 3.0, pose.eye] {
        window.set(LAMP_AT, Raw::List(away.to_array().map(Raw::Float).into()));
        window.harness.run_steps(2);
        let at = handle(&window, "Handle of lamp").center();
        assert!(image.contains(at), "{at} in {image}");
        window.drag(at, image.center() - at, Modifiers::NONE);
        let now = window.point(LAMP_AT);
        let (seen, deep) = (handle(&window, "Handle of lamp").center(), depth(&window, now));
        assert!(deep > 0.0 && (seen - image.center()).length() < 1.0, "{deep} m deep at {seen}");
        window.undo();
        window.undo();
    }
}

#[test]
fn a_selected_light_is_the_one_that_ctrl_and_drag_turns() {
    let mut setup = Setup { size: [1000.0, 700.0], ..Setup::default() };
    setup.scene += "[lights.moon]\ndirection = [0.0, 0.5, 1.0]\n";
    let mut window = setup.open();
    let drag = |window: &mut Window| {
        let (moon, sun) = (window.point("lights.moon.direction"), window.point(SUN_TO));
        let centre = window.image_rect().center();
        window.drag(centre, egui::vec2(40.0, 0.0), Modifiers::COMMAND);
        (window.point("lights.moon.direction") != moon, window.point(SUN_TO) != sun)
    };
    assert_eq!(drag(&mut window), (true, false), "the first by name");
    window.press("Light sun");
    assert_eq!(drag(&mut window), (false, true));
    window.press("Switch moon off");
    window.press("Light sun");
    assert_eq!(drag(&mut window), (false, true), "the first that shines");
}

#[test]
fn a_spot_light_is_aimed_by_the_point_it_shines_at() {
    let mut setup = Setup { size: [1000.0, 700.0], ..Setup::default() };
    setup.scene +=
        "[lights.spot]\nkind = \"spot\"\nposition = [1.5, 0.5, 3.0]\ndirection = [0.6, 0.4, 1.0]\n";
    let mut window = setup.open();
    window.press("Light spot");
    let text = window.viewer().document().scene().to_toml();
    let key = "lights.spot.direction";
    let position = window.point("lights.spot.position");
    let reach = position.distance(window.point("camera.target"));
    let aim = position - window.point(key).normalize() * reach;
    let from = handle(&window, "Aim of spot").center();
    let by = egui::vec2(-50.0, 30.0);
    window.drag(from, by, Modifiers::NONE);
    let direction = window.point(key);
    assert!((direction.length() - 1.0).abs() < 1e-6, "unit");
    assert!((handle(&window, "Aim of spot").center() - from - by).length() < 0.01, "under the pointer");
    // The new aim lies on the ray from the light against its direction, in the plane of the old aim.
    let forward = (window.point("camera.target") - window.point("camera.eye")).normalize();
    let along = (position - aim).dot(forward) / direction.dot(forward);
    let moved = position - direction * along - aim;
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let metres =
        2.0 * pose(&window).tan_half_fov * depth(&window, aim) / f64::from(window.image_rect().height());
    let want = (right * f64::from(by.x) - up * f64::from(by.y)) * metres;
    assert!((moved - want).length() < 0.01 * want.length(), "{moved} for {want}");
    assert_eq!(window.point("lights.spot.position"), position, "the light stays");
    window.undo();
    assert_eq!(window.viewer().document().scene().to_toml(), text);
    // The light keeps its direction when it is moved.
    let place = handle(&window, "Handle of spot").center();
    window.drag(place, egui::vec2(20.0, 10.0), Modifiers::NONE);
    assert!(window.point("lights.spot.position") != position);
    assert!(window.viewer().document().scene().to_toml().contains("direction = [0.6, 0.4, 1]"));
}
