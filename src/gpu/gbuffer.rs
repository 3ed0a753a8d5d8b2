//! §3 The raster pass: opaque geometry, then the volume's quads, in one z-buffer.

use std::ops::Range;
use std::sync::OnceLock;
use std::time::Instant;

use glam::{Mat4, Vec3};

use super::device::Gpu;
use super::meshlets::in_view;
use super::targets::{DEPTH, FLOATS};
use super::timing::Span;
use super::{Inputs, shader};
use crate::error::Result;
use crate::pool::{STRAIGHT, WAVES};
use crate::scene::Scene;

const IDS: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
const CLEAR: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
const KEEP: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Load;

/// Parts of the mesh drawn in one submission: 32,736 triangles take software Vulkan 10 to 30 ms.
const PARTS: usize = 96;

/// The pass's shader. A pool's waves are added up one by one: software Vulkan reads what stands at a constant
/// place once for eight pixels, and lane by lane in a loop.
pub fn gbuffer_source() -> String {
    let waves: String = (0..WAVES)
        .map(|i| {
            let kind = if i < STRAIGHT { "straight" } else { "ring" };
            format!("    sum += {kind}_wave(pool.waves[{i}u], p, churn, footprint);\n")
        })
        .collect();
    let sum = format!(
        "fn waves(p: vec2<f32>, churn: f32, footprint: f32) -> vec3<f32> {{\n    \
         var sum = vec3<f32>(0.0);\n{waves}    return sum;\n}}\n"
    );
    [include_str!("../../shaders/gbuffer.wgsl"), include_str!("../../shaders/pool.wgsl"), &sum].join("\n")
}

/// What of the targets has to be drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Redraw {
    /// All.
    All,
    /// The pools: the targets hold the same picture with other waves.
    Pools,
}

/// The pass: its pipelines, compiled for the first scene that has use for them.
pub struct Gbuffer {
    module: wgpu::ShaderModule,
    // Without and with an environment.
    background: [OnceLock<wgpu::RenderPipeline>; 2],
    rock: [OnceLock<wgpu::RenderPipeline>; 2],
    pool: [OnceLock<wgpu::RenderPipeline>; 2],
    volume: OnceLock<wgpu::RenderPipeline>,
    peel: OnceLock<wgpu::RenderPipeline>,
}

impl Gbuffer {
    /// Reads the shader.
    pub fn new(gpu: &Gpu) -> Self {
        Gbuffer {
            module: shader(gpu, "gbuffer", &gbuffer_source()),
            background: Default::default(),
            rock: Default::default(),
            pool: Default::default(),
            volume: OnceLock::new(),
            peel: OnceLock::new(),
        }
    }

    /// Compiles what a scene under whose pixels `layers` quads may lie has use for.
    pub fn compile(&self, gpu: &Gpu, scene: &Scene, layers: u32) {
        let under = scene.environment.is_some();
        self.background(gpu, under);
        if !scene.rocks.is_empty() {
            self.rock(gpu, under);
        }
        if !scene.pools.is_empty() {
            self.pool(gpu, under);
        }
        if !scene.quads.is_empty() {
            self.volume(gpu);
        }
        if layers > 1 {
            self.peel(gpu);
        }
    }

    fn background(&self, gpu: &Gpu, environment: bool) -> &wgpu::RenderPipeline {
        self.behind(gpu, &self.background, environment, "background", wgpu::CompareFunction::Always)
    }

    fn rock(&self, gpu: &Gpu, environment: bool) -> &wgpu::RenderPipeline {
        self.behind(gpu, &self.rock, environment, "opaque", wgpu::CompareFunction::Greater)
    }

    /// Drawn again where it was drawn before.
    fn pool(&self, gpu: &Gpu, environment: bool) -> &wgpu::RenderPipeline {
        self.behind(gpu, &self.pool, environment, "pool", wgpu::CompareFunction::GreaterEqual)
    }

