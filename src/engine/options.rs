//! How to render.

use std::ops::Range;

use super::gpu::Filling;
use crate::picture::Grid;
use crate::util::window::Window;
use crate::volume::Leaps;

/// How to render.
#[derive(Clone, Debug, Default)]
pub struct RenderOptions {
    /// Whether to bring back depth, texture coordinates, quads and normals too.
    pub surface: bool,
    /// Only these of the scene's samples; the radiance is their mean.
    pub samples: Option<Range<u32>>,
    /// About this many pixels a submission, instead of what the clock suggests.
    pub tile_pixels: Option<u32>,
    /// Only this part of the image, which it must lie in: the frame has its size, and the same bits as this
    /// part of the whole image's frame.
    pub window: Option<Window>,
    /// Bytes on the device for results of the raster pass that later frames may use again.
    pub keep_rasters: u64,
    /// Whether rays leap over empty cells.
    pub leaps: Leaps,
    /// Where light volumes are filled.
    pub filling: Filling,
    /// How the GPU engine cuts the image; another grid rounds the rock's radiance otherwise.
    pub grid: Grid,
}
