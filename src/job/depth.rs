//! Depth of developed pictures, and what their formats allow and need.

use std::path::Path;

use crate::output::frame::Format;
use crate::picture::{Image, Look, Tone};
use crate::util::error::{Error, Result};
use crate::util::window::Window;

/// Depth that developed pictures are asked for in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Depth {
    /// Bits per channel, 8 or 16, where a format has them. `None`: the default of each format.
    pub bits: Option<u8>,
    /// Whether formats of 16 bits hold linear light.
    pub linear: bool,
}

impl Depth {
    /// Checks that the depth suits an output of these formats, and the scene's look.
    ///
    /// # Errors
    /// [`Error::Usage`] where no output has the depth, or a tone curve contradicts linear light.
    pub fn check(self, formats: &[Format], look: &Look) -> Result<()> {
        let any = |bits: u8| formats.iter().any(|format| format.depths().contains(&bits));
        if let Some(bits) = self.bits.filter(|&bits| !any(bits)) {
            let with = Format::ALL.iter().filter(|format| format.depths().contains(&bits));
            let with: Vec<&str> = with.map(|format| format.extension()).collect();
            let what = format!("--bits {bits} is for .{} files; add -o FILE.{}", with.join(", ."), with[0]);
            return Err(Error::Usage(what));
        }
        if !self.linear {
            return Ok(());
        }
        if self.bits == Some(8) {
            return Err(Error::Usage("--linear needs 16 bits for dark colours; leave out --bits 8".into()));
        }
        if !any(16) {
            let what = "--linear is for .png and .tif files; an .exr is linear without it";
            return Err(Error::Usage(what.into()));
        }
        if look.tone != Tone::None {
            let what = format!(
                "--linear stores values in proportion to light, but image.tone = {:?} bends them; add --set \
                 image.tone=none",
                look.tone.word()
            );
            return Err(Error::Usage(what));
        }
        Ok(())
    }
}

/// Refuses files without an alpha channel for an image that has one.
///
/// # Errors
/// [`Error::Usage`] for such a file.
pub(crate) fn check_alpha<'a>(
    image: &Image,
    files: impl IntoIterator<Item = (&'a Path, Format)>,
) -> Result<()> {
    let mut files = files.into_iter();
    match files.find(|(_, format)| image.alpha && !format.has_alpha()) {
        Some((path, format)) => Err(Error::Usage(format!(
            "-o {}: {} has no alpha channel, and image.alpha is true; write .png, .tif, .webp or .exr",
            path.display(),
            format.name()
        ))),
        None => Ok(()),
    }
}

/// Refuses a picture that is too large for its file's format.
///
/// # Errors
/// [`Error::CannotCreate`] for such a picture.
pub(crate) fn check_side(path: &Path, format: Format, window: Window) -> Result<()> {
    let (side, most) = (window.width.max(window.height), format.longest_side());
    if side <= most {
        return Ok(());
    }
    Err(Error::CannotCreate {
        path: path.to_owned(),
        why: format!("{side} pixels are more than the {most} that a side of {} may have", format.name()),
        fix: "write a .png, .tif or .exr instead".into(),
    })
}

/// Returns the bytes that the encoders of these formats take for a picture.
pub(crate) fn held_bytes(formats: &[Format], window: Window) -> u64 {
    formats.iter().map(|format| format.held_bytes() * window.pixels()).sum()
}

/// Returns what is left of `memory` for rendering beside the encoders of these formats.
///
/// # Errors
/// [`Error::Memory`] where nothing is.
pub(crate) fn beside_encoders(memory: u64, formats: &[Format], window: Window) -> Result<u64> {
    let held = held_bytes(formats, window);
    memory.checked_sub(held).filter(|&rest| rest > 0).ok_or_else(|| {
        let what = format!("encoding a JPEG or WebP of {}×{} pixels", window.width, window.height);
        Error::memory(what, held.into(), memory, "write a .png, .tif or .exr, or raise --memory")
    })
}
