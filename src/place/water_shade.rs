//! Shade on falling water: the shares of the sky's and of the sun's light that rocks and meshes hide from it,
//! at the corners of its quads.

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::rock::shade::{Blocked, SUN_RAYS, SkyShade, SunShade, beside};
use super::rock::veil::{Veil, WATER_COVER};
use crate::mapping::Quad;
use crate::trace::tear;

/// Version of the shade on water, a part of its cache key. Raise it with every change to its values.
pub const WATER_SHADE_VERSION: u32 = 1;

/// Distance of the points where light is measured from the water, in sides of a quad. Water runs through the
/// bumps of the rock, where it would be dark.
const CLEAR: f32 = 0.3;

/// Falling water that takes shade and casts a shadow.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShadedWater {
    /// Share of the surroundings' light that the water loses where rock hides them all, 0 to 1.
    pub occlusion: f32,
    /// Share of the sun's light that it loses in the shadow, and strength of its own shadow, 0 to 1.
    pub shadow: f32,
    /// All quads; empty if both strengths are 0.
    pub veils: Vec<Veil>,
}

/// Shares of light that a quad loses, each at (0, 0), (1, 0), (1, 1) and (0, 1) of its map. They are bilinear
/// between.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct QuadShade {
    /// Share of the light of the surroundings.
    pub occlusion: [f32; 4],
    /// Share of the light of [`Scene::shadow_light`](crate::scene::Scene::shadow_light).
    pub shadow: [f32; 4],
}

impl QuadShade {
    /// Shares of both that are left at `uv`. Twin: `light_left` of
    /// `shaders/engine/integrate_light.wgsl`.
    #[inline]
    pub fn left(&self, uv: Vec2) -> [f32; 2] {
        [self.occlusion, self.shadow].map(|[a, b, c, d]| {
            let near = a + (b - a) * uv.x;
            let far = d + (c - d) * uv.x;
            1.0 - (near + (far - near) * uv.y).clamp(0.0, 1.0)
        })
    }
}

impl Veil {
    /// Light that a quad hides. Mist hides none.
    pub fn of(quad: &Quad) -> Veil {
        let torn = quad.tear.open.map(tear::mean);
        let is_water = quad.mist == 0.0;
        let cover =
            |worn: f32, torn: f32| if is_water { WATER_COVER * (1.0 - worn) * (1.0 - torn) } else { 0.0 };
        let [a, b, c, d] = quad.worn;
        let cover = [cover(a, torn[0]), cover(b, torn[0]), cover(c, torn[1]), cover(d, torn[1])];
        let map = &quad.map;
        let uv = |p: Vec3| {
            let away = p - map.a_world;
            let away = Vec2::new(away.dot(map.e1_world), away.dot(map.e2_world));
            map.uv_and_det(away).0
        };
        let uv = match quad.is_triangle() {
            true => quad.corners.map(uv),
            false => [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        };
        Veil { corners: quad.corners, uv, normal: map.n_world, cover }
    }

    /// Side of a square as large as the quad, metres.
    fn side(&self) -> f32 {
        let [a, b, c, d] = self.corners;
        (0.5 * (c - a).cross(d - b).length()).sqrt()
    }

    /// Values at the corners of the map, given those at the corners of what is drawn.
    fn on_map(&self, [a, b, c, d]: [f32; 4]) -> [f32; 4] {
        if !self.is_triangle() {
            return [a, b, c, d];
        }
        let [at_a, at_b, at_c, _] = self.uv;
        let (ab, ac) = (at_b - at_a, at_c - at_a);
        let det = ab.perp_dot(ac);
        [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(|uv| {
            let away = uv - at_a;
            a + ((b - a) * away.perp_dot(ac) + (c - a) * ab.perp_dot(away)) / det
        })
    }
}

/// A corner that several quads may share.
#[derive(Clone, Copy, Default)]
struct Corner {
    /// Sum of the normals.
    normal: Vec3,
    /// Side of the smallest quad, metres.
    side: f32,
}

impl ShadedWater {
    /// Shade of each quad. Corners that several quads share have the same in all of them.
    pub fn shades<F: Blocked, G: Blocked>(
        &self,
        sky: Option<&SkyShade<F>>,
        sun: Option<&SunShade<G>>,
    ) -> Vec<QuadShade> {
        let key = |p: Vec3| p.to_array().map(f32::to_bits);
        let mut corners: HashMap<[u32; 3], Corner> = HashMap::new();
        for veil in &self.veils {
            for p in veil.corners {
                let corner =
                    corners.entry(key(p)).or_insert(Corner { side: f32::INFINITY, ..Corner::default() });
                corner.normal += veil.normal;
                corner.side = corner.side.min(veil.side());
            }
        }
        let shade = |(at, Corner { normal, side }): (&[u32; 3], &Corner)| {
            let (point, n) = (Vec3::from(at.map(f32::from_bits)), normal.normalize_or(Vec3::Y));
            // Water is thin: light comes from both sides.
            let sides = [n * (CLEAR * side), n * (-CLEAR * side)];
            let most = |seen: &dyn Fn(Vec3) -> f32| sides.map(seen).into_iter().fold(0.0, f32::max);
            let of_sky = sky.map_or(1.0, |sky| most(&|out| sky.seen(point + out)));
            let of_sun = sun.map_or(1.0, |sun| {
                let around = (0..SUN_RAYS).map(|i| beside(point, n, i, *side));
                around.map(|point| most(&|out| sun.seen(point + out))).sum::<f32>() / SUN_RAYS as f32
            });
            (*at, [self.occlusion * (1.0 - of_sky), self.shadow * (1.0 - of_sun)])
        };
        let shaded: HashMap<[u32; 3], [f32; 2]> = corners.par_iter().map(shade).collect();
        let of = |veil: &Veil| {
            let own = veil.corners.map(|p| shaded[&key(p)]);
            let [occlusion, shadow] = [0, 1].map(|i| veil.on_map(own.map(|shares| shares[i])));
            QuadShade { occlusion, shadow }
        };
        self.veils.iter().map(of).collect()
    }
}
