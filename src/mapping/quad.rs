//! §3 Quads of the surface that carry the volume.

use glam::{Vec2, Vec3};

use super::{Material, QuadFault, QuadMap};

/// Quad with its material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// Corners A, B, C, D in the world, metres.
    pub corners: [Vec3; 4],
    /// Map of the quad in its plane.
    pub map: QuadMap,
    /// Layout of the volume's copies on the quad.
    pub material: Material,
    /// Texture position of corner A, in copies of the volume along u and v.
    pub offset: Vec2,
    /// Erosion e at A, B, C and D, bilinear between them. It leaves max(ρ − e, 0) of the density ρ.
    pub erosion: [f32; 4],
    /// Ψ of mist, which replaces that of the cells. With 0 the quad is not mist.
    pub mist: f32,
}

impl Quad {
    /// Quad that begins at the texture's origin and has no erosion and no mist. `corners` are in the world,
    /// metres.
    ///
    /// # Errors
    /// Returns the [`QuadFault`] of corners that cannot be mapped.
    pub fn new(corners: [Vec3; 4], material: Material) -> std::result::Result<Quad, QuadFault> {
        let map = QuadMap::new(corners)?;
        Ok(Quad { corners, map, material, offset: Vec2::ZERO, erosion: [0.0; 4], mist: 0.0 })
    }
}
