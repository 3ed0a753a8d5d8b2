//! Fractal rock: a height field by midpoint displacement (Fournier, Fussell and Carpenter 1982),
//! raised on a four-cornered patch as a real mesh.

use std::sync::Arc;

use glam::Vec3;
use rand_distr::{Distribution, StandardNormal};

use crate::random::{Family, Stream};

/// Most subdivisions of a rock: a mesh of a million points.
pub const MAX_LEVELS: u32 = 10;

/// What a rock is made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Rock {
    /// The scene's name for it.
    pub name: String,
    /// Patch corners (u,v) = (0,0) (1,0) (1,1) (0,1), counter-clockwise seen from the outside; metres.
    pub corners: [Vec3; 4],
    /// 2^levels squares a side.
    pub levels: u32,
    /// Roughness as in the curves: displacement at level n has deviation amplitude·2^(−(n−1)·h).
    pub h: f32,
    /// Metres.
    pub amplitude: f32,
    /// Height of the middle over the border, metres.
    pub bulge: f32,
    /// Seed.
    pub seed: u64,
    /// Mean albedo.
    pub color: Vec3,
    /// Relative variation of the albedo.
    pub color_noise: f32,
    /// Darkening of hollows, 0 to 1.
    pub cavity: f32,
}

/// A vertex of opaque geometry, as the raster pass reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// World position, metres.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Linear albedo.
    pub albedo: [f32; 3],
}

/// Triangles of opaque geometry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices, shared: who keeps them on a device knows them again.
    pub vertices: Arc<Vec<Vertex>>,
    /// Three indices a triangle.
    pub indices: Arc<Vec<u32>>,
}

impl Mesh {
    /// The rocks' mesh with the same vertices and a sixteenth of the triangles, for previews.
    pub fn coarse(&self, rocks: &[Rock]) -> Mesh {
        let mut indices = Vec::new();
        let mut first = 0;
        for rock in rocks {
            rock.add_triangles(first, 1 << rock.levels.min(2), &mut indices);
            first += rock.vertex_count() as u32;
        }
        Mesh { vertices: self.vertices.clone(), indices: Arc::new(indices) }
    }
}

impl Rock {
    /// Vertices the mesh will have.
    pub fn vertex_count(&self) -> u64 {
        let side = (1u64 << self.levels) + 1;
        side * side
    }

    /// Adds this rock's triangles to `mesh`.
    pub fn add_to(&self, mesh: &mut Mesh) {
        let n = 1usize << self.levels;
        let side = n + 1;
        let field = |channel| displace(self.levels, self.h, self.seed, channel);
        let mut height = field(0);
        let tint = field(1);
        let [a, b, c, d] = self.corners;
        let out = (c - a).cross(d - b).normalize_or(Vec3::Z);
        let uv = |i: usize| ((i % side) as f32 / n as f32, (i / side) as f32 / n as f32);
        for (i, h) in height.iter_mut().enumerate() {
            let (u, v) = uv(i);
            *h = *h * self.amplitude + self.bulge * 16.0 * u * (1.0 - u) * v * (1.0 - v);
        }
        let position = |i: usize| {
            let (u, v) = uv(i);
            let base = a.lerp(b, u).lerp(d.lerp(c, u), v);
            base + out * height[i]
        };
        let positions: Vec<Vec3> = (0..side * side).map(position).collect();
        let hollow = hollows(&height, side);
        let vertices = Arc::make_mut(&mut mesh.vertices);
        let first = vertices.len() as u32;
        for i in 0..side * side {
            let (x, y) = (i % side, i / side);
            let du = positions[y * side + (x + 1).min(n)] - positions[y * side + x.saturating_sub(1)];
            let dv = positions[(y + 1).min(n) * side + x] - positions[y.saturating_sub(1) * side + x];
            let shade = (1.0 + self.color_noise * tint[i]).max(0.1) * (1.0 - self.cavity * hollow[i]);
            vertices.push(Vertex {
                position: positions[i].to_array(),
                normal: du.cross(dv).normalize_or(out).to_array(),
                albedo: (self.color * shade).to_array(),
            });
        }
        self.add_triangles(first, 1, Arc::make_mut(&mut mesh.indices));
    }

