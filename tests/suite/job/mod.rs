//! Long work: batches, and pictures in parts.

pub mod batch;
pub mod strips;
