//! Closed forms of reflection at a cylinder and of how its lobes spread.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use taki::light::strand::azimuthal::{Azimuth, Logistic, logistic_scale};
use taki::light::strand::cylinder::{Passage, exit_azimuth, fresnel, modified_index, refracted_cosine};
use taki::light::strand::longitudinal::{bessel_i0e, longitudinal, variances};
use taki::light::strand::water::{ETA, pure_water};

fn reflectance(cos_i: f64) -> [f64; 2] {
    fresnel(cos_i, refracted_cosine(cos_i, ETA), ETA)
}

#[test]
fn water_reflects_two_per_cent_head_on_and_all_at_grazing_incidence() {
    let [s, p] = reflectance(1.0);
    assert!((s - 0.0204).abs() < 5e-5 && (p - 0.0204).abs() < 5e-5, "{s}, {p}");
    assert_eq!(reflectance(0.0), [1.0, 1.0]);
}

#[test]
fn fresnel_is_his_sines_and_tangents_and_p_vanishes_at_brewsters_angle() {
    for degrees in 1..90 {
        let i = (degrees as f64).to_radians();
        let t = (i.sin() / ETA).asin();
        let [s, p] = reflectance(i.cos());
        assert!((s - ((i - t).sin() / (i + t).sin()).powi(2)).abs() < 1e-12);
        assert!((p - ((i - t).tan() / (i + t).tan()).powi(2)).abs() < 1e-12);
    }
    let [s, p] = reflectance(ETA.atan().cos());
    assert!(p < 1e-28 && (s - ((ETA * ETA - 1.0) / (ETA * ETA + 1.0)).powi(2)).abs() < 1e-12);
}

/// Largest Φ_2 beyond the light's own direction, and its h, searched in steps of 1e-5.
fn bow(eta_prime: f64) -> (f64, f64) {
    let turn = |h: f64| exit_azimuth(2, h, h / eta_prime) - TAU;
    (0..=100_000)
        .map(|i| i as f64 * 1e-5)
        .map(|h| (turn(h), h))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .expect("some")
}

#[test]
fn the_bow_stands_42_degrees_from_the_lights_direction() {
    let (turn, h) = bow(ETA);
    // Descartes: dφ/dh = 0 where sin²γ_i = (4 − η²)/3.
    assert!((h - ((4.0 - ETA * ETA) / 3.0).sqrt()).abs() < 1e-4, "{h}");
    assert!((turn.to_degrees() - 42.08).abs() < 0.01, "{}", turn.to_degrees());
}

#[test]
fn a_smooth_strand_is_brightest_in_the_bow() {
    for degrees in [0.0f64, 30.0, 45.0] {
        let cos_d = degrees.to_radians().cos();
        let around = Azimuth::new(0.004, ETA, cos_d, DVec3::ZERO);
        let trt = |tenth: i32| around.at((tenth as f64 * 0.1).to_radians())[2].x;
        let brightest = (0..1800).max_by(|a, b| trt(*a).total_cmp(&trt(*b))).expect("some") as f64 * 0.1;
        let want = bow(modified_index(ETA, cos_d)).0.to_degrees();
        // The lobe is 0.8° wide, and the bow is lit on one side only.
        assert!((brightest - want).abs() < 0.8, "{brightest}°, not {want}° at {degrees}°");
        assert!(
            trt((want * 10.0) as i32 + 40) < 0.05 * trt((brightest * 10.0) as i32),
            "it is dark outside the bow"
        );
    }
}

#[test]
fn there_is_no_bow_where_the_modified_index_is_over_2() {
    let limit = ((4.0 - ETA * ETA) / 3.0).sqrt().asin();
    assert!((limit.to_degrees() - 59.4).abs() < 0.05, "{}", limit.to_degrees());
    assert!((modified_index(ETA, limit.cos()) - 2.0).abs() < 1e-12);
    assert!(bow(modified_index(ETA, (limit - 0.05).cos())).1 > 0.1);
    assert_eq!(bow(modified_index(ETA, (limit + 0.05).cos())).1, 0.0);
}

