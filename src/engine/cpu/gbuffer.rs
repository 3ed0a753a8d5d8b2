//! §3 The raster pass on the CPU. Twin: `shaders/gbuffer.wgsl`, with the fill rule of a GPU
//! (corners snapped to 1/256 pixel, top-left rule), so that the two cover the same pixels.

use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::opaque::{Opaque, shade_opaque};
use super::pool::shade_pool;
use crate::engine::{overlap, pool_surface};
use crate::light::haze::EyeHaze;
use crate::mapping::Quad;
use crate::picture::Image;
use crate::picture::camera::sample_offset;
use crate::place::{Mesh, tiles};
use crate::scene::Scene;
use crate::util::window::Window;

/// The targets of one sample of a part of the image, row by row.
pub struct Gbuffer {
    /// The part.
    pub window: Window,
    /// Radiance of the opaque scene or background, and metres from the eye (0: background).
    pub opaque: Vec<[f32; 4]>,
    /// Its normal.
    pub normal: Vec<Vec3>,
    /// Faces of a pixel that are kept.
    pub layers: usize,
    /// u, v, metres from the eye; `layers` for each pixel, the nearest first.
    pub surface: Vec<[f32; 3]>,
    /// Quad number plus 1; 0: none. As many.
    pub quad_id: Vec<u32>,
}

impl Gbuffer {
    /// The faces of pixel `i` in order of depth: number of the quad, and u, v, metres from the eye.
    pub fn faces(&self, i: usize) -> impl Iterator<Item = (usize, [f32; 3])> {
        let own = i * self.layers..(i + 1) * self.layers;
        let ids = self.quad_id[own.clone()].iter().take_while(|&&id| id != 0);
        ids.zip(&self.surface[own]).map(|(&id, &hit)| (id as usize - 1, hit))
    }
}

/// A triangle in pixels, clipped at the near plane.
struct ScreenTriangle {
    x: [f64; 3],
    y: [f64; 3],
    inverse_w: [f64; 3],
    /// Each corner as weights of the corners before clipping.
    weights: [Vec3; 3],
    /// Number of the tile or the quad.
    id: u32,
    /// Corners of the tile.
    corners: [u16; 3],
}

/// What covers a pixel: depth (reversed, 0 is far), and the triangle's place in the list plus 1.
type Covered = (f32, u32);

/// Fills the targets of the whole image with sample `sample`.
pub fn run(scene: &Scene, mesh: &Mesh, sample: u32) -> Gbuffer {
    let Image { width, height, .. } = scene.image;
    run_window(scene, mesh, Window { x: 0, y: 0, width, height }, sample)
}

