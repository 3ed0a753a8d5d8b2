//! Shade of rock on rock: depth maps along a direction (Williams 1978), looked up at every vertex. A map
//! towards the sun gives the shadow. Many maps over the upper half of the sphere give the share of the
//! surroundings that a vertex does not see (Pharr and Green 2004).

use std::f32::consts::PI;
use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::Rock;
use crate::place::Vertex;

/// Number of directions that stand for the surroundings. Twice as many change the occlusion by a few
/// hundredths.
const DIRECTIONS: u32 = 48;
/// Cells on a side of the map for one of these directions. It shows the mesh with a sixteenth of its
/// triangles.
const SIDE: usize = 224;
/// Cells on a side of the sun's map: 2 cm for rocks of 20 m.
const SUN_SIDE: usize = 1024;

/// Farthest extent of the rocks along a direction, on a grid of cells across it.
struct DepthMap {
    x: Vec3,
    y: Vec3,
    to_light: Vec3,
    origin: [f32; 2],
    /// Side of a cell, metres.
    cell: f32,
    side: usize,
    /// Extent towards the light in each cell, metres; −∞ where there is no rock.
    depth: Vec<f32>,
}

/// A range of vertices that are shaded, and the share of the light that they lose where no light arrives.
pub type ShadedRange = (f32, Range<usize>);

/// Sets the vertices' occlusion. The rocks whose `occlusion` is above 0 block the surroundings' light, and so
/// does what else `blocked` meets, from a point along a direction.
pub fn occlude(
    rocks: &[(&Rock, Range<usize>)],
    shaded: &[ShadedRange],
    vertices: &mut [Vertex],
    blocked: Option<&(impl Fn(Vec3, Vec3) -> bool + Sync)>,
) {
    let casters = triangles(rocks, |rock| rock.occlusion, 4);
    if casters.is_empty() && blocked.is_none() {
        return;
    }
    let maps: Vec<DepthMap> = (0..DIRECTIONS)
        .into_par_iter()
        .map(|i| DepthMap::new(&casters, vertices, direction(i), SIDE))
        .collect();
    for (amount, own) in shaded {
        if *amount == 0.0 {
            continue;
        }
        vertices[own.clone()].par_iter_mut().for_each(|vertex| {
            let (point, n) = (Vec3::from(vertex.position), Vec3::from(vertex.normal));
            let (mut all, mut seen) = (0.0, 0.0);
            for map in &maps {
                let cos = n.dot(map.to_light);
                if cos > 0.0 {
                    all += cos;
                    let lit = if casters.is_empty() { 1.0 } else { map.lit(point, n) };
                    if lit > 0.0 && !blocked.is_some_and(|blocked| blocked(point, map.to_light)) {
                        seen += cos * lit;
                    }
                }
            }
            vertex.occlusion = amount * (1.0 - seen / f32::max(all, 1e-6));
        });
    }
}

/// Points around a vertex from which rays go to the sun past what is no rock.
const SUN_RAYS: u32 = 8;

/// Sets the vertices' shadow from a light at infinity. The rocks whose `shadow` is above 0 cast it, and so
/// does what else `blocked` meets, from a point along a direction.
pub fn shadow(
    rocks: &[(&Rock, Range<usize>)],
    shaded: &[ShadedRange],
    vertices: &mut [Vertex],
    to_light: Vec3,
    blocked: Option<&(impl Fn(Vec3, Vec3) -> bool + Sync)>,
) {
    let casters = triangles(rocks, |rock| rock.shadow, 1);
    if casters.is_empty() && blocked.is_none() {
        return;
    }
    let map = DepthMap::new(&casters, vertices, to_light, SUN_SIDE);
    for (amount, own) in shaded {
        let spacing = spacing(&vertices[own.clone()]);
        vertices[own.clone()].par_iter_mut().for_each(|vertex| {
            let (point, n) = (Vec3::from(vertex.position), Vec3::from(vertex.normal));
            let mut lit = if casters.is_empty() { 1.0 } else { map.lit(point, n) };
            if let Some(blocked) = blocked.filter(|_| *amount > 0.0 && lit > 0.0) {
                let open =
                    (0..SUN_RAYS).filter(|i| !blocked(beside(point, n, *i, spacing), to_light)).count();
                lit *= open as f32 / SUN_RAYS as f32;
            }
            vertex.shadow = amount * (1.0 - lit);
        });
    }
}

/// Returns the distance between neighbours on a square grid, metres.
fn spacing(vertices: &[Vertex]) -> f32 {
    let squares = vertices.len().isqrt() - 1;
    let [first, last] = [0, squares].map(|i| Vec3::from(vertices[i].position));
    first.distance(last) / squares as f32
}

/// Returns the `i`-th of [`SUN_RAYS`] points around one on a surface with normal `n`, within a disc as large
/// as a square of the grid, on a spiral (Vogel 1979).
fn beside(point: Vec3, n: Vec3, i: u32, spacing: f32) -> Vec3 {
    let (x, y) = n.any_orthonormal_pair();
    let (sin, cos) = (i as f32 * PI * (3.0 - 5f32.sqrt())).sin_cos();
    let r = spacing * ((i as f32 + 0.5) / (SUN_RAYS as f32 * PI)).sqrt();
    point + (x * cos + y * sin) * r
}

