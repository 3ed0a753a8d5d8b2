//! §4 Settings of the trace: attenuation, limits, prefilter and lookup.

use crate::util::words::words;

/// Settings of the walk that view rays take through the volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trace {
    /// Optical depth τ_k of a cell.
    pub attenuation: Attenuation,
    /// Maximum number of cells that one ray visits.
    pub max_cells: u32,
    /// Transmittance below which a ray ends, 0 to 1; at 0 no ray ends early.
    pub early_end: f32,
    /// Maximum number of sheets that one ray passes through.
    pub layers: u32,
    /// Filter for distant water: whether rays walk coarser levels of the volume.
    pub filter: Prefilter,
    /// Reconstruction of a cell's values.
    pub lookup: Lookup,
}

/// Filter against aliasing where one pixel covers many cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prefilter {
    /// No filter: every ray walks the volume's own cells.
    None,
    /// Coarser levels of the volume; a ray blends the two nearest to the pixel's footprint.
    Pyramid,
}

words! { Prefilter { None => "none", Pyramid => "pyramid" } }

/// Reconstruction of the values that a ray reads in a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lookup {
    /// The cell's own values.
    Nearest,
    /// Trilinear interpolation between eight cell centres, at the midpoint of the ray's segment in the cell.
    Trilinear,
    /// The cell's own values; where a pixel sees less than a cell, the strands' lines ([`super::lines`]).
    Strand,
}

words! { Lookup { Nearest => "nearest", Trilinear => "trilinear", Strand => "strand" } }

/// Optical depth τ_k of a cell with density ρ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Attenuation {
    /// τ_k = σ·ρ·Δs, with Δs the metres of the ray inside the cell.
    PathLength {
        /// Extinction at ρ = 1, 1/m.
        sigma: f32,
    },
    /// τ_k = τ·ρ, whatever the length of the ray inside the cell.
    PerCell {
        /// Optical depth at ρ = 1.
        tau: f32,
    },
}

/// Form of an [`Attenuation`], without its coefficient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttenuationKind {
    /// [`Attenuation::PathLength`].
    PathLength,
    /// [`Attenuation::PerCell`].
    PerCell,
}

words! { AttenuationKind { PathLength => "path-length", PerCell => "per-cell" } }

impl Attenuation {
    /// Returns the form without the coefficient.
    pub fn kind(&self) -> AttenuationKind {
        match self {
            Attenuation::PathLength { .. } => AttenuationKind::PathLength,
            Attenuation::PerCell { .. } => AttenuationKind::PerCell,
        }
    }
}

/// Optical depth in bits (−log₂ T) per unit of a cell's ρ code, and per metre with path-length attenuation.
/// In this unit the walk needs one product and one `exp2` per cell.
pub fn extinction(attenuation: &Attenuation, alpha: f32) -> f32 {
    let per_rho = match *attenuation {
        Attenuation::PathLength { sigma } => sigma,
        Attenuation::PerCell { tau } => tau,
    };
    (per_rho as f64 * alpha as f64 / 65535.0 * std::f64::consts::LOG2_E) as f32
}

/// Shift along y, in cells, of a volume of `ny` cells that has flowed by `flow` times its length.
///
/// Whole lengths are dropped because copies of the volume join along y. The arithmetic is float64, so a whole
/// number of lengths gives exactly 0.
pub fn flow_cells(flow: f32, ny: u32) -> f32 {
    ((flow as f64).rem_euclid(1.0) * ny as f64) as f32
}
