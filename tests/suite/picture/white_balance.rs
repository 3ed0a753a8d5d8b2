//! White balance against standard illuminants, and the matrix that adapts a light's colour to 6500 K.

use glam::{DVec2, DVec3};
use taki::picture::white_balance::{matrix, white};

/// Rec. 709 RGB from XYZ, to four digits (IEC 61966-2-1).
fn rgb_from_xyz(xyz: DVec3) -> DVec3 {
    DVec3::new(
        xyz.dot(DVec3::new(3.2406, -1.5372, -0.4986)),
        xyz.dot(DVec3::new(-0.9689, 1.8758, 0.0415)),
        xyz.dot(DVec3::new(0.0557, -0.2040, 1.0570)),
    )
}

fn luminance(rgb: DVec3) -> f64 {
    rgb.dot(DVec3::new(0.2126729, 0.7151522, 0.0721750))
}

#[test]
fn at_6500_kelvin_without_tint_nothing_changes() {
    let m = matrix(6500.0, 0.0).to_cols_array();
    let one = glam::DMat3::IDENTITY.to_cols_array();
    assert!(m.iter().zip(one).all(|(a, b)| (a - b).abs() < 1e-12), "{m:?}");
}

#[test]
fn the_black_bodys_curve_goes_through_the_standard_illuminant_a() {
    // CIE standard illuminant A is a black body of 2856 K at x 0.44757, y 0.40745. Krystek's fit is good to
    // 9e-5 in u and v. The five digits add an error of 1e-5.
    let uv = |xyz: DVec3| DVec2::new(4.0 * xyz.x, 6.0 * xyz.y) / xyz.dot(DVec3::new(1.0, 15.0, 3.0));
    let a = DVec3::new(0.44757, 0.40745, 1.0 - 0.44757 - 0.40745);
    let away = (uv(white(2856.0, 0.0)) - uv(a)).abs();
    assert!(away.max_element() < 1e-4, "{away}");
}

#[test]
fn light_of_the_chosen_temperature_and_tint_becomes_that_of_6500_kelvin_at_the_same_luminance() {
    let neutral = rgb_from_xyz(white(6500.0, 0.0));
    for (temperature, tint) in
        [(1500.0f32, 0.0f32), (2856.0, 0.0), (4000.0, 12.0), (9000.0, -20.0), (15000.0, 0.0)]
    {
        let light = rgb_from_xyz(white(temperature.into(), f64::from(tint) * 1e-3));
        let seen = matrix(temperature, tint) * light;
        // The matrix above has four digits. For a light with hardly any blue, its 1e-4 become 1e-3.
        assert!((seen - neutral).abs().max_element() < 3e-3, "{temperature} K, {tint}: {seen} for {neutral}");
        assert!((luminance(seen) - luminance(neutral)).abs() < 1e-3);
    }
}

#[test]
fn a_lower_temperature_turns_grey_blue_and_a_positive_tint_turns_it_magenta() {
    let grey = DVec3::splat(0.5);
    let cold = matrix(4000.0, 0.0) * grey;
    assert!(cold.z > 0.5 && cold.x < 0.5, "{cold}");
    let warm = matrix(10000.0, 0.0) * grey;
    assert!(warm.z < 0.5 && warm.x > 0.5, "{warm}");
    let magenta = matrix(6500.0, 20.0) * grey;
    assert!(magenta.y < magenta.x && magenta.y < magenta.z, "{magenta}");
}
