//! Opaque geometry as triangles: rocks, pools and meshes of other programs, with the light that they block
//! from one another.

use std::convert::Infallible;
use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::bvh::Bvh;
use super::paint::{Painting, Paints, texture};
use super::pool::Pool;
use super::pool::field::{FIELD_VERSION, PoolField};
use super::rock::shade::{self, SkyShade, SunShade};
use super::rock::stone::Stone;
use super::rock::veil::Veils;
use super::rock::{Rock, wet};
use super::tiles::{self, Tile};
use super::triangles::{MeshShade, ShadeMemo, WaterFaces, kinds};
use super::water_shade::{QuadShade, ShadedWater, WATER_SHADE_VERSION};
use crate::place::Vertex;
use crate::util::cache::{Cache, key};

/// Opaque triangles of a mesh that another program made.
#[derive(Clone)]
pub struct Triangles {
    /// Three vertices for each triangle, counter-clockwise as seen from the side that their normals are on.
    pub vertices: Arc<Vec<Vertex>>,
    /// Whether a picture with an alpha channel has a hole in their place.
    pub holdout: bool,
    /// Strengths of their shade and wetness.
    pub shade: MeshShade,
    /// Their textures and roughness; without it they are shaded as rock is.
    pub painting: Option<Arc<Painting>>,
}

/// Opaque geometry: square grids of vertices, first of the rocks and then of the pools, and triangles of
/// other meshes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices, row by row. They are shared, so that the owner of a copy on the GPU can recognise them.
    pub vertices: Arc<Vec<Vertex>>,
    /// Tiles of the grids, and those of triangles.
    pub tiles: Arc<Vec<Tile>>,
    /// Paints of tiles.
    pub paints: Arc<Paints>,
    /// Stones of tiles.
    pub stones: Arc<Vec<Stone>>,
    /// Waves and foam of each pool that has a field of them, by the pool's number; empty without pools.
    pub fields: Arc<Vec<Option<PoolField>>>,
    /// Shade on each quad of falling water; empty where there is none.
    pub on_water: Arc<Vec<QuadShade>>,
}

impl Mesh {
    /// Makes a mesh of consecutive grids. `grids` are the squares on a side of each, powers of two, and
    /// whether it is a holdout.
    pub fn new(vertices: Vec<Vertex>, grids: impl IntoIterator<Item = (u32, bool)>) -> Mesh {
        let tiles = tiles::cut(&vertices, grids.into_iter());
        Mesh { vertices: Arc::new(vertices), tiles: Arc::new(tiles), ..Mesh::default() }
    }

    /// Gives the tiles of rocks their stones. `rocks` are the rocks with the ranges of their vertices; points
    /// are measured from `origin`.
    fn with_stones<'a>(
        mut self,
        rocks: impl IntoIterator<Item = (&'a Rock, Range<usize>)>,
        origin: DVec3,
    ) -> Mesh {
        let mut stones = Vec::new();
        for (rock, own) in rocks {
            let Some(stone) = Stone::new(rock, origin) else { continue };
            stones.push(stone);
            let tiles = Arc::make_mut(&mut self.tiles).iter_mut();
            for tile in tiles.filter(|tile| own.contains(&(tile.first as usize))) {
                tile.stone = stones.len() as u32;
            }
        }
        self.stones = Arc::new(stones);
        self
    }

    /// Adds the triangles of other meshes.
    pub fn with_triangles(mut self, soups: &[Triangles]) -> Mesh {
        if soups.is_empty() {
            return self;
        }
        let mut vertices = Arc::unwrap_or_clone(std::mem::take(&mut self.vertices));
        let mut tiles = Arc::unwrap_or_clone(std::mem::take(&mut self.tiles));
        let paintings = soups.iter().filter_map(|own| own.painting.as_deref());
        let (paints, firsts) = Paints::join(paintings, texture::MOST_BYTES);
        let mut firsts = firsts.into_iter();
        for Triangles { vertices: own, holdout, painting, .. } in soups {
            let first = vertices.len();
            vertices.extend_from_slice(own);
            let Some(painting) = painting else {
                tiles.extend(tiles::cut_triangles(&vertices, first as u32, *holdout));
                continue;
            };
            let [paint, coordinate] = firsts.next().expect("one for each painting");
            for (triangles, start, finish) in painting.parts() {
                let [first, end] = [triangles.start, triangles.end].map(|t| first + 3 * t);
                let slots = finish.map_or(0, |finish| painting.finishes[finish].slots);
                let cut = tiles::cut_triangles(&vertices[..end], first as u32, *holdout);
                tiles.extend(cut.map(|mut tile| {
                    tile.paint = finish.map_or(0, |finish| (paint + finish) as u32 + 1);
                    tile.coordinates = (coordinate + start) as u32 + (tile.first - first as u32) * slots;
                    tile
                }));
            }
        }
        Mesh { vertices: Arc::new(vertices), tiles: Arc::new(tiles), paints: Arc::new(paints), ..self }
    }

