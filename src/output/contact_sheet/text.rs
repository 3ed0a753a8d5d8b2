//! Text of a sheet, in fonts that the binary contains.

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};
use image::RgbImage;

use super::paint::blend;
use super::{Label, Rect};
use crate::util::error::{Error, Result};

/// The fonts. The second has characters that the first lacks.
pub struct Fonts([FontRef<'static>; 2]);

impl Fonts {
    pub fn new() -> Result<Fonts> {
        let open = |bytes| {
            FontRef::try_from_slice(bytes)
                .map_err(|e| Error::input(format!("the built-in font: {e}"), "report this"))
        };
        Ok(Fonts([open(epaint_default_fonts::UBUNTU_LIGHT)?, open(epaint_default_fonts::HACK_REGULAR)?]))
    }

    /// Returns the height of a line of text, pixels.
    pub fn line(&self, size: f32) -> u32 {
        size.ceil() as u32
    }

    /// Lays out a text from x = 0. Returns its glyphs, each with the index of its font, and its end. A
    /// character that no font has becomes `?`, and control characters become blanks.
    pub fn glyphs(&self, text: &str, size: f32) -> (Vec<(usize, Glyph)>, f32) {
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

    /// Returns the width of a text, pixels.
    pub fn width(&self, text: &str, size: f32) -> u32 {
        self.glyphs(text, size).1.ceil() as u32
    }

    /// Returns the text, or as much of its start as fits into `width` pixels with … after it. The result is
    /// empty if not even … fits.
    pub fn shorten(&self, text: &str, size: f32, width: u32) -> String {
        if self.width(text, size) <= width {
            return text.to_owned();
        }
        // At most one character per pixel can fit, so the rest of a very long name need not be measured.
        let mut starts: Vec<usize> = text.char_indices().map(|(i, _)| i).take(width as usize + 1).collect();
        while let Some(end) = starts.pop() {
            let short = format!("{}…", text[..end].trim_end());
            if self.width(&short, size) <= width {
                return short;
            }
        }
        String::new()
    }

    /// Draws a label, clipped to its box.
    pub fn draw(&self, image: &mut RgbImage, label: &Label) {
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
        let table = include_str!("../../../docs/parameters.md");
        for c in greek.chain("…·×²³⁻¹°→−–µ".chars()).chain(table.chars()).filter(|c| !c.is_whitespace())
        {
            assert!(fonts.0.iter().any(|font| font.glyph_id(c).0 != 0), "{c}");
        }
        let drawn = |c: char| fonts.0.iter().any(|f| f.outline(f.glyph_id(c)).is_some());
        assert!("ασρτθλ…".chars().all(drawn));
    }
}
