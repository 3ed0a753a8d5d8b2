//! The walk of eight rays through the strands of a volume, and what each meets of them. Twin of
//! `walk_strands` in `src/engine/cpu/integrate/walk.rs` and of `src/trace/lines.rs`, with the same bits.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};
use glam::IVec3;

use super::cells::{rho_codes, v_codes, words};
use super::group::{Ends, Group, Scratch};
use super::scatter::LaneScatter;
use super::walk::{BATCH, NO_CELL, Units, Walk};
use crate::trace::lines::{LEAST_SINE2, ON_LINE, STRAND_RADIUS};
use crate::util::lane_powers::exp2;
use crate::util::lanes::{Floats, Ints, LANES, Lanes3, Mask, Stored, Stored3, Words, signed};
use crate::util::powers::log2;
use crate::volume::{Cell, LINE_STEPS, V_SCALE};

/// Cells between whose centres a ray is.
const CORNERS: usize = 8;

/// Parts of eight rays, each between eight centres of cells; see [`crate::trace::lines::Segment`].
struct Segments<S: Simd> {
    middle: Lanes3<S>,
    direction: Lanes3<S>,
    half: Floats<S>,
}

impl<'a> Group<'a, '_> {
    /// Walks the strands to the end of the slab, or to the rays' own.
    #[inline(always)]
    pub fn walk_strands<S: Simd>(&self, simd: S, scratch: &mut Scratch<'a>) -> Ends {
        let Scratch { steps, lights, tint } = scratch;
        *tint = Stored3::default();
        for (i, light) in lights.iter_mut().enumerate() {
            light.reset(simd, self, i);
        }
        let scatter = LaneScatter::of(self);
        let trace = &self.integrator.scene.trace;
        let (zero, none) = (f32x8::splat(simd, 0.0), i32x8::splat(simd, 0));
        let layers = self.level.size.z;
        let direction = self.hits.values.d_cell.load(simd);
        let origin = self.hits.values.origin.load(simd);
        let half = f32x8::splat(simd, 0.5);
        let origin = Lanes3 { x: origin.x + half, y: origin.y + half, z: origin.z + half };
        let speed = match self.integrator.per_cell {
            true => direction.x.abs() + direction.y.abs() + direction.z.abs(),
            false => f32x8::splat(simd, 1.0),
        };
        let back = f32x8::splat(simd, layers as f32) / direction.z;
        let (scale, shift) = (self.line()[0].load(simd), self.line()[1].load(simd));
        let units = Units { size: self.level.size + IVec3::Z, factors: IVec3::ONE };
        let mut walk = Walk::new(simd, &units, origin, direction);
        let mut transmittance = self.before.load(simd);
        let mut depth = Stored::from_fn(|lane| -log2(self.before.0[lane].max(1e-30))).load(simd);
        let mut count = none;
        let mut walked = [0; LANES];
        let mut indices = [[NO_CELL; LANES]; CORNERS];
        let mut cells = [[Cell::default(); LANES]; CORNERS];
        let mut own = [Stored::default(); CORNERS];
        let mut n = 0;
        steps.count = 0;
        loop {
            let goes_on = walk.t.simd_lt(back) & transmittance.simd_ge(trace.early_end);
            let ends = n == trace.max_cells || !goes_on.any_true();
            if ends || steps.count + CORNERS > BATCH {
                self.light_batch(simd, steps, (lights, tint), scatter.as_ref(), &mut walked);
                steps.count = 0;
            }
            if ends {
                break;
            }
            n += 1;
            count += goes_on.select(i32x8::splat(simd, 1), none);
            let (enter, upper) = (walk.t, walk.coordinates());
            walk.advance();
            let exit = walk.t.min(back);
            let at = (enter + exit) * 0.5;
            let middle = Lanes3 {
                x: origin.x + direction.x * at,
                y: origin.y + direction.y * at,
                z: origin.z + direction.z * at,
            };
            let middle = Lanes3 {
                x: middle.x - middle.x.floor(),
                y: middle.y - middle.y.floor(),
                z: middle.z - middle.z.floor(),
            };
            let segments = Segments { middle, direction, half: (exit - enter) * 0.5 };
            let [x, y] = [self.pair(simd, upper[0], 0), self.pair(simd, upper[1], 1)];
            let factor = self.store.units.factors.z;
            let lower_z = upper[2] - i32x8::splat(simd, 1);
            let z = [lower_z * factor, upper[2] * factor];
            let is_inside = [goes_on & lower_z.simd_ge(0), goes_on & upper[2].simd_lt(layers)];
            for (corner, index) in indices.iter_mut().enumerate() {
                let index_of = x[corner & 1] + y[corner >> 1 & 1] + z[corner >> 2];
                is_inside[corner >> 2].select(index_of, i32x8::splat(simd, NO_CELL)).store_array(index);
            }
            self.store.fetch(&indices, &mut cells);
            let mut tau_bits = zero;
            for (corner, (cells, own)) in cells.iter().zip(&mut own).enumerate() {
                let [first, second] = words(simd, cells);
                let code = rho_codes(first);
                let rho = (code * scale + shift).max(zero);
                let is_met = code.simd_gt(0.0) & rho.simd_gt(0.0);
                if !is_met.any_true() {
                    own.store(zero);
                    continue;
                }
                let depth = rho * self.extinction * segments.through(simd, second, corner) * speed;
                let depth = is_met.select(depth, zero);
                own.store(depth);
                tau_bits += depth;
            }
            let meets = tau_bits.simd_gt(0.0);
            if !meets.any_true() {
                continue;
            }
            let passed = transmittance * exp2(simd, -tau_bits);
            let each = (transmittance - passed) / tau_bits;
            let layer = [lower_z, upper[2]].map(|z| i32x8::splat(simd, layers) - z);
            for corner in 0..CORNERS {
                let own = own[corner].load(simd);
                let lit = own.simd_gt(0.0);
                if !lit.any_true() {
                    continue;
                }
                let j = steps.count;
                steps.count += 1;
                steps.passed.index[j] = indices[corner];
                layer[corner >> 2].store_array(&mut steps.passed.layers[j]);
                steps.cells[j] = cells[corner];
                steps.lit[j] = lit.to_bitmask() as u8;
                steps.weight[j].store(lit.select(own * each, zero));
                steps.tau_bits[j].store(own);
                steps.depth[j].store(depth);
            }
            transmittance = meets.select(passed, transmittance);
            depth += tau_bits;
        }
        let seen = count.to_array().map(|count| count as u32);
        Ends { transmittance: transmittance.to_array(), cells: [seen, walked] }
    }

    /// Parts of the indices of the cells before and after the centres that each ray is between, along x or y.
    #[inline(always)]
    fn pair<S: Simd>(&self, simd: S, upper: Ints<S>, axis: usize) -> [Ints<S>; 2] {
        let (size, factor) = (self.store.units.size[axis], self.store.units.factors[axis]);
        let wrapped = upper.simd_eq(0).select(i32x8::splat(simd, size), upper);
        [(wrapped - i32x8::splat(simd, 1)) * factor, upper * factor]
    }
}

