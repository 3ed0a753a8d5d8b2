//! Times passes on the device with timestamp queries. If a device has none, or only unreliable ones, the
//! host's clock times submission and wait.

use std::time::Instant;

use super::device::Gpu;
use crate::util::error::Result;

/// Times one submission at a time.
pub struct Timer {
    queries: Option<Queries>,
}

struct Queries {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
    seconds_per_tick: f64,
}

/// A span of device time; its passes write timestamps at its begin and end.
pub struct Span<'a> {
    set: Option<&'a wgpu::QuerySet>,
}

impl Span<'_> {
    /// Returns the timestamp writes of a compute pass that begins and ends the span.
    pub fn compute(&self) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.set.map(|query_set| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        })
    }

    /// Returns the timestamp writes of a render pass that begins the span, ends it, or both.
    pub fn render(&self, begins: bool, ends: bool) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.set.map(|query_set| wgpu::RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: begins.then_some(0),
            end_of_pass_write_index: ends.then_some(1),
        })
    }
}

impl Timer {
    /// Creates a timer for a device.
    pub fn new(gpu: &Gpu) -> Self {
        let queries = gpu.timestamps.then(|| Queries {
            set: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            resolved: gpu.buffer(
                "pass times",
                16,
                wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            ),
            readable: gpu.buffer(
                "pass times",
                16,
                wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            ),
            seconds_per_tick: gpu.queue.get_timestamp_period() as f64 * 1e-9,
        });
        Timer { queries }
    }

    /// Runs a compute pass of `groups` workgroups. Returns the seconds that the device spent in it.
    ///
    /// # Errors
    /// Errors of the device: see [`Gpu::run`].
    pub fn dispatch(
        &self,
        gpu: &Gpu,
        label: &str,
        pipeline: &wgpu::ComputePipeline,
        group: &wgpu::BindGroup,
        groups: u32,
    ) -> Result<f64> {
        self.run(gpu, label, |encoder, span| {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(label),
                timestamp_writes: span.compute(),
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        })
    }

    /// Records commands with `record`, submits them and waits. Returns the seconds that the device spent in
    /// the span.
    ///
    /// # Errors
    /// Errors of the device: see [`Gpu::run`].
    pub fn run(
        &self,
        gpu: &Gpu,
        label: &str,
        record: impl FnOnce(&mut wgpu::CommandEncoder, &Span),
    ) -> Result<f64> {
        let mut encoder = gpu.encoder(label);
        record(&mut encoder, &Span { set: self.queries.as_ref().map(|q| &q.set) });
        let Some(q) = &self.queries else {
            let start = Instant::now();
            gpu.run(encoder)?;
            return Ok(start.elapsed().as_secs_f64());
        };
        encoder.resolve_query_set(&q.set, 0..2, &q.resolved, 0);
        encoder.copy_buffer_to_buffer(&q.resolved, 0, &q.readable, 0, 16);
        gpu.run(encoder)?;
        let ticks: [u64; 2] = super::readback::map(gpu, &q.readable, bytemuck::pod_read_unaligned)?;
        Ok(ticks[1].saturating_sub(ticks[0]) as f64 * q.seconds_per_tick)
    }
}
