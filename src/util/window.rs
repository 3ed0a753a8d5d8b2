//! Parts of an image.

use std::fmt;

/// A rectangle of the image, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Window {
    /// Returns the window of a whole image of `width` × `height` pixels.
    pub fn whole([width, height]: [u32; 2]) -> Window {
        Window { x: 0, y: 0, width, height }
    }

    /// Returns the index of an image's pixel among the window's pixels, row by row. The pixel lies in the
    /// window.
    pub fn index(&self, pixel: [u32; 2]) -> usize {
        (pixel[1] - self.y) as usize * self.width as usize + (pixel[0] - self.x) as usize
    }

    /// Returns the number of pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Returns the column after the last.
    pub fn right(&self) -> u32 {
        self.x + self.width
    }

    /// Returns the row after the last.
    pub fn bottom(&self) -> u32 {
        self.y + self.height
    }

    /// Returns the intersection of two windows, or `None` if it is empty.
    pub fn meet(&self, other: &Window) -> Option<Window> {
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let width = self.right().min(other.right()).checked_sub(x)?;
        let height = self.bottom().min(other.bottom()).checked_sub(y)?;
        (width > 0 && height > 0).then_some(Window { x, y, width, height })
    }

    /// Returns whether `other` lies inside this window.
    pub fn holds(&self, other: &Window) -> bool {
        self.meet(other) == Some(*other)
    }

    /// Returns whether the rectangle is not empty and lies inside an image of this size, for any numbers.
    pub fn fits([width, height]: [u32; 2], [x, y, w, h]: [u32; 4]) -> bool {
        let within = |first: u32, count: u32, of: u32| {
            count > 0 && u64::from(first) + u64::from(count) <= u64::from(of)
        };
        within(x, w, width) && within(y, h, height)
    }
}

/// `X,Y,W,H`, as `--crop` takes it.
impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{},{},{},{}", self.x, self.y, self.width, self.height)
    }
}
