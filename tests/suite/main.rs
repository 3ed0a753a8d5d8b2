//! Every test of the project, as one binary: linking one is quicker than linking twelve.
//!
//! Reference truth (float64, closed form) and parity of the engines (float32, same order) are two kinds
//! of test; each module says which it holds. Tolerances stand in `tolerance`.

mod cli;
mod curve;
mod docs;
mod engine;
mod farm;
mod job;
mod light;
mod mapping;
mod output;
mod picture;
mod place;
mod rooms;
mod scene;
mod tolerance;
mod trace;
mod tutorial;
mod util;
#[cfg(feature = "viewer")]
mod viewer;
mod volume;
mod walk;
