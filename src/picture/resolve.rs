//! Development of the picture from linear radiance, on the CPU. Twin: `shaders/picture/resolve.wgsl`.

use rayon::prelude::*;

use super::bloom::Bloom;
use super::{Develop, Frame, Look, TONE_AGX, TONE_FILMIC};
use crate::util::window::Window;

/// Filmic tone curve (Narkowicz, "ACES Filmic Tone Mapping Curve", 2015).
fn filmic(x: f32) -> f32 {
    (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
}

/// Encodes a linear value from 0 to 1 as sRGB (IEC 61966-2-1).
pub fn srgb(x: f32) -> f32 {
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

/// Rounds an encoded value to 8 bits, up if its fraction and `threshold` add up to 1.
fn byte(encoded: f32, threshold: f32) -> u8 {
    (encoded.clamp(0.0, 1.0) * 255.0 + threshold) as u8
}

/// Returns the threshold of the dither at a pixel of the whole image, 0 to 1: interleaved gradient noise
/// (Jimenez 2014), in whole numbers so that both engines get the same. Its grain is fine and even. The 256
/// thresholds keep 1/512 away from 0 and 1, so that a value that rounding errors move stays what it is.
fn threshold(x: u32, y: u32) -> f32 {
    // 0.06711056 and 0.00583715, in units of 2⁻³². Wrapping leaves the fraction.
    let u = x.wrapping_mul(288_237_660).wrapping_add(y.wrapping_mul(25_070_368));
    // Times 52.98292.
    let noise = u.wrapping_mul(52).wrapping_add((u >> 16).wrapping_mul(64_417));
    ((noise >> 24) as f32 + 0.5) / 256.0
}

/// Returns the grain of a pixel of the whole image: a number with the mean 0 and the variance 1, almost
/// Gaussian, which depends on the pixel and on the number of the pattern. It is the sum of the four bytes of
/// a hash (Wellons, "Prospecting for Hash Functions", 2018), in whole numbers so that both engines get the
/// same.
fn grain([x, y]: [u32; 2], seed: u32) -> f32 {
    let mut h = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841) ^ seed.wrapping_mul(0xcb1a_b31f);
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^= h >> 16;
    let sum: u32 = h.to_le_bytes().into_iter().map(u32::from).sum();
    // The variance of four even bytes is (256² − 1)/3.
    (sum as f32 - 510.0) * (1.0 / 147.800_54)
}

/// Develops the pixels of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Resolver(Develop);

impl Resolver {
    /// Resolver for this look, without its vignette.
    pub fn new(look: &Look) -> Self {
        Resolver(Develop::new(look))
    }

    /// Resolver for pixels of a whole image of this size, with the look's vignette.
    pub fn over(look: &Look, size: [u32; 2]) -> Self {
        Resolver(Develop::new(look).over(size))
    }

    /// Develops one pixel: division by alpha, white balance, exposure, vignette, tone curve, sRGB encoding,
    /// grain and rounding to 8 bits. `light` is R, G, B multiplied by alpha, and alpha, see [`lit`]; the
    /// result is not multiplied. `at` is the pixel's column and row in the whole image, on which vignette,
    /// grain and dither depend.
    pub fn pixel(&self, light: [f32; 4], at: [u32; 2]) -> [u8; 4] {
        let [r, g, b] = self.bytes(self.encoded(light, at), at);
        // Alpha is not dithered, so that what is solid or empty stays so.
        [r, g, b, byte(light[3], 0.5)]
    }

    /// Rounds encoded values to 8 bits, dithered as in [`Resolver::pixel`].
    pub fn bytes(&self, encoded: [f32; 3], at: [u32; 2]) -> [u8; 3] {
        let threshold = if self.0.dither != 0 { threshold(at[0], at[1]) } else { 0.5 };
        encoded.map(|x| byte(x, threshold))
    }

    /// Develops one pixel as [`Resolver::pixel`] does, without rounding: values for a display, 0 to 1.
    pub fn encoded(&self, light: [f32; 4], at: [u32; 2]) -> [f32; 3] {
        let x = self.exposed(light, at);
        let mut encoded = match self.0.tone {
            TONE_AGX => agx(x),
            TONE_FILMIC => x.map(|x| srgb(filmic(x).clamp(0.0, 1.0))),
            _ => x.map(|x| srgb(x.clamp(0.0, 1.0))),
        };
        if self.0.grain > 0.0 {
            let noise = self.0.grain * grain(at, self.0.grain_seed);
            encoded = encoded.map(|x| x + noise * (4.0 * x * (1.0 - x)));
        }
        encoded.map(|x| x.clamp(0.0, 1.0))
    }

    /// Factor by which the vignette darkens a pixel: 1/(1 + tan²)² = cos⁴ of an angle that grows from the
    /// middle to the corners.
    fn vignette(&self, at: [u32; 2]) -> f32 {
        let Develop { place: [step_x, step_y, x, y], vignette, .. } = self.0;
        let (x, y) = ((at[0] as f32 + 0.5) * step_x - x, (at[1] as f32 + 0.5) * step_y - y);
        let fall = 1.0 + vignette * (x * x + y * y);
        1.0 / (fall * fall)
    }

    /// Returns the linear values that the tone curve gets: alpha is divided out, white balance, exposure and
    /// vignette are applied.
    pub fn exposed(&self, [r, g, b, alpha]: [f32; 4], at: [u32; 2]) -> [f32; 3] {
        let develop = &self.0;
        let mut rgb = [r, g, b].map(|x| x / alpha.max(LEAST_ALPHA));
        if develop.balanced != 0 {
            rgb = develop.balance.map(|row| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2]);
        }
        if develop.vignette > 0.0 {
            let vignette = self.vignette(at);
            rgb = rgb.map(|x| x * vignette);
        }
        // All curves are flat above 10⁴. The bound keeps their squares finite.
        rgb.map(|x| (x * develop.exposure).clamp(0.0, 1e4))
    }
}

