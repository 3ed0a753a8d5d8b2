//! The engines: parity between them, and the code that they share.

pub mod boxes;
pub mod colors;
pub mod device_limits;
pub mod every_preset;
pub mod exposure;
pub mod far;
pub mod gpu;
pub mod hair;
pub mod layers;
mod lens;
pub mod lockstep;
pub mod long_walks;
pub mod meshes;
pub mod overlap;
pub mod paint;
pub mod rasters;
pub mod ray;
mod reflections;
pub mod shaders;
pub mod shell_scatter;
pub mod shells;
mod shutter;
pub mod specialise;
pub mod strands;
pub mod volumes;
