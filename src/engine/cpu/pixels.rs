//! Single pixels of a frame that the GPU engine left to this one.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use super::gbuffer;
use super::integrate::Integrator;
use crate::engine::options::RenderOptions;
use crate::picture::Frame;
use crate::picture::camera::sample_numbers;
use crate::picture::resolve::{Resolver, develop_whole, lit};
use crate::place::Mesh;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::window::Window;

/// Most bytes of the raster pass's targets at a time. They lie within the memory that a picture sets aside
/// for read-back, which is over by now.
const BAND_BYTES: u64 = 32 << 20;

/// Renders some pixels of a frame anew, given by their indices: radiance, alpha, counts and picture. They get
/// the bits of [`super::render_with`]'s frame. The layers of the raster pass stay.
///
/// # Errors
/// Errors of `monitor`, which may stop the work.
pub fn render_pixels(
    integrator: &Integrator,
    mesh: &Mesh,
    options: &RenderOptions,
    pixels: &[usize],
    frame: &mut Frame,
    monitor: &dyn Monitor,
) -> Result<()> {
    let scene = integrator.scene();
    let image = &scene.image;
    let whole = Window::whole([image.width, image.height]);
    let window = options.window.unwrap_or(whole);
    let samples = options.samples.clone().unwrap_or(sample_numbers(image));
    let inverse = 1.0 / samples.len() as f32;
    let pixel = |i: usize| [window.x + i as u32 % window.width, window.y + i as u32 / window.width];
    let row_bytes = u64::from(window.width) * gbuffer::pixel_bytes(scene);
    let rows = (BAND_BYTES / row_bytes).clamp(1, u64::from(window.height)) as usize;
    let mut pixels = pixels.to_vec();
    pixels.sort_unstable();
    let total = (pixels.len() * samples.len()) as u64;
    let done = AtomicU64::new(0);
    let near = |a: &usize, b: &usize| a / frame.width as usize / rows == b / frame.width as usize / rows;
    for chosen in pixels.chunk_by(near) {
        let band = around(chosen.iter().map(|&i| pixel(i)));
        let mut sums = vec![([0.0f32; 4], [0u32; 2], 0.0); chosen.len()];
        for sample in samples.clone() {
            let clock = Instant::now();
            let gbuffer = gbuffer::run_window(scene, mesh, band, sample);
            frame.seconds.gbuffer += clock.elapsed().as_secs_f64();
            let clock = Instant::now();
            chosen.par_iter().zip(&mut sums).try_for_each(|(&i, (radiance, counts, uncovered))| {
                let result = integrator.pixel(&gbuffer, pixel(i), sample, &mut ());
                let new = result.radiance.extend(result.transmittance).to_array();
                *radiance = [0, 1, 2, 3].map(|c| new[c] + radiance[c]);
                *counts = [0, 1].map(|c| counts[c] + result.cells[c]);
                *uncovered += result.uncovered;
                monitor.progress("cut pixels", done.fetch_add(1, Ordering::Relaxed) + 1, total)
            })?;
            frame.seconds.integrate += clock.elapsed().as_secs_f64();
        }
        for (&i, (radiance, counts, uncovered)) in chosen.iter().zip(sums) {
            (frame.radiance[i], frame.counts[i]) = (radiance.map(|x| x * inverse), counts);
            if let Some(alpha) = &mut frame.alpha {
                alpha[i] = 1.0 - uncovered * inverse;
            }
        }
    }
    if image.look.bloom > 0.0 && window == whole {
        develop_whole(frame, &image.look);
    } else {
        let resolver = Resolver::over(&image.look, [image.width, image.height]);
        for i in pixels {
            let light = lit(frame, &image.look, false)(i);
            frame.picture[i] = resolver.pixel(light, pixel(i));
        }
    }
    Ok(())
}

/// Returns the smallest window that holds all pixels, of which there is at least one.
fn around(pixels: impl Iterator<Item = [u32; 2]>) -> Window {
    let (mut low, mut high) = ([u32::MAX; 2], [0; 2]);
    for pixel in pixels {
        low = [0, 1].map(|c| pixel[c].min(low[c]));
        high = [0, 1].map(|c| (pixel[c] + 1).max(high[c]));
    }
    Window { x: low[0], y: low[1], width: high[0] - low[0], height: high[1] - low[1] }
}
