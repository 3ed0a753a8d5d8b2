//! §3 The raster pass: opaque geometry, then the volume's quads, in one z-buffer.

mod pipeline;

use std::sync::OnceLock;
use std::time::Instant;

use glam::{Mat4, Vec3};

use super::device::Gpu;
use super::shader::resolve;
use super::targets::FLOATS;
use super::tiles::{Part, in_view};
use super::timing::Span;
use super::{Inputs, Uploaded};
use crate::engine::pool_surface::{STRAIGHT, WAVES};
use crate::scene::Scene;
use crate::util::error::Result;
use pipeline::{NEARER, OpaqueVariant, PipelineState, pipeline};

const IDS: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
const CLEAR: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
const KEEP: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Load;

/// Indices of the mesh drawn in one submission: 32,768 triangles take software Vulkan 5 to 20 ms.
const INDICES: usize = 3 << 15;

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
    resolve(&format!("#import engine::gbuffer\n#import engine::pool\n{sum}"))
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
    place: OnceLock<wgpu::RenderPipeline>,
    // And without and with one light alone.
    rock: [OnceLock<wgpu::RenderPipeline>; 4],
    pool: [OnceLock<wgpu::RenderPipeline>; 4],
    volume: OnceLock<wgpu::RenderPipeline>,
    peel: OnceLock<wgpu::RenderPipeline>,
}

