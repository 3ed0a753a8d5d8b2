//! Layout of a sheet.

use super::text::Fonts;
use super::{LONGEST_SIDE, Label, Layout, Place, Rect, Sheet};
use crate::util::error::{Error, Result};

/// Shortest side to which a picture is shrunk, pixels. A value of four digits still fits above it.
const SMALLEST_CELL: u32 = 36;

/// Ratio of width to height at which a wrapped row of pictures aims.
const ASPECT: f64 = 1.6;

/// Largest number of pictures of one parameter in a single row.
const ONE_ROW: usize = 6;

const BRIGHT: [u8; 3] = [222, 224, 228];
const QUIET: [u8; 3] = [160, 164, 171];

impl Sheet {
    /// Lays out the sheet. Pictures keep their size if no side of the sheet is then longer than
    /// [`LONGEST_SIDE`]; otherwise they shrink as far as necessary.
    ///
    /// # Errors
    /// [`Error::Input`] (exit 65) where pictures would have to be smaller than 36 pixels, or have no pixels.
    pub fn layout(&self) -> Result<Layout> {
        let [columns, rows] = [&self.columns, &self.rows].map(|axis| axis.values.len().max(1));
        let shortest = self.cell[0].min(self.cell[1]);
        if shortest == 0 {
            return Err(Error::input("a sheet of pictures without pixels", "give them a size"));
        }
        let longest = self.cell[0].max(self.cell[1]);
        let fonts = Fonts::new()?;
        // Sizes follow from the longer side, so that a picture keeps its shape to the pixel.
        let cell = |side: u32| {
            self.cell
                .map(|full| ((full as u64 * side as u64 + longest as u64 / 2) / longest as u64).max(1) as u32)
        };
        let fits = |side: u32| {
            let layout = self.arrange(&fonts, cell(side));
            layout.size.iter().all(|s| *s <= LONGEST_SIDE).then_some(layout)
        };
        // Far too many pictures are refused before their places are computed.
        let smallest =
            longest.min(SMALLEST_CELL.max(SMALLEST_CELL.saturating_mul(longest / shortest).min(512)));
        let most = (LONGEST_SIDE / SMALLEST_CELL.min(shortest)) as usize;
        let countable = columns.checked_mul(rows).is_some_and(|n| n <= most.saturating_mul(most));
        let small = if countable { fits(smallest) } else { None };
        let Some(small) = small else {
            return Err(Error::input(
                format!("{columns} x {rows} pictures do not fit on a sheet of {LONGEST_SIDE} pixels a side"),
                "sweep fewer values, or make several sheets",
            ));
        };
        if let Some(layout) = fits(longest.min(LONGEST_SIDE)) {
            return Ok(layout);
        }
        let (mut low, mut high, mut best) = (smallest, longest.min(LONGEST_SIDE), small);
        while high - low > 1 {
            let middle = low.midpoint(high);
            match fits(middle) {
                Some(layout) => (low, best) = (middle, layout),
                None => high = middle,
            }
        }
        Ok(best)
    }

