//! §5 Lights, and what is seen where nothing is.

use glam::Vec3;

use crate::util::words::words;

/// A light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// From infinitely far: unit vector towards it, radiance factor I.
    Directional {
        /// Unit vector towards the light.
        to_light: Vec3,
        /// Colour × intensity.
        intensity: Vec3,
    },
    /// From a point: I at 1 m, falling with the square of the distance.
    Point {
        /// Metres.
        position: Vec3,
        /// Colour × intensity, at 1 m.
        intensity: Vec3,
    },
    /// From a point into a cone: inside it as a point light.
    Spot {
        /// Metres.
        position: Vec3,
        /// Colour × intensity, at 1 m.
        intensity: Vec3,
        /// Cone that the light fills.
        cone: Cone,
    },
}

/// Kind of a [`Light`], without its position, direction and intensity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightKind {
    /// [`Light::Directional`].
    Directional,
    /// [`Light::Point`].
    Point,
    /// [`Light::Spot`].
    Spot,
}

words! { LightKind { Directional => "directional", Point => "point", Spot => "spot" } }

impl Light {
    /// Returns the kind of the light.
    pub fn kind(&self) -> LightKind {
        match self {
            Light::Directional { .. } => LightKind::Directional,
            Light::Point { .. } => LightKind::Point,
            Light::Spot { .. } => LightKind::Spot,
        }
    }
}

/// The cone of a spot light. With c the cosine of the angle between the beam and the way to a point, and
/// s = (c − `cos_edge`)·`inverse_soft` clamped to 0..1, its light is s²(3 − 2s) of a point light's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit, against the beam.
    pub axis: Vec3,
    /// Cosine of the half angle.
    pub cos_edge: f32,
    /// 1 / (cosine where the full light begins − `cos_edge`).
    pub inverse_soft: f32,
}

impl Cone {
    /// Around the unit vector `axis`, with a half angle in degrees of which the outer share `softness` (0 to
    /// 1) is the way from full light to none.
    pub fn new(axis: Vec3, angle: f32, softness: f32) -> Self {
        let cosine = |degrees: f64| degrees.to_radians().cos();
        let (edge, full) = (cosine(angle as f64), cosine(angle as f64 * (1.0 - softness as f64)));
        // A hard edge is a thousandth of a degree wide at most.
        let inverse_soft = (1.0 / (full - edge).max(1e-7)) as f32;
        Cone { axis, cos_edge: edge as f32, inverse_soft }
    }
}

/// Radiance where nothing is seen: horizon + (zenith − horizon)·max(0, d·y).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background {
    /// Straight up.
    pub zenith: Vec3,
    /// At and below the horizon.
    pub horizon: Vec3,
}

impl Background {
    /// Radiance along a unit direction.
    pub fn radiance(&self, d: Vec3) -> Vec3 {
        self.horizon + (self.zenith - self.horizon) * d.y.max(0.0)
    }
}
