//! The engines: §1 to §5 combined into a frame, on a GPU or on the CPU.

pub mod cpu;
pub mod exposure;
mod frame;
pub mod gpu;
pub mod lens;
mod options;
pub mod overlap;
pub mod pool_surface;

pub use options::RenderOptions;

use crate::picture::Frame;
use crate::place::Mesh;
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::volume::VolumeTexture;
use gpu::{DeviceOptions, Gpu, GpuRenderer, is_software};

/// The engine a user asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EngineChoice {
    /// A GPU if there is one, otherwise the CPU. Adapters that are software, such as Mesa's llvmpipe, run on
    /// the CPU too, and more slowly than the CPU engine.
    #[default]
    Auto,
    /// A GPU adapter; exit code 69 if there is none.
    Gpu,
    /// The CPU.
    Cpu,
}

/// An engine that is ready to render.
pub enum Engine {
    /// The GPU engine.
    Gpu {
        /// The renderer on the device.
        renderer: Box<GpuRenderer>,
        /// The options that opened the device.
        device: DeviceOptions,
        /// Whether the CPU engine takes over when this device cannot render a scene.
        falls_back: bool,
        /// Whether the user was told that the CPU engine finishes pixels.
        told: bool,
    },
    /// The CPU engine, which uses all cores.
    Cpu(Box<cpu::LightVolumeCache>),
}

/// Pixels per submission after a device was lost: small enough for the shortest watchdog known.
const CAREFUL_TILE_PIXELS: u32 = 4096;

impl Engine {
    /// Returns a CPU engine without cached light volumes.
    pub fn cpu() -> Engine {
        Engine::Cpu(Box::default())
    }

    /// Returns a GPU engine on an open device. What the device cannot do is an error.
    pub fn gpu(renderer: GpuRenderer) -> Engine {
        Engine::Gpu {
            renderer: Box::new(renderer),
            device: DeviceOptions::default(),
            falls_back: false,
            told: false,
        }
    }

    /// Opens the chosen engine. Returns it with one line that says which engine was opened and why.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] if the choice is [`EngineChoice::Gpu`], or `device` names an adapter, and no
    /// such adapter can be opened.
    pub fn open(choice: EngineChoice, device: &DeviceOptions) -> Result<(Engine, String)> {
        let cpu = |why: &str| {
            (Engine::cpu(), format!("engine cpu on {} threads{why}", rayon::current_num_threads()))
        };
        match choice {
            EngineChoice::Cpu => Ok(cpu("")),
            EngineChoice::Gpu => Engine::open_gpu(device, false),
            // A named adapter is meant: it may be software, but must not be missing.
            EngineChoice::Auto if device.adapter.is_some() => Engine::open_gpu(device, false),
            EngineChoice::Auto => match Gpu::adapter(device) {
                Ok(adapter) if is_software(&adapter.get_info()) => {
                    let name = adapter.get_info().name;
                    Ok(cpu(&format!(": no GPU but {name}, which is software and slower")))
                }
                Ok(adapter) => Engine::open_on(adapter, device, true),
                Err(Error::NoAdapter { what, .. }) => Ok(cpu(&format!(": {what}"))),
                Err(e) => Err(e),
            },
        }
    }

    fn open_gpu(device: &DeviceOptions, falls_back: bool) -> Result<(Engine, String)> {
        Engine::open_on(Gpu::adapter(device)?, device, falls_back)
    }

    fn open_on(adapter: wgpu::Adapter, device: &DeviceOptions, falls_back: bool) -> Result<(Engine, String)> {
        let renderer = GpuRenderer::new(Gpu::open_on(adapter, device)?);
        renderer.gpu.check()?;
        let line = format!("engine gpu on {}", renderer.gpu.name());
        Ok((
            Engine::Gpu { renderer: Box::new(renderer), device: device.clone(), falls_back, told: false },
            line,
        ))
    }

    /// Compiles the passes that a scene needs, as far as they are known without its volume.
    pub fn prepare(&mut self, scene: &Scene) {
        if let Engine::Gpu { renderer, .. } = self {
            renderer.prepare(scene);
        }
    }

    /// Opens a new device after the old one was lost.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] if no device can be opened.
    pub fn renew(&mut self) -> Result<()> {
        if let Engine::Gpu { renderer, device, .. } = self {
            **renderer = GpuRenderer::new(Gpu::open(device)?);
        }
        Ok(())
    }

