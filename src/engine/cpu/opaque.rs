//! §3 Shading of rock in the raster pass, eight points side by side. Twin: `shaders/engine/opaque.wgsl`.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use glam::{Vec2, Vec3};

use super::lights::{background_at, irradiance_at, light_at};
use super::stone::stone_lobe;
use crate::place::Vertex;
use crate::place::tiles::Tile;
use crate::scene::Scene;
use crate::util::lanes::{Floats, LANES, Lanes3, Stored, Stored3};

/// Points of the opaque mesh, one a lane, with values interpolated between its vertices.
#[derive(Clone, Copy)]
pub struct Points<S: Simd> {
    /// Position in the world, metres.
    pub position: Lanes3<S>,
    /// Normal, not normalised.
    pub normal: Lanes3<S>,
    /// Normal of the plane of a triangle that is no part of a grid, of any length, on the side of its
    /// vertices' normals; 0 in a grid.
    pub plane: Lanes3<S>,
    /// Linear albedo. A pool has its depth (metres) and the density of its foam (0 to 1) here.
    pub albedo: Lanes3<S>,
    /// Share of the surroundings' light that is blocked, 0 to 1.
    pub occlusion: Floats<S>,
    /// Share of the light of [`Scene::shadow_light`] that is blocked, 0 to 1.
    pub shadow: Floats<S>,
    /// Strength of the film of water, 0 to 1.
    pub wet: Floats<S>,
    /// Squared roughness of the film of water on a stone; 0: that of plain rock.
    pub film: Floats<S>,
}

/// How the eye sees eight points.
#[derive(Clone, Copy)]
pub struct View<S: Simd> {
    /// Unit normal on the eye's side.
    pub n: Lanes3<S>,
    /// Unit direction to the eye.
    pub e: Lanes3<S>,
    /// Metres from the eye.
    pub distance: Floats<S>,
}

impl<S: Simd> Points<S> {
    /// Interpolates the vertices around a place in each lane's tile, in squares of its grid. `position` are
    /// the points in the world. Twin: `opaque_point`.
    #[inline(always)]
    pub fn at(
        simd: S,
        vertices: &[Vertex],
        tiles: [&Tile; LANES],
        places: &[[f32; LANES]; 2],
        position: Lanes3<S>,
    ) -> Self {
        // Eight of the numbers lie side by side; the ninth is apart.
        let mut rows = [[0.0; LANES]; LANES];
        let (mut wet, mut planes) = (Stored::default(), Stored3::default());
        for lane in 0..LANES {
            let (numbers, weights) = tiles[lane].around(Vec2::new(places[0][lane], places[1][lane]));
            if !tiles[lane].is_grid() {
                let [a, b, c] = numbers.map(|number| Vec3::from(vertices[number as usize].position));
                planes.set(lane, (b - a).cross(c - a));
            }
            let coats = numbers.map(|number| vertices[number as usize].coat());
            let mut row = f32x8::splat(simd, 0.0);
            for c in 0..3 {
                let (first, last) = coats[c];
                row += f32x8::load_array_ref(simd, first) * weights[c];
                wet.0[lane] += last * weights[c];
            }
            row.store_array(&mut rows[lane]);
        }
        let mut mixed = [Stored::default(); LANES];
        for lane in 0..LANES {
            for i in 0..LANES {
                mixed[i].0[lane] = rows[lane][i];
            }
        }
        let [nx, ny, nz, red, green, blue, occlusion, shadow] = &mixed;
        Points {
            position,
            normal: Lanes3 { x: nx.load(simd), y: ny.load(simd), z: nz.load(simd) },
            plane: planes.load(simd),
            albedo: Lanes3 { x: red.load(simd), y: green.load(simd), z: blue.load(simd) },
            occlusion: occlusion.load(simd),
            shadow: shadow.load(simd),
            wet: wet.load(simd),
            film: f32x8::splat(simd, 0.0),
        }
    }

    /// Returns how the eye sees the points.
    ///
    /// Both sides of a surface are seen. Which side it is, the plane of a triangle says: near the outline of
    /// a smooth mesh, normals that were interpolated lean away from the eye. There the normal is taken that
    /// is nearest to them among those that the eye sees.
    #[inline(always)]
    pub fn view(&self, simd: S, scene: &Scene) -> View<S> {
        let splat = |x: f32| f32x8::splat(simd, x);
        let (zero, one) = (splat(0.0), splat(1.0));
        let to_eye = Lanes3::splat(simd, scene.camera.eye_local().as_vec3()).minus(self.position);
        let distance = to_eye.dot(to_eye).sqrt();
        let e = to_eye.over(distance.max(splat(1e-6)));
        let n = self.normal.over(self.normal.dot(self.normal).max(splat(1e-30)).sqrt());
        let by_plane = self.plane.dot(to_eye);
        let side = by_plane.simd_eq(zero).select(n.dot(to_eye), by_plane);
        let n = n.times(side.simd_lt(zero).select(splat(-1.0), one));
        let leans = n.dot(to_eye).simd_lt(zero);
        let across = n.minus(e.times(n.dot(e)));
        let across = across.over(across.dot(across).max(splat(1e-30)).sqrt());
        View { n: across.or(leans, n), e, distance }
    }

