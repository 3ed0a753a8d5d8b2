//! One rendering on the GPU: prepare the scene, then draw window by window, sample by sample, and read each
//! window back.

use std::ops::Range;
use std::time::Instant;

use super::canvas::{Canvas, lru_get_or_insert};
use super::device::Gpu;
use super::gbuffer::{Gbuffer, Redraw};
use super::groups::GroupList;
use super::integrate::{CUT, Integrate, Tiler};
use super::layout::{FrameUniforms, Tile, WORKGROUP};
use super::prepared::PreparedScene;
use super::rasters::{Key, Rasters};
use super::renderer::{GpuRenderer, KEPT_CANVASES, KEPT_PIPELINES, TileHint};
use super::resolve::{Resolve, ResolveInputs};
use super::targets::TargetShape;
use super::timing::Timer;
use super::visibility::{FilledVolumes, VisibilityInputs};
use super::{Inputs, readback};
use crate::engine::options::RenderOptions;
use crate::picture::camera::{CENTRE, sample_numbers};
use crate::picture::resolve::develop_whole;
use crate::picture::{Develop, Frame, Seconds};
use crate::place::Mesh;
use crate::scene::Scene;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::window::Window;
use crate::volume::VolumeTexture;

/// One rendering: what all its windows and samples share.
pub struct FrameRun<'a> {
    gpu: &'a Gpu,
    timer: &'a Timer,
    gbuffer: &'a Gbuffer,
    integrate: &'a Integrate,
    resolve: &'a Resolve,
    canvas: &'a Canvas,
    rasters: &'a mut Rasters,
    scene: &'a Scene,
    volumes: &'a [VolumeTexture],
    prepared: PreparedScene,
    filled: FilledVolumes,
    shell_light: wgpu::TextureView,
    /// Part of the image that is rendered, pixels.
    part: Window,
    samples: Range<u32>,
    keep_rasters: u64,
    look: Develop,
    tiler: Tiler,
    hint: TileHint,
    monitor: &'a dyn Monitor,
    /// Pixels done so far, and in total, each counted once per sample.
    done: u64,
    total: u64,
    seconds: Seconds,
    /// Pixels of the frame whose walks the device ended early, by index.
    cut: Vec<usize>,
}

impl<'a> FrameRun<'a> {
    /// Uploads a scene, compiles its pipelines, allocates its canvas and fills its light volumes.
    pub fn prepare(
        renderer: &'a mut GpuRenderer,
        scene: &'a Scene,
        volumes: &'a [VolumeTexture],
        mesh: &Mesh,
        options: &RenderOptions,
        monitor: &'a dyn Monitor,
    ) -> Result<Self> {
        let GpuRenderer { gpu, timer, gbuffer, resolve, visibility, rasters, .. } = renderer;
        let gpu: &'a Gpu = gpu;
        let mut seconds = Seconds::default();
        let clock = Instant::now();
        renderer.resident.levels.leaps = options.leaps;
        visibility.filling = options.filling;
        let kept = (&mut renderer.resident, &mut renderer.reflections);
        let prepared = PreparedScene::new(gpu, kept, scene, volumes, mesh, monitor)?;
        seconds.upload = clock.elapsed().as_secs_f64();

        let clock = Instant::now();
        let PreparedScene { layers, variant, .. } = prepared;
        let integrate = lru_get_or_insert(
            &mut renderer.integrate,
            KEPT_PIPELINES,
            |pass| pass.variant == variant,
            || Integrate::new(gpu, variant),
        );
        gbuffer.compile(gpu, scene, layers);
        seconds.pipelines = clock.elapsed().as_secs_f64();

        let whole = [scene.image.width, scene.image.height];
        let part = options.window.unwrap_or(Window::whole(whole));
        let shape = TargetShape {
            size: options.grid.size(whole),
            layers,
            pools: !scene.pools.is_empty(),
            alpha: scene.image.alpha,
        };
        let canvas = lru_get_or_insert(
            &mut renderer.canvases,
            KEPT_CANVASES,
            |canvas| canvas.shape == shape,
            || Canvas::new(gpu, shape),
        );
        gpu.check()?;
        rasters.begin();

        let samples = options.samples.clone().unwrap_or(sample_numbers(&scene.image));
        let filled = match &prepared.light_volumes {
            None => {
                visibility.forget();
                visibility.none()
            }
            Some(plan) => {
                let mut frame =
                    FrameUniforms::new(scene, volumes, part, &samples, samples.start, 1, &prepared.depth);
                frame.max_cells = plan.medium.max_cells;
                let (up, lookup) = (&prepared.up, scene.trace.lookup);
                let inputs = VisibilityInputs { gpu, timer, up, frame: &frame, plan, lookup };
                let progress = |done, total| monitor.progress("light volumes", done, total);
                let (filled, took) = visibility.get(&inputs, progress)?;
                seconds.visibility = took;
                filled
            }
        };
        let progress = |done, total| monitor.progress("light in shells", done, total);
        let inputs = (&prepared.up, &prepared.at_vertices);
        let (shell_light, took) = renderer.shell_light.get((gpu, timer), scene, volumes, inputs, progress)?;
        seconds.visibility += took;
        let hint: TileHint = (variant, volumes[0].cells.address(), whole);
        let known = renderer.learned.filter(|(frame, _)| *frame == hint).map(|(_, pixels)| pixels);
        Ok(FrameRun {
            gpu,
            timer,
            gbuffer,
            integrate,
            resolve,
            canvas,
            rasters,
            scene,
            volumes,
            prepared,
            filled,
            shell_light,
            part,
            keep_rasters: options.keep_rasters,
            look: Develop::new(&scene.image.look).over(whole),
            tiler: Tiler::new(options.tile_pixels, known, scene.volume_lights().len()),
            hint,
            monitor,
            done: 0,
            total: part.pixels() * samples.len() as u64,
            samples,
            seconds,
            cut: Vec::new(),
        })
    }

