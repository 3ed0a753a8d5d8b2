//! Disk cache of data that is slow to compute: volume textures and opaque meshes.
//!
//! A file holds its key (the text of all inputs), the computed values, and a checksum of both. A file that is
//! incomplete or has another key counts as missing, and so does a folder that cannot be read or written: the
//! values are then computed again.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use bytemuck::Pod;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

/// Largest size of a folder, bytes. The least recently used files are removed first.
const MOST_BYTES: u64 = 512 << 20;
/// Least computing time that is worth a file. Opening it and scanning the folder take about a millisecond.
const LEAST: Duration = Duration::from_millis(10);
/// Upper bound of the time to read one byte and add it to the checksum, seconds; for a slow disk, uncached.
const READ_SECONDS_PER_BYTE: f64 = 2e-9;
/// Age from which a temporary file counts as left by a dead process.
const STALE: Duration = Duration::from_secs(3600);

const MAGIC: [u8; 16] = *b"taki cache 1\n\r\n\0";
/// Extension of cache files.
const EXTENSION: &str = "made";
const TEMPORARY: &str = "tmp";

/// Returns the key of data of a `kind`: the `Debug` text of all its inputs, and the version of its builder.
pub fn key(kind: &str, builder: u32, values: &impl std::fmt::Debug) -> String {
    let (version, machine) = (env!("CARGO_PKG_VERSION"), std::env::consts::ARCH);
    format!("taki {version} {machine} {kind} {builder}\n{values:?}")
}

/// A disk cache in one folder.
#[derive(Clone, Debug)]
pub struct Cache {
    root: PathBuf,
    most: u64,
    least: Duration,
}

/// Header of a cache file, before key and contents.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
struct Head {
    magic: [u8; 16],
    /// Length of the key, bytes.
    key: u64,
    /// Length of the contents, bytes.
    contents: u64,
    /// Checksum of key and contents.
    checksum: [u64; 2],
}

impl Cache {
    /// Opens the user's cache: `taki` in `$XDG_CACHE_HOME`, or in the system's folder of caches.
    pub fn of_user() -> Option<Cache> {
        Some(Cache::new(dirs::cache_dir()?.join("taki"), MOST_BYTES))
    }

    /// Opens a cache in `root`; each kind has a folder of at most `most` bytes.
    pub fn new(root: impl Into<PathBuf>, most: u64) -> Cache {
        Cache { root: root.into(), most, least: LEAST }
    }

    /// Also stores data that is quick to compute. For tests.
    #[doc(hidden)]
    pub fn keeping_all(self) -> Cache {
        Cache { least: Duration::ZERO, ..self }
    }

    /// Returns the `count` values of a `kind` under `key`: read from the cache, or computed by `make`. Values
    /// that are quicker to compute than to read are not stored.
    ///
    /// # Errors
    /// The error of `make`; faults of the cache itself are ignored.
    pub fn get<T: Pod, E>(
        &self,
        kind: &str,
        key: &str,
        count: usize,
        make: impl FnOnce() -> Result<Vec<T>, E>,
    ) -> Result<Vec<T>, E> {
        let path = self.path(kind, key);
        if let Some(known) = read(&path, key, count) {
            return Ok(known);
        }
        let clock = Instant::now();
        let made = make()?;
        self.keep_if_slow(kind, key, &made, clock.elapsed());
        Ok(made)
    }

    /// Stores values that took the time `took` to compute, if reading them is quicker.
    pub fn keep_if_slow<T: Pod>(&self, kind: &str, key: &str, made: &[T], took: Duration) {
        let bytes = size_of_val(made) as u64;
        let read = Duration::from_secs_f64(bytes as f64 * READ_SECONDS_PER_BYTE);
        let worth = self.least.is_zero() || took > self.least + read;
        if worth && bytes <= self.most {
            // Errors are ignored: the next process computes the values again.
            let _ = self.write(&self.path(kind, key), key, bytemuck::cast_slice(made));
        }
    }

    /// Returns the path of the file of a key.
    pub fn path(&self, kind: &str, key: &str) -> PathBuf {
        self.root.join(kind).join(format!("{:032x}.{EXTENSION}", xxh3_128(key.as_bytes())))
    }

    fn write(&self, path: &Path, key: &str, contents: &[u8]) -> std::io::Result<()> {
        let folder = path.parent().expect("a folder and a name");
        std::fs::create_dir_all(folder)?;
        let head = Head::new(key, contents);
        make_room(folder, self.most, (size_of::<Head>() + key.len() + contents.len()) as u64)?;
        let suffix = format!(".{TEMPORARY}");
        let mut file = tempfile::Builder::new().prefix("").suffix(&suffix).tempfile_in(folder)?;
        for part in [bytemuck::bytes_of(&head), key.as_bytes(), contents] {
            file.write_all(part)?;
        }
        file.persist(path)?;
        Ok(())
    }
}

impl Head {
    fn new(key: &str, contents: &[u8]) -> Head {
        let mut sum = Xxh3::new();
        sum.update(key.as_bytes());
        sum.update(contents);
        let sum = sum.digest128();
        Head {
            magic: MAGIC,
            key: key.len() as u64,
            contents: contents.len() as u64,
            checksum: [sum as u64, (sum >> 64) as u64],
        }
    }
}

/// Returns the contents of a file if it is complete and has this key.
fn read<T: Pod>(path: &Path, key: &str, count: usize) -> Option<Vec<T>> {
    let mut file = File::open(path).ok()?;
    let wanted = size_of::<Head>() + key.len() + count * size_of::<T>();
    // Checked before the buffer is allocated.
    let meta = file.metadata().ok()?;
    if !meta.is_file() || meta.len() != wanted as u64 {
        return None;
    }
    let mut head = vec![0; size_of::<Head>() + key.len()];
    file.read_exact(&mut head).ok()?;
    let (head, own_key) = head.split_at(size_of::<Head>());
    if own_key != key.as_bytes() {
        return None;
    }
    let mut contents = vec![T::zeroed(); count];
    file.read_exact(bytemuck::cast_slice_mut(&mut contents)).ok()?;
    if *head != *bytemuck::bytes_of(&Head::new(key, bytemuck::cast_slice(&contents))) {
        return None;
    }
    // The modification time orders files by last use.
    let _ = file.set_modified(SystemTime::now());
    Some(contents)
}

/// Removes the least recently used files until `more` bytes fit, and temporary files of dead processes.
fn make_room(folder: &Path, most: u64, more: u64) -> std::io::Result<()> {
    let mut files = Vec::new();
    let mut total = more;
    for entry in std::fs::read_dir(folder)?.flatten() {
        let path = entry.path();
        let Ok(meta) = entry.metadata() else { continue };
        let used = meta.modified().unwrap_or(SystemTime::UNIX_EPOCH);
        match path.extension().and_then(|e| e.to_str()) {
            Some(EXTENSION) => {
                total += meta.len();
                files.push((used, meta.len(), path));
            }
            Some(TEMPORARY) if used.elapsed().is_ok_and(|age| age > STALE) => {
                let _ = std::fs::remove_file(path);
            }
            _ => {}
        }
    }
    files.sort();
    for (_, bytes, path) in files {
        if total <= most {
            break;
        }
        if std::fs::remove_file(path).is_ok() {
            total -= bytes;
        }
    }
    Ok(())
}
