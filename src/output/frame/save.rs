//! A frame as a file of its own, without the scene that made it.

use std::io::BufWriter;
use std::path::Path;

use super::{Compression, ExrHead, ExrWriter, Output, channels_of, encode_png, lines_of};
use crate::picture::{Frame, Gamut, Layer};
use crate::util::error::{Error, Result};
use crate::util::window::Window;

impl Frame {
    /// Writes the picture as an 8-bit sRGB PNG. The file appears whole or not at all, and replaces any file
    /// of this name, whatever it holds.
    ///
    /// # Errors
    /// [`Error::CannotCreate`] or [`Error::Io`] where the file cannot be created or written.
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<()> {
        let output = Output::create(path.as_ref())?;
        let bytes = encode_png(self, &[]).map_err(|e| Error::write(output.path(), e))?;
        output.finish_with(&bytes)
    }

    /// Writes `layers` as an EXR of linear float32 in Rec. 709. The file appears whole or not at all, and
    /// replaces any file of this name, whatever it holds. A layer of the raster pass that the frame was
    /// rendered without is 0.
    ///
    /// # Errors
    /// [`Error::CannotCreate`] or [`Error::Io`] where the file cannot be created or written.
    pub fn write_exr(&self, path: impl AsRef<Path>, layers: &[Layer]) -> Result<()> {
        let mut output = Output::create(path.as_ref())?;
        let target = output.path().to_owned();
        let fault = |e: &dyn std::fmt::Display| Error::write(&target, e.to_string());
        let file = BufWriter::new(output.file().try_clone().map_err(|e| fault(&e))?);
        let size = [self.width, self.height];
        let layers: Vec<Layer> = layers.iter().map(|l| l.of_picture(self.alpha.is_some())).collect();
        let channels = channels_of(&layers, false);
        let compression = Compression::for_width(None, &channels, self.width)?;
        let head = ExrHead { compression, ..Default::default() };
        let mut writer =
            ExrWriter::new(file, size, Window::whole(size), &channels, &head, &[]).map_err(|e| fault(&e))?;
        for line in lines_of(self, &layers, false, Gamut::Rec709, 0..self.height) {
            writer.push(line).map_err(|e| fault(&e))?;
        }
        writer.finish().map_err(|e| fault(&e))?;
        output.finish()
    }
}
