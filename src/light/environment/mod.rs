//! The light of the surroundings: a sky or a picture of somewhere, seen where nothing is, lighting rock and
//! water.
//!
//! One [`Map`] of radiance serves three ways. The background is the map itself. Rock takes its irradiance
//! from nine [spherical harmonics](Irradiance). Water is walked through towards lights, so there a
//! [`LightSet`] stands for the map, and how far it is off is [measured](Environment::error). The sun of a sky
//! is none of this but a light of its own.

mod file;
mod irradiance;
mod lights;
mod map;
mod memo;
mod moments;
mod overview;
mod sky;
mod sun;

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Vec3};

pub use file::{FileMap, MAX_RADIANCE, read as read_map};
pub use irradiance::Irradiance;
pub use lights::{LightSet, error_of};
pub use map::{ARCTAN, Map, angle_of, direction_at, uv_of};
pub use memo::{Baked, EnvironmentStock};
pub use moments::{Beam, Cells, TERMS, luminance, of_map as moments_of_map};
pub use sky::{BakedSky, Sky, UNIT_CD_M2, luminance_cd_m2};
pub use sun::{ANGULAR_RADIUS, air_mass, irradiance as sun_irradiance};

use super::Light;
use crate::util::error::{Error, Result};

/// What an environment is made from.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// The clear sky.
    Sky(Sky),
    /// An equirectangular map, resolved and inside the allowed folders.
    File(PathBuf),
}

/// How it is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Factor on everything, the sun included.
    pub intensity: f32,
    /// Degrees about +y, from +z towards +x.
    pub turn: f32,
    /// The sun's direction in the same sense, degrees from +z; of a sky only.
    pub azimuth: f32,
    /// Most lights that stand for the map in the volume.
    pub lights: u32,
}

/// The light of the surroundings.
#[derive(Clone, Debug)]
pub struct Environment {
    /// What it was made from.
    pub source: Source,
    /// Radiance, shared: who keeps it on a device knows it again by its memory.
    pub map: Arc<Map>,
    /// Factor on the map's radiance.
    pub intensity: f32,
    /// How far the map is turned about +y, from +z towards +x; once round is 1. 0 to 1.
    pub turn: f32,
    /// E(n)/π of the map, turned and with the factor.
    pub irradiance: Irradiance,
    /// The sun, where there is one.
    pub sun: Option<Sun>,
    lights: u32,
    baked: Arc<Baked>,
}

/// The sun of a sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit.
    pub to_sun: Vec3,
    /// Irradiance on a surface that faces it, divided by π: the I of a directional light.
    pub intensity: Vec3,
    /// Radiance of its disc.
    pub radiance: Vec3,
    /// Square of the distance on the unit sphere from its middle to its rim.
    pub rim2: f32,
}

impl Environment {
    /// Takes it from the stock, or makes it; a file of at most `memory` bytes.
    ///
    /// # Errors
    /// Those of [`read_map`], and [`Error::Input`] where it would be infinitely bright.
    pub fn new(
        source: Source,
        settings: Settings,
        stock: &EnvironmentStock,
        memory: u64,
    ) -> Result<Environment> {
        let baked = stock.baked(&source, memory)?;
        let mut degrees = f64::from(settings.turn);
        if let Source::Sky(_) = source {
            // Its map has the sun at −z.
            degrees += f64::from(settings.azimuth) + 180.0;
        }
        let turn = (degrees / 360.0).rem_euclid(1.0);
        let factor = f64::from(settings.intensity);
        let sun = match &source {
            Source::Sky(sky) if baked.sun != DVec3::ZERO && factor > 0.0 => {
                let rim = 2.0 * (0.5 * ANGULAR_RADIUS).sin();
                let solid_angle = std::f64::consts::PI * rim * rim;
                Some(Sun {
                    to_sun: lights::turned(sky.to_sun(), turn),
                    intensity: (baked.sun * (factor / std::f64::consts::PI)).as_vec3(),
                    radiance: (baked.sun * (factor / solid_angle)).as_vec3(),
                    rim2: (rim * rim) as f32,
                })
            }
            _ => None,
        };
        let brightest = baked.brightest * settings.intensity;
        let environment = Environment {
            map: baked.map.clone(),
            intensity: settings.intensity,
            // 1 − 1e-9 is 1 in float32, which is 0.
            turn: (turn as f32).fract(),
            irradiance: Irradiance::new(&baked.moments, turn, factor),
            sun,
            lights: settings.lights,
            baked,
            source,
        };
        // What adds up all of it is 4π brighter than the brightest texel at most.
        let finite = (brightest * 16.0).is_finite() && sun.is_none_or(|s| s.radiance.is_finite());
        if !finite {
            return Err(Error::input(
                "the environment is infinitely bright",
                "lower environment.intensity or sky.sun",
            ));
        }
        Ok(environment)
    }

