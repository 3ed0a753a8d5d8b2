//! Billows of mist: their mean, their loop, and the even mist without them.

use glam::Vec3;
use taki::mapping::Billow;
use taki::trace::BillowTimes;
use taki::trace::billow::factor;

const BILLOW: Billow = Billow { strength: 0.6, inverse_size: 2.0, rise: 1.5 };

/// Points of a lattice that is no multiple of the noise's.
fn points() -> impl Iterator<Item = Vec3> {
    (0..20_000).map(|i| {
        let at = i as f32;
        Vec3::new(0.377 * (at % 29.0), 0.291 * (at / 29.0 % 27.0).floor(), 0.413 * (at / 783.0).floor())
    })
}

#[test]
fn billows_keep_the_mean_and_the_contrast_at_every_time() {
    for flow in [0.0, 0.13, 0.25, 0.4] {
        let times = BillowTimes::new(flow);
        let all: Vec<f32> = points().map(|p| factor(&BILLOW, &times, p)).collect();
        let mean = all.iter().sum::<f32>() / all.len() as f32;
        let variance = all.iter().map(|f| (f - mean).powi(2)).sum::<f32>() / all.len() as f32;
        assert!((mean - 1.0).abs() < 0.05, "{flow}: {mean}");
        assert!((0.2..0.5).contains(&variance.sqrt()), "{flow}: {variance}");
        assert!(all.iter().all(|f| (0.1..=3.0).contains(f)), "mist has no holes");
    }
}

#[test]
fn billows_return_to_where_their_loop_began_without_a_jump() {
    let at = |flow: f32| -> Vec<f32> {
        let times = BillowTimes::new(flow);
        points().take(500).map(|p| factor(&BILLOW, &times, p)).collect()
    };
    assert!(at(0.0) == at(1.0) && at(0.25) == at(3.25));
    let most = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    // Either field begins anew at one of these.
    for flow in [0.0f32, 0.5] {
        assert!(most(&at((flow - 1e-4).rem_euclid(1.0)), &at(flow + 1e-4)) < 0.01, "{flow}");
    }
    assert!(most(&at(0.0), &at(0.3)) > 0.3);
}

#[test]
fn without_strength_mist_is_even() {
    let even = Billow { strength: 0.0, ..BILLOW };
    assert!(points().all(|p| factor(&even, &BillowTimes::new(0.3), p) == 1.0));
}
