//! §1 Spatial fractal curves, tested against the statements of the paper's §2.1. Reference truth.

use glam::Vec3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use taki::curve::{CurveShape, levels_for, spatial_fractal_curve};

const P1: Vec3 = Vec3::new(3.0, 0.0, 5.0);
const P2: Vec3 = Vec3::new(3.0, 40.0, 5.0);

fn curve(shape: CurveShape, p1: Vec3, p2: Vec3, seed: u64) -> Vec<Vec3> {
    let mut points = vec![Vec3::NAN; 3];
    spatial_fractal_curve(&shape, p1, p2, &mut Pcg64Mcg::seed_from_u64(seed), &mut points);
    points
}

fn length(points: &[Vec3]) -> f64 {
    points.windows(2).map(|p| (p[1] - p[0]).as_dvec3().length()).sum()
}

#[test]
fn the_scale_is_two_to_the_minus_n_h() {
    for h in [0.0f32, 0.5, 0.9, 1.0, 2.0] {
        let shape = CurveShape { h, sigma_g_cells: 1.0, levels: 1 };
        assert_eq!(shape.scale(0), 1.0);
        for n in 1..=16 {
            // Recurrence of eq. (1): S(n) = S(n−1)·0.5^h.
            let step = shape.scale(n) as f64 / shape.scale(n - 1) as f64;
            assert!((step - 0.5f64.powf(h as f64)).abs() < 1e-6, "h {h}, n {n}: {step}");
            assert!((shape.scale(n) as f64 - 2f64.powf(-(n as f64) * h as f64)).abs() < 1e-6);
        }
    }
}

#[test]
fn a_curve_keeps_its_ends_and_has_two_to_the_levels_segments() {
    for levels in 0..=12 {
        let points = curve(CurveShape { h: 0.3, sigma_g_cells: 9.0, levels }, P1, P2, 1);
        assert_eq!(points.len(), (1 << levels) + 1);
        assert_eq!((points[0], points[points.len() - 1]), (P1, P2));
        assert!(points.iter().all(|p| p.is_finite()));
    }
}

#[test]
fn the_same_seed_gives_the_same_curve_and_another_seed_another() {
    let shape = CurveShape { h: 0.9, sigma_g_cells: 2.0, levels: 7 };
    assert_eq!(curve(shape, P1, P2, 5), curve(shape, P1, P2, 5));
    assert_ne!(curve(shape, P1, P2, 5), curve(shape, P1, P2, 6));
}

#[test]
fn without_amplitude_a_curve_is_the_straight_line() {
    let points = curve(CurveShape { h: 0.9, sigma_g_cells: 0.0, levels: 5 }, P1, P2, 1);
    for (i, p) in points.iter().enumerate() {
        assert_eq!(*p, P1 + (P2 - P1) * (i as f32 / 32.0));
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 500,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(4),
        ..ProptestConfig::default()
    })]

    #[test]
    fn every_midpoint_is_displaced_perpendicular_to_its_segment(
        a in [-50.0f32..50.0, -50.0f32..50.0, -50.0f32..50.0],
        b in [-50.0f32..50.0, -50.0f32..50.0, -50.0f32..50.0],
        h in 0.0f32..2.0,
        seed: u64,
    ) {
        let levels = 6;
        let points = curve(CurveShape { h, sigma_g_cells: 3.0, levels }, a.into(), b.into(), seed);
        let mut displaced = 0;
        for level in 1..=levels {
            let stride = (points.len() - 1) >> (level - 1);
            for start in (0..points.len() - 1).step_by(stride) {
                let (p, q) = (points[start].as_dvec3(), points[start + stride].as_dvec3());
                let r = points[start + stride / 2].as_dvec3() - (p + q) * 0.5;
                let along = (q - p).normalize_or_zero();
                // Rounding error of coordinates of up to a few hundred cells.
                prop_assert!(r.dot(along).abs() < 1e-4, "{r} along {along} at level {level}");
                displaced += usize::from(r.length() > 1e-3);
            }
        }
        prop_assert!(displaced > 10, "only {displaced} of 63 midpoints were displaced");
    }
}

