//! Shade of rock on rock: depth maps along a direction (Williams 1978), looked up at every vertex. A map
//! towards the sun gives the shadow. Many maps over the upper half of the sphere give the share of the
//! surroundings that a vertex does not see (Pharr and Green 2004).

use std::f32::consts::PI;
use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::Rock;
use super::veil::Veils;
use crate::place::Vertex;

/// Number of directions that stand for the surroundings. Twice as many change the occlusion by a few
/// hundredths.
const DIRECTIONS: u32 = 48;
/// Cells on a side of the map for one of these directions. It shows the mesh with a sixteenth of its
/// triangles.
const SIDE: usize = 224;
/// Cells on a side of the sun's map: 2 cm for rocks of 20 m.
const SUN_SIDE: usize = 1024;

/// Square grid of cells across the direction to a light.
pub struct Plane {
    x: Vec3,
    y: Vec3,
    to_light: Vec3,
    origin: [f32; 2],
    /// Side of a cell, metres.
    cell: f32,
    /// Cells on a side.
    pub side: usize,
}

/// Farthest extent of the rocks along a direction, on a grid of cells across it.
struct DepthMap {
    plane: Plane,
    /// Extent towards the light in each cell, metres; −∞ where there is no rock.
    depth: Vec<f32>,
}

/// A range of vertices that are shaded, and the share of the light that they lose where no light arrives.
pub type ShadedRange = (f32, Range<usize>);

/// Test for what blocks light besides rocks: whether it meets anything from a point along a direction.
pub trait Blocked: Fn(Vec3, Vec3) -> bool + Sync {}

impl<F: Fn(Vec3, Vec3) -> bool + Sync> Blocked for F {}

/// Casters that hide the surroundings: rocks whose `occlusion` is above 0, and what `blocked` meets.
pub struct SkyShade<'a, F> {
    maps: Vec<DepthMap>,
    blocked: Option<&'a F>,
}

impl<'a, F: Blocked> SkyShade<'a, F> {
    /// Draws the rocks. None if nothing hides the surroundings.
    pub fn new(
        rocks: &[(&Rock, Range<usize>)],
        vertices: &[Vertex],
        blocked: Option<&'a F>,
    ) -> Option<SkyShade<'a, F>> {
        let casters = triangles(rocks, |rock| rock.occlusion, 4);
        let draw = |i| DepthMap::new(&casters, vertices, direction(i), SIDE);
        let maps: Vec<DepthMap> = (0..DIRECTIONS).into_par_iter().filter_map(draw).collect();
        (!maps.is_empty() || blocked.is_some()).then_some(SkyShade { maps, blocked })
    }

    /// Sets the occlusion of vertices.
    pub fn occlude(&self, shaded: &[ShadedRange], vertices: &mut [Vertex]) {
        for (amount, own) in shaded {
            if *amount == 0.0 {
                continue;
            }
            vertices[own.clone()].par_iter_mut().for_each(|vertex| {
                let (point, n) = (Vec3::from(vertex.position), Vec3::from(vertex.normal));
                let (mut all, mut seen) = (0.0, 0.0);
                for i in 0..DIRECTIONS as usize {
                    let direction = direction(i as u32);
                    let cos = n.dot(direction);
                    if cos > 0.0 {
                        all += cos;
                        let lit = self.maps.get(i).map_or(1.0, |map| map.lit(point, n));
                        if lit > 0.0 && !self.blocked.is_some_and(|blocked| blocked(point, direction)) {
                            seen += cos * lit;
                        }
                    }
                }
                vertex.occlusion = amount * (1.0 - seen / f32::max(all, 1e-6));
            });
        }
    }

    /// Share of the upper half of the sphere that a point sees which has matter around it that scatters light
    /// into all directions.
    pub fn seen(&self, point: Vec3) -> f32 {
        let open = |i: u32| {
            let lit = self.maps.get(i as usize).map_or(1.0, |map| map.lit(point, Vec3::ZERO));
            let is_blocked = || self.blocked.is_some_and(|blocked| blocked(point, direction(i)));
            if lit > 0.0 && !is_blocked() { lit } else { 0.0 }
        };
        (0..DIRECTIONS).map(open).sum::<f32>() / DIRECTIONS as f32
    }
}

