//! §3 A quad of the surface and the mapping of the volume onto it.

use glam::{Vec2, Vec3};

use super::{Material, QuadFault, QuadMap};

/// A quad with its material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// Corners A, B, C and D in the world, metres.
    pub corners: [Vec3; 4],
    /// Map between the quad's plane and (u, v).
    pub map: QuadMap,
    /// Repetition and depth of the volume.
    pub material: Material,
    /// Texture position of corner A, in copies of the volume along u and v.
    pub offset: Vec2,
    /// Erosion e at A, B, C and D, interpolated bilinearly. It reduces ρ to max(ρ − e, 0).
    pub erosion: [f32; 4],
    /// Ψ of droplets, which have no direction; replaces Ψ of the cells. 0: the cells' own Ψ is used.
    pub mist: f32,
}

impl Quad {
    /// Builds a single quad without texture offset, erosion or mist.
    ///
    /// # Errors
    /// A [`QuadFault`] if the corners do not form a convex planar quad.
    pub fn new(corners: [Vec3; 4], material: Material) -> std::result::Result<Quad, QuadFault> {
        let map = QuadMap::new(corners)?;
        Ok(Quad { corners, map, material, offset: Vec2::ZERO, erosion: [0.0; 4], mist: 0.0 })
    }
}
