//! Colour spaces of files, and the way from them to linear Rec. 709.
//!
//! A space has a curve and primaries. Primaries with another white than D65 are adapted to it by the
//! transform of Bradford, so that grey stays grey.

use glam::{DMat3, DVec3};

/// Chromaticities x, y of red, green, blue and white.
pub type Primaries = [f64; 8];

/// Primaries and white of Rec. 709.
pub const REC709: Primaries = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];
/// Primaries and white of Rec. 2020.
pub const REC2020: Primaries = [0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329];
const P3_D65: Primaries = [0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329];
const ADOBE_RGB: Primaries = [0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.329];
const AP0: Primaries = [0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767];
/// Primaries and white of ACEScg.
pub const AP1: Primaries = [0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767];
/// The axes of CIE XYZ. Its values are those of the eye, whatever the white: they are not adapted.
const XYZ: Primaries = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0];
/// Primaries that differ by less are the same: files hold them with three or four digits.
const SAME: f64 = 1e-3;

/// Responses of the cones after Bradford, per X, Y and Z.
const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);

/// How a file stores linear values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    /// As they are.
    Linear,
    /// Through the curve of sRGB (IEC 61966-2-1), which goes on above 1.
    Srgb,
    /// As the power 1/γ.
    Gamma(f64),
}

impl Curve {
    /// Returns the linear value of one that a file stores.
    pub fn decode(self, value: f32) -> f32 {
        let power = |x: f32, gamma: f64| f64::from(x).powf(gamma) as f32;
        match self {
            Curve::Srgb if value > 0.040_45 => power((value + 0.055) / 1.055, 2.4),
            Curve::Srgb => value / 12.92,
            Curve::Gamma(gamma) => power(value.abs(), gamma).copysign(value),
            Curve::Linear => value,
        }
    }
}

/// Curve and primaries that a name says. A name may say nothing of one of them.
pub struct Named {
    /// Curve of the values.
    pub curve: Curve,
    /// Primaries and white.
    pub primaries: Option<Primaries>,
}

/// Reads a name of the Color Interop Forum, such as `srgb_rec709_display`, or a common one. Returns `None` if
/// the name is unknown.
pub fn named(name: &str) -> Option<Named> {
    let name = name.trim().to_lowercase().replace([' ', '-'], "_");
    let some = |curve, primaries| Some(Named { curve, primaries });
    match name.as_str() {
        "" | "linear" | "scene_linear" | "data" | "raw" | "unknown" => {
            return some(Curve::Linear, None);
        }
        "srgb" | "srgb_texture" => return some(Curve::Srgb, Some(REC709)),
        "linear_srgb" | "srgb_linear" => return some(Curve::Linear, Some(REC709)),
        "linear_rec.709" | "linear_rec.709_(srgb)" => return some(Curve::Linear, Some(REC709)),
        "aces2065_1" => return some(Curve::Linear, Some(AP0)),
        "acescg" => return some(Curve::Linear, Some(AP1)),
        _ => {}
    }
    let (curve, primaries) = name.split_once('_')?;
    let curve = match curve {
        "lin" => Curve::Linear,
        "srgb" => Curve::Srgb,
        "g18" => Curve::Gamma(1.8),
        "g22" => Curve::Gamma(2.2),
        "g24" => Curve::Gamma(2.4),
        "g26" => Curve::Gamma(2.6),
        _ => return None,
    };
    let primaries =
        primaries.strip_suffix("_scene").or(primaries.strip_suffix("_display")).unwrap_or(primaries);
    let primaries = match primaries {
        "rec709" | "srgb" => REC709,
        "rec2020" => REC2020,
        "p3d65" => P3_D65,
        "adobergb" => ADOBE_RGB,
        "ap0" => AP0,
        "ap1" => AP1,
        "ciexyzd65" | "xyzd65" => XYZ,
        _ => return None,
    };
    some(curve, Some(primaries))
}

/// Whether two sets of primaries are the same, within the digits that files have.
pub fn same(a: &Primaries, b: &Primaries) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < SAME)
}

