//! §5 Light volumes on the GPU: the compute pass that fills them, and the cache that keeps them from frame to
//! frame. CPU twin: `src/engine/cpu/visibility.rs`. Reasons and units: `src/light/visibility.rs`.

mod atlas;
mod host;

use std::ops::Range;
use std::sync::Arc;

use super::binding::{bind_buffer, bind_texture, visibility as at};
use super::compute_pipeline;
use super::device::Gpu;
use super::layout::{FrameUniforms, LightVolume};
use super::shader::resolve;
use super::specialise::Source;
use super::timing::Timer;
use super::upload::Uploaded;
use crate::light::visibility::{CELLS_A_WORD, Form, LightVolumes};
use crate::trace::Lookup;
use crate::util::error::{Error, Result};
use crate::volume::{LevelAtlas, LevelSets};
use atlas::{LightVolumeAtlas, light_places, texture};
use host::fill_on_host;

/// Returns the stage's shader with everything it imports.
pub fn source() -> String {
    resolve("#import light::visibility")
}

/// Columns of cells in the first submission. The size of later ones follows the measured time, as for tiles.
const FIRST_COLUMNS: u32 = 1 << 12;
/// Largest number of columns in a submission: 65535 workgroups of 64 along one dimension of a dispatch.
const MOST_COLUMNS: u32 = 65535 * 64;
/// Target time of a submission in seconds, as for tiles of the integrate pass.
const SECONDS: f64 = 0.03;

/// Where light volumes are filled. The results differ only in the rounding of codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filling {
    /// On the device. On software Vulkan, on the host: the host sums rows of cells side by side
    /// ([`crate::light::fill`]), which a shader cannot. Sparse volumes are always filled on the device.
    #[default]
    Auto,
    /// On the device, by the compute pass.
    Device,
    /// On the host, by the CPU engine's code.
    Host,
}

/// The pass, and the light volumes of the last frame that had any.
pub struct VisibilityPass {
    /// Where light volumes are filled.
    pub filling: Filling,
    pipelines: Vec<(Variant, wgpu::ComputePipeline)>,
    columns: Option<Columns>,
    cache: Option<FilledCache>,
    /// One texel and no places, for scenes without light volumes.
    none: FilledVolumes,
}

/// Constants that a pipeline is specialised to.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Variant {
    per_cell: bool,
    form: Form,
    pyramid: bool,
    leaps: bool,
    sparse: bool,
    several: bool,
    /// Whether empty cells are filled too: trilinear lookup reads them.
    everywhere: bool,
}

/// Columns of [`CELLS_A_WORD`] cells that are filled.
struct Columns {
    levels: LevelSets,
    everywhere: bool,
    list: ColumnList,
}

/// Columns on the device.
#[derive(Clone)]
struct ColumnList {
    /// Linear indices of the columns among the levels of their volume, `array<u32>`, volume by volume.
    buffer: wgpu::Buffer,
    /// Part of the list that belongs to each volume.
    parts: Vec<Range<u32>>,
}

/// The last frame's light volumes, and the inputs they were filled from.
struct FilledCache {
    levels: LevelSets,
    everywhere: bool,
    plan: LightVolumes,
    filled: FilledVolumes,
}

/// Light volumes on the device, as the integrate pass reads them.
#[derive(Clone)]
pub struct FilledVolumes {
    /// All light volumes side by side in one `r32uint` texture: words of four codes, or the bits of optical
    /// depths.
    pub texture: wgpu::TextureView,
    /// `array<vec4<i32>>`. First one entry per quad and light: index of its first light volume in this array,
    /// patches along u and v, and whether light volumes stand at the patches' corners. Then one entry per
    /// light volume: its origin in the texture.
    pub places: wgpu::Buffer,
}

/// Inputs of the visibility pass.
#[derive(Clone, Copy)]
pub struct VisibilityInputs<'a> {
    /// The device.
    pub gpu: &'a Gpu,
    /// Times the submissions.
    pub timer: &'a Timer,
    /// The scene on the device.
    pub up: &'a Uploaded,
    /// Uniforms of the frame, with the plan's limit of cells per walk.
    pub frame: &'a FrameUniforms,
    /// The light volumes to fill.
    pub plan: &'a LightVolumes,
    /// How the view rays look up cells.
    pub lookup: Lookup,
}

impl VisibilityPass {
    /// Creates the pass. Pipelines are compiled when they are first needed.
    pub fn new(gpu: &Gpu) -> Self {
        let none = FilledVolumes {
            texture: texture(gpu, [1; 3]),
            places: gpu.buffer_with("light places", &[], wgpu::BufferUsages::STORAGE),
        };
        VisibilityPass { filling: Filling::Auto, pipelines: Vec::new(), columns: None, cache: None, none }
    }

