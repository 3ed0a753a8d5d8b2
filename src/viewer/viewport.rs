//! The picture in the window: camera and light moved by hand in it, pixels picked from it.

use eframe::egui;
use egui::{Align2, Color32, FontId, Pos2, Rect, Sense, Stroke, Ui, Vec2, pos2, vec2};

use super::lights::{self, Lights};
use super::navigate::{self, Pose};
use super::parameters::name;
use crate::scene::{Raw, Values};

/// What dragging in the picture does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Turns the camera around its target.
    #[default]
    Orbit,
    /// Moves the camera along the image.
    Pan,
    /// Turns a light; shows the handles of all.
    Light,
    /// Shows the ray under the pointer.
    Inspect,
}

impl Tool {
    /// All, in the order of the toolbar, with their keys.
    pub const ALL: [(Tool, &'static str, egui::Key, &'static str); 4] = [
        (Tool::Orbit, "Orbit", egui::Key::O, "Drag to turn the camera; Shift or the right button pans"),
        (Tool::Pan, "Pan", egui::Key::P, "Drag to move the camera along the image"),
        (
            Tool::Light,
            "Light",
            egui::Key::L,
            "Drag to turn the selected light, or a light's handle (or Ctrl and drag)",
        ),
        (Tool::Inspect, "Inspect", egui::Key::I, "Click or drag to see the ray of a pixel, cell by cell"),
    ];
}

/// What was done in the picture.
#[derive(Debug, Default)]
pub struct Actions {
    /// The camera was moved to here.
    pub pose: Option<Pose>,
    /// Lights were turned or moved: keys and new values.
    pub lights: Vec<(String, Raw)>,
    /// Where in the image (0 to 1) a ray is asked for.
    pub inspect: Option<[f32; 2]>,
    /// Where in the image the camera is to focus.
    pub focus: Option<[f32; 2]>,
}

/// What is drawn.
pub struct Shown<'a> {
    /// The picture, if there is one.
    pub texture: Option<&'a egui::TextureHandle>,
    /// Its aspect, and that of the scene's image.
    pub aspect: f32,
    /// The pixel that is inspected, 0 to 1.
    pub marked: Option<[f32; 2]>,
    /// The tool in hand.
    pub tool: Tool,
}

/// The largest rectangle of an aspect inside another, on whole pixels.
pub fn fit(outer: Rect, aspect: f32, pixels_per_point: f32) -> Rect {
    let (w, h) = (outer.width().max(0.0), outer.height().max(0.0));
    let size = if w / h.max(1e-6) > aspect { vec2(h * aspect, h) } else { vec2(w, w / aspect) };
    let whole = |x: f32| (x * pixels_per_point).round() / pixels_per_point;
    let size = vec2(whole(size.x), whole(size.y));
    let corner = outer.center() - size * 0.5;
    Rect::from_min_size(pos2(whole(corner.x), whole(corner.y)), size)
}

/// Shows the picture; what was done in it.
pub fn show(ui: &mut Ui, shown: &Shown, values: &Values, lights: &mut Lights) -> (Rect, Actions) {
    let outer = ui.available_rect_before_wrap();
    let image = fit(outer, shown.aspect, ui.ctx().pixels_per_point());
    let response = ui.allocate_rect(outer, Sense::click_and_drag());
    name(&response, "Picture");
    let painter = ui.painter_at(outer);
    // Neutral and of middling brightness: a bright surround makes the picture look dark.
    let ground = if ui.visuals().dark_mode { Color32::from_gray(22) } else { Color32::from_gray(176) };
    painter.rect_filled(outer, 0.0, ground);
    match shown.texture {
        Some(texture) => {
            let uv = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            painter.image(texture.id(), image, uv, Color32::WHITE);
        }
        None => {
            let text = "The first picture is coming …";
            let font = FontId::proportional(16.0);
            painter.text(outer.center(), Align2::CENTER_CENTER, text, font, ui.visuals().weak_text_color());
        }
    }
    if let Some([x, y]) = shown.marked {
        mark(&painter, image, image.min + image.size() * vec2(x, y));
    }

    let mut actions = Actions::default();
    let place = |at: Pos2| {
        let p = (at - image.min) / image.size().max(Vec2::splat(1.0));
        ((0.0..1.0).contains(&p.x) && (0.0..1.0).contains(&p.y)).then_some([p.x, p.y])
    };
    let (modifiers, scroll, pinch) = ui.input(|i| (i.modifiers, i.smooth_scroll_delta().y, i.zoom_delta()));
    let pose = Pose::of(values);
    let height = f64::from(image.height().max(1.0));
    let drag = response.drag_delta();
    if response.dragged() && drag != Vec2::ZERO {
        let (dx, dy) = (f64::from(drag.x), f64::from(drag.y));
        let primary = response.dragged_by(egui::PointerButton::Primary);
        let tool = match () {
            _ if !primary || modifiers.shift => Tool::Pan,
            _ if modifiers.command => Tool::Light,
            _ => shown.tool,
        };
        // A drag over the image's height turns half way round.
        let turn = std::f64::consts::PI / height;
        match tool {
            Tool::Orbit => actions.pose = Some(pose.orbit(-dx * turn, dy * turn)),
            Tool::Pan => actions.pose = Some(pose.pan(-dx / height, dy / height)),
            Tool::Light => {
                actions.lights.extend(lights::turned(values, lights.selected()).map(|light| {
                    let key = format!("lights.{light}.direction");
                    let direction = values.triple(&key).as_dvec3();
                    let turned = navigate::turn_light(direction, &pose, dx * turn, -dy * turn);
                    (key, navigate::raw(turned))
                }));
            }
            Tool::Inspect => {
                actions.inspect = response.interact_pointer_pos().and_then(place);
            }
        }
    }
    let turning = modifiers.command && response.dragged();
    let handles = lights::show_handles(ui, image, values, lights, (shown.tool == Tool::Light, turning));
    actions.lights.extend(handles.edits);
    if response.hovered() || handles.hovered {
        let factor = f64::from(scroll * -0.002).exp() / f64::from(pinch);
        if (factor - 1.0).abs() > 1e-6 {
            actions.pose = Some(actions.pose.unwrap_or(pose).zoom(factor));
        }
    }
    if response.hovered() {
        let cursor = match shown.tool {
            Tool::Inspect => egui::CursorIcon::Crosshair,
            _ if response.dragged() => egui::CursorIcon::Grabbing,
            _ => egui::CursorIcon::Grab,
        };
        ui.ctx().set_cursor_icon(cursor);
    }
    if let Some(at) = response.interact_pointer_pos().and_then(place) {
        if response.double_clicked() {
            actions.focus = Some(at);
        } else if response.clicked() {
            actions.inspect = Some(at);
        }
    }
    (image, actions)
}

/// A cross that is seen on bright water and on dark rock.
fn mark(painter: &egui::Painter, image: Rect, at: Pos2) {
    let painter = painter.with_clip_rect(image);
    for (width, color) in [(3.0, Color32::from_black_alpha(160)), (1.0, Color32::WHITE)] {
        let stroke = Stroke::new(width, color);
        for d in [vec2(1.0, 0.0), vec2(-1.0, 0.0), vec2(0.0, 1.0), vec2(0.0, -1.0)] {
            painter.line_segment([at + d * 4.0, at + d * 12.0], stroke);
        }
        painter.circle_stroke(at, 4.0, stroke);
    }
}
