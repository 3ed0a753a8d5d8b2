//! §5 The fibre model against float64 with the angles themselves. Reference truth.

use glam::{DMat3, DVec3, Mat3, Vec2, Vec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use taki::light::fibre::{Metric, fibre_angles, psi, specular_power, whole_exponent};
use taki::mapping::{CellFrame, cross};

/// Ψ in float64 from the angles themselves: sin·sin − cos·cos is −cos of the sum of both angles.
fn true_psi(k_d: f64, k_s: f64, p: f64, t: DVec3, l: DVec3, e: DVec3) -> f64 {
    let (angle_l, angle_e) = (t.angle_between(l), t.angle_between(e));
    k_d * angle_l.sin() + k_s * (-(angle_l + angle_e).cos()).max(0.0).powf(p)
}

/// Ψ of unit vectors, as the walk calls it.
fn own_psi(k_d: f32, k_s: f32, p: f32, t: Vec3, l: Vec3, e: Vec3) -> f32 {
    psi(k_d, k_s, p, t.dot(l), t.dot(e), 1.0 / t.dot(t))
}

fn unit() -> impl Strategy<Value = Vec3> {
    [-1.0f64..1.0, 0.0f64..std::f64::consts::TAU].prop_map(|[z, turn]| {
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * turn.cos(), r * turn.sin(), z).as_vec3()
    })
}

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 20_000,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(89),
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn psi_is_kajiya_and_kays(
        t in unit(), l in unit(), e in unit(),
        length in 0.1f32..600.0,
        k_d in 0.0f32..1.0, k_s in 0.0f32..1.0, p in 1.0f32..60.0,
    ) {
        let want = true_psi(k_d as f64, k_s as f64, p as f64, t.as_dvec3(), l.as_dvec3(), e.as_dvec3());
        // The length of the direction must cancel.
        let got = own_psi(k_d, k_s, p, t * length, l, e) as f64;
        // 1 − cos² loses digits as the sine falls: its error is 1e-7 / sine. The power multiplies that error
        // by p.
        let sine = |w: Vec3| t.as_dvec3().cross(w.as_dvec3()).length().max(3e-4);
        let error = 4e-7 / sine(l) + 4e-7 / sine(e);
        let allowed = error * (k_d + k_s * p) as f64 + 1e-6;
        prop_assert!((got - want).abs() <= allowed, "{got}, not {want}");
    }

    #[test]
    fn the_sense_of_the_flow_does_not_matter(t in unit(), l in unit(), e in unit()) {
        prop_assert_eq!(own_psi(0.7, 0.4, 20.0, t, l, e), own_psi(0.7, 0.4, 20.0, -t, l, e));
    }

    #[test]
    fn diffuse_light_vanishes_along_the_fibre_and_is_k_d_across_it(t in unit(), w in unit(), e in unit()) {
        let across = t.as_dvec3().cross(w.as_dvec3()).normalize_or(t.any_orthonormal_vector().as_dvec3());
        prop_assert!((own_psi(0.7, 0.0, 1.0, t, across.as_vec3(), e) - 0.7).abs() < 1e-6);
        // cos² is 1 except for rounding, and the sine is at most the square root of that rounding.
        for l in [t, -t] {
            prop_assert!(own_psi(0.7, 0.0, 1.0, t, l, e) < 0.7 * 1e-3);
        }
    }

    #[test]
    fn specular_light_is_k_s_on_the_mirror_cone_and_less_off_it(
        t in unit(),
        theta in 0.05f64..3.09,
        turns in [0.0f64..std::f64::consts::TAU, 0.0f64..std::f64::consts::TAU],
        off in 0.05f64..0.4,
    ) {
        let t64 = t.as_dvec3();
        let (x, y) = t64.any_orthonormal_pair();
        let around = |theta: f64, turn: f64| {
            (t64 * theta.cos() + (x * turn.cos() + y * turn.sin()) * theta.sin()).as_vec3()
        };
        // t·l = −t·e holds anywhere around the fibre: on a cone, not in one direction.
        let l = around(theta, turns[0]);
        let e = around(std::f64::consts::PI - theta, turns[1]);
        let p = 20.0;
        prop_assert!((own_psi(0.0, 0.4, p, t, l, e) - 0.4).abs() < 2e-4);
        // At some angle off the cone, the base is the cosine of that angle.
        for off in [off, -off] {
            let theta_e = std::f64::consts::PI - theta + off;
            if (0.02..3.12).contains(&theta_e) {
                let beside = own_psi(0.0, 0.4, p, t, l, around(theta_e, turns[1])) as f64;
                prop_assert!((beside - 0.4 * off.cos().powf(p as f64)).abs() < 4e-4, "{beside} at {off}");
            }
        }
    }

    #[test]
    fn the_metric_is_the_squared_length_in_the_world(
        c in [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0],
        depth in 0.01f32..1.0,
        v in [-511.0f32..511.0, -511.0f32..511.0, -511.0f32..511.0],
    ) {
        let (frame, metric) = frame_and_metric(Vec2::new(c[0], c[1]), Vec2::new(c[2], c[3]), depth);
        let j = matrix(&frame);
        let v = Vec3::from_array(v);
        let world = (j * v.as_dvec3()).length_squared();
        // Terms of both signs may cancel, so the bound uses the sizes of the terms.
        let terms = (j.abs() * v.abs().as_dvec3()).length_squared();
        prop_assert!((metric.squared(v) as f64 - world).abs() <= 1e-6 * terms, "{world}");
    }

    #[test]
    fn world_and_texture_frame_agree_where_the_map_is_a_similarity(
        turn in 0.0f32..std::f32::consts::TAU,
        scale in 0.001f32..2.0,
        t in unit(), l in unit(), e in unit(),
    ) {
        let cx = Vec2::from_angle(turn) * scale;
        let (frame, world) = frame_and_metric(cx, cx.perp(), scale);
        let v = t * 511.0;
        let in_world = psi(
            0.7, 0.4, 20.0,
            v.dot(frame.transposed(l)), v.dot(frame.transposed(e)), 1.0 / world.squared(v),
        );
        let texture = Metric { m: [1.0, 0.0, 1.0, 1.0] };
        let mapped = |w: Vec3| frame.cell_from_plane(w).normalize();
        let in_texture = psi(0.7, 0.4, 20.0, v.dot(mapped(l)), v.dot(mapped(e)), 1.0 / texture.squared(v));
        let j = matrix(&frame);
        let t_world = (j * v.as_dvec3()).normalize();
        let want = true_psi(0.7, 0.4, 20.0, t_world, l.as_dvec3(), e.as_dvec3());
        let sine = |w: Vec3| t_world.cross(w.as_dvec3()).length().max(5e-4);
        let allowed = (1e-6 / sine(l) + 1e-6 / sine(e)) * 9.0 + 2e-6;
        prop_assert!((in_world as f64 - want).abs() <= allowed, "world {in_world}, not {want}");
        prop_assert!((in_texture as f64 - want).abs() <= allowed, "texture {in_texture}, not {want}");
    }

    #[test]
    fn squaring_is_the_power(x in 0.0f32..=1.0, p in 1u32..=255) {
        let want = (x as f64).powi(p as i32);
        let got = specular_power(x, p as f32) as f64;
        // Each factor adds one rounding. Below the smallest normal number, digits are lost.
        prop_assert!((got - want).abs() <= want * p as f64 * 6e-8 + 1e-37, "{x}^{p} = {got}, not {want}");
        prop_assert_eq!(whole_exponent(p as f32), Some(p));
    }
}

