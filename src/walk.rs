//! The exact 3-D DDA walk through a grid of unit cells: geometry only.
//!
//! The volume's builder (§2) uses it to find every cell that a curve's segment passes, and the trace (§4)
//! uses it along view and light rays. The algorithm is that of Amanatides and Woo, "A Fast Voxel Traversal
//! Algorithm for Ray Tracing", Eurographics 1987, in the spirit of the paper's [Snyder and Barr 87].
//!
//! Copies of the grid lie side by side in x and y, so the cell's x and y wrap around. Its z does not, and the
//! consumer ends the walk when z leaves the slab. The walk itself ends at `t_end`.
//!
//! Edge cases:
//! - A zero (or −0) component never steps: its next boundary lies at [`NEVER`].
//! - A start on a face belongs to the cell that the ray goes into.
//! - Through an edge or a corner exactly one axis steps at a time, x before y before z. So the cells always
//!   form a 6-connected chain, and the ray's length in the cell between is 0.
//! - Boundaries are whole numbers, and each parameter is computed from its boundary alone. So no error
//!   accumulates along the ray, and parameters never decrease.
//! - A leap ([`Walk::leap`]) advances to the last cell of an empty box without visiting the cells between. It
//!   counts the boundaries it passes instead of accumulating parameters, so it always lands in a state that
//!   the plain walk would reach. The count is rounded down: at worst the box takes one more leap. Only rays
//!   of the GPU engine leap; here leaps are tested.
//!
//! Twin: `shaders/walk.wgsl`, with the same operations in the same order.

use glam::{IVec3, Vec3};

/// Parameter of a boundary that is never met. It is larger than any path, and small enough that differences
/// of parameters stay finite.
pub const NEVER: f32 = 1.0e30;

/// Smallest direction component that does not count as zero, in cells per unit of t. A ray with a smaller one
/// needs more than 10^20 units of t to cross one cell.
pub const PARALLEL: f32 = 1.0e-20;

/// Share of a box's exit parameter before which a leap ends, 1 − 2^−20. A parameter is a difference times a
/// reciprocal, so its relative error is at most 4·2^−24, well within the margin.
pub const LEAP_MARGIN: f32 = 1.0 - 1.0 / (1 << 20) as f32;

/// One cell that a ray crosses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The cell. Its x and y are wrapped into the tile; its z may lie outside the slab.
    pub cell: IVec3,
    /// Parameter where the ray enters the cell.
    pub t_enter: f32,
    /// Parameter where the ray leaves the cell, never less than `t_enter`.
    pub t_exit: f32,
}

/// Iterator over the cells that a ray `origin + t·direction` crosses, for t from 0 to `t_end`.
#[derive(Clone, Debug)]
pub struct Walk {
    size: IVec3,
    cell: IVec3,
    step: IVec3,
    origin: Vec3,
    inverse: Vec3,
    boundary: Vec3,
    t_next: Vec3,
    /// Boundaries crossed in one unit of t, along each axis.
    speed: Vec3,
    /// Parameter where the ray leaves the slab.
    t_slab: f32,
    t: f32,
    t_end: f32,
}

/// Largest whole number that is not above x, |x| < 2^23. Without SSE 4.1, which a portable build may not
/// assume, `f32::floor` is a call into the C library and takes a tenth of the time of a volume's build.
#[inline]
pub fn floor_cell(x: f32) -> i32 {
    let whole = x as i32;
    whole - i32::from(x < whole as f32)
}

/// Coordinate of the cell that a ray starts in. On a face it is the cell that the ray goes into.
#[inline]
fn start_cell(x: f32, direction: f32) -> i32 {
    if direction < 0.0 { -floor_cell(-x) - 1 } else { floor_cell(x) }
}

impl Walk {
    /// Walk from `origin_cell` (cells, finite, |x| < 2^23) along `direction_cell` (cells per unit of t) to
    /// the parameter `t_end`, through tiles of `size` cells.
    #[inline]
    pub fn new(size: IVec3, origin_cell: Vec3, direction_cell: Vec3, t_end: f32) -> Self {
        let cell = IVec3::new(
            start_cell(origin_cell.x, direction_cell.x),
            start_cell(origin_cell.y, direction_cell.y),
            start_cell(origin_cell.z, direction_cell.z),
        );
        // A parallel axis stays at boundary 1 of origin 0: its parameter is always NEVER.
        let mut step = IVec3::ZERO;
        let mut origin = Vec3::ZERO;
        let mut inverse = Vec3::splat(NEVER);
        let mut boundary = Vec3::ONE;
        let mut speed = Vec3::ZERO;
        for axis in 0..3 {
            let d = direction_cell[axis];
            if d.abs() < PARALLEL {
                continue;
            }
            step[axis] = if d > 0.0 { 1 } else { -1 };
            origin[axis] = origin_cell[axis];
            inverse[axis] = 1.0 / d;
            speed[axis] = d.abs();
            boundary[axis] = (cell[axis] + i32::from(d > 0.0)) as f32;
        }
        let t_slab = match step.z {
            0 => NEVER,
            1 => (size.z as f32 - origin.z) * inverse.z,
            _ => (0.0 - origin.z) * inverse.z,
        };
        Walk {
            size,
            cell: IVec3::new(cell.x.rem_euclid(size.x), cell.y.rem_euclid(size.y), cell.z),
            step,
            origin,
            inverse,
            boundary,
            t_next: (boundary - origin) * inverse,
            speed,
            t_slab,
            t: 0.0,
            t_end,
        }
    }

