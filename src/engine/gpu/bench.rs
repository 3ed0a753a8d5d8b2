//! Single passes on a prepared frame, for `taki bench`.

use std::rc::Rc;

use super::gbuffer::Redraw;
use super::groups::GroupList;
use super::integrate::{Integrate, Sums, Tiler, Variant};
use super::layout::{FrameUniforms, Tile};
use super::prepared::PreparedScene;
use super::reflection::Reflections;
use super::renderer::GpuRenderer;
use super::shells::ShellLightPass;
use super::targets::{TargetShape, Targets};
use super::upload::Resident;
use super::visibility::{FilledVolumes, VisibilityInputs, VisibilityPass};
use super::{Gpu, Inputs, readback};
use crate::place::Mesh;
use crate::scene::Scene;
use crate::trace::Lookup;
use crate::util::error::{Error, Result};
use crate::util::monitor::Unwatched;
use crate::util::window::Window;
use crate::volume::{Leaps, VolumeTexture};

/// Largest volume in bytes that is measured in more than one form: 320³ cells.
const LARGE_BYTES: u64 = 8 * 320 * 320 * 320;

/// A renderer with scenes on its device that differ only in their light.
pub struct GpuBench {
    renderer: GpuRenderer,
    prepared: Option<Prepared>,
}

struct Prepared {
    targets: Targets,
    sums: Sums,
    groups: GroupList,
    window: Window,
    passes: Vec<(&'static str, Pass)>,
}

/// A pass to measure, with its inputs.
struct Pass {
    work: Work,
    scene: Rc<PreparedScene>,
    frame: FrameUniforms,
    filled: FilledVolumes,
    shell_light: wgpu::TextureView,
}

enum Work {
    Gbuffer,
    /// Fills the scene's light volumes anew.
    Visibility(Lookup),
    /// Runs an integrate pass; the number of cells it walks, once known.
    Integrate(Box<Integrate>, Tiler, Option<u64>),
}

impl GpuBench {
    /// Wraps an open renderer.
    pub fn new(renderer: GpuRenderer) -> Self {
        GpuBench { renderer, prepared: None }
    }

