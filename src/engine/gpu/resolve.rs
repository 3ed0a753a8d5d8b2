//! The resolve pass: develops the picture from the linear sums.

use super::binding::{bind_buffer, resolve as at};
use super::device::Gpu;
use super::integrate::Sums;
use super::layout::{FrameUniforms, Tile, WORKGROUP};
use super::specialise::Source;
use super::timing::Timer;
use super::{compute_pipeline, shader};
use crate::picture::Develop;
use crate::util::error::Result;

/// Inputs of the resolve pass.
#[derive(Clone, Copy)]
pub struct ResolveInputs<'a> {
    /// Sums of all samples.
    pub sums: &'a Sums,
    /// The developed picture: one word per pixel of the window.
    pub picture: &'a wgpu::Buffer,
    /// The part of the window that is developed, pixels.
    pub area: Tile,
    /// Uniforms of the window; those of any sample will do.
    pub frame: &'a FrameUniforms,
    /// Exposure, tone curve and white balance.
    pub develop: &'a Develop,
}

/// The resolve pass.
pub struct Resolve {
    pipeline: wgpu::ComputePipeline,
}

impl Resolve {
    /// Compiles the pipeline.
    pub fn new(gpu: &Gpu) -> Self {
        let source = Source::read("resolve", &shader::resolve("#import picture::resolve"));
        let pipeline = compute_pipeline(gpu, None, &source, "resolve", &[]);
        Resolve { pipeline }
    }

    /// Develops the sums of a window's area into `inputs.picture`. Returns the seconds on the device.
    ///
    /// # Errors
    /// Errors of the device: see [`Gpu::run`].
    pub fn run(&self, gpu: &Gpu, timer: &Timer, inputs: &ResolveInputs) -> Result<f64> {
        let ResolveInputs { sums, picture, area, frame, develop } = *inputs;
        let uniform = gpu.buffer_with("frame", bytemuck::bytes_of(frame), wgpu::BufferUsages::UNIFORM);
        let develop = gpu.buffer_with("develop", bytemuck::bytes_of(develop), wgpu::BufferUsages::UNIFORM);
        let tile = gpu.buffer_with("tile", bytemuck::bytes_of(&area), wgpu::BufferUsages::UNIFORM);
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("resolve"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                bind_buffer(at::FRAME, &uniform),
                bind_buffer(at::RADIANCE, &sums.radiance),
                bind_buffer(at::PICTURE, picture),
                bind_buffer(at::TILE, &tile),
                bind_buffer(at::DEVELOP, &develop),
                bind_buffer(at::UNCOVERED, &sums.uncovered),
            ],
        });
        timer.run(gpu, "resolve", |encoder, span| {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("resolve"),
                timestamp_writes: span.compute(),
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(area.width.div_ceil(WORKGROUP), area.height.div_ceil(WORKGROUP), 1);
        })
    }
}
