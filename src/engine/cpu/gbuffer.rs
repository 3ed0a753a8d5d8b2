//! §3 The raster pass on the CPU. Twin: `shaders/engine/gbuffer.wgsl`. The rasteriser follows a GPU's fill
//! rule, so that both engines cover the same pixels.

mod raster;

use glam::{BVec3, Mat4, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::opaque::{Opaque, shade_opaque};
use super::pool::shade_pool;
use super::waves::Waves;
use crate::engine::pool_surface::Surface;
use crate::engine::{overlap, pool_surface};
use crate::light::haze::EyeHaze;
use crate::mapping::{PlaneView, Quad};
use crate::picture::camera::{DepthRange, DepthToPoint, sample_offset};
use crate::picture::{Camera, Image};
use crate::place::{Mesh, tiles};
use crate::scene::{Parts, Scene};
use crate::util::window::Window;
use raster::{Covered, Rasteriser, ScreenPoint, Triangles};

/// The targets of one sample of a window of the image, row by row.
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
    /// Number of each quad under a pixel plus 1; 0: none. Ordered as `surface`.
    pub quad_id: Vec<u32>,
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

    /// Iterates over the quads under pixel `i` in order of depth: the quad's number, and u, v and metres from
    /// the eye.
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
    28 + 16 * u64::from(overlap::sheets(scene))
}

/// Fills the targets of the whole image with sample `sample`.
pub fn run(scene: &Scene, mesh: &Mesh, sample: u32) -> Gbuffer {
    let Image { width, height, .. } = scene.image;
    run_window(scene, mesh, Window { x: 0, y: 0, width, height }, sample)
}

/// Fills the targets of a window inside the image with sample `sample`. The bits are those of the whole
/// image's targets.
pub fn run_window(scene: &Scene, mesh: &Mesh, window: Window, sample: u32) -> Gbuffer {
    let drawing = Drawing::new(scene, mesh, window, sample);
    let mut out = Gbuffer::empty(scene);
    out.resize(window);
    let (layers, band) = (out.layers, BAND_ROWS as usize * window.width as usize);
    out.opaque
        .par_chunks_mut(band)
        .zip(out.normal.par_chunks_mut(band))
        .zip(out.surface.par_chunks_mut(band * layers))
        .zip(out.quad_id.par_chunks_mut(band * layers))
        .enumerate()
        .for_each(|(i, (((opaque, normal), surface), quad_id))| {
            drawing.draw(i, Targets { opaque, normal, surface, quad_id });
        });
    out
}

/// Rows of a window that are drawn at a time.
pub const BAND_ROWS: u32 = 16;

/// Targets of a band of rows.
struct Targets<'a> {
    opaque: &'a mut [[f32; 4]],
    normal: &'a mut [Vec4],
    surface: &'a mut [[f32; 3]],
    quad_id: &'a mut [u32],
}

/// One sample of a window, whose triangles are projected and which is drawn band by band: each has
/// [`BAND_ROWS`] rows, the last one as many as are left.
pub struct Drawing<'a> {
    frame: WindowFrame<'a>,
    rock: Rasteriser,
    water: Rasteriser,
    layers: usize,
}

impl<'a> Drawing<'a> {
    /// Projects sample `sample` of a window inside the image.
    pub fn new(scene: &'a Scene, mesh: &'a Mesh, window: Window, sample: u32) -> Self {
        let frame = WindowFrame::new(scene, mesh, window, sample);
        let rock = Rasteriser::new(frame.rock_triangles(), window, BAND_ROWS as usize);
        let water = Rasteriser::new(frame.water_triangles(), window, BAND_ROWS as usize);
        Drawing { frame, rock, water, layers: overlap::sheets(scene) as usize }
    }

    /// Fills the targets of band number `i`.
    pub fn band(&self, i: usize, out: &mut Gbuffer) {
        out.resize(self.window_of(i));
        let Gbuffer { opaque, normal, surface, quad_id, .. } = out;
        surface.fill([0.0; 3]);
        quad_id.fill(0);
        self.draw(i, Targets { opaque, normal, surface, quad_id });
    }

