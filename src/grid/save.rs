//! Writing of files that are there whole or not at all.

use std::io::{BufWriter, Seek, Write};
use std::path::Path;

use super::{Grid, encode_nvdb, encode_vdb, nanovdb, openvdb};
use crate::util::error::{Error, Result};

/// Writes grids to a file of OpenVDB. The file is there whole or not at all: it takes its name when all of it
/// is on the disk. See [`encode_vdb`] for what is in it.
///
/// # Errors
/// [`Error::CannotCreate`] where no file can be made beside `path`, [`Error::Io`] where the disk is full.
pub fn write_vdb(path: &Path, grids: &[Grid]) -> Result<()> {
    write(path, grids, GridFile::OpenVdb)
}

/// Writes grids to a file of NanoVDB, as [`write_vdb`] does. See [`encode_nvdb`] for what is in it.
///
/// # Errors
/// The errors of [`write_vdb`].
pub fn write_nvdb(path: &Path, grids: &[Grid]) -> Result<()> {
    write(path, grids, GridFile::NanoVdb)
}

fn write(path: &Path, grids: &[Grid], format: GridFile) -> Result<()> {
    let fail = |why: std::io::Error| Error::CannotCreate {
        path: path.to_owned(),
        why: why.to_string(),
        fix: "choose a folder that is there and may be written".into(),
    };
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".taki-").suffix(".tmp");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(folder).map_err(fail)?;
    let writer = BufWriter::with_capacity(1 << 16, file.as_file());
    format.encode(grids, writer).map_err(|e| Error::write(path, e))?;
    file.as_file().sync_all().map_err(|e| Error::write(path, e))?;
    file.persist(path).map_err(|e| Error::write(path, e.error))?;
    Ok(())
}

/// Format in which grids are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GridFile {
    OpenVdb,
    NanoVdb,
}

impl GridFile {
    /// Format that the ending of a path stands for.
    pub fn of(path: &Path) -> Option<GridFile> {
        match path.extension()?.to_ascii_lowercase().to_str()? {
            "vdb" => Some(GridFile::OpenVdb),
            "nvdb" => Some(GridFile::NanoVdb),
            _ => None,
        }
    }

    /// Name of the format.
    pub fn words(self) -> &'static str {
        match self {
            GridFile::OpenVdb => "OpenVDB",
            GridFile::NanoVdb => "NanoVDB",
        }
    }

    /// Whether a file of the format starts with these bytes.
    pub fn starts(self, start: &[u8]) -> bool {
        match self {
            GridFile::OpenVdb => start.starts_with(&openvdb::MAGIC),
            GridFile::NanoVdb => start.get(..8).is_some_and(nanovdb::is_magic),
        }
    }

    /// Writes grids in the format.
    pub fn encode(self, grids: &[Grid], out: impl Write + Seek) -> std::io::Result<()> {
        match self {
            GridFile::OpenVdb => encode_vdb(grids, out),
            GridFile::NanoVdb => encode_nvdb(grids, out),
        }
    }
}