    /// Uploads scenes, each with the name of its integrate pass, and compiles these passes. The first scene
    /// also gets the raster pass and the walks without light (`shaders/engine/bare.wgsl`), cell by cell and
    /// leaping.
    ///
    /// Returns the names of scenes that could not be prepared, and why. They have no passes.
    ///
    /// # Errors
    /// Errors of uploading the scenes and filling their light volumes, as in [`GpuRenderer::render`], if no
    /// scene could be prepared.
    ///
    /// # Panics
    /// If `scenes` is empty.
    pub fn prepare(
        &mut self,
        scenes: &[(&'static str, &Scene)],
        volume: &VolumeTexture,
        mesh: &Mesh,
    ) -> Result<Vec<(&'static str, Error)>> {
        let GpuRenderer { gpu, timer, .. } = &self.renderer;
        let first = scenes[0].1;
        let window = Window::whole([first.image.width, first.image.height]);
        let volumes = std::slice::from_ref(volume);
        let (mut resident, mut reflections) = (Resident::default(), Reflections::default());
        let mut passes: Vec<(&'static str, Pass)> = Vec::new();
        let mut layers = 1;
        let mut light_volumes_measured = false;
        let mut failed = Vec::new();
        self.prepared = None;
        for &(name, scene) in scenes {
            let prepared = match PreparedScene::new(
                gpu,
                (&mut resident, &mut reflections),
                scene,
                volumes,
                mesh,
                &Unwatched,
            ) {
                Ok(prepared) => Rc::new(prepared),
                Err(e) => {
                    failed.push((name, e));
                    continue;
                }
            };
            layers = prepared.layers;
            let frame = FrameUniforms::new(scene, volumes, window, &(0..1), 0, layers, &prepared.depth);
            let lights = scene.volume_lights().len();
            let integrate = |pass| Work::Integrate(Box::new(pass), Tiler::new(None, None, lights), None);
            let mut visibility = VisibilityPass::new(gpu);
            let none = visibility.none();
            let mut filled = none.clone();
            let lookup = scene.trace.lookup;
            if let Some(plan) = &prepared.light_volumes {
                let inputs = VisibilityInputs { gpu, timer, up: &prepared.up, frame: &frame, plan, lookup };
                filled = match visibility.get(&inputs, |_, _| Ok(())) {
                    Ok((filled, _)) => filled,
                    Err(e) => {
                        failed.push((name, e));
                        continue;
                    }
                };
            }
            let inputs = (&prepared.up, &prepared.at_vertices);
            let shell_light =
                ShellLightPass::default().get((gpu, timer), scene, volumes, inputs, |_, _| Ok(()));
            let shell_light = match shell_light {
                Ok((light, _)) => light,
                Err(e) => {
                    failed.push((name, e));
                    continue;
                }
            };
            let is_first = passes.is_empty();
            let mut add = |name, work, scene: &Rc<PreparedScene>, filled: &FilledVolumes| {
                let (scene, filled, shell_light) = (scene.clone(), filled.clone(), shell_light.clone());
                passes.push((name, Pass { work, scene, frame, filled, shell_light }));
            };
            if is_first {
                add("gbuffer", Work::Gbuffer, &prepared, &filled);
                // A large volume is on the device only once.
                let is_sparse = prepared.up.is_sparse();
                let is_large = volume.cells.bytes() > LARGE_BYTES || is_sparse;
                let walks = [("bare walk", Leaps::Never), ("bare leaping walk", Leaps::Always)];
                for (name, leaps) in walks.into_iter().take(if is_large { 1 } else { 2 }) {
                    let scene_of_walk = if is_large {
                        prepared.clone()
                    } else {
                        let mut own = Resident::default();
                        own.levels.leaps = leaps;
                        let kept = (&mut own, &mut reflections);
                        Rc::new(PreparedScene::new(gpu, kept, scene, volumes, mesh, &Unwatched)?)
                    };
                    let storage = [leaps == Leaps::Always, is_sparse];
                    let variant = Variant::of(scene, layers, None, storage);
                    add(name, integrate(Integrate::bare(gpu, variant)), &scene_of_walk, &none);
                }
            }
            if prepared.light_volumes.is_some() && !light_volumes_measured {
                light_volumes_measured = true;
                add("light volumes", Work::Visibility(lookup), &prepared, &filled);
            }
            add(name, integrate(Integrate::new(gpu, prepared.variant)), &prepared, &filled);
        }
        if passes.is_empty() {
            return Err(failed.remove(0).1);
        }
        let shape = TargetShape {
            size: [window.width, window.height],
            layers,
            pools: !first.pools.is_empty(),
            alpha: first.image.alpha,
        };
        self.prepared = Some(Prepared {
            targets: Targets::new(gpu, shape),
            sums: Sums::new(gpu, window.pixels(), shape.alpha),
            groups: GroupList::new(gpu, first, window, Tile::whole(window)),
            window,
            passes,
        });
        self.run(0)?;
        Ok(failed)
    }

    /// Returns the names of the passes, in the order of [`GpuBench::run`]'s indices.
    pub fn names(&self) -> Vec<&'static str> {
        self.prepared.iter().flat_map(|p| &p.passes).map(|(name, _)| *name).collect()
    }

    /// Runs the pass at an index of [`GpuBench::names`]. Returns its seconds on the device and the cells it
    /// walked.
    ///
    /// # Errors
    /// Errors of the device: see [`Gpu::run`].
    ///
    /// # Panics
    /// If [`GpuBench::prepare`] has not been called.
    pub fn run(&mut self, number: usize) -> Result<(f64, u64)> {
        let GpuRenderer { gpu, timer, gbuffer, .. } = &self.renderer;
        let p = self.prepared.as_mut().expect("prepare comes first");
        let Pass { work, scene, frame, filled, shell_light } = &mut p.passes[number].1;
        let window = p.window;
        let inputs = Inputs {
            gpu,
            timer,
            up: &scene.up,
            targets: &p.targets,
            window,
            area: Tile::whole(window),
            frame,
            groups: &p.groups,
            filled,
            shell_light,
            reflection: &scene.reflection,
            volumes: &scene.volumes,
        };
        match work {
            Work::Gbuffer => Ok((gbuffer.run(&inputs, Redraw::All, || Ok(()))?, 0)),
            Work::Visibility(lookup) => {
                let mut pass = VisibilityPass::new(gpu);
                let (up, lookup) = (&scene.up, *lookup);
                let plan = scene.light_volumes.as_ref().expect("the pass was made for light volumes");
                let inputs = VisibilityInputs { gpu, timer, up, frame, plan, lookup };
                Ok((pass.get(&inputs, |_, _| Ok(()))?.1, 0))
            }
            Work::Integrate(integrate, tiler, cells) => {
                let seconds = integrate.run(&inputs, &p.sums, tiler, |_| Ok(()))?;
                let cells = match cells {
                    Some(cells) => *cells,
                    None => *cells.insert(cells_walked(gpu, &p.sums, window)?),
                };
                Ok((seconds, cells))
            }
        }
    }
}

/// Sums the cells of view rays and light rays over a window.
fn cells_walked(gpu: &Gpu, sums: &Sums, window: Window) -> Result<u64> {
    let mut sum = 0;
    readback::read_rows(gpu, &sums.counts, 8, window.width, Tile::whole(window), |_, bytes| {
        let counts = bytes.chunks_exact(4).map(|c| bytemuck::pod_read_unaligned::<u32>(c) as u64);
        sum += counts.sum::<u64>();
    })?;
    Ok(sum)
}
