//! Handles over the picture, with which lights are moved and turned.

use eframe::egui;
use egui::{Align2, Color32, FontId, Pos2, Rect, Sense, Stroke, Ui, vec2};
use glam::{DVec2, DVec3};

use super::{Lights, edit, shines, turned};
use crate::scene::Values;
use crate::viewer::canvas::{self, Canvas, Drawn};
use crate::viewer::navigate::{Pose, angles, direction, raw};
use crate::viewer::parameters::name as label;

/// Radius of the dial in a large picture, points.
const DIAL_RADIUS: f32 = 46.0;
/// A handle being dragged: the light and its part.
pub(super) type Grip = canvas::Grip<(String, Part)>;

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Part {
    /// The light itself.
    Light,
    /// The point at which a spot light is aimed.
    Aim,
}

/// Shows the handles of the selected light. With `tool`, the Light tool, shows those of all lights. With
/// `turning`, a light being turned by a drag, shows that light's dial.
pub fn show(
    ui: &Ui,
    image: Rect,
    (values, pose): (&Values, Pose),
    lights: &mut Lights,
    (tool, turning): (bool, bool),
) -> Drawn {
    let mut canvas = Canvas::new(ui, image, values, pose);
    for light in values.names("lights") {
        let selected = lights.selected() == Some(light.as_str());
        let kind = values.text(&format!("lights.{light}.kind"));
        if (selected || tool) && edit::takes(&kind, "position") {
            canvas.light(lights, &light, selected);
            if selected && kind == "spot" {
                canvas.aim(lights, &light);
            }
        }
    }
    let is_directional = |light: &String| values.text(&format!("lights.{light}.kind")) == "directional";
    let by_drag = turned(values, lights.selected()).filter(is_directional);
    // While a drag would turn a spot light, the Light tool still shows the dial of a directional one.
    let dial = by_drag.or_else(|| turned(values, None).filter(|_| tool));
    if let Some(light) = dial.filter(|light| tool || turning || lights.selected() == Some(light)) {
        canvas.dial(&light);
    }
    canvas.done
}

