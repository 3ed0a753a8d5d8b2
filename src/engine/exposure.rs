//! Automatic exposure.
//!
//! It is measured once, on a small picture of frame 0: so it is the same for every frame, shard, crop and strip, for
//! every size of picture and on both engines, and nothing flickers. What is chosen is written into the scene as an
//! ordinary `image.exposure`.

use super::cpu::{self, LightVolumeCache};
use crate::picture::AutoExposure;
use crate::place::Mesh;
use crate::scene::{Animation, Scene};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::window::Window;
use crate::volume::VolumeTexture;

/// Longest side of the picture that is measured, pixels: enough for shares of a hundredth.
const SIDE: u32 = 96;
/// The mean's luminance in the picture: the reflectance of middle grey (Reinhard et al. 2002).
pub const MIDDLE_GREY: f64 = 0.18;
/// Darkness counts as this share of the mean luminance, so that the logarithm of black does not rule.
const DARKEST: f64 = 1e-3;
/// The share of the pixels that may be brighter than 1.
const BRIGHTEST: f64 = 0.01;
/// Steps of a stop.
const STEPS: f64 = 64.0;

/// Stops that suit a scene, measured on its whole image by the CPU engine; 0 where it asks for none or all is black.
pub fn measure(scene: &Scene, volume: &VolumeTexture, mesh: &Mesh, monitor: &dyn Monitor) -> Result<f32> {
    let method = scene.image.look.auto_exposure;
    if method == AutoExposure::None {
        return Ok(0.0);
    }
    let mut small = scene.clone();
    let image = &mut small.edit().image;
    let longest = image.width.max(image.height).max(SIDE);
    let side = |n: u32| ((u64::from(n) * u64::from(SIDE)).div_ceil(u64::from(longest)) as u32).max(1);
    (image.width, image.height, image.samples) = (side(image.width), side(image.height), 1);
    let window = Window::whole([image.width, image.height]);
    let watch = Quiet(monitor);
    let kept = &mut LightVolumeCache::default();
    let frame = cpu::render_samples(&small, volume, mesh, window, 0..1, false, kept, &watch)?;
    Ok(stops(method, frame.radiance.iter().map(|&[r, g, b, _]| [r, g, b])))
}

/// An animation with its automatic exposure, if it has one, measured on frame 0 and the same for every frame from
/// now on; and the stops that it chose.
///
/// # Errors
/// Those of [`Animation::at`], of its volume, and of [`measure`].
pub fn exposed(animation: Animation, monitor: &dyn Monitor) -> Result<(Animation, Option<f32>)> {
    let scene = animation.at(0)?;
    if scene.image.look.auto_exposure == AutoExposure::None {
        return Ok((animation, None));
    }
    let limits = animation.limits();
    let cache = limits.cache.as_ref();
    let volume = scene.kept_volume(cache, limits.memory, monitor)?;
    let stops = measure(&scene, &volume, &scene.kept_mesh(cache), monitor)?;
    Ok((animation.exposed(stops), Some(stops)))
}

/// Stops for pixels of these radiances: `Average` brings the mean of the logarithm of luminance to
/// [`MIDDLE_GREY`], `Highlights` the brightest hundredth to 1. In 64ths of a stop, within ±32.
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
            let place = (luminances.len() - 1) - (BRIGHTEST * count) as usize;
            // Where fewer pixels shine than that, the brightest counts.
            let bright =
                if luminances[place] > 0.0 { luminances[place] } else { luminances[luminances.len() - 1] };
            -bright.log2()
        }
    };
    ((wanted * STEPS).round() / STEPS).clamp(-32.0, 32.0) as f32
}

/// Passes on what may stop the work, not how far this small part of it is.
struct Quiet<'a>(&'a dyn Monitor);

impl Monitor for Quiet<'_> {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        self.0.progress("exposure", 0, 1)
    }

    fn warn(&self, text: &str) {
        self.0.warn(text);
    }
}
