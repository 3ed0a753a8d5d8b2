//! Settings of the picture: size, samples and look.

use super::Gamut;
use crate::util::words::words;

/// Settings of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Image {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Number of samples per pixel.
    pub samples: u32,
    /// Filter by which samples are distributed around a pixel.
    pub filter: Filter,
    /// Whether the background is transparent, so that the picture has an alpha channel.
    pub alpha: bool,
    /// Distance by which the image is moved behind its pixels, pixels to the right and down: a pixel shows
    /// what lies so far from it in the image of the same camera without it. 0 but for the samples of a lens.
    pub shift: [f32; 2],
    /// Maximum error of simplified rock, in distances between samples. A larger error takes fewer triangles.
    pub rock_error: f32,
    /// Primaries of files of linear light.
    pub gamut: Gamut,
    /// Development of the picture from the radiance.
    pub look: Look,
}

impl Image {
    /// Makes the image a rough picture of itself: at most `side` pixels on its longer side, and one sample.
    pub fn shrink(&mut self, side: u32) {
        let longest = self.width.max(self.height).max(side);
        let shrunk = |n: u32| ((u64::from(n) * u64::from(side)).div_ceil(u64::from(longest)) as u32).max(1);
        (self.width, self.height, self.samples) = (shrunk(self.width), shrunk(self.height), 1);
    }
}

/// Filter of a pixel's samples. The samples are distributed by it, so that they all have the same weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Uniform over the pixel.
    Box,
    /// Gaussian with σ = ½ pixel, cut off at a radius of 1½ pixels.
    Gaussian,
    /// Blackman–Harris window (Harris 1978), three pixels wide.
    BlackmanHarris,
}

words! { Filter { Box => "box", Gaussian => "gaussian", BlackmanHarris => "blackman-harris" } }

/// Development of a picture from linear radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Exposure, stops.
    pub exposure: f32,
    /// Method that chooses additional stops; see [`crate::engine::exposure`].
    pub auto_exposure: AutoExposure,
    /// Share of the light that bloom spreads around bright things, 0 to 1.
    pub bloom: f32,
    /// σ of the widest bloom, as a share of the image's height.
    pub bloom_radius: f32,
    /// Colour temperature of the light that is adapted to 6500 K, kelvin.
    pub temperature: f32,
    /// Distance of that light from the black body curve, thousandths of Duv; above 0 it is greener.
    pub tint: f32,
    /// Tone curve.
    pub tone: Tone,
    /// Way in which values are rounded to 8 bits.
    pub dither: Dither,
    /// Stops by which the corners are darker than the middle.
    pub vignette: f32,
    /// Standard deviation of the grain in the middle greys, as a share of white.
    pub grain: f32,
    /// Number of the grain's pattern.
    pub grain_seed: u32,
}

/// Way in which values are rounded to 8 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dither {
    /// Up or down by a fixed pattern over the image, so that smooth colours have no bands.
    Pattern,
    /// To the nearest value.
    None,
}

words! { Dither { Pattern => "pattern", None => "none" } }

/// Method that chooses an exposure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AutoExposure {
    /// None: the exposure is set by hand.
    None,
    /// Makes the logarithmic mean of the luminance middle grey.
    Average,
    /// Puts the threshold of the brightest hundredth of the pixels at 1.
    Highlights,
}

words! { AutoExposure { None => "none", Average => "average", Highlights => "highlights" } }

/// Tone curve of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Clamps to 0..1.
    None,
    /// Filmic curve of Narkowicz 2015.
    Filmic,
    /// AgX of Sobotka 2022.
    Agx,
}

words! { Tone { Filmic => "filmic", Agx => "agx", None => "none" } }
