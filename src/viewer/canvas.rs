//! Handles over the picture: where they stand, and how the pointer drags them.

use eframe::egui;
use egui::{Color32, FontId, Pos2, Rect, Response, Sense, Stroke, Ui, pos2, vec2};
use glam::{DVec2, DVec3};

use super::lights::projection::View;
use super::navigate::Pose;
use super::parameters::name as label;
use crate::scene::{Raw, Values};

/// Half the side of the square in which the pointer grabs a handle, points.
const GRAB_RADIUS: f32 = 11.0;
/// Exponent of the change in depth: a drag over the image's height multiplies the depth by e to this power.
const DEPTH_EXPONENT: f64 = 3.0;
/// Depths to which a handle can be moved, metres along the view axis.
const DEPTHS: std::ops::RangeInclusive<f64> = 1e-3..=1e6;

/// Result of showing handles for one frame.
#[derive(Debug, Default)]
pub struct Drawn {
    /// New values, with their keys.
    pub edits: Vec<(String, Raw)>,
    /// Whether the pointer is over a handle.
    pub hovered: bool,
}

/// The picture that handles are drawn over, and the result so far.
pub(super) struct Canvas<'a> {
    pub ui: &'a Ui,
    pub painter: egui::Painter,
    pub image: Rect,
    pub view: View,
    pub values: &'a Values,
    pub pose: Pose,
    pub done: Drawn,
}

/// A handle that is dragged parallel to the image.
pub(super) struct Grip<Part> {
    /// The handle.
    pub part: Part,
    /// Position of the handle, points of the window.
    at: DVec2,
    /// Offset of the handle from the pointer when it was grabbed, points.
    offset: DVec2,
    /// Depth of the handle along the view axis, metres.
    depth: f64,
}

impl<'a> Canvas<'a> {
    pub fn new(ui: &'a Ui, image: Rect, values: &'a Values, pose: Pose) -> Canvas<'a> {
        let view = View::new(&pose, point(image.min), point(pos2(image.width(), image.height())));
        Canvas { ui, painter: ui.painter_at(image), image, view, values, pose, done: Drawn::default() }
    }

    /// Whether a point of the world is visible in the picture, and the position of its handle. The handle of
    /// a point outside the picture is at the border.
    pub fn handle_position(&self, point: DVec3) -> (bool, Pos2) {
        let projected = self.view.project(point).0;
        let at = projected.unwrap_or_else(|| self.view.border_towards(point));
        (projected.is_some_and(|at| self.view.contains(at)), at_point(self.view.nearest(at, 14.0)))
    }

    /// Registers a handle at a position, under a name that screen readers read.
    pub fn handle(&mut self, at: Pos2, name: &str) -> Response {
        let rect = Rect::from_center_size(at, vec2(GRAB_RADIUS, GRAB_RADIUS) * 2.0);
        let response = self.ui.interact(rect, self.ui.scope_id().with(name), Sense::click_and_drag());
        label(&response, name);
        self.done.hovered |= response.hovered();
        response.on_hover_and_drag_cursor(egui::CursorIcon::Move)
    }

    /// Continues a drag of the handle of a point, parallel to the image or with Shift in depth. Returns where
    /// the point is moved to.
    pub fn drag<Part: PartialEq + Clone>(
        &self,
        grip: &mut Option<Grip<Part>>,
        response: &Response,
        part: Part,
        now: DVec3,
    ) -> Option<DVec3> {
        if response.drag_stopped() {
            *grip = None;
        }
        if !response.dragged_by(egui::PointerButton::Primary) {
            return None;
        }
        let pointer = point(response.interact_pointer_pos()?);
        if response.drag_started() {
            let (projected, depth) = self.view.project(now);
            let pressed = self.pressed_at(pointer);
            // The handle of a point outside the picture jumps to the pointer. A point behind the eye gets the
            // depth of the camera's target.
            let visible = projected.filter(|at| self.view.contains(*at));
            let offset = visible.map_or(DVec2::ZERO, |at| at - pressed);
            let depth = if depth > 0.0 { depth } else { self.view.project(self.pose.target).1 };
            *grip = Some(Grip { at: pressed + offset, part: part.clone(), offset, depth });
        }
        let grip = grip.as_mut().filter(|grip| grip.part == part)?;
        if self.ui.input(|i| i.modifiers.shift) {
            let up = f64::from(-response.drag_delta().y) / f64::from(self.image.height().max(1.0));
            grip.depth = (grip.depth * (up * DEPTH_EXPONENT).exp()).clamp(*DEPTHS.start(), *DEPTHS.end());
            grip.offset = grip.at - pointer;
        } else {
            grip.at = pointer + grip.offset;
        }
        Some(self.view.unproject(grip.at, grip.depth))
    }

    /// Where the button was pressed, points of the window. A drag begins a few points from there.
    pub fn pressed_at(&self, pointer: DVec2) -> DVec2 {
        self.ui.input(|i| i.pointer.press_origin()).map_or(pointer, point)
    }

    /// Draws an arrow at the border towards a point that the picture does not show.
    pub fn arrow_out(&self, at: Pos2) {
        let out = (at - self.image.center()).normalized();
        let side = out.rot90() * 4.0;
        let tip = vec![at + out * 13.0, at + out * 9.0 + side, at + out * 9.0 - side];
        self.painter.add(egui::Shape::convex_polygon(tip, Color32::WHITE, Stroke::NONE));
    }

    /// Draws the line between two points of the world, if the eye sees both.
    pub fn line(&self, a: DVec3, b: DVec3, stroke: Stroke) {
        if let (Some(a), Some(b)) = (self.view.project(a).0, self.view.project(b).0) {
            self.painter.line_segment([at_point(a), at_point(b)], stroke);
        }
    }

    /// Writes text beside a handle, inside the picture.
    pub fn caption(&self, at: Pos2, text: &str) {
        let font = FontId::proportional(12.0);
        let galley = self.painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
        let size = galley.size();
        let right = at + vec2(14.0, -size.y * 0.5);
        let most = self.image.right_bottom() - size - vec2(4.0, 4.0);
        let corner = right.min(most).max(self.image.left_top() + vec2(4.0, 4.0));
        let ground = Rect::from_min_size(corner, size).expand2(vec2(4.0, 1.0));
        self.painter.rect_filled(ground, 3.0, Color32::from_black_alpha(130));
        self.painter.galley(corner, galley, Color32::WHITE);
    }
}

pub(super) fn point(at: Pos2) -> DVec2 {
    DVec2::new(f64::from(at.x), f64::from(at.y))
}

pub(super) fn at_point(at: DVec2) -> Pos2 {
    pos2(at.x as f32, at.y as f32)
}