    /// The cell that the ray is in, wrapped as [`Crossing::cell`] is.
    #[inline]
    pub fn cell(&self) -> IVec3 {
        self.cell
    }

    /// Octant of the ray's direction: bit 0 is set if x decreases, bit 1 if y does, bit 2 if z does.
    #[inline]
    pub fn octant(&self) -> u32 {
        let down = |axis: usize| u32::from(self.step[axis] < 0) << axis;
        down(0) | down(1) | down(2)
    }

    /// Advances to the last cell of an empty box (or to the one before it) without leaving the slab. Returns
    /// the number of cells skipped.
    ///
    /// The box begins with the ray's cell, extends along the ray's octant, and has sides of 2^`exponents`
    /// cells, none longer than the tile. The skipped cells yield no crossings: the next crossing enters where
    /// the leap began.
    #[inline]
    pub fn leap(&mut self, exponents: [u32; 3]) -> u32 {
        let [x, y, z] = exponents.map(|l| ((1i32 << l) - 1) as f32);
        let far = self.t_next + Vec3::new(x, y, z) * self.inverse.abs();
        let t = smaller(smaller(far.x, far.y), smaller(far.z, self.t_slab)) * LEAP_MARGIN;
        let ahead = (t - self.t_next) * self.speed;
        let passed = IVec3::new(ceil_from_zero(ahead.x), ceil_from_zero(ahead.y), ceil_from_zero(ahead.z));
        let way = passed * self.step;
        self.boundary += way.as_vec3();
        self.t_next = (self.boundary - self.origin) * self.inverse;
        self.cell += way;
        self.cell.x = wrap_within_one_tile(self.cell.x, self.size.x);
        self.cell.y = wrap_within_one_tile(self.cell.y, self.size.y);
        passed.element_sum() as u32
    }
}

/// The smaller of two parameters, which are never NaN. `f32::min` would spend four instructions on that.
#[inline]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Smallest whole number that is not below x, or 0 if x is negative.
#[inline]
fn ceil_from_zero(x: f32) -> i32 {
    let whole = x as i32;
    (whole + i32::from(x > whole as f32)).max(0)
}

/// Wraps `x` into 0..n, where `x` is less than n past either end.
#[inline]
fn wrap_within_one_tile(x: i32, n: i32) -> i32 {
    if x < 0 {
        x + n
    } else if x >= n {
        x - n
    } else {
        x
    }
}

impl Iterator for Walk {
    type Item = Crossing;

    #[inline]
    fn next(&mut self) -> Option<Crossing> {
        if self.t >= self.t_end {
            return None;
        }
        let t_exit = smaller(smaller(self.t_next.x, self.t_next.y), self.t_next.z);
        let crossing = Crossing { cell: self.cell, t_enter: self.t, t_exit: smaller(t_exit, self.t_end) };
        // One axis steps, x before y before z if several boundaries coincide.
        let t_next = self.t_next;
        if t_next.x <= t_next.y && t_next.x <= t_next.z {
            self.boundary.x += self.step.x as f32;
            self.t_next.x = (self.boundary.x - self.origin.x) * self.inverse.x;
            self.cell.x = wrap_one_step(self.cell.x + self.step.x, self.size.x);
        } else if t_next.y <= t_next.z {
            self.boundary.y += self.step.y as f32;
            self.t_next.y = (self.boundary.y - self.origin.y) * self.inverse.y;
            self.cell.y = wrap_one_step(self.cell.y + self.step.y, self.size.y);
        } else {
            self.boundary.z += self.step.z as f32;
            self.t_next.z = (self.boundary.z - self.origin.z) * self.inverse.z;
            self.cell.z += self.step.z;
        }
        self.t = t_exit;
        Some(crossing)
    }
}

/// Wraps `x` into 0..n, where `x` is at most one step past either end.
#[inline]
fn wrap_one_step(x: i32, n: i32) -> i32 {
    if x < 0 {
        n - 1
    } else if x >= n {
        0
    } else {
        x
    }
}
