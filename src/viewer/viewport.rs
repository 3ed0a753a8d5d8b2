//! The picture in the window, in which the user moves camera and lights and picks pixels.

use eframe::egui;
use egui::{Align2, Color32, FontId, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2, pos2, vec2};

use super::lights::{self, Lights};
use super::meshes::{self, Meshes};
use super::navigate::{self, Pose};
use super::parameters::name;
use crate::scene::{Raw, SceneMesh, Values};

/// Tool that a drag in the picture uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Turns the camera around its target.
    #[default]
    Orbit,
    /// Moves the camera parallel to the image.
    Pan,
    /// Turns a light. Shows the handles of all lights.
    Light,
    /// Shows the ray under the pointer.
    Inspect,
}

impl Tool {
    /// All tools in the order of the toolbar, each with name, key and tooltip.
    pub const ALL: [(Tool, &'static str, egui::Key, &'static str); 4] = [
        (
            Tool::Orbit,
            "Orbit",
            egui::Key::O,
            "Drag to turn the camera around its target; drag with Shift or the right button to pan",
        ),
        (Tool::Pan, "Pan", egui::Key::P, "Drag to move the camera parallel to the image"),
        (
            Tool::Light,
            "Light",
            egui::Key::L,
            "Drag to turn the selected light, or drag the handle of a light (Ctrl and drag with any tool)",
        ),
        (Tool::Inspect, "Inspect", egui::Key::I, "Click or drag to see the ray of a pixel, cell by cell"),
    ];
}

/// The user's actions in the picture.
#[derive(Debug, Default)]
pub struct Actions {
    /// New pose of the camera.
    pub pose: Option<Pose>,
    /// Lights that were turned or moved: keys and new values.
    pub lights: Vec<(String, Raw)>,
    /// Meshes that were moved, turned or sized: keys and new values.
    pub meshes: Vec<(String, Raw)>,
    /// Whether a click beside all handles deselects what is selected.
    pub deselect: bool,
    /// Position in the image (0 to 1) whose ray is to be inspected.
    pub inspect: Option<[f32; 2]>,
    /// Position in the image (0 to 1) on which the camera is to focus.
    pub focus: Option<[f32; 2]>,
}

/// Contents of the viewport.
pub struct Content<'a> {
    /// The picture, once there is one.
    pub texture: Option<&'a egui::TextureHandle>,
    /// Aspect of the picture and of the scene's image: width divided by height.
    pub aspect: f32,
    /// Position of the inspected pixel, 0 to 1.
    pub marked: Option<[f32; 2]>,
    /// The selected tool.
    pub tool: Tool,
    /// Pose of the camera.
    pub pose: Pose,
    /// The scene's meshes that are not hidden.
    pub meshes: &'a [SceneMesh],
}

/// What is selected, and has handles.
pub struct Selection<'a> {
    /// The lights.
    pub lights: &'a mut Lights,
    /// The meshes.
    pub meshes: &'a mut Meshes,
}

/// Largest rectangle of an aspect inside `outer`, on whole pixels.
pub fn fit(outer: Rect, aspect: f32, pixels_per_point: f32) -> Rect {
    let (w, h) = (outer.width().max(0.0), outer.height().max(0.0));
    let size = if w / h.max(1e-6) > aspect { vec2(h * aspect, h) } else { vec2(w, w / aspect) };
    let whole = |x: f32| (x * pixels_per_point).round() / pixels_per_point;
    let size = vec2(whole(size.x), whole(size.y));
    let corner = outer.center() - size * 0.5;
    Rect::from_min_size(pos2(whole(corner.x), whole(corner.y)), size)
}

