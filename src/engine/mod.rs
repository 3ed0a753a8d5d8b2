//! §1 to §5 put together: the frame, on a GPU or on the CPU.

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
use crate::util::window::Window;
use crate::volume::VolumeTexture;
use gpu::{DeviceOptions, Gpu, GpuRenderer};

/// The user's choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EngineChoice {
    /// A GPU adapter if there is one, else the CPU.
    #[default]
    Auto,
    /// A GPU adapter, or exit 69.
    Gpu,
    /// The CPU.
    Cpu,
}

/// An engine ready to render.
pub enum Engine {
    /// On a device.
    Gpu(Box<GpuRenderer>, DeviceOptions),
    /// On all cores.
    Cpu(cpu::LightVolumeCache),
}

/// Pixels a submission after a device was lost: small enough for the shortest watchdog known.
const CAREFUL_TILE_PIXELS: u32 = 4096;

impl Engine {
    /// The CPU engine.
    pub fn cpu() -> Engine {
        Engine::Cpu(cpu::LightVolumeCache::default())
    }

    /// Opens the engine; says in one line what was taken and why.
    pub fn open(choice: EngineChoice, device: &DeviceOptions) -> Result<(Engine, String)> {
        let cpu = |why: &str| {
            (Engine::cpu(), format!("engine cpu on {} threads{why}", rayon::current_num_threads()))
        };
        match choice {
            EngineChoice::Cpu => Ok(cpu("")),
            EngineChoice::Gpu => Engine::open_gpu(device),
            EngineChoice::Auto => match Engine::open_gpu(device) {
                Ok(opened) => Ok(opened),
                // A named adapter that is not there is a mistake, not a reason to fall back.
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

    /// Compiles what a scene will need, as far as that can be told without its volume.
    pub fn prepare(&mut self, scene: &Scene) {
        if let Engine::Gpu(renderer, _) = self {
            renderer.prepare(scene);
        }
    }

    /// Opens the device anew, after it was lost.
    pub fn renew(&mut self) -> Result<()> {
        if let Engine::Gpu(renderer, device) = self {
            **renderer = GpuRenderer::new(Gpu::open(device)?);
        }
        Ok(())
    }

    /// `gpu` or `cpu`.
    pub fn word(&self) -> &'static str {
        match self {
            Engine::Gpu(..) => "gpu",
            Engine::Cpu(_) => "cpu",
        }
    }

    /// The adapter's name, on the GPU engine.
    pub fn adapter(&self) -> Option<String> {
        match self {
            Engine::Gpu(renderer, _) => Some(renderer.gpu.name()),
            Engine::Cpu(_) => None,
        }
    }

    /// Renders. After a lost device or exhausted device memory it tries once more on a new device
    /// with smaller tiles.
    pub fn render_volume(
        &mut self,
        scene: &Scene,
        volume: &VolumeTexture,
        mesh: &Mesh,
        options: &RenderOptions,
        monitor: &dyn Monitor,
    ) -> Result<Frame> {
        match self {
            Engine::Cpu(kept) => {
                let samples = options.samples.clone().unwrap_or(0..scene.image.samples);
                let window = options.window.unwrap_or(Window::whole([scene.image.width, scene.image.height]));
                cpu::render_samples(scene, volume, mesh, window, samples, options.surface, kept, monitor)
            }
            Engine::Gpu(renderer, device) => {
                let result = renderer.render(scene, volume, mesh, options, monitor);
                let again = match &result {
                    Err(Error::DeviceLost(_)) => true,
                    // What was refused before the device was asked would be refused again.
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
