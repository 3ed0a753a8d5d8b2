//! Exclusive claims on work, for any number of processes that share a folder.
//!
//! A claim on `fall.0007.exr` is the file `.fall.0007.exr.taki-claim-0` beside it; a hash replaces a name
//! that is too long for that. Only one process can create that file. Its owner updates the file's
//! modification time four times within the stale time. A claim is stale if its owner is known to be dead
//! (only processes of the same machine can tell) or if the modification time has not changed for the stale
//! time. The observer measures that time with its own clock, because clocks of machines differ.
//!
//! The next process then creates `.fall.0007.exr.taki-claim-1`. Again only one process can, so two never
//! hold the same claim. The highest number owns the work. Claims are removed once the work is done; a
//! process that claims it after that finds the finished file.

use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, mpsc};
use std::time::{Duration, Instant, SystemTime};

use xxhash_rust::xxh3::xxh3_64;

use crate::output::frame::{Life, Owner, folder_of};
use crate::util::error::{Error, Result};

/// A claim file that does not name its owner within this time is stale.
const NAMELESS: Duration = Duration::from_secs(5);

/// Takes claims and keeps their modification times fresh.
pub struct Claims {
    stale: Duration,
    /// Claims of other processes: the last modification time seen, and when it was first seen.
    watched: HashMap<PathBuf, (Option<SystemTime>, Instant)>,
    held: Arc<Mutex<Vec<Held>>>,
    /// Dropping it ends the thread that touches the held claims.
    _stop: mpsc::Sender<()>,
}

struct Held {
    path: PathBuf,
    file: File,
}

/// The answer to a request for a claim.
pub enum Asked {
    /// This process holds the claim.
    Ours(Claim),
    /// Another process works on it: its name, or "someone" if unknown.
    Theirs(String),
}

/// A claim that this process holds. Dropping it lets others take the work.
pub struct Claim {
    target: PathBuf,
    generation: u32,
    held: Arc<Mutex<Vec<Held>>>,
    /// Owners of the stale claims that this one replaces; their temporary files are stale too.
    pub taken_from: Vec<Owner>,
}

fn lock(held: &Mutex<Vec<Held>>) -> std::sync::MutexGuard<'_, Vec<Held>> {
    held.lock().unwrap_or_else(|e| e.into_inner())
}

/// Longest name of a target, bytes, that its claim file can repeat: file systems allow names of 255 bytes.
const LONGEST_NAME: usize = 200;

/// Path of a target's claim file. Each takeover has the next generation.
fn claim_path(target: &Path, generation: u32) -> PathBuf {
    let target_name = target.file_name().unwrap_or_default();
    let bytes = target_name.as_encoded_bytes();
    let mut name = std::ffi::OsString::from(".");
    if bytes.len() <= LONGEST_NAME {
        name.push(target_name);
    } else {
        name.push(format!("{:016x}", xxh3_64(bytes)));
    }
    name.push(format!(".taki-claim-{generation}"));
    folder_of(target).join(name)
}

impl Claims {
    /// Starts a thread that keeps held claims fresh. Claims of other processes are stale if their owner has
    /// died or has not touched them for `stale`.
    pub fn new(stale: Duration) -> Self {
        let held: Arc<Mutex<Vec<Held>>> = Arc::default();
        let (stop, stopped) = mpsc::channel();
        let fresh = held.clone();
        // Four touches within the stale time, so one late touch does no harm.
        let pause = (stale / 4).max(Duration::from_millis(50));
        std::thread::spawn(move || {
            while stopped.recv_timeout(pause) == Err(mpsc::RecvTimeoutError::Timeout) {
                for held in lock(&fresh).iter() {
                    // At worst another process takes the claim over, and the picture is made twice.
                    let _ = held.file.set_modified(SystemTime::now());
                }
            }
        });
        Claims { stale, watched: HashMap::new(), held, _stop: stop }
    }

