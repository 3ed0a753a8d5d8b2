//! From the device to the host.

use super::device::Gpu;
use crate::error::{Error, Result};

/// Maps a finished `MAP_READ` buffer and hands its bytes to `read`.
pub fn map<T>(gpu: &Gpu, buffer: &wgpu::Buffer, read: impl FnOnce(&[u8]) -> T) -> Result<T> {
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
    let result = read(&view);
    drop(view);
    buffer.unmap();
    Ok(result)
}

/// Hands the first `size` bytes of a storage buffer to `read`.
pub fn read_buffer<T>(
    gpu: &Gpu,
    buffer: &wgpu::Buffer,
    size: u64,
    read: impl FnOnce(&[u8]) -> T,
) -> Result<T> {
    let staging = gpu.buffer("read-back", size, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let mut encoder = gpu.encoder("read-back");
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, size);
    gpu.run(encoder)?;
    map(gpu, &staging, read)
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
    map(gpu, &staging, |bytes| {
        let rows = bytes.chunks(padded as usize).map(|line| &line[..row as usize]);
        rows.collect::<Vec<_>>().concat()
    })
}
