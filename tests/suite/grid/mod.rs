//! Grids of simulations. Reference truth: every sample against the formula that made it.

mod broken;
mod info;
mod mutations;
mod npz;
mod samples;
mod tree;
mod written;

use std::io::Read;
use std::path::PathBuf;

use taki::grid::{Grid, read};

/// Memory for the samples, bytes.
const MEMORY: u64 = 64 << 20;

/// Content of a sample of `tests/data/grid`.
pub fn sample(name: &str) -> Vec<u8> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/grid");
    let file = std::fs::File::open(folder.join(format!("{name}.gz"))).expect("a sample");
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(file).read_to_end(&mut bytes).expect("gzip");
    bytes
}

/// A folder with one file, which goes when it is dropped.
pub struct Folder {
    folder: tempfile::TempDir,
    name: String,
}

impl Folder {
    pub fn new(name: &str, bytes: &[u8]) -> Folder {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join(name), bytes).expect("written");
        Folder { folder, name: name.into() }
    }

    pub fn sample(name: &str) -> Folder {
        Folder::new(name, &sample(name))
    }

    pub fn path(&self) -> PathBuf {
        self.folder.path().join(&self.name)
    }

    pub fn read(&self, grid: &str) -> Grid {
        read(&self.path(), grid, MEMORY).unwrap_or_else(|e| panic!("{}: {e}", self.name))
    }
}
