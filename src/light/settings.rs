//! §5 Settings of the light: where angles are measured, visibility, reflection and scattering.

use glam::Vec3;

use super::strand::StrandParams;
use super::strand::table::{StrandShading, StrandTable};
use crate::util::words::words;

/// Space in which the fibre model's angles are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AngleFrame {
    /// World space: t = normalize(J v) against world vectors.
    World,
    /// Texture space, as in the paper: v against J⁻¹l and J⁻¹e, normalised.
    Texture,
}

words! { AngleFrame { World => "world", Texture => "texture" } }

/// Computation of V_i(k), the transmittance from cell k to light i.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// V = 1: the volume casts no shadow on itself.
    None,
    /// Exact walk from the cell's centre towards the light, for every cell that a view ray meets.
    March,
    /// Exact walk from every cell of the volume, stored in light volumes ([`super::visibility`]).
    Cached,
}

words! { Visibility { March => "march", Cached => "cached", None => "none" } }

/// Reflection model of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reflection {
    /// The paper's model: fibres with the cell's coefficients k_d and k_s ([`super::fibre`]).
    KajiyaKay,
    /// Strands of water with air between them ([`super::strand`]).
    Strand(StrandParams),
    /// Hairs ([`super::strand::hair`]). The ambient light takes their colour, too.
    Hair(StrandParams),
}

/// Model of a [`Reflection`], without its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReflectionKind {
    /// [`Reflection::KajiyaKay`].
    KajiyaKay,
    /// [`Reflection::Strand`].
    Strand,
    /// [`Reflection::Hair`].
    Hair,
}

words! { ReflectionKind { KajiyaKay => "kajiya-kay", Strand => "strand", Hair => "hair" } }

/// Reflection model of the cells of one volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeReflection {
    /// That of the scene.
    Scene,
    /// [`Reflection::KajiyaKay`], whatever the scene has.
    KajiyaKay,
}

words! { VolumeReflection { Scene => "scene", KajiyaKay => "kajiya-kay" } }

impl Reflection {
    /// Returns the model without its parameters.
    pub fn kind(&self) -> ReflectionKind {
        match self {
            Reflection::KajiyaKay => ReflectionKind::KajiyaKay,
            Reflection::Strand(_) => ReflectionKind::Strand,
            Reflection::Hair(_) => ReflectionKind::Hair,
        }
    }

    /// Strands that cells hold, if the model is one of strands.
    pub fn strands(&self) -> Option<&StrandParams> {
        match self {
            Reflection::KajiyaKay => None,
            Reflection::Strand(params) | Reflection::Hair(params) => Some(params),
        }
    }

    /// The model of [`Reflection::strands`], with its table.
    pub fn shading(&self) -> Option<StrandShading> {
        self.strands().map(StrandShading::new)
    }

    /// Share of the ambient light that cells give back, linear RGB. Only that of hairs is below 1: water is
    /// nearly white, and what fibres absorb of it is not known.
    pub fn ambient_share(&self) -> Vec3 {
        match self {
            Reflection::KajiyaKay | Reflection::Strand(_) => Vec3::ONE,
            Reflection::Hair(params) => StrandTable::of(params).moments().albedo.as_vec3(),
        }
    }
}

/// Number of times that light may scatter on its way through the volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scattering {
    /// Once: at the cell that the view ray meets.
    Single,
    /// Any number of times ([`super::scatter`]).
    Multiple,
}

words! { Scattering { Single => "single", Multiple => "multiple" } }
