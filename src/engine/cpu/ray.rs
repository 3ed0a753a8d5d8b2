//! A report of one pixel's ray: every cell it meets and the light that each cell adds. It explains why a
//! pixel looks as it does. An [`Observer`] records the frame's own trace, so the numbers are those of the
//! frame.

use glam::{DVec3, Vec3};

use super::gbuffer;
use super::integrate::{Integrator, Observer};
use crate::picture::Camera;
use crate::picture::camera::{CENTRE, sample_offset};
use crate::place::Mesh;
use crate::scene::{Face, Scene};
use crate::trace::{Lookup, Prefilter};
use crate::util::monitor::Unwatched;
use crate::util::window::Window;
use crate::volume::{Cell, VolumeTexture};
use crate::walk::Crossing;

/// The ray of one pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct RayReport {
    /// Column and row in the image.
    pub pixel: [u32; 2],
    /// Points where the ray meets water, in order of depth: at most `trace.layers` quads. If the ray ends
    /// early, the last of them have no steps.
    pub faces: Vec<RayFace>,
    /// Linear radiance of the opaque scene or background behind the water, seen through the scene's haze.
    pub behind: Vec3,
    /// Point where the ray meets the opaque scene, metres; `None` if it leaves to the background.
    pub opaque: Option<DVec3>,
    /// Cells in the order in which the ray meets them; empty without water. Their radiance is without haze.
    pub steps: Vec<RayStep>,
    /// Linear radiance of the pixel: the steps' sum and the transmitted share of `behind`, seen through the
    /// haze.
    pub radiance: Vec3,
    /// T at the end of the walk; 1 without water.
    pub transmittance: f32,
    /// Number of cells walked by the view ray, and by its light rays.
    pub cells: [u32; 2],
    /// Whether the frame's pixel is looked up in coarser levels or between cells. The report uses the
    /// volume's own cells, so its radiance then differs from the frame's.
    pub filtered: bool,
}

impl RayReport {
    /// Returns the first point of water or rock that the ray meets, metres.
    pub fn surface_point(&self) -> Option<DVec3> {
        self.face().map(|face| face.point).or(self.opaque)
    }

    /// Returns the nearest face, which is the one in the frame's layers.
    pub fn face(&self) -> Option<RayFace> {
        self.faces.first().copied()
    }

    /// Returns the distances along the ray from the nearest face to the points where the ray enters and
    /// leaves a step's cell, metres.
    pub fn behind_nearest_m(&self, step: &RayStep) -> [f32; 2] {
        let face_m = self.faces[step.face].depth_m - self.faces[0].depth_m;
        [face_m + step.enter_m, face_m + step.exit_m]
    }
}

/// The point where a ray meets a quad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayFace {
    /// Number of the quad in the scene, from 0. Faces of shells' hulls are numbered after the quads.
    pub quad: usize,
    /// Texture coordinates on the quad, 0 to 1.
    pub uv: [f32; 2],
    /// Metres from the eye.
    pub depth_m: f32,
    /// The point in the world, metres.
    pub point: DVec3,
}

/// One cell of a ray.
#[derive(Clone, Debug, PartialEq)]
pub struct RayStep {
    /// Index of its face in [`RayReport::faces`].
    pub face: usize,
    /// x, y and z in the volume; x and y inside the tile.
    pub cell: [u32; 3],
    /// Metres along the ray from its face to the point where it enters the cell.
    pub enter_m: f32,
    /// Metres along the ray from its face to the point where it leaves the cell.
    pub exit_m: f32,
    /// α·ρ after the sheet's erosion or mist. Without them it is the ρ of a volume file.
    pub rho: f32,
    /// Unit direction of the flow; zero without a direction.
    pub v: Vec3,
    /// Diffuse reflection coefficient.
    pub k_d: f32,
    /// Specular reflection coefficient.
    pub k_s: f32,
    /// T before the cell.
    pub transmittance: f32,
    /// Linear radiance that the cell adds towards the eye, including its ambient light.
    pub radiance: Vec3,
    /// V of each light; no values for an empty cell.
    pub visibility: Vec<f32>,
}