impl Gbuffer {
    /// Reads the shader.
    pub fn new(gpu: &Gpu) -> Self {
        Gbuffer {
            module: gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("gbuffer"),
                source: wgpu::ShaderSource::Wgsl(gbuffer_source().into()),
            }),
            background: Default::default(),
            place: OnceLock::new(),
            rock: Default::default(),
            pool: Default::default(),
            volume: OnceLock::new(),
            peel: OnceLock::new(),
        }
    }

    /// Compiles what a scene under whose pixels `layers` quads may lie has use for.
    pub fn compile(&self, gpu: &Gpu, scene: &Scene, layers: u32) {
        let under = OpaqueVariant::new(scene.environment.is_some(), scene.lights.len());
        self.background(gpu, under);
        if !scene.rocks.is_empty() {
            self.rock_surface_pipeline(gpu);
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

    /// Where nothing has been drawn.
    fn background(&self, gpu: &Gpu, under: OpaqueVariant) -> &wgpu::RenderPipeline {
        self.behind(
            gpu,
            &self.background,
            OpaqueVariant { one_light: false, ..under },
            "background",
            wgpu::CompareFunction::GreaterEqual,
        )
    }

    fn rock_surface_pipeline(&self, gpu: &Gpu) -> &wgpu::RenderPipeline {
        self.place.get_or_init(|| {
            pipeline(gpu, &self.module, ["place_vertex", "place_fragment"], &[FLOATS], NEARER)
        })
    }

    /// Where rock has been drawn.
    fn rock(&self, gpu: &Gpu, under: OpaqueVariant) -> &wgpu::RenderPipeline {
        self.behind(gpu, &self.rock, under, "opaque", wgpu::CompareFunction::Less)
    }

    /// Drawn again where it was drawn before.
    fn pool(&self, gpu: &Gpu, under: OpaqueVariant) -> &wgpu::RenderPipeline {
        self.behind(gpu, &self.pool, under, "pool", wgpu::CompareFunction::GreaterEqual)
    }

    fn behind<'a>(
        &self,
        gpu: &Gpu,
        of: &'a [OnceLock<wgpu::RenderPipeline>],
        under: OpaqueVariant,
        name: &str,
        compare: wgpu::CompareFunction,
    ) -> &'a wgpu::RenderPipeline {
        of[usize::from(under.environment) + 2 * usize::from(under.one_light)].get_or_init(|| {
            let vertex = if name == "pool" { "pool_vertex" } else { "behind_vertex" };
            let fragment = format!("{name}{}_fragment", if under.environment { "_environment" } else { "" });
            let kind = PipelineState { compare, writes_depth: name == "pool", one_light: under.one_light };
            pipeline(gpu, &self.module, [vertex, &fragment], &[FLOATS; 2], kind)
        })
    }

    fn volume(&self, gpu: &Gpu) -> &wgpu::RenderPipeline {
        self.volume.get_or_init(|| self.water(gpu, "volume_fragment", &[FLOATS, IDS]))
    }

    fn peel(&self, gpu: &Gpu) -> &wgpu::RenderPipeline {
        self.peel.get_or_init(|| self.water(gpu, "peel_fragment", &[IDS]))
    }

    fn water(&self, gpu: &Gpu, fragment: &str, targets: &[wgpu::TextureFormat]) -> wgpu::RenderPipeline {
        pipeline(gpu, &self.module, ["volume_vertex", fragment], targets, NEARER)
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
        for (number, parts) in runs(&parts).enumerate() {
            let mut encoder = gpu.encoder("gbuffer");
            self.places(&mut encoder, number == 0, parts);
            let submitted = gpu.queue.submit([encoder.finish()]);
            if let Some(before) = before.replace(submitted) {
                gpu.wait(before)?;
                between()?;
            }
        }
        let mut seconds = clock.elapsed().as_secs_f64();
        seconds += timer.run(gpu, "gbuffer", |encoder, span| {
            if parts.is_empty() {
                self.places(encoder, true, &[]);
            }
            self.behind(encoder, !parts.is_empty());
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

    /// Where part of the rock is seen. The points of the sheets come after it, in the same target.
    fn places(&self, encoder: &mut wgpu::CommandEncoder, first: bool, parts: &[&Part]) {
        let Inputs { gpu, up, targets, .. } = *self.inputs;
        let places = view(&targets.surface);
        let depth_load = if first { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("gbuffer places"),
            // What is not drawn on is not read.
            color_attachments: &[colour(&places, KEEP)],
            depth_stencil_attachment: Some(depth(&self.depths[0], depth_load)),
            ..Default::default()
        });
        self.set_viewport(&mut pass);
        if !parts.is_empty() {
            let pipeline = self.pass.rock_surface_pipeline(gpu);
            pass.set_pipeline(pipeline);
            let buffers = [(0, &self.uniform), (8, &up.positions), (9, &up.tiles)];
            let entries = buffers.map(|(binding, buffer)| entry(binding, buffer.as_entire_binding()));
            pass.set_bind_group(0, &group(gpu, pipeline, &entries), &[]);
            draw(&mut pass, up, parts.iter().copied());
        }
    }

    /// The rock that is seen, and the background where there is none.
    fn behind(&self, encoder: &mut wgpu::CommandEncoder, rock: bool) {
        let Inputs { gpu, up, targets, .. } = *self.inputs;
        let places = view(&targets.surface);
        self.draw_opaque(encoder, "gbuffer opaque", (&self.depths[0], None), KEEP, None, |pass| {
            let under = self.under();
            let pipeline = self.pass.background(gpu, under);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.bind(pipeline, &[(0, &self.uniform)], true, None), &[]);
            pass.draw(0..3, 0..1);
            if rock {
                let pipeline = self.pass.rock(gpu, under);
                pass.set_pipeline(pipeline);
                let buffers = [(0, &self.uniform), (1, &up.lights), (9, &up.tiles), (11, &up.coats)];
                pass.set_bind_group(0, &self.bind(pipeline, &buffers, false, Some(&places)), &[]);
                pass.draw(0..3, 0..1);
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
        let load = Some(wgpu::LoadOp::Load);
        self.draw_opaque(encoder, "gbuffer pools", (depth, load), KEEP, span, |pass| {
            let pipeline = self.pass.pool(gpu, self.under());
            pass.set_pipeline(pipeline);
            for (surface, parts) in &up.pools {
                let lit = [(0, &self.uniform), (1, &up.lights), (7, surface)];
                let mesh = [(8, &up.positions), (9, &up.tiles), (11, &up.coats)];
                let buffers = [lit, mesh].concat();
                pass.set_bind_group(0, &self.bind(pipeline, &buffers, false, None), &[]);
                draw(pass, up, parts.iter());
            }
        });
    }

    fn draw_opaque(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        label: &str,
        (depth_view, depth_load): (&wgpu::TextureView, Option<wgpu::LoadOp<f32>>),
        load: wgpu::LoadOp<wgpu::Color>,
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites>,
        draw: impl FnOnce(&mut wgpu::RenderPass),
    ) {
        let [radiance, normal] = [&self.inputs.targets.opaque, &self.inputs.targets.normal].map(view);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: &[colour(&radiance, load), colour(&normal, load)],
            depth_stencil_attachment: Some(match depth_load {
                Some(load) => depth(depth_view, load),
                // Read alone.
                None => wgpu::RenderPassDepthStencilAttachment {
                    view: depth_view,
                    depth_ops: None,
                    stencil_ops: None,
                },
            }),
            timestamp_writes,
            ..Default::default()
        });
        self.set_viewport(&mut pass);
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
        self.set_viewport(&mut pass);
        if up.quad_count > 0 {
            let pipeline = self.pass.volume(gpu);
            let group = self.bind(pipeline, &[(0, &self.uniform), (2, &up.quads)], false, None);
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
        let entries = [
            entry(0, self.uniform.as_entire_binding()),
            entry(2, up.quads.as_entire_binding()),
            entry(3, wgpu::BindingResource::TextureView(&self.depths[known])),
            entry(4, wgpu::BindingResource::TextureView(&known_ids)),
        ];
        let group = group(gpu, pipeline, &entries);
        copy(encoder, &targets.depth[2], &targets.depth[own]);
        let ids = targets.layer(layer);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("gbuffer peel"),
            color_attachments: &[colour(&ids, CLEAR)],
            depth_stencil_attachment: Some(depth(&self.depths[own], wgpu::LoadOp::Load)),
            timestamp_writes: span.render(true, true),
            ..Default::default()
        });
        self.set_viewport(&mut pass);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..6, 0..up.quad_count);
    }

    /// Buffers, and those of the environment, with its map for who looks `at_map`; and the places on the mesh.
    fn bind(
        &self,
        pipeline: &wgpu::RenderPipeline,
        buffers: &[(u32, &wgpu::Buffer)],
        at_map: bool,
        places: Option<&wgpu::TextureView>,
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
        entries.extend(places.map(|view| entry(10, wgpu::BindingResource::TextureView(view))));
        group(gpu, pipeline, &entries)
    }

    fn under(&self) -> OpaqueVariant {
        OpaqueVariant::new(self.inputs.up.environment.is_some(), self.inputs.frame.light_count as usize)
    }

    /// The targets may be larger than a window at the image's edge.
    fn set_viewport(&self, pass: &mut wgpu::RenderPass) {
        let window = self.inputs.window;
        pass.set_viewport(0.0, 0.0, window.width as f32, window.height as f32, 0.0, 1.0);
    }
}

/// Parts in runs of about as many triangles as a submission may have.
fn runs<'a>(parts: &'a [&'a Part]) -> impl Iterator<Item = &'a [&'a Part]> {
    let mut rest = parts;
    std::iter::from_fn(move || {
        let mut indices = 0;
        let fit = rest.iter().take_while(|part| {
            indices += part.indices.len();
            indices <= INDICES
        });
        let (run, after) = rest.split_at(fit.count());
        rest = after;
        (!run.is_empty()).then_some(run)
    })
}

/// Draws parts of the mesh.
fn draw<'a>(pass: &mut wgpu::RenderPass, up: &Uploaded, parts: impl Iterator<Item = &'a Part>) {
    pass.set_index_buffer(up.indices.slice(..), wgpu::IndexFormat::Uint32);
    parts.for_each(|part| pass.draw_indexed(part.indices.clone(), 0, part.tile..part.tile + 1));
}

fn group(gpu: &Gpu, pipeline: &wgpu::RenderPipeline, entries: &[wgpu::BindGroupEntry]) -> wgpu::BindGroup {
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("gbuffer"),
        layout: &pipeline.get_bind_group_layout(0),
        entries,
    })
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