/// Fills the targets of a window inside the image with sample `sample`, with the same bits as those of
/// the whole image.
pub fn run_window(scene: &Scene, mesh: &Mesh, window: Window, sample: u32) -> Gbuffer {
    let image = &scene.image;
    let (width, height) = (window.width as usize, window.height as usize);
    let offset = sample_offset(image, sample);
    let clip_from_world = scene.camera.clip_from_world(image.width, image.height, offset);
    let near = scene.camera.near as f64;
    let project = |points: [Vec3; 3], id: u32, corners: [u16; 3], out: &mut Vec<ScreenTriangle>| {
        let clip = points.map(|p| clip_from_world * p.extend(1.0));
        clip_near(clip, scene.camera.near, |part| {
            let triangle = to_screen(part, image.width as usize, image.height as usize, id, corners);
            // Most triangles of a fine mesh lie between the pixels' centres.
            if triangle.covers_centres(window) {
                out.push(triangle);
            }
        });
    };
    let steps = tiles::steps(&mesh.tiles, &scene.camera, image);
    let rock: Vec<ScreenTriangle> = mesh
        .tiles
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, tile)| {
            let mut out = Vec::new();
            let point =
                |corner| Vec3::from(mesh.vertices[tile.vertex(tiles::place(corner)) as usize].position);
            let drawn = tiles::triangles(tile.side, steps[i], tiles::coarser(&mesh.tiles, &steps, i));
            for &corners in drawn.as_chunks::<3>().0 {
                project(corners.map(point), i as u32, corners, &mut out);
            }
            out
        })
        .collect();
    let mut water = Vec::new();
    for (i, quad) in scene.quads.iter().enumerate() {
        let [a, b, c, d] = quad.corners;
        project([a, b, c], i as u32, [0; 3], &mut water);
        project([a, c, d], i as u32, [0; 3], &mut water);
    }
    let shadow_light = scene.shadow_light();
    let pools = pool_surface::surfaces(scene, mesh);
    let layers = overlap::sheets(scene) as usize;
    let haze = scene.haze.seen_from(scene.camera.eye);
    let rows = 16.min(height);
    let rock_bins = bins(&rock, window, rows);
    let water_bins = bins(&water, window, rows);

    let eye_plane: Vec<Vec3> = scene.quads.iter().map(|q| eye_in_plane(q, scene.camera.eye)).collect();
    let mut out = Gbuffer {
        window,
        opaque: vec![[0.0; 4]; width * height],
        normal: vec![Vec3::ZERO; width * height],
        layers,
        surface: vec![[0.0; 3]; width * height * layers],
        quad_id: vec![0; width * height * layers],
    };
    let band = rows * width;
    out.opaque
        .par_chunks_mut(band)
        .zip(out.normal.par_chunks_mut(band))
        .zip(out.surface.par_chunks_mut(band * layers))
        .zip(out.quad_id.par_chunks_mut(band * layers))
        .enumerate()
        .for_each(|(i, (((opaque, normal), surface), quad_id))| {
            let band =
                Window { y: window.y + (i * rows) as u32, height: (opaque.len() / width) as u32, ..window };
            let pixel = |k: usize| [band.x + (k % width) as u32, band.y + (k / width) as u32];
            let ray = |k: usize| scene.camera.view_ray(image.width, image.height, pixel(k), offset);
            let mut covered: Vec<Covered> = vec![(0.0, 0); opaque.len()];
            rasterise(&rock, &rock_bins[i], near, band, &mut covered, 1);
            for (k, &(depth, id)) in covered.iter().enumerate() {
                if id == 0 {
                    let radiance = match &scene.environment {
                        None => scene.background.radiance(ray(k)),
                        Some(environment) => environment.radiance(ray(k)),
                    };
                    let d_y = ray(k).y;
                    opaque[k] = hazed(&haze, radiance, d_y, haze.far).extend(0.0).to_array();
                } else {
                    let triangle = &rock[id as usize - 1];
                    let centre = pixel(k).map(|p| p as f64 + 0.5);
                    let weights = triangle.weights_at(centre).to_array();
                    let place = (0..3).map(|c| tiles::at(triangle.corners[c]) * weights[c]).sum();
                    let d = ray(k);
                    let metres = scene.camera.near / (depth * d.dot(scene.camera.forward));
                    let position = scene.camera.eye + d * metres;
                    let point = Opaque::at(mesh, &mesh.tiles[triangle.id as usize], place, position);
                    let (radiance, n) = match point.pool {
                        0 => shade_opaque(scene, shadow_light, &point),
                        pool => shade_pool(scene, shadow_light, &pools[pool as usize - 1], &point, ray(k)),
                    };
                    let distance = radiance[3];
                    let d_y = (point.position.y - scene.camera.eye.y) / distance.max(1e-20);
                    let radiance = hazed(&haze, Vec3::from_slice(&radiance), d_y, distance);
                    let radiance = radiance.extend(distance).to_array();
                    opaque[k] = radiance;
                    normal[k] = n;
                }
            }
            let mut covered: Vec<Covered> =
                covered.iter().flat_map(|&(depth, _)| std::iter::repeat_n((depth, 0), layers)).collect();
            rasterise(&water, &water_bins[i], near, band, &mut covered, layers);
            for (k, &(_, id)) in covered.iter().enumerate() {
                if id != 0 {
                    let quad = water[id as usize - 1].id;
                    quad_id[k] = quad + 1;
                    surface[k] =
                        map_quad(&scene.quads[quad as usize], eye_plane[quad as usize], ray(k / layers));
                }
            }
        });
    out
}

