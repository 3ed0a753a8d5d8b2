//! Shading of the samples of a band: the opaque scene or the background, eight side by side, and the volume
//! quads in front of it.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8, u32x8};
use glam::{DVec3, Vec3, Vec4};

use super::raster::{self, Covered, Rasteriser};
use super::{Gbuffer, map_hull, map_quad};
use crate::engine::cpu::gloss::{Looks, Samples};
use crate::engine::cpu::haze;
use crate::engine::cpu::lights::background_at;
use crate::engine::cpu::opaque::Points;
use crate::engine::cpu::pool;
use crate::engine::cpu::stone::lay_stones;
use crate::engine::pool_surface::{self, SlopeMap, Surface};
use crate::light::haze::EyeHaze;
use crate::mapping::PlaneView;
use crate::picture::camera::{DepthRange, DepthToPoint, footprint};
use crate::picture::{Camera, Image, SampleTimes};
use crate::place::Mesh;
use crate::scene::{Face, Parts, Scene};
use crate::util::lanes::{Floats, LANES, Lanes3, Stored, Stored3};
use crate::util::window::Window;

/// Everything that the samples of a frame share.
pub struct Shading<'a> {
    scene: &'a Scene,
    mesh: &'a Mesh,
    shadow_light: Option<usize>,
    pools: Vec<Surface>,
    slopes: Vec<Option<SlopeMap>>,
    haze: EyeHaze,
    /// Vectors forward, right and up of the camera; see [`Camera::rays`].
    rays: [Vec3; 3],
    /// Position of the eye, metres.
    eye: Vec3,
    eye_local: DVec3,
    /// The planes of the quads.
    planes: Vec<PlaneView>,
    to_point: DepthToPoint,
    /// Size of a sample on the image plane at distance 1.
    sample_angle: f32,
}

/// One of the samples that a band's triangles are drawn for.
#[derive(Clone, Copy)]
pub struct Which {
    /// Its place among them, and their number.
    pub index: usize,
    pub count: usize,
    /// Its offset from the top left corner of a pixel, pixels.
    pub offset: [f32; 2],
    /// The same in an image that is not shifted.
    pub in_pixel: [f32; 2],
    /// Its times in all pixels.
    pub times: SampleTimes,
}

/// Up to eight pixels of a band, one a lane; those that are missing repeat the last one.
struct Pixels {
    /// Column and row in the image.
    at: [[u32; LANES]; 2],
    /// Number of the triangle that the sample sees plus 1 (0: none), and its reversed depth.
    ids: [u32; LANES],
    depth: Stored,
}

/// Up to eight points of the opaque mesh, one a lane.
struct Spots {
    /// Number of the tile, and the place there in squares of its grid.
    tiles: [u32; LANES],
    places: [[f32; LANES]; 2],
    /// Reversed depth.
    depth: Stored,
}

/// A pixel under which a pool is seen: what its shading needs besides the waves, which move.
#[derive(Clone, Copy)]
pub struct PoolPixel {
    /// Index of the pixel in its band.
    index: u32,
    tile: u32,
    place: [f32; 2],
    depth: f32,
}

/// Radiance with the metres from the eye, and normal with the share of a backdrop that shows.
struct Seen<S: Simd> {
    opaque: (Lanes3<S>, Floats<S>),
    normal: (Lanes3<S>, Floats<S>),
}

impl<'a> Shading<'a> {
    /// Collects what the samples share. `depth` is the range of the z-buffer.
    pub fn new(scene: &'a Scene, mesh: &'a Mesh, depth: &DepthRange) -> Self {
        let Parts { camera, image, .. } = &**scene;
        let (eye, rays) = (camera.eye_local(), camera.rays(image.width, image.height));
        Shading {
            scene,
            mesh,
            shadow_light: scene.shadow_light(),
            pools: pool_surface::surfaces(scene, mesh),
            slopes: pool_surface::slope_maps(scene, mesh),
            haze: scene.haze.seen_from(eye),
            rays: rays.map(|v| v.as_vec3()),
            eye: eye.as_vec3(),
            eye_local: eye,
            planes: scene.quads.iter().map(|quad| PlaneView::of_quad(&quad.map, eye, rays)).collect(),
            to_point: camera.depth_to_point(depth),
            sample_angle: footprint(camera, image).sqrt(),
        }
    }

