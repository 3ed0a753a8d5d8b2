//! The strand model for eight cells. Twin of `src/light/strand/table.rs`, with the same operations in the
//! same order.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8, u32x8};

use super::fibre::Spread;
use crate::light::strand::table::{
    CONE_SHARE, SINE_SHARE, SIZE, StrandShading, StrandTable, TILTED_X, UNIT_BITS,
};
use crate::util::lanes::{Floats, Ints, LANES, Lanes3, Words, signed};

/// Texels from the first to the last that one lookup reads, in a table of `nx` nodes along x.
const fn span(nx: usize) -> usize {
    nx * SIZE[1] + nx + 2
}

/// See [`StrandShading::cosines`].
#[inline(always)]
pub fn cosines<S: Simd>(
    shading: &StrandShading,
    spread: &Spread<S>,
    l_v: Lanes3<S>,
    way: impl FnOnce() -> Lanes3<S>,
) -> [Floats<S>; 2] {
    let cosines = spread.of_one(l_v);
    if shading.table.is_tilted() { spread.along(cosines, l_v, way()) } else { cosines }
}

/// See [`StrandShading::psi`].
#[inline(always)]
pub fn psi<S: Simd>(
    simd: S,
    shading: &StrandShading,
    [k_d, k_s]: [Floats<S>; 2],
    [t_dot_l, t_dot_e]: [Floats<S>; 2],
    l_dot_e: Floats<S>,
) -> Lanes3<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let (zero, one) = (splat(0.0), splat(1.0));
    let (aeration, g) = (shading.aeration, shading.g);
    let sum = k_d + k_s;
    let own = (k_d * 2.0 / sum * aeration).max(zero).min(one);
    let a = sum.simd_gt(zero).select(own, splat(aeration));
    let x = (l_dot_e * (2.0 * g) + (1.0 + g * g)).max(splat(1e-6));
    let air = a * (0.25 * (1.0 - g * g)) / (x * x.sqrt());
    let Lanes3 { x, y, z } = of_table(simd, &shading.table, [t_dot_l, t_dot_e], l_dot_e);
    let rest = one - a;
    Lanes3 { x: x * rest + air, y: y * rest + air, z: z * rest + air }
}

/// See [`StrandTable::psi`].
#[inline(always)]
fn of_table<S: Simd>(
    simd: S,
    table: &StrandTable,
    [t_dot_l, t_dot_e]: [Floats<S>; 2],
    l_dot_e: Floats<S>,
) -> Lanes3<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let (zero, one) = (splat(0.0), splat(1.0));
    let sisi = t_dot_l * t_dot_e;
    let coco = ((one - t_dot_l * t_dot_l).max(zero) * (one - t_dot_e * t_dot_e).max(zero)).sqrt();
    let mut s = ((one - coco + sisi) * 0.5).max(zero).min(one).sqrt();
    let cos_d = ((one + coco + sisi) * 0.5).max(zero).min(one).sqrt();
    let sin2_half_phi = ((coco + sisi - l_dot_e) / (coco.max(splat(1e-6)) * 2.0)).max(zero).min(one);
    let both = t_dot_l + t_dot_e;
    if table.is_tilted() {
        s = (both.abs() / (cos_d.max(splat(1e-6)) * 2.0)).min(one);
    }
    let x = s * (1.0 + table.squeeze) / (s + table.squeeze);
    let far = (one - (one - sin2_half_phi).sqrt()) * (1.0 - SINE_SHARE);
    let z = sin2_half_phi.sqrt() * SINE_SHARE + far;
    let Lanes3 { x, y, z } = if table.is_tilted() {
        let is_back = both.simd_lt(zero);
        let cos_h = (one - s * s).sqrt();
        let x = x * CONE_SHARE + (one - cos_h) * (1.0 - CONE_SHARE);
        let x = is_back.select(-x, x) * 0.5 + 0.5;
        sample::<S, TILTED_X, { span(TILTED_X) }>(simd, table.texels(), [x, cos_d, z])
    } else {
        sample::<S, { SIZE[0] }, { span(SIZE[0]) }>(simd, table.texels(), [x, cos_d, z])
    };
    let near = if table.is_tilted() { cos_d * cos_d } else { coco };
    let root = (near + table.spread).sqrt();
    Lanes3 { x: x / root, y: y / root, z: z / root }
}

