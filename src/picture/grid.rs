//! How an image is cut into the windows that are rasterised.
//!
//! Rasterisers interpolate from a window's corner, so the last bits of a pixel depend on the window it is
//! drawn in. The windows therefore depend on the image's size alone: whatever part of it is asked for, a
//! pixel is drawn in the same window, with the same bits.

use crate::util::window::Window;

/// What limits a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Most pixels of a side: 4096 is what every device of Vulkan, Metal and Direct3D can draw.
    pub side: u32,
    /// Most pixels: 2²¹ are 33 MB of the 128 MiB a storage buffer may have.
    pub pixels: u32,
}

impl Default for Grid {
    fn default() -> Self {
        Grid { side: 4096, pixels: 1 << 21 }
    }
}

impl Grid {
    /// Columns and rows of a window of an image; those at its right and lower edge may be smaller.
    pub fn size(&self, [width, height]: [u32; 2]) -> [u32; 2] {
        let columns = width.min(self.side).max(1);
        [columns, (self.pixels / columns).clamp(1, self.side.min(height).max(1))]
    }

    /// The windows of an image that a part of it meets, row by row.
    pub fn windows(&self, image: [u32; 2], part: Window) -> Vec<Window> {
        let [columns, rows] = self.size(image);
        let first = |at: u32, step: u32| at - at % step;
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
