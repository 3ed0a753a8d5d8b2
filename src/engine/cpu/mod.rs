//! The CPU engine: renders the whole frame on all cores. It is the reference for the GPU engine, and the
//! engine of machines without a GPU.

pub mod gbuffer;
pub mod integrate;
pub mod opaque;
pub mod pixels;
pub mod pool;
pub mod ray;
pub mod visibility;

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use rayon::prelude::*;

pub use pixels::render_pixels;
pub use visibility::LightVolumeCache;

use crate::engine::options::RenderOptions;
use crate::picture::camera::{CENTRE, sample_numbers};
use crate::picture::resolve::develop;
use crate::picture::{Frame, Seconds};
use crate::place::Mesh;
use crate::scene::Scene;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::window::Window;
use crate::volume::VolumeTexture;

/// Renders a scene. With `surface` the frame also holds depth, texture coordinates, quads and normals.
///
/// # Errors
/// Errors of [`render_with`].
pub fn render(
    scene: &Scene,
    volume: &VolumeTexture,
    mesh: &Mesh,
    surface: bool,
    monitor: &dyn Monitor,
) -> Result<Frame> {
    let options = RenderOptions { surface, ..Default::default() };
    render_with(scene, volume, mesh, &options, &mut LightVolumeCache::default(), monitor)
}

/// Pixels rendered at once. Each takes 32 bytes, and 16 for every layer of quads, besides the frame.
const BAND_PIXELS: u64 = 1 << 21;

/// Renders the options' part of the image and of the samples. A pixel has the same bits in every window.
/// Light volumes stay in `light_volumes` for later frames.
///
/// # Errors
/// Errors of `monitor`, which may stop the work. With cached visibility, [`Error::Memory`] if the light
/// volumes do not fit into the scene's budget for them.
///
/// [`Error::Memory`]: crate::util::error::Error::Memory
pub fn render_with(
    scene: &Scene,
    volume: &VolumeTexture,
    mesh: &Mesh,
    options: &RenderOptions,
    light_volumes: &mut LightVolumeCache,
    monitor: &dyn Monitor,
) -> Result<Frame> {
    let image = &scene.image;
    let window = options.window.unwrap_or(Window::whole([image.width, image.height]));
    let samples = options.samples.clone().unwrap_or(sample_numbers(image));
    let width = window.width as usize;
    let mut frame = Frame::new(window.width, window.height, options.surface);
    // Until the end it holds sums of 1 − alpha.
    frame.alpha = image.alpha.then(|| vec![0.0; frame.radiance.len()]);
    let mut seconds = Seconds::default();
    let clock = Instant::now();
    let integrator = integrate::Integrator::prepared(scene, volume, light_volumes, monitor)?;
    seconds.visibility = clock.elapsed().as_secs_f64();
    let total = window.pixels() * samples.len() as u64;
    let done = AtomicU64::new(0);
    let rows = ((BAND_PIXELS / u64::from(window.width)) as u32).clamp(1, window.height);
    for y in (0..window.height).step_by(rows as usize) {
        let band = Window { y: window.y + y, height: rows.min(window.height - y), ..window };
        let first = y as usize * width;
        let pixels = first..first + band.pixels() as usize;
        // Layers lie at the pixels' centres, where the picture need not have a sample.
        let only_layers = frame.surface.is_some() && !samples.contains(&CENTRE);
        for sample in only_layers.then_some(CENTRE).into_iter().chain(samples.clone()) {
            let clock = Instant::now();
            let gbuffer = gbuffer::run_window(scene, mesh, band, sample);
            seconds.gbuffer += clock.elapsed().as_secs_f64();
            if sample == CENTRE
                && let Some(surface) = &mut frame.surface
            {
                for i in 0..gbuffer.opaque.len() {
                    let nearest = i * gbuffer.layers;
                    let [u, v, t] = gbuffer.surface[nearest];
                    let behind = (gbuffer.opaque[i][3], gbuffer.normal[i].truncate());
                    surface.set(
                        first + i,
                        (&scene.quads, scene.camera.eye_local().as_vec3()),
                        gbuffer.quad_id[nearest],
                        [u, v, t, 0.0],
                        behind,
                    );
                }
            }
            if !samples.contains(&sample) {
                continue;
            }
            let clock = Instant::now();
            let uncovered: Vec<&mut [f32]> = match &mut frame.alpha {
                Some(alpha) => alpha[pixels.clone()].chunks_mut(width).collect(),
                None => (0..band.height).map(|_| <&mut [f32]>::default()).collect(),
            };
            frame.radiance[pixels.clone()]
                .par_chunks_mut(width)
                .zip(frame.counts[pixels.clone()].par_chunks_mut(width))
                .zip(uncovered)
                .zip(band.y..band.bottom())
                .try_for_each(|(((radiance, counts), uncovered), y)| {
                    let row: Vec<[u32; 2]> = (band.x..band.right()).map(|x| [x, y]).collect();
                    integrator.pixels(&gbuffer, &row, sample, |x, result| {
                        let new = result.radiance.extend(result.transmittance).to_array();
                        radiance[x] = [0, 1, 2, 3].map(|c| new[c] + radiance[x][c]);
                        counts[x] = [0, 1].map(|c| counts[x][c] + result.cells[c]);
                        if let Some(sum) = uncovered.get_mut(x) {
                            *sum += result.uncovered;
                        }
                    });
                    let pixels = done.fetch_add(width as u64, Ordering::Relaxed) + width as u64;
                    monitor.progress("pixels", pixels, total)
                })?;
            seconds.integrate += clock.elapsed().as_secs_f64();
        }
    }
    if let Some(surface) = &mut frame.surface {
        surface.set_planar(&scene.camera, image, window);
    }
    let clock = Instant::now();
    let inverse = 1.0 / samples.len() as f32;
    frame.radiance.par_iter_mut().for_each(|sum| *sum = sum.map(|x| x * inverse));
    frame.alpha.par_iter_mut().flatten().for_each(|sum| *sum = 1.0 - *sum * inverse);
    develop(&mut frame, &image.look, window, [image.width, image.height]);
    seconds.resolve = clock.elapsed().as_secs_f64();
    frame.seconds = seconds;
    Ok(frame)
}