    fn behind<'a>(
        &self,
        gpu: &Gpu,
        of: &'a [OnceLock<wgpu::RenderPipeline>; 2],
        environment: bool,
        name: &str,
        compare: wgpu::CompareFunction,
    ) -> &'a wgpu::RenderPipeline {
        of[usize::from(environment)].get_or_init(|| {
            let vertex = if name == "background" { "background_vertex" } else { "opaque_vertex" };
            let fragment = format!("{name}{}_fragment", if environment { "_environment" } else { "" });
            pipeline(gpu, &self.module, [vertex, &fragment], &[FLOATS; 2], compare)
        })
    }

    fn volume(&self, gpu: &Gpu) -> &wgpu::RenderPipeline {
        self.volume.get_or_init(|| self.water(gpu, "volume_fragment", &[FLOATS, IDS]))
    }

    fn peel(&self, gpu: &Gpu) -> &wgpu::RenderPipeline {
        self.peel.get_or_init(|| self.water(gpu, "peel_fragment", &[IDS]))
    }

    fn water(&self, gpu: &Gpu, fragment: &str, targets: &[wgpu::TextureFormat]) -> wgpu::RenderPipeline {
        let nearer = wgpu::CompareFunction::Greater;
        pipeline(gpu, &self.module, ["volume_vertex", fragment], targets, nearer)
    }

    /// Fills the targets with one sample of a window; seconds on the device, and where several submissions go
    /// on side by side on the host. A large mesh is drawn in parts, and each layer behind the nearest in one of
    /// its own; `between` is called between them, and may stop the work.
    pub fn run(&self, inputs: &Inputs, what: Redraw, between: impl FnMut() -> Result<()>) -> Result<f64> {
        let uniform =
            inputs.gpu.buffer_with("frame", bytemuck::bytes_of(inputs.frame), wgpu::BufferUsages::UNIFORM);
        let depths = inputs.targets.depth.iter().map(view).collect();
        let run = Run { pass: self, inputs, uniform, depths };
        match what {
            Redraw::All => run.all(between),
            Redraw::Pools => inputs.timer.run(inputs.gpu, "gbuffer", |encoder, span| {
                let behind = run.depths.last().expect("one at least");
                run.pools(encoder, behind, span.render(true, true));
            }),
        }
    }
}

/// One run of the pass.
struct Run<'a> {
    pass: &'a Gbuffer,
    inputs: &'a Inputs<'a>,
    uniform: wgpu::Buffer,
    depths: Vec<wgpu::TextureView>,
}

