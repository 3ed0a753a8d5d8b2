//! §5 Lights, and the background.

use glam::Vec3;

use crate::util::words::words;

/// A light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// A light infinitely far away; its intensity is I = irradiance / π.
    Directional {
        /// Unit vector towards the light.
        to_light: Vec3,
        /// I: colour × intensity, linear RGB.
        intensity: Vec3,
    },
    /// A point light: I at a distance of 1 m, falling with the square of the distance.
    Point {
        /// Position in the world, metres.
        position: Vec3,
        /// I at 1 m: colour × intensity, linear RGB.
        intensity: Vec3,
    },
    /// A spot light: a point light restricted to a cone.
    Spot {
        /// Position in the world, metres.
        position: Vec3,
        /// I at 1 m: colour × intensity, linear RGB.
        intensity: Vec3,
        /// Cone that the light shines into.
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

    /// Returns the light with another intensity.
    pub fn with_intensity(self, intensity: Vec3) -> Light {
        match self {
            Light::Directional { to_light, .. } => Light::Directional { to_light, intensity },
            Light::Point { position, .. } => Light::Point { position, intensity },
            Light::Spot { position, cone, .. } => Light::Spot { position, intensity, cone },
        }
    }

    /// Returns the distance of the light from a point, metres; infinite for a directional light.
    pub fn distance(&self, point: Vec3) -> f32 {
        match self {
            Light::Directional { .. } => f32::INFINITY,
            Light::Point { position, .. } | Light::Spot { position, .. } => position.distance(point),
        }
    }

    /// Returns the unit direction from a point to the light, and the light's intensity at the point. Twin:
    /// `light_from` of `shaders/layout.wgsl`.
    pub fn at(&self, point: Vec3) -> (Vec3, Vec3) {
        match *self {
            Light::Directional { to_light, intensity } => (to_light, intensity),
            Light::Point { position, intensity } => {
                let (to_light, falloff) = from_point(position, point);
                (to_light, intensity * falloff)
            }
            Light::Spot { position, intensity, cone } => {
                let (to_light, falloff) = from_point(position, point);
                let s = ((cone.axis.dot(to_light) - cone.cos_edge) * cone.inverse_soft).clamp(0.0, 1.0);
                (to_light, intensity * (falloff * (s * s * (3.0 - 2.0 * s))))
            }
        }
    }
}

/// Returns the unit direction from `point` to a light at `position`, and the falloff 1/d² there.
fn from_point(position: Vec3, point: Vec3) -> (Vec3, f32) {
    let away = position - point;
    let d2 = away.dot(away).max(1e-12);
    (away / d2.sqrt(), 1.0 / d2)
}

/// The cone of a spot light.
///
/// Inside the cone a point receives the share s²(3 − 2s) of a point light's intensity. Here s = (c −
/// `cos_edge`)·`inverse_soft`, clamped to 0..1, and c is the cosine of the angle between the beam and the
/// direction from the light to the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit vector against the beam.
    pub axis: Vec3,
    /// Cosine of the half angle, at which the light reaches zero.
    pub cos_edge: f32,
    /// 1 / (cosine of the angle at which the full light begins − `cos_edge`).
    pub inverse_soft: f32,
}

impl Cone {
    /// Cone around the unit vector `axis` with the half angle `angle` in degrees. The light falls from full
    /// to zero over the outer share `softness` (0 to 1) of the half angle.
    pub fn new(axis: Vec3, angle: f32, softness: f32) -> Self {
        let cosine = |degrees: f64| degrees.to_radians().cos();
        let (edge, full) = (cosine(angle as f64), cosine(angle as f64 * (1.0 - softness as f64)));
        // The bound keeps the quotient finite. It makes a hard edge at most a thousandth of a degree wide.
        let inverse_soft = (1.0 / (full - edge).max(1e-7)) as f32;
        Cone { axis, cos_edge: edge as f32, inverse_soft }
    }
}

/// Background: radiance horizon + (zenith − horizon)·max(0, d·y) along the unit direction d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background {
    /// Radiance straight up, linear RGB.
    pub zenith: Vec3,
    /// Radiance at and below the horizon, linear RGB.
    pub horizon: Vec3,
}
