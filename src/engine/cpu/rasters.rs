//! Results of the raster pass that later frames reuse: rock and quads stay the same while only the water
//! moves or a parameter of the walk changes. Twin: `src/engine/gpu/rasters.rs`.

use std::collections::VecDeque;
use std::sync::{Arc, OnceLock};

use super::gbuffer::{Gbuffer, band_rows, pixel_bytes, shade_pools};
use crate::light::environment::Environment;
use crate::mapping::Quad;
use crate::mapping::shell::Shell;
use crate::picture::Image;
use crate::picture::camera::sample_offset;
use crate::place::Mesh;
use crate::scene::{Parts, Scene};
use crate::util::window::Window;

/// Targets of a window, band by band. A band is drawn when it is first needed, so the bands of a frame that
/// was interrupted serve the next one.
pub type Bands = Vec<OnceLock<Gbuffer>>;

/// Whether all bands are drawn.
pub fn is_drawn(bands: &Bands) -> bool {
    bands.iter().all(|band| band.get().is_some())
}

/// Number of passes that are remembered. A pass is kept only when it comes up a second time.
const REMEMBERED: usize = 64;

/// The kept results.
#[derive(Default)]
pub struct Rasters {
    kept: Vec<Kept>,
    /// Passes that were not kept, the latest first.
    seen: VecDeque<Pass>,
    /// Number of the current frame.
    turn: u64,
    /// Number of passes that were drawn, wholly or in part.
    pub drawn: u64,
}

/// One sample of a window, and what it shows.
struct Pass {
    scene: Scene,
    mesh: Mesh,
    window: Window,
    sample: u32,
}

/// The targets of a pass.
struct Kept {
    pass: Pass,
    bands: Arc<Bands>,
    /// Rows of a band.
    rows: u32,
    bytes: u64,
    /// Number of the last frame that used them.
    used: u64,
}

impl Pass {
    /// Whether a pass holds the memory of this mesh and of this scene's environment.
    fn shares(&self, scene: &Scene, mesh: &Mesh) -> bool {
        let is_same_map = match (&self.scene.environment, &scene.environment) {
            (None, _) => true,
            (Some(a), Some(b)) => Arc::ptr_eq(&a.map, &b.map),
            (Some(_), None) => false,
        };
        is_same_mesh(&self.mesh, mesh) && is_same_map
    }

    fn is(&self, scene: &Scene, mesh: &Mesh, window: Window, sample: u32) -> bool {
        (self.window, self.sample) == (window, sample)
            && is_same_mesh(&self.mesh, mesh)
            && looks_alike(&self.scene, scene, sample)
    }
}

impl Rasters {
    /// Begins a new frame. Passes that show another mesh or sky are dropped, because they would hold all of
    /// its memory.
    pub fn begin(&mut self, scene: &Scene, mesh: &Mesh) {
        self.turn += 1;
        self.seen.retain(|pass| pass.shares(scene, mesh));
        self.kept.retain(|kept| kept.pass.shares(scene, mesh));
    }

