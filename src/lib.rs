//! taki (滝, waterfall) renders matter that is too fine for geometry, gushing water first, as volume textures
//! on the GPU. It implements Kimoto and Ohno, "Rendering Gushing Water Using Texture Mapping", and goes past
//! it.
//!
//! ```
//! use taki::{Engine, EngineChoice, RenderOptions, Scene};
//!
//! # fn main() -> taki::Result<()> {
//! let scene = Scene::preset("fig5")?.with(&["image.width=67", "image.height=107"])?;
//! let mut engine = Engine::new(EngineChoice::Cpu)?;
//! let frame = engine.render(&scene, &RenderOptions::default())?;
//! assert_eq!((frame.width, frame.height), (67, 107));
//! assert!(frame.covered_pixels() > 1000);
//! # Ok(())
//! # }
//! ```
//!
//! # The frame, stage by stage
//!
//! The modules stand from the ground up: a module imports only those before it.
//!
//! 1. [`curve`] makes spatial fractal curves (§1 of the [method](guide::method)), and [`walk`] finds the
//!    cells that a segment passes.
//!    [`model`] and [`grid`], beside them, read geometry and simulations of other programs.
//! 2. [`volume`] gives each cell a density ρ, a flow direction v and reflection coefficients k, packed to 64
//!    bits (§2).
//! 3. [`mapping`] is the one-to-one map between a quad and the face of the volume (§3). Sheets and splashes
//!    of falling water are made of quads.
//! 4. [`trace`] is what a view ray finds on its way through the cells (§4): the level of the volume it looks
//!    into, the sample there, and what a sheet leaves of it.
//! 5. [`light`] is what lights send, what of it reaches a cell, and what the cell sends on to the eye (§5):
//!    the paper's [fibre](light::fibre) or [strands](light::strand) of water or hair,
//!    [visibility](light::visibility), multiple [scattering](light::scatter),
//!    [environments](light::environment), [haze](light::haze).
//! 6. [`picture`] has the camera, the linear [`Frame`], and its way to an image (§6).
//! 7. [`place`] is what the water is in: rock and pools.
//! 8. [`output`] writes and reads files: PNG, EXR, movies, contact sheets.
//! 9. [`scene`] reads what is asked for, and checks it whole before any work.
//! 10. [`engine`] puts these together: the raster pass `gbuffer` finds the quads under each pixel and the
//!     texture coordinates there, `integrate` walks the cells and adds up their light, `resolve` makes the
//!     picture. It does so on a [GPU](engine::gpu) and on the [CPU](engine::cpu), with the same names and the
//!     same order of operations.
//!
//! # Where each stage is
//!
#![doc = include_str!("map.md")]

#[doc(hidden)]
pub mod util;

pub mod curve;
pub mod walk;

pub mod grid;

pub mod model;

pub mod volume;

pub mod mapping;

pub mod trace;

pub mod light;

pub mod picture;

pub mod place;

pub mod output;

pub mod scene;

pub mod engine;

#[doc(hidden)]
pub mod job;

#[doc(hidden)]
pub mod farm;

#[cfg(feature = "viewer")]
#[doc(hidden)]
pub mod viewer;

#[doc(hidden)]
pub mod cli;

pub mod guide;

pub use engine::{Engine, EngineChoice, RenderOptions};
pub use picture::Frame;
pub use scene::{Limits, Scene};
pub use util::error::{Error, Result};
pub use util::monitor::{Monitor, Unwatched};
