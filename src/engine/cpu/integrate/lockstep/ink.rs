//! Colours of eight cells of one volume. Twin of `src/light/ramp.rs`.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use crate::light::ramp::Ramp;
use crate::util::lanes::{Floats, Lanes3};

/// See [`crate::light::ramp::Ink`].
#[derive(Clone, Copy)]
pub struct Ink<S: Simd> {
    pub color: Lanes3<S>,
    pub k_s: Floats<S>,
}

impl<S: Simd> Ink<S> {
    /// See [`Ramp::ink`].
    #[inline(always)]
    pub fn of(simd: S, ramp: &Ramp, code: Floats<S>) -> Self {
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let at = code * (1.0 / 255.0) * ramp.count;
        let mut color = Lanes3::splat(simd, ramp.first);
        for (i, &step) in ramp.steps.iter().enumerate() {
            let share = (at - i as f32).max(zero).min(one);
            color = color.plus(Lanes3::splat(simd, step).times(share));
        }
        Ink { color, k_s: code * ramp.k_s[0] + ramp.k_s[1] }
    }

    /// See [`crate::light::ramp::Ink::lit`].
    #[inline(always)]
    pub fn lit(&self, [diffuse, specular]: [Floats<S>; 2]) -> Lanes3<S> {
        let Lanes3 { x, y, z } = self.color.times(diffuse);
        Lanes3 { x: x + specular, y: y + specular, z: z + specular }
    }

    /// Colour minus white, times a weight.
    #[inline(always)]
    pub fn tint(&self, simd: S, weight: Floats<S>) -> Lanes3<S> {
        let one = f32x8::splat(simd, 1.0);
        let Lanes3 { x, y, z } = self.color;
        Lanes3 { x: x - one, y: y - one, z: z - one }.times(weight)
    }
}