    /// Asks for the work on `target`.
    ///
    /// # Errors
    /// [`Error::Io`] if the disk is full, [`Error::CannotCreate`] if the claim file cannot be created.
    pub fn ask(&mut self, target: &Path) -> Result<Asked> {
        let mut taken_from = Vec::new();
        for generation in 0..u32::MAX {
            let path = claim_path(target, generation);
            match File::options().write(true).create_new(true).open(&path) {
                Ok(mut file) => {
                    // On a full disk the file stays empty; its modification time alone tells that it is held.
                    let _ = file.write_all(serde_json::json!(Owner::me()).to_string().as_bytes());
                    for older in 0..generation {
                        self.watched.remove(&claim_path(target, older));
                    }
                    lock(&self.held).push(Held { path, file });
                    let held = self.held.clone();
                    return Ok(Asked::Ours(Claim {
                        target: target.to_owned(),
                        generation,
                        held,
                        taken_from,
                    }));
                }
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {
                    let (owner, stale) = self.watch(&path);
                    if !stale {
                        let who =
                            owner.map_or("someone".into(), |o| format!("process {} on {}", o.pid, o.host));
                        return Ok(Asked::Theirs(who));
                    }
                    taken_from.extend(owner);
                }
                Err(e) if e.kind() == std::io::ErrorKind::StorageFull => return Err(Error::write(target, e)),
                Err(e) => {
                    return Err(Error::CannotCreate {
                        path: target.to_owned(),
                        why: e.to_string(),
                        fix: "choose a folder you may write to with -o".into(),
                    });
                }
            }
        }
        Ok(Asked::Theirs("someone".into()))
    }

    /// Removes the claims that dead processes of this machine left on a finished target.
    pub fn clear_dead(target: &Path) {
        for path in (0..).map(|generation| claim_path(target, generation)) {
            let owner =
                std::fs::read_to_string(&path).ok().and_then(|t| serde_json::from_str::<Owner>(&t).ok());
            if owner.is_none_or(|o| o.life() != Life::Dead) || std::fs::remove_file(path).is_err() {
                return;
            }
        }
    }

    /// Returns the owner of another process's claim, if known, and whether the claim is stale.
    fn watch(&mut self, path: &Path) -> (Option<Owner>, bool) {
        let Ok(meta) = std::fs::symlink_metadata(path) else {
            // The owner has just finished or given up. The next request finds out which.
            self.watched.remove(path);
            return (None, false);
        };
        let touched = meta.modified().ok();
        let mut text = String::new();
        // Opening a named pipe would block for ever.
        let read =
            meta.is_file().then(|| File::open(path).and_then(|f| f.take(4096).read_to_string(&mut text)));
        let owner: Option<Owner> = read.and_then(|_| serde_json::from_str(&text).ok());
        let dead = owner.as_ref().is_some_and(|o| o.life() == Life::Dead);
        let (seen, since) = self.watched.entry(path.to_owned()).or_insert((touched, Instant::now()));
        if *seen != touched {
            (*seen, *since) = (touched, Instant::now());
        }
        // The owner of a nameless claim was killed before it could write its name, or is about to write it.
        let patience = if owner.is_some() { self.stale } else { self.stale.min(NAMELESS) };
        (owner, dead || since.elapsed() > patience)
    }
}

impl Claim {
    /// Removes every claim on the target. Call it once the finished file has its final name.
    pub fn done(mut self) {
        let last = self.generation;
        self.release();
        (0..last).for_each(|generation| {
            let _ = std::fs::remove_file(claim_path(&self.target, generation));
        });
        self.generation = u32::MAX;
    }

    fn release(&mut self) {
        if self.generation != u32::MAX {
            let path = claim_path(&self.target, self.generation);
            lock(&self.held).retain(|held| held.path != path);
            let _ = std::fs::remove_file(path);
        }
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // Only this claim goes. Older stale ones stay, so that a newer claim keeps its number.
        self.release();
    }
}
