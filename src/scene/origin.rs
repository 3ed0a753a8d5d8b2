//! The origin of a scene: the place in the world from which the engines measure in float32.

use glam::DVec3;

use super::Values;
use super::param::POINT_MAX;

/// Distance between origins along each axis, metres. Within half of it a float32 is accurate to 2 µm. The
/// origin stays where it is while the scene changes a little, and a scene near the world's origin has that.
const STEP_M: f64 = 64.0;
/// Largest coordinates of an origin.
const MOST: DVec3 = DVec3::splat(POINT_MAX);

/// Returns the origin of a scene: the median of its water's points, or of those of rocks and pools if it has
/// no water, rounded to whole steps. One part that lies far from the others does not move it. It does not
/// depend on the camera, so that the mesh stays while the camera moves.
pub(super) fn origin(v: &Values) -> DVec3 {
    let mut points = water(v);
    if points.is_empty() {
        points = corners(v, "rocks").chain(corners(v, "pools")).collect();
    }
    if points.is_empty() {
        points.push(v.point("camera.target"));
    }
    let median = |axis: usize| {
        let mut along: Vec<f64> = points.iter().map(|point| point[axis]).collect();
        let middle = along.len() / 2;
        *along.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let middle = DVec3::from_array([0, 1, 2].map(median)).clamp(-MOST, MOST);
    (middle / STEP_M).round() * STEP_M
}

/// Returns points of the water: corners of quads, points of sheets, and the ends of splashes.
fn water(v: &Values) -> Vec<DVec3> {
    let mut points: Vec<DVec3> = corners(v, "quads").collect();
    for name in v.names("sheets") {
        let series = v.series(&format!("sheets.{name}.points"));
        points.extend(series.iter().filter(|point| point.len() == 3).map(|point| DVec3::from_slice(point)));
    }
    for name in v.names("splashes") {
        let keys = ["from", "to"].map(|what| format!("splashes.{name}.{what}"));
        points.extend(keys.iter().filter(|key| v.is_set(key)).map(|key| v.point(key)));
    }
    points
}

/// Returns the corners of all parts of a family that have some.
fn corners<'a>(v: &'a Values, family: &'a str) -> impl Iterator<Item = DVec3> + 'a {
    let keys = v.names(family).into_iter().map(move |name| format!("{family}.{name}.corners"));
    keys.filter(|key| v.is_set(key)).flat_map(|key| v.corners(&key))
}
