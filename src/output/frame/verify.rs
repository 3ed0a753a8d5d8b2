//! Whether a picture's file is whole.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::exr_file::ExrLines;
use super::png_file::PngRows;
use super::{Figures, SCENE_TEXT};
use crate::util::error::{Error, Result};
use crate::util::window::Window;

/// What a file says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Verified {
    /// Width and height of the whole image, pixels.
    pub size: [u32; 2],
    /// The part of it that the file holds.
    pub window: Window,
    /// The scene that made it, as a scene file.
    pub scene: Option<String>,
    /// Channels of an EXR, in the file's order; none of a PNG.
    pub channels: Vec<String>,
    /// Figures of a PNG that this program made.
    pub figures: Option<Figures>,
}

/// What a file is by its first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// sRGB, 8 bits.
    Png,
    /// Float32, layers.
    Exr,
}

impl Kind {
    /// Of a file that exists.
    pub fn of(path: &Path) -> Result<Kind> {
        let metadata = std::fs::metadata(path).map_err(|e| Error::read(path, e))?;
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

/// Decodes the whole of a file that this program wrote, in constant memory.
///
/// A PNG has checksums over everything: a missing, changed or added byte is always seen. An EXR has none:
/// missing and added bytes are seen, and so is a change of the header's structure, of the table of lines,
/// of a line's place, length or run lengths. A change of a sample's value, or inside a text, is not.
///
/// # Errors
/// [`Error::Input`] where the file is not whole or not of this program's kind, [`Error::Io`] where it
/// cannot be read.
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
