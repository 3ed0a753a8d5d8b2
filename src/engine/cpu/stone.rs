//! §3 Grain, cracks, moss and streaks of stone, evaluated for eight samples side by side. Twin:
//! `shaders/engine/stone.wgsl`. The numbers of each kind: [`crate::place::stone`].

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, u32x8};
use glam::Vec3;

use super::opaque::{Points, View, fresnel};
use crate::place::stone::{COARSEST, CRACK, CRACK_SHARE, EDGE, GRADIENT, OCTAVES, STREAK, Stone};
use crate::place::tiles::Tile;
use crate::trace::noise::HASH;
use crate::util::lanes::{Floats, LANES, Lanes3, Mask, Words, floor_cell, signed, unsigned};

/// Factor that gives the noise a deviation of 1.
pub const UNIT: f32 = 0.541_047;

/// Noise at a point: its gradient per cell, and its value.
#[derive(Clone, Copy)]
struct Noise<S: Simd> {
    gradient: Lanes3<S>,
    value: Floats<S>,
}

/// Adds the share of a corner at the distance `d` to a noise. `hashed` are the coordinates of the corner
/// times [`HASH`].
#[inline(always)]
fn add_corner<S: Simd>(simd: S, sum: Noise<S>, hashed: [Words<S>; 3], d: Lanes3<S>) -> Noise<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let h = hashed[0] ^ hashed[1] ^ hashed[2];
    let h = (h ^ (h >> 15)) * u32x8::splat(simd, 0x9e37_79b1);
    let h = (h ^ (h >> 13)) * u32x8::splat(simd, 0x85eb_ca6b);
    let bits = u32x8::splat(simd, 1023);
    // Signed numbers take one instruction to convert, others many.
    let x = signed(h >> 22).to_float::<f32x8<S>>();
    let y = signed((h >> 12) & bits).to_float::<f32x8<S>>();
    let z = signed((h >> 2) & bits).to_float::<f32x8<S>>();
    let middle = splat(511.5);
    let g = Lanes3 { x: x - middle, y: y - middle, z: z - middle };
    let t = (splat(0.5) - d.dot(d)).max(splat(0.0));
    let t2 = t * t;
    let t4 = t2 * t2;
    let along = g.dot(d);
    let gradient = sum.gradient.plus(g.times(t4).minus(d.times(splat(8.0) * t2 * t * along)));
    Noise { gradient, value: sum.value + t4 * along }
}

/// Adds the share of a corner that lies one step along some axes from the first, at the distance `d` of which
/// the point lies; `shift` is what the skew adds to each component.
#[inline(always)]
fn add_step<S: Simd>(
    simd: S,
    sum: Noise<S>,
    (hashed, next): ([Words<S>; 3], [Words<S>; 3]),
    d: Lanes3<S>,
    steps: [Mask<S>; 3],
    shift: f32,
) -> Noise<S> {
    let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
    let shift = f32x8::splat(simd, shift);
    let away = Lanes3 {
        x: d.x - steps[0].select(one, zero) + shift,
        y: d.y - steps[1].select(one, zero) + shift,
        z: d.z - steps[2].select(one, zero) + shift,
    };
    let corner = [
        steps[0].select(next[0], hashed[0]),
        steps[1].select(next[1], hashed[1]),
        steps[2].select(next[2], hashed[2]),
    ];
    add_corner(simd, sum, corner, away)
}

/// Returns simplex noise of deviation 1. `cells` is the skewed cell of the origin.
#[inline(always)]
fn simplex<S: Simd>(simd: S, p: Lanes3<S>, cells: [u32; 3]) -> Noise<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let skew = (p.x + p.y + p.z) * splat(1.0 / 3.0);
    let (x, y, z) =
        (floor_cell(simd, p.x + skew), floor_cell(simd, p.y + skew), floor_cell(simd, p.z + skew));
    let i = Lanes3 { x: x.to_float::<f32x8<S>>(), y: y.to_float::<f32x8<S>>(), z: z.to_float::<f32x8<S>>() };
    let back = (i.x + i.y + i.z) * splat(1.0 / 6.0);
    let d = p.minus(i);
    let d = Lanes3 { x: d.x + back, y: d.y + back, z: d.z + back };
    let (xy, yz, zx) = (d.x.simd_ge(d.y), d.y.simd_ge(d.z), d.z.simd_ge(d.x));
    let word = |x: u32| u32x8::splat(simd, x);
    let hashed = [
        (unsigned(x) + word(cells[0])) * word(HASH[0]),
        (unsigned(y) + word(cells[1])) * word(HASH[1]),
        (unsigned(z) + word(cells[2])) * word(HASH[2]),
    ];
    let next = [hashed[0] + word(HASH[0]), hashed[1] + word(HASH[1]), hashed[2] + word(HASH[2])];
    let zero = splat(0.0);
    let nothing = Noise { gradient: Lanes3 { x: zero, y: zero, z: zero }, value: zero };
    let sum = add_corner(simd, nothing, hashed, d);
    let sum = add_step(simd, sum, (hashed, next), d, [xy & !zx, yz & !xy, zx & !yz], 1.0 / 6.0);
    let sum = add_step(simd, sum, (hashed, next), d, [xy | !zx, yz | !xy, zx | !yz], 1.0 / 3.0);
    let half = splat(0.5);
    let last = Lanes3 { x: d.x - half, y: d.y - half, z: d.z - half };
    let sum = add_corner(simd, sum, next, last);
    Noise { gradient: sum.gradient.times(splat(UNIT)), value: sum.value * splat(UNIT) }
}

