//! Pipelines of the raster pass.

use crate::engine::gpu::device::Gpu;
use crate::engine::gpu::targets::DEPTH;

/// What a scene is lit by, as far as shaders differ.
#[derive(Clone, Copy)]
pub struct OpaqueVariant {
    /// Whether there is an environment.
    pub environment: bool,
    /// Whether one light is all.
    pub one_light: bool,
}

impl OpaqueVariant {
    /// Of so many lights.
    pub fn new(environment: bool, lights: usize) -> OpaqueVariant {
        OpaqueVariant { environment, one_light: lights == 1 }
    }
}

/// How pipelines differ besides their shaders.
pub struct PipelineState {
    /// Which depths are drawn.
    pub compare: wgpu::CompareFunction,
    /// Whether they stay.
    pub writes_depth: bool,
    /// `ONE_LIGHT`.
    pub one_light: bool,
}

/// Draws what is nearer.
pub const NEARER: PipelineState =
    PipelineState { compare: wgpu::CompareFunction::Greater, writes_depth: true, one_light: false };

/// A pipeline without vertex buffers.
pub fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    [vertex, fragment]: [&str; 2],
    targets: &[wgpu::TextureFormat],
    kind: PipelineState,
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
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(kind.writes_depth),
            depth_compare: Some(kind.compare),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: if kind.one_light { &[("ONE_LIGHT", 1.0)] } else { &[] },
                ..Default::default()
            },
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