    /// Returns what the integrate pass binds for a scene without light volumes.
    pub fn none(&self) -> FilledVolumes {
        self.none.clone()
    }

    /// Drops the light volumes of the last frame.
    pub fn forget(&mut self) {
        self.cache = None;
    }

    /// Returns the planned light volumes, and the seconds it took to fill them: 0 if they are those of the
    /// last call. The time is that of the device, or of the host where it fills them. Calls `between` after
    /// each submission or light volume with the work done so far and in total; its error stops the work.
    ///
    /// # Errors
    /// Errors of `between` and of the device (see [`Gpu::run`]); [`Error::Device`] if the device's largest
    /// texture cannot hold the light volumes.
    ///
    /// [`Error::Device`]: crate::util::error::Error::Device
    pub fn get(
        &mut self,
        inputs: &VisibilityInputs,
        between: impl FnMut(u64, u64) -> Result<()>,
    ) -> Result<(FilledVolumes, f64)> {
        let VisibilityInputs { gpu, up, plan, lookup, .. } = *inputs;
        let everywhere = lookup == Lookup::Trilinear;
        if let Some(cache) = &self.cache
            && Arc::ptr_eq(&cache.levels, &up.levels)
            && cache.everywhere == everywhere
            && cache.plan == *plan
        {
            return Ok((cache.filled.clone(), 0.0));
        }
        // The old ones are dropped first, because both might not fit.
        self.cache = None;
        let sizes = up.levels.iter().map(|levels| plan.words(LevelAtlas::new(levels).extent()));
        let sizes: Vec<[u32; 3]> = sizes.collect();
        let each: Vec<[u32; 3]> = plan.volumes.iter().map(|own| sizes[own.volume as usize]).collect();
        let atlas = LightVolumeAtlas::new(gpu, &each)?;
        let what = || format!("the texture of {} light volumes", plan.volumes.len());
        let texture = gpu.allocate(what, || texture(gpu, atlas.extent()))?;
        let filled = FilledVolumes { texture, places: light_places(gpu, plan, &atlas) };
        gpu.check()?;
        let on_host = match self.filling {
            Filling::Auto => gpu.is_software() && !up.is_sparse(),
            Filling::Device => false,
            Filling::Host => true,
        };
        let seconds = if on_host {
            fill_on_host(inputs, &atlas, &filled, between)?
        } else {
            self.fill(inputs, &atlas, &filled, between)?
        };
        let (levels, plan) = (up.levels.clone(), plan.clone());
        self.cache = Some(FilledCache { levels, everywhere, plan, filled: filled.clone() });
        Ok((filled, seconds))
    }

