//! The loop of the render thread, and its work on a request.

mod export;
mod faults;
mod kept;
mod watch;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::{Export, MessageKind, Picture, Request, Shared, lock};
use crate::engine::gpu::DeviceOptions;
use crate::engine::{Engine, EngineChoice, RenderOptions, exposure};
use crate::job::VolumeMemo;
use crate::picture::camera::CENTRE;
use crate::picture::{AutoExposure, Frame, Look};
use crate::place::{Ground, Mesh};
use crate::scene::{Cost, Scene, Values, split_volume_key};
use crate::util::cache::Cache;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::viewer::document::changed_keys;
use crate::viewer::layer_image::layer_image;
use crate::volume::VolumeTexture;
use eframe::egui;
use kept::{Kept, Rendered};

/// Target time of a preview. With the window's own frame and the volume's upload, a preview stays under 150
/// ms.
const PREVIEW_SECONDS: f64 = 0.06;
/// Pixels of the very first preview, when the scene's cost is not yet known.
const FIRST_PREVIEW_PIXELS: f64 = 15_000.0;
/// If a full picture takes longer than this, smaller pictures of growing size come first.
const STEP_SECONDS: f64 = 0.4;
/// Time that the renderer waits for the next change after a preview, before it starts to refine.
const SETTLE: Duration = Duration::from_millis(60);
/// A preview is finished even if a newer request waits, because otherwise a moving slider would show no
/// pictures. A preview that takes longer than this is abandoned for the newer request.
const PATIENCE: Duration = Duration::from_millis(250);
/// The same limit for building a volume, which is worth a longer wait.
const BUILD_PATIENCE: Duration = Duration::from_secs(2);
/// Size of the cache of raster passes, bytes. With it, previews skip the raster pass while the water plays or
/// a slider of the walk moves. It holds the results of several previews, or of one picture of 1.2 times 720p.
const RASTER_CACHE_BYTES: u64 = 48 << 20;
/// Share of the memory budget for pictures that are valid but not in the window.
const KEPT_SHARE: u64 = 16;
/// Scale from which on rocks are drawn coarsely.
const COARSE_SCALE: u32 = 3;
/// Error of coarsely drawn rocks, pixels of the preview. See [`Image::rock_error`](crate::picture::Image).
const COARSE_ROCK: f32 = 6.0;
/// Scales of previews to choose from: pixels of the viewport per pixel of the preview, along one side.
const SCALES: [u32; 8] = [1, 2, 3, 4, 6, 8, 12, 16];

/// Times of the last pictures, seconds per sample.
#[derive(Default)]
struct Speed {
    /// Time of walk, tone and read-back, per pixel.
    per_pixel: Option<f64>,
    /// Time of the rest per picture, mostly the raster pass: with fine rocks, then with coarse ones.
    per_picture: [f64; 2],
}

/// State of the render thread.
pub struct Renderer {
    shared: Arc<Shared>,
    choice: EngineChoice,
    device: DeviceOptions,
    memory: u64,
    engine: Option<Engine>,
    volume: VolumeMemo,
    /// Disk cache for the mesh of the first scene. `None` once that is made.
    cache: Option<Cache>,
    mesh: Option<(Ground, Mesh)>,
    /// The full-size picture in the window.
    rendered: Option<Rendered>,
    /// Other pictures that are still valid.
    kept: Kept,
    /// Whether the last request was left for an export and is to be continued.
    unfinished: bool,
    /// The values that the last automatic exposure was measured for, and the exposure in stops.
    exposed: Option<(Values, f32)>,
    speed: Speed,
    /// Times at which devices were lost in the last minute.
    losses: VecDeque<Instant>,
}

enum Task {
    View(Box<Request>),
    Export(Box<Export>),
    LoseDevice,
    Quit,
}

impl Renderer {
    /// Creates the renderer. It opens the engine in [`Renderer::run`].
    pub fn new(
        shared: Arc<Shared>,
        choice: EngineChoice,
        device: DeviceOptions,
        memory: u64,
        cache: Option<Cache>,
    ) -> Self {
        Renderer {
            shared,
            choice,
            device,
            memory,
            engine: None,
            volume: VolumeMemo::with(cache.clone()),
            cache,
            mesh: None,
            rendered: None,
            kept: Kept::default(),
            unfinished: false,
            exposed: None,
            speed: Speed::default(),
            losses: VecDeque::new(),
        }
    }

