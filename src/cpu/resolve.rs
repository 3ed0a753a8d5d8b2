//! The picture from linear radiance, on the CPU. Twin: `shaders/resolve.wgsl`.

use crate::scene::{Image, Tone};

/// Narkowicz, "ACES Filmic Tone Mapping Curve", 2015.
fn filmic(x: f32) -> f32 {
    (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
}

/// IEC 61966-2-1.
fn srgb(x: f32) -> f32 {
    if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// Exposure, tone curve, sRGB and 8 bits of one pixel; alpha is 255.
pub fn resolve(image: &Image, linear: [f32; 4]) -> [u8; 4] {
    let exposure = image.exposure.exp2();
    let channel = |linear: f32| {
        // Past 10⁴ both curves are flat; the bound keeps their squares finite.
        let mut x = (linear * exposure).clamp(0.0, 1e4);
        if image.tone == Tone::Filmic {
            x = filmic(x);
        }
        (srgb(x.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
    };
    [channel(linear[0]), channel(linear[1]), channel(linear[2]), 255]
}
