//! Reader of developed pictures of this program, row by row, whatever their format.

use std::path::{Path, PathBuf};

use super::png_file::PngRows;
use super::texts::{Texts, bad};
use super::tiff_file::TiffRows;
use super::{Encoding, Figures, Format, MAX_SIDE, SCENE_TEXT, jpeg_file, webp_file};
use crate::util::error::Result;
use crate::util::window::Window;

/// Reader of a developed picture. It checks every checksum.
pub struct PictureRows {
    path: PathBuf,
    source: Source,
    rows_left: u32,
    scene: Option<String>,
    /// Encoding of the samples.
    pub encoding: Encoding,
    /// Width and height of the whole image, pixels.
    pub whole: [u32; 2],
    /// Part of the image in the file.
    pub window: Window,
}

enum Source {
    Png(Box<PngRows>),
    Tiff(Box<TiffRows>),
    /// Samples that have been read and checked, and how many bytes of them are used up.
    Samples(Texts, Vec<u8>, usize),
    /// A lossy file, which has been checked as a whole.
    Checked(Texts),
}

impl PictureRows {
    /// Opens a file and reads everything before the pixels. Small formats are read as a whole.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is damaged or not of this program's kind, [`Error::Io`] where it
    /// cannot be read.
    ///
    /// [`Error::Input`]: crate::util::error::Error::Input
    /// [`Error::Io`]: crate::util::error::Error::Io
    pub fn open(path: &Path) -> Result<PictureRows> {
        let (source, texts, encoding, size) = match Format::of_file(path)? {
            Format::Png => {
                let rows = PngRows::open(path)?;
                let (texts, encoding, size) = (rows.texts(), rows.encoding, rows.size);
                (Source::Png(Box::new(rows)), texts, encoding, size)
            }
            Format::Tiff => {
                let rows = TiffRows::open(path)?;
                let (texts, encoding, size) = (rows.texts.clone(), rows.encoding, rows.size);
                (Source::Tiff(Box::new(rows)), texts, encoding, size)
            }
            Format::Webp => {
                let (texts, size, samples, encoding) = webp_file::read(path)?;
                (Source::Samples(texts.clone(), samples, 0), texts, encoding, size)
            }
            Format::Jpeg => {
                let (texts, size) = jpeg_file::verify(path)?;
                (Source::Checked(texts.clone()), texts, Encoding::DISPLAY, size)
            }
            Format::Exr => return Err(bad(path, "an EXR holds layers, not a developed picture")),
        };
        if size[0].max(size[1]) > MAX_SIDE {
            return Err(bad(path, "it is too large"));
        }
        let (window, whole) = texts.place(path, size)?;
        Ok(PictureRows {
            path: path.to_owned(),
            source,
            rows_left: window.height,
            scene: texts.get(SCENE_TEXT).map(str::to_owned),
            encoding,
            whole,
            window,
        })
    }

    /// Returns the scene of the picture, as a scene file, if the file names it.
    pub fn scene(&self) -> Option<String> {
        self.scene.clone()
    }

    /// Returns the bytes of a row.
    pub fn row_bytes(&self) -> usize {
        self.window.width as usize * self.encoding.pixel_bytes()
    }

    /// Reads the next row into `row`: samples of the window's width, see [`super::samples_of`].
    ///
    /// # Errors
    /// [`Error::Input`] where the file is damaged, is lossy or has no more rows, [`Error::Io`] where it
    /// cannot be read.
    ///
    /// [`Error::Input`]: crate::util::error::Error::Input
    /// [`Error::Io`]: crate::util::error::Error::Io
    pub fn read_row(&mut self, row: &mut [u8]) -> Result<()> {
        match &mut self.source {
            Source::Png(rows) => rows.read_row(row)?,
            Source::Tiff(rows) => rows.read_row(row)?,
            Source::Samples(_, samples, used) => {
                let next = samples.get(*used..*used + row.len());
                row.copy_from_slice(next.ok_or_else(|| bad(&self.path, "the pixels end too early"))?);
                *used += row.len();
            }
            Source::Checked(_) => return Err(bad(&self.path, "its pixels are not exact")),
        }
        self.rows_left = self.rows_left.saturating_sub(1);
        Ok(())
    }

    /// Reads the remaining rows.
    ///
    /// # Errors
    /// The errors of [`PictureRows::read_row`].
    pub fn skip_rows(&mut self) -> Result<()> {
        if matches!(self.source, Source::Checked(_)) {
            return Ok(());
        }
        let mut row = vec![0; self.row_bytes()];
        (0..self.rows_left).try_for_each(|_| self.read_row(&mut row))
    }

    /// Reads the rest of the file, to its last byte. Returns the figures, if the file has them.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is damaged or its figures do not fit it, [`Error::Io`] where it cannot
    /// be read.
    ///
    /// [`Error::Input`]: crate::util::error::Error::Input
    /// [`Error::Io`]: crate::util::error::Error::Io
    pub fn finish(self) -> Result<Option<Figures>> {
        let texts = match self.source {
            Source::Png(rows) => rows.finish()?,
            Source::Tiff(rows) => rows.finish()?,
            Source::Samples(texts, ..) | Source::Checked(texts) => texts,
        };
        texts.figures(&self.path, self.window.pixels())
    }
}
