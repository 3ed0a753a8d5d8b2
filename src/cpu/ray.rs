//! x
use crate::scene::{Mesh, Scene};
use crate::volume::VolumeTexture;
use glam::Vec3;
/// x
pub struct RayReport {}
impl RayReport {
    /// x
    pub fn surface_point(&self) -> Option<Vec3> {
        None
    }
}
/// x
pub fn inspect(_: &Scene, _: &VolumeTexture, _: &Mesh, _: [u32; 2]) -> RayReport {
    RayReport {}
}
