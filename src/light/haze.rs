//! Haze between the eye and the scene: mist over the pool, or air over a distance.
//!
//! The extinction is β(y) = β₀·e^(−(y − y₀)/H), or β₀ everywhere. The haze emits one colour. The optical
//! depth along a ray has a closed form (Quílez, "Better Fog", 2010; Wenzel, "Real-Time Atmospheric Effects in
//! Games", 2006): τ(t) = β(eye)·t·(1 − e^(−x))/x with x = d_y·t/H. A surface of radiance L appears as
//! L·e^(−τ) + colour·(1 − e^(−τ)).

use glam::{DVec3, Vec3};

/// Maximum extinction at the eye, 1/m. An eye so far below y₀ that β exceeds it sees only haze anyway.
const DENSEST: f64 = 1e6;
/// |x| below which (1 − e^(−x))/x is computed from its series, with an error of 4·10⁻⁸.
pub const SERIES: f32 = 1e-2;
/// Minimum of x: e⁶⁰ is finite in float32, and the haze is opaque there.
pub const LEAST_X: f32 = -60.0;

/// Haze of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Haze {
    /// β₀, 1/m; 0 means no haze.
    pub density: f32,
    /// Radiance of infinitely thick haze, linear RGB.
    pub color: Vec3,
    /// Scale height H, metres; 0 means the same density at every height.
    pub height: f32,
    /// Height y₀ at which the extinction is β₀, metres.
    pub level: f32,
    /// Metres of haze in front of the background; 0 means a clear background.
    pub far: f32,
}

/// Haze as seen from one eye position. Twin: `shaders/light/haze.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeHaze {
    /// β at the eye, 1/m.
    pub density: f32,
    /// 1/H, 1/m; 0 where the density is the same at every height.
    pub falloff: f32,
    /// Radiance of infinitely thick haze, linear RGB.
    pub color: Vec3,
    /// Metres of haze in front of the background; 0 means a clear background.
    pub far: f32,
}

impl Haze {
    /// Haze as seen from `eye`, a position in metres.
    pub fn seen_from(&self, eye: DVec3) -> EyeHaze {
        let falloff = if self.height > 0.0 { 1.0 / f64::from(self.height) } else { 0.0 };
        let above = (eye.y - f64::from(self.level)) * falloff;
        let density = (f64::from(self.density) * (-above).exp()).min(DENSEST);
        EyeHaze {
            // A subnormal density counts as no haze.
            density: if density < f64::from(f32::MIN_POSITIVE) { 0.0 } else { density as f32 },
            falloff: falloff as f32,
            color: self.color,
            far: self.far,
        }
    }
}

impl EyeHaze {
    /// Transmittance e^(−τ) over `t` metres along a unit direction with the y component `d_y`.
    pub fn transmittance(&self, d_y: f32, t: f32) -> f32 {
        let x = (d_y * t * self.falloff).max(LEAST_X);
        let mean = if x.abs() < SERIES { 1.0 - x * (0.5 - x * (1.0 / 6.0)) } else { (1.0 - (-x).exp()) / x };
        (-(self.density * t * mean)).exp()
    }

    /// Radiance of water and its backdrop, seen through haze of this transmittance.
    ///
    /// `seen` is the radiance without haze in front of the water. It contains `behind`·`through`, the share
    /// of the backdrop that the water lets through; `behind` already has its haze. The haze dims the water's
    /// own light. It adds its own light to the share that the water hides, because the haze of `behind`
    /// covers the rest.
    pub fn over_water(&self, seen: Vec3, behind: Vec3, through: f32, transmittance: f32) -> Vec3 {
        let passed = behind * through;
        (seen - passed) * transmittance + passed + self.color * ((1.0 - through) * (1.0 - transmittance))
    }
}