    fn uniforms(&self, window: Window, sample: u32) -> FrameUniforms {
        // The sums run over the samples of the picture. A sample that gives only layers stands alone.
        let own = sample..sample + 1;
        let samples = if self.samples.contains(&sample) { &self.samples } else { &own };
        let PreparedScene { layers, depth, .. } = &self.prepared;
        FrameUniforms::new(self.scene, self.volumes, window, samples, sample, *layers, depth)
    }

    /// Renders one window of the grid, as far as it lies in the rendered part, into `frame`.
    pub fn window(&mut self, window: Window, frame: &mut Frame) -> Result<()> {
        // The grid returns only windows that meet the part.
        let Some(wanted) = window.meet(&self.part) else { return Ok(()) };
        let area = Tile {
            x: wanted.x - window.x,
            y: wanted.y - window.y,
            width: wanted.width,
            height: wanted.height,
        };
        // A device that ends long walks ends those of a SIMD group together, so a crop needs whole groups.
        let drawn = if self.gpu.limits_loops() { whole_groups(area, window) } else { area };
        let groups = GroupList::new(self.gpu, self.scene, window, drawn);
        // Layers lie at the pixels' centres, where the picture need not have a sample.
        let only_layers = frame.surface.is_some() && !self.samples.contains(&CENTRE);
        if only_layers {
            self.sample(window, [area, drawn], &groups, CENTRE, frame)?;
        }
        for sample in self.samples.clone() {
            self.sample(window, [area, drawn], &groups, sample, frame)?;
            self.done += wanted.pixels();
        }
        if self.samples.is_empty() {
            return Ok(());
        }
        let inputs = ResolveInputs {
            sums: &self.canvas.sums,
            picture: &self.canvas.picture,
            area,
            frame: &self.uniforms(window, self.samples.start),
            develop: &self.look,
        };
        self.seconds.resolve += self.resolve.run(self.gpu, self.timer, &inputs)?;
        let clock = Instant::now();
        self.read_back(window, area, wanted, frame)?;
        self.seconds.readback += clock.elapsed().as_secs_f64();
        Ok(())
    }

