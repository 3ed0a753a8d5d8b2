//! Edges of triangles as the samples of a pixel see them, one a lane.

use std::ops::Range;

use fearless_simd::f64x4;
use fearless_simd::prelude::*;

use super::raster::{Grid, SAMPLES, ScreenPoint};
use crate::util::lanes::LANES;

/// Shifts of the points for each lane's sample.
pub struct Shift<S: Simd> {
    pub x: f64x4<S>,
    pub y: f64x4<S>,
}

/// Rounds to 1/256, halves away from zero. Far outside the image, snapping has no meaning and would lose the
/// fraction's bits.
#[inline(always)]
fn snapped<S: Simd>(simd: S, x: f64x4<S>) -> f64x4<S> {
    let splat = |x: f64| f64x4::splat(simd, x);
    let scaled = x.max(splat(-1e9)).min(splat(1e9)) * splat(256.0);
    (scaled + splat(0.5).copysign(scaled)).trunc() * splat(1.0 / 256.0)
}

/// Edges of a triangle as each lane's sample sees them. Edge i lies opposite of point i.
pub struct Edges<S: Simd> {
    /// A point of each edge.
    x: [f64x4<S>; 3],
    y: [f64x4<S>; 3],
    /// Direction of each edge, with the triangle on its left.
    dx: [f64x4<S>; 3],
    dy: [f64x4<S>; 3],
    /// Number that each edge's function exceeds inside.
    least: [f64x4<S>; 3],
    /// Depth of each point over twice the area.
    depth: [f64x4<S>; 3],
}

impl<S: Simd> Edges<S> {
    #[inline(always)]
    pub fn new(simd: S, points: [&ScreenPoint; 3], shift: &Shift<S>) -> Self {
        let splat = |x: f64| f64x4::splat(simd, x);
        let zero = splat(0.0);
        let mut x = [zero; 3];
        let mut y = [zero; 3];
        for c in 0..3 {
            x[c] = snapped(simd, splat(points[c].x) + shift.x);
            y[c] = snapped(simd, splat(points[c].y) + shift.y);
        }
        let area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
        let sign = splat(1.0).copysign(area);
        let inverse = splat(1.0) / area.abs();
        let mut edges = Edges {
            x: [zero; 3],
            y: [zero; 3],
            dx: [zero; 3],
            dy: [zero; 3],
            least: [zero; 3],
            depth: [zero; 3],
        };
        for i in 0..3 {
            let (a, b) = ((i + 1) % 3, (i + 2) % 3);
            let (dx, dy) = ((x[b] - x[a]) * sign, (y[b] - y[a]) * sign);
            // Centres on top and left edges belong to the triangle. The functions are multiples of 2^-16.
            let owns = dy.simd_lt(zero) | (dy.simd_eq(zero) & dx.simd_gt(zero));
            edges.least[i] = owns.select(splat(-1.0 / 131_072.0), zero);
            (edges.x[i], edges.y[i], edges.dx[i], edges.dy[i]) = (x[a], y[a], dx, dy);
            edges.depth[i] = splat(points[i].depth) * inverse;
        }
        edges
    }

    /// The edges in row `y`.
    #[inline(always)]
    pub fn row(&self, y: usize) -> EdgesInRow<'_, S> {
        let centre = y as f64 + 0.5;
        let mut across = self.y;
        for i in 0..3 {
            across[i] = self.dx[i] * (-(self.y[i] - centre));
        }
        EdgesInRow { edges: self, across }
    }
}

/// Edges in one row of pixels.
pub struct EdgesInRow<'a, S: Simd> {
    edges: &'a Edges<S>,
    /// Part of each edge's function that is the same in the whole row.
    across: [f64x4<S>; 3],
}

impl<S: Simd> EdgesInRow<'_, S> {
    /// Returns which samples of the pixel in column `x` lie inside, one bit each, and their depths.
    #[inline(always)]
    pub fn at(&self, simd: S, x: usize) -> (u64, [f64; SAMPLES]) {
        let centre = f64x4::splat(simd, x as f64 + 0.5);
        let Edges { x, dy, least, depth, .. } = self.edges;
        let mut e = self.across;
        for i in 0..3 {
            e[i] -= dy[i] * (centre - x[i]);
        }
        let inside = e[0].simd_gt(least[0]) & e[1].simd_gt(least[1]) & e[2].simd_gt(least[2]);
        let depth = e[0] * depth[0] + e[1] * depth[1] + e[2] * depth[2];
        (inside.to_bitmask(), depth.into())
    }
}

/// Columns of a bounding box that are tested one by one.
const NARROW: usize = 4;

/// Returns the part of `columns` in which samples of row `y` may lie inside a triangle.
#[inline(always)]
pub fn span(points: &[&ScreenPoint; 3], grid: &Grid, y: usize, columns: Range<usize>) -> Range<usize> {
    // In few columns, to divide takes longer than to test them all.
    if columns.len() <= NARROW {
        return columns;
    }
    let [[left, right], [up, down]] = grid.shifts;
    let area = (points[1].x - points[0].x) * (points[2].y - points[0].y)
        - (points[1].y - points[0].y) * (points[2].x - points[0].x);
    let (mut low, mut high) = (columns.start as f64, columns.end as f64);
    for i in 0..3 {
        let (a, b) = (points[(i + 1) % 3], points[(i + 2) % 3]);
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        // Columns where the edge crosses the row, for the samples that see it farthest up and down.
        let at = |shift: f64| a.x + dx * (y as f64 + 0.5 - shift - a.y) / dy;
        let [first, second] = [at(up), at(down)];
        // Snapping moves the crossing with a flatter edge by more than a column.
        if dy.abs() < (dx.abs() / 256.0).max(0.05) {
            continue;
        }
        if dy * area < 0.0 {
            low = low.max(first.min(second) + left - 2.5);
        } else {
            high = high.min(first.max(second) + right + 2.5);
        }
    }
    (low as usize).max(columns.start)..(high.max(0.0) as usize).min(columns.end)
}

/// Pixels whose places are computed at a time, in float64.
pub const HALF: usize = LANES / 2;

/// Returns the perspective-correct weights of the three points at each lane's pixel. `screen` are x, y and
/// 1/w of each point.
#[inline(always)]
pub fn weights<S: Simd>(
    simd: S,
    screen: &[[[f64; HALF]; 3]; 3],
    centre: [[f64; HALF]; 2],
    shift: &Shift<S>,
) -> [[f64; HALF]; 3] {
    let zero = f64x4::splat(simd, 0.0);
    let (mut x, mut y, mut w) = ([zero; 3], [zero; 3], [zero; 3]);
    for c in 0..3 {
        x[c] = snapped(simd, f64x4::load_array(simd, screen[c][0]) + shift.x);
        y[c] = snapped(simd, f64x4::load_array(simd, screen[c][1]) + shift.y);
    }
    let [px, py] = [f64x4::load_array(simd, centre[0]), f64x4::load_array(simd, centre[1])];
    for c in 0..3 {
        let (a, b) = ((c + 1) % 3, (c + 2) % 3);
        let edge = (x[b] - x[a]) * (py - y[a]) - (y[b] - y[a]) * (px - x[a]);
        w[c] = edge * f64x4::load_array(simd, screen[c][2]);
    }
    let sum = w[0] + w[1] + w[2];
    [(w[0] / sum).into(), (w[1] / sum).into(), (w[2] / sum).into()]
}
