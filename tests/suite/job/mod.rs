//! Long work: batches, and pictures that are rendered in parts.

pub mod batch;
pub mod exr;
pub mod strips;
