//! A vertex of opaque geometry.

/// A vertex of opaque geometry, as the raster pass reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// World position, metres.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Linear albedo of rock. A pool stores its depth (metres) and the density of its foam (0 to 1) here.
    pub albedo: [f32; 3],
    /// Share of the surroundings' light that is blocked, 0 to 1.
    pub occlusion: f32,
    /// Share of the light of [`Scene::shadow_light`](crate::scene::Scene::shadow_light) that is blocked,
    /// 0 to 1.
    pub shadow: f32,
    /// Strength of the film of water, 0 to 1.
    pub wet: f32,
    /// Number of the pool plus 1; 0 for rock.
    pub pool: u32,
}

impl Vertex {
    /// Numbers that are interpolated over a triangle: normal, albedo, occlusion and shadow; and the film of
    /// water.
    #[inline]
    pub fn coat(&self) -> (&[f32; 8], f32) {
        let all: &[f32; 13] = bytemuck::cast_ref(self);
        (all[3..].first_chunk().expect("ten numbers"), self.wet)
    }
}
