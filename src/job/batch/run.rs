//! Renders a batch: claims each picture, renders it and hands it to the writer.

use std::time::{Duration, Instant};

use super::Batch;
use super::report::{Event, Name, Summary, Watcher};
use super::writer::{Outcomes, Start, Writer};
use crate::engine::{Engine, RenderOptions};
use crate::job::{
    Asked, Claim, Claims, Still, VolumeMemo, beside_encoders, memory_of, spare_for_next, spare_for_rasters,
};
use crate::output::frame::remove_left_by;
use crate::place::{Ground, Mesh};
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::window::Window;

/// Pause before pictures that other processes had claimed are tried again.
const WAIT: Duration = Duration::from_millis(200);

/// State that the pictures of a run share.
struct Work<'a> {
    batch: &'a Batch,
    engine: &'a mut Engine,
    claims: Claims,
    volumes: VolumeMemo,
    mesh: Option<(Ground, Mesh)>,
    /// Picture that probably comes next.
    next: Option<usize>,
    /// Scene of a picture whose files are read ahead.
    coming: Option<(usize, Scene)>,
    watcher: &'a dyn Watcher,
    /// Whether the scene's warnings have been shown.
    warned: bool,
    summary: Summary,
    /// The first error of a picture that did not end the run.
    failure: Option<Error>,
}

/// Result of trying a picture.
enum Tried {
    /// All its strips were handed to the writer.
    Handed,
    /// Another process has made it.
    Elsewhere,
    /// Another process is making it: the name of that process.
    Theirs(String),
}

impl Batch {
    /// Renders the missing pictures of this run's shard and waits for pictures that other processes have
    /// claimed. The watcher gets the summary even if the run fails.
    ///
    /// # Errors
    /// The error that ended the run. With `keep_going`, if none did, the first error of a picture.
    pub fn run(&self, engine: &mut Engine, watcher: &dyn Watcher) -> Result<Summary> {
        let clock = Instant::now();
        let numbers: Vec<usize> = self.own().filter(|&n| !self.whole[n]).collect();
        let pictures = self.own().count() as u64;
        let kept = pictures - numbers.len() as u64;
        let adapter = engine.adapter().unwrap_or_else(|| engine.word().into());
        watcher.event(&Event::Started { pictures, kept, engine: &adapter });
        let mut work = Work {
            batch: self,
            engine,
            claims: Claims::new(self.request.stale),
            volumes: VolumeMemo::with(self.base.limits().cache.clone()).making_room(),
            mesh: None,
            next: None,
            coming: None,
            watcher,
            warned: false,
            summary: Summary { pictures, kept, auto_exposure: self.measured, ..Default::default() },
            failure: None,
        };
        let ended = std::thread::scope(|scope| {
            let writer = Writer::start(scope, watcher);
            let ended = work.all(numbers, &writer);
            (ended, writer.finish())
        });
        // The end of the scope has joined the writer's thread, so all outcomes are known.
        let (ended, outcomes) = ended;
        let last = std::mem::take(&mut *outcomes.lock().unwrap_or_else(|e| e.into_inner()));
        let ended = ended.and(work.note(last));
        let whole = work.failure.is_none();
        if ended.is_ok() && whole {
            // A process that was killed may have claimed a picture that this run was done with.
            self.own().filter_map(|n| self.files(n).into_iter().next()).for_each(|f| Claims::clear_dead(&f));
        }
        let ended = ended.and_then(|()| if whole { self.assemble(watcher) } else { Ok(()) });
        let Work { mut summary, failure, .. } = work;
        let result = match (ended, failure) {
            (Err(e), _) | (Ok(()), Some(e)) => Err(e),
            (Ok(()), None) => Ok(()),
        };
        summary.left = pictures - kept - summary.rendered - summary.elsewhere - summary.failed;
        summary.elapsed = clock.elapsed().as_secs_f64();
        summary.exit_code = result.as_ref().map_or_else(Error::exit_code, |()| 0);
        watcher.event(&Event::Done(&summary));
        result.map(|()| summary)
    }

    /// The part of the image that the batch renders.
    pub(super) fn window(&self, scene: &Scene) -> Window {
        self.request.crop.unwrap_or(Window::whole([scene.image.width, scene.image.height]))
    }
}

