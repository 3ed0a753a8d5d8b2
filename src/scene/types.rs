//! What a scene is made of.

use glam::{Vec2, Vec3};

use crate::error::Result;
use crate::mapping::{Material, QuadFault, QuadMap};
use crate::strand::StrandParams;

/// A quad with its material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// A, B, C, D in the world.
    pub corners: [Vec3; 4],
    /// The quad in its plane.
    pub map: QuadMap,
    /// How the volume lies on it.
    pub material: Material,
    /// Where in the texture A is, copies of the volume along u and v.
    pub offset: Vec2,
    /// e at A, B, C and D, bilinear between: of ρ max(ρ − e, 0) is left.
    pub erosion: [f32; 4],
    /// Ψ of droplets that have no direction, in place of the cells'; 0: a quad of cells.
    pub mist: f32,
}

impl Quad {
    /// A quad by itself: with the whole texture, and all of ρ.
    ///
    /// # Errors
    /// Where the corners are those of no quad.
    pub fn new(corners: [Vec3; 4], material: Material) -> std::result::Result<Quad, QuadFault> {
        let map = QuadMap::new(corners)?;
        Ok(Quad { corners, map, material, offset: Vec2::ZERO, erosion: [0.0; 4], mist: 0.0 })
    }
}

/// A light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// From infinitely far: unit vector towards it, radiance factor I.
    Directional {
        /// Unit.
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
        /// Where it shines.
        cone: Cone,
    },
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
    /// Around the unit vector `axis`, with a half angle in degrees of which the outer share `softness` (0 to 1) is
    /// the way from full light to none.
    pub fn new(axis: Vec3, angle: f32, softness: f32) -> Self {
        let cosine = |degrees: f64| degrees.to_radians().cos();
        let (edge, full) = (cosine(angle as f64), cosine(angle as f64 * (1.0 - softness as f64)));
        // A hard edge is a thousandth of a degree wide at most.
        let inverse_soft = (1.0 / (full - edge).max(1e-7)) as f32;
        Cone { axis, cos_edge: edge as f32, inverse_soft }
    }
}

/// How view rays go through the volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trace {
    /// τ_k of a cell.
    pub attenuation: Attenuation,
    /// Most cells of one ray.
    pub max_cells: u32,
    /// A ray ends where T falls below this; 0: never.
    pub early_end: f32,
    /// Most sheets one ray goes through.
    pub layers: u32,
    /// Whether far away coarser levels of the volume are walked.
    pub filter: Prefilter,
    /// What a ray finds in a cell.
    pub lookup: Lookup,
}

/// How views that see many cells in one pixel are kept from aliasing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prefilter {
    /// They are not.
    None,
    /// By levels of fewer cells, the two that suit the pixel's footprint.
    Pyramid,
}

/// What a ray finds in a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lookup {
    /// The cell's own.
    Nearest,
    /// At the middle of its way through the cell, what lies between the centres of eight cells.
    Trilinear,
}

/// τ_k of a cell with density ρ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Attenuation {
    /// σ·ρ·Δs, σ in 1/m.
    PathLength {
        /// Extinction at ρ = 1, 1/m.
        sigma: f32,
    },
    /// τ·ρ.
    PerCell {
        /// Optical depth at ρ = 1.
        tau: f32,
    },
}

/// Where the fibre model's angles are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AngleFrame {
    /// t = normalize(J v) against world vectors.
    World,
    /// v against J⁻¹l and J⁻¹e, normalised: the paper's.
    Texture,
}

/// V_i(k).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// 1.
    None,
    /// Exact walk from the cell's centre to the light.
    March,
    /// The same, walked once for every cell of the volume and kept.
    Cached,
}

/// How a cell reflects light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reflection {
    /// The paper's: fibres with the coefficients of the cell.
    KajiyaKay,
    /// Strands of water and air.
    Strand(StrandParams),
}

/// How often light may be scattered on its way through the volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scattering {
    /// Once.
    Single,
    /// As often as it is.
    Multiple,
}

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Metres.
    pub eye: Vec3,
    /// Unit, to the right of the image.
    pub right: Vec3,
    /// Unit, up in the image.
    pub up: Vec3,
    /// Unit, into the image.
    pub forward: Vec3,
    /// Tangent of half the vertical field of view.
    pub tan_half_fov: f32,
    /// Near plane, metres along `forward`.
    pub near: f32,
}

/// Radiance where nothing is seen: horizon + (zenith − horizon)·max(0, d·y).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background {
    /// Straight up.
    pub zenith: Vec3,
    /// At and below the horizon.
    pub horizon: Vec3,
}

/// The picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Image {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Samples a pixel.
    pub samples: u32,
    /// Where they lie about the pixel.
    pub filter: Filter,
    /// How far rock may be off for the sake of fewer triangles, in distances between samples.
    pub rock_error: f32,
    /// How the PNG is made from the radiance.
    pub look: Look,
}

/// How a picture is made from linear radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Stops.
    pub exposure: f32,
    /// How more of them are chosen, [`crate::exposure`].
    pub auto_exposure: AutoExposure,
    /// Share of the light that is spread around bright things.
    pub bloom: f32,
    /// σ of the widest spread, in heights of the image.
    pub bloom_radius: f32,
    /// Colour temperature that is adapted to 6500 K, kelvin.
    pub temperature: f32,
    /// Its distance from the black body's curve, thousandths of Duv.
    pub tint: f32,
    /// Tone curve.
    pub tone: Tone,
}

/// How an exposure is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AutoExposure {
    /// By hand.
    None,
    /// The logarithmic mean of the luminance becomes middle grey.
    Average,
    /// The brightest hundredth begins at 1.
    Highlights,
}

/// How the samples of a pixel are weighed, by where they are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Evenly over the pixel.
    Box,
    /// σ of half a pixel, cut at 1½.
    Gaussian,
    /// The window of Blackman and Harris (1978), three pixels wide.
    BlackmanHarris,
}

/// Tone curve of the PNG.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Clamp only.
    None,
    /// Narkowicz 2015.
    Filmic,
    /// Sobotka 2022.
    Agx,
}

impl Image {
    /// Pictures are made in parts: refused are those of which no part fits.
    pub(super) fn check_budget(&self, memory: u64) -> Result<()> {
        crate::job::check_image(self, memory)
    }
}

impl Background {
    /// Radiance along a unit direction.
    pub fn radiance(&self, d: Vec3) -> Vec3 {
        self.horizon + (self.zenith - self.horizon) * d.y.max(0.0)
    }
}
