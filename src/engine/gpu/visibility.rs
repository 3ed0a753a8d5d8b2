//! §5 Light volumes: the compute pass that fills them, and what is kept of them. CPU twin:
//! `src/cpu/visibility.rs`; why and in which units: `src/visibility.rs`.

use std::sync::Arc;
use std::time::Instant;

use super::compute_pipeline;
use super::device::Gpu;
use super::layout::{FrameUniforms, LightVolume};
use super::shader::resolve;
use super::specialise::Source;
use super::timing::Timer;
use super::upload::{SLAB_BYTES, Uploaded};
use crate::light::fill::{Numbers, Rows};
use crate::light::visibility::{CELLS_A_WORD, Form, LightVolumes};
use crate::trace::Lookup;
use crate::util::error::{Error, Result};
use crate::volume::{LevelAtlas, Levels};

/// The stage's shader.
pub fn source() -> String {
    resolve("#import light::visibility")
}

/// Columns of the first submission, and most of any: its time is learned as for tiles.
const FIRST_COLUMNS: u32 = 1 << 12;
/// One dimension of a dispatch: 65535 workgroups of 64.
const MOST_COLUMNS: u32 = 65535 * 64;
/// A submission aims at this many seconds, as tiles of the integrate pass.
const SECONDS: f64 = 0.03;

/// Where light volumes are filled. They are the same but for the rounding of codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filling {
    /// On the device, but on the host where the device is the host: shaders cannot add up rows of cells side by side
    /// ([`crate::light::fill`]).
    #[default]
    Auto,
    /// By the pass.
    Device,
    /// By the CPU engine.
    Host,
}

/// The pass, and the light volumes of the last frame that had any.
pub struct VisibilityPass {
    /// Where they are filled.
    pub filling: Filling,
    pipelines: Vec<(Kind, wgpu::ComputePipeline)>,
    occupied: Option<(Levels, bool, wgpu::Buffer, u32)>,
    kept: Option<Kept>,
    none: FilledVolumes,
}

/// What the pipeline is specialised to.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Kind {
    per_cell: bool,
    form: Form,
    pyramid: bool,
    leaps: bool,
    sparse: bool,
    /// Of empty cells too.
    everywhere: bool,
}

struct Kept {
    levels: Levels,
    everywhere: bool,
    plan: LightVolumes,
    filled: FilledVolumes,
}

/// Light volumes on the device, as the integrate pass reads them.
#[derive(Clone)]
pub struct FilledVolumes {
    /// All light volumes, side by side in one `r32uint` texture: words of four codes, or the bits of optical depths.
    pub texture: wgpu::TextureView,
    /// `array<vec4<i32>>`: of every quad and light where its numbers begin, patches along u and v, whether they are
    /// cornered; then for every number where its light volume begins in the texture.
    pub places: wgpu::Buffer,
}

/// Where the light volumes lie in their texture: as many as fit along x, then y, then z.
struct LightVolumeAtlas {
    size: [u32; 3],
    along: [u32; 3],
}

impl LightVolumeAtlas {
    fn new(gpu: &Gpu, size: [u32; 3], count: u32) -> Result<Self> {
        let most = gpu.device.limits().max_texture_dimension_3d;
        // Along z first: the order of the volume's own slices.
        let mut along = [1; 3];
        let mut left = count;
        for axis in [2, 1, 0] {
            along[axis] = left.clamp(1, (most / size[axis]).max(1));
            left = left.div_ceil(along[axis]);
        }
        if left > 1 {
            let [nx, ny, nz] = size;
            return Err(Error::input(
                format!("{count} light volumes of {nx}×{ny}×{nz} cells are too many for {}", gpu.name()),
                "use light.visibility=march, or --engine cpu",
            ));
        }
        Ok(LightVolumeAtlas { size, along })
    }

    fn extent(&self) -> [u32; 3] {
        [0, 1, 2].map(|axis| self.size[axis] * self.along[axis])
    }

