//! Samples that a lens and an open shutter want.

use std::f64::consts::PI;

use glam::Vec3;

use super::Scene;

/// Samples with which the copies of what moves under an open shutter fill one another's gaps.
const SHUTTER_SAMPLES: u32 = 8;

/// Distance between the copies of a blurred point, pixels, at which they melt into a disc.
const COPY_PIXELS: f64 = 1.5;

/// Returns warnings about too few samples for an open shutter or for a lens.
pub(super) fn warnings(scene: &Scene) -> Vec<String> {
    let samples = scene.image.samples;
    let mut warnings = Vec::new();
    if samples < SHUTTER_SAMPLES && (scene.moves() || (scene.wave_moves != 0.0 && !scene.pools.is_empty())) {
        warnings.push(format!(
            "camera.shutter gives each sample a time of its own, and {samples} of them show grain: set \
             image.samples=16 or more"
        ));
    }
    if let Some((blur, wanted)) = samples_of_lens(scene).filter(|&(_, wanted)| samples < wanted) {
        warnings.push(format!(
            "the lens blurs points to discs of up to {blur:.1} pixels, in which {samples} samples show \
             copies: set image.samples={wanted} or more, or a higher camera.f_number"
        ));
    }
    warnings
}

/// Returns the diameter of the largest disc that a point of the background or of the nearest water becomes,
/// in pixels, and the samples that fill it.
fn samples_of_lens(scene: &Scene) -> Option<(f64, u32)> {
    let lens = scene.lens?;
    let camera = &scene.camera;
    let depth = |point: &Vec3| (point.as_dvec3() - camera.eye_local()).dot(camera.forward);
    let points = scene.quads.iter().flat_map(|quad| &quad.corners);
    let nearest = points.map(depth).filter(|&depth| depth > camera.near.into()).fold(lens.focus, f64::min);
    let blur = lens.blur(camera, &scene.image, f64::INFINITY).max(lens.blur(camera, &scene.image, nearest));
    let wanted = (PI / 4.0 * (blur / COPY_PIXELS).powi(2)).ceil().clamp(1.0, 1024.0);
    Some((blur, wanted as u32))
}
