//! The frame on the GPU: upload, gbuffer, integrate, resolve, read back.

mod bench;
mod bricks;
mod device;
mod gbuffer;
mod groups;
mod integrate;
pub mod layout;
mod rasters;
mod readback;
mod reflection;
mod resolve;
pub mod shader;
mod specialise;
mod strand;
mod targets;
mod tiles;
mod timing;
mod upload;
mod visibility;

pub use bench::GpuBench;
pub use device::{DeviceOptions, Gpu, adapters};
pub use gbuffer::{Gbuffer, Redraw, gbuffer_source};
pub use groups::GroupList;
pub use integrate::{CUT, Integrate, Sums, Tiler, Variant, source as integrate_source};
pub use reflection::{BoundReflection, Reflections};
pub use resolve::Resolve;
pub use specialise::Source;
pub use strand::StrandTexture;
pub use targets::Targets;
pub use timing::Timer;
pub use upload::{Resident, Uploaded};
pub use visibility::{FilledVolumes, Filling, VisibilityPass, source as visibility_source};

use std::borrow::Cow;
use std::time::Instant;

use super::overlap;
use crate::engine::options::RenderOptions;
use crate::picture::resolve::develop;
use crate::picture::{Develop, Frame, PICTURE_BYTES, Seconds, Surface};
use crate::place::Mesh;
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::window::Window;
use crate::volume::{Storage, VolumeTexture};
use layout::Tile;
use rasters::{Key, Rasters};

/// Pixels of the raster pass's layers brought back at once: 52 bytes each, twice.
const SURFACE_PIXELS: u32 = 1 << 17;

/// A compute pipeline of a stage's shader, specialised to `constants`.
fn compute_pipeline(
    gpu: &Gpu,
    layout: Option<&wgpu::PipelineLayout>,
    source: &Source,
    entry_point: &str,
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(entry_point),
        source: wgpu::ShaderSource::Naga(Cow::Owned(source.compute(entry_point, constants))),
    });
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry_point),
        layout,
        module: &module,
        entry_point: Some(entry_point),
        compilation_options: Default::default(),
        cache: None,
    })
}

/// What the passes of one sample of one window work on.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The device.
    pub gpu: &'a Gpu,
    /// Its clock.
    pub timer: &'a Timer,
    /// The scene on the device.
    pub up: &'a Uploaded,
    /// The raster pass's results.
    pub targets: &'a Targets,
    /// The part of the image that is drawn.
    pub window: Window,
    /// What of it is looked at.
    pub area: Tile,
    /// The window's uniforms.
    pub frame: &'a layout::FrameUniforms,
    /// Its workgroups.
    pub groups: &'a GroupList,
    /// The light volumes.
    pub filled: &'a FilledVolumes,
    /// The reflection model and multiple scattering.
    pub reflection: &'a BoundReflection,
}

/// The renderer: a device and its compiled passes.
pub struct GpuRenderer {
    /// The device.
    pub gpu: Gpu,
    timer: Timer,
    gbuffer: Gbuffer,
    resolve: Resolve,
    /// The latest first.
    integrate: Vec<Integrate>,
    resident: Resident,
    visibility: VisibilityPass,
    reflections: Reflections,
    /// The latest first.
    canvases: Vec<Canvas>,
    rasters: Rasters,
    /// Pixels of a tile that suited the last frame, and what that frame was.
    learned: Option<(TileHint, f64)>,
}

/// What frames share whose tiles take alike: the pass, where the volume's cells are, the image's size.
type TileHint = (Variant, usize, [u32; 2]);

/// Specialised pipelines that are kept: a slider that goes to and fro finds them again.
const KEPT_PIPELINES: usize = 16;
/// Canvases that are kept: an interactive renderer changes between its preview sizes.
const KEPT_CANVASES: usize = 5;

/// Targets and sums of one size and number of layers.
struct Canvas {
    size: [u32; 2],
    layers: u32,
    pools: bool,
    targets: Targets,
    sums: Sums,
    picture: wgpu::Buffer,
}

impl Canvas {
    fn new(gpu: &Gpu, [width, height]: [u32; 2], layers: u32, pools: bool) -> Self {
        let pixels = width as u64 * height as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        Canvas {
            size: [width, height],
            layers,
            pools,
            targets: Targets::new(gpu, width, height, layers, pools),
            sums: Sums::new(gpu, pixels),
            picture: gpu.buffer("picture", pixels * PICTURE_BYTES, usage),
        }
    }
}

/// The first item that `is` it, moved to the front; a new one if there is none. The last of more than
/// `most` goes, before the new one is made.
fn lru_get_or_insert<T>(
    items: &mut Vec<T>,
    most: usize,
    is: impl Fn(&T) -> bool,
    new: impl FnOnce() -> T,
) -> &T {
    let item = match items.iter().position(is) {
        Some(i) => items.remove(i),
        None => {
            items.truncate(most - 1);
            new()
        }
    };
    items.insert(0, item);
    &items[0]
}