    /// Adds one sample of the `drawn` part of a window to the canvas's sums, if it is one of the picture's.
    /// The sample at the pixels' centres also fills `frame.surface` in the window's `area`.
    fn sample(
        &mut self,
        window: Window,
        [area, drawn]: [Tile; 2],
        groups: &GroupList,
        sample: u32,
        frame: &mut Frame,
    ) -> Result<()> {
        let (gpu, monitor, done, total) = (self.gpu, self.monitor, self.done, self.total);
        let uniforms = self.uniforms(window, sample);
        let up = &self.prepared.up;
        let kept = match self.keep_rasters {
            0 => None,
            most => self.rasters.get(gpu, Key::new(&uniforms, &up.geometry), self.canvas.shape, most),
        };
        let targets = kept.map_or(&self.canvas.targets, |kept| &kept.targets);
        let inputs = Inputs {
            gpu,
            timer: self.timer,
            up,
            targets,
            window,
            area: drawn,
            frame: &uniforms,
            groups,
            filled: &self.filled,
            shell_light: &self.shell_light,
            reflection: &self.prepared.reflection,
            volumes: &self.prepared.volumes,
        };
        let waves = Some(up.waves);
        let redraw = match kept.map(|kept| kept.waves.replace(None)) {
            Some(drawn) if drawn == waves => None,
            Some(Some(_)) => Some(Redraw::Pools),
            _ => Some(Redraw::All),
        };
        if let Some(redraw) = redraw {
            let between = || monitor.progress("pixels", done, total);
            self.seconds.gbuffer += self.gbuffer.run(&inputs, redraw, between)?;
        }
        if let Some(kept) = kept {
            kept.waves.set(waves);
        }
        if sample == CENTRE
            && let Some(surface) = &mut frame.surface
        {
            let first = self.part.index([window.x + area.x, window.y + area.y]);
            let row = self.part.width as usize;
            readback::read_surface(gpu, self.scene, targets, area, surface, first, row)?;
        }
        if !self.samples.contains(&sample) {
            return Ok(());
        }
        self.seconds.integrate +=
            self.integrate.run(&inputs, &self.canvas.sums, &mut self.tiler, |pixels| {
                // What is drawn beyond the area does not count.
                monitor.progress("pixels", (done + pixels).min(total), total)
            })?;
        Ok(())
    }

    /// Copies radiance, counts and picture of a window's area, which is `wanted` in the image, into `frame`.
    /// Notes the pixels whose walks the device ended early.
    fn read_back(&mut self, window: Window, area: Tile, wanted: Window, frame: &mut Frame) -> Result<()> {
        let (gpu, Canvas { sums, picture, .. }) = (self.gpu, self.canvas);
        let inverse = 1.0 / self.samples.len() as f32;
        let range = |row: u32| {
            let first = self.part.index([wanted.x, wanted.y + row]);
            first..first + wanted.width as usize
        };
        readback::read_rows(gpu, &sums.radiance, 16, window.width, area, |row, bytes| {
            let mean = |sum: [f32; 4]| sum.map(|x| x * inverse);
            frame.radiance[range(row)]
                .iter_mut()
                .zip(bytes.chunks_exact(16))
                .for_each(|(out, sum)| *out = mean(bytemuck::pod_read_unaligned(sum)));
        })?;
        if let Some(alpha) = &mut frame.alpha {
            readback::read_rows(gpu, &sums.uncovered, 4, window.width, area, |row, bytes| {
                alpha[range(row)]
                    .iter_mut()
                    .zip(bytes.chunks_exact(4))
                    .for_each(|(out, sum)| *out = 1.0 - bytemuck::pod_read_unaligned::<f32>(sum) * inverse);
            })?;
        }
        self.monitor.progress("pixels", self.done, self.total)?;
        readback::read_rows(gpu, &sums.counts, 8, window.width, area, |row, bytes| {
            bytemuck::cast_slice_mut(&mut frame.counts[range(row)]).copy_from_slice(bytes);
        })?;
        self.cut.extend((0..wanted.height).flat_map(range).filter(|&i| frame.counts[i][0] == CUT));
        readback::read_rows(gpu, picture, 4, window.width, area, |row, bytes| {
            bytemuck::cast_slice_mut(&mut frame.picture[range(row)]).copy_from_slice(bytes);
        })
    }

    /// Adds bloom and times to a finished frame. Returns the size of tiles that suited it, and the indices of
    /// the pixels whose walks the device ended early.
    pub fn finish(mut self, frame: &mut Frame) -> (Option<(TileHint, f64)>, Vec<usize>) {
        let image = &self.scene.image;
        // Bloom needs the whole image, which may be drawn in several windows.
        if image.look.bloom > 0.0 && self.part == Window::whole([image.width, image.height]) {
            let clock = Instant::now();
            develop_whole(frame, &image.look);
            self.seconds.resolve += clock.elapsed().as_secs_f64();
        }
        frame.seconds = self.seconds;
        (self.tiler.learned().map(|pixels| (self.hint, pixels)), self.cut)
    }
}

/// Extends an area of a window to whole workgroups, counted from the window's corner.
fn whole_groups(area: Tile, window: Window) -> Tile {
    let down = |n: u32| n / WORKGROUP * WORKGROUP;
    let up = |n: u32, most: u32| n.next_multiple_of(WORKGROUP).min(most);
    let [x, y] = [down(area.x), down(area.y)];
    Tile {
        x,
        y,
        width: up(area.x + area.width, window.width) - x,
        height: up(area.y + area.height, window.height) - y,
    }
}
