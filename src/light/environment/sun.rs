//! Sunlight on the ground: the sun's spectrum above the atmosphere, attenuated along its path through the
//! air.

use glam::DVec3;

/// Angular radius of the sun's disc at the mean distance, radians: 959.63″ (IAU, Astronomical Almanac).
pub const ANGULAR_RADIUS: f64 = 959.63 / 3600.0 * std::f64::consts::PI / 180.0;

/// Width of a spectral band, nm.
const BAND: f64 = 20.0;
/// Centre of the first band, nm.
const FIRST: f64 = 390.0;

/// Spectral irradiance above the atmosphere, W/(m²·nm): the extraterrestrial column of ASTM G-173, averaged
/// over the bands.
const ABOVE: [f64; 17] = [
    1.080, 1.729, 1.651, 1.973, 2.021, 1.946, 1.873, 1.881, 1.851, 1.834, 1.798, 1.725, 1.664, 1.563, 1.534,
    1.461, 1.389,
];

/// Vertical optical depth of 300 Dobson units of ozone: cross-sections at 233 K (Serdyuchenko et al. 2014),
/// averaged over the bands, times 8.06e22 molecules/m².
const OZONE: [f64; 17] = [
    0.00004, 0.00017, 0.00056, 0.00157, 0.00347, 0.00675, 0.0124, 0.0197, 0.0266, 0.0360, 0.0367, 0.0376,
    0.0280, 0.0197, 0.0134, 0.0087, 0.0057,
];

/// Air mass on a path at `elevation` (radians, 0 to π/2), relative to the vertical path (Kasten and Young
/// 1989).
pub fn air_mass(elevation: f64) -> f64 {
    let degrees = elevation.to_degrees();
    1.0 / (elevation.sin() + 0.50572 * (degrees + 6.07995).powf(-1.6364))
}

/// Irradiance of the sun alone on a surface that faces it, linear RGB (Rec. 709), in lux/683 per channel,
/// which is the unit of the sky model's radiance times sr. `elevation` is in radians, `turbidity` from 1 to
/// 10.
///
/// Rayleigh scattering, haze and ozone follow Preetham, Shirley and Smits 1999 (appendix 2, after Iqbal
/// 1983). Water vapour and the other gases absorb next to nothing in the visible range, so they are left out.
pub fn irradiance(elevation: f64, turbidity: f64) -> DVec3 {
    let mass = air_mass(elevation);
    // Ångström's turbidity coefficient; it is 0 for pure air.
    let beta = (0.04608 * turbidity - 0.04586).max(0.0);
    let mut xyz = DVec3::ZERO;
    for (i, (above, ozone)) in ABOVE.iter().zip(OZONE).enumerate() {
        let nm = FIRST + BAND * i as f64;
        let um = nm * 1e-3;
        let depth = 0.008735 * um.powf(-4.08) + beta * um.powf(-1.3) + ozone;
        xyz += matching(nm) * (above * (-depth * mass).exp() * BAND);
    }
    rgb_of(xyz).max(DVec3::ZERO)
}

/// CIE 1931 matching functions as sums of lobes (Wyman, Sloan and Shirley 2013, "Simple Analytic
/// Approximations to the CIE XYZ Color Matching Functions").
fn matching(nm: f64) -> DVec3 {
    let lobe = |height: f64, middle: f64, left: f64, right: f64| {
        let t = (nm - middle) / if nm < middle { left } else { right };
        height * (-0.5 * t * t).exp()
    };
    DVec3::new(
        lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    )
}

/// Converts CIE XYZ to linear RGB of Rec. 709 (IEC 61966-2-1).
fn rgb_of(xyz: DVec3) -> DVec3 {
    DVec3::new(
        xyz.dot(DVec3::new(3.2406, -1.5372, -0.4986)),
        xyz.dot(DVec3::new(-0.9689, 1.8758, 0.0415)),
        xyz.dot(DVec3::new(0.0557, -0.2040, 1.0570)),
    )
}
