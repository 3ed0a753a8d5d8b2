//! Output files: pictures, movies, contact sheets.

pub mod alpha_files;
pub mod contact_sheet;
pub mod difference;
pub mod exr;
pub mod exr_read;
pub mod formats;
pub mod movie;
pub mod streaks;