impl GpuRenderer {
    /// Compiles the passes that do not depend on the scene.
    pub fn new(gpu: Gpu) -> Self {
        let (timer, gbuffer, resolve) = (Timer::new(&gpu), Gbuffer::new(&gpu), Resolve::new(&gpu));
        let visibility = VisibilityPass::new(&gpu);
        GpuRenderer {
            gpu,
            timer,
            gbuffer,
            resolve,
            integrate: Vec::new(),
            resident: Resident::default(),
            visibility,
            reflections: Reflections::default(),
            canvases: Vec::new(),
            rasters: Rasters::default(),
            learned: None,
        }
    }

    /// Compiles the passes that a scene needs, as far as that can be told without its volume.
    pub fn prepare(&mut self, scene: &Scene) {
        let layers = overlap::sheets(scene);
        let GpuRenderer { gpu, gbuffer, integrate, .. } = self;
        std::thread::scope(|scope| {
            scope.spawn(|| gbuffer.compile(gpu, scene, layers));
            if scene.visibility != crate::light::Visibility::Cached {
                // Most volumes are too full for leaps.
                let variant = Variant::of(scene, layers, None, [false, scene.storage == Storage::Sparse]);
                let known = |pass: &Integrate| pass.variant == variant;
                lru_get_or_insert(integrate, KEPT_PIPELINES, known, || Integrate::new(gpu, variant));
            }
        });
    }

    /// Lets go of the light volumes of the last frame: the next one fills its own.
    pub fn forget_light_volumes(&mut self) {
        self.visibility.forget();
    }

    /// Renders a scene, or the part of it that `options.window` names.
    pub fn render(
        &mut self,
        scene: &Scene,
        volume: &VolumeTexture,
        mesh: &Mesh,
        options: &RenderOptions,
        monitor: &dyn Monitor,
    ) -> Result<Frame> {
        let image = &scene.image;
        let gpu = &self.gpu;
        let mut seconds = Seconds::default();
        let clock = Instant::now();
        let layers = overlap::sheets(scene);
        let light_volumes = match scene.visibility {
            crate::light::Visibility::Cached => {
                Some(scene.light_volumes(volume.size, volume.alpha, scene.light_cache)?)
            }
            _ => None,
        };
        self.resident.levels.leaps = options.leaps;
        self.visibility.filling = options.filling;
        let up = Uploaded::new(gpu, &mut self.resident, scene, volume, mesh)?;
        let reflection = self.reflections.bind(gpu, scene, volume);
        seconds.upload = clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        let variant =
            Variant::of(scene, layers, light_volumes.as_ref(), [up.levels.leaps, volume.is_sparse()]);
        let integrate = lru_get_or_insert(
            &mut self.integrate,
            KEPT_PIPELINES,
            |pass| pass.variant == variant,
            || Integrate::new(gpu, variant),
        );
        self.gbuffer.compile(gpu, scene, layers);
        seconds.pipelines = clock.elapsed().as_secs_f64();

        let whole = [image.width, image.height];
        let part = options.window.unwrap_or(Window::whole(whole));
        let mut frame = Frame::new(part.width, part.height, options.surface);
        let size = options.grid.size(whole);
        let pools = !scene.pools.is_empty();
        let canvas = lru_get_or_insert(
            &mut self.canvases,
            KEPT_CANVASES,
            |c| c.size == size && c.layers == layers && c.pools == pools,
            || Canvas::new(gpu, size, layers, pools),
        );
        let Canvas { targets: own, sums, picture, .. } = canvas;
        gpu.check()?;
        self.rasters.begin();

        let samples = options.samples.clone().unwrap_or(0..image.samples);
        let filled = match light_volumes {
            None => {
                self.visibility.forget();
                self.visibility.none()
            }
            Some(light_volumes) => {
                let mut frame = layout::FrameUniforms::new(scene, volume, part, &samples, samples.start, 1);
                frame.max_cells = light_volumes.medium.max_cells;
                let watch = |done, all| monitor.progress("light volumes", done, all);
                let found = self.visibility.get(
                    gpu,
                    &self.timer,
                    &up,
                    &frame,
                    light_volumes,
                    scene.trace.lookup,
                    watch,
                )?;
                seconds.visibility = found.1;
                found.0
            }
        };
        let look = Develop::new(&image.look);
        let total = part.pixels() * samples.len() as u64;
        let mut done = 0;
        let like: TileHint = (variant, volume.cells.address(), whole);
        let known = self.learned.filter(|(of, _)| *of == like).map(|(_, pixels)| pixels);
        let mut tiler = Tiler::new(options.tile_pixels, known, scene.volume_lights().len());
        for window in options.grid.windows(whole, part) {
            // They meet, by the way windows are chosen.
            let Some(wanted) = window.meet(&part) else { continue };
            let area = Tile {
                x: wanted.x - window.x,
                y: wanted.y - window.y,
                width: wanted.width,
                height: wanted.height,
            };
            let uniforms =
                |sample| layout::FrameUniforms::new(scene, volume, window, &samples, sample, layers);
            let groups = GroupList::new(gpu, scene, window, area);
            for sample in samples.clone() {
                let frame_uniforms = uniforms(sample);
                let key = Key::new(&frame_uniforms, &up.geometry);
                let kept = match options.keep_rasters {
                    0 => None,
                    most => self.rasters.place(gpu, key, size, layers, pools, most),
                };
                let targets = kept.map_or(own, |kept| &kept.targets);
                let inputs = Inputs {
                    gpu,
                    timer: &self.timer,
                    up: &up,
                    targets,
                    window,
                    area,
                    frame: &frame_uniforms,
                    groups: &groups,
                    filled: &filled,
                    reflection: &reflection,
                };
                let waves = Some(up.waves);
                let redraw = match kept.map(|kept| kept.waves.replace(None)) {
                    Some(of) if of == waves => None,
                    Some(Some(_)) => Some(Redraw::Pools),
                    _ => Some(Redraw::All),
                };
                if let Some(redraw) = redraw {
                    let between = || monitor.progress("pixels", done, total);
                    seconds.gbuffer += self.gbuffer.run(&inputs, redraw, between)?;
                }
                if let Some(kept) = kept {
                    kept.waves.set(waves);
                }
                if sample == samples.start
                    && let Some(surface) = &mut frame.surface
                {
                    let first = part.index([wanted.x, wanted.y]);
                    read_surface(gpu, scene, targets, area, surface, first, part.width as usize)?;
                }
                seconds.integrate += integrate.run(&inputs, sums, &mut tiler, |pixels| {
                    monitor.progress("pixels", done + pixels, total)
                })?;
                done += wanted.pixels();
            }
            let uniforms = uniforms(samples.start);
            seconds.resolve += self.resolve.run(gpu, &self.timer, sums, picture, area, &uniforms, &look)?;
            let clock = Instant::now();
            let inverse = 1.0 / samples.len() as f32;
            let range = |row: u32| {
                let first = part.index([wanted.x, wanted.y + row]);
                first..first + wanted.width as usize
            };
            readback::read_rows(gpu, &sums.radiance, 16, window.width, area, |row, bytes| {
                let mean = |sum: [f32; 4]| sum.map(|x| x * inverse);
                frame.radiance[range(row)]
                    .iter_mut()
                    .zip(bytes.chunks_exact(16))
                    .for_each(|(out, sum)| *out = mean(bytemuck::pod_read_unaligned(sum)));
            })?;
            monitor.progress("pixels", done, total)?;
            readback::read_rows(gpu, &sums.counts, 8, window.width, area, |row, bytes| {
                bytemuck::cast_slice_mut(&mut frame.counts[range(row)]).copy_from_slice(bytes);
            })?;
            let cut = (0..wanted.height).flat_map(range).filter(|&i| frame.counts[i][0] == CUT).count();
            if cut > 0 {
                return Err(Error::input(
                    format!(
                        "{} ended the walks of {cut} pixels before they were done: too many cells",
                        gpu.name()
                    ),
                    "use light.visibility=cached, fewer lights, a smaller trace.max_cells, or --engine cpu",
                ));
            }
            readback::read_rows(gpu, picture, 4, window.width, area, |row, bytes| {
                bytemuck::cast_slice_mut(&mut frame.picture[range(row)]).copy_from_slice(bytes);
            })?;
            seconds.readback += clock.elapsed().as_secs_f64();
        }
        // Bloom needs the whole image, which may be drawn in several windows.
        if image.look.bloom > 0.0 && part == Window::whole(whole) {
            let clock = Instant::now();
            develop(&mut frame, &image.look, true);
            seconds.resolve += clock.elapsed().as_secs_f64();
        }
        self.learned = tiler.learned().map(|pixels| (like, pixels));
        frame.seconds = seconds;
        Ok(frame)
    }
}

