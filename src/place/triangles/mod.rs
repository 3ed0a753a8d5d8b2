//! Shade and wetness of the triangles of other programs' meshes.

mod bake;
mod memo;
mod refine;

use std::convert::Infallible;
use std::fmt;
use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::bvh::{Bvh, Caster};
use super::rock::wet;
use super::{Ground, Mesh, Rock, Triangles, Vertex};
use crate::util::cache::{Cache, key};
pub use memo::ShadeMemo;
use memo::{Kept, Key};
use refine::{Refined, refined};

/// Version of the shade of meshes, a part of its cache key. Raise it with every change to the values at the
/// vertices; a test compares their checksum.
pub const SHADE_VERSION: u32 = 1;

/// Triangles that all meshes of a scene get at most for their shade.
pub const MAX_ADDED: u32 = 400_000;
/// Bytes that a triangle with shade takes while it is made, besides its vertices: in the tree of boxes, and
/// in the tables that find equal vertices.
pub const SHADE_BYTES: u64 = 320;

/// Squares on a side of the grid that blocks light in a rock's place. The rock itself has as many or more.
pub(super) const ROCK_SQUARES: u32 = 256;

/// What blocks a ray: bits of [`Caster::kinds`].
pub(super) mod kinds {
    /// Meshes that take part in occlusion.
    pub const MESH_OCCLUSION: u8 = 1;
    /// Meshes that take part in shadow.
    pub const MESH_SHADOW: u8 = 2;
    /// Rocks that take part in occlusion.
    pub const ROCK_OCCLUSION: u8 = 4;
    /// Rocks that take part in shadow.
    pub const ROCK_SHADOW: u8 = 8;
}

/// Strengths of the shade and of the film of water on a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshShade {
    /// Share of the surroundings' light that the mesh loses where it sees nothing but opaque matter, 0 to 1.
    pub occlusion: f32,
    /// Share of the light of the shadow's light that the mesh loses in full shadow, 0 to 1.
    pub shadow: f32,
    /// Wetness where water is, 0 to 1.
    pub wet: f32,
    /// Distance from the water at which the mesh is dry, metres.
    pub wet_reach: f32,
    /// Triangles that the mesh may get besides its own, so that its vertices hold the above.
    pub most_added: u32,
}

impl MeshShade {
    /// Whether there is any shade or water.
    pub fn is_wanted(&self) -> bool {
        self.occlusion > 0.0 || self.shadow > 0.0 || self.wet > 0.0
    }
}

/// Triangles around the water of shells, metres.
#[derive(Clone, Default, PartialEq)]
pub struct WaterFaces(pub Vec<[Vec3; 3]>);

/// Checksum of values, which stands for them in the keys of caches.
fn digest<T: bytemuck::NoUninit>(values: &[T]) -> u128 {
    xxhash_rust::xxh3::xxh3_128(bytemuck::cast_slice(values))
}

impl fmt::Debug for WaterFaces {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "WaterFaces({} {:032x})", self.0.len(), digest(&self.0))
    }
}

impl fmt::Debug for Triangles {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        // Shade does not depend on the textures.
        let Triangles { vertices, holdout, shade, .. } = self;
        write!(f, "Triangles({} {:032x} {holdout} {shade:?})", vertices.len(), digest(vertices))
    }
}

impl PartialEq for Triangles {
    fn eq(&self, other: &Triangles) -> bool {
        let is_same = || Arc::ptr_eq(&self.vertices, &other.vertices) || self.vertices == other.vertices;
        let has_same_painting = || match (&self.painting, &other.painting) {
            (Some(own), Some(other)) => Arc::ptr_eq(own, other) || own == other,
            (own, other) => own.is_none() && other.is_none(),
        };
        (self.holdout, self.shade) == (other.holdout, other.shade) && has_same_painting() && is_same()
    }
}

/// Occlusion, shadow and wetness of a vertex.
type Coat = [f32; 3];

