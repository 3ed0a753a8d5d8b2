//! Formats of picture files: what each can hold.

use std::ffi::OsStr;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::{Encoding, check_regular};
use crate::picture::Gamut;
use crate::util::error::{Error, Result};

/// Format of a picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// PNG: 8 or 16 bits, lossless.
    Png,
    /// JPEG: 8 bits, lossy, chroma at full resolution.
    Jpeg,
    /// TIFF: 8 or 16 bits, lossless.
    Tiff,
    /// WebP: 8 bits, lossless.
    Webp,
    /// EXR: linear, with layers.
    Exr,
}

impl Format {
    /// All formats.
    pub const ALL: [Format; 5] = [Format::Png, Format::Jpeg, Format::Tiff, Format::Webp, Format::Exr];

    /// Extensions of all formats, for messages.
    pub const EXTENSIONS: &str = ".png, .jpg, .tif, .webp or .exr";

    /// Returns the format that a path's extension names, in upper or lower case.
    pub fn of(path: &Path) -> Option<Format> {
        Format::of_extension(path.extension()?)
    }

    fn of_extension(extension: &OsStr) -> Option<Format> {
        let extension = extension.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "png" => Format::Png,
            "jpg" | "jpeg" => Format::Jpeg,
            "tif" | "tiff" => Format::Tiff,
            "webp" => Format::Webp,
            "exr" => Format::Exr,
            _ => return None,
        })
    }

    /// Returns the format that a path's extension names.
    ///
    /// # Errors
    /// [`Error::Usage`] for other extensions, and [`Error::CannotCreate`] for a device; `option` names what
    /// the path was given with.
    pub fn wanted(option: &str, path: &Path) -> Result<Format> {
        if let Some(format) = Format::of(path) {
            return Ok(format);
        }
        check_regular(path)?;
        let extensions = Format::EXTENSIONS;
        let what = format!("{option} {}: unknown kind of picture; use {extensions}", path.display());
        Err(Error::Usage(what))
    }

    /// Detects the format of a file by its first bytes.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is no picture or missing, [`Error::Io`] where it cannot be read.
    pub fn of_file(path: &Path) -> Result<Format> {
        let metadata = std::fs::metadata(path).map_err(|e| Error::open(path, e))?;
        let foreign = |why: &str| {
            let fix = format!("give a picture of taki: {}", Format::EXTENSIONS);
            Error::input(format!("{}: {why}", path.display()), fix)
        };
        if !metadata.is_file() {
            return Err(foreign("not a regular file"));
        }
        let mut start = Vec::new();
        let file = File::open(path).map_err(|e| Error::read(path, e))?;
        file.take(12).read_to_end(&mut start).map_err(|e| Error::read(path, e))?;
        Format::of_start(&start).ok_or_else(|| foreign("no picture of a known kind"))
    }

    /// Detects a format by the first 12 bytes of a file.
    pub fn of_start(start: &[u8]) -> Option<Format> {
        match start {
            [0x89, b'P', b'N', b'G', ..] => Some(Format::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Format::Jpeg),
            // Classic and large files, in either byte order.
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Some(Format::Tiff),
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some(Format::Webp),
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Format::Exr),
            _ => None,
        }
    }

    /// Returns the name for messages.
    pub fn name(self) -> &'static str {
        match self {
            Format::Png => "PNG",
            Format::Jpeg => "JPEG",
            Format::Tiff => "TIFF",
            Format::Webp => "WebP",
            Format::Exr => "EXR",
        }
    }

    /// Returns the usual extension.
    pub fn extension(self) -> &'static str {
        match self {
            Format::Png => "png",
            Format::Jpeg => "jpg",
            Format::Tiff => "tif",
            Format::Webp => "webp",
            Format::Exr => "exr",
        }
    }

    /// Whether files hold an alpha channel.
    pub fn has_alpha(self) -> bool {
        self != Format::Jpeg
    }

    /// Whether a file holds exactly the samples that were written.
    pub fn is_lossless(self) -> bool {
        self != Format::Jpeg
    }

    /// Whether files show the picture as developed, and not radiance and layers.
    pub fn is_developed(self) -> bool {
        self != Format::Exr
    }

    /// Returns the depths that a developed picture may have, bits per channel. The first is the default.
    pub fn depths(self) -> &'static [u8] {
        match self {
            Format::Png => &[8, 16],
            Format::Jpeg | Format::Webp => &[8],
            Format::Tiff => &[16, 8],
            Format::Exr => &[],
        }
    }

    /// Returns the encoding of a developed picture, with `bits` per channel and `alpha` if the format has
    /// them. A linear one has 16 bits and, unless [`Encoding::in_gamut`] says otherwise, the primaries of
    /// Rec. 709.
    pub fn encoding(self, bits: Option<u8>, linear: bool, alpha: bool) -> Encoding {
        let depths = self.depths();
        let wanted = if linear { Some(16) } else { bits };
        let bits = wanted.filter(|bits| depths.contains(bits)).or(depths.first().copied()).unwrap_or(8);
        Encoding {
            bits,
            linear: linear && bits == 16,
            alpha: alpha && self.has_alpha(),
            gamut: Gamut::Rec709,
        }
    }

    /// Returns the largest side, pixels: that of the format, or of its encoder.
    pub fn longest_side(self) -> u32 {
        match self {
            Format::Jpeg => 65_535,
            Format::Webp => 16_384,
            _ => i32::MAX as u32,
        }
    }

    /// Returns the memory that an encoder takes besides the rows, bytes per pixel. JPEG and WebP are encoded
    /// once the whole picture is there: its samples, the encoder's copy of them, and the file.
    pub fn held_bytes(self) -> u64 {
        match self {
            Format::Jpeg => 3 + 3,
            Format::Webp => 4 + 4 + 4,
            _ => 0,
        }
    }
}