    /// Returns the field of waves and foam of a pool, given by its index, if it has one.
    pub fn field(&self, pool: usize) -> Option<&PoolField> {
        self.fields.get(pool)?.as_ref()
    }

    /// Returns the first vertex of each tile of triangles, in order, and the mean colour of its texture.
    pub fn tints(&self) -> Vec<(u32, Vec3)> {
        let is_grid = self.tiles.partition_point(Tile::is_grid);
        let tint = |tile: &Tile| {
            let paint = tile.paint.checked_sub(1).map(|paint| &self.paints.all[paint as usize]);
            (tile.first, paint.map_or(Vec3::ONE, |paint| self.paints.tint(paint)))
        };
        self.tiles[is_grid..].iter().map(tint).collect()
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
pub const BUILDER_VERSION: u32 = 2;

/// Everything that determines the opaque mesh of a scene: equal grounds have equal meshes.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Rocks, in the order of their vertices.
    pub rocks: Vec<Rock>,
    /// Pools; their vertices follow those of the rocks.
    pub pools: Vec<Pool>,
    /// Corners of the quads that wet rocks and meshes and fall into pools, metres; empty where nothing can be
    /// wet.
    pub water: Vec<[Vec3; 4]>,
    /// Triangles of other programs' meshes; their vertices follow those of the pools.
    pub triangles: Vec<Triangles>,
    /// Triangles around shells of water; empty where nothing can be wet.
    pub water_faces: WaterFaces,
    /// Falling water that is shaded.
    pub shaded_water: ShadedWater,
    /// Unit vector to the light that makes rocks and meshes cast shadows; `None` where none is shaded.
    pub sun: Option<Vec3>,
    /// The place in the world from which positions are measured, metres. Beds of rock are fixed to the world.
    pub origin: DVec3,
}

impl Ground {
    /// Builds the mesh. `memo` holds parts of what was built last.
    pub fn mesh(&self, memo: &ShadeMemo) -> Mesh {
        let mut mesh = self.with_meshes(self.grid_mesh(self.vertices(memo)), memo, None);
        let field = |pool: &Pool| PoolField::new(pool, &mesh, &self.water, self.origin);
        mesh.fields = Arc::new(self.pools.iter().map(field).collect());
        self.with_water(mesh, memo, None)
    }

    /// Returns [`Ground::mesh`], from `cache` where it is stored there.
    pub fn cached_mesh(&self, memo: &ShadeMemo, cache: &Cache) -> Mesh {
        let count = self.rock_vertices() as usize + self.pools.len() * Pool::VERTICES;
        let make = || Ok::<_, Infallible>(self.vertices(memo));
        let grids = || {
            let key = key("mesh", BUILDER_VERSION, &self.of_grids());
            let Ok(vertices) = cache.get("meshes", &key, count, make);
            self.with_meshes(self.grid_mesh(vertices), memo, Some(cache))
        };
        let field_key = |pool: &Pool| {
            key("pool", FIELD_VERSION, &(&self.rocks, &self.triangles, pool, &self.water, self.origin))
        };
        let stored = |pool: &Pool| PoolField::stored(pool, cache, &field_key(pool));
        // A field needs the mesh only where it has to be made.
        let (mut mesh, stored) =
            rayon::join(grids, || self.pools.iter().map(stored).collect::<Vec<Option<PoolField>>>());
        let field = |(pool, stored): (&Pool, Option<PoolField>)| {
            let made = || PoolField::cached(pool, &mesh, &self.water, self.origin, (cache, &field_key(pool)));
            stored.or_else(made)
        };
        mesh.fields = Arc::new(self.pools.iter().zip(stored).map(field).collect());
        self.with_water(mesh, memo, Some(cache))
    }

    /// Makes the mesh of rocks and pools of their vertices.
    fn grid_mesh(&self, vertices: Vec<Vertex>) -> Mesh {
        Mesh::new(vertices, self.grids()).with_stones(self.rocks.iter().zip(self.ranges()), self.origin)
    }

    /// Adds the shade on falling water to the mesh, from `cache` where it is stored there.
    fn with_water(&self, mut mesh: Mesh, memo: &ShadeMemo, cache: Option<&Cache>) -> Mesh {
        let water = &self.shaded_water;
        if water.veils.is_empty() {
            return mesh;
        }
        let rocks: Vec<(&Rock, Range<usize>)> = self.rocks.iter().zip(self.ranges()).collect();
        let make = || {
            let has =
                |amount: fn(&MeshShade) -> f32| self.triangles.iter().any(|own| amount(&own.shade) > 0.0);
            let blocks = [has(|shade| shade.occlusion), has(|shade| shade.shadow)];
            let casters = (blocks != [false; 2]).then(|| self.casters(memo, &mesh.vertices));
            let [of_sky, of_sun] = self.blockers(casters.as_deref(), blocks);
            let sky = SkyShade::new(&rocks, &mesh.vertices, of_sky.as_ref());
            let sun = self
                .sun
                .and_then(|to_sun| SunShade::new(&rocks, &mesh.vertices, to_sun, of_sun.as_ref(), None));
            Ok::<_, Infallible>(water.shades(sky.as_ref(), sun.as_ref()))
        };
        let Ok(shades) = match cache {
            Some(cache) => {
                let key = key("shade on water", WATER_SHADE_VERSION, self);
                cache.get("meshes", &key, water.veils.len(), make)
            }
            None => make(),
        };
        mesh.on_water = Arc::new(shades);
        mesh
    }

