//! §1 Spatial fractal curves: midpoint displacement of a line in space (the paper's §2.1, Fig. 1,
//! after Fournier, Fussell and Carpenter 1982).

use glam::Vec3;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal, UnitCircle};

/// Shape of a spatial fractal curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveShape {
    /// Complexity constant h of eq. (1): small is rough, large is smooth.
    pub h: f32,
    /// Standard deviation of g, cells.
    pub sigma_g_cells: f32,
    /// Depth of the recursion. The curve has 2^levels segments.
    pub levels: u32,
}

impl CurveShape {
    /// S(n) = 2^(−n·h), the scale of the displacement at level n of the recursion; S(0) = 1.
    pub fn scale(&self, level: u32) -> f32 {
        (-(level as f32) * self.h).exp2()
    }
}

/// Smallest depth of recursion at which a segment spans at most half a cell along a flow of `ny` cells. Half
/// a cell, because the displacement makes a segment longer than its share of the flow.
pub fn levels_for(ny: u32) -> u32 {
    (2 * ny.max(1)).next_power_of_two().trailing_zeros()
}

/// Writes the 2^levels + 1 points of one spatial fractal curve from `p1` to `p2` into `points`.
///
/// Each segment is split at p_mid = p_m + r·axis, r = g·S(n), where the axis is uniformly random in the plane
/// through the midpoint p_m and perpendicular to the segment. Random numbers are drawn level by level, from
/// the start of the curve to its end: one for g, then two at a time for the axis, by rejection.
pub fn spatial_fractal_curve(
    shape: &CurveShape,
    p1: Vec3,
    p2: Vec3,
    rng: &mut impl Rng,
    points: &mut Vec<Vec3>,
) {
    let count = 1usize << shape.levels;
    points.clear();
    points.resize(count + 1, p1);
    points[count] = p2;
    let mut stride = count;
    for level in 1..=shape.levels {
        let amplitude = shape.sigma_g_cells * shape.scale(level);
        let half = stride / 2;
        for start in (0..count).step_by(stride) {
            let a = points[start];
            let b = points[start + stride];
            let g: f32 = StandardNormal.sample(rng);
            let [c, s]: [f32; 2] = UnitCircle.sample(rng);
            let (e1, e2) = perpendicular_axes(b - a);
            let axis = e1 * c + e2 * s;
            points[start + half] = (a + b) * 0.5 + axis * (g * amplitude);
        }
        stride = half;
    }
}

/// Returns two unit vectors that span the plane perpendicular to `d`. A zero `d` counts as +y, the flow.
fn perpendicular_axes(d: Vec3) -> (Vec3, Vec3) {
    d.try_normalize().unwrap_or(Vec3::Y).any_orthonormal_pair()
}
