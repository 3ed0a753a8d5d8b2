//! Check that a picture file is complete.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::exr_file::ExrLines;
use super::png_file::PngRows;
use super::{Figures, SCENE_TEXT};
use crate::util::error::{Error, Result};
use crate::util::window::Window;

/// Contents of a verified file.
#[derive(Clone, Debug, PartialEq)]
pub struct Verified {
    /// Width and height of the whole image, pixels.
    pub size: [u32; 2],
    /// Part of the image in the file.
    pub window: Window,
    /// Scene of the picture, as a scene file.
    pub scene: Option<String>,
    /// Channels of an EXR, in the file's order; empty for a PNG.
    pub channels: Vec<String>,
    /// Figures of a PNG that this program made.
    pub figures: Option<Figures>,
}

/// Format of a picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// PNG: sRGB, 8 bits.
    Png,
    /// EXR: float32, with layers.
    Exr,
}

impl Kind {
    /// Detects the format of a file by its first bytes.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is neither or missing, [`Error::Io`] where it cannot be read.
    pub fn of(path: &Path) -> Result<Kind> {
        let metadata = std::fs::metadata(path).map_err(|e| Error::open(path, e))?;
        let foreign =
            |why: &str| Error::input(format!("{}: {why}", path.display()), "give a PNG or EXR of taki");
        if !metadata.is_file() {
            return Err(foreign("not a regular file"));
        }
        let mut start = Vec::new();
        let file = File::open(path).map_err(|e| Error::read(path, e))?;
        file.take(4).read_to_end(&mut start).map_err(|e| Error::read(path, e))?;
        match start[..] {
            [0x89, b'P', b'N', b'G'] => Ok(Kind::Png),
            [0x76, 0x2f, 0x31, 0x01] => Ok(Kind::Exr),
            _ => Err(foreign("neither a PNG nor an EXR")),
        }
    }
}

/// Decodes a whole file that this program wrote, in constant memory.
///
/// A PNG has checksums over everything, so a missing, changed or added byte is always detected. An EXR has
/// none. Missing and added bytes are detected, and changes to the structure of the header, to the table of
/// lines, and to the position, length or run lengths of a line. A change to the value of a sample or inside a
/// text is not detected.
///
/// # Errors
/// [`Error::Input`] where the file is damaged or not of this program's kind, [`Error::Io`] where it cannot be
/// read.
pub fn verify(path: &Path) -> Result<Verified> {
    match Kind::of(path)? {
        Kind::Png => {
            let mut rows = PngRows::open(path)?;
            let (size, window, scene) = (rows.whole, rows.window, rows.text(SCENE_TEXT));
            rows.skip_rows()?;
            Ok(Verified { size, window, scene, channels: Vec::new(), figures: rows.finish()? })
        }
        Kind::Exr => {
            let mut lines = ExrLines::open(path)?;
            let (size, window, scene) = (lines.whole, lines.window, lines.scene());
            let mut line = Vec::new();
            for _ in 0..window.height {
                lines.read_line(&mut line)?;
            }
            let channels = std::mem::take(&mut lines.channels);
            lines.finish()?;
            Ok(Verified { size, window, scene, channels, figures: None })
        }
    }
}