/// Trilinear interpolation at coordinates from 0 to 1, in a table of `NX` nodes along x.
#[inline(always)]
fn sample<S: Simd, const NX: usize, const SPAN: usize>(
    simd: S,
    texels: &[u32],
    [x, y, z]: [Floats<S>; 3],
) -> Lanes3<S> {
    let [nx, ny, nz] = [NX, SIZE[1], SIZE[2]];
    let (ix, fx) = split(simd, x, nx);
    let (iy, fy) = split(simd, y, ny);
    let (iz, fz) = split(simd, z, nz);
    let whole = |n: usize| i32x8::splat(simd, n as i32);
    let first: [i32; LANES] = ((iz * whole(ny) + iy) * whole(nx) + ix).to_array();
    // Two neighbours along x of every lane, in four rows.
    let mut rows = [[[0; 2]; LANES]; 4];
    for lane in 0..LANES {
        // The index of an idle lane may be any number.
        let texels =
            texels.get(first[lane] as u32 as usize..).and_then(|texels| texels.first_chunk::<SPAN>());
        if let Some(texels) = texels {
            rows[0][lane] = [texels[0], texels[1]];
            rows[1][lane] = [texels[nx], texels[nx + 1]];
            rows[2][lane] = [texels[nx * ny], texels[nx * ny + 1]];
            rows[3][lane] = [texels[nx * ny + nx], texels[nx * ny + nx + 1]];
        }
    }
    let near = lerp(simd, along_x(simd, &rows[0], fx), along_x(simd, &rows[1], fx), fy);
    let far = lerp(simd, along_x(simd, &rows[2], fx), along_x(simd, &rows[3], fx), fy);
    lerp(simd, near, far, fz)
}

/// Node below a coordinate on an axis of `n` nodes, and the share of the next one.
#[inline(always)]
fn split<S: Simd>(simd: S, x: Floats<S>, n: usize) -> (Ints<S>, Floats<S>) {
    let x = x * (n - 1) as f32;
    let i = x.to_int::<i32x8<S>>().min(i32x8::splat(simd, n as i32 - 2));
    (i, x - i.to_float::<f32x8<S>>())
}

/// Interpolates between the two texels of every lane.
#[inline(always)]
fn along_x<S: Simd>(simd: S, texels: &[[u32; 2]; LANES], share: Floats<S>) -> Lanes3<S> {
    let (low, high) = texels.as_flattened().split_at(LANES);
    let (low, high) = (u32x8::from_slice(simd, low), u32x8::from_slice(simd, high));
    lerp(simd, unpack(low.unzip_low(high)), unpack(low.unzip_high(high)), share)
}

/// Numbers with 9 bits each and a shared exponent.
#[inline(always)]
fn unpack<S: Simd>(word: Words<S>) -> Lanes3<S> {
    let unit = f32x8::from_bits(((word >> 27) + UNIT_BITS) << 23);
    let whole = |word: Words<S>| signed(word & 0x1ff).to_float::<f32x8<S>>();
    Lanes3 { x: whole(word) * unit, y: whole(word >> 9) * unit, z: whole(word >> 18) * unit }
}

/// Interpolates between two colours.
#[inline(always)]
fn lerp<S: Simd>(simd: S, a: Lanes3<S>, b: Lanes3<S>, share: Floats<S>) -> Lanes3<S> {
    a.times(f32x8::splat(simd, 1.0) - share).plus(b.times(share))
}
