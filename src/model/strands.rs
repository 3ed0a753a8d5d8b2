//! Strands of hair in files `.hair`, as Cem Yuksel's hair models are stored
//! (<http://www.cemyuksel.com/research/hairmodels>).
//!
//! All numbers are little-endian. A header of 128 bytes stands first:
//!
//! | byte | content |
//! |--:|---|
//! | 0 | the letters HAIR |
//! | 4 | u32: number of strands |
//! | 8 | u32: number of points |
//! | 12 | u32: arrays in the file, a bit each: segments 1, points 2, thickness 4, transparency 8, colours 16 |
//! | 16 | u32: segments of a strand, without their array |
//! | 20 | f32: thickness, without its array |
//! | 24 | f32: transparency, f32 × 3: colour, without their arrays |
//! | 40 | text of 88 bytes |
//!
//! The arrays follow in the order of their bits: u16 segments of each strand, f32 × 3 each point, f32
//! thickness of each point; the others are not read. A strand of n segments has n + 1 points, from its root
//! to its tip. Such files say nothing about units; in the models of their author z points up.

use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::path::Path;

use glam::Vec3;

use crate::util::error::{Error, Result};

const MAGIC: &[u8; 4] = b"HAIR";
const HEADER: usize = 128;
const SEGMENTS: u32 = 1;
const POINTS: u32 = 2;
const THICKNESS: u32 = 4;
/// Most segments of a strand.
const MOST_SEGMENTS: usize = u16::MAX as usize;
/// Numbers that are read at once.
const CHUNK: usize = 1 << 14;

/// Largest coordinate of a point, in the file's unit. Beyond it are slips; squares of lengths still have a
/// float32.
const FARTHEST: f32 = 1e12;

/// Whether a point is one that a strand may have.
pub(super) fn is_place(point: Vec3) -> bool {
    point.is_finite() && point.abs().max_element() <= FARTHEST
}

/// Strands as rows of points, each from its root to its tip.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strands {
    /// Number of the first point of each strand, and behind the last the number of all points.
    pub starts: Vec<u32>,
    /// Points, in the file's unit.
    pub points: Vec<Vec3>,
    /// Diameter at each point, in the file's unit.
    pub widths: Vec<f32>,
}

impl Strands {
    /// Number of strands.
    pub fn count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Points of a strand, and the diameters there.
    pub fn strand(&self, number: usize) -> (&[Vec3], &[f32]) {
        let range = self.starts[number] as usize..self.starts[number + 1] as usize;
        (&self.points[range.clone()], &self.widths[range])
    }

