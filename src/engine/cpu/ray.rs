//! One pixel's ray in full: every cell it meets and what each gives, for whoever asks why a pixel looks
//! as it does. The numbers are those of the frame: an [`Observer`] of the same trace writes them down.

use glam::Vec3;

use super::gbuffer;
use super::integrate::{Integrator, Observer};
use crate::picture::camera::sample_offset;
use crate::place::Mesh;
use crate::scene::Scene;
use crate::trace::{Lookup, Prefilter};
use crate::util::window::Window;
use crate::volume::{Cell, VolumeTexture};
use crate::walk::Crossing;

/// One pixel's ray.
#[derive(Clone, Debug, PartialEq)]
pub struct RayReport {
    /// Column and row in the image.
    pub pixel: [u32; 2],
    /// Where the ray meets water, in order of depth: `trace.layers` quads at most. Where it ends early no
    /// step belongs to the last of them.
    pub faces: Vec<RayFace>,
    /// Radiance of the opaque scene or background behind the water, with its haze.
    pub behind: Vec3,
    /// Where the ray meets the opaque scene, metres; none where it leaves to the background.
    pub opaque: Option<Vec3>,
    /// The cells in the order the ray meets them; none without water. What they send is told without haze.
    pub steps: Vec<RayStep>,
    /// Linear radiance of the pixel: the steps' sum and what is left of `behind`, through the scene's haze.
    pub radiance: Vec3,
    /// T at the end of the walk; 1 without water.
    pub transmittance: f32,
    /// Cells of the view ray and of its light rays.
    pub cells: [u32; 2],
    /// Whether the picture's pixel comes from coarser levels, or from between cells; the report's own is then another.
    pub filtered: bool,
}

impl RayReport {
    /// The first point the ray meets, water or rock, metres.
    pub fn surface_point(&self) -> Option<Vec3> {
        self.face().map(|face| face.point).or(self.opaque)
    }

    /// The nearest face, whose are the frame's layers.
    pub fn face(&self) -> Option<RayFace> {
        self.faces.first().copied()
    }

    /// Metres along the ray from the nearest face to where it enters a step's cell, and to where it leaves it.
    pub fn behind_nearest_m(&self, step: &RayStep) -> [f32; 2] {
        let away = self.faces[step.face].depth_m - self.faces[0].depth_m;
        [away + step.enter_m, away + step.exit_m]
    }
}

/// Where a ray meets a quad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayFace {
    /// Number of the quad in the scene, from 0.
    pub quad: usize,
    /// Texture coordinates on the quad, 0 to 1.
    pub uv: [f32; 2],
    /// Metres from the eye.
    pub depth_m: f32,
    /// The point in the world, metres.
    pub point: Vec3,
}

/// One cell of a ray.
#[derive(Clone, Debug, PartialEq)]
pub struct RayStep {
    /// Number of its face in [`RayReport::faces`].
    pub face: usize,
    /// x, y and z in the volume; x and y inside the tile.
    pub cell: [u32; 3],
    /// Metres along the ray from its face to where it enters the cell.
    pub enter_m: f32,
    /// Metres along the ray from its face to where it leaves the cell.
    pub exit_m: f32,
    /// α·ρ, as in a volume file but for what the sheet erodes, or is mist.
    pub rho: f32,
    /// Direction of the flow, unit; zero where there is none.
    pub v: Vec3,
    /// Diffuse reflection coefficient.
    pub k_d: f32,
    /// Specular reflection coefficient.
    pub k_s: f32,
    /// T before the cell.
    pub transmittance: f32,
    /// Linear radiance the cell adds towards the eye, its share of the ambient light included.
    pub radiance: Vec3,
    /// V of each light; empty where the cell is.
    pub visibility: Vec<f32>,
}

/// Traces the ray through the centre of a pixel (column, row; outside the image the nearest inside).
/// Where the scene has one sample a pixel, no filter and looks up the nearest cell, radiance, transmittance and cells are the bits of
/// [`super::render`]'s frame.
pub fn inspect(scene: &Scene, volume: &VolumeTexture, mesh: &Mesh, pixel: [u32; 2]) -> RayReport {
    // The first sample is the centre for any number of samples.
    const SAMPLE: u32 = 0;
    let image = &scene.image;
    let pixel = [pixel[0].min(image.width - 1), pixel[1].min(image.height - 1)];
    let window = Window { x: pixel[0], y: pixel[1], width: 1, height: 1 };
    let gbuffer = gbuffer::run_window(scene, mesh, window, SAMPLE);
    let offset = sample_offset(image, SAMPLE);
    let d_world = scene.camera.view_ray(image.width, image.height, pixel, offset);
    let at = |metres: f32| scene.camera.eye + d_world * metres;
    let opaque_m = gbuffer.opaque[0][3];
    let face = |(quad, [u, v, depth_m]): (usize, [f32; 3])| RayFace {
        quad,
        uv: [u, v],
        depth_m,
        point: at(depth_m),
    };
    let faces = gbuffer.faces(0).map(face).collect();
    let mut recorder = Recorder { alpha: volume.alpha, faces: 0, steps: Vec::new() };
    // Its cells are the volume's own.
    let mut plain = scene.clone();
    plain.edit().trace.filter = Prefilter::None;
    plain.edit().trace.lookup = Lookup::Nearest;
    let traced = Integrator::new(&plain, volume).pixel(&gbuffer, pixel, SAMPLE, &mut recorder);
    RayReport {
        pixel,
        faces,
        behind: Vec3::from_slice(&gbuffer.opaque[0]),
        opaque: (opaque_m > 0.0).then(|| at(opaque_m)),
        steps: recorder.steps,
        radiance: traced.radiance,
        transmittance: traced.transmittance,
        cells: traced.cells,
        filtered: scene.trace.filter != Prefilter::None || scene.trace.lookup != Lookup::Nearest,
    }
}

/// Writes a ray's cells down.
struct Recorder {
    alpha: f32,
    /// Met so far.
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
            rho: rho * self.alpha,
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
