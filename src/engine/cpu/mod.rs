//! The CPU engine: renders the whole frame on all cores. It is the reference for the GPU engine, and the
//! engine of machines without a GPU.

pub mod gbuffer;
pub mod gloss;
mod haze;
pub mod integrate;
mod lights;
pub mod opaque;
pub mod pixels;
pub mod pool;
pub mod rasters;
pub mod ray;
pub mod stone;
pub mod visibility;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use fearless_simd::Level;
use gbuffer::{Canvas, Drawing, Gbuffer};
pub use pixels::render_pixels;
use rasters::{Bands, is_drawn};
pub use visibility::LightVolumeCache;

use crate::engine::lens;
use crate::engine::options::RenderOptions;
use crate::picture::camera::{CENTRE, sample_numbers};
use crate::picture::resolve::develop;
use crate::picture::{Frame, Seconds, Surface};
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
    volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
    mesh: &Mesh,
    surface: bool,
    monitor: &dyn Monitor,
) -> Result<Frame> {
    let options = RenderOptions { surface, ..Default::default() };
    render_with(scene, volumes, mesh, &options, &mut LightVolumeCache::default(), monitor)
}

/// Pixels whose triangles are held at once.
const BAND_PIXELS: u64 = 1 << 21;

/// Renders the options' part of the image and of the samples, through the lens if the scene has one. A pixel
/// has the same bits in every window. Light volumes stay in `light_volumes` for later frames.
///
/// # Errors
/// Errors of `monitor`, which may stop the work. With cached visibility, [`Error::Memory`] if the light
/// volumes do not fit into the scene's budget for them.
///
/// [`Error::Memory`]: crate::util::error::Error::Memory
pub fn render_with(
    scene: &Scene,
    volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
    mesh: &Mesh,
    options: &RenderOptions,
    light_volumes: &mut LightVolumeCache,
    monitor: &dyn Monitor,
) -> Result<Frame> {
    let volumes = volumes.as_ref();
    lens::through(scene, options, monitor, |scene, options, monitor| {
        render_volumes(scene, volumes, mesh, options, light_volumes, monitor)
    })
}

