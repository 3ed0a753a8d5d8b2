//! Surroundings of the water: rock, pools, meshes of other programs, and one mesh of all.

mod bvh;
mod mesh;
pub mod paint;
pub mod pool;
mod rock;
mod shell_core;
mod shell_diffuse;
mod shell_shadows;
mod show;
pub mod tiles;
mod triangles;
mod vertex;
mod water_shade;

pub use mesh::{BUILDER_VERSION, Ground, Mesh, Triangles};
pub use pool::field::PoolField;
pub use pool::{MAX_POOLS, Pool, PoolWaves};
pub use rock::{
    MAX_LEVELS, Rock, stone, stone::StoneKind, veil::Veil, veil::WATER_COVER, wet::wet_albedo, wet::wetness,
};
pub use shell_core::opposite;
pub use shell_diffuse::{DiffuseKey, DiffuseOfShells};
pub use shell_shadows::{CASTER_BYTES, ShellShadows};
pub use show::Show;
pub use triangles::{MAX_ADDED, MeshShade, SHADE_BYTES, SHADE_VERSION, ShadeMemo, WaterFaces};
pub use vertex::Vertex;
pub use water_shade::{QuadShade, ShadedWater, WATER_SHADE_VERSION};
