//! Meshes that are moved, turned and sized in the picture, against a pinhole projection of the test's own.

use glam::{DMat3, DVec2, DVec3};
use taki::viewer::navigate::Pose;

use super::files::drop_on;
use super::meshes::toml;
use super::*;
use crate::model::Doc;

const POSITION: &str = "meshes.square.position";
const TURN: &str = "meshes.square.turn";
/// Middle of the square in the space of its file: not the origin.
const LOCAL: DVec3 = DVec3::new(0.5, 0.5, 0.0);

/// A window with a square, seen from above at an angle, whose handles are shown.
fn window() -> Window {
    let mut window = Setup { size: [1000.0, 700.0], ..Setup::default() }.open();
    let file = window.path("square.glb");
    std::fs::write(&file, Doc::square().glb()).expect("written");
    drop_on(&mut window, &file);
    look_from(&mut window, DVec3::new(1.9, 2.6, 3.4));
    window
}

fn look_from(window: &mut Window, eye: DVec3) {
    set(window, "camera.eye", eye);
    set(window, "camera.target", DVec3::new(0.4, 0.4, 0.1));
    window.harness.run_steps(2);
}

fn set(window: &mut Window, key: &str, point: DVec3) {
    window.set(key, Raw::List(point.to_array().map(Raw::Float).into()));
}

fn handle(window: &Window, label: &str) -> Pos2 {
    window.harness.get_by_label(label).rect().center()
}

/// Rectangle of the picture, which lies on whole points.
fn image(window: &Window) -> Rect {
    let rough = window.image_rect();
    let size = rough.size().round();
    Rect::from_min_size((rough.center() - size * 0.5).round(), size)
}

/// Eye, axes to the right, up and into the picture, and metres in a point of the window at a depth of 1 m.
struct Eye {
    eye: DVec3,
    axes: [DVec3; 3],
    metres: f64,
    centre: DVec2,
}

impl Eye {
    fn of(window: &Window) -> Eye {
        let pose = Pose::of(window.viewer().document().values());
        let forward = (pose.target - pose.eye).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let image = image(window);
        Eye {
            eye: pose.eye,
            axes: [right, right.cross(forward), forward],
            metres: 2.0 * pose.tan_half_fov / f64::from(image.height()),
            centre: DVec2::new(image.center().x.into(), image.center().y.into()),
        }
    }

    fn depth(&self, point: DVec3) -> f64 {
        (point - self.eye).dot(self.axes[2])
    }

    fn project(&self, point: DVec3) -> DVec2 {
        let d = point - self.eye;
        let metres = self.metres * self.depth(point);
        self.centre + DVec2::new(d.dot(self.axes[0]), -d.dot(self.axes[1])) / metres
    }

    /// Direction of the ray through a position in the window.
    fn ray(&self, at: Pos2) -> DVec3 {
        let d = (DVec2::new(at.x.into(), at.y.into()) - self.centre) * self.metres;
        self.axes[2] + self.axes[0] * d.x - self.axes[1] * d.y
    }

    /// Point of a plane that is seen at a position.
    fn on_plane(&self, at: Pos2, point: DVec3, normal: DVec3) -> DVec3 {
        let ray = self.ray(at);
        self.eye + ray * ((point - self.eye).dot(normal) / ray.dot(normal))
    }
}

/// The rotation of `meshes.*.turn`, written out: about x, then y, then z.
fn rotation(degrees: DVec3) -> DMat3 {
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x)
}

/// Middle of the square in the world.
fn middle(window: &Window) -> DVec3 {
    window.point(POSITION) + rotation(window.point(TURN)) * LOCAL * window.float("meshes.square.scale")
}

fn vec(by: DVec2) -> Vec2 {
    egui::vec2(by.x as f32, by.y as f32)
}

/// Numbers of a scene have the digits of a float32, and so have places in the window.
const ROUGH: f64 = 1e-3;

