//! Sparse volumes on the device: a texture of bricks, and a texture of the stored cells one after the other.
//! `shaders/volume/cells.wgsl` reads them.

use super::device::Gpu;
use super::upload::{SLAB_BYTES, write_layers};
use crate::util::error::{Error, Result};
use crate::volume::{BRICK, Bricks, Cell};

/// Stored cells along x and along y of their texture, as in the shader.
const ROW: usize = 1024;

/// Creates an empty 3-D texture of cells (`rg32uint`) or of bricks (`rgba32uint`).
pub fn texture(gpu: &Gpu, name: &str, format: wgpu::TextureFormat, extent: [u32; 3]) -> wgpu::Texture {
    let [width, height, depth_or_array_layers] = extent;
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(name),
        size: wgpu::Extent3d { width, height, depth_or_array_layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// Returns one texel to bind for a dense volume, which has no bricks.
pub fn none(gpu: &Gpu) -> wgpu::TextureView {
    texture(gpu, "no bricks", wgpu::TextureFormat::Rgba32Uint, [1; 3]).create_view(&Default::default())
}

/// Uploads a sparse volume. Returns the textures of its stored cells and of its bricks.
///
/// # Errors
/// [`Error::Device`] if the device's largest 3-D texture or its memory cannot hold them, and errors of
/// [`Gpu::run`].
pub fn upload(gpu: &Gpu, bricks: &Bricks) -> Result<[wgpu::TextureView; 2]> {
    let most = gpu.device.limits().max_texture_dimension_3d;
    let (grid, stored) = (bricks.grid(), bricks.stored());
    let extent = stored_extent(stored.len());
    if grid.iter().chain(&extent).any(|&n| n > most) {
        let [nx, ny, nz] = bricks.size();
        return Err(Error::device(
            format!(
                "a volume of {nx}×{ny}×{nz} cells, {} of them stored, is too large for {}",
                stored.len(),
                gpu.name()
            ),
            format!(
                "volume.nx, ny and nz are at most {} there, and the stored cells {}; \
                 use --engine cpu for more",
                most * BRICK,
                most as usize * ROW * ROW
            ),
        ));
    }
    let what = || {
        let [nx, ny, nz] = bricks.size();
        format!("a volume of {nx}×{ny}×{nz} cells, {} of them stored,", stored.len())
    };
    let [brick_texture, cell_texture] = gpu.allocate(what, || {
        let brick_texture = texture(gpu, "bricks", wgpu::TextureFormat::Rgba32Uint, grid);
        [brick_texture, texture(gpu, "stored cells", wgpu::TextureFormat::Rg32Uint, extent)]
    })?;
    let layer = grid[0] as usize * grid[1] as usize;
    let layers = (SLAB_BYTES / (layer * size_of::<[u32; 4]>())).max(1);
    for first in (0..grid[2] as usize).step_by(layers) {
        let end = (first + layers).min(grid[2] as usize);
        let texels = bricks.texels(first * layer..end * layer);
        write_layers(gpu, &brick_texture, [0, 0, first as u32], [grid[0], grid[1]], &texels)?;
    }
    let layer = extent[0] as usize * extent[1] as usize;
    let layers = SLAB_BYTES / (layer * size_of::<Cell>());
    for (slab, cells) in stored.chunks(layers * layer).enumerate() {
        let z = (slab * layers) as u32;
        let whole = cells.len() / layer * layer;
        let (cells, rest) = cells.split_at(whole);
        if whole > 0 {
            write_layers(gpu, &cell_texture, [0, 0, z], [extent[0], extent[1]], cells)?;
        }
        if !rest.is_empty() {
            let mut last = rest.to_vec();
            last.resize(layer, Cell::default());
            let z = z + (whole / layer) as u32;
            write_layers(gpu, &cell_texture, [0, 0, z], [extent[0], extent[1]], &last)?;
        }
    }
    Ok([cell_texture, brick_texture].map(|texture| texture.create_view(&Default::default())))
}

/// Returns the size of the texture that holds `count` stored cells.
fn stored_extent(count: usize) -> [u32; 3] {
    let rows = count.div_ceil(ROW).max(1);
    [ROW as u32, rows.min(ROW) as u32, rows.div_ceil(ROW) as u32]
}
