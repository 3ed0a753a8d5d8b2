//! §3 Shading of a pool with a field of waves and foam, eight points side by side. Twin:
//! `shaders/engine/pool_field.wgsl`.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::{NOISE, value_noise};
use crate::engine::pool_surface::{Foam, SlopeMap, Surface};
use crate::place::PoolField;
use crate::util::lanes::{Floats, LANES, Stored};

/// Reads a texel of four floats for each lane. Cells beyond the border are those on it.
#[inline(always)]
fn load<S: Simd>(
    simd: S,
    (size, texels): ([usize; 2], &[[f32; 4]]),
    columns: &[i32; LANES],
    rows: &[i32; LANES],
    [dx, dz]: [i32; 2],
) -> [Floats<S>; 4] {
    let mut out = [Stored::default(); 4];
    for lane in 0..LANES {
        let x = (columns[lane].saturating_add(dx)).clamp(0, size[0] as i32 - 1) as usize;
        let z = (rows[lane].saturating_add(dz)).clamp(0, size[1] as i32 - 1) as usize;
        let texel = texels[z * size[0] + x];
        for c in 0..4 {
            out[c].0[lane] = texel[c];
        }
    }
    [out[0].load(simd), out[1].load(simd), out[2].load(simd), out[3].load(simd)]
}

/// Returns whole numbers as lanes in memory. Numbers out of range become the nearest.
#[inline(always)]
fn whole<S: Simd>(lanes: Floats<S>) -> [i32; LANES] {
    let lanes: [f32; LANES] = lanes.into();
    let mut out = [0; LANES];
    for lane in 0..LANES {
        out[lane] = lanes[lane] as i32;
    }
    out
}

/// Returns the slopes of the field along x and z at points (x, z), metres, at the times of the samples.
/// Quadratic B-splines between the cells keep the slopes' own slopes continuous, which mirrored pictures
/// show.
#[inline(always)]
pub fn slopes<S: Simd>(
    simd: S,
    surface: &Surface,
    map: &SlopeMap,
    [px, pz]: [Floats<S>; 2],
    time: Floats<S>,
) -> [Floats<S>; 2] {
    let splat = |x: f32| f32x8::splat(simd, x);
    let (half, zero) = (splat(0.5), splat(0.0));
    let scale = splat(surface.field_scale);
    let sx = (px - splat(surface.field_origin[0])) * scale;
    let sz = (pz - splat(surface.field_origin[1])) * scale;
    let (middle_x, middle_z) = (sx.floor(), sz.floor());
    let (fx, fz) = (sx - middle_x - half, sz - middle_z - half);
    let (low_x, high_x) = (half - fx, half + fx);
    let (low_z, high_z) = (half - fz, half + fz);
    let of_x = [low_x * low_x * half, splat(0.75) - fx * fx, high_x * high_x * half];
    let of_z = [low_z * low_z * half, splat(0.75) - fz * fz, high_z * high_z * half];
    let (columns, rows) = (whole(middle_x), whole(middle_z));
    let mut sums = [zero; 4];
    for z in 0..3 {
        let mut row = [zero; 4];
        for x in 0..3 {
            let at = [x as i32 - 1, z as i32 - 1];
            let texel = load(simd, (map.size, &map.texels), &columns, &rows, at);
            for c in 0..4 {
                row[c] += texel[c] * of_x[x];
            }
        }
        for c in 0..4 {
            sums[c] += row[c] * of_z[z];
        }
    }
    [sums[0] + sums[2] * time, sums[1] + sums[3] * time]
}

