//! Joins crops of a picture to the file of the whole picture.

mod canvas;

use std::iter::Peekable;
use std::path::{Path, PathBuf};

use super::{About, Sink, check_replaced, check_side};
use crate::output::frame::{
    Channel, Compression, Encoding, ExrHead, ExrLines, Figures, Format, PictureRows, fits_half, listed,
};
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::window::Window;
use canvas::{Canvas, recoded};

/// Bytes of rows handed to an encoder at a time.
const PIECE_BYTES: usize = 1 << 20;

/// How [`stitch_with`] writes the whole picture.
#[derive(Clone, Debug, Default)]
pub struct StitchOptions {
    /// Whether a crop, or a file that is no picture, is replaced.
    pub overwrite: bool,
    /// Whether colours, transmittance and normals of an EXR become half floats.
    pub half: bool,
    /// Compression of an EXR; `None` keeps that of the crops.
    pub compression: Option<Compression>,
}

/// Does as [`stitch_with`], with the number types and the compression of the crops.
///
/// # Errors
/// Errors of [`stitch_with`].
pub fn stitch(
    parts: &[PathBuf],
    output: &Path,
    overwrite: bool,
    monitor: &dyn Monitor,
) -> Result<Option<Figures>> {
    stitch_with(parts, output, &StitchOptions { overwrite, ..Default::default() }, monitor)
}

/// Joins crops of one picture and writes the whole picture to `output`. The crops must cover the picture,
/// and their pixels must be equal where they overlap. The file equals that of an uncropped render byte for
/// byte, unless its figures are unknown (see below). Memory holds one row of the picture and of each open
/// crop, plus the rows that wait for the encoder (about 1 MiB); WebP files are held whole. A crop, or a
/// file that is no picture, is replaced only where the options say so.
///
/// Returns the figures of a developed picture: the sum of its crops' figures, without crops that lie wholly
/// inside another.
/// If the remaining crops overlap, or one carries no figures, the sum is unknown: the file gets none and the
/// result is `None`. An EXR never carries figures.
///
/// # Errors
/// [`Error::Input`] if the crops belong to different pictures, leave a gap, or differ where they overlap.
/// [`Error::Usage`] if `parts` is empty, `output` is one of them unasked, the extension of `output` does not
/// match the crops, or the options ask for what only an EXR has.
/// Otherwise an error of reading, of creating or writing `output`, or of the monitor.
pub fn stitch_with(
    parts: &[PathBuf],
    output: &Path,
    options: &StitchOptions,
    monitor: &dyn Monitor,
) -> Result<Option<Figures>> {
    if !options.overwrite && parts.iter().any(|part| is_same_file(part, output)) {
        let what = "is one of the parts; choose another name, or replace the part with --overwrite";
        return Err(Error::Usage(format!("-o {} {what}", output.display())));
    }
    let parts =
        parts.iter().map(|path| Part::open(path).map(|(part, _)| part)).collect::<Result<Vec<_>>>()?;
    let Some(first) = parts.first() else {
        return Err(Error::Usage("nothing to stitch; give the files that taki render --crop wrote".into()));
    };
    let (format, encoding, whole) = (first.format, first.encoding, first.whole);
    if !format.is_lossless() {
        let what = format!("{} is a {}, whose pixels are not exact", first.path.display(), format.name());
        return Err(Error::input(what, "render the crops as .png, .tif, .webp or .exr files"));
    }
    check_extension(output, format)?;
    check_side(output, format, Window::whole(whole))?;
    if format != Format::Exr && (options.half || options.compression.is_some()) {
        let what = format!("--half and --compression are for EXR files, but the crops are {}", format.name());
        return Err(Error::Usage(what));
    }
    // Faults that no further crop can mend have been refused by now.
    check_parts(first, &parts)?;
    if !options.overwrite {
        check_replaced(output)?;
    }
    let stored = first.channels.clone();
    let mut channels = stored.clone();
    channels.iter_mut().for_each(|c| c.half |= options.half && fits_half(&c.name));
    let mut head = first.head.clone();
    if let Some(asked) = options.compression {
        head.compression = Compression::for_width(Some(asked), &channels, whole[0])?;
    }
    let about = About { whole, window: Window::whole(whole), scene: first.scene.clone(), channels, head };
    let sink = Sink::create(output, encoding, &about)?;
    let mut canvas = Canvas::new(format, encoding, whole[0], &stored);
    let recode = (stored != about.channels).then(|| (stored, about.channels.clone()));
    let mut sink = RowSink { sink, format, piece: Vec::new(), recode };
    let mut sum = FigureSum::new(format, whole, &parts);
    let mut readers = Readers::new(&parts);
    for y in 0..whole[1] {
        monitor.progress("rows", u64::from(y), u64::from(whole[1]))?;
        readers.open_at(y)?;
        canvas.clear();
        readers.draw_row(y, &mut canvas)?;
        sink.push(&canvas.row)?;
        readers.close_after(y, &mut sum)?;
    }
    if format.is_developed() && sum.total.is_none() {
        monitor.warn("some crops overlap or carry no figures: the whole picture gets no figures");
    }
    sink.finish(sum.total.as_ref())?;
    Ok(sum.total)
}

