//! The plot of the scattering lobes: its numbers, and its display in the panel.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use super::*;
use glam::DVec3;
use taki::light::Reflection;
use taki::light::strand::water::Water;
use taki::scene::Scene;
use taki::viewer::lobes::{
    Curve, DECADES, Incidence, Plane, STEPS, Scale, Setting, alpha, curves, flow, incidence,
};

/// Setting of smooth strands, whose lobes all stand out.
fn strand(theta_i: f64, plane: Plane) -> Setting {
    let params = Water { aeration: 0.4, ..Water::default() }.strand();
    Setting { reflection: Reflection::Strand(params), k_d: 0.5, k_s: 0.5, p: 12.0, theta_i, plane }
}

fn fibre(theta_i: f64, plane: Plane) -> Setting {
    Setting { reflection: Reflection::KajiyaKay, ..strand(theta_i, plane) }
}

fn curve<'a>(curves: &'a [Curve], name: &str) -> &'a [f64] {
    &curves.iter().find(|curve| curve.name == name).expect(name).values
}

/// Index of the direction with the largest value.
fn brightest(values: &[f64]) -> usize {
    (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b])).expect("values")
}

#[test]
fn light_through_the_strand_goes_away_from_the_light() {
    for theta_i in [-1.2, -0.3, 0.0, 0.6, 1.4] {
        let around = curves(&strand(theta_i, Plane::Around));
        assert_eq!(brightest(curve(&around, "TT")), STEPS / 2, "φ = π at θ_i = {theta_i}");
        assert!(curve(&around, "TRT")[0] > curve(&around, "TRT")[STEPS / 2], "TRT goes back");
        assert_eq!(brightest(curve(&around, "aerated")), STEPS / 2, "bubbles send light on");
        // Straight through, α is the light's angle plus a half turn. The peak of M is shifted from the mirror
        // direction by less than the lobe's standard deviation, 9° at this roughness.
        let along = curves(&strand(theta_i, Plane::Along));
        let through = brightest(curve(&along, "TT")) as f64 - theta_i.to_degrees();
        assert!((through - 180.0).abs() < 9.0, "{through} at θ_i = {theta_i}");
    }
}

#[test]
fn the_last_curve_is_the_sum_of_the_others() {
    for plane in [Plane::Around, Plane::Along] {
        for setting in [strand(0.4, plane), fibre(0.4, plane)] {
            let all = curves(&setting);
            let (total, parts) = all.split_last().expect("curves");
            assert_eq!(total.name, "total");
            assert!(total.peak() > 0.0 && parts.iter().all(|part| part.peak() > 0.0));
            for i in 0..STEPS {
                let sum: f64 = parts.iter().map(|part| part.values[i]).sum();
                // Both are float64 sums of the same few numbers in different orders.
                assert!((sum - total.values[i]).abs() <= 1e-14 * sum, "{i}: {sum} and {}", total.values[i]);
            }
        }
    }
}

#[test]
fn right_and_left_of_the_light_are_alike_around_the_strand() {
    for curve in curves(&strand(0.7, Plane::Around)) {
        for i in 1..STEPS / 2 {
            let [a, b] = [curve.values[i], curve.values[STEPS - i]];
            // For −φ, the lobes' sums over offsets have another order.
            assert!((a - b).abs() <= 1e-12 * a, "{} {i}: {a} {b}", curve.name);
        }
    }
}

#[test]
fn the_fibres_curves_are_the_models_closed_form_over_pi() {
    // The closed forms are k_d·cos θ_i/π all around and k_s/π on the mirror cone. In the other plane the
    // specular peak lies on that cone.
    let setting = fibre(0.5, Plane::Around);
    let all = curves(&setting);
    let diffuse: f64 = curve(&all, "diffuse").iter().sum::<f64>() * 2.0 * PI / STEPS as f64;
    // The fibre model computes in float32.
    assert!((diffuse - 2.0 * 0.5 * 0.5f64.cos()).abs() < 1e-6, "{diffuse}");
    let specular = curve(&all, "specular");
    assert!(specular.iter().all(|s| (s - 0.5 * FRAC_1_PI).abs() < 1e-5), "{}", specular[0]);
    let along = curves(&fibre(0.5, Plane::Along));
    let mirror = (-0.5f64).to_degrees().round() as i32;
    let peak = brightest(curve(&along, "specular")) as i32;
    assert!((peak - (mirror + 360)).abs() <= 1 || (peak - (180 - mirror)).abs() <= 1, "{peak}");
}

