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

/// Sums θ_i + θ_o, radians, at which the four lobes have their middle, for scales on the surface that are
/// tilted by `tilt`.
///
/// The outer surface of a scale widens towards the tip, so its normal is tilted towards the root. What it
/// reflects is turned by 2α towards the root, and what comes through or back from the inside is turned
/// towards the tip. The values are those of Marschner et al. 2003, table 1: half of the sum is −α for R, α/2
/// for TT and 3α/2 for TRT. Light that stays inside for longer leaves without a preference, as it does around
/// the strand.
pub fn shifts(tilt: f64) -> [f64; LOBES] {
    [-2.0 * tilt, tilt, 3.0 * tilt, 0.0]
}

/// Longitudinal lobe M(θ_i, θ_o) per unit of sin θ_o; its integral over sin θ_o is 1.
///
/// `coco` = cos θ_i·cos θ_o and `sisi` = sin θ_i·sin θ_o. Both directions point outward, so the mirror
/// direction is θ_o = −θ_i. The exponential and I₀ are scaled so that neither overflows for any v.
/// [`shifted`] may turn an inclination beyond 90°, where `coco` is negative; I₀ is even.
pub fn longitudinal(v: f64, coco: f64, sisi: f64) -> f64 {
    let x = coco.abs();
    ((x - sisi - 1.0) / v).exp() * bessel_i0e(x / v) / (v * -(-2.0 / v).exp_m1())
}

/// Longitudinal lobe M(θ_i − s/2, θ_o − s/2) whose middle is at θ_i + θ_o = `shift` = s. Both inclinations
/// are turned by one half, so light and eye may change places. `sum` = θ_i + θ_o, the rest as in
/// [`longitudinal`].
pub fn shifted(v: f64, shift: f64, sum: f64, coco: f64, sisi: f64) -> f64 {
    // The turn keeps cos(θ_i − θ_o) = coco + sisi and changes cos(θ_i + θ_o) = coco − sisi. It is exactly 0
    // without a shift.
    let more = 0.5 * ((sum - shift).cos() - sum.cos());
    longitudinal(v, coco + more, sisi - more)
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
