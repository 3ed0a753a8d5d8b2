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
pub use upload::Uploaded;

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
    integrate: Option<Integrate>,
}

impl GpuRenderer {
    /// Compiles the passes that do not depend on the scene.
    pub fn new(gpu: Gpu) -> Self {
        let (timer, gbuffer, resolve) = (Timer::new(&gpu), Gbuffer::new(&gpu), Resolve::new(&gpu));
        GpuRenderer { gpu, timer, gbuffer, resolve, integrate: None }
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
        let integrate = match self.integrate.take() {
            Some(pass) if pass.variant == variant => pass,
            _ => Integrate::new(gpu, variant),
        };
        let integrate = &*self.integrate.insert(integrate);
        seconds.pipelines = clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        let up = Uploaded::new(gpu, scene, volume, mesh)?;
        seconds.upload = clock.elapsed().as_secs_f64();

        let mut frame = Frame::new(image.width, image.height, options.surface);
        let rows = options.window_pixels.unwrap_or(WINDOW_PIXELS) / image.width as u64;
        let rows = (rows as u32).clamp(1, image.height);
        let targets = Targets::new(gpu, image.width, rows);
        let pixels = image.width as u64 * rows as u64;
        let sums = Sums::new(gpu, pixels);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let picture = gpu.buffer("picture", pixels * Resolve::PICTURE_BYTES, usage);
        gpu.check()?;

        let total = image.width as u64 * image.height as u64 * image.samples as u64;
        let mut done = 0;
        let mut tiler = Tiler::new(options.tile_pixels);
        for y in (0..image.height).step_by(rows as usize) {
            let window = Window { x: 0, y, width: image.width, height: rows.min(image.height - y) };
            let window_pixels = window.width as u64 * window.height as u64;
            let uniforms = |sample| layout::Frame::new(scene, volume.size, volume.alpha, window, sample);
            for sample in 0..image.samples {
                let frame_uniforms = uniforms(sample);
                let inputs = Inputs {
                    gpu,
                    timer: &self.timer,
                    up: &up,
                    targets: &targets,
                    window,
                    frame: &frame_uniforms,
                };
                seconds.gbuffer += self.gbuffer.run(&inputs)?;
                if sample == 0
                    && let Some(surface) = &mut frame.surface
                {
                    read_surface(gpu, scene, &targets, window, surface)?;
                }
                seconds.integrate += integrate.run(&inputs, &sums, &mut tiler, |pixels| {
                    monitor.progress("pixels", done + pixels, total)
                })?;
                done += window_pixels;
            }
            seconds.resolve += self.resolve.run(gpu, &self.timer, &sums, &picture, window, &uniforms(0))?;
            let clock = Instant::now();
            let first = y as usize * image.width as usize;
            let range = first..first + window_pixels as usize;
            let bytes = readback::read_buffer(gpu, &sums.radiance, window_pixels * 16)?;
            let inverse = 1.0 / image.samples as f32;
            let mean = |sum: [f32; 4]| sum.map(|x| x * inverse);
            frame.radiance[range.clone()]
                .iter_mut()
                .zip(bytes.chunks_exact(16))
                .for_each(|(out, sum)| *out = mean(bytemuck::pod_read_unaligned(sum)));
            let bytes = readback::read_buffer(gpu, &sums.counts, window_pixels * 8)?;
            frame.counts[range.clone()]
                .iter_mut()
                .zip(bytes.chunks_exact(8))
                .for_each(|(out, count)| *out = bytemuck::pod_read_unaligned(count));
            let bytes = readback::read_buffer(gpu, &picture, window_pixels * 4)?;
            frame.picture[range].copy_from_slice(bytemuck::cast_slice(&bytes));
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
