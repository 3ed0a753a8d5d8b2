//! The engines: each against the other, and what they share.

pub mod exposure;
pub mod gpu;
pub mod layers;
pub mod overlap;
pub mod ray;
pub mod shaders;
pub mod specialise;
