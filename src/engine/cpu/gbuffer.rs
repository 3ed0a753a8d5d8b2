//! §3 The raster pass on the CPU. Twin: `shaders/engine/gbuffer.wgsl`. The rasteriser follows a GPU's fill
//! rule, so that both engines cover the same pixels.

mod edges;
mod projection;
mod raster;
mod shade;

use std::sync::OnceLock;

use fearless_simd::{Level, dispatch};
use glam::{DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use crate::engine::overlap;
use crate::mapping::{PlaneView, Quad};
use crate::picture::camera::{offset_in_pixel, sample_offset};
use crate::picture::{Image, SampleTimes};
use crate::place::Mesh;
use crate::scene::Scene;
use crate::util::window::Window;
use projection::Projection;
use raster::{Covered, Grid, Rasteriser, SAMPLES, Shifts};
use shade::{PoolPixel, Shading, Which};

/// The targets of one sample of a window of the image, row by row.
#[derive(Clone)]
pub struct Gbuffer {
    /// The window, pixels.
    pub window: Window,
    /// Linear radiance of the opaque scene or background, and metres from the eye (0: background).
    pub opaque: Vec<[f32; 4]>,
    /// Unit normal of the opaque scene (0: background), and the share of a backdrop behind the opaque scene
    /// that shows: 0 on what is visible, otherwise what haze lets through.
    pub normal: Vec<Vec4>,
    /// Volume quads kept per pixel.
    pub layers: usize,
    /// u, v and metres from the eye of each quad under a pixel: `layers` entries per pixel, the nearest
    /// first.
    pub surface: Vec<[f32; 3]>,
    /// Number of each quad under a pixel plus 1; 0: none. Faces of shells' hulls are numbered after the
    /// quads. Ordered as `surface`.
    pub quad_id: Vec<u32>,
    /// Pixels that show a pool.
    pools: Vec<PoolPixel>,
}

impl Gbuffer {
    /// Targets without pixels.
    pub fn empty(scene: &Scene) -> Self {
        Gbuffer {
            window: Window { x: 0, y: 0, width: 0, height: 0 },
            opaque: Vec::new(),
            normal: Vec::new(),
            layers: overlap::sheets(scene) as usize,
            surface: Vec::new(),
            quad_id: Vec::new(),
            pools: Vec::new(),
        }
    }

    /// Makes the targets those of another window. Their contents are of no use.
    fn resize(&mut self, window: Window) {
        let pixels = window.pixels() as usize;
        self.window = window;
        self.opaque.resize(pixels, [0.0; 4]);
        self.normal.resize(pixels, Vec4::ZERO);
        self.surface.resize(pixels * self.layers, [0.0; 3]);
        self.quad_id.resize(pixels * self.layers, 0);
    }

    /// Iterates over the quads and hull faces under pixel `i` in order of depth: the face's number, and u, v
    /// and metres from the eye.
    pub fn faces(&self, i: usize) -> impl Iterator<Item = (usize, [f32; 3])> {
        (0..).map_while(move |layer| self.face(i, layer))
    }

    /// One of [`Gbuffer::faces`], given by its position.
    pub fn face(&self, i: usize, layer: usize) -> Option<(usize, [f32; 3])> {
        let at = i * self.layers + layer;
        let id = if layer < self.layers { self.quad_id[at] } else { 0 };
        (id != 0).then(|| (id as usize - 1, self.surface[at]))
    }
}

/// Bytes of the targets per pixel of a scene's image.
pub fn pixel_bytes(scene: &Scene) -> u64 {
    let pools = if scene.pools.is_empty() { 0 } else { size_of::<PoolPixel>() as u64 };
    32 + pools + 16 * u64::from(overlap::sheets(scene))
}

/// Fills the targets of the whole image with sample `sample`.
pub fn run(scene: &Scene, mesh: &Mesh, sample: u32) -> Gbuffer {
    let Image { width, height, .. } = scene.image;
    run_window(scene, mesh, Window { x: 0, y: 0, width, height }, sample)
}

/// Fills the targets of a window inside the image with sample `sample`. The bits are those of the whole
/// image's targets.
pub fn run_window(scene: &Scene, mesh: &Mesh, window: Window, sample: u32) -> Gbuffer {
    run_on(Level::new(), scene, mesh, window, sample)
}

/// As [`run_window`], with an instruction set of the processor. The bits are the same with each.
pub fn run_on(simd: Level, scene: &Scene, mesh: &Mesh, window: Window, sample: u32) -> Gbuffer {
    let drawing = Drawing::new(simd, scene, mesh, window, &[sample]);
    let mut out = Gbuffer::empty(scene);
    out.resize(window);
    let (layers, band) = (out.layers, (drawing.grid.rows * window.width) as usize);
    out.opaque
        .par_chunks_mut(band)
        .zip(out.normal.par_chunks_mut(band))
        .zip(out.surface.par_chunks_mut(band * layers))
        .zip(out.quad_id.par_chunks_mut(band * layers))
        .enumerate()
        .for_each_init(
            || Canvas::empty(scene),
            |canvas, (i, (((opaque, normal), surface), quad_id))| {
                let drawn = drawing.sample(i, 0, canvas);
                opaque.copy_from_slice(&drawn.opaque);
                normal.copy_from_slice(&drawn.normal);
                surface.copy_from_slice(&drawn.surface);
                quad_id.copy_from_slice(&drawn.quad_id);
            },
        );
    out
}

/// Shades the pools in the drawn bands of a window again, of which nothing but the waves has changed.
pub fn shade_pools(scene: &Scene, mesh: &Mesh, sample: u32, bands: &mut [OnceLock<Gbuffer>]) {
    let shading = Shading::new(scene, mesh, &scene.depth_range(mesh));
    let (simd, offset) = (Level::new(), sample_offset(&scene.image, sample));
    let times = SampleTimes::new(&scene.image, sample);
    bands.par_iter_mut().filter_map(OnceLock::get_mut).for_each(|band| {
        dispatch!(simd, simd => shading.pools(simd, offset, times, band));
    });
}

/// Rows of a window that are drawn at a time.
pub fn band_rows(window: Window) -> u32 {
    let bands = BANDS_A_THREAD * rayon::current_num_threads() as u32;
    window.height.div_ceil(bands).min(MOST_ROWS)
}

/// Most rows of a window that are drawn at a time.
const MOST_ROWS: u32 = 16;

/// Bands for each thread, so that threads without work can take over some of the others' work, and the
/// memory of the bands in work is an eighth of what the whole window would take.
const BANDS_A_THREAD: u32 = 8;

/// Samples of a window, whose triangles are projected and which are drawn band by band.
pub struct Drawing<'a> {
    simd: Level,
    grid: Grid,
    /// Offset of each sample from the top left corner of a pixel, pixels.
    offsets: Vec<[f32; 2]>,
    /// The same in an image that is not shifted.
    in_pixel: Vec<[f32; 2]>,
    /// Times of each sample.
    times: Vec<SampleTimes>,
    rock: Rasteriser,
    water: Rasteriser,
    shading: Shading<'a>,
}

