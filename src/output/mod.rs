//! Output files: pictures, movies and contact sheets.

pub mod contact_sheet;
pub mod frame;
pub mod movie;
