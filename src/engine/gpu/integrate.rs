//! §4 and §5: the compute pass that walks the volume under each pixel. Shader:
//! `shaders/engine/integrate.wgsl`; twin: `src/engine/cpu/integrate.rs`.

use super::binding::{bind, bind_buffer, bind_texture, integrate as at};
use super::device::Gpu;
use super::layout::{Groups, WORKGROUP};
use super::shader::resolve;
use super::specialise::Source;
use super::{Inputs, compute_pipeline};
use crate::light::fibre::whole_exponent;
use crate::light::scatter::optics::ShellOptics;
use crate::light::strand::StrandParams;
use crate::light::visibility::{Form, LightVolumes};
use crate::light::{Reflection, Scattering, Visibility};
use crate::mapping::Quad;
use crate::scene::Scene;
use crate::trace::{Attenuation, Lookup, Prefilter};
use crate::util::error::Result;

/// Target time of a submission in seconds: long enough to hide its overhead, short enough for every driver's
/// watchdog (250 ms and up) and for a quick response to Ctrl-C.
const TILE_SECONDS: f64 = 0.03;
/// Pixels of the first tile with one light, when the scene's cost is unknown. If every pixel walks the cap of
/// 512 cells, with a full walk to the light from each, software Vulkan takes about a second for it.
const FIRST_TILE_PIXELS: f64 = 1024.0;
/// Largest growth of a tile relative to the one before.
const TILE_GROWTH: f64 = 4.0;

/// Pixels per workgroup.
const GROUP_PIXELS: u64 = WORKGROUP as u64 * WORKGROUP as u64;
/// Largest number of workgroups along one dimension of a dispatch.
const MOST_GROUPS: u32 = 65535;

/// Returns the stage's shader with everything it imports, for pixels with `many` sheets or at most one.
pub fn source(many: bool) -> String {
    resolve(if many { "#import engine::sheets_many" } else { "#import engine::sheets_one" })
}

/// Constants that a pipeline is specialised to: the shader's `override` constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Number of lights: 0, 1, or 2 for several.
    lights: u32,
    per_cell: bool,
    march: bool,
    cached: bool,
    codes: bool,
    cornered: bool,
    marched: bool,
    strand: bool,
    /// Whether there are volumes of Kajiya and Kay's fibres beside those of strands.
    fibres_too: bool,
    hair: bool,
    tilted: bool,
    colored: bool,
    multiple: bool,
    eroded: bool,
    billows: bool,
    tears: bool,
    pyramid: bool,
    trilinear: bool,
    lines: bool,
    leaps: bool,
    sparse: bool,
    /// Whether any volume moves while the shutter is open.
    shutter: bool,
    alpha: bool,
    several: bool,
    many: bool,
    exponent: u32,
    quads: bool,
    shells: bool,
    shell_march: bool,
    shell_kept: bool,
    shell_shadows: bool,
    /// Whether light scatters many times in any shell, whether any has a surface, and whether any has fibres.
    shell_optics: [bool; 3],
}

impl Variant {
    /// Returns the variant for a scene with at most `layers` sheets under a pixel. `light_volumes` is the
    /// plan of its light volumes, if it has one. `leaps` tells whether the levels are made for
    /// leaps, `sparse` whether cells are stored in bricks.
    pub fn of(
        scene: &Scene,
        layers: u32,
        light_volumes: Option<&LightVolumes>,
        [leaps, sparse]: [bool; 2],
    ) -> Self {
        Variant {
            lights: scene.volume_lights().len().min(2) as u32,
            per_cell: matches!(scene.trace.attenuation, Attenuation::PerCell { .. }),
            march: scene.visibility == Visibility::March && light_volumes.is_none(),
            cached: light_volumes.is_some(),
            codes: light_volumes.is_some_and(|volumes| volumes.form == Form::Codes),
            cornered: light_volumes.is_some_and(LightVolumes::cornered),
            marched: light_volumes.is_some_and(LightVolumes::marches),
            strand: scene.has_strands(),
            fibres_too: scene.has_strands() && !scene.has_strands_alone(),
            hair: scene.has_strands() && matches!(scene.reflection, Reflection::Hair(_)),
            tilted: scene.has_strands() && scene.reflection.strands().is_some_and(StrandParams::is_tilted),
            colored: scene.is_colored(),
            multiple: scene.scattering == Scattering::Multiple,
            eroded: scene.quads.iter().any(Quad::changes_matter),
            tears: scene.quads.iter().any(Quad::is_torn),
            billows: scene.quads.iter().any(|quad| quad.mist > 0.0 && quad.material.billow.strength > 0.0),
            pyramid: scene.trace.filter == Prefilter::Pyramid,
            trilinear: scene.trace.lookup == Lookup::Trilinear,
            lines: scene.keeps_lines(),
            leaps,
            sparse,
            shutter: scene.moves(),
            alpha: scene.image.alpha,
            several: scene.recipes.len() > 1,
            many: layers > 1,
            exponent: whole_exponent(scene.p).unwrap_or(0),
            quads: !scene.quads.is_empty() || scene.shells.is_empty(),
            shells: !scene.shells.is_empty(),
            shell_march: !scene.shells.is_empty() && scene.visibility == Visibility::March,
            shell_kept: false,
            shell_shadows: false,
            shell_optics: [false, false, true],
        }
    }