#[test]
fn a_light_along_the_strand_and_every_other_gives_finite_lobes() {
    for theta_i in [-FRAC_PI_2, 1e-6 - FRAC_PI_2, 0.0, 1.5, FRAC_PI_2] {
        for plane in [Plane::Around, Plane::Along] {
            for setting in [strand(theta_i, plane), fibre(theta_i, plane)] {
                let all = curves(&setting);
                let scale = Scale::new(&all);
                for curve in &all {
                    assert_eq!(curve.values.len(), STEPS);
                    let sound = |x: &f64| x.is_finite() && *x >= 0.0;
                    assert!(curve.values.iter().all(sound), "{} at {theta_i}", curve.name);
                    let inside = |x: &f64| (0.0..=1.0).contains(&scale.radius(*x));
                    assert!(curve.values.iter().all(inside), "{} at {theta_i}", curve.name);
                }
            }
        }
    }
}

#[test]
fn the_planes_meet_where_they_cross() {
    // The directions θ_o = −θ_i at φ = 0 and φ = π lie on both planes.
    let theta_i = 30f64.to_radians();
    for [around, along] in [
        [strand(theta_i, Plane::Around), strand(theta_i, Plane::Along)],
        [fibre(theta_i, Plane::Around), fibre(theta_i, Plane::Along)],
    ] {
        for (a, b) in curves(&around).iter().zip(&curves(&along)) {
            for (on_around, on_along) in [(0, 330), (180, 210)] {
                let [x, y] = [a.values[on_around], b.values[on_along]];
                // The fibre model computes in float32, to the twelfth power.
                assert!((x - y).abs() <= 1e-5 * x.max(y), "{} {on_around}: {x} {y}", a.name);
            }
        }
    }
}

#[test]
fn air_and_strand_have_the_shares_of_the_cell() {
    let air = |k_d: f32, k_s: f32| {
        curve(&curves(&Setting { k_d, k_s, ..strand(0.2, Plane::Around) }), "aerated")[0]
    };
    // The share of air is 2·k_d/(k_d + k_s) times the aeration of 0.4.
    assert!((air(0.2, 0.8) / air(0.5, 0.5) - 0.4).abs() < 1e-6);
    let none = curves(&Setting { k_d: 0.0, ..strand(0.2, Plane::Around) });
    assert_eq!(none.iter().find(|c| c.name == "aerated").expect("air").peak(), 0.0);
}

#[test]
fn the_radius_is_the_logarithm_from_the_middle_to_the_rim() {
    let of = |peak: f64| Scale::new(&[Curve { name: "x", doc: "", values: vec![0.0, peak] }]);
    for (peak, middle) in [(3.2, 1 - DECADES), (1.0, -DECADES), (0.032, -1 - DECADES), (0.0, -DECADES)] {
        let scale = of(peak);
        assert_eq!(scale.middle, middle, "{peak}");
        let value = |radius: f64| 10f64.powf(f64::from(middle) + radius * (scale.rim - f64::from(middle)));
        for radius in [0.0, 0.25, 0.6, 1.0] {
            // The bound is the rounding of float64 logarithms.
            assert!((scale.radius(value(radius)) - radius).abs() < 1e-12, "{peak} {radius}");
        }
        assert!(peak == 0.0 || scale.radius(peak) == 1.0);
        assert_eq!((scale.radius(0.0), scale.radius(1e-12)), (0.0, 0.0));
        for (power, radius) in scale.rings() {
            assert!((value(radius) / 10f64.powi(power) - 1.0).abs() < 1e-12 && radius > 0.0 && radius <= 1.0);
        }
    }
    assert_eq!(of(3.2).rings().map(|ring| ring.0).collect::<Vec<_>>(), [-2, -1, 0]);
    assert_eq!((alpha(0), alpha(STEPS / 2), alpha(STEPS)), (0.0, PI, 0.0));
}

fn load(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    Scene::load(Path::new("fig5"), &sets, &Limits::default()).expect("a valid scene")
}

