//! Fractal rock: a height field by midpoint displacement (Fournier, Fussell and Carpenter 1982) on a patch of
//! four corners. It becomes a mesh, with ridges, beds and ragged borders.

mod field;
mod patch;
pub mod shade;
pub mod stone;
mod strata;
pub mod veil;
pub mod wet;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::Vertex;
use field::hollows;
use patch::steeper;
use stone::StoneKind;
use strata::Strata;

/// Largest number of subdivisions of a rock: a mesh of a million points.
pub const MAX_LEVELS: u32 = 10;

/// Least cosine between the normal of a vertex and that of the patch.
const LEAST_OUTWARD: f32 = 0.02;

/// Returns a normal that does not point into the rock.
///
/// Displacement within the patch may fold the mesh over itself. There the triangles face into the rock.
/// Normals that were interpolated between both sides would pass 0, and a point that looks into the rock is
/// in the dark: both showed as black dots.
fn outward(n: Vec3, out: Vec3) -> Vec3 {
    let cos = n.dot(out);
    if cos >= LEAST_OUTWARD {
        return n;
    }
    (n + out * (LEAST_OUTWARD - cos)).normalize_or(out)
}

/// Parameters of a rock.
#[derive(Clone, Debug, PartialEq)]
pub struct Rock {
    /// Name in the scene.
    pub name: String,
    /// Whether a picture with an alpha channel has a hole in its place.
    pub holdout: bool,
    /// Kind of its stone.
    pub kind: StoneKind,
    /// Strength of the stone's grain, cracks and streaks.
    pub grain: f32,
    /// Amount of moss on the stone, 0 to 1.
    pub moss: f32,
    /// Patch corners (u,v) = (0,0) (1,0) (1,1) (0,1), counter-clockwise seen from the outside; metres.
    pub corners: [Vec3; 4],
    /// Number of subdivisions: the mesh has 2^levels squares a side.
    pub levels: u32,
    /// Roughness as in the curves: the displacement at level n has the deviation amplitude·2^(−(n−1)·h).
    pub h: f32,
    /// Standard deviation of the displacement at the first level, metres.
    pub amplitude: f32,
    /// Height of the patch's middle above its border, metres.
    pub bulge: f32,
    /// Seed of the rock's randomness.
    pub seed: u64,
    /// Mean albedo, linear RGB.
    pub color: Vec3,
    /// Relative variation of the albedo.
    pub color_noise: f32,
    /// Darkening of hollows, 0 to 1.
    pub cavity: f32,
    /// Share of the height that is −|f| of a second field f, which is sharp where f passes 0; 0 to 1.
    pub ridges: f32,
    /// Distance by which beds step out and back, in bed heights.
    pub strata: f32,
    /// Mean height of a bed, metres.
    pub strata_height: f32,
    /// Angle of the beds with the horizon, degrees.
    pub strata_tilt: f32,
    /// Relative variation of the albedo from bed to bed.
    pub strata_color: f32,
    /// Share by which the patch's outline is rounded to an ellipse, 0 to 1.
    pub round: f32,
    /// Standard deviation of the displacement of points within the patch, border included; metres.
    pub border: f32,
    /// Wetness of the rock where water is, 0 to 1.
    pub wet: f32,
    /// Distance from the water at which the rock is dry, metres.
    pub wet_reach: f32,
    /// Share of the surroundings' light that this rock loses where it sees nothing but rock, 0 to 1.
    pub occlusion: f32,
    /// Share of the sun's light that this rock loses in full shadow, 0 to 1.
    pub shadow: f32,
}

impl Rock {
    /// Returns the number of vertices of the mesh.
    pub fn vertex_count(&self) -> u64 {
        let side = (1u64 << self.levels) + 1;
        side * side
    }

    /// Returns the unit normal of the patch.
    fn out(&self) -> Vec3 {
        let [a, b, c, d] = self.corners;
        (c - a).cross(d - b).normalize_or(Vec3::Z)
    }

    /// Returns the unit vectors across the beds, and along them and the patch.
    fn bed_axes(&self) -> (Vec3, Vec3) {
        let level = Vec3::Y.cross(self.out()).normalize_or(Vec3::X);
        let (sin, cos) = self.strata_tilt.to_radians().sin_cos();
        (Vec3::Y * cos + level * sin, level * cos - Vec3::Y * sin)
    }

    /// Builds the vertices, dry and without shade from other rock. Positions are measured from `origin`.
    pub(super) fn vertices(&self, origin: DVec3) -> Vec<Vertex> {
        let n = 1usize << self.levels;
        let side = n + 1;
        let field = |channel| self.field(channel, self.h);
        let tint = field(1);
        let out = self.out();
        let uv = |i: usize| ((i % side) as f32 / n as f32, (i / side) as f32 / n as f32);
        let mut height = field(0);
        if self.ridges > 0.0 {
            for (h, r) in height.iter_mut().zip(field(2)) {
                // √(2/π) is E|g| of a unit normal g, so ridges keep the mean height.
                *h += self.ridges * ((2.0 / std::f32::consts::PI).sqrt() - r.abs() - *h);
            }
        }
        for (i, h) in height.iter_mut().enumerate() {
            let (u, v) = uv(i);
            let dome = 16.0 * u * (1.0 - u) * v * (1.0 - v);
            *h = *h * self.amplitude + self.bulge * steeper(dome, self.round);
        }
        let base = self.base();
        let mut tone = vec![0.0; side * side];
        if self.strata > 0.0 {
            let strata = Strata::new(self, origin);
            let (bend, weather) = (field(5), field(6));
            let size = self.strata * self.strata_height;
            height.par_iter_mut().zip(&mut tone).enumerate().for_each(|(i, (height, tone))| {
                // Beds wave, end in rough edges, and are worn down in places.
                let bed = strata.at(base[i], 0.6 * bend[i]);
                let relief = 0.55 + 0.45 * weather[i] / (1.0 + weather[i] * weather[i]).sqrt();
                *height += size * relief * bed.out;
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
                normal: outward(du.cross(dv).normalize_or(out), out).to_array(),
                albedo: (self.color * shade * (1.0 + tone[i])).to_array(),
                ..Vertex::default()
            }
        };
        (0..side * side).map(vertex).collect()
    }

    /// Appends the triangles between every `step`-th vertex of this rock. The rock's vertices begin at
    /// `first`.
    pub(super) fn add_triangles(&self, first: u32, step: u32, indices: &mut Vec<u32>) {
        let n = 1u32 << self.levels;
        let index = |x: u32, y: u32| first + (y * (n + 1) + x) * step;
        for (x, y) in (0..n / step).flat_map(|y| (0..n / step).map(move |x| (x, y))) {
            let [a, b, c, d] = [index(x, y), index(x + 1, y), index(x + 1, y + 1), index(x, y + 1)];
            indices.extend([a, b, c, a, c, d]);
        }
    }
}