    /// Fills the light volumes on the device. Returns the device's seconds.
    fn fill(
        &mut self,
        inputs: &VisibilityInputs,
        atlas: &LightVolumeAtlas,
        filled: &FilledVolumes,
        mut between: impl FnMut(u64, u64) -> Result<()>,
    ) -> Result<f64> {
        let VisibilityInputs { gpu, timer, up, frame, plan, lookup } = *inputs;
        let everywhere = lookup == Lookup::Trilinear;
        let ColumnList { buffer: occupied, parts } = self.columns(gpu, &up.levels, everywhere)?;
        let pipeline = self.pipeline(
            gpu,
            Variant {
                per_cell: plan.medium.per_cell,
                form: plan.form,
                pyramid: up.levels.iter().any(|levels| levels.len() > 1),
                leaps: up.leaps(),
                sparse: up.is_sparse(),
                several: up.levels.len() > 1,
                everywhere,
            },
        );
        let frame = gpu.buffer_with("frame", bytemuck::bytes_of(frame), wgpu::BufferUsages::UNIFORM);
        let part = gpu.buffer(
            "light volume",
            size_of::<LightVolume>() as u64,
            wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        );
        let mut entries = vec![
            bind_buffer(at::FRAME, &frame),
            bind_buffer(at::LIGHT_VOLUME, &part),
            bind_texture(at::VOLUME, &up.volume),
            bind_buffer(at::COLUMNS, &occupied),
            bind_texture(at::LIGHT_VOLUMES, &filled.texture),
        ];
        // The pipeline's layout holds only the bindings that its specialised shader uses.
        if up.is_sparse() {
            entries.push(bind_texture(at::BRICKS, &up.bricks));
        }
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("visibility"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let total = plan.volumes.iter().map(|own| parts[own.volume as usize].len() as u64).sum();
        let (mut seconds, mut done, mut columns) = (0.0, 0, FIRST_COLUMNS);
        for (number, light_volume) in plan.volumes.iter().enumerate() {
            let volume = light_volume.volume as usize;
            let levels = &up.levels[volume];
            let [width, height, _] = LevelAtlas::new(levels).extent();
            let Range { start: mut first_column, end } = parts[volume];
            while first_column < end {
                let column_count = columns.min(end - first_column);
                let uniform = LightVolume {
                    direction: light_volume.direction.to_array(),
                    first_column,
                    offset: atlas.origin(number as u32),
                    column_count,
                    cells: levels[0].size.map(|n| n as i32),
                    bits: light_volume.bits,
                    base: up.origins[volume].map(|n| n as i32),
                    width,
                    height,
                    pad: [0; 3],
                };
                gpu.queue.write_buffer(&part, 0, bytemuck::bytes_of(&uniform));
                let groups = column_count.div_ceil(64);
                let took = timer.dispatch(gpu, "visibility", &pipeline, &group, groups)?;
                seconds += took;
                first_column += column_count;
                done += u64::from(column_count);
                between(done, total)?;
                let wanted = f64::from(column_count) * SECONDS / took.max(1e-6);
                columns = wanted.clamp(64.0, f64::from(columns.saturating_mul(4).min(MOST_COLUMNS))) as u32;
            }
        }
        Ok(seconds)
    }

    /// Returns the columns that are filled: those with density, or all of them if `everywhere`.
    ///
    /// # Errors
    /// [`Error::Device`] if the device's largest buffer cannot hold the indices.
    fn columns(&mut self, gpu: &Gpu, sets: &LevelSets, everywhere: bool) -> Result<ColumnList> {
        if let Some(known) = &self.columns
            && Arc::ptr_eq(&known.levels, sets)
            && known.everywhere == everywhere
        {
            return Ok(known.list.clone());
        }
        let (mut indices, mut parts): (Vec<u32>, _) = (Vec::new(), Vec::new());
        for levels in sets.iter() {
            let first = indices.len() as u32;
            let atlas = LevelAtlas::new(levels);
            let [width, height, _] = atlas.extent();
            for (level, number) in levels.iter().zip(0..) {
                let [nx, ny, nz] = level.size;
                let [_, y0, z0] = atlas.origin(number);
                let occupied = |x: u32, y: u32, z: u32| {
                    everywhere || (z..(z + CELLS_A_WORD).min(nz)).any(|z| level.cell(x, y, z).rho_code() > 0)
                };
                for z in (0..nz).step_by(CELLS_A_WORD as usize) {
                    let column = |x, y| ((z0 + z) / CELLS_A_WORD * height + y0 + y) * width + x;
                    let row = |y| (0..nx).filter(move |&x| occupied(x, y, z)).map(move |x| column(x, y));
                    indices.extend((0..ny).flat_map(row));
                }
            }
            parts.push(first..indices.len() as u32);
        }
        let (bytes, count): (&[u8], _) = (bytemuck::cast_slice(&indices), indices.len() as u32);
        if bytes.len() as u64 > gpu.device.limits().max_storage_buffer_binding_size {
            return Err(Error::device(
                format!("the light volume of {count} columns is too large for {}", gpu.name()),
                "use light.visibility=march or --engine cpu",
            ));
        }
        let buffer = gpu.buffer_with("occupied columns", bytes, wgpu::BufferUsages::STORAGE);
        let list = ColumnList { buffer, parts };
        self.columns = Some(Columns { levels: sets.clone(), everywhere, list: list.clone() });
        Ok(list)
    }

    fn pipeline(&mut self, gpu: &Gpu, variant: Variant) -> wgpu::ComputePipeline {
        if let Some((_, pipeline)) = self.pipelines.iter().find(|p| p.0 == variant) {
            return pipeline.clone();
        }
        let number = |on: bool| f64::from(u8::from(on));
        let constants = [
            ("PER_CELL", number(variant.per_cell)),
            ("CODES", number(variant.form == Form::Codes)),
            ("PYRAMID", number(variant.pyramid)),
            ("LEAPS", number(variant.leaps)),
            ("SPARSE", number(variant.sparse)),
            ("SEVERAL", number(variant.several)),
            ("EVERYWHERE", number(variant.everywhere)),
        ];
        let source = Source::read("visibility", &source());
        let pipeline = compute_pipeline(gpu, None, &source, "visibility", &constants);
        self.pipelines.push((variant, pipeline.clone()));
        pipeline
    }
}
