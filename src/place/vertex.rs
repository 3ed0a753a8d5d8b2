//! A vertex of opaque geometry.

use glam::Vec3;

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
    /// The vertex in the middle between two.
    pub(super) fn between(a: &Vertex, b: &Vertex) -> Vertex {
        let middle = |a: [f32; 3], b: [f32; 3]| (Vec3::from(a) + Vec3::from(b)) * 0.5;
        // Every field is named, so that none is forgotten.
        Vertex {
            position: middle(a.position, b.position).to_array(),
            normal: middle(a.normal, b.normal).normalize_or(a.normal.into()).to_array(),
            albedo: middle(a.albedo, b.albedo).to_array(),
            occlusion: 0.5 * (a.occlusion + b.occlusion),
            shadow: 0.5 * (a.shadow + b.shadow),
            wet: 0.5 * (a.wet + b.wet),
            pool: a.pool,
        }
    }

    /// Numbers that are interpolated over a triangle: normal, albedo, occlusion and shadow; and the film of
    /// water.
    #[inline]
    pub fn coat(&self) -> (&[f32; 8], f32) {
        let all: &[f32; 13] = bytemuck::cast_ref(self);
        (all[3..].first_chunk().expect("ten numbers"), self.wet)
    }
}
