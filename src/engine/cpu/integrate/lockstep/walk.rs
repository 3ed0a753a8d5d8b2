//! The exact walk of eight rays in lockstep. Twin of `src/walk.rs`: every lane passes the cells, and has the
//! parameters, of the walk of its ray alone, bit for bit.
//!
//! No lane waits for another and none branches: each step moves each ray by one cell along one axis. A ray
//! that has left the slab goes on without cells.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};
use glam::IVec3;

use crate::util::lanes::{Floats, Ints, LANES, Lanes3, Mask, Stored, floor_cell};
use crate::walk::{NEVER, PARALLEL};

/// Number of steps between two looks at the cells. The cells of a row are fetched and shaded together, so
/// that the processor waits for none of them.
pub const ROW: usize = 8;

/// Most steps whose cells wait to be lit together.
pub const BATCH: usize = 8 * ROW;

/// Index of no cell: outside the slab.
pub const NO_CELL: i32 = -1;

/// Cells that eight rays pass in up to `N` steps.
#[derive(Clone)]
pub struct Passed<const N: usize> {
    /// Index of each step's and ray's cell in the units of [`Units`], or [`NO_CELL`].
    pub index: [[i32; LANES]; N],
    /// Layers before each ray leaves the slab, its cell's own included.
    pub layers: [[i32; LANES]; N],
    /// Offsets of the cell along x and y, and the parameter of the middle of the ray's segment in it; only
    /// for rows that interpolate.
    pub offsets: [[[i32; LANES]; 2]; N],
    pub middle: [Stored; N],
    /// Difference of the parameters where the ray leaves the cell and enters it.
    pub length: [Stored; N],
}

impl<const N: usize> Default for Passed<N> {
    fn default() -> Self {
        Passed {
            index: [[NO_CELL; LANES]; N],
            layers: [[0; LANES]; N],
            offsets: [[[0; LANES]; 2]; N],
            middle: [Stored::default(); N],
            length: [Stored::default(); N],
        }
    }
}

/// Sum of multiples of a cell's coordinates by which the walk numbers it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Number of cells along x, y and z.
    pub size: IVec3,
    /// Multiples of x, y and z.
    pub factors: IVec3,
}

impl Units {
    /// Units of dense storage: the linear index. `None` if a cell's index needs more than 31 bits.
    pub fn linear(size: [u32; 3]) -> Option<Units> {
        let [nx, ny, nz] = size.map(i64::from);
        let fits = nx * ny * nz <= i64::from(i32::MAX);
        fits.then(|| Units {
            size: size.map(|n| n as i32).into(),
            factors: IVec3::new(1, nx as i32, (nx * ny) as i32),
        })
    }

    /// Units that keep the coordinates apart: x and y take [`Units::BITS`] bits each, z the rest. `None` if
    /// the size has more.
    pub fn apart(size: [u32; 3]) -> Option<Units> {
        let [nx, ny, nz] = size;
        let (side, deep) = (1 << Units::BITS, 1 << (32 - 2 * Units::BITS));
        // In the largest volume of all, the last cell would have the bits of `NO_CELL`.
        let fits = nx <= side && ny <= side && nz <= deep && size != [side, side, deep];
        fits.then(|| Units {
            size: size.map(|n| n as i32).into(),
            factors: IVec3::new(1, side as i32, 1 << (2 * Units::BITS)),
        })
    }

    /// Bits of x and of y in [`Units::apart`].
    pub const BITS: u32 = 11;
}

/// Units of eight rays.
pub struct LaneUnits<S: Simd> {
    size: [Ints<S>; 3],
    factors: [Ints<S>; 3],
}

impl<S: Simd> LaneUnits<S> {
    /// Units of each lane.
    #[inline(always)]
    pub fn new(simd: S, units: &[Units; LANES]) -> Self {
        let of = |number: fn(&Units) -> IVec3, axis: usize| {
            let mut out = [0; LANES];
            for lane in 0..LANES {
                out[lane] = number(&units[lane])[axis];
            }
            i32x8::load_array(simd, out)
        };
        LaneUnits {
            size: [of(|u| u.size, 0), of(|u| u.size, 1), of(|u| u.size, 2)],
            factors: [of(|u| u.factors, 0), of(|u| u.factors, 1), of(|u| u.factors, 2)],
        }
    }

