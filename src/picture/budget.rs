//! Memory that a picture takes.

use super::{Grid, Image};
use crate::util::error::{Error, Result};

/// Bytes of a strip's pixel on the host: radiance 16, counts 8, picture 4; and as R, G, B bytes 3 for the
/// strip that is being encoded and 3 for the one that waits.
pub(crate) const PIXEL_BYTES: u64 = 28 + 6;

/// More with the raster pass's layers: depth 4, uv 8, quad 4, normal 12.
pub(crate) const SURFACE_BYTES: u64 = 28;

/// Most pixels of an image.
const MAX_PIXELS: u64 = 1 << 36;
/// Bytes of a pixel of the raster pass's targets under which `layers` quads may lie, at most: three of four
/// floats, the quads' numbers, depths.
pub const fn target_bytes(layers: u32) -> u64 {
    3 * 16 + 4 * layers as u64 + if layers > 1 { 3 * 4 } else { 2 * 4 }
}

/// Bytes of a pixel's sums on the device: radiance and counts.
const SUM_BYTES: u64 = 16 + 8;
/// Bytes of a pixel of the picture on the device.
pub const PICTURE_BYTES: u64 = 4;

/// Bytes on the device for a pixel of a window under which `layers` quads may lie: targets, sums and picture.
pub const fn canvas_bytes(layers: u32) -> u64 {
    target_bytes(layers) + SUM_BYTES + PICTURE_BYTES
}

/// Bytes for the window that is drawn, under which `layers` quads may lie: [`canvas_bytes`] a pixel on the
/// device. The CPU engine's targets have as many pixels, at most, and 28 bytes for each and 16 for each
/// layer.
pub fn canvas(image: &Image, layers: u32) -> u64 {
    let [columns, rows] = Grid::default().size([image.width, image.height]);
    u64::from(columns) * u64::from(rows) * canvas_bytes(layers).max(28 + 16 * u64::from(layers))
}

/// Refuses an image that cannot be rendered in any strips within `memory` bytes: one window and one row of
/// pixels must fit.
pub fn check_image(image: &Image, memory: u64) -> Result<()> {
    let [width, height] = [image.width, image.height].map(u64::from);
    let what = format!("an image of {width}×{height} pixels (image.width, height)");
    if width * height > MAX_PIXELS {
        // What one that is held whole would take.
        let need = u128::from(width) * u128::from(height) * 48;
        let fix = "a picture has at most 6.8e10 pixels, however large --memory is: lower the size";
        return Err(Error::memory(what, need, memory, fix));
    }
    let need = canvas(image, 1) + width * (PIXEL_BYTES + SURFACE_BYTES);
    if need > memory {
        return Err(Error::memory(what, need.into(), memory, "lower the size or raise --memory"));
    }
    Ok(())
}
