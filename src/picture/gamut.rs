//! Primaries of the colours that files of linear light hold.

use glam::DMat3;

use crate::util::colour;
use crate::util::words::words;

/// Primaries of linear colours. taki computes in those of Rec. 709; files may have others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gamut {
    /// Rec. 709, those of sRGB. Their white is D65.
    #[default]
    Rec709,
    /// AP1, those of ACEScg. Their white is that of ACES, about D60.
    Acescg,
    /// Rec. 2020. Their white is D65.
    Rec2020,
}

words! { Gamut { Rec709 => "rec709", Acescg => "acescg", Rec2020 => "rec2020" } }

impl Gamut {
    /// All of them.
    pub const ALL: [Gamut; 3] = [Gamut::Rec709, Gamut::Acescg, Gamut::Rec2020];

    /// Returns the chromaticities x, y of red, green, blue and white.
    pub fn chromaticities(self) -> colour::Primaries {
        match self {
            Gamut::Rec709 => colour::REC709,
            Gamut::Acescg => colour::AP1,
            Gamut::Rec2020 => colour::REC2020,
        }
    }

    /// Returns the name that the Color Interop Forum gives to linear light of a scene in these primaries.
    pub fn interop_id(self) -> &'static str {
        match self {
            Gamut::Rec709 => "lin_rec709_scene",
            Gamut::Acescg => "lin_ap1_scene",
            Gamut::Rec2020 => "lin_rec2020_scene",
        }
    }

    /// Returns its name for people and for texts of files.
    pub fn name(self) -> &'static str {
        match self {
            Gamut::Rec709 => "Rec. 709",
            Gamut::Acescg => "ACEScg",
            Gamut::Rec2020 => "Rec. 2020",
        }
    }

    /// Returns the matrix from linear Rec. 709. White is adapted by Bradford's transform, so that grey stays
    /// grey. `None` for Rec. 709 itself, whose values do not change.
    pub fn from_rec709(self) -> Option<DMat3> {
        match self {
            Gamut::Rec709 => None,
            other => colour::from_rec709(&other.chromaticities()),
        }
    }

    /// Finds the gamut that has these chromaticities.
    pub fn of(chromaticities: &colour::Primaries) -> Option<Gamut> {
        Gamut::ALL.into_iter().find(|gamut| colour::same(&gamut.chromaticities(), chromaticities))
    }
}
