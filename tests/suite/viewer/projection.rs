//! Drags in the picture against closed forms of the pinhole camera and of the dial. Reference truth.

use super::*;
use glam::{DVec2, DVec3};
use taki::scene::Scene;
use taki::viewer::lights::projection::View;
use taki::viewer::navigate::Pose;

/// Rounding error: float64 has 16 digits, a window has a thousand points, and ten operations follow one
/// another.
const ROUNDING: f64 = 1e-11;

const CORNER: DVec2 = DVec2::new(340.5, 62.0);
const SIZE: DVec2 = DVec2::new(960.0, 540.0);

fn poses() -> Vec<Pose> {
    let pose =
        |eye, target, up, fov: f64| Pose { eye, target, up, tan_half_fov: (fov.to_radians() * 0.5).tan() };
    let v = DVec3::new;
    vec![
        pose(v(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y, 40.0),
        pose(v(0.3, -5.0, 12.5), v(0.0, -0.75, 0.0), DVec3::Y, 38.0),
        pose(v(-70.0, 300.0, 2.0), v(4.0, 1.0, -9.0), v(0.2, 0.9, -0.3).normalize(), 90.0),
        pose(v(1e5, 2e5, -3e5), v(1e5, 2e5 + 40.0, -3e5 + 1.0), DVec3::Z, 1.0),
    ]
}

fn places() -> impl Iterator<Item = DVec2> {
    let steps = [-0.4, 0.0, 0.13, 0.5, 0.77, 1.0, 1.6];
    steps.into_iter().flat_map(move |x| steps.map(|y| CORNER + SIZE * DVec2::new(x, y)))
}

/// Directions spread evenly over the sphere (a Fibonacci spiral).
fn sphere() -> impl Iterator<Item = DVec3> {
    const N: i32 = 400;
    (0..N).map(|i| {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(N);
        let (sin, cos) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
        DVec3::new(cos, 0.0, sin) * (1.0 - y * y).sqrt() + DVec3::Y * y
    })
}

#[test]
fn what_is_unprojected_is_seen_where_it_came_from_and_at_that_depth() {
    for pose in poses() {
        let view = View::new(&pose, CORNER, SIZE);
        let far = pose.eye.length().max(1.0);
        for at in places() {
            for depth in [0.01, 1.0, 7.3, 1e4] {
                let (seen, deep) = view.project(view.unproject(at, depth));
                let seen = seen.expect("before the eye");
                // Coordinates are metres from the world's origin. At this depth, their rounding has the size
                // of so many points.
                let points = ROUNDING * SIZE.y * (1.0 + far / depth) / pose.tan_half_fov;
                assert!(seen.distance(at) < points, "{seen} for {at}");
                assert!((deep - depth).abs() < ROUNDING * (depth + far) * 10.0, "{deep} for {depth}");
            }
        }
    }
}

#[test]
fn the_target_is_in_the_middle_and_the_field_of_view_ends_at_the_borders() {
    for pose in poses() {
        let view = View::new(&pose, CORNER, SIZE);
        let away = pose.eye.distance(pose.target);
        let points = ROUNDING * SIZE.y * (1.0 + pose.eye.length() / away) / pose.tan_half_fov;
        let (seen, depth) = view.project(pose.target);
        assert!(seen.expect("before the eye").distance(CORNER + SIZE * 0.5) < points);
        assert!((depth - away).abs() < ROUNDING * (1.0 + pose.eye.length()));
        let forward = (pose.target - pose.eye).normalize();
        let right = forward.cross(pose.up).normalize();
        let up = right.cross(forward);
        let (high, wide) = (up * pose.tan_half_fov, right * (pose.tan_half_fov * SIZE.x / SIZE.y));
        for (way, want) in [
            (high, DVec2::new(0.5, 0.0)),
            (-high, DVec2::new(0.5, 1.0)),
            (wide, DVec2::new(1.0, 0.5)),
            (high - wide, DVec2::ZERO),
        ] {
            let (seen, depth) = view.project(pose.eye + (forward + way) * away);
            assert!(seen.expect("before the eye").distance(CORNER + SIZE * want) < points, "{want}");
            assert!((depth - away).abs() < ROUNDING * (away + pose.eye.length()) * 10.0);
        }
    }
}

#[test]
fn nothing_behind_the_eye_has_a_place() {
    for pose in poses() {
        let view = View::new(&pose, CORNER, SIZE);
        let back = pose.eye * 2.0 - pose.target;
        assert_eq!(view.project(back).0, None);
        assert!(view.project(back).1 < 0.0);
        assert_eq!(view.project(pose.eye).0, None);
        assert!(!view.contains(view.border_towards(back)));
    }
}

#[test]
fn a_place_unprojects_onto_the_ray_that_the_renderer_sends_through_it() {
    let scene = Scene::load(Path::new("fig5"), &[], &Limits::default()).expect("a preset");
    let pose = Pose::of(scene.values().unwrap());
    let (width, height) = (scene.image.width, scene.image.height);
    let view = View::new(&pose, DVec2::ZERO, DVec2::new(f64::from(width), f64::from(height)));
    for pixel in [[0, 0], [17, 300], [265, 425], [133, 213]] {
        let ray = scene.camera.view_ray(width, height, pixel, [0.5, 0.5]).as_dvec3();
        let at = DVec2::new(f64::from(pixel[0]) + 0.5, f64::from(pixel[1]) + 0.5);
        let mine = (view.unproject(at, 3.0) - pose.eye).normalize();
        // The renderer's ray is computed with a few operations in float32, which has 24 bits.
        assert!(mine.distance(ray) < 1e-6, "{mine} for {ray}");
    }
}

#[test]
fn every_direction_has_its_own_place_on_the_dial() {
    for pose in poses() {
        let view = View::new(&pose, CORNER, SIZE);
        for direction in sphere() {
            let place = view.dial_place(direction);
            assert!(place.length() <= 1.0 + ROUNDING);
            let again = view.dial_direction(place);
            assert!((again.length() - 1.0).abs() < ROUNDING);
            assert!(again.distance(direction) < ROUNDING, "{again} for {direction}");
        }
    }
}

#[test]
fn a_direction_stays_under_the_pointer_that_drags_it() {
    let view = View::new(&poses()[1], CORNER, SIZE);
    for at in places().map(|at| ((at - CORNER) / SIZE * 2.0 - 1.0) * 0.9) {
        let direction = view.dial_direction(at);
        assert!((direction.length() - 1.0).abs() < ROUNDING);
        // Beyond the rim, the direction is that of the rim: straight from behind.
        let want = if at.length() < 1.0 { at } else { DVec2::Y };
        let got = view.dial_place(direction);
        if at.length() < 1.0 {
            assert!(got.distance(want) < 1e-9, "{got} for {at}");
        } else {
            assert!((got.length() - 1.0).abs() < 1e-9, "{got} for {at}");
        }
    }
}

#[test]
fn the_dials_middle_is_the_eye_its_half_radius_the_side_its_rim_behind() {
    for pose in poses() {
        let view = View::new(&pose, CORNER, SIZE);
        let forward = (pose.target - pose.eye).normalize();
        let right = forward.cross(pose.up).normalize();
        let up = right.cross(forward);
        for (direction, want) in [
            (-forward, DVec2::ZERO),
            (right, DVec2::new(0.5, 0.0)),
            (-right, DVec2::new(-0.5, 0.0)),
            (up, DVec2::new(0.0, 0.5)),
            (-up, DVec2::new(0.0, -0.5)),
            ((up - forward).normalize(), DVec2::new(0.0, 0.25)),
            ((right + forward).normalize(), DVec2::new(0.75, 0.0)),
        ] {
            assert!(view.dial_place(direction).distance(want) < ROUNDING, "{want}");
        }
        assert!((view.dial_place(forward).length() - 1.0).abs() < ROUNDING);
        for rim in [DVec2::X, DVec2::Y, DVec2::new(-0.6, 0.8), DVec2::new(30.0, -4.0)] {
            assert!(view.dial_direction(rim).distance(forward) < ROUNDING);
        }
    }
}
