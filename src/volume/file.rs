//! Volume files: NumPy `.npz` with `rho` float32 [nz,ny,nx], `v` float32 [nz,ny,nx,3], `k` float32
//! [nz,ny,nx,2] and the scalar `alpha`.
//!
//! The arrays hold the values that the renderer uses, as they are after packing. `rho` includes α; `v` is
//! unit or zero. `alpha` makes reading exact, because the cells hold ρ/α. A file without it is read with α =
//! 1.

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

/// Longest header of an array, bytes. NumPy pads the headers of arrays of numbers to 128 bytes. The bound
/// protects the recursive parser of headers from hostile files.
const MAX_HEADER_BYTES: u64 = 512;

/// Largest distance of |v| from 1 at which v counts as a unit vector: float32 rounding, with room for files
/// that other programs wrote in lower precision.
const UNIT_TOLERANCE: f32 = 1e-3;

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

/// Reads a volume file into at most `budget` bytes. Every value is checked, and nothing of the size that the
/// file claims is allocated before that size is compared with the budget.
///
/// `asked` sets the storage; with [`StorageChoice::Auto`] it is sparse if a dense volume does not fit.
///
/// # Errors
/// [`Error::Io`] if the file cannot be opened, [`Error::Input`] if there is none or it is not a valid volume
/// file, and [`Error::Memory`] if the volume does not fit into the budget.
pub fn read_npz(path: &Path, asked: StorageChoice, budget: u64) -> Result<VolumeTexture> {
    let meta = std::fs::metadata(path).map_err(|e| Error::open(path, e))?;
    if !meta.is_file() {
        return Err(Error::input(
            format!("{} is not a regular file", path.display()),
            "give an .npz file made by `taki volume build` or NumPy's savez",
        ));
    }
    let file = File::open(path).map_err(|e| Error::open(path, e))?;
    let mut reader = Reader {
        path,
        asked,
        budget,
        zip: ZipArchive::new(BufReader::new(file)).map_err(|e| invalid(path, e.to_string()))?,
    };
    reader.volume()
}

/// Error about the contents of the file.
fn invalid(path: &Path, what: String) -> Error {
    Error::input(
        format!("{}: {what}", path.display()),
        "a volume file is an .npz with rho float32 [nz,ny,nx], v float32 [nz,ny,nx,3], \
         k float32 [nz,ny,nx,2]",
    )
}

/// Reader of one volume file.
struct Reader<'a> {
    path: &'a Path,
    asked: StorageChoice,
    budget: u64,
    zip: ZipArchive<BufReader<File>>,
}