/// Memory that every band uses again.
pub struct Canvas {
    /// Band and first sample that are drawn.
    covered: Option<(usize, usize)>,
    rock: Vec<Covered>,
    water: Vec<Covered>,
    targets: Gbuffer,
}

impl Canvas {
    /// Memory for bands of a scene.
    pub fn empty(scene: &Scene) -> Self {
        Canvas { covered: None, rock: Vec::new(), water: Vec::new(), targets: Gbuffer::empty(scene) }
    }
}

impl<'a> Drawing<'a> {
    /// Projects the triangles of a window inside the image for samples, given by their numbers.
    pub fn new(simd: Level, scene: &'a Scene, mesh: &'a Mesh, window: Window, samples: &[u32]) -> Self {
        let offsets: Vec<[f32; 2]> = samples.iter().map(|&s| sample_offset(&scene.image, s)).collect();
        let times = samples.iter().map(|&s| SampleTimes::new(&scene.image, s)).collect();
        let in_pixel: Vec<_> = samples.iter().map(|&s| offset_in_pixel(&scene.image, s)).collect();
        let grid = Grid::new(window, band_rows(window), &in_pixel);
        let depth = scene.depth_range(mesh);
        let projection = Projection::new(scene, &depth, &grid);
        let faces = || {
            let mut water = projection.water();
            water.extend(projection.hulls());
            (Rasteriser::new(water, &grid), Shading::new(scene, mesh, &depth))
        };
        // Each has parts that run on one thread.
        let (rock, (water, shading)) = rayon::join(|| Rasteriser::new(projection.rock(mesh), &grid), faces);
        Drawing { simd, grid, offsets, in_pixel, times, rock, water, shading }
    }