/// Returns the light that the pixels of a frame are developed from: R, G, B multiplied by alpha, and alpha,
/// which is 1 in a frame without an alpha channel.
///
/// Bloom spreads it, which needs all pixels: only a `whole` image gets it. Alpha is spread as light is, so
/// that a backdrop is hidden where light arrives.
pub fn lit<'a>(frame: &'a Frame, look: &Look, whole: bool) -> impl Fn(usize) -> [f32; 4] + Sync + use<'a> {
    let size = [frame.width as usize, frame.height as usize];
    let alpha = frame.alpha.as_deref();
    let blooms = whole && look.bloom > 0.0;
    let bloom = blooms.then(|| Bloom::new(&frame.radiance, size, look));
    let bloom_of_alpha = alpha.filter(|_| blooms).map(|alpha| {
        let alpha = alpha.iter().map(|&a| [a; 4]).collect::<Vec<_>>();
        let bloom = Bloom::new(&alpha, size, look);
        (0..alpha.len()).into_par_iter().map(|i| bloom.pixel(i)[0]).collect::<Vec<f32>>()
    });
    move |i| {
        let [r, g, b, _] = frame.radiance[i];
        let [r, g, b] = bloom.as_ref().map_or([r, g, b], |bloom| bloom.pixel(i));
        let alpha = bloom_of_alpha.as_deref().or(alpha);
        [r, g, b, alpha.map_or(1.0, |alpha| alpha[i])]
    }
}

/// Develops the picture of a frame from its radiance. The frame is the part `window` of an image of `size`
/// pixels; only the whole image gets bloom.
pub fn develop(frame: &mut Frame, look: &Look, window: Window, size: [u32; 2]) {
    let resolver = Resolver::over(look, size);
    let mut picture = std::mem::take(&mut frame.picture);
    let lit = lit(frame, look, window == Window::whole(size));
    let width = window.width as usize;
    picture.par_iter_mut().enumerate().for_each(|(i, picture)| {
        let at = [window.x + (i % width) as u32, window.y + (i / width) as u32];
        *picture = resolver.pixel(lit(i), at);
    });
    drop(lit);
    frame.picture = picture;
}

/// Develops the picture of a whole image from its radiance.
pub fn develop_whole(frame: &mut Frame, look: &Look) {
    let size = [frame.width, frame.height];
    develop(frame, look, Window::whole(size), size);
}
