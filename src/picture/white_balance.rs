//! White balance: adaptation of a picture to the colour of its light.
//!
//! The light has the chromaticity of a black body of its temperature in the CIE 1960 diagram (Krystek, "An
//! Algorithm to Calculate Correlated Colour Temperature", Color Research and Application 10, 1985), moved off
//! the black body curve by the tint. The picture is adapted from this light to 6500 K by von Kries' rule in
//! the cone space of CAT16 (Li et al., "Comprehensive color solutions: CAM16, CAT16, and CAM16-UCS", Color
//! Research and Application 42, 2017).

use glam::{DMat3, DVec2, DVec3};

/// Colour temperature at which nothing changes, kelvin.
pub const NEUTRAL_K: f32 = 6500.0;

/// Matrix that adapts linear RGB (Rec. 709, D65) from the light of `temperature` and `tint` to light of 6500
/// K.
///
/// `temperature` is in kelvin, 1000 to 15000; `tint` is in thousandths of Duv, above 0 for greener light.
/// White keeps its luminance.
pub fn matrix(temperature: f32, tint: f32) -> DMat3 {
    let rgb_from_xyz = XYZ_FROM_RGB.inverse();
    let cone_from_xyz = CONE_FROM_XYZ;
    let from = cone_from_xyz * white(f64::from(temperature), f64::from(tint) * 1e-3);
    let to = cone_from_xyz * white(f64::from(NEUTRAL_K), 0.0);
    let adapted = cone_from_xyz.inverse() * DMat3::from_diagonal(to / from) * cone_from_xyz;
    rgb_from_xyz * adapted * XYZ_FROM_RGB
}

/// CIE XYZ, with Y = 1, of the light of a black body moved by `duv` off the black body curve in the CIE 1960
/// diagram. A positive `duv` moves it upwards, towards green.
pub fn white(kelvin: f64, duv: f64) -> DVec3 {
    let step = 0.5;
    let along = (black_body(kelvin + step) - black_body(kelvin - step)).normalize();
    // The curve runs to smaller u with higher temperature, so green is on its right.
    let uv = black_body(kelvin) + DVec2::new(along.y, -along.x) * duv;
    let d = 2.0 * uv.x - 8.0 * uv.y + 4.0;
    let (x, y) = (3.0 * uv.x / d, 2.0 * uv.y / d);
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// Chromaticity (u, v) of a black body in the CIE 1960 diagram (Krystek 1985); the error is 8·10⁻⁵ from 1000
/// to 15000 K.
fn black_body(t: f64) -> DVec2 {
    DVec2::new(
        (0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t)
            / (1.0 + 8.42420235e-4 * t + 7.08145163e-7 * t * t),
        (0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t)
            / (1.0 - 2.89741816e-5 * t + 1.61456053e-7 * t * t),
    )
}

/// Columns of the matrix from Rec. 709 with the white point D65 to CIE XYZ (IEC 61966-2-1).
const XYZ_FROM_RGB: DMat3 = DMat3::from_cols(
    DVec3::new(0.4124564, 0.2126729, 0.0193339),
    DVec3::new(0.3575761, 0.7151522, 0.1191920),
    DVec3::new(0.1804375, 0.0721750, 0.9503041),
);

/// Columns of the matrix from CIE XYZ to the cone space of CAT16.
const CONE_FROM_XYZ: DMat3 = DMat3::from_cols(
    DVec3::new(0.401288, -0.250268, -0.002079),
    DVec3::new(0.650173, 1.204414, 0.048952),
    DVec3::new(-0.051461, 0.045854, 0.953127),
);
