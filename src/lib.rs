//! taki (滝, waterfall) renders matter that is too fine for geometry, gushing water first, as volume
//! textures on the GPU. It implements Kimoto and Ohno, "Rendering Gushing Water Using Texture Mapping".
//!
//! The frame, stage by stage:
//!
//! 1. [`scene`] reads what is asked for, strictly, and checks it whole before any work.
//! 2. [`curve`] makes spatial fractal curves (§1 of the method); [`walk`] finds the cells they pass.
//! 3. [`volume`] gives each cell density ρ, flow direction v and reflection coefficients k (§2), packed
//!    to 64 bits.
//! 4. [`mapping`] is the one-to-one map between a quad and the volume's face (§3): the raster pass
//!    (`gbuffer`) finds the quads under each pixel, as many as [`overlap`] tells, in order of depth, and the
//!    texture coordinates there; behind them rock, and [`pool`]s that mirror it.
//! 5. [`shading`] is the light of one cell (§5), or [`strand`], a model made for water; [`visibility`] keeps what is
//!    left of the lights in every cell, [`environment`] makes lights of sun, sky and maps; the compute pass
//!    (`integrate`) walks the cells under each pixel (§4) and adds them up; [`scatter`] is the light that is
//!    scattered more than once, [`haze`] what lies before all of it.
//! 6. `resolve` makes the picture from the linear [`frame`], with its bloom, [`white_balance`], [`exposure`] and tone; that becomes
//!    PNG or EXR; many frames become
//!    a [`movie`] or a labelled [contact sheet](contact_sheet).
//!
//! [`cache`] keeps volumes and meshes for the next process. [`gpu`] and [`cpu`] each do stages 4 to 6, with the same names and the same order of operations;
//! [`job`] chooses between them and watches over long work; [`farm`] writes job files that split it over many
//! machines. The command line and the viewer are clients of all this.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod cli;
pub mod curve;
pub mod engine;
pub mod farm;
pub mod job;
pub mod light;
pub mod mapping;
pub mod output;
pub mod picture;
pub mod place;
pub mod scene;
pub mod trace;
pub mod util;
#[cfg(feature = "viewer")]
pub mod viewer;
pub mod volume;
pub mod walk;

pub use util::error::{Error, Result};
