//! Development of the picture from linear radiance, on the CPU. Twin: `shaders/picture/resolve.wgsl`.

use rayon::prelude::*;

use super::bloom::Bloom;
use super::{Develop, Frame, Look, TONE_AGX, TONE_FILMIC};

/// Filmic tone curve (Narkowicz, "ACES Filmic Tone Mapping Curve", 2015).
fn filmic(x: f32) -> f32 {
    (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
}

/// Encodes a linear value from 0 to 1 as sRGB (IEC 61966-2-1).
fn srgb(x: f32) -> f32 {
    if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// AgX tone curve (Sobotka, "AgX", 2022, in the form of Wrensch, "Minimal AgX Implementation", 2023).
///
/// The primaries are drawn in towards white, the curve covers 16.5 stops about 0.18, and the primaries are
/// drawn out again. The result is already encoded for a display.
fn agx(x: [f32; 3]) -> [f32; 3] {
    const LEAST_EV: f32 = -12.47393;
    const MOST_EV: f32 = 4.026069;
    let drawn_in = [
        0.842_479 * x[0] + 0.078_433_6 * x[1] + 0.079_223_745 * x[2],
        0.042_328_24 * x[0] + 0.878_468_6 * x[1] + 0.079_166_13 * x[2],
        0.042_375_655 * x[0] + 0.078_433_6 * x[1] + 0.879_143 * x[2],
    ];
    let v = drawn_in.map(|x| {
        let ev = x.max(1e-10).log2().clamp(LEAST_EV, MOST_EV);
        agx_curve((ev - LEAST_EV) / (MOST_EV - LEAST_EV))
    });
    [
        1.196_879 * v[0] - 0.098_020_88 * v[1] - 0.099_029_74 * v[2],
        -0.052_896_85 * v[0] + 1.151_903_1 * v[1] - 0.098_961_18 * v[2],
        -0.052_971_635 * v[0] - 0.098_043_45 * v[1] + 1.151_073_7 * v[2],
    ]
}

/// Wrensch's polynomial fit of the AgX curve.
fn agx_curve(x: f32) -> f32 {
    (((((15.5 * x - 40.14) * x + 31.96) * x - 6.868) * x + 0.4298) * x + 0.1191) * x - 0.00232
}

/// Alpha below which a pixel keeps its premultiplied colour: it rounds to 0 in 8 and in 16 bits.
const LEAST_ALPHA: f32 = 1e-6;

/// Rounds an encoded value to 8 bits.
fn byte(encoded: f32) -> u8 {
    (encoded.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// Develops the pixels of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Resolver(Develop);

impl Resolver {
    /// Resolver for this look.
    pub fn new(look: &Look) -> Self {
        Resolver(Develop::new(look))
    }

    /// Develops one pixel: division by alpha, white balance, exposure, tone curve, sRGB encoding and rounding
    /// to 8 bits. `linear` is multiplied by `alpha`, 0 to 1; the result is not.
    pub fn pixel(&self, linear: [f32; 3], alpha: f32) -> [u8; 4] {
        let develop = &self.0;
        let mut rgb = linear.map(|x| x / alpha.max(LEAST_ALPHA));
        if develop.balanced != 0 {
            rgb = develop.balance.map(|row| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2]);
        }
        // All curves are flat above 10⁴. The bound keeps their squares finite.
        let x = rgb.map(|x| (x * develop.exposure).clamp(0.0, 1e4));
        let [r, g, b] = match develop.tone {
            TONE_AGX => agx(x).map(byte),
            TONE_FILMIC => x.map(|x| byte(srgb(filmic(x).clamp(0.0, 1.0)))),
            _ => x.map(|x| byte(srgb(x.clamp(0.0, 1.0)))),
        };
        [r, g, b, byte(alpha)]
    }
}

/// Develops the picture of a frame from its radiance. Only a `whole` image gets bloom, because bloom needs
/// all pixels. Bloom spreads alpha as it spreads light, so that a backdrop is hidden where light arrives.
pub fn develop(frame: &mut Frame, look: &Look, whole: bool) {
    let resolver = Resolver::new(look);
    let picture = frame.picture.par_iter_mut().enumerate();
    let alpha = frame.alpha.as_deref();
    if whole && look.bloom > 0.0 {
        let size = [frame.width as usize, frame.height as usize];
        let bloom = Bloom::new(&frame.radiance, size, look);
        let alpha: Option<Vec<[f32; 4]>> = alpha.map(|alpha| alpha.iter().map(|&a| [a; 4]).collect());
        let alpha = alpha.as_ref().map(|alpha| Bloom::new(alpha, size, look));
        picture.for_each(|(i, picture)| {
            *picture = resolver.pixel(bloom.pixel(i), alpha.as_ref().map_or(1.0, |alpha| alpha.pixel(i)[0]));
        });
    } else {
        picture.for_each(|(i, picture)| {
            let [r, g, b, _] = frame.radiance[i];
            *picture = resolver.pixel([r, g, b], alpha.map_or(1.0, |alpha| alpha[i]));
        });
    }
}
