//! What is there already: whole, broken, or another's.

use std::io::Read;
use std::path::Path;

use rayon::prelude::*;

use super::{Batch, stamp};
use crate::job::still::{SOFTWARE, scene_text, volume_line};
use crate::job::{Claims, VolumeStock};
use crate::output::frame::{Kind, Verified, verify};
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;

/// What a file's name holds.
#[derive(Debug, PartialEq)]
pub enum Found {
    Nothing,
    /// Just this picture, every byte of it decoded.
    Whole,
    /// No picture: what is wrong with it.
    Broken(String),
    /// Another picture: what tells it from this one.
    Other(String),
}

/// The first bytes of a regular file.
pub(super) fn start_of(path: &Path) -> Option<Vec<u8>> {
    // A pipe would never open.
    let file = path.is_file().then(|| std::fs::File::open(path).ok())??;
    let mut start = Vec::new();
    file.take(4096).read_to_end(&mut start).ok()?;
    Some(start)
}

/// Whether a file that begins so is a PNG or EXR that this program wrote: its name stands near the start.
pub(super) fn is_ours(start: &[u8]) -> bool {
    let picture = start.starts_with(b"\x89PNG") || start.starts_with(b"\x76\x2f\x31\x01");
    // Whatever its version.
    let name = &SOFTWARE.as_bytes()[..SOFTWARE.find(' ').map_or(SOFTWARE.len(), |space| space + 1)];
    picture && start.windows(name.len()).any(|w| w == name)
}

/// A name that another picture has.
fn taken(file: &Path, what: &str) -> Error {
    Error::CannotCreate {
        path: file.to_owned(),
        why: format!("another file has this name: {what}"),
        fix: "choose other names with -o, or replace it with --overwrite".into(),
    }
}

impl Batch {
    /// Decodes what is there. Files of other scenes are refused unless they may be replaced.
    pub(super) fn look(&mut self, monitor: &dyn Monitor) -> Result<()> {
        let own: Vec<usize> = self.own().collect();
        let there: Vec<usize> = own
            .par_iter()
            .copied()
            .filter(|&n| self.files(n).iter().any(|f| f.symlink_metadata().is_ok()))
            .collect();
        for (part, numbers) in there.chunks(16).enumerate() {
            monitor.progress("verifying", part as u64 * 16, there.len() as u64)?;
            let found: Vec<Result<Vec<Found>>> = if self.request.overwrite {
                numbers.iter().map(|_| Ok(Vec::new())).collect()
            } else {
                numbers.par_iter().map(|&n| self.found(n)).collect()
            };
            for (&number, found) in numbers.iter().zip(found) {
                let files = self.files(number);
                let found = found?;
                for (file, found) in files.iter().zip(&found) {
                    match found {
                        Found::Other(what) => {
                            return Err(taken(file, what));
                        }
                        Found::Broken(why) => {
                            monitor.warn(&format!("{}: {why}; it is rendered again", file.display()));
                        }
                        Found::Whole | Found::Nothing => {}
                    }
                }
                if !found.is_empty() && found.iter().all(|f| *f == Found::Whole) {
                    self.whole[number] = true;
                    files.iter().take(1).for_each(|file| Claims::clear_dead(file));
                    continue;
                }
                for file in files {
                    if file.is_dir() {
                        return Err(Error::CannotCreate {
                            path: file,
                            why: "a folder has this name".into(),
                            fix: "choose another name with -o".into(),
                        });
                    }
                    if let Some(stamp) = stamp(&file) {
                        self.replaced.insert(file, stamp);
                    }
                }
            }
        }
        Ok(())
    }

    /// Whether another process has made the picture since this one has looked. One of another scene is
    /// refused as at first.
    pub(super) fn made_meanwhile(&self, number: usize) -> Result<bool> {
        let files = self.files(number);
        let new = |file: &Path| stamp(file).is_some_and(|s| self.replaced.get(file) != Some(&s));
        if !files.iter().any(|file| new(file)) {
            return Ok(false);
        }
        let found = self.found(number)?;
        for (file, found) in files.iter().zip(&found) {
            if let Found::Other(what) = found
                && new(file)
            {
                return Err(taken(file, what));
            }
        }
        Ok(files.iter().all(|file| new(file)) && found.iter().all(|f| *f == Found::Whole))
    }

    /// What the names of a picture's files hold.
    fn found(&self, number: usize) -> Result<Vec<Found>> {
        let scene = self.scene(number)?;
        self.files(number).iter().map(|file| self.found_in(file, &scene)).collect()
    }

    fn found_in(&self, file: &Path, scene: &Scene) -> Result<Found> {
        if file.symlink_metadata().is_err() {
            return Ok(Found::Nothing);
        }
        if file.is_dir() {
            return Err(Error::CannotCreate {
                path: file.to_owned(),
                why: "a folder has this name".into(),
                fix: "choose another name with -o".into(),
            });
        }
        let verified = match verify(file) {
            Ok(verified) => verified,
            Err(Error::Input { what, .. }) => {
                // What was not ours is nobody's to replace; of ours a part may be left.
                let start = start_of(file).unwrap_or_default();
                let ours = file.is_file() && (start.is_empty() || is_ours(&start));
                return Ok(if ours {
                    Found::Broken(what)
                } else {
                    Found::Other("it is no picture of taki".into())
                });
            }
            Err(e) => return Err(e),
        };
        Ok(match self.difference(file, &verified, scene)? {
            None => Found::Whole,
            Some(what) => Found::Other(what),
        })
    }

    /// What tells the picture in a file from the one of `scene`.
    fn difference(&self, file: &Path, verified: &Verified, scene: &Scene) -> Result<Option<String>> {
        let Some(text) = &verified.scene else {
            return Ok(Some("it does not say what scene it shows".into()));
        };
        let (line, text) = text.split_once('\n').unwrap_or((text, ""));
        let wanted = scene_text(scene);
        if text != wanted {
            let lines = text.lines().map(Some).chain(std::iter::repeat(None));
            let differ = wanted.lines().zip(lines).find(|(want, have)| *have != Some(want));
            return Ok(Some(match differ {
                Some((want, have)) => format!("it has {:?}, this has {want:?}", have.unwrap_or("")),
                None => "its scene has more parameters".into(),
            }));
        }
        if scene.volume_file.is_some() {
            // A built volume follows from its parameters; one from a file may have changed since.
            let memory = self.base.limits().memory;
            let (volume, _) =
                VolumeStock::default().volume(scene, memory, &crate::util::monitor::Unwatched)?;
            if line != volume_line(&volume) {
                return Ok(Some("it was made with other contents of volume.file".into()));
            }
        }
        if verified.window != self.window(scene) {
            return Ok(Some("it is another part of the picture".into()));
        }
        if Kind::of(file)? == Kind::Exr {
            let mut wanted: Vec<&str> =
                self.request.layers.iter().flat_map(|l| l.channels()).copied().collect();
            let mut have: Vec<&str> = verified.channels.iter().map(String::as_str).collect();
            wanted.sort_unstable();
            have.sort_unstable();
            if wanted != have {
                return Ok(Some(format!("it has the channels {}", have.join(", "))));
            }
        }
        Ok(None)
    }
}
