//! The picture that is asked for: size, samples and look.

use crate::util::words::words;

/// The picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Image {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Samples a pixel.
    pub samples: u32,
    /// Where they lie about the pixel.
    pub filter: Filter,
    /// How far rock may be off for the sake of fewer triangles, in distances between samples.
    pub rock_error: f32,
    /// How the PNG is made from the radiance.
    pub look: Look,
}

/// How the samples of a pixel are weighed, by where they are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Evenly over the pixel.
    Box,
    /// σ of half a pixel, cut at 1½.
    Gaussian,
    /// The window of Blackman and Harris (1978), three pixels wide.
    BlackmanHarris,
}

words! { Filter { Box => "box", Gaussian => "gaussian", BlackmanHarris => "blackman-harris" } }

/// How a picture is made from linear radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Stops.
    pub exposure: f32,
    /// How more of them are chosen, [`crate::engine::exposure`].
    pub auto_exposure: AutoExposure,
    /// Share of the light that is spread around bright things.
    pub bloom: f32,
    /// σ of the widest spread, in heights of the image.
    pub bloom_radius: f32,
    /// Colour temperature that is adapted to 6500 K, kelvin.
    pub temperature: f32,
    /// Its distance from the black body's curve, thousandths of Duv.
    pub tint: f32,
    /// Tone curve.
    pub tone: Tone,
}

/// How an exposure is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AutoExposure {
    /// By hand.
    None,
    /// The logarithmic mean of the luminance becomes middle grey.
    Average,
    /// The brightest hundredth begins at 1.
    Highlights,
}

words! { AutoExposure { None => "none", Average => "average", Highlights => "highlights" } }

/// Tone curve of the PNG.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Clamp only.
    None,
    /// Narkowicz 2015.
    Filmic,
    /// Sobotka 2022.
    Agx,
}

words! { Tone { Filmic => "filmic", Agx => "agx", None => "none" } }
