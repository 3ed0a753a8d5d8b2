//! Units of level sets. Most programs write distances in metres, and Blender's fluids in voxels.

use super::LevelSetUnit;
use crate::grid::{BlockData, Class, Grid};

/// Least ratio between the edge of a voxel and 1 m, either way, at which the numbers tell the unit.
const APART: f64 = 1.5;

/// Takes the distances of a level set to metres. Grids of another class stay.
pub(super) fn to_metres(grid: &mut Grid, unit: LevelSetUnit) {
    if grid.class != Class::LevelSet {
        return;
    }
    let edge = grid.to_world.matrix3.determinant().abs().cbrt();
    let is_in_voxels = match unit {
        LevelSetUnit::Metres => false,
        LevelSetUnit::Voxels => true,
        LevelSetUnit::Auto => slope(grid).is_some_and(|slope| is_voxels(slope, edge)),
    };
    if is_in_voxels {
        grid.scale(edge as f32);
    }
}

/// Whether distances that grow by `slope` an index are nearer to voxels, 1, than to metres, `edge`.
fn is_voxels(slope: f64, edge: f64) -> bool {
    let [slope, edge] = [slope, edge].map(f64::ln);
    edge.abs() > APART.ln() && slope.abs() < (slope - edge).abs()
}

/// Mean length of the gradient per index at the surface; `None` for a grid without one. Differences are taken
/// inside of leaves.
fn slope(grid: &Grid) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0u64);
    for block in grid.blocks() {
        let BlockData::Leaf { values, active } = block.data else { continue };
        let number = |[x, y, z]: [usize; 3]| x + 8 * y + 64 * z;
        let is_active = |i: usize| active[i >> 6] >> (i & 63) & 1 != 0;
        for i in (0..343).map(|i| number([i % 7, i / 7 % 7, i / 49])) {
            let next = [i + 1, i + 8, i + 64];
            if !is_active(i) || !next.into_iter().all(is_active) {
                continue;
            }
            let own = f64::from(values[i]);
            let steps = next.map(|n| f64::from(values[n]) - own);
            // The surface lies between the sample and one of the others.
            if steps.iter().any(|step| (own <= 0.0) != (own + step <= 0.0)) {
                sum += steps.iter().map(|step| step * step).sum::<f64>().sqrt();
                count += 1;
            }
        }
    }
    (count > 0 && sum > 0.0).then(|| sum / count as f64)
}