    /// Works until the window's side is dropped.
    pub fn run(mut self) {
        self.open_engine();
        loop {
            match self.next() {
                Task::Quit => return,
                Task::LoseDevice => {
                    if let Some(Engine::Gpu { renderer, .. }) = &self.engine {
                        renderer.gpu.device.destroy();
                    }
                }
                Task::View(request) => {
                    let serial = request.serial;
                    let retry = (*request).clone();
                    let again = self.attempt(|renderer| renderer.view(*request));
                    if std::mem::take(&mut self.unfinished) || again {
                        // Continues after an export, or on the new device or the CPU, unless a newer request
                        // waits.
                        let mut queue = lock(&self.shared.queue);
                        queue.view.get_or_insert(retry);
                        continue;
                    }
                    let mut state = lock(&self.shared.state);
                    state.settled = state.settled.max(serial);
                    state.busy = None;
                }
                Task::Export(export) => {
                    if self.attempt(|renderer| renderer.export(&export)) {
                        lock(&self.shared.queue).exports.push_front(*export);
                        continue;
                    }
                    let mut state = lock(&self.shared.state);
                    state.exports_done += 1;
                    state.busy = None;
                }
            }
            (self.shared.wake)();
        }
    }

    /// Waits for the next task. Exports come before requests of the window.
    fn next(&self) -> Task {
        let mut queue = lock(&self.shared.queue);
        loop {
            if queue.quit {
                return Task::Quit;
            }
            if std::mem::take(&mut queue.lose_device) {
                return Task::LoseDevice;
            }
            if let Some(export) = queue.exports.pop_front() {
                return Task::Export(Box::new(export));
            }
            if let Some(request) = queue.view.take() {
                return Task::View(Box::new(request));
            }
            queue = self.shared.queue_changed.wait(queue).unwrap_or_else(|e| e.into_inner());
        }
    }

    /// Waits up to `time` for a task newer than request `serial`. Returns whether there is one.
    fn superseded(&self, serial: u64, time: Duration) -> bool {
        let until = Instant::now() + time;
        let mut queue = lock(&self.shared.queue);
        loop {
            let newer = self.shared.newest.load(Ordering::Relaxed) > serial;
            if newer || queue.quit || queue.lose_device || !queue.exports.is_empty() {
                return true;
            }
            let remaining = until.saturating_duration_since(Instant::now());
            if remaining.is_zero() {
                return false;
            }
            let woken = self.shared.queue_changed.wait_timeout(queue, remaining);
            queue = woken.map_or_else(|e| e.into_inner().0, |woken| woken.0);
        }
    }

    /// Renders a request of the window: a preview, the full size, then sample after sample.
    fn view(&mut self, request: Request) -> Result<()> {
        let (volumes, volume_cost) = self.volumes(&request)?;
        let (mesh, new_mesh) = self.mesh(&request.scene);
        let cost = match volume_cost {
            Some(cost) => cost,
            None if new_mesh => Cost::Upload,
            None => Cost::Uniform,
        };
        let look = self.exposed(&request.scene, &volumes, &mesh, request.serial)?.image.look;
        let job = Job { request: &request, volumes, mesh, cost, look };
        let old = self.rendered.take();
        if let Some(rendered) = self.kept.exchange(old, &job, self.memory / KEPT_SHARE) {
            self.continued(&job, rendered)?;
        } else {
            let scale = self.preview_scale(request.size);
            self.picture(&job, scale, true)?;
            if self.superseded(request.serial, SETTLE) {
                self.unfinished = true;
                return Ok(());
            }
            self.enlarge(&job, scale)?;
        }
        self.refine(&job)
    }

    /// Shows a picture that the request continues.
    fn continued(&mut self, job: &Job, mut rendered: Rendered) -> Result<()> {
        let layer = job.request.layer;
        if layer.of_surface() && rendered.frame.surface.is_none() {
            // Only the raster pass is run: the rays of the picture stay as they are.
            match self.render(job, 1, CENTRE..CENTRE, "preview") {
                Ok(frame) => rendered.set_surface(frame.surface),
                Err(e) => {
                    self.rendered = Some(rendered);
                    return Err(e);
                }
            }
        }
        self.keep(job, rendered, true);
        Ok(())
    }

    /// Renders pictures of growing size, from a preview's `scale` to full size.
    fn enlarge(&mut self, job: &Job, mut scale: u32) -> Result<()> {
        while scale > 1 {
            scale = match self.seconds_for(job.request.size, 1) {
                // On the way to a slow picture, each picture has twice the resolution of the one before it.
                full if full > STEP_SECONDS && scale > 2 => scale.div_ceil(2).max(2),
                _ => 1,
            };
            self.picture(job, scale, false)?;
        }
        Ok(())
    }

