//! Foundations that every other module builds on: errors, progress, random numbers, the disk cache, unit
//! vectors, and parts of an image.

pub mod cache;
pub mod error;
pub mod monitor;
pub mod random;
pub mod unit;
pub mod window;
pub(crate) mod words;
