//! Shadows of opaque matter on shells: shares of light at the vertices of their meshes.
//!
//! A light's ray through a shell knows that shell alone. What else is in its way, opaque triangles and the
//! skins of all shells, is found by rays from below the mesh's triangles: some below each, near the outer
//! surface and near the inner one. A vertex holds their mean, in which a ray weighs by the vertex's share at
//! its start (Kavan, Bargteil and Sloan 2011, without their solve). So a shadow's edge is a slope as wide as
//! the triangles, and a post between two vertices still casts a shadow.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::Mesh;
use super::bvh::{Bvh, Caster};
use super::triangles::ROCK_SQUARES;
use crate::light::Light;
use crate::mapping::shell::{EDGES, End, Shell, ShellPath};
use crate::util::error::Result;
use crate::util::monitor::Monitor;

/// Rays below a triangle for each surface and light. Some six triangles meet in a vertex; with half of the
/// rays, the edges of shadows look grainy.
const RAYS: usize = 4;
/// Triangles times lights from which on each has fewer rays, so that their sum stays.
const MANY: usize = 1 << 15;
/// Depths at which rays start. At 0 and 1 they would lie on a surface, and rounding would decide on which
/// side of it.
const DEPTHS: [f32; 2] = [0.01, 0.99];
/// Bytes that a caster takes while shadows are made: as a triangle, and in the tree of boxes.
pub const CASTER_BYTES: u64 = 200;

/// Shares of light that opaque matter lets through to shells.
#[derive(Debug, PartialEq)]
pub struct ShellShadows {
    /// Of each shell and light: at every vertex, at the outer and at the inner surface.
    shares: Vec<Vec<Vec<[f32; 2]>>>,
}

impl ShellShadows {
    /// Share of a light's rays at a place in a shell's prism: below its `vertices` with their `shares`, at
    /// `depth` (0 to 1) from the outer surface. Twin: `shell_shadow` of
    /// `shaders/engine/integrate_shell.wgsl`.
    #[inline]
    pub fn at(&self, shell: usize, light: usize, vertices: [u32; 3], shares: Vec3, depth: f32) -> f32 {
        let own = &self.shares[shell][light];
        let seen = vertices.map(|vertex| {
            let [outer, inner] = own[vertex as usize];
            outer + (inner - outer) * depth
        });
        Vec3::from_array(seen).dot(shares).clamp(0.0, 1.0)
    }

    /// Shares of a light at the vertices of a shell, at the outer and at the inner surface.
    pub fn of(&self, shell: usize, light: usize) -> &[[f32; 2]] {
        &self.shares[shell][light]
    }

    /// All shares: shell by shell, light by light, vertex by vertex, of the outer before the inner surface.
    pub fn values(&self) -> impl Iterator<Item = f32> {
        self.shares.iter().flatten().flatten().flatten().copied()
    }

    /// Sends the rays. `None` where nothing hides any light.
    ///
    /// # Errors
    /// Errors of `monitor`, which may stop the work.
    pub(super) fn new(
        casters: &Bvh,
        shells: &[Arc<Shell>],
        lights: &[Light],
        monitor: &dyn Monitor,
    ) -> Result<Option<ShellShadows>> {
        if casters.is_empty() {
            return Ok(None);
        }
        let triangles = shells.iter().map(|shell| shell.prisms.len()).sum::<usize>() * lights.len();
        let rays = (RAYS * MANY / triangles.max(1)).clamp(1, RAYS);
        let total = (shells.len() * lights.len()) as u64;
        let mut shares: Vec<Vec<Vec<[f32; 2]>>> = Vec::with_capacity(shells.len());
        for shell in shells {
            let mut own = Vec::with_capacity(lights.len());
            for light in lights {
                let done = (shares.len() * lights.len() + own.len()) as u64;
                monitor.progress("shadows on shells", done, total)?;
                own.push(Rays { casters, shell, light, count: rays }.at_vertices());
            }
            shares.push(own);
        }
        let shadows = ShellShadows { shares };
        let hides = shadows.values().any(|share| share < 1.0);
        Ok(hides.then_some(shadows))
    }
}

/// Sorts the opaque triangles of a mesh into a tree, and the skins of shells. Pools let light through.
pub(super) fn casters(mesh: &Mesh, shells: &[Arc<Shell>]) -> Bvh {
    let mut casters = Vec::new();
    let caster = |corners: [Vec3; 3]| Caster { corners, kinds: 1 };
    for tile in mesh.tiles.iter().filter(|tile| tile.pool == 0) {
        // Tiles of one grid have one step, so there is no crack between them.
        let step = if tile.is_grid() { ((tile.pitch - 1) / ROCK_SQUARES).clamp(1, tile.side) } else { 1 };
        let (triangles, _) = tile.triangles(step, [false; 4]).as_chunks::<3>();
        let position = |corner: u16| Vec3::from(mesh.vertices[tile.vertex_of(corner) as usize].position);
        casters.extend(triangles.iter().map(|corners| caster(corners.map(position))));
    }
    for shell in shells.iter().filter(|shell| shell.skin) {
        let inner = |vertex: u32| shell.points[2 * vertex as usize + 1];
        casters.extend(shell.prisms.iter().map(|prism| caster(prism.vertices.map(inner))));
    }
    Bvh::new(&casters)
}

/// Rays from a shell to a light.
struct Rays<'a> {
    casters: &'a Bvh,
    shell: &'a Shell,
    light: &'a Light,
    /// Number of rays below each triangle at either surface.
    count: usize,
}