impl Work<'_> {
    /// Tries the pictures in order, then repeats with those that other processes had claimed, until none is
    /// left.
    fn all(&mut self, mut numbers: Vec<usize>, writer: &Writer) -> Result<()> {
        let mut round = 0;
        while !numbers.is_empty() {
            let mut theirs = Vec::new();
            let mut who = String::new();
            for (i, &number) in numbers.iter().enumerate() {
                self.next = numbers.get(i + 1).copied();
                // Notices signals even if other processes hold every picture.
                self.watcher.progress("pictures", 0, 1)?;
                match self.attempts(number, writer) {
                    Ok(Tried::Handed) => {}
                    Ok(Tried::Elsewhere) => {
                        self.summary.elsewhere += 1;
                        self.watcher.event(&Event::Elsewhere { picture: &self.batch.name(number) });
                    }
                    Ok(Tried::Theirs(other)) => {
                        theirs.push(number);
                        who = other;
                    }
                    Err(e) => self.note(vec![(number, self.batch.name(number), Err(e))])?,
                }
                self.note(writer.outcomes())?;
            }
            numbers = theirs;
            if !numbers.is_empty() {
                if round == 0 {
                    self.watcher.event(&Event::Waiting { pictures: numbers.len() as u64, on: &who });
                }
                round += 1;
                std::thread::sleep(WAIT);
            }
        }
        Ok(())
    }

    /// Tries a picture, again after each lost device as long as retries remain.
    fn attempts(&mut self, number: usize, writer: &Writer) -> Result<Tried> {
        let mut retries = self.batch.request.retries;
        loop {
            match self.attempt(number, writer) {
                Err(e @ Error::DeviceLost(_)) if retries > 0 => {
                    retries -= 1;
                    let picture = self.batch.name(number);
                    self.watcher.event(&Event::Retry { picture: &picture, error: e.to_string() });
                    self.engine.renew()?;
                }
                other => return other,
            }
        }
    }

    fn attempt(&mut self, number: usize, writer: &Writer) -> Result<Tried> {
        let files = self.batch.files(number);
        if files.is_empty() {
            // Without picture files there is nothing to share with other processes, so nothing to claim.
            self.render(number, None, writer)?;
            return Ok(Tried::Handed);
        }
        let claim = match self.claims.ask(&files[0])? {
            Asked::Theirs(who) => return Ok(Tried::Theirs(who)),
            Asked::Ours(claim) => claim,
        };
        if self.batch.made_meanwhile(number, self.watcher)? {
            claim.done();
            return Ok(Tried::Elsewhere);
        }
        for owner in &claim.taken_from {
            files.iter().for_each(|file| remove_left_by(owner, file));
        }
        self.render(number, Some(claim), writer)?;
        Ok(Tried::Handed)
    }

    fn render(&mut self, number: usize, claim: Option<Claim>, writer: &Writer) -> Result<()> {
        let began = Instant::now();
        let name = self.batch.name(number);
        self.watcher.event(&Event::Rendering { picture: &name });
        let files = self.batch.files(number);
        let scene = match self.coming.take() {
            Some((own, scene)) if own == number => scene,
            _ => self.batch.scene(number)?,
        };
        let memory = self.batch.base.limits().memory;
        let still = Still::open(&files)?.with_depth(self.batch.request.depth);
        let exr = &self.batch.request.exr;
        let surface = still.has_exr() && exr.layers.iter().any(|l| l.of_surface());
        let window = self.batch.window(&scene);
        let (volumes, _) = self.volumes.volumes(&scene, memory, self.watcher)?;
        if !std::mem::replace(&mut self.warned, true) {
            scene.warnings(&*volumes).iter().for_each(|w| self.watcher.warn(w));
        }
        let mesh = self.mesh(&scene);
        let memory = beside_encoders(memory, &still.formats(), window)?;
        let (needed, parts) = memory_of(&scene, window, surface, memory)?;
        let mut start = Some(Start {
            number,
            name: name.clone(),
            files,
            still: Some(still),
            claim,
            scene: scene.clone(),
            volumes: volumes.clone(),
            window,
            exr: exr.clone(),
            movies: self.batch.movies_starting(number, &scene),
            last: (number + 1).is_multiple_of(self.batch.frames.len()),
            began,
        });
        let several = parts.len() > 1;
        let keep_rasters = if several { 0 } else { spare_for_rasters(memory, needed) };
        if !several {
            let held = volumes.iter().map(|volume| volume.cells.bytes()).sum();
            self.read_ahead(&scene, spare_for_next(memory, needed, held));
        }
        for part in parts {
            let options = RenderOptions { surface, window: Some(part), keep_rasters, ..Default::default() };
            let rows = [part.y - window.y, part.height, window.height];
            let watch = Share { watcher: self.watcher, name: &name, rows };
            let frame = match self.engine.render_volume(&scene, &*volumes, &mesh, &options, &watch) {
                Ok(frame) => frame,
                Err(e) => {
                    if start.is_none() {
                        writer.drop_picture();
                    }
                    return Err(e);
                }
            };
            if frame.non_finite_pixels() > 0 {
                let count = frame.non_finite_pixels();
                self.watcher.warn(&format!(
                    "{name}: {count} pixels are not finite; please report this scene as a bug"
                ));
            }
            if let Some(start) = start.take() {
                writer.begin(start);
            }
            writer.strip(frame);
            if several {
                // Strips are as large as memory allows, so the next one must wait until this one is written.
                writer.settle();
            }
        }
        writer.end();
        Ok(())
    }

    /// Starts to read the files of the next picture within `memory` bytes, if the scene has a sequence.
    fn read_ahead(&mut self, scene: &Scene, memory: u64) {
        let is_sequence = scene.recipes.iter().any(|recipe| recipe.is_sequence);
        let Some(next) = self.next.filter(|_| is_sequence && memory > 0) else { return };
        // A fault of the next picture is reported when its turn comes.
        if let Ok(scene) = self.batch.scene(next) {
            self.volumes.read_ahead(scene.clone(), memory);
            self.coming = Some((next, scene));
        }
    }

    fn mesh(&mut self, scene: &Scene) -> Mesh {
        let ground = scene.ground();
        match &self.mesh {
            Some((known, mesh)) if *known == ground => mesh.clone(),
            _ => {
                let mesh = scene.cached_mesh(self.batch.base.limits().cache.as_ref());
                self.mesh = Some((ground, mesh.clone()));
                mesh
            }
        }
    }

    /// Counts outcomes of pictures. Returns the error that ends the run, if there is one.
    fn note(&mut self, outcomes: Outcomes) -> Result<()> {
        let mut end = Ok(());
        for (_, name, outcome) in outcomes {
            match outcome {
                Ok(seconds) => {
                    self.summary.rendered += 1;
                    self.summary.seconds += seconds;
                }
                Err(e @ Error::Interrupted { .. }) => end = Err(e),
                Err(e) => {
                    self.summary.failed += 1;
                    let (error, exit_code) = (e.to_string(), e.exit_code());
                    self.watcher.event(&Event::Failed { picture: &name, error, exit_code });
                    // A hung device would hang at every later picture too.
                    let hopeless = matches!(e, Error::Watchdog { .. });
                    if hopeless || !self.batch.request.keep_going {
                        end = end.and(Err(e));
                    } else {
                        self.failure.get_or_insert(e);
                    }
                }
            }
        }
        end
    }
}

/// Reports progress within one strip as progress of its picture.
struct Share<'a> {
    watcher: &'a dyn Watcher,
    name: &'a Name,
    /// Number of rows before the strip, in the strip, and in the picture.
    rows: [u32; 3],
}

impl Monitor for Share<'_> {
    fn progress(&self, stage: &'static str, done: u64, total: u64) -> Result<()> {
        self.watcher.progress(stage, done, total)?;
        if stage == "pixels" {
            let [before, strip, all] = self.rows.map(f64::from);
            let share = (before + strip * done as f64 / total.max(1) as f64) / all;
            self.watcher.event(&Event::Progress { picture: self.name, share });
        }
        Ok(())
    }

    fn warn(&self, text: &str) {
        self.watcher.warn(&format!("{}: {text}", self.name));
    }
}
