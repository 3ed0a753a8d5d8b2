//! 2^x, log₂ x and x^p of the CPU engine's rays: few operations, and on every machine the same bits.
//!
//! The C library's functions would be called once a cell, and they differ between systems. These consist of
//! sums, products and one quotient alone, so eight of them run side by side in SIMD registers with the same
//! bits (`src/util/lane_powers.rs`, their twin).

use std::f32::consts::LN_2;

/// 1.5·2²³: added to a number it rounds it to a whole one, which then lies in the low bits.
pub const ROUNDER: f32 = 12_582_912.0;
/// Smallest exponent: below it 2^x counts as 0.
pub const LEAST_EXPONENT: f32 = -127.0;
/// Coefficients of f¹ to f⁶ of 2^f, −½ ≤ f ≤ ½; the relative error is at most 2e-9 before rounding.
pub const EXP2: [f32; 6] =
    [LN_2, 0.240_226_48, 0.055_503_324, 0.009_618_437, 0.001_339_887_5, 0.000_153_533_62];
/// Coefficients of s¹, s³, s⁵ and s⁷ of log₂ m, s = (m − 1)/(m + 1), ½√2 ≤ m < √2; the relative error is at
/// most 7e-10 before rounding.
pub const LOG2: [f32; 4] = [2.885_39, 0.961_798_85, 0.576_714_4, 0.431_735_84];
/// Bits of ½√2.
pub const ROOT_HALF_BITS: u32 = 0x3f35_04f3;

/// 2^x for x ≤ 127, with a relative error of at most 2e-7; 0 below 2^−126. 2^0 is exactly 1.
#[inline]
pub fn exp2(x: f32) -> f32 {
    let x = if x > LEAST_EXPONENT { x } else { LEAST_EXPONENT };
    let rounded = x + ROUNDER;
    let f = x - (rounded - ROUNDER);
    let [a, b, c, d, e, g] = EXP2;
    // In pairs, so that a processor need not wait for one product after the other.
    let f2 = f * f;
    let power = 1.0 + f * ((a + f * b) + f2 * (c + f * d) + (f2 * f2) * (e + f * g));
    let exponent = rounded.to_bits().wrapping_sub(ROUNDER.to_bits()).wrapping_add(127);
    power * f32::from_bits(exponent << 23)
}

/// log₂ x for x ≥ 2^−126, with an error of at most 1e-7 (of log₂ x, or of 1 if that is larger); −127 for 0.
#[inline]
pub fn log2(x: f32) -> f32 {
    let bits = x.to_bits();
    let exponent = (bits.wrapping_sub(ROOT_HALF_BITS) as i32) >> 23;
    let m = f32::from_bits(bits.wrapping_sub((exponent << 23) as u32));
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let [a, b, c, d] = LOG2;
    exponent as f32 + s * (a + z * (b + z * (c + z * d)))
}

/// x^p for 0 ≤ x ≤ 1 and p ≥ 0.
#[inline]
pub fn pow(x: f32, p: f32) -> f32 {
    exp2(p * log2(x))
}
