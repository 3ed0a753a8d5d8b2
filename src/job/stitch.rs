//! Parts of an image joined to the file of the whole.

use std::path::{Path, PathBuf};

use super::{About, Sink};
use crate::output::frame::{ExrLines, Figures, Kind, PngRows, SCENE_TEXT};
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::window::Window;

/// Bytes of rows handed to the PNG encoder at a time.
const PIECE_BYTES: usize = 1 << 20;

/// A part's file while its rows are read.
enum Rows {
    Png(Box<PngRows>),
    Exr(Box<ExrLines>),
}

/// A part, known by what stands before its pixels.
struct Part {
    path: PathBuf,
    window: Window,
    whole: [u32; 2],
    scene: Option<String>,
    channels: Vec<String>,
    kind: Kind,
}

impl Part {
    fn open(path: &Path) -> Result<(Part, Rows)> {
        let kind = Kind::of(path)?;
        let path_buf = path.to_owned();
        Ok(match kind {
            Kind::Png => {
                let rows = PngRows::open(path)?;
                let (window, whole, scene) = (rows.window, rows.whole, rows.text(SCENE_TEXT));
                let part = Part { path: path_buf, window, whole, scene, channels: Vec::new(), kind };
                (part, Rows::Png(Box::new(rows)))
            }
            Kind::Exr => {
                let lines = ExrLines::open(path)?;
                let (window, whole, scene) = (lines.window, lines.whole, lines.scene());
                let part =
                    Part { path: path_buf, window, whole, scene, channels: lines.channels.clone(), kind };
                (part, Rows::Exr(Box::new(lines)))
            }
        })
    }

