//! A plane as an eye sees it: the point of the plane under each point of the image.

use glam::{DVec3, Vec2, Vec3};

use super::QuadMap;

/// Largest distance of a point, metres. It keeps products of coordinates inside float32.
pub const FARTHEST: f32 = 1e9;

/// A plane through a point A, seen from an eye.
///
/// The ray through the point (X, Y) of the image is v = forward + right·X + up·Y. It meets the plane at
/// A + e1·h₁ + e2·h₂. With the eye's position E relative to A, h_i is (E_i·v_n − E_n·v_i)/v_n: numerator and
/// denominator are linear in X and Y. Their coefficients are computed in float64. A distant eye therefore
/// loses no digits: E_i and v_i are large and almost parallel there, and only their difference is rounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneView {
    /// Coefficients of h₁·v_n for 1, X and Y.
    pub across: Vec3,
    /// Coefficients of h₂·v_n.
    pub along: Vec3,
    /// Coefficients of v_n.
    pub normal: Vec3,
    /// Height of the eye over the plane, E_n, metres.
    pub height: f32,
}

impl PlaneView {
    /// The plane through A with the axes e1, e2 and n. `eye` is the eye's position relative to A, and `rays`
    /// are the camera's vectors forward, right and up.
    pub fn new([e1, e2, n]: [Vec3; 3], eye: DVec3, rays: [DVec3; 3]) -> PlaneView {
        let [e1, e2, n] = [e1, e2, n].map(|axis| axis.as_dvec3());
        let height = eye.dot(n);
        let row = |axis: DVec3| {
            Vec3::from_array(rays.map(|v| (eye.dot(axis) * v.dot(n) - height * v.dot(axis)) as f32))
        };
        PlaneView {
            across: row(e1),
            along: row(e2),
            normal: Vec3::from_array(rays.map(|v| v.dot(n) as f32)),
            height: height as f32,
        }
    }

    /// The plane of a quad. `eye` is the eye's position where the quad's corners are measured.
    pub fn of_quad(map: &QuadMap, eye: DVec3, rays: [DVec3; 3]) -> PlaneView {
        PlaneView::new([map.e1_world, map.e2_world, map.n_world], eye - map.a_world.as_dvec3(), rays)
    }

    /// Returns the point (h₁, h₂) under the point `at` of the image, metres from A, and the length of the ray
    /// v in front of it as a multiple of |v|. Twin: `plane_hit` of `shaders/mapping.wgsl`.
    pub fn hit(&self, at: Vec2) -> (Vec2, f32) {
        let linear = |row: Vec3| row.x + row.y * at.x + row.z * at.y;
        let v_n = linear(self.normal);
        let inverse = 1.0 / if v_n.abs() < 1e-20 { 1e-20 } else { v_n };
        let inside = |x: f32| (x * inverse).clamp(-FARTHEST, FARTHEST);
        (
            Vec2::new(inside(linear(self.across)), inside(linear(self.along))),
            (-self.height * inverse).clamp(0.0, FARTHEST),
        )
    }
}