/// Returns the greatest height of the rocks at the column of each vertex in `own`, metres; −∞ where there is
/// no rock.
pub fn heights(rocks: &[(&Rock, Range<usize>)], vertices: &[Vertex], own: Range<usize>) -> Vec<f32> {
    let casters = triangles(rocks, |_| 1.0, 1);
    if casters.is_empty() {
        return vec![f32::NEG_INFINITY; own.len()];
    }
    let map = DepthMap::new(&casters, vertices, Vec3::Y, SUN_SIDE);
    vertices[own].iter().map(|vertex| map.at(vertex.position.into())).collect()
}

/// Returns the `i`-th direction of a spiral over the upper half of the sphere. All have the same solid angle.
fn direction(i: u32) -> Vec3 {
    let y = (i as f32 + 0.5) / DIRECTIONS as f32;
    let (sin, cos) = (i as f32 * PI * (3.0 - 5f32.sqrt())).sin_cos();
    let r = (1.0 - y * y).sqrt();
    Vec3::new(r * cos, y, r * sin)
}

/// Returns the triangles between every `step`-th vertex of the rocks whose `amount` is above 0.
fn triangles(rocks: &[(&Rock, Range<usize>)], amount: fn(&Rock) -> f32, step: u32) -> Vec<u32> {
    let mut indices = Vec::new();
    for (rock, own) in rocks.iter().filter(|(rock, _)| amount(rock) > 0.0) {
        rock.add_triangles(own.start as u32, step.min(1 << rock.levels), &mut indices);
    }
    indices
}

impl DepthMap {
    fn new(indices: &[u32], vertices: &[Vertex], to_light: Vec3, side: usize) -> DepthMap {
        let (x, y) = to_light.any_orthonormal_pair();
        let mut map = DepthMap {
            x,
            y,
            to_light,
            origin: [0.0; 2],
            cell: 1.0,
            side,
            depth: vec![f32::NEG_INFINITY; side * side],
        };
        let corner = |i: u32| Vec3::from(vertices[i as usize].position);
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for &i in indices {
            let p = corner(i);
            for (axis, c) in [p.dot(x), p.dot(y)].into_iter().enumerate() {
                low[axis] = low[axis].min(c);
                high[axis] = high[axis].max(c);
            }
        }
        map.origin = low;
        map.cell = ((high[0] - low[0]).max(high[1] - low[1]) / side as f32).max(1e-6);
        for t in indices.chunks_exact(3) {
            map.draw([t[0], t[1], t[2]].map(corner));
        }
        map
    }

    /// Projects a point: cells across the direction in x and y, metres along it in z.
    fn project(&self, p: Vec3) -> Vec3 {
        let [left, low] = self.origin;
        Vec3::new((p.dot(self.x) - left) / self.cell, (p.dot(self.y) - low) / self.cell, p.dot(self.to_light))
    }

    /// Draws a triangle: each cell keeps its largest depth.
    fn draw(&mut self, corners: [Vec3; 3]) {
        let [a, b, c] = corners.map(|p| self.project(p));
        let (ab, ac) = (b - a, c - a);
        let area = ab.x * ac.y - ab.y * ac.x;
        if area == 0.0 {
            return;
        }
        let cells = |p: f32, q: f32, r: f32| {
            let (low, high) = (p.min(q).min(r), p.max(q).max(r));
            (low - 0.5).ceil().max(0.0) as usize..((high + 0.5).floor().max(0.0) as usize).min(self.side)
        };
        let (columns, rows) = (cells(a.x, b.x, c.x), cells(a.y, b.y, c.y));
        for row in rows {
            for column in columns.clone() {
                let (x, y) = (column as f32 + 0.5 - a.x, row as f32 + 0.5 - a.y);
                let (u, v) = ((x * ac.y - y * ac.x) / area, (ab.x * y - ab.y * x) / area);
                // The triangle is drawn slightly larger, so that neighbours leave no gap.
                if u >= -1e-4 && v >= -1e-4 && u + v <= 1.0 + 1e-4 {
                    let depth = &mut self.depth[row * self.side + column];
                    *depth = depth.max(a.z + u * ab.z + v * ac.z);
                }
            }
        }
    }

    /// Returns the depth in the cell of a point.
    fn at(&self, point: Vec3) -> f32 {
        let p = self.project(point);
        let inside = |c: f32| c >= 0.0 && c < self.side as f32;
        if inside(p.x) && inside(p.y) {
            self.depth[p.y as usize * self.side + p.x as usize]
        } else {
            f32::NEG_INFINITY
        }
    }

    /// Returns the share of the light that reaches a point of a surface with normal `n`: the share of the
    /// four cells around it that nothing nearer to the light covers (Reeves, Salesin and Cook 1987). The
    /// point is moved off the surface by 1.5 cells along `n` and towards the light, because a cell has a
    /// single depth and an oblique surface has many in it.
    fn lit(&self, point: Vec3, n: Vec3) -> f32 {
        let p = self.project(point + (n + self.to_light) * (1.5 * self.cell));
        let (x, y) = (p.x - 0.5, p.y - 0.5);
        let (left, low) = (x.floor(), y.floor());
        let (f, g) = (x - left, y - low);
        let open = |dx: f32, dy: f32| {
            let (column, row) = (left + dx, low + dy);
            let inside = |c: f32| c >= 0.0 && c < self.side as f32;
            let covered =
                inside(column) && inside(row) && self.depth[row as usize * self.side + column as usize] > p.z;
            if covered { 0.0 } else { 1.0 }
        };
        (open(0.0, 0.0) * (1.0 - f) + open(1.0, 0.0) * f) * (1.0 - g)
            + (open(0.0, 1.0) * (1.0 - f) + open(1.0, 1.0) * f) * g
    }
}
