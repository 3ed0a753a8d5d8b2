//! Shade at the vertices of a mesh, by rays from its triangles.
//!
//! A vertex holds the mean over the triangles around it; for the shadow, each ray weighs by the share of the
//! vertex at its start (Kavan, Bargteil and Sloan 2011, without their solve). So a shadow's edge becomes a
//! slope as wide as the triangles, and not a row of teeth.

use std::collections::HashMap;
use std::f32::consts::TAU;

use glam::Vec3;
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_128;

use super::refine::lift;
use crate::place::Vertex;
use crate::place::bvh::Bvh;

/// Rays of a triangle for its occlusion. Some six triangles meet in a vertex; with half of the rays, even
/// walls look grainy.
const RAYS: u32 = 32;
/// Rays of a triangle for its shadow.
const SUN_RAYS: u32 = 8;
/// Triangles from which on each has fewer rays, so that their sum stays: they are as small as the grain.
const MANY: usize = 1 << 17;
/// Part of [`RAYS`] or [`SUN_RAYS`] that a triangle keeps at least, as a divisor.
const LEAST: u32 = 8;

/// Vertices of triangles, with the equal ones known.
pub struct Welded {
    /// Number of the vertex at each corner.
    pub numbers: Vec<u32>,
    /// A corner of each vertex.
    pub corners: Vec<u32>,
}

impl Welded {
    /// Finds vertices of the same position and normal.
    pub fn new(vertices: &[Vertex]) -> Welded {
        let mut known: HashMap<[u32; 6], u32> = HashMap::with_capacity(vertices.len() / 5);
        let mut corners = Vec::new();
        let number = |(corner, vertex): (usize, &Vertex)| {
            let ([x, y, z], [nx, ny, nz]) = (vertex.position, vertex.normal);
            // Minus 0 is 0.
            let key = [x, y, z, nx, ny, nz].map(|c| (c + 0.0).to_bits());
            *known.entry(key).or_insert_with(|| {
                corners.push(corner as u32);
                corners.len() as u32 - 1
            })
        };
        let numbers = vertices.iter().enumerate().map(number).collect();
        Welded { numbers, corners }
    }

    /// Sums what `of` makes of each triangle: an amount and a weight for each corner. Returns the mean amount
    /// of each vertex, and 0 where there is no weight.
    fn means(&self, vertices: &[Vertex], of: impl Fn(usize, &Facet) -> [[f32; 2]; 3] + Sync) -> Vec<f32> {
        let (triangles, _) = vertices.as_chunks::<3>();
        let made = triangles.par_iter().enumerate().map(|(number, corners)| {
            Facet::new(corners).map_or_else(Default::default, |facet| of(number, &facet))
        });
        let made: Vec<[[f32; 2]; 3]> = made.collect();
        // One order of the sums, whatever the number of threads.
        let mut sums = vec![[0.0f32; 2]; self.corners.len()];
        for (number, [amount, weight]) in self.numbers.iter().zip(made.as_flattened()) {
            let sum = &mut sums[*number as usize];
            *sum = [sum[0] + amount, sum[1] + weight];
        }
        sums.into_par_iter()
            .map(|[amount, weight]| if weight > 0.0 { amount / weight } else { 0.0 })
            .collect()
    }
}

/// A triangle that sends rays.
struct Facet {
    positions: [Vec3; 3],
    normals: [Vec3; 3],
    /// Unit normal of the plane, on the side of the vertices' normals.
    out: Vec3,
    area: f32,
    seeds: [u32; 4],
}

/// A point of a facet.
struct Sample {
    /// Shares of the corners.
    shares: [f32; 3],
    position: Vec3,
    /// Interpolated unit normal.
    normal: Vec3,
}

/// The fraction of seed + i·step, with 32 binary digits.
fn fraction(seed: u32, i: u32, step: u32) -> f32 {
    (seed.wrapping_add(i.wrapping_mul(step)) >> 8) as f32 / (1 << 24) as f32
}

/// 2³² over the golden ratio.
const GOLDEN: u32 = 0x9E37_79B9;
/// 2³² over the first two powers of the plastic number, whose multiples fill a square evenly (Roberts 2018).
const PLASTIC: [u32; 2] = [0xC13F_A9A9, 0x91E1_0DA5];