/// Brings the layers of `area` back into `surface`, whose rows of `width` pixels they begin in at `first`.
fn read_surface(
    gpu: &Gpu,
    scene: &Scene,
    targets: &Targets,
    area: Tile,
    surface: &mut Surface,
    first: usize,
    width: usize,
) -> Result<()> {
    let rows = (SURFACE_PIXELS / area.width).max(1);
    for y in (0..area.height).step_by(rows as usize) {
        let band = Tile { y: area.y + y, height: rows.min(area.height - y), ..area };
        let read = |texture| readback::read_texture(gpu, texture, band);
        let (opaque, normal, hit) = (read(&targets.opaque)?, read(&targets.normal)?, read(&targets.surface)?);
        let quads = read(&targets.quad_id)?;
        let floats = |bytes: &[u8], i: usize| -> [f32; 4] {
            bytemuck::pod_read_unaligned(&bytes[16 * i..16 * i + 16])
        };
        for i in 0..band.width as usize * band.height as usize {
            let quad: u32 = bytemuck::pod_read_unaligned(&quads[4 * i..4 * i + 4]);
            let behind = (floats(&opaque, i)[3], glam::Vec3::from_slice(&floats(&normal, i)));
            let (row, column) = (y as usize + i / band.width as usize, i % band.width as usize);
            surface.set(
                first + row * width + column,
                (&scene.quads, scene.camera.eye),
                quad,
                floats(&hit, i),
                behind,
            );
        }
    }
    Ok(())
}
