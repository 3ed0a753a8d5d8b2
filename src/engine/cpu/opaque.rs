//! §3 Shading of a point of rock in the raster pass. Twin: `shaders/engine/opaque.wgsl`.

use glam::{Vec2, Vec3};

use crate::light::Light;
use crate::place::tiles::Tile;
use crate::place::{Mesh, Vertex};
use crate::scene::Scene;

/// A point of the opaque mesh, with values interpolated between its vertices.
pub struct Opaque {
    /// Position in the world, metres.
    pub position: Vec3,
    /// Normal, not normalised.
    pub normal: Vec3,
    /// Linear albedo.
    pub albedo: Vec3,
    /// Occlusion, shadow and film of water, 0 to 1 each.
    pub shade: Vec3,
    /// Number of the pool plus 1; 0 for rock.
    pub pool: u32,
    /// Whether a picture with an alpha channel has a hole here.
    pub holdout: bool,
}

impl Opaque {
    /// Interpolates the vertices around `in_tile`, a position in a tile in squares of its grid. `position` is
    /// the point in the world. Twin: `opaque_point`.
    pub fn at(mesh: &Mesh, tile: &Tile, in_tile: Vec2, position: Vec3) -> Opaque {
        let (corners, weights) = tile.around(in_tile);
        let corners = corners.map(|number| &mesh.vertices[number as usize]);
        let mix = |get: fn(&Vertex) -> [f32; 3]| {
            (0..3).map(|c| Vec3::from(get(corners[c])) * weights[c]).sum::<Vec3>()
        };
        Opaque {
            position,
            normal: mix(|v| v.normal),
            albedo: mix(|v| v.albedo),
            shade: mix(|v| [v.occlusion, v.shadow, v.wet]),
            pool: tile.pool,
            holdout: tile.holdout,
        }
    }
}

/// Shades rock: two-sided Lambert, with the gloss of a film of water. Returns the linear radiance with the
/// metres from the eye, and the unit normal. `shadow_light` is [`Scene::shadow_light`].
pub fn shade_opaque(scene: &Scene, shadow_light: Option<usize>, point: &Opaque) -> ([f32; 4], Vec3) {
    let to_eye = scene.camera.eye_local().as_vec3() - point.position;
    let distance = to_eye.dot(to_eye).sqrt();
    let mut n = point.normal / point.normal.dot(point.normal).max(1e-30).sqrt();
    if n.dot(to_eye) < 0.0 {
        n = -n;
    }
    let e = to_eye / distance.max(1e-6);
    let mirrored = n * (2.0 * n.dot(e)) - e;
    let (ambient, sky) = match &scene.environment {
        None => (scene.ambient, scene.background.radiance(mirrored)),
        // A film on rough rock reflects the light from all around the mirrored view.
        Some(environment) => {
            (scene.ambient + environment.irradiance.at(n), environment.irradiance.at(mirrored))
        }
    };
    let open = 1.0 - point.shade.x;
    let mut irradiance = ambient * open;
    let mut gloss = Vec3::ZERO;
    for (i, light) in scene.lights.iter().enumerate() {
        let (to_light, intensity) = light.at(point.position);
        let lit = if shadow_light == Some(i) { 1.0 - point.shade.y } else { 1.0 };
        let cos_light = n.dot(to_light).max(0.0);
        irradiance += intensity * (lit * cos_light);
        if point.shade.z > 0.0 {
            gloss += intensity * (lit * cos_light * film_lobe(n, to_light, e));
        }
    }
    let mut radiance = point.albedo * irradiance;
    if point.shade.z > 0.0 {
        radiance += (gloss + sky * (open * fresnel(n.dot(e)))) * point.shade.z;
    }
    (radiance.extend(distance).to_array(), n)
}

/// Returns π times the reflectance of a film of water on rough rock: Blinn 1977 with the exponent s = 32,
/// normalised by (s + 8)/8π. All directions are unit vectors away from the point.
pub fn film_lobe(n: Vec3, l: Vec3, e: Vec3) -> f32 {
    let sum = l + e;
    let h = sum / sum.dot(sum).max(1e-12).sqrt();
    let c = n.dot(h).max(0.0);
    let c2 = c * c;
    let c4 = c2 * c2;
    let c8 = c4 * c4;
    let c16 = c8 * c8;
    5.0 * fresnel(l.dot(h)) * (c16 * c16)
}

/// Returns the Fresnel reflectance of water for light at an angle to the normal (Schlick 1994).
pub fn fresnel(cos_angle: f32) -> f32 {
    let m = 1.0 - cos_angle.clamp(0.0, 1.0);
    let m2 = m * m;
    0.02 + 0.98 * (m2 * m2 * m)
}

impl Light {
    /// Returns the unit direction from a point to the light, and the light's intensity at the point. Twin:
    /// `light_from` of `shaders/layout.wgsl`.
    pub fn at(&self, point: Vec3) -> (Vec3, Vec3) {
        match *self {
            Light::Directional { to_light, intensity } => (to_light, intensity),
            Light::Point { position, intensity } => {
                let (to_light, falloff) = from_point(position, point);
                (to_light, intensity * falloff)
            }
            Light::Spot { position, intensity, cone } => {
                let (to_light, falloff) = from_point(position, point);
                let s = ((cone.axis.dot(to_light) - cone.cos_edge) * cone.inverse_soft).clamp(0.0, 1.0);
                (to_light, intensity * (falloff * (s * s * (3.0 - 2.0 * s))))
            }
        }
    }
}

/// Returns the unit direction from `point` to a light at `position`, and the falloff 1/d² there.
fn from_point(position: Vec3, point: Vec3) -> (Vec3, f32) {
    let away = position - point;
    let d2 = away.dot(away).max(1e-12);
    (away / d2.sqrt(), 1.0 / d2)
}
