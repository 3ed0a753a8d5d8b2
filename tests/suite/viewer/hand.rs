//! Camera, light and time, changed with the mouse.

use glam::DVec3;

use super::*;

struct Camera {
    eye: DVec3,
    target: DVec3,
    right: DVec3,
    up: DVec3,
}

fn camera(window: &Window) -> Camera {
    let (eye, target) = (window.point("camera.eye"), window.point("camera.target"));
    let forward = (target - eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    Camera { eye, target, right, up: right.cross(forward) }
}

const RIGHT: Vec2 = egui::vec2(40.0, 0.0);
const UP: Vec2 = egui::vec2(0.0, -30.0);

#[test]
fn an_orbit_turns_the_scene_with_the_pointer_and_is_one_step() {
    let mut window = Setup::bare().open();
    let centre = window.image_rect().center();
    for (drag, axis) in [(RIGHT, 0), (UP, 1)] {
        let before = camera(&window);
        window.drag(centre, drag, Modifiers::NONE);
        let after = camera(&window);
        let moved = after.eye - before.eye;
        let along = [moved.dot(before.right), moved.dot(before.up)][axis];
        assert!(along < -0.5, "the eye goes the other way: {moved}");
        assert_eq!(after.target, before.target);
        let distance = |c: &Camera| c.eye.distance(c.target);
        assert!((distance(&after) - distance(&before)).abs() < 1e-3, "it stays as far away");
        window.undo();
        assert_eq!(camera(&window).eye, before.eye);
        assert!(!window.viewer().document().can_undo());
    }
}

#[test]
fn an_orbit_over_the_pole_stops_short_of_it() {
    let mut window = Setup::bare().open();
    let centre = window.image_rect().center();
    for _ in 0..6 {
        window.drag(centre, -UP * 2.5, Modifiers::NONE);
    }
    let c = camera(&window);
    let up = (c.eye - c.target).normalize().y;
    assert!(up > 0.99 && up < 1.0, "{up}");
    window.settle();
    assert!(window.viewer().document().fault().is_none());
}

#[test]
fn a_pan_takes_the_scene_along() {
    let mut window = Setup::bare().open();
    let rect = window.image_rect();
    for (drag, modifiers, tool) in
        [(RIGHT, Modifiers::SHIFT, Key::O), (RIGHT, Modifiers::NONE, Key::P), (UP, Modifiers::NONE, Key::P)]
    {
        window.key(tool);
        let before = camera(&window);
        window.drag(rect.center(), drag, modifiers);
        let after = camera(&window);
        let moved = after.target - before.target;
        assert!((after.eye - before.eye - moved).length() < 1e-4, "eye and target move alike");
        // The point in the target's plane under the pointer stays under it.
        let away = before.eye.distance(before.target);
        let fov = window.float("camera.fov").to_radians();
        let metres = 2.0 * (fov / 2.0).tan() * away / f64::from(rect.height());
        let want = -before.right * f64::from(drag.x) * metres + before.up * f64::from(drag.y) * metres;
        assert!((moved - want).length() < 0.01 * want.length(), "{moved} for {want}");
        window.undo();
    }
}

#[test]
fn a_pan_far_from_the_origin_moves_as_smoothly() {
    let pan = |by: DVec3| {
        let mut setup = Setup::bare();
        let list = |p: DVec3| format!("[{:?}, {:?}, {:?}]", p.x, p.y, p.z);
        let points = [DVec3::new(0.3, 0.2, 8.0), DVec3::new(0.1, 0.0, 0.0)].map(|p| list(by + p));
        setup.sets = vec![format!("camera.eye={}", points[0]), format!("camera.target={}", points[1])];
        let mut window = setup.open();
        let centre = window.image_rect().center();
        window.drag(centre, RIGHT, Modifiers::SHIFT);
        camera(&window).target - by
    };
    // A float32 would round the target to whole metres there.
    let (home, far) = (pan(DVec3::ZERO), pan(DVec3::new(9.5e6, -2e6, 9.5e6)));
    assert!(home.distance(DVec3::new(0.1, 0.0, 0.0)) > 0.1, "{home}");
    assert!(home.distance(far) < 1e-5, "{home} and {far}");
}

fn scroll(window: &mut Window, lines: f32) {
    window.harness.hover_at(window.image_rect().center());
    window.harness.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: egui::vec2(0.0, lines),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Wheel,
        modifiers: Modifiers::NONE,
    });
    // A step of the wheel is spread over some frames.
    window.harness.run_steps(20);
}

