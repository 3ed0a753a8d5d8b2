//! Sparse volumes on the device: a texture of bricks, and a texture of the stored cells one after the other.
//! `shaders/volume/cells.wgsl` reads them.

use super::device::Gpu;
use super::packing::Packing;
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

/// Sparse volumes on the device.
pub struct UploadedBricks {
    /// Textures of the stored cells and of the bricks.
    pub views: [wgpu::TextureView; 2],
    /// First cell of each volume, as the shader counts cells in the texture of bricks.
    pub origins: Vec<[u32; 3]>,
}

/// Uploads sparse volumes: their stored cells one volume after the other, each from the start of a row, and
/// their bricks side by side.
///
/// # Errors
/// [`Error::Device`] if the device's largest 3-D texture or its memory cannot hold them, and errors of
/// [`Gpu::run`].
pub fn upload(gpu: &Gpu, volumes: &[&Bricks]) -> Result<UploadedBricks> {
    let most = gpu.device.limits().max_texture_dimension_3d;
    let stored = volumes.iter().map(|bricks| bricks.stored().len()).sum::<usize>();
    // Rows of each volume, and the first of them.
    let (mut firsts, mut rows) = (Vec::new(), 0);
    for bricks in volumes {
        firsts.push(rows);
        rows += bricks.stored().len().div_ceil(ROW);
    }
    let extent = stored_extent(rows);
    let grids: Vec<[u32; 3]> = volumes.iter().map(|bricks| bricks.grid()).collect();
    let packing = Packing::smallest(&grids, most);
    let what = || match volumes {
        [only] => {
            let [nx, ny, nz] = only.size();
            format!("a volume of {nx}×{ny}×{nz} cells, {stored} of them stored,")
        }
        _ => format!("{} volumes with {stored} stored cells", volumes.len()),
    };
    let fits = extent.iter().all(|&n| n <= most) && u32::try_from(rows * ROW).is_ok();
    let Some(Packing { extent: grid, origins }) = packing.filter(|_| fits) else {
        let verb = if volumes.len() == 1 { "is" } else { "are" };
        return Err(Error::device(
            format!("{} {verb} too large for {}", what(), gpu.name()),
            format!(
                "volume.nx, ny and nz are at most {} there, and the stored cells {}; \
                 use --engine cpu for more",
                most * BRICK,
                most as usize * ROW * ROW
            ),
        ));
    };
    let [brick_texture, cell_texture] = gpu.allocate(what, || {
        let brick_texture = texture(gpu, "bricks", wgpu::TextureFormat::Rgba32Uint, grid);
        [brick_texture, texture(gpu, "stored cells", wgpu::TextureFormat::Rg32Uint, extent)]
    })?;
    for ((bricks, [x, y, z]), row) in volumes.iter().zip(&origins).zip(&firsts) {
        let [width, height, depth] = bricks.grid();
        let layer = width as usize * height as usize;
        let layers = (SLAB_BYTES / (layer * size_of::<[u32; 4]>())).max(1);
        for first in (0..depth as usize).step_by(layers) {
            let end = (first + layers).min(depth as usize);
            let texels = bricks.texels(first * layer..end * layer, (row * ROW) as u32);
            write_layers(gpu, &brick_texture, [*x, *y, z + first as u32], [width, height], &texels)?;
        }
        upload_cells(gpu, &cell_texture, extent[1] as usize, *row, bricks.stored())?;
    }
    let views = [cell_texture, brick_texture].map(|texture| texture.create_view(&Default::default()));
    Ok(UploadedBricks { views, origins: origins.iter().map(|at| at.map(|n| n * BRICK)).collect() })
}

/// Writes stored cells into their texture of `height` rows a layer, from row `row` on.
fn upload_cells(
    gpu: &Gpu,
    texture: &wgpu::Texture,
    height: usize,
    mut row: usize,
    mut cells: &[Cell],
) -> Result<()> {
    while !cells.is_empty() {
        let (y, z) = (row % height, row / height);
        let whole = if y == 0 { cells.len() / (height * ROW) } else { 0 };
        let rows = match whole {
            // Whole layers go together, others as far as their layer goes.
            0 => (height - y).min(cells.len().div_ceil(ROW)),
            _ => height * whole.min((SLAB_BYTES / (height * ROW * size_of::<Cell>())).max(1)),
        };
        let (own, rest) = cells.split_at((rows * ROW).min(cells.len()));
        let size = [ROW as u32, rows.min(height) as u32];
        let origin = [0, y as u32, z as u32];
        if own.len() == rows * ROW {
            write_layers(gpu, texture, origin, size, own)?;
        } else {
            let mut last = own.to_vec();
            last.resize(rows * ROW, Cell::default());
            write_layers(gpu, texture, origin, size, &last)?;
        }
        (cells, row) = (rest, row + rows);
    }
    Ok(())
}

/// Returns the size of the texture that holds `rows` rows of stored cells.
fn stored_extent(rows: usize) -> [u32; 3] {
    let rows = rows.max(1);
    [ROW as u32, rows.min(ROW) as u32, rows.div_ceil(ROW) as u32]
}
