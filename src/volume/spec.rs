//! §2 Input of the builder of water volumes.

use crate::curve::CurveShape;

/// Specification of a water volume. Equal specifications build equal bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaterSpec {
    /// nx, ny, nz, cells.
    pub size: [u32; 3],
    /// Columns (along x) of the jitter grid of curve starts on the face y = 0.
    pub across: u32,
    /// Rows (along z) of the jitter grid of curve starts on the face y = 0.
    pub deep: u32,
    /// Shape of the curves.
    pub shape: CurveShape,
    /// Bundles and strands.
    pub structure: Structure,
    /// Seed of all randomness in the volume.
    pub seed: u64,
    /// Scale α of the density, kept beside the cells and not in them.
    pub alpha: f32,
    /// k_d before noise is added.
    pub k_d: f32,
    /// k_s before noise is added.
    pub k_s: f32,
    /// Standard deviation of the noise of k_d and k_s.
    pub k_noise: f32,
}

/// Structure that the paper's curves and densities lack. With all values 0 (`Default`) the volume is the
/// paper's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Structure {
    /// Number of parent curves. With 0 every curve is independent.
    pub bundles: u32,
    /// Standard deviation of a curve's distance from its parent, in x and in z, cells.
    pub radius_cells: f32,
    /// Standard deviation of g of the parent curves, cells.
    pub wander_cells: f32,
    /// Relative standard deviation of a bundle's width along the flow.
    pub breathe: f32,
    /// Share of the curves that have no parent.
    pub loose: f32,
    /// Dependence of ρ on the strands, from ρ independent in every cell (0) to ρ carried by the strands (1).
    pub coherence: f32,
    /// Correlation length of ρ along a strand, as a fraction of the flow length ny.
    pub strand_length: f32,
    /// Dependence of ρ on the length of the strands in a cell, from none (0) to full (1).
    pub coverage: f32,
    /// Difference of k_d between ρ = 1 and ρ = 0.
    pub crest: f32,
    /// Whether each cell keeps the line of its strand ([`Cell::with_line`](super::Cell::with_line)).
    pub lines: bool,
}