    /// Returns the kept targets of sample `sample` of a window, drawn or still to be drawn. Returns `None` if
    /// the pass is new, or if its targets do not fit into `most` bytes. Targets that neither this frame nor
    /// the last one has used are dropped to make room.
    pub fn get(
        &mut self,
        scene: &Scene,
        mesh: &Mesh,
        window: Window,
        sample: u32,
        most: u64,
    ) -> Option<Arc<Bands>> {
        self.drawn += 1;
        let bytes = window.pixels() * pixel_bytes(scene);
        if bytes > most {
            return None;
        }
        // Their number depends on that of the threads.
        let rows = band_rows(window);
        self.kept.retain(|kept| kept.pass.window != window || kept.rows == rows);
        let known = self.kept.iter().position(|kept| kept.pass.is(scene, mesh, window, sample));
        let i = match known {
            Some(i) => i,
            None => {
                let Some(seen) = self.seen.iter().position(|pass| pass.is(scene, mesh, window, sample))
                else {
                    let (scene, mesh) = (scene.clone(), mesh.clone());
                    self.seen.truncate(REMEMBERED - 1);
                    self.seen.push_front(Pass { scene, mesh, window, sample });
                    return None;
                };
                let total = |kept: &[Kept]| kept.iter().map(|kept| kept.bytes).sum::<u64>();
                if total(&self.kept) + bytes > most {
                    let turn = self.turn;
                    self.kept.retain(|kept| kept.used + 1 >= turn);
                }
                if total(&self.kept) + bytes > most {
                    return None;
                }
                let pass = self.seen.remove(seen)?;
                let count = window.height.div_ceil(rows);
                let bands = (0..count).map(|_| OnceLock::new()).collect();
                self.kept.push(Kept { pass, bands: Arc::new(bands), rows, bytes, used: self.turn });
                self.kept.len() - 1
            }
        };
        let Kept { pass, bands, used, .. } = &mut self.kept[i];
        *used = self.turn;
        let waves = |scene: &Scene| (scene.wave_flow, scene.wave_moves);
        // Pools mirror the water, so its erosion is seen in them.
        let thinned = |(a, b): (&Quad, &Quad)| a.erosion != b.erosion;
        if waves(&pass.scene) != waves(scene) || pass.scene.quads.iter().zip(&scene.quads).any(thinned) {
            if !scene.pools.is_empty() {
                // No other frame holds them.
                shade_pools(scene, mesh, sample, Arc::get_mut(bands)?);
            }
            pass.scene = scene.clone();
        }
        self.drawn -= u64::from(is_drawn(bands));
        Some(bands.clone())
    }
}

fn is_same_mesh(a: &Mesh, b: &Mesh) -> bool {
    Arc::ptr_eq(&a.vertices, &b.vertices)
        && Arc::ptr_eq(&a.tiles, &b.tiles)
        && Arc::ptr_eq(&a.on_water, &b.on_water)
}

/// Whether the raster pass of sample `sample` gives the same for two scenes with the same mesh, except the
/// pools' waves.
fn looks_alike(a: &Scene, b: &Scene, sample: u32) -> bool {
    // Every part is named, so that a new one must be placed here too.
    let Parts {
        name: _,
        recipes: _,
        boxes: _,
        // The waves of pools are drawn anew.
        wave_flow: _,
        wave_moves: _,
        quads,
        shells,
        lights,
        environment,
        environment_lights: _,
        ambient,
        // The shade on water is in the mesh.
        water_shade: _,
        // Rocks and triangles are in the mesh.
        rocks: _,
        triangles: _,
        // What became of meshes is in the quads, the shells and the mesh.
        meshes: _,
        unmapped: _,
        untextured: _,
        pools,
        trace,
        angles: _,
        visibility: _,
        light_cache: _,
        reflection: _,
        scattering: _,
        p: _,
        camera,
        // The camera and the image of a sample are those of its point of the lens.
        lens: _,
        background,
        haze,
        image,
        shades: _,
    } = &**a;
    let Image { width, height, samples, filter: _, alpha, shift: _, rock_error, gamut: _, look: _ } = *image;
    let of_image = (width, height, samples, alpha, rock_error, sample_offset(image, sample));
    let other = &b.image;
    let of_other_image = (
        other.width,
        other.height,
        other.samples,
        other.alpha,
        other.rock_error,
        sample_offset(other, sample),
    );
    of_image == of_other_image
        && *camera == b.camera
        && trace.layers == b.trace.layers
        && lie_alike(quads, &b.quads)
        && shells.len() == b.shells.len()
        && shells.iter().zip(&b.shells).all(|(a, b)| Shell::is_same(a, b))
        && *lights == b.lights
        && *ambient == b.ambient
        && *background == b.background
        && *haze == b.haze
        && *pools == b.pools
        && match (environment, &b.environment) {
            (None, None) => true,
            (Some(a), Some(b)) => is_same_sky(a, b),
            _ => false,
        }
}

/// Whether quads are the same but for their erosion, which the pass does not read.
fn lie_alike(a: &[Quad], b: &[Quad]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| Quad { erosion: b.erosion, ..*a } == *b)
}

fn is_same_sky(a: &Environment, b: &Environment) -> bool {
    Arc::ptr_eq(&a.map, &b.map)
        && (a.intensity, a.turn, a.sun, &a.irradiance) == (b.intensity, b.turn, b.sun, &b.irradiance)
}
