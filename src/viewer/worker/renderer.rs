//! The thread itself: what it does with a request.

mod export;
mod faults;
mod watch;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use eframe::egui;
use rayon::prelude::*;

use super::{Export, MessageKind, Picture, Request, Shared, lock};
use crate::engine::gpu::DeviceOptions;
use crate::engine::{Engine, EngineChoice, RenderOptions, exposure};
use crate::job::VolumeStock;
use crate::picture::resolve::develop;
use crate::picture::{AutoExposure, Frame, Look};
use crate::place::{Ground, Mesh};
use crate::scene::{Cost, Scene, Values};
use crate::util::cache::Cache;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::viewer::document::changed_keys;
use crate::viewer::layer_image::layer_image;
use crate::volume::VolumeTexture;

/// A preview aims at this: with the window's own frame and the volume's upload it stays under 150 ms.
const PREVIEW_SECONDS: f64 = 0.06;
/// Pixels of the first preview of all, when nothing is known about the scene's cost.
const FIRST_PREVIEW_PIXELS: f64 = 15_000.0;
/// A full picture that takes longer than this is reached over pictures of half the size.
const STEP_SECONDS: f64 = 0.4;
/// After a preview the renderer waits this long for the next change before it starts to refine.
const SETTLE: Duration = Duration::from_millis(60);
/// A preview is finished even if something newer waits, so that a moving slider shows pictures at all;
/// one that takes longer than this is given up.
const PATIENCE: Duration = Duration::from_millis(250);
/// So is the building of a volume, but it is worth a longer wait.
const BUILD_PATIENCE: Duration = Duration::from_secs(2);
/// Bytes for results of the raster pass: while the water plays or one slider of the walk moves, previews are
/// spared it. Those of several previews, or of one picture of 1.2 times 720p.
const KEPT_RASTERS: u64 = 48 << 20;
/// From this scale on the rocks are drawn coarsely,
const COARSE_SCALE: u32 = 3;
/// and may be off by so many of a preview's pixels, [`Image::rock_error`](crate::picture::Image).
const COARSE_ROCK: f32 = 6.0;
/// Preview pixels per side of a full pixel that are tried.
const SCALES: [u32; 8] = [1, 2, 3, 4, 6, 8, 12, 16];

/// The picture that refinement goes on from.
struct Rendered {
    scene: Arc<Scene>,
    look: Look,
    size: [u32; 2],
    frame: Arc<Frame>,
    samples: u32,
    volume: Arc<VolumeTexture>,
}

/// What the last pictures took, seconds a sample.
#[derive(Default)]
struct Speed {
    /// Of walk, tone and read-back.
    per_pixel: Option<f64>,
    /// Of the rest, mostly the raster pass: with fine rocks, and with coarse ones.
    once: [f64; 2],
}

/// What the thread holds.
pub struct Renderer {
    shared: Arc<Shared>,
    choice: EngineChoice,
    device: DeviceOptions,
    memory: u64,
    engine: Option<Engine>,
    volume: VolumeStock,
    /// Of the first scene.
    cache: Option<Cache>,
    mesh: Option<(Ground, Mesh)>,
    rendered: Option<Rendered>,
    /// The values that the last automatic exposure was measured for, and its stops.
    exposed: Option<(Values, f32)>,
    speed: Speed,
    /// When devices were lost.
    losses: VecDeque<Instant>,
}

enum Task {
    View(Box<Request>),
    Export(Box<Export>),
    LoseDevice,
    Quit,
}

