//! §4 Strands finer than cells: where a pixel sees less than a cell, a ray meets the strands that made the
//! cells around it, each along the line that its cell keeps. Twin: `shaders/trace/lines.wgsl`.
//!
//! A strand is a tube of the radius [`STRAND_RADIUS`] around its line. Its density falls as (1 − d²/R²)² with
//! the distance d from the line, and along the line it goes over linearly from the centre of one cell to the
//! next, so strands that pass several cells have no steps. Everything is in cells: a tube is as much wider
//! than deep as a cell is.
//!
//! Rays walk the grid of the cells' centres: between the same eight centres, the same eight lines are near.
//! None of the others reaches there, because no line passes within [`STRAND_RADIUS`] of the centre of another
//! cell.

use glam::Vec3;

use crate::volume::Cell;

/// Radius of a strand, cells. A line is at least 17/32 of a cell away from the centres of all cells but its
/// own and those along it.
pub const STRAND_RADIUS: f32 = 0.5;

/// Density on the line of a strand along an axis, in units of its cell's: the mean over the cell is 1. The
/// mean of (1 − d²/R²)² over a tube's cross-section, πR², is 1/3.
pub const ON_LINE: f32 = 3.0 / (std::f32::consts::PI * STRAND_RADIUS * STRAND_RADIUS);

/// Smallest squared sine between a ray and a line; a ray along a strand is treated as one at this angle.
pub const LEAST_SINE2: f32 = 1e-4;

/// Part of a ray between eight centres of cells.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Its middle, in cells from the lowest of the eight centres; each component 0 to 1.
    pub middle: Vec3,
    /// Direction of the ray, cells per unit of t.
    pub direction: Vec3,
    /// Half its length in units of t.
    pub half: f32,
}

impl Segment {
    /// Integral of a strand's density along the segment over t, in units of the density of its cell. `corner`
    /// is the cell's centre among the eight, each component 0 or 1.
    #[inline]
    pub fn through(&self, cell: Cell, corner: Vec3) -> f32 {
        let (place, axis) = cell.line();
        let v = cell.v_code();
        let d = self.direction;
        let w = self.middle - corner - place;
        // The squared distance from the line is a·t² + 2b·t + c, t counted from the middle.
        let inverse = 1.0 / v.dot(v);
        let (d_v, w_v) = (d.dot(v), w.dot(v));
        let a = (d.dot(d) - d_v * d_v * inverse).max(d.dot(d) * LEAST_SINE2);
        let b = w.dot(d) - w_v * d_v * inverse;
        let c = w.dot(w) - w_v * w_v * inverse;
        let nearest = -b / a;
        let scale = 1.0 / (STRAND_RADIUS * STRAND_RADIUS);
        let u = 1.0 - (c + b * nearest) * scale;
        if u <= 0.0 {
            return 0.0;
        }
        // Along the ray the density is (u − k·s²)², with s counted from the nearest point.
        let k = a * scale;
        let reach = (u / k).sqrt();
        let (enter, exit) = ((nearest - reach).max(-self.half), (nearest + reach).min(self.half));
        if exit <= enter {
            return 0.0;
        }
        let (from, to) = (enter - nearest, exit - nearest);
        let cubes = [from, to].map(|s| u - k * s * s).map(|x| x * x * x);
        let sum = |s: f32| s * (u * u + s * s * k * (0.2 * k * s * s - 2.0 / 3.0 * u));
        let sum = sum(to) - sum(from);
        let moment = (cubes[0] - cubes[1]) / (6.0 * k);
        // Towards the next centre along the strand, its share falls from 1 to 0.
        let side = 1.0 - 2.0 * corner[axis];
        let share = 1.0 - side * (w[axis] + d[axis] * nearest);
        let through = share * sum - side * d[axis] * moment;
        through.max(0.0) * ON_LINE * v[axis].abs() * inverse.sqrt()
    }
}
