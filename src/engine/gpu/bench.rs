//! Single passes on a prepared frame, for `taki bench`.

use super::groups::GroupList;
use super::integrate::{Integrate, Sums, Tiler, Variant};
use super::layout::{self, Tile};
use super::targets::Targets;
use super::visibility::{FilledVolumes, VisibilityPass};
use super::{BoundReflection, GpuRenderer, Inputs, Redraw, Reflections, Resident, Uploaded, readback};
use crate::engine::overlap;
use crate::light::visibility::LightVolumes;
use crate::place::Mesh;
use crate::scene::Scene;
use crate::util::error::Result;
use crate::util::window::Window;
use crate::volume::{Leaps, VolumeTexture};

/// Volumes of more than that are not measured in more than one form: 320³.
const LARGE_BYTES: u64 = 8 * 320 * 320 * 320;

/// A renderer with scenes on its device that differ in their light alone.
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

/// What can be measured, and what it works on.
struct Pass {
    work: Work,
    up: Uploaded,
    frame: layout::FrameUniforms,
    filled: FilledVolumes,
    reflection: BoundReflection,
}

enum Work {
    Gbuffer,
    /// Light volumes, walked anew.
    Visibility(LightVolumes, crate::trace::Lookup),
    /// The walk, with the cells that it once took.
    Integrate(Box<Integrate>, Tiler, Option<u64>),
}

impl GpuBench {
    /// From an open renderer.
    pub fn new(renderer: GpuRenderer) -> Self {
        GpuBench { renderer, prepared: None }
    }

    /// Uploads scenes with the names of their integrate passes, and compiles these. The raster pass and the walks
    /// without light (`shaders/bare.wgsl`), cell by cell and leaping, are the first scene's.
    pub fn prepare(
        &mut self,
        scenes: &[(&'static str, &Scene)],
        volume: &VolumeTexture,
        mesh: &Mesh,
    ) -> Result<()> {
        let GpuRenderer { gpu, timer, .. } = &self.renderer;
        let first = scenes[0].1;
        let window = Window::whole([first.image.width, first.image.height]);
        let layers = overlap::sheets(first);
        let mut resident = Resident::default();
        let mut passes = Vec::new();
        for (number, &(name, scene)) in scenes.iter().enumerate() {
            let frame = layout::FrameUniforms::new(scene, volume, window, &(0..1), 0, layers);
            let mut up = || Uploaded::new(gpu, &mut resident, scene, volume, mesh);
            let light_volumes = match scene.visibility {
                crate::light::Visibility::Cached => {
                    Some(scene.light_volumes(volume.size, volume.alpha, scene.light_cache)?)
                }
                _ => None,
            };
            let variant =
                Variant::of(scene, layers, light_volumes.as_ref(), [up()?.levels.leaps, volume.is_sparse()]);
            let integrate = |pass| {
                Work::Integrate(Box::new(pass), Tiler::new(None, None, scene.volume_lights().len()), None)
            };
            let mut visibility = VisibilityPass::new(gpu);
            let (mut work, mut bare) = (Vec::new(), Vec::new());
            if number == 0 {
                work.push(("gbuffer", Work::Gbuffer));
                // A large volume is on the device once.
                let is_large = volume.cells.bytes() > LARGE_BYTES || volume.is_sparse();
                let walks = [("bare walk", Leaps::Never), ("bare leaping walk", Leaps::Always)];
                for (name, leaps) in walks.into_iter().take(if is_large { 1 } else { 2 }) {
                    let mut own = Resident::default();
                    own.levels.leaps = leaps;
                    let up = match is_large {
                        true => up()?,
                        false => Uploaded::new(gpu, &mut own, scene, volume, mesh)?,
                    };
                    let variant =
                        Variant::of(scene, layers, None, [leaps == Leaps::Always, volume.is_sparse()]);
                    let work = integrate(Integrate::bare(gpu, variant));
                    let (filled, reflection) =
                        (visibility.none(), Reflections::default().bind(gpu, scene, volume));
                    bare.push((name, Pass { work, up, frame, filled, reflection }));
                }
            }
            let mut filled = visibility.none();
            if let Some(light_volumes) = light_volumes {
                let up = up()?;
                let volumes = light_volumes.clone();
                filled =
                    visibility.get(gpu, timer, &up, &frame, volumes, scene.trace.lookup, |_, _| Ok(()))?.0;
                if !passes.iter().any(|(name, _)| *name == "light volumes") {
                    work.push(("light volumes", Work::Visibility(light_volumes, scene.trace.lookup)));
                }
            }
            work.push((name, integrate(Integrate::new(gpu, variant))));
            for (name, work) in work {
                let reflection = Reflections::default().bind(gpu, scene, volume);
                let filled = filled.clone();
                passes.push((name, Pass { work, up: up()?, frame, filled, reflection }));
                passes.append(&mut bare);
            }
        }
        self.prepared = Some(Prepared {
            targets: Targets::new(gpu, window.width, window.height, layers, !first.pools.is_empty()),
            sums: Sums::new(gpu, window.pixels()),
            groups: GroupList::new(gpu, first, window, Tile::whole(window)),
            window,
            passes,
        });
        self.run(0).map(drop)
    }

    /// The passes' names, in their order.
    pub fn names(&self) -> Vec<&'static str> {
        self.prepared.iter().flat_map(|p| &p.passes).map(|(name, _)| *name).collect()
    }

    /// Runs one pass by its place in [`GpuBench::names`]: seconds on the device, and the cells it walked.
    ///
    /// # Panics
    /// Before [`GpuBench::prepare`].
    pub fn run(&mut self, number: usize) -> Result<(f64, u64)> {
        let GpuRenderer { gpu, timer, gbuffer, .. } = &self.renderer;
        let p = self.prepared.as_mut().expect("prepare comes first");
        let Pass { work, up, frame, filled, reflection } = &mut p.passes[number].1;
        let (window, area) = (p.window, Tile::whole(p.window));
        let (targets, groups) = (&p.targets, &p.groups);
        let inputs = Inputs { gpu, timer, up, targets, window, area, frame, groups, filled, reflection };
        match work {
            Work::Gbuffer => Ok((gbuffer.run(&inputs, Redraw::All, || Ok(()))?, 0)),
            Work::Visibility(volumes, lookup) => {
                let mut pass = VisibilityPass::new(gpu);
                let found = pass.get(gpu, timer, up, frame, volumes.clone(), *lookup, |_, _| Ok(()))?;
                Ok((found.1, 0))
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

fn cells_walked(gpu: &super::Gpu, sums: &Sums, window: Window) -> Result<u64> {
    let mut sum = 0;
    readback::read_rows(gpu, &sums.counts, 8, window.width, Tile::whole(window), |_, bytes| {
        let counts = bytes.chunks_exact(4).map(|c| bytemuck::pod_read_unaligned::<u32>(c) as u64);
        sum += counts.sum::<u64>();
    })?;
    Ok(sum)
}