/// Points around a vertex from which rays go to the sun past what is no rock.
pub const SUN_RAYS: u32 = 8;

/// Casters that hide a light at infinity: rocks whose `shadow` is above 0, what `blocked` meets, and
/// falling water.
pub struct SunShade<'a, F> {
    map: Option<DepthMap>,
    blocked: Option<&'a F>,
    veils: Option<&'a Veils>,
    to_light: Vec3,
}

impl<'a, F: Blocked> SunShade<'a, F> {
    /// Draws the rocks. None if nothing hides the light.
    pub fn new(
        rocks: &[(&Rock, Range<usize>)],
        vertices: &[Vertex],
        to_light: Vec3,
        blocked: Option<&'a F>,
        veils: Option<&'a Veils>,
    ) -> Option<SunShade<'a, F>> {
        let map = DepthMap::new(&triangles(rocks, |rock| rock.shadow, 1), vertices, to_light, SUN_SIDE);
        let sun = SunShade { map, blocked, veils, to_light };
        (sun.map.is_some() || blocked.is_some() || veils.is_some()).then_some(sun)
    }

    /// Sets the shadow of vertices.
    pub fn shadow(&self, shaded: &[ShadedRange], vertices: &mut [Vertex]) {
        for (amount, own) in shaded {
            let spacing = spacing(&vertices[own.clone()]);
            vertices[own.clone()].par_iter_mut().for_each(|vertex| {
                let (point, n) = (Vec3::from(vertex.position), Vec3::from(vertex.normal));
                let mut lit = self.map.as_ref().map_or(1.0, |map| map.lit(point, n));
                if let Some(blocked) = self.blocked.filter(|_| *amount > 0.0 && lit > 0.0) {
                    let points = (0..SUN_RAYS).map(|i| beside(point, n, i, spacing));
                    let open = points.filter(|point| !blocked(*point, self.to_light)).count();
                    lit *= open as f32 / SUN_RAYS as f32;
                }
                if let Some(veils) = self.veils.filter(|_| *amount > 0.0 && lit > 0.0) {
                    lit *= veils.pass(point);
                }
                vertex.shadow = amount * (1.0 - lit);
            });
        }
    }

    /// Share of the light that reaches a point in falling water past rocks and meshes.
    pub fn seen(&self, point: Vec3) -> f32 {
        if self.blocked.is_some_and(|blocked| blocked(point, self.to_light)) {
            return 0.0;
        }
        self.map.as_ref().map_or(1.0, |map| map.lit(point, Vec3::ZERO))
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
pub fn beside(point: Vec3, n: Vec3, i: u32, spacing: f32) -> Vec3 {
    let (x, y) = n.any_orthonormal_pair();
    let (sin, cos) = (i as f32 * PI * (3.0 - 5f32.sqrt())).sin_cos();
    let r = spacing * ((i as f32 + 0.5) / (SUN_RAYS as f32 * PI)).sqrt();
    point + (x * cos + y * sin) * r
}

/// Returns the greatest height of the rocks at the column of each vertex in `own`, metres; −∞ where there is
/// no rock.
pub fn heights(rocks: &[(&Rock, Range<usize>)], vertices: &[Vertex], own: Range<usize>) -> Vec<f32> {
    let Some(map) = DepthMap::new(&triangles(rocks, |_| 1.0, 1), vertices, Vec3::Y, SUN_SIDE) else {
        return vec![f32::NEG_INFINITY; own.len()];
    };
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

impl Plane {
    /// Grid around points, with `side` cells on its longer side. None without points.
    pub fn around(points: impl IntoIterator<Item = Vec3>, to_light: Vec3, side: usize) -> Option<Plane> {
        let (x, y) = to_light.any_orthonormal_pair();
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for p in points {
            for (axis, c) in [p.dot(x), p.dot(y)].into_iter().enumerate() {
                low[axis] = low[axis].min(c);
                high[axis] = high[axis].max(c);
            }
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]);
        let cell = (extent / side as f32).max(1e-6);
        (extent >= 0.0).then_some(Plane { x, y, to_light, origin: low, cell, side })
    }

    /// Projects a point: cells across the direction in x and y, metres along it in z.
    fn project(&self, p: Vec3) -> Vec3 {
        let [left, low] = self.origin;
        Vec3::new((p.dot(self.x) - left) / self.cell, (p.dot(self.y) - low) / self.cell, p.dot(self.to_light))
    }

    /// Calls `each` for the cells whose middle lies in a triangle, with the depth there and the weights of
    /// its second and third corner. The triangle is larger by the share `margin`.
    pub fn cells(&self, corners: [Vec3; 3], margin: f32, mut each: impl FnMut(usize, f32, [f32; 2])) {
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
                if u >= -margin && v >= -margin && u + v <= 1.0 + margin {
                    each(row * self.side + column, a.z + u * ab.z + v * ac.z, [u, v]);
                }
            }
        }
    }

    /// Returns the cell of a point, if it is on the grid.
    fn cell_of(&self, point: Vec3) -> Option<usize> {
        let p = self.project(point);
        self.cell_at(p.x.floor(), p.y.floor())
    }

    fn cell_at(&self, column: f32, row: f32) -> Option<usize> {
        let is_inside = |c: f32| c >= 0.0 && c < self.side as f32;
        (is_inside(column) && is_inside(row)).then(|| row as usize * self.side + column as usize)
    }

    /// Interpolates between the shares of light that reach a point in the four cells around it (Reeves,
    /// Salesin and Cook 1987). `open` is that in a cell at the point's depth; it is 1 beside the grid.
    pub fn between(&self, point: Vec3, open: impl Fn(usize, f32) -> f32) -> f32 {
        let p = self.project(point);
        let (x, y) = (p.x - 0.5, p.y - 0.5);
        let (left, low) = (x.floor(), y.floor());
        let (f, g) = (x - left, y - low);
        let open = |dx, dy| self.cell_at(left + dx, low + dy).map_or(1.0, |cell| open(cell, p.z));
        (open(0.0, 0.0) * (1.0 - f) + open(1.0, 0.0) * f) * (1.0 - g)
            + (open(0.0, 1.0) * (1.0 - f) + open(1.0, 1.0) * f) * g
    }
}

