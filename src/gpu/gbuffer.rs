//! §3 The raster pass: opaque geometry, then the volume's quads, in one z-buffer.

use std::cell::OnceCell;

use super::device::Gpu;
use super::upload::UploadedEnvironment;
use super::{Inputs, shader};
use crate::error::Result;
use crate::scene::Vertex;

const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const FLOATS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// Indices drawn in one submission: 32,768 triangles take software Vulkan 10 to 40 ms.
const PART_INDICES: u32 = 3 << 15;

/// The pass's shader.
pub fn gbuffer_source() -> String {
    [include_str!("../../shaders/gbuffer.wgsl"), include_str!("../../shaders/pool.wgsl")].join("\n")
}

/// The targets of one window.
pub struct Targets {
    /// Radiance of the opaque scene or the background; metres from the eye (0: background).
    pub opaque: wgpu::Texture,
    /// Normal of the opaque scene (0: background).
    pub normal: wgpu::Texture,
    /// u, v and metres from the eye of the nearest volume quad.
    pub surface: wgpu::Texture,
    /// Numbers plus 1 of the quads under each pixel, the nearest in layer 0; 0: no more.
    pub quad_id: wgpu::Texture,
    /// The z-buffer; with several layers it and the second hold that of the even and of the odd ones in turn,
    /// and the third that of the opaque scene.
    depth: Vec<wgpu::Texture>,
}

impl Targets {
    /// Bytes a pixel: three of four floats, the quads' numbers, depths. The points of the sheets behind the
    /// nearest are not kept: what finds them again costs less than a cell of the walk.
    pub const fn bytes(layers: u32) -> u64 {
        3 * 16 + 4 * layers as u64 + if layers > 1 { 3 * 4 } else { 4 }
    }

    /// Targets for a window of `width` × `height` pixels under which `layers` quads may lie.
    pub fn new(gpu: &Gpu, width: u32, height: u32, layers: u32) -> Self {
        let texture = |label, format, usage, layers| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let (depths, depth_usage) = match layers {
            1 => (1, wgpu::TextureUsages::empty()),
            _ => (3, read | wgpu::TextureUsages::COPY_DST),
        };
        Targets {
            opaque: texture("opaque radiance", FLOATS, read, 1),
            normal: texture("opaque normal", FLOATS, wgpu::TextureUsages::COPY_SRC, 1),
            surface: texture("surface", FLOATS, read, 1),
            quad_id: texture("quad id", wgpu::TextureFormat::R32Uint, read, layers),
            depth: (0..depths).map(|_| texture("depth", DEPTH, depth_usage, 1)).collect(),
        }
    }

    /// The quads' numbers in some of the layers.
    pub fn ids(&self, layers: std::ops::Range<u32>) -> wgpu::TextureView {
        self.quad_id.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            base_array_layer: layers.start,
            array_layer_count: Some(layers.len() as u32),
            ..Default::default()
        })
    }

    fn depth_view(&self, number: usize) -> wgpu::TextureView {
        self.depth[number].create_view(&Default::default())
    }
}

/// The pass: its pipelines.
pub struct Gbuffer {
    background: wgpu::RenderPipeline,
    opaque: wgpu::RenderPipeline,
    volume: wgpu::RenderPipeline,
    peel: wgpu::RenderPipeline,
    module: wgpu::ShaderModule,
    /// Background and opaque scene under an environment; compiled for the first scene that has one.
    environment: OnceCell<[wgpu::RenderPipeline; 2]>,
}

impl Gbuffer {
    /// Compiles the pipelines.
    pub fn new(gpu: &Gpu) -> Self {
        let module = shader(gpu, "gbuffer", &gbuffer_source());
        let [background, opaque] = behind(gpu, &module, "");
        let ids = wgpu::TextureFormat::R32Uint;
        let water = |fragment, targets: &[wgpu::TextureFormat]| {
            let nearer = wgpu::CompareFunction::Greater;
            pipeline(gpu, &module, ["volume_vertex", fragment], &[], targets, nearer)
        };
        let (volume, peel) = (water("volume_fragment", &[FLOATS, ids]), water("peel_fragment", &[ids]));
        Gbuffer { background, opaque, volume, peel, module, environment: OnceCell::new() }
    }