#[test]
fn every_ray_keeps_its_power_without_absorption() {
    for cos_d in [0.0, 1e-3, 0.2, 0.7, 1.0] {
        for h in [0.0, 0.3, 0.8607, 0.99, 0.999999, 1.0] {
            let sum: DVec3 = Passage::new(ETA, cos_d, h, DVec3::ZERO).attenuation.into_iter().sum();
            assert!((sum - 1.0).abs().max_element() < 1e-12, "{sum} at h = {h}, cos θ_d = {cos_d}");
        }
    }
}

#[test]
fn a_ray_through_the_axis_is_attenuated_along_its_slanted_diameter() {
    let depth = DVec3::new(0.7, 0.2, 0.05);
    for degrees in [0.0f64, 35.0, 70.0] {
        let theta_d = degrees.to_radians();
        let theta_t = (theta_d.sin() / ETA).asin();
        let [s, p] = reflectance(theta_d.cos());
        let t = (depth * (-1.0 / theta_t.cos())).map(f64::exp);
        let got = Passage::new(ETA, theta_d.cos(), 0.0, depth).attenuation;
        let mean = |f: fn(f64) -> f64| 0.5 * (f(s) + f(p));
        assert!((got[0] - mean(|f| f)).abs().max_element() < 1e-12);
        assert!((got[1] - t * mean(|f| (1.0 - f).powi(2))).abs().max_element() < 1e-12);
        assert!((got[2] - t * t * mean(|f| (1.0 - f).powi(2) * f)).abs().max_element() < 1e-12);
    }
    // Off the axis the chord is shorter: cos γ_t times the diameter.
    let h = 0.8;
    let chord = (1.0f64 - (h / ETA).powi(2)).sqrt();
    let (with, without) = (Passage::new(ETA, 1.0, h, depth), Passage::new(ETA, 1.0, h, DVec3::ZERO));
    let ratio = with.attenuation[1] / without.attenuation[1];
    assert!((ratio - (depth * -chord).map(f64::exp)).abs().max_element() < 1e-12);
}

#[test]
fn reflection_from_a_smooth_strand_is_the_mirror_cylinders() {
    // N_R = cos(φ/2)/4 · F, with h = sin(φ/2).
    let around = Azimuth::new(0.002, ETA, 1.0, DVec3::ZERO);
    for degrees in [5.0f64, 60.0, 120.0] {
        let phi = degrees.to_radians();
        let [s, p] = reflectance((phi / 2.0).cos());
        let want = 0.25 * (phi / 2.0).cos() * 0.5 * (s + p);
        let got = around.at(phi)[0].x;
        // The error is the logistic's variance π²s²/3 times half the second derivative, far below this bound.
        assert!((got - want).abs() < 1e-3 * want, "{got}, not {want} at {degrees}°");
    }
}

#[test]
fn around_the_strand_nothing_is_lost() {
    for roughness in [0.1, 0.3, 1.0] {
        let around = Azimuth::new(logistic_scale(roughness), ETA, 0.8, DVec3::new(0.5, 0.1, 0.0));
        let steps = 720;
        let mut sum = [DVec3::ZERO; 4];
        for i in 0..steps {
            let n = around.at((i as f64 + 0.5) * TAU / steps as f64);
            (0..4).for_each(|p| sum[p] += n[p] * (TAU / steps as f64));
        }
        for (sum, want) in sum.into_iter().zip(around.attenuation()) {
            assert!((sum - want).abs().max_element() < 1e-4 * want.max_element(), "{sum}, not {want}");
        }
    }
}

#[test]
fn roughness_spreads_the_lobes_as_chiang_and_others_say() {
    let [r, tt, trt, residual] = variances(0.3);
    // The variance is (0.726·0.3 + 0.812·0.3²)² radians². A lobe is half as wide through the strand, and
    // twice as wide after a reflection.
    assert!((r.sqrt() - 0.29088).abs() < 1e-6, "{r}");
    assert_eq!([tt, trt, residual], [r / 4.0, 4.0 * r, 4.0 * r]);
    // √(π/8)·(0.265·0.2 + 1.194·0.2²).
    assert!((logistic_scale(0.2) - 0.063141).abs() < 1e-6, "{}", logistic_scale(0.2));
}

