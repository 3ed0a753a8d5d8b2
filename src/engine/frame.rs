//! The frame of a scene, from the scene alone.

use super::gpu::DeviceOptions;
use super::{Engine, EngineChoice, RenderOptions};
use crate::picture::Frame;
use crate::scene::{Limits, Scene};
use crate::util::error::Result;
use crate::util::monitor::Unwatched;

impl Engine {
    /// Opens an engine on the first suitable device. [`Engine::open`] chooses a device by name and says what
    /// it took.
    ///
    /// # Errors
    /// [`Error::NoAdapter`](crate::Error::NoAdapter) where [`EngineChoice::Gpu`] finds no GPU adapter.
    pub fn new(choice: EngineChoice) -> Result<Engine> {
        Engine::open(choice, &DeviceOptions::default()).map(|(engine, _)| engine)
    }

    /// Builds the scene's volumes and mesh, and renders its image.
    ///
    /// To render many frames of the same volumes, build both once and call [`Engine::render_volume`].
    ///
    /// # Errors
    /// Errors of [`Scene::volumes`] with the memory of [`Limits::default`], and of [`Engine::render_volume`].
    pub fn render(&mut self, scene: &Scene, options: &RenderOptions) -> Result<Frame> {
        let volumes = scene.volumes(Limits::default().memory, &Unwatched)?;
        self.render_volume(scene, &volumes, &scene.mesh(), options, &Unwatched)
    }
}
