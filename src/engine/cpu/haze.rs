//! Haze in front of eight points. Twin of `src/light/haze.rs`.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use crate::light::haze::{EyeHaze, LEAST_X, SERIES};
use crate::util::lane_powers::exp2;
use crate::util::lanes::{Floats, Lanes3};

/// Transmittance over `t` metres along unit directions with the y component `d_y`. See
/// [`EyeHaze::transmittance`].
#[inline(always)]
pub fn transmittance<S: Simd>(simd: S, haze: &EyeHaze, d_y: Floats<S>, t: Floats<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let one = splat(1.0);
    let bits = splat(-std::f32::consts::LOG2_E);
    let x = (d_y * t * splat(haze.falloff)).max(splat(LEAST_X));
    let series = one - x * (splat(0.5) - x * splat(1.0 / 6.0));
    let mean = x.abs().simd_lt(splat(SERIES)).select(series, (one - exp2(simd, x * bits)) / x);
    exp2(simd, splat(haze.density) * t * mean * bits)
}

/// Radiance of surfaces, or of the background, behind haze of this transmittance. Twin: `haze_over` of
/// `shaders/light/haze.wgsl`.
#[inline(always)]
pub fn in_front_of<S: Simd>(
    simd: S,
    haze: &EyeHaze,
    radiance: Lanes3<S>,
    transmittance: Floats<S>,
) -> Lanes3<S> {
    let hidden = f32x8::splat(simd, 1.0) - transmittance;
    radiance.times(transmittance).plus(Lanes3::splat(simd, haze.color).times(hidden))
}
