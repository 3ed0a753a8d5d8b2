//! Division of an image into the windows that are rasterised.
//!
//! Rasterisers interpolate from a window's corner, so the last bits of a pixel depend on the window it is
//! drawn in. The windows therefore depend on the image's size alone. Whatever part of the image is rendered,
//! a pixel lies in the same window and has the same bits.

use crate::util::window::Window;

/// Limits on the size of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Maximum pixels along a side. Every Vulkan, Metal and Direct3D device can draw 4096.
    pub side: u32,
    /// Maximum pixels of a window. 2²¹ pixels take 33 MB of the 128 MiB that a storage buffer may have.
    pub pixels: u32,
}

impl Default for Grid {
    fn default() -> Self {
        Grid { side: 4096, pixels: 1 << 21 }
    }
}

impl Grid {
    /// Width and height, in pixels, of a window of an image. Windows at the right and lower edges may be
    /// smaller.
    pub fn size(&self, [width, height]: [u32; 2]) -> [u32; 2] {
        let columns = width.min(self.side).max(1);
        [columns, (self.pixels / columns).clamp(1, self.side.min(height).max(1))]
    }

    /// Windows of an image that overlap the part `part`, row by row.
    pub fn windows(&self, image: [u32; 2], part: Window) -> Vec<Window> {
        let [columns, rows] = self.size(image);
        let first = |position: u32, step: u32| position - position % step;
        let mut windows = Vec::new();
        for y in (first(part.y, rows)..part.bottom()).step_by(rows as usize) {
            for x in (first(part.x, columns)..part.right()).step_by(columns as usize) {
                let (width, height) = (columns.min(image[0] - x), rows.min(image[1] - y));
                windows.push(Window { x, y, width, height });
            }
        }
        windows
    }
}
