//! Shared basics: errors, progress, random numbers, the disk cache, and parts of an image.

pub mod cache;
pub mod error;
pub mod monitor;
pub mod random;
pub mod unit;
pub mod window;
pub(crate) mod words;