    /// Adds a strand.
    pub fn push(&mut self, points: impl IntoIterator<Item = (Vec3, f32)>) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        for (point, width) in points {
            self.points.push(point);
            self.widths.push(width);
        }
        self.starts.push(self.points.len() as u32);
    }

    /// Least and greatest coordinates of the points; `None` without points.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let first = *self.points.first()?;
        Some(self.points.iter().fold([first; 2], |[low, high], p| [low.min(*p), high.max(*p)]))
    }

    /// Reads a `.hair` within `budget` bytes.
    ///
    /// # Errors
    /// [`Error::Input`] for a file of another kind, one that ends early, and numbers that are not finite;
    /// [`Error::Io`] where it cannot be read; [`Error::Memory`] for one that is too large.
    pub fn read(path: &Path, budget: u64) -> Result<Strands> {
        let fault = |what: String| {
            Error::input(
                format!("{}: {what}", path.display()),
                "export it again as .hair (Yuksel's format), or check that it was copied whole",
            )
        };
        let meta = std::fs::metadata(path).map_err(|e| Error::open(path, e))?;
        if !meta.is_file() {
            // A pipe would be waited for without end.
            let fix = "give a .hair in the format of Yuksel's hair models";
            return Err(Error::input(format!("{} is not a regular file", path.display()), fix));
        }
        let length = meta.len();
        let file = File::open(path).map_err(|e| Error::open(path, e))?;
        let mut input = BufReader::with_capacity(1 << 16, file);
        let mut header = [0; HEADER];
        let start = &mut header[..(HEADER as u64).min(length) as usize];
        input.read_exact(start).map_err(|e| Error::read(path, e))?;
        if !start.starts_with(MAGIC) {
            return Err(fault("is no file of hair: it does not begin with the letters HAIR".into()));
        }
        if length < HEADER as u64 {
            return Err(fault(format!("ends early: it is {length} bytes long, and its head takes {HEADER}")));
        }
        let word = |at: usize| [header[at], header[at + 1], header[at + 2], header[at + 3]];
        let [strands, points, flags, segments] = [4, 8, 12, 16].map(|at| u32::from_le_bytes(word(at)));
        let thickness = f32::from_le_bytes(word(20));
        if flags & POINTS == 0 || strands == 0 {
            return Err(fault("has no strands".into()));
        }
        // The bytes that the arrays need are compared with the file before memory is taken.
        let [of_strands, of_points] = [u64::from(strands), u64::from(points)];
        if of_strands > of_points {
            return Err(fault(format!("has {strands} strands and {points} points")));
        }
        let own = |flag: u32, bytes: u64| if flags & flag != 0 { bytes } else { 0 };
        let want =
            HEADER as u64 + own(SEGMENTS, 2 * of_strands) + 12 * of_points + own(THICKNESS, 4 * of_points);
        if length < want {
            let bytes = format!("{length} bytes long, and {strands} strands of {points} points take {want}");
            return Err(fault(format!("ends early: it is {bytes}")));
        }
        let need = 4 * (of_strands + 1) + 16 * of_points;
        if need > budget {
            let what = format!("{} with {points} points", path.display());
            return Err(Error::memory(
                what,
                u128::from(need),
                budget,
                "export fewer strands, or raise --memory",
            ));
        }
        let mut starts = Vec::with_capacity(strands as usize + 1);
        starts.push(0);
        let mut sum = 0u64;
        let mut bytes = vec![0; 2 * CHUNK];
        for first in (0..strands as usize).step_by(CHUNK) {
            let count = CHUNK.min(strands as usize - first);
            if flags & SEGMENTS != 0 {
                input.read_exact(&mut bytes[..2 * count]).map_err(|e| Error::read(path, e))?;
            }
            for pair in bytes[..2 * count].as_chunks::<2>().0 {
                let own = if flags & SEGMENTS != 0 { u32::from(u16::from_le_bytes(*pair)) } else { segments };
                sum += u64::from(own) + 1;
                starts.push(sum.min(u64::from(u32::MAX)) as u32);
            }
        }
        if sum != of_points {
            return Err(fault(format!("its strands have {sum} points, and the file {points}")));
        }
        let numbers = floats(&mut input, 3 * points as usize).map_err(|e| Error::read(path, e))?;
        let points: Vec<Vec3> = numbers.as_chunks::<3>().0.iter().map(|p| Vec3::from_array(*p)).collect();
        let widths = match flags & THICKNESS {
            0 => vec![thickness; points.len()],
            _ => floats(&mut input, points.len()).map_err(|e| Error::read(path, e))?,
        };
        if let Some(at) = points.iter().position(|point| !is_place(*point)) {
            return Err(fault(format!("point {at} is {}", points[at])));
        }
        if let Some(at) = widths.iter().position(|width| !(width.is_finite() && *width >= 0.0)) {
            return Err(fault(format!("the thickness of point {at} is {}", widths[at])));
        }
        Ok(Strands { starts, points, widths })
    }

    /// Writes a `.hair` with segments, points and thickness. Strands of a single point are left out, and
    /// further segments than a file can hold.
    ///
    /// # Errors
    /// Returns the first error of `out`.
    pub fn write(&self, mut out: impl Write) -> std::io::Result<()> {
        let strands = || {
            let all = (0..self.count()).map(|i| self.strand(i)).filter(|(points, _)| points.len() > 1);
            all.map(|(points, widths)| {
                let kept = points.len().min(MOST_SEGMENTS + 1);
                (&points[..kept], &widths[..kept])
            })
        };
        let points: usize = strands().map(|(points, _)| points.len()).sum();
        let mut header = [0; HEADER];
        header[..4].copy_from_slice(MAGIC);
        let words = [strands().count() as u32, points as u32, SEGMENTS | POINTS | THICKNESS];
        for (word, place) in words.iter().zip(header[4..].as_chunks_mut::<4>().0) {
            *place = word.to_le_bytes();
        }
        out.write_all(&header)?;
        for (points, _) in strands() {
            out.write_all(&((points.len() - 1) as u16).to_le_bytes())?;
        }
        for point in strands().flat_map(|(points, _)| points) {
            for x in point.to_array() {
                out.write_all(&x.to_le_bytes())?;
            }
        }
        for width in strands().flat_map(|(_, widths)| widths) {
            out.write_all(&width.to_le_bytes())?;
        }
        out.flush()
    }
}

/// Reads `count` numbers.
fn floats(input: &mut impl Read, count: usize) -> std::io::Result<Vec<f32>> {
    let mut numbers = Vec::with_capacity(count);
    let mut bytes = vec![0; 4 * CHUNK];
    while numbers.len() < count {
        let part = &mut bytes[..4 * CHUNK.min(count - numbers.len())];
        input.read_exact(part)?;
        numbers.extend(part.as_chunks::<4>().0.iter().map(|own| f32::from_le_bytes(*own)));
    }
    Ok(numbers)
}
