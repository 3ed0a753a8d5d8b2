//! §3 The raster pass on the GPU: opaque geometry, then the volume's quads, in one z-buffer. Twin:
//! `src/engine/cpu/gbuffer.rs`.

mod pipeline;
mod run;

use std::sync::OnceLock;

use super::Inputs;
use super::device::Gpu;
use super::shader::resolve;
use super::targets::FLOATS;
use crate::engine::pool_surface::{STRAIGHT, WAVES};
use crate::place::{PoolWaves, StoneKind};
use crate::scene::Scene;
use crate::util::error::Result;
use pipeline::{NEARER, OpaqueVariant, PipelineState, pipeline};
use run::{Run, view};

const IDS: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
/// Returns the pass's shader with everything it imports. The sum over a pool's waves is unrolled: software
/// Vulkan reads an array at a constant index once for eight pixels, but lane by lane inside a loop.
pub fn gbuffer_source() -> String {
    let wave = |i: usize| {
        let kind = if i < STRAIGHT { "straight" } else { "ring" };
        format!("    sum += {kind}_wave(pool.waves[{i}u], at);\n")
    };
    let fine = |i: usize| format!("    sum += fine_wave(pool.waves[{i}u], at, bend);\n");
    let sum = |name: &str, more: &str, waves: String| {
        format!(
            "fn {name}(at: WavePlace{more}) -> vec3<f32> {{\n    \
             var sum = vec3<f32>(0.0);\n{waves}    return sum;\n}}\n"
        )
    };
    let sums = [
        sum("waves", "", (0..WAVES).map(wave).collect()),
        sum("fine_waves", ", bend: f32", (0..STRAIGHT).map(fine).collect()),
    ];
    resolve(&format!(
        "#import engine::gbuffer\n#import engine::gloss\n#import engine::pool\n\
         #import engine::pool_field\n{}",
        sums.concat()
    ))
}

/// The part of the targets that has to be drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Redraw {
    /// Everything.
    All,
    /// Only the pools: the targets hold the same picture with other waves.
    Pools,
}

/// The raster pass. Each pipeline is compiled for the first scene that needs it.
pub struct Gbuffer {
    module: wgpu::ShaderModule,
    // Index: environment.
    background: [OnceLock<wgpu::RenderPipeline>; 2],
    rock_surface: OnceLock<wgpu::RenderPipeline>,
    // Index: number of the variant.
    rock: [OnceLock<wgpu::RenderPipeline>; 8],
    painted: [OnceLock<wgpu::RenderPipeline>; 8],
    pool: [OnceLock<wgpu::RenderPipeline>; 4],
    pool_field: [OnceLock<wgpu::RenderPipeline>; 4],
    volume: OnceLock<wgpu::RenderPipeline>,
    peel: OnceLock<wgpu::RenderPipeline>,
    hull: OnceLock<wgpu::RenderPipeline>,
    hull_peel: OnceLock<wgpu::RenderPipeline>,
}

