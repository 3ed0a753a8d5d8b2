//! §3 Shading of a pool's surface in the raster pass. Twin: `shaders/engine/pool.wgsl`.

use glam::{Vec2, Vec3, Vec4};

use super::waves::Waves;
use crate::engine::pool_surface::{AROUND, FOAM, Foam, Surface, turn};
use crate::mapping::PlaneView;
use crate::scene::Scene;
use crate::walk::floor_cell;

/// Returns sin(2πt) with an error below 3e-5. It replaces WGSL's `sin`, whose error the standard leaves open.
pub fn sin_turns(t: f32) -> f32 {
    let x = t - (t + 0.5).floor();
    let x2 = x * x;
    SINE[1..].iter().fold(SINE[0], |sum, c| sum * x2 + c) * x
}

/// Coefficients of [`sin_turns`], that of the highest power first.
pub const SINE: [f32; 7] =
    [3.8199526, -15.094643, 42.058694, -76.70586, 81.60525, -41.341_7, std::f32::consts::TAU];

/// Hashes a lattice point to a number from 0 to 1.
fn lattice(x: u32, y: u32) -> f32 {
    let mut h = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841);
    h = (h ^ (h >> 13)).wrapping_mul(0x9e37_79b1);
    h ^= h >> 16;
    (h >> 8) as f32 / 16_777_216.0
}

/// Value noise: interpolates smoothly between the values of the lattice. The lattice is fixed to the world;
/// `p` is measured from the scene's origin, in cells.
fn value_noise(p: Vec2, origin: &Foam) -> f32 {
    let p = p + Vec2::from(origin.rest);
    let cell = [p.x, p.y].map(floor_cell);
    let f = p - Vec2::from(cell.map(|c| c as f32));
    let s = f * f * (Vec2::splat(3.0) - f * 2.0);
    let [x, y] = [0, 1].map(|c| (cell[c] + origin.cells[c]) as u32);
    let (right, above) = (x.wrapping_add(1), y.wrapping_add(1));
    let near = lattice(x, y) + (lattice(right, y) - lattice(x, y)) * s.x;
    let far = lattice(x, above) + (lattice(right, above) - lattice(x, above)) * s.x;
    near + (far - near) * s.y
}

/// Returns the point where the view ray through the point `at` of the image meets the pool's plane. The
/// position interpolated from the triangle's corners differs from it by more than the size of waves. Far or
/// parallel rays keep `position`.
fn on_pool(scene: &Scene, surface: &Surface, position: Vec3, at: Vec2) -> Vec3 {
    let plane = PlaneView {
        across: surface.across.into(),
        along: surface.along.into(),
        normal: surface.normal.into(),
        height: surface.height,
    };
    let (hh, t) = plane.hit(at);
    let metres = t * scene.camera.ray_to(scene.image.width, scene.image.height, at).length();
    let met = Vec3::from(surface.middle) + Vec3::new(hh.x, 0.0, hh.y);
    if metres > 0.0 && metres < surface.far { met } else { position }
}

/// A point of a pool's surface, with values interpolated between the vertices of the mesh.
#[derive(Clone, Copy)]
pub struct PoolPoint {
    /// Position in the world, metres.
    pub position: Vec3,
    /// Depth of the water, metres.
    pub depth: f32,
    /// Density of the foam, 0 to 1.
    pub foam: f32,
    /// Share of the surroundings' light that is blocked, 0 to 1.
    pub occlusion: f32,
    /// Share of the light of [`Scene::shadow_light`] that is blocked, 0 to 1.
    pub shadow: f32,
}

/// Returns the unit normal of the waves. A wave fades out as the pixel's footprint reaches half its length,
/// because the pixel then sees the wave's mean.
fn pool_normal(scene: &Scene, waves: &Waves, point: &PoolPoint) -> Vec3 {
    let to_eye = scene.camera.eye_local().as_vec3() - point.position;
    let distance = to_eye.dot(to_eye).sqrt();
    let e = to_eye / distance.max(1e-6);
    let pixel = 2.0 * scene.camera.tan_half_fov / scene.image.height as f32;
    let footprint = distance * pixel / e.y.max(0.05);
    let p = Vec2::new(point.position.x, point.position.z);
    // The surface is rougher where water falls in.
    let churn = 1.0 + 1.5 * point.foam;
    let (slope, lift) = waves.slopes(p, churn, footprint);
    let n = Vec3::new(-slope.x, (1.0 - lift).max(0.3), -slope.y);
    n / n.dot(n).sqrt()
}

/// Returns the view direction mirrored at `n`. It never points into the water, because other waves would hide
/// that view.
fn pool_mirrored(e: Vec3, n: Vec3) -> Vec3 {
    let r = n * (2.0 * n.dot(e)) - e;
    let up = Vec3::new(r.x, r.y.abs().max(0.01), r.z);
    up / up.dot(up).sqrt()
}