    fn window_of(&self, i: usize) -> Window {
        let window = self.frame.window;
        let y = window.y + i as u32 * BAND_ROWS;
        Window { y, height: BAND_ROWS.min(window.bottom() - y), ..window }
    }

    /// Fills the targets of band number `i`, whose `surface` and `quad_id` are 0.
    fn draw(&self, i: usize, Targets { opaque, normal, surface, quad_id }: Targets) {
        let (band, layers) = (self.window_of(i), self.layers);
        let mut covered: Vec<Covered> = vec![(0.0, 0); opaque.len()];
        self.rock.draw(i, band, &mut covered, 1);
        self.frame.shade_rock(&self.rock, &covered, band, opaque, normal);
        let mut covered: Vec<Covered> =
            covered.iter().flat_map(|&(depth, _)| std::iter::repeat_n((depth, 0), layers)).collect();
        self.water.draw(i, band, &mut covered, layers);
        self.frame.map_water(&self.water, &covered, band, layers, surface, quad_id);
    }
}

/// Corners of the largest tile.
const GRID: usize = ((tiles::SIDE + 1) * (tiles::SIDE + 1)) as usize;

/// The projection of one sample.
struct Projection {
    clip_from_world: Mat4,
    /// Width and height of the image, pixels.
    size: [usize; 2],
    near: f32,
    window: Window,
}

impl Projection {
    /// Adds a point. Returns it in clip space, with its index.
    fn point(&self, point: Vec3, out: &mut Triangles) -> (Vec4, u32) {
        let clip = self.clip_from_world * point.extend(1.0);
        (clip, out.add_point(ScreenPoint::new(clip, self.size)))
    }

    /// Adds the parts of a triangle that may cover a pixel's centre. Its points are in clip space, with their
    /// indices.
    fn triangle(&self, points: [(Vec4, u32); 3], of: (u32, [u16; 3]), out: &mut Triangles) {
        // Almost all triangles lie wholly in front.
        if points.iter().all(|(clip, _)| clip.w >= self.near) {
            return out.add(points.map(|(_, number)| number), None, of, self.window);
        }
        raster::clip_near(points.map(|(clip, _)| clip), self.near, |part| {
            let points = part.map(|(clip, _)| out.add_point(ScreenPoint::new(clip, self.size)));
            out.add(points, Some(part.map(|(_, weights)| weights)), of, self.window);
        });
    }

    /// Whether anything in a box may cover a pixel's centre of the window. Only boxes that lie wholly beyond
    /// one side of the view, or behind the eye, are left out.
    fn may_show(&self, low: Vec3, high: Vec3) -> bool {
        let [width, height] = self.size.map(|n| n as f32);
        // The sides of the window with a pixel around it, in clip space over w.
        let Window { x, y, .. } = self.window;
        let side = |pixels: f32, size: f32| 2.0 * pixels / size - 1.0;
        let [left, right] =
            [x as f32 - 1.0, self.window.right() as f32 + 1.0].map(|pixels| side(pixels, width));
        let [top, bottom] =
            [y as f32 - 1.0, self.window.bottom() as f32 + 1.0].map(|pixels| -side(pixels, height));
        let mut beyond = [true; 5];
        for corner in 0..8 {
            let point =
                Vec3::select(BVec3::new(corner & 1 == 0, corner & 2 == 0, corner & 4 == 0), low, high);
            let c = self.clip_from_world * point.extend(1.0);
            let outside =
                [c.w < self.near, c.x < left * c.w, c.x > right * c.w, c.y > top * c.w, c.y < bottom * c.w];
            beyond = [0, 1, 2, 3, 4].map(|i| beyond[i] && outside[i]);
        }
        !beyond.contains(&true)
    }
}

/// Everything that the pixels of one sample of a window share.
struct WindowFrame<'a> {
    scene: &'a Scene,
    mesh: &'a Mesh,
    window: Window,
    /// Offset of the sample from the pixel's centre, pixels.
    offset: [f32; 2],
    shadow_light: Option<usize>,
    pools: Vec<(Surface, Waves)>,
    haze: EyeHaze,
    /// Vectors forward, right and up of the camera; see [`Camera::rays`].
    rays: [Vec3; 3],
    /// Position of the eye, metres.
    eye: Vec3,
    /// The planes of the quads.
    planes: Vec<PlaneView>,
    depth: DepthRange,
    to_point: DepthToPoint,
}