/// Whether two paths, of which links are followed, lead to one file.
pub(crate) fn is_same_file(a: &Path, b: &Path) -> bool {
    a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

/// Refuses parts of different pictures, and parts that do not cover the whole picture.
fn check_parts(first: &Part, parts: &[Part]) -> Result<()> {
    parts.iter().try_for_each(|part| first.check(part))?;
    let windows: Vec<Window> = parts.iter().map(|part| part.window).collect();
    match gap(first.whole, &windows) {
        Some(gap) => Err(Error::input(
            format!("the crops leave a gap: no file holds the pixels {gap} (column, row, width, height)"),
            format!("render them with --crop {gap} and add the file"),
        )),
        None => Ok(()),
    }
}

/// Refuses an output whose extension is not that of the parts.
fn check_extension(output: &Path, format: Format) -> Result<()> {
    if Format::of(output) == Some(format) {
        return Ok(());
    }
    let extension = format.extension();
    let what = format!(
        "-o {}: the crops are .{extension} files, so the output must end with .{extension} too",
        output.display()
    );
    Err(Error::Usage(what))
}

/// The reader of a part's pixels.
enum Rows {
    Picture(Box<PictureRows>),
    Exr(Box<ExrLines>),
}

/// A part's description, read from the head of its file.
struct Part {
    path: PathBuf,
    window: Window,
    /// Width and height of the whole picture, pixels.
    whole: [u32; 2],
    scene: Option<String>,
    /// Channels of an EXR; empty for a developed picture.
    channels: Vec<Channel>,
    /// Head of an EXR.
    head: ExrHead,
    format: Format,
    /// Encoding of a developed picture's samples.
    encoding: Encoding,
}

impl Part {
    fn open(path: &Path) -> Result<(Part, Rows)> {
        let format = Format::of_file(path)?;
        let path = path.to_owned();
        if format == Format::Exr {
            let lines = ExrLines::open(&path)?;
            let (window, whole, scene) = (lines.window, lines.whole, lines.scene());
            let (channels, encoding) = (lines.channels.clone(), Encoding::DISPLAY);
            let head = lines.head.clone();
            let part = Part { path, window, whole, scene, channels, head, format, encoding };
            return Ok((part, Rows::Exr(Box::new(lines))));
        }
        let rows = PictureRows::open(&path)?;
        let (window, whole, scene, encoding) = (rows.window, rows.whole, rows.scene(), rows.encoding);
        let (channels, head) = (Vec::new(), ExrHead::default());
        let part = Part { path, window, whole, scene, channels, head, format, encoding };
        Ok((part, Rows::Picture(Box::new(rows))))
    }

    /// Refuses a part that cannot belong to the same picture as `self`.
    fn check(&self, other: &Part) -> Result<()> {
        let names = format!("{} and {}", self.path.display(), other.path.display());
        let refuse = |why: String| Err(Error::input(format!("{names} {why}"), "stitch crops of one picture"));
        let [[w, h], [other_w, other_h]] = [self.whole, other.whole];
        if self.format != other.format {
            return refuse(format!("are a {} and a {} file", self.format.name(), other.format.name()));
        }
        if self.encoding != other.encoding {
            return refuse(format!("have other samples ({} and {})", self.encoding, other.encoding));
        }
        if self.whole != other.whole {
            return refuse(format!(
                "are crops of pictures of different sizes ({w}×{h} and {other_w}×{other_h} pixels)"
            ));
        }
        if self.channels != other.channels {
            return refuse(format!(
                "have different layers ({} and {})",
                listed(&self.channels),
                listed(&other.channels)
            ));
        }
        if self.head.gamut != other.head.gamut {
            return refuse("have colours in different primaries".into());
        }
        if self.scene != other.scene {
            return refuse(format!(
                "show different scenes ({})",
                first_difference(&self.scene, &other.scene)
            ));
        }
        Ok(())
    }
}

/// Describes how two scene texts differ: the first pair of lines that are not equal.
fn first_difference(a: &Option<String>, b: &Option<String>) -> String {
    match (a, b) {
        (Some(a), Some(b)) => {
            let lines = a.lines().zip(b.lines()).find(|(a, b)| a != b);
            lines.map_or("one has more lines".into(), |(a, b)| format!("{a:?} and {b:?}"))
        }
        _ => "one file does not name its scene".into(),
    }
}

/// Parts that are open for reading, from a part's first row to its last.
struct Readers<'a> {
    parts: &'a [Part],
    /// Indices of parts that are not open yet, sorted by first row.
    waiting: Peekable<std::vec::IntoIter<usize>>,
    open: Vec<Reader>,
}

