//! The whole frame on the CPU, on all cores: the reference of the GPU engine, and the engine where
//! there is no GPU.

pub mod gbuffer;
pub mod integrate;
pub mod ray;
pub mod resolve;

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use crate::error::Result;
use crate::frame::{Frame, Seconds};
use crate::job::Monitor;
use crate::scene::{Mesh, Scene};
use crate::volume::VolumeTexture;

/// Renders a scene. With `surface` the raster pass's layers are kept.
pub fn render(
    scene: &Scene,
    volume: &VolumeTexture,
    mesh: &Mesh,
    surface: bool,
    monitor: &dyn Monitor,
) -> Result<Frame> {
    render_samples(scene, volume, mesh, 0..scene.image.samples, surface, monitor)
}

/// Renders only some of a scene's samples; the radiance is their mean.
pub fn render_samples(
    scene: &Scene,
    volume: &VolumeTexture,
    mesh: &Mesh,
    samples: Range<u32>,
    surface: bool,
    monitor: &dyn Monitor,
) -> Result<Frame> {
    let image = &scene.image;
    let width = image.width as usize;
    let mut frame = Frame::new(image.width, image.height, surface);
    let mut seconds = Seconds::default();
    let integrator = integrate::Integrator::new(scene, volume);
    let total = image.width as u64 * image.height as u64 * samples.len() as u64;
    let done = AtomicU64::new(0);
    for sample in samples.clone() {
        let clock = Instant::now();
        let gbuffer = gbuffer::run(scene, mesh, sample);
        seconds.gbuffer += clock.elapsed().as_secs_f64();
        if sample == samples.start
            && let Some(surface) = &mut frame.surface
        {
            for i in 0..gbuffer.quad_id.len() {
                let [u, v, t] = gbuffer.surface[i];
                let behind = (gbuffer.opaque[i][3], gbuffer.normal[i]);
                surface.set(i, scene, gbuffer.quad_id[i], [u, v, t, 0.0], behind);
            }
        }
        let clock = Instant::now();
        frame
            .radiance
            .par_chunks_mut(width)
            .zip(frame.counts.par_chunks_mut(width))
            .enumerate()
            .try_for_each(|(y, (radiance, counts))| {
                for x in 0..width {
                    let traced = integrator.pixel(&gbuffer, [x as u32, y as u32], sample, &mut ());
                    let new = traced.radiance.extend(traced.transmittance).to_array();
                    radiance[x] = [0, 1, 2, 3].map(|c| new[c] + radiance[x][c]);
                    counts[x] = [0, 1].map(|c| counts[x][c] + traced.cells[c]);
                }
                let pixels = done.fetch_add(width as u64, Ordering::Relaxed) + width as u64;
                monitor.progress("pixels", pixels, total)
            })?;
        seconds.integrate += clock.elapsed().as_secs_f64();
    }
    let clock = Instant::now();
    let inverse = 1.0 / samples.len() as f32;
    frame.radiance.par_iter_mut().zip(frame.picture.par_iter_mut()).for_each(|(sum, picture)| {
        *sum = sum.map(|x| x * inverse);
        *picture = resolve::resolve(image, *sum);
    });
    seconds.resolve = clock.elapsed().as_secs_f64();
    frame.seconds = seconds;
    Ok(frame)
}
