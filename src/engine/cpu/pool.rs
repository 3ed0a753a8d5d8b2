//! §3 The surface of a pool under a pixel of the raster pass. Twin: `shaders/pool.wgsl`.

use glam::{Vec2, Vec3, Vec4};

use super::opaque::{Opaque, fresnel};
use crate::engine::pool_surface::{AROUND, Surface, turn};
use crate::scene::Scene;

/// sin(2πt), to 3e-5: WGSL leaves the error of its own open.
pub fn sin_turns(t: f32) -> f32 {
    let x = t - (t + 0.5).floor();
    let x2 = x * x;
    let mut sum = 3.8199526;
    sum = sum * x2 - 15.094643;
    sum = sum * x2 + 42.058694;
    sum = sum * x2 - 76.70586;
    sum = sum * x2 + 81.60525;
    sum = sum * x2 - 41.341_7;
    sum = sum * x2 + std::f32::consts::TAU;
    sum * x
}

/// 0 to 1, of a point with whole coordinates.
fn lattice(x: u32, y: u32) -> f32 {
    let mut h = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841);
    h = (h ^ (h >> 13)).wrapping_mul(0x9e37_79b1);
    h ^= h >> 16;
    (h >> 8) as f32 / 16_777_216.0
}

/// Smooth between the lattice's values.
fn value_noise(p: Vec2) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let s = f * f * (Vec2::splat(3.0) - f * 2.0);
    let (x, y) = (cell.x as i32 as u32, cell.y as i32 as u32);
    let (right, above) = (x.wrapping_add(1), y.wrapping_add(1));
    let near = lattice(x, y) + (lattice(right, y) - lattice(x, y)) * s.x;
    let far = lattice(x, above) + (lattice(right, above) - lattice(x, above)) * s.x;
    near + (far - near) * s.y
}

/// Where the ray `d` meets the pool, not where its triangles' corners mix: waves are finer than the difference.
fn on_pool(scene: &Scene, surface: &Surface, position: Vec3, d: Vec3) -> Vec3 {
    let eye = scene.camera.eye;
    let t = (surface.middle[1] - eye.y) / if d.y == 0.0 { 1e-20 } else { d.y };
    if t > 0.0 && t < 1e6 { eye + d * t } else { position }
}

/// The waves' normal. Waves of which a pixel sees half a length or more fade away, for it sees their mean.
pub fn pool_normal(scene: &Scene, surface: &Surface, point: &Opaque) -> Vec3 {
    let to_eye = scene.camera.eye - point.position;
    let distance = to_eye.dot(to_eye).sqrt();
    let e = to_eye / distance.max(1e-6);
    let pixel = 2.0 * scene.camera.tan_half_fov / scene.image.height as f32;
    let footprint = distance * pixel / e.y.max(0.05);
    let p = Vec2::new(point.position.x, point.position.z);
    // Where water falls in, the surface is rougher.
    let churn = 1.0 + 1.5 * point.albedo.y;
    let mut slope = Vec2::ZERO;
    let mut lift = 0.0;
    for wave in &surface.waves {
        let mut toward = Vec2::from(wave.toward);
        let mut along = toward.dot(p);
        let mut steep = wave.slope * churn;
        if wave.ring > 0.5 {
            let away = p - Vec2::from(wave.toward);
            along = away.dot(away).sqrt().max(1e-3);
            toward = away / along;
            let fall = 1.0 + along * wave.decay;
            steep /= fall * fall;
        }
        let wide = 3.0 * wave.k * footprint;
        let blur = 1.0 + wide * wide;
        steep /= blur * blur;
        let t = wave.k * along + wave.phase;
        slope += toward * (steep * sin_turns(t + 0.25));
        lift += steep * sin_turns(t);
    }
    let n = Vec3::new(-slope.x, (1.0 - lift).max(0.3), -slope.y);
    n / n.dot(n).sqrt()
}