#[test]
fn the_trimmed_logistic_holds_one_turn() {
    for s in [0.02, 0.5, 4.0] {
        let d = Logistic::new(s);
        let steps = 100_000;
        let sum: f64 = (0..steps).map(|i| d.at((i as f64 + 0.5) * TAU / steps as f64 - 5.0)).sum();
        assert!((sum * TAU / steps as f64 - 1.0).abs() < 1e-6, "{s}");
        assert!((d.at(0.3) - d.at(-0.3)).abs() < 1e-12 && (d.at(0.3) - d.at(0.3 + TAU)).abs() < 1e-9);
    }
}

#[test]
fn along_the_strand_nothing_is_lost_for_any_variance() {
    let roughest = variances(1.0)[2];
    for v in [1e-6, 1e-4, 0.01, 0.3, 3.0, roughest] {
        for theta_i in [0.0f64, 0.7, -1.4, FRAC_PI_2] {
            // The range around the peak at −θ_i is 40 standard deviations wide.
            let width = (40.0 * f64::sqrt(v)).min(TAU);
            let steps = 4000;
            let mut sum = 0.0;
            for i in 0..steps {
                let theta = -theta_i + ((i as f64 + 0.5) / steps as f64 - 0.5) * width;
                if theta.abs() < FRAC_PI_2 {
                    let coco = theta_i.cos() * theta.cos();
                    let m = longitudinal(v, coco, theta_i.sin() * theta.sin());
                    sum += m * theta.cos() * width / steps as f64;
                }
            }
            // The ends of the range may cut a step. The Bessel function is good to 2e-7.
            assert!((sum - 1.0).abs() < 2e-4, "{sum} for v = {v} at {theta_i}");
        }
    }
}

#[test]
fn the_bessel_function_is_its_integral() {
    for x in [0.0f64, 0.5, 3.0, 3.74, 3.76, 10.0, 100.0, 5000.0] {
        let steps = 2000;
        let angle = |i: i32| (i as f64 + 0.5) * PI / steps as f64;
        let want: f64 = (0..steps).map(|i| (x * (angle(i).cos() - 1.0)).exp()).sum::<f64>() / steps as f64;
        assert!((bessel_i0e(x) - want).abs() < 1e-6 * want, "{x}");
    }
    assert!(longitudinal(1e-9, 1.0, 0.0).is_finite());
}

#[test]
fn absorption_is_pope_and_frys_seen_by_the_cie_observer() {
    let got = pure_water();
    assert!(got.x > got.y && got.y > got.z && got.z > 0.0, "{got}");
    // The observer's table (CIE 1931, 2°) and the spectrum, every 20 nm.
    const ROWS: [([f64; 3], f64); 17] = [
        ([0.0014, 0.0000, 0.0065], 0.01137),
        ([0.0143, 0.0004, 0.0679], 0.00663),
        ([0.1344, 0.0040, 0.6456], 0.00454),
        ([0.3483, 0.0230, 1.7471], 0.00635),
        ([0.2908, 0.0600, 1.6692], 0.00979),
        ([0.0956, 0.1390, 0.8130], 0.0127),
        ([0.0049, 0.3230, 0.2720], 0.0204),
        ([0.0633, 0.7100, 0.0782], 0.0409),
        ([0.2904, 0.9540, 0.0203], 0.0474),
        ([0.5945, 0.9950, 0.0039], 0.0619),
        ([0.9163, 0.8700, 0.0017], 0.0896),
        ([1.0622, 0.6310, 0.0008], 0.2224),
        ([0.8544, 0.3810, 0.0002], 0.2755),
        ([0.4479, 0.1750, 0.0000], 0.3108),
        ([0.1649, 0.0610, 0.0000], 0.410),
        ([0.0468, 0.0170, 0.0000], 0.465),
        ([0.0114, 0.0041, 0.0000], 0.624),
    ];
    let (mut sum, mut weights) = (DVec3::ZERO, DVec3::ZERO);
    for ([x, y, z], a) in ROWS {
        let srgb = DVec3::new(
            3.2406 * x - 1.5372 * y - 0.4986 * z,
            -0.9689 * x + 1.8758 * y + 0.0415 * z,
            0.0557 * x - 0.2040 * y + 1.0570 * z,
        );
        sum += srgb.max(DVec3::ZERO) * a;
        weights += srgb.max(DVec3::ZERO);
    }
    // Half of the rows and a fit replace the table, which is some per cent off where the spectrum is steep.
    assert!((got / (sum / weights) - 1.0).abs().max_element() < 0.03, "{got}, not {}", sum / weights);
}
