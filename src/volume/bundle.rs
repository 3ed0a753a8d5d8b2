//! §2 Curves of the water builder: independent ones, as in the paper, or bundles of curves around parents.

use glam::Vec3;
use rand::RngExt;

use super::ripple::Ripple;
use super::spec::WaterSpec;
use crate::curve::{CurveShape, spatial_fractal_curve};
use crate::util::random::{Family, Stream, normal};

/// Distance that parents keep from the volume's faces z = 0 and z = nz, as a share of its depth. Around a
/// parent on a face half of the children would be lost.
const MARGIN: f32 = 0.2;
/// Correlation length of a bundle's width, as a fraction of the flow length. A bundle opens and closes two or
/// three times along the flow.
const BREATH_LENGTH: f32 = 0.12;
/// Smallest factor of a bundle's width. At 0 all its strands would go through one point.
const MIN_WIDTH: f32 = 0.15;

/// Writes the points of one curve into `points`, in cells and not wrapped around. `curve` is its number in
/// the jitter grid, column + row·across. The volume is built from exactly these points. The curve's ends have
/// the same x and z.
///
/// The curve is drawn level by level, so a specification with fewer `shape.levels` gives every
/// 2^(difference)-th point of the same curve.
///
/// In a bundle each point of the curve is moved by the displacement of its parent at that point. The curve's
/// distance from the parent is scaled by the bundle's width there. Both are periodic along the flow.
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
    // A generator of their own, because the number of the curve's own draws depends on its levels.
    let mut choice = Family::new(spec.seed, Stream::Child).member(curve as u64);
    let parent = choice.random_range(0..structure.bundles);
    let away = Vec3::new(normal(&mut choice), 0.0, normal(&mut choice)) * structure.radius_cells;
    if choice.random::<f32>() < structure.loose {
        return spatial_fractal_curve(&spec.shape, p1, p2, &mut rng, points);
    }

    let mut rng_parent = Family::new(spec.seed, Stream::Bundle).member(u64::from(parent));
    let x = (parent as f32 + rng_parent.random::<f32>()) / structure.bundles as f32 * nx;
    let z = (MARGIN + (1.0 - 2.0 * MARGIN) * rng_parent.random::<f32>()) * nz;
    let breath = Ripple::new(BREATH_LENGTH, &mut rng_parent);
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
        let width = (1.0 + structure.breathe * widths[i]).max(MIN_WIDTH);
        *point += (*parent - straight) + away * (width - 1.0);
    }
}
