//! Options of a rendering.

use std::ops::Range;

use super::gpu::Filling;
use crate::picture::Grid;
use crate::util::window::Window;
use crate::volume::Leaps;

/// Options of a rendering that do not belong to the scene.
#[derive(Clone, Debug, Default)]
pub struct RenderOptions {
    /// Whether the frame also holds depth, texture coordinates, quads and normals.
    pub surface: bool,
    /// Numbers of the samples to render, as in [`sample_offset`]; `None` renders all of the scene's. The
    /// radiance is their mean. An empty range renders only the layers of `surface`.
    ///
    /// [`sample_offset`]: crate::picture::camera::sample_offset
    pub samples: Option<Range<u32>>,
    /// Approximate pixels per submission; `None` chooses them by measured time.
    pub tile_pixels: Option<u32>,
    /// Part of the image to render, in pixels; `None` renders the whole image. It must lie inside the image.
    /// The frame has the window's size and equals the same part of the whole image's frame bit for bit.
    pub window: Option<Window>,
    /// Bytes of memory, on a GPU the device's, for results of the raster pass that later frames may reuse.
    pub keep_rasters: u64,
    /// Whether rays leap over boxes of empty cells.
    pub leaps: Leaps,
    /// Whether the GPU engine fills light volumes on the device or on the host.
    pub filling: Filling,
    /// Grid by which the GPU engine cuts the image into windows. Another grid rounds the rock's radiance
    /// differently.
    pub grid: Grid,
}
