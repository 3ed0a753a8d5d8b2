//! Wet rock: near falling water, below it, and in pools. Meshes of other programs are wet alike.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::Rock;
use crate::place::bvh::Bvh;
use crate::place::triangles::water_tree;
use crate::place::{Pool, Vertex, WaterFaces};

/// Ratio of the distance that water runs down to the distance that it spreads sideways.
const RUN: f32 = 4.0;
/// Share of light that the film reflects before it reaches the rock, with n = 1.33 at normal incidence.
const OUTSIDE: f32 = 0.02;
/// Share of diffuse light from the rock that the film reflects back to it: 1 − (1 − 0.066)/n². Water reflects
/// 0.066 of light that falls from all sides (Lekner and Dorf 1988).
const INSIDE: f32 = 0.474;

/// Returns the albedo of rock under a film of water. Light passes the film, is reflected by the rock, and
/// leaves after any number of reflections between the two (Ångström 1925; Lekner and Dorf 1988, without the
/// smaller reflection of the rock itself against water).
pub fn wet_albedo(dry: Vec3) -> Vec3 {
    (1.0 - OUTSIDE) * (1.0 - INSIDE) * dry / (1.0 - INSIDE * dry.min(Vec3::ONE))
}

/// Returns the wetness of a point at a distance of `metres` from the water: 1 in it, 0 at `reach`.
pub fn wetness(metres: f32, reach: f32) -> f32 {
    let x = (1.0 - metres / reach).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// A quad that wets rock, with its bounding sphere.
struct WettingQuad {
    corners: [Vec3; 4],
    middle: Vec3,
    radius: f32,
}

/// Height to which a pool wets rock, as a share of the reach of falling water.
const SPLASH: f32 = 0.5;

/// Wets the vertices of rocks near the quads `water` and the shells inside `faces`, and in and above pools.
pub fn wet(
    rocks: &[(&Rock, Range<usize>)],
    vertices: &mut [Vertex],
    water: &[[Vec3; 4]],
    faces: &WaterFaces,
    pools: &[Pool],
) {
    if rocks.iter().all(|(rock, _)| rock.wet == 0.0) {
        return;
    }
    let shells = water_tree(faces.0.iter().copied());
    let sources: Vec<WettingQuad> = water
        .iter()
        .map(|&corners| {
            let middle = corners.iter().sum::<Vec3>() / 4.0;
            let radius = corners.iter().map(|c| c.distance(middle)).fold(0.0, f32::max);
            WettingQuad { corners, middle, radius }
        })
        .collect();
    for (rock, own) in rocks {
        if rock.wet == 0.0 || (sources.is_empty() && shells.is_empty() && pools.is_empty()) {
            continue;
        }
        vertices[own.clone()].par_iter_mut().for_each(|vertex| {
            let (point, reach) = (Vec3::from(vertex.position), rock.wet_reach);
            let near = distance(&sources, point, above(pools, point, reach));
            wet_vertex(vertex, rock.wet * wetness(shells.nearest(point, near, away_from_water), reach));
        });
    }
}

/// Returns the wetness of a point of a surface with the strength `wet`, near the triangles of `water`, and in
/// and above pools.
pub fn wetness_at(point: Vec3, wet: f32, reach: f32, water: &Bvh, pools: &[Pool]) -> f32 {
    wet * wetness(water.nearest(point, above(pools, point, reach), away_from_water), reach)
}

/// Puts a film of water on a dry vertex.
pub fn wet_vertex(vertex: &mut Vertex, wet: f32) {
    if wet > 0.0 {
        let dry = Vec3::from_array(vertex.albedo);
        vertex.albedo = dry.lerp(wet_albedo(dry), wet).to_array();
        vertex.wet = wet;
    }
}

/// Returns the distance that stands for the height above a pool, metres, but at most `reach`.
fn above(pools: &[Pool], point: Vec3, reach: f32) -> f32 {
    let over = pools.iter().filter(|pool| pool.holds(point));
    over.map(|pool| (point.y - pool.level()).max(0.0) / SPLASH).fold(reach, f32::min)
}

/// Returns the length of a vector from water to a point, metres. Its part downwards counts 1/[`RUN`].
fn away_from_water(mut away: Vec3) -> f32 {
    if away.y < 0.0 {
        away.y /= RUN;
    }
    away.length()
}

/// Returns the distance to the nearest source, metres, but at most `reach`. Downward parts of the distance
/// count 1/[`RUN`].
fn distance(sources: &[WettingQuad], point: Vec3, reach: f32) -> f32 {
    let mut best = reach;
    for source in sources {
        let away = point - source.middle;
        let down = (-away.y - source.radius).max(0.0) / RUN;
        let ball = source.radius + best;
        if away.x * away.x + away.z * away.z > ball * ball || away.y > ball || down > best {
            continue;
        }
        let [a, b, c, d] = source.corners;
        for corners in [[a, b, c], [a, c, d]] {
            best = best.min(away_from_water(point - nearest_on_triangle(point, corners)));
        }
    }
    best
}

/// Returns the point of a triangle nearest to `p` by Voronoi regions (Ericson 2005, Real-Time Collision
/// Detection, 5.1.5).
pub fn nearest_on_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let (ab, ac) = (b - a, c - a);
    let n = ab.cross(ac);
    let inside = |from: Vec3, to: Vec3| (to - from).cross(p - from).dot(n) >= 0.0;
    if n != Vec3::ZERO && inside(a, b) && inside(b, c) && inside(c, a) {
        return p - n * ((p - a).dot(n) / n.length_squared());
    }
    let on_edge = |from: Vec3, to: Vec3| {
        let edge = to - from;
        from + edge * ((p - from).dot(edge) / edge.length_squared().max(1e-30)).clamp(0.0, 1.0)
    };
    let edges = [on_edge(a, b), on_edge(b, c), on_edge(c, a)];
    let nearer = |x: Vec3, y: Vec3| if x.distance_squared(p) <= y.distance_squared(p) { x } else { y };
    nearer(nearer(edges[0], edges[1]), edges[2])
}