#[test]
fn the_first_displacement_is_normal_with_sigma_s_1_along_a_uniform_axis() {
    let shape = CurveShape { h: 0.7, sigma_g_cells: 2.0, levels: 1 };
    let sigma = 2.0 * 2f64.powf(-0.7);
    let n = 40_000;
    let (mut r2, mut r4, mut x, mut z, mut x2, mut xz) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for seed in 0..n {
        let r = (curve(shape, P1, P2, seed)[1] - (P1 + P2) * 0.5).as_dvec3() / sigma;
        assert!(r.y.abs() < 1e-6);
        let square = r.length_squared();
        r2 += square;
        r4 += square * square;
        x += r.x;
        z += r.z;
        x2 += r.x * r.x;
        xz += r.x * r.z;
    }
    // Five standard errors. For a normal g, E g² = 1 (variance 2) and E g⁴ = 3 (variance 96). The fourth
    // moment distinguishes a normal g on a random axis from a displacement that is normal along both axes
    // (2).
    let five = |variance: f64| 5.0 * (variance / n as f64).sqrt();
    let mean = |sum: f64| sum / n as f64;
    assert!((mean(r2) - 1.0).abs() < five(2.0), "variance {}", mean(r2));
    assert!((mean(r4) - 3.0).abs() < five(96.0), "fourth moment {}", mean(r4));
    assert!(mean(x).abs() < five(0.5) && mean(z).abs() < five(0.5), "mean {} {}", mean(x), mean(z));
    // For a uniform axis, E (g cos)² = 1/2 and E g² cos·sin = 0.
    assert!((mean(x2) - 0.5).abs() < five(3.0 * 0.375 - 0.25), "along x {}", mean(x2));
    assert!(mean(xz).abs() < five(3.0 * 0.125), "correlation {}", mean(xz));
}

#[test]
fn a_larger_h_makes_shorter_and_smoother_curves() {
    let figures = [0.3f32, 0.6, 0.9, 1.2, 1.8].map(|h| {
        let shape = CurveShape { h, sigma_g_cells: 2.0, levels: 7 };
        let (mut total, mut turn) = (0.0, 0.0);
        for seed in 0..200 {
            let points = curve(shape, P1, P2, seed);
            total += length(&points);
            turn += points.windows(3).map(|p| (p[1] - p[0]).angle_between(p[2] - p[1]) as f64).sum::<f64>();
        }
        (total, turn)
    });
    for pair in figures.windows(2) {
        assert!(pair[1].0 < pair[0].0, "lengths {figures:?}");
        assert!(pair[1].1 < pair[0].1, "turns {figures:?}");
    }
    assert!(figures[4].0 > 200.0 * 40.0, "no curve is shorter than its line");
}

#[test]
fn the_default_depth_is_the_least_that_spans_half_a_cell() {
    for ny in [1, 2, 3, 7, 8, 9, 39, 40, 41, 64, 300, 400, 1_000_000] {
        let span = |levels: u32| ny as f64 / 2f64.powi(levels as i32);
        let levels = levels_for(ny);
        assert!(span(levels) <= 0.5, "ny {ny}: {levels} levels span {}", span(levels));
        assert!(span(levels - 1) > 0.5, "ny {ny}: one level less would do");
    }
}

#[test]
fn at_the_default_depth_segments_stay_shorter_than_a_cell() {
    for ny in [16u32, 40, 100, 400] {
        // The default look: h = 0.9, amplitude 0.05 flow lengths.
        let levels = levels_for(ny);
        let shape = CurveShape { h: 0.9, sigma_g_cells: 0.05 * ny as f32, levels };
        let (p1, p2) = (Vec3::ZERO, Vec3::new(0.0, ny as f32, 0.0));
        let (mut longer, mut all) = (0, 0);
        for seed in 0..100 {
            let points = curve(shape, p1, p2, seed);
            all += points.len() - 1;
            longer += points.windows(2).filter(|p| p[0].distance(p[1]) >= 1.0).count();
        }
        assert!(longer * 100 <= all, "ny {ny}: {longer} of {all} segments are a cell or longer");
    }
}