impl Facet {
    /// `None` for a triangle without area.
    fn new(corners: &[Vertex; 3]) -> Option<Facet> {
        let positions = corners.map(|vertex| Vec3::from(vertex.position));
        let normals = corners.map(|vertex| Vec3::from(vertex.normal));
        let [a, b, c] = positions;
        let cross = (b - a).cross(c - a);
        let plane = cross.try_normalize()?;
        let out = if plane.dot(normals.iter().sum()) < 0.0 { -plane } else { plane };
        let hash = xxh3_128(bytemuck::bytes_of(&corners.map(|vertex| vertex.position)));
        let seeds = [0, 32, 64, 96].map(|shift| (hash >> shift) as u32);
        Some(Facet { positions, normals, out, area: 0.5 * cross.length(), seeds })
    }

    fn sample(&self, i: u32) -> Sample {
        let [s, t] = [0, 1].map(|k| fraction(self.seeds[k], i, PLASTIC[k]));
        let [s, t] = if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] };
        let shares = [(1.0 - s - t).max(0.0), s, t];
        let mix = |of: &[Vec3; 3]| of[0] * shares[0] + of[1] * shares[1] + of[2] * shares[2];
        Sample { shares, position: mix(&self.positions), normal: mix(&self.normals).normalize_or(self.out) }
    }

    /// The `i`-th of `count` directions about a unit vector, as many as the cosine. They lie on a spiral
    /// (Vogel 1979) that each facet turns by its own angle.
    fn direction(&self, i: u32, count: u32, about: Vec3) -> Vec3 {
        let r2 = (i as f32 + fraction(self.seeds[3], 0, 0)) / count as f32;
        let (sin, cos) = (TAU * fraction(self.seeds[2], i, GOLDEN)).sin_cos();
        let (x, y) = about.any_orthonormal_pair();
        (x * cos + y * sin) * r2.sqrt() + about * (1.0 - r2).max(0.0).sqrt()
    }
}

/// Number of rays of each of `triangles`, of which a small mesh sends `rays`.
fn rays_of(triangles: usize, rays: u32) -> u32 {
    let share = MANY as f64 / triangles.max(1) as f64;
    ((f64::from(rays) * share) as u32).clamp(rays / LEAST, rays)
}

/// Returns the share of the surroundings' light that each vertex loses: cosine-weighted, of the half space
/// about its normal. `triangles` are those of all meshes together.
pub fn occlusion(vertices: &[Vertex], welded: &Welded, bvh: &Bvh, kinds: u8, triangles: usize) -> Vec<f32> {
    let (margin, rays) = (bvh.margin(), rays_of(triangles, RAYS));
    welded.means(vertices, |_, facet| {
        let (mut hits, mut all) = (0u32, 0u32);
        for i in 0..rays {
            let Sample { position, normal, .. } = facet.sample(i);
            let direction = facet.direction(i, rays, normal);
            // Such a ray leaves a smooth surface, and only its flat stand-in is in the way.
            if direction.dot(facet.out) > 0.0 {
                all += 1;
                hits += u32::from(bvh.is_hit(position + facet.out * margin, direction, kinds));
            }
        }
        // One mean for the three corners: a weight for each ray would undo the even spread of the spiral.
        [[hits as f32 / all.max(1) as f32 * facet.area, facet.area]; 3]
    })
}

/// Returns the share of the light along the unit vector `to_sun` that each vertex loses. A vertex that faces
/// away from the sun has the shadow on the back of its surface, which is what a thin sheet shows there.
/// `lifts` lead from the vertices to the curved surface; they may be empty.
pub fn shadow(
    vertices: &[Vertex],
    lifts: &[Vec3],
    welded: &Welded,
    bvh: &Bvh,
    kinds: u8,
    to_sun: Vec3,
    triangles: usize,
) -> Vec<f32> {
    let (margin, rays) = (bvh.margin(), rays_of(triangles, SUN_RAYS));
    let (lifts, _) = lifts.as_chunks::<3>();
    welded.means(vertices, |number, facet| {
        let mut sums = [[0.0; 2]; 3];
        let is_lit = facet.normals.map(|normal| normal.dot(to_sun) > 0.0);
        let lifts = lifts.get(number).copied().unwrap_or_default();
        for i in 0..rays {
            let Sample { shares, position, normal } = facet.sample(i);
            let cos = normal.dot(to_sun);
            let start = if cos > 0.0 {
                let up = |k: usize| lifts[k] + lift(position, facet.positions[k], facet.normals[k]);
                position + (0..3).map(|k| up(k) * shares[k]).sum::<Vec3>() + facet.out * margin
            } else {
                position - facet.out * margin
            };
            let is_hit = bvh.is_hit(start, to_sun, kinds);
            for k in (0..3).filter(|k| is_lit[*k] == (cos > 0.0)) {
                let weight = shares[k] * facet.area * cos.abs();
                sums[k] = [sums[k][0] + if is_hit { weight } else { 0.0 }, sums[k][1] + weight];
            }
        }
        sums
    })
}
