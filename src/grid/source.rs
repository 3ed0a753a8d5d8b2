//! A file that is read from front to back with jumps. Nothing is allocated that the file does not hold.

use std::fmt::Display;
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek};
use std::path::{Path, PathBuf};

use super::own;
use crate::util::budget::Budget;
use crate::util::error::{Error, Result};

/// Advice on a file that breaks its format.
pub(super) const WRITE_AGAIN: &str = "copy the file again, or write it again in the program that made it";
/// Advice on a grid that is too large.
pub(super) const COARSER: &str =
    "simulate or resample it with larger voxels, clip it, or allow more memory with --memory";
/// Longest name or text, bytes.
const LONGEST_TEXT: u32 = 1 << 16;

/// Opens a regular file.
pub(super) fn open(path: &Path) -> Result<File> {
    let meta = std::fs::metadata(path).map_err(|e| Error::open(path, e))?;
    if !meta.is_file() {
        let fix = "give a .vdb, .nvdb or .npz file";
        return Err(Error::input(format!("{} is not a regular file", path.display()), fix));
    }
    File::open(path).map_err(|e| Error::open(path, e))
}

/// A budget for the reading of a grid.
pub(super) fn budget(bytes: u64) -> Budget {
    Budget::new(bytes, COARSER)
}

/// Bytes on the disk or in the program.
trait Input: Read + Seek {}

impl<T: Read + Seek> Input for T {}

/// A file with a position.
pub(super) struct Source {
    path: PathBuf,
    file: BufReader<Box<dyn Input>>,
    at: u64,
    end: u64,
    /// Name of the grid that is being read, for errors.
    grid: String,
}

impl Source {
    pub fn open(path: &Path) -> Result<Source> {
        let (file, end): (Box<dyn Input>, u64) = match own(path) {
            Some(bytes) => (Box::new(Cursor::new(bytes)), bytes.len() as u64),
            None => {
                let file = open(path)?;
                let end = file.metadata().map_err(|e| Error::read(path, e))?.len();
                (Box::new(file), end)
            }
        };
        let file = BufReader::with_capacity(1 << 16, file);
        Ok(Source { path: path.into(), file, at: 0, end, grid: String::new() })
    }

    /// Names the grid that is read from here on.
    pub fn enter(&mut self, grid: &str) {
        self.grid = grid.chars().take(64).collect();
    }

    /// Position of the next byte.
    pub fn at(&self) -> u64 {
        self.at
    }

    /// Length of the file, bytes.
    pub fn end(&self) -> u64 {
        self.end
    }

    /// File and grid, as errors name them.
    pub fn place(&self) -> String {
        match self.grid.is_empty() {
            true => self.path.display().to_string(),
            false => format!("{}: grid {:?}", self.path.display(), self.grid),
        }
    }

    /// The error for a fault at byte `at`.
    pub fn fault(&self, at: u64, why: impl Display) -> Error {
        self.fault_with(at, why, WRITE_AGAIN)
    }

    /// The error for a fault at byte `at`, with advice.
    pub fn fault_with(&self, at: u64, why: impl Display, fix: impl Into<String>) -> Error {
        Error::input(format!("{}: byte {at}: {why}", self.place()), fix)
    }

    /// Moves to byte `to`.
    pub fn seek(&mut self, to: u64) -> Result<()> {
        if to > self.end {
            return Err(self.fault(self.at, format!("it leads to byte {to} of {}", self.end)));
        }
        let by = to as i64 - self.at as i64;
        self.file.seek_relative(by).map_err(|e| Error::read(&self.path, e))?;
        self.at = to;
        Ok(())
    }

    /// Moves on by a number of bytes.
    pub fn skip(&mut self, bytes: u64) -> Result<()> {
        self.check_left(bytes)?;
        self.seek(self.at + bytes)
    }

    /// Checks that the file has this many bytes more.
    pub fn check_left(&self, bytes: u64) -> Result<()> {
        match bytes <= self.end - self.at {
            true => Ok(()),
            false => {
                let left = self.end - self.at;
                Err(self.fault(self.at, format!("the file ends here: {bytes} bytes are due, {left} follow")))
            }
        }
    }

    /// Reads bytes into `into`.
    pub fn fill(&mut self, into: &mut [u8]) -> Result<()> {
        self.check_left(into.len() as u64)?;
        self.file.read_exact(into).map_err(|e| Error::read(&self.path, e))?;
        self.at += into.len() as u64;
        Ok(())
    }

    /// Replaces the content of `into` by the next `count` bytes.
    pub fn bytes(&mut self, count: u64, into: &mut Vec<u8>) -> Result<()> {
        self.check_left(count)?;
        into.resize(count as usize, 0);
        self.fill(into)
    }

    pub fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    pub fn u8(&mut self) -> Result<u8> {
        Ok(self.array::<1>()?[0])
    }

    pub fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub fn i32(&mut self) -> Result<i32> {
        Ok(i32::from_le_bytes(self.array()?))
    }

    pub fn i64(&mut self) -> Result<i64> {
        Ok(i64::from_le_bytes(self.array()?))
    }

    pub fn f64s<const N: usize>(&mut self) -> Result<[f64; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = f64::from_le_bytes(self.array()?);
        }
        Ok(numbers)
    }

    pub fn index(&mut self) -> Result<[i32; 3]> {
        Ok([self.i32()?, self.i32()?, self.i32()?])
    }

    /// Reads a text after its length.
    pub fn text(&mut self) -> Result<String> {
        let (at, length) = (self.at, self.u32()?);
        if length > LONGEST_TEXT {
            return Err(self.fault(at, format!("a name of {length} bytes")));
        }
        let mut bytes = Vec::new();
        self.bytes(length.into(), &mut bytes)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}