impl Ground {
    /// Adds the meshes to the grids of rocks and pools, with their shade.
    pub(super) fn with_meshes(&self, grids: Mesh, memo: &ShadeMemo, cache: Option<&Cache>) -> Mesh {
        if !self.triangles.iter().any(|own| own.shade.is_wanted()) {
            return grids.with_triangles(&self.triangles);
        }
        let kept = self.kept(memo);
        let first = grids.vertices.len();
        let make = || Ok::<_, Infallible>(self.coats(&kept, &grids.vertices));
        let count = kept.refined.iter().map(|own| own.vertices.len()).sum();
        let made = match cache {
            Some(cache) => cache.get("meshes", &key("mesh shade", SHADE_VERSION, self), count, make),
            None => make(),
        };
        let Ok(coats) = made;
        let mut mesh = grids.with_triangles(&kept.refined);
        let Mesh { vertices, tiles, paints, .. } = &mut mesh;
        let vertices = Arc::make_mut(vertices);
        for tile in tiles.iter().filter(|tile| !tile.is_grid()) {
            // The raster pass darkens a texture under the film pixel by pixel.
            let paint = tile.paint.checked_sub(1).map(|paint| &paints.all[paint as usize]);
            let is_textured = paint.is_some_and(|paint| paint.color.levels > 0);
            let own = tile.first as usize..tile.first as usize + 3 * tile.side as usize;
            for (vertex, [occlusion, shadow, wet]) in
                vertices[own.clone()].iter_mut().zip(&coats[own.start - first..])
            {
                (vertex.occlusion, vertex.shadow, vertex.wet) = (*occlusion, *shadow, *wet);
                if !is_textured {
                    wet::wet_vertex(vertex, *wet);
                }
            }
        }
        mesh
    }

    /// What is kept of the shade of these meshes.
    fn kept(&self, memo: &ShadeMemo) -> Arc<Kept> {
        let full = |amount: f32| if amount > 0.0 { 1.0 } else { 0.0 };
        let with_full = |own: &Triangles| {
            let MeshShade { occlusion, shadow, wet, most_added, .. } = own.shade;
            let [occlusion, shadow, wet] = [occlusion, shadow, wet].map(full);
            let shade = MeshShade { occlusion, shadow, wet, wet_reach: 0.0, most_added };
            Triangles { shade, ..own.clone() }
        };
        let casts = |rock: &&Rock| rock.occlusion > 0.0 || rock.shadow > 0.0;
        let key = Key {
            triangles: self.triangles.iter().map(with_full).collect(),
            rocks: self.rocks.iter().filter(casts).cloned().collect(),
            origin: self.origin,
        };
        let refine = |own: &Triangles| {
            if !own.shade.is_wanted() {
                return (own.clone(), Vec::new());
            }
            let Refined { vertices, lifts, pieces } = refined(&own.vertices, own.shade.most_added as usize);
            let painting = match &own.painting {
                Some(painting) if !pieces.is_empty() => {
                    Some(Arc::new(painting.split(&own.vertices, &vertices, &pieces)))
                }
                other => other.clone(),
            };
            (Triangles { vertices, painting, ..own.clone() }, lifts)
        };
        memo.kept(key, |key| key.triangles.iter().map(refine).unzip())
    }

    /// Everything that blocks light. `grids` are the vertices of the rocks.
    pub(super) fn casters(&self, memo: &ShadeMemo, grids: &[Vertex]) -> Arc<Bvh> {
        self.kept(memo).casters(|| self.new_casters(grids))
    }

