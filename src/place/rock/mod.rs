//! Fractal rock: a height field by midpoint displacement (Fournier, Fussell and Carpenter 1982),
//! raised on a four-cornered patch as a real mesh, with ridges, layers and ragged borders.

mod field;
pub mod shade;
mod strata;
pub mod wet;

use glam::Vec3;
use rayon::prelude::*;

use super::Vertex;
use field::{displace, hollows};
use strata::Strata;

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
    /// How much of the height is a second field's −|f|, which is sharp where f passes 0; 0 to 1.
    pub ridges: f32,
    /// How far its beds step out and back, in bed heights.
    pub strata: f32,
    /// Mean height of a bed, metres.
    pub strata_height: f32,
    /// Angle of the beds with the horizon, degrees.
    pub strata_tilt: f32,
    /// Relative variation of the albedo from bed to bed.
    pub strata_color: f32,
    /// Deviation of the displacement of points inside the patch, and so of its border; metres.
    pub border: f32,
    /// How wet it is where water is, 0 to 1.
    pub wet: f32,
    /// Metres from water to where it is dry.
    pub wet_reach: f32,
    /// How much of the light from the surroundings rock takes from it where it sees nothing else, 0 to 1.
    pub occlusion: f32,
    /// How much of the sun's light rock takes from it in full shadow, 0 to 1.
    pub shadow: f32,
}

impl Rock {
    /// Vertices the mesh will have.
    pub fn vertex_count(&self) -> u64 {
        let side = (1u64 << self.levels) + 1;
        side * side
    }

    /// This rock's vertices, dry and without the shade of others.
    pub(super) fn vertices(&self) -> Vec<Vertex> {
        let n = 1usize << self.levels;
        let side = n + 1;
        let field = |channel| displace(self.levels, self.h, self.seed, channel);
        let tint = field(1);
        let [a, b, c, d] = self.corners;
        let out = (c - a).cross(d - b).normalize_or(Vec3::Z);
        let uv = |i: usize| ((i % side) as f32 / n as f32, (i / side) as f32 / n as f32);
        let mut height = field(0);
        if self.ridges > 0.0 {
            for (h, r) in height.iter_mut().zip(field(2)) {
                // E|g| of a unit normal: ridges leave the mean height alone.
                *h += self.ridges * ((2.0 / std::f32::consts::PI).sqrt() - r.abs() - *h);
            }
        }
        for (i, h) in height.iter_mut().enumerate() {
            let (u, v) = uv(i);
            *h = *h * self.amplitude + self.bulge * 16.0 * u * (1.0 - u) * v * (1.0 - v);
        }
        let mut base: Vec<Vec3> = (0..side * side)
            .map(|i| {
                let (u, v) = uv(i);
                a.lerp(b, u).lerp(d.lerp(c, u), v)
            })
            .collect();
        if self.border > 0.0 {
            let along = (b - a + c - d).normalize_or_zero();
            let across = out.cross(along);
            for ((p, x), y) in base.iter_mut().zip(field(3)).zip(field(4)) {
                *p += (along * x + across * y) * self.border;
            }
        }
        let mut tone = vec![0.0; side * side];
        if self.strata > 0.0 {
            let strata = Strata::new(self, out);
            let (bend, weather) = (field(5), field(6));
            let size = self.strata * self.strata_height;
            height.par_iter_mut().zip(&mut tone).enumerate().for_each(|(i, (height, tone))| {
                // Beds wave, end in rough edges, and are worn down in places.
                let bed = strata.at(base[i], 0.6 * bend[i]);
                let kept = 0.55 + 0.45 * weather[i] / (1.0 + weather[i] * weather[i]).sqrt();
                *height += size * kept * bed.out;
                *tone = bed.tone * self.strata_color;
            });
        }
        let positions: Vec<Vec3> = base.iter().zip(&height).map(|(p, &h)| *p + out * h).collect();
        let hollow = hollows(&height, side);
        let vertex = |i: usize| {
            let (x, y) = (i % side, i / side);
            let du = positions[y * side + (x + 1).min(n)] - positions[y * side + x.saturating_sub(1)];
            let dv = positions[(y + 1).min(n) * side + x] - positions[y.saturating_sub(1) * side + x];
            let shade = (1.0 + self.color_noise * tint[i]).max(0.1) * (1.0 - self.cavity * hollow[i]);
            Vertex {
                position: positions[i].to_array(),
                normal: du.cross(dv).normalize_or(out).to_array(),
                albedo: (self.color * shade * (1.0 + tone[i])).to_array(),
                ..Vertex::default()
            }
        };
        (0..side * side).map(vertex).collect()
    }

    /// Adds the triangles between every `step`-th of this rock's vertices, which begin at `first`.
    pub(super) fn add_triangles(&self, first: u32, step: u32, indices: &mut Vec<u32>) {
        let n = 1u32 << self.levels;
        let index = |x: u32, y: u32| first + (y * (n + 1) + x) * step;
        for (x, y) in (0..n / step).flat_map(|y| (0..n / step).map(move |x| (x, y))) {
            let [a, b, c, d] = [index(x, y), index(x + 1, y), index(x + 1, y + 1), index(x, y + 1)];
            indices.extend([a, b, c, a, c, d]);
        }
    }
}
