//! The engines: §1 to §5 combined into a frame, on a GPU or on the CPU.

pub mod cpu;
pub mod exposure;
mod frame;
pub mod gpu;
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
use gpu::{DeviceOptions, Gpu, GpuRenderer};

/// The engine a user asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EngineChoice {
    /// A GPU adapter if there is one, otherwise the CPU.
    #[default]
    Auto,
    /// A GPU adapter; exit code 69 if there is none.
    Gpu,
    /// The CPU.
    Cpu,
}

/// An engine that is ready to render.
pub enum Engine {
    /// The GPU engine, and the options that opened its device.
    Gpu(Box<GpuRenderer>, DeviceOptions),
    /// The CPU engine, which uses all cores.
    Cpu(cpu::LightVolumeCache),
}

/// Pixels per submission after a device was lost: small enough for the shortest watchdog known.
const CAREFUL_TILE_PIXELS: u32 = 4096;

impl Engine {
    /// Returns a CPU engine without cached light volumes.
    pub fn cpu() -> Engine {
        Engine::Cpu(cpu::LightVolumeCache::default())
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
            EngineChoice::Gpu => Engine::open_gpu(device),
            EngineChoice::Auto => match Engine::open_gpu(device) {
                Ok(opened) => Ok(opened),
                // A named adapter that is missing is a user error, not a reason to fall back.
                Err(e) if device.adapter.is_some() => Err(e),
                Err(Error::NoAdapter(why)) => Ok(cpu(&format!(
                    ": {why}; a Vulkan driver (Debian: mesa-vulkan-drivers) enables the GPU engine"
                ))),
                Err(e) => Err(e),
            },
        }
    }

    fn open_gpu(device: &DeviceOptions) -> Result<(Engine, String)> {
        let renderer = GpuRenderer::new(Gpu::open(device)?);
        renderer.gpu.check()?;
        let line = format!("engine gpu on {}", renderer.gpu.name());
        Ok((Engine::Gpu(Box::new(renderer), device.clone()), line))
    }

    /// Compiles the passes that a scene needs, as far as they are known without its volume.
    pub fn prepare(&mut self, scene: &Scene) {
        if let Engine::Gpu(renderer, _) = self {
            renderer.prepare(scene);
        }
    }

    /// Opens a new device after the old one was lost.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] if no device can be opened.
    pub fn renew(&mut self) -> Result<()> {
        if let Engine::Gpu(renderer, device) = self {
            **renderer = GpuRenderer::new(Gpu::open(device)?);
        }
        Ok(())
    }

    /// Returns `gpu` or `cpu`.
    pub fn word(&self) -> &'static str {
        match self {
            Engine::Gpu(..) => "gpu",
            Engine::Cpu(_) => "cpu",
        }
    }

    /// Returns the adapter's name; `None` on the CPU engine.
    pub fn adapter(&self) -> Option<String> {
        match self {
            Engine::Gpu(renderer, _) => Some(renderer.gpu.name()),
            Engine::Cpu(_) => None,
        }
    }

    /// Renders a frame. After a lost device or exhausted device memory, it tries once more on a new device
    /// with smaller tiles.
    ///
    /// # Errors
    /// Errors of [`cpu::render_with`] or [`GpuRenderer::render`], and those of `monitor`.
    pub fn render_volume(
        &mut self,
        scene: &Scene,
        volume: &VolumeTexture,
        mesh: &Mesh,
        options: &RenderOptions,
        monitor: &dyn Monitor,
    ) -> Result<Frame> {
        match self {
            Engine::Cpu(light_volumes) => {
                cpu::render_with(scene, volume, mesh, options, light_volumes, monitor)
            }
            Engine::Gpu(renderer, device) => {
                let result = renderer.render(scene, volume, mesh, options, monitor);
                let again = match &result {
                    Err(Error::DeviceLost(_)) => true,
                    // A budget that refused the frame before the device was used would refuse it again.
                    Err(Error::Memory { .. }) => renderer.gpu.check().is_err(),
                    _ => false,
                };
                let Err(e) = &result else { return result };
                if !again {
                    return result;
                }
                monitor.warn(&format!("{e}: trying once more on a new device with smaller tiles"));
                **renderer = GpuRenderer::new(Gpu::open(device)?);
                let careful = RenderOptions { tile_pixels: Some(CAREFUL_TILE_PIXELS), ..options.clone() };
                renderer.render(scene, volume, mesh, &careful, monitor)
            }
        }
    }
}
