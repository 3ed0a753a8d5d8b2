//! One run of the raster pass: its submissions in order.

use std::time::Instant;

use glam::{Mat4, Vec3};

use super::Gbuffer;
use super::pipeline::OpaqueVariant;
use crate::engine::gpu::binding::{bind_buffer, bind_texture, gbuffer as at};
use crate::engine::gpu::device::Gpu;
use crate::engine::gpu::pools::UploadedPool;
use crate::engine::gpu::tiles::{Part, in_view};
use crate::engine::gpu::timing::Span;
use crate::engine::gpu::{Inputs, Uploaded};
use crate::util::error::Result;

const CLEAR: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
const KEEP: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Load;

/// Indices of the mesh drawn in one submission: 32,768 triangles take software Vulkan 5 to 20 ms.
const INDICES: usize = 3 << 15;

/// One run of the pass over a window.
pub struct Run<'a> {
    /// The pass.
    pub pass: &'a Gbuffer,
    /// Inputs of the passes.
    pub inputs: &'a Inputs<'a>,
    /// Uniforms of the sample and the window.
    pub uniform: wgpu::Buffer,
    /// Views of the targets' z-buffers.
    pub depths: Vec<wgpu::TextureView>,
}

impl Run<'_> {
    /// Draws everything. Returns the seconds it took.
    pub fn all(&self, mut between: impl FnMut() -> Result<()>) -> Result<f64> {
        let Inputs { gpu, timer, up, targets, frame, .. } = *self.inputs;
        let clock = Instant::now();
        let clip_from_world = Mat4::from_cols_array_2d(&frame.clip_from_world);
        let parts = in_view(&up.rock, clip_from_world, Vec3::from(frame.eye_world).as_dvec3());
        // Software Vulkan sets up the triangles of one submission while it rasterises the one before.
        let mut before: Option<wgpu::SubmissionIndex> = None;
        for (number, parts) in runs(&parts).enumerate() {
            let mut encoder = gpu.encoder("gbuffer");
            self.rock_surface(&mut encoder, number == 0, parts);
            let submitted = gpu.queue.submit([encoder.finish()]);
            if let Some(before) = before.replace(submitted) {
                gpu.wait(before)?;
                between()?;
            }
        }
        let mut seconds = clock.elapsed().as_secs_f64();
        seconds += timer.run(gpu, "gbuffer", |encoder, span| {
            if parts.is_empty() {
                self.rock_surface(encoder, true, &[]);
            }
            self.rock_and_background(encoder, !parts.is_empty());
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

    /// Draws parts of the rock: the positions on the mesh go to the target that later holds the points of the
    /// sheets.
    fn rock_surface(&self, encoder: &mut wgpu::CommandEncoder, first: bool, parts: &[&Part]) {
        let Inputs { gpu, up, targets, .. } = *self.inputs;
        let surface = view(&targets.surface);
        let depth_load = if first { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("gbuffer rock surface"),
            // Pixels without rock are not read, so the target need not be cleared.
            color_attachments: &[colour(&surface, KEEP)],
            depth_stencil_attachment: Some(depth(&self.depths[0], depth_load)),
            ..Default::default()
        });
        self.set_viewport(&mut pass);
        if !parts.is_empty() {
            let pipeline = self.pass.rock_surface_pipeline(gpu);
            pass.set_pipeline(pipeline);
            let buffers =
                [(at::FRAME, &self.uniform), (at::POSITIONS, &up.positions), (at::TILES, &up.tiles)];
            let entries = buffers.map(|(binding, buffer)| bind_buffer(binding, buffer));
            pass.set_bind_group(0, &group(gpu, pipeline, &entries), &[]);
            draw(&mut pass, up, parts.iter().copied());
        }
    }

    /// Shades the visible rock, and the background where there is none.
    fn rock_and_background(&self, encoder: &mut wgpu::CommandEncoder, rock: bool) {
        let Inputs { gpu, up, targets, .. } = *self.inputs;
        let surface = view(&targets.surface);
        self.draw_opaque(encoder, "gbuffer opaque", (&self.depths[0], None), KEEP, None, |pass| {
            let variant = self.variant();
            let pipeline = self.pass.background(gpu, variant);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.bind(pipeline, &[(at::FRAME, &self.uniform)], true, &[]), &[]);
            pass.draw(0..3, 0..1);
            if rock {
                let pipeline = self.pass.rock(gpu, variant, up.paints.is_some());
                pass.set_pipeline(pipeline);
                let mut buffers = vec![
                    (at::FRAME, &self.uniform),
                    (at::LIGHTS, &up.lights),
                    (at::POSITIONS, &up.positions),
                    (at::TILES, &up.tiles),
                    (at::COATS, &up.coats),
                    (at::STONES, &up.stones),
                ];
                if let Some(paints) = &up.paints {
                    buffers.extend([
                        (at::PAINTS, &paints.paints),
                        (at::CORNER_UVS, &paints.corner_uvs),
                        (at::TEXELS, &paints.texels),
                    ]);
                }
                pass.set_bind_group(
                    0,
                    &self.bind(pipeline, &buffers, false, &[(at::ROCK_SURFACE, &surface)]),
                    &[],
                );
                pass.draw(0..3, 0..1);
            }
        });
    }

    /// Draws the pools where the opaque scene of the z-buffer `depth` does not hide them.
    pub fn pools(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: &wgpu::TextureView,
        span: Option<wgpu::RenderPassTimestampWrites>,
    ) {
        let Inputs { gpu, up, .. } = *self.inputs;
        let load = Some(wgpu::LoadOp::Load);
        self.draw_opaque(encoder, "gbuffer pools", (depth, load), KEEP, span, |pass| {
            for UploadedPool { surface, field, parts } in &up.pools {
                let pipeline = self.pass.pool(gpu, self.variant(), field.is_some());
                pass.set_pipeline(pipeline);
                let lit = [(at::FRAME, &self.uniform), (at::LIGHTS, &up.lights), (at::POOL, surface)];
                let mesh = [(at::POSITIONS, &up.positions), (at::TILES, &up.tiles), (at::COATS, &up.coats)];
                let buffers = [lit, mesh].concat();
                let textures = field.iter().flatten().zip([at::POOL_SLOPES, at::POOL_CARRIED]);
                let textures: Vec<_> = textures.map(|(view, binding)| (binding, view)).collect();
                pass.set_bind_group(0, &self.bind(pipeline, &buffers, false, &textures), &[]);
                draw(pass, up, parts.iter());
            }
        });
    }

    /// Begins a pass over the targets of the opaque scene and records it with `draw`. Without a load
    /// operation the z-buffer is read-only.
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

    /// Draws the nearest sheets.
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
            let group =
                self.bind(pipeline, &[(at::FRAME, &self.uniform), (at::QUADS, &up.quads)], false, &[]);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.draw(0..6, 0..up.quad_count);
        }
        for (faces, count) in &up.shells.faces {
            let pipeline = self.pass.hull(gpu);
            let entries = [bind_buffer(at::FRAME, &self.uniform), bind_buffer(at::HULL_FACES, faces)];
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group(gpu, pipeline, &entries), &[]);
            pass.draw(0..3 * count, 0..1);
        }
    }

    /// Draws layer number `layer` of the sheets, behind those of the layers before. Sheets behind the opaque
    /// scene are hidden.
    fn peel(&self, encoder: &mut wgpu::CommandEncoder, layer: u32, span: &Span) {
        let Inputs { gpu, up, targets, .. } = *self.inputs;
        let (known, own) = ((layer as usize - 1) % 2, layer as usize % 2);
        let known_ids = targets.ids(0..layer);
        let pipeline = self.pass.peel(gpu);
        let entries = [
            bind_buffer(at::FRAME, &self.uniform),
            bind_buffer(at::QUADS, &up.quads),
            bind_texture(at::KNOWN_DEPTH, &self.depths[known]),
            bind_texture(at::KNOWN_IDS, &known_ids),
        ];
        let peel = group(gpu, pipeline, &entries);
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
        pass.set_bind_group(0, &peel, &[]);
        pass.draw(0..6, 0..up.quad_count);
        for (faces, count) in &up.shells.faces {
            let pipeline = self.pass.hull_peel(gpu);
            let entries = [
                bind_buffer(at::FRAME, &self.uniform),
                bind_buffer(at::HULL_FACES, faces),
                bind_texture(at::KNOWN_DEPTH, &self.depths[known]),
                bind_texture(at::KNOWN_IDS, &known_ids),
            ];
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group(gpu, pipeline, &entries), &[]);
            pass.draw(0..3 * count, 0..1);
        }
    }

    /// Binds buffers, the environment's uniform if the shader shades opaque geometry, its map if `with_map`,
    /// and other textures.
    fn bind(
        &self,
        pipeline: &wgpu::RenderPipeline,
        buffers: &[(u32, &wgpu::Buffer)],
        with_map: bool,
        textures: &[(u32, &wgpu::TextureView)],
    ) -> wgpu::BindGroup {
        let Inputs { gpu, up, .. } = *self.inputs;
        let mut entries: Vec<_> =
            buffers.iter().map(|(binding, buffer)| bind_buffer(*binding, buffer)).collect();
        // Only the shaders of volume quads bind the quads, and they read no environment.
        let is_opaque = buffers.iter().all(|(binding, _)| *binding != at::QUADS);
        if let (true, Some(environment)) = (is_opaque, &up.environment) {
            entries.push(bind_buffer(at::ENVIRONMENT, &environment.uniform));
            if with_map {
                entries.push(bind_texture(at::ENVIRONMENT_MAP, &environment.map));
            }
        }
        entries.extend(textures.iter().map(|(binding, view)| bind_texture(*binding, view)));
        group(gpu, pipeline, &entries)
    }

    fn variant(&self) -> OpaqueVariant {
        let Inputs { up, frame, .. } = *self.inputs;
        OpaqueVariant::new(up.environment.is_some(), frame.light_count as usize, up.has_stones)
    }

    /// Restricts drawing to the window: targets may be larger than a window at the image's edge.
    fn set_viewport(&self, pass: &mut wgpu::RenderPass) {
        let window = self.inputs.window;
        pass.set_viewport(0.0, 0.0, window.width as f32, window.height as f32, 0.0, 1.0);
    }
}

/// Splits parts into runs that hold at most [`INDICES`] indices each.
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

/// Draws parts of the opaque mesh.
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

pub fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&Default::default())
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

/// Copies a whole texture to another of its size. Part of a depth texture cannot be copied.
fn copy(encoder: &mut wgpu::CommandEncoder, from: &wgpu::Texture, to: &wgpu::Texture) {
    encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), from.size());
}
