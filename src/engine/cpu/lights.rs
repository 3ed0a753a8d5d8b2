//! Light from lamps, environment and background at eight points.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use glam::Vec3;

use crate::light::environment::Irradiance;
use crate::light::{Background, Light};
use crate::util::lanes::{Floats, Lanes3};

/// Returns the radiance of the background along unit directions. Twin: `background_radiance` of
/// `shaders/engine/opaque.wgsl`.
#[inline(always)]
pub fn background_at<S: Simd>(simd: S, background: &Background, d: Lanes3<S>) -> Lanes3<S> {
    let up = d.y.max(f32x8::splat(simd, 0.0));
    let rise = Lanes3::splat(simd, background.zenith - background.horizon);
    Lanes3::splat(simd, background.horizon).plus(rise.times(up))
}

/// See [`Irradiance::at`].
#[inline(always)]
pub fn irradiance_at<S: Simd>(simd: S, irradiance: &Irradiance, n: Lanes3<S>) -> Lanes3<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let Lanes3 { x, y, z } = n;
    let terms = [x, y, z, x * y, y * z, splat(3.0) * y * y - splat(1.0), x * z, x * x - z * z];
    let mut sum = Lanes3::splat(simd, irradiance.0[0]);
    for i in 0..terms.len() {
        sum = sum.plus(Lanes3::splat(simd, irradiance.0[i + 1]).times(terms[i]));
    }
    let zero = splat(0.0);
    Lanes3 { x: sum.x.max(zero), y: sum.y.max(zero), z: sum.z.max(zero) }
}

/// See [`Light::at`].
#[inline(always)]
pub fn light_at<S: Simd>(simd: S, light: &Light, point: Lanes3<S>) -> (Lanes3<S>, Lanes3<S>) {
    let splat = |x: f32| f32x8::splat(simd, x);
    match *light {
        Light::Directional { to_light, intensity } => {
            (Lanes3::splat(simd, to_light), Lanes3::splat(simd, intensity))
        }
        Light::Point { position, intensity } => {
            let (to_light, falloff) = from_point(simd, position, point);
            (to_light, Lanes3::splat(simd, intensity).times(falloff))
        }
        Light::Spot { position, intensity, cone } => {
            let (to_light, falloff) = from_point(simd, position, point);
            let s = (Lanes3::splat(simd, cone.axis).dot(to_light) - splat(cone.cos_edge))
                * splat(cone.inverse_soft);
            let s = s.max(splat(0.0)).min(splat(1.0));
            let falloff = falloff * (s * s * (splat(3.0) - splat(2.0) * s));
            (to_light, Lanes3::splat(simd, intensity).times(falloff))
        }
    }
}

/// Returns the unit directions from points to a light at `position`, and the falloff 1/d² there.
#[inline(always)]
fn from_point<S: Simd>(simd: S, position: Vec3, point: Lanes3<S>) -> (Lanes3<S>, Floats<S>) {
    let away = Lanes3::splat(simd, position).minus(point);
    let d2 = away.dot(away).max(f32x8::splat(simd, 1e-12));
    (away.over(d2.sqrt()), f32x8::splat(simd, 1.0) / d2)
}
