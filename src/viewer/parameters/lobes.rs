//! The polar plot of the scattering lobes, in a fold of its own.

use std::f64::consts::{PI, TAU};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use eframe::egui;
use egui::{Color32, RichText, Sense, Shape, Stroke, Ui, Vec2};
use egui_plot::{Arrows, HoverPosition, Line, LineStyle, Plot, PlotPoint, PlotPoints, PlotUi, Text};

use super::name;
use crate::light::Reflection;
use crate::scene::{Scene, Values};
use crate::viewer::lobes::{Curve, Plane, STEPS, Scale, Setting, alpha, curves, incidence};

/// Largest width of the plot, points.
const MAX_WIDTH: f32 = 380.0;
/// Half the side of the plot in radii of its rim. It leaves room for the light's arrow and the angles.
const EXTENT: f64 = 1.24;
/// Angle on both sides of the light that is kept free of labels, radians: the light's arrow and name are
/// there.
const ARROW_ROOM: f64 = 0.35;

/// The plot, its curves, and the setting that they were computed for.
#[derive(Default)]
pub(super) struct LobesPlot {
    plane: Plane,
    shown: Option<(Setting, Vec<Curve>)>,
    /// The curves that a thread is computing.
    computing: Option<(Setting, Receiver<Vec<Curve>>)>,
}

/// How a curve is drawn.
struct Pen {
    colour: Color32,
    style: LineStyle,
    width: f32,
}

impl Pen {
    /// The pen of a curve, by the curve's name.
    fn of(curve: &str, visuals: &egui::Visuals) -> Pen {
        let pen = |dark: [u8; 3], light: [u8; 3], style: LineStyle| {
            let [r, g, b] = if visuals.dark_mode { dark } else { light };
            // A dot's radius is the width.
            let width = if matches!(style, LineStyle::Dotted { .. }) { 1.2 } else { 1.8 };
            Pen { colour: Color32::from_rgb(r, g, b), style, width }
        };
        match curve {
            "R" | "specular" => pen([110, 175, 255], [25, 90, 200], LineStyle::Solid),
            "TT" | "diffuse" => pen([255, 165, 80], [195, 85, 0], LineStyle::Dashed { length: 9.0 }),
            "TRT" => pen([110, 215, 130], [15, 125, 45], LineStyle::Dashed { length: 4.0 }),
            "rest" => pen([220, 150, 230], [140, 50, 155], LineStyle::Dotted { spacing: 9.0 }),
            "aerated" => pen([120, 215, 215], [0, 120, 130], LineStyle::Dotted { spacing: 5.0 }),
            _ => Pen { colour: visuals.strong_text_color(), style: LineStyle::Solid, width: 1.2 },
        }
    }
}

impl LobesPlot {
    /// Shows the fold with the plot. Nothing is computed while it is closed.
    pub fn show(&mut self, ui: &mut Ui, scene: &Scene, values: &Values, selected: Option<&str>) {
        let fold = egui::CollapsingHeader::new("Lobes").id_salt("lobes");
        let fold = fold.show_unindented(ui, |ui| self.body(ui, scene, values, selected));
        fold.header_response.on_hover_text("How a cell of water distributes light over directions");
    }

    fn body(&mut self, ui: &mut Ui, scene: &Scene, values: &Values, selected: Option<&str>) {
        let Some(incidence) = incidence(scene, values, selected) else {
            ui.weak("No light to reflect.");
            return;
        };
        ui.horizontal_wrapped(|ui| {
            let around = ui.selectable_value(&mut self.plane, Plane::Around, "around the strand");
            around.on_hover_text("The eye moves around the strand, on the cone of mirror reflection");
            let along = ui.selectable_value(&mut self.plane, Plane::Along, "along it");
            along.on_hover_text("The eye stays in the plane of strand and light");
        });
        self.update(ui.ctx(), Setting::new(scene, incidence.theta_i, self.plane));
        let Some((setting, curves)) = &self.shown else {
            ui.horizontal(|ui| {
                ui.spinner();
                ui.label("Computing the lobes");
            });
            return;
        };
        let theta_i = degrees(setting.theta_i, 1);
        let model = match setting.reflection {
            Reflection::KajiyaKay => "Fibre of Kajiya and Kay, Ψ/π",
            Reflection::Strand(_) => "Strand of water with air bubbles, Φ",
            Reflection::Hair(_) => "Hair, Φ",
        };
        ui.label(format!("θ_i = {theta_i} of {}", incidence.light)).on_hover_text(
            "Inclination of the light to the plane across the flow. The flow is v at the middle of the first \
             quad. Select a light to see its lobes.",
        );
        legend(ui, curves);
        let scale = Scale::new(curves);
        plot(ui, setting, curves, scale);
        let angle = match setting.plane {
            Plane::Around => format!("over φ at θ_o = {}", degrees(-setting.theta_i, 1)),
            Plane::Along => "over θ_o, with φ = 0 on the left, φ = π on the right, and the flow down".into(),
        };
        let caption = format!(
            "{model}, {angle}, of a cell with k_d = {} and k_s = {}. The radius is the luminance in 1/sr on \
             a logarithmic scale, from {} or less in the middle to the largest value at the rim.",
            setting.k_d,
            setting.k_s,
            power_of_ten(scale.middle)
        );
        ui.weak(caption);
    }

