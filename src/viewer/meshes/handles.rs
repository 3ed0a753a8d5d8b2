//! Handles over the picture, with which the selected mesh is moved, turned and sized.
//!
//! They stand at the middle of the box around the mesh, which stays where it is while the mesh is turned or
//! sized. Each ring turns about the axis of one number of `meshes.*.turn`. The mesh is turned about x first,
//! so the axis of x is turned by y and z, and that of y by z.

use std::f64::consts::{PI, TAU};

use eframe::egui;
use egui::{Color32, Pos2, Rect, Response, Stroke, Ui, vec2};
use glam::{DVec2, DVec3};

use super::Meshes;
use super::gizmo::{Gizmo, PIECES, TIP};
use crate::scene::{Raw, SceneMesh, Values, box_corners, mesh_place};
use crate::viewer::canvas::{self, Canvas, Drawn, at_point, point};
use crate::viewer::navigate::{Pose, raw};

/// Place of the handle for the size, in radii of the rings to the right and up.
const SIZE_AT: f64 = 1.0;
/// Distance from a ring at which the pointer grabs it, points.
const REACH: f64 = 10.0;
/// Shortest arrow that can be dragged, points. A shorter one points at the eye.
const SHORTEST: f64 = 14.0;
/// Steps of a turn with Shift, degrees.
const STEP_DEG: f64 = 15.0;
/// Smallest and largest `meshes.*.scale`.
const SCALES: [f64; 2] = [1e-6, 1e6];

const AXES: [&str; 3] = ["x", "y", "z"];
const COLORS: [Color32; 3] =
    [Color32::from_rgb(235, 90, 80), Color32::from_rgb(110, 200, 90), Color32::from_rgb(90, 150, 250)];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    /// The middle, which moves the mesh parallel to the image.
    Middle,
    /// The arrow that moves it along an axis of the world.
    Axis(usize),
    /// The ring that turns it by a number of `meshes.*.turn`.
    Ring(usize),
    /// The square that sizes it.
    Size,
}

/// A handle being dragged.
pub(super) struct Grip {
    mesh: String,
    part: Part,
    /// The gizmo when the handle was grabbed.
    start: Gizmo,
    /// Where the button was pressed, points of the window.
    pressed: DVec2,
    /// Angle of the pointer in the plane of a ring, radians.
    angle: f64,
    /// Angle that a ring was turned by so far, radians.
    swept: f64,
    /// Plane of a drag of the middle.
    plane: Option<canvas::Grip<Part>>,
}

/// Shows the handles of the selected mesh, if it is not hidden.
pub fn show(
    ui: &Ui,
    image: Rect,
    (values, pose): (&Values, Pose),
    shown: &[SceneMesh],
    meshes: &mut Meshes,
) -> Drawn {
    let mut canvas = Canvas::new(ui, image, values, pose);
    let selected = shown.iter().find(|mesh| meshes.selected() == Some(&mesh.name));
    let Some((mesh, gizmo)) = selected.and_then(|mesh| Some((mesh, Gizmo::of(values, mesh, &canvas)?)))
    else {
        return canvas.done;
    };
    canvas.frame(mesh);
    let (visible, at) = canvas.handle_position(gizmo.middle);
    let mut hovered = None;
    if visible {
        canvas.rings(meshes, mesh, &gizmo, &mut hovered);
        canvas.arrows(meshes, mesh, &gizmo, at, &mut hovered);
        canvas.size(meshes, mesh, &gizmo, at, &mut hovered);
    }
    canvas.middle(meshes, mesh, &gizmo, at, &mut hovered);
    if !visible {
        canvas.arrow_out(at);
    }
    let held = meshes.grip.as_ref().filter(|grip| grip.mesh == mesh.name).map(|grip| grip.part);
    match held.or(hovered) {
        Some(part) => canvas.numbers(mesh, &gizmo, part),
        // Below the arrows and rings.
        None => canvas.caption(at + vec2(-26.0, (gizmo.points * TIP) as f32 + 18.0), &mesh.name),
    }
    canvas.done
}