    /// Shades the opaque scene or the background under each pixel of a band.
    #[inline(always)]
    pub fn opaque<S: Simd>(
        &self,
        simd: S,
        rock: &Rasteriser,
        covered: &[Covered],
        sample: Which,
        out: &mut Gbuffer,
    ) {
        for first in (0..out.opaque.len()).step_by(LANES) {
            let count = LANES.min(out.opaque.len() - first);
            let pixels = Pixels::new(out.window, first, count, covered, sample);
            let at = self.image_points(simd, &pixels.at, sample.offset);
            let is_rock = !u32x8::load_array(simd, pixels.ids).simd_eq(0);
            let seen = if is_rock.any_true() {
                let spots = Spots::new(simd, rock, &pixels, sample);
                self.keep_pools(&spots, &pixels, first, count, &mut out.pools);
                let near = self.rock(simd, &spots, at, self.times(simd, &pixels.at, sample.times));
                if is_rock.all_true() { near } else { near.or(self.background(simd, at, is_rock), is_rock) }
            } else {
                self.background(simd, at, is_rock)
            };
            seen.store(&mut out.opaque[first..first + count], &mut out.normal[first..first + count]);
        }
    }

    /// Shades the pools of a band again, of which nothing but the waves has changed.
    #[inline(always)]
    pub fn pools<S: Simd>(&self, simd: S, offset: [f32; 2], times: SampleTimes, out: &mut Gbuffer) {
        let width = out.window.width;
        for pixels in out.pools.chunks(LANES) {
            let mut at = [[0; LANES]; 2];
            let mut spots = Spots { tiles: [0; LANES], places: [[0.0; LANES]; 2], depth: Stored::default() };
            for lane in 0..LANES {
                let PoolPixel { index, tile, place, depth } = pixels[lane.min(pixels.len() - 1)];
                [at[0][lane], at[1][lane]] = [out.window.x + index % width, out.window.y + index / width];
                (spots.tiles[lane], spots.depth.0[lane]) = (tile, depth);
                [spots.places[0][lane], spots.places[1][lane]] = place;
            }
            let (mut opaque, mut normal) = ([[0.0; 4]; LANES], [Vec4::ZERO; LANES]);
            let (at, time) = (self.image_points(simd, &at, offset), self.times(simd, &at, times));
            self.rock(simd, &spots, at, time).store(&mut opaque, &mut normal);
            for (lane, pixel) in pixels.iter().enumerate() {
                out.opaque[pixel.index as usize] = opaque[lane];
                out.normal[pixel.index as usize] = normal[lane];
            }
        }
    }

    /// Notes which pixels show a pool.
    #[inline(always)]
    fn keep_pools(
        &self,
        spots: &Spots,
        pixels: &Pixels,
        first: usize,
        count: usize,
        pools: &mut Vec<PoolPixel>,
    ) {
        if self.pools.is_empty() {
            return;
        }
        for lane in (0..count).filter(|&lane| pixels.ids[lane] != 0) {
            let tile = spots.tiles[lane];
            if self.mesh.tiles[tile as usize].pool > 0 {
                let place = [spots.places[0][lane], spots.places[1][lane]];
                let index = (first + lane) as u32;
                pools.push(PoolPixel { index, tile, place, depth: spots.depth.0[lane] });
            }
        }
    }

