//! §3 Shading of a pool's surface in the raster pass, eight points side by side. Twin:
//! `shaders/engine/pool.wgsl`.

mod field;

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, u32x8};
use glam::Vec3;

use super::lights::{background_at, irradiance_at, light_at};
use super::opaque::{Points, fresnel};
use crate::engine::pool_surface::{AROUND, FOAM, Foam, SlopeMap, Surface};
use crate::mapping::FARTHEST;
use crate::place::PoolField;
use crate::scene::Scene;
use crate::util::lane_powers::exp2;
use crate::util::lanes::floor_cell;
use crate::util::lanes::{Floats, LANES, Lanes3, Stored, Words, unsigned};

/// Returns sin(2πt) with an error below 3e-5. It replaces WGSL's `sin`, whose error the standard leaves open.
#[inline(always)]
pub fn sin_turns<S: Simd>(simd: S, t: Floats<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let x = t - (t + splat(0.5)).floor();
    let x2 = x * x;
    let mut sum = splat(SINE[0]);
    // The closure of a fold would be compiled without the instruction set.
    for &c in &SINE[1..] {
        sum = sum * x2 + splat(c);
    }
    sum * x
}

/// Coefficients of [`sin_turns`], that of the highest power first.
const SINE: [f32; 7] =
    [3.8199526, -15.094643, 42.058694, -76.70586, 81.60525, -41.341_7, std::f32::consts::TAU];

/// Hashes lattice points to numbers from 0 to 1.
#[inline(always)]
fn lattice<S: Simd>(simd: S, x: Words<S>, y: Words<S>) -> Floats<S> {
    let splat = |x: u32| u32x8::splat(simd, x);
    let h = (x * splat(0x8da6_b343)) ^ (y * splat(0xd816_3841));
    let h = (h ^ (h >> 13)) * splat(0x9e37_79b1);
    let h = h ^ (h >> 16);
    (h >> 8).to_float::<f32x8<S>>() * f32x8::splat(simd, 1.0 / 16_777_216.0)
}

/// Value noise: interpolates smoothly between the values of the lattice. The lattice is fixed to the world;
/// (x, y) is measured from the scene's origin, in cells.
#[inline(always)]
fn value_noise<S: Simd>(simd: S, x: Floats<S>, y: Floats<S>, origin: &Foam) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let (x, y) = (x + splat(origin.rest[0]), y + splat(origin.rest[1]));
    let (left, low) = (floor_cell(simd, x), floor_cell(simd, y));
    let (f, g) = (x - left.to_float::<f32x8<S>>(), y - low.to_float::<f32x8<S>>());
    let s = f * f * (splat(3.0) - splat(2.0) * f);
    let t = g * g * (splat(3.0) - splat(2.0) * g);
    let one = u32x8::splat(simd, 1);
    let left = unsigned(left) + u32x8::splat(simd, origin.cells[0] as u32);
    let low = unsigned(low) + u32x8::splat(simd, origin.cells[1] as u32);
    let (right, high) = (left + one, low + one);
    let [a, b] = [lattice(simd, left, low), lattice(simd, right, low)];
    let [c, d] = [lattice(simd, left, high), lattice(simd, right, high)];
    let near = a + (b - a) * s;
    let far = c + (d - c) * s;
    near + (far - near) * t
}

