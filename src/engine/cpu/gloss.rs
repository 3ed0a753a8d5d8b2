//! §3 Shading of opaque triangles that have a paint, eight points side by side. Twin:
//! `shaders/engine/gloss.wgsl`.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, u32x8};
use glam::{Vec2, Vec3};

use super::lights::light_at;
use super::opaque::{Points, View, film_lobe, fresnel};
use crate::place::paint::Sight;
use crate::place::tiles::Tile;
use crate::place::{Mesh, wet_albedo};
use crate::scene::Scene;
use crate::util::lanes::{Floats, LANES, Lanes3, Stored, Stored3};

/// Reflectance of a dielectric with n = 1.5, seen head-on.
pub const DIELECTRIC: f32 = 0.04;

/// Least α. A lamp is a point, and normals of vertices have 16 bits on the device.
pub const LEAST_ALPHA: f32 = 0.01;

/// The eye and the samples of eight pixels.
pub struct Samples<S: Simd> {
    /// Position of the eye, metres.
    pub eye: Vec3,
    /// Vectors from the eye to the samples' points of the image plane at distance 1.
    pub rays: Lanes3<S>,
    /// Size of a sample on that plane.
    pub angle: f32,
}

/// What paints say about eight points. Lanes without a paint keep what they have.
pub struct Looks {
    albedo: Stored3,
    normal: Stored3,
    roughness: Stored,
    metallic: Stored,
    has_gloss: [u32; LANES],
}

impl Looks {
    /// Looks up the paints of points in tiles. `normals` are their unit normals on the eye's side.
    #[inline(always)]
    pub fn at<S: Simd>(
        mesh: &Mesh,
        tiles: [&Tile; LANES],
        places: &[[f32; LANES]; 2],
        points: &Points<S>,
        normals: Lanes3<S>,
        samples: &Samples<S>,
    ) -> Looks {
        let (mut rays, mut wet) = (Stored3::default(), Stored::default());
        rays.store(samples.rays);
        wet.store(points.wet);
        let mut out = Looks {
            albedo: Stored3::default(),
            normal: Stored3::default(),
            roughness: Stored::default(),
            metallic: Stored::default(),
            has_gloss: [0; LANES],
        };
        out.albedo.store(points.albedo);
        out.normal.store(normals);
        for lane in 0..LANES {
            let Some(paint) = tiles[lane].paint.checked_sub(1) else { continue };
            let paint = &mesh.paints.all[paint as usize];
            let (corners, _) = tiles[lane].around(Vec2::new(places[0][lane], places[1][lane]));
            let [a, b, c] = corners.map(|i| Vec3::from(mesh.vertices[i as usize].position));
            let sight = Sight {
                corner: a - samples.eye,
                edges: [b - a, c - a],
                ray: rays.get(lane),
                normal: out.normal.get(lane),
                angle: samples.angle,
            };
            let first = tiles[lane].coordinates + (corners[0] - tiles[lane].first) * paint.slots;
            let painted = mesh.paints.at(paint, first as usize, &sight);
            let dry = out.albedo.get(lane) * painted.color;
            // Vertices under a film hold a darker albedo, but a texture's is dry.
            let film = if paint.color.is_some() { wet.0[lane] } else { 0.0 };
            out.albedo.set(lane, dry + (wet_albedo(dry) - dry) * film);
            out.normal.set(lane, painted.normal);
            (out.roughness.0[lane], out.metallic.0[lane]) = (painted.roughness, painted.metallic);
            out.has_gloss[lane] = paint.has_gloss;
        }
        out
    }

    /// Shades points as [`Points::lambert`] does, those with gloss with their lobe. Returns the linear
    /// radiance and the unit normal.
    #[inline(always)]
    pub fn shade<S: Simd>(
        &self,
        simd: S,
        scene: &Scene,
        shadow_light: Option<usize>,
        points: &Points<S>,
        view: View<S>,
    ) -> (Lanes3<S>, Lanes3<S>) {
        let view = View { n: self.normal.load(simd), ..view };
        let points = Points { albedo: self.albedo.load(simd), ..*points };
        let plain = points.lambert(simd, scene, shadow_light, &view);
        let has_gloss = !u32x8::load_array(simd, self.has_gloss).simd_eq(0);
        if !has_gloss.any_true() {
            return (plain, view.n);
        }
        let glossy = self.shade_glossy(simd, scene, shadow_light, &points, &view);
        let radiance = Lanes3 {
            x: has_gloss.select(glossy.x, plain.x),
            y: has_gloss.select(glossy.y, plain.y),
            z: has_gloss.select(glossy.z, plain.z),
        };
        (radiance, view.n)
    }

