//! Cuts a large picture into strips that fit the memory.

use crate::engine::overlap;
use crate::picture::{Grid, LEAST_ROWS, WORK_BYTES, check_image, row_bytes};
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::util::window::Window;

/// Bytes for the program and the driver: libraries and compiled shaders. Lavapipe with its compiler takes
/// about 150 MiB. At most a quarter of the budget is set aside for this.
const PROGRAM_BYTES: u64 = 256 << 20;
/// Most pixels of a strip, unless one row of raster windows or bloom needs more. Larger strips would take
/// more memory and save no time.
const STRIP_PIXELS: u64 = 1 << 23;
/// Bytes per pixel that a lens adds: the frame of one sample beside that of their mean.
const LENS_BYTES: u64 = 32;

/// Cuts the part `window` of a scene's image into strips of its full width, from the top. Each strip can be
/// rendered within `memory` bytes, together with the device's targets, the scene's volumes, its rocks and its
/// environment. Strips end between raster windows (see [`Grid`]) where that fits; else they divide one
/// raster window evenly.
///
/// Bytes counted:
/// - per pixel of a strip 34; with `surface_layers` 32 more; with bloom 12 more, and one strip if it fits;
///   with an alpha channel 6 more, and with both 28 more; with a lens 32 more;
/// - per pixel of the raster window, at most 2²¹ pixels, 88; where n > 1 quads overlap, the larger of 88 +
///   4·n and 32 + 16·n; with an alpha channel 4 more. The CPU engine takes 60 + 48·n per pixel, but only for
///   the bands in work, about an eighth of the window;
/// - 64 MiB for read-back and encoders;
/// - a quarter of `memory`, at most 256 MiB, for the program and the driver. This share only makes strips
///   smaller; it does not cause an error.
///
/// # Errors
/// [`Error::Memory`] if 64 rows of the part (all rows, if it has fewer) do not fit with the rest.
pub fn strips(scene: &Scene, window: Window, surface_layers: bool, memory: u64) -> Result<Vec<Window>> {
    memory_of(scene, window, surface_layers, memory).map(|(_, strips)| strips)
}

/// Returns the bytes that the work takes on host and device, without the program itself, and the [`strips`].
///
/// # Errors
/// As [`strips`].
pub fn memory_of(
    scene: &Scene,
    window: Window,
    surface_layers: bool,
    memory: u64,
) -> Result<(u64, Vec<Window>)> {
    let image = &scene.image;
    check_image(image, memory)?;
    // A volume file has been read by now, and was checked against the budget then. Building takes more than
    // storing, and has been checked by now.
    let volumes = scene.recipes.iter().map(|recipe| recipe.bytes(scene.has_pyramid())).sum::<u128>();
    let volumes = u64::try_from(volumes).unwrap_or(u64::MAX);
    let parts = scene.bytes_beside_volume(overlap::sheets(scene)).saturating_add(volumes);
    let available = memory.saturating_sub(parts).saturating_sub(WORK_BYTES + PROGRAM_BYTES.min(memory / 4));
    let blooms = image.look.bloom > 0.0;
    let lens = if scene.lens.is_some() { LENS_BYTES * u64::from(window.width) } else { 0 };
    let row = row_bytes(image, window.width, surface_layers) + lens;
    let [_, drawn] = Grid::default().size([image.width, image.height]);
    let wanted = (STRIP_PIXELS / u64::from(window.width)).max(u64::from(drawn));
    let wanted = if blooms { u64::from(window.height) } else { wanted };
    let least = LEAST_ROWS.min(u64::from(window.height));
    let need = parts.saturating_add(WORK_BYTES + least * row);
    if need > memory {
        let what =
            format!("a picture of {}×{} pixels with its volume and rocks", window.width, window.height);
        return Err(Error::memory(what, need.into(), memory, "lower the sizes or raise --memory"));
    }
    let most = (available / row).clamp(least, wanted.max(least)).min(u64::from(u32::MAX)) as u32;
    let strips = cut(window, drawn, most);
    let tallest = strips.iter().map(|s| u64::from(s.height)).max().unwrap_or(0);
    Ok((parts.saturating_add(WORK_BYTES + tallest * row), strips))
}

/// Refuses bloom on a part of an image, or on an image that is rendered in several `strips`: bloom needs the
/// whole picture at once. An EXR has no bloom and needs no check.
///
/// # Errors
/// [`Error::Input`] if the scene has bloom and the picture is not rendered in one piece.
pub fn check_bloom(scene: &Scene, window: Window, strips: usize) -> Result<()> {
    let image = &scene.image;
    let bloom = image.look.bloom;
    if bloom == 0.0 {
        return Ok(());
    }
    let fix = |first: &str| format!("{first}, set image.bloom = 0, or write only .exr, which has no bloom");
    if window != Window::whole([image.width, image.height]) {
        let what = format!(
            "image.bloom = {bloom} spreads light over the whole picture, but {window} is only a part of it"
        );
        return Err(Error::input(what, fix("render the whole")));
    }
    if strips > 1 {
        let what = format!(
            "image.bloom = {bloom} needs the whole picture at once, but {}×{} pixels fit the memory only in \
             {strips} strips",
            image.width, image.height
        );
        return Err(Error::input(what, fix("raise --memory, lower the size")));
    }
    Ok(())
}

/// Bytes that may hold results of the raster pass for reuse by later frames (`RenderOptions::keep_rasters`),
/// if the work itself takes `needed` of `memory` bytes. On a GPU, four samples of 1280×720
/// pixels take 197 MiB.
pub fn spare_for_rasters(memory: u64, needed: u64) -> u64 {
    (memory.saturating_sub(needed).saturating_sub(PROGRAM_BYTES) / 2).min(256 << 20)
}

/// Bytes that reading the next picture's volumes may take meanwhile. `held` bytes are those of the volumes of
/// this picture, and the writer may still hold as many of the one before.
pub fn spare_for_next(memory: u64, needed: u64, held: u64) -> u64 {
    (memory.saturating_sub(needed).saturating_sub(PROGRAM_BYTES) / 2).saturating_sub(2 * held)
}

/// Cuts a window into strips of at most `most` rows. Where possible, strips end between raster windows,
/// which have `drawn` rows each; else they divide one raster window evenly.
fn cut(window: Window, drawn: u32, most: u32) -> Vec<Window> {
    let mut strips = Vec::new();
    let mut y = window.y;
    while y < window.bottom() {
        let remaining = window.bottom() - y;
        // Rows to the end of the current raster window.
        let to_edge = (drawn - y % drawn).min(remaining);
        let height = if most >= remaining {
            remaining
        } else if most >= to_edge {
            to_edge + (most - to_edge) / drawn * drawn
        } else {
            to_edge.div_ceil(to_edge.div_ceil(most))
        };
        strips.push(Window { y, height, ..window });
        y += height;
    }
    strips
}