    /// The same units in all lanes.
    #[inline(always)]
    pub fn splat(simd: S, units: &Units) -> Self {
        let of = |v: IVec3| [i32x8::splat(simd, v.x), i32x8::splat(simd, v.y), i32x8::splat(simd, v.z)];
        LaneUnits { size: of(units.size), factors: of(units.factors) }
    }
}

/// Where eight rays are.
pub struct Walk<S: Simd> {
    simd: S,
    /// Steps of the boundaries: 1, −1, or 0 for an axis that is never crossed.
    unit: [Floats<S>; 3],
    origin: [Floats<S>; 3],
    inverse: [Floats<S>; 3],
    /// Boundary behind the next one of each axis.
    boundary: [Floats<S>; 3],
    t_next: [Floats<S>; 3],
    /// Parameter of `boundary`, computed one step before it is needed.
    t_after: [Floats<S>; 3],
    /// Parameter where each ray enters its cell.
    pub t: Floats<S>,
    /// Coordinates of the cell times their factors.
    offset: [Ints<S>; 3],
    offset_step: [Ints<S>; 3],
    /// Offsets in x and y one step outside the tile, and those that take their place.
    past: [Ints<S>; 2],
    wrapped: [Ints<S>; 2],
    /// Layers before the ray leaves the slab, its own included.
    layers: Ints<S>,
    layer_step: Ints<S>,
    /// Number of cells passed inside the slab.
    pub count: Ints<S>,
}

impl<S: Simd> Walk<S> {
    /// Walk from `origin` (cells, at most one tile outside it) along `direction` (cells per unit of t). The
    /// ray starts inside the slab.
    #[inline(always)]
    pub fn new(simd: S, units: &Units, origin: Lanes3<S>, direction: Lanes3<S>) -> Self {
        Walk::of_lanes(simd, &LaneUnits::splat(simd, units), origin, direction)
    }

    /// [`Walk::new`] with units for each lane.
    #[inline(always)]
    pub fn of_lanes(simd: S, units: &LaneUnits<S>, origin: Lanes3<S>, direction: Lanes3<S>) -> Self {
        let zero = f32x8::splat(simd, 0.0);
        let one = f32x8::splat(simd, 1.0);
        let none = i32x8::splat(simd, 0);
        let [o, d] = [[origin.x, origin.y, origin.z], [direction.x, direction.y, direction.z]];
        let mut walk = Walk {
            simd,
            unit: [zero; 3],
            origin: [zero; 3],
            inverse: [zero; 3],
            boundary: [one; 3],
            t_next: [zero; 3],
            t_after: [zero; 3],
            t: zero,
            offset: [none; 3],
            offset_step: [none; 3],
            past: [none; 2],
            wrapped: [none; 2],
            layers: none,
            layer_step: none,
            count: none,
        };
        for axis in 0..3 {
            let (size, factor) = (units.size[axis], units.factors[axis]);
            let parallel = d[axis].abs().simd_lt(PARALLEL);
            let up = d[axis].simd_gt(0.0);
            let cell = start_cell(simd, o[axis], d[axis]);
            let boundary = (cell + up.select(i32x8::splat(simd, 1), none)).to_float::<f32x8<S>>();
            walk.unit[axis] = parallel.select(zero, up.select(one, -one));
            walk.origin[axis] = parallel.select(zero, o[axis]);
            walk.inverse[axis] = parallel.select(f32x8::splat(simd, NEVER), one / d[axis]);
            walk.boundary[axis] = parallel.select(one, boundary);
            walk.t_next[axis] = walk.parameter(axis);
            walk.boundary[axis] += walk.unit[axis];
            walk.t_after[axis] = walk.parameter(axis);
            let offset_step = up.select(factor, -factor);
            walk.offset_step[axis] = parallel.select(none, offset_step);
            if axis < 2 {
                let inside = cell.simd_lt(0).select(cell + size, cell);
                let inside = inside.simd_ge(size).select(inside - size, inside);
                walk.offset[axis] = inside * factor;
                walk.past[axis] = up.select(size * factor, -factor);
                walk.wrapped[axis] = up.select(none, (size - i32x8::splat(simd, 1)) * factor);
            } else {
                walk.offset[axis] = cell * factor;
                walk.layers = up.select(size - cell, cell + i32x8::splat(simd, 1));
                walk.layer_step = parallel.select(none, i32x8::splat(simd, 1));
            }
        }
        walk
    }

