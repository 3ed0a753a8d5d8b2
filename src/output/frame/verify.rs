//! Check that a picture file is complete.

use std::path::Path;

use super::{Channel, Encoding, ExrHead, ExrLines, Figures, Format, PictureRows};
use crate::util::error::Result;
use crate::util::window::Window;

/// Contents of a verified file.
#[derive(Clone, Debug, PartialEq)]
pub struct Verified {
    /// Format of the file.
    pub format: Format,
    /// Encoding of a developed picture's samples; `None` for an EXR.
    pub encoding: Option<Encoding>,
    /// Width and height of the whole image, pixels.
    pub size: [u32; 2],
    /// Part of the image in the file.
    pub window: Window,
    /// Scene of the picture, as a scene file.
    pub scene: Option<String>,
    /// Channels of an EXR, in the file's order; empty for a developed picture.
    pub channels: Vec<Channel>,
    /// Head of an EXR.
    pub head: Option<ExrHead>,
    /// Figures of a developed picture, if it has any.
    pub figures: Option<Figures>,
}

/// Decodes a whole file that this program wrote, in constant memory.
///
/// A PNG has checksums over everything, so a missing, changed or added byte is always detected, and so it is
/// in a JPEG. TIFF and WebP have a checksum over samples and texts; a change that leaves both as they are is
/// not detected. An EXR has one only over samples that are compressed by ZIP or ZIPS. Missing and added bytes
/// are detected, and changes to the structure of the header, to the table of lines, and to the position,
/// length or run lengths of a line. A change inside a text is not detected, nor one to a sample with another
/// compression.
///
/// # Errors
/// [`Error::Input`] where the file is damaged or not of this program's kind, [`Error::Io`] where it cannot be
/// read.
///
/// [`Error::Input`]: crate::util::error::Error::Input
/// [`Error::Io`]: crate::util::error::Error::Io
pub fn verify(path: &Path) -> Result<Verified> {
    let format = Format::of_file(path)?;
    if format.is_developed() {
        let mut rows = PictureRows::open(path)?;
        let (size, window, scene) = (rows.whole, rows.window, rows.scene());
        let encoding = Some(rows.encoding);
        rows.skip_rows()?;
        let figures = rows.finish()?;
        let (channels, head) = (Vec::new(), None);
        return Ok(Verified { format, encoding, size, window, scene, channels, head, figures });
    }
    let mut lines = ExrLines::open(path)?;
    let (size, window, scene) = (lines.whole, lines.window, lines.scene());
    let mut line = Vec::new();
    for _ in 0..window.height {
        lines.read_line(&mut line)?;
    }
    let (channels, head) = (lines.channels.clone(), Some(lines.head.clone()));
    lines.finish()?;
    Ok(Verified { format, encoding: None, size, window, scene, channels, head, figures: None })
}

/// Returns the scene in a picture of this program, `None` in it for a picture without one. `None` where the
/// file is no picture.
pub fn scene_in(path: &Path) -> Option<Result<Option<String>>> {
    Some(match Format::of_file(path).ok()? {
        Format::Exr => ExrLines::open(path).map(|lines| lines.scene()),
        _ => PictureRows::open(path).map(|rows| rows.scene()),
    })
}
