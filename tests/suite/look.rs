//! From radiance to picture: white balance and tone curves against closed forms and published values.

mod tone;
mod white;