/// Returns the slopes of the surface along x and z at the points (x, z), metres, and the lift of its normal.
/// `churn` scales the slopes. A wave fades out as `footprint`, the width of a pixel on the surface in metres,
/// reaches half its length, because the pixel then sees the wave's mean. `time` is that of the samples.
/// Beside a field, waves are moved by `bend` metres along their direction.
#[inline(always)]
fn slopes<S: Simd>(
    simd: S,
    surface: &Surface,
    [px, pz]: [Floats<S>; 2],
    bend: Option<Floats<S>>,
    churn: Floats<S>,
    footprint: Floats<S>,
    time: Floats<S>,
) -> [Floats<S>; 3] {
    let splat = |x: f32| f32x8::splat(simd, x);
    let one = splat(1.0);
    let mut sums = [splat(0.0); 3];
    for wave in &surface.waves {
        // There may be fewer rings than places for them.
        if wave.slope == 0.0 {
            continue;
        }
        let (tx, tz) = (splat(wave.toward[0]), splat(wave.toward[1]));
        let wide = splat(3.0 * wave.k) * footprint;
        let blur = one + wide * wide;
        let (tx, tz, along, thin) = if wave.ring > 0.5 {
            let (away_x, away_z) = (px - tx, pz - tz);
            let away = (away_x * away_x + away_z * away_z).sqrt().max(splat(1e-3));
            let inverse = one / away;
            (away_x * inverse, away_z * inverse, away, blur * (one + away * splat(wave.decay)))
        } else {
            let along = tx * px + tz * pz;
            let along = if let Some(bend) = bend { along + bend } else { along };
            (tx, tz, along, blur)
        };
        let steep = splat(wave.slope) * churn / (thin * thin);
        let t = splat(wave.k) * along + splat(wave.phase) + splat(wave.moves) * time;
        let slope = steep * sin_turns(simd, t + splat(0.25));
        sums[0] += tx * slope;
        sums[1] += tz * slope;
        sums[2] += steep * sin_turns(simd, t);
    }
    sums
}

/// Returns the points where view rays through the points `at` of the image meet the pool's plane. The
/// position interpolated from the triangle's corners differs from it by more than the size of waves. Far or
/// parallel rays keep `position`.
#[inline(always)]
fn on_pool<S: Simd>(
    simd: S,
    rays: &[Vec3; 3],
    surface: &Surface,
    position: Lanes3<S>,
    [x, y]: [Floats<S>; 2],
) -> Lanes3<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let farthest = splat(FARTHEST);
    let [across, along, normal] = [surface.across, surface.along, surface.normal].map(|row| {
        let [one, of_x, of_y] = row.map(|x| f32x8::splat(simd, x));
        one + of_x * x + of_y * y
    });
    let inverse = splat(1.0) / normal.abs().simd_lt(splat(1e-20)).select(splat(1e-20), normal);
    let hx = (across * inverse).max(-farthest).min(farthest);
    let hz = (along * inverse).max(-farthest).min(farthest);
    let t = (splat(-surface.height) * inverse).max(splat(0.0)).min(farthest);
    let [forward, right, up] = rays.map(|v| Lanes3::splat(simd, v));
    let to = forward.plus(right.times(x)).plus(up.times(y));
    let metres = t * to.dot(to).sqrt();
    let is_met = metres.simd_gt(splat(0.0)) & metres.simd_lt(splat(surface.far));
    let [middle_x, middle_y, middle_z] = surface.middle.map(|x| f32x8::splat(simd, x));
    Lanes3 {
        x: is_met.select(middle_x + hx, position.x),
        y: is_met.select(middle_y, position.y),
        z: is_met.select(middle_z + hz, position.z),
    }
}

