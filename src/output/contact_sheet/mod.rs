//! A labelled contact sheet: the pictures of a parameter sweep side by side, with its axes and values.
//!
//! One parameter fills rows like lines of text, each picture with its value below it. Two make a grid, the
//! first across and the second down; of three and more, the first goes across and a row stands for each
//! combination of the others. Pictures are drawn one at a time, so the sheet itself is all the memory taken.

mod layout;
mod paint;
mod text;

pub use paint::draw;

/// Most pixels a side of a sheet: 192 MiB if it is a square. Pictures shrink until it fits.
pub const LONGEST_SIDE: u32 = 8192;

/// A parameter and the values it takes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Axis {
    /// Name with symbol and unit, such as `σ 1/m`.
    pub name: String,
    /// Its values as text, in order.
    pub values: Vec<String>,
}

/// What a sheet shows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sheet {
    /// First line, large.
    pub title: String,
    /// Second line: what all pictures have in common.
    pub subtitle: String,
    /// From left to right.
    pub columns: Axis,
    /// From top to bottom. Without values there is one parameter only, whose pictures wrap.
    pub rows: Axis,
    /// Width and height of a picture, pixels; it is shown no larger.
    pub cell: [u32; 2],
}

/// Pixels from the top left.
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
    /// Whether the two have a pixel in common.
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
    /// As it is drawn, shortened with … where its place is short.
    pub text: String,
    /// Holds every pixel of it.
    pub rect: Rect,
    /// Height of the line, pixels.
    pub size: f32,
    /// sRGB.
    pub color: [u8; 3],
}

/// The place of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Index in the rows' values; 0 if they have none.
    pub row: usize,
    /// Index in the columns' values.
    pub column: usize,
    /// The picture is in its middle.
    pub rect: Rect,
}

/// Where everything is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// Width and height of the sheet, pixels.
    pub size: [u32; 2],
    /// Pictures, row by row.
    pub places: Vec<Place>,
    /// All text but the notes in absent pictures.
    pub labels: Vec<Label>,
    /// From start to head, x and y, one along each axis.
    pub arrows: Vec<[[u32; 2]; 2]>,
    /// Height of the text, pixels.
    text: f32,
}

impl Sheet {
    /// The sheet of a sweep: the first axis goes across, the product of the others down, the last fastest.
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
