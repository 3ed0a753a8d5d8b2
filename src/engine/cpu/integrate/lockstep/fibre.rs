//! Kajiya and Kay's model for eight cells. Twin of `src/light/fibre.rs`, with the same operations in the same
//! order.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::cells::v_codes;
use crate::light::fibre::whole_exponent;
use crate::util::lane_powers::pow;
use crate::util::lanes::{Floats, Lanes3, Stored, Stored3, Words, signed};

/// Metric of every ray; see [`crate::light::fibre::Metric`].
#[derive(Clone, Copy)]
pub struct Metric<S: Simd>(pub [Floats<S>; 4]);

impl<S: Simd> Metric<S> {
    /// Loads the entries of M.
    #[inline(always)]
    pub fn load(simd: S, [a, b, c, d]: &[Stored; 4]) -> Self {
        Metric([a.load(simd), b.load(simd), c.load(simd), d.load(simd)])
    }

    /// Returns vᵀ M v.
    #[inline(always)]
    pub fn squared(&self, v: Lanes3<S>) -> Floats<S> {
        let [m00, m01x2, m11, m22] = self.0;
        (m00 * v.x + m01x2 * v.y) * v.x + m11 * v.y * v.y + m22 * v.z * v.z
    }
}

/// See [`crate::light::fibre::fibre_angles`].
#[inline(always)]
fn fibre_angles<S: Simd>(
    simd: S,
    t_dot_l: Floats<S>,
    t_dot_e: Floats<S>,
    inverse_q: Floats<S>,
) -> [Floats<S>; 2] {
    let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
    let sin2_l = (one - t_dot_l * t_dot_l * inverse_q).max(zero);
    let sin2_e = (one - t_dot_e * t_dot_e * inverse_q).max(zero);
    [sin2_l.sqrt(), (sin2_l * sin2_e).sqrt() - t_dot_l * t_dot_e * inverse_q]
}

/// See [`crate::light::fibre::psi_parts`].
#[inline(always)]
pub fn psi_parts<S: Simd>(
    simd: S,
    [k_d, k_s]: [Floats<S>; 2],
    exponent: &Exponent,
    t_dot_l: Floats<S>,
    t_dot_e: Floats<S>,
    inverse_q: Floats<S>,
) -> [Floats<S>; 2] {
    let [sin_l, base] = fibre_angles(simd, t_dot_l, t_dot_e, inverse_q);
    [k_d * sin_l, k_s * exponent.power(simd, base.max(f32x8::splat(simd, 0.0)))]
}

/// Exponent of the specular term.
#[derive(Clone, Copy)]
pub struct Exponent {
    p: f32,
    /// p as an integer, where powers of it are products.
    whole: Option<u32>,
}

impl Exponent {
    /// Exponent p.
    pub fn new(p: f32) -> Self {
        Exponent { p, whole: whole_exponent(p) }
    }

    /// See [`crate::light::fibre::specular_power`].
    #[inline(always)]
    pub fn power<S: Simd>(&self, simd: S, x: Floats<S>) -> Floats<S> {
        let Some(mut bits) = self.whole else {
            return pow(simd, x, f32x8::splat(simd, self.p));
        };
        let (mut power, mut result) = (x, f32x8::splat(simd, 1.0));
        while bits != 0 {
            if bits & 1 == 1 {
                result *= power;
            }
            power *= power;
            bits >>= 1;
        }
        result
    }
}

/// Second moments of directions; see [`crate::volume::Moments`].
#[derive(Clone, Copy)]
pub struct Moments<S: Simd> {
    pub diagonal: Lanes3<S>,
    pub mixed: Lanes3<S>,
}

impl<S: Simd> Moments<S> {
    /// No directions.
    #[inline(always)]
    pub fn zero(simd: S) -> Self {
        let zero = f32x8::splat(simd, 0.0);
        let none = Lanes3 { x: zero, y: zero, z: zero };
        Moments { diagonal: none, mixed: none }
    }

    /// Moments of the directions in the second words of cells.
    #[inline(always)]
    pub fn of(word: Words<S>) -> Self {
        let v = v_codes(word);
        Moments {
            diagonal: Lanes3 { x: v.x * v.x, y: v.y * v.y, z: v.z * v.z },
            mixed: Lanes3 { x: v.x * v.y, y: v.x * v.z, z: v.y * v.z },
        }
    }