/// Looks up the surroundings that rays from `position` along `r` meet: radiance × cover, and the cover. The
/// surroundings are projected on a sphere (Lagarde and Zanuttini 2012).
#[inline(always)]
fn around<S: Simd>(simd: S, surface: &Surface, position: Lanes3<S>, r: Lanes3<S>) -> (Lanes3<S>, Floats<S>) {
    let splat = |x: f32| f32x8::splat(simd, x);
    let (zero, one) = (splat(0.0), splat(1.0));
    let [columns, rows] = AROUND;
    let o = position.minus(Lanes3::splat(simd, surface.middle.into()));
    let b = o.dot(r);
    let c = o.dot(o) - splat(surface.radius * surface.radius);
    let far = o.plus(r.times(((b * b - c).max(zero).sqrt() - b).max(zero)));
    let d = far.over(far.dot(far).max(splat(1e-12)).sqrt());
    // See `turn` of `src/engine/pool_surface/mod.rs`.
    let p = d.x / (d.x.abs() + d.z.abs()).max(splat(1e-20));
    let turn = splat(0.25) * d.z.simd_ge(zero).select(one - p, splat(3.0) + p);
    let s = turn * splat(columns as f32) - splat(0.5);
    let t = (d.y * splat(rows as f32) - splat(0.5)).max(zero).min(splat(rows as f32 - 1.0));
    let (column, row) = (s.floor(), t.floor());
    let (f, g) = (s - column, t - row);
    let column: [f32; LANES] = column.into();
    let row: [f32; LANES] = row.into();
    let mut texels = [[Stored::default(); 4]; 4];
    for lane in 0..LANES {
        let x0 = (column[lane] as i32 + columns as i32) as usize % columns;
        let (x1, y0) = ((x0 + 1) % columns, row[lane] as usize);
        let y1 = (y0 + 1).min(rows - 1);
        let corners = [y0 * columns + x0, y0 * columns + x1, y1 * columns + x0, y1 * columns + x1];
        for corner in 0..4 {
            let texel = surface.around[corners[corner]];
            for c in 0..4 {
                texels[corner][c].0[lane] = texel[c];
            }
        }
    }
    let mut out = [zero; 4];
    for c in 0..4 {
        let low = texels[0][c].load(simd) * (one - f) + texels[1][c].load(simd) * f;
        let high = texels[2][c].load(simd) * (one - f) + texels[3][c].load(simd) * f;
        out[c] = low * (one - g) + high * g;
    }
    let [x, y, z, cover] = out;
    (Lanes3 { x, y, z }, cover)
}

/// Textures of a pool with a field: its slopes and what it carries.
pub type FieldMaps<'a> = (&'a SlopeMap, &'a PoolField);