    /// Parameter of each ray's `boundary`.
    #[inline(always)]
    fn parameter(&self, axis: usize) -> Floats<S> {
        (self.boundary[axis] - self.origin[axis]) * self.inverse[axis]
    }

    /// Which rays are inside the slab.
    #[inline(always)]
    pub fn inside(&self) -> Mask<S> {
        self.layers.simd_gt(0)
    }

    /// Walks the next cells of each ray, one in each of `steps`.
    #[inline(always)]
    pub fn row<const N: usize>(&mut self, steps: Range<usize>, passed: &mut Passed<N>) {
        for j in steps {
            self.step(passed, j);
        }
    }

    /// Walks as [`Walk::row`] does, and keeps what interpolation needs.
    #[inline(always)]
    pub fn row_between<const N: usize>(&mut self, steps: Range<usize>, passed: &mut Passed<N>) {
        for j in steps {
            self.offset[0].store_array(&mut passed.offsets[j][0]);
            self.offset[1].store_array(&mut passed.offsets[j][1]);
            let t = self.t;
            self.step(passed, j);
            passed.middle[j].store((t + self.t) * 0.5);
        }
    }

    /// Walks one cell of each ray, in step `j`.
    #[inline(always)]
    fn step<const N: usize>(&mut self, passed: &mut Passed<N>, j: usize) {
        let (none, one) = (i32x8::splat(self.simd, 0), i32x8::splat(self.simd, 1));
        self.index().store_array(&mut passed.index[j]);
        self.layers.store_array(&mut passed.layers[j]);
        self.count += self.inside().select(one, none);
        let t = self.t;
        self.advance();
        passed.length[j].store(self.t - t);
    }

    /// Index of each ray's cell in the units of [`Units`], or [`NO_CELL`].
    #[inline(always)]
    pub fn index(&self) -> Ints<S> {
        let [x, y, z] = self.offset;
        self.inside().select(x + y + z, i32x8::splat(self.simd, NO_CELL))
    }

    /// Coordinates of each ray's cell, if their factors are 1.
    #[inline(always)]
    pub fn coordinates(&self) -> [Ints<S>; 3] {
        self.offset
    }

    /// Goes to the next cell of each ray.
    #[inline(always)]
    pub fn advance(&mut self) {
        let none = i32x8::splat(self.simd, 0);
        let zero = f32x8::splat(self.simd, 0.0);
        let [tx, ty, tz] = self.t_next;
        let t_yz = ty.min(tz);
        self.t = tx.min(t_yz);
        // One axis steps, x before y before z if several boundaries coincide.
        let x_steps = tx.simd_le(t_yz);
        let y_first = ty.simd_le(tz);
        let y_steps = y_first & !x_steps;
        let z_steps = !(x_steps | y_first);
        for (axis, steps) in [x_steps, y_steps, z_steps].into_iter().enumerate() {
            self.t_next[axis] = steps.select(self.t_after[axis], self.t_next[axis]);
            self.boundary[axis] += steps.select(self.unit[axis], zero);
            self.t_after[axis] = self.parameter(axis);
            let offset = self.offset[axis] + steps.select(self.offset_step[axis], none);
            self.offset[axis] = match axis {
                2 => offset,
                _ => offset.simd_eq(self.past[axis]).select(self.wrapped[axis], offset),
            };
        }
        self.layers -= z_steps.select(self.layer_step, none);
    }
}

/// Coordinate of the cell that a ray starts in. Twin of the function of this name in `src/walk.rs`.
#[inline(always)]
fn start_cell<S: Simd>(simd: S, x: Floats<S>, direction: Floats<S>) -> Ints<S> {
    let down = direction.simd_lt(0.0);
    let below = floor_cell(simd, down.select(-x, x));
    down.select(-below - i32x8::splat(simd, 1), below)
}
