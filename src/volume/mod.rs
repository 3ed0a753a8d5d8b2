//! §2 The volume texture: density ρ, flow direction v and reflection coefficients k in every cell.
//!
//! `set` in `water.rs` gives every cell its ρ and k, `flow.rs` gives it v, and `cell.rs` packs them. What a
//! sheet makes of ρ later, by erosion or mist, is in `src/trace/matter.rs`.

mod bricks;
mod bundle;
mod cell;
mod cells;
mod cloth;
mod field;
mod file;
mod flow;
mod fur;
mod grains;
mod grids;
mod hair;
mod leaps;
mod matter;
mod measured;
mod mountain;
mod pyramid;
mod ripple;
mod skin;
mod spec;
mod spots;
mod storage;
mod strands;
mod threads;
mod water;

pub use bricks::{BRICK, Bricks, grid as brick_grid};
pub use bundle::curve_points;
pub use cell::{Cell, LINE_STEPS, V_SCALE};
pub use cells::Cells;
pub use cloth::{ClothSpec, Weave, WeaveName};
pub use file::{ReadOptions, check_npz, has_reflection, read_npz, write_npz};
pub use fur::FurSpec;
pub use grains::GrainsSpec;
pub use hair::HairSpec;
pub use leaps::{box_exponents, empty_share, with_boxes, worth_leaping};
pub use matter::Matter;
pub use measured::{
    LevelSetUnit, Measured, MeasuredSpec, ReflectBy, RhoRule, StrandSpec, Up, VelocityAt, VelocityNames,
    Wanted, build_measured, find_measured,
};
pub use mountain::MountainSpec;
pub use pyramid::{
    Leaps, LevelAtlas, LevelSets, Levels, LevelsCache, Moments, Pyramid, PyramidSpec, coarse_levels,
    level_count, level_size, levels_of, stored_levels,
};
pub use ripple::Ripple;
pub use skin::SkinSpec;
pub use spec::{Structure, WaterSpec};
pub use storage::{Storage, StorageChoice, check_budget, dense_bytes, sparse_bytes, storage_of};
pub use strands::StrandsSpec;
pub use water::{
    BUILDER_VERSION, build_sparse_water, build_water, expected_cells, kept_water, set_density_and_reflection,
};

/// Volume texture of nx × ny × nz packed cells. x varies fastest, then y, then z.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeTexture {
    /// Number of cells along x (across the flow), y (along the flow) and z (into the surface).
    pub size: [u32; 3],
    /// Scale α of the density, 0 to 1. The cells hold ρ/α.
    pub alpha: f32,
    /// The nx·ny·nz cells. They are shared, so a copy with another α costs nothing.
    pub cells: Cells,
}

/// A single volume stands for all volumes of a scene.
impl AsRef<[VolumeTexture]> for VolumeTexture {
    fn as_ref(&self) -> &[VolumeTexture] {
        std::slice::from_ref(self)
    }
}

impl VolumeTexture {
    /// Linear index of the cell at x, y, z of the tile.
    #[inline]
    pub fn index(&self, x: u32, y: u32, z: u32) -> usize {
        (z as usize * self.size[1] as usize + y as usize) * self.size[0] as usize + x as usize
    }

    /// The cell at x, y, z of the tile. Every step of every walk calls it, so the choice is not left to the
    /// compiler.
    #[inline(always)]
    pub fn cell(&self, x: u32, y: u32, z: u32) -> Cell {
        match &self.cells {
            Cells::Dense(cells) => cells[self.index(x, y, z)],
            Cells::Sparse(bricks) => *bricks.at(x, y, z),
        }
    }

    /// Iterates over the cells with a direction, in the order in which they are stored.
    pub fn flow_cells(&self) -> impl Iterator<Item = &Cell> {
        self.cells.stored().iter().filter(|cell| cell.has_direction())
    }

    /// Whether the cells are stored in bricks.
    pub fn is_sparse(&self) -> bool {
        self.cells.bricks().is_some()
    }

    /// Sums the ρ codes of each layer of cells, from z = 0 on.
    pub fn layer_codes(&self) -> Vec<u64> {
        self.cells.layer_codes(self.size[0] as usize * self.size[1] as usize)
    }