/// An open part: its index, its rows, and the row read last.
struct Reader {
    index: usize,
    rows: Rows,
    row: Vec<u8>,
}

impl<'a> Readers<'a> {
    fn new(parts: &'a [Part]) -> Self {
        let mut order: Vec<usize> = (0..parts.len()).collect();
        order.sort_by_key(|&i| parts[i].window.y);
        Readers { parts, waiting: order.into_iter().peekable(), open: Vec::new() }
    }

    /// Opens the parts whose first row is `y`.
    fn open_at(&mut self, y: u32) -> Result<()> {
        while let Some(index) = self.waiting.next_if(|&i| self.parts[i].window.y == y) {
            let (part, rows) = Part::open(&self.parts[index].path)?;
            if part.window != self.parts[index].window {
                let what = format!("{} changed while it was read", part.path.display());
                return Err(Error::input(what, "run the command again"));
            }
            self.open.push(Reader { index, rows, row: Vec::new() });
        }
        Ok(())
    }

    /// Reads row `y` of every open part and draws it on the canvas.
    fn draw_row(&mut self, y: u32, canvas: &mut Canvas) -> Result<()> {
        for Reader { index, rows, row } in &mut self.open {
            let part = &self.parts[*index];
            match rows {
                Rows::Picture(rows) => {
                    row.resize(rows.row_bytes(), 0);
                    rows.read_row(row)?;
                }
                Rows::Exr(lines) => lines.read_line(row)?,
            }
            canvas.draw(*index, part.window, row).map_err(|(x, other)| {
                Error::input(
                    format!(
                        "{} and {} differ at the pixel ({x}, {y})",
                        self.parts[other].path.display(),
                        part.path.display()
                    ),
                    "they are crops of different pictures: render one of them again, with the same engine",
                )
            })?;
        }
        Ok(())
    }

    /// Closes the parts whose last row is `y` and adds their figures to the sum.
    fn close_after(&mut self, y: u32, sum: &mut FigureSum) -> Result<()> {
        let ended = |reader: &Reader| self.parts[reader.index].window.bottom() == y + 1;
        let (ended, open): (Vec<Reader>, Vec<Reader>) =
            std::mem::take(&mut self.open).into_iter().partition(ended);
        self.open = open;
        for Reader { index, rows, .. } in ended {
            let figures = match rows {
                Rows::Picture(rows) => rows.finish()?,
                Rows::Exr(lines) => lines.finish().map(|()| None)?,
            };
            sum.add(index, figures.as_ref());
        }
        Ok(())
    }
}

