//! Volume files: NumPy `.npz` with `rho` float32 [nz,ny,nx], `v` float32 [nz,ny,nx,3], `k` float32
//! [nz,ny,nx,2] and the scalar `alpha`.
//!
//! The arrays hold the values that the renderer uses, as they are after packing. `rho` includes α; `v` is
//! unit or zero. `alpha` makes reading exact, because the cells hold ρ/α. A file without it is read with α =
//! 1.
//!
//! Files of other programs may hold numbers of other types, in Fortran order, and no `k`. They are converted
//! while they are read, with a note. An array in C order is read once. An array in Fortran order
//! is read several times if memory is short: each time the numbers of one range of cells are kept.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::Path;

use glam::Vec3;
use npyz::WriterBuilder;
use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

use super::bricks::{BRICK, Bricks, Packer};
use super::storage::{Storage, StorageChoice, check_stored, file_storage};
use super::{Cell, Cells, VolumeTexture};
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::npy::{Number, Numbers, open_array};

/// Largest distance of |v| from 1 at which v counts as a unit vector: float32 rounding, with room for files
/// that other programs wrote in lower precision.
const UNIT_TOLERANCE: f32 = 1e-3;

/// Largest distance of |v| from 1 at which v is normalised. Interpolated and averaged directions lie farther
/// away, and so do velocities.
const NEAR_UNIT: f32 = 1e-2;

/// Advice that shows the whole format.
const FORMAT: &str = "a volume file is an .npz with rho [nz,ny,nx] and v [nz,ny,nx,3], and perhaps k \
                      [nz,ny,nx,2] and alpha; see docs/scenes-and-files.md#volume-files";
const FIX_V: &str = "divide v by its length where it has one: n = numpy.linalg.norm(v, axis=-1, \
                     keepdims=True); v = v / numpy.where(n > 0, n, 1)";
const FIX_V_FINITE: &str = "empty such cells: bad = ~numpy.isfinite(v).all(-1); v[bad] = 0; rho[bad] = 0";
const WITHOUT_K: &str = "; without k all cells take volume.k_d and volume.k_s";
const FIX_NO_V: &str = "save the flow as v [nz,ny,nx,3]; where nothing is known about it, let all water fall \
                        straight down: v = numpy.zeros((*rho.shape, 3)); v[..., 1] = 1";
const FIX_ALPHA: &str = "save alpha as one number from 0 to 1, or leave alpha out, which means 1";

/// Writes `volume` to `out` as `.npz`. The bytes depend on the volume alone.
///
/// # Errors
/// Returns the first error of `out`.
pub fn write_npz(volume: &VolumeTexture, out: impl Write + Seek) -> std::io::Result<()> {
    let [nx, ny, nz] = volume.size.map(u64::from);
    let mut zip = ZipWriter::new(UntilError { out, position: 0, failed: false });
    let cells = &volume.cells;
    let rho = cells.iter().map(|c| c.rho() * volume.alpha);
    write_array(&mut zip, "rho", &[nz, ny, nx], rho)?;
    let v = cells.iter().flat_map(|c| c.v().to_array());
    write_array(&mut zip, "v", &[nz, ny, nx, 3], v)?;
    let k = cells.iter().flat_map(|c| <[f32; 2]>::from(c.k()));
    write_array(&mut zip, "k", &[nz, ny, nx, 2], k)?;
    write_array(&mut zip, "alpha", &[], std::iter::once(volume.alpha))?;
    zip.finish()?.flush()
}

/// Writer that passes everything on until the first error and then pretends to succeed. [`ZipWriter`] goes on
/// writing when it is dropped, and complains on stderr when that fails.
struct UntilError<W> {
    out: W,
    position: u64,
    failed: bool,
}

impl<W> UntilError<W> {
    /// Remembers a failure that trying again cannot mend.
    fn note<T>(&mut self, done: std::io::Result<T>) -> std::io::Result<T> {
        self.failed |= done.as_ref().is_err_and(|e| e.kind() != ErrorKind::Interrupted);
        done
    }
}

impl<W: Write> Write for UntilError<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = if self.failed { Ok(bytes.len()) } else { self.out.write(bytes) };
        self.position += *written.as_ref().unwrap_or(&0) as u64;
        self.note(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        let flushed = if self.failed { Ok(()) } else { self.out.flush() };
        self.note(flushed)
    }
}

