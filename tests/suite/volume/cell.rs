//! The packing of one cell.

use glam::Vec3;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, UnitSphere};
use rand_pcg::Pcg64Mcg;
use taki::volume::{Cell, V_SCALE};

/// Largest angle that the docs of `Cell` state, in degrees.
const LARGEST_ANGLE_DEGREES: f64 = 0.0793;

fn error_degrees(v: Vec3) -> f64 {
    // The cross product is used because near 0 the arc cosine loses all digits.
    let (a, b) = (v.as_dvec3().normalize(), Cell::from_direction(v).v_code().as_dvec3().normalize());
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

#[test]
fn packing_turns_a_direction_by_no_more_than_the_docs_state() {
    let docs = include_str!("../../../src/volume/cell.rs");
    assert!(docs.contains(&format!("{LARGEST_ANGLE_DEGREES}°")), "the docs state another angle");
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    for _ in 0..2_000_000 {
        let v = Vec3::from_array(UnitSphere.sample(&mut rng));
        let error = error_degrees(v);
        assert!(error <= LARGEST_ANGLE_DEGREES, "{v} is turned by {error}°");
    }
    // The worst directions lie beside an axis, half a code off in both other components.
    let mut worst = 0.0f64;
    for sign in [-1.0f32, 1.0] {
        for turn in 0..3 {
            let mut v = [511.0 * sign, 0.499_99, -0.499_99];
            v.rotate_right(turn);
            worst = worst.max(error_degrees(Vec3::from_array(v)));
        }
    }
    assert!(worst <= LARGEST_ANGLE_DEGREES && worst > LARGEST_ANGLE_DEGREES - 1e-4, "{worst}°");
}

#[test]
fn an_unpacked_direction_is_unit_and_points_the_same_way() {
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    for _ in 0..100_000 {
        let v = Vec3::from_array(UnitSphere.sample(&mut rng));
        // The length is arbitrary, because sums of segments are packed as they are.
        let cell = Cell::from_direction(v * (rng.random::<f32>() * 40.0 - 20.0).exp2());
        assert!((cell.v().length() - 1.0).abs() < 1e-6 && cell.v().dot(v) > 0.999_99);
    }
    for axis in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
        assert_eq!(Cell::from_direction(axis).v(), axis);
    }
}

#[test]
fn a_zero_or_vanishing_direction_makes_an_empty_cell() {
    for v in [Vec3::ZERO, -Vec3::ZERO, Vec3::splat(1e-30), Vec3::new(0.0, f32::from_bits(1), 0.0)] {
        assert_eq!(Cell::from_direction(v), Cell::default());
    }
    assert!(!Cell::default().has_direction());
    assert_eq!(Cell::default().v(), Vec3::ZERO);
}

#[test]
fn packing_what_was_unpacked_gives_the_same_code() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let most = V_SCALE as i32;
    for _ in 0..500_000 {
        let mut code = [0; 3].map(|_: i32| rng.random_range(-most..=most) as f32);
        // In every code, one component has the largest magnitude.
        code[rng.random_range(0..3)] = if rng.random() { V_SCALE } else { -V_SCALE };
        let v = Cell::from_direction(Vec3::from_array(code));
        assert_eq!(v.v_code().to_array(), code);
        let rho = rng.random_range(0..=65535u32);
        let (k_d, k_s) = (rng.random_range(0..=255u32), rng.random_range(0..=255u32));
        let cell = Cell { x: rho | k_d << 16 | k_s << 24, y: v.y };
        let k = cell.k();
        let again = Cell::from_direction(cell.v()).with_density(cell.rho(), k.0, k.1);
        assert_eq!(again, cell);
        assert_eq!((again.rho_code(), again.k_codes()), (rho, (k_d, k_s)));
    }
}

#[test]
fn densities_and_coefficients_are_clamped_and_rounded_to_the_nearest_code() {
    let cell = |rho: f32, k: f32| Cell::from_direction(Vec3::Y).with_density(rho, k, 1.0 - k);
    assert_eq!((cell(-3.0, -0.1).rho_code(), cell(-3.0, -0.1).k_codes()), (0, (0, 255)));
    assert_eq!((cell(1.7, 1.1).rho_code(), cell(1.7, 1.1).k_codes()), (65535, (255, 0)));
    for i in 0..=1000 {
        let x = i as f32 / 1000.0;
        assert!((cell(x, x).rho() - x).abs() <= 0.5001 / 65535.0);
        assert!((cell(x, x).k().0 - x).abs() <= 0.5001 / 255.0);
    }
    assert_eq!(cell(0.3, 0.3).v(), Vec3::Y, "density leaves the direction alone");
}

#[test]
fn a_cell_keeps_the_line_of_its_strand_beside_the_direction() {
    const LARGEST_LINE_ANGLE_DEGREES: f64 = 0.0905;
    let docs = include_str!("../../../src/volume/cell.rs");
    assert!(docs.contains(&format!("{LARGEST_LINE_ANGLE_DEGREES}°")), "the docs state another angle");
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    for i in 0..500_000 {
        let mut v = Vec3::from_array(UnitSphere.sample(&mut rng));
        // Two or three components may be equally large.
        if i % 5 == 0 {
            v = Vec3::new(v.x, v.x, if i % 10 == 0 { -v.x } else { v.z });
        }
        let inside = Vec3::new(rng.random(), rng.random(), rng.random());
        let cell = Cell::with_line(v, inside).with_density(0.7, 0.2, 0.9);
        let (a, b) = (v.as_dvec3().normalize(), cell.v_code().as_dvec3().normalize());
        let error = a.cross(b).length().atan2(a.dot(b)).to_degrees();
        assert!(error <= LARGEST_LINE_ANGLE_DEGREES, "{v} is turned by {error}°");
        let (place, axis) = cell.line();
        assert_eq!(place[axis], 0.0);
        // The point where the true line passes the cell's middle along that axis, moved inside.
        let at = inside + v * ((0.5 - inside[axis]) / v[axis]) - 0.5;
        for other in (0..3).filter(|&other| other != axis) {
            let error = (place[other] - at[other].clamp(-0.5, 0.5)).abs();
            assert!(error <= 1.0 / 32.0 + 1e-4, "{v} through {inside}: {place} instead of {at}");
        }
        assert!((cell.rho() - 0.7).abs() < 1e-4);
    }
    assert_eq!(Cell::with_line(Vec3::ZERO, Vec3::splat(0.5)), Cell::default());
}
