//! Longitudinal lobes M_p: the spread along the strand (d'Eon, Francois, Hill, Letteri and Aubry, "An
//! Energy-Conserving Hair Reflectance Model", EGSR 2011, eq. 7).

use super::cylinder::LOBES;

/// Variances of the four lobes for a roughness from 0 to 1; small ones are in radians² (Chiang, Bitterli,
/// Tappan and Burley, "A Practical and Controllable Hair and Fur Model for Production Path Tracing", 2016,
/// eq. 7).
pub fn variances(roughness: f64) -> [f64; LOBES] {
    let v = (0.726 * roughness + 0.812 * roughness.powi(2) + 3.7 * roughness.powi(20)).powi(2);
    [v, v / 4.0, 4.0 * v, 4.0 * v]
}

/// Longitudinal lobe M(θ_i, θ_o) per unit of sin θ_o; its integral over sin θ_o is 1.
///
/// `coco` = cos θ_i·cos θ_o and `sisi` = sin θ_i·sin θ_o. Both directions point outward, so the mirror
/// direction is θ_o = −θ_i. The exponential and I₀ are scaled so that neither overflows for any v.
pub fn longitudinal(v: f64, coco: f64, sisi: f64) -> f64 {
    ((coco - sisi - 1.0) / v).exp() * bessel_i0e(coco / v) / (v * -(-2.0 / v).exp_m1())
}

/// Scaled Bessel function e^(−x)·I₀(x) for x ≥ 0 (Abramowitz and Stegun 1964, 9.8.1 and 9.8.2; error below
/// 2e-7).
pub fn bessel_i0e(x: f64) -> f64 {
    let horner = |t: f64, c: &[f64]| c.iter().rev().fold(0.0, |sum, c| sum * t + c);
    if x < 3.75 {
        let t = (x / 3.75).powi(2);
        let i0 = horner(t, &[1.0, 3.5156229, 3.0899424, 1.2067492, 0.2659732, 0.0360768, 0.0045813]);
        return (-x).exp() * i0;
    }
    const LARGE: [f64; 9] = [
        0.39894228,
        0.01328592,
        0.00225319,
        -0.00157565,
        0.00916281,
        -0.02057706,
        0.02635537,
        -0.01647633,
        0.00392377,
    ];
    horner(3.75 / x, &LARGE) / x.sqrt()
}
