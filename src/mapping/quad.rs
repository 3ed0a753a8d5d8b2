//! §3 A quad of the surface, and how the volume lies on it.

use glam::{Vec2, Vec3};

use super::{Material, QuadFault, QuadMap};

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