/// Traces the ray through the centre of a pixel (column, row). A pixel outside the image is clamped to its
/// edge. Radiance, transmittance and cells equal those of [`super::render`]'s frame bit for bit if the scene
/// has one sample per pixel, no filter and nearest lookup.
pub fn inspect(
    scene: &Scene,
    volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
    mesh: &Mesh,
    pixel: [u32; 2],
) -> RayReport {
    let volumes = volumes.as_ref();
    let image = &scene.image;
    let pixel = [pixel[0].min(image.width - 1), pixel[1].min(image.height - 1)];
    let window = Window { x: pixel[0], y: pixel[1], width: 1, height: 1 };
    let gbuffer = gbuffer::run_window(scene, mesh, window, CENTRE);
    let offset = sample_offset(image, CENTRE);
    let at = Camera::image_point(image.width, image.height, pixel, offset).as_dvec2();
    let [forward, right, up] = scene.camera.rays(image.width, image.height);
    let d_world = (forward + right * at.x + up * at.y).normalize();
    let opaque_m = gbuffer.opaque[0][3];
    let face = |(quad, [u, v, depth_m]): (usize, [f32; 3])| RayFace {
        quad,
        uv: [u, v],
        depth_m,
        point: match scene.face(quad) {
            Face::Quad(quad) => scene.camera.origin + quad.map.point_world(u, v).as_dvec3(),
            Face::Hull(..) => scene.camera.eye + d_world * f64::from(depth_m),
        },
    };
    let faces: Vec<RayFace> = gbuffer.faces(0).map(face).collect();
    let alpha = |face: &RayFace| volumes[scene.volume_of_face(face.quad)].alpha;
    let alphas = faces.iter().map(alpha).collect();
    let mut recorder = Recorder { alphas, faces: 0, steps: Vec::new() };
    // Without filter and interpolation, the steps are the volume's own cells.
    let mut plain = scene.clone();
    let trace = &mut plain.edit().trace;
    (trace.filter, trace.lookup) = (Prefilter::None, Lookup::Nearest);
    let mut integrator = Integrator::new(&plain, volumes);
    let is_shaded = !mesh.on_water.is_empty();
    if is_shaded || faces.iter().any(|face| matches!(scene.face(face.quad), Face::Hull(..))) {
        let shaded = integrator.with_shadows_of(volumes, mesh, &Unwatched);
        integrator = shaded.expect("nobody stops the work");
    }
    let result = integrator.pixel(&gbuffer, pixel, CENTRE, &mut recorder);
    RayReport {
        pixel,
        faces,
        behind: Vec3::from_slice(&gbuffer.opaque[0]),
        opaque: (opaque_m > 0.0).then(|| scene.camera.eye + d_world * f64::from(opaque_m)),
        steps: recorder.steps,
        radiance: result.radiance,
        transmittance: result.transmittance,
        cells: result.cells,
        filtered: scene.trace.filter != Prefilter::None || scene.trace.lookup != Lookup::Nearest,
    }
}

/// Records the cells of a ray.
struct Recorder {
    /// α of each face's volume.
    alphas: Vec<f32>,
    /// Faces met so far.
    faces: usize,
    steps: Vec<RayStep>,
}

impl Observer for Recorder {
    fn sheet(&mut self) {
        self.faces += 1;
    }

    fn enter(&mut self, crossing: &Crossing, cell: Cell, rho: f32, transmittance: f32) {
        let (k_d, k_s) = cell.k();
        self.steps.push(RayStep {
            face: self.faces - 1,
            cell: crossing.cell.as_uvec3().to_array(),
            enter_m: crossing.t_enter,
            exit_m: crossing.t_exit,
            rho: rho * self.alphas[self.faces - 1],
            v: cell.v(),
            k_d,
            k_s,
            transmittance,
            radiance: Vec3::ZERO,
            visibility: Vec::new(),
        });
    }

    fn ambient(&mut self, radiance: Vec3) {
        if let Some(step) = self.steps.last_mut() {
            step.radiance += radiance;
        }
    }

    fn light(&mut self, visibility: f32, radiance: Vec3) {
        if let Some(step) = self.steps.last_mut() {
            step.radiance += radiance;
            step.visibility.push(visibility);
        }
    }
}
