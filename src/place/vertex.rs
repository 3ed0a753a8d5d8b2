//! A vertex of opaque geometry.

/// A vertex of opaque geometry, as the raster pass reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// World position, metres.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Linear albedo; of a pool its depth in metres and how dense its foam is, 0 to 1.
    pub albedo: [f32; 3],
    /// Share of the surroundings' light that does not arrive, 0 to 1.
    pub occlusion: f32,
    /// Share of the light of [`Scene::shadow_light`](crate::scene::Scene::shadow_light) that does not arrive,
    /// 0 to 1.
    pub shadow: f32,
    /// How much of a film of water there is, 0 to 1.
    pub wet: f32,
    /// Number of the pool plus 1; 0: rock.
    pub pool: u32,
}
