//! Unit vectors.

use glam::Vec3;

/// Returns `v` scaled to length 1, or `None` if it is shorter than 1e-12. Computed in float64, so that
/// neither tiny nor huge vectors lose their direction.
pub fn unit(v: Vec3) -> Option<Vec3> {
    let d = v.as_dvec3();
    (d.length() > 1e-12).then(|| d.normalize().as_vec3())
}
