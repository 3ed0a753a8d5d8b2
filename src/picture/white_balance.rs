//! White balance: what a picture looks like to an eye that has adapted to other light.
//!
//! The light's place is the black body's of its temperature in the CIE 1960 diagram (Krystek, "An Algorithm
//! to Calculate Correlated Colour Temperature", Color Research and Application 10, 1985), moved off its curve
//! by the tint. From there the picture is adapted to 6500 K by von Kries' rule in the cone space of CAT16 (Li
//! et al., "Comprehensive color solutions: CAM16, CAT16, and CAM16-UCS", Color Research and Application 42,
//! 2017).

use glam::{DMat3, DVec2, DVec3};

/// Kelvin, where nothing changes.
pub const NEUTRAL_K: f32 = 6500.0;

/// Linear RGB (Rec. 709, D65) of a picture in light of `temperature` (kelvin, 1000 to 15000) and `tint`
/// (thousandths of Duv, above 0 for greener light), as it is in light of 6500 K: the matrix that takes one to
/// the other. White keeps its luminance.
pub fn matrix(temperature: f32, tint: f32) -> DMat3 {
    let rgb_from_xyz = XYZ_FROM_RGB.inverse();
    let cone_from_xyz = CONE_FROM_XYZ;
    let from = cone_from_xyz * white(f64::from(temperature), f64::from(tint) * 1e-3);
    let to = cone_from_xyz * white(f64::from(NEUTRAL_K), 0.0);
    let adapted = cone_from_xyz.inverse() * DMat3::from_diagonal(to / from) * cone_from_xyz;
    rgb_from_xyz * adapted * XYZ_FROM_RGB
}

/// CIE XYZ of the light of a black body, Y = 1, moved by `duv` off its curve in the CIE 1960 diagram, upwards
/// (greener) for positive ones.
pub fn white(kelvin: f64, duv: f64) -> DVec3 {
    let step = 0.5;
    let along = (black_body(kelvin + step) - black_body(kelvin - step)).normalize();
    // Towards higher temperatures the curve runs to smaller u: green is to the right of it.
    let uv = black_body(kelvin) + DVec2::new(along.y, -along.x) * duv;
    let d = 2.0 * uv.x - 8.0 * uv.y + 4.0;
    let (x, y) = (3.0 * uv.x / d, 2.0 * uv.y / d);
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// Krystek 1985: u and v, to 8·10⁻⁵ from 1000 to 15000 K.
fn black_body(t: f64) -> DVec2 {
    DVec2::new(
        (0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t)
            / (1.0 + 8.42420235e-4 * t + 7.08145163e-7 * t * t),
        (0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t)
            / (1.0 - 2.89741816e-5 * t + 1.61456053e-7 * t * t),
    )
}

/// Rec. 709 with the white of D65 (IEC 61966-2-1); columns.
const XYZ_FROM_RGB: DMat3 = DMat3::from_cols(
    DVec3::new(0.4124564, 0.2126729, 0.0193339),
    DVec3::new(0.3575761, 0.7151522, 0.1191920),
    DVec3::new(0.1804375, 0.0721750, 0.9503041),
);

/// CAT16; columns.
const CONE_FROM_XYZ: DMat3 = DMat3::from_cols(
    DVec3::new(0.401288, -0.250268, -0.002079),
    DVec3::new(0.650173, 1.204414, 0.048952),
    DVec3::new(-0.051461, 0.045854, 0.953127),
);
