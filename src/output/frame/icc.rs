//! Colour profiles (ICC) of developed pictures: sRGB, and linear light.

use std::io;

use moxcms::{
    Chromaticity, ColorPrimaries, ColorProfile, LocalizableString, ProfileText, ToneReprCurve, XyY,
};

use super::Encoding;
use crate::picture::Gamut;

/// Place of the profile's date in its header. The date would make the bytes of pictures differ.
const DATE: std::ops::Range<usize> = 24..36;
/// Place of the illuminant in the header.
const ILLUMINANT: std::ops::Range<usize> = 68..80;
/// D50 as the specification writes it, to the last bit, which strict readers compare.
const D50: [u8; 12] = [0, 0, 0xf6, 0xd6, 0, 1, 0, 0, 0, 0, 0xd3, 0x2d];
/// The first of January 2026, as six numbers of 16 bits.
const FIXED_DATE: [u8; 12] = [0x07, 0xea, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0];

/// Returns the profile of a picture, linear in its primaries or with the curve of sRGB.
///
/// # Errors
/// Errors of the encoder.
pub(super) fn profile(Encoding { linear, gamut, .. }: Encoding) -> io::Result<Vec<u8>> {
    let mut profile = ColorProfile::new_srgb();
    // Its code points say otherwise than the curve where that is linear, and make old readers stop.
    profile.cicp = None;
    if linear {
        let curve = || Some(ToneReprCurve::Lut(Vec::new()));
        (profile.red_trc, profile.green_trc, profile.blue_trc) = (curve(), curve(), curve());
    }
    if gamut != Gamut::Rec709 {
        let [rx, ry, gx, gy, bx, by, x, y] = gamut.chromaticities();
        let at = |x: f64, y: f64| Chromaticity { x: x as f32, y: y as f32 };
        let primaries = ColorPrimaries { red: at(rx, ry), green: at(gx, gy), blue: at(bx, by) };
        profile.update_rgb_colorimetry(XyY { x, y, yb: 1.0 }, primaries);
    }
    // The encoder does not align what follows a text, so texts have an even number of letters.
    let text = |text: &str| {
        let text = LocalizableString::new("en".into(), "US".into(), text.into());
        Some(ProfileText::Localizable(vec![text]))
    };
    profile.description = text(match (linear, gamut) {
        (false, _) => "sRGB",
        (true, Gamut::Rec709) => "sRGB, linear",
        (true, Gamut::Acescg) => "ACEScg",
        (true, Gamut::Rec2020) => "Rec. 2020 linear",
    });
    profile.copyright = text("No copyright");
    let mut bytes = profile.encode().map_err(|e| io::Error::other(e.to_string()))?;
    bytes[DATE].copy_from_slice(&FIXED_DATE);
    bytes[ILLUMINANT].copy_from_slice(&D50);
    Ok(bytes)
}
