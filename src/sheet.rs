//! A labelled contact sheet: the pictures of a parameter sweep side by side, with its axes and values.
//!
//! One parameter fills rows like lines of text, each picture with its value below it. Two make a grid, the
//! first across and the second down; of three and more, the first goes across and a row stands for each
//! combination of the others. Pictures are drawn one at a time, so the sheet itself is all the memory taken.

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};
use image::imageops::{self, FilterType};
use image::{ImageBuffer, Rgb, RgbImage};

use crate::error::{Error, Result};

/// Most pixels a side of a sheet: 192 MiB if it is a square. Pictures shrink until it fits.
pub const LONGEST_SIDE: u32 = 8192;

/// Shortest side that a picture is shrunk to. A value of four digits still stands over it.
const SMALLEST_CELL: u32 = 36;

/// Width over height that a wrapped row of pictures comes nearest to.
const ASPECT: f64 = 1.6;

/// Pictures that one parameter may have in a single row.
const ONE_ROW: usize = 6;

/// In the middle of an absent picture.
const ABSENT: &str = "not rendered";

const PAPER: [u8; 3] = [19, 20, 22];
const BRIGHT: [u8; 3] = [222, 224, 228];
const QUIET: [u8; 3] = [160, 164, 171];
const LINE: [u8; 3] = [92, 96, 104];
const FRAME: [u8; 3] = [50, 53, 58];

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

    /// Where everything goes. Pictures keep their size if the sheet then has no side longer than
    /// [`LONGEST_SIDE`]; else they shrink as much as it takes. Exit 65 if they would have to be smaller than
    /// 36 pixels, or if there are none.
    pub fn layout(&self) -> Result<Layout> {
        let [columns, rows] = [&self.columns, &self.rows].map(|axis| axis.values.len().max(1));
        let shortest = self.cell[0].min(self.cell[1]);
        if shortest == 0 {
            return Err(Error::input("a sheet of pictures without pixels", "give them a size"));
        }
        let longest = self.cell[0].max(self.cell[1]);
        let fonts = Fonts::new()?;
        // By the longer side, so that a picture keeps its shape to the pixel.
        let cell = |side: u32| {
            self.cell
                .map(|full| ((full as u64 * side as u64 + longest as u64 / 2) / longest as u64).max(1) as u32)
        };
        let fits = |side: u32| {
            let layout = self.arrange(&fonts, cell(side));
            layout.size.iter().all(|s| *s <= LONGEST_SIDE).then_some(layout)
        };
        // Pictures far too many are refused before their places are made.
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

    /// The layout with pictures of this size.
    fn arrange(&self, fonts: &Fonts, [w, h]: [u32; 2]) -> Layout {
        // Text grows with the pictures, for a large sheet is looked at from further away.
        let text = (6.0 + 0.075 * w.min(h) as f32).clamp(14.0, 34.0).round();
        let em = text as u32;
        let (margin, gap) = (2 * em, (em / 2).max(6));
        let line = fonts.line(text);
        let wrapped = self.rows.values.is_empty();
        let count = self.columns.values.len().max(1);
        let caption = if wrapped && !self.columns.values.is_empty() { line + gap / 2 } else { 0 };
        // Beside a picture lower than a line stands a line all the same.
        let slot = if wrapped { h } else { h.max(line) };
        let pitch = [w + gap, slot + caption + gap + if caption > 0 { gap } else { 0 }];
        let across = if wrapped { wrap(count, pitch) } else { count };
        let down = if wrapped { count.div_ceil(across) } else { self.rows.values.len() };

        // Left of the grid: an arrow, and the rows' values.
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

/// Pictures in a row, of `count` that wrap at `pitch` pixels: the sheet comes near to [`ASPECT`], with few
/// places left empty in the last row.
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

/// Draws the sheet; `cell` gives the picture of a row and a column, or `None` where there is none. Its
/// errors end the drawing.
pub fn draw(
    sheet: &Sheet,
    mut cell: impl FnMut(usize, usize) -> Result<Option<RgbImage>>,
) -> Result<RgbImage> {
    let layout = sheet.layout()?;
    let fonts = Fonts::new()?;
    let mut image = RgbImage::from_pixel(layout.size[0], layout.size[1], Rgb(PAPER));
    for label in &layout.labels {
        fonts.draw(&mut image, label);
    }
    for arrow in &layout.arrows {
        draw_arrow(&mut image, arrow, layout.text);
    }
    for place in &layout.places {
        match cell(place.row, place.column)? {
            Some(picture) => {
                let picture = shrink(picture, place.rect);
                let x = place.rect.x + (place.rect.w - picture.width()) / 2;
                let y = place.rect.y + (place.rect.h - picture.height()) / 2;
                imageops::replace(&mut image, &picture, x as i64, y as i64);
            }
            None => draw_absent(&mut image, &fonts, place.rect, layout.text),
        }
    }
    Ok(image)
}

/// The picture no larger than its place, its shape kept. The mean is taken of light, not of sRGB bytes:
/// thin bright threads keep their brightness. No sharpening filter: its halos would pass for water.
fn shrink(picture: RgbImage, place: Rect) -> RgbImage {
    let (w, h) = picture.dimensions();
    if w <= place.w && h <= place.h {
        return picture;
    }
    let scale = (place.w as f64 / w as f64).min(place.h as f64 / h as f64);
    let side = |full: u32, most: u32| ((full as f64 * scale).round() as u32).clamp(1, most);
    let table: Vec<f32> = (0..=255u8).map(light).collect();
    let linear = |p: u8| table[p as usize];
    let linear: ImageBuffer<Rgb<f32>, Vec<f32>> =
        ImageBuffer::from_fn(w, h, |x, y| Rgb(picture.get_pixel(x, y).0.map(linear)));
    drop(picture);
    let small = imageops::resize(&linear, side(w, place.w), side(h, place.h), FilterType::Triangle);
    ImageBuffer::from_fn(small.width(), small.height(), |x, y| Rgb(small.get_pixel(x, y).0.map(byte)))
}

/// Linear light of an sRGB byte.
fn light(byte: u8) -> f32 {
    let x = byte as f32 / 255.0;
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// sRGB byte of linear light.
fn byte(x: f32) -> u8 {
    let x = x.clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0 + 0.5) as u8
}

/// Lays `color` over a pixel, in linear light.
fn blend(image: &mut RgbImage, x: u32, y: u32, color: [u8; 3], share: f32) {
    if let Some(pixel) = image.get_pixel_mut_checked(x, y) {
        for (under, over) in pixel.0.iter_mut().zip(color) {
            let mixed = light(*under) * (1.0 - share) + light(over) * share;
            *under = byte(mixed);
        }
    }
}

/// A line of one pixel with an open head, to the right or down.
fn draw_arrow(image: &mut RgbImage, [[x0, y0], [x1, y1]]: &[[u32; 2]; 2], text: f32) {
    for x in *x0..=*x1 {
        blend(image, x, *y0, LINE, 1.0);
    }
    for y in y0 + 1..=*y1 {
        blend(image, *x0, y, LINE, 1.0);
    }
    for i in 1..=(text * 0.25) as u32 {
        for (x, y) in match x0 == x1 {
            true => [(x1.saturating_sub(i), y1.saturating_sub(i)), (x1 + i, y1.saturating_sub(i))],
            false => [(x1.saturating_sub(i), y1.saturating_sub(i)), (x1.saturating_sub(i), y1 + i)],
        } {
            blend(image, x, y, LINE, 1.0);
        }
    }
}

/// An empty frame with a note, as far as there is room for one.
fn draw_absent(image: &mut RgbImage, fonts: &Fonts, place: Rect, size: f32) {
    let [right, bottom] = [place.x + place.w - 1, place.y + place.h - 1];
    for x in place.x..=right {
        for y in place.y..=bottom {
            if x == place.x || x == right || y == place.y || y == bottom {
                blend(image, x, y, FRAME, 1.0);
            }
        }
    }
    let (w, h) = (fonts.width(ABSENT, size), fonts.line(size));
    if w + 4 <= place.w && h + 4 <= place.h {
        let rect = Rect { x: place.x + (place.w - w) / 2, y: place.y + (place.h - h) / 2, w, h };
        fonts.draw(image, &Label { text: ABSENT.into(), rect, size, color: LINE });
    }
}

/// The fonts: the second has signs that the first lacks.
struct Fonts([FontRef<'static>; 2]);

impl Fonts {
    fn new() -> Result<Fonts> {
        let open = |bytes| {
            FontRef::try_from_slice(bytes)
                .map_err(|e| Error::input(format!("the built-in font: {e}"), "report this"))
        };
        Ok(Fonts([open(epaint_default_fonts::UBUNTU_LIGHT)?, open(epaint_default_fonts::HACK_REGULAR)?]))
    }

    /// Height of a line of text.
    fn line(&self, size: f32) -> u32 {
        size.ceil() as u32
    }

    /// The glyphs of a text from x = 0, and its end. What no font has is a `?`, and control signs are blanks.
    fn glyphs(&self, text: &str, size: f32) -> (Vec<(usize, Glyph)>, f32) {
        let (mut glyphs, mut x, mut before) = (Vec::new(), 0.0, None);
        for c in text.chars() {
            let c = if c.is_control() || c.is_whitespace() { ' ' } else { c };
            let which = self.0.iter().position(|font| font.glyph_id(c).0 != 0);
            let (which, c) = which.map_or((0, '?'), |which| (which, c));
            let font = self.0[which].as_scaled(PxScale::from(size));
            let id = font.glyph_id(c);
            if let Some((font_before, id_before)) = before
                && font_before == which
            {
                x += font.kern(id_before, id);
            }
            glyphs.push((which, id.with_scale_and_position(size, point(x, 0.0))));
            x += font.h_advance(id);
            before = Some((which, id));
        }
        (glyphs, x)
    }

    fn width(&self, text: &str, size: f32) -> u32 {
        self.glyphs(text, size).1.ceil() as u32
    }

    /// The text, or as much of its start as fits into `width` pixels with a … behind it; nothing if not even
    /// that fits.
    fn shorten(&self, text: &str, size: f32, width: u32) -> String {
        if self.width(text, size) <= width {
            return text.to_owned();
        }
        // No more signs than pixels can fit: the rest of a hostile name is never measured.
        let mut starts: Vec<usize> = text.char_indices().map(|(i, _)| i).take(width as usize + 1).collect();
        while let Some(end) = starts.pop() {
            let short = format!("{}…", text[..end].trim_end());
            if self.width(&short, size) <= width {
                return short;
            }
        }
        String::new()
    }

    fn draw(&self, image: &mut RgbImage, label: &Label) {
        let Rect { x, y, w, h } = label.rect;
        let ascent = self.0[0].as_scaled(PxScale::from(label.size)).ascent();
        for (which, mut glyph) in self.glyphs(&label.text, label.size).0 {
            glyph.position.x += x as f32;
            glyph.position.y = (y as f32 + ascent).round();
            let Some(outline) = self.0[which].outline_glyph(glyph) else { continue };
            let corner = outline.px_bounds().min;
            outline.draw(|gx, gy, share| {
                let [px, py] = [corner.x as i64 + gx as i64, corner.y as i64 + gy as i64];
                let inside =
                    (x as i64..(x + w) as i64).contains(&px) && (y as i64..(y + h) as i64).contains(&py);
                if inside && share > 0.0 {
                    blend(image, px as u32, py as u32, label.color, share.min(1.0));
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_symbol_of_the_parameters_is_in_the_font() {
        let fonts = Fonts::new().unwrap();
        let greek = ('α'..='ω').chain('Α'..='Ρ').chain('Σ'..='Ω');
        let table = crate::scene::markdown_table();
        for c in greek.chain("…·×²³⁻¹°→−–µ".chars()).chain(table.chars()).filter(|c| !c.is_whitespace())
        {
            assert!(fonts.0.iter().any(|font| font.glyph_id(c).0 != 0), "{c}");
        }
        let drawn = |c: char| fonts.0.iter().any(|f| f.outline(f.glyph_id(c)).is_some());
        assert!("ασρτθλ…".chars().all(drawn));
    }

    #[test]
    fn shrinking_keeps_the_light() {
        let checks = RgbImage::from_fn(64, 64, |x, y| Rgb([if (x + y) % 2 == 0 { 255 } else { 0 }; 3]));
        let small = shrink(checks, Rect { x: 0, y: 0, w: 16, h: 16 });
        assert_eq!(small.dimensions(), (16, 16));
        // Half the light is byte 188, not 128.
        assert!(small.pixels().all(|p| p.0[0].abs_diff(188) <= 2));
    }

    #[test]
    fn bytes_survive_the_way_through_light() {
        assert!((0..=255).all(|b| byte(light(b)) == b));
    }
}