fn white(p: &Primaries) -> DVec3 {
    DVec3::new(p[6] / p[7], 1.0, (1.0 - p[6] - p[7]) / p[7])
}

/// X, Y and Z of red, green and blue. `None` if the primaries span no space.
fn xyz_from_rgb(p: &Primaries) -> Option<DMat3> {
    let column = |i: usize| DVec3::new(p[i], p[i + 1], 1.0 - p[i] - p[i + 1]);
    let directions = DMat3::from_cols(column(0), column(2), column(4));
    if !(directions.determinant().abs() > 1e-6 && p[7] > 1e-6) {
        return None;
    }
    let xyz = directions * DMat3::from_diagonal(directions.inverse() * white(p));
    (xyz.is_finite() && xyz.determinant().abs() > 1e-9).then_some(xyz)
}

/// Adapts the white `from` to the white `to`.
fn adapted(from: DVec3, to: DVec3) -> DMat3 {
    BRADFORD.inverse() * DMat3::from_diagonal((BRADFORD * to) / (BRADFORD * from)) * BRADFORD
}

/// Returns the matrix from linear Rec. 709 to other primaries, whose white is adapted by Bradford's
/// transform. `None` if the primaries span no space.
pub fn from_rec709(primaries: &Primaries) -> Option<DMat3> {
    let xyz_from_other = xyz_from_rgb(primaries)?;
    let white_of_other = adapted(white(&REC709), white(primaries));
    Some(xyz_from_other.inverse() * white_of_other * xyz_from_rgb(&REC709)?)
}

/// Says how many texels lie outside Rec. 709.
pub fn outside(texels: u64) -> Option<String> {
    (texels > 0).then(|| format!("{texels} texels lie outside Rec. 709: they were moved to its border"))
}

/// Colour space of a file.
pub struct Space {
    curve: Curve,
    /// `None` for Rec. 709, whose values do not change.
    rec709: Option<DMat3>,
    /// Luminance of red, green and blue.
    pub luminance: DVec3,
}

impl Space {
    /// `None` if the primaries span no space.
    pub fn new(curve: Curve, primaries: &Primaries) -> Option<Space> {
        let xyz = xyz_from_rgb(primaries)?;
        let rgb = xyz_from_rgb(&REC709)?.inverse();
        let white_d65 = white(&REC709);
        let rec709 = if same(primaries, &REC709) {
            None
        } else if same(primaries, &XYZ) {
            Some(rgb)
        } else {
            Some(rgb * adapted(white(primaries), white_d65) * xyz)
        };
        let rec709 = rec709.filter(DMat3::is_finite);
        Some(Space { curve, rec709, luminance: xyz.row(1) })
    }

    /// The space of Radiance's XYZE: X, Y and Z whose white has equal energy.
    pub fn radiance_xyz() -> Option<Space> {
        let rgb = xyz_from_rgb(&REC709)?.inverse();
        let rec709 = rgb * adapted(DVec3::ONE, white(&REC709));
        Some(Space { curve: Curve::Linear, rec709: Some(rec709), luminance: DVec3::Y })
    }

    /// Converts texels to linear Rec. 709. A colour outside it loses its negative components. Returns the
    /// number of texels that lose more than a thousandth of their largest component.
    pub fn convert(&self, texels: &mut [[f32; 4]]) -> u64 {
        let mut clipped = 0;
        for texel in texels {
            if self.curve != Curve::Linear {
                texel[..3].iter_mut().for_each(|value| *value = self.curve.decode(*value));
            }
            let Some(rec709) = self.rec709 else { continue };
            let before = DVec3::new(texel[0].into(), texel[1].into(), texel[2].into());
            let mut after = rec709 * before;
            if before.min_element() >= 0.0 {
                clipped += u64::from(after.min_element() < -1e-3 * after.max_element());
                after = after.max(DVec3::ZERO);
            }
            *texel = after.as_vec3().extend(0.0).to_array();
        }
        clipped
    }
}
