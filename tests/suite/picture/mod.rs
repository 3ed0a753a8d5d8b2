//! From radiance to picture: sample filter, bloom, exposure, white balance and tone curves, against closed
//! forms and published values.

pub mod alpha;
pub mod bloom;
pub mod filter;
pub mod gamut;
pub mod resolve;
pub mod samples;
pub mod white_balance;