impl Canvas<'_> {
    /// Draws the box around the mesh.
    fn frame(&self, mesh: &SceneMesh) {
        let Some(bounds) = mesh.loaded.bounds() else { return };
        let place = mesh_place(self.values, &mesh.name);
        let corners = box_corners(bounds).map(|corner| place.transform_point3(corner));
        for i in 0..8_usize {
            for other in [1, 2, 4].map(|bit| i | bit).into_iter().filter(|other| *other != i) {
                self.line(corners[i], corners[other], Stroke::new(2.0, Color32::from_black_alpha(70)));
                self.line(corners[i], corners[other], Stroke::new(1.0, Color32::from_white_alpha(110)));
            }
        }
    }

    /// The middle, which is dragged parallel to the image, or with Shift in depth.
    fn middle(
        &mut self,
        meshes: &mut Meshes,
        mesh: &SceneMesh,
        gizmo: &Gizmo,
        at: Pos2,
        hovered: &mut Option<Part>,
    ) {
        let response = self.handle(at, &format!("Handle of {}", mesh.name));
        self.grab(meshes, &response, mesh, Part::Middle, gizmo);
        let grip = meshes.grip.as_mut().filter(|grip| grip.part == Part::Middle);
        if let Some(grip) = grip
            && let Some(moved) = self.drag(&mut grip.plane, &response, Part::Middle, gizmo.middle)
        {
            let position = grip.start.position + (moved - grip.start.middle);
            self.edit(mesh, "position", raw(position));
        }
        let bright = self.mark(&response, Part::Middle, hovered);
        for (width, color) in [(4.0, Color32::from_black_alpha(170)), (2.0, Color32::WHITE)] {
            self.painter.circle_stroke(at, if bright { 8.0 } else { 6.5 }, Stroke::new(width, color));
        }
    }

    /// The arrows along the axes of the world.
    fn arrows(
        &mut self,
        meshes: &mut Meshes,
        mesh: &SceneMesh,
        gizmo: &Gizmo,
        at: Pos2,
        hovered: &mut Option<Part>,
    ) {
        for i in 0..3 {
            let axis = DVec3::AXES[i];
            let end = gizmo.middle + axis * (gizmo.radius * TIP);
            let Some(tip) = self.view.project(end).0.map(at_point) else { continue };
            let held = holds(meshes, mesh, Part::Axis(i));
            if (tip - at).length() < SHORTEST as f32 && !held {
                continue;
            }
            let response = self.handle(tip, &format!("Move {} along {}", mesh.name, AXES[i]));
            self.grab(meshes, &response, mesh, Part::Axis(i), gizmo);
            if let Some((grip, pointer)) = dragged(meshes, &response, mesh, Part::Axis(i)) {
                let along = |at: DVec2| self.along(grip.start.middle, axis, at);
                if let (Some(from), Some(to)) = (along(grip.pressed), along(pointer)) {
                    let position = grip.start.position + axis * (to - from);
                    self.edit(mesh, "position", raw(position));
                }
            }
            let bright = self.mark(&response, Part::Axis(i), hovered);
            let out = (tip - at).normalized();
            let from = at + out * 10.0;
            let color = if bright { Color32::WHITE } else { COLORS[i] };
            for (width, color) in [(4.0, Color32::from_black_alpha(150)), (2.0, color)] {
                self.painter.line_segment([from, tip], Stroke::new(width, color));
            }
            let side = out.rot90() * 6.0;
            let head = vec![tip + out * 9.0, tip - out * 4.0 + side, tip - out * 4.0 - side];
            let edge = Stroke::new(1.0, Color32::from_black_alpha(170));
            self.painter.add(egui::Shape::convex_polygon(head, color, edge));
        }
    }

    /// The rings that turn the mesh.
    fn rings(&mut self, meshes: &mut Meshes, mesh: &SceneMesh, gizmo: &Gizmo, hovered: &mut Option<Part>) {
        let pointer = self.ui.input(|i| i.pointer.hover_pos()).map(point);
        let points: [Vec<Option<DVec2>>; 3] = [0, 1, 2].map(|i| {
            (0..=PIECES)
                .map(|k| self.view.project(gizmo.on_ring(i, TAU * k as f64 / PIECES as f64)).0)
                .collect()
        });
        let distance = |points: &[Option<DVec2>], to: DVec2| {
            let pieces = points.windows(2).filter_map(|pair| Some(to_segment(to, pair[0]?, pair[1]?)));
            pieces.fold(f64::INFINITY, f64::min)
        };
        let near = pointer.and_then(|pointer| {
            let all = [0, 1, 2].map(|i| (distance(&points[i], pointer), i));
            let nearest = all.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
            (nearest.0 <= REACH).then_some((nearest.1, pointer))
        });
        for i in 0..3 {
            let knob = self.knob(gizmo, i);
            // The whole ring can be grabbed: its handle comes to the pointer.
            let at = near.filter(|(ring, _)| *ring == i).map_or(knob, |(_, pointer)| Some(pointer));
            let Some(at) = at.map(at_point) else { continue };
            let response = self.handle(at, &format!("Turn {} about {}", mesh.name, AXES[i]));
            self.grab(meshes, &response, mesh, Part::Ring(i), gizmo);
            self.turn(meshes, &response, mesh, i);
            let bright = self.mark(&response, Part::Ring(i), hovered);
            let color = if bright { Color32::WHITE } else { COLORS[i] };
            self.draw_ring(gizmo, i, &points[i], color);
            if let Some(knob) = knob {
                let edge = Stroke::new(1.0, Color32::from_black_alpha(170));
                self.painter.circle(at_point(knob), 4.5, color, edge);
            }
        }
    }

    /// Continues a turn by ring `i`.
    fn turn(&mut self, meshes: &mut Meshes, response: &Response, mesh: &SceneMesh, i: usize) {
        let Some((grip, pointer)) = dragged(meshes, response, mesh, Part::Ring(i)) else { return };
        let start = grip.start;
        let Some(angle) = self.angle_on_ring(&start, i, grip.pressed, pointer) else { return };
        if response.drag_started() {
            grip.angle = self.angle_on_ring(&start, i, grip.pressed, grip.pressed).unwrap_or(angle);
        }
        grip.swept += (angle - grip.angle + PI).rem_euclid(TAU) - PI;
        grip.angle = angle;
        let mut degrees = start.turn[i] + grip.swept.to_degrees();
        if self.ui.input(|input| input.modifiers.shift) {
            degrees = (degrees / STEP_DEG).round() * STEP_DEG;
        }
        let mut turn = start.turn;
        // A hundredth of a degree is less than the hand can do, and reads well in a file.
        turn[i] = (((degrees + 180.0).rem_euclid(360.0) - 180.0) * 100.0).round() / 100.0;
        self.edit(mesh, "turn", raw(turn));
        self.edit(mesh, "position", raw(start.position_with(turn, start.scale)));
    }

    /// The square that sizes the mesh by its distance from the middle.
    fn size(
        &mut self,
        meshes: &mut Meshes,
        mesh: &SceneMesh,
        gizmo: &Gizmo,
        middle: Pos2,
        hovered: &mut Option<Part>,
    ) {
        let away = (gizmo.points * SIZE_AT) as f32;
        let mut at = middle + vec2(away, -away);
        if let Some(grip) = meshes.grip.as_ref().filter(|grip| grip.part == Part::Size) {
            at = middle + (at - middle) * (gizmo.scale / grip.start.scale) as f32;
        }
        let response = self.handle(at, &format!("Size of {}", mesh.name));
        self.grab(meshes, &response, mesh, Part::Size, gizmo);
        if let Some((grip, pointer)) = dragged(meshes, &response, mesh, Part::Size) {
            let (start, centre) = (grip.start, point(middle));
            let factor = pointer.distance(centre) / grip.pressed.distance(centre).max(1.0);
            let [least, most] = SCALES;
            let scale = f64::from((start.scale * factor).clamp(least, most) as f32);
            self.edit(mesh, "scale", Raw::Float(scale));
            self.edit(mesh, "position", raw(start.position_with(start.turn, scale)));
        }
        let bright = self.mark(&response, Part::Size, hovered);
        let half = if bright { 7.0 } else { 6.0 };
        let square = Rect::from_center_size(at, vec2(half, half) * 2.0);
        let line = Stroke::new(1.5, Color32::from_white_alpha(150));
        self.painter.line_segment([middle + (at - middle) * 0.12, at], line);
        self.painter.rect_filled(square.expand(1.5), 2.0, Color32::from_black_alpha(170));
        self.painter.rect_filled(square, 1.0, Color32::WHITE);
    }

    /// Writes the numbers of a handle beside it.
    fn numbers(&self, mesh: &SceneMesh, gizmo: &Gizmo, part: Part) {
        let at = self.ui.input(|i| i.pointer.hover_pos()).unwrap_or(self.image.center());
        let [x, y, z] = gizmo.position.to_array();
        let text = match part {
            Part::Middle => {
                let deep = self.view.project(gizmo.middle).1;
                format!("{}: {x:.2}, {y:.2}, {z:.2} m, {deep:.2} m deep", mesh.name)
            }
            Part::Axis(i) => format!("{}: {} {:.2} m", mesh.name, AXES[i], gizmo.position[i]),
            Part::Ring(i) => format!("{}: turn {} {:.1}°", mesh.name, AXES[i], gizmo.turn[i]),
            Part::Size => {
                let [low, high] = mesh.loaded.bounds().unwrap_or_default();
                let [x, y, z] = ((high - low) * gizmo.scale).to_array();
                format!("{}: scale {:.3}, {x:.2} × {y:.2} × {z:.2} m", mesh.name, gizmo.scale)
            }
        };
        self.caption(at + vec2(6.0, 18.0), &text);
    }

    /// Begins a drag of a handle, and ends the last one.
    fn grab(&self, meshes: &mut Meshes, response: &Response, mesh: &SceneMesh, part: Part, gizmo: &Gizmo) {
        if response.drag_stopped() {
            meshes.grip = None;
        }
        if response.drag_started_by(egui::PointerButton::Primary)
            && let Some(pointer) = response.interact_pointer_pos()
        {
            meshes.grip = Some(Grip {
                mesh: mesh.name.clone(),
                part,
                start: *gizmo,
                pressed: self.pressed_at(point(pointer)),
                angle: 0.0,
                swept: 0.0,
                plane: None,
            });
        }
    }

    fn edit(&mut self, mesh: &SceneMesh, what: &str, raw: Raw) {
        self.done.edits.push((format!("meshes.{}.{what}", mesh.name), raw));
    }

    /// Records the handle under the pointer. Returns whether it is this one.
    fn mark(&self, response: &Response, part: Part, hovered: &mut Option<Part>) -> bool {
        let bright = response.hovered() || response.dragged();
        if bright {
            *hovered = Some(part);
        }
        bright
    }

    /// Draws a ring, its far half faint.
    fn draw_ring(&self, gizmo: &Gizmo, i: usize, points: &[Option<DVec2>], color: Color32) {
        let depth = self.view.project(gizmo.middle).1;
        for (k, pair) in points.windows(2).enumerate() {
            let (Some(a), Some(b)) = (pair[0], pair[1]) else { continue };
            let angle = TAU * (k as f64 + 0.5) / PIECES as f64;
            let is_far = self.view.project(gizmo.on_ring(i, angle)).1 > depth;
            let line = [at_point(a), at_point(b)];
            if !is_far {
                self.painter.line_segment(line, Stroke::new(4.0, Color32::from_black_alpha(120)));
            }
            let (width, color) = if is_far { (1.0, color.gamma_multiply(0.45)) } else { (2.0, color) };
            self.painter.line_segment(line, Stroke::new(width, color));
        }
    }
}

/// Whether a handle is being dragged.
fn holds(meshes: &Meshes, mesh: &SceneMesh, part: Part) -> bool {
    meshes.grip.as_ref().is_some_and(|grip| grip.mesh == mesh.name && grip.part == part)
}

/// The grip of a handle that is dragged in this frame, and the position of the pointer, points.
fn dragged<'a>(
    meshes: &'a mut Meshes,
    response: &Response,
    mesh: &SceneMesh,
    part: Part,
) -> Option<(&'a mut Grip, DVec2)> {
    if !response.dragged_by(egui::PointerButton::Primary) || !holds(meshes, mesh, part) {
        return None;
    }
    Some((meshes.grip.as_mut()?, point(response.interact_pointer_pos()?)))
}

/// Distance of a point from a line between two points.
fn to_segment(point: DVec2, a: DVec2, b: DVec2) -> f64 {
    let d = b - a;
    let t = ((point - a).dot(d) / d.length_squared().max(1e-12)).clamp(0.0, 1.0);
    point.distance(a + d * t)
}