/// Returns the share of a noise with cells of `samples` samples that a sample shows. The noise has no power
/// to speak of above 1.5 periods a cell; it is gone where a period has two samples.
#[inline(always)]
fn shown<S: Simd>(simd: S, samples: Floats<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let x = (samples * splat(1.0 / 3.0) - splat(1.0)).max(splat(0.0)).min(splat(1.0));
    x * x * (splat(3.0) - splat(2.0) * x)
}

/// Returns the share of the area where a normal number of deviation 1 lies below `x`: a polynomial within
/// 0.015 of it.
#[inline(always)]
fn below<S: Simd>(simd: S, x: Floats<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let u = (splat(0.5) + x * splat(0.2)).max(splat(0.0)).min(splat(1.0));
    u * u * u * (splat(10.0) + u * (splat(6.0) * u - splat(15.0)))
}

/// Returns the places of points in the coarsest lattice of a stone, cells.
#[inline(always)]
fn in_lattice<S: Simd>(simd: S, position: Lanes3<S>, up: Vec3, along: f32, rest: [f32; 3]) -> Lanes3<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let up = Lanes3::splat(simd, up);
    let across = up.times(up.dot(position) * splat(1.0 - 1.0 / along));
    let p = position.times(splat(1.0 / along)).plus(across);
    p.times(splat(1.0 / COARSEST)).plus(Lanes3::splat(simd, Vec3::from(rest)))
}

/// Lays a stone over points of rock. `angle` is the size of a sample on the image plane at distance 1.
/// Returns the points, and how the eye sees them.
#[inline(always)]
pub fn stone_at<S: Simd>(
    simd: S,
    stone: &Stone,
    points: &Points<S>,
    view: &View<S>,
    angle: f32,
) -> (Points<S>, View<S>) {
    let splat = |x: f32| f32x8::splat(simd, x);
    let (zero, one, two) = (splat(0.0), splat(1.0), splat(2.0));
    let (up, along) = (Vec3::from(stone.up), stone.along);
    let (wet, position) = (points.wet, points.position);
    let View { n, e, distance } = *view;
    let spacing = distance * splat(angle) / n.dot(e).max(splat(0.25));
    let p = in_lattice(simd, position, up, along, stone.rest);
    let cells = stone.cells.map(|c| c as u32);
    let (mut tone, mut tinted) = (zero, zero);
    let mut slope = Lanes3 { x: zero, y: zero, z: zero };
    let (mut slope2, mut moss2, mut lichen2) =
        (splat(stone.slope2), splat(stone.moss2), splat(stone.lichen2));
    let (mut moss, mut lichen, mut before) = (zero, zero, zero);
    for k in 0..OCTAVES {
        let octave = &stone.octaves[k];
        let scale = (1u32 << k) as f32;
        let samples = splat(COARSEST) / (splat(scale) * spacing);
        let weight = shown(simd, samples);
        if !weight.simd_gt(zero).any_true() {
            break;
        }
        let noise = simplex(simd, p.times(splat(scale)), cells.map(|c| c << k));
        let (value, g) = (noise.value, noise.gradient);
        let mut steep = weight * splat(octave.slope / GRADIENT);
        // Octaves without grooves and cracks add nothing below.
        if octave.fold > 0.0 {
            let soft = splat(0.1) + splat(1.5) / samples;
            let folded = value / (value * value + soft * soft).sqrt();
            steep *= one + (folded - one) * splat(octave.fold);
        }
        slope = slope.plus(g.times(steep));
        let mut grey = splat(octave.tone * (1.0 - octave.tinted)) * value;
        if octave.crack > 0.0 {
            let away = value.abs() / g.dot(g).max(one).sqrt();
            let reach = splat(CRACK) + splat(0.5) / samples;
            let line = splat(CRACK) / reach * (one - away / reach).max(zero) - splat(CRACK * CRACK_SHARE);
            let open = (splat(0.5) + splat(0.6) * before).max(zero).min(one);
            grey -= splat(octave.crack) * open * line;
        }
        tone += weight * grey;
        tinted += weight * splat(octave.tone * octave.tinted) * value;
        let kept = weight * weight;
        slope2 -= kept * splat(octave.slope * octave.slope);
        moss += weight * splat(octave.moss) * value;
        moss2 -= kept * splat(octave.moss * octave.moss);
        lichen += weight * splat(octave.lichen) * value;
        lichen2 -= kept * splat(octave.lichen * octave.lichen);
        before = value;
    }
    let [wide, high] = STREAK;
    let streak_size = Vec3::new(1.0 / wide, 1.0 / high, 1.0 / wide);
    let q = position.scaled(streak_size).plus(Lanes3::splat(simd, Vec3::from(stone.streak_rest)));
    let streak_cells = stone.streak_cells.map(|c| c as u32);
    let mut streak = zero;
    for k in [0, 2] {
        let scale = (1u32 << k) as f32;
        let weight = shown(simd, splat(wide / scale) / spacing);
        if !weight.simd_gt(zero).any_true() {
            break;
        }
        let noise = simplex(simd, q.times(splat(scale)), streak_cells.map(|c| c << k));
        streak += splat(0.7) * weight * noise.value;
    }
    let streak = streak * (one - n.y * n.y);
    tone += splat(stone.streaks) * streak;
    let tint = Vec3::from(stone.tint);
    let of = |tint: f32| (one + tone + splat(tint) * tinted).max(splat(0.1));
    let mut albedo = points.albedo.by(Lanes3 { x: of(tint.x), y: of(tint.y), z: of(tint.z) });
    let edge2 = splat(EDGE * EDGE);
    let bare = below(simd, (lichen - splat(stone.bare)) / (edge2 + lichen2.max(zero)).sqrt());
    let color = points.albedo.scaled(Vec3::from(stone.lichen)).times(one + tone);
    albedo = albedo.plus(color.minus(albedo).times(bare * (one - wet)));
    let mut rough = one;
    if stone.moss > 0.0 {
        let bias = splat(3.0) * (n.y - one + splat(1.3 * stone.moss));
        let cover = below(simd, (moss + bias) / (edge2 + moss2.max(zero)).sqrt());
        let bright = (one + splat(1.6) * tone).max(splat(0.2)) * (one - splat(0.4) * wet);
        let color = Lanes3::splat(simd, Vec3::from(stone.moss_color)).times(bright);
        albedo = albedo.plus(color.minus(albedo).times(cover));
        rough = one - splat(0.5) * cover;
    }
    let share = rough * (one - splat(0.4) * wet);
    let up = Lanes3::splat(simd, up);
    let across = up.times(up.dot(slope) * splat(1.0 - 1.0 / along));
    let slope = slope.times(splat(1.0 / along)).plus(across);
    let tilt = slope.minus(n.times(n.dot(slope)));
    let bent = n.minus(tilt.times(share));
    let unit = bent.over(bent.dot(bent).max(splat(1e-12)).sqrt());
    let aside = unit.minus(e.times(unit.dot(e)));
    let seen = aside.over(aside.dot(aside).max(splat(1e-12)).sqrt());
    let points = Points {
        albedo,
        wet: (wet + splat(0.5) * wet * streak).max(zero).min(one),
        film: (splat(stone.film) + two * slope2.max(zero) * share * share).min(one),
        ..*points
    };
    (points, View { n: seen.or(unit.dot(e).simd_lt(zero), unit), e, distance })
}