    /// Returns the variant of a scene in which opaque matter casts shadows on shells, or none.
    pub fn with_shell_shadows(self, shell_shadows: bool) -> Self {
        Variant { shell_shadows, ..self }
    }

    /// Returns the variant of a scene whose volumes have these optics where shells show them.
    pub fn with_shell_optics(self, scene: &Scene, optics: &[Option<ShellOptics>]) -> Self {
        let own = || scene.shells.iter().map(|shell| optics[shell.volume as usize].as_ref());
        let has_surface = |own: Option<&ShellOptics>| own.is_some_and(|optics| optics.surface.is_some());
        let shell_optics = [
            own().any(|own| own.is_some()),
            own().any(has_surface),
            own().next().is_none() || own().any(|own| !has_surface(own)),
        ];
        Variant { shell_optics, ..self }
    }

    /// Returns the variant of a scene with the visibility [`Visibility::Cached`] in which rays walk to the
    /// lights in some shells (`march`), and V is kept at the vertices of some (`kept`).
    pub fn with_shell_light(self, [march, kept]: [bool; 2]) -> Self {
        Variant { shell_march: march, shell_kept: kept, ..self }
    }
}

/// Marker in place of both numbers of cells if the device ended a walk early. Twin: `CUT` of
/// `shaders/engine/integrate.wgsl`.
pub const CUT: u32 = u32::MAX;

/// Sums over the samples, for each pixel of a window.
pub struct Sums {
    /// Linear radiance (rgb) and transmittance, `vec4<f32>`.
    pub radiance: wgpu::Buffer,
    /// Cells walked by view rays and by light rays, `vec2<u32>`.
    pub counts: wgpu::Buffer,
    /// Share of a backdrop that shows, 1 − alpha, `f32`; one item if the picture has no alpha channel.
    pub uncovered: wgpu::Buffer,
}

impl Sums {
    /// Allocates sums for `pixels` pixels, with those of alpha if `alpha`.
    pub fn new(gpu: &Gpu, pixels: u64, alpha: bool) -> Self {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        Sums {
            radiance: gpu.buffer("radiance", pixels * 16, usage),
            counts: gpu.buffer("counts", pixels * 8, usage),
            uncovered: gpu.buffer("uncovered", if alpha { pixels * 4 } else { 4 }, usage),
        }
    }
}

/// The integrate pass, specialised to one variant.
pub struct Integrate {
    pipeline: wgpu::ComputePipeline,
    /// Pipeline of the dry workgroups; the bare walk has none and skips them.
    dry: Option<wgpu::ComputePipeline>,
    group_layout: wgpu::BindGroupLayout,
    /// The variant that it is specialised to.
    pub variant: Variant,
}

/// Chooses the size of a tile by the time the last one took. The picture does not depend on it.
pub struct Tiler {
    pixels: f64,
    fixed: bool,
    /// Smallest size chosen so far.
    smallest: f64,
}

impl Tiler {
    /// Creates a tiler. With `fixed`, every tile has about that many pixels. `known` is the size that a
    /// similar frame has learned, in pixels; `lights` is the number of lights.
    pub fn new(fixed: Option<u32>, known: Option<f64>, lights: usize) -> Self {
        let first = (FIRST_TILE_PIXELS / lights.max(1) as f64).max(64.0);
        let pixels = fixed.map(f64::from).or(known).unwrap_or(first);
        Tiler { pixels, fixed: fixed.is_some(), smallest: f64::INFINITY }
    }

    /// Returns the size in pixels that suited the most expensive part of the frame; `None` if no tile was
    /// timed.
    pub fn learned(&self) -> Option<f64> {
        self.smallest.is_finite().then_some(self.smallest)
    }

    /// Returns how many of `remaining` workgroups the next submission takes.
    fn next(&self, remaining: u32) -> u32 {
        let count = (self.pixels.max(1.0) as u64).div_ceil(GROUP_PIXELS).clamp(1, MOST_GROUPS.into()) as u32;
        // Submissions of equal size beat large ones with a small rest: each waits for its last workgroup.
        remaining.div_ceil(remaining.div_ceil(count))
    }

