//! 2^x, log₂ x and x^p against float64.

use taki::util::powers::{exp2, log2, pow};

#[test]
fn powers_of_two_are_right_to_the_last_bit_but_one() {
    for i in 0..200_000 {
        let x = -126.0 + i as f32 * (252.0 / 200_000.0);
        let truth = f64::from(x).exp2();
        let error = (f64::from(exp2(x)) - truth).abs() / truth;
        assert!(error <= 2e-7, "2^{x}: {} instead of {truth}", exp2(x));
    }
    let exact = [(0.0, 1.0), (-0.0, 1.0), (-1.0, 0.5), (-10.0, 1.0 / 1024.0), (3.0, 8.0)];
    exact.iter().for_each(|&(x, power)| assert_eq!(exp2(x), power));
    [-127.0, -150.0, -1e9, f32::MIN, f32::NEG_INFINITY].iter().for_each(|&x| assert_eq!(exp2(x), 0.0));
}

#[test]
fn logarithms_are_as_accurate_near_one_as_elsewhere() {
    for i in 0..200_000u32 {
        // Bits of positive floats, evenly over all exponents; and numbers near 1.
        for x in [f32::from_bits(0x0080_0000 + i * 10_650), 1.0 + (i as f32 - 100_000.0) * 1e-6] {
            let truth = f64::from(x).log2();
            let error = (f64::from(log2(x)) - truth).abs();
            let near = (x - 1.0).abs() < 0.25;
            let most = if near { 3e-7 * truth.abs() } else { 1e-7 * truth.abs().max(1.0) };
            assert!(error <= most, "log2 of {x}: {} instead of {truth}", log2(x));
        }
    }
    assert_eq!(log2(1.0), 0.0);
    assert_eq!(log2(0.0), -127.0);
}

#[test]
fn powers_below_one_keep_their_digits() {
    for p in [0.0, 0.5, 1.7, 20.0, 10_000.0] {
        for i in 0..=10_000 {
            let x = i as f32 / 10_000.0;
            let truth = f64::from(x).powf(f64::from(p));
            let error = (f64::from(pow(x, p)) - truth).abs();
            assert!(error <= 1e-5 * truth + 1e-12, "{x}^{p}: {} instead of {truth}", pow(x, p));
        }
    }
}