    /// Adds samples to the full-size picture, until it has as many as requested. Samples that are finished
    /// stay when the work is interrupted.
    fn refine(&mut self, job: &Job) -> Result<()> {
        let most = job.request.samples;
        // A GPU takes all samples of a step in one go, because each reading back costs time.
        let at_once = if matches!(self.engine, Some(Engine::Gpu { .. })) { u32::MAX } else { 1 };
        while let Some(rendered) = &mut self.rendered
            && rendered.samples < most
        {
            let fork = rendered.fork(most);
            let numbers = rendered.next_samples(most, at_once);
            fork.into_iter().for_each(|old| self.kept.put(old));
            if self.superseded(job.request.serial, Duration::ZERO) {
                self.unfinished = true;
                return Ok(());
            }
            let part = self.render(job, 1, numbers.clone(), "refining")?;
            if let Some(mut rendered) = self.rendered.take() {
                match rendered.add(part, numbers, most) {
                    true => self.keep(job, rendered, false),
                    false => self.rendered = Some(rendered),
                }
            }
        }
        Ok(())
    }

    /// Renders and shows the sample at the pixels' centres at 1/`scale` of the size.
    fn picture(&mut self, job: &Job, scale: u32, first: bool) -> Result<()> {
        let frame =
            self.render(job, scale, CENTRE..CENTRE + 1, if first { "preview" } else { "refining" })?;
        match scale {
            1 => self.keep(job, Rendered::first(job, frame), first),
            _ => self.show(job, Arc::new(frame), scale, 1, first),
        }
        Ok(())
    }

    /// Shows a full-size picture and keeps it for refinement.
    fn keep(&mut self, job: &Job, rendered: Rendered, first: bool) {
        self.show(job, rendered.frame.clone(), 1, rendered.samples, first);
        self.rendered = Some(rendered);
    }

    /// Hands a frame to the window.
    fn show(&self, job: &Job, frame: Arc<Frame>, scale: u32, samples: u32, first: bool) {
        let mut scene = (*job.request.scene).clone();
        let shown = &mut scene.edit().image;
        (shown.width, shown.height, shown.look) = (frame.width, frame.height, job.look);
        let layer = job.request.layer;
        let drawn = layer_image(&frame, layer, samples);
        let size = [frame.width as usize, frame.height as usize];
        let image = egui::ColorImage::from_rgba_unmultiplied(size, bytemuck::cast_slice(&drawn.pixels));
        let picture = Picture {
            serial: job.request.serial,
            asked: job.request.asked,
            requested: job.request.scene.clone(),
            scene: Arc::new(scene),
            volumes: job.volumes.clone(),
            mesh: job.mesh.clone(),
            frame,
            image: Arc::new(image),
            layer,
            legend: drawn.legend,
            scale,
            samples,
            first,
            cost: job.cost,
        };
        lock(&self.shared.state).picture = Some(Arc::new(picture));
        (self.shared.wake)();
    }

    /// Renders `samples` at 1/`scale` of the size, and measures the time. `what` names the work for the
    /// progress bar.
    fn render(
        &mut self,
        job: &Job,
        scale: u32,
        samples: std::ops::Range<u32>,
        what: &'static str,
    ) -> Result<Frame> {
        let [width, height] = job.request.size.map(|n| n.div_ceil(scale).max(1));
        let mut scene = (*job.request.scene).clone();
        let coarse = scale >= COARSE_SCALE;
        let image = &mut scene.edit().image;
        (image.width, image.height) = (width, height);
        image.samples = job.request.samples.max(1);
        image.look = job.look;
        if coarse {
            image.rock_error = image.rock_error.max(COARSE_ROCK);
        }
        let patience = if what == "preview" { PATIENCE } else { Duration::ZERO };
        let watch = self.watch(what, job.request.serial, patience);
        let options = RenderOptions {
            surface: job.request.layer.of_surface() && samples.start == CENTRE,
            samples: Some(samples.clone()),
            keep_rasters: RASTER_CACHE_BYTES,
            ..Default::default()
        };
        let clock = Instant::now();
        let mut frame = self.run_engine(&scene, &job.volumes, &job.mesh, &options, &watch)?;
        if scale == 1 {
            lock(&self.shared.state).samples_taken += samples.len() as u64;
        }
        let s = &mut frame.seconds;
        let pixel_seconds = s.integrate + s.resolve + s.readback;
        // A smaller picture would not save these.
        let unscaled = s.pipelines + s.upload + s.visibility;
        let other_seconds = clock.elapsed().as_secs_f64() - pixel_seconds - unscaled;
        if samples.is_empty() {
            return Ok(frame);
        }
        let samples = samples.len() as f64;
        self.speed.per_pixel = Some(pixel_seconds / samples / (width as f64 * height as f64));
        // A picture whose raster pass came from the cache does not tell how long the next one takes.
        if s.gbuffer > 0.0 {
            self.speed.per_picture[usize::from(coarse)] = other_seconds.max(0.0) / samples;
        }
        // The status bar shows times per sample, which are comparable between refinement steps.
        (s.gbuffer, s.integrate) = (s.gbuffer / samples, s.integrate / samples);
        Ok(frame)
    }

