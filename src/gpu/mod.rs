//! The frame on the GPU: upload, gbuffer, integrate, resolve, read back.

mod bench;
mod device;
mod gbuffer;
mod integrate;
pub mod layout;
mod readback;
mod resolve;
mod timing;
mod upload;

pub use bench::{BenchPass, GpuBench};
pub use device::{DeviceOptions, Gpu, adapters};
pub use gbuffer::{Gbuffer, Targets};
pub use integrate::{Integrate, Sums, Tiler, Variant};
pub use resolve::Resolve;
pub use timing::Timer;
pub use upload::{Resident, Uploaded};

use std::ops::Range;
use std::time::Instant;

use crate::error::{Error, Result};
use crate::frame::{Frame, Seconds, Surface};
use crate::job::Monitor;
use crate::scene::{Mesh, Scene};
use crate::volume::VolumeTexture;
use layout::Window;

/// Pixels rendered at once. Larger images are made of several windows, so that no target passes a
/// device's limits: 2²¹ pixels are 33 MB of the 128 MiB a storage buffer may have.
const WINDOW_PIXELS: u64 = 1 << 21;

/// How to render on the GPU.
#[derive(Clone, Debug, Default)]
pub struct RenderOptions {
    /// Whether to bring back depth, texture coordinates, quads and normals too.
    pub surface: bool,
    /// Only these of the scene's samples; the radiance is their mean.
    pub samples: Option<Range<u32>>,
    /// About this many pixels a submission, instead of what the clock suggests.
    pub tile_pixels: Option<u32>,
    /// Pixels rendered at once, instead of 2²¹. Rasterisers interpolate the rock from the window's corner,
    /// so other windows round its radiance otherwise.
    pub window_pixels: Option<u64>,
}

/// The text of a stage's shader: what all stages share, then its own.
pub fn shader_source(stage: &str) -> String {
    [
        include_str!("../../shaders/frame.wgsl"),
        include_str!("../../shaders/mapping.wgsl"),
        include_str!("../../shaders/walk.wgsl"),
        include_str!("../../shaders/shading.wgsl"),
        stage,
    ]
    .join("\n")
}

fn shader(gpu: &Gpu, name: &str, stage: &str) -> wgpu::ShaderModule {
    gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(shader_source(stage).into()),
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
    /// The part of the image.
    pub window: Window,
    /// Its uniforms.
    pub frame: &'a layout::Frame,
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
    /// The latest first.
    canvases: Vec<Canvas>,
}

/// Specialised pipelines that are kept: a slider that goes to and fro finds them again.
const KEPT_PIPELINES: usize = 16;
/// Canvases that are kept: an interactive renderer changes between its preview sizes.
const KEPT_CANVASES: usize = 5;

/// Targets and sums of one size.
struct Canvas {
    size: [u32; 2],
    targets: Targets,
    sums: Sums,
    picture: wgpu::Buffer,
}

impl Canvas {
    fn new(gpu: &Gpu, [width, height]: [u32; 2]) -> Self {
        let pixels = width as u64 * height as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        Canvas {
            size: [width, height],
            targets: Targets::new(gpu, width, height),
            sums: Sums::new(gpu, pixels),
            picture: gpu.buffer("picture", pixels * Resolve::PICTURE_BYTES, usage),
        }
    }
}