/// The eye relative to corner A along e1, e2 and n, subtracted in float64.
pub fn eye_in_plane(quad: &Quad, eye: Vec3) -> Vec3 {
    let away = eye.as_dvec3() - quad.map.a_world.as_dvec3();
    Vec3::from_array(
        [quad.map.e1_world, quad.map.e2_world, quad.map.n_world].map(|axis| away.dot(axis.as_dvec3()) as f32),
    )
}

/// Where the ray `d` meets a quad: u, v and metres. Twin: `volume_fragment`.
pub fn map_quad(quad: &Quad, eye_plane: Vec3, d: Vec3) -> [f32; 3] {
    let map = &quad.map;
    let d_n = d.dot(map.n_world);
    let d_n = if d_n.abs() < 1e-20 { 1e-20 } else { d_n };
    let t = (-eye_plane.z / d_n).clamp(0.0, 1e9);
    let hh = eye_plane.truncate() + Vec2::new(d.dot(map.e1_world), d.dot(map.e2_world)) * t;
    let uv = map.uv(hh);
    [uv.x, uv.y, t]
}

/// Twin: `haze_over`.
fn hazed(haze: &EyeHaze, radiance: Vec3, d_y: f32, t: f32) -> Vec3 {
    if haze.density == 0.0 {
        return radiance;
    }
    haze.over(radiance, haze.transmittance(d_y, t))
}

/// Cuts a triangle at w = near and gives each part as corners with weights of the original three.
fn clip_near(clip: [Vec4; 3], near: f32, mut part: impl FnMut([(Vec4, Vec3); 3])) {
    let corners = [(clip[0], Vec3::X), (clip[1], Vec3::Y), (clip[2], Vec3::Z)];
    // Almost all are whole.
    if clip.iter().all(|corner| corner.w >= near) {
        return part(corners);
    }
    let mut polygon: Vec<(Vec4, Vec3)> = Vec::with_capacity(4);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        let (inside_a, inside_b) = (a.0.w >= near, b.0.w >= near);
        if inside_a {
            polygon.push(a);
        }
        if inside_a != inside_b {
            let s = (near - a.0.w) / (b.0.w - a.0.w);
            let mut cut = a.0.lerp(b.0, s);
            cut.w = near;
            polygon.push((cut, a.1.lerp(b.1, s)));
        }
    }
    for i in 2..polygon.len() {
        part([polygon[0], polygon[i - 1], polygon[i]]);
    }
}

fn to_screen(
    part: [(Vec4, Vec3); 3],
    width: usize,
    height: usize,
    id: u32,
    corners: [u16; 3],
) -> ScreenTriangle {
    // Far outside the image snapping has no meaning and would lose the fraction's bits.
    let snap = |x: f64| (x.clamp(-1e9, 1e9) * 256.0).round() / 256.0;
    let mut t = ScreenTriangle {
        x: part.map(|(c, _)| snap((c.x as f64 / c.w as f64 * 0.5 + 0.5) * width as f64)),
        y: part.map(|(c, _)| snap((0.5 - c.y as f64 / c.w as f64 * 0.5) * height as f64)),
        inverse_w: part.map(|(c, _)| 1.0 / c.w as f64),
        weights: part.map(|(_, w)| w),
        id,
        corners,
    };
    if t.area() < 0.0 {
        t.x.swap(1, 2);
        t.y.swap(1, 2);
        t.inverse_w.swap(1, 2);
        t.weights.swap(1, 2);
    }
    t
}

impl ScreenTriangle {
    fn edge(&self, i: usize, p: [f64; 2]) -> f64 {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        (self.x[b] - self.x[a]) * (p[1] - self.y[a]) - (self.y[b] - self.y[a]) * (p[0] - self.x[a])
    }

    fn area(&self) -> f64 {
        self.edge(2, [self.x[2], self.y[2]])
    }

    /// Whether it has an area and its bounding box holds a pixel's centre of the window.
    fn covers_centres(&self, window: Window) -> bool {
        let ((x0, x1), (y0, y1)) = self.centres(window);
        self.area() > 0.0 && x0 < x1 && y0 < y1
    }

