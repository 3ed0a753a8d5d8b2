//! Samples of developed pictures: the one place that turns a frame into 8 or 16 bits.

use rayon::prelude::*;

use crate::picture::resolve::{Resolver, lit};
use crate::picture::{Frame, Look};

/// Encoding of a developed picture's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoding {
    /// Bits per channel, 8 or 16.
    pub bits: u8,
    /// Whether samples are proportional to light. They are encoded by the curve of sRGB otherwise.
    pub linear: bool,
    /// Whether alpha follows R, G, B, which are not multiplied by it. It is never encoded by a curve.
    pub alpha: bool,
}

impl Encoding {
    /// 8 bits, as displays show them.
    pub const DISPLAY: Encoding = Encoding { bits: 8, linear: false, alpha: false };

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
        let linear = if self.linear { ", linear" } else { "" };
        write!(f, "{} bits{linear}{}", self.bits, if self.alpha { ", alpha" } else { "" })
    }
}

/// Returns the samples of a frame, row by row; those of 16 bits with the higher byte first. 8 bits are those
/// of the frame's picture. 16 bits are developed from its radiance by `look`, with bloom if it is the `whole`
/// image; linear ones without tone curve.
pub fn samples_of(frame: &Frame, encoding: Encoding, look: &Look, whole: bool) -> Vec<u8> {
    if encoding.bits == 8 {
        return frame.picture.iter().flat_map(|p| p[..encoding.channels()].iter().copied()).collect();
    }
    let (resolver, lit) = (Resolver::new(look), lit(frame, look, whole));
    let mut samples = vec![0; frame.radiance.len() * encoding.pixel_bytes()];
    samples.par_chunks_mut(encoding.pixel_bytes()).enumerate().for_each(|(i, pixel)| {
        let light = lit(i);
        let [r, g, b] = match encoding.linear {
            true => resolver.exposed(light).map(|x| x.min(1.0)),
            false => resolver.encoded(light),
        };
        for (sample, value) in pixel.chunks_exact_mut(2).zip([r, g, b, light[3]]) {
            sample.copy_from_slice(&((value * 65_535.0 + 0.5) as u16).to_be_bytes());
        }
    });
    samples
}

/// Returns the picture as R, G, B bytes, without alpha.
pub fn rgb_rows(frame: &Frame) -> Vec<u8> {
    frame.picture.iter().flat_map(|p| [p[0], p[1], p[2]]).collect()
}
