//! The viewer: panels that explain what is rendered.

pub mod curves_panel;
pub mod layer_image;
pub mod volume_panel;