/// [`render_with`] through a pinhole, compiled once for all kinds of lists of volumes.
fn render_volumes(
    scene: &Scene,
    volumes: &[VolumeTexture],
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
    let integrator = integrate::Integrator::prepared(scene, volumes, mesh, light_volumes, monitor)?;
    seconds.visibility = clock.elapsed().as_secs_f64();
    light_volumes.rasters.begin(scene, mesh);
    let total = window.pixels() * samples.len() as u64;
    let done = AtomicU64::new(0);
    let height = ((BAND_PIXELS / u64::from(window.width)) as u32).clamp(1, window.height);
    for y in (0..window.height).step_by(height as usize) {
        let band = Window { y: window.y + y, height: height.min(window.height - y), ..window };
        let first = y as usize * width;
        let pixels = first..first + band.pixels() as usize;
        // Layers lie at the pixels' centres, where the picture need not have a sample.
        let only_layers = frame.surface.is_some() && !samples.contains(&CENTRE);
        let numbers: Vec<u32> = only_layers.then_some(CENTRE).into_iter().chain(samples.clone()).collect();
        // Nothing between here and the first row can be stopped.
        monitor.progress("pixels", done.load(Ordering::Relaxed), total)?;
        let clock = Instant::now();
        let rasters = &mut light_volumes.rasters;
        let mut kept_of = |&sample: &u32| rasters.get(scene, mesh, band, sample, options.keep_rasters);
        let kept: Vec<Option<Arc<Bands>>> = numbers.iter().map(&mut kept_of).collect();
        let is_drawn = kept.iter().all(|bands| bands.as_ref().is_some_and(|bands| is_drawn(bands)));
        let drawing = (!is_drawn).then(|| Drawing::new(Level::new(), scene, mesh, band, &numbers));
        if !is_drawn {
            seconds.gbuffer += clock.elapsed().as_secs_f64();
        }
        let surface = Mutex::new(frame.surface.as_mut());
        let rows = gbuffer::band_rows(band);
        let part = width * rows as usize;
        let uncovered: Vec<&mut [f32]> = match &mut frame.alpha {
            Some(alpha) => alpha[pixels.clone()].chunks_mut(part).collect(),
            None => (0..band.height.div_ceil(rows)).map(|_| <&mut [f32]>::default()).collect(),
        };
        // Rows are integrated as soon as they are drawn, while their targets are in the caches.
        let clock = Instant::now();
        let nanoseconds = [AtomicU64::new(0), AtomicU64::new(0)];
        // Threads take one band after the other. Rayon's own parts of a list hold up to a quarter of the
        // bands, and nobody helps with a part that is begun.
        frame.radiance[pixels.clone()]
            .chunks_mut(part)
            .zip(frame.counts[pixels.clone()].chunks_mut(part))
            .zip(uncovered)
            .enumerate()
            .par_bridge()
            .try_for_each_init(
                || (Canvas::empty(scene), integrator.walker()),
                |(canvas, walker), (i, ((radiance, counts), uncovered))| {
                    // Zeroed memory that is read before it is written has two faults a page, and the second
                    // interrupts all threads.
                    radiance.fill([0.0; 4]);
                    counts.fill([0; 2]);
                    uncovered.fill(0.0);
                    for (k, &sample) in numbers.iter().enumerate() {
                        let clock = Instant::now();
                        let place = kept[k].as_ref().map(|bands| &bands[i]);
                        let gbuffer = match (place.and_then(OnceLock::get), &drawing) {
                            (Some(known), _) => known,
                            (None, Some(drawing)) => {
                                let drawn = drawing.sample(i, k, canvas);
                                place.map_or(drawn, |place| place.get_or_init(|| drawn.clone()))
                            }
                            (None, None) => continue,
                        };
                        if sample == CENTRE
                            && let Some(surface) = surface.lock().unwrap_or_else(|e| e.into_inner()).as_mut()
                        {
                            set_surface(surface, scene, gbuffer, first + i * part);
                        }
                        monitor.progress("pixels", done.load(Ordering::Relaxed), total)?;
                        let drawn = if is_drawn { Duration::ZERO } else { clock.elapsed() };
                        nanoseconds[0].fetch_add(drawn.as_nanos() as u64, Ordering::Relaxed);
                        if !samples.contains(&sample) {
                            continue;
                        }
                        let of_band: Vec<[u32; 2]> = gbuffer.window.each().collect();
                        walker.pixels(gbuffer, &of_band, sample, |k, result| {
                            let new = result.radiance.extend(result.transmittance).to_array();
                            radiance[k] = [0, 1, 2, 3].map(|c| new[c] + radiance[k][c]);
                            counts[k] = [0, 1].map(|c| counts[k][c] + result.cells[c]);
                            if let Some(sum) = uncovered.get_mut(k) {
                                *sum += result.uncovered;
                            }
                        });
                        let integrated = clock.elapsed() - drawn;
                        nanoseconds[1].fetch_add(integrated.as_nanos() as u64, Ordering::Relaxed);
                        let pixels = of_band.len() as u64;
                        let done = done.fetch_add(pixels, Ordering::Relaxed) + pixels;
                        monitor.progress("pixels", done, total)?;
                    }
                    Ok(())
                },
            )?;
        // The passes share the time as they share the work of the threads.
        let [drawn, integrated] = nanoseconds.map(|n| n.into_inner() as f64);
        let share = drawn / (drawn + integrated).max(1.0);
        let all = clock.elapsed().as_secs_f64();
        seconds.gbuffer += all * share;
        seconds.integrate += all * (1.0 - share);
    }
    if let Some(surface) = &mut frame.surface {
        surface.set_planar(&scene.camera, image, window);
    }
    if samples.is_empty() {
        frame.seconds = seconds;
        return Ok(frame);
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

/// Sets the layers of a band of pixels, the first of which is number `first` of the frame.
fn set_surface(surface: &mut Surface, scene: &Scene, gbuffer: &Gbuffer, first: usize) {
    for i in 0..gbuffer.opaque.len() {
        let nearest = i * gbuffer.layers;
        let [u, v, t] = gbuffer.surface[nearest];
        let behind = (gbuffer.opaque[i][3], gbuffer.normal[i].truncate());
        let normal = |face, uv| scene.seen_normal(face, uv);
        surface.set(first + i, gbuffer.quad_id[nearest], [u, v, t, 0.0], normal, behind);
    }
}
