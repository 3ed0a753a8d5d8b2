//! Automatic exposure.
//!
//! It is measured once, on a small picture of frame 0. It is therefore the same for every frame, shard, crop
//! and strip, for every picture size and on both engines, and nothing flickers. The chosen exposure is
//! written into the scene as an ordinary `image.exposure`.

use super::cpu;
use crate::picture::AutoExposure;
use crate::place::Mesh;
use crate::scene::{Animation, Scene};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::volume::VolumeTexture;

/// Longest side of the measured picture, pixels: enough pixels to count one in a hundred.
const SIDE: u32 = 96;
/// Luminance that `Average` gives the logarithmic mean: the reflectance of middle grey (Reinhard et al.
/// 2002).
pub const MIDDLE_GREY: f64 = 0.18;
/// Offset that is added to every luminance, as a share of the mean: it keeps the logarithm of black pixels
/// from dominating.
const DARKEST: f64 = 1e-3;
/// Share of the pixels that `Highlights` lets be brighter than 1.
const BRIGHTEST: f64 = 0.01;
/// Steps per stop to which the result is rounded.
const STEPS: f64 = 64.0;

/// Measures the exposure of a scene, in stops, on its whole image with the CPU engine. Returns 0 if the scene
/// asks for no automatic exposure or if every pixel is black.
///
/// # Errors
/// Errors of [`cpu::render`], including those of `monitor`.
pub fn measure(
    scene: &Scene,
    volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
    mesh: &Mesh,
    monitor: &dyn Monitor,
) -> Result<f32> {
    let method = scene.image.look.auto_exposure;
    if method == AutoExposure::None {
        return Ok(0.0);
    }
    let mut small = scene.clone();
    let image = &mut small.edit().image;
    image.shrink(SIDE);
    // A picture with an alpha channel is exposed as the same picture with its background.
    image.alpha = false;
    let frame = cpu::render(&small, volumes, mesh, false, &Quiet(monitor))?;
    Ok(stops(method, frame.radiance.iter().map(|&[r, g, b, _]| [r, g, b])))
}

/// Applies automatic exposure to an animation that asks for it. The exposure is measured on frame 0 and holds
/// for every frame. Returns the animation, and the measured stops (`None` if it asks for no automatic
/// exposure).
///
/// # Errors
/// Errors of [`Animation::at`], of building frame 0's volumes, and of [`measure`].
pub fn exposed(animation: Animation, monitor: &dyn Monitor) -> Result<(Animation, Option<f32>)> {
    let scene = animation.at(0)?;
    if scene.image.look.auto_exposure == AutoExposure::None {
        return Ok((animation, None));
    }
    let limits = animation.limits();
    let cache = limits.cache.as_ref();
    let volumes = scene.cached_volumes(cache, limits.memory, monitor)?;
    let stops = measure(&scene, &volumes, &scene.cached_mesh(cache), monitor)?;
    Ok((animation.exposed(stops), Some(stops)))
}

/// Returns the exposure in stops for pixels of these linear radiances: a multiple of 1/64 within ±32.
/// `Average` brings the logarithmic mean of luminance to [`MIDDLE_GREY`]; `Highlights` brings the brightest
/// hundredth of the pixels to 1.
pub fn stops(method: AutoExposure, pixels: impl Iterator<Item = [f32; 3]>) -> f32 {
    let luminance = |[r, g, b]: [f32; 3]| {
        let y = 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
        if y.is_finite() { y.max(0.0) } else { 0.0 }
    };
    let mut luminances: Vec<f64> = pixels.map(luminance).collect();
    let count = luminances.len() as f64;
    let mean = luminances.iter().sum::<f64>() / count.max(1.0);
    if mean <= 0.0 {
        return 0.0;
    }
    let wanted = match method {
        AutoExposure::None => 0.0,
        AutoExposure::Average => {
            let dark = DARKEST * mean;
            let log = luminances.iter().map(|y| (y + dark).log2()).sum::<f64>() / count;
            MIDDLE_GREY.log2() - log
        }
        AutoExposure::Highlights => {
            luminances.sort_by(f64::total_cmp);
            let i = (luminances.len() - 1) - (BRIGHTEST * count) as usize;
            // If fewer pixels than that are lit, the brightest one counts.
            let bright = if luminances[i] > 0.0 { luminances[i] } else { luminances[luminances.len() - 1] };
            -bright.log2()
        }
    };
    ((wanted * STEPS).round() / STEPS).clamp(-32.0, 32.0) as f32
}

/// A monitor that can stop the work but hides the progress of this small part of it.
struct Quiet<'a>(&'a dyn Monitor);

impl Monitor for Quiet<'_> {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        self.0.progress("exposure", 0, 1)
    }

    fn warn(&self, text: &str) {
        self.0.warn(text);
    }
}