impl Reader<'_> {
    fn volume(&mut self) -> Result<VolumeTexture> {
        let alpha = self.alpha()?;
        let shape = self.each("rho", None, |_, _: [f32; 1]| Ok(()))?;
        let &[nz, ny, nx] = shape.as_slice() else {
            return Err(invalid(self.path, format!("rho has shape {shape:?}, not [nz,ny,nx]")));
        };
        let size = [nx, ny, nz].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        if size.contains(&0) {
            return Err(invalid(
                self.path,
                format!("rho has shape {shape:?}: a volume has at least one cell"),
            ));
        }
        let mut cells = match file_storage(size, self.asked, self.budget)? {
            Storage::Dense => self.directions(size)?,
            Storage::Sparse => self.packed_directions(size)?,
        };
        let mut cursor = CellCursor::new(size);
        self.each("rho", Some(&[nz, ny, nx]), |_, [value]: [f32; 1]| {
            let cell = cursor.next(&mut cells);
            if !(0.0..=1.0).contains(&value) {
                return Err(format!("{value} is outside 0..=1"));
            }
            if value > alpha * 1.000001 {
                return Err(format!("{value} is more than the file's alpha {alpha}"));
            }
            let cell = cell.filter(|cell| cell.has_direction());
            if value > 0.0 && cell.is_none() {
                return Err(format!("{value} where v is zero: a cell with density needs a direction"));
            }
            if let Some(cell) = cell {
                *cell = cell.with_density(if alpha > 0.0 { value / alpha } else { 0.0 }, 0.0, 0.0);
            }
            Ok(())
        })?;
        let mut cursor = CellCursor::new(size);
        self.each("k", Some(&[nz, ny, nx, 2]), |_, [k_d, k_s]: [f32; 2]| {
            let cell = cursor.next(&mut cells);
            if !(0.0..=1.0).contains(&k_d) || !(0.0..=1.0).contains(&k_s) {
                return Err(format!("({k_d}, {k_s}) is outside 0..=1"));
            }
            if let Some(cell) = cell.filter(|cell| cell.has_direction()) {
                *cell = cell.with_reflection(k_d, k_s);
            }
            Ok(())
        })?;
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
        let budget = self.budget;
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
                    return Err(String::new());
                }
            }
            Ok(())
        });
        too_large.map_or(read, Err)?;
        Ok(CellBuffer::Sparse(packer.finish()))
    }

    /// Gives each direction to `take`, packed, with the linear index of its cell.
    fn each_direction(
        &mut self,
        size: [u32; 3],
        mut take: impl FnMut(usize, Cell) -> std::result::Result<(), String>,
    ) -> Result<()> {
        let [nx, ny, nz] = size.map(u64::from);
        self.each("v", Some(&[nz, ny, nx, 3]), |i, v: [f32; 3]| {
            let v = Vec3::from_array(v);
            let length = v.length();
            if v == Vec3::ZERO || (length - 1.0).abs() <= UNIT_TOLERANCE {
                take(i, Cell::from_direction(v))
            } else {
                Err(format!("{v:?} has length {length}: v is unit or zero"))
            }
        })
        .map(drop)
    }

    /// Reads α, or 1 from a file that has none.
    fn alpha(&mut self) -> Result<f32> {
        if self.zip.index_for_name("alpha.npy").is_none() {
            return Ok(1.0);
        }
        let mut alpha = 1.0;
        self.each("alpha", Some(&[]), |_, [value]: [f32; 1]| {
            alpha = value;
            if (0.0..=1.0).contains(&value) { Ok(()) } else { Err(format!("{value} is outside 0..=1")) }
        })?;
        Ok(alpha)
    }

    /// Reads the array `name` as float32 in rows of N, gives each row to `row` with its index, and returns
    /// the array's shape. Without an expected shape it reads the header only.
    fn each<const N: usize>(
        &mut self,
        name: &str,
        expected: Option<&[u64]>,
        mut row: impl FnMut(usize, [f32; N]) -> std::result::Result<(), String>,
    ) -> Result<Vec<u64>> {
        let path = self.path;
        let fault = |what: String| invalid(path, format!("{name}: {what}"));
        let entry = self
            .zip
            .by_name(&npyz::npz::file_name_from_array_name(name))
            .map_err(|e| fault(e.to_string()))?;
        let (header, mut bytes) = open_array(entry).map_err(|e| fault(e.to_string()))?;
        let shape = header.shape().to_vec();
        let dtype = header.dtype().descr();
        if dtype != "'<f4'" {
            return Err(fault(format!("dtype is {dtype}, not '<f4' (float32)")));
        }
        if header.order() != npyz::Order::C {
            return Err(fault("the array is in Fortran order; save it with numpy.ascontiguousarray".into()));
        }
        let Some(expected) = expected else { return Ok(shape) };
        if shape != expected {
            return Err(fault(format!("shape is {shape:?}, not {expected:?}")));
        }
        let npy = npyz::NpyFile::with_header(header, &mut bytes);
        let mut values = npy.data::<f32>().map_err(|e| fault(e.to_string()))?;
        let rows = expected.iter().product::<u64>() as usize / N;
        for i in 0..rows {
            let mut out = [0.0; N];
            for slot in &mut out {
                *slot = match values.next() {
                    Some(Ok(x)) => x,
                    Some(Err(e)) => return Err(fault(format!("row {i}: {e}"))),
                    None => return Err(fault(format!("ends after {i} of {rows} rows"))),
                };
            }
            row(i, out).map_err(|e| fault(format!("row {i}: {e}")))?;
        }
        // The archive compares an entry's checksum only when the entry is read to its end.
        if bytes.read(&mut [0]).map_err(|e| fault(e.to_string()))? != 0 {
            return Err(fault(format!("has more than {rows} rows")));
        }
        Ok(shape)
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

/// Opens an array. Its header is parsed only if it has a sane length.
fn open_array<R: Read>(mut entry: R) -> std::io::Result<(npyz::NpyHeader, impl Read)> {
    let mut prefix = [0u8; 12];
    entry.read_exact(&mut prefix)?;
    let header_bytes = match prefix[6] {
        1 => u16::from_le_bytes([prefix[8], prefix[9]]) as u64,
        _ => u32::from_le_bytes([prefix[8], prefix[9], prefix[10], prefix[11]]) as u64,
    };
    if &prefix[..6] != b"\x93NUMPY" || header_bytes > MAX_HEADER_BYTES {
        return Err(std::io::Error::other("not a NumPy array"));
    }
    let mut bytes = BufReader::with_capacity(1 << 16, std::io::Cursor::new(prefix).chain(entry));
    Ok((npyz::NpyHeader::from_reader(&mut bytes)?, bytes))
}
