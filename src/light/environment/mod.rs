//! §5 Environment light: a sky or a photographed map that forms the background and lights rock and water.
//!
//! One [`Map`] of radiance has three uses. It is the background. Nine [spherical harmonics](Irradiance) of it
//! light the rock. In the water, where visibility needs separate lights, a [`LightSet`] approximates it, and
//! [`Environment::error`] measures the approximation. The sun of a sky is not part of the map but a light of
//! its own.

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
pub use memo::{Baked, EnvironmentMemo};
pub use moments::{Beam, Cells, TERMS, luminance, of_map as moments_of_map};
pub use sky::{BakedSky, Sky, UNIT_CD_M2, luminance_cd_m2};
pub use sun::{ANGULAR_RADIUS, air_mass, irradiance as sun_irradiance};

use super::Light;
use crate::util::error::{Error, Result};

/// Source of an environment.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// Model of the clear sky.
    Sky(Sky),
    /// Equirectangular map in a file. The path is resolved and lies inside the allowed folders.
    File(PathBuf),
}

/// Settings of an environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Factor on all radiance, the sun's included.
    pub intensity: f32,
    /// Rotation about +y, from +z towards +x, degrees.
    pub turn: f32,
    /// Azimuth of the sun, from +z towards +x, degrees. Only a sky uses it.
    pub azimuth: f32,
    /// Maximum number of lights that approximate the map in the volume.
    pub lights: u32,
}

/// Environment light, ready to render.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Source of the map.
    pub source: Source,
    /// Radiance map without rotation and factor. Shared, so that a copy on a device is recognised by its
    /// address.
    pub map: Arc<Map>,
    /// Factor on the map's radiance.
    pub intensity: f32,
    /// Rotation of the map about +y, from +z towards +x, in turns, 0 to 1.
    pub turn: f32,
    /// E(n)/π of the map, with rotation and factor, without the sun.
    pub irradiance: Irradiance,
    /// The sun of a sky; `None` for a file or a sky without sun.
    pub sun: Option<Sun>,
    lights: u32,
    baked: Arc<Baked>,
}

/// The sun of a sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit vector towards the sun.
    pub to_sun: Vec3,
    /// Intensity I of a directional light: irradiance on a surface that faces the sun, divided by π.
    pub intensity: Vec3,
    /// Radiance of the disc.
    pub radiance: Vec3,
    /// Square of the chord on the unit sphere from the disc's centre to its rim.
    pub rim2: f32,
}

impl Environment {
    /// Takes an environment from the memo or bakes it. Reading a file may take at most `memory` bytes.
    ///
    /// # Errors
    /// Returns the errors of [`read_map`], and [`Error::Input`] if the radiance exceeds the range of float32.
    pub fn new(
        source: Source,
        settings: Settings,
        memo: &EnvironmentMemo,
        memory: u64,
    ) -> Result<Environment> {
        let baked = memo.baked(&source, memory)?;
        let mut degrees = f64::from(settings.turn);
        if let Source::Sky(_) = source {
            // The map of a sky has its sun at −z.
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
            // A turn just below 1 rounds to 1 in float32; `fract` maps it to 0.
            turn: (turn as f32).fract(),
            irradiance: Irradiance::new(&baked.moments, turn, factor),
            sun,
            lights: settings.lights,
            baked,
            source,
        };
        // A sum over the whole sphere is at most 4π times the brightest texel.
        let finite = (brightest * 16.0).is_finite() && sun.is_none_or(|s| s.radiance.is_finite());
        if !finite {
            return Err(Error::input(
                "the environment is infinitely bright",
                "lower environment.intensity or sky.sun",
            ));
        }
        Ok(environment)
    }

    /// Radiance along the unit direction `d`, the sun's disc included.
    pub fn radiance(&self, d: Vec3) -> Vec3 {
        let radiance = self.map.radiance(uv_of(d, self.turn)) * self.intensity;
        match &self.sun {
            // The ground hides the part of the disc below the horizon.
            Some(sun) if d.y > 0.0 && (d - sun.to_sun).dot(d - sun.to_sun) < sun.rim2 => {
                radiance + sun.radiance
            }
            _ => radiance,
        }
    }

    /// The sun as a directional light.
    pub fn sunlight(&self) -> Option<Light> {
        self.sun.map(|sun| Light::Directional { to_light: sun.to_sun, intensity: sun.intensity })
    }

    /// Lights that approximate the map in the volume, without the sun. Their I is irradiance/π; black ones
    /// are left out.
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

    /// Relative error of the irradiance from [`Environment::volume_lights`]; see [`LightSet::error`].
    pub fn error(&self) -> f64 {
        self.baked.error(self.lights)
    }

    /// Relative error of [`Environment::irradiance`], which lights the rock; see [`LightSet::error`].
    pub fn irradiance_error(&self) -> f64 {
        let unturned = Irradiance::new(&self.baked.moments, 0.0, 1.0);
        error_of(&self.baked.cells, |n| luminance(unturned.at(n.as_vec3()).as_dvec3()) * std::f64::consts::PI)
    }

    /// Description of the environment in one line.
    pub fn words(&self) -> String {
        let what = match &self.source {
            Source::Sky(_) => "sky",
            Source::File(_) => "map",
        };
        let Map { width, height, .. } = *self.map;
        let count = self.baked.lights(self.lights).lights.len();
        format!(
            "environment {what} of {width}×{height}: {count} lights in the water, \
             irradiance error {:.1} % (RMS)",
            100.0 * self.error()
        )
    }

    /// Warnings about the map's file, one line each; empty for a sky.
    pub fn warnings(&self) -> Vec<String> {
        let Source::File(path) = &self.source else { return Vec::new() };
        let path = path.display();
        let mut warnings: Vec<String> =
            self.baked.notes.iter().map(|note| format!("environment map {path}: {note}")).collect();
        if self.baked.negative > 0 {
            let n = self.baked.negative;
            warnings.push(format!("environment map {path}: {n} values below zero were replaced by 0"));
        }
        let Map { width, height, .. } = *self.map;
        if width != 2 * height {
            warnings.push(format!(
                "environment map {path} has {width}×{height} texels: \
                 an equirectangular map is twice as wide as it is high"
            ));
        }
        warnings
    }
}