    /// Returns the layout for pictures of this size.
    fn arrange(&self, fonts: &Fonts, [w, h]: [u32; 2]) -> Layout {
        // Text grows with the pictures, because a large sheet is viewed from further away.
        let text = (6.0 + 0.075 * w.min(h) as f32).clamp(14.0, 34.0).round();
        let em = text as u32;
        let (margin, gap) = (2 * em, (em / 2).max(6));
        let line = fonts.line(text);
        let wrapped = self.rows.values.is_empty();
        let count = self.columns.values.len().max(1);
        let caption = if wrapped && !self.columns.values.is_empty() { line + gap / 2 } else { 0 };
        // A row label needs a whole line even beside a picture that is lower than one.
        let slot = if wrapped { h } else { h.max(line) };
        let pitch = [w + gap, slot + caption + gap + if caption > 0 { gap } else { 0 }];
        let across = if wrapped { wrap(count, pitch) } else { count };
        let down = if wrapped { count.div_ceil(across) } else { self.rows.values.len() };

        // Left of the grid are an arrow and the values of the rows.
        let values = self.rows.values.iter().map(|v| fonts.width(v, text)).max().unwrap_or(0);
        let strip = if wrapped {
            0
        } else {
            (em + values).max(fonts.width(&self.rows.name, text)).min(16 * em) + gap
        };
        let grid_w = (across as u32).saturating_mul(pitch[0]) - gap;
        let title = text * 1.5;
        let heading = fonts.width(&self.title, title).max(fonts.width(&self.subtitle, text)).min(48 * em);
        let content = (strip.saturating_add(grid_w)).max(heading);
        let mut layout = Layout { text, ..Default::default() };
        let mut label = |text: &str, at: Rect, size: f32, color: [u8; 3], place: f32| {
            let text = fonts.shorten(text, size, at.w);
            let w = fonts.width(&text, size);
            let x = at.x + ((at.w - w) as f32 * place) as u32;
            if !text.is_empty() {
                layout.labels.push(Label { text, rect: Rect { x, w, ..at }, size, color });
            }
            w
        };

        let mut y = margin;
        for (words, size, color) in [(&self.title, title, BRIGHT), (&self.subtitle, text, QUIET)] {
            if !words.is_empty() {
                let h = fonts.line(size);
                label(words, Rect { x: margin, y, w: content, h }, size, color, 0.0);
                y += h + em / 4;
            }
        }
        if y > margin {
            y += em;
        }
        let left = margin + strip;
        let mut arrows = Vec::new();
        if !self.columns.values.is_empty() {
            let named = label(&self.columns.name, Rect { x: left, y, w: grid_w, h: line }, text, BRIGHT, 0.0);
            let from = left + if named > 0 { named + em } else { 0 };
            if from + 2 * em <= left + grid_w && count > 1 {
                arrows.push([[from, y + line / 2 + 1], [left + grid_w - 1, y + line / 2 + 1]]);
            }
            y += line + gap / 2;
        }
        if !wrapped {
            label(&self.rows.name, Rect { x: margin, y, w: strip - gap, h: line }, text, BRIGHT, 1.0);
            for (i, value) in self.columns.values.iter().enumerate() {
                label(value, Rect { x: left + i as u32 * pitch[0], y, w, h: line }, text, QUIET, 0.5);
            }
            y += line + gap;
        } else if caption > 0 {
            y += gap;
        }
        let bottom = (down as u32).saturating_mul(pitch[1]).saturating_add(y) - gap;
        if !wrapped {
            for (i, value) in self.rows.values.iter().enumerate() {
                let y =
                    (i as u32).saturating_mul(pitch[1]).saturating_add(y + slot / 2).saturating_sub(line / 2);
                label(value, Rect { x: margin + em, y, w: strip - gap - em, h: line }, text, QUIET, 1.0);
            }
            if down > 1 {
                let x = (left - gap - em / 2).saturating_sub(values).max(margin + em / 4);
                arrows.push([[x, y], [x, bottom - 1]]);
            }
        } else {
            for (i, value) in self.columns.values.iter().enumerate() {
                let [column, row] = [i % across, i / across].map(|n| n as u32);
                let at =
                    [left + column * pitch[0], y.saturating_add(row.saturating_mul(pitch[1])) + h + gap / 2];
                label(value, Rect { x: at[0], y: at[1], w, h: line }, text, QUIET, 0.5);
            }
        }
        let size = [content.saturating_add(2 * margin), bottom.saturating_add(margin)];
        let all = if wrapped { count } else { across * down };
        let places = (0..all).map(|i| {
            let [column, row] = [i % across, i / across];
            let [x, y] =
                [left + column as u32 * pitch[0], y.saturating_add((row as u32).saturating_mul(pitch[1]))];
            let rect = Rect { x, y: y.saturating_add((slot - h) / 2), w, h };
            if wrapped { Place { row: 0, column: i, rect } } else { Place { row, column, rect } }
        });
        layout.places = places.collect();
        Layout { size, arrows, ..layout }
    }
}

/// Returns the number of pictures in a row, out of `count` that wrap at a pitch of `pitch` pixels. It brings
/// the sheet near to [`ASPECT`] and leaves few places empty in the last row.
fn wrap(count: usize, pitch: [u32; 2]) -> usize {
    if count <= ONE_ROW {
        return count;
    }
    let cost = |across: usize| {
        let down = count.div_ceil(across);
        let aspect = across as f64 * pitch[0] as f64 / (down as f64 * pitch[1] as f64);
        (aspect / ASPECT).ln().abs() + (across * down - count) as f64 / across as f64 * 0.3
    };
    (1..=count.min(LONGEST_SIDE as usize)).min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(1)
}
