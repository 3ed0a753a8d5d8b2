//! Exclusive claims on work, for any number of processes that share a folder.
//!
//! A claim on `fall.0007.exr` is the file `.fall.0007.exr.taki-claim-0` beside it, which only one process
//! can create. Its owner touches it now and then. Where the owner is dead (on this machine that is known), or has
//! not touched it for the stale time (by the watcher's own clock, for clocks differ), the next one claims `-1`,
//! which again only one can create: so a claim is never taken by two. The highest number owns the work. Claims are
//! removed once the work is done: who claims after that finds it done.

use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, mpsc};
use std::time::{Duration, Instant, SystemTime};

use crate::output::frame::{Life, Owner, folder_of};
use crate::util::error::{Error, Result};

/// A claim that still does not say whose it is after so long is stale.
const NAMELESS: Duration = Duration::from_secs(5);

/// Takes claims, and keeps them fresh.
pub struct Claims {
    stale: Duration,
    /// Others' claims: the time stamp of each, and since when it is seen.
    watched: HashMap<PathBuf, (Option<SystemTime>, Instant)>,
    held: Arc<Mutex<Vec<Held>>>,
    /// Dropped to end the thread that touches what is held.
    _stop: mpsc::Sender<()>,
}

struct Held {
    path: PathBuf,
    file: File,
}

/// What came of asking for a claim.
pub enum Asked {
    /// It is ours.
    Ours(Claim),
    /// Someone works on it: who, as far as is known.
    Theirs(String),
}

/// A claim that is held. Dropping it lets others have the work.
pub struct Claim {
    target: PathBuf,
    generation: u32,
    held: Arc<Mutex<Vec<Held>>>,
    /// Machines whose work was taken over: their temporary files for it are stale.
    pub taken_from: Vec<Owner>,
}

fn lock(held: &Mutex<Vec<Held>>) -> std::sync::MutexGuard<'_, Vec<Held>> {
    held.lock().unwrap_or_else(|e| e.into_inner())
}

/// The claim file of a target.
fn claim_path(target: &Path, generation: u32) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(target.file_name().unwrap_or_default());
    name.push(format!(".taki-claim-{generation}"));
    folder_of(target).join(name)
}

impl Claims {
    /// Claims of others are stale when their owner has died, or has not touched them for `stale`.
    pub fn new(stale: Duration) -> Self {
        let held: Arc<Mutex<Vec<Held>>> = Arc::default();
        let (stop, stopped) = mpsc::channel();
        let kept = held.clone();
        // Four chances to be seen alive, even where one touch is late.
        let pause = (stale / 4).max(Duration::from_millis(50));
        std::thread::spawn(move || {
            while stopped.recv_timeout(pause) == Err(mpsc::RecvTimeoutError::Timeout) {
                for held in lock(&kept).iter() {
                    // A claim that cannot be touched is taken over at worst, and made twice.
                    let _ = held.file.set_modified(SystemTime::now());
                }
            }
        });
        Claims { stale, watched: HashMap::new(), held, _stop: stop }
    }

    /// Asks for the work on `target`.
    pub fn ask(&mut self, target: &Path) -> Result<Asked> {
        let mut taken_from = Vec::new();
        for generation in 0..u32::MAX {
            let path = claim_path(target, generation);
            match File::options().write(true).create_new(true).open(&path) {
                Ok(mut file) => {
                    // A full disk leaves it empty: then it says by its time alone that someone is here.
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
                Err(e) if e.kind() == std::io::ErrorKind::StorageFull => return Err(Error::write(&path, e)),
                Err(e) => {
                    return Err(Error::CannotCreate {
                        path,
                        why: e.to_string(),
                        fix: "choose a folder you may write to with -o".into(),
                    });
                }
            }
        }
        Ok(Asked::Theirs("someone".into()))
    }

    /// Removes the claims that dead processes of this machine left on finished work.
    pub fn clear_dead(target: &Path) {
        for path in (0..).map(|generation| claim_path(target, generation)) {
            let owner =
                std::fs::read_to_string(&path).ok().and_then(|t| serde_json::from_str::<Owner>(&t).ok());
            if owner.is_none_or(|o| o.life() != Life::Dead) || std::fs::remove_file(path).is_err() {
                return;
            }
        }
    }

    /// Who owns another's claim, and whether it is stale.
    fn watch(&mut self, path: &Path) -> (Option<Owner>, bool) {
        let Ok(meta) = std::fs::symlink_metadata(path) else {
            // Gone by now: its owner has finished, or given up. Asked again later, it tells.
            self.watched.remove(path);
            return (None, false);
        };
        let touched = meta.modified().ok();
        let mut text = String::new();
        // A pipe of this name would never open.
        let read =
            meta.is_file().then(|| File::open(path).and_then(|f| f.take(4096).read_to_string(&mut text)));
        let owner: Option<Owner> = read.and_then(|_| serde_json::from_str(&text).ok());
        let dead = owner.as_ref().is_some_and(|o| o.life() == Life::Dead);
        let (seen, since) = self.watched.entry(path.to_owned()).or_insert((touched, Instant::now()));
        if *seen != touched {
            (*seen, *since) = (touched, Instant::now());
        }
        // Without a name its process was killed between two calls, or is about to write it.
        let patience = if owner.is_some() { self.stale } else { self.stale.min(NAMELESS) };
        (owner, dead || since.elapsed() > patience)
    }
}

impl Claim {
    /// The work is done, under its final name: every claim on it goes.
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
        // Only our own: one that was stale before us stays, so that who has claimed after it keeps that.
        self.release();
    }
}
