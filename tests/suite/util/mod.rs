//! What every room needs.

pub mod cache;