    fn place(&self, number: u32) -> [i32; 3] {
        let [kx, _, kz] = self.along;
        let steps = [number / kz % kx, number / kz / kx, number % kz];
        [0, 1, 2].map(|axis| (steps[axis] * self.size[axis]) as i32)
    }
}

impl VisibilityPass {
    /// Nothing is compiled before it is needed.
    pub fn new(gpu: &Gpu) -> Self {
        let none = FilledVolumes {
            texture: texture(gpu, [1; 3]),
            places: gpu.buffer_with("light places", &[], wgpu::BufferUsages::STORAGE),
        };
        VisibilityPass { filling: Filling::Auto, pipelines: Vec::new(), occupied: None, kept: None, none }
    }

    /// What the integrate pass binds where no light volumes are asked for.
    pub fn none(&self) -> FilledVolumes {
        self.none.clone()
    }

    /// Lets go of what the last frame had.
    pub fn forget(&mut self) {
        self.kept = None;
    }

    /// The light volumes that are planned, walked unless they are those of the last call; and the device's seconds
    /// for it. `between` is called with the columns of cells done and all there are, and may stop the work.
    #[expect(clippy::too_many_arguments, reason = "the device, its clock, and what the light volumes are of")]
    pub fn get(
        &mut self,
        gpu: &Gpu,
        timer: &Timer,
        up: &Uploaded,
        frame: &FrameUniforms,
        plan: LightVolumes,
        lookup: Lookup,
        between: impl FnMut(u64, u64) -> Result<()>,
    ) -> Result<(FilledVolumes, f64)> {
        let everywhere = lookup == Lookup::Trilinear;
        if let Some(kept) = &self.kept
            && Arc::ptr_eq(&kept.levels, &up.levels)
            && kept.everywhere == everywhere
            && kept.plan == plan
        {
            return Ok((kept.filled.clone(), 0.0));
        }
        // The old ones go first: both might not fit.
        self.kept = None;
        let shelf = LightVolumeAtlas::new(
            gpu,
            plan.words(LevelAtlas::new(&up.levels).extent()),
            plan.volumes.len() as u32,
        )?;
        let filled =
            FilledVolumes { texture: texture(gpu, shelf.extent()), places: places(gpu, &plan, &shelf) };
        gpu.check()?;
        let on_host = match self.filling {
            Filling::Auto => gpu.is_software() && !up.levels[0].is_sparse(),
            Filling::Device => false,
            Filling::Host => true,
        };
        let seconds = if on_host {
            fill_on_host(gpu, &up.levels, &plan, lookup, &shelf, &filled, between)?
        } else {
            self.fill(gpu, timer, up, frame, &plan, everywhere, &shelf, &filled, between)?
        };
        let kept = Kept { levels: up.levels.clone(), everywhere, plan, filled: filled.clone() };
        self.kept = Some(kept);
        Ok((filled, seconds))
    }

