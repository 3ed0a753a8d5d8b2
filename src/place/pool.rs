//! Pools: level water that falls end in, as part of the opaque mesh. [`crate::engine::pool_surface`] shades
//! them.

pub mod current;
pub mod field;
pub mod waves;

use std::f32::consts::TAU;

use glam::Vec3;

use super::Vertex;
use super::rock::wet::nearest_on_triangle;
use crate::util::words::words;

/// Largest number of pools in a scene.
pub const MAX_POOLS: usize = 8;
/// Squares on a side of a pool's mesh. The mesh holds depth and foam; the finer waves are computed per pixel.
const SQUARES: usize = 128;
/// Depth below which the shore has foam, metres.
const SHORE: f32 = 0.05;

/// Number of straight waves of a sum.
pub const STRAIGHT: usize = 20;
/// The longest of them, which a field has in their place.
pub const STRAIGHT_IN_FIELD: usize = 6;
/// Length of the shortest straight wave relative to the longest.
pub const SHORTEST: f32 = 0.09;

/// Choice of how a pool's waves and foam are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PoolWaves {
    /// A sum of straight waves and rings, and foam by the distance from falling water.
    #[default]
    Sum,
    /// Waves that are mirrored and bent by rocks, and foam that a current carries.
    Field,
}

words! { PoolWaves { Sum => "sum", Field => "field" } }

/// Returns the straight waves' amplitude relative to their length. All waves are equally steep: A = λ·a,
/// where Σ A²/2 is the variance of the height.
pub fn steepness(pool: &Pool) -> f32 {
    let length = |i: usize| pool.straight_length(i);
    let sum: f32 = (0..STRAIGHT).map(|i| length(i) * length(i) * 0.5).sum();
    pool.height / sum.sqrt()
}

/// Returns the steepest slope of a straight wave.
pub fn straight_slope(pool: &Pool) -> f32 {
    TAU * steepness(pool)
}

/// Parameters of a pool.
#[derive(Clone, Debug, PartialEq)]
pub struct Pool {
    /// Name in the scene.
    pub name: String,
    /// Whether a picture with an alpha channel has a hole in its place.
    pub holdout: bool,
    /// Corners, counter-clockwise seen from above, at one height; metres.
    pub corners: [Vec3; 4],
    /// Greatest depth, metres. Rock makes the water shallower.
    pub depth: f32,
    /// Albedo of water that is too deep for its ground to be seen.
    pub color: Vec3,
    /// Albedo of the ground.
    pub bottom: Vec3,
    /// Absorption, 1/m.
    pub absorption: Vec3,
    /// How waves and foam are made.
    pub waves: PoolWaves,
    /// Standard deviation of the surface's height, metres.
    pub height: f32,
    /// Length of the longest wave, metres.
    pub wavelength: f32,
    /// Amplitude of the rings where water falls in, metres.
    pub rings: f32,
    /// Time in which the volume moves by its own length, seconds. The waves repeat with it.
    pub period: f32,
    /// Density of the foam where water falls in, 0 to 1.
    pub foam: f32,
    /// Distance from the falling water at which the foam ends, metres.
    pub foam_reach: f32,
    /// Time in which carried foam falls to 1/e, seconds.
    pub foam_life: f32,
    /// Speed at which falling water pushes the surface away, m/s.
    pub current: f32,
    /// Speed of the whole surface away from falling water, m/s.
    pub drift: f32,
    /// Seed of the waves.
    pub seed: u64,
}

impl Pool {
    /// Squares on a side of the mesh.
    pub const SQUARES: usize = SQUARES;
    /// Vertices of the mesh.
    pub const VERTICES: usize = (SQUARES + 1) * (SQUARES + 1);

    /// Returns the length of a straight wave of a sum, metres, by its number.
    pub fn straight_length(&self, i: usize) -> f32 {
        self.wavelength * SHORTEST.powf(i as f32 / (STRAIGHT - 1) as f32)
    }

    /// Returns the side of the cells in which a field of waves and foam is computed, metres, if they are too
    /// coarse for its foam: wider than half the length over which the foam's current slows down.
    pub fn too_coarse(&self) -> Option<f32> {
        let foam_cell = field::Grid::of(self).halved().cell;
        (self.waves == PoolWaves::Field && self.foam > 0.0 && foam_cell > 0.5 * self.foam_reach)
            .then_some(foam_cell)
    }

    /// Returns the height of the surface, metres.
    pub fn level(&self) -> f32 {
        self.corners[0].y
    }

    /// Returns the segments in which the quads `water` cross the surface, by their two ends; metres.
    pub fn impacts(&self, water: &[[Vec3; 4]]) -> Vec<[Vec3; 2]> {
        let level = self.level();
        let mut impacts = Vec::new();
        for corners in water {
            let mut ends = Vec::new();
            for i in 0..4 {
                let (a, b) = (corners[i], corners[(i + 1) % 4]);
                if (a.y > level) != (b.y > level) {
                    ends.push(a.lerp(b, (level - a.y) / (b.y - a.y)));
                }
            }
            if let [a, b] = ends[..]
                && self.holds((a + b) * 0.5)
            {
                impacts.push([a, b]);
            }
        }
        impacts
    }

    /// Whether a point lies above or below the pool.
    pub fn holds(&self, p: Vec3) -> bool {
        let side = |i: usize| {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % 4]);
            (b - a).cross(p - a).y >= 0.0
        };
        (0..4).all(side)
    }

    /// Appends the vertices of the mesh, without depth and foam. `number` is the pool's number plus 1.
    pub(super) fn add_vertices(&self, number: u32, vertices: &mut Vec<Vertex>) {
        let [a, b, c, d] = self.corners;
        for y in 0..=SQUARES {
            for x in 0..=SQUARES {
                let (u, v) = (x as f32 / SQUARES as f32, y as f32 / SQUARES as f32);
                let position = a.lerp(b, u).lerp(d.lerp(c, u), v).with_y(self.level());
                vertices.push(Vertex {
                    position: position.to_array(),
                    normal: [0.0, 1.0, 0.0],
                    pool: number,
                    ..Vertex::default()
                });
            }
        }
    }

    /// Sets depth and foam of the pool's vertices. `ground` is the height of the rock at each vertex, metres.
    pub(super) fn fill(&self, vertices: &mut [Vertex], ground: &[f32], water: &[[Vec3; 4]]) {
        let impacts = self.impacts(water);
        for (vertex, ground) in vertices.iter_mut().zip(ground) {
            let p = Vec3::from(vertex.position);
            let away = |[a, b]: &[Vec3; 2]| p.distance(nearest_on_triangle(p, [*a, *b, *b]));
            let metres = impacts.iter().map(away).fold(self.foam_reach, f32::min);
            let near = match self.waves {
                PoolWaves::Sum => 1.0 - metres / self.foam_reach,
                // The current carries it.
                PoolWaves::Field => 0.0,
            };
            let depth = (self.level() - ground).clamp(0.0, self.depth);
            let shore = 0.45 * (1.0 - depth / SHORE).max(0.0);
            vertex.albedo = [depth, self.foam * (near * near * (3.0 - 2.0 * near)).max(shore), 0.0];
        }
    }
}
