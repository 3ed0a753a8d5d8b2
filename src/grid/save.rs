//! Writing of files that are there whole or not at all.

use std::io::BufWriter;
use std::path::Path;

use super::{Grid, encode_vdb};
use crate::util::error::{Error, Result};

/// Writes grids to a file of OpenVDB. The file is there whole or not at all: it takes its name when all of it
/// is on the disk. See [`encode_vdb`] for what is in it.
///
/// # Errors
/// [`Error::CannotCreate`] where no file can be made beside `path`, [`Error::Io`] where the disk is full.
pub fn write_vdb(path: &Path, grids: &[Grid]) -> Result<()> {
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
    encode_vdb(grids, BufWriter::with_capacity(1 << 16, file.as_file()))
        .map_err(|e| Error::write(path, e))?;
    file.as_file().sync_all().map_err(|e| Error::write(path, e))?;
    file.persist(path).map_err(|e| Error::write(path, e.error))?;
    Ok(())
}