    /// Returns `gpu` or `cpu`.
    pub fn word(&self) -> &'static str {
        match self {
            Engine::Gpu { .. } => "gpu",
            Engine::Cpu(_) => "cpu",
        }
    }

    /// Returns the adapter's name; `None` on the CPU engine.
    pub fn adapter(&self) -> Option<String> {
        match self {
            Engine::Gpu { renderer, .. } => Some(renderer.gpu.name()),
            Engine::Cpu(_) => None,
        }
    }

    /// Renders a frame of a scene with its volumes, or with its only one. After a lost device or exhausted
    /// device memory, it tries once more on a new device with smaller tiles. Where the device cannot render
    /// the scene, an engine opened by [`EngineChoice::Auto`] becomes the CPU engine, with a warning.
    ///
    /// # Errors
    /// Errors of [`cpu::render_with`] or [`GpuRenderer::render`], and those of `monitor`.
    pub fn render_volume(
        &mut self,
        scene: &Scene,
        volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
        mesh: &Mesh,
        options: &RenderOptions,
        monitor: &dyn Monitor,
    ) -> Result<Frame> {
        let mut result = self.render_once(scene, volumes, mesh, options, monitor);
        let is_the_devices = |e: &Error, engine: &Engine| match engine {
            Engine::Gpu { renderer, .. } => is_the_devices(e, renderer),
            Engine::Cpu(_) => false,
        };
        if let Err(e) = &result
            && is_the_devices(e, self)
            && !matches!(e, Error::Device { .. } | Error::Watchdog { .. })
        {
            monitor.warn(&format!("{}: trying once more on a new device with smaller tiles", e.cause()));
            self.renew()?;
            let careful = RenderOptions { tile_pixels: Some(CAREFUL_TILE_PIXELS), ..options.clone() };
            result = self.render_once(scene, volumes, mesh, &careful, monitor);
        }
        match &result {
            Err(e) if matches!(self, Engine::Gpu { falls_back: true, .. }) && is_the_devices(e, self) => {
                // It stays, so that the strips of one picture come from one engine and are warned of once.
                monitor.warn(&format!("{}: the CPU engine takes over", e.cause()));
                *self = Engine::cpu();
                self.render_once(scene, volumes, mesh, options, monitor)
            }
            _ => result,
        }
    }

    /// Renders a frame without another try after a fault of the device. Pixels whose walks the device ended
    /// early are finished by the CPU engine, with a warning.
    ///
    /// # Errors
    /// Errors of [`cpu::render_with`] or [`GpuRenderer::render_marked`], and those of `monitor`.
    pub fn render_once(
        &mut self,
        scene: &Scene,
        volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
        mesh: &Mesh,
        options: &RenderOptions,
        monitor: &dyn Monitor,
    ) -> Result<Frame> {
        let (renderer, told) = match self {
            Engine::Cpu(light_volumes) => {
                return cpu::render_with(scene, volumes, mesh, options, light_volumes, monitor);
            }
            Engine::Gpu { renderer, told, .. } => (renderer, told),
        };
        lens::through(scene, options, monitor, |scene, options, monitor| {
            let (mut frame, cut) = renderer.render_marked(scene, volumes, mesh, options, monitor)?;
            if !cut.is_empty() {
                let levels = renderer.levels(scene, volumes.as_ref());
                let integrator = cpu::integrate::Integrator::with_levels(scene, volumes, &levels)
                    .with_shadows_of(volumes, mesh, monitor)?;
                cpu::render_pixels(&integrator, mesh, options, &cut, &mut frame, monitor)?;
                // Strips and frames would repeat it.
                if !std::mem::replace(told, true) {
                    let (device, pixels) = (renderer.gpu.name(), frame.counts.len());
                    monitor.warn(&format!(
                        "{device} ends walks through so many cells early: the CPU engine finished {} of \
                         {pixels} pixels",
                        cut.len()
                    ));
                }
            }
            Ok(frame)
        })
    }
}

/// Whether an error comes from the device, so that the CPU engine may do better.
fn is_the_devices(e: &Error, renderer: &GpuRenderer) -> bool {
    match e {
        Error::Device { .. } | Error::DeviceLost(_) | Error::Watchdog { .. } => true,
        // A budget that refused the frame before the device was used would refuse it on the CPU too.
        Error::Memory { .. } => renderer.gpu.check().is_err(),
        _ => false,
    }
}