/// Lays the stones of points' tiles over the points, as [`stone_at`] does. It is not inlined: its code is
/// long, and rock is shaded in several places.
#[inline(never)]
pub fn lay_stones<S: Simd>(
    simd: S,
    stones: &[Stone],
    tiles: [&Tile; LANES],
    plain: (Points<S>, View<S>),
    angle: f32,
) -> (Points<S>, View<S>) {
    simd.vectorize(
        #[inline(always)]
        || {
            let (mut points, mut view) = plain;
            let mut numbers = [0; LANES];
            for lane in 0..LANES {
                numbers[lane] = tiles[lane].stone;
            }
            for lane in 0..LANES {
                let number = numbers[lane];
                if number == 0 || numbers[..lane].contains(&number) {
                    continue;
                }
                let (laid, seen) = stone_at(simd, &stones[number as usize - 1], &plain.0, &plain.1, angle);
                let is_here = u32x8::load_array(simd, numbers).simd_eq(number);
                points.albedo = laid.albedo.or(is_here, points.albedo);
                points.wet = is_here.select(laid.wet, points.wet);
                points.film = is_here.select(laid.film, points.film);
                view.n = seen.n.or(is_here, view.n);
            }
            (points, view)
        },
    )
}

/// As [`film_lobe`](super::opaque::film_lobe), for a film on a stone: a lobe with the squared roughness
/// `film` (Trowbridge and Reitz 1975; Walter and others 2007), and the height of the peak of `film_lobe` at
/// 0.05.
#[inline(always)]
pub fn stone_lobe<S: Simd>(simd: S, n: Lanes3<S>, l: Lanes3<S>, e: Lanes3<S>, film: Floats<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let sum = l.plus(e);
    let h = sum.over(sum.dot(sum).max(splat(1e-12)).sqrt());
    let c = n.dot(h).max(splat(0.0));
    let spread = c * c * (film - splat(1.0)) + splat(1.0);
    splat(0.25) * fresnel(simd, l.dot(h)) * film / (spread * spread)
}