/// Shades a pool's surface under the points `at` of the image. Returns the linear radiance, metres from the
/// eye, and the unit normal. The radiance adds the mirrored surroundings, the glint of the lights (Blinn 1977
/// with the exponent 256) and the light from below through the depth of water; foam covers all of them.
/// `shadow_light` is [`Scene::shadow_light`], `rays` are the camera's vectors forward, right and up, and
/// `time` is that of the samples while the shutter is open.
#[inline(always)]
pub fn shade<S: Simd>(
    simd: S,
    scene: &Scene,
    shadow_light: Option<usize>,
    rays: &[Vec3; 3],
    (surface, maps): (&Surface, Option<FieldMaps>),
    points: &Points<S>,
    (at, time): ([Floats<S>; 2], Floats<S>),
) -> (Lanes3<S>, Floats<S>, Lanes3<S>) {
    let splat = |x: f32| f32x8::splat(simd, x);
    let (zero, one) = (splat(0.0), splat(1.0));
    let (depth, mut foam) = (points.albedo.x, points.albedo.y);
    let position = on_pool(simd, rays, surface, points.position, at);
    let to_eye = Lanes3::splat(simd, scene.camera.eye_local().as_vec3()).minus(position);
    let distance = to_eye.dot(to_eye).sqrt();
    let e = to_eye.over(distance.max(splat(1e-6)));

    let pixel = 2.0 * scene.camera.tan_half_fov / scene.image.height as f32;
    let footprint = distance * splat(pixel) / e.y.max(splat(0.05));
    let place = [position.x, position.z];
    let carried = maps.map(|(_, field)| field::carried_at(simd, surface, field, place));
    if let Some([carried, ..]) = carried {
        foam = carried.max(foam).min(one);
    }
    // The surface is rougher where water falls in.
    let churn = one + splat(1.5) * foam;
    let bend = carried.map(|[_, _, _, noise]| noise * splat(surface.bend));
    let [mut slope_x, mut slope_z, lift] = slopes(simd, surface, place, bend, churn, footprint, time);
    if let Some((map, _)) = maps {
        let wide = splat(surface.field_blur) * footprint;
        let blur = one + wide * wide;
        let [of_x, of_z] = field::slopes(simd, surface, map, place, time);
        slope_x += of_x / (blur * blur);
        slope_z += of_z / (blur * blur);
    }
    let n = Lanes3 { x: -slope_x, y: (one - lift).max(splat(0.3)), z: -slope_z };
    let n = n.over(n.dot(n).sqrt());
    // The mirrored view never points into the water, because other waves would hide that view.
    let r = n.times(splat(2.0) * n.dot(e)).minus(e);
    let r = Lanes3 { y: r.y.abs().max(splat(0.01)), ..r };
    let r = r.over(r.dot(r).sqrt());

    let ambient = Lanes3::splat(simd, scene.ambient);
    let (ambient, sky) = match &scene.environment {
        None => (ambient, background_at(simd, &scene.background, r)),
        // The environment's sun is already a light, so the mean radiance about the ray is used.
        Some(environment) => {
            let up = Lanes3::splat(simd, environment.irradiance.at(Vec3::Y));
            (ambient.plus(up), irradiance_at(simd, &environment.irradiance, r))
        }
    };
    let mut irradiance = ambient.times(one - points.occlusion);
    let mut glint = Lanes3::splat(simd, Vec3::ZERO);
    for (i, light) in scene.lights.iter().enumerate() {
        let (to_light, intensity) = light_at(simd, light, position);
        let lit = if shadow_light == Some(i) { one - points.shadow } else { one };
        irradiance = irradiance.plus(intensity.times(lit * to_light.y.max(zero)));
        let sum = to_light.plus(e);
        let h = sum.over(sum.dot(sum).max(splat(1e-12)).sqrt());
        let mut c = n.dot(h).max(zero);
        for _ in 0..8 {
            c *= c;
        }
        let lobe = splat(33.0) * fresnel(simd, to_light.dot(h)) * c * n.dot(to_light).max(zero);
        glint = glint.plus(intensity.times(lit * lobe));
    }
    let (mirrors, cover) = around(simd, surface, position, r);
    let mirror = mirrors.plus(sky.times(one - cover));
    // log₂e · 2.2: light travels 2.2 depths on its way down and, slanted by refraction, up again.
    let bits = splat(-3.174) * depth;
    let [r_through, g_through, b_through] =
        surface.absorption.map(|absorption| exp2(simd, f32x8::splat(simd, absorption) * bits));
    let through = Lanes3 { x: r_through, y: g_through, z: b_through };
    let color = Lanes3::splat(simd, surface.color.into());
    let bottom = Lanes3::splat(simd, surface.bottom.into());
    let body = color.by(Lanes3::splat(simd, Vec3::ONE).minus(through)).plus(bottom.by(through));
    let back = fresnel(simd, n.dot(e).max(splat(0.02)));
    let clear = mirror.times(back).plus(glint).plus(body.by(irradiance).times(one - back));

    // Noise is at most 1, so that there is no foam where its density is 0.
    if !foam.simd_gt(zero).any_true() {
        return (clear, distance, n);
    }
    if let Some([_, v_x, v_z, _]) = carried {
        let aside = splat(0.1 / surface.foam_scale);
        let p = [position.x + n.x * aside, position.z + n.z * aside];
        let [cover, noise] = field::lace(simd, surface, p, [v_x, v_z], foam);
        let white = irradiance.times((splat(0.25) + splat(0.5) * noise) * cover);
        return (clear.times(one - cover).plus(white), distance, n);
    }
    let (x, z) = (position.x + n.x * splat(0.3), position.z + n.z * splat(0.3));
    let mut noise = zero;
    for i in 0..FOAM.len() {
        let scale = splat(FOAM[i]);
        noise += splat(NOISE[i]) * value_noise(simd, x * scale, z * scale, &surface.foam[i]);
    }
    let cover = ((splat(1.6) * foam + noise - splat(1.05)) * splat(2.2)).max(zero).min(one);
    let white = irradiance.times((splat(0.25) + splat(0.5) * noise) * cover);
    (clear.times(one - cover).plus(white), distance, n)
}

/// Shares of the octaves of noise, whose lattices are [`FOAM`].
const NOISE: [f32; FOAM.len()] = [0.45, 0.27, 0.17, 0.11];
