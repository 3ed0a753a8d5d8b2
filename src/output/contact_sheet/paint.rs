//! Drawing of a sheet: shrunk pictures, labels, arrows and frames.

use image::imageops::{self, FilterType};
use image::{ImageBuffer, Rgb, RgbImage};

use super::text::Fonts;
use super::{Label, Rect, Sheet};
use crate::util::error::Result;

/// Note in the middle of an absent picture.
const ABSENT: &str = "not rendered";

const PAPER: [u8; 3] = [19, 20, 22];
const LINE: [u8; 3] = [92, 96, 104];
const FRAME: [u8; 3] = [50, 53, 58];

/// Draws a sheet. `cell` returns the picture of a row and column, or `None` where there is none.
///
/// # Errors
/// The errors of [`Sheet::layout`] and of `cell`.
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

/// Shrinks a picture to fit its place, and keeps its shape. The mean is taken in linear light and not of sRGB
/// bytes, so that thin bright threads keep their brightness. A sharpening filter is not used: its halos would
/// look like water.
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

/// Decodes an sRGB byte to linear light.
fn light(byte: u8) -> f32 {
    let x = byte as f32 / 255.0;
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// Encodes linear light as an sRGB byte.
fn byte(x: f32) -> u8 {
    let x = x.clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0 + 0.5) as u8
}

/// Blends `color` over a pixel by its share, in linear light.
pub fn blend(image: &mut RgbImage, x: u32, y: u32, color: [u8; 3], share: f32) {
    if let Some(pixel) = image.get_pixel_mut_checked(x, y) {
        for (under, over) in pixel.0.iter_mut().zip(color) {
            let mixed = light(*under) * (1.0 - share) + light(over) * share;
            *under = byte(mixed);
        }
    }
}

/// Draws a line of one pixel with an open head, to the right or down.
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

/// Draws an empty frame, with a note where there is room for it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinking_keeps_the_light() {
        let checks = RgbImage::from_fn(64, 64, |x, y| Rgb([if (x + y) % 2 == 0 { 255 } else { 0 }; 3]));
        let small = shrink(checks, Rect { x: 0, y: 0, w: 16, h: 16 });
        assert_eq!(small.dimensions(), (16, 16));
        // Half the light encodes to byte 188, not 128.
        assert!(small.pixels().all(|p| p.0[0].abs_diff(188) <= 2));
    }

    #[test]
    fn bytes_survive_the_way_through_light() {
        assert!((0..=255).all(|b| byte(light(b)) == b));
    }
}