    /// xx + yy + zz.
    #[inline(always)]
    pub fn trace(&self) -> Floats<S> {
        self.diagonal.x + self.diagonal.y + self.diagonal.z
    }

    /// Adds `share` times other moments.
    #[inline(always)]
    pub fn add(&mut self, other: Moments<S>, share: Floats<S>) {
        self.diagonal = self.diagonal.plus(other.diagonal.times(share));
        self.mixed = self.mixed.plus(other.mixed.times(share));
    }

    /// Products with one number a lane.
    #[inline(always)]
    pub fn scaled(&self, factor: Floats<S>) -> Self {
        Moments { diagonal: self.diagonal.times(factor), mixed: self.mixed.times(factor) }
    }

    /// Stores the moments.
    #[inline(always)]
    pub fn store(&self, [diagonal, mixed]: &mut [Stored3; 2]) {
        diagonal.store(self.diagonal);
        mixed.store(self.mixed);
    }

    /// Loads the moments.
    #[inline(always)]
    pub fn load(simd: S, [diagonal, mixed]: &[Stored3; 2]) -> Self {
        Moments { diagonal: diagonal.load(simd), mixed: mixed.load(simd) }
    }

    /// Unpacks the second words of coarse cells.
    #[inline(always)]
    pub fn unpacked(simd: S, word: Words<S>) -> Self {
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let (x, z) = (unsigned_share(word), unsigned_share(word >> 7));
        let yy = (one - x * x - z * z).max(zero);
        let y = yy.sqrt();
        Moments {
            diagonal: Lanes3 { x: x * x, y: yy, z: z * z },
            mixed: Lanes3 {
                x: signed_share(word << 12) * (x * y),
                y: signed_share(word << 6) * (x * z),
                z: signed_share(word) * (y * z),
            },
        }
    }

    /// Moments J·S·Jᵀ of the directions J·v, by the columns of J.
    #[inline(always)]
    pub fn mapped(&self, [x, y, z]: &[Lanes3<S>; 3]) -> Self {
        let rows = [
            Lanes3 { x: x.x, y: y.x, z: z.x },
            Lanes3 { x: x.y, y: y.y, z: z.y },
            Lanes3 { x: x.z, y: y.z, z: z.z },
        ];
        let times = [self.times(rows[0]), self.times(rows[1]), self.times(rows[2])];
        Moments {
            diagonal: Lanes3 { x: rows[0].dot(times[0]), y: rows[1].dot(times[1]), z: rows[2].dot(times[2]) },
            mixed: Lanes3 { x: rows[0].dot(times[1]), y: rows[0].dot(times[2]), z: rows[1].dot(times[2]) },
        }
    }

    /// Product S·v.
    #[inline(always)]
    fn times(&self, v: Lanes3<S>) -> Lanes3<S> {
        let (d, m) = (self.diagonal, self.mixed);
        Lanes3 {
            x: d.x * v.x + m.x * v.y + m.y * v.z,
            y: m.x * v.x + d.y * v.y + m.z * v.z,
            z: m.y * v.x + m.z * v.y + d.z * v.z,
        }
    }
}

/// Reflection by fibres with a distribution of directions; see [`crate::light::fibre::Spread`].
#[derive(Clone, Copy)]
pub struct Spread<S: Simd> {
    simd: S,
    s_e: Lanes3<S>,
    moments: Moments<S>,
    inverse_q: Floats<S>,
    cos2_e: Floats<S>,
    variance: Floats<S>,
}

