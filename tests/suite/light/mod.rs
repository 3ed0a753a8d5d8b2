//! §5 Light.

pub mod environment;
pub mod fibre;
pub mod haze;
pub mod lights;
pub mod ramp;
pub mod scatter;
pub mod skin;
pub mod strand;
pub mod visibility;