    fn learn(&mut self, groups: u32, seconds: f64) {
        if !self.fixed {
            let pixels = f64::from(groups) * GROUP_PIXELS as f64;
            let wanted = pixels * TILE_SECONDS / seconds.max(1e-6);
            self.pixels = wanted.clamp(64.0, pixels.max(self.pixels) * TILE_GROWTH);
            self.smallest = self.smallest.min(self.pixels);
        }
    }
}

impl Integrate {
    /// Compiles the pipelines for one variant.
    pub fn new(gpu: &Gpu, variant: Variant) -> Self {
        let number = |on: bool| f64::from(u8::from(on));
        let constants = [
            ("LIGHTS", variant.lights as f64),
            ("PER_CELL", number(variant.per_cell)),
            ("MARCH", number(variant.march)),
            ("CACHED", number(variant.cached)),
            ("CODES", number(variant.codes)),
            ("CORNERED", number(variant.cornered)),
            ("MARCHED", number(variant.marched)),
            ("STRAND", number(variant.strand)),
            ("FIBRES_TOO", number(variant.fibres_too)),
            ("HAIR", number(variant.hair)),
            ("TILTED", number(variant.tilted)),
            ("COLORED", number(variant.colored)),
            ("MULTIPLE", number(variant.multiple)),
            ("ERODED", number(variant.eroded)),
            ("BILLOWS", number(variant.billows)),
            ("TEARS", number(variant.tears)),
            ("PYRAMID", number(variant.pyramid)),
            ("TRILINEAR", number(variant.trilinear)),
            ("LINES", number(variant.lines)),
            ("LEAPS", number(variant.leaps)),
            ("SPARSE", number(variant.sparse)),
            ("SHUTTER", number(variant.shutter)),
            ("ALPHA", number(variant.alpha)),
            ("SEVERAL", number(variant.several)),
            ("EXPONENT", variant.exponent as f64),
            ("QUADS", number(variant.quads)),
            ("SHELLS", number(variant.shells)),
            ("SHELL_MARCH", number(variant.shell_march)),
            ("SHELL_KEPT", number(variant.shell_kept)),
            ("SHELL_SHADOWS", number(variant.shell_shadows)),
            ("SHELL_SCATTER", number(variant.shell_optics[0])),
            ("SHELL_SURFACE", number(variant.shell_optics[1])),
            ("SHELL_FIBRES", number(variant.shell_optics[2])),
        ];
        Self::compile(gpu, variant, &source(variant.many), &constants, true)
    }

    /// Compiles the bare walk of `taki bench`: the same bindings, no light.
    pub fn bare(gpu: &Gpu, variant: Variant) -> Self {
        let number = |on: bool| f64::from(u8::from(on));
        let constants = [("LEAPS", number(variant.leaps)), ("SPARSE", number(variant.sparse))];
        Self::compile(gpu, variant, &resolve("#import engine::bare"), &constants, false)
    }