    /// Takes curves that are ready, and starts computing those of `setting` if they are not shown.
    fn update(&mut self, ctx: &egui::Context, setting: Setting) {
        if let Some((computed, answer)) = &self.computing {
            match answer.try_recv() {
                Ok(curves) => self.shown = Some((*computed, curves)),
                Err(TryRecvError::Empty) => return,
                // The thread could not start.
                Err(TryRecvError::Disconnected) => self.shown = Some((*computed, Vec::new())),
            }
            self.computing = None;
        }
        if self.shown.as_ref().is_some_and(|(shown, _)| *shown == setting) {
            return;
        }
        let (send, answer) = channel();
        let ctx = ctx.clone();
        let compute = move || {
            // Sending fails if the panel is gone.
            let _ = send.send(curves(&setting));
            ctx.request_repaint();
        };
        // On a thread of its own: the strand's energy balance waits for the thread pool, which may be busy
        // rendering.
        let _ = std::thread::Builder::new().name("lobes".into()).spawn(compute);
        self.computing = Some((setting, answer));
    }
}

/// Shows the names of the curves, each with a piece of its line.
fn legend(ui: &mut Ui, curves: &[Curve]) {
    ui.horizontal_wrapped(|ui| {
        for curve in curves {
            let peak = curve.peak();
            let tip = format!("{}\nat most {}", curve.doc, per_steradian(peak));
            // Piece and name are one widget, so that no line break separates them.
            let galley = egui::WidgetText::from(curve.name).into_galley(
                ui,
                Some(egui::TextWrapMode::Extend),
                f32::INFINITY,
                egui::TextStyle::Body,
            );
            let (piece, gap) = (22.0, 5.0);
            let size = Vec2::new(piece + gap + galley.size().x, galley.size().y);
            let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, curve.name));
            name(&response, curve.name);
            let pen = Pen::of(curve.name, ui.visuals());
            let ends = [rect.left_center(), rect.left_center() + Vec2::new(piece, 0.0)];
            let stroke = Stroke::new(pen.width, pen.colour);
            match pen.style {
                LineStyle::Solid => drop(ui.painter().line_segment(ends, stroke)),
                LineStyle::Dashed { length } => {
                    ui.painter().extend(Shape::dashed_line(&ends, stroke, length, 0.618 * length));
                }
                LineStyle::Dotted { spacing } => {
                    ui.painter().extend(Shape::dotted_line(&ends, pen.colour, spacing, pen.width));
                }
            }
            let at = rect.right_center() - Vec2::new(galley.size().x, 0.5 * galley.size().y);
            ui.painter().galley(at, galley, ui.visuals().text_color());
            response.on_hover_text(tip);
        }
    });
}

/// Position of a direction in the plot. The light comes from the left, and the flow goes down.
fn plot_position(plane: Plane, alpha: f64, radius: f64) -> [f64; 2] {
    let up = if plane == Plane::Along { -1.0 } else { 1.0 };
    [-radius * alpha.cos(), up * radius * alpha.sin()]
}

