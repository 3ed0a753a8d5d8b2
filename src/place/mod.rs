//! Surroundings of the water: rock, pools, and the mesh of both.

mod mesh;
mod pool;
mod rock;
mod show;
pub mod tiles;
mod vertex;

pub use mesh::{BUILDER_VERSION, Ground, Mesh, Triangles};
pub use pool::{MAX_POOLS, Pool};
pub use rock::{MAX_LEVELS, Rock, wet::wet_albedo, wet::wetness};
pub use show::Show;
pub use vertex::Vertex;