    /// Fills the targets with one sample of a window; seconds on the device. A large mesh is drawn in
    /// parts, and each layer behind the nearest in one of its own; `between` is called before each but the
    /// first, and may stop the work.
    pub fn run(&self, inputs: &Inputs, mut between: impl FnMut() -> Result<()>) -> Result<f64> {
        let Inputs { gpu, timer, up, targets, window, frame, .. } = *inputs;
        let layers = frame.layers;
        let uniform = gpu.buffer_with("frame", bytemuck::bytes_of(frame), wgpu::BufferUsages::UNIFORM);
        let bind = |pipeline: &wgpu::RenderPipeline, entries: &[(u32, wgpu::BindingResource)]| {
            let entries: Vec<_> = entries
                .iter()
                .map(|(binding, resource)| wgpu::BindGroupEntry {
                    binding: *binding,
                    resource: resource.clone(),
                })
                .collect();
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("gbuffer"),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &entries,
            })
        };
        let [frame, lights, quads, pools] =
            [&uniform, &up.lights, &up.quads, &up.pools].map(|b| b.as_entire_binding());
        let (background, opaque, sky, rock) = match &up.environment {
            None => {
                let sky = bind(&self.background, &[(0, frame.clone())]);
                let rock = bind(&self.opaque, &[(0, frame.clone()), (1, lights), (7, pools)]);
                (&self.background, &self.opaque, sky, rock)
            }
            Some(UploadedEnvironment { uniform, map }) => {
                let [background, opaque] =
                    self.environment.get_or_init(|| behind(gpu, &self.module, "_environment"));
                let uniform = uniform.as_entire_binding();
                let map = wgpu::BindingResource::TextureView(map);
                let sky = bind(background, &[(0, frame.clone()), (5, uniform.clone()), (6, map)]);
                let rock = bind(opaque, &[(0, frame.clone()), (1, lights), (5, uniform), (7, pools)]);
                (background, opaque, sky, rock)
            }
        };
        let water = bind(&self.volume, &[(0, frame.clone()), (2, quads.clone())]);
        let [radiance, normal, surface] =
            [&targets.opaque, &targets.normal, &targets.surface].map(|t| t.create_view(&Default::default()));
        let depth_views: Vec<_> = (0..targets.depth.len()).map(|i| targets.depth_view(i)).collect();
        let id_view = |layer| {
            targets.quad_id.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: layer,
                array_layer_count: Some(1),
                ..Default::default()
            })
        };
        let id_views: Vec<_> = (0..layers).map(id_view).collect();
        let colour = |view, load| {
            let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
            Some(wgpu::RenderPassColorAttachment { view, resolve_target: None, depth_slice: None, ops })
        };
        let clear = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let depth = |number: usize, load| wgpu::RenderPassDepthStencilAttachment {
            view: &depth_views[number],
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
                    color_attachments: &[colour(&radiance, load), colour(&normal, load)],
                    depth_stencil_attachment: Some(depth(0, load_depth)),
                    timestamp_writes: span.render(true, !last),
                    ..Default::default()
                });
                place(&mut pass);
                if part == 0 {
                    pass.set_pipeline(background);
                    pass.set_bind_group(0, &sky, &[]);
                    pass.draw(0..3, 0..1);
                }
                if up.index_count > 0 {
                    let first = part * PART_INDICES;
                    pass.set_pipeline(opaque);
                    pass.set_bind_group(0, &rock, &[]);
                    pass.set_vertex_buffer(0, up.vertices.slice(..));
                    pass.set_index_buffer(up.indices.slice(..), wgpu::IndexFormat::Uint32);
                    pass.draw_indexed(first..up.index_count.min(first + PART_INDICES), 0, 0..1);
                }
                drop(pass);
                if !last {
                    return;
                }
                if layers > 1 {
                    copy(encoder, &targets.depth[0], &targets.depth[2]);
                }
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("gbuffer volume"),
                    color_attachments: &[colour(&surface, clear), colour(&id_views[0], clear)],
                    depth_stencil_attachment: Some(depth(0, wgpu::LoadOp::Load)),
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
        for layer in 1..layers {
            between()?;
            let (known, own) = ((layer as usize - 1) % 2, layer as usize % 2);
            let ids = targets.ids(0..layer);
            let group = bind(
                &self.peel,
                &[
                    (0, frame.clone()),
                    (2, quads.clone()),
                    (3, wgpu::BindingResource::TextureView(&depth_views[known])),
                    (4, wgpu::BindingResource::TextureView(&ids)),
                ],
            );
            seconds += timer.run(gpu, "gbuffer", |encoder, span| {
                // What lies behind the opaque scene is not there.
                copy(encoder, &targets.depth[2], &targets.depth[own]);
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("gbuffer peel"),
                    color_attachments: &[colour(&id_views[layer as usize], clear)],
                    depth_stencil_attachment: Some(depth(own, wgpu::LoadOp::Load)),
                    timestamp_writes: span.render(true, true),
                    ..Default::default()
                });
                place(&mut pass);
                pass.set_pipeline(&self.peel);
                pass.set_bind_group(0, &group, &[]);
                pass.draw(0..6, 0..up.quad_count);
            })?;
        }
        Ok(seconds)
    }
}

/// Copies a whole texture to one of its size: of a depth texture a part cannot be copied.
fn copy(encoder: &mut wgpu::CommandEncoder, from: &wgpu::Texture, to: &wgpu::Texture) {
    encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), from.size());
}

/// Background and opaque scene, with the fragment shaders of this `kind`.
fn behind(gpu: &Gpu, module: &wgpu::ShaderModule, kind: &str) -> [wgpu::RenderPipeline; 2] {
    let attributes = wgpu::vertex_attr_array![
        0 => Float32x3, 1 => Float32x3, 2 => Float32x3, 3 => Float32x3, 4 => Uint32
    ];
    let vertices = wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &attributes,
    };
    let behind = |name: &str, buffers: &[Option<wgpu::VertexBufferLayout>], compare| {
        let [vertex, fragment] = [format!("{name}_vertex"), format!("{name}{kind}_fragment")];
        pipeline(gpu, module, [&vertex, &fragment], buffers, &[FLOATS; 2], compare)
    };
    [
        behind("background", &[], wgpu::CompareFunction::Always),
        behind("opaque", &[Some(vertices)], wgpu::CompareFunction::Greater),
    ]
}

fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    [vertex, fragment]: [&str; 2],
    buffers: &[Option<wgpu::VertexBufferLayout>],
    targets: &[wgpu::TextureFormat],
    compare: wgpu::CompareFunction,
) -> wgpu::RenderPipeline {
    let target =
        |&format| Some(wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::ALL });
    let targets: Vec<_> = targets.iter().map(target).collect();
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
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
            module,
            entry_point: Some(fragment),
            compilation_options: Default::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