    /// Shades rock: two-sided Lambert, with the gloss of a film of water. Returns the linear radiance.
    /// `shadow_light` is [`Scene::shadow_light`].
    #[inline(always)]
    pub fn lambert(&self, simd: S, scene: &Scene, shadow_light: Option<usize>, view: &View<S>) -> Lanes3<S> {
        let splat = |x: f32| f32x8::splat(simd, x);
        let (zero, one) = (splat(0.0), splat(1.0));
        let View { n, e, .. } = *view;
        let (ambient, sky) = view.surroundings(simd, scene);
        let open = one - self.occlusion;
        let is_wet = self.wet.simd_gt(zero);
        let mut irradiance = ambient.times(open);
        let mut gloss = Lanes3::splat(simd, Vec3::ZERO);
        for (i, light) in scene.lights.iter().enumerate() {
            let (to_light, intensity) = light_at(simd, light, self.position);
            let lit = if shadow_light == Some(i) { one - self.shadow } else { one };
            let cos_light = n.dot(to_light).max(zero);
            irradiance = irradiance.plus(intensity.times(lit * cos_light));
            if is_wet.any_true() {
                let lobe = self.film_on(simd, n, to_light, e);
                gloss = gloss.plus(intensity.times(lit * cos_light * lobe));
            }
        }
        let dry = self.albedo.by(irradiance);
        if !is_wet.any_true() {
            return dry;
        }
        let mirror = sky.times(open * fresnel(simd, n.dot(e)));
        dry.plus(gloss.plus(mirror).times(self.wet))
    }

    /// Returns π times the reflectance of the film of water at the points.
    #[inline(always)]
    fn film_on(&self, simd: S, n: Lanes3<S>, l: Lanes3<S>, e: Lanes3<S>) -> Floats<S> {
        let plain = film_lobe(simd, n, l, e);
        let is_stone = self.film.simd_gt(f32x8::splat(simd, 0.0));
        if is_stone.any_true() {
            return is_stone.select(stone_lobe(simd, n, l, e, self.film), plain);
        }
        plain
    }
}

impl<S: Simd> View<S> {
    /// Returns the light from all around, and the radiance of the surroundings along the mirrored view.
    #[inline(always)]
    pub fn surroundings(&self, simd: S, scene: &Scene) -> (Lanes3<S>, Lanes3<S>) {
        let View { n, e, .. } = *self;
        let mirrored = n.times(f32x8::splat(simd, 2.0) * n.dot(e)).minus(e);
        let ambient = Lanes3::splat(simd, scene.ambient);
        match &scene.environment {
            None => (ambient, background_at(simd, &scene.background, mirrored)),
            // A film on rough rock reflects the light from all around the mirrored view.
            Some(environment) => {
                let irradiance = &environment.irradiance;
                (ambient.plus(irradiance_at(simd, irradiance, n)), irradiance_at(simd, irradiance, mirrored))
            }
        }
    }
}

/// Returns π times the reflectance of a film of water on rough rock: Blinn 1977 with the exponent s = 32,
/// normalised by (s + 8)/8π. All directions are unit vectors away from the point.
#[inline(always)]
pub fn film_lobe<S: Simd>(simd: S, n: Lanes3<S>, l: Lanes3<S>, e: Lanes3<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let sum = l.plus(e);
    let h = sum.over(sum.dot(sum).max(splat(1e-12)).sqrt());
    let c = n.dot(h).max(splat(0.0));
    let c2 = c * c;
    let c4 = c2 * c2;
    let c8 = c4 * c4;
    let c16 = c8 * c8;
    splat(5.0) * fresnel(simd, l.dot(h)) * (c16 * c16)
}

/// Returns the Fresnel reflectance of water for light at an angle to the normal (Schlick 1994).
#[inline(always)]
pub fn fresnel<S: Simd>(simd: S, cos_angle: Floats<S>) -> Floats<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    let m = splat(1.0) - cos_angle.max(splat(0.0)).min(splat(1.0));
    let m2 = m * m;
    splat(0.02) + splat(0.98) * (m2 * m2 * m)
}