/// The figures of the whole picture, added up from its parts.
struct FigureSum {
    /// By index of the part, whether its figures count.
    counts: Vec<bool>,
    /// `None` where the sum is unknown.
    total: Option<Figures>,
}

impl FigureSum {
    fn new(format: Format, whole: [u32; 2], parts: &[Part]) -> FigureSum {
        let windows: Vec<Window> = parts.iter().map(|part| part.window).collect();
        let counts = disjoint_cover(whole, &windows);
        let total = (format.is_developed() && counts.is_some()).then(Figures::default);
        FigureSum { counts: counts.unwrap_or_default(), total }
    }

    fn add(&mut self, index: usize, figures: Option<&Figures>) {
        if self.counts.get(index) == Some(&true) {
            match (&mut self.total, figures) {
                (Some(total), Some(figures)) => total.add(figures),
                _ => self.total = None,
            }
        }
    }
}

/// The output file. Rows of a developed picture reach it in pieces of about [`PIECE_BYTES`], lines of an EXR
/// one by one.
struct RowSink {
    sink: Sink,
    format: Format,
    /// Rows of a developed picture that are not yet with the encoder.
    piece: Vec<u8>,
    /// Channels of the lines and of the file, if they differ.
    recode: Option<(Vec<Channel>, Vec<Channel>)>,
}

impl RowSink {
    fn push(&mut self, row: &[u8]) -> Result<()> {
        if self.format == Format::Exr {
            let line = match &self.recode {
                Some((from, to)) => recoded(row, from, to),
                None => row.to_owned(),
            };
            return self.sink.push(line);
        }
        self.piece.extend_from_slice(row);
        if self.piece.len() >= PIECE_BYTES {
            self.sink.push(std::mem::take(&mut self.piece))?;
        }
        Ok(())
    }

    fn finish(mut self, figures: Option<&Figures>) -> Result<()> {
        if !self.piece.is_empty() {
            self.sink.push(self.piece)?;
        }
        self.sink.finish(figures)
    }
}

/// Leaves out windows that lie inside another. If the rest cover every pixel exactly once, returns by window
/// whether it is one of them.
fn disjoint_cover(whole: [u32; 2], windows: &[Window]) -> Option<Vec<bool>> {
    // Equal windows lie inside one another; the first one stays.
    let inside = |i: usize, j: usize| windows[j].holds(&windows[i]) && (windows[i] != windows[j] || j < i);
    let counts: Vec<bool> =
        (0..windows.len()).map(|i| !(0..windows.len()).any(|j| j != i && inside(i, j))).collect();
    let pixels: u64 =
        windows.iter().zip(&counts).filter(|(_, counts)| **counts).map(|(w, _)| w.pixels()).sum();
    // The windows cover the picture, so an equal number of pixels means that none is covered twice.
    (pixels == Window::whole(whole).pixels()).then_some(counts)
}

/// Returns the first rectangle, from the top left, that no window covers; `None` if there is no gap.
fn gap([width, height]: [u32; 2], windows: &[Window]) -> Option<Window> {
    let mut edges: Vec<u32> = windows.iter().flat_map(|w| [w.y, w.bottom()]).chain([0, height]).collect();
    edges.sort_unstable();
    edges.dedup();
    let mut gap: Option<Window> = None;
    for rows in edges.windows(2) {
        let (y, bottom) = (rows[0], rows[1]);
        let mut spans: Vec<(u32, u32)> =
            windows.iter().filter(|w| w.y <= y && w.bottom() >= bottom).map(|w| (w.x, w.right())).collect();
        spans.sort_unstable();
        let free = |first: u32, last: u32| spans.iter().all(|s| s.1 <= first || s.0 >= last);
        match &mut gap {
            None => {
                let mut x = 0;
                for &(left, right) in &spans {
                    if left > x {
                        break;
                    }
                    x = x.max(right);
                }
                if x < width {
                    let next = spans.iter().map(|s| s.0).filter(|&left| left > x).min().unwrap_or(width);
                    gap = Some(Window { x, y, width: next - x, height: bottom - y });
                }
            }
            Some(gap) if free(gap.x, gap.right()) => gap.height = bottom - gap.y,
            Some(_) => break,
        }
    }
    gap
}