    fn compile(gpu: &Gpu, variant: Variant, source: &str, constants: &[(&str, f64)], dry: bool) -> Self {
        let source = Source::read("integrate", source);
        let group_layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("integrate"),
            entries: &bindings(),
        });
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("integrate"),
            bind_group_layouts: &[Some(&group_layout)],
            immediate_size: 0,
        });
        let pipeline = |entry_point| compute_pipeline(gpu, Some(&layout), &source, entry_point, constants);
        let dry = dry.then(|| pipeline("dry"));
        Integrate { pipeline: pipeline("integrate"), dry, group_layout, variant }
    }

    /// Adds one sample of a window's area to `sums`, some workgroups at a time. Returns the seconds on the
    /// device. Calls `between` after each submission with the pixels done so far; its error stops the work.
    ///
    /// # Errors
    /// Errors of `between` and of the device: see [`Gpu::run`].
    pub fn run(
        &self,
        inputs: &Inputs,
        sums: &Sums,
        tiler: &mut Tiler,
        mut between: impl FnMut(u64) -> Result<()>,
    ) -> Result<f64> {
        let Inputs {
            gpu,
            timer,
            up,
            targets,
            area,
            frame,
            groups,
            filled,
            shell_light,
            reflection,
            volumes,
            ..
        } = *inputs;
        let uniform = gpu.buffer_with("frame", bytemuck::bytes_of(frame), wgpu::BufferUsages::UNIFORM);
        let part = gpu.buffer(
            "part of the workgroups",
            size_of::<Groups>() as u64,
            wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        );
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        let [surface, opaque, normal] = [&targets.surface, &targets.opaque, &targets.normal].map(view);
        let quad_id = targets.ids(0..frame.layers);
        let entries = [
            bind_buffer(at::FRAME, &uniform),
            bind_buffer(at::LIGHTS, &up.lights),
            bind_buffer(at::QUADS, &up.quads),
            bind_buffer(at::GROUPS, &part),
            bind_texture(at::VOLUME, &up.volume),
            bind_texture(at::SURFACE, &surface),
            bind_texture(at::QUAD_ID, &quad_id),
            bind_texture(at::OPAQUE_RADIANCE, &opaque),
            bind_buffer(at::RADIANCE, &sums.radiance),
            bind_buffer(at::COUNTS, &sums.counts),
            bind_texture(at::LIGHT_VOLUMES, &filled.texture),
            bind_buffer(at::LIGHT_PLACES, &filled.places),
            bind_buffer(at::REFLECTION, &reflection.uniform),
            bind_texture(at::STRAND_TABLE, &reflection.table),
            bind(at::LINEAR, wgpu::BindingResource::Sampler(&reflection.sampler)),
            bind_buffer(at::PROFILES, &reflection.profiles),
            bind_buffer(at::GROUP_LIST, &groups.buffer),
            bind_texture(at::BRICKS, &up.bricks),
            bind_texture(at::OPAQUE_NORMAL, &normal),
            bind_buffer(at::UNCOVERED, &sums.uncovered),
            bind_buffer(at::VOLUMES, volumes),
            bind_texture(at::SHELLS, &up.shells.texels),
            bind_texture(at::SHELL_LIGHT, shell_light),
        ];
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("integrate"),
            layout: &self.group_layout,
            entries: &entries,
        });
        let submit = |pipeline: &wgpu::ComputePipeline, first: u32, count: u32| {
            let uniform = Groups { area, first, count, pad_a: 0, pad_b: 0 };
            gpu.queue.write_buffer(&part, 0, bytemuck::bytes_of(&uniform));
            timer.run(gpu, "integrate", |encoder, span| {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: Some("integrate"),
                    timestamp_writes: span.compute(),
                });
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &group, &[]);
                pass.dispatch_workgroups(count, 1, 1);
            })
        };
        let pixels =
            |groups: u32| (u64::from(groups) * GROUP_PIXELS).min(area.width as u64 * area.height as u64);
        let (mut seconds, mut done) = (0.0, 0);
        while let Some(dry) = &self.dry
            && done < groups.dry
        {
            let count = (groups.dry - done).min(MOST_GROUPS);
            seconds += submit(dry, groups.wet + done, count)?;
            done += count;
            between(pixels(done))?;
        }
        let mut first = 0;
        while first < groups.wet {
            let count = tiler.next(groups.wet - first);
            let took = submit(&self.pipeline, first, count)?;
            seconds += took;
            tiler.learn(count, took);
            first += count;
            between(pixels(done + first))?;
        }
        Ok(seconds)
    }
}

/// The layout of the bindings.
fn bindings() -> [wgpu::BindGroupLayoutEntry; 23] {
    use wgpu::{
        BindingType, BufferBindingType, SamplerBindingType, StorageTextureAccess, TextureFormat,
        TextureSampleType, TextureViewDimension,
    };
    let buffer = |ty| BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let uniform = buffer(BufferBindingType::Uniform);
    let texture = |sample_type, view_dimension| BindingType::Texture {
        sample_type,
        view_dimension,
        multisampled: false,
    };
    let floats = texture(TextureSampleType::Float { filterable: false }, TextureViewDimension::D2);
    let sums = buffer(BufferBindingType::Storage { read_only: false });
    let cells = |format| BindingType::StorageTexture {
        access: StorageTextureAccess::ReadOnly,
        format,
        view_dimension: TextureViewDimension::D3,
    };
    let list = buffer(BufferBindingType::Storage { read_only: true });
    let types = [
        (at::FRAME, uniform),
        (at::LIGHTS, list),
        (at::QUADS, list),
        (at::GROUPS, uniform),
        (at::VOLUME, cells(TextureFormat::Rg32Uint)),
        (at::SURFACE, floats),
        (at::QUAD_ID, texture(TextureSampleType::Uint, TextureViewDimension::D2Array)),
        (at::OPAQUE_RADIANCE, floats),
        (at::RADIANCE, sums),
        (at::COUNTS, sums),
        (at::LIGHT_VOLUMES, cells(TextureFormat::R32Uint)),
        (at::LIGHT_PLACES, list),
        (at::REFLECTION, uniform),
        (at::STRAND_TABLE, texture(TextureSampleType::Float { filterable: true }, TextureViewDimension::D3)),
        (at::LINEAR, BindingType::Sampler(SamplerBindingType::Filtering)),
        (at::PROFILES, list),
        (at::GROUP_LIST, list),
        (at::BRICKS, cells(TextureFormat::Rgba32Uint)),
        (at::OPAQUE_NORMAL, floats),
        (at::UNCOVERED, sums),
        (at::VOLUMES, uniform),
        (at::SHELLS, texture(TextureSampleType::Uint, TextureViewDimension::D2)),
        (at::SHELL_LIGHT, floats),
    ];
    types.map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    })
}