impl Gbuffer {
    /// Creates the shader module.
    pub fn new(gpu: &Gpu) -> Self {
        Gbuffer {
            module: gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("gbuffer"),
                source: wgpu::ShaderSource::Wgsl(gbuffer_source().into()),
            }),
            background: Default::default(),
            rock_surface: OnceLock::new(),
            rock: Default::default(),
            painted: Default::default(),
            pool: Default::default(),
            pool_field: Default::default(),
            volume: OnceLock::new(),
            peel: OnceLock::new(),
            hull: OnceLock::new(),
            hull_peel: OnceLock::new(),
        }
    }

    /// Compiles the pipelines that a scene with `layers` layers of volume quads needs.
    pub fn compile(&self, gpu: &Gpu, scene: &Scene, layers: u32) {
        let has_stones = scene.rocks.iter().any(|rock| rock.kind != StoneKind::Plain);
        let variant = OpaqueVariant::new(scene.environment.is_some(), scene.lights.len(), has_stones);
        self.background(gpu, variant);
        if !scene.rocks.is_empty() || !scene.triangles.is_empty() {
            self.rock_surface_pipeline(gpu);
            let is_painted = scene.triangles.iter().any(|own| own.painting.is_some());
            self.rock(gpu, variant, is_painted);
        }
        for pool in &scene.pools {
            self.pool(gpu, variant, pool.waves == PoolWaves::Field);
        }
        if !scene.quads.is_empty() {
            self.volume(gpu);
        }
        if layers > 1 {
            self.peel(gpu);
        }
        if !scene.shells.is_empty() {
            self.hull(gpu);
            if layers > 1 {
                self.hull_peel(gpu);
            }
        }
    }

    /// Draws the background where no rock has been drawn.
    fn background(&self, gpu: &Gpu, variant: OpaqueVariant) -> &wgpu::RenderPipeline {
        self.opaque_pipeline(
            gpu,
            &self.background,
            OpaqueVariant { one_light: false, stones: false, ..variant },
            "background",
            wgpu::CompareFunction::GreaterEqual,
        )
    }

    /// Writes the positions on the mesh of the visible rock.
    fn rock_surface_pipeline(&self, gpu: &Gpu) -> &wgpu::RenderPipeline {
        self.rock_surface.get_or_init(|| {
            pipeline(gpu, &self.module, ["rock_surface_vertex", "rock_surface_fragment"], &[FLOATS], NEARER)
        })
    }

    /// Shades the rock where it is visible, or rock and triangles with paints.
    fn rock(&self, gpu: &Gpu, variant: OpaqueVariant, is_painted: bool) -> &wgpu::RenderPipeline {
        let (pipelines, name) = if is_painted { (&self.painted, "painted") } else { (&self.rock, "opaque") };
        self.opaque_pipeline(gpu, pipelines, variant, name, wgpu::CompareFunction::Less)
    }

    /// Draws pools, with or without a field. Equal depths pass, so that a pool can be redrawn with other
    /// waves.
    fn pool(&self, gpu: &Gpu, variant: OpaqueVariant, has_field: bool) -> &wgpu::RenderPipeline {
        let (pipelines, name) =
            if has_field { (&self.pool_field, "pool_field") } else { (&self.pool, "pool") };
        let variant = OpaqueVariant { stones: false, ..variant };
        self.opaque_pipeline(gpu, pipelines, variant, name, wgpu::CompareFunction::GreaterEqual)
    }

    /// Returns the pipeline of `pipelines` for a variant, compiled at its first use. `name` begins the
    /// fragment shader's name.
    fn opaque_pipeline<'a>(
        &self,
        gpu: &Gpu,
        pipelines: &'a [OnceLock<wgpu::RenderPipeline>],
        variant: OpaqueVariant,
        name: &str,
        compare: wgpu::CompareFunction,
    ) -> &'a wgpu::RenderPipeline {
        pipelines[variant.number()].get_or_init(|| {
            let is_pool = name.starts_with("pool");
            let vertex = if is_pool { "pool_vertex" } else { "behind_vertex" };
            let fragment =
                format!("{name}{}_fragment", if variant.environment { "_environment" } else { "" });
            let state = PipelineState {
                compare,
                writes_depth: is_pool,
                one_light: variant.one_light,
                stones: variant.stones,
            };
            pipeline(gpu, &self.module, [vertex, &fragment], &[FLOATS; 2], state)
        })
    }

    /// Maps the nearest volume quad of each pixel.
    fn volume(&self, gpu: &Gpu) -> &wgpu::RenderPipeline {
        self.volume.get_or_init(|| self.water_pipeline(gpu, "volume_fragment", &[FLOATS, IDS]))
    }

    /// Finds the next volume quad behind those of the layers before.
    fn peel(&self, gpu: &Gpu) -> &wgpu::RenderPipeline {
        self.peel.get_or_init(|| self.water_pipeline(gpu, "peel_fragment", &[IDS]))
    }

    /// As [`Gbuffer::volume`], for the faces of hulls.
    fn hull(&self, gpu: &Gpu) -> &wgpu::RenderPipeline {
        let shaders = ["hull_vertex", "hull_fragment"];
        self.hull.get_or_init(|| pipeline(gpu, &self.module, shaders, &[FLOATS, IDS], NEARER))
    }

    /// As [`Gbuffer::peel`], for the faces of hulls.
    fn hull_peel(&self, gpu: &Gpu) -> &wgpu::RenderPipeline {
        let shaders = ["hull_vertex", "peel_fragment"];
        self.hull_peel.get_or_init(|| pipeline(gpu, &self.module, shaders, &[IDS], NEARER))
    }

    fn water_pipeline(
        &self,
        gpu: &Gpu,
        fragment: &str,
        targets: &[wgpu::TextureFormat],
    ) -> wgpu::RenderPipeline {
        pipeline(gpu, &self.module, ["volume_vertex", fragment], targets, NEARER)
    }

    /// Fills the targets with one sample of a window. Returns the seconds on the device; for submissions that
    /// overlap, it counts the host's seconds. A large mesh is drawn in several submissions, and each layer
    /// behind the nearest in one of its own. Calls `between` between submissions; its error stops the work.
    ///
    /// # Errors
    /// Errors of `between` and of the device: see [`Gpu::run`].
    pub fn run(&self, inputs: &Inputs, redraw: Redraw, between: impl FnMut() -> Result<()>) -> Result<f64> {
        let uniform =
            inputs.gpu.buffer_with("frame", bytemuck::bytes_of(inputs.frame), wgpu::BufferUsages::UNIFORM);
        let depths = inputs.targets.depth.iter().map(view).collect();
        let run = Run { pass: self, inputs, uniform, depths };
        match redraw {
            Redraw::All => run.all(between),
            Redraw::Pools => inputs.timer.run(inputs.gpu, "gbuffer", |encoder, span| {
                let opaque_depth = run.depths.last().expect("every window has a z-buffer");
                run.pools(encoder, opaque_depth, span.render(true, true));
            }),
        }
    }
}