/// Looks up the surroundings that a ray from `position` along `r` meets: radiance × cover, and the cover. The
/// surroundings are projected on a sphere (Lagarde and Zanuttini 2012).
fn around(surface: &Surface, position: Vec3, r: Vec3) -> Vec4 {
    let o = position - Vec3::from(surface.middle);
    let b = o.dot(r);
    let c = o.dot(o) - surface.radius * surface.radius;
    let far = o + r * ((b * b - c).max(0.0).sqrt() - b).max(0.0);
    let d = far / far.dot(far).max(1e-12).sqrt();
    let [columns, rows] = AROUND;
    let s = turn(d) * columns as f32 - 0.5;
    let t = (d.y * rows as f32 - 0.5).clamp(0.0, rows as f32 - 1.0);
    let (column, row) = (floor_cell(s), t as usize);
    let (f, g) = (s - column as f32, t - row as f32);
    let x0 = (column + columns as i32) as usize % columns;
    let x1 = (x0 + 1) % columns;
    let y0 = row * columns;
    let y1 = (row + 1).min(rows - 1) * columns;
    let at = |i: usize| Vec4::from(surface.around[i]);
    let low = at(y0 + x0) * (1.0 - f) + at(y0 + x1) * f;
    let high = at(y1 + x0) * (1.0 - f) + at(y1 + x1) * f;
    low * (1.0 - g) + high * g
}

/// Shades a pool's surface under the point `at` of the image. Returns the linear radiance with the metres
/// from the eye, and the unit normal. The radiance adds the mirrored surroundings, the glint of the lights
/// (Blinn 1977 with the exponent 256) and the light from below through the depth of water; foam covers all of
/// them. `shadow_light` is [`Scene::shadow_light`].
pub fn shade_pool(
    scene: &Scene,
    shadow_light: Option<usize>,
    (surface, waves): &(Surface, Waves),
    point: &PoolPoint,
    at: Vec2,
) -> ([f32; 4], Vec3) {
    let point = &PoolPoint { position: on_pool(scene, surface, point.position, at), ..*point };
    let n = pool_normal(scene, waves, point);
    let to_eye = scene.camera.eye_local().as_vec3() - point.position;
    let distance = to_eye.dot(to_eye).sqrt();
    let e = to_eye / distance.max(1e-6);
    let r = pool_mirrored(e, n);
    let (ambient, sky) = match &scene.environment {
        None => (scene.ambient, scene.background.radiance(r)),
        // The environment's sun is already a light, so the mean radiance about the ray is used.
        Some(environment) => {
            (scene.ambient + environment.irradiance.at(Vec3::Y), environment.irradiance.at(r))
        }
    };
    let mut irradiance = ambient * (1.0 - point.occlusion);
    let mut glint = Vec3::ZERO;
    for (i, light) in scene.lights.iter().enumerate() {
        let (to_light, intensity) = light.at(point.position);
        let lit = if shadow_light == Some(i) { 1.0 - point.shadow } else { 1.0 };
        irradiance += intensity * (lit * to_light.y.max(0.0));
        let sum = to_light + e;
        let h = sum / sum.dot(sum).max(1e-12).sqrt();
        let mut c = n.dot(h).max(0.0);
        for _ in 0..8 {
            c *= c;
        }
        let lobe = 33.0 * fresnel(to_light.dot(h)) * c * n.dot(to_light).max(0.0);
        glint += intensity * (lit * lobe);
    }
    let mirrors = around(surface, point.position, r);
    let mirror = mirrors.truncate() + sky * (1.0 - mirrors.w);
    // log₂e · 2.2: light travels 2.2 depths on its way down and, slanted by refraction, up again.
    let through = (Vec3::from(surface.absorption) * (-3.174 * point.depth)).exp2();
    let body = Vec3::from(surface.color) * (1.0 - through) + Vec3::from(surface.bottom) * through;
    let back = fresnel(n.dot(e).max(0.02));
    let clear = mirror * back + glint + body * irradiance * (1.0 - back);

    let p = Vec2::new(point.position.x, point.position.z) + Vec2::new(n.x, n.z) * 0.3;
    let noise = |i: usize| value_noise(p * FOAM[i], &surface.foam[i]);
    let noise = 0.45 * noise(0) + 0.27 * noise(1) + 0.17 * noise(2) + 0.11 * noise(3);
    let cover = ((1.6 * point.foam + noise - 1.05) * 2.2).clamp(0.0, 1.0);
    let radiance = clear * (1.0 - cover) + irradiance * ((0.25 + 0.5 * noise) * cover);
    (radiance.extend(distance).to_array(), n)
}

/// Returns the Fresnel reflectance of water for light at an angle to the normal (Schlick 1994).
pub fn fresnel(cos_angle: f32) -> f32 {
    let m = 1.0 - cos_angle.clamp(0.0, 1.0);
    let m2 = m * m;
    0.02 + 0.98 * (m2 * m2 * m)
}