/// Shows the picture. Returns its rectangle and the user's actions in it.
pub fn show(ui: &mut Ui, content: &Content, values: &Values, selection: Selection) -> (Rect, Actions) {
    let Selection { lights, meshes } = selection;
    let outer = ui.available_rect_before_wrap();
    let image = fit(outer, content.aspect, ui.ctx().pixels_per_point());
    let response = ui.allocate_rect(outer, Sense::click_and_drag());
    name(&response, "Picture");
    draw(ui, content, outer, image);

    let mut actions = Actions::default();
    let (modifiers, scroll, pinch) = ui.input(|i| (i.modifiers, i.smooth_scroll_delta().y, i.zoom_delta()));
    let pose = content.pose;
    if response.dragged() && response.drag_delta() != Vec2::ZERO {
        drag(&response, image, modifiers, content, (values, lights), &mut actions);
    }
    let turning = modifiers.command && response.dragged();
    let view = (values, pose);
    let of_lights = lights::show_handles(ui, image, view, lights, (content.tool == Tool::Light, turning));
    actions.lights.extend(of_lights.edits);
    let of_mesh = meshes::show_handles(ui, image, view, content.meshes, meshes);
    actions.meshes = of_mesh.edits;
    if response.hovered() || of_lights.hovered || of_mesh.hovered {
        let factor = f64::from(scroll * -0.002).exp() / f64::from(pinch);
        if (factor - 1.0).abs() > 1e-6 {
            actions.pose = Some(actions.pose.unwrap_or(pose).zoom(factor));
        }
    }
    if response.hovered() {
        let cursor = match content.tool {
            Tool::Inspect => egui::CursorIcon::Crosshair,
            _ if response.dragged() => egui::CursorIcon::Grabbing,
            _ => egui::CursorIcon::Grab,
        };
        ui.ctx().set_cursor_icon(cursor);
    }
    actions.deselect = response.clicked();
    if let Some(at) = response.interact_pointer_pos().and_then(|at| position_in(image, at)) {
        if response.double_clicked() {
            actions.focus = Some(at);
        } else if response.clicked() {
            actions.inspect = Some(at);
        }
    }
    (image, actions)
}

/// Draws the picture, its surround, and the mark of the inspected pixel.
fn draw(ui: &Ui, content: &Content, outer: Rect, image: Rect) {
    let painter = ui.painter_at(outer);
    // A neutral surround of medium brightness: a bright one makes the picture look dark.
    let ground = if ui.visuals().dark_mode { Color32::from_gray(22) } else { Color32::from_gray(176) };
    painter.rect_filled(outer, 0.0, ground);
    match content.texture {
        Some(texture) => {
            let uv = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            painter.image(texture.id(), image, uv, Color32::WHITE);
        }
        None => {
            let text = "Rendering the first picture …";
            let font = FontId::proportional(16.0);
            painter.text(outer.center(), Align2::CENTER_CENTER, text, font, ui.visuals().weak_text_color());
        }
    }
    if let Some([x, y]) = content.marked {
        mark(&painter, image, image.min + image.size() * vec2(x, y));
    }
}

/// Turns a drag in the picture into actions, by the modifiers and the selected tool.
fn drag(
    response: &Response,
    image: Rect,
    modifiers: egui::Modifiers,
    content: &Content,
    (values, lights): (&Values, &Lights),
    actions: &mut Actions,
) {
    let (dx, dy) = (f64::from(response.drag_delta().x), f64::from(response.drag_delta().y));
    let primary = response.dragged_by(egui::PointerButton::Primary);
    let tool = match () {
        _ if !primary || modifiers.shift => Tool::Pan,
        _ if modifiers.command => Tool::Light,
        _ => content.tool,
    };
    let pose = content.pose;
    let height = f64::from(image.height().max(1.0));
    // A drag over the image's height makes half a turn.
    let turn = std::f64::consts::PI / height;
    match tool {
        Tool::Orbit => actions.pose = Some(pose.orbit(-dx * turn, dy * turn)),
        Tool::Pan => actions.pose = Some(pose.pan(-dx / height, dy / height)),
        Tool::Light => {
            actions.lights.extend(lights::turned(values, lights.selected()).map(|light| {
                let key = format!("lights.{light}.direction");
                let direction = values.point(&key);
                let turned = navigate::turn_light(direction, &pose, dx * turn, -dy * turn);
                (key, navigate::raw(turned))
            }));
        }
        Tool::Inspect => {
            actions.inspect = response.interact_pointer_pos().and_then(|at| position_in(image, at));
        }
    }
}

/// Position of a point of the window in the image, 0 to 1. `None` outside the image.
fn position_in(image: Rect, at: Pos2) -> Option<[f32; 2]> {
    let p = (at - image.min) / image.size().max(Vec2::splat(1.0));
    ((0.0..1.0).contains(&p.x) && (0.0..1.0).contains(&p.y)).then_some([p.x, p.y])
}

/// Draws a cross that is visible on bright water and on dark rock.
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
