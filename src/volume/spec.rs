//! §2 What a volume of water is built from.

use crate::curve::CurveShape;

/// Everything the water builder needs; equal specs give equal bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaterSpec {
    /// nx, ny, nz.
    pub size: [u32; 3],
    /// Jitter grid on the face y = 0: columns in x.
    pub across: u32,
    /// Jitter grid on the face y = 0: rows in z.
    pub deep: u32,
    /// The curves.
    pub shape: CurveShape,
    /// Bundles and strands.
    pub structure: Structure,
    /// Seed of all randomness.
    pub seed: u64,
    /// Scale of ρ; kept beside the cells, not in them.
    pub alpha: f32,
    /// Base of k_d.
    pub k_d: f32,
    /// Base of k_s.
    pub k_s: f32,
    /// Standard deviation of the noise of k.
    pub k_noise: f32,
}

/// What the paper's curves do not have; all 0 (`Default`) is the paper.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Structure {
    /// Parent curves; 0: every curve goes its own way.
    pub bundles: u32,
    /// Standard deviation of the children's distance from their parent, in x and in z, cells.
    pub radius_cells: f32,
    /// Standard deviation of g of the parents, cells.
    pub wander_cells: f32,
    /// Relative standard deviation of a bundle's width along its way.
    pub breathe: f32,
    /// Share of the curves that stay without a parent.
    pub loose: f32,
    /// From ρ independent in every cell (0) to ρ of the strands (1).
    pub coherence: f32,
    /// Correlation length of ρ along a strand, a fraction of the flow length.
    pub strand_length: f32,
    /// From ρ whole in every cell a strand touches (0) to ρ by the length of the strands in it (1).
    pub coverage: f32,
    /// k_d grows by this from ρ = 0 to ρ = 1.
    pub crest: f32,
}