impl<W: Seek> Seek for UntilError<W> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        let moved = match (self.failed, to) {
            (false, to) => self.out.seek(to),
            (true, SeekFrom::Start(position)) => Ok(position),
            (true, SeekFrom::Current(by) | SeekFrom::End(by)) => Ok(self.position.saturating_add_signed(by)),
        };
        self.position = *moved.as_ref().unwrap_or(&self.position);
        self.note(moved)
    }
}

/// Adds one float32 array to the archive.
fn write_array<W: Write + Seek>(
    zip: &mut ZipWriter<W>,
    name: &str,
    shape: &[u64],
    values: impl Iterator<Item = f32>,
) -> std::io::Result<()> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(1))
        .large_file(true)
        // A date would make the files of equal volumes differ.
        .last_modified_time(zip::DateTime::default());
    zip.start_file(npyz::npz::file_name_from_array_name(name), options)?;
    let mut buffered = std::io::BufWriter::with_capacity(1 << 16, zip);
    let mut writer =
        npyz::WriteOptions::new().default_dtype().shape(shape).writer(&mut buffered).begin_nd()?;
    writer.extend(values)?;
    writer.finish()?;
    buffered.flush()
}

/// How a volume file is read.
#[derive(Clone, Copy, Debug)]
pub struct ReadOptions {
    /// Storage of the cells. [`StorageChoice::Auto`] is sparse if a dense volume does not fit.
    pub storage: StorageChoice,
    /// Memory that reading and the volume may take, bytes.
    pub budget: u64,
    /// k_d and k_s of every cell, for a file without `k`.
    pub k: [f32; 2],
}

/// The defaults of `--memory`, `volume.k_d` and `volume.k_s`.
impl Default for ReadOptions {
    fn default() -> Self {
        ReadOptions { storage: StorageChoice::Auto, budget: 4 << 30, k: [0.5; 2] }
    }
}

/// Reads a volume file. Every value is checked, and nothing of the size that the file claims is allocated
/// before that size is compared with the budget. `monitor` is told what was converted.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, [`Error::Input`] if it is missing or not a valid volume file,
/// and [`Error::Memory`] if the volume does not fit into the budget.
pub fn read_npz(path: &Path, options: &ReadOptions, monitor: &dyn Monitor) -> Result<VolumeTexture> {
    let file = open(path)?;
    let zip = ZipArchive::new(BufReader::new(file)).map_err(|e| {
        let mut start = [0; 6];
        let is_array = File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok()
            && &start == b"\x93NUMPY";
        match is_array {
            true => invalid(
                path,
                "it is an .npy, which holds one array".into(),
                "write all of them with numpy.savez(\"volume.npz\", rho=rho, v=v)",
            ),
            false => invalid(path, format!("it is no .npz ({e})"), FORMAT),
        }
    })?;
    let mut reader = Reader { path, options, spare: 0, zip, notes: Vec::new() };
    let volume = reader.volume()?;
    reader.notes.iter().for_each(|note| monitor.warn(&format!("{}: {note}", path.display())));
    Ok(volume)
}

/// Checks that a volume file is there and may be read, but not what is in it.
///
/// # Errors
/// As [`read_npz`].
pub fn check_npz(path: &Path) -> Result<()> {
    open(path).map(drop)
}

fn open(path: &Path) -> Result<File> {
    let meta = std::fs::metadata(path).map_err(|e| Error::open(path, e))?;
    if !meta.is_file() {
        return Err(Error::input(
            format!("{} is not a regular file", path.display()),
            "give an .npz file made by `taki volume build` or NumPy's savez",
        ));
    }
    File::open(path).map_err(|e| Error::open(path, e))
}

/// Whether the volume file has reflection coefficients of its own. A file that cannot be read counts as one
/// that has.
pub fn has_reflection(path: &Path) -> bool {
    let zip = File::open(path).ok().and_then(|file| ZipArchive::new(BufReader::new(file)).ok());
    zip.is_none_or(|zip| zip.index_for_name("k.npy").is_some())
}

/// Error about the contents of the file.
fn invalid(path: &Path, what: String, fix: impl Into<String>) -> Error {
    Error::input(format!("{}: {what}", path.display()), fix)
}

/// A fault in a cell and advice on how to mend it.
struct Fault(String, String);

type Checked = std::result::Result<(), Fault>;

