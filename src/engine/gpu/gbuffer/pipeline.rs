//! Render pipelines of the raster pass.

use crate::engine::gpu::device::Gpu;
use crate::engine::gpu::targets::DEPTH;

/// Variant of the shaders that shade opaque geometry.
#[derive(Clone, Copy)]
pub struct OpaqueVariant {
    /// Whether the scene has an environment.
    pub environment: bool,
    /// Whether the scene has exactly one light.
    pub one_light: bool,
    /// Whether any rock has a kind of stone.
    pub stones: bool,
}

impl OpaqueVariant {
    /// Returns the variant for a number of lights.
    pub fn new(environment: bool, lights: usize, stones: bool) -> OpaqueVariant {
        OpaqueVariant { environment, one_light: lights == 1, stones }
    }

    /// Returns the number of the variant, below 8.
    pub fn number(self) -> usize {
        usize::from(self.environment) + 2 * usize::from(self.one_light) + 4 * usize::from(self.stones)
    }
}

/// State in which pipelines differ, apart from their shaders.
pub struct PipelineState {
    /// Depth test.
    pub compare: wgpu::CompareFunction,
    /// Whether the depth is written.
    pub writes_depth: bool,
    /// Value of the shader's constant `ONE_LIGHT`.
    pub one_light: bool,
    /// Value of the shader's constant `STONES`.
    pub stones: bool,
}

/// Draws nearer fragments and writes their depth.
pub const NEARER: PipelineState = PipelineState {
    compare: wgpu::CompareFunction::Greater,
    writes_depth: true,
    one_light: false,
    stones: false,
};

/// Creates a pipeline without vertex buffers.
pub fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    [vertex, fragment]: [&str; 2],
    targets: &[wgpu::TextureFormat],
    state: PipelineState,
) -> wgpu::RenderPipeline {
    let target =
        |&format| Some(wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::ALL });
    let targets: Vec<_> = targets.iter().map(target).collect();
    let set = [("ONE_LIGHT", state.one_light), ("STONES", state.stones)];
    let constants: Vec<_> =
        set.into_iter().filter(|(_, is_set)| *is_set).map(|(name, _)| (name, 1.0)).collect();
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
            depth_write_enabled: Some(state.writes_depth),
            depth_compare: Some(state.compare),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            },
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
