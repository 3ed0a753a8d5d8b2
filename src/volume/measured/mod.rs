//! §2 Volumes measured in simulations: density and velocity of grids become ρ, v and k of cells.
//!
//! The texture's axes are those of the grid's index, so nothing is turned: rotation and shear of the grid's
//! transform are those of the box in which the volume stands. A voxel is a box around its sample. Where there
//! are fewer cells than voxels, each cell takes the share of every voxel that overlaps it, so ∫ρ stays.
//!
//! | element | value |
//! |---|---|
//! | ρ | `rho_scale` × density, or 1 − e^(−`rho_scale` × density × edge of a cell) |
//! | v | mean velocity, weighted by the density, in the axes of the cells |
//! | k_d, k_s | even, or between two values by speed, vorticity or another grid, or those of two grids, weighted by the density |
//!
//! The cells hold ρ/α in 65535ths, where α is the largest ρ. So ρ is exact to α/131070, and a cell with less
//! is empty. v is in cells, so that J·v is parallel to the velocity whatever the shape of the voxels.

mod build;
mod field;
mod find;
mod level_set;
mod overlap;
mod strands;

use std::path::PathBuf;

use glam::{DAffine3, DMat3, DVec3};

pub use build::{Measured, build_measured};
pub use find::{Wanted, find_measured};

use crate::grid::Bounds;
use crate::util::words::words;

/// How ρ follows from the density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RhoRule {
    /// In proportion.
    #[default]
    Linear,
    /// Share of light that an edge of a cell takes: 1 − e^(−κ·density·edge).
    Opacity,
}

words! { RhoRule { Linear => "linear", Opacity => "opacity" } }

/// Place of the velocity's samples among the voxels of the density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VelocityAt {
    /// On the lower faces if the file says that the grid is staggered, and at the centres otherwise.
    #[default]
    Auto,
    /// At the centres of voxels.
    Centre,
    /// At the lower corners of voxels.
    Node,
    /// Each component in the middle of the lower face across its axis.
    Staggered,
}

words! { VelocityAt { Auto => "auto", Centre => "centre", Node => "node", Staggered => "staggered" } }

/// Axis of a file that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// y, as in scenes.
    #[default]
    Y,
    /// z: the file's y is the scene's −z.
    Z,
}

words! { Up { Y => "y", Z => "z" } }

impl Up {
    /// Turn from the axes of the file to those of the scene.
    pub fn scene_from_file(self) -> DMat3 {
        match self {
            Up::Y => DMat3::IDENTITY,
            Up::Z => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
        }
    }
}

/// Unit of the distances in a level set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LevelSetUnit {
    /// Voxels if the distances grow by about 1 from voxel to voxel, and metres otherwise.
    #[default]
    Auto,
    /// Metres of the file's transform.
    Metres,
    /// Edges of a voxel.
    Voxels,
}

words! { LevelSetUnit { Auto => "auto", Metres => "metres", Voxels => "voxels" } }

/// What k_d and k_s follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReflectBy {
    /// Nothing: all cells have the same.
    #[default]
    Even,
    /// Speed.
    Speed,
    /// Length of the curl of the velocity.
    Vorticity,
    /// A grid of its own, such as foam or age.
    Grid,
    /// The grids `kd` and `ks`, which hold k_d and k_s themselves.
    Stored,
}

words! {
    ReflectBy {
        Even => "even",
        Speed => "speed",
        Vorticity => "vorticity",
        Grid => "grid",
        Stored => "stored",
    }
}

/// Names of the grids that hold the velocity.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum VelocityNames {
    /// No velocity.
    #[default]
    None,
    /// One grid of vectors.
    Vector(String),
    /// A grid for each component.
    Components([String; 3]),
}