    /// Refuses a part that cannot belong to the same picture as `self`.
    fn check(&self, other: &Part) -> Result<()> {
        let names = format!("{} and {}", self.path.display(), other.path.display());
        let refuse = |why: String| Err(Error::input(format!("{names} {why}"), "stitch parts of one picture"));
        let [[w, h], [other_w, other_h]] = [self.whole, other.whole];
        if self.kind != other.kind {
            return refuse("are a PNG and an EXR".into());
        }
        if self.whole != other.whole {
            return refuse(format!("are parts of pictures of {w}×{h} and {other_w}×{other_h} pixels"));
        }
        if self.channels != other.channels {
            return refuse(format!(
                "have other layers: {} and {}",
                self.channels.join(" "),
                other.channels.join(" ")
            ));
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

fn first_difference(a: &Option<String>, b: &Option<String>) -> String {
    match (a, b) {
        (Some(a), Some(b)) => {
            let lines = a.lines().zip(b.lines()).find(|(a, b)| a != b);
            lines.map_or("one is longer".into(), |(a, b)| format!("{a:?} and {b:?}"))
        }
        _ => "one does not tell its scene".into(),
    }
}

/// A part being read: its number, its rows, and the row in hand.
struct Open {
    number: usize,
    rows: Rows,
    row: Vec<u8>,
}

/// Joins crops of one picture, which must cover it and may overlap where their pixels are equal, to
/// `output`: byte for byte the file of the whole. Holds a few rows at a time and the files that meet them.
///
/// The figures of a PNG are added up from those of its parts, without parts that lie wholly in another;
/// where others overlap they cannot be known, and the file has none.
///
/// # Errors
/// [`Error::Input`] for parts of different pictures, gaps, and overlaps that differ.
pub fn stitch(parts: &[PathBuf], output: &Path, monitor: &dyn Monitor) -> Result<Option<Figures>> {
    let parts =
        parts.iter().map(|path| Part::open(path).map(|(part, _)| part)).collect::<Result<Vec<_>>>()?;
    let Some(first) = parts.first() else {
        return Err(Error::Usage("there is nothing to stitch: give the files of the parts".into()));
    };
    parts.iter().try_for_each(|part| first.check(part))?;
    let windows: Vec<Window> = parts.iter().map(|part| part.window).collect();
    if let Some(gap) = gap(first.whole, &windows) {
        return Err(Error::input(
            format!("the parts leave a gap: no file has the pixels {gap} (column, row, width, height)"),
            format!("render them with --crop {gap} and add the file"),
        ));
    }
    let kind = first.kind;
    let of_kind = output.extension().map(|e| e.to_string_lossy().to_lowercase());
    let extension = match kind {
        Kind::Png => "png",
        Kind::Exr => "exr",
    };
    if of_kind.as_deref() != Some(extension) {
        let what = format!("-o {}: the parts make a .{extension}", output.display());
        return Err(Error::Usage(what));
    }
    let about = About {
        whole: first.whole,
        window: Window::whole(first.whole),
        scene: first.scene.clone(),
        channels: first.channels.clone(),
    };
    let mut sink = Sink::create(output, &about)?;
    let counted = counted(first.whole, &windows);
    let mut figures = (kind == Kind::Png && counted.is_some()).then(Figures::default);
    let counts = counted.unwrap_or_default();

    let mut canvas = Canvas::new(kind, first.whole[0], about.channels.len());
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by_key(|&i| windows[i].y);
    let mut waiting = order.into_iter().peekable();
    let mut open: Vec<Open> = Vec::new();
    let mut piece = Vec::new();
    for y in 0..first.whole[1] {
        monitor.progress("rows", u64::from(y), u64::from(first.whole[1]))?;
        while let Some(number) = waiting.next_if(|&i| windows[i].y == y) {
            let (part, rows) = Part::open(&parts[number].path)?;
            if part.window != windows[number] {
                let what = format!("{} changed while it was read", part.path.display());
                return Err(Error::input(what, "run the command again"));
            }
            open.push(Open { number, rows, row: Vec::new() });
        }
        canvas.clear();
        for Open { number, rows, row } in &mut open {
            match rows {
                Rows::Png(rows) => {
                    row.resize(3 * windows[*number].width as usize, 0);
                    rows.read_row(row)?;
                }
                Rows::Exr(lines) => lines.read_line(row)?,
            }
            canvas.draw(*number, windows[*number], row).map_err(|(x, other)| {
                Error::input(
                    format!(
                        "{} and {} differ at the pixel ({x}, {y})",
                        parts[other].path.display(),
                        parts[*number].path.display()
                    ),
                    "they are not of one picture: render one of them again, with the same engine",
                )
            })?;
        }
        match kind {
            Kind::Png => {
                piece.extend_from_slice(&canvas.row);
                if piece.len() >= PIECE_BYTES {
                    sink.push(std::mem::take(&mut piece))?;
                }
            }
            Kind::Exr => sink.push(canvas.row.clone())?,
        }
        let (ended, rest): (Vec<Open>, Vec<Open>) =
            open.into_iter().partition(|part| windows[part.number].bottom() == y + 1);
        open = rest;
        for Open { number, rows, .. } in ended {
            let own = match rows {
                Rows::Png(rows) => rows.finish()?,
                Rows::Exr(lines) => lines.finish().map(|()| None)?,
            };
            if counts.get(number) == Some(&true) {
                match (&mut figures, own) {
                    (Some(sum), Some(own)) => sum.add(&own),
                    _ => figures = None,
                }
            }
        }
    }
    if !piece.is_empty() {
        sink.push(piece)?;
    }
    if kind == Kind::Png && figures.is_none() {
        monitor.warn("the parts overlap or have no figures: the figures of the whole are not known");
    }
    sink.finish(figures.as_ref())?;
    Ok(figures)
}

/// The row that is put together.
struct Canvas {
    width: usize,
    /// Bytes of a pixel that lie together, and how often a row has such.
    item: usize,
    planes: usize,
    row: Vec<u8>,
    /// The part each pixel came from, plus 1; 0: none yet.
    owner: Vec<u32>,
}

impl Canvas {
    fn new(kind: Kind, width: u32, channels: usize) -> Canvas {
        let (item, planes) = match kind {
            Kind::Png => (3, 1),
            Kind::Exr => (4, channels),
        };
        let width = width as usize;
        Canvas { width, item, planes, row: vec![0; width * item * planes], owner: vec![0; width] }
    }

    fn clear(&mut self) {
        self.owner.fill(0);
    }

    /// Draws the row of part `number`; the column and the other part where they differ.
    fn draw(&mut self, number: usize, window: Window, row: &[u8]) -> std::result::Result<(), (usize, usize)> {
        let (item, count, first) = (self.item, window.width as usize, window.x as usize);
        let mut at = 0;
        while at < count {
            let owner = self.owner[first + at];
            // Pixels with one owner are drawn or compared together.
            let run = self.owner[first + at..first + count].iter().take_while(|&&o| o == owner).count();
            for plane in 0..self.planes {
                let target = item * (plane * self.width + first + at)..;
                let target = &mut self.row[target][..item * run];
                let source = &row[item * (plane * count + at)..][..item * run];
                if owner == 0 {
                    target.copy_from_slice(source);
                } else if let Some(byte) = (0..item * run).find(|&i| target[i] != source[i]) {
                    return Err((first + at + byte / item, owner as usize - 1));
                }
            }
            if owner == 0 {
                self.owner[first + at..][..run].fill(number as u32 + 1);
            }
            at += run;
        }
        Ok(())
    }
}

/// Which parts count for the figures of the whole, if these together have each pixel once.
fn counted(whole: [u32; 2], windows: &[Window]) -> Option<Vec<bool>> {
    let inside = |i: usize, j: usize| windows[j].holds(&windows[i]) && (windows[i] != windows[j] || j < i);
    let counts: Vec<bool> =
        (0..windows.len()).map(|i| !(0..windows.len()).any(|j| j != i && inside(i, j))).collect();
    let pixels: u64 =
        windows.iter().zip(&counts).filter(|(_, counts)| **counts).map(|(w, _)| w.pixels()).sum();
    (pixels == Window::whole(whole).pixels()).then_some(counts)
}

/// The first rectangle, from the top left, that no window covers.
fn gap([width, height]: [u32; 2], windows: &[Window]) -> Option<Window> {
    let mut edges: Vec<u32> = windows.iter().flat_map(|w| [w.y, w.bottom()]).chain([0, height]).collect();
    edges.sort_unstable();
    edges.dedup();
    let mut found: Option<Window> = None;
    for rows in edges.windows(2) {
        let (y, bottom) = (rows[0], rows[1]);
        let mut spans: Vec<(u32, u32)> =
            windows.iter().filter(|w| w.y <= y && w.bottom() >= bottom).map(|w| (w.x, w.right())).collect();
        spans.sort_unstable();
        let free = |first: u32, last: u32| spans.iter().all(|s| s.1 <= first || s.0 >= last);
        match &mut found {
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
                    found = Some(Window { x, y, width: next - x, height: bottom - y });
                }
            }
            Some(gap) if free(gap.x, gap.right()) => gap.height = bottom - gap.y,
            Some(_) => break,
        }
    }
    found
}