    /// Returns the targets of band number `i` for one of the samples. Triangles are drawn for several
    /// at a time, so samples should be asked for in their order.
    pub fn sample<'c>(&self, i: usize, sample: usize, canvas: &'c mut Canvas) -> &'c Gbuffer {
        let first = sample - sample % SAMPLES;
        if canvas.covered != Some((i, first)) {
            self.cover(i, first, canvas);
            canvas.covered = Some((i, first));
        }
        self.shade(i, sample, canvas)
    }

    /// Draws the triangles of band number `i` for the samples from number `first` on, [`SAMPLES`] of them
    /// unless fewer are left.
    fn cover(&self, i: usize, first: usize, canvas: &mut Canvas) {
        let samples = &self.in_pixel[first..self.in_pixel.len().min(first + SAMPLES)];
        let shifts = Shifts::new(samples);
        let Canvas { rock, water, targets, .. } = canvas;
        rock.clear();
        rock.resize(samples.len() * self.grid.band(i).pixels() as usize, (0.0, 0));
        dispatch!(self.simd, simd => self.rock.draw(simd, i, &self.grid, &shifts, rock, 1));
        water.clear();
        if self.water.reaches(i) {
            water.resize(rock.len() * targets.layers, (0.0, 0));
            for (faces, &(depth, _)) in water.chunks_mut(targets.layers).zip(&*rock) {
                faces.fill((depth, 0));
            }
            let layers = targets.layers;
            dispatch!(self.simd, simd => self.water.draw(simd, i, &self.grid, &shifts, water, layers));
        }
    }

    /// Shades one of the samples that [`Drawing::cover`] has drawn last in the band.
    fn shade<'c>(&self, i: usize, sample: usize, canvas: &'c mut Canvas) -> &'c Gbuffer {
        let Canvas { rock, water, targets, .. } = canvas;
        targets.resize(self.grid.band(i));
        targets.surface.fill([0.0; 3]);
        targets.quad_id.fill(0);
        targets.pools.clear();
        let first = sample - sample % SAMPLES;
        let count = SAMPLES.min(self.offsets.len() - first);
        let (offset, times) = (self.offsets[sample], self.times[sample]);
        let sample = Which { index: sample - first, count, offset, in_pixel: self.in_pixel[sample], times };
        dispatch!(self.simd, simd => self.shading.opaque(simd, &self.rock, rock, sample, targets));
        if self.water.reaches(i) {
            self.shading.water(&self.water, water, sample, targets);
        }
        targets
    }
}

/// Returns where the ray through the point `at` of the image meets a quad, whose plane is `plane`: u, v and
/// metres from the eye. `length` is that of
/// [`Camera::ray_to`](crate::picture::Camera::ray_to). Twin: `quad_hit` of `shaders/mapping.wgsl`.
pub fn map_quad(quad: &Quad, plane: &PlaneView, at: Vec2, length: f32) -> [f32; 3] {
    let (hh, t) = plane.hit(at);
    let uv = quad.map.uv(hh);
    [uv.x, uv.y, t * length]
}

/// Returns where the ray from the eye in the direction of `ray` meets a face of a shell's hull, given by its
/// corners and their texture coordinates: u, v and metres from the eye. A rasteriser rounds corners, so the
/// ray may pass by the face; the point then lies in the face's plane, at a distance of its corners.
pub fn map_hull((corners, uv): ([Vec3; 3], [Vec2; 3]), eye: DVec3, ray: Vec3) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| p.as_dvec3() - eye);
    let d = ray.as_dvec3().normalize();
    let normal = (b - a).cross(c - a);
    let along = [a, b, c].map(|p| p.dot(d));
    let low = along[0].min(along[1]).min(along[2]);
    let high = along[0].max(along[1]).max(along[2]);
    let t = (normal.dot(a) / normal.dot(d)).max(low).min(high);
    let p = d * t;
    let of = |[p0, p1]: [DVec3; 2]| (p0 - p).cross(p1 - p).dot(normal).max(0.0);
    let areas = [of([b, c]), of([c, a]), of([a, b])];
    let sum = areas[0] + areas[1] + areas[2];
    let shares = areas.map(|area| if sum > 0.0 { (area / sum) as f32 } else { 1.0 / 3.0 });
    let uv: Vec2 = uv.into_iter().zip(shares).map(|(uv, share)| uv * share).sum();
    [uv.x, uv.y, t as f32]
}