    /// The points of the image under the samples of pixels, given by their columns and rows.
    #[inline(always)]
    fn image_points<S: Simd>(&self, simd: S, pixels: &[[u32; LANES]; 2], offset: [f32; 2]) -> [Floats<S>; 2] {
        let Image { width, height, .. } = self.scene.image;
        let splat = |x: f32| f32x8::splat(simd, x);
        let [x, y] = [u32x8::load_array(simd, pixels[0]), u32x8::load_array(simd, pixels[1])];
        let [x, y]: [f32x8<S>; 2] = [x.to_float(), y.to_float()];
        [
            splat(2.0) * (x + splat(offset[0])) / splat(width as f32) - splat(1.0),
            splat(1.0) - splat(2.0) * (y + splat(offset[1])) / splat(height as f32),
        ]
    }

    /// Times of a sample in pixels, given by their columns and rows; zeros if no pool moves.
    #[inline(always)]
    fn times<S: Simd>(&self, simd: S, pixels: &[[u32; LANES]; 2], times: SampleTimes) -> Floats<S> {
        if self.scene.wave_moves == 0.0 {
            return f32x8::splat(simd, 0.0);
        }
        Stored::from_fn(|lane| times.of([pixels[0][lane], pixels[1][lane]])).load(simd)
    }

    /// Radiance of the background; in a picture with alpha only that of the haze in front of it. Lanes that
    /// are `skipped` get any values. Twin: `background_targets`.
    #[inline(always)]
    fn background<S: Simd>(&self, simd: S, at: [Floats<S>; 2], skipped: mask32x8<S>) -> Seen<S> {
        let [forward, right, up] = self.rays.map(|v| Lanes3::splat(simd, v));
        let d = forward.plus(right.times(at[0])).plus(up.times(at[1]));
        let d = d.over(d.dot(d).sqrt());
        let zero = f32x8::splat(simd, 0.0);
        let nothing = Lanes3 { x: zero, y: zero, z: zero };
        let radiance = match &self.scene.environment {
            _ if self.scene.image.alpha => nothing,
            None => background_at(simd, &self.scene.background, d),
            Some(environment) => {
                let mut directions = Stored3::default();
                directions.store(d);
                let skipped = skipped.to_bitmask();
                let of = |lane: usize| match skipped >> lane & 1 {
                    0 => environment.radiance(directions.get(lane)),
                    _ => Vec3::ZERO,
                };
                Stored3::from_fn(of).load(simd)
            }
        };
        if self.haze.density == 0.0 {
            let one = f32x8::splat(simd, 1.0);
            return Seen { opaque: (radiance, zero), normal: (nothing, one) };
        }
        let passes = haze::transmittance(simd, &self.haze, d.y, f32x8::splat(simd, self.haze.far));
        let radiance = haze::in_front_of(simd, &self.haze, radiance, passes);
        Seen { opaque: (radiance, zero), normal: (nothing, passes) }
    }

