//! Finished pictures as they are shown, for movies and sheets, from whichever file holds them best.

use std::path::Path;

use super::Batch;
use crate::output::frame::{Encoding, ExrColours, Format, read_picture, rgb_rows, samples_of};
use crate::picture::resolve::{Resolver, develop};
use crate::picture::{Frame, Image, Layer};
use crate::util::error::Result;
use crate::util::window::Window;

/// A picture as shown.
pub(super) struct Shown {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// sRGB samples, as of [`samples_of`].
    pub samples: Vec<u8>,
}

impl Batch {
    /// Encoding of the pictures of a format, with `alpha` if they have it.
    pub(super) fn encoding(&self, format: Format, alpha: bool) -> Encoding {
        format.encoding(self.request.depth.bits, self.request.depth.linear, alpha)
    }

    /// Ranks a file of this format and these layers as the source of a picture with `bits` per channel; the
    /// best is 0.
    fn rank(&self, (format, layers): (Format, &[Layer]), bits: u8) -> u8 {
        let Encoding { bits: own, linear, .. } = self.encoding(format, false);
        match format {
            // It has no colour without this layer.
            Format::Exr if !layers.contains(&Layer::Rgb) => 9,
            Format::Exr if bits == 8 => 2,
            Format::Exr => 1,
            Format::Jpeg => 4,
            _ if own == bits && !linear => 0,
            _ if own == 16 => 2,
            _ => 3,
        }
    }

    /// Whether the pictures hold more than 8 bits of what is shown.
    pub(super) fn has_deep_source(&self) -> bool {
        self.ranks(16).into_iter().any(|rank| rank <= 2)
    }

    /// Ranks all files of a picture.
    fn ranks(&self, bits: u8) -> Vec<u8> {
        let files = self.formats().into_iter().zip(&self.layers);
        files.map(|(format, layers)| self.rank((format, layers), bits)).collect()
    }

    /// Reads a picture as shown, with `bits` per channel.
    pub(super) fn shown(&self, number: usize, bits: u8) -> Result<Shown> {
        let (formats, ranks) = (self.formats(), self.ranks(bits));
        let best = (0..formats.len()).min_by_key(|&i| ranks[i]).unwrap_or(0);
        let path = &self.files(number)[best];
        let scene = self.scene(number)?;
        let (image, window) = (&scene.image, self.window(&scene));
        if formats[best] == Format::Exr {
            return of_exr(path, image, window, bits, self.base.limits().memory);
        }
        let picture = read_picture(path)?;
        let own = picture.encoding.bits;
        let size = [picture.width, picture.height];
        let width = picture.width.max(1);
        // A picture with alpha is shown over black.
        let shown = picture.over(0.0).into_iter().map(picture.encoding.shown());
        let samples = match bits {
            8 if own == 8 => shown.flatten().map(|x| (x * 255.0).round() as u8).collect(),
            8 => {
                let resolver = Resolver::new(&image.look);
                let at = |i: u32| [window.x + i % width, window.y + i / width];
                shown.zip(0..).flat_map(|(x, i)| resolver.bytes(x, at(i))).collect()
            }
            _ => shown.flatten().flat_map(|x| ((x * 65_535.0).round() as u16).to_be_bytes()).collect(),
        };
        Ok(Shown { size, samples })
    }
}

/// Develops an EXR's colour, the part `window` of an image, as a picture file would hold it.
fn of_exr(path: &Path, image: &Image, window: Window, bits: u8, memory: u64) -> Result<Shown> {
    let read = ExrColours::open(path)?.read(window, memory)?;
    let (width, height) = (read.width, read.height);
    let mut frame = Frame::new(width, height, false);
    frame.radiance = read.pixels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
    let whole = [image.width, image.height];
    let samples = if bits == 8 {
        develop(&mut frame, &image.look, window, whole);
        rgb_rows(&frame)
    } else {
        samples_of(&frame, Encoding { bits, ..Encoding::DISPLAY }, &image.look, window, whole)
    };
    Ok(Shown { size: [width, height], samples })
}
