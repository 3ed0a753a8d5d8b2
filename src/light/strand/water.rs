//! Strands of water: their index of refraction, and the absorption of pure water in linear sRGB.

use glam::DVec3;

use super::StrandParams;

/// Index of refraction of water at 20 °C in yellow light.
pub const ETA: f64 = 1.333;

/// Properties of strands of water and of the air between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Water {
    /// Radius of a strand, metres.
    pub radius_m: f32,
    /// Roughness along the strand, β_m, 0.1 to 1.
    pub roughness_m: f32,
    /// Roughness around the strand, β_n, 0.1 to 1.
    pub roughness_n: f32,
    /// Absorption as a multiple of pure water's.
    pub absorption: f32,
    /// See [`StrandParams::aeration`].
    pub aeration: f32,
    /// See [`StrandParams::g`].
    pub g: f32,
}

impl Default for Water {
    fn default() -> Self {
        Water { radius_m: 5e-4, roughness_m: 0.3, roughness_n: 0.2, absorption: 1.0, aeration: 0.5, g: 0.8 }
    }
}

impl Water {
    /// Strands of this water. Their surface is smooth, so nothing is tilted.
    pub fn strand(&self) -> StrandParams {
        StrandParams {
            eta: ETA,
            tilt: 0.0,
            depth: pure_water() * (2.0 * self.radius_m as f64 * self.absorption as f64),
            roughness_m: self.roughness_m,
            roughness_n: self.roughness_n,
            aeration: self.aeration,
            g: self.g,
        }
    }
}

/// Wavelength of the first value in the table, nm.
const FIRST_NM: f64 = 380.0;
/// Difference of wavelength between successive values, nm.
const STEP_NM: f64 = 10.0;

/// Absorption of pure water at 22 °C, 1/m, 380 to 700 nm: every fourth row of table 3 of Pope and Fry,
/// "Absorption spectrum (380–700 nm) of pure water. II. Integrating cavity measurements", Applied Optics 36
/// (1997).
const POPE_FRY: [f64; 33] = [
    0.01137, 0.00851, 0.00663, 0.00473, 0.00454, 0.00495, 0.00635, 0.00922, 0.00979, 0.0106, 0.0127, 0.0150,
    0.0204, 0.0325, 0.0409, 0.0434, 0.0474, 0.0565, 0.0619, 0.0695, 0.0896, 0.1351, 0.2224, 0.2644, 0.2755,
    0.2916, 0.3108, 0.340, 0.410, 0.439, 0.465, 0.516, 0.624,
];

/// Absorption coefficient σ_a of pure water, 1/m, linear sRGB.
///
/// Each primary takes the mean of the spectrum, weighted by the positive part of its colour matching
/// function. The negative part would make the colour of a thin layer exact. It would also give blue a
/// negative coefficient, and a deep layer would then amplify light.
pub fn pure_water() -> DVec3 {
    let (mut sum, mut weights) = (DVec3::ZERO, DVec3::ZERO);
    for (i, a) in POPE_FRY.iter().enumerate() {
        let weight = srgb_matching(FIRST_NM + STEP_NM * i as f64).max(DVec3::ZERO);
        sum += weight * *a;
        weights += weight;
    }
    sum / weights
}

/// Colour matching functions of linear sRGB (IEC 61966-2-1), from those of the CIE 1931 observer in the fit
/// by Wyman, Sloan and Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions",
/// JCGT 2 (2013).
fn srgb_matching(nm: f64) -> DVec3 {
    let lobe = |height: f64, middle: f64, left: f64, right: f64| {
        let t = (nm - middle) * if nm < middle { left } else { right };
        height * (-0.5 * t * t).exp()
    };
    let x = lobe(0.362, 442.0, 0.0624, 0.0374)
        + lobe(1.056, 599.8, 0.0264, 0.0323)
        + lobe(-0.065, 501.1, 0.0490, 0.0382);
    let y = lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322);
    let z = lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725);
    DVec3::new(
        3.2406 * x - 1.5372 * y - 0.4986 * z,
        -0.9689 * x + 1.8758 * y + 0.0415 * z,
        0.0557 * x - 0.2040 * y + 1.0570 * z,
    )
}