    /// Returns whether meshes block the surroundings' light, and the sun's, where `is_asked`.
    fn blockers<'a>(
        &self,
        casters: Option<&'a Bvh>,
        is_asked: [bool; 2],
    ) -> [Option<impl Fn(Vec3, Vec3) -> bool + Sync + use<'a>>; 2] {
        let of = |kinds: u8, is_asked: bool| {
            let bvh = casters.filter(|_| is_asked)?;
            Some(move |from: Vec3, direction: Vec3| bvh.is_hit(from, direction, kinds))
        };
        [of(kinds::MESH_OCCLUSION, is_asked[0]), of(kinds::MESH_SHADOW, is_asked[1])]
    }

    /// Falling water as the sun sees it, if it casts a shadow.
    pub(super) fn veils(&self) -> Option<Veils> {
        Veils::new(&self.shaded_water, self.sun?)
    }

    /// Everything that determines the vertices of rocks and pools.
    fn of_grids(&self) -> Ground {
        let [blocks_sky, blocks_sun] = self.meshes_that_shade();
        let mut own = self.clone();
        if !blocks_sky && !blocks_sun {
            own.triangles.clear();
        }
        if !self.rocks.iter().any(|rock| rock.wet > 0.0) {
            own.water_faces = WaterFaces::default();
        }
        own
    }

    /// Whether meshes block light that rocks and pools would get: that of the surroundings, and the sun's.
    fn meshes_that_shade(&self) -> [bool; 2] {
        let of = |rock: fn(&Rock) -> f32, mesh: fn(&MeshShade) -> f32| {
            let takes = !self.pools.is_empty() || self.rocks.iter().any(|own| rock(own) > 0.0);
            takes && self.triangles.iter().any(|own| mesh(&own.shade) > 0.0)
        };
        [of(|rock| rock.occlusion, |mesh| mesh.occlusion), of(|rock| rock.shadow, |mesh| mesh.shadow)]
    }

    /// Returns the number of squares on a side of each grid, and whether it is a holdout.
    fn grids(&self) -> impl Iterator<Item = (u32, bool)> {
        let pools = self.pools.iter().map(|pool| (Pool::SQUARES as u32, pool.holdout));
        self.rocks.iter().map(|rock| (1 << rock.levels, rock.holdout)).chain(pools)
    }

    fn vertices(&self, memo: &ShadeMemo) -> Vec<Vertex> {
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
        let shaded = |of_rock: fn(&Rock) -> f32, of_mesh: fn(&MeshShade) -> f32| {
            let own = rocks.iter().map(|(rock, own)| (of_rock(rock), own.clone()));
            let amounts = self.rocks.iter().map(of_rock);
            let most =
                amounts.chain(self.triangles.iter().map(|own| of_mesh(&own.shade))).fold(0.0, f32::max);
            own.chain(pools.iter().map(|own| (most, own.clone()))).collect::<Vec<_>>()
        };
        let [blocks_sky, blocks_sun] = self.meshes_that_shade();
        let casters = (blocks_sky || blocks_sun).then(|| self.casters(memo, vertices));
        let [of_sky, of_sun] = self.blockers(casters.as_deref(), [blocks_sky, blocks_sun]);
        if let Some(sky) = SkyShade::new(&rocks, vertices, of_sky.as_ref()) {
            sky.occlude(&shaded(|rock| rock.occlusion, |mesh| mesh.occlusion), vertices);
        }
        let veils = self.veils();
        if let Some(to_sun) = self.sun
            && let Some(sun) = SunShade::new(&rocks, vertices, to_sun, of_sun.as_ref(), veils.as_ref())
        {
            sun.shadow(&shaded(|rock| rock.shadow, |mesh| mesh.shadow), vertices);
        }
        wet::wet(&rocks, vertices, &self.water, &self.water_faces, &self.pools);
        std::mem::take(vertices)
    }

    fn rock_vertices(&self) -> u64 {
        self.rocks.iter().map(Rock::vertex_count).sum()
    }

    /// Returns the range of each rock's vertices.
    pub(super) fn ranges(&self) -> Vec<Range<usize>> {
        let mut first = 0;
        let range = |rock: &Rock| {
            let start = first;
            first += rock.vertex_count() as usize;
            start..first
        };
        self.rocks.iter().map(range).collect()
    }
}
