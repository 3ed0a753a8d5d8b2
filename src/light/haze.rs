//! Haze between the eye and what it sees: mist over the pool, air with distance.
//!
//! Its extinction is β(y) = β₀·e^(−(y − y₀)/H), or β₀ everywhere, and it glows by itself in one colour. Along
//! a ray the optical depth has a closed form (Quílez, "Better Fog", 2010; Wenzel, "Real-Time Atmospheric
//! Effects in Games", 2006): τ(t) = β(eye)·t·(1 − e^(−x))/x with x = d_y·t/H. What is seen through it is
//! L·e^(−τ) + colour·(1 − e^(−τ)).

use glam::Vec3;

/// Densest haze about an eye, 1/m: where an eye far below y₀ would meet more it is blind anyway.
const DENSEST: f64 = 1e6;
/// Below this x the quotient is a series, to 4·10⁻⁸.
const SERIES: f32 = 1e-2;
/// Least x: e⁶⁰ is finite, and of what lies behind nothing is left.
const LEAST_X: f32 = -60.0;

/// Haze as the scene describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Haze {
    /// β₀, 1/m; 0: there is none.
    pub density: f32,
    /// Radiance of endless haze.
    pub color: Vec3,
    /// H, metres; 0: it is the same at every height.
    pub height: f32,
    /// y₀, metres.
    pub level: f32,
    /// Metres of it before the background; 0: the background is seen as it is.
    pub far: f32,
}

/// Haze as seen from one eye. Twin: `shaders/light/haze.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeHaze {
    /// β at the eye, 1/m.
    pub density: f32,
    /// 1/H, or 0.
    pub falloff: f32,
    /// Radiance of endless haze.
    pub color: Vec3,
    /// Metres of it before the background.
    pub far: f32,
}

impl Haze {
    /// Returns the haze as seen from `eye`.
    pub fn seen_from(&self, eye: Vec3) -> EyeHaze {
        let falloff = if self.height > 0.0 { 1.0 / f64::from(self.height) } else { 0.0 };
        let above = (f64::from(eye.y) - f64::from(self.level)) * falloff;
        let density = (f64::from(self.density) * (-above).exp()).min(DENSEST);
        EyeHaze {
            // What no float32 holds is none.
            density: if density < f64::from(f32::MIN_POSITIVE) { 0.0 } else { density as f32 },
            falloff: falloff as f32,
            color: self.color,
            far: self.far,
        }
    }
}

impl EyeHaze {
    /// e^(−τ) over `t` metres along a unit direction that climbs by `d_y` a metre.
    pub fn transmittance(&self, d_y: f32, t: f32) -> f32 {
        let x = (d_y * t * self.falloff).max(LEAST_X);
        let mean = if x.abs() < SERIES { 1.0 - x * (0.5 - x * (1.0 / 6.0)) } else { (1.0 - (-x).exp()) / x };
        (-(self.density * t * mean)).exp()
    }

    /// Opaque matter, or the background, through what is left by `transmittance`.
    pub fn over(&self, radiance: Vec3, transmittance: f32) -> Vec3 {
        radiance * transmittance + self.color * (1.0 - transmittance)
    }

    /// Water of which `seen` is all that comes to the eye, `behind`·T of it from behind, where that has its
    /// haze already: the water's own light dims, and the haze before it shines where the water hides the one
    /// behind.
    pub fn over_water(&self, seen: Vec3, behind: Vec3, through: f32, transmittance: f32) -> Vec3 {
        let passed = behind * through;
        (seen - passed) * transmittance + passed + self.color * ((1.0 - through) * (1.0 - transmittance))
    }
}