/// The first item that `is` it, moved to the front; a new one if there is none. The last of more than
/// `most` goes, before the new one is made.
fn recent<T>(items: &mut Vec<T>, most: usize, is: impl Fn(&T) -> bool, new: impl FnOnce() -> T) -> &T {
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
        GpuRenderer {
            gpu,
            timer,
            gbuffer,
            resolve,
            integrate: Vec::new(),
            resident: Resident::default(),
            canvases: Vec::new(),
        }
    }

    /// Renders a scene.
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
        let side = gpu.device.limits().max_texture_dimension_2d;
        if image.width.max(image.height) > side {
            return Err(Error::input(
                format!(
                    "an image of {}×{} pixels is too large for {}",
                    image.width,
                    image.height,
                    gpu.name()
                ),
                format!("a side is at most {side} pixels there; use --engine cpu for more"),
            ));
        }
        let mut seconds = Seconds::default();
        let clock = Instant::now();
        let variant = Variant::of(scene);
        let integrate = recent(
            &mut self.integrate,
            KEPT_PIPELINES,
            |pass| pass.variant == variant,
            || Integrate::new(gpu, variant),
        );
        seconds.pipelines = clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        let up = Uploaded::new(gpu, &mut self.resident, scene, volume, mesh)?;
        seconds.upload = clock.elapsed().as_secs_f64();

        let mut frame = Frame::new(image.width, image.height, options.surface);
        let rows = options.window_pixels.unwrap_or(WINDOW_PIXELS) / image.width as u64;
        let rows = (rows as u32).clamp(1, image.height);
        let size = [image.width, rows];
        let canvas = recent(&mut self.canvases, KEPT_CANVASES, |c| c.size == size, || Canvas::new(gpu, size));
        let Canvas { targets, sums, picture, .. } = canvas;
        gpu.check()?;

        let samples = options.samples.clone().unwrap_or(0..image.samples);
        let total = image.width as u64 * image.height as u64 * samples.len() as u64;
        let mut done = 0;
        let mut tiler = Tiler::new(options.tile_pixels);
        for y in (0..image.height).step_by(rows as usize) {
            let window = Window { x: 0, y, width: image.width, height: rows.min(image.height - y) };
            let window_pixels = window.width as u64 * window.height as u64;
            let uniforms = |sample| layout::Frame::new(scene, volume, window, &samples, sample);
            for sample in samples.clone() {
                let frame_uniforms = uniforms(sample);
                let inputs =
                    Inputs { gpu, timer: &self.timer, up: &up, targets, window, frame: &frame_uniforms };
                seconds.gbuffer += self.gbuffer.run(&inputs, || monitor.progress("pixels", done, total))?;
                if sample == samples.start
                    && let Some(surface) = &mut frame.surface
                {
                    read_surface(gpu, scene, targets, window, surface)?;
                }
                seconds.integrate += integrate.run(&inputs, sums, &mut tiler, |pixels| {
                    monitor.progress("pixels", done + pixels, total)
                })?;
                done += window_pixels;
            }
            seconds.resolve +=
                self.resolve.run(gpu, &self.timer, sums, picture, window, &uniforms(samples.start))?;
            let clock = Instant::now();
            let first = y as usize * image.width as usize;
            let range = first..first + window_pixels as usize;
            let inverse = 1.0 / samples.len() as f32;
            readback::read_buffer(gpu, &sums.radiance, window_pixels * 16, |bytes| {
                let mean = |sum: [f32; 4]| sum.map(|x| x * inverse);
                frame.radiance[range.clone()]
                    .iter_mut()
                    .zip(bytes.chunks_exact(16))
                    .for_each(|(out, sum)| *out = mean(bytemuck::pod_read_unaligned(sum)));
            })?;
            monitor.progress("pixels", done, total)?;
            readback::read_buffer(gpu, &sums.counts, window_pixels * 8, |bytes| {
                bytemuck::cast_slice_mut(&mut frame.counts[range.clone()]).copy_from_slice(bytes);
            })?;
            readback::read_buffer(gpu, picture, window_pixels * 4, |bytes| {
                bytemuck::cast_slice_mut(&mut frame.picture[range]).copy_from_slice(bytes);
            })?;
            seconds.readback += clock.elapsed().as_secs_f64();
        }
        frame.seconds = seconds;
        Ok(frame)
    }
}

fn read_surface(
    gpu: &Gpu,
    scene: &Scene,
    targets: &Targets,
    window: Window,
    surface: &mut Surface,
) -> Result<()> {
    let floats = |texture| -> Result<Vec<[f32; 4]>> {
        Ok(readback::read_texture(gpu, texture)?.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect())
    };
    let (opaque, normal, hit) =
        (floats(&targets.opaque)?, floats(&targets.normal)?, floats(&targets.surface)?);
    let quads = readback::read_texture(gpu, &targets.quad_id)?;
    let first = window.y as usize * window.width as usize;
    for i in 0..window.width as usize * window.height as usize {
        let quad: u32 = bytemuck::pod_read_unaligned(&quads[4 * i..4 * i + 4]);
        let behind = (opaque[i][3], glam::Vec3::from_slice(&normal[i]));
        surface.set(first + i, scene, quad, hit[i], behind);
    }
    Ok(())
}
