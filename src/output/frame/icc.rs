//! Colour profiles (ICC) of developed pictures: sRGB, and linear light with the primaries of sRGB.

use std::io;

use moxcms::{ColorProfile, LocalizableString, ProfileText, ToneReprCurve};

/// Place of the profile's date in its header. The date would make the bytes of pictures differ.
const DATE: std::ops::Range<usize> = 24..36;
/// The first of January 2026, as six numbers of 16 bits.
const FIXED_DATE: [u8; 12] = [0x07, 0xea, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0];

/// Returns the profile of a picture, linear or with the curve of sRGB.
///
/// # Errors
/// Errors of the encoder.
pub(super) fn profile(linear: bool) -> io::Result<Vec<u8>> {
    let mut profile = ColorProfile::new_srgb();
    // Its code points say otherwise than the curve where that is linear, and make old readers stop.
    profile.cicp = None;
    if linear {
        let curve = || Some(ToneReprCurve::Lut(Vec::new()));
        (profile.red_trc, profile.green_trc, profile.blue_trc) = (curve(), curve(), curve());
        let name = LocalizableString::new("en".into(), "US".into(), "Linear Rec. 709".into());
        profile.description = Some(ProfileText::Localizable(vec![name]));
    }
    let mut bytes = profile.encode().map_err(|e| io::Error::other(e.to_string()))?;
    bytes[DATE].copy_from_slice(&FIXED_DATE);
    Ok(bytes)
}
