//! The origin of a scene: the place in the world from which the engines measure in float32.

use glam::{DVec3, Vec3};

use super::param::POINT_MAX;
use super::{Parts, SceneBox, SceneMesh, Values};

/// Distance between origins along each axis, metres. Within half of it a float32 is accurate to 2 µm. The
/// origin stays where it is while the scene changes a little, and a scene near the world's origin has that.
const STEP_M: f64 = 64.0;
/// Largest coordinates of an origin.
const MOST: DVec3 = DVec3::splat(POINT_MAX);

/// Returns the origin of a scene: the median of its water's points and boxes, of the middles of its meshes if
/// it has no other water, or of the points of rocks and pools if it has no meshes either, rounded to whole
/// steps. One part that lies far from the others does not move it. It does not depend on the camera, so that
/// the mesh stays while the camera moves.
pub(super) fn origin(v: &Values, meshes: &[SceneMesh], boxes: &[SceneBox]) -> DVec3 {
    let mut points = water(v);
    points.extend(boxes.iter().map(SceneBox::middle));
    if points.is_empty() {
        points.extend(meshes.iter().filter_map(SceneMesh::middle));
    }
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

/// Largest error of a point that needs no warning, pixels.
const UNSEEN_PX: f64 = 0.5;

/// Returns a warning about the part whose points the picture shows rounded most, if that is seen. Such a part
/// lies far from the origin and near the eye.
pub(super) fn rounded(scene: &Parts) -> Option<String> {
    let (camera, eye) = (&scene.camera, scene.camera.eye_local());
    let pixel = 2.0 * f64::from(camera.tan_half_fov) / f64::from(scene.image.height);
    let water = scene.quads.iter().map(|quad| ("water".to_owned(), quad.corners));
    let rocks = scene.rocks.iter().map(|rock| (format!("rocks.{}", rock.name), rock.corners));
    let pools = scene.pools.iter().map(|pool| (format!("pools.{}", pool.name), pool.corners));
    let seen = water.chain(rocks).chain(pools).filter_map(|(name, corners)| {
        let corners = corners.map(Vec3::as_dvec3);
        if corners.iter().all(|corner| (*corner - eye).dot(camera.forward) < 0.0) {
            return None;
        }
        let [low, high] = [DVec3::min, DVec3::max].map(|f| corners.into_iter().reduce(f).unwrap_or_default());
        let largest = low.abs().max(high.abs()).max_element() as f32;
        let step = f64::from(largest.next_up() - largest);
        // A box may hold the eye although the part is not that near.
        let least = f64::from(camera.near).max(0.01 * low.distance(high));
        let pixels = 0.5 * step / (eye.distance(eye.clamp(low, high)).max(least) * pixel);
        (pixels > UNSEEN_PX).then(|| (pixels, name, 0.5 * (low + high), step))
    });
    let (pixels, name, middle, step) = seen.max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(format!(
        "{name} lies {:.0} m from the middle of the scene: its points are rounded to {:.2} mm, which moves \
         them by up to {pixels:.1} pixels; bring the parts of the scene closer together, or render {name} as \
         a scene of its own",
        middle.length(),
        1000.0 * step
    ))
}
