//! Memory that a picture needs.

use super::{Grid, Image};
use crate::util::error::{Error, Result};

/// Host memory per pixel of a strip, bytes: radiance 16, counts 8 and picture 4. The R, G, B bytes add 3 for
/// the strip that is being encoded and 3 for the strip that waits.
pub(crate) const PIXEL_BYTES: u64 = 28 + 6;

/// Additional host memory per pixel for the raster pass's layers, bytes: depth 8, uv 8, quad 4, normal 12.
pub(crate) const SURFACE_BYTES: u64 = 32;

/// Additional host memory per pixel for an alpha channel, bytes: alpha 4, and 2 in the encoded strips.
const ALPHA_BYTES: u64 = 6;

/// Bytes per pixel that bloom of an alpha channel adds: a copy of four floats, and a pyramid of its own.
const ALPHA_BLOOM_BYTES: u64 = 16 + BLOOM_BYTES;

/// Bytes per pixel that bloom adds on the host. Its pyramid takes a third of 12 bytes per pixel, of a
/// picture that may be widened to a whole multiple of the coarsest level; 12 bytes leave room for that.
const BLOOM_BYTES: u64 = 12;

/// Bytes that engines and encoders need at any picture size: staging buffers for read-back (at most 2 × 16
/// MiB), lines of an EXR before and after compression (3 × 8 MiB), and small buffers.
pub(crate) const WORK_BYTES: u64 = 64 << 20;

/// Least rows of a strip: every strip rasterises its whole window again, so thin strips waste time.
pub(crate) const LEAST_ROWS: u64 = 64;

/// Host memory of a row of `width` pixels, bytes, with the raster pass's layers if `surface_layers`.
pub(crate) fn row_bytes(image: &Image, width: u32, surface_layers: bool) -> u64 {
    let surface = if surface_layers { SURFACE_BYTES } else { 0 };
    let blooms = image.look.bloom > 0.0;
    let bloom = if blooms { BLOOM_BYTES } else { 0 };
    let alpha = match (image.alpha, blooms) {
        (false, _) => 0,
        (true, false) => ALPHA_BYTES,
        (true, true) => ALPHA_BYTES + ALPHA_BLOOM_BYTES,
    };
    u64::from(width) * (PIXEL_BYTES + surface + bloom + alpha)
}

/// Maximum number of pixels in an image.
const MAX_PIXELS: u64 = 1 << 36;
/// Maximum device memory of the raster pass's targets per pixel, bytes, where up to `layers` quads lie under
/// a pixel: three targets of four floats, the numbers of the quads, and depths.
pub const fn target_bytes(layers: u32) -> u64 {
    3 * 16 + 4 * layers as u64 + if layers > 1 { 3 * 4 } else { 2 * 4 }
}

/// Device memory of a pixel's sums, bytes: radiance 16 and counts 8.
const SUM_BYTES: u64 = 16 + 8;
/// Device memory of a pixel's sum of alpha, bytes.
const ALPHA_SUM_BYTES: u64 = 4;
/// Device memory per pixel of the picture, bytes.
pub const PICTURE_BYTES: u64 = 4;

/// Device memory per pixel of a window, bytes, where up to `layers` quads lie under a pixel: targets, sums
/// and picture.
pub const fn canvas_bytes(layers: u32) -> u64 {
    target_bytes(layers) + SUM_BYTES + PICTURE_BYTES
}

/// Memory of the window that is drawn, bytes, where up to `layers` quads lie under a pixel.
///
/// The GPU engine needs [`canvas_bytes`] per pixel. The targets of the CPU engine have at most as many
/// pixels, with 32 bytes per pixel and 16 per layer.
pub fn canvas(image: &Image, layers: u32) -> u64 {
    let [columns, rows] = Grid::default().size([image.width, image.height]);
    let pixel = canvas_bytes(layers).max(32 + 16 * u64::from(layers));
    u64::from(columns) * u64::from(rows) * (pixel + if image.alpha { ALPHA_SUM_BYTES } else { 0 })
}

/// Refuses an image that does not fit into `memory` bytes even when it is rendered in strips. One window and
/// one row of pixels must fit.
///
/// # Errors
/// Returns [`Error::Memory`] if the image does not fit, or if it has more than 2³⁶ pixels.
pub fn check_image(image: &Image, memory: u64) -> Result<()> {
    let [width, height] = [image.width, image.height].map(u64::from);
    let what = format!("an image of {width}×{height} pixels (image.width, height)");
    if width * height > MAX_PIXELS {
        // Memory of an image that is held whole.
        let need = u128::from(width) * u128::from(height) * 48;
        let fix = "lower the size: an image has at most 6.8e10 pixels, whatever --memory allows";
        return Err(Error::memory(what, need, memory, fix));
    }
    let need = canvas(image, 1) + width * (PIXEL_BYTES + SURFACE_BYTES);
    if need > memory {
        return Err(Error::memory(what, need.into(), memory, "lower the size or raise --memory"));
    }
    Ok(())
}
