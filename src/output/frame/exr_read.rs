//! Reader of the pictures in EXR files of any program. [`crate::util::open_exr`] decodes them.

use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::{Path, PathBuf};

use exr::prelude::{IntegerBounds, Vec2};

use crate::util::error::{Error, Result};
use crate::util::open_exr::{Colours, Fault, OpenExr};
use crate::util::window::Window;

/// Names and values of an EXR file's channels; values row by row.
pub type Channels = Vec<(String, Vec<f32>)>;

/// Colours of a picture in linear Rec. 709.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrPicture {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// R, G and B, row by row from the top, multiplied by alpha.
    pub pixels: Vec<[f32; 3]>,
    /// Alpha, if the file has it.
    pub alpha: Option<Vec<f32>>,
    /// Notes on the file for the user, a sentence each.
    pub notes: Vec<String>,
}

/// The colours of an EXR file of any program, not read yet.
pub struct ExrColours {
    path: PathBuf,
    colours: Colours,
    display: IntegerBounds,
    /// Width and height of the picture, which is the display window, pixels.
    pub size: [u32; 2],
    /// Part of the picture in which the file has data.
    pub data: Window,
}

impl ExrColours {
    /// Opens a file and finds its colours.
    ///
    /// # Errors
    /// [`Error::Io`] where the file cannot be read, [`Error::Input`] where it is no EXR or has no colours.
    pub fn open(path: &Path) -> Result<ExrColours> {
        let fault = |fault| unread(path, fault);
        let colours = OpenExr::open(open(path)?).and_then(OpenExr::colours).map_err(fault)?;
        let [display, data] = colours.windows().map_err(fault)?;
        // They overlap, so the part is not empty.
        let along = |data: i32, n: usize, display: i32, m: usize| {
            let first = (i64::from(data) - i64::from(display)).max(0);
            let end = (i64::from(data) - i64::from(display) + n as i64).min(m as i64);
            (first as u32, (end - first) as u32)
        };
        let (x, width) = along(data.position.0, data.size.0, display.position.0, display.size.0);
        let (y, height) = along(data.position.1, data.size.1, display.position.1, display.size.1);
        let size = [display.size.0 as u32, display.size.1 as u32];
        let data = Window { x, y, width, height };
        Ok(ExrColours { path: path.to_owned(), colours, display, size, data })
    }

    /// Reads the part `area` of the picture as the file means it, in linear Rec. 709. Pixels outside the data
    /// window are black.
    ///
    /// # Errors
    /// [`Error::Io`] where the file cannot be read, [`Error::Input`] where it is broken, [`Error::Memory`]
    /// where the area takes more than `memory` bytes.
    pub fn read(self, area: Window, memory: u64) -> Result<ExrPicture> {
        let ExrColours { path, colours, display, .. } = self;
        let size = [area.width as usize, area.height as usize];
        check(&path, size, 16 + 12 + 4, colours.block_bytes(), memory)?;
        let at = |display: i32, first: u32| display.saturating_add(first as i32);
        let position = Vec2(at(display.position.0, area.x), at(display.position.1, area.y));
        let bounds = IntegerBounds { position, size: Vec2(size[0], size[1]) };
        let mut pixels = colours.read(bounds).map_err(|fault| unread(&path, fault))?;
        pixels.to_rec709();
        let (values, alpha, notes) = (pixels.values, pixels.alpha, pixels.notes);
        let pixels = values.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
        Ok(ExrPicture { width: area.width, height: area.height, pixels, alpha, notes })
    }
}

/// Reads a whole picture; see [`ExrColours`].
///
/// # Errors
/// Errors of [`ExrColours::open`] and [`ExrColours::read`].
pub fn read_exr_picture(path: &Path, memory: u64) -> Result<ExrPicture> {
    let colours = ExrColours::open(path)?;
    let whole = Window::whole(colours.size);
    colours.read(whole, memory)
}

/// Reads every channel of the first part of an EXR file. Returns width, height and channels. The picture is
/// the display window; values outside the data window are 0.
///
/// # Errors
/// [`Error::Io`] where the file cannot be read, [`Error::Input`] where it is no EXR, [`Error::Memory`] where
/// the picture takes more than `memory` bytes.
pub fn read_exr(path: &Path, memory: u64) -> Result<(u32, u32, Channels)> {
    let fault = |fault| unread(path, fault);
    let exr = OpenExr::open(open(path)?).map_err(fault)?;
    let [display, _] = exr.windows(0).map_err(fault)?;
    let (width, height) = (display.size.0, display.size.1);
    let list = &exr.headers()[0].channels.list;
    check(path, [width, height], 4 * list.len(), exr.block_bytes(0), memory)?;
    let mut channels: Channels =
        list.iter().map(|c| (c.name.to_string(), vec![0.0; width * height])).collect();
    exr.lines(0, display, |channel, y, first, line| {
        channels[channel].1[y * width + first..][..line.len()].copy_from_slice(line);
    })
    .map_err(fault)?;
    Ok((width as u32, height as u32, channels))
}

fn open(path: &Path) -> Result<BufReader<File>> {
    File::open(path).map(BufReader::new).map_err(|e| Error::read(path, e))
}

/// Refuses a picture that takes too much memory, before any of it is allocated.
fn check(path: &Path, size: [usize; 2], pixel: usize, more: u128, memory: u64) -> Result<()> {
    let [width, height] = size;
    let need = width as u128 * height as u128 * pixel as u128 + more;
    if need <= u128::from(memory) {
        return Ok(());
    }
    let what = format!("{} of {width}×{height} pixels", path.display());
    Err(Error::memory(what, need, memory, "make it smaller or raise --memory"))
}

fn unread(path: &Path, fault: Fault) -> Error {
    let bad = |why: String, fix: &str| {
        // Messages of libraries may span several lines.
        Error::input(format!("{}: {}", path.display(), why.replace(['\n', '\r'], " ")), fix)
    };
    match fault {
        Fault::Bad { why, fix } => bad(why, fix.unwrap_or("give an EXR image")),
        Fault::Io(e) => match e.kind() {
            ErrorKind::UnexpectedEof | ErrorKind::InvalidInput | ErrorKind::InvalidData => {
                bad(e.to_string(), "give an EXR image")
            }
            _ => Error::read(path, e),
        },
    }
}