    /// The half-open ranges of the columns and rows of the window whose centres its bounding box holds.
    fn centres(&self, window: Window) -> ((usize, usize), (usize, usize)) {
        let range = |v: [f64; 3], first: u32, count: u32| {
            let low = (v[0].min(v[1]).min(v[2]) - 0.5).ceil().max(first as f64);
            let high = (v[0].max(v[1]).max(v[2]) - 0.5).floor() + 1.0;
            (low as usize, (high.max(0.0) as usize).min((first + count) as usize))
        };
        (range(self.x, window.x, window.width), range(self.y, window.y, window.height))
    }

    /// Whether a point on edge i belongs to this triangle: it does on top and left edges.
    fn owns_edge(&self, i: usize) -> bool {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        let (dx, dy) = (self.x[b] - self.x[a], self.y[b] - self.y[a]);
        dy < 0.0 || (dy == 0.0 && dx > 0.0)
    }

    /// Perspective-correct weights of the original corners at a pixel position.
    fn weights_at(&self, p: [f64; 2]) -> Vec3 {
        let w = [0, 1, 2].map(|i| self.edge(i, p) * self.inverse_w[i]);
        let sum: f64 = w.iter().sum();
        (0..3).map(|i| self.weights[i] * (w[i] / sum) as f32).sum()
    }
}

/// For each band of `rows` rows of the window the numbers of the triangles that reach into it, in order.
fn bins(triangles: &[ScreenTriangle], window: Window, rows: usize) -> Vec<Vec<u32>> {
    let mut bins = vec![Vec::new(); (window.height as usize).div_ceil(rows)];
    for (number, t) in triangles.iter().enumerate() {
        let (_, rows_met) = t.centres(window);
        let [first, last] = [rows_met.0, rows_met.1 - 1].map(|y| (y - window.y as usize) / rows);
        for bin in &mut bins[first..=last] {
            bin.push(number as u32);
        }
    }
    bins
}

/// Draws triangles into the band of rows that `covered` holds, `layers` for each pixel, the nearest first, of
/// equals the first. Of one `id` only the nearest stays: where snapping folds a quad seen from its edge, its two
/// triangles lie over one another.
fn rasterise(
    triangles: &[ScreenTriangle],
    numbers: &[u32],
    near: f64,
    band: Window,
    covered: &mut [Covered],
    layers: usize,
) {
    let (left, top, width) = (band.x as usize, band.y as usize, band.width as usize);
    for &number in numbers {
        let t = &triangles[number as usize];
        let area = t.area();
        let ((x0, x1), (y0, y1)) = t.centres(band);
        let owns = [0, 1, 2].map(|i| t.owns_edge(i));
        for y in y0..y1 {
            for x in x0..x1 {
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let e = [0, 1, 2].map(|i| t.edge(i, p));
                if (0..3).all(|i| e[i] > 0.0 || (e[i] == 0.0 && owns[i])) {
                    let inverse_w = (0..3).map(|i| e[i] * t.inverse_w[i]).sum::<f64>() / area;
                    let depth = (near * inverse_w) as f32;
                    let pixel = ((y - top) * width + x - left) * layers;
                    insert(&mut covered[pixel..pixel + layers], (depth, number + 1), |other| {
                        triangles[other as usize - 1].id == t.id
                    });
                }
            }
        }
    }
}

/// Puts a triangle where it belongs among those that cover a pixel; the last one falls out. Twin:
/// `peel_fragment`.
fn insert(faces: &mut [Covered], new: Covered, same: impl Fn(u32) -> bool) {
    let Some(place) = faces.iter().position(|face| new.0 > face.0) else { return };
    if faces[..place].iter().any(|face| face.1 != 0 && same(face.1)) {
        return;
    }
    let last = faces[place..].iter().position(|face| face.1 != 0 && same(face.1));
    let last = last.map_or(faces.len() - 1, |behind| place + behind);
    faces.copy_within(place..last, place + 1);
    faces[place] = new;
}