impl<'a> WindowFrame<'a> {
    fn new(scene: &'a Scene, mesh: &'a Mesh, window: Window, sample: u32) -> Self {
        let Parts { camera, image, .. } = &**scene;
        let with_waves = |surface: Surface| {
            let waves = Waves::new(&surface);
            (surface, waves)
        };
        let (eye, rays) = (camera.eye_local(), camera.rays(image.width, image.height));
        let depth = scene.depth_range(mesh);
        WindowFrame {
            scene,
            mesh,
            window,
            offset: sample_offset(&scene.image, sample),
            shadow_light: scene.shadow_light(),
            pools: pool_surface::surfaces(scene, mesh).into_iter().map(with_waves).collect(),
            haze: scene.haze.seen_from(eye),
            rays: rays.map(|v| v.as_vec3()),
            eye: eye.as_vec3(),
            planes: scene.quads.iter().map(|quad| PlaneView::of_quad(&quad.map, eye, rays)).collect(),
            depth,
            to_point: camera.depth_to_point(&depth),
        }
    }

    /// The pixel of the image at index `k` of a band.
    fn pixel(&self, band: Window, k: usize) -> [u32; 2] {
        let width = band.width as usize;
        [band.x + (k % width) as u32, band.y + (k / width) as u32]
    }

    /// The point of the image under the sample of index `k` of a band.
    fn image_point(&self, band: Window, k: usize) -> Vec2 {
        let image = &self.scene.image;
        Camera::image_point(image.width, image.height, self.pixel(band, k), self.offset)
    }

    /// Unit direction of the sample's view ray through index `k` of a band.
    fn ray(&self, band: Window, k: usize) -> Vec3 {
        let image = &self.scene.image;
        self.scene.camera.view_ray(image.width, image.height, self.pixel(band, k), self.offset)
    }

    /// Returns the projection from the world to the window's image.
    fn projection(&self) -> Projection {
        let Parts { camera, image, .. } = &**self.scene;
        Projection {
            clip_from_world: camera.clip_from_world(image.width, image.height, self.offset, &self.depth),
            size: [image.width as usize, image.height as usize],
            near: camera.near,
            window: self.window,
        }
    }

    /// Triangles of the opaque mesh, whose ids are numbers of tiles.
    fn rock_triangles(&self) -> Triangles {
        let (scene, mesh) = (self.scene, self.mesh);
        let projection = self.projection();
        let steps = tiles::steps(&mesh.tiles, &scene.camera, &scene.image);
        let of_tiles = mesh
            .tiles
            .par_iter()
            .enumerate()
            .map(|(i, tile)| {
                let mut out = Triangles::default();
                if projection.may_show(tile.low, tile.high) {
                    // Six triangles meet in a vertex, which is projected once.
                    let mut points = [None; GRID];
                    let drawn = tiles::triangles(tile.side, steps[i], tiles::coarser(&mesh.tiles, &steps, i));
                    for &corners in drawn.as_chunks::<3>().0 {
                        let points = corners.map(|corner| {
                            *points[usize::from(corner)].get_or_insert_with(|| {
                                let vertex = tile.vertex(tiles::grid_point(corner));
                                projection.point(mesh.vertices[vertex as usize].position.into(), &mut out)
                            })
                        });
                        projection.triangle(points, (i as u32, corners), &mut out);
                    }
                }
                out
            })
            .collect();
        Triangles::joined(of_tiles)
    }

    /// Triangles of the volume quads, whose ids are numbers of quads.
    fn water_triangles(&self) -> Triangles {
        let projection = self.projection();
        let mut water = Triangles::default();
        for (i, quad) in self.scene.quads.iter().enumerate() {
            let [a, b, c, d] = quad.corners.map(|corner| projection.point(corner, &mut water));
            projection.triangle([a, b, c], (i as u32, [0; 3]), &mut water);
            projection.triangle([a, c, d], (i as u32, [0; 3]), &mut water);
        }
        water
    }