impl<S: Simd> Segments<S> {
    /// Integrals of the densities of strands, whose cells have these second words. They have no meaning for
    /// empty cells. Twin of [`crate::trace::lines::Segment::through`].
    #[inline(always)]
    fn through(&self, simd: S, second: Words<S>, corner: usize) -> Floats<S> {
        let splat = |x: f32| f32x8::splat(simd, x);
        let (zero, one) = (splat(0.0), splat(1.0));
        let v = v_codes(second);
        let [x, y, z] = [v.x.abs(), v.y.abs(), v.z.abs()];
        let is_x = x.simd_ge(y) & x.simd_ge(z);
        let is_y = y.simd_ge(z);
        let axes = [is_x, is_y];
        let largest = main(axes, Lanes3 { x, y, z });
        let low = (splat(V_SCALE) - largest).to_int::<i32x8<S>>();
        let line = low | signed((second >> 30) << 6);
        let (a, b) = (place(simd, line & 15), place(simd, line >> 4));
        let place = Lanes3 {
            x: is_x.select(zero, a),
            y: is_x.select(a, is_y.select(zero, b)),
            z: is_x.select(b, is_y.select(b, zero)),
        };
        let of_corner = [corner & 1, corner >> 1 & 1, corner >> 2].map(|c| splat(c as f32));
        let corner = Lanes3 { x: of_corner[0], y: of_corner[1], z: of_corner[2] };
        let (d, m) = (self.direction, self.middle);
        let w =
            Lanes3 { x: m.x - corner.x - place.x, y: m.y - corner.y - place.y, z: m.z - corner.z - place.z };
        let inverse = one / v.dot(v);
        let (d_v, w_v, d_d) = (d.dot(v), w.dot(v), d.dot(d));
        let a = (d_d - d_v * d_v * inverse).max(d_d * LEAST_SINE2);
        let b = w.dot(d) - w_v * d_v * inverse;
        let c = w.dot(w) - w_v * w_v * inverse;
        let nearest = -b / a;
        let scale = 1.0 / (STRAND_RADIUS * STRAND_RADIUS);
        let u = one - (c + b * nearest) * scale;
        let k = a * scale;
        let reach = (u / k).sqrt();
        let enter = (nearest - reach).max(-self.half);
        let exit = (nearest + reach).min(self.half);
        let (from, to) = (enter - nearest, exit - nearest);
        let moment = (cube(u, k, from) - cube(u, k, to)) / (splat(6.0) * k);
        let sum = sum(simd, u, k, to) - sum(simd, u, k, from);
        let side = one - splat(2.0) * main(axes, corner);
        let share = one - side * (main(axes, w) + main(axes, d) * nearest);
        let through = share * sum - side * main(axes, d) * moment;
        let through = through.max(zero) * ON_LINE * largest * inverse.sqrt();
        (u.simd_gt(0.0) & exit.simd_gt(enter)).select(through, zero)
    }
}

// Functions and not closures, which might not be inlined and would then lose the instruction set.

/// Components along the main axes of lines: x in the first lanes of `axes`, y in the second, otherwise z.
#[inline(always)]
fn main<S: Simd>([is_x, is_y]: [Mask<S>; 2], of: Lanes3<S>) -> Floats<S> {
    is_x.select(of.x, is_y.select(of.y, of.z))
}

/// Places of lines across their main axes, from −½ to ½, by their steps.
#[inline(always)]
fn place<S: Simd>(simd: S, step: Ints<S>) -> Floats<S> {
    (step.to_float::<f32x8<S>>() + 0.5) / f32x8::splat(simd, LINE_STEPS) - 0.5
}

/// Cube of u − k·s².
#[inline(always)]
fn cube<S: Simd>(u: Floats<S>, k: Floats<S>, s: Floats<S>) -> Floats<S> {
    let x = u - k * s * s;
    x * x * x
}

/// Integral of (u − k·s²)² from 0 to s.
#[inline(always)]
fn sum<S: Simd>(simd: S, u: Floats<S>, k: Floats<S>, s: Floats<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    s * (u * u + s * s * k * (splat(0.2) * k * s * s - splat(2.0 / 3.0) * u))
}