#[test]
fn the_middle_moves_parallel_to_the_picture_and_in_depth() {
    let mut window = window();
    let before = toml(&window);
    for by in [egui::vec2(60.0, 0.0), egui::vec2(-33.0, -41.0)] {
        let (from, start, eye) =
            (handle(&window, "Handle of square"), window.point(POSITION), Eye::of(&window));
        window.drag(from + egui::vec2(3.0, -2.0), by, Modifiers::NONE);
        let to = handle(&window, "Handle of square");
        assert!((to - from - by).length() < 0.02, "{to} for {}", from + by);
        let moved = window.point(POSITION) - start;
        let metres = eye.metres * eye.depth(middle(&window));
        let want = (eye.axes[0] * f64::from(by.x) - eye.axes[1] * f64::from(by.y)) * metres;
        assert!(moved.distance(want) < ROUGH * want.length(), "{moved} for {want}");
        assert!(moved.dot(eye.axes[2]).abs() < 1e-5, "in the plane of the picture");
        window.undo();
        assert!(toml(&window) == before, "one drag is one step");
    }
    let (from, eye) = (handle(&window, "Handle of square"), Eye::of(&window));
    let deep = eye.depth(middle(&window));
    window.drag(from, egui::vec2(0.0, -40.0), Modifiers::SHIFT);
    let want = (3.0 * 40.0 / f64::from(window.image_rect().height())).exp();
    assert!((eye.depth(middle(&window)) / deep / want - 1.0).abs() < 0.02, "away");
}

#[test]
fn an_arrow_moves_along_its_axis_alone_by_the_metres_under_the_pointer() {
    let mut window = window();
    let before = toml(&window);
    for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
        let label = format!("Move square along {name}");
        let (eye, start, centre) = (Eye::of(&window), window.point(POSITION), middle(&window));
        let axis = DVec3::AXES[i];
        for metres in [0.3, -0.45] {
            let from = handle(&window, &label);
            // The tip lies on the axis; this is where it must come to lie.
            let ray = eye.ray(from);
            let side = axis.cross(ray).cross(ray);
            let tip = centre + axis * ((eye.eye - centre).dot(side) / axis.dot(side));
            let by = eye.project(tip + axis * metres) - eye.project(tip);
            window.drag(from, vec(by), Modifiers::NONE);
            let moved = window.point(POSITION) - start;
            assert!((moved[i] - metres).abs() < ROUGH * metres.abs(), "{name}: {moved} for {metres} m");
            assert!(moved.reject_from(axis).length() < 1e-6, "{name}: {moved}");
            window.undo();
            assert!(toml(&window) == before, "one step");
        }
    }
}

#[test]
fn a_ring_turns_by_the_degrees_under_the_pointer_about_the_middle() {
    let mut window = window();
    for turn in [DVec3::ZERO, DVec3::new(20.0, -35.0, 50.0)] {
        set(&mut window, TURN, turn);
        set(&mut window, POSITION, DVec3::new(0.4, 0.4, 0.1) - rotation(turn) * LOCAL);
        window.harness.run_steps(2);
        let before = toml(&window);
        for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
            let (eye, centre) = (Eye::of(&window), middle(&window));
            // The axis is that of a small change of this number alone.
            let mut more = turn;
            more[i] += 1e-3;
            let change = rotation(more) * rotation(turn).transpose();
            let axis = DVec3::new(
                change.y_axis.z - change.z_axis.y,
                change.z_axis.x - change.x_axis.z,
                change.x_axis.y - change.y_axis.x,
            )
            .normalize();
            if axis.dot((centre - eye.eye).normalize()).abs() < 0.25 {
                continue;
            }
            let label = format!("Turn square about {name}");
            for degrees in [32.0_f64, -64.0] {
                let from = handle(&window, &label);
                let arm = eye.on_plane(from, centre, axis) - centre;
                assert!(arm.dot(axis).abs() < 1e-9);
                let to = eye.project(centre + glam::DQuat::from_axis_angle(axis, degrees.to_radians()) * arm);
                let by = to - DVec2::new(from.x.into(), from.y.into());
                window.drag(from, vec(by), Modifiers::NONE);
                let now = window.point(TURN);
                let turned = (now[i] - turn[i] + 180.0).rem_euclid(360.0) - 180.0;
                assert!((turned - degrees).abs() < 0.03, "{name} of {turn}: {turned}° for {degrees}°");
                assert!((0..3).all(|k| k == i || now[k] == turn[k]), "{name} alone: {now} from {turn}");
                assert!(now.abs().max_element() <= 180.0);
                assert!(middle(&window).distance(centre) < 1e-6, "the middle stays");
                window.undo();
                assert!(toml(&window) == before, "one step");
            }
        }
    }
}