    /// Shades the opaque scene or the background under each pixel of a band.
    fn shade_rock(
        &self,
        rock: &Rasteriser,
        covered: &[Covered],
        band: Window,
        opaque: &mut [[f32; 4]],
        normal: &mut [Vec4],
    ) {
        for (k, &(depth, id)) in covered.iter().enumerate() {
            if id == 0 {
                (opaque[k], normal[k]) = self.shade_background(self.ray(band, k));
            } else {
                let triangle = rock.triangle(id - 1);
                let centre = self.pixel(band, k).map(|p| p as f64 + 0.5);
                let at = self.image_point(band, k);
                let weights = rock.weights_at(triangle, centre).to_array();
                let in_tile = (0..3).map(|c| tiles::at(triangle.corners[c]) * weights[c]).sum();
                (opaque[k], normal[k]) = self.shade_point(triangle.id, in_tile, at, depth);
            }
        }
    }

    /// Radiance of the background along a ray, with distance and normal 0; in a picture with alpha only that
    /// of the haze in front of it. Twin: `background_targets`.
    fn shade_background(&self, d: Vec3) -> ([f32; 4], Vec4) {
        let radiance = match &self.scene.environment {
            _ if self.scene.image.alpha => Vec3::ZERO,
            None => self.scene.background.radiance(d),
            Some(environment) => environment.radiance(d),
        };
        let passes = self.haze.passes(d.y, self.haze.far);
        let radiance = self.haze.in_front_of(radiance, d.y, self.haze.far);
        (radiance.extend(0.0).to_array(), Vec3::ZERO.extend(passes))
    }

    /// Radiance, metres from the eye, and normal of the opaque point at the position `in_tile` of tile number
    /// `tile`, in squares of its grid. `at` is its point of the image, and `depth` its reversed depth. Of a
    /// holdout in a picture with alpha, only the haze in front of it has a radiance.
    fn shade_point(&self, tile: u32, in_tile: Vec2, at: Vec2, depth: f32) -> ([f32; 4], Vec4) {
        let (scene, mesh) = (self.scene, self.mesh);
        let position = self.to_point.point(self.rays, at, depth);
        let point = Opaque::at(mesh, &mesh.tiles[tile as usize], in_tile, position);
        let (radiance, n) = match point.pool {
            0 => shade_opaque(scene, self.shadow_light, &point),
            pool => shade_pool(scene, self.shadow_light, &self.pools[pool as usize - 1], &point, at),
        };
        let distance = radiance[3];
        let d_y = (point.position.y - self.eye.y) / distance.max(1e-20);
        let hole = point.holdout && scene.image.alpha;
        let seen = if hole { Vec3::ZERO } else { Vec3::from_slice(&radiance) };
        let passes = if hole { self.haze.passes(d_y, distance) } else { 0.0 };
        let radiance = self.haze.in_front_of(seen, d_y, distance);
        (radiance.extend(distance).to_array(), n.extend(passes))
    }

    /// Maps the volume quads under each pixel of a band, `layers` per pixel.
    fn map_water(
        &self,
        water: &Rasteriser,
        covered: &[Covered],
        band: Window,
        layers: usize,
        surface: &mut [[f32; 3]],
        quad_id: &mut [u32],
    ) {
        let [forward, right, up] = self.rays;
        for (i, faces) in covered.chunks(layers).enumerate() {
            if faces[0].1 == 0 {
                continue;
            }
            let at = self.image_point(band, i);
            let length = (forward + right * at.x + up * at.y).length();
            for (k, &(_, id)) in (i * layers..).zip(faces).take_while(|(_, (_, id))| *id != 0) {
                let quad = water.triangle(id - 1).id;
                quad_id[k] = quad + 1;
                let plane = &self.planes[quad as usize];
                surface[k] = map_quad(&self.scene.quads[quad as usize], plane, at, length);
            }
        }
    }
}

/// Returns where the ray through the point `at` of the image meets a quad, whose plane is `plane`: u, v and
/// metres from the eye. `length` is that of [`Camera::ray_to`]. Twin: `quad_hit` of `shaders/mapping.wgsl`.
pub fn map_quad(quad: &Quad, plane: &PlaneView, at: Vec2, length: f32) -> [f32; 3] {
    let (hh, t) = plane.hit(at);
    let uv = quad.map.uv(hh);
    [uv.x, uv.y, t * length]
}
