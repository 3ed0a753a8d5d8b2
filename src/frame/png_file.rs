//! PNG: sRGB, 8 bits, with the resolved scene as text.

use std::path::Path;

use crate::error::{Error, Result};

use super::Frame;

/// Largest side and pixel count read by [`read_png`]: 2³⁰ bytes of pixels.
const MAX_PIXELS: u64 = 1 << 28;

/// Encodes the picture in memory: an encoder that writes to a full disk may report success.
pub fn encode_png(frame: &Frame, texts: &[(&str, &str)]) -> std::result::Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, frame.width, frame.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    for (key, text) in texts {
        encoder.add_itxt_chunk((*key).into(), (*text).into())?;
    }
    let mut writer = encoder.write_header()?;
    let rgb: Vec<u8> = frame.picture.iter().flat_map(|p| [p[0], p[1], p[2]]).collect();
    writer.write_image_data(&rgb)?;
    writer.finish()?;
    Ok(bytes)
}

/// Reads a PNG as RGB float in 0..=1 (as encoded, not linear): width, height, pixels.
pub fn read_png(path: &Path) -> Result<(u32, u32, Vec<[f32; 3]>)> {
    let bad = |why: String| Error::input(format!("{}: {why}", path.display()), "give a PNG image");
    let file = std::fs::File::open(path).map_err(|e| Error::read(path, e))?;
    let mut reader = image::ImageReader::with_format(std::io::BufReader::new(file), image::ImageFormat::Png);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_PIXELS * 8);
    reader.limits(limits);
    let decoded = reader.decode().map_err(|e| bad(e.to_string()))?;
    let rgb = decoded.to_rgb32f();
    let pixels = rgb.pixels().map(|p| p.0).collect();
    Ok((rgb.width(), rgb.height(), pixels))
}