/// Header of an array.
struct Head {
    name: &'static str,
    shape: Vec<u64>,
    number: Number,
    /// Whether the first index varies fastest, not the last.
    fortran: bool,
    /// Whether the numbers are codes 0 to 255 of 0 to 1.
    codes: bool,
}

impl Head {
    /// Tells how the array differs from one that taki writes.
    fn note(&self) -> Option<String> {
        let number = (self.number != Number::FLOAT32).then(|| self.number.words());
        let from = match (number, self.fortran) {
            (None, false) => return None,
            (None, true) => "Fortran order".into(),
            (Some(number), false) => number,
            (Some(number), true) => format!("{number} in Fortran order"),
        };
        let codes = if self.codes { ": codes 0 to 255 mean 0 to 1" } else { "" };
        Some(format!("{} is converted from {from}{codes}", self.name))
    }
}

/// Reader of one volume file.
struct Reader<'a> {
    path: &'a Path,
    options: &'a ReadOptions,
    /// Memory for numbers of arrays in Fortran order, bytes.
    spare: u64,
    zip: ZipArchive<BufReader<File>>,
    /// Conversions so far, a sentence each.
    notes: Vec<String>,
}

impl Reader<'_> {
    fn volume(&mut self) -> Result<VolumeTexture> {
        let (alpha, mut slack) = self.alpha()?;
        let rho = self.head("rho")?;
        let shape = &rho.shape;
        let &[nz, ny, nx] = shape.as_slice() else {
            return Err(self.fault(&rho, format!("shape is {shape:?}, not [nz,ny,nx]"), FORMAT));
        };
        let size = [nx, ny, nz].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        if size.contains(&0) {
            let what = format!("shape is {shape:?}: a volume has at least one cell");
            return Err(self.fault(&rho, what, FORMAT));
        }
        let ReadOptions { storage, budget, k } = *self.options;
        let mut cells = match file_storage(size, storage, budget)? {
            Storage::Dense => {
                let cells = nx * ny * nz * size_of::<Cell>() as u64;
                // This holds the largest array, v: `file_storage` has asked for a vector beside each cell.
                self.spare = budget - cells;
                self.directions(size)?
            }
            Storage::Sparse => {
                // Bricks may fill half of the budget, because a copy on the device is to fit beside them.
                self.spare = budget / 4;
                self.packed_directions(size)?
            }
        };
        slack += alpha * 1e-6 + rho.number.rounding(alpha, rho.codes);
        let mut cursor = CellCursor::new(size);
        let mut outside = false;
        let read = self.each(&rho, size, |_, [value]: [f32; 1]| {
            let cell = cursor.next(&mut cells);
            if !(0.0..=1.0).contains(&value) {
                outside = true;
                return Err(Fault(format!("{value} is outside 0..=1"), String::new()));
            }
            if value > alpha + slack {
                return Err(Fault(
                    format!("{value} is more than the file's alpha {alpha}"),
                    "leave alpha out, or save the largest rho as alpha".into(),
                ));
            }
            let cell = cell.filter(|cell| cell.has_direction());
            if value > 0.0 && cell.is_none() {
                return Err(Fault(
                    format!("{value} where v is zero: a cell with density needs a direction"),
                    "empty such cells: rho[(v == 0).all(-1)] = 0".into(),
                ));
            }
            if let Some(cell) = cell {
                *cell = cell.with_density(if alpha > 0.0 { value / alpha } else { 0.0 }, k[0], k[1]);
            }
            Ok(())
        });
        read.map_err(|fault| if outside { self.out_of_range(fault, &rho, alpha, "") } else { fault })?;
        if self.zip.index_for_name("k.npy").is_none() {
            self.notes.push(format!(
                "k is missing: all cells take k_d = {} and k_s = {} (volume.k_d, volume.k_s)",
                k[0], k[1]
            ));
            return Ok(VolumeTexture { size, alpha, cells: cells.into() });
        }
        let head = self.head("k")?;
        let mut cursor = CellCursor::new(size);
        let mut outside = false;
        let read = self.each(&head, size, |_, [k_d, k_s]: [f32; 2]| {
            let cell = cursor.next(&mut cells);
            if !(0.0..=1.0).contains(&k_d) || !(0.0..=1.0).contains(&k_s) {
                outside = true;
                return Err(Fault(format!("({k_d}, {k_s}) is outside 0..=1"), String::new()));
            }
            if let Some(cell) = cell.filter(|cell| cell.has_direction()) {
                *cell = cell.with_reflection(k_d, k_s);
            }
            Ok(())
        });
        read.map_err(|fault| if outside { self.out_of_range(fault, &head, 1.0, WITHOUT_K) } else { fault })?;
        Ok(VolumeTexture { size, alpha, cells: cells.into() })
    }

    /// Reads the directions into dense cells that hold nothing else yet.
    fn directions(&mut self, size: [u32; 3]) -> Result<CellBuffer> {
        let count = size.iter().map(|&n| n as usize).product();
        let mut cells = vec![Cell::default(); count];
        self.each_direction(size, |i, cell| {
            cells[i] = cell;
            Ok(())
        })?;
        Ok(CellBuffer::Dense(cells))
    }

    /// Reads the directions into bricks. Four layers at a time are in memory unpacked.
    fn packed_directions(&mut self, size: [u32; 3]) -> Result<CellBuffer> {
        let area = size[0] as usize * size[1] as usize;
        let (all, slab) = (area * size[2] as usize, area * BRICK as usize);
        let budget = self.options.budget;
        let mut packer = Packer::new(size);
        let mut layers: Vec<Cell> = Vec::with_capacity(slab.min(all));
        let mut too_large = None;
        let read = self.each_direction(size, |i, cell| {
            layers.push(cell);
            if layers.len() == slab || i + 1 == all {
                packer.push(&layers);
                layers.clear();
                if let Err(e) = check_stored(size, packer.count(), 0, budget) {
                    too_large = Some(e);
                    return Err(Fault(String::new(), String::new()));
                }
            }
            Ok(())
        });
        too_large.map_or(read, Err)?;
        Ok(CellBuffer::Sparse(packer.finish()))
    }

    /// Gives each direction to `take`, packed, with the linear index of its cell.
    fn each_direction(&mut self, size: [u32; 3], mut take: impl FnMut(usize, Cell) -> Checked) -> Result<()> {
        let (mut normalised, mut shortest, mut longest) = (0u64, f32::INFINITY, 0f32);
        let head = self.head("v")?;
        self.each(&head, size, |i, v: [f32; 3]| {
            let v = Vec3::from_array(v);
            let length = v.length();
            let off = (length - 1.0).abs();
            if v != Vec3::ZERO && off > UNIT_TOLERANCE {
                normalised += 1;
                (shortest, longest) = (shortest.min(length), longest.max(length));
            }
            if v == Vec3::ZERO || off <= NEAR_UNIT {
                // The code of a direction does not depend on its length.
                take(i, Cell::from_direction(v))
            } else if v.is_finite() {
                Err(Fault(format!("{v} has length {length}: v is unit or zero"), FIX_V.into()))
            } else {
                Err(Fault(format!("{v} is no direction"), FIX_V_FINITE.into()))
            }
        })?;
        let length = match format!("{shortest:.4}") {
            least if least == format!("{longest:.4}") => least,
            least => format!("{least} to {longest:.4}"),
        };
        let cells = if normalised == 1 { "cell" } else { "cells" };
        if normalised > 0 {
            self.notes.push(format!("v is normalised in {normalised} {cells}, where its length is {length}"));
        }
        Ok(())
    }

    /// Reads α, and the largest error that its rounding made. A file without alpha has α = 1.
    fn alpha(&mut self) -> Result<(f32, f32)> {
        if self.zip.index_for_name("alpha.npy").is_none() {
            return Ok((1.0, 0.0));
        }
        let head = self.head("alpha")?;
        if head.shape.iter().any(|&n| n != 1) {
            let what = format!("shape is {:?}: α is one number", head.shape);
            return Err(self.fault(&head, what, FIX_ALPHA));
        }
        let mut numbers = self.numbers(&head, 1)?;
        let value = numbers.next();
        let value = value.and_then(|value| numbers.finish().map(|()| value));
        let value = value.map_err(|e| self.fault(&head, e.to_string(), FIX_ALPHA))?;
        if !(0.0..=1.0).contains(&value) {
            return Err(self.fault(&head, format!("{value} is outside 0..=1"), FIX_ALPHA));
        }
        self.notes.extend(head.note());
        Ok((value, head.number.rounding(value, head.codes)))
    }

    /// Gives the error for a number outside 0 to 1 its way out, followed by `more`. The numbers of a larger
    /// range are to be divided, because clipping them would make nearly all of them 1. `most` is the largest
    /// number that is allowed.
    fn out_of_range(&mut self, fault: Error, head: &Head, most: f32, more: &str) -> Error {
        let Error::Input { what, .. } = fault else { return fault };
        let name = head.name;
        let factor = if most == 1.0 { String::new() } else { format!("{most} * ") };
        let fix = match self.divisor(head) {
            // Codes from 0 to 255 that were taken for bytes with a sign.
            _ if head.number.is_signed_byte() => format!("{name} = {factor}{name}.view(numpy.uint8) / 255"),
            None => format!("{name} = numpy.clip(numpy.nan_to_num({name}), 0, {most})"),
            Some(by) => format!("{name} = {factor}numpy.clip(numpy.nan_to_num({name}) / {by}, 0, 1)"),
        };
        Error::input(what, format!("{fix} brings it into the range{more}"))
    }

    /// Returns the number by which an array is to be divided so that it lies within 0 to 1: the largest code
    /// of 8 or 16 bits where the array seems to hold such codes, and otherwise its largest number. `None`
    /// where that is about 1, or the array cannot be read to its end.
    fn divisor(&mut self, head: &Head) -> Option<String> {
        let count = head.shape.iter().product();
        let mut numbers = self.numbers(head, count).ok()?;
        let (mut most, mut whole) = (0f32, true);
        for _ in 0..count {
            let number = numbers.next().ok()?;
            if number.is_finite() {
                most = most.max(number);
                whole &= number.fract() == 0.0;
            }
        }
        match most {
            _ if most <= 1.01 => None,
            128.0..=255.0 if whole => Some("255".into()),
            32768.0..=65535.0 if whole => Some("65535".into()),
            _ if most < 1e9 => Some(most.to_string()),
            _ => Some(format!("{most:e}")),
        }
    }

    /// Error about an array.
    fn fault(&self, head: &Head, what: String, fix: impl Into<String>) -> Error {
        invalid(self.path, format!("{}: {what}", head.name), fix)
    }

    /// Reads the header of an array.
    fn head(&mut self, name: &'static str) -> Result<Head> {
        let path = self.path;
        let fault = |what: String, fix: String| invalid(path, format!("{name}: {what}"), fix);
        let file = npyz::npz::file_name_from_array_name(name);
        if self.zip.index_for_name(&file).is_none() {
            let files = self.zip.file_names().filter_map(|file| file.ok());
            let names: Vec<String> =
                files.take(8).map(|file| file.trim_end_matches(".npy").chars().take(32).collect()).collect();
            let what = match names.as_slice() {
                [] => "there is no such array".into(),
                names => format!("there is no such array, but {}", names.join(", ")),
            };
            return Err(match name {
                "v" => fault(what, FIX_NO_V.into()),
                _ => fault(what, format!("numpy.savez(file, rho=rho, v=v) names arrays; {FORMAT}")),
            });
        }
        let entry = self.zip.by_name(&file).map_err(|e| fault(e.to_string(), FORMAT.into()))?;
        let (header, _) = open_array(entry).map_err(|e| fault(e.to_string(), FORMAT.into()))?;
        let dtype = header.dtype();
        let number = Number::of(&dtype).ok_or_else(|| {
            fault(
                format!("dtype is {}, which taki does not read", dtype.descr()),
                "save it as float32; bool, integers, float16 and float64 are converted".into(),
            )
        })?;
        Ok(Head {
            name,
            shape: header.shape().to_vec(),
            number,
            fortran: header.order() == npyz::Order::Fortran,
            codes: number.is_uint8() && matches!(name, "rho" | "k"),
        })
    }

    /// Opens an array and returns its numbers.
    fn numbers(&mut self, head: &Head, count: u64) -> Result<Numbers<impl Read>> {
        let fault = |e: String| invalid(self.path, format!("{}: {e}", head.name), FORMAT);
        let entry = self
            .zip
            .by_name(&npyz::npz::file_name_from_array_name(head.name))
            .map_err(|e| fault(e.to_string()))?;
        let (_, bytes) = open_array(entry).map_err(|e| fault(e.to_string()))?;
        Ok(Numbers::new(bytes, head.number, head.codes, count))
    }

    /// Gives the N numbers of every cell to `cell`, with the linear index of the cell and in its order.
    fn each<const N: usize>(
        &mut self,
        head: &Head,
        size: [u32; 3],
        mut cell: impl FnMut(usize, [f32; N]) -> Checked,
    ) -> Result<()> {
        let path = self.path;
        let fault = |what: String, fix: &str| invalid(path, format!("{}: {what}", head.name), fix);
        let [nx, ny, nz] = size.map(u64::from);
        let expected = [nz, ny, nx, N as u64];
        let expected = &expected[..if N > 1 { 4 } else { 3 }];
        if head.shape != expected {
            let what = format!("shape is {:?}, not {expected:?}", head.shape);
            let name = head.name;
            return Err(match N > 1 && head.shape == [N as u64, nz, ny, nx] {
                true => fault(what, &format!("{name} = numpy.moveaxis({name}, 0, -1) mends it")),
                false => fault(what, FORMAT),
            });
        }
        let (nx, ny, nz) = (nx as usize, ny as usize, nz as usize);
        let cells = nx * ny * nz;
        let mut largest = 0f32;
        let mut give = |i: usize, values: [f32; N]| {
            largest = values.iter().fold(largest, |a, &b| a.max(b));
            cell(i, values).map_err(|Fault(what, fix)| {
                let at = [i / (nx * ny), i / nx % ny, i % nx];
                fault(format!("at {at:?}: {what}"), &fix)
            })
        };
        let count = (cells * N) as u64;
        let broken = |e: std::io::Error| fault(e.to_string(), FORMAT);
        if head.fortran {
            let most = (self.spare as usize / size_of::<[f32; N]>()).clamp(1, cells);
            let mut range = vec![[0f32; N]; most];
            for start in (0..cells).step_by(most) {
                let range = &mut range[..most.min(cells - start)];
                let mut numbers = self.numbers(head, count)?;
                for part in 0..N {
                    for column in (0..nx).flat_map(|x| (0..ny).map(move |y| y * nx + x)) {
                        for z in 0..nz {
                            let number = numbers.next().map_err(broken)?;
                            let i = z * (nx * ny) + column;
                            if let Some(values) = range.get_mut(i.wrapping_sub(start)) {
                                values[part] = number;
                            }
                        }
                    }
                }
                numbers.finish().map_err(broken)?;
                for (i, &values) in range.iter().enumerate() {
                    give(start + i, values)?;
                }
            }
        } else {
            let mut numbers = self.numbers(head, count)?;
            for i in 0..cells {
                let mut values = [0.0; N];
                for value in &mut values {
                    *value = numbers.next().map_err(broken)?;
                }
                give(i, values)?;
            }
            numbers.finish().map_err(broken)?;
        }
        self.notes.extend(head.note());
        if head.codes && largest > 0.0 && largest < 1.5 / 255.0 {
            self.notes.push(format!("{} has no code above 1: a mask of 0 and 1 is saved as bool", head.name));
        }
        Ok(())
    }
}

