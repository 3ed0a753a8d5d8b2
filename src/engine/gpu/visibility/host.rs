//! Light volumes that the host fills for the device.

use std::time::Instant;

use super::atlas::LightVolumeAtlas;
use super::{FilledVolumes, VisibilityInputs};
use crate::engine::gpu::device::Gpu;
use crate::engine::gpu::upload::SLAB_BYTES;
use crate::light::fill::{Numbers, Rows};
use crate::light::visibility::{CELLS_A_WORD, Form};
use crate::util::error::Result;
use crate::volume::LevelAtlas;

/// Fills the light volumes on the host and uploads them one by one. Returns the seconds it took. Calls
/// `between` before each light volume.
pub fn fill_on_host(
    inputs: &VisibilityInputs,
    atlas: &LightVolumeAtlas,
    filled: &FilledVolumes,
    mut between: impl FnMut(u64, u64) -> Result<()>,
) -> Result<f64> {
    let VisibilityInputs { gpu, up, plan, lookup, .. } = *inputs;
    let clock = Instant::now();
    let is_lit = |volume: u32| plan.volumes.iter().any(|own| own.volume == volume);
    let rows =
        up.levels.iter().zip(0..).map(|(levels, volume)| is_lit(volume).then(|| Rows::new(levels, lookup)));
    let rows: Vec<Option<Rows>> = rows.collect();
    let texture = filled.texture.texture();
    let mut staged = 0;
    for (number, light_volume) in plan.volumes.iter().enumerate() {
        between(number as u64, plan.volumes.len() as u64)?;
        let [x, y, z] = atlas.origin(number as u32).map(|c| c as u32);
        let volume = light_volume.volume as usize;
        let Some(rows) = &rows[volume] else { continue };
        let (levels, level_atlas) = (&up.levels[volume], LevelAtlas::new(&up.levels[volume]));
        let filled_levels = rows.fill(light_volume, plan.medium, plan.form);
        for ((level, numbers), level_number) in levels.iter().zip(filled_levels).zip(0..) {
            let [_, y_level, z_level] = level_atlas.origin(level_number);
            let z_level = match plan.form {
                Form::Codes => z_level / CELLS_A_WORD,
                Form::Depths => z_level,
            };
            let words = words(level.size, &numbers);
            upload_words(gpu, texture, [x, y + y_level, z + z_level], plan.words(level.size), &words);
            staged += size_of_val(words.as_slice());
        }
        // The queue holds a copy of all that is written to it until the next submission.
        if staged > SLAB_BYTES {
            gpu.run(gpu.encoder("upload light volumes"))?;
            staged = 0;
        }
    }
    gpu.run(gpu.encoder("upload light volumes"))?;
    Ok(clock.elapsed().as_secs_f64())
}

/// Packs values as the shader reads them. A word holds one depth, or the codes of [`CELLS_A_WORD`] cells that
/// follow one another along z.
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
