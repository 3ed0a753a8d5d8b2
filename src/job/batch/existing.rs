//! Examines files that already exist: complete, damaged, or another picture.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use rayon::prelude::*;

use super::{Batch, stamp};
use crate::job::still::{SOFTWARE, scene_text, volume_line};
use crate::job::{Claims, VolumeMemo};
use crate::output::frame::{Compression, Format, Verified, listed, real_file, verify};
use crate::output::movie::mark_of;
use crate::picture::Layer;
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;

/// State of a picture's file.
#[derive(Debug, PartialEq)]
pub enum FileState {
    /// There is no file.
    Nothing,
    /// Exactly this picture, if its volumes are those of this line; all of it was decoded.
    Whole(String),
    /// A damaged picture: description of the damage.
    Broken(String),
    /// Another picture: description of the difference.
    Other(String),
}

/// Scene of a picture, and the state of each of its files.
type Examined = (Scene, Vec<FileState>);

impl FileState {
    fn is_whole(&self) -> bool {
        matches!(self, FileState::Whole(_))
    }
}

/// Time at which a picture was written.
fn written(picture: &Path) -> Option<SystemTime> {
    picture.metadata().ok()?.modified().ok()
}

/// Time of the last change of a volume's file. A copy or a move may keep the time of the contents; on Unix
/// the time of the change of the file itself counts too, and elsewhere that of its creation. `None` for a
/// file without times, which must be read.
fn changed(source: &Path) -> Option<SystemTime> {
    let meta = source.metadata().ok()?;
    #[cfg(unix)]
    let own = {
        use std::os::unix::fs::MetadataExt;
        let [seconds, nanoseconds] = [meta.ctime(), meta.ctime_nsec()].map(|n| n.max(0) as u64);
        SystemTime::UNIX_EPOCH + Duration::new(seconds, nanoseconds as u32)
    };
    #[cfg(not(unix))]
    let own = meta.created().ok()?;
    Some(meta.modified().ok()?.max(own))
}

/// The first 4096 bytes of a regular file; `None` if it is not a readable one.
pub(super) fn start_of(path: &Path) -> Option<Vec<u8>> {
    // Opening a named pipe would block for ever.
    let file = path.is_file().then(|| std::fs::File::open(path).ok())??;
    let mut start = Vec::new();
    file.take(4096).read_to_end(&mut start).ok()?;
    Some(start)
}

/// Whether a file is a picture of this program, whose name then stands in it.
pub(super) fn is_ours(path: &Path) -> bool {
    // Other versions of the program count too.
    let name = &SOFTWARE.as_bytes()[..SOFTWARE.find(' ').map_or(SOFTWARE.len(), |space| space + 1)];
    holds(path, name)
}

/// Whether a file is a picture with `text` among its texts: near the start, but in WebP and TIFF after the
/// pixels.
pub(super) fn holds(path: &Path, text: &[u8]) -> bool {
    let start = start_of(path).unwrap_or_default();
    let bytes = match Format::of_start(&start) {
        None => return false,
        Some(Format::Webp | Format::Tiff) => std::fs::read(path).unwrap_or(start),
        Some(_) => start,
    };
    bytes.windows(text.len()).any(|w| w == text)
}

/// The error for a name that another picture has.
fn taken(file: &Path, what: &str) -> Error {
    Error::CannotCreate {
        path: file.to_owned(),
        why: format!("another picture has this name: {what}"),
        fix: "choose other names with -o, or replace the file with --overwrite".into(),
    }
}

