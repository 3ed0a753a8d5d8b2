//! Memory that a file takes, counted before it is taken.

pub(super) use crate::util::budget::Budget;

/// Advice on a model that is too large.
pub(super) const SMALLER: &str =
    "simplify the mesh in the program that made it, or allow more memory with --memory";