    /// Adds the triangles between every `step`-th of this rock's vertices, which begin at `first`.
    fn add_triangles(&self, first: u32, step: u32, indices: &mut Vec<u32>) {
        let n = 1u32 << self.levels;
        let side = n + 1;
        for y in (0..n).step_by(step as usize) {
            for x in (0..n).step_by(step as usize) {
                let i = first + y * side + x;
                let up = i + step * side;
                indices.extend([i, i + step, up + step, i, up + step, up]);
            }
        }
    }
}

/// A fractal field on (2^levels + 1)² points, deviation 1 at the first level, 0 at the corners.
///
/// Each level sets the middle of every square from its four corners, then the middle of every edge
/// from its neighbours (two on the border), each plus g·2^(−(n−1)·h).
fn displace(levels: u32, h: f32, seed: u64, channel: u64) -> Vec<f32> {
    let n = 1usize << levels;
    let side = n + 1;
    let family = Family::new(seed, Stream::Rock);
    // A point keeps its number, and so its g, when finer levels are added: the shape stays.
    let finest = |c: usize| (c as u64) << (MAX_LEVELS - levels);
    let g = |x: usize, y: usize| -> f32 {
        let number = finest(y) * ((1 << MAX_LEVELS) + 1) + finest(x);
        StandardNormal.sample(&mut family.member(2 * number + channel))
    };
    let mut field = vec![0.0f32; side * side];
    let mut stride = n;
    for level in 0..levels {
        let half = stride / 2;
        let scale = (-(level as f32) * h).exp2();
        for y in (half..side).step_by(stride) {
            for x in (half..side).step_by(stride) {
                let at = |dx: usize, dy: usize| field[(y - half + dy) * side + x - half + dx];
                let mean = (at(0, 0) + at(stride, 0) + at(0, stride) + at(stride, stride)) * 0.25;
                let i = y * side + x;
                field[i] = mean + g(x, y) * scale;
            }
        }
        for y in (0..side).step_by(half) {
            let first = if (y / half).is_multiple_of(2) { half } else { 0 };
            for x in (first..side).step_by(stride) {
                let (mut sum, mut count) = (0.0, 0.0);
                let mut add = |x: usize, y: usize| {
                    sum += field[y * side + x];
                    count += 1.0;
                };
                if x >= half {
                    add(x - half, y);
                }
                if x + half <= n {
                    add(x + half, y);
                }
                if y >= half {
                    add(x, y - half);
                }
                if y + half <= n {
                    add(x, y + half);
                }
                let i = y * side + x;
                // √½: an edge's middle comes half a level after its square's.
                field[i] = sum / count + g(x, y) * scale * (-0.5 * h).exp2();
            }
        }
        stride = half;
    }
    field
}

/// How hollow the field is around each point, 0 (ridge) to 1 (deep hollow), over a neighbourhood of
/// about a sixteenth of the side.
fn hollows(height: &[f32], side: usize) -> Vec<f32> {
    let radius = (side / 16).max(1);
    let mean = box_mean(&box_mean(height, side, radius, false), side, radius, true);
    let difference: Vec<f32> = height.iter().zip(&mean).map(|(h, m)| h - m).collect();
    let variance = difference.iter().map(|d| d * d).sum::<f32>() / difference.len() as f32;
    let scale = 1.0 / variance.sqrt().max(1e-9);
    difference
        .iter()
        .map(|d| {
            let c = d * scale;
            0.5 - 0.5 * c / (1.0 + c * c).sqrt()
        })
        .collect()
}

/// Mean over 2·radius + 1 points along x, or along y if `vertical`, shorter at the border.
fn box_mean(field: &[f32], side: usize, radius: usize, vertical: bool) -> Vec<f32> {
    let at = |line: usize, i: usize| if vertical { field[i * side + line] } else { field[line * side + i] };
    let mut out = vec![0.0; field.len()];
    for line in 0..side {
        let mut prefix = vec![0.0f64; side + 1];
        for i in 0..side {
            prefix[i + 1] = prefix[i] + at(line, i) as f64;
        }
        for i in 0..side {
            let (low, high) = (i.saturating_sub(radius), (i + radius + 1).min(side));
            let mean = ((prefix[high] - prefix[low]) / (high - low) as f64) as f32;
            out[if vertical { i * side + line } else { line * side + i }] = mean;
        }
    }
    out
}