#[test]
fn the_wheel_zooms_home_restores_and_f_frames_all() {
    let mut window = Setup::bare().open();
    let first = camera(&window);
    let far = first.eye.distance(first.target);
    scroll(&mut window, 3.0);
    let near = camera(&window);
    assert!(near.eye.distance(near.target) < 0.95 * far, "forward brings the eye nearer");
    assert_eq!(near.target, first.target);
    scroll(&mut window, -6.0);
    let c = camera(&window);
    assert!(c.eye.distance(c.target) > near.eye.distance(near.target));
    window.key(Key::Home);
    assert_eq!((camera(&window).eye, camera(&window).target), (first.eye, first.target));
    scroll(&mut window, 20.0);
    window.key(Key::F);
    let c = camera(&window);
    let forward = (c.target - c.eye).normalize();
    let tan = (window.float("camera.fov").to_radians() / 2.0).tan();
    let scene = window.viewer().document().scene().clone();
    let corners: Vec<DVec3> = scene.quads.iter().flat_map(|q| q.corners).map(|p| p.as_dvec3()).collect();
    let reach = corners.iter().map(|corner| {
        let d = *corner - c.eye;
        let deep = d.dot(forward) * tan;
        (d.dot(c.right) / deep / f64::from(ASPECT)).abs().max((d.dot(c.up) / deep).abs())
    });
    let reach = reach.fold(0.0, f64::max);
    assert!(reach < 1.0, "a corner lies at {reach} of the half image");
    assert!(reach > 0.2, "and the scene fills some of it");
}

#[test]
fn a_wheel_step_is_one_step_of_undo() {
    let mut window = Setup::bare().open();
    let first = camera(&window).eye;
    scroll(&mut window, 3.0);
    window.undo();
    assert_eq!(camera(&window).eye, first, "one turn of the wheel, one undo");
}

#[test]
fn the_light_follows_the_pointer() {
    let mut window = Setup::bare().open();
    let centre = window.image_rect().center();
    let key = "lights.sun.direction";
    for (drag, modifiers, tool) in [
        (RIGHT, Modifiers::COMMAND, Key::O),
        (RIGHT, Modifiers::NONE, Key::L),
        (UP * -1.0, Modifiers::NONE, Key::L),
    ] {
        window.key(tool);
        let c = camera(&window);
        let before = window.point(key).normalize();
        window.drag(centre, drag, modifiers);
        let after = window.point(key);
        assert!((after.length() - 1.0).abs() < 1e-5);
        match drag.x > 0.0 {
            true => assert!(after.dot(c.right) > before.dot(c.right) + 0.05, "to the right: {after}"),
            false => assert!(after.dot(c.up) < before.dot(c.up) - 0.05, "down: {after}"),
        }
        assert_eq!(camera(&window).eye, c.eye, "the camera stays");
        window.undo();
        assert!((window.point(key).normalize() - before).length() < 1e-6);
    }
}

#[test]
fn the_water_plays_and_pauses_without_steps_of_undo() {
    let mut window = Setup::bare().open();
    window.set("trace.sigma", Raw::Float(4.0));
    window.settle();
    window.key(Key::Space);
    let first = window.picture().frame.radiance.clone();
    window.until("the flow", |viewer| viewer.document().values().float("volume.flow") > 0.05);
    assert!(window.harness.query_by_label("Pause the water").is_some());
    window.key(Key::Space);
    window.settle();
    let flow = window.float("volume.flow");
    assert!(flow > 0.0 && flow < 1.0 && window.picture().frame.radiance != first);
    window.harness.run_steps(5);
    assert_eq!(window.float("volume.flow"), flow, "paused");
    window.undo();
    assert_eq!(window.float("trace.sigma"), 3.0, "the step before the water moved");
    assert!(!window.viewer().document().can_undo());
}

#[test]
fn the_edge_and_the_outside_of_the_picture_are_safe_to_drag() {
    let mut window = Setup::bare().open();
    let rect = window.image_rect();
    for from in [rect.min, rect.max, rect.left_bottom()] {
        for tool in [Key::O, Key::P, Key::L, Key::I] {
            window.key(tool);
            window.drag(from, egui::vec2(900.0, -700.0), Modifiers::NONE);
            window.drag(from, egui::vec2(-900.0, 700.0), Modifiers::NONE);
        }
    }
    window.settle();
    assert!(window.viewer().document().fault().is_none());
}