fn frame_and_metric(cx: Vec2, cy: Vec2, depth: f32) -> (CellFrame, Metric) {
    let m = [cx.dot(cx), 2.0 * cx.dot(cy), cy.dot(cy), depth * depth];
    (CellFrame { cx, cy, depth, det: cross(cx, cy) }, Metric { m })
}

fn matrix(frame: &CellFrame) -> DMat3 {
    let z = Vec3::new(0.0, 0.0, -frame.depth);
    Mat3::from_cols(frame.cx.extend(0.0), frame.cy.extend(0.0), z).as_dmat3()
}

#[test]
fn frames_differ_where_the_map_is_no_similarity() {
    // The map stretches threefold along the flow. Without a stretch both frames would give the same result.
    let (frame, world) = frame_and_metric(Vec2::X, Vec2::Y * 3.0, 1.0);
    let (v, l) = (Vec3::new(1.0, 1.0, 0.0), Vec3::X);
    let (in_world, _) = fibre_angles(v.dot(frame.transposed(l)), 0.0, 1.0 / world.squared(v));
    let mapped = frame.cell_from_plane(l).normalize();
    let (in_texture, _) = fibre_angles(v.dot(mapped), 0.0, 0.5);
    assert!((in_world as f64 - 0.9f64.sqrt()).abs() < 1e-6);
    assert!((in_texture as f64 - 0.5f64.sqrt()).abs() < 1e-6);
}

#[test]
fn a_power_with_a_fraction_or_beyond_255_is_powf() {
    for p in [1.5f32, 19.99, 255.5, 256.0, 1000.0, 1e4] {
        assert_eq!(whole_exponent(p), None);
        for x in [0.0f32, 0.5, 0.9, 0.999, 1.0] {
            let want = (x as f64).powf(p as f64);
            assert!((specular_power(x, p) as f64 - want).abs() <= want * 1e-3 + 1e-37, "{x}^{p}");
        }
    }
    assert_eq!(specular_power(0.0, 1.0), 0.0);
    assert_eq!(specular_power(1.0, 255.0), 1.0);
}

#[test]
fn specular_light_behind_the_cone_is_dark_not_negative() {
    // Light and eye both point along the fibre, so the base is −1.
    assert_eq!(own_psi(0.0, 1.0, 3.0, Vec3::Y, Vec3::Y, Vec3::Y), 0.0);
    assert_eq!(own_psi(0.0, 1.0, 1.0, Vec3::Y, Vec3::Y, Vec3::Y), 0.0);
}
