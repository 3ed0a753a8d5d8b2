//! The viewer.

pub mod ray_panel;
