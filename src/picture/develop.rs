//! How the resolve pass makes the picture, as the shader reads it. Twin: `shaders/picture/resolve.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::{Look, Tone, white_balance};

/// `tone` of [`Develop`]: Narkowicz's curve.
pub const TONE_FILMIC: u32 = 1;
/// `tone` of [`Develop`]: AgX.
pub const TONE_AGX: u32 = 2;

/// How the resolve pass makes the picture; `shaders/picture/resolve.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Develop {
    pub balance: [[f32; 4]; 3],
    pub exposure: f32,
    pub tone: u32,
    pub balanced: u32,
    pub pad_a: u32,
}

impl Develop {
    /// Of pictures that look so.
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
            pad_a: 0,
        }
    }
}
