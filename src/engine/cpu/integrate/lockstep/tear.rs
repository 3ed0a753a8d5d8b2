//! Torn water under eight rays. Twin of `src/trace/tear.rs`, with the same bits.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, u32x8};

use crate::trace::noise::HASH;
use crate::trace::tear::{INVERSE_DEVIATION, LEADS, LEVELS, OCTAVES, SOFT};
use crate::util::lane_powers::log2;
use crate::util::lanes::{Floats, Words, floor_cell, signed, unsigned};

/// Place of eight rays on their quads and in their volumes, as the scalar twin has it.
pub struct Places<S: Simd> {
    /// Share of the water that is torn.
    pub open: Floats<S>,
    /// Number of the holes' cells across a copy of the volume, and along it.
    pub lattice: [Floats<S>; 2],
    /// Place in the volume, in copies of it.
    pub place: [Floats<S>; 2],
    /// Number of the volume's cells across.
    pub cells: Floats<S>,
    /// Level of the pyramid whose cells a pixel sees.
    pub level: Floats<S>,
}

/// A lattice point's number, 0 to 1. `z` is hashed already.
#[inline(always)]
fn lattice<S: Simd>(simd: S, x: Words<S>, y: Words<S>, z: u32) -> Floats<S> {
    let h = x ^ y ^ u32x8::splat(simd, z);
    let h = (h ^ (h >> 13)) * u32x8::splat(simd, 0x9e37_79b1);
    let h = h ^ (h >> 16);
    // Signed numbers take one instruction to convert, others many.
    signed(h >> 8).to_float::<f32x8<S>>() * f32x8::splat(simd, 1.0 / 16_777_216.0)
}

/// Hashed coordinates of the lattice points before and after `cell` on an axis that repeats after `period`.
#[inline(always)]
fn around<S: Simd>(simd: S, cell: Floats<S>, period: Floats<S>, factor: u32) -> [Words<S>; 2] {
    let one = f32x8::splat(simd, 1.0);
    // The quotients of numbers below 2^24 round to whole numbers only where they are whole.
    let at = cell - period * floor_cell(simd, cell / period).to_float::<f32x8<S>>();
    let next = at + one;
    let next = next.simd_lt(period).select(next, f32x8::splat(simd, 0.0));
    let factor = u32x8::splat(simd, factor);
    [at, next].map(|at| unsigned(floor_cell(simd, at)) * factor)
}

/// Share of the way to the next lattice point, smoothed, and the whole part of a coordinate.
#[inline(always)]
fn smooth<S: Simd>(simd: S, p: Floats<S>) -> (Floats<S>, Floats<S>) {
    let cell = floor_cell(simd, p).to_float::<f32x8<S>>();
    let f = p - cell;
    (f * f * (f32x8::splat(simd, 3.0) - f * f32x8::splat(simd, 2.0)), cell)
}

/// Value noise between two lattice points of one row.
#[inline(always)]
fn row<S: Simd>(simd: S, [x, x1]: [Words<S>; 2], y: Words<S>, z: u32, share: Floats<S>) -> Floats<S> {
    let near = lattice(simd, x, y, z);
    near + (lattice(simd, x1, y, z) - near) * share
}

/// Rank of the places among all of their volumes'.
#[inline(always)]
fn rank<S: Simd>(simd: S, places: &Places<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let [columns, rows] = places.lattice;
    let x = places.place[0] * columns;
    let mut y = places.place[1] * rows;
    for (octave, (finer, ahead)) in LEADS.iter().enumerate() {
        let finer = splat(*finer as f32);
        let (share, cell) = smooth(simd, x * finer);
        let ends = around(simd, cell, columns * finer, HASH[0]);
        let z = (8 + octave as u32).wrapping_mul(HASH[2]);
        y += splat(*ahead) * row(simd, ends, u32x8::splat(simd, 0), z, share);
    }
    let mut sum = splat(0.0);
    for (octave, (across, along, weight)) in OCTAVES.iter().enumerate() {
        let (across, along) = (splat(*across as f32), splat(*along as f32));
        let (share, cell) = smooth(simd, x * across);
        let ends = around(simd, cell, columns * across, HASH[0]);
        let (share_y, cell_y) = smooth(simd, y * along);
        let [near_y, far_y] = around(simd, cell_y, rows * along, HASH[1]);
        let z = (octave as u32).wrapping_mul(HASH[2]);
        let near = row(simd, ends, near_y, z, share);
        let noise = near + (row(simd, ends, far_y, z, share) - near) * share_y;
        sum += splat(*weight) * (noise - splat(0.5));
    }
    let u = (splat(0.5) + sum * splat(0.2 * INVERSE_DEVIATION)).max(splat(0.0)).min(splat(1.0));
    u * u * u * (splat(10.0) + u * (splat(6.0) * u - splat(15.0)))
}

/// Erosion by the holes, 0 to 1.
#[inline(always)]
pub fn erosion<S: Simd>(simd: S, places: &Places<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let (zero, one) = (splat(0.0), splat(1.0));
    let open = places.open;
    let torn = (rank(simd, places) - (one - open)) * splat(1.0 / SOFT);
    let torn = torn.max(zero).min(one);
    let mean = open.simd_lt(splat(SOFT)).select(open * open / splat(2.0 * SOFT), open - splat(0.5 * SOFT));
    let hole = log2(simd, places.cells / places.lattice[0]);
    let unseen = one + (places.level - hole) * splat(1.0 / LEVELS);
    let eroded = torn + (mean - torn) * unseen.max(zero).min(one);
    open.simd_gt(zero).select(eroded, zero)
}