    /// Radiance along a unit direction, the sun's disc included.
    pub fn radiance(&self, d: Vec3) -> Vec3 {
        let radiance = self.map.radiance(uv_of(d, self.turn)) * self.intensity;
        match &self.sun {
            // The ground hides what of the disc is below the horizon.
            Some(sun) if d.y > 0.0 && (d - sun.to_sun).dot(d - sun.to_sun) < sun.rim2 => {
                radiance + sun.radiance
            }
            _ => radiance,
        }
    }

    /// The sun as a light.
    pub fn sunlight(&self) -> Option<Light> {
        self.sun.map(|sun| Light::Directional { to_light: sun.to_sun, intensity: sun.intensity })
    }

    /// The lights that stand for the map in the volume, without the sun: I is irradiance/π.
    pub fn volume_lights(&self) -> Vec<Light> {
        let factor = f64::from(self.intensity) / std::f64::consts::PI;
        let lights = self.baked.lights(self.lights);
        let lights = lights.lights.iter().map(|(to_light, irradiance)| Light::Directional {
            to_light: lights::turned(*to_light, f64::from(self.turn)),
            intensity: (*irradiance * factor).as_vec3(),
        });
        let lit =
            |light: &Light| matches!(light, Light::Directional { intensity, .. } if *intensity != Vec3::ZERO);
        lights.filter(lit).collect()
    }

    /// How far the irradiance of [`Environment::volume_lights`] is from the map's: see [`LightSet::error`].
    pub fn error(&self) -> f64 {
        self.baked.error(self.lights)
    }

    /// The same of [`Environment::irradiance`], which lights the rock.
    pub fn irradiance_error(&self) -> f64 {
        let unturned = Irradiance::new(&self.baked.moments, 0.0, 1.0);
        error_of(&self.baked.cells, |n| luminance(unturned.at(n.as_vec3()).as_dvec3()) * std::f64::consts::PI)
    }

    /// One line about it.
    pub fn words(&self) -> String {
        let what = match &self.source {
            Source::Sky(_) => "sky",
            Source::File(_) => "map",
        };
        let Map { width, height, .. } = *self.map;
        let count = self.baked.lights(self.lights).lights.len();
        format!(
            "environment {what} of {width}×{height}: {count} lights in the water, \
             {:.1} % off its irradiance (RMS)",
            100.0 * self.error()
        )
    }

    /// What is odd about its file.
    pub fn warnings(&self) -> Vec<String> {
        let Source::File(path) = &self.source else { return Vec::new() };
        let path = path.display();
        let mut warnings = Vec::new();
        if self.baked.negative > 0 {
            let n = self.baked.negative;
            warnings.push(format!("environment map {path}: {n} values below zero were taken as 0"));
        }
        let Map { width, height, .. } = *self.map;
        if width != 2 * height {
            warnings.push(format!(
                "environment map {path} has {width}×{height} texels: \
                 an equirectangular one is twice as wide as high"
            ));
        }
        warnings
    }
}
