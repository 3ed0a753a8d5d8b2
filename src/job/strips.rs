//! How a large picture is rendered in parts that fit the memory.

use crate::engine::overlap;
use crate::picture::{Grid, PIXEL_BYTES, SURFACE_BYTES, canvas, check_image};
use crate::place::{Pool, Vertex};
use crate::scene::Scene;
use crate::trace::Prefilter;
use crate::util::error::{Error, Result};
use crate::util::window::Window;
use crate::volume::{Storage, dense_bytes, expected_cells, sparse_bytes};

/// More on the host for the pyramid of bloom: a third of 12 bytes, of a picture that may be widened to whole multiples
/// of the largest level.
const BLOOM_BYTES: u64 = 12;
/// What both engines and the encoders need besides, whatever the size: staging for read-back (at most 2 × 16
/// MiB), lines of an EXR before and after compression (3 × 8 MiB), and small buffers.
const WORK_BYTES: u64 = 64 << 20;
/// What the program and the driver themselves take: libraries, compiled shaders. Lavapipe and its compiler
/// take some 150 MiB. Of a small budget at most a quarter is set aside for it.
const PROGRAM_BYTES: u64 = 256 << 20;
/// Strips are not larger than this without need: more memory would gain no time.
const STRIP_PIXELS: u64 = 1 << 23;
/// Fewer rows are not rendered at once: for every strip the whole window is drawn again.
const LEAST_ROWS: u64 = 64;

/// Cuts a part of a scene's image into strips of its full width, from the top, that can be rendered within
/// `memory` bytes together with the device's targets, the scene's volume and its rocks: whole rows of the
/// windows that are drawn (see [`Grid`]) where they fit, else even parts of one.
///
/// A pixel of a strip takes 34 bytes, with `surface_layers` 62, 12 more with bloom, which wants one strip; a pixel of the window that is drawn 84, or
/// where n quads lie over one another 88 + 4·n, and there are at most 2²¹ of those. 64 MiB more are for read-back and encoders, and a quarter of `memory`,
/// at most 256 MiB, for the program and the driver. These make strips smaller, down to an eighth of
/// `memory`; only a single row and window that do not fit are an [`Error::Memory`].
pub fn strips(scene: &Scene, window: Window, surface_layers: bool, memory: u64) -> Result<Vec<Window>> {
    memory_of(scene, window, surface_layers, memory).map(|(_, strips)| strips)
}

/// The bytes that [`strips`] counts with for the work on host and device, the program itself left out; and
/// the strips.
pub fn memory_of(
    scene: &Scene,
    window: Window,
    surface_layers: bool,
    memory: u64,
) -> Result<(u64, Vec<Window>)> {
    let image = &scene.image;
    check_image(image, memory)?;
    let water = &scene.water;
    let volume = match (&scene.volume_file, scene.storage) {
        // Read by now, and checked against the whole budget.
        (Some(_), _) => 0,
        (None, Storage::Dense) => dense_bytes(water.size, scene.trace.filter == Prefilter::Pyramid),
        // Building it, which takes more, has been checked by now.
        (None, Storage::Sparse) => sparse_bytes(water.size, expected_cells(water), 0),
    };
    let volume = u64::try_from(volume).unwrap_or(u64::MAX);
    let vertices: u64 = scene.rocks.iter().map(|rock| rock.vertex_count()).sum();
    let vertices = vertices + (scene.pools.len() * Pool::VERTICES) as u64;
    let rocks = vertices.saturating_mul(2 * (size_of::<Vertex>() as u64 + 24));
    let environment = scene.environment.as_ref().map_or(0, |e| e.map.bytes().saturating_mul(2));
    let parts = canvas(image, overlap::sheets(scene))
        .saturating_add(volume)
        .saturating_add(rocks)
        .saturating_add(environment);
    let left = memory.saturating_sub(parts).saturating_sub(WORK_BYTES + PROGRAM_BYTES.min(memory / 4));
    let blooms = image.look.bloom > 0.0;
    let pixel =
        PIXEL_BYTES + if surface_layers { SURFACE_BYTES } else { 0 } + if blooms { BLOOM_BYTES } else { 0 };
    let row = u64::from(window.width) * pixel;
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
    let most = (left / row).clamp(least, wanted.max(least)).min(u64::from(u32::MAX)) as u32;
    let strips = cut(window, drawn, most);
    let tallest = strips.iter().map(|s| u64::from(s.height)).max().unwrap_or(0);
    Ok((parts.saturating_add(WORK_BYTES + tallest * row), strips))
}

/// Refuses to make the picture of a part of an image, or of one in several `strips`, where bloom would need all of it at
/// once. An EXR has no bloom, and needs no check.
pub fn check_bloom(scene: &Scene, window: Window, strips: usize) -> Result<()> {
    let image = &scene.image;
    let bloom = image.look.bloom;
    if bloom == 0.0 {
        return Ok(());
    }
    let fix = |first: &str| format!("{first}, set image.bloom = 0, or write only .exr, which has no bloom");
    if window != Window::whole([image.width, image.height]) {
        let what = format!(
            "image.bloom = {bloom} spreads light over the whole picture, and {window} is a part of it"
        );
        return Err(Error::input(what, fix("render the whole")));
    }
    if strips > 1 {
        let what = format!(
            "image.bloom = {bloom} needs the whole picture at once, and the memory only holds {}×{} pixels in {strips} \
             strips",
            image.width, image.height
        );
        return Err(Error::input(what, fix("raise --memory, lower the size")));
    }
    Ok(())
}

/// Bytes for results of the raster pass that later frames may use again (`RenderOptions::keep_rasters`), where
/// the work itself takes `needed` of `memory` bytes. Four samples of 1280×720 pixels take 197 MiB.
pub fn spare_for_rasters(memory: u64, needed: u64) -> u64 {
    (memory.saturating_sub(needed).saturating_sub(PROGRAM_BYTES) / 2).min(256 << 20)
}

/// Strips of at most `most` rows; those that can end between windows of `drawn` rows.
fn cut(window: Window, drawn: u32, most: u32) -> Vec<Window> {
    let mut strips = Vec::new();
    let mut y = window.y;
    while y < window.bottom() {
        let left = window.bottom() - y;
        // Rows to the end of the window that is drawn here.
        let here = (drawn - y % drawn).min(left);
        let height = if most >= left {
            left
        } else if most >= here {
            here + (most - here) / drawn * drawn
        } else {
            here.div_ceil(here.div_ceil(most))
        };
        strips.push(Window { y, height, ..window });
        y += height;
    }
    strips
}
