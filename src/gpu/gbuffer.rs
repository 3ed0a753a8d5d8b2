//! §3 The raster pass: opaque geometry, then the volume's quads, in one z-buffer.

use super::device::Gpu;
use super::{Inputs, shader};
use crate::error::Result;
use crate::scene::Vertex;

const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const FLOATS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// Indices drawn in one submission: 32,768 triangles take software Vulkan 10 to 40 ms.
const PART_INDICES: u32 = 3 << 15;

/// The targets of one window.
pub struct Targets {
    /// Radiance of the opaque scene or the background; metres from the eye (0: background).
    pub opaque: wgpu::Texture,
    /// Normal of the opaque scene (0: background).
    pub normal: wgpu::Texture,
    /// u, v and metres from the eye of the nearest volume quad.
    pub surface: wgpu::Texture,
    /// Its number plus 1; 0: none.
    pub quad_id: wgpu::Texture,
    depth: wgpu::TextureView,
}

impl Targets {
    /// Bytes a pixel: three of four floats, the quad's number, depth.
    pub const BYTES: u64 = 3 * 16 + 4 + 4;

    /// Targets for a window of `width` × `height` pixels.
    pub fn new(gpu: &Gpu, width: u32, height: u32) -> Self {
        let texture = |label, format, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        Targets {
            opaque: texture("opaque radiance", FLOATS, read),
            normal: texture("opaque normal", FLOATS, wgpu::TextureUsages::COPY_SRC),
            surface: texture("surface", FLOATS, read),
            quad_id: texture("quad id", wgpu::TextureFormat::R32Uint, read),
            depth: texture("depth", DEPTH, wgpu::TextureUsages::empty()).create_view(&Default::default()),
        }
    }
}

/// The pass: two pipelines.
pub struct Gbuffer {
    background: wgpu::RenderPipeline,
    opaque: wgpu::RenderPipeline,
    volume: wgpu::RenderPipeline,
}

impl Gbuffer {
    /// Compiles the pipelines.
    pub fn new(gpu: &Gpu) -> Self {
        let module = shader(gpu, "gbuffer", include_str!("../../shaders/gbuffer.wgsl"));
        let target =
            |format| Some(wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::ALL });
        let pipeline = |name: &str,
                        buffers: &[Option<wgpu::VertexBufferLayout>],
                        targets: &[Option<wgpu::ColorTargetState>],
                        compare| {
            gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(name),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(&format!("{name}_vertex")),
                    compilation_options: Default::default(),
                    buffers,
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(compare),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(&format!("{name}_fragment")),
                    compilation_options: Default::default(),
                    targets,
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3];
        let vertices = wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        };
        let opaque_targets = [target(FLOATS), target(FLOATS)];
        Gbuffer {
            background: pipeline("background", &[], &opaque_targets, wgpu::CompareFunction::Always),
            opaque: pipeline("opaque", &[Some(vertices)], &opaque_targets, wgpu::CompareFunction::Greater),
            volume: pipeline(
                "volume",
                &[],
                &[target(FLOATS), target(wgpu::TextureFormat::R32Uint)],
                wgpu::CompareFunction::Greater,
            ),
        }
    }

    /// Fills the targets with one sample of a window; seconds on the device. A large mesh is drawn in
    /// parts; `between` is called before each but the first, and may stop the work.
    pub fn run(&self, inputs: &Inputs, mut between: impl FnMut() -> Result<()>) -> Result<f64> {
        let Inputs { gpu, timer, up, targets, window, frame, .. } = *inputs;
        let uniform = gpu.buffer_with("frame", bytemuck::bytes_of(frame), wgpu::BufferUsages::UNIFORM);
        let bind = |pipeline: &wgpu::RenderPipeline, entries: &[(u32, &wgpu::Buffer)]| {
            let entries: Vec<_> = entries
                .iter()
                .map(|(binding, buffer)| wgpu::BindGroupEntry {
                    binding: *binding,
                    resource: buffer.as_entire_binding(),
                })
                .collect();
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("gbuffer"),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &entries,
            })
        };
        let sky = bind(&self.background, &[(0, &uniform)]);
        let rock = bind(&self.opaque, &[(0, &uniform), (1, &up.lights)]);
        let water = bind(&self.volume, &[(0, &uniform), (2, &up.quads)]);
        let views = [&targets.opaque, &targets.normal, &targets.surface, &targets.quad_id]
            .map(|t| t.create_view(&Default::default()));
        let colour = |view, load| {
            let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
            Some(wgpu::RenderPassColorAttachment { view, resolve_target: None, depth_slice: None, ops })
        };
        let clear = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let depth = |load| wgpu::RenderPassDepthStencilAttachment {
            view: &targets.depth,
            depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        // The targets may be larger than a window at the image's edge.
        let place = |pass: &mut wgpu::RenderPass| {
            pass.set_viewport(0.0, 0.0, window.width as f32, window.height as f32, 0.0, 1.0);
        };
        let parts = up.index_count.div_ceil(PART_INDICES).max(1);
        let mut seconds = 0.0;
        for part in 0..parts {
            let last = part + 1 == parts;
            if part > 0 {
                between()?;
            }
            seconds += timer.run(gpu, "gbuffer", |encoder, span| {
                let (load, load_depth) = match part {
                    0 => (clear, wgpu::LoadOp::Clear(0.0)),
                    _ => (wgpu::LoadOp::Load, wgpu::LoadOp::Load),
                };
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("gbuffer opaque"),
                    color_attachments: &[colour(&views[0], load), colour(&views[1], load)],
                    depth_stencil_attachment: Some(depth(load_depth)),
                    timestamp_writes: span.render(true, !last),
                    ..Default::default()
                });
                place(&mut pass);
                if part == 0 {
                    pass.set_pipeline(&self.background);
                    pass.set_bind_group(0, &sky, &[]);
                    pass.draw(0..3, 0..1);
                }
                if up.index_count > 0 {
                    let first = part * PART_INDICES;
                    pass.set_pipeline(&self.opaque);
                    pass.set_bind_group(0, &rock, &[]);
                    pass.set_vertex_buffer(0, up.vertices.slice(..));
                    pass.set_index_buffer(up.indices.slice(..), wgpu::IndexFormat::Uint32);
                    pass.draw_indexed(first..up.index_count.min(first + PART_INDICES), 0, 0..1);
                }
                drop(pass);
                if !last {
                    return;
                }
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("gbuffer volume"),
                    color_attachments: &[colour(&views[2], clear), colour(&views[3], clear)],
                    depth_stencil_attachment: Some(depth(wgpu::LoadOp::Load)),
                    timestamp_writes: span.render(false, true),
                    ..Default::default()
                });
                place(&mut pass);
                if up.quad_count > 0 {
                    pass.set_pipeline(&self.volume);
                    pass.set_bind_group(0, &water, &[]);
                    pass.draw(0..6, 0..up.quad_count);
                }
            })?;
        }
        Ok(seconds)
    }
}
