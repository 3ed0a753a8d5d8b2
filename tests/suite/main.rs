//! Every test of the project, as one binary: linking one is quicker than linking twelve.
//!
//! Reference truth (float64, closed form) and parity of the engines (float32, same order) are two kinds
//! of test; each module says which it holds. Tolerances stand in `tolerance`.

mod animation;
mod batch;
mod big;
mod cache;
mod closed_forms;
mod compare;
mod contact_sheet;
mod covered;
mod curve;
mod environment;
mod falling;
mod farm;
mod faults;
mod flow;
mod gpu;
mod haze;
mod layers;
mod leaps;
mod lights;
mod look;
mod looking;
mod mapping;
mod movie;
mod place;
mod presets;
mod pyramid;
mod ray;
mod readme;
mod scatter;
mod scene;
mod shaders;
mod shading;
mod sparse;
mod specialise;
mod splash;
mod strand;
mod tiles;
mod tolerance;
mod tutorial;
#[cfg(feature = "viewer")]
mod viewer;
mod visibility;
mod volume;
mod walk;
#[cfg(all(feature = "viewer", target_os = "linux"))]
mod window;
