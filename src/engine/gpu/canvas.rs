//! The buffers and textures that windows are drawn on, kept from frame to frame.

use super::device::Gpu;
use super::integrate::Sums;
use super::targets::{TargetShape, Targets};
use crate::picture::PICTURE_BYTES;

/// Targets, sums and picture of one shape.
pub struct Canvas {
    /// Size, layers and z-buffers of the targets.
    pub shape: TargetShape,
    /// Targets of the raster pass.
    pub targets: Targets,
    /// Sums of the integrate pass.
    pub sums: Sums,
    /// The developed picture: `PICTURE_BYTES` per pixel.
    pub picture: wgpu::Buffer,
}

impl Canvas {
    /// Allocates a canvas.
    pub fn new(gpu: &Gpu, shape: TargetShape) -> Self {
        let [width, height] = shape.size;
        let pixels = width as u64 * height as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        Canvas {
            shape,
            targets: Targets::new(gpu, shape),
            sums: Sums::new(gpu, pixels, shape.alpha),
            picture: gpu.buffer("picture", pixels * PICTURE_BYTES, usage),
        }
    }
}

/// Returns the first item that `matches`, moved to the front, or inserts a new one there. The least recently
/// used items beyond `most` are dropped before the new one is made.
pub fn lru_get_or_insert<T>(
    items: &mut Vec<T>,
    most: usize,
    matches: impl Fn(&T) -> bool,
    new: impl FnOnce() -> T,
) -> &T {
    let item = match items.iter().position(matches) {
        Some(i) => items.remove(i),
        None => {
            items.truncate(most - 1);
            new()
        }
    };
    items.insert(0, item);
    &items[0]
}
