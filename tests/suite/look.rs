//! From radiance to picture: samples' filter, bloom, exposure, white balance and tone curves, against closed forms and
//! published values.

mod bloom;
mod exposure;
mod filter;
mod tone;
mod white;