/// Returns density of the foam, velocity along x and z in metres per second, and noise at points (x, z),
/// interpolated linearly.
#[inline(always)]
pub fn carried_at<S: Simd>(
    simd: S,
    surface: &Surface,
    field: &PoolField,
    [px, pz]: [Floats<S>; 2],
) -> [Floats<S>; 4] {
    let splat = |x: f32| f32x8::splat(simd, x);
    let one = splat(1.0);
    let scale = splat(0.5 * surface.field_scale);
    let sx = (px - splat(surface.field_origin[0])) * scale - splat(0.5);
    let sz = (pz - splat(surface.field_origin[1])) * scale - splat(0.5);
    let (low_x, low_z) = (sx.floor(), sz.floor());
    let (f, g) = (sx - low_x, sz - low_z);
    let (columns, rows) = (whole(low_x), whole(low_z));
    let texels = (field.coarse.size, &field.carried[..]);
    let a = load(simd, texels, &columns, &rows, [0, 0]);
    let b = load(simd, texels, &columns, &rows, [1, 0]);
    let c = load(simd, texels, &columns, &rows, [0, 1]);
    let d = load(simd, texels, &columns, &rows, [1, 1]);
    let mut out = [splat(0.0); 4];
    for k in 0..4 {
        let near = a[k] * (one - f) + b[k] * f;
        let far = c[k] * (one - f) + d[k] * f;
        out[k] = near * (one - g) + far * g;
    }
    out
}

/// Returns cover and noise of the foam of a `density` at points (x, z), whose pattern is carried with the
/// velocity `v`. Two patterns cross-fade, of which each is taken up anew while it does not show (Max and
/// Becker 1996): a pattern carried on and on would be drawn out without end.
#[inline(always)]
pub fn lace<S: Simd>(
    simd: S,
    surface: &Surface,
    [px, pz]: [Floats<S>; 2],
    [vx, vz]: [Floats<S>; 2],
    density: Floats<S>,
) -> [Floats<S>; 2] {
    let splat = |x: f32| f32x8::splat(simd, x);
    let [time_a, time_b, share_a, share_b] = surface.carry;
    let at = |time: f32| [px - vx * splat(time), pz - vz * splat(time)];
    let [cover_a, noise_a] = one_lace(simd, surface, at(time_a), density);
    let [cover_b, noise_b] = one_lace(simd, surface, at(time_b), density);
    let (share_a, share_b) = (splat(share_a), splat(share_b));
    [cover_a * share_a + cover_b * share_b, noise_a * share_a + noise_b * share_b]
}

/// Returns the noise of one lattice at points (x, z).
#[inline(always)]
fn turned_noise<S: Simd>(simd: S, [px, pz]: [Floats<S>; 2], lattice: &Foam) -> Floats<S> {
    let [cos, sin] = [f32x8::splat(simd, lattice.axis[0]), f32x8::splat(simd, lattice.axis[1])];
    value_noise(simd, px * cos - pz * sin, px * sin + pz * cos, lattice)
}

/// Returns cover and noise of one pattern: lines along which noise has its mean, and which close to cells.
/// They widen with the density to a whole cover, and lie in patches. Wide noise moves the fine one, which
/// makes it swirl.
#[inline(always)]
fn one_lace<S: Simd>(simd: S, surface: &Surface, p: [Floats<S>; 2], density: Floats<S>) -> [Floats<S>; 2] {
    let splat = |x: f32| f32x8::splat(simd, x);
    let (zero, half, one) = (splat(0.0), splat(0.5), splat(1.0));
    let foam = &surface.foam;
    let wide = turned_noise(simd, p, &foam[0]);
    let next = turned_noise(simd, p, &foam[1]);
    let by = splat(0.2 / surface.foam_scale);
    let q = [p[0] + (wide - half) * by, p[1] + (next - half) * by];
    let noise = splat(NOISE[0]) * wide
        + splat(NOISE[1]) * next
        + splat(NOISE[2]) * turned_noise(simd, q, &foam[2])
        + splat(NOISE[3]) * turned_noise(simd, q, &foam[3]);
    let patches = ((splat(2.2) * density + wide - splat(1.05)) * splat(1.5)).max(zero).min(one);
    let width = splat(0.03) + splat(0.25) * density * density;
    let line = ((width - (noise - half).abs()) * splat(9.0) + half).max(zero).min(one);
    let thick = splat(0.45) + splat(0.55) * (splat(1.6) * density).min(one);
    [patches * line * thick, noise]
}
