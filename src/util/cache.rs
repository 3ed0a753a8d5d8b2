//! Things that take long to make, kept on disk for the next process: volume textures and opaque meshes.
//!
//! A file holds the text of everything the thing follows from (its key), what was made of it, and a checksum of
//! both. Whatever is not whole, or of another key, is as if it were not there, and so is a folder that cannot be
//! read or written: the thing is made anew.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use bytemuck::Pod;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

/// Bytes a folder may hold; the files that were used longest ago make room.
const MOST_BYTES: u64 = 512 << 20;
/// The least time worth a file: opening and looking through the folder take about a millisecond.
const LEAST: Duration = Duration::from_millis(10);
/// Reading takes less time than this for each byte, with its checksum; from a slow disk that is new to the system.
const READ_SECONDS_PER_BYTE: f64 = 2e-9;
/// Temporary files of dead processes are that old.
const STALE: Duration = Duration::from_secs(3600);

const MAGIC: [u8; 16] = *b"taki cache 1\n\r\n\0";
/// Of the files.
const EXTENSION: &str = "made";
const TEMPORARY: &str = "tmp";

/// Key of a thing of a `kind`: all the values it follows from, as their `Debug` writes them, and its builder's version.
pub fn key(kind: &str, builder: u32, values: &impl std::fmt::Debug) -> String {
    let (version, machine) = (env!("CARGO_PKG_VERSION"), std::env::consts::ARCH);
    format!("taki {version} {machine} {kind} {builder}\n{values:?}")
}

/// Where things are kept.
#[derive(Clone, Debug)]
pub struct Cache {
    root: PathBuf,
    most: u64,
    least: Duration,
}

/// What stands before key and contents.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
struct Head {
    magic: [u8; 16],
    /// Bytes.
    key: u64,
    /// Bytes.
    contents: u64,
    /// Of key and contents.
    checksum: [u64; 2],
}

impl Cache {
    /// The user's: `taki` in `$XDG_CACHE_HOME`, or where the system keeps caches.
    pub fn of_user() -> Option<Cache> {
        Some(Cache::new(dirs::cache_dir()?.join("taki"), MOST_BYTES))
    }

    /// In folders of `root`, each of at most `most` bytes.
    pub fn new(root: impl Into<PathBuf>, most: u64) -> Cache {
        Cache { root: root.into(), most, least: LEAST }
    }

    /// Keeps also what is quick to make. For tests.
    #[doc(hidden)]
    pub fn keeping_all(self) -> Cache {
        Cache { least: Duration::ZERO, ..self }
    }

    /// `count` values that `make` makes, or once made, of a `kind` from all that `key` says. What takes less time
    /// to make than to read is not kept.
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

    /// Keeps what took so long to make, where reading it takes less.
    pub fn keep_if_slow<T: Pod>(&self, kind: &str, key: &str, made: &[T], took: Duration) {
        let bytes = size_of_val(made) as u64;
        let read = Duration::from_secs_f64(bytes as f64 * READ_SECONDS_PER_BYTE);
        let worth = self.least.is_zero() || took > self.least + read;
        if worth && bytes <= self.most {
            // Without it the next process makes it anew.
            let _ = self.write(&self.path(kind, key), key, bytemuck::cast_slice(made));
        }
    }

    /// The file of a key.
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

/// The contents of a file, if it is whole and of this key.
fn read<T: Pod>(path: &Path, key: &str, count: usize) -> Option<Vec<T>> {
    let mut file = File::open(path).ok()?;
    let wanted = size_of::<Head>() + key.len() + count * size_of::<T>();
    // Before room is made for it.
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
    // What was used last goes last.
    let _ = file.set_modified(SystemTime::now());
    Some(contents)
}

/// Removes what was used longest ago until `more` bytes fit, and what dead processes left.
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