/// The view, mirrored; never into the water, for waves hide that from one another.
fn pool_mirrored(e: Vec3, n: Vec3) -> Vec3 {
    let r = n * (2.0 * n.dot(e)) - e;
    let up = Vec3::new(r.x, r.y.abs().max(0.01), r.z);
    up / up.dot(up).sqrt()
}

/// What of the surroundings a ray from `position` meets: rays are followed to a ball, on which all lies
/// (Lagarde and Zanuttini 2012).
fn around(surface: &Surface, position: Vec3, r: Vec3) -> Vec4 {
    let o = position - Vec3::from(surface.middle);
    let b = o.dot(r);
    let c = o.dot(o) - surface.radius * surface.radius;
    let far = o + r * ((b * b - c).max(0.0).sqrt() - b).max(0.0);
    let d = far / far.dot(far).max(1e-12).sqrt();
    let [columns, rows] = AROUND;
    let s = turn(d) * columns as f32 - 0.5;
    let t = (d.y * rows as f32 - 0.5).clamp(0.0, rows as f32 - 1.0);
    let (f, g) = (s - s.floor(), t - t.floor());
    let x0 = (s.floor() + columns as f32) as usize % columns;
    let x1 = (x0 + 1) % columns;
    let y0 = t.floor() as usize * columns;
    let y1 = (t.floor() as usize + 1).min(rows - 1) * columns;
    let at = |i: usize| Vec4::from(surface.around[i]);
    let low = at(y0 + x0) * (1.0 - f) + at(y0 + x1) * f;
    let high = at(y1 + x0) * (1.0 - f) + at(y1 + x1) * f;
    low * (1.0 - g) + high * g
}

/// Radiance and metres from the eye, and normal, where the view ray `d` meets it: what the surface mirrors, with the glint of lights (Blinn 1977, the
/// exponent 256), what comes from below through the depth, and foam over both.
pub fn shade_pool(
    scene: &Scene,
    shadow_light: Option<usize>,
    surface: &Surface,
    point: &Opaque,
    d: Vec3,
) -> ([f32; 4], Vec3) {
    let point = &Opaque { position: on_pool(scene, surface, point.position, d), ..*point };
    let n = pool_normal(scene, surface, point);
    let to_eye = scene.camera.eye - point.position;
    let distance = to_eye.dot(to_eye).sqrt();
    let e = to_eye / distance.max(1e-6);
    let r = pool_mirrored(e, n);
    let (ambient, sky) = match &scene.environment {
        None => (scene.ambient, scene.background.radiance(r)),
        // Its sun is a light already: the mean about the ray.
        Some(environment) => {
            (scene.ambient + environment.irradiance.at(Vec3::Y), environment.irradiance.at(r))
        }
    };
    let mut irradiance = ambient * (1.0 - point.shade.x);
    let mut glint = Vec3::ZERO;
    for (i, light) in scene.lights.iter().enumerate() {
        let (to_light, intensity) = light.at(point.position);
        let lit = if shadow_light == Some(i) { 1.0 - point.shade.y } else { 1.0 };
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
    // log₂e times the way down and, slanted by refraction, up again: 2.2 depths.
    let through = (Vec3::from(surface.absorption) * (-3.174 * point.albedo.x)).exp2();
    let body = Vec3::from(surface.color) * (1.0 - through) + Vec3::from(surface.bottom) * through;
    let back = fresnel(n.dot(e).max(0.02));
    let clear = mirror * back + glint + body * irradiance * (1.0 - back);

    let p = Vec2::new(point.position.x, point.position.z) + Vec2::new(n.x, n.z) * 0.3;
    let noise = 0.45 * value_noise(p * 2.3)
        + 0.27 * value_noise(p * 5.1)
        + 0.17 * value_noise(p * 11.0)
        + 0.11 * value_noise(p * 23.0);
    let cover = ((1.6 * point.albedo.y + noise - 1.05) * 2.2).clamp(0.0, 1.0);
    let radiance = clear * (1.0 - cover) + irradiance * ((0.25 + 0.5 * noise) * cover);
    (radiance.extend(distance).to_array(), n)
}
