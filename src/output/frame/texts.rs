//! Texts of a picture file: what they hold, and how formats without named texts store them.

use std::path::Path;

use crc32fast::Hasher;

use super::{CROP_TEXT, FIGURES_TEXT, Figures, MAX_SIDE};
use crate::util::error::{Error, Result};
use crate::util::window::Window;

/// Key of the last text, the checksum of a picture whose format has none.
const CRC_TEXT: &str = "taki.crc32";

/// Texts with their keys.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Texts(pub Vec<(String, String)>);

impl Texts {
    /// Returns the text of a key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.0.iter().find(|(k, _)| k == key).map(|(_, text)| text.as_str())
    }

    /// Joins texts to one: each with a line before it that has its key and its length in bytes.
    pub fn pack(texts: &[(String, String)]) -> String {
        texts.iter().map(|(key, text)| format!("{key} {}\n{text}\n", text.len())).collect()
    }

    /// Takes joined texts apart; `None` where they are damaged or not from this program.
    pub fn unpack(mut packed: &str) -> Option<Texts> {
        let mut texts = Vec::new();
        while !packed.is_empty() {
            let (head, rest) = packed.split_once('\n')?;
            let (key, length) = head.split_once(' ')?;
            let (text, rest) = rest.split_at_checked(length.parse().ok()?)?;
            texts.push((key.to_owned(), text.to_owned()));
            packed = rest.strip_prefix('\n')?;
        }
        Some(Texts(texts))
    }

    /// Returns the part of the image in the file, and the size of the whole. `size` is that of the part.
    ///
    /// # Errors
    /// [`Error::Input`] where the text does not fit the picture.
    pub fn place(&self, path: &Path, size: [u32; 2]) -> Result<(Window, [u32; 2])> {
        let Some(crop) = self.get(CROP_TEXT) else { return Ok((Window::whole(size), size)) };
        let parsed = parse_crop(crop).filter(|(window, _)| [window.width, window.height] == size);
        parsed.ok_or_else(|| bad(path, format!("the text taki.crop = {crop:?} does not fit the picture")))
    }

    /// Returns the figures, if there are any.
    ///
    /// # Errors
    /// [`Error::Input`] where they are damaged, or not those of a picture of so many pixels.
    pub fn figures(&self, path: &Path, pixels: u64) -> Result<Option<Figures>> {
        let Some(text) = self.get(FIGURES_TEXT) else { return Ok(None) };
        let figures: Figures =
            serde_json::from_str(text).map_err(|e| bad(path, format!("the text taki.figures: {e}")))?;
        if figures.pixels != pixels {
            return Err(bad(path, "the text taki.figures belongs to another picture"));
        }
        Ok(Some(figures))
    }

    /// Adds the checksum to texts: that of what `crc` has seen, and of the texts.
    pub fn seal(texts: &mut Vec<(String, String)>, crc: Hasher) {
        let sum = checksum(texts, crc);
        texts.push((CRC_TEXT.into(), sum));
    }

    /// Refuses a picture with another checksum than that of what `crc` has seen, and of the texts.
    ///
    /// # Errors
    /// [`Error::Input`] where it has another one or none.
    pub fn check_seal(&self, path: &Path, crc: Hasher) -> Result<()> {
        match self.0.split_last() {
            Some(((key, text), others)) if key == CRC_TEXT => match *text == checksum(others, crc) {
                true => Ok(()),
                false => Err(bad(path, "its checksum is wrong")),
            },
            _ => Err(bad(path, "not a picture of taki (it has no checksum)")),
        }
    }
}

fn checksum(texts: &[(String, String)], mut crc: Hasher) -> String {
    crc.update(Texts::pack(texts).as_bytes());
    format!("{:08x}", crc.finalize())
}

/// An error about the contents of a picture file.
pub(super) fn bad(path: &Path, why: impl std::fmt::Display) -> Error {
    Error::input(format!("{}: {why}", path.display()), "give a whole picture of taki")
}

/// Formats a part of an image: `X,Y,W,H of WxH`.
pub fn crop_text(window: Window, [width, height]: [u32; 2]) -> String {
    format!("{window} of {width}x{height}")
}

fn parse_crop(text: &str) -> Option<(Window, [u32; 2])> {
    let (window, whole) = text.split_once(" of ")?;
    let (width, height) = whole.split_once('x')?;
    let whole: [u32; 2] = [width.parse().ok()?, height.parse().ok()?];
    let numbers: Vec<u32> = window.split(',').map(|n| n.parse().ok()).collect::<Option<_>>()?;
    let numbers: [u32; 4] = numbers.try_into().ok()?;
    let [x, y, width, height] = numbers;
    let valid = whole[0].max(whole[1]) <= MAX_SIDE && Window::fits(whole, numbers);
    valid.then_some((Window { x, y, width, height }, whole))
}
