//! §5 How light is worked out.

use super::strand::StrandParams;
use crate::util::words::words;

/// Where the fibre model's angles are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AngleFrame {
    /// t = normalize(J v) against world vectors.
    World,
    /// v against J⁻¹l and J⁻¹e, normalised: the paper's.
    Texture,
}

words! { AngleFrame { World => "world", Texture => "texture" } }

/// V_i(k).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// 1.
    None,
    /// Exact walk from the cell's centre to the light.
    March,
    /// The same, walked once for every cell of the volume and kept.
    Cached,
}

words! { Visibility { March => "march", Cached => "cached", None => "none" } }

/// How a cell reflects light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reflection {
    /// The paper's: fibres with the coefficients of the cell.
    KajiyaKay,
    /// Strands of water and air.
    Strand(StrandParams),
}

/// Model of a [`Reflection`], without its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReflectionKind {
    /// [`Reflection::KajiyaKay`].
    KajiyaKay,
    /// [`Reflection::Strand`].
    Strand,
}

words! { ReflectionKind { KajiyaKay => "kajiya-kay", Strand => "strand" } }

impl Reflection {
    /// Returns the model without its parameters.
    pub fn kind(&self) -> ReflectionKind {
        match self {
            Reflection::KajiyaKay => ReflectionKind::KajiyaKay,
            Reflection::Strand(_) => ReflectionKind::Strand,
        }
    }
}

/// How often light may be scattered on its way through the volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scattering {
    /// Once.
    Single,
    /// As often as it is.
    Multiple,
}

words! { Scattering { Single => "single", Multiple => "multiple" } }