/// Sum of the shares of some rays times their weights, and of the weights.
type Sum = [f32; 2];

impl Rays<'_> {
    /// Shares at every vertex, at the outer and at the inner surface.
    fn at_vertices(&self) -> Vec<[f32; 2]> {
        let prisms = &self.shell.prisms;
        let made: Vec<[[Sum; 3]; 2]> =
            (0..prisms.len()).into_par_iter().map(|prism| [0, 1].map(|k| self.below(prism, k))).collect();
        // One order of the sums, whatever the number of threads.
        let mut sums = vec![[Sum::default(); 2]; self.shell.vertices()];
        for (prism, own) in prisms.iter().zip(&made) {
            for (surface, of_vertices) in own.iter().enumerate() {
                for (&vertex, [share, weight]) in prism.vertices.iter().zip(of_vertices) {
                    let sum = &mut sums[vertex as usize][surface];
                    *sum = [sum[0] + share, sum[1] + weight];
                }
            }
        }
        let mean = |[share, weight]: Sum| (weight > 0.0).then(|| (share / weight).min(1.0));
        let known: Vec<Option<[f32; 2]>> = sums
            .iter()
            .map(|own| {
                let [outer, inner] = own.map(mean);
                Some([outer.or(inner)?, inner.or(outer)?])
            })
            .collect();
        self.filled(&known)
    }

    /// Gives a vertex without shares the mean of its neighbours. The shell itself is dark there, but between
    /// it and its neighbours it may be lit.
    fn filled(&self, known: &[Option<[f32; 2]>]) -> Vec<[f32; 2]> {
        let mut around = vec![([0.0f32; 2], 0.0f32); known.len()];
        for [a, b] in self.shell.prisms.iter().flat_map(|p| EDGES.map(|edge| edge.map(|k| p.vertices[k]))) {
            for [to, from] in [[a, b], [b, a]].map(|ends| ends.map(|vertex| vertex as usize)) {
                if let (None, Some([outer, inner])) = (known[to], known[from]) {
                    let (sum, count) = &mut around[to];
                    *sum = [sum[0] + outer, sum[1] + inner];
                    *count += 1.0;
                }
            }
        }
        let filled = |(own, (sum, count)): (&Option<[f32; 2]>, &([f32; 2], f32))| match own {
            Some(own) => *own,
            None if *count > 0.0 => sum.map(|sum| (sum / count).min(1.0)),
            None => [1.0; 2],
        };
        known.iter().zip(&around).map(filled).collect()
    }

    /// Sums over the rays that start below a triangle, near the outer surface (0) or the inner one (1), for
    /// each of its vertices.
    fn below(&self, prism: usize, surface: usize) -> [Sum; 3] {
        let [a, b, c] = self.shell.prisms[prism].vertices.map(|v| self.shell.points[2 * v as usize]);
        let area = (b - a).cross(c - a).length();
        let mut sums = [Sum::default(); 3];
        for i in 0..self.count {
            let shares = sample(prism, i);
            let [at_top, own] =
                [DEPTHS[0], DEPTHS[surface]].map(|depth| self.shell.below_triangle(prism, shares, depth));
            let Some(is_open) = self.is_open(at_top.0, own) else { continue };
            for (sum, share) in sums.iter_mut().zip(shares.to_array()) {
                let weight = share * area;
                *sum = [sum[0] + if is_open { weight } else { 0.0 }, sum[1] + weight];
            }
        }
        sums
    }

    /// Whether a place in a tetrahedron sees the light past opaque matter. `None` where nobody will know:
    /// beside a spot light's beam, where the ray ends in the shell's own skin, and where opaque matter lies
    /// between the place and `at_top`, near the outer surface above it. Rock under water often fills the
    /// lower part of the shell; the water above it should not get its darkness.
    fn is_open(&self, at_top: Vec3, (point, tetrahedron): (Vec3, [usize; 2])) -> Option<bool> {
        let (to_light, intensity) = self.light.at(point);
        let far = self.light.distance(point);
        let (down, height) = (point - at_top, point.distance(at_top));
        let is_buried = height > 0.0 && self.casters.is_hit_before(at_top, down / height, height, 1);
        if intensity == Vec3::ZERO || is_buried {
            return None;
        }
        if !self.casters.is_hit_before(point, to_light, far, 1) {
            return Some(true);
        }
        if self.shell.skin
            && let Some(path) = ShellPath::inside(self.shell, tetrahedron, point, to_light)
            && path.take_while(|segment| segment.t[1] < far).any(|segment| segment.end == End::Inner)
        {
            return None;
        }
        Some(false)
    }
}

/// Shares of a triangle's vertices at the `i`-th point of its sequence. It fills the triangle evenly (Roberts
/// 2018); each triangle begins it elsewhere.
fn sample(triangle: usize, i: usize) -> Vec3 {
    // 2³² over the first two powers of the plastic number.
    let steps = [0xC13F_A9A9u32, 0x91E1_0DA5];
    // Multiples of large odd numbers, mixed, look random.
    let mixed = (triangle as u32 ^ 0x68BC_21EB).wrapping_mul(0x9E37_79B1);
    let seeds = [mixed ^ mixed >> 15, (mixed ^ mixed >> 13).wrapping_mul(0x85EB_CA77)];
    let [s, t] = [0, 1].map(|k| {
        let turned = seeds[k].wrapping_add((i as u32).wrapping_mul(steps[k]));
        (turned >> 8) as f32 / (1 << 24) as f32
    });
    let [s, t] = if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] };
    Vec3::new((1.0 - s - t).max(0.0), s, t)
}
