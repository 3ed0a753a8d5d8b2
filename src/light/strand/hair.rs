//! Hairs: fibres of keratin, whose surface is covered with tilted scales and whose pigments absorb light.
//!
//! Pigments, and lengths in their absorption, follow d'Eon et al. 2011, where the radius of a hair is the
//! unit of length. The hair has no medulla, and its cross-section is a circle.

use glam::DVec3;

use super::StrandParams;

/// Index of refraction of keratin.
pub const ETA: f32 = 1.55;

/// Absorption of eumelanin of concentration 1, linear sRGB, per radius of a hair (d'Eon et al. 2011).
pub const EUMELANIN: DVec3 = DVec3::new(0.419, 0.697, 1.37);
/// Absorption of pheomelanin of concentration 1, as that of [`EUMELANIN`].
pub const PHEOMELANIN: DVec3 = DVec3::new(0.187, 0.4, 1.05);

/// Properties of hairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hair {
    /// Index of refraction.
    pub eta: f32,
    /// Angle α by which the scales stand off the hair, towards its tip, degrees.
    pub tilt_degrees: f32,
    /// Roughness along the hair, β_m, 0.1 to 1.
    pub roughness_m: f32,
    /// Roughness around the hair, β_n, 0.1 to 1.
    pub roughness_n: f32,
    /// Source of the colour.
    pub pigment: Pigment,
}

/// Source of a hair's colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pigment {
    /// Concentration of both melanins together, and the share of pheomelanin, 0 to 1.
    Melanin(f32, f32),
    /// Colour of a mass of such hairs in even light, linear RGB from 0 to 1.
    Color(DVec3),
}

impl Default for Hair {
    fn default() -> Self {
        let pigment = Pigment::Melanin(1.3, 0.2);
        Hair { eta: ETA, tilt_degrees: 3.0, roughness_m: 0.3, roughness_n: 0.3, pigment }
    }
}

impl Hair {
    /// Strands of this hair, without air.
    pub fn strand(&self) -> StrandParams {
        StrandParams {
            eta: self.eta as f64,
            tilt: (self.tilt_degrees as f64).to_radians(),
            depth: self.absorption() * 2.0,
            roughness_m: self.roughness_m,
            roughness_n: self.roughness_n,
            aeration: 0.0,
            g: 0.0,
        }
    }

    /// Absorption coefficient σ_a per radius, linear RGB.
    pub fn absorption(&self) -> DVec3 {
        match self.pigment {
            Pigment::Melanin(sum, redness) => {
                let (sum, redness) = (sum as f64, redness as f64);
                (EUMELANIN * (1.0 - redness) + PHEOMELANIN * redness) * sum
            }
            Pigment::Color(color) => absorption_of(color, self.roughness_n as f64),
        }
    }
}

/// Absorption coefficient σ_a per radius of hairs that look like `color`, linear RGB, after light has been
/// scattered among many of them: the fit of Chiang et al. 2016, eq. 9, for the roughness around the hair
/// β_n. It is 0 for the colour 1, and infinite for the colour 0.
pub fn absorption_of(color: DVec3, roughness_n: f64) -> DVec3 {
    let fit = [5.969, -0.215, 2.532, -10.73, 5.574, 0.245];
    let scale = fit.iter().rev().fold(0.0, |sum, c| sum * roughness_n + c);
    (color.map(f64::ln) / scale).map(|x| x * x)
}
