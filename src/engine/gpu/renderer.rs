//! The renderer: a device, its compiled passes, and what it keeps from frame to frame.

use super::canvas::{Canvas, lru_get_or_insert};
use super::device::Gpu;
use super::frame_run::FrameRun;
use super::gbuffer::Gbuffer;
use super::integrate::{Integrate, Variant};
use super::rasters::Rasters;
use super::reflection::Reflections;
use super::resolve::Resolve;
use super::shells::ShellLightPass;
use super::timing::Timer;
use super::upload::Resident;
use super::visibility::VisibilityPass;
use super::walks_ended;
use crate::engine::options::RenderOptions;
use crate::engine::{lens, overlap};
use crate::light::Visibility;
use crate::picture::Frame;
use crate::place::Mesh;
use crate::scene::Scene;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::window::Window;
use crate::volume::{LevelSets, Storage, VolumeTexture};

/// A device with its compiled passes.
pub struct GpuRenderer {
    /// The device.
    pub gpu: Gpu,
    pub(super) timer: Timer,
    pub(super) gbuffer: Gbuffer,
    pub(super) resolve: Resolve,
    /// Most recently used first.
    pub(super) integrate: Vec<Integrate>,
    pub(super) resident: Resident,
    pub(super) visibility: VisibilityPass,
    pub(super) shell_light: ShellLightPass,
    pub(super) reflections: Reflections,
    /// Most recently used first.
    pub(super) canvases: Vec<Canvas>,
    pub(super) rasters: Rasters,
    /// Pixels of a tile that suited the last frame, and what that frame was.
    pub(super) learned: Option<(TileHint, f64)>,
}

/// Key of frames whose tiles take equally long: the variant of the integrate pass, the address of the
/// first volume's cells, and the image's size.
pub(super) type TileHint = (Variant, usize, [u32; 2]);

/// Specialised pipelines that are kept, so that a slider that moves back finds its pipeline again.
pub(super) const KEPT_PIPELINES: usize = 16;
/// Canvases that are kept: an interactive renderer alternates between its preview sizes.
pub(super) const KEPT_CANVASES: usize = 5;

impl GpuRenderer {
    /// Compiles the passes that do not depend on the scene.
    pub fn new(gpu: Gpu) -> Self {
        let (timer, gbuffer, resolve) = (Timer::new(&gpu), Gbuffer::new(&gpu), Resolve::new(&gpu));
        let visibility = VisibilityPass::new(&gpu);
        GpuRenderer {
            gpu,
            timer,
            gbuffer,
            resolve,
            integrate: Vec::new(),
            resident: Resident::default(),
            visibility,
            shell_light: ShellLightPass::default(),
            reflections: Reflections::default(),
            canvases: Vec::new(),
            rasters: Rasters::default(),
            learned: None,
        }
    }

    /// Compiles the passes that a scene needs, as far as they are known without its volume.
    pub fn prepare(&mut self, scene: &Scene) {
        let layers = overlap::sheets(scene);
        let GpuRenderer { gpu, gbuffer, integrate, .. } = self;
        std::thread::scope(|scope| {
            scope.spawn(|| gbuffer.compile(gpu, scene, layers));
            // Whether light volumes stand for walks to the lights is known with the volume.
            if scene.visibility == Visibility::None {
                // Most volumes are too full for leaps.
                let is_sparse = scene.recipes.iter().any(|recipe| recipe.storage == Storage::Sparse);
                let variant = Variant::of(scene, layers, None, [false, is_sparse]);
                let matches = |pass: &Integrate| pass.variant == variant;
                lru_get_or_insert(integrate, KEPT_PIPELINES, matches, || Integrate::new(gpu, variant));
            }
        });
    }

    /// Returns the levels of a scene's volumes: those on the device, if it rendered the scene last.
    pub fn levels(&mut self, scene: &Scene, volumes: &[VolumeTexture]) -> LevelSets {
        self.resident.levels.get(volumes, &scene.pyramid_specs(volumes))
    }

    /// Drops the light volumes of the last frame, so that the next one fills its own.
    pub fn forget_light_volumes(&mut self) {
        self.visibility.forget();
        self.shell_light.forget();
    }

    /// Renders a scene, or the part of it that `options.window` names.
    ///
    /// # Errors
    /// - Errors of `monitor`, which may stop the work.
    /// - [`Error::Device`] if the scene is too large for the device, or the device ends walks early.
    /// - [`Error::Memory`] if light volumes or textures do not fit into memory.
    /// - [`Error::DeviceLost`] or [`Error::Watchdog`] if the device fails.
    ///
    /// [`Error::Device`]: crate::util::error::Error::Device
    /// [`Error::Memory`]: crate::util::error::Error::Memory
    /// [`Error::DeviceLost`]: crate::util::error::Error::DeviceLost
    /// [`Error::Watchdog`]: crate::util::error::Error::Watchdog
    pub fn render(
        &mut self,
        scene: &Scene,
        volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
        mesh: &Mesh,
        options: &RenderOptions,
        monitor: &dyn Monitor,
    ) -> Result<Frame> {
        lens::through(scene, options, monitor, |scene, options, monitor| {
            let (frame, cut) = self.render_marked(scene, volumes, mesh, options, monitor)?;
            match cut.len() {
                0 => Ok(frame),
                count => Err(walks_ended(&self.gpu.name(), &format!("{count} pixels are unfinished"))),
            }
        })
    }

    /// Renders as [`GpuRenderer::render`] through a pinhole, and also returns the indices of the pixels whose
    /// walks the device ended early. They hold no radiance, cells or picture.
    ///
    /// # Errors
    /// As [`GpuRenderer::render`], except for walks that the device ended.
    pub fn render_marked(
        &mut self,
        scene: &Scene,
        volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
        mesh: &Mesh,
        options: &RenderOptions,
        monitor: &dyn Monitor,
    ) -> Result<(Frame, Vec<usize>)> {
        let whole = [scene.image.width, scene.image.height];
        let part = options.window.unwrap_or(Window::whole(whole));
        let mut run = FrameRun::prepare(self, scene, volumes.as_ref(), mesh, options, monitor)?;
        let mut frame = Frame::new(part.width, part.height, options.surface);
        frame.alpha = scene.image.alpha.then(|| vec![0.0; frame.radiance.len()]);
        for window in options.grid.windows(whole, part) {
            run.window(window, &mut frame)?;
        }
        if let Some(surface) = &mut frame.surface {
            surface.set_planar(&scene.camera, &scene.image, part);
        }
        let (learned, cut) = run.finish(&mut frame);
        self.learned = learned;
        Ok((frame, cut))
    }
}