/// Cells that are being read.
enum CellBuffer {
    Dense(Vec<Cell>),
    Sparse(Bricks),
}

impl From<CellBuffer> for Cells {
    fn from(buffer: CellBuffer) -> Cells {
        match buffer {
            CellBuffer::Dense(cells) => cells.into(),
            CellBuffer::Sparse(bricks) => bricks.into(),
        }
    }
}

/// Position in a volume that advances in the order of its cells.
struct CellCursor {
    size: [u32; 3],
    /// x, y and z of the next cell.
    position: [u32; 3],
    /// Linear index of the next cell.
    index: usize,
}

impl CellCursor {
    fn new(size: [u32; 3]) -> CellCursor {
        CellCursor { size, position: [0; 3], index: 0 }
    }

    /// Returns the next cell, or `None` if it is not stored, and advances.
    #[inline]
    fn next<'a>(&mut self, cells: &'a mut CellBuffer) -> Option<&'a mut Cell> {
        let ([x, y, z], index) = (self.position, self.index);
        self.index += 1;
        self.position[0] += 1;
        if self.position[0] == self.size[0] {
            self.position = if y + 1 == self.size[1] { [0, 0, z + 1] } else { [0, y + 1, z] };
        }
        match cells {
            CellBuffer::Dense(cells) => cells.get_mut(index),
            CellBuffer::Sparse(bricks) => bricks.at_mut(x, y, z),
        }
    }
}
