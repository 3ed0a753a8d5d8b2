//! §2 Parameters that a volume of water is built from.

use crate::curve::CurveShape;

/// Parameters of the water builder. Equal specs give equal bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaterSpec {
    /// nx, ny, nz.
    pub size: [u32; 3],
    /// Jitter grid on the face y = 0: columns in x.
    pub across: u32,
    /// Jitter grid on the face y = 0: rows in z.
    pub deep: u32,
    /// Shape of the curves.
    pub shape: CurveShape,
    /// Bundles and strands.
    pub structure: Structure,
    /// Seed of all randomness.
    pub seed: u64,
    /// Scale of ρ; the cells hold ρ/α.
    pub alpha: f32,
    /// Base of k_d.
    pub k_d: f32,
    /// Base of k_s.
    pub k_s: f32,
    /// Standard deviation of the noise of k.
    pub k_noise: f32,
}

/// Structure beyond the paper's curves. With all values 0 (`Default`) the volume is the paper's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Structure {
    /// Number of parent curves; 0: all curves are independent.
    pub bundles: u32,
    /// Standard deviation of the children's distance from their parent, in x and in z, cells.
    pub radius_cells: f32,
    /// Standard deviation of g of the parents, cells.
    pub wander_cells: f32,
    /// Relative standard deviation of a bundle's width along its length.
    pub breathe: f32,
    /// Fraction of the curves that have no parent.
    pub loose: f32,
    /// Blend from ρ independent in every cell (0) to ρ that follows the strands (1).
    pub coherence: f32,
    /// Correlation length of ρ along a strand, a fraction of the flow length.
    pub strand_length: f32,
    /// Blend from full ρ in every cell that a strand touches (0) to ρ by the length of the strands in it (1).
    pub coverage: f32,
    /// Increase of k_d from ρ = 0 to ρ = 1.
    pub crest: f32,
}
