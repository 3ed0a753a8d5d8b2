//! Foundations that every other module builds on: errors, progress, random numbers, powers, lanes, the disk
//! cache, confined paths, numbered files, unit vectors, parts of an image, colour spaces, and EXR files of
//! any program.

pub(crate) mod budget;
pub mod cache;
pub mod colour;
pub(crate) mod confine;
pub mod error;
pub(crate) mod lane_powers;
pub mod lanes;
pub mod monitor;
pub(crate) mod npy;
pub(crate) mod numbering;
pub mod open_exr;
pub mod powers;
pub mod random;
pub mod unit;
pub mod window;
pub(crate) mod words;
