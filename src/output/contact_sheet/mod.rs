//! Labelled contact sheets: the pictures of a parameter sweep side by side, with its axes and values.
//!
//! The pictures of one parameter fill rows like words in a text, each with its value below it. Two parameters
//! make a grid, the first across and the second down. With three or more, the first goes across and each row
//! is a combination of the others. Pictures are drawn one at a time, so only the sheet itself takes memory.

mod layout;
mod paint;
mod text;

pub use paint::draw;

/// Longest side of a sheet, pixels; a square sheet takes 192 MiB. Pictures shrink until the sheet fits.
pub const LONGEST_SIDE: u32 = 8192;

/// A parameter and its values.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Axis {
    /// Name with symbol and unit, such as `σ 1/m`.
    pub name: String,
    /// Values as text, in order.
    pub values: Vec<String>,
}

/// Contents of a sheet.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sheet {
    /// First line, large.
    pub title: String,
    /// Second line: the properties that all pictures share.
    pub subtitle: String,
    /// Axis from left to right.
    pub columns: Axis,
    /// Axis from top to bottom. Without values there is only one parameter, and its pictures wrap.
    pub rows: Axis,
    /// Width and height of a picture, pixels. It is never enlarged.
    pub cell: [u32; 2],
}

/// A rectangle, in pixels from the top left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rect {
    /// Left edge.
    pub x: u32,
    /// Upper edge.
    pub y: u32,
    /// Width.
    pub w: u32,
    /// Height.
    pub h: u32,
}

impl Rect {
    /// Whether the two rectangles share a pixel.
    pub fn meets(&self, other: &Rect) -> bool {
        self.x < other.x + other.w
            && other.x < self.x + self.w
            && self.y < other.y + other.h
            && other.y < self.y + self.h
    }
}

/// A piece of text in its box.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// Text as drawn, shortened with … where the box is too narrow.
    pub text: String,
    /// Box that contains every pixel of the text.
    pub rect: Rect,
    /// Height of the line, pixels.
    pub size: f32,
    /// Colour, sRGB.
    pub color: [u8; 3],
}

/// The place of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Index in the rows' values; 0 if they have none.
    pub row: usize,
    /// Index in the columns' values.
    pub column: usize,
    /// Box in whose middle the picture is drawn.
    pub rect: Rect,
}

/// Positions of everything on a sheet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// Width and height of the sheet, pixels.
    pub size: [u32; 2],
    /// Places of the pictures, row by row.
    pub places: Vec<Place>,
    /// All text except the notes in absent pictures.
    pub labels: Vec<Label>,
    /// Arrows along the axes: x and y of start and head.
    pub arrows: Vec<[[u32; 2]; 2]>,
    /// Height of the text, pixels.
    text: f32,
}

impl Sheet {
    /// Makes the sheet of a sweep. The first axis goes across and the product of the others down; the last
    /// one varies fastest.
    pub fn of(title: &str, subtitle: &str, axes: &[Axis], cell: [u32; 2]) -> Sheet {
        let mut rest = axes.iter().skip(1);
        let rows = rest.next().cloned().unwrap_or_default();
        let rows = rest.fold(rows, |all, axis| Axis {
            name: format!("{} · {}", all.name, axis.name),
            values: (all.values.iter())
                .flat_map(|a| axis.values.iter().map(move |b| format!("{a} · {b}")))
                .collect(),
        });
        let columns = axes.first().cloned().unwrap_or_default();
        Sheet { title: title.into(), subtitle: subtitle.into(), columns, rows, cell }
    }
}
