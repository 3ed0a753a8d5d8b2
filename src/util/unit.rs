//! Unit vectors.

use glam::Vec3;

/// Normalises `v` in float64, so that neither tiny nor huge vectors lose their direction. Returns `None` if
/// its length is at most 1e-12.
pub fn unit(v: Vec3) -> Option<Vec3> {
    let d = v.as_dvec3();
    (d.length() > 1e-12).then(|| d.normalize().as_vec3())
}
