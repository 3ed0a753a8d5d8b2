//! Opaque geometry as triangles: rocks and pools, and the light that they take from one another.

use std::convert::Infallible;
use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::pool::Pool;
use super::rock::{Rock, shade, wet};
use super::tiles::{self, Tile};
use crate::place::Vertex;
use crate::util::cache::{Cache, key};

/// Opaque geometry: square grids of vertices, those of rocks and then those of pools.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices row by row, shared: who keeps them on a device knows them again.
    pub vertices: Arc<Vec<Vertex>>,
    /// The grids' tiles.
    pub tiles: Arc<Vec<Tile>>,
}

impl Mesh {
    /// Grids one after the other with so many squares a side, powers of two.
    pub fn new(vertices: Vec<Vertex>, squares: impl IntoIterator<Item = u32>) -> Mesh {
        let tiles = tiles::cut(&vertices, squares.into_iter());
        Mesh { vertices: Arc::new(vertices), tiles: Arc::new(tiles) }
    }

    /// All triangles, as three numbers of vertices each; with these steps of the tiles.
    pub fn triangles(&self, steps: &[u32]) -> Vec<[u32; 3]> {
        let mut out = Vec::new();
        for (i, tile) in self.tiles.iter().enumerate() {
            let corners = tiles::triangles(tile.side, steps[i], tiles::coarser(&self.tiles, steps, i));
            let (triangles, _) = corners.as_chunks::<3>();
            out.extend(triangles.iter().map(|t| t.map(|corner| tile.vertex(tiles::place(corner)))));
        }
        out
    }
}

/// Version of the mesh's builder: part of the key of meshes on disk. Raise it with every change of the
/// vertices that a [`Ground`] gives; a test compares their checksums.
pub const BUILDER_VERSION: u32 = 1;

/// All that the opaque mesh of a scene follows from: equal grounds have equal meshes.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// The rocks, in the order of their vertices.
    pub rocks: Vec<Rock>,
    /// The pools, whose vertices follow.
    pub pools: Vec<Pool>,
    /// Corners of the quads that make rock wet and fall into pools; none where nothing can be wet.
    pub water: Vec<[Vec3; 4]>,
    /// Unit vector to the light that rock shades rock from; none where no rock is shaded.
    pub sun: Option<Vec3>,
}

impl Ground {
    /// The mesh of all.
    pub fn mesh(&self) -> Mesh {
        Mesh::new(self.vertices(), self.squares())
    }

    /// As [`Ground::mesh`], or from `cache`.
    pub fn kept_mesh(&self, cache: &Cache) -> Mesh {
        let count = self.rock_vertices() as usize + self.pools.len() * Pool::VERTICES;
        let make = || Ok::<_, Infallible>(self.vertices());
        let Ok(vertices) = cache.get("meshes", &key("mesh", BUILDER_VERSION, self), count, make);
        Mesh::new(vertices, self.squares())
    }

    /// On a side of each grid.
    fn squares(&self) -> impl Iterator<Item = u32> {
        let pools = self.pools.iter().map(|_| Pool::SQUARES as u32);
        self.rocks.iter().map(|rock| 1 << rock.levels).chain(pools)
    }

    fn vertices(&self) -> Vec<Vertex> {
        let made: Vec<Vec<Vertex>> = self.rocks.par_iter().map(Rock::vertices).collect();
        let vertices = &mut made.concat();
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

    /// Where each rock's vertices are.
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