    /// Renders without the retry of [`Engine::render`], because the render thread counts lost devices itself.
    fn run_engine(
        &mut self,
        scene: &Scene,
        volumes: &[VolumeTexture],
        mesh: &Mesh,
        options: &RenderOptions,
        watch: &dyn Monitor,
    ) -> Result<Frame> {
        self.engine.get_or_insert(Engine::cpu()).render_once(scene, volumes, mesh, options, watch)
    }

    /// Expected time of one sample at 1/`scale` of the size, seconds.
    fn seconds_for(&self, size: [u32; 2], scale: u32) -> f64 {
        let pixels = size.map(|n| n.div_ceil(scale) as f64).iter().product::<f64>();
        let per_pixel = self.speed.per_pixel.unwrap_or(PREVIEW_SECONDS / FIRST_PREVIEW_PIXELS);
        pixels * per_pixel + self.speed.per_picture[usize::from(scale >= COARSE_SCALE)]
    }

    /// The finest scale whose preview is expected to meet its target time, or the coarsest.
    fn preview_scale(&self, size: [u32; 2]) -> u32 {
        let fits = |scale: &u32| self.seconds_for(size, *scale) <= PREVIEW_SECONDS;
        SCALES.into_iter().find(fits).unwrap_or(SCALES[SCALES.len() - 1])
    }

    /// Returns the request's volumes, and their cost if they were not the last ones.
    fn volumes(&mut self, request: &Request) -> Result<(Arc<Vec<VolumeTexture>>, Option<Cost>)> {
        let scene = &request.scene;
        let clock = Instant::now();
        let watch = self.watch("curves", request.serial, BUILD_PATIENCE);
        let (volumes, cost) = self.volume.volumes(scene, self.memory, &watch)?;
        if cost == Some(Cost::Volume) {
            self.volume.forget_cache();
            lock(&self.shared.state).volume_seconds = clock.elapsed().as_secs_f64();
            scene.warnings(&*volumes).into_iter().for_each(|w| self.say(MessageKind::Warning, w));
        }
        Ok((volumes, cost))
    }

    /// Returns the scene's opaque mesh, and whether it is new.
    fn mesh(&mut self, scene: &Scene) -> (Mesh, bool) {
        let ground = scene.ground();
        if let Some((known, mesh)) = &self.mesh
            && *known == ground
        {
            return (mesh.clone(), false);
        }
        let mesh = scene.cached_mesh(self.cache.take().as_ref());
        self.mesh = Some((ground, mesh.clone()));
        (mesh, true)
    }

    /// Returns the scene with its automatic exposure, if it has one. The exposure is measured again when
    /// something that it depends on has changed. The flow does not count, so that the picture does not
    /// flicker while the water plays.
    fn exposed(
        &mut self,
        scene: &Scene,
        volumes: &[VolumeTexture],
        mesh: &Mesh,
        serial: u64,
    ) -> Result<Scene> {
        if scene.image.look.auto_exposure == AutoExposure::None {
            return Ok(scene.clone());
        }
        const AFFECTS_EXPOSURE: [&str; 3] = ["image.width", "image.height", "image.auto_exposure"];
        let is_irrelevant = |key: &String| {
            let of_image = key.starts_with("image.") && !AFFECTS_EXPOSURE.contains(&key.as_str());
            let is_flow = split_volume_key(key).is_some_and(|(_, own)| own == "volume.flow");
            of_image || key.starts_with("animate.") || is_flow
        };
        let is_current = |(measured, _): &&(Values, f32)| {
            changed_keys(measured, scene.written()).iter().all(is_irrelevant)
        };
        let stops = match self.exposed.as_ref().filter(is_current) {
            Some((_, stops)) => *stops,
            None => exposure::measure(scene, volumes, mesh, &self.watch("exposure", serial, PATIENCE))?,
        };
        self.exposed = Some((scene.written().clone(), stops));
        Ok(scene.clone().exposed(stops))
    }
}

/// Data shared by all pictures of a request.
struct Job<'a> {
    request: &'a Request,
    volumes: Arc<Vec<VolumeTexture>>,
    mesh: Mesh,
    cost: Cost,
    /// The scene's look, including the automatic exposure.
    look: Look,
}
