//! Samples of developed pictures: the one place that turns a frame into 8 or 16 bits.

use rayon::prelude::*;

use glam::{DMat3, DVec3};

use crate::picture::resolve::{Resolver, lit, srgb};
use crate::picture::{Frame, Gamut, Look};
use crate::util::window::Window;

/// Encoding of a developed picture's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoding {
    /// Bits per channel, 8 or 16.
    pub bits: u8,
    /// Whether samples are proportional to light. They are encoded by the curve of sRGB otherwise.
    pub linear: bool,
    /// Whether alpha follows R, G, B, which are not multiplied by it. It is never encoded by a curve.
    pub alpha: bool,
    /// Primaries of linear samples; those of Rec. 709 otherwise.
    pub gamut: Gamut,
}

impl Encoding {
    /// 8 bits, as displays show them.
    pub const DISPLAY: Encoding = Encoding { bits: 8, linear: false, alpha: false, gamut: Gamut::Rec709 };

    /// Returns the encoding with linear samples in these primaries.
    pub fn in_gamut(self, gamut: Gamut) -> Encoding {
        if self.linear { Encoding { gamut, ..self } } else { self }
    }

    /// Returns R, G and B from 0 to 1 as a display shows them: Rec. 709 with the curve of sRGB.
    pub fn shown(self) -> impl Fn([f32; 3]) -> [f32; 3] {
        let rec709 = self.gamut.from_rec709().map(|m| m.inverse());
        move |p| {
            if self.linear { multiplied(rec709, p).map(|x| srgb(x.clamp(0.0, 1.0))) } else { p }
        }
    }

    /// Number of channels: R, G, B, and alpha if there is one.
    pub fn channels(self) -> usize {
        3 + usize::from(self.alpha)
    }

    /// Bytes of a pixel.
    pub fn pixel_bytes(self) -> usize {
        self.channels() * usize::from(self.bits / 8)
    }
}

impl std::fmt::Display for Encoding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let linear = match (self.linear, self.gamut) {
            (false, _) => String::new(),
            (true, Gamut::Rec709) => ", linear".into(),
            (true, gamut) => format!(", linear {}", gamut.name()),
        };
        write!(f, "{} bits{linear}{}", self.bits, if self.alpha { ", alpha" } else { "" })
    }
}

/// Returns the samples of a frame, row by row; those of 16 bits with the higher byte first. 8 bits are those
/// of the frame's picture. 16 bits are developed from its radiance by `look`, with bloom if its `window` is
/// the whole image of `size` pixels; linear ones without tone curve and grain, in the primaries of the
/// encoding.
pub fn samples_of(frame: &Frame, encoding: Encoding, look: &Look, window: Window, size: [u32; 2]) -> Vec<u8> {
    if encoding.bits == 8 {
        return frame.picture.iter().flat_map(|p| p[..encoding.channels()].iter().copied()).collect();
    }
    let (resolver, lit) = (Resolver::over(look, size), lit(frame, look, window == Window::whole(size)));
    let from_rec709 = encoding.gamut.from_rec709();
    let mut samples = vec![0; frame.radiance.len() * encoding.pixel_bytes()];
    samples.par_chunks_mut(encoding.pixel_bytes()).enumerate().for_each(|(i, pixel)| {
        let light = lit(i);
        let at = [window.x + i as u32 % window.width, window.y + i as u32 / window.width];
        let [r, g, b] = match encoding.linear {
            true => multiplied(from_rec709, resolver.exposed(light, at)).map(|x| x.clamp(0.0, 1.0)),
            false => resolver.encoded(light, at),
        };
        for (sample, value) in pixel.chunks_exact_mut(2).zip([r, g, b, light[3]]) {
            sample.copy_from_slice(&((value * 65_535.0 + 0.5) as u16).to_be_bytes());
        }
    });
    samples
}

/// Multiplies a colour by a matrix, if there is one.
fn multiplied(matrix: Option<DMat3>, rgb: [f32; 3]) -> [f32; 3] {
    matrix.map_or(rgb, |m| (m * DVec3::from(rgb.map(f64::from))).as_vec3().to_array())
}

/// Returns the picture as R, G, B bytes, without alpha.
pub fn rgb_rows(frame: &Frame) -> Vec<u8> {
    frame.picture.iter().flat_map(|p| [p[0], p[1], p[2]]).collect()
}
