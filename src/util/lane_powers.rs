//! 2^x, log₂ x and x^p of eight lanes. Twin of `src/util/powers.rs`, with the same bits.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8, u32x8};

use super::powers::{EXP2, LEAST_EXPONENT, LOG2, ROOT_HALF_BITS, ROUNDER};

/// See [`super::powers::exp2`].
#[inline(always)]
pub fn exp2<S: Simd>(simd: S, x: f32x8<S>) -> f32x8<S> {
    let x = x.max(f32x8::splat(simd, LEAST_EXPONENT));
    let rounded = x + ROUNDER;
    let f = x - (rounded - ROUNDER);
    let [a, b, c, d, e, g] = EXP2;
    let f2 = f * f;
    let power = f * ((f * b + a) + f2 * (f * d + c) + (f2 * f2) * (f * g + e)) + 1.0;
    let exponent = rounded.to_bits() - u32x8::splat(simd, ROUNDER.to_bits().wrapping_sub(127));
    power * f32x8::from_bits(exponent << 23)
}

/// See [`super::powers::log2`].
#[inline(always)]
pub fn log2<S: Simd>(simd: S, x: f32x8<S>) -> f32x8<S> {
    let bits = x.to_bits();
    let exponent = (bits - ROOT_HALF_BITS).bitcast::<i32x8<S>>() >> 23;
    let m = f32x8::from_bits(bits - (exponent << 23).bitcast::<u32x8<S>>());
    let one = f32x8::splat(simd, 1.0);
    let s = (m - one) / (m + one);
    let z = s * s;
    let [a, b, c, d] = LOG2;
    exponent.to_float::<f32x8<S>>() + s * (z * (z * (z * d + c) + b) + a)
}

/// See [`super::powers::pow`].
#[inline(always)]
pub fn pow<S: Simd>(simd: S, x: f32x8<S>, p: f32x8<S>) -> f32x8<S> {
    exp2(simd, p * log2(simd, x))
}