impl Batch {
    /// Decodes the existing files. Refuses files of other pictures unless they may be replaced.
    pub(super) fn look(&mut self, monitor: &dyn Monitor) -> Result<()> {
        let own: Vec<usize> = self.own().collect();
        let there: Vec<usize> = own
            .par_iter()
            .copied()
            .filter(|&n| self.files(n).iter().any(|f| f.symlink_metadata().is_ok()))
            .collect();
        let mut memo = VolumeMemo::default();
        for (part, numbers) in there.chunks(16).enumerate() {
            monitor.progress("verifying", part as u64 * 16, there.len() as u64)?;
            let examined: Vec<Option<Result<Examined>>> = if self.request.overwrite {
                numbers.iter().map(|_| None).collect()
            } else {
                numbers.par_iter().map(|&n| Some(self.states(n))).collect()
            };
            for (&number, examined) in numbers.iter().zip(examined) {
                let files = self.files(number);
                let mut states = Vec::new();
                if let Some(examined) = examined {
                    let scene;
                    (scene, states) = examined?;
                    self.check_volumes(&scene, &files, &mut states, &mut memo, monitor)?;
                }
                for (file, state) in files.iter().zip(&states) {
                    match state {
                        FileState::Other(what) => {
                            return Err(taken(file, what));
                        }
                        FileState::Broken(why) => {
                            monitor.warn(&format!("{}: {why}; it is rendered again", file.display()));
                        }
                        FileState::Whole(_) | FileState::Nothing => {}
                    }
                }
                if !states.is_empty() && states.iter().all(FileState::is_whole) {
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

    /// Whether another process has made the picture since [`Batch::look`]. Refuses a picture of another
    /// scene, as [`Batch::look`] does.
    pub(super) fn made_meanwhile(&self, number: usize, monitor: &dyn Monitor) -> Result<bool> {
        let files = self.files(number);
        let new = |file: &Path| stamp(file).is_some_and(|s| self.replaced.get(file) != Some(&s));
        if !files.iter().any(|file| new(file)) {
            return Ok(false);
        }
        let (scene, mut states) = self.states(number)?;
        self.check_volumes(&scene, &files, &mut states, &mut VolumeMemo::default(), monitor)?;
        for (file, state) in files.iter().zip(&states) {
            if let FileState::Other(what) = state
                && new(file)
            {
                return Err(taken(file, what));
            }
        }
        Ok(files.iter().all(|file| new(file)) && states.iter().all(FileState::is_whole))
    }

    /// Scene of a picture, and the state of each of its files. The contents of the volumes' files are not
    /// compared yet.
    fn states(&self, number: usize) -> Result<Examined> {
        let scene = self.scene(number)?;
        let files = self.files(number);
        let state = |(file, layers): (&PathBuf, &Vec<Layer>)| self.state_of(file, layers, &scene);
        let states = files.iter().zip(&self.layers).map(state).collect::<Result<_>>()?;
        Ok((scene, states))
    }

    /// Puts [`FileState::Other`] in the place of pictures of other contents of the volumes' files. One
    /// picture's volumes are read at a time, because they may fill the memory. They are not read for pictures
    /// that are newer than all of the files.
    fn check_volumes(
        &self,
        scene: &Scene,
        files: &[PathBuf],
        states: &mut [FileState],
        memo: &mut VolumeMemo,
        monitor: &dyn Monitor,
    ) -> Result<()> {
        let sources: Vec<&Path> = scene.recipes.iter().filter_map(|recipe| recipe.file.as_deref()).collect();
        let is_older = |source: &&Path, picture: &Path| {
            changed(source).zip(written(picture)).is_some_and(|(source, picture)| source < picture)
        };
        let is_known = |(file, state): (&PathBuf, &FileState)| {
            !state.is_whole() || sources.iter().all(|source| is_older(source, file))
        };
        if files.iter().zip(states.iter()).all(is_known) {
            return Ok(());
        }
        let (volumes, _) = memo.volumes(scene, self.base.limits().memory, monitor)?;
        let wanted = volume_line(&volumes);
        for state in states {
            if matches!(state, FileState::Whole(line) if *line != wanted) {
                *state = FileState::Other("it was made with other contents of volume.file".into());
            }
        }
        Ok(())
    }

    fn state_of(&self, file: &Path, layers: &[Layer], scene: &Scene) -> Result<FileState> {
        // A link to a file that does not exist yet is as good as nothing.
        let real = real_file(file)?;
        if real.symlink_metadata().is_err() {
            return Ok(FileState::Nothing);
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
            // It has been removed since.
            Err(_) if real.symlink_metadata().is_err() => return Ok(FileState::Nothing),
            Err(Error::Input { what, .. }) => {
                // A file of another program must stay. A damaged one of ours, or an empty one, may be the
                // rest of an interrupted run.
                let start = start_of(file).unwrap_or_default();
                let ours = file.is_file() && (start.is_empty() || is_ours(file));
                return Ok(if ours {
                    FileState::Broken(what)
                } else {
                    FileState::Other(match mark_of(file) {
                        Some(_) => "it is a movie that taki wrote".into(),
                        None => "it is not a picture that taki wrote".into(),
                    })
                });
            }
            Err(e) => return Err(e),
        };
        Ok(match self.difference((file, layers), &verified, scene)? {
            None => {
                let text = verified.scene.as_deref().unwrap_or_default();
                FileState::Whole(text.lines().next().unwrap_or_default().into())
            }
            Some(what) => FileState::Other(what),
        })
    }

    /// Describes how the picture in a file differs from the one of `scene`; `None` if it does not.
    fn difference(
        &self,
        (file, layers): (&Path, &[Layer]),
        verified: &Verified,
        scene: &Scene,
    ) -> Result<Option<String>> {
        let Some(text) = &verified.scene else {
            return Ok(Some("it does not name its scene".into()));
        };
        // The first line names the volumes.
        let text = text.split_once('\n').map_or("", |(_, text)| text);
        let wanted = scene_text(scene);
        if text != wanted {
            let lines = text.lines().map(Some).chain(std::iter::repeat(None));
            let differ = wanted.lines().zip(lines).find(|(want, have)| *have != Some(want));
            return Ok(Some(match differ {
                Some((want, have)) => {
                    format!("it has {:?}, but this picture has {want:?}", have.unwrap_or(""))
                }
                None => "its scene has more parameters".into(),
            }));
        }
        if verified.window != self.window(scene) {
            return Ok(Some("it shows another part of the picture".into()));
        }
        let wanted = Format::of(file);
        if wanted != Some(verified.format) {
            return Ok(Some(format!("it is a {}", verified.format.name())));
        }
        if let Some((format, encoding)) = wanted.zip(verified.encoding) {
            let wanted = self.encoding(format, scene.image.alpha).in_gamut(scene.image.gamut);
            if encoding != wanted {
                return Ok(Some(format!("it has {encoding}, but this picture has {wanted}")));
            }
        }
        if verified.format == Format::Exr {
            let exr = &self.request.exr;
            let wanted = exr.channels(layers, scene.image.alpha);
            if wanted != verified.channels {
                return Ok(Some(format!("it has the channels {}", listed(&verified.channels))));
            }
            if let Some(head) = &verified.head {
                let compression = Compression::for_width(exr.compression, &wanted, scene.image.width)?;
                if head.compression != compression {
                    return Ok(Some(format!("its compression is {}", head.compression.word())));
                }
                if head.rate != exr.rate {
                    let [n, d] = head.rate.unwrap_or([0, 1]);
                    return Ok(Some(format!("it is for {n}/{d} frames per second")));
                }
            }
        }
        Ok(None)
    }
}