impl<S: Simd> Spread<S> {
    /// Prepares the terms that all lights of a cell share.
    #[inline(always)]
    pub fn new(simd: S, metric: &Metric<S>, moments: Moments<S>, e_v: Lanes3<S>) -> Self {
        let splat = |x: f32| f32x8::splat(simd, x);
        let [a, b2, c, d] = metric.0;
        let (s, m, b) = (moments.diagonal, moments.mixed, splat(0.5) * b2);
        let row = |x, y, z| Lanes3 { x, y, z };
        let p = [
            row(a * s.x + b * m.x, a * m.x + b * s.y, a * m.y + b * m.z),
            row(b * s.x + c * m.x, b * m.x + c * s.y, b * m.y + c * m.z),
            row(d * m.y, d * m.z, d * s.z),
        ];
        let inverse_q = splat(1.0) / (p[0].x + p[1].y + p[2].z).max(splat(1e-30));
        let crossed = p[0].y * p[1].x + p[0].z * p[2].x + p[1].z * p[2].y;
        let squares = p[0].x * p[0].x + p[1].y * p[1].y + p[2].z * p[2].z + splat(2.0) * crossed;
        let s_e = moments.times(e_v).times(inverse_q);
        Spread {
            simd,
            s_e,
            moments,
            inverse_q,
            cos2_e: s_e.dot(e_v),
            variance: (splat(0.5) - splat(0.5) * squares * inverse_q * inverse_q).max(splat(0.0)),
        }
    }

    /// Means of (t·l)² and of (t·l)(t·e) over the distribution.
    #[inline(always)]
    fn cosines(&self, l_v: Lanes3<S>) -> [Floats<S>; 2] {
        [self.moments.times(l_v).dot(l_v) * self.inverse_q, self.s_e.dot(l_v)]
    }

    /// Returns t·l and t·e of a single direction with these means.
    #[inline(always)]
    pub fn of_one(&self, l_v: Lanes3<S>) -> [Floats<S>; 2] {
        let (zero, one) = (f32x8::splat(self.simd, 0.0), f32x8::splat(self.simd, 1.0));
        let [cos2_l, product] = self.cosines(l_v);
        let e = self.cos2_e.max(zero).min(one).sqrt();
        [cos2_l.max(zero).min(one).sqrt(), product.simd_lt(zero).select(-e, e)]
    }

    /// See [`crate::light::fibre::Spread::along`].
    #[inline(always)]
    pub fn along(
        &self,
        [t_dot_l, t_dot_e]: [Floats<S>; 2],
        l_v: Lanes3<S>,
        way: Lanes3<S>,
    ) -> [Floats<S>; 2] {
        let zero = f32x8::splat(self.simd, 0.0);
        let mean = self.moments.times(l_v).times(self.inverse_q).plus(self.s_e);
        let is_against = mean.dot(way).simd_lt(zero) ^ (t_dot_l + t_dot_e).simd_lt(zero);
        [is_against.select(-t_dot_l, t_dot_l), is_against.select(-t_dot_e, t_dot_e)]
    }

    /// Diffuse and specular part of the reflection Ψ, with the highlight convolved with the spread of the
    /// directions.
    #[inline(always)]
    pub fn psi_parts(
        &self,
        [k_d, k_s]: [Floats<S>; 2],
        p: &Exponent,
        l_v: Lanes3<S>,
        l_dot_e: Floats<S>,
    ) -> [Floats<S>; 2] {
        let splat = |x: f32| f32x8::splat(self.simd, x);
        let (zero, one) = (splat(0.0), splat(1.0));
        let [cos2_l, product] = self.cosines(l_v);
        let sin2_l = (one - cos2_l).max(zero);
        let sin2_e = (one - self.cos2_e).max(zero);
        let root = (sin2_l * sin2_e).sqrt();
        let cos_phi = ((l_dot_e - product) / root.max(splat(1e-6))).max(-one).min(one);
        let variance = self.variance * (one + cos_phi);
        let base = (root - product + splat(0.5) * variance).max(zero).min(one);
        let wide = one + splat(p.p) * variance;
        [k_d * sin2_l.sqrt(), k_s * pow(self.simd, base, splat(p.p) / wide) / wide.sqrt()]
    }
}

/// Numbers from 0 to 1 in the lowest 7 bits.
#[inline(always)]
fn unsigned_share<S: Simd>(word: Words<S>) -> Floats<S> {
    signed(word & 127).to_float::<f32x8<S>>() * (1.0 / 127.0)
}

/// Numbers from −1 to 1 in the highest 6 bits.
#[inline(always)]
fn signed_share<S: Simd>(word: Words<S>) -> Floats<S> {
    (signed(word) >> 26).to_float::<f32x8<S>>() * (1.0 / 31.0)
}