impl Run<'_> {
    fn all(&self, mut between: impl FnMut() -> Result<()>) -> Result<f64> {
        let Inputs { gpu, timer, up, targets, frame, .. } = *self.inputs;
        let clock = Instant::now();
        let clip_from_world = Mat4::from_cols_array_2d(&frame.clip_from_world);
        let parts = in_view(&up.rock, clip_from_world, Vec3::from(frame.eye_world).as_dvec3());
        // While one submission is rasterised, software Vulkan makes the triangles of the next.
        let mut before: Option<wgpu::SubmissionIndex> = None;
        for (number, parts) in parts.chunks(PARTS).enumerate() {
            let mut encoder = gpu.encoder("gbuffer");
            self.rock(&mut encoder, number == 0, parts, None);
            let submitted = gpu.queue.submit([encoder.finish()]);
            if let Some(before) = before.replace(submitted) {
                gpu.wait(before)?;
                between()?;
            }
        }
        let mut seconds = clock.elapsed().as_secs_f64();
        seconds += timer.run(gpu, "gbuffer", |encoder, span| {
            if parts.is_empty() {
                self.rock(encoder, true, &[], None);
            }
            if !up.pools.is_empty() {
                self.pools(encoder, &self.depths[0], None);
            }
            if let [nearest, .., opaque] = targets.depth.as_slice() {
                copy(encoder, nearest, opaque);
            }
            self.sheets(encoder, span);
        })?;
        for layer in 1..frame.layers {
            between()?;
            seconds += timer.run(gpu, "gbuffer", |encoder, span| self.peel(encoder, layer, span))?;
        }
        Ok(seconds)
    }

    /// Part of the rock, with the first one the background.
    fn rock(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        first: bool,
        parts: &[Range<u32>],
        span: Option<wgpu::RenderPassTimestampWrites>,
    ) {
        let Inputs { gpu, up, .. } = *self.inputs;
        let load = if first { (CLEAR, wgpu::LoadOp::Clear(0.0)) } else { (KEEP, wgpu::LoadOp::Load) };
        self.draw_opaque(encoder, "gbuffer opaque", &self.depths[0], load, span, |pass| {
            if first {
                let pipeline = self.pass.background(gpu, up.environment.is_some());
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &self.bind(pipeline, &[(0, &self.uniform)], true), &[]);
                pass.draw(0..3, 0..1);
            }
            if !parts.is_empty() {
                let pipeline = self.pass.rock(gpu, up.environment.is_some());
                pass.set_pipeline(pipeline);
                let group =
                    self.bind(pipeline, &[(0, &self.uniform), (1, &up.lights), (8, &up.vertices)], false);
                pass.set_bind_group(0, &group, &[]);
                pass.set_index_buffer(up.indices.slice(..), wgpu::IndexFormat::Uint32);
                parts.iter().for_each(|part| pass.draw_indexed(part.clone(), 0, 0..1));
            }
        });
    }

    /// The pools, where nothing of the opaque scene with this z-buffer is before them.
    fn pools(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: &wgpu::TextureView,
        span: Option<wgpu::RenderPassTimestampWrites>,
    ) {
        let Inputs { gpu, up, .. } = *self.inputs;
        let load = (KEEP, wgpu::LoadOp::Load);
        self.draw_opaque(encoder, "gbuffer pools", depth, load, span, |pass| {
            let pipeline = self.pass.pool(gpu, up.environment.is_some());
            pass.set_pipeline(pipeline);
            pass.set_index_buffer(up.indices.slice(..), wgpu::IndexFormat::Uint32);
            for (surface, indices) in &up.pools {
                let buffers = [(0, &self.uniform), (1, &up.lights), (7, surface), (8, &up.vertices)];
                pass.set_bind_group(0, &self.bind(pipeline, &buffers, false), &[]);
                pass.draw_indexed(indices.clone(), 0, 0..1);
            }
        });
    }

    fn draw_opaque(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        label: &str,
        depth_view: &wgpu::TextureView,
        load: (wgpu::LoadOp<wgpu::Color>, wgpu::LoadOp<f32>),
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites>,
        draw: impl FnOnce(&mut wgpu::RenderPass),
    ) {
        let [radiance, normal] = [&self.inputs.targets.opaque, &self.inputs.targets.normal].map(view);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: &[colour(&radiance, load.0), colour(&normal, load.0)],
            depth_stencil_attachment: Some(depth(depth_view, load.1)),
            timestamp_writes,
            ..Default::default()
        });
        self.place(&mut pass);
        draw(&mut pass);
    }

    /// The nearest sheets.
    fn sheets(&self, encoder: &mut wgpu::CommandEncoder, span: &Span) {
        let Inputs { gpu, up, targets, .. } = *self.inputs;
        let (surface, ids) = (view(&targets.surface), targets.layer(0));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("gbuffer volume"),
            color_attachments: &[colour(&surface, CLEAR), colour(&ids, CLEAR)],
            depth_stencil_attachment: Some(depth(&self.depths[0], wgpu::LoadOp::Load)),
            timestamp_writes: span.render(true, true),
            ..Default::default()
        });
        self.place(&mut pass);
        if up.quad_count > 0 {
            let pipeline = self.pass.volume(gpu);
            let group = self.bind(pipeline, &[(0, &self.uniform), (2, &up.quads)], false);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.draw(0..6, 0..up.quad_count);
        }
    }

    /// The sheets behind them; what lies behind the opaque scene is not there.
    fn peel(&self, encoder: &mut wgpu::CommandEncoder, layer: u32, span: &Span) {
        let Inputs { gpu, up, targets, .. } = *self.inputs;
        let (known, own) = ((layer as usize - 1) % 2, layer as usize % 2);
        let known_ids = targets.ids(0..layer);
        let pipeline = self.pass.peel(gpu);
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("gbuffer"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                entry(0, self.uniform.as_entire_binding()),
                entry(2, up.quads.as_entire_binding()),
                entry(3, wgpu::BindingResource::TextureView(&self.depths[known])),
                entry(4, wgpu::BindingResource::TextureView(&known_ids)),
            ],
        });
        copy(encoder, &targets.depth[2], &targets.depth[own]);
        let ids = targets.layer(layer);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("gbuffer peel"),
            color_attachments: &[colour(&ids, CLEAR)],
            depth_stencil_attachment: Some(depth(&self.depths[own], wgpu::LoadOp::Load)),
            timestamp_writes: span.render(true, true),
            ..Default::default()
        });
        self.place(&mut pass);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..6, 0..up.quad_count);
    }

    /// Buffers, and those of the environment, with its map for who looks `at_map`.
    fn bind(
        &self,
        pipeline: &wgpu::RenderPipeline,
        buffers: &[(u32, &wgpu::Buffer)],
        at_map: bool,
    ) -> wgpu::BindGroup {
        let Inputs { gpu, up, .. } = *self.inputs;
        let mut entries: Vec<_> =
            buffers.iter().map(|(binding, buffer)| entry(*binding, buffer.as_entire_binding())).collect();
        let sees = buffers.iter().all(|(binding, _)| *binding != 2);
        if let (true, Some(environment)) = (sees, &up.environment) {
            entries.push(entry(5, environment.uniform.as_entire_binding()));
            if at_map {
                entries.push(entry(6, wgpu::BindingResource::TextureView(&environment.map)));
            }
        }
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("gbuffer"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        })
    }

    /// The targets may be larger than a window at the image's edge.
    fn place(&self, pass: &mut wgpu::RenderPass) {
        let window = self.inputs.window;
        pass.set_viewport(0.0, 0.0, window.width as f32, window.height as f32, 0.0, 1.0);
    }
}

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&Default::default())
}

fn entry(binding: u32, resource: wgpu::BindingResource) -> wgpu::BindGroupEntry {
    wgpu::BindGroupEntry { binding, resource }
}

fn colour(
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    Some(wgpu::RenderPassColorAttachment { view, resolve_target: None, depth_slice: None, ops })
}

fn depth(view: &wgpu::TextureView, load: wgpu::LoadOp<f32>) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    }
}

/// Copies a whole texture to one of its size: of a depth texture a part cannot be copied.
fn copy(encoder: &mut wgpu::CommandEncoder, from: &wgpu::Texture, to: &wgpu::Texture) {
    encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), from.size());
}

fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    [vertex, fragment]: [&str; 2],
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
            buffers: &[],
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
