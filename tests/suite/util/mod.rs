//! Utilities that every other module may use.

pub mod cache;
pub mod powers;