fn of(scene: &Scene, selected: Option<&str>) -> Incidence {
    incidence(scene, scene.values().unwrap(), selected).expect("a light")
}

#[test]
fn the_inclination_is_that_to_the_first_quads_flow() {
    let plain = load(&[]);
    let [a, b, c, d] = plain.quads[0].corners.map(|p| p.as_dvec3());
    let down = ((d + c) - (a + b)).normalize();
    assert!((flow(&plain) - down).length() < 1e-12);
    let across = down.any_orthonormal_vector();
    for theta in [-1.5, -0.5, 0.0, 0.25, 1.0] {
        let (sin, cos) = f64::sin_cos(theta);
        let to = (down * sin + across * cos) * 3.0;
        let scene = load(&[&format!("lights.sun.direction=[{},{},{}]", to.x, to.y, to.z)]);
        // A scene's directions are float32.
        assert!((of(&scene, None).theta_i - theta).abs() < 1e-5, "{theta}");
        let at = (a + b + c + d) / 4.0 + to;
        let place = format!("lights.sun.position=[{},{},{}]", at.x, at.y, at.z);
        let scene = load(&["lights.sun.kind=point", &place]);
        assert!((of(&scene, None).theta_i - theta).abs() < 1e-5, "{theta} of a point light");
    }
}

#[test]
fn the_light_is_the_selected_one_or_the_first_that_shines() {
    let dark = load(&["lights.sun.intensity=0"]);
    let mut two = dark.values().unwrap().clone();
    two.set("lights.z.kind", &Raw::Text("point".into()), &taki::scene::Place("test".into()))
        .expect("a value");
    let name = |selected| incidence(&dark, &two, selected).expect("a light").light;
    assert_eq!((name(Some("sun")).as_str(), name(None).as_str()), ("sun", "z"));
    let scene = load(&["lights.sun.intensity=0", "environment.kind=sky"]);
    let sun = scene.environment.as_ref().and_then(|e| e.sun).expect("a sun");
    let sin: f64 = flow(&scene).dot(DVec3::from(sun.to_sun));
    assert!((of(&scene, None).theta_i.sin() - sin).abs() < 1e-6);
    assert_eq!(of(&dark, None).light, "sun", "better than nothing");
    assert!(incidence(&dark, &taki::scene::Values::default(), None).is_none());
}

/// A window in which the plot is visible.
fn window() -> Window {
    Setup { size: [760.0, 1500.0], ..Setup::default() }.open()
}

const NAMES: [&str; 6] = ["R", "TT", "TRT", "rest", "aerated", "total"];

fn press_fold(window: &mut Window) {
    window.harness.get_by_label("Lobes").click_accesskit();
    window.harness.run_steps(4);
}

fn open_fold(window: &mut Window) {
    press_fold(window);
    let start = Instant::now();
    while !window.reads("θ_i = ") {
        window.harness.step();
        assert!(start.elapsed() < LONGEST, "the lobes did not come");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn the_fold_names_every_lobe_of_the_model_and_nothing_while_it_is_closed() {
    let mut window = window();
    window.choose("light.reflection", "strand");
    window.settle();
    let has = |window: &Window, name: &str| window.harness.query_by_label(name).is_some();
    for name in NAMES {
        assert!(!has(&window, name), "{name} while the fold is closed");
    }
    assert!(!window.reads("θ_i = ") && !window.reads("around the strand"));
    open_fold(&mut window);
    for name in NAMES {
        assert!(has(&window, name), "{name}");
    }
    let degrees = of(window.viewer().document().scene(), None).theta_i.to_degrees();
    let degrees = format!("θ_i = {degrees:.1}° of sun").replace('-', "−");
    assert!(window.reads(&degrees), "{degrees}");
    window.choose("light.reflection", "kajiya-kay");
    let start = Instant::now();
    while window.harness.query_by_label("specular").is_none() {
        window.harness.step();
        assert!(start.elapsed() < LONGEST, "the other model did not come");
    }
    assert!(has(&window, "diffuse") && has(&window, "total") && !has(&window, "TT"));
    press_fold(&mut window);
    window.harness.run_steps(30);
    assert!(!has(&window, "specular") && !window.reads("θ_i = "), "closed again");
}