#[test]
fn with_shift_a_ring_turns_in_steps() {
    let mut window = window();
    set(&mut window, TURN, DVec3::new(0.0, 4.0, 0.0));
    window.harness.run_steps(2);
    let from = handle(&window, "Turn square about y");
    window.drag(from, egui::vec2(40.0, 6.0), Modifiers::SHIFT);
    let turned = window.point(TURN).y;
    assert!(turned != 4.0 && turned.rem_euclid(15.0) == 0.0, "{turned}");
}

#[test]
fn a_ring_that_is_seen_from_its_edge_turns_along_its_tangent() {
    let mut window = window();
    look_from(&mut window, DVec3::new(0.4, 0.4, 4.1));
    let (eye, centre) = (Eye::of(&window), middle(&window));
    let from = handle(&window, "Turn square about x");
    // Near the eye the ring about x moves down in the picture when the number grows.
    window.drag(from, egui::vec2(0.0, 12.0), Modifiers::NONE);
    let turned = window.point(TURN);
    assert!(turned.y == 0.0 && turned.z == 0.0 && turned.x > 0.0, "{turned}");
    // The knob stands at 45°, where the ring goes straight into depth by as much as it goes up.
    let arm = (eye.project(centre) - DVec2::new(from.x.into(), from.y.into())).length();
    let want = (12.0 / arm).to_degrees();
    assert!((turned.x / want - 1.0).abs() < 0.15, "{}° for {want}°", turned.x);
}

#[test]
fn the_square_sizes_the_mesh_about_its_middle() {
    let mut window = window();
    let before = toml(&window);
    for factor in [1.6_f32, 0.35] {
        let (at, from) = (handle(&window, "Handle of square"), handle(&window, "Size of square"));
        let centre = middle(&window);
        window.drag(from, (from - at) * (factor - 1.0), Modifiers::NONE);
        let scale = window.float("meshes.square.scale");
        assert!((scale / f64::from(factor) - 1.0).abs() < 1e-3, "{scale} for {factor}");
        assert!(middle(&window).distance(centre) < 1e-6, "the middle stays");
        window.undo();
        assert!(toml(&window) == before, "one step");
    }
}

#[test]
fn the_whole_ring_can_be_grabbed() {
    let mut window = window();
    let (eye, centre) = (Eye::of(&window), middle(&window));
    let knob = handle(&window, "Turn square about y");
    let arm = eye.on_plane(knob, centre, DVec3::Y) - centre;
    let before = toml(&window);
    let mut turned = 0;
    for k in 1..12 {
        let away = glam::DQuat::from_rotation_y(f64::from(k) * 0.5) * arm;
        let at = vec(eye.project(centre + away)).to_pos2();
        // Where another handle is nearer, that one is grabbed.
        window.harness.hover_at(at);
        window.harness.run_steps(2);
        window.drag(at, egui::vec2(24.0, -9.0), Modifiers::NONE);
        turned += u32::from(window.point(TURN).y != 0.0);
        if toml(&window) != before {
            window.undo();
        }
        assert!(toml(&window) == before, "at {k}");
    }
    assert!(turned >= 7, "{turned} of 11 places");
}