/// Recipe of a measured volume. Its grids were found in the file, but not read.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredSpec {
    /// File of the grids.
    pub path: PathBuf,
    /// Name of the density's grid.
    pub density: String,
    /// Names of the velocity's grids.
    pub velocity: VelocityNames,
    /// Name of the grid that k follows, with [`ReflectBy::Grid`], or of that of k_d, with
    /// [`ReflectBy::Stored`].
    pub second: Option<String>,
    /// Name of the grid of k_s, with [`ReflectBy::Stored`].
    pub specular: Option<String>,
    /// Voxels that the volume covers.
    pub bounds: Bounds,
    /// Transform from a voxel's index to its centre in the world of the file, metres.
    pub to_world: DAffine3,
    /// Turn and shift from the world of the file to that of the scene.
    pub scene_from_file: DAffine3,
    /// Unit of the density's grid if it is a level set.
    pub level_set_unit: LevelSetUnit,
    /// Metres per second of a velocity of 1.
    pub velocity_scale: f32,
    /// Number of cells along x, y and z.
    pub size: [u32; 3],
    /// How ρ follows from the density.
    pub rho: RhoRule,
    /// ρ per density; with [`RhoRule::Opacity`], extinction per density, 1/m.
    pub rho_scale: f32,
    /// Place of the velocity's samples.
    pub velocity_at: VelocityAt,
    /// What k follows.
    pub reflect: ReflectBy,
    /// Values of that between which k changes.
    pub reflect_range: [f32; 2],
    /// k_d and k_s at the lower value, or everywhere, and at the upper value.
    pub k: [[f32; 2]; 2],
    /// Factor on ρ.
    pub alpha: f32,
    /// Strands along the flow. `None` for cells with the even density of their voxels.
    pub strands: Option<StrandSpec>,
}

/// Strands along the flow, which the density draws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrandSpec {
    /// Number of strands.
    pub count: u32,
    /// Complexity constant h of eq. (1).
    pub h: f32,
    /// Standard deviation of g, as a share of a strand's length.
    pub amplitude: f32,
    /// [`Structure::coherence`](crate::volume::Structure::coherence).
    pub coherence: f32,
    /// [`Structure::strand_length`](crate::volume::Structure::strand_length), as a share of a strand's length.
    pub strand_length: f32,
    /// [`Structure::coverage`](crate::volume::Structure::coverage).
    pub coverage: f32,
    /// Standard deviation of the noise of k_d and k_s.
    pub k_noise: f32,
    /// Seed of all randomness.
    pub seed: u64,
}

impl MeasuredSpec {
    /// Transform from texture coordinates, 0 to 1 along each axis, to the world of the scene, metres. A voxel
    /// reaches half an index to either side of its sample.
    pub fn world_from_texture(&self) -> DAffine3 {
        self.scene_from_file * self.file_from_texture()
    }

    /// Transform from texture coordinates to the world of the file.
    fn file_from_texture(&self) -> DAffine3 {
        let low = DVec3::from_array(self.bounds.min.map(f64::from)) - 0.5;
        let voxels = DVec3::from_array(self.bounds.size().map(|n| n as f64));
        self.to_world * DAffine3::from_translation(low) * DAffine3::from_scale(voxels)
    }

    /// Metres of the file's world per cell along x, y and z, as columns.
    fn world_from_cell(&self) -> DMat3 {
        let cells = DVec3::from_array(self.size.map(f64::from));
        self.file_from_texture().matrix3 * DMat3::from_diagonal(1.0 / cells)
    }

    /// ρ of a cell whose mean density is `mass`, before the factor of the scene.
    fn rho_of(&self, mass: f64) -> f64 {
        let scaled = f64::from(self.rho_scale) * mass;
        match self.rho {
            RhoRule::Linear => scaled,
            RhoRule::Opacity => -(-scaled * self.edge()).exp_m1(),
        }
    }

    /// k_d and k_s of a cell where what they follow has this value.
    fn reflected(&self, value: f64) -> [f32; 2] {
        let [low, high] = self.reflect_range.map(f64::from);
        let share = match self.reflect {
            ReflectBy::Even | ReflectBy::Stored => 0.0,
            _ if high > low => ((value - low) / (high - low)).clamp(0.0, 1.0),
            _ => f64::from(u8::from(value >= low)),
        } as f32;
        let [from, to] = self.k;
        [0, 1].map(|i| from[i] + (to[i] - from[i]) * share)
    }

    /// Edge of the cube with the volume of a cell, metres.
    fn edge(&self) -> f64 {
        self.world_from_cell().determinant().abs().cbrt()
    }
}
