//! Opaque geometry as triangles: rocks and pools, with the light that they block from one another.

use std::convert::Infallible;
use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::pool::Pool;
use super::rock::{Rock, shade, wet};
use super::tiles::{self, Tile};
use crate::place::Vertex;
use crate::util::cache::{Cache, key};

/// Opaque triangles of a mesh that another program made.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangles {
    /// Three vertices for each triangle.
    pub vertices: Arc<Vec<Vertex>>,
    /// Whether a picture with an alpha channel has a hole in their place.
    pub holdout: bool,
}

impl Triangles {
    /// Whether two lists share the same vertices.
    pub fn are_shared(a: &[Triangles], b: &[Triangles]) -> bool {
        let is_same = |(a, b): (&Triangles, &Triangles)| {
            Arc::ptr_eq(&a.vertices, &b.vertices) && a.holdout == b.holdout
        };
        a.len() == b.len() && a.iter().zip(b).all(is_same)
    }
}

/// Opaque geometry: square grids of vertices, first of the rocks and then of the pools, and triangles of
/// other meshes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices, row by row. They are shared, so that the owner of a copy on the GPU can recognise them.
    pub vertices: Arc<Vec<Vertex>>,
    /// Tiles of the grids, and those of triangles.
    pub tiles: Arc<Vec<Tile>>,
}

impl Mesh {
    /// Makes a mesh of consecutive grids. `grids` are the squares on a side of each, powers of two, and
    /// whether it is a holdout.
    pub fn new(vertices: Vec<Vertex>, grids: impl IntoIterator<Item = (u32, bool)>) -> Mesh {
        let tiles = tiles::cut(&vertices, grids.into_iter());
        Mesh { vertices: Arc::new(vertices), tiles: Arc::new(tiles) }
    }

    /// Adds the triangles of other meshes.
    pub fn with_triangles(self, soups: &[Triangles]) -> Mesh {
        if soups.is_empty() {
            return self;
        }
        let mut vertices = Arc::unwrap_or_clone(self.vertices);
        let mut tiles = Arc::unwrap_or_clone(self.tiles);
        for Triangles { vertices: own, holdout } in soups {
            let first = vertices.len() as u32;
            vertices.extend_from_slice(own);
            tiles.extend(tiles::cut_triangles(&vertices, first, *holdout));
        }
        Mesh { vertices: Arc::new(vertices), tiles: Arc::new(tiles) }
    }

    /// Returns all triangles as indices of vertices, with the given step for each tile.
    pub fn triangles(&self, steps: &[u32]) -> Vec<[u32; 3]> {
        let mut out = Vec::new();
        for (i, tile) in self.tiles.iter().enumerate() {
            let corners = tile.triangles(steps[i], tiles::coarser(&self.tiles, steps, i));
            let (triangles, _) = corners.as_chunks::<3>();
            out.extend(triangles.iter().map(|t| t.map(|corner| tile.vertex_of(corner))));
        }
        out
    }
}

/// Version of the mesh builder, a part of the cache key of meshes. Raise it with every change to the vertices
/// that a [`Ground`] makes; a test compares their checksums.
pub const BUILDER_VERSION: u32 = 1;

/// Everything that determines the opaque mesh of a scene: equal grounds have equal meshes.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Rocks, in the order of their vertices.
    pub rocks: Vec<Rock>,
    /// Pools; their vertices follow those of the rocks.
    pub pools: Vec<Pool>,
    /// Corners of the quads that wet rock and fall into pools, metres; empty where nothing can be wet.
    pub water: Vec<[Vec3; 4]>,
    /// Unit vector to the light that makes rock cast shadows on rock; `None` where no rock is shaded.
    pub sun: Option<Vec3>,
    /// The place in the world from which positions are measured, metres. Beds of rock are fixed to the world.
    pub origin: DVec3,
}

impl Ground {
    /// Builds the mesh.
    pub fn mesh(&self) -> Mesh {
        Mesh::new(self.vertices(), self.grids())
    }

    /// Returns [`Ground::mesh`], from `cache` where it is stored there.
    pub fn cached_mesh(&self, cache: &Cache) -> Mesh {
        let count = self.rock_vertices() as usize + self.pools.len() * Pool::VERTICES;
        let make = || Ok::<_, Infallible>(self.vertices());
        let Ok(vertices) = cache.get("meshes", &key("mesh", BUILDER_VERSION, self), count, make);
        Mesh::new(vertices, self.grids())
    }

    /// Returns the number of squares on a side of each grid, and whether it is a holdout.
    fn grids(&self) -> impl Iterator<Item = (u32, bool)> {
        let pools = self.pools.iter().map(|pool| (Pool::SQUARES as u32, pool.holdout));
        self.rocks.iter().map(|rock| (1 << rock.levels, rock.holdout)).chain(pools)
    }

    fn vertices(&self) -> Vec<Vertex> {
        let of_rocks: Vec<Vec<Vertex>> =
            self.rocks.par_iter().map(|rock| rock.vertices(self.origin)).collect();
        let vertices = &mut of_rocks.concat();
        let rocks: Vec<(&Rock, Range<usize>)> = self.rocks.iter().zip(self.ranges()).collect();
        let mut pools = Vec::new();
        for (i, pool) in self.pools.iter().enumerate() {
            let first = vertices.len();
            pool.add_vertices(i as u32 + 1, vertices);
            let own = first..vertices.len();
            let ground = shade::heights(&rocks, vertices, own.clone());
            pool.fill(&mut vertices[own.clone()], &ground, &self.water);
            pools.push(own);
        }
        let shaded = |amount: fn(&Rock) -> f32| {
            let rocks = rocks.iter().map(|(rock, own)| (amount(rock), own.clone()));
            let most = self.rocks.iter().map(amount).fold(0.0, f32::max);
            rocks.chain(pools.iter().map(|own| (most, own.clone()))).collect::<Vec<_>>()
        };
        shade::occlude(&rocks, &shaded(|rock| rock.occlusion), vertices);
        if let Some(to_sun) = self.sun {
            shade::shadow(&rocks, &shaded(|rock| rock.shadow), vertices, to_sun);
        }
        wet::wet(&rocks, vertices, &self.water, &self.pools);
        std::mem::take(vertices)
    }

    fn rock_vertices(&self) -> u64 {
        self.rocks.iter().map(Rock::vertex_count).sum()
    }

    /// Returns the range of each rock's vertices.
    fn ranges(&self) -> Vec<Range<usize>> {
        let mut first = 0;
        let range = |rock: &Rock| {
            let start = first;
            first += rock.vertex_count() as usize;
            start..first
        };
        self.rocks.iter().map(range).collect()
    }
}