    #[inline(always)]
    fn shade_glossy<S: Simd>(
        &self,
        simd: S,
        scene: &Scene,
        shadow_light: Option<usize>,
        points: &Points<S>,
        view: &View<S>,
    ) -> Lanes3<S> {
        let splat = |x: f32| f32x8::splat(simd, x);
        let (zero, one) = (splat(0.0), splat(1.0));
        let (roughness, metallic) = (self.roughness.load(simd), self.metallic.load(simd));
        let gloss = Gloss::new(simd, points.albedo, roughness, metallic, view.n, view.e);
        let open = one - points.occlusion;
        let (ambient, sky) = view.surroundings(simd, scene);
        let strength = rim_strength(simd, gloss.alpha);
        let mirrors = gloss.rising(simd, strength * rim(simd, gloss.cos_eye));
        let mean = one - strength * splat(1.0 / 21.0);
        let diffuse = gloss.diffuse.by(ambient).times(gloss.passes * mean);
        // The rougher a surface is, the more directions it mirrors.
        let mirrored = sky.plus(ambient.minus(sky).times(gloss.alpha));
        let mut radiance = diffuse.plus(mirrored.by(mirrors)).times(open);
        let is_wet = points.wet.simd_gt(zero);
        let mut film = Lanes3::splat(simd, Vec3::ZERO);
        for (i, light) in scene.lights.iter().enumerate() {
            let (to_light, intensity) = light_at(simd, light, points.position);
            let lit = if shadow_light == Some(i) { one - points.shadow } else { one };
            let cos_light = view.n.dot(to_light).max(zero);
            let strength = intensity.times(lit * cos_light);
            let reflected = strength.by(gloss.reflects(simd, to_light, cos_light));
            let faces = cos_light.simd_gt(zero);
            radiance = radiance.plus(Lanes3 {
                x: faces.select(reflected.x, zero),
                y: faces.select(reflected.y, zero),
                z: faces.select(reflected.z, zero),
            });
            if is_wet.any_true() {
                film = film.plus(strength.times(film_lobe(simd, view.n, to_light, view.e)));
            }
        }
        if !is_wet.any_true() {
            return radiance;
        }
        let mirror = sky.times(open * fresnel(simd, view.n.dot(view.e)));
        radiance.plus(film.plus(mirror).times(points.wet))
    }
}

/// Eight points with gloss.
pub struct Gloss<S: Simd> {
    n: Lanes3<S>,
    e: Lanes3<S>,
    cos_eye: Floats<S>,
    /// Albedo of the diffuse part.
    diffuse: Lanes3<S>,
    /// Reflectance seen head-on.
    f0: Lanes3<S>,
    /// Share of light that leaves or enters through the surface, along the view.
    passes: Floats<S>,
    alpha: Floats<S>,
}

/// (1 − c)⁵ (Schlick 1994).
#[inline(always)]
fn rim<S: Simd>(simd: S, c: Floats<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let m = splat(1.0) - c.max(splat(0.0)).min(splat(1.0));
    let m2 = m * m;
    m2 * m2 * m
}

/// Strength of the rim of a surface that reflects from all sides: a rough one has less of it. With this
/// factor no surface reflects more than it receives, which a test integrates.
#[inline(always)]
fn rim_strength<S: Simd>(simd: S, alpha: Floats<S>) -> Floats<S> {
    f32x8::splat(simd, 1.0) - f32x8::splat(simd, 0.9) * alpha
}

#[inline(always)]
fn passes_along<S: Simd>(simd: S, alpha: Floats<S>, c: Floats<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    splat(1.0 - DIELECTRIC) * (splat(1.0) - rim_strength(simd, alpha) * rim(simd, c))
}

impl<S: Simd> Gloss<S> {
    /// Gloss of points with unit normals `n`, seen from the unit directions `e`.
    #[inline(always)]
    pub fn new(
        simd: S,
        albedo: Lanes3<S>,
        roughness: Floats<S>,
        metallic: Floats<S>,
        n: Lanes3<S>,
        e: Lanes3<S>,
    ) -> Self {
        let splat = |x: f32| f32x8::splat(simd, x);
        let alpha = (roughness * roughness).max(splat(LEAST_ALPHA));
        let cos_eye = n.dot(e).max(splat(1e-3));
        let dielectric = Lanes3::splat(simd, Vec3::splat(DIELECTRIC));
        Gloss {
            n,
            e,
            cos_eye,
            diffuse: albedo.times(splat(1.0) - metallic),
            f0: dielectric.plus(albedo.minus(dielectric).times(metallic)),
            passes: passes_along(simd, alpha, cos_eye),
            alpha,
        }
    }

    /// The reflectance head-on, and `share` of what it lacks to 1.
    #[inline(always)]
    fn rising(&self, simd: S, share: Floats<S>) -> Lanes3<S> {
        let one = Lanes3::splat(simd, Vec3::ONE);
        self.f0.plus(one.minus(self.f0).times(share))
    }

    /// Returns π times the reflectance for light from unit directions at a cosine above 0: Lambert under a
    /// surface, and the lobe of Trowbridge and Reitz 1975 with the height-correlated shadows of Smith (Heitz
    /// 2014).
    #[inline(always)]
    pub fn reflects(&self, simd: S, l: Lanes3<S>, cos_light: Floats<S>) -> Lanes3<S> {
        let splat = |x: f32| f32x8::splat(simd, x);
        let one = splat(1.0);
        let sum = l.plus(self.e);
        let h = sum.over(sum.dot(sum).max(splat(1e-12)).sqrt());
        let a2 = self.alpha * self.alpha;
        let cos_half = self.n.dot(h).max(splat(0.0));
        // The sine has digits where the cosine is near 1.
        let sine = Lanes3 {
            x: self.n.y * h.z - self.n.z * h.y,
            y: self.n.z * h.x - self.n.x * h.z,
            z: self.n.x * h.y - self.n.y * h.x,
        };
        let spread = cos_half * cos_half * a2 + sine.dot(sine);
        let hidden = cos_light * (self.cos_eye * self.cos_eye * (one - a2) + a2).sqrt()
            + self.cos_eye * (cos_light * cos_light * (one - a2) + a2).sqrt();
        let lobe = a2 / (spread * spread) * (splat(0.5) / hidden);
        let mirrored = self.rising(simd, rim(simd, l.dot(h)));
        let scattered = self.passes * passes_along(simd, self.alpha, cos_light) / splat(1.0 - DIELECTRIC);
        self.diffuse.times(scattered).plus(mirrored.times(lobe))
    }
}