fn plot(ui: &mut Ui, setting: &Setting, curves: &[Curve], scale: Scale) {
    let width = ui.available_width().min(MAX_WIDTH);
    let shown: Vec<(&str, Pen, Vec<[f64; 2]>)> = curves
        .iter()
        .map(|curve| {
            let at = |i: usize| plot_position(setting.plane, alpha(i), scale.radius(curve.values[i % STEPS]));
            (curve.name, Pen::of(curve.name, ui.visuals()), (0..=STEPS).map(at).collect())
        })
        .collect();
    let values: Vec<(&str, Vec<f64>)> = curves.iter().map(|c| (c.name, c.values.clone())).collect();
    let (setting, faint, text) = (*setting, ui.visuals().weak_text_color(), ui.visuals().text_color());
    let plot = Plot::new("lobes plot").width(width).height(width).data_aspect(1.0).show_axes(false);
    let plot = plot.show_grid(false).allow_zoom(false).allow_drag(false).allow_scroll(false);
    let plot = plot.allow_boxed_zoom(false).allow_double_click_reset(false).show_crosshair(false);
    let plot = plot.set_margin_fraction(Vec2::ZERO);
    let plot = plot.default_x_bounds(-EXTENT, EXTENT).default_y_bounds(-EXTENT, EXTENT);
    let plot = plot.label_formatter(move |at| {
        let HoverPosition::NearDataPoint { plot_name, index, .. } = at else { return None };
        let (_, values) = values.iter().find(|(name, _)| name == plot_name)?;
        let (theta_o, phi) = setting.plane.direction(setting.theta_i, alpha(*index));
        let [theta_o, phi] = [theta_o, phi].map(|angle| degrees(angle, 0));
        let value = per_steradian(values[index % STEPS]);
        Some(format!("{plot_name}\nφ = {phi}, θ_o = {theta_o}\n{value}"))
    });
    plot.show(ui, move |plot| {
        rings(plot, scale, faint);
        frame(plot, &setting, faint, text);
        for (name, pen, points) in shown {
            let line = Line::new(name, PlotPoints::new(points)).style(pen.style);
            plot.line(line.color(pen.colour).width(pen.width));
        }
    });
}

/// Draws a labelled ring for each power of ten.
fn rings(plot: &mut PlotUi<'_>, scale: Scale, faint: Color32) {
    let ring = |plot: &mut PlotUi<'_>, name: &str, radius: f64, strength: f32| {
        let circle = (0..=90).map(|i| (f64::from(i) / 90.0 * TAU).sin_cos());
        let circle: Vec<[f64; 2]> = circle.map(|(sin, cos)| [radius * cos, radius * sin]).collect();
        let circle = Line::new(name, PlotPoints::new(circle)).allow_hover(false);
        plot.line(circle.color(faint.gamma_multiply(strength)).width(1.0));
    };
    ring(plot, "rim", 1.0, 0.8);
    for (power, radius) in scale.rings() {
        ring(plot, &format!("ring {power}"), radius, 0.4);
        // Labels lie between two spokes, on the side of the light: the strong lobes are on the other side.
        let (sin, cos) = (0.625 * PI).sin_cos();
        let label = RichText::new(power_of_ten(power)).size(10.0);
        let at = PlotPoint::new(radius * cos, radius * sin);
        plot.text(Text::new(format!("scale {power}"), at, label).color(faint).allow_hover(false));
    }
}

/// Draws spokes with their angles, and an arrow from the light.
fn frame(plot: &mut PlotUi<'_>, setting: &Setting, faint: Color32, text: Color32) {
    let plane = setting.plane;
    let light = if plane == Plane::Around { 0.0 } else { setting.theta_i };
    for i in 0..12 {
        let a = alpha(i * STEPS / 12);
        let spoke = PlotPoints::new(vec![plot_position(plane, a, 0.0), plot_position(plane, a, 1.0)]);
        let spoke = Line::new(format!("spoke {i}"), spoke).allow_hover(false);
        plot.line(spoke.color(faint.gamma_multiply(0.25)).width(1.0));
        if (a - light).cos() > ARROW_ROOM.cos() {
            continue;
        }
        let (theta_o, phi) = plane.direction(setting.theta_i, a);
        let [x, y] = plot_position(plane, a, 1.12);
        let label = degrees(if plane == Plane::Around { phi } else { theta_o }, 0);
        let label = Text::new(format!("angle {i}"), PlotPoint::new(x, y), RichText::new(label).size(10.0));
        plot.text(label.color(faint).allow_hover(false));
    }
    let [from, to] = [1.22, 1.01].map(|r| PlotPoints::new(vec![plot_position(plane, light, r)]));
    plot.arrows(Arrows::new("light", from, to).color(text).allow_hover(false));
    let [x, y] = plot_position(plane, light + 0.5 * ARROW_ROOM, 1.14);
    let label = Text::new("light's name", PlotPoint::new(x, y), RichText::new("light").size(10.0));
    plot.text(label.color(text).allow_hover(false));
}

fn degrees(radians: f64, decimals: usize) -> String {
    // Adding 0 turns −0 into 0, so that no minus is written.
    let degrees = radians.to_degrees() + 0.0;
    format!("{degrees:.decimals$}°").replace('-', "−")
}

fn per_steradian(value: f64) -> String {
    match value {
        0.0 => "0".into(),
        0.01..1000.0 => format!("{value:.3} /sr"),
        _ => format!("{value:.2e} /sr"),
    }
}

/// A power of ten as text.
fn power_of_ten(power: i32) -> String {
    if (-4..=4).contains(&power) { format!("{}", 10f64.powi(power)) } else { format!("1e{power}") }
}
