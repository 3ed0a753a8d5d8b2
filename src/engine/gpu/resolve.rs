//! The picture from the linear sums.

use super::device::Gpu;
use super::integrate::Sums;
use super::layout::{FrameUniforms, Tile, WORKGROUP};
use super::specialise::Source;
use super::timing::Timer;
use super::{compute_pipeline, shader};
use crate::picture::Develop;
use crate::util::error::Result;

/// The pass.
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

    /// Turns the sums of an area of a window into `picture`; seconds on the device.
    #[expect(clippy::too_many_arguments, reason = "where from, where to, and how")]
    pub fn run(
        &self,
        gpu: &Gpu,
        timer: &Timer,
        sums: &Sums,
        picture: &wgpu::Buffer,
        area: Tile,
        frame: &FrameUniforms,
        develop: &Develop,
    ) -> Result<f64> {
        let uniform = gpu.buffer_with("frame", bytemuck::bytes_of(frame), wgpu::BufferUsages::UNIFORM);
        let develop = gpu.buffer_with("develop", bytemuck::bytes_of(develop), wgpu::BufferUsages::UNIFORM);
        let tile = gpu.buffer_with("tile", bytemuck::bytes_of(&area), wgpu::BufferUsages::UNIFORM);
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("resolve"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: sums.radiance.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 2, resource: picture.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 3, resource: tile.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 4, resource: develop.as_entire_binding() },
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
