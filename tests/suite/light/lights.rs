//! Spot lights: their cone, falloff and aim. Invalid values of lights are refused with their line.

use glam::Vec3;
use taki::light::{Cone, Light};
use taki::scene::{Limits, Scene};

/// A spot light at the origin that shines along −z.
fn spot(angle: f32, softness: f32) -> Light {
    Light::Spot { position: Vec3::ZERO, intensity: Vec3::ONE, cone: Cone::new(Vec3::Z, angle, softness) }
}

/// The point `metres` away from the origin, `degrees` off the axis −z.
fn off_axis(degrees: f32, metres: f32) -> Vec3 {
    let angle = degrees.to_radians();
    Vec3::new(angle.sin(), 0.0, -angle.cos()) * metres
}

#[test]
fn a_spot_light_is_a_point_light_inside_its_cone_and_dark_outside() {
    for (angle, softness) in [(30.0, 0.2), (80.0, 0.0), (5.0, 1.0), (90.0, 0.5)] {
        let (light, inner) = (spot(angle, softness), angle * (1.0 - softness));
        for metres in [0.5f32, 2.0, 100.0] {
            let point = Light::Point { position: Vec3::ZERO, intensity: Vec3::ONE };
            for degrees in [0.0, 0.5 * inner, 0.99 * inner] {
                let p = off_axis(degrees, metres);
                assert!(
                    (light.at(p).1 / point.at(p).1 - 1.0).abs().max_element() < 1e-3,
                    "{angle} {degrees}"
                );
                assert_eq!(light.at(p).0, point.at(p).0);
            }
            for degrees in [angle * 1.01, 0.5 * (angle + 180.0), 180.0] {
                assert_eq!(light.at(off_axis(degrees, metres)).1, Vec3::ZERO, "{angle} {degrees}");
            }
        }
    }
}

#[test]
fn the_light_of_a_spot_falls_smoothly_from_full_to_none_by_half_in_the_middle_of_the_cosines() {
    let light = spot(40.0, 0.5);
    let cosine = 0.5 * (20f32.to_radians().cos() + 40f32.to_radians().cos());
    assert!((light.at(off_axis(cosine.acos().to_degrees(), 1.0)).1.x - 0.5).abs() < 1e-4);
    let along: Vec<f32> = (0..=100).map(|i| light.at(off_axis(15.0 + 0.3 * i as f32, 1.0)).1.x).collect();
    assert!(along.is_sorted_by(|a, b| *a >= b - 1e-6), "{along:?}");
    assert!(along.windows(2).all(|pair| pair[0] - pair[1] < 0.05), "{along:?}");
}

#[test]
fn a_spot_light_shines_where_it_is_aimed() {
    let sets = [
        "lights.key.kind=spot",
        "lights.key.color=[1,1,1]",
        "lights.key.position=[1,2,3]",
        "lights.key.direction=[0,3,0]",
        "lights.key.angle=20",
    ];
    let scene = Scene::load("front".as_ref(), &sets.map(String::from), &Limits::default()).expect("valid");
    let light = scene.lights.first().expect("the lamp");
    // The direction points against the beam: a point below the lamp is lit, a point above it is not.
    assert!((light.at(Vec3::new(1.0, 0.0, 3.0)).1 - 0.25).abs().max_element() < 1e-6);
    assert_eq!(light.at(Vec3::new(1.0, 4.0, 3.0)).1, Vec3::ZERO);
}

#[test]
fn bad_values_of_lights_have_their_line() {
    for (set, words) in [
        ("lights.key.kind=area", "directional, point, spot"),
        ("lights.key.angle=0", "0.01 to 90"),
        ("lights.key.angle=90.1", "0.01 to 90"),
        ("lights.key.softness=1.5", "0 to 1"),
        ("lights.key.softness=nan", "0 to 1"),
    ] {
        let error =
            Scene::load("front".as_ref(), &[set.into()], &Limits::default()).expect_err(set).to_string();
        assert!(error.contains(words), "{set}: {error}");
    }
    let aimless = ["lights.key.kind=spot", "lights.key.direction=[0,0,0]"].map(String::from);
    let error =
        Scene::load("front".as_ref(), &aimless, &Limits::default()).expect_err("no direction").to_string();
    assert!(error.contains("lights.key.direction") && error.contains("towards the light"), "{error}");
}
