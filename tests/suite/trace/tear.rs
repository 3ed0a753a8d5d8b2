//! Torn water: its share, its loop, and its mean from afar.

use glam::Vec2;
use taki::mapping::Tear;
use taki::trace::tear::{erosion, mean};

const LATTICE: [u32; 2] = [40, 24];
/// A level at which every hole is seen.
const NEAR: f32 = -20.0;

/// Erosion at the places of a grid that is no multiple of the holes' lattice.
fn field(open: f32, level: f32) -> Vec<f32> {
    let tear = Tear { open: [open; 2], lattice: LATTICE };
    let places = (0..401 * 397).map(|i| Vec2::new((i % 401) as f32 / 401.0, (i / 401) as f32 / 397.0));
    places.map(|place| erosion(&tear, 0.5, place, 640.0, level)).collect()
}

fn mean_of(all: &[f32]) -> f32 {
    all.iter().sum::<f32>() / all.len() as f32
}

#[test]
fn as_much_water_is_torn_as_the_mean_says() {
    assert!(field(0.0, NEAR).iter().all(|e| *e == 0.0));
    let mut last = 0.0;
    for open in [0.1, 0.3, 0.6, 0.8, 1.0] {
        let all = field(open, NEAR);
        assert!(all.iter().all(|e| (0.0..=1.0).contains(e)));
        // Noise of few octaves is not quite normal.
        assert!((mean_of(&all) - mean(open)).abs() < 0.03, "{open}: {} and {}", mean_of(&all), mean(open));
        let touched = all.iter().filter(|e| **e > 0.0).count() as f32 / all.len() as f32;
        assert!((touched - open).abs() < 0.04, "{open}: {touched} is touched");
        assert!(mean_of(&all) > last);
        last = mean_of(&all);
    }
}

#[test]
fn holes_that_a_pixel_does_not_resolve_are_their_mean() {
    let near = field(0.5, NEAR);
    let deviation = |all: &[f32]| {
        let mean = mean_of(all);
        (all.iter().map(|e| (e - mean).powi(2)).sum::<f32>() / all.len() as f32).sqrt()
    };
    // A hole's cell is 16 cells wide: level 4.
    assert_eq!(field(0.5, 2.0), near);
    assert!(deviation(&field(0.5, 3.0)) < 0.6 * deviation(&near));
    assert!(field(0.5, 4.0).iter().all(|e| (e - mean(0.5)).abs() < 1e-6));
}

#[test]
fn holes_repeat_with_the_volume_without_a_step() {
    let tear = Tear { open: [0.7; 2], lattice: LATTICE };
    let at = |x: f32, y: f32| erosion(&tear, 0.5, Vec2::new(x, y), 640.0, NEAR);
    let near = 1.0 - 1.0 / 16_777_216.0;
    for i in 0..1000 {
        let along = i as f32 / 1000.0;
        assert!((at(0.0, along) - at(near, along)).abs() < 0.01);
        assert!((at(along, 0.0) - at(along, near)).abs() < 0.01);
    }
}

#[test]
fn tears_grow_down_a_quad() {
    let tear = Tear { open: [0.0, 0.8], lattice: LATTICE };
    let at = |v: f32| {
        let places = (0..10_000).map(|i| Vec2::new((i % 100) as f32 / 100.0, (i / 100) as f32 / 100.0));
        mean_of(&places.map(|place| erosion(&tear, v, place, 640.0, NEAR)).collect::<Vec<_>>())
    };
    assert_eq!(at(0.0), 0.0);
    assert!((at(0.5) - mean(0.4)).abs() < 0.03 && (at(1.0) - mean(0.8)).abs() < 0.03);
}
