//! The comparison code must be able to fail: a comparison that always passes proves nothing.

use taki::output::frame::{Difference, Tolerance};

const TIGHT: Tolerance = Tolerance { relative: 1e-3, absolute: 1e-4 };

fn picture() -> Vec<[f32; 3]> {
    (0..64 * 48).map(|i| [i as f32 / 3072.0, (i % 64) as f32 / 64.0, 0.25]).collect()
}

#[test]
fn a_picture_equals_itself() {
    let d = Difference::new(64, &picture(), &picture(), TIGHT);
    assert_eq!((d.outside, d.max, d.rmse), (0, 0.0, 0.0));
}

#[test]
fn one_perturbed_pixel_is_seen_and_named() {
    let mut other = picture();
    other[64 * 7 + 5][1] += 0.01;
    let d = Difference::new(64, &picture(), &other, TIGHT);
    assert_eq!(d.outside, 1);
    assert_eq!(d.worst, [5, 7]);
    assert!((d.max - 0.01).abs() < 1e-6 && d.rmse > 0.0);
}

#[test]
fn a_pixel_that_is_not_a_number_is_outside_even_beside_itself() {
    let mut broken = picture();
    broken[3] = [f32::NAN; 3];
    assert_eq!(Difference::new(64, &broken, &broken, TIGHT).outside, 1);
    broken[3] = [f32::INFINITY; 3];
    assert_eq!(Difference::new(64, &picture(), &broken, TIGHT).outside, 1);
}

#[test]
fn a_picture_one_percent_brighter_is_outside_nearly_everywhere() {
    let brighter: Vec<[f32; 3]> = picture().iter().map(|p| p.map(|x| x * 1.01)).collect();
    assert!(Difference::new(64, &picture(), &brighter, TIGHT).share_outside() > 0.99);
}

#[test]
fn swapped_rows_are_seen() {
    let mut other = picture();
    other.reverse();
    assert!(Difference::new(64, &picture(), &other, TIGHT).share_outside() > 0.9);
}
