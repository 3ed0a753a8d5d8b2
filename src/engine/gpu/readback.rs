//! Copies from the device to the host.

use super::device::Gpu;
use super::layout::Tile;
use super::targets::Targets;
use crate::picture::Surface;
use crate::scene::Scene;
use crate::util::error::{Error, Result};

/// Maps a `MAP_READ` buffer and hands its bytes to `read`. The copies into it must have been submitted.
pub fn map<T>(gpu: &Gpu, buffer: &wgpu::Buffer, read: impl FnOnce(&[u8]) -> T) -> Result<T> {
    let (send, receive) = std::sync::mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver is dropped only if waiting failed, and that error is returned.
        let _ = send.send(result);
    });
    gpu.run(gpu.encoder("map"))?;
    match receive.try_recv() {
        Ok(Ok(())) => {}
        other => return Err(Error::DeviceLost(format!("a buffer could not be read ({other:?})"))),
    }
    let view = buffer.get_mapped_range(..).map_err(|e| Error::DeviceLost(e.to_string()))?;
    let result = read(&view);
    drop(view);
    buffer.unmap();
    Ok(result)
}

/// Bytes copied at once: a staging buffer for a whole window would be large compared with the window's
/// targets.
const STAGING_BYTES: u64 = 16 << 20;

/// Reads the rows of `area` from a storage buffer whose rows have `width` items of `item` bytes. Calls `read`
/// with each row's number in the area and its bytes.
pub fn read_rows(
    gpu: &Gpu,
    buffer: &wgpu::Buffer,
    item: u64,
    width: u32,
    area: Tile,
    mut read: impl FnMut(u32, &[u8]),
) -> Result<()> {
    let (stride, row) = (item * u64::from(width), item * u64::from(area.width));
    let most = ((STAGING_BYTES / stride) as u32).clamp(1, area.height);
    let staging = gpu.buffer(
        "read-back",
        stride * u64::from(most - 1) + row,
        wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
    );
    for first in (0..area.height).step_by(most as usize) {
        let rows = most.min(area.height - first);
        let offset = stride * u64::from(area.y + first) + item * u64::from(area.x);
        let mut encoder = gpu.encoder("read-back");
        encoder.copy_buffer_to_buffer(buffer, offset, &staging, 0, stride * u64::from(rows - 1) + row);
        gpu.run(encoder)?;
        map(gpu, &staging, |bytes| {
            let lines = bytes.chunks(stride as usize).take(rows as usize);
            lines.zip(first..).for_each(|(line, number)| read(number, &line[..row as usize]));
        })?;
    }
    Ok(())
}

/// Reads an area of a 2-D texture. The result is tightly packed; the padding of rows to 256 bytes is removed.
pub fn read_texture(gpu: &Gpu, texture: &wgpu::Texture, area: Tile) -> Result<Vec<u8>> {
    let texel = texture.format().block_copy_size(None).unwrap_or(4);
    let row = area.width * texel;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let staging = gpu.buffer(
        "read-back",
        padded as u64 * area.height as u64,
        wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
    );
    let mut encoder = gpu.encoder("read-back");
    encoder.copy_texture_to_buffer(
        wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x: area.x, y: area.y, z: 0 },
            ..texture.as_image_copy()
        },
        wgpu::TexelCopyBufferInfo {
            buffer: &staging,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded),
                rows_per_image: None,
            },
        },
        wgpu::Extent3d { width: area.width, height: area.height, depth_or_array_layers: 1 },
    );
    gpu.run(encoder)?;
    map(gpu, &staging, |bytes| {
        let rows = bytes.chunks(padded as usize).map(|line| &line[..row as usize]);
        rows.collect::<Vec<_>>().concat()
    })
}

/// Pixels of the raster pass's targets copied at once: 52 bytes each, in the staging buffers and unpacked.
const SURFACE_PIXELS: u32 = 1 << 17;

/// Copies the targets of `area` into `surface`, whose rows have `width` pixels. The area's first pixel goes
/// to index `first`.
pub fn read_surface(
    gpu: &Gpu,
    scene: &Scene,
    targets: &Targets,
    area: Tile,
    surface: &mut Surface,
    first: usize,
    width: usize,
) -> Result<()> {
    let rows = (SURFACE_PIXELS / area.width).max(1);
    for y in (0..area.height).step_by(rows as usize) {
        let band = Tile { y: area.y + y, height: rows.min(area.height - y), ..area };
        let read = |texture| read_texture(gpu, texture, band);
        let (opaque, normal, hit) = (read(&targets.opaque)?, read(&targets.normal)?, read(&targets.surface)?);
        let quads = read(&targets.quad_id)?;
        let floats = |bytes: &[u8], i: usize| -> [f32; 4] {
            bytemuck::pod_read_unaligned(&bytes[16 * i..16 * i + 16])
        };
        for i in 0..band.width as usize * band.height as usize {
            let quad: u32 = bytemuck::pod_read_unaligned(&quads[4 * i..4 * i + 4]);
            let behind = (floats(&opaque, i)[3], glam::Vec3::from_slice(&floats(&normal, i)));
            let (row, column) = (y as usize + i / band.width as usize, i % band.width as usize);
            let normal = |face, uv| scene.seen_normal(face, uv);
            surface.set(first + row * width + column, quad, floats(&hit, i), normal, behind);
        }
    }
    Ok(())
}
