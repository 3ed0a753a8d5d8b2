//! Rectangular parts of an image.

use std::fmt;

/// A rectangle of an image, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column, counted from the left.
    pub x: u32,
    /// First row, counted from the top.
    pub y: u32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl Window {
    /// Window that covers a whole image of `width` × `height` pixels.
    pub fn whole([width, height]: [u32; 2]) -> Window {
        Window { x: 0, y: 0, width, height }
    }

    /// Index of `pixel` (column and row in the image) among the window's pixels, row by row. The pixel must
    /// lie inside the window.
    pub fn index(&self, pixel: [u32; 2]) -> usize {
        (pixel[1] - self.y) as usize * self.width as usize + (pixel[0] - self.x) as usize
    }

    /// Iterates over the pixels, row by row.
    pub fn each(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let columns = self.x..self.right();
        (self.y..self.bottom()).flat_map(move |y| columns.clone().map(move |x| [x, y]))
    }

    /// Number of pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// First column to the right of the window.
    pub fn right(&self) -> u32 {
        self.x + self.width
    }

    /// First row below the window.
    pub fn bottom(&self) -> u32 {
        self.y + self.height
    }

    /// Intersection of two windows, or `None` if they share no pixel.
    pub fn meet(&self, other: &Window) -> Option<Window> {
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let width = self.right().min(other.right()).checked_sub(x)?;
        let height = self.bottom().min(other.bottom()).checked_sub(y)?;
        (width > 0 && height > 0).then_some(Window { x, y, width, height })
    }

    /// Smallest window around this one and `other`.
    pub fn around(&self, other: &Window) -> Window {
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let (right, bottom) = (self.right().max(other.right()), self.bottom().max(other.bottom()));
        Window { x, y, width: right - x, height: bottom - y }
    }

    /// Whether all of `other` lies inside this window.
    pub fn holds(&self, other: &Window) -> bool {
        self.meet(other) == Some(*other)
    }

    /// Whether the rectangle [x, y, width, height] has pixels and lies inside an image of `size` [width,
    /// height]. Any numbers are accepted: nothing overflows.
    pub fn fits(size: [u32; 2], [x, y, width, height]: [u32; 4]) -> bool {
        let within = |first: u32, count: u32, available: u32| {
            count > 0 && u64::from(first) + u64::from(count) <= u64::from(available)
        };
        within(x, width, size[0]) && within(y, height, size[1])
    }
}

/// Writes `X,Y,W,H`, the form that `--crop` takes.
impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{},{},{},{}", self.x, self.y, self.width, self.height)
    }
}
