//! Projection from the world to the picture in the window and back, for the handles over the picture.

use glam::{DVec2, DVec3};

use crate::viewer::navigate::Pose;

/// A camera, and the rectangle of its picture in the window.
#[derive(Clone, Copy, Debug)]
pub struct View {
    eye: DVec3,
    /// Unit vectors to the right of the image, up in it, and into it.
    axes: [DVec3; 3],
    tan_half_fov: f64,
    /// Top left corner of the picture, points of the window, y down.
    corner: DVec2,
    /// Size of the picture, points of the window.
    size: DVec2,
}

impl View {
    /// Creates the view of a picture at `corner` with a `size`, points of the window.
    pub fn new(pose: &Pose, corner: DVec2, size: DVec2) -> View {
        let size = size.max(DVec2::ONE);
        View { eye: pose.eye, axes: pose.axes(), tan_half_fov: pose.tan_half_fov, corner, size }
    }

    /// Projects a point of the world to the window, in points. Also returns the point's depth along the view
    /// axis, metres. A point behind the eye has a depth of at most 0 and no projection.
    pub fn project(&self, point: DVec3) -> (Option<DVec2>, f64) {
        let [right, up, forward] = self.axes;
        let d = point - self.eye;
        let depth = d.dot(forward);
        let metres = depth * self.metres_per_point();
        let at = DVec2::new(d.dot(right), -d.dot(up)) / metres;
        ((depth > 0.0 && at.is_finite()).then(|| self.corner + self.size * 0.5 + at), depth)
    }

    /// The point of the world seen at a position in the window, at `depth` along the view axis, metres.
    pub fn unproject(&self, at: DVec2, depth: f64) -> DVec3 {
        let [right, up, forward] = self.axes;
        let d = (at - self.corner - self.size * 0.5) * self.metres_per_point();
        self.eye + (forward + right * d.x - up * d.y) * depth
    }

    /// Whether a position in the window lies in the picture.
    pub fn contains(&self, at: DVec2) -> bool {
        let d = at - self.corner;
        d.cmpge(DVec2::ZERO).all() && d.cmple(self.size).all()
    }

    /// The position nearest to `at` in the picture, at least `margin` points inside its border.
    pub fn nearest(&self, at: DVec2, margin: f64) -> DVec2 {
        let margin = DVec2::splat(margin).min(self.size * 0.5);
        at.clamp(self.corner + margin, self.corner + self.size - margin)
    }

    /// A position far outside the picture in the direction of a point that has no projection.
    pub fn border_towards(&self, point: DVec3) -> DVec2 {
        let [right, up, _] = self.axes;
        let d = point - self.eye;
        let towards = DVec2::new(d.dot(right), -d.dot(up)).normalize_or(DVec2::Y);
        self.corner + self.size * 0.5 + towards * self.size.length()
    }

    /// Position of a direction on the dial. Inverse of [`View::dial_direction`].
    pub fn dial_place(&self, direction: DVec3) -> DVec2 {
        let [right, up, forward] = self.axes;
        let across = DVec2::new(direction.dot(right), direction.dot(up));
        let angle = across.length().atan2(-direction.dot(forward));
        // For light from straight behind the scene, any position on the rim is correct.
        across.normalize_or(DVec2::Y) * (angle / std::f64::consts::PI)
    }

    /// The unit direction towards the light at a position on the dial. Outside the dial it is that of the
    /// rim.
    ///
    /// The dial shows all directions at once, with up as in the image. The distance from its middle is
    /// proportional to the angle from the direction towards the eye (azimuthal equidistant projection). The
    /// middle lights the scene from the eye, radius ½ from the side, the rim (radius 1) from behind.
    pub fn dial_direction(&self, position: DVec2) -> DVec3 {
        let [right, up, forward] = self.axes;
        let (sin, cos) = (position.length().min(1.0) * std::f64::consts::PI).sin_cos();
        let across = position.normalize_or_zero();
        ((right * across.x + up * across.y) * sin - forward * cos).normalize()
    }

    /// Direction from the eye to what is seen at a position in the window, not of unit length.
    pub fn towards(&self, at: DVec2) -> DVec3 {
        self.unproject(at, 1.0) - self.eye
    }

    /// Position of the eye, metres.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Metres that one point of the window covers at a depth of 1 m.
    pub fn metres_per_point(&self) -> f64 {
        2.0 * self.tan_half_fov / self.size.y
    }
}
