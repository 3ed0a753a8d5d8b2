//! Finer triangles where a mesh is too coarse for what its vertices are to hold.
//!
//! An edge that is longer than a limit is split in its middle, again and again. The two positions of an edge
//! decide alone, so both triangles of an edge split it alike: no crack opens, and no vertex lies on the edge
//! of a neighbour.
//!
//! Smooth normals tell of a curved surface over flat triangles. Rays to the sun start from it, or the
//! triangles would show their own shadow where the light grazes (Hanika 2021). So a vertex that is added also
//! gets its place on the curve.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use crate::place::Vertex;

/// Longest edge, as a share of the diagonal of the mesh's box. Half of it takes four times the memory; with
/// twice as much, the shadow of a post on a floor is a blot.
const LONGEST: f32 = 1.0 / 200.0;
/// Factor by which the limit grows until the triangles are few enough.
const STEP: f32 = 1.19;
/// Triangles that one thread splits at a time.
const AT_ONCE: usize = 1024;

/// Vertices of triangles that are fine enough.
pub struct Refined {
    /// Three for each triangle.
    pub vertices: Arc<Vec<Vertex>>,
    /// Distance of the curved surface above each vertex, metres; empty if no triangle was split.
    pub lifts: Vec<Vec3>,
    /// Number of parts of each triangle; empty if none was split.
    pub pieces: Vec<u32>,
}

/// A vertex, and its place on the curved surface.
#[derive(Clone, Copy)]
struct Corner {
    vertex: Vertex,
    curved: Vec3,
}

impl Corner {
    fn between(a: &Corner, b: &Corner) -> Corner {
        let middle = (a.curved + b.curved) * 0.5;
        let normals = [a, b].map(|own| Vec3::from(own.vertex.normal));
        let lift = (lift(middle, a.curved, normals[0]) + lift(middle, b.curved, normals[1])) * 0.5;
        Corner { vertex: Vertex::between(&a.vertex, &b.vertex), curved: middle + lift }
    }
}

/// The way from a point up to the plane through a vertex with normal `n`; none if the point lies above it
/// (Boubekeur and Alexa 2008, only where the surface is convex).
pub fn lift(point: Vec3, vertex: Vec3, n: Vec3) -> Vec3 {
    n * -(point - vertex).dot(n).min(0.0)
}

/// Returns the vertices with at most `most_added` more triangles. A mesh that is fine enough stays as it is.
pub fn refined(vertices: &Arc<Vec<Vertex>>, most_added: usize) -> Refined {
    let as_it_is = || Refined { vertices: vertices.clone(), lifts: Vec::new(), pieces: Vec::new() };
    let positions = || vertices.par_iter().map(|vertex| Vec3::from(vertex.position));
    let low = positions().reduce(|| Vec3::INFINITY, Vec3::min);
    let high = positions().reduce(|| Vec3::NEG_INFINITY, Vec3::max);
    let mut limit = LONGEST * low.distance(high);
    if !limit.is_finite() || limit <= 0.0 {
        return as_it_is();
    }
    let (triangles, _) = vertices.as_chunks::<3>();
    let most = triangles.len() + most_added;
    // A guess first: a count takes as long as the triangles are many.
    while guess(triangles, limit) > 2.0 * most as f64 {
        limit *= STEP;
    }
    let count = |pieces: &[u32]| pieces.iter().map(|&own| own as usize).sum::<usize>();
    let mut own = pieces(triangles, limit);
    while count(&own) > most {
        limit *= STEP;
        own = pieces(triangles, limit);
    }
    if count(&own) == triangles.len() {
        return as_it_is();
    }
    let made = triangles.par_chunks(AT_ONCE).flat_map_iter(|own| {
        let mut out: Vec<(Vertex, Vec3)> = Vec::with_capacity(3 * own.len());
        let position = |corner: &Corner| Vec3::from(corner.vertex.position);
        let mut add = |corner: Corner| out.push((corner.vertex, corner.curved - position(&corner)));
        for corners in own {
            let corners = corners.map(|vertex| Corner { vertex, curved: vertex.position.into() });
            split(corners, limit, &position, &Corner::between, &mut |corners| {
                corners.into_iter().for_each(&mut add)
            });
        }
        out
    });
    let (vertices, lifts): (Vec<Vertex>, Vec<Vec3>) = made.unzip();
    Refined { vertices: Arc::new(vertices), lifts, pieces: own }
}

/// Number of parts that the limit makes of each triangle.
fn pieces(triangles: &[[Vertex; 3]], limit: f32) -> Vec<u32> {
    let of = |corners: &[Vertex; 3]| {
        let mut count = 0;
        let between = |a: &Vec3, b: &Vec3| (*a + *b) * 0.5;
        let corners = corners.map(|vertex| Vec3::from(vertex.position));
        split(corners, limit, &|p: &Vec3| *p, &between, &mut |_| count += 1);
        count
    };
    triangles.par_iter().map(of).collect()
}

/// Rough number of triangles that the limit makes, by area and length.
fn guess(triangles: &[[Vertex; 3]], limit: f32) -> f64 {
    let of = |corners: &[Vertex; 3]| {
        let [a, b, c] = corners.map(|vertex| Vec3::from(vertex.position) / limit);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        f64::from(1.0 + (b - a).cross(c - a).length() + longest)
    };
    triangles.par_iter().map(of).sum()
}

/// Splits a triangle until no edge is longer than `limit`, and hands the parts to `out`.
fn split<C: Copy>(
    corners: [C; 3],
    limit: f32,
    position: &impl Fn(&C) -> Vec3,
    between: &impl Fn(&C, &C) -> C,
    out: &mut impl FnMut([C; 3]),
) {
    let is_long = |a: &C, b: &C| position(a).distance_squared(position(b)) > limit * limit;
    let long = [0, 1, 2].map(|i| is_long(&corners[i], &corners[(i + 1) % 3]));
    let mut each = |parts: &[[C; 3]]| parts.iter().for_each(|own| split(*own, limit, position, between, out));
    match long.iter().filter(|long| **long).count() {
        0 => out(corners),
        1 => {
            let first = long.iter().position(|long| *long).unwrap_or(0);
            let [a, b, c] = [0, 1, 2].map(|i| corners[(first + i) % 3]);
            let middle = between(&a, &b);
            each(&[[a, middle, c], [middle, b, c]]);
        }
        2 => {
            let short = long.iter().position(|long| !*long).unwrap_or(0);
            let [a, b, c] = [1, 2, 3].map(|i| corners[(short + i) % 3]);
            let [ab, bc] = [between(&a, &b), between(&b, &c)];
            each(&[[ab, b, bc]]);
            let length = |p: &C, q: &C| position(p).distance_squared(position(q));
            match length(&a, &bc) < length(&ab, &c) {
                true => each(&[[a, ab, bc], [a, bc, c]]),
                false => each(&[[a, ab, c], [ab, bc, c]]),
            }
        }
        _ => {
            let [a, b, c] = corners;
            let [ab, bc, ca] = [between(&a, &b), between(&b, &c), between(&c, &a)];
            each(&[[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
    }
}
