//! The curves of the water builder: those of the paper, each by itself, or gathered around parents.

use glam::Vec3;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::ripple::Ripple;
use super::spec::WaterSpec;
use crate::curve::{CurveShape, spatial_fractal_curve};
use crate::util::random::{Family, Stream};

/// How far into the volume, as a share of its depth, parents keep from either face: around one that starts on
/// a face half of the children would be lost.
const MARGIN: f32 = 0.2;
/// Correlation length of the breathing, a fraction of the flow: a bundle opens and closes two or three times
/// on its way.
const BREATH: f32 = 0.12;
/// Narrowest that breathing makes a bundle: at 0 all its strands would go through one point.
const NARROWEST: f32 = 0.15;

/// Writes the points of curve number `curve` of the jitter grid (column + row·across) into `points`, in
/// cells, unwrapped: just the curve the volume is built from. Its ends have the same x and z.
///
/// The curve is drawn level by level, so a spec with fewer `shape.levels` gives every
/// 2^(difference)-th point of the same curve.
///
/// With bundles a child's point is its own curve's, moved as its parent is displaced there; its distance from
/// the parent breathes with the bundle. Both are periodic along the flow.
pub fn curve_points(spec: &WaterSpec, curve: usize, points: &mut Vec<Vec3>) {
    let [nx, ny, nz] = spec.size.map(|n| n as f32);
    let mut rng = Family::new(spec.seed, Stream::Curve).member(curve as u64);
    let column = (curve % spec.across as usize) as f32;
    let row = (curve / spec.across as usize) as f32;
    let x = (column + rng.random::<f32>()) / spec.across as f32 * nx;
    let z = (row + rng.random::<f32>()) / spec.deep as f32 * nz;
    let ends = |x: f32, z: f32| [Vec3::new(x, 0.0, z), Vec3::new(x, ny, z)];
    let [p1, p2] = ends(x, z);
    let structure = &spec.structure;
    if structure.bundles == 0 {
        return spatial_fractal_curve(&spec.shape, p1, p2, &mut rng, points);
    }
    // Drawn from a generator of their own: the number of the curve's own draws depends on its levels.
    let mut choice = Family::new(spec.seed, Stream::Child).member(curve as u64);
    let parent = choice.random_range(0..structure.bundles);
    let away = Vec3::new(normal(&mut choice), 0.0, normal(&mut choice)) * structure.radius_cells;
    if choice.random::<f32>() < structure.loose {
        return spatial_fractal_curve(&spec.shape, p1, p2, &mut rng, points);
    }

    let mut rng_parent = Family::new(spec.seed, Stream::Bundle).member(u64::from(parent));
    let x = (parent as f32 + rng_parent.random::<f32>()) / structure.bundles as f32 * nx;
    let z = (MARGIN + (1.0 - 2.0 * MARGIN) * rng_parent.random::<f32>()) * nz;
    let breath = Ripple::new(BREATH, &mut rng_parent);
    let shape = CurveShape { sigma_g_cells: structure.wander_cells, ..spec.shape };
    let mut parent_points = Vec::new();
    let [q1, q2] = ends(x, z);
    spatial_fractal_curve(&shape, q1, q2, &mut rng_parent, &mut parent_points);
    let [p1, p2] = ends(x + away.x, z + away.z);
    spatial_fractal_curve(&spec.shape, p1, p2, &mut rng, points);

    let steps = points.len() - 1;
    let mut widths = Vec::with_capacity(steps + 1);
    breath.sample(steps, &mut widths);
    widths.push(widths[0]);
    for (i, (point, parent)) in points.iter_mut().zip(&parent_points).enumerate() {
        let straight = q1.lerp(q2, i as f32 / steps as f32);
        let width = (1.0 + structure.breathe * widths[i]).max(NARROWEST);
        *point += (*parent - straight) + away * (width - 1.0);
    }
}

fn normal(rng: &mut impl Rng) -> f32 {
    StandardNormal.sample(rng)
}