    /// Radiance, metres from the eye, and normal of the opaque points under the samples. Of a holdout in a
    /// picture with alpha, only the haze in front of it has a radiance. Lanes without rock get any values.
    #[inline(always)]
    fn rock<S: Simd>(&self, simd: S, spots: &Spots, at: [Floats<S>; 2], time: Floats<S>) -> Seen<S> {
        let splat = |x: f32| f32x8::splat(simd, x);
        let scene = self.scene;
        let position = self.points(simd, at, spots.depth.load(simd));
        let mut tiles = [&self.mesh.tiles[0]; LANES];
        let mut holes = [0u32; LANES];
        for lane in 0..LANES {
            tiles[lane] = &self.mesh.tiles[spots.tiles[lane] as usize];
            holes[lane] = u32::from(tiles[lane].holdout && scene.image.alpha);
        }
        let points = Points::at(simd, &self.mesh.vertices, tiles, &spots.places, position);
        let mut seen = (points, points.view(simd, scene));
        if tiles.iter().any(|tile| tile.stone > 0) {
            seen = lay_stones(simd, &self.mesh.stones, tiles, seen, self.sample_angle);
        }
        let (points, view) = seen;
        let mut distance = view.distance;
        let (mut radiance, mut normal) = if tiles.iter().any(|tile| tile.paint > 0) {
            let [forward, right, up] = self.rays.map(|v| Lanes3::splat(simd, v));
            let rays = forward.plus(right.times(at[0])).plus(up.times(at[1]));
            let samples = Samples { eye: self.eye, rays, angle: self.sample_angle };
            let looks = Looks::at(self.mesh, tiles, &spots.places, &points, view.n, &samples);
            looks.shade(simd, scene, self.shadow_light, &points, view)
        } else {
            (points.lambert(simd, scene, self.shadow_light, &view), view.n)
        };
        let mut of_pools = [0u32; LANES];
        for number in 0..self.pools.len() as u32 {
            for lane in 0..LANES {
                of_pools[lane] = u32::from(tiles[lane].pool == number + 1);
            }
            let is_here = !u32x8::load_array(simd, of_pools).simd_eq(0);
            if is_here.any_true() {
                let maps = self.slopes[number as usize].as_ref().zip(self.mesh.field(number as usize));
                let pool = (&self.pools[number as usize], maps);
                let at = (at, time);
                let seen = pool::shade(simd, scene, self.shadow_light, &self.rays, pool, &points, at);
                let seen = Seen { opaque: (seen.0, seen.1), normal: (seen.2, distance) };
                let others = Seen { opaque: (radiance, distance), normal: (normal, distance) };
                let Seen { opaque, normal: (n, _) } = seen.or(others, is_here);
                ((radiance, distance), normal) = (opaque, n);
            }
        }
        let is_hole = !u32x8::load_array(simd, holes).simd_eq(0);
        let zero = splat(0.0);
        let mut passes = zero;
        if is_hole.any_true() {
            radiance = radiance.times(is_hole.select(zero, splat(1.0)));
            passes = is_hole.select(splat(1.0), zero);
        }
        if self.haze.density != 0.0 {
            let d_y = (position.y - splat(self.eye.y)) / distance.max(splat(1e-20));
            let transmittance = haze::transmittance(simd, &self.haze, d_y, distance);
            radiance = haze::in_front_of(simd, &self.haze, radiance, transmittance);
            passes = is_hole.select(transmittance, zero);
        }
        Seen { opaque: (radiance, distance), normal: (normal, passes) }
    }

    /// The points at these depths under points of the image. Twin: `point_at` of
    /// `shaders/layout.wgsl`.
    #[inline(always)]
    fn points<S: Simd>(&self, simd: S, at: [Floats<S>; 2], z: Floats<S>) -> Lanes3<S> {
        let splat = |x: f32| f32x8::splat(simd, x);
        let DepthToPoint { anchor, shift, rise, slope, scale } = self.to_point;
        let [forward, right, up] = self.rays.map(|v| Lanes3::splat(simd, v));
        let inverse = splat(1.0) / (z - splat(shift));
        let along = (splat(rise) + splat(slope) * z) * inverse;
        let aside = right.times(at[0]).plus(up.times(at[1])).times(splat(scale) * inverse);
        Lanes3::splat(simd, anchor).plus(forward.times(along)).plus(aside)
    }

    /// Maps the volume quads under each pixel of a band, `layers` per sample.
    pub fn water(&self, water: &Rasteriser, covered: &[Covered], sample: Which, out: &mut Gbuffer) {
        let [forward, right, up] = self.rays;
        let Image { width, height, .. } = self.scene.image;
        let layers = out.layers;
        let window = out.window;
        for (i, pixel) in window.each().enumerate() {
            let faces = &covered[(i * sample.count + sample.index) * layers..][..layers];
            if faces[0].1 == 0 {
                continue;
            }
            let at = Camera::image_point(width, height, pixel, sample.offset);
            let length = (forward + right * at.x + up * at.y).length();
            for (k, &(_, id)) in (i * layers..).zip(faces).take_while(|(_, (_, id))| *id != 0) {
                let number = water.face_of(id - 1);
                out.quad_id[k] = number + 1;
                out.surface[k] = match self.scene.face(number as usize) {
                    Face::Quad(quad) => map_quad(quad, &self.planes[number as usize], at, length),
                    Face::Hull(shell, face) => {
                        let corners = self.scene.hull_corners(&self.scene.shells[shell], face);
                        map_hull(corners, self.eye_local, forward + right * at.x + up * at.y)
                    }
                };
            }
        }
    }
}

