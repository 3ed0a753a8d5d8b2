//! Disk cache of data that takes long to compute: volume textures and opaque meshes.
//!
//! A file holds a key (the text of every value that the data depend on), the data, and a checksum of both. A
//! file that is incomplete, damaged or of another key counts as missing, and a folder that cannot be read or
//! written counts as empty. Missing data are computed again.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use bytemuck::Pod;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

/// Largest size of a folder, bytes. The least recently used files are removed to make room.
const MAX_FOLDER_BYTES: u64 = 512 << 20;
/// Shortest computation that is worth a file. Opening the file and listing the folder take about a
/// millisecond.
const MIN_TIME: Duration = Duration::from_millis(10);
/// Upper bound on the time to read and verify one byte, s: a slow disk, with nothing in the system's file
/// cache.
const READ_SECONDS_PER_BYTE: f64 = 2e-9;
/// Age from which a temporary file counts as left behind by a process that died.
const STALE: Duration = Duration::from_secs(3600);

/// Bytes that are read at a time.
const PART: usize = 1 << 18;

const MAGIC: [u8; 16] = *b"taki cache 1\n\r\n\0";
/// Extension of cache files.
const EXTENSION: &str = "made";
/// Extension of files that are being written.
const TEMPORARY: &str = "tmp";

/// Builds the key of data of a `kind`: the versions of taki and of the data's builder, the processor
/// architecture, and all `values` that the data depend on, as `Debug` writes them.
pub fn key(kind: &str, builder: u32, values: &impl std::fmt::Debug) -> String {
    let (version, machine) = (env!("CARGO_PKG_VERSION"), std::env::consts::ARCH);
    format!("taki {version} {machine} {kind} {builder}\n{values:?}")
}

/// A cache: one folder for each kind of data, below one root.
#[derive(Clone, Debug)]
pub struct Cache {
    root: PathBuf,
    /// Largest size of one kind's folder, bytes.
    max_bytes: u64,
    /// Shortest computation that is worth a file.
    min_time: Duration,
}

/// Header of a file. The key and the contents follow it.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
struct Head {
    magic: [u8; 16],
    /// Length of the key, bytes.
    key: u64,
    /// Length of the contents, bytes.
    contents: u64,
    /// XXH3-128 of key and contents, low half first.
    checksum: [u64; 2],
}

impl Cache {
    /// The user's cache: `taki` in `$XDG_CACHE_HOME`, or in the system's folder for caches. `None` if there
    /// is no such folder.
    pub fn of_user() -> Option<Cache> {
        Some(Cache::new(dirs::cache_dir()?.join("taki"), MAX_FOLDER_BYTES))
    }

    /// Cache in folders below `root`, each of at most `max_bytes` bytes.
    pub fn new(root: impl Into<PathBuf>, max_bytes: u64) -> Cache {
        Cache { root: root.into(), max_bytes, min_time: MIN_TIME }
    }

    /// Makes the cache also keep data that are quick to compute. For tests.
    #[doc(hidden)]
    pub fn keeping_all(self) -> Cache {
        Cache { min_time: Duration::ZERO, ..self }
    }

    /// Returns the `count` values of `kind` and `key`: from the disk if they are there, otherwise from
    /// `make`. Values that take less time to compute than to read are not kept.
    ///
    /// # Errors
    /// Returns the error of `make`. Faults of the cache are not errors.
    pub fn get<T: Pod, E>(
        &self,
        kind: &str,
        key: &str,
        count: usize,
        make: impl FnOnce() -> Result<Vec<T>, E>,
    ) -> Result<Vec<T>, E> {
        if let Some(contents) = self.stored(kind, key, count) {
            return Ok(contents);
        }
        let clock = Instant::now();
        let made = make()?;
        self.keep_if_slow(kind, key, &made, clock.elapsed());
        Ok(made)
    }

    /// Returns the `count` values of `kind` and `key` if they are on the disk.
    pub fn stored<T: Pod>(&self, kind: &str, key: &str, count: usize) -> Option<Vec<T>> {
        read(&self.path(kind, key), key, count)
    }

    /// Keeps `made`, which took the time `took` to compute, if reading it takes less.
    pub fn keep_if_slow<T: Pod>(&self, kind: &str, key: &str, made: &[T], took: Duration) {
        let bytes = size_of_val(made) as u64;
        let read = Duration::from_secs_f64(bytes as f64 * READ_SECONDS_PER_BYTE);
        let worth = self.min_time.is_zero() || took > self.min_time + read;
        if worth && bytes <= self.max_bytes {
            // A fault costs the next process the computation, nothing else.
            let _ = self.write(&self.path(kind, key), key, bytemuck::cast_slice(made));
        }
    }

    /// Path of the file of a key.
    pub fn path(&self, kind: &str, key: &str) -> PathBuf {
        self.root.join(kind).join(format!("{:032x}.{EXTENSION}", xxh3_128(key.as_bytes())))
    }

    fn write(&self, path: &Path, key: &str, contents: &[u8]) -> std::io::Result<()> {
        let folder = path.parent().expect("a folder and a name");
        std::fs::create_dir_all(folder)?;
        let head = Head::new(key, contents);
        make_room(folder, self.max_bytes, (size_of::<Head>() + key.len() + contents.len()) as u64)?;
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
        Head::of_sum(key, contents.len(), &sum)
    }

    /// Header of a key and of `contents` bytes, of which `sum` is the checksum.
    fn of_sum(key: &str, contents: usize, sum: &Xxh3) -> Head {
        let sum = sum.digest128();
        Head {
            magic: MAGIC,
            key: key.len() as u64,
            contents: contents as u64,
            checksum: [sum as u64, (sum >> 64) as u64],
        }
    }
}

/// Reads the contents of a file. Returns `None` if it is missing, damaged, or of another key or size.
fn read<T: Pod>(path: &Path, key: &str, count: usize) -> Option<Vec<T>> {
    let mut file = File::open(path).ok()?;
    let expected = size_of::<Head>() + key.len() + count * size_of::<T>();
    // Checked before memory for the contents is allocated.
    let meta = file.metadata().ok()?;
    if !meta.is_file() || meta.len() != expected as u64 {
        return None;
    }
    let mut head = vec![0; size_of::<Head>() + key.len()];
    file.read_exact(&mut head).ok()?;
    let (head, own_key) = head.split_at(size_of::<Head>());
    if own_key != key.as_bytes() {
        return None;
    }
    let mut contents: Vec<T> = bytemuck::allocation::zeroed_vec(count);
    let mut sum = Xxh3::new();
    sum.update(key.as_bytes());
    // Each part is summed while it is in the processor's cache.
    for part in bytemuck::cast_slice_mut(&mut contents).chunks_mut(PART) {
        file.read_exact(part).ok()?;
        sum.update(part);
    }
    if *head != *bytemuck::bytes_of(&Head::of_sum(key, size_of_val(contents.as_slice()), &sum)) {
        return None;
    }
    // The time of last use decides which file is removed first.
    let _ = file.set_modified(SystemTime::now());
    Some(contents)
}

/// Removes the least recently used files until `new_bytes` fit, and what processes that died left behind.
fn make_room(folder: &Path, max_bytes: u64, new_bytes: u64) -> std::io::Result<()> {
    let mut files = Vec::new();
    let mut total = new_bytes;
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
        if total <= max_bytes {
            break;
        }
        if std::fs::remove_file(path).is_ok() {
            total -= bytes;
        }
    }
    Ok(())
}