    /// Sums the ρ codes of each layer of cells by the codes of k_s, which may be places on a ramp of colours,
    /// from z = 0 on.
    pub fn layer_codes_by_k_s(&self) -> Vec<[u64; 256]> {
        self.cells.layer_codes_by_k_s(self.size[0] as usize * self.size[1] as usize)
    }

    /// CRC-32 of size, α and cells. Equal volumes have equal checksums, whether built or read.
    pub fn checksum(&self) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(bytemuck::bytes_of(&self.size));
        hasher.update(bytemuck::bytes_of(&self.alpha));
        hasher.combine(&self.cells.checksum());
        hasher.finalize()
    }

    /// Counts the flow cells by ρ, with `bins` equal steps between 0 and α (at least one).
    pub fn rho_histogram(&self, bins: usize) -> RhoHistogram {
        let bins = bins.max(1);
        let mut h = RhoHistogram { at_zero: 0, between: vec![0; bins], at_alpha: 0 };
        for cell in self.flow_cells() {
            match cell.rho_code() as usize {
                0 => h.at_zero += 1,
                0xffff => h.at_alpha += 1,
                code => h.between[(code - 1) * bins / 0xfffe] += 1,
            }
        }
        h
    }

    /// Computes the figures that `taki volume info` prints.
    pub fn statistics(&self) -> Statistics {
        let mut s = Statistics { size: self.size, alpha: self.alpha, ..Default::default() };
        let (mut rho, mut k_d, mut k_s) = (0.0f64, 0.0f64, 0.0f64);
        let (mut at_zero, mut at_alpha) = (0u64, 0u64);
        let mut v = glam::DVec3::ZERO;
        for cell in self.flow_cells() {
            s.flow_cells += 1;
            s.occupied_cells += u64::from(cell.rho_code() > 0);
            at_zero += u64::from(cell.rho_code() == 0);
            at_alpha += u64::from(cell.rho_code() == 0xffff);
            rho += (cell.rho() * self.alpha) as f64;
            let k = cell.k();
            k_d += k.0 as f64;
            k_s += k.1 as f64;
            v += cell.v().as_dvec3();
        }
        s.cells = self.cells.len() as u64;
        s.bytes = self.cells.bytes();
        s.stored_cells = self.cells.stored().len() as u64;
        if s.flow_cells > 0 {
            let n = s.flow_cells as f64;
            s.rho_mean = rho / n;
            s.rho_share_at_zero = at_zero as f64 / n;
            s.rho_share_at_alpha = at_alpha as f64 / n;
            s.k_d_mean = k_d / n;
            s.k_s_mean = k_s / n;
            s.v_mean = (v / n).to_array();
        }
        s
    }
}

/// Number of flow cells by ρ. A built volume clamps ρ, so many cells lie exactly at 0 and at α and are
/// counted apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RhoHistogram {
    /// Number of cells with ρ = 0.
    pub at_zero: u64,
    /// Number of cells with 0 < ρ < α, in equal steps of ρ.
    pub between: Vec<u64>,
    /// Number of cells with ρ = α.
    pub at_alpha: u64,
}

impl RhoHistogram {
    /// Number of all flow cells.
    pub fn total(&self) -> u64 {
        self.at_zero + self.between.iter().sum::<u64>() + self.at_alpha
    }
}

/// Figures of a volume texture. Means and shares are over the flow cells, the cells with a direction.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Statistics {
    /// nx, ny, nz.
    pub size: [u32; 3],
    /// Scale α of the density.
    pub alpha: f32,
    /// Number of cells, nx·ny·nz.
    pub cells: u64,
    /// Number of cells with a direction.
    pub flow_cells: u64,
    /// Number of cells with ρ > 0.
    pub occupied_cells: u64,
    /// Mean of ρ, α included; α/2 in theory.
    pub rho_mean: f64,
    /// Share of cells with ρ = 0; 0.3085 in theory.
    pub rho_share_at_zero: f64,
    /// Share of cells with ρ = α; 0.3085 in theory.
    pub rho_share_at_alpha: f64,
    /// Mean of k_d.
    pub k_d_mean: f64,
    /// Mean of k_s.
    pub k_s_mean: f64,
    /// Mean of v, not a unit vector.
    pub v_mean: [f64; 3],
    /// Number of cells that are stored: all of them, except in sparse storage.
    pub stored_cells: u64,
    /// Size of the stored cells and, in sparse storage, of the bricks' masks and bases, bytes.
    pub bytes: u64,
}