impl Which {
    /// How far the sample sees points from where the pixel's centre sees them, pixels.
    fn shift(&self) -> [f64; 2] {
        self.in_pixel.map(raster::shift)
    }
}

impl Pixels {
    /// The pixels of a window from number `first`, of which there are `count`.
    #[inline(always)]
    fn new(window: Window, first: usize, count: usize, covered: &[Covered], sample: Which) -> Self {
        let mut pixels = Pixels { at: [[0; LANES]; 2], ids: [0; LANES], depth: Stored::default() };
        let [mut x, mut y] = [first as u32 % window.width, first as u32 / window.width];
        for lane in 0..LANES {
            let (depth, id) = covered[(first + lane.min(count - 1)) * sample.count + sample.index];
            (pixels.depth.0[lane], pixels.ids[lane]) = (depth, id);
            (pixels.at[0][lane], pixels.at[1][lane]) = (window.x + x, window.y + y);
            if lane + 1 < count {
                x += 1;
                if x == window.width {
                    (x, y) = (0, y + 1);
                }
            }
        }
        pixels
    }

    /// Number of the triangle of each pixel. Pixels without one get that of another.
    #[inline(always)]
    fn triangles(&self) -> [u32; LANES] {
        let mut any = 1;
        for lane in 0..LANES {
            any = any.max(self.ids[lane]);
        }
        let mut out = [any - 1; LANES];
        for lane in 0..LANES {
            if self.ids[lane] != 0 {
                out[lane] = self.ids[lane] - 1;
            }
        }
        out
    }
}

impl Spots {
    /// Finds the points that samples of pixels see. Pixels without rock get any.
    #[inline(always)]
    fn new<S: Simd>(simd: S, rock: &Rasteriser, pixels: &Pixels, sample: Which) -> Self {
        let triangles = pixels.triangles();
        let places = rock.places(simd, &triangles, &pixels.at, sample.shift());
        let mut tiles = [0; LANES];
        for lane in 0..LANES {
            tiles[lane] = Rasteriser::piece_of(triangles[lane]);
        }
        Spots { tiles, places, depth: pixels.depth }
    }
}

impl<S: Simd> Seen<S> {
    /// Takes what `other` sees in the lanes that are not `own`.
    #[inline(always)]
    fn or(self, other: Seen<S>, own: mask32x8<S>) -> Seen<S> {
        let of = |(v, w): (Lanes3<S>, Floats<S>), (other, more): (Lanes3<S>, Floats<S>)| {
            let v = Lanes3 {
                x: own.select(v.x, other.x),
                y: own.select(v.y, other.y),
                z: own.select(v.z, other.z),
            };
            (v, own.select(w, more))
        };
        Seen { opaque: of(self.opaque, other.opaque), normal: of(self.normal, other.normal) }
    }

    /// Stores the first lanes, one for each pixel.
    #[inline(always)]
    fn store(self, opaque: &mut [[f32; 4]], normal: &mut [Vec4]) {
        let (mut radiance, mut normals) = (Stored4::default(), Stored4::default());
        radiance.store(self.opaque.0, self.opaque.1);
        normals.store(self.normal.0, self.normal.1);
        for lane in 0..opaque.len() {
            opaque[lane] = radiance.get(lane);
            normal[lane] = normals.get(lane).into();
        }
    }
}

/// Vectors of eight lanes in memory, with a fourth number each.
#[derive(Clone, Copy, Debug, Default)]
struct Stored4(Stored3, Stored);

impl Stored4 {
    #[inline(always)]
    fn store<S: Simd>(&mut self, v: Lanes3<S>, w: Floats<S>) {
        self.0.store(v);
        self.1.store(w);
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> [f32; 4] {
        let [x, y, z] = &self.0.0;
        [x.0[lane], y.0[lane], z.0[lane], self.1.0[lane]]
    }
}
