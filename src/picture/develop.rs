//! Parameters of the resolve pass in the shader's layout. Twin: `shaders/picture/resolve.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::{Dither, Look, Tone, white_balance};

/// Value of [`Develop::tone`] for Narkowicz's curve.
pub const TONE_FILMIC: u32 = 1;
/// Value of [`Develop::tone`] for AgX.
pub const TONE_AGX: u32 = 2;

/// Parameters of the resolve pass; `Develop` in `shaders/picture/resolve.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Develop {
    /// Rows of the white balance matrix; the fourth component is padding.
    pub balance: [[f32; 4]; 3],
    /// Factor on the radiance.
    pub exposure: f32,
    /// Tone curve: 0 for none, [`TONE_FILMIC`] or [`TONE_AGX`].
    pub tone: u32,
    /// 1 if the white balance changes anything, else 0.
    pub balanced: u32,
    /// 1 if 8-bit values are rounded by a pattern, 0 if to the nearest.
    pub dither: u32,
    /// Turns pixels of the whole image into points that are 1 from its middle in the corners: factors along x
    /// and y, and what is subtracted. Without an image's size all are 0.
    pub place: [f32; 4],
    /// Squared tangent of the angle at which a corner would be as dark by the cos⁴ law; 0 without a vignette.
    pub vignette: f32,
    /// Standard deviation of the grain in the middle greys; 0 without grain.
    pub grain: f32,
    /// Number of the grain's pattern.
    pub grain_seed: u32,
    /// Padding.
    pub pad: u32,
}

impl Develop {
    /// Parameters for this look, without a vignette: see [`Develop::over`].
    pub fn new(look: &Look) -> Self {
        let balanced = (look.temperature, look.tint) != (white_balance::NEUTRAL_K, 0.0);
        let rows = white_balance::matrix(look.temperature, look.tint).transpose().to_cols_array_2d();
        Develop {
            balance: rows.map(|row| [row[0] as f32, row[1] as f32, row[2] as f32, 0.0]),
            exposure: look.exposure.exp2(),
            tone: match look.tone {
                Tone::None => 0,
                Tone::Filmic => TONE_FILMIC,
                Tone::Agx => TONE_AGX,
            },
            balanced: u32::from(balanced),
            dither: u32::from(look.dither == Dither::Pattern),
            place: [0.0; 4],
            vignette: if look.vignette > 0.0 { (0.5 * look.vignette).exp2() - 1.0 } else { 0.0 },
            grain: look.grain,
            grain_seed: look.grain_seed,
            pad: 0,
        }
    }

    /// Parameters for pixels of a whole image of this size, which a vignette needs.
    pub fn over(self, [width, height]: [u32; 2]) -> Self {
        let [w, h] = [width, height].map(f64::from);
        let middle = [w, h].map(|side| side / w.hypot(h));
        let factor = |side: f64, middle: f64| (2.0 * middle / side) as f32;
        let [x, y] = middle.map(|middle| middle as f32);
        Develop { place: [factor(w, middle[0]), factor(h, middle[1]), x, y], ..self }
    }
}
