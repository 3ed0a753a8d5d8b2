//! The waves of a pool's surface, eight of them side by side. Twin: the loop of `pool_normal` in
//! `shaders/engine/pool.wgsl`, whose sums have another order.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f32x8};
use glam::Vec2;

use super::pool::SINE;
use crate::engine::pool_surface::{Surface, WAVES, Wave};

/// Waves side by side.
const LANES: usize = 8;

/// The waves of one pool.
pub struct Waves {
    simd: Level,
    groups: [Group; WAVES / LANES],
}

/// Eight waves; see [`Wave`].
#[derive(Default)]
struct Group {
    toward: [[f32; LANES]; 2],
    k: [f32; LANES],
    phase: [f32; LANES],
    slope: [f32; LANES],
    /// 1 for a ring, 0 for a straight wave.
    ring: [f32; LANES],
    decay: [f32; LANES],
}

impl Waves {
    /// Takes the waves of a surface.
    pub fn new(surface: &Surface) -> Self {
        let group = |number: usize| {
            let waves = &surface.waves[number * LANES..][..LANES];
            let each = |value: fn(&Wave) -> f32| std::array::from_fn(|lane| value(&waves[lane]));
            Group {
                toward: [each(|wave| wave.toward[0]), each(|wave| wave.toward[1])],
                k: each(|wave| wave.k),
                phase: each(|wave| wave.phase),
                slope: each(|wave| wave.slope),
                ring: each(|wave| wave.ring),
                decay: each(|wave| wave.decay),
            }
        };
        Waves { simd: Level::new(), groups: std::array::from_fn(group) }
    }

    /// Returns the slopes of the surface along x and z at the point `p` = (x, z), metres, and the lift of its
    /// normal. `churn` scales the slopes. A wave fades out as `footprint`, the width of a pixel on the
    /// surface in metres, reaches half its length.
    pub fn slopes(&self, p: Vec2, churn: f32, footprint: f32) -> (Vec2, f32) {
        dispatch!(self.simd, simd => sums(simd, &self.groups, p, churn, footprint))
    }
}

#[inline(always)]
fn sums<S: Simd>(simd: S, groups: &[Group], p: Vec2, churn: f32, footprint: f32) -> (Vec2, f32) {
    let (px, pz, one) = (of(simd, p.x), of(simd, p.y), of(simd, 1.0));
    let mut sums = [of(simd, 0.0); 3];
    for group in groups {
        let (tx, tz, k) = (load(simd, &group.toward[0]), load(simd, &group.toward[1]), load(simd, &group.k));
        let is_ring = load(simd, &group.ring).simd_gt(of(simd, 0.5));
        let (away_x, away_z) = (px - tx, pz - tz);
        let away = (away_x * away_x + away_z * away_z).sqrt().max(of(simd, 1e-3));
        let along = is_ring.select(away, tx * px + tz * pz);
        let (tx, tz) = (is_ring.select(away_x / away, tx), is_ring.select(away_z / away, tz));
        let fall = is_ring.select(one + along * load(simd, &group.decay), one);
        let wide = of(simd, 3.0) * k * of(simd, footprint);
        let blur = one + wide * wide;
        let steep = load(simd, &group.slope) * of(simd, churn) / (fall * fall) / (blur * blur);
        let t = k * along + load(simd, &group.phase);
        let slope = steep * sin_turns(simd, t + of(simd, 0.25));
        sums[0] += tx * slope;
        sums[1] += tz * slope;
        sums[2] += steep * sin_turns(simd, t);
    }
    // The lanes are added in their order, so that the sum is the same in registers of any width.
    let [x, z, lift] = sums.map(|lanes| <[f32; LANES]>::from(lanes).iter().sum::<f32>());
    (Vec2::new(x, z), lift)
}

/// The same number in every lane.
#[inline(always)]
fn of<S: Simd>(simd: S, x: f32) -> f32x8<S> {
    f32x8::splat(simd, x)
}

#[inline(always)]
fn load<S: Simd>(simd: S, values: &[f32; LANES]) -> f32x8<S> {
    f32x8::load_array_ref(simd, values)
}

/// See [`super::pool::sin_turns`].
#[inline(always)]
fn sin_turns<S: Simd>(simd: S, t: f32x8<S>) -> f32x8<S> {
    let x = t - (t + of(simd, 0.5)).floor();
    let x2 = x * x;
    let mut sum = of(simd, SINE[0]);
    // The closure of a fold would be compiled without the instruction set.
    for &c in &SINE[1..] {
        sum = sum * x2 + of(simd, c);
    }
    sum * x
}