impl DepthMap {
    /// Draws triangles. None without any.
    fn new(indices: &[u32], vertices: &[Vertex], to_light: Vec3, side: usize) -> Option<DepthMap> {
        let corner = |i: u32| Vec3::from(vertices[i as usize].position);
        let plane = Plane::around(indices.iter().map(|&i| corner(i)), to_light, side)?;
        let mut depth = vec![f32::NEG_INFINITY; side * side];
        for t in indices.chunks_exact(3) {
            // Triangles are drawn slightly larger, so that neighbours leave no gap.
            plane.cells([t[0], t[1], t[2]].map(corner), 1e-4, |cell, z, _| depth[cell] = depth[cell].max(z));
        }
        Some(DepthMap { plane, depth })
    }

    /// Returns the depth in the cell of a point.
    fn at(&self, point: Vec3) -> f32 {
        self.plane.cell_of(point).map_or(f32::NEG_INFINITY, |cell| self.depth[cell])
    }

    /// Returns the share of the light that reaches a point of a surface with normal `n`. The point is moved
    /// off the surface by 1.5 cells along `n` and towards the light, because a cell has a single depth and an
    /// oblique surface has many in it.
    fn lit(&self, point: Vec3, n: Vec3) -> f32 {
        let point = point + (n + self.plane.to_light) * (1.5 * self.plane.cell);
        self.plane.between(point, |cell, depth| if self.depth[cell] > depth { 0.0 } else { 1.0 })
    }
}
