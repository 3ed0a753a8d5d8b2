//! All tests of the project in one binary, because one binary links faster than twelve.
//!
//! There are two kinds of tests: reference truth (float64, closed forms) and parity of the engines (float32,
//! same order of operations). Each module says which kind it holds. `tolerance` defines the tolerances.

mod cli;
mod curve;
mod docs;
mod engine;
mod farm;
mod grid;
mod job;
mod light;
mod mapping;
mod model;
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
