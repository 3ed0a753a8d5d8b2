//! From the device to the host.

use super::device::Gpu;
use crate::error::{Error, Result};

/// Maps a finished `MAP_READ` buffer and copies it out.
pub fn map(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<u8>> {
    let (send, receive) = std::sync::mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver is gone only if waiting failed, and that is reported.
        let _ = send.send(result);
    });
    gpu.run(gpu.encoder("map"))?;
    match receive.try_recv() {
        Ok(Ok(())) => {}
        other => return Err(Error::DeviceLost(format!("a buffer could not be read ({other:?})"))),
    }
    let view = buffer.get_mapped_range(..).map_err(|e| Error::DeviceLost(e.to_string()))?;
    let bytes = view.to_vec();
    drop(view);
    buffer.unmap();
    Ok(bytes)
}

/// Reads a whole storage buffer.
pub fn read_buffer(gpu: &Gpu, buffer: &wgpu::Buffer, size: u64) -> Result<Vec<u8>> {
    let staging = gpu.buffer("read-back", size, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let mut encoder = gpu.encoder("read-back");
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, size);
    gpu.run(encoder)?;
    map(gpu, &staging)
}

/// Reads a 2-D texture, tightly packed: copies pad every row to 256 bytes.
pub fn read_texture(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Vec<u8>> {
    let (width, height) = (texture.width(), texture.height());
    let texel = texture.format().block_copy_size(None).unwrap_or(4);
    let row = width * texel;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let staging = gpu.buffer(
        "read-back",
        padded as u64 * height as u64,
        wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
    );
    let mut encoder = gpu.encoder("read-back");
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &staging,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
    gpu.run(encoder)?;
    let bytes = map(gpu, &staging)?;
    Ok(bytes.chunks(padded as usize).flat_map(|line| &line[..row as usize]).copied().collect())
}
