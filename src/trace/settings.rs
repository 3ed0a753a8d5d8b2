//! §4 How view rays go through the volume.

use crate::util::words::words;

/// How view rays go through the volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trace {
    /// τ_k of a cell.
    pub attenuation: Attenuation,
    /// Most cells of one ray.
    pub max_cells: u32,
    /// A ray ends where T falls below this; 0: never.
    pub early_end: f32,
    /// Most sheets one ray goes through.
    pub layers: u32,
    /// Whether far away coarser levels of the volume are walked.
    pub filter: Prefilter,
    /// What a ray finds in a cell.
    pub lookup: Lookup,
}

/// How views that see many cells in one pixel are kept from aliasing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prefilter {
    /// They are not.
    None,
    /// By levels of fewer cells, the two that suit the pixel's footprint.
    Pyramid,
}

words! { Prefilter { None => "none", Pyramid => "pyramid" } }

/// What a ray finds in a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lookup {
    /// The cell's own.
    Nearest,
    /// At the middle of its way through the cell, what lies between the centres of eight cells.
    Trilinear,
}

words! { Lookup { Nearest => "nearest", Trilinear => "trilinear" } }

/// τ_k of a cell with density ρ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Attenuation {
    /// σ·ρ·Δs, σ in 1/m.
    PathLength {
        /// Extinction at ρ = 1, 1/m.
        sigma: f32,
    },
    /// τ·ρ.
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

/// Optical depth in bits (log₂ of the transmittance) per unit of a cell's ρ code, and per metre with
/// path-length attenuation: the walk then needs one product and `exp2`.
pub fn extinction(attenuation: &Attenuation, alpha: f32) -> f32 {
    let per_rho = match *attenuation {
        Attenuation::PathLength { sigma } => sigma,
        Attenuation::PerCell { tau } => tau,
    };
    (per_rho as f64 * alpha as f64 / 65535.0 * std::f64::consts::LOG2_E) as f32
}

/// How far `flow` lengths of the volume move its `ny` cells, without the whole lengths: they change
/// nothing, for copies of the volume join along y. In float64, so that whole numbers give exactly 0.
pub fn flow_cells(flow: f32, ny: u32) -> f32 {
    ((flow as f64).rem_euclid(1.0) * ny as f64) as f32
}
