//! View of the volume's box from a point on the sphere around it.

use eframe::egui::{self, Pos2, Rect};
use glam::Vec3;

/// Distance of the eye from the middle of the box, in radii of the sphere around the box. It is close enough
/// for perspective to be seen.
const DISTANCE: f32 = 4.0;
/// Diameter of that sphere's outline as a share of the canvas without its labels. It is more than 1 because
/// two opposite corners seldom lie on the outline.
const FILL: f32 = 1.05;
/// Room for the labels of both sides together, points.
const LABELS: egui::Vec2 = egui::vec2(64.0, 40.0);

/// Direction and distance from which the box is seen. At yaw and pitch 0, x points right, y (the flow) down
/// and z away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    /// Rotation about the vertical, radians.
    yaw: f32,
    /// Elevation of the eye, radians, positive from above.
    pitch: f32,
    zoom: f32,
}

impl Default for View {
    fn default() -> Self {
        View { yaw: 0.55, pitch: 0.32, zoom: 1.0 }
    }
}

impl View {
    /// Applies the pointer's actions: drag turns, scroll and pinch zoom, a double click resets.
    pub(super) fn steer(&mut self, ui: &egui::Ui, response: &egui::Response) {
        if response.dragged() {
            let by = response.drag_delta();
            self.yaw += by.x * 0.01;
            self.pitch = (self.pitch + by.y * 0.01).clamp(-1.5, 1.5);
        }
        if response.hovered() {
            let pinch = ui.input(|i| i.zoom_delta());
            // The scroll is consumed, or the panel around the canvas would scroll as well.
            let scroll = ui.input_mut(|i| std::mem::take(&mut i.smooth_scroll_delta));
            self.zoom = (self.zoom * pinch * (scroll.y * 0.004).exp()).clamp(0.4, 12.0);
        }
        if response.double_clicked() {
            *self = View::default();
        }
    }
}

/// Perspective projection of a box of cells to a rectangle of the screen.
pub(super) struct Projection {
    centre: Pos2,
    /// Points on the screen per radius of the sphere around the box, at a distance of one radius.
    points: f32,
    /// Size of the box, cells.
    size: Vec3,
    right: Vec3,
    up: Vec3,
    to_eye: Vec3,
}

impl Projection {
    /// Projects a box of `size` cells to `rect`.
    pub(super) fn new(view: &View, rect: Rect, size: Vec3) -> Self {
        let (sin_yaw, cos_yaw) = view.yaw.sin_cos();
        let (sin_pitch, cos_pitch) = view.pitch.sin_cos();
        // In cell coordinates y points down and z away.
        let right = Vec3::new(cos_yaw, 0.0, -sin_yaw);
        let to_eye = Vec3::new(-sin_yaw * cos_pitch, -sin_pitch, -cos_yaw * cos_pitch);
        let up = Vec3::new(sin_yaw * sin_pitch, -cos_pitch, cos_yaw * sin_pitch);
        // In perspective, the outline of the unit sphere has radius 1/√(DISTANCE² − 1).
        let fit = (DISTANCE * DISTANCE - 1.0).sqrt();
        let room = (rect.size() - LABELS).max(egui::Vec2::splat(40.0));
        let points = 0.5 * room.min_elem() * FILL * fit * view.zoom;
        Projection { centre: rect.center(), points, size, right, up, to_eye }
    }

    /// Position of a point on the screen, and its nearness: about 0 at the back of the box, 1 at its front.
    pub(super) fn project(&self, p_cell: Vec3) -> (Pos2, f32) {
        let q = (p_cell - self.size * 0.5) / (0.5 * self.size.length());
        let near = q.dot(self.to_eye);
        // Curves far outside the box must not get behind the eye.
        let scale = self.points / (DISTANCE - near).max(0.3);
        let at = egui::vec2(q.dot(self.right), -q.dot(self.up)) * scale;
        (self.centre + at, 0.5 + 0.62 * near)
    }

    /// The twelve edges of the box on the screen: those that meet in its farthest corner, then the others.
    pub(super) fn edges(&self) -> (Vec<[Pos2; 2]>, Vec<[Pos2; 2]>) {
        let far = Vec3::select(self.to_eye.cmplt(Vec3::ZERO), self.size, Vec3::ZERO);
        let (mut behind, mut in_front) = (Vec::new(), Vec::new());
        for axis in 0..3 {
            for corner in 0..4 {
                let mut a = Vec3::ZERO;
                a[(axis + 1) % 3] = (corner % 2) as f32 * self.size[(axis + 1) % 3];
                a[(axis + 2) % 3] = (corner / 2) as f32 * self.size[(axis + 2) % 3];
                let mut b = a;
                b[axis] = self.size[axis];
                let ends = [a, b].map(|p| self.project(p).0);
                if a == far || b == far { behind.push(ends) } else { in_front.push(ends) }
            }
        }
        (behind, in_front)
    }
}
