//! §5 Light: the lights, their visibility from a cell, and the light that the cell reflects to the eye.
//!
//! This module has the models. The integrate pass applies them to each cell of a ray:
//! `src/engine/cpu/integrate/walk.rs` on the CPU, `lit` in `shaders/engine/integrate_light.wgsl` on the GPU.

pub mod environment;
pub mod fibre;
pub mod fill;
pub mod haze;
mod lights;
pub mod optical_depth;
pub mod ramp;
pub mod scatter;
mod settings;
pub mod skin;
pub mod strand;
pub mod visibility;

pub use lights::{Background, Cone, Light, LightKind};
pub use settings::{AngleFrame, Reflection, ReflectionKind, Scattering, Visibility, VolumeReflection};
