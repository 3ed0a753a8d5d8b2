//! Reading of the next picture's volumes while one picture renders.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;

use super::memo::Source;
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::volume::VolumeTexture;

/// A volume that was read before it is needed.
pub(super) struct Early {
    pub name: String,
    pub source: Source,
    pub volume: VolumeTexture,
    /// What the reading warned of.
    pub notes: Vec<String>,
}

/// Slot for the volumes of one scene, which a thread reads.
#[derive(Default)]
pub(super) struct Ahead {
    thread: Option<JoinHandle<Vec<Early>>>,
    stop: Arc<AtomicBool>,
}

impl Ahead {
    /// Starts to read those volumes of a scene with the numbers `wanted`, within `memory`
    /// bytes. One that cannot be read is left out: whoever needs it gets the error.
    pub fn start(&mut self, scene: Scene, wanted: Vec<usize>, memory: u64) {
        self.cancel();
        let stop = Arc::new(AtomicBool::new(false));
        self.stop = stop.clone();
        let read = move || {
            let mut made: Vec<Early> = Vec::new();
            for number in wanted {
                let recipe = &scene.recipes[number];
                let source = Source::of(recipe);
                let held = made.iter().map(|own| own.volume.cells.bytes()).sum();
                let watch = Watch { stop: &stop, notes: Mutex::default() };
                let left = memory.saturating_sub(held);
                let Ok(volume) = scene.cached_volume(number, None, left, &watch) else { continue };
                let notes = watch.notes.into_inner().unwrap_or_else(PoisonError::into_inner);
                made.push(Early { name: recipe.name.clone(), source, volume, notes });
            }
            made
        };
        // Without a thread the volumes are read when they are needed.
        self.thread = std::thread::Builder::new().name("volumes".into()).spawn(read).ok();
    }

    /// Waits for the volumes and takes them.
    pub fn take(&mut self) -> Vec<Early> {
        self.thread.take().and_then(|thread| thread.join().ok()).unwrap_or_default()
    }

    /// Ends the reading.
    fn cancel(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        drop(self.take());
    }
}

impl Drop for Ahead {
    fn drop(&mut self) {
        self.cancel();
    }
}

/// Monitor of the reading, which keeps the warnings.
struct Watch<'a> {
    stop: &'a AtomicBool,
    notes: Mutex<Vec<String>>,
}

impl Monitor for Watch<'_> {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        match self.stop.load(Ordering::Relaxed) {
            true => Err(Error::Interrupted { code: 130 }),
            false => Ok(()),
        }
    }

    fn warn(&self, text: &str) {
        self.notes.lock().unwrap_or_else(PoisonError::into_inner).push(text.into());
    }
}