impl Renderer {
    /// Opens nothing yet.
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
            volume: VolumeStock::with(cache.clone()),
            cache,
            mesh: None,
            rendered: None,
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
                    if let Some(Engine::Gpu(renderer, _)) = &self.engine {
                        renderer.gpu.device.destroy();
                    }
                }
                Task::View(request) => {
                    let serial = request.serial;
                    let again = (*request).clone();
                    if self.attempt(|renderer| renderer.view(*request)) {
                        // On the new device, or on the CPU, which is tried once only.
                        let mut queue = lock(&self.shared.queue);
                        queue.view.get_or_insert(again);
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
            queue = self.shared.news.wait(queue).unwrap_or_else(|e| e.into_inner());
        }
    }

    /// Whether there is something newer to do than `serial`; waits for it up to `time`.
    fn superseded(&self, serial: u64, time: Duration) -> bool {
        let until = Instant::now() + time;
        let mut queue = lock(&self.shared.queue);
        loop {
            let newer = self.shared.newest.load(Ordering::Relaxed) > serial;
            if newer || queue.quit || queue.lose_device || !queue.exports.is_empty() {
                return true;
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            queue =
                self.shared.news.wait_timeout(queue, left).map_or_else(|e| e.into_inner().0, |woken| woken.0);
        }
    }

    fn view(&mut self, request: Request) -> Result<()> {
        let (volume, made) = self.volume(&request)?;
        let (mesh, mesh_made) = self.mesh(&request.scene);
        let cost = match made {
            Some(cost) => cost,
            None if mesh_made => Cost::Upload,
            None => Cost::Uniform,
        };
        let look = self.exposed(&request.scene, &volume, &mesh, request.serial)?.image.look;
        let job = Job { request: &request, volume, mesh, cost, look };
        let mut first = true;
        if let Some(rendered) = self.goes_on(&job) {
            let samples = rendered.samples;
            self.keep(&job, rendered, first);
            if samples >= request.samples {
                return Ok(());
            }
            first = false;
        } else {
            self.rendered = None;
            let mut scale = self.preview_scale(request.size);
            self.picture(&job, scale, first)?;
            first = false;
            if self.superseded(request.serial, SETTLE) {
                return Ok(());
            }
            while scale > 1 {
                scale = match self.seconds_for(request.size, 1) {
                    // Half a picture's time is well spent on showing what the next one will be.
                    full if full > STEP_SECONDS && scale > 2 => scale.div_ceil(2).max(2),
                    _ => 1,
                };
                self.picture(&job, scale, first)?;
            }
        }
        // As many samples again as there are: half the time goes into the last step.
        while let Some(samples) = self.rendered.as_ref().map(|r| r.samples)
            && samples < request.samples
        {
            let more = samples.min(request.samples - samples);
            let part = self.render(&job, 1, samples..samples + more, "refining")?;
            if let Some(rendered) = self.rendered.take() {
                let mut frame = rendered.frame;
                add(Arc::make_mut(&mut frame), samples, &part, more, &job.look);
                self.keep(&job, Rendered { frame, samples: samples + more, ..rendered }, first);
            }
        }
        Ok(())
    }

    /// The finished part of the same picture, if that is what is asked for again.
    fn goes_on(&mut self, job: &Job) -> Option<Rendered> {
        let Job { request, volume, look, .. } = job;
        let old = self.rendered.take()?;
        let same = old.size == request.size
            && Arc::ptr_eq(&old.volume, volume)
            && (!request.layer.of_surface() || old.frame.surface.is_some())
            && old.scene.image.filter == request.scene.image.filter
            && old.scene.image.rock_error == request.scene.image.rock_error
            && old.samples <= request.samples.max(1)
            && changed_keys(old.scene.written(), request.scene.written())
                .iter()
                .all(|key| key.starts_with("image."))
            && old.scene.name == request.scene.name;
        if !same {
            return None;
        }
        let mut frame = old.frame;
        if old.look != *look {
            develop(Arc::make_mut(&mut frame), look, true);
        }
        Some(Rendered { scene: request.scene.clone(), look: *look, frame, ..old })
    }

    /// Renders and shows sample 0 at 1/scale of the size.
    fn picture(&mut self, job: &Job, scale: u32, first: bool) -> Result<()> {
        let frame = self.render(job, scale, 0..1, if first { "preview" } else { "refining" })?;
        let frame = Arc::new(frame);
        if scale == 1 {
            let rendered = Rendered {
                scene: job.request.scene.clone(),
                look: job.look,
                size: job.request.size,
                frame,
                samples: 1,
                volume: job.volume.clone(),
            };
            self.keep(job, rendered, first);
        } else {
            self.show(job, frame, scale, 1, first);
        }
        Ok(())
    }

    fn keep(&mut self, job: &Job, rendered: Rendered, first: bool) {
        self.show(job, rendered.frame.clone(), 1, rendered.samples, first);
        self.rendered = Some(rendered);
    }

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
            of: job.request.scene.clone(),
            scene: Arc::new(scene),
            volume: job.volume.clone(),
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
            surface: job.request.layer.of_surface() && samples.start == 0,
            samples: Some(samples.clone()),
            keep_rasters: KEPT_RASTERS,
            ..Default::default()
        };
        let clock = Instant::now();
        let mut frame = self.run_engine(&scene, &job.volume, &job.mesh, &options, &watch)?;
        let s = &mut frame.seconds;
        let of_pixels = s.integrate + s.resolve + s.readback;
        let once = clock.elapsed().as_secs_f64() - of_pixels - s.pipelines - s.upload;
        let samples = samples.len() as f64;
        self.speed.per_pixel = Some(of_pixels / samples / (width as f64 * height as f64));
        // Where results of the raster pass were kept it says nothing of the next picture, which may need it.
        if s.gbuffer > 0.0 {
            self.speed.once[usize::from(coarse)] = once.max(0.0) / samples;
        }
        // People compare passes, not parts of a refinement.
        (s.gbuffer, s.integrate) = (s.gbuffer / samples, s.integrate / samples);
        Ok(frame)
    }

    /// Renders without [`Engine::render`]'s own second try: lost devices are counted here.
    fn run_engine(
        &mut self,
        scene: &Scene,
        volume: &VolumeTexture,
        mesh: &Mesh,
        options: &RenderOptions,
        watch: &dyn Monitor,
    ) -> Result<Frame> {
        match self.engine.get_or_insert(Engine::cpu()) {
            Engine::Gpu(renderer, _) => renderer.render(scene, volume, mesh, options, watch),
            cpu => cpu.render_volume(scene, volume, mesh, options, watch),
        }
    }

    /// Expected seconds of one sample at 1/scale of the size.
    fn seconds_for(&self, size: [u32; 2], scale: u32) -> f64 {
        let pixels = size.map(|n| n.div_ceil(scale) as f64).iter().product::<f64>();
        let per_pixel = self.speed.per_pixel.unwrap_or(PREVIEW_SECONDS / FIRST_PREVIEW_PIXELS);
        pixels * per_pixel + self.speed.once[usize::from(scale >= COARSE_SCALE)]
    }

    fn preview_scale(&self, size: [u32; 2]) -> u32 {
        let fits = |scale: &u32| self.seconds_for(size, *scale) <= PREVIEW_SECONDS;
        SCALES.into_iter().find(fits).unwrap_or(SCALES[SCALES.len() - 1])
    }

    /// The request's volume, and what making it cost.
    fn volume(&mut self, request: &Request) -> Result<(Arc<VolumeTexture>, Option<Cost>)> {
        let scene = &request.scene;
        let clock = Instant::now();
        let watch = self.watch("curves", request.serial, BUILD_PATIENCE);
        let (volume, cost) = self.volume.volume(scene, self.memory, &watch)?;
        if cost == Some(Cost::Volume) {
            self.volume.forget_cache();
            lock(&self.shared.state).volume_seconds = clock.elapsed().as_secs_f64();
            scene.warnings(&volume).into_iter().for_each(|w| self.say(MessageKind::Warning, w));
        }
        Ok((volume, cost))
    }

    /// The request's geometry, and whether it was made anew.
    fn mesh(&mut self, scene: &Scene) -> (Mesh, bool) {
        let ground = scene.ground();
        if let Some((known, mesh)) = &self.mesh
            && *known == ground
        {
            return (mesh.clone(), false);
        }
        let mesh = self.cache.take().map_or_else(|| ground.mesh(), |cache| ground.kept_mesh(&cache));
        self.mesh = Some((ground, mesh.clone()));
        (mesh, true)
    }

    /// The scene with its automatic exposure, if it has one: measured anew where something has changed that
    /// it depends on. The flow is not among it, so that nothing flickers while the water plays.
    fn exposed(&mut self, scene: &Scene, volume: &VolumeTexture, mesh: &Mesh, serial: u64) -> Result<Scene> {
        if scene.image.look.auto_exposure == AutoExposure::None {
            return Ok(scene.clone());
        }
        const OF_SIZE_AND_WAY: [&str; 3] = ["image.width", "image.height", "image.auto_exposure"];
        let same = |key: &String| {
            let of_image = key.starts_with("image.") && !OF_SIZE_AND_WAY.contains(&key.as_str());
            of_image || key.starts_with("animate.") || key == "volume.flow"
        };
        let known =
            self.exposed.as_ref().filter(|(of, _)| changed_keys(of, scene.written()).iter().all(same));
        let stops = match known {
            Some((_, stops)) => *stops,
            None => exposure::measure(scene, volume, mesh, &self.watch("exposure", serial, PATIENCE))?,
        };
        self.exposed = Some((scene.written().clone(), stops));
        Ok(scene.clone().exposed(stops))
    }
}

/// What all pictures of a request share.
struct Job<'a> {
    request: &'a Request,
    volume: Arc<VolumeTexture>,
    mesh: Mesh,
    cost: Cost,
    /// With the automatic exposure, if there is one.
    look: Look,
}

/// Adds the mean of `more` samples to the mean of `samples`.
fn add(sum: &mut Frame, samples: u32, part: &Frame, more: u32, look: &Look) {
    let share = more as f32 / (samples + more) as f32;
    sum.radiance
        .par_iter_mut()
        .zip(&part.radiance)
        .for_each(|(a, b)| *a = [0, 1, 2, 3].map(|c| a[c] + (b[c] - a[c]) * share));
    sum.counts.par_iter_mut().zip(&part.counts).for_each(|(a, b)| *a = [a[0] + b[0], a[1] + b[1]]);
    sum.seconds = part.seconds;
    develop(sum, look, true);
}