impl Canvas<'_> {
    /// The handle of the light itself, which is dragged parallel to the image, or with Shift in depth.
    fn light(&mut self, lights: &mut Lights, light: &str, selected: bool) {
        let key = format!("lights.{light}.position");
        let position = self.values.point(&key);
        let (visible, at) = self.handle_position(position);
        let response = self.handle(at, &format!("Handle of {light}"));
        if response.clicked() || response.drag_started() {
            lights.select(Some(light));
        }
        if let Some(moved) = self.drag(&mut lights.grip, &response, (light.into(), Part::Light), position) {
            self.done.edits.push((key, raw(moved)));
        }
        let color = color_of(self.values, light);
        let alpha = if selected || response.hovered() { 1.0 } else { 0.7 };
        bulb(&self.painter, at, color.map(|c| c.gamma_multiply(alpha)), selected);
        if !visible {
            self.arrow_out(at);
        }
        let held = lights.grip.as_ref().is_some_and(|grip| grip.part == (light.to_owned(), Part::Light));
        if held || response.hovered() {
            let deep = self.view.project(position).1;
            let [x, y, z] = position.to_array();
            self.caption(at, &format!("{light}: {x:.2}, {y:.2}, {z:.2} m, {deep:.2} m deep"));
        } else if selected || self.ui.input(|i| i.modifiers.is_none()) {
            self.caption(at, light);
        }
    }

    /// The handle of the point at which a spot light is aimed, and the light's cone.
    fn aim(&mut self, lights: &mut Lights, light: &str) {
        let key = |what: &str| format!("lights.{light}.{what}");
        let position = self.values.point(&key("position"));
        let to_light = self.values.point(&key("direction")).normalize_or(DVec3::Y);
        let far = position.distance(self.pose.target).max(1e-3);
        let distance = *lights.aim_distance.get_or_insert(far);
        let aim = position - to_light * distance;
        let (_, at) = self.handle_position(aim);
        let color = color_of(self.values, light).unwrap_or(Color32::GRAY);
        self.cone(position, to_light, distance, light, color);
        let response = self.handle(at, &format!("Aim of {light}"));
        if let Some(moved) = self.drag(&mut lights.grip, &response, (light.into(), Part::Aim), aim) {
            let away = position - moved;
            // A spot light aimed at its own position keeps its direction.
            if away.length() > 1e-6 {
                lights.aim_distance = Some(away.length());
                self.done.edits.push((key("direction"), raw(away.normalize())));
            }
        }
        for (width, color) in [(3.5, Color32::from_black_alpha(170)), (1.5, color)] {
            let stroke = Stroke::new(width, color);
            self.painter.circle_stroke(at, 6.0, stroke);
            self.painter.line_segment([at - vec2(9.0, 0.0), at + vec2(9.0, 0.0)], stroke);
            self.painter.line_segment([at - vec2(0.0, 9.0), at + vec2(0.0, 9.0)], stroke);
        }
    }

    /// Draws a spot light's cone at a distance from the light: the circle where its light ends, the circle
    /// within which it is full, and four lines to the light.
    fn cone(&self, position: DVec3, to_light: DVec3, distance: f64, light: &str, color: Color32) {
        let number = |what: &str| f64::from(self.values.float(&format!("lights.{light}.{what}")));
        let (u, v) = to_light.any_orthonormal_pair();
        // The rim of a wider cone would be too far away to see.
        let radius = |angle: f64| distance * angle.min(80.0).to_radians().tan();
        let circle = |radius: f64, i: i32| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / 48.0).sin_cos();
            position - to_light * distance + (u * cos + v * sin) * radius
        };
        let line = |a: DVec3, b: DVec3, faint: f32| {
            self.line(a, b, Stroke::new(1.0, color.gamma_multiply(faint)));
        };
        let edge = radius(number("angle"));
        let full = radius(number("angle") * (1.0 - number("softness")));
        (0..48).for_each(|i| line(circle(edge, i), circle(edge, i + 1), 0.8));
        (0..48).for_each(|i| line(circle(full, i), circle(full, i + 1), 0.35));
        (0..48).step_by(12).for_each(|i| line(position, circle(edge, i), 0.8));
    }

    /// The dial on which a directional light is turned ([`View::dial_direction`]).
    fn dial(&mut self, light: &str) {
        let key = format!("lights.{light}.direction");
        let radius = DIAL_RADIUS.min(self.image.height() * 0.2).min(self.image.width() * 0.2);
        let centre = self.image.right_bottom() - vec2(radius + 12.0, radius + 26.0);
        let square = Rect::from_center_size(centre, vec2(radius, radius) * 2.0);
        let id = self.ui.scope_id().with(("light dial", light));
        let response = self.ui.interact(square, id, Sense::click_and_drag());
        label(&response, &format!("Dial of {light}"));
        self.done.hovered |= response.hovered();
        let mut to_light = self.values.point(&key).normalize_or(DVec3::Y);
        if (response.dragged_by(egui::PointerButton::Primary) || response.clicked())
            && let Some(pointer) = response.interact_pointer_pos()
        {
            let d = (pointer - centre) / radius;
            to_light = self.view.dial_direction(DVec2::new(f64::from(d.x), f64::from(-d.y)));
            self.done.edits.push((key, raw(to_light)));
        }
        response.on_hover_cursor(egui::CursorIcon::Crosshair);

        self.draw_dial(light, centre, radius, to_light);
    }

    /// Draws the dial with its horizon, the other directional lights, and the light at its tip.
    fn draw_dial(&self, light: &str, centre: Pos2, radius: f32, to_light: DVec3) {
        let on_dial = |p: DVec2| centre + vec2(p.x as f32, -p.y as f32) * radius;
        let square = Rect::from_center_size(centre, vec2(radius, radius) * 2.0);
        let painter = &self.painter;
        let ground = square.expand(6.0).union(square.translate(vec2(0.0, 20.0)));
        painter.rect_filled(ground, 8.0, Color32::from_black_alpha(120));
        painter.circle(
            centre,
            radius,
            Color32::from_black_alpha(120),
            Stroke::new(1.0, Color32::from_gray(170)),
        );
        let front = Color32::from_white_alpha(22);
        painter.circle(centre, radius * 0.5, front, Stroke::new(1.0, Color32::from_gray(110)));
        let horizon = (0..=90).map(|i| on_dial(self.view.dial_place(direction([f64::from(i) * 4.0, 0.0]))));
        let horizon: Vec<Pos2> = horizon.collect();
        for pair in horizon.windows(2).filter(|pair| pair[0].distance(pair[1]) < radius * 0.5) {
            painter.line_segment([pair[0], pair[1]], Stroke::new(1.0, Color32::from_rgb(120, 150, 180)));
        }
        for other in self.values.names("lights") {
            let key = |what: &str| format!("lights.{other}.{what}");
            if other != light && self.values.text(&key("kind")) == "directional" {
                let d = self.values.point(&key("direction")).normalize_or(DVec3::Y);
                painter.circle_filled(on_dial(self.view.dial_place(d)), 2.5, Color32::from_gray(160));
            }
        }
        let tip = on_dial(self.view.dial_place(to_light));
        let color = color_of(self.values, light);
        for (width, color) in [(3.5, Color32::from_black_alpha(170)), (1.5, color.unwrap_or(Color32::GRAY))] {
            painter.line_segment([centre, tip], Stroke::new(width, color));
        }
        bulb(painter, tip, color, true);
        let [azimuth, elevation] = angles(to_light);
        let side = if elevation < 0.0 { "down" } else { "up" };
        let text = format!("{light}: {azimuth:.0}°, {:.0}° {side}", elevation.abs());
        let below = centre + vec2(0.0, radius + 4.0);
        painter.text(below, Align2::CENTER_TOP, text, FontId::proportional(12.0), Color32::WHITE);
    }
}

/// A light's colour at full brightness. `None` if the light does not shine.
fn color_of(values: &Values, light: &str) -> Option<Color32> {
    let rgb = values.triple(&format!("lights.{light}.color"));
    let full = rgb.max_element();
    shines(values, light).then(|| {
        let [r, g, b] = (rgb / full).to_array();
        egui::Rgba::from_rgb(r, g, b).into()
    })
}

/// Draws a small lamp, visible on bright water and on dark rock.
fn bulb(painter: &egui::Painter, at: Pos2, color: Option<Color32>, selected: bool) {
    let dark = Color32::from_black_alpha(170);
    if selected {
        for (width, color) in [(3.5, dark), (1.5, Color32::WHITE)] {
            painter.circle_stroke(at, 8.0, Stroke::new(width, color));
        }
    }
    match color {
        Some(color) => painter.circle(at, 5.0, color, Stroke::new(1.5, dark)),
        None => painter.circle(at, 5.0, Color32::from_black_alpha(90), Stroke::new(1.5, Color32::GRAY)),
    };
}
