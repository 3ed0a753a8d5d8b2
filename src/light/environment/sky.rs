//! The clear sky of Hosek and Wilkie 2012, "An Analytic Model for Full Spectral Sky-Dome Radiance", baked
//! into a map with the sun in the middle column, at −z.

use glam::{DVec3, Vec3};
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use rayon::prelude::*;

use super::map::{Map, direction_at};
use super::moments::luminance;
use super::sun;

/// Number of columns and rows of the map. It resolves the aureole to a third of a degree, and the edge
/// between two rows lies on the horizon.
const SIZE: [u32; 2] = [1024, 512];

/// Luminance of a radiance of 1, cd/m². In this unit the sun of a clear noon has an I of about 3 and the sky
/// a radiance of about ½, as bright as the lights of the presets.
pub const UNIT_CD_M2: f64 = 10_000.0;

/// Factor from the model's radiance, W/(m²·sr) weighted by the eye's response, to the program's unit.
const SCALE: f64 = 683.0 / UNIT_CD_M2;

/// Parameters of a sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// Elevation of the sun above the horizon, degrees, 0 to 90.
    pub elevation: f32,
    /// Turbidity (haze) of the air, 1 (pure air) to 10.
    pub turbidity: f32,
    /// Albedo of the ground per colour, 0 to 1, linear RGB.
    pub ground: Vec3,
    /// Factor on the direct light of the sun.
    pub sun: f32,
}

/// Sky baked into a map.
pub struct BakedSky {
    /// Radiance of the sky and the ground, without the sun's disc.
    pub map: Map,
    /// Irradiance of the sun on a surface that faces it, with the factor, in the map's unit times sr.
    pub sun: DVec3,
}

impl Sky {
    /// Unit direction towards the sun in the map.
    pub fn to_sun(&self) -> DVec3 {
        let elevation = f64::from(self.elevation).to_radians();
        DVec3::new(0.0, elevation.sin(), -elevation.cos())
    }

    /// Evaluates the model. Negative values of its fit are replaced by 0. The ground is uniform and diffuse,
    /// lit by sky and sun.
    pub fn bake(&self) -> BakedSky {
        let elevation = self.elevation.to_radians().min(std::f32::consts::FRAC_PI_2);
        let params = SkyParams { elevation, turbidity: self.turbidity, albedo: self.ground.to_array() };
        // The parameter table allows only values in the model's range.
        let state = SkyState::new(&params)
            .unwrap_or_else(|e| panic!("the parameter table allows only the model's range: {e}"));
        let to_sun = self.to_sun();
        let [columns, rows] = SIZE.map(|n| n as usize);
        let mut texels = vec![[0.0f32; 4]; columns * rows];
        let horizon = rows / 2;
        texels.par_chunks_exact_mut(columns).take(horizon).enumerate().for_each(|(j, row)| {
            let v = (j as f64 + 0.5) / rows as f64;
            let theta = (v * std::f64::consts::PI) as f32;
            // Both halves are mirrored, so the sky is symmetric about the sun to the last bit.
            for i in 0..columns / 2 {
                let d = direction_at((i as f64 + 0.5) / columns as f64, v);
                let gamma = d.dot(to_sun).clamp(-1.0, 1.0).acos() as f32;
                let [r, g, b] = [Channel::R, Channel::G, Channel::B]
                    .map(|c| (f64::from(state.radiance(theta, gamma, c)) * SCALE).max(0.0) as f32);
                row[i] = [r, g, b, 0.0];
                row[columns - 1 - i] = row[i];
            }
        });
        let sun =
            sun::irradiance(f64::from(elevation), f64::from(self.turbidity)) * (SCALE * f64::from(self.sun));
        let ground = self.ground.as_dvec3() / std::f64::consts::PI
            * (irradiance_down(&texels, columns, rows) + sun * f64::from(elevation).sin());
        let ground = ground.as_vec3().extend(0.0).to_array();
        texels[horizon * columns..].fill(ground);
        BakedSky { map: Map { width: SIZE[0], height: SIZE[1], texels }, sun }
    }
}

/// Irradiance ∫ L·sin φ dω of the upper hemisphere on the ground.
fn irradiance_down(texels: &[[f32; 4]], columns: usize, rows: usize) -> DVec3 {
    let dtheta = std::f64::consts::TAU / columns as f64;
    let squared = |edge: usize| (std::f64::consts::PI * edge as f64 / rows as f64).cos().powi(2) / 2.0;
    let mut sum = DVec3::ZERO;
    for (j, row) in texels.chunks_exact(columns).take(rows / 2).enumerate() {
        let radiance: DVec3 = row.iter().map(|t| Vec3::from_slice(t).as_dvec3()).sum();
        sum += radiance * ((squared(j) - squared(j + 1)) * dtheta);
    }
    sum
}

/// Luminance, in cd/m², of a radiance in the program's unit.
pub fn luminance_cd_m2(radiance: Vec3) -> f64 {
    luminance(radiance.as_dvec3()) * UNIT_CD_M2
}
