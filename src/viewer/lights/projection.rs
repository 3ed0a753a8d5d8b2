//! From the world to the picture in the window and back, for what is drawn over it and dragged in it.

use glam::{DVec2, DVec3};

use crate::viewer::navigate::Pose;

/// The camera and where its picture lies in the window.
#[derive(Clone, Copy, Debug)]
pub struct View {
    eye: DVec3,
    /// Unit: to the right of the image, up in it, into it.
    axes: [DVec3; 3],
    tan_half_fov: f64,
    /// Top left corner, points of the window, y down.
    corner: DVec2,
    /// Points of the window.
    size: DVec2,
}

impl View {
    /// Of a picture at `corner` with a `size`, points of the window.
    pub fn new(pose: &Pose, corner: DVec2, size: DVec2) -> View {
        let size = size.max(DVec2::ONE);
        View { eye: pose.eye, axes: pose.axes(), tan_half_fov: pose.tan_half_fov, corner, size }
    }

    /// Where a point of the world is seen, points of the window, and its depth along the view axis, metres;
    /// a depth of at most 0 is behind the eye, and has no place.
    pub fn project(&self, point: DVec3) -> (Option<DVec2>, f64) {
        let [right, up, forward] = self.axes;
        let d = point - self.eye;
        let depth = d.dot(forward);
        let metres = depth * self.metres_per_point();
        let at = DVec2::new(d.dot(right), -d.dot(up)) / metres;
        ((depth > 0.0 && at.is_finite()).then(|| self.corner + self.size * 0.5 + at), depth)
    }

    /// The point of the world that is seen at a place, at this depth along the view axis, metres.
    pub fn unproject(&self, at: DVec2, depth: f64) -> DVec3 {
        let [right, up, forward] = self.axes;
        let d = (at - self.corner - self.size * 0.5) * self.metres_per_point();
        self.eye + (forward + right * d.x - up * d.y) * depth
    }

    /// Whether a place lies in the picture.
    pub fn contains(&self, at: DVec2) -> bool {
        let d = at - self.corner;
        d.cmpge(DVec2::ZERO).all() && d.cmple(self.size).all()
    }

    /// The place in the picture, `margin` points within its border, that is nearest to another.
    pub fn nearest(&self, at: DVec2, margin: f64) -> DVec2 {
        let margin = DVec2::splat(margin).min(self.size * 0.5);
        at.clamp(self.corner + margin, self.corner + self.size - margin)
    }

    /// The middle of the picture's border towards which a point lies that has no place.
    pub fn border_towards(&self, point: DVec3) -> DVec2 {
        let [right, up, _] = self.axes;
        let d = point - self.eye;
        let way = DVec2::new(d.dot(right), -d.dot(up)).normalize_or(DVec2::Y);
        self.corner + self.size * 0.5 + way * self.size.length()
    }

    /// Where a direction is on the dial.
    pub fn dial_place(&self, direction: DVec3) -> DVec2 {
        let [right, up, forward] = self.axes;
        let across = DVec2::new(direction.dot(right), direction.dot(up));
        let angle = across.length().atan2(-direction.dot(forward));
        // Straight from behind the scene all of the rim is right.
        across.normalize_or(DVec2::Y) * (angle / std::f64::consts::PI)
    }

    /// The unit direction at a place of the dial; outside, that of the rim.
    ///
    /// The dial shows all directions at once: the distance from its middle is the angle from the direction
    /// towards the eye (azimuthal equidistant projection), up is up in the image. The middle lights the scene
    /// from the eye, radius ½ from the side, the rim (radius 1) from behind.
    pub fn dial_direction(&self, place: DVec2) -> DVec3 {
        let [right, up, forward] = self.axes;
        let (sin, cos) = (place.length().min(1.0) * std::f64::consts::PI).sin_cos();
        let across = place.normalize_or_zero();
        ((right * across.x + up * across.y) * sin - forward * cos).normalize()
    }

    /// Metres at a depth of 1 m that one point of the window covers.
    fn metres_per_point(&self) -> f64 {
        2.0 * self.tan_half_fov / self.size.y
    }
}