    fn new_casters(&self, grids: &[Vertex]) -> Bvh {
        let mut casters = Vec::new();
        for own in &self.triangles {
            let kinds =
                kinds_of(own.shade.occlusion, own.shade.shadow, [kinds::MESH_OCCLUSION, kinds::MESH_SHADOW]);
            if kinds != 0 {
                let corners = |t: &[Vertex; 3]| t.map(|vertex| Vec3::from(vertex.position));
                let (triangles, _) = own.vertices.as_chunks::<3>();
                casters.extend(triangles.iter().map(|t| Caster { corners: corners(t), kinds }));
            }
        }
        for (rock, own) in self.rocks.iter().zip(self.ranges()) {
            let kinds = kinds_of(rock.occlusion, rock.shadow, [kinds::ROCK_OCCLUSION, kinds::ROCK_SHADOW]);
            if kinds != 0 {
                let mut indices = Vec::new();
                let step = ((1 << rock.levels) / ROCK_SQUARES).max(1);
                rock.add_triangles(own.start as u32, step, &mut indices);
                let corner = |i: u32| Vec3::from(grids[i as usize].position);
                let (triangles, _) = indices.as_chunks::<3>();
                casters.extend(triangles.iter().map(|t| Caster { corners: t.map(corner), kinds }));
            }
        }
        Bvh::new(&casters)
    }

    /// Returns what each vertex of the meshes gets.
    fn coats(&self, kept: &Kept, grids: &[Vertex]) -> Vec<Coat> {
        let welded = kept.welded();
        let count = kept.refined.iter().map(|own| own.vertices.len() / 3).sum();
        let casters = kept.casters(|| self.new_casters(grids));
        let each = || kept.refined.iter().zip(welded.iter());
        let occlusion = kept.occlusion(|| {
            let kinds = kinds::MESH_OCCLUSION | kinds::ROCK_OCCLUSION;
            let of = |(own, welded): (&Triangles, _)| match own.shade.occlusion > 0.0 {
                true => bake::occlusion(&own.vertices, welded, &casters, kinds, count),
                false => Vec::new(),
            };
            each().map(of).collect()
        });
        let (water, veils) = (self.water_around_meshes(), self.veils());
        let mut coats = Vec::with_capacity(3 * count);
        for (mesh, (own, welded)) in each().enumerate() {
            let shade = self.triangles[mesh].shade;
            let shadow = match self.sun {
                Some(to_sun) if shade.shadow > 0.0 => {
                    let kinds = kinds::MESH_SHADOW | kinds::ROCK_SHADOW;
                    bake::shadow(&own.vertices, &kept.lifts[mesh], welded, &casters, kinds, to_sun, count)
                }
                _ => Vec::new(),
            };
            let shadow = match &veils {
                Some(veils) if shade.shadow > 0.0 => {
                    let points = welded.corners.par_iter().map(|i| own.vertices[*i as usize].position.into());
                    points.zip(shadow).map(|(p, shadow)| 1.0 - (1.0 - shadow) * veils.pass(p)).collect()
                }
                _ => shadow,
            };
            let wet: Vec<f32> = match shade.wet > 0.0 {
                true => {
                    let points = welded.corners.par_iter().map(|i| own.vertices[*i as usize].position.into());
                    points
                        .map(|p| wet::wetness_at(p, shade.wet, shade.wet_reach, &water, &self.pools))
                        .collect()
                }
                false => Vec::new(),
            };
            let of = |values: &[f32], i: u32| values.get(i as usize).copied().unwrap_or(0.0);
            coats.extend(welded.numbers.iter().map(|&i| {
                [shade.occlusion * of(&occlusion[mesh], i), shade.shadow * of(&shadow, i), of(&wet, i)]
            }));
        }
        coats
    }

    /// Falling water and shells that can wet meshes.
    fn water_around_meshes(&self) -> Bvh {
        if !self.triangles.iter().any(|own| own.shade.wet > 0.0) {
            return Bvh::new(&[]);
        }
        let halves = self.water.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        water_tree(halves.chain(self.water_faces.0.iter().copied()))
    }
}

/// Sorts triangles of water into a tree.
pub(super) fn water_tree(triangles: impl Iterator<Item = [Vec3; 3]>) -> Bvh {
    Bvh::new(&triangles.map(|corners| Caster { corners, kinds: 0 }).collect::<Vec<_>>())
}

/// Bits of a caster that takes part in occlusion and shadow where they are above 0.
fn kinds_of(occlusion: f32, shadow: f32, [first, second]: [u8; 2]) -> u8 {
    (if occlusion > 0.0 { first } else { 0 }) | (if shadow > 0.0 { second } else { 0 })
}