#[test]
fn escape_takes_a_drag_back() {
    let mut window = window();
    let before = toml(&window);
    for label in ["Handle of square", "Move square along x", "Turn square about y", "Size of square"] {
        let from = handle(&window, label);
        window.press_at(from, Modifiers::NONE);
        for step in 1..=3 {
            window.harness.hover_at(from + egui::vec2(14.0, -6.0) * step as f32);
            window.harness.step();
        }
        assert!(toml(&window) != before, "{label}");
        window.key(Key::Escape);
        assert!(toml(&window) == before, "{label}");
        window.harness.hover_at(from + egui::vec2(90.0, 40.0));
        window.harness.run_steps(2);
        assert!(toml(&window) == before, "{label}: the drag is over");
        window.release_at(from + egui::vec2(90.0, 40.0), Modifiers::NONE);
        assert!(toml(&window) == before && !window.viewer().document().can_redo(), "{label}");
        handle(&window, label);
    }
}

#[test]
fn a_lamps_drag_is_taken_back_too() {
    let mut setup = Setup { size: [1000.0, 700.0], ..Setup::default() };
    setup.scene += "[lights.lamp]\nkind = \"point\"\nposition = [0.5, 1.0, 2.0]\n";
    let mut window = setup.open();
    window.press("Light lamp");
    let before = toml(&window);
    let from = handle(&window, "Handle of lamp");
    window.press_at(from, Modifiers::NONE);
    window.harness.hover_at(from + egui::vec2(30.0, 10.0));
    window.harness.run_steps(2);
    assert!(toml(&window) != before);
    window.key(Key::Escape);
    window.release_at(from + egui::vec2(30.0, 10.0), Modifiers::NONE);
    assert!(toml(&window) == before && !window.viewer().document().can_undo());
}

#[test]
fn a_click_beside_the_handles_deselects() {
    let mut window = window();
    let before = toml(&window);
    handle(&window, "Size of square");
    let nothing = window.image_rect().left_top() + egui::vec2(12.0, 12.0);
    window.press_at(nothing, Modifiers::NONE);
    window.release_at(nothing, Modifiers::NONE);
    assert!(window.harness.query_by_label("Size of square").is_none());
    assert!(toml(&window) == before);
    // A click on a handle does not.
    window.press("Mesh square");
    let at = handle(&window, "Size of square");
    window.press_at(at, Modifiers::NONE);
    window.release_at(at, Modifiers::NONE);
    handle(&window, "Size of square");
    assert!(toml(&window) == before, "a click moves nothing");
}

#[test]
fn a_mesh_out_of_sight_has_its_handle_at_the_border_and_can_be_brought_in() {
    let mut window = window();
    let (image, eye) = (window.image_rect(), Eye::of(&window));
    for away in [eye.axes[0] * 40.0, eye.eye - eye.axes[2] * 5.0, eye.eye - LOCAL] {
        set(&mut window, POSITION, away);
        window.harness.run_steps(2);
        let at = handle(&window, "Handle of square");
        assert!(image.contains(at), "{at} in {image}");
        window.drag(at, image.center() - at, Modifiers::NONE);
        assert!(eye.depth(middle(&window)) > 0.0);
        assert!((handle(&window, "Handle of square") - image.center()).length() < 1.0);
        window.undo();
        window.undo();
    }
}

#[test]
fn a_camera_from_the_same_file_stays_where_it_is_while_its_mesh_is_moved() {
    let mut window = Setup { size: [1000.0, 700.0], ..Setup::default() }.open();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/model/blender.glb");
    let file = window.path("blender.glb");
    std::fs::copy(data, &file).expect("a copy");
    drop_on(&mut window, &file);
    window.set("camera.from", Raw::Text("blender".into()));
    window.harness.run_steps(2);
    let (before, camera) = (toml(&window), window.viewer().document().scene().camera);
    let from = handle(&window, "Handle of blender");
    window.drag(from, egui::vec2(50.0, 0.0), Modifiers::NONE);
    let now = window.viewer().document().scene().camera;
    assert!(now.eye.distance(camera.eye) < 1e-5 && now.forward.distance(camera.forward) < 1e-6);
    let to = handle(&window, "Handle of blender");
    assert!((to - from - egui::vec2(50.0, 0.0)).length() < 0.5, "it stays under the pointer: {to}");
    window.undo();
    assert!(toml(&window) == before, "one step");
}
