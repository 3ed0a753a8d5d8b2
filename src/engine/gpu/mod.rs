//! The GPU engine. A frame goes through five steps: upload, gbuffer, integrate, resolve, read back.

mod bench;
pub mod binding;
mod bricks;
mod canvas;
mod device;
mod frame_run;
mod gbuffer;
mod groups;
mod integrate;
pub mod layout;
pub mod packing;
mod pools;
mod prepared;
mod rasters;
mod readback;
mod reflection;
mod renderer;
mod resolve;
pub mod shader;
pub mod shells;
mod specialise;
mod strand;
mod targets;
mod tiles;
mod timing;
mod upload;
mod visibility;

pub use bench::GpuBench;
pub use device::{DeviceOptions, Gpu, adapters, is_software};
pub use gbuffer::{Gbuffer, Redraw, gbuffer_source};
pub use groups::GroupList;
pub use integrate::{CUT, Integrate, Sums, Tiler, Variant, source as integrate_source};
pub use reflection::{BoundReflection, Reflections};
pub use renderer::GpuRenderer;
pub use resolve::{Resolve, ResolveInputs};
pub use specialise::Source;
pub use strand::StrandTexture;
pub use targets::{TargetShape, Targets};
pub use timing::Timer;
pub use upload::{Resident, Uploaded};
pub use visibility::{FilledVolumes, Filling, VisibilityInputs, VisibilityPass, source as visibility_source};

use std::borrow::Cow;

use crate::util::error::Error;
use crate::util::window::Window;
use layout::Tile;

/// The error of a device that ends walks early. `what` tells how far a walk went or what is missing.
pub fn walks_ended(device: &str, what: &str) -> Error {
    Error::device(
        format!("{device} ends walks through so many cells early ({what})"),
        "use light.visibility=cached, fewer lights, a smaller trace.max_cells, or --engine cpu",
    )
}

/// Compiles a compute pipeline of a stage's shader, specialised to `constants`.
fn compute_pipeline(
    gpu: &Gpu,
    layout: Option<&wgpu::PipelineLayout>,
    source: &Source,
    entry_point: &str,
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(entry_point),
        source: wgpu::ShaderSource::Naga(Cow::Owned(source.compute(entry_point, constants))),
    });
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry_point),
        layout,
        module: &module,
        entry_point: Some(entry_point),
        compilation_options: Default::default(),
        cache: None,
    })
}

/// Inputs of the passes that draw one sample of one window.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The device.
    pub gpu: &'a Gpu,
    /// Times the submissions.
    pub timer: &'a Timer,
    /// The scene on the device.
    pub up: &'a Uploaded,
    /// Targets of the raster pass.
    pub targets: &'a Targets,
    /// The window, in pixels of the image.
    pub window: Window,
    /// The part of the window that is rendered, in pixels of the window.
    pub area: Tile,
    /// Uniforms of the sample and the window.
    pub frame: &'a layout::FrameUniforms,
    /// Workgroups of the area.
    pub groups: &'a GroupList,
    /// The light volumes.
    pub filled: &'a FilledVolumes,
    /// V at the vertices of shells.
    pub shell_light: &'a wgpu::TextureView,
    /// The reflection model and multiple scattering.
    pub reflection: &'a BoundReflection,
    /// Constants of all volumes.
    pub volumes: &'a wgpu::Buffer,
}