    /// Runs the pass; the device's seconds.
    #[expect(clippy::too_many_arguments, reason = "the device, its clock, and what the light volumes are of")]
    fn fill(
        &mut self,
        gpu: &Gpu,
        timer: &Timer,
        up: &Uploaded,
        frame: &FrameUniforms,
        plan: &LightVolumes,
        everywhere: bool,
        shelf: &LightVolumeAtlas,
        filled: &FilledVolumes,
        mut between: impl FnMut(u64, u64) -> Result<()>,
    ) -> Result<f64> {
        let (occupied, count) = self.occupied(gpu, &up.levels, everywhere);
        let pipeline = self.pipeline(
            gpu,
            Kind {
                per_cell: plan.medium.per_cell,
                form: plan.form,
                pyramid: up.levels.len() > 1,
                leaps: up.levels.leaps,
                sparse: up.levels[0].is_sparse(),
                everywhere,
            },
        );
        let frame = gpu.buffer_with("frame", bytemuck::bytes_of(frame), wgpu::BufferUsages::UNIFORM);
        let part = gpu.buffer(
            "light volume",
            size_of::<LightVolume>() as u64,
            wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        );
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let mut entries = vec![
            entry(0, frame.as_entire_binding()),
            entry(1, part.as_entire_binding()),
            entry(2, wgpu::BindingResource::TextureView(&up.volume)),
            entry(3, occupied.as_entire_binding()),
            entry(4, wgpu::BindingResource::TextureView(&filled.texture)),
        ];
        // The pipeline's layout has what is left in its shader.
        if up.levels[0].is_sparse() {
            entries.push(entry(5, wgpu::BindingResource::TextureView(&up.bricks)));
        }
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("visibility"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let total = u64::from(count) * plan.volumes.len() as u64;
        let (mut seconds, mut done, mut columns) = (0.0, 0, FIRST_COLUMNS);
        for (number, light_volume) in plan.volumes.iter().enumerate() {
            let mut first_column = 0;
            while first_column < count {
                let column_count = columns.min(count - first_column);
                let uniform = LightVolume {
                    direction: light_volume.direction.to_array(),
                    first_column,
                    offset: shelf.place(number as u32),
                    column_count,
                    bits: light_volume.bits,
                    pad: [0; 3],
                };
                gpu.queue.write_buffer(&part, 0, bytemuck::bytes_of(&uniform));
                let took = timer.run(gpu, "visibility", |encoder, span| {
                    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                        label: Some("visibility"),
                        timestamp_writes: span.compute(),
                    });
                    pass.set_pipeline(&pipeline);
                    pass.set_bind_group(0, &group, &[]);
                    pass.dispatch_workgroups(column_count.div_ceil(64), 1, 1);
                })?;
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

    /// Linear indices of the columns of cells with density, and their number.
    fn occupied(&mut self, gpu: &Gpu, levels: &Levels, everywhere: bool) -> (wgpu::Buffer, u32) {
        if let Some((old, all, buffer, count)) = &self.occupied
            && Arc::ptr_eq(old, levels)
            && *all == everywhere
        {
            return (buffer.clone(), *count);
        }
        let stack = LevelAtlas::new(levels);
        let [width, height, _] = stack.extent();
        let mut indices: Vec<u32> = Vec::new();
        for (level, number) in levels.iter().zip(0..) {
            let [nx, ny, nz] = level.size;
            let [_, y0, z0] = stack.place(number);
            let occupied = |x: u32, y: u32, z: u32| {
                everywhere || (z..(z + CELLS_A_WORD).min(nz)).any(|z| level.cell(x, y, z).rho_code() > 0)
            };
            for z in (0..nz).step_by(CELLS_A_WORD as usize) {
                let column = |x, y| ((z0 + z) / CELLS_A_WORD * height + y0 + y) * width + x;
                let row = |y| (0..nx).filter(move |&x| occupied(x, y, z)).map(move |x| column(x, y));
                indices.extend((0..ny).flat_map(row));
            }
        }
        let buffer =
            gpu.buffer_with("occupied columns", bytemuck::cast_slice(&indices), wgpu::BufferUsages::STORAGE);
        self.occupied = Some((levels.clone(), everywhere, buffer.clone(), indices.len() as u32));
        (buffer, indices.len() as u32)
    }

    fn pipeline(&mut self, gpu: &Gpu, kind: Kind) -> wgpu::ComputePipeline {
        if let Some((_, pipeline)) = self.pipelines.iter().find(|p| p.0 == kind) {
            return pipeline.clone();
        }
        let number = |on: bool| f64::from(u8::from(on));
        let constants = [
            ("PER_CELL", number(kind.per_cell)),
            ("CODES", number(kind.form == Form::Codes)),
            ("PYRAMID", number(kind.pyramid)),
            ("LEAPS", number(kind.leaps)),
            ("SPARSE", number(kind.sparse)),
            ("EVERYWHERE", number(kind.everywhere)),
        ];
        let source = Source::read("visibility", &source());
        let pipeline = compute_pipeline(gpu, None, &source, "visibility", &constants);
        self.pipelines.push((kind, pipeline.clone()));
        pipeline
    }
}

/// Fills them on the host and uploads them one by one; seconds.
fn fill_on_host(
    gpu: &Gpu,
    levels: &Levels,
    plan: &LightVolumes,
    lookup: Lookup,
    shelf: &LightVolumeAtlas,
    filled: &FilledVolumes,
    mut between: impl FnMut(u64, u64) -> Result<()>,
) -> Result<f64> {
    let clock = Instant::now();
    let (rows, stack) = (Rows::new(levels, lookup), LevelAtlas::new(levels));
    let texture = filled.texture.texture();
    let mut staged = 0;
    for (number, light_volume) in plan.volumes.iter().enumerate() {
        between(number as u64, plan.volumes.len() as u64)?;
        let [x, y, z] = shelf.place(number as u32).map(|c| c as u32);
        let of_levels = rows.fill(light_volume, plan.medium, plan.form);
        for ((level, numbers), at) in levels.iter().zip(of_levels).zip(0..) {
            let [_, y_level, z_level] = stack.place(at);
            let z_level = match plan.form {
                Form::Codes => z_level / CELLS_A_WORD,
                Form::Depths => z_level,
            };
            let words = words(level.size, &numbers);
            upload_words(gpu, texture, [x, y + y_level, z + z_level], plan.words(level.size), &words);
            staged += size_of_val(words.as_slice());
        }
        // The queue stages what it is given.
        if staged > SLAB_BYTES {
            gpu.run(gpu.encoder("upload light volumes"))?;
            staged = 0;
        }
    }
    gpu.run(gpu.encoder("upload light volumes"))?;
    Ok(clock.elapsed().as_secs_f64())
}

/// As the shader reads them: codes of cells that follow one another along z are in one word.
fn words([nx, ny, nz]: [u32; 3], numbers: &Numbers) -> Vec<u32> {
    match numbers {
        Numbers::Depths(depths) => depths.iter().map(|depth| depth.to_bits()).collect(),
        Numbers::Codes(codes) => {
            let slice = nx as usize * ny as usize;
            let mut words = vec![0; slice * nz.div_ceil(CELLS_A_WORD) as usize];
            for (z, codes) in codes.chunks(slice).enumerate() {
                let (first, shift) = (z / CELLS_A_WORD as usize * slice, 8 * (z as u32 % CELLS_A_WORD));
                for (word, &code) in words[first..].iter_mut().zip(codes) {
                    *word |= u32::from(code) << shift;
                }
            }
            words
        }
    }
}

fn upload_words(
    gpu: &Gpu,
    texture: &wgpu::Texture,
    [x, y, z]: [u32; 3],
    [nx, ny, nz]: [u32; 3],
    words: &[u32],
) {
    gpu.queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x, y, z },
            aspect: wgpu::TextureAspect::All,
        },
        bytemuck::cast_slice(words),
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(nx * 4), rows_per_image: Some(ny) },
        wgpu::Extent3d { width: nx, height: ny, depth_or_array_layers: nz },
    );
}

fn texture(gpu: &Gpu, [width, height, depth]: [u32; 3]) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("light volumes"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: depth },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: wgpu::TextureFormat::R32Uint,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

fn places(gpu: &Gpu, plan: &LightVolumes, shelf: &LightVolumeAtlas) -> wgpu::Buffer {
    let before = plan.patches.len() as u32;
    let patches = plan.patches.iter().map(|p| {
        let [nu, nv] = p.count.map(|n| n as i32);
        [(before + p.first) as i32, nu, nv, i32::from(p.cornered)]
    });
    let numbers = plan.numbers.iter().map(|&number| {
        let [x, y, z] = shelf.place(number);
        [x, y, z, 0]
    });
    let all: Vec<[i32; 4]> = patches.chain(numbers).collect();
    gpu.buffer_with("light places", bytemuck::cast_slice(&all), wgpu::BufferUsages::STORAGE)
}
