//! The picture: the camera, the linear frame, and the development of the frame into an image.

pub mod bloom;
mod budget;
pub mod camera;
pub mod develop;
mod frame;
mod gamut;
mod grid;
mod image;
pub mod lens;
pub mod resolve;
pub mod shutter;
pub mod white_balance;

pub(crate) use budget::{LEAST_ROWS, WORK_BYTES, row_bytes};
pub use budget::{PICTURE_BYTES, canvas, canvas_bytes, check_image, target_bytes};
pub use camera::Camera;
pub use develop::{Develop, TONE_AGX, TONE_FILMIC};
pub use frame::{Frame, Layer, Seconds, Surface};
pub use gamut::Gamut;
pub use grid::Grid;
pub use image::{AutoExposure, Dither, Filter, Image, Look, Tone};
pub use lens::Lens;
pub use shutter::SampleTimes;
