//! The polar plot of the scattering lobes, under a fold of its own.

use std::f64::consts::{PI, TAU};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use eframe::egui;
use egui::{Color32, RichText, Sense, Shape, Stroke, Ui, Vec2};
use egui_plot::{Arrows, HoverPosition, Line, LineStyle, Plot, PlotPoint, PlotPoints, PlotUi, Text};

use super::name;
use crate::light::Reflection;
use crate::scene::{Scene, Values};
use crate::viewer::lobes::{Curve, Plane, STEPS, Scale, Setting, alpha, curves, incidence};

/// Widest plot, points.
const MAX_WIDTH: f32 = 380.0;
/// Half the side of the plot in radii of its rim: room for the light's arrow and the angles.
const EXTENT: f64 = 1.24;
/// Radians beside the light that have no angle written: its arrow is there, and its name.
const ARROW_ROOM: f64 = 0.35;

/// The plot and what it was made from.
#[derive(Default)]
pub(super) struct LobesPlot {
    plane: Plane,
    shown: Option<(Setting, Vec<Curve>)>,
    /// What is computed beside the frames.
    coming: Option<(Setting, Receiver<Vec<Curve>>)>,
}

/// How a curve is drawn.
struct Pen {
    colour: Color32,
    style: LineStyle,
    width: f32,
}

impl Pen {
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
    /// The fold with the plot; nothing is computed while it is closed.
    pub fn show(&mut self, ui: &mut Ui, scene: &Scene, values: &Values, selected: Option<&str>) {
        let fold = egui::CollapsingHeader::new("Lobes").id_salt("lobes");
        let fold = fold.show_unindented(ui, |ui| self.body(ui, scene, values, selected));
        fold.header_response.on_hover_text("How much light a cell of water sends in which direction");
    }

    fn body(&mut self, ui: &mut Ui, scene: &Scene, values: &Values, selected: Option<&str>) {
        let Some(incidence) = incidence(scene, values, selected) else {
            ui.weak("No light to reflect.");
            return;
        };
        ui.horizontal_wrapped(|ui| {
            let around = ui.selectable_value(&mut self.plane, Plane::Around, "around the strand");
            around
                .on_hover_text("The eye goes round the strand, on the cone that a mirror sends the light to");
            let along = ui.selectable_value(&mut self.plane, Plane::Along, "along it");
            along.on_hover_text("The eye stays in the plane of strand and light");
        });
        self.take(ui.ctx(), Setting::new(scene, incidence.theta_i, self.plane));
        let Some((setting, curves)) = &self.shown else {
            ui.horizontal(|ui| {
                ui.spinner();
                ui.label("Computing the lobes");
            });
            return;
        };
        let theta_i = degrees(setting.theta_i, 1);
        let model = match setting.reflection {
            Reflection::KajiyaKay => "Kajiya and Kay's fibre, Ψ/π",
            Reflection::Strand(_) => "A strand of water and its air, Φ",
        };
        ui.label(format!("θ_i = {theta_i} of {}", incidence.light)).on_hover_text(
            "Inclination of the light to the plane across the flow; the flow is v of the first quad, in its middle. \
             Select a light to see it here.",
        );
        legend(ui, curves);
        let scale = Scale::new(curves);
        plot(ui, setting, curves, scale);
        let angle = match setting.plane {
            Plane::Around => format!("over φ at θ_o = {}", degrees(-setting.theta_i, 1)),
            Plane::Along => "over θ_o, at φ = 0 left and π right, the flow down".into(),
        };
        let words = format!(
            "{model}, {angle}, of a cell with k_d = {} and k_s = {}. Luminance, 1/sr, on a logarithmic radius: {} \
             or less in the middle, the largest value at the rim.",
            setting.k_d,
            setting.k_s,
            power_of_ten(scale.middle)
        );
        ui.weak(words);
    }

    /// Keeps what is shown up to date.
    fn take(&mut self, ctx: &egui::Context, setting: Setting) {
        if let Some((of, answer)) = &self.coming {
            match answer.try_recv() {
                Ok(curves) => self.shown = Some((*of, curves)),
                Err(TryRecvError::Empty) => return,
                // No thread was to be had.
                Err(TryRecvError::Disconnected) => self.shown = Some((*of, Vec::new())),
            }
            self.coming = None;
        }
        if self.shown.as_ref().is_some_and(|(of, _)| *of == setting) {
            return;
        }
        let (send, answer) = channel();
        let ctx = ctx.clone();
        let compute = move || {
            // Whoever asked may be gone.
            let _ = send.send(curves(&setting));
            ctx.request_repaint();
        };
        // Beside the frames: the strand's balance waits for the pool, which may be rendering for long.
        let _ = std::thread::Builder::new().name("lobes".into()).spawn(compute);
        self.coming = Some((setting, answer));
    }
}

/// The curves' names, each with a piece of its line.
fn legend(ui: &mut Ui, curves: &[Curve]) {
    ui.horizontal_wrapped(|ui| {
        for curve in curves {
            let peak = curve.peak();
            let words = format!("{}\nat most {}", curve.doc, per_steradian(peak));
            // One widget: a line does not end between the piece and the name.
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
            response.on_hover_text(words);
        }
    });
}

/// Where a direction is drawn: the light comes from the left, and what flows flows down.
fn place(plane: Plane, alpha: f64, radius: f64) -> [f64; 2] {
    let up = if plane == Plane::Along { -1.0 } else { 1.0 };
    [-radius * alpha.cos(), up * radius * alpha.sin()]
}

fn plot(ui: &mut Ui, setting: &Setting, curves: &[Curve], scale: Scale) {
    let width = ui.available_width().min(MAX_WIDTH);
    let shown: Vec<(&str, Pen, Vec<[f64; 2]>)> = curves
        .iter()
        .map(|curve| {
            let at = |i: usize| place(setting.plane, alpha(i), scale.radius(curve.values[i % STEPS]));
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

/// A ring for each power of ten, and their names.
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
        // Between two spokes, on the side the light comes from: the strong lobes are on the other.
        let (sin, cos) = (0.625 * PI).sin_cos();
        let words = RichText::new(power_of_ten(power)).size(10.0);
        let at = PlotPoint::new(radius * cos, radius * sin);
        plot.text(Text::new(format!("scale {power}"), at, words).color(faint).allow_hover(false));
    }
}

/// Spokes with their angles, and the light.
fn frame(plot: &mut PlotUi<'_>, setting: &Setting, faint: Color32, text: Color32) {
    let plane = setting.plane;
    let light = if plane == Plane::Around { 0.0 } else { setting.theta_i };
    for i in 0..12 {
        let a = alpha(i * STEPS / 12);
        let spoke = PlotPoints::new(vec![place(plane, a, 0.0), place(plane, a, 1.0)]);
        let spoke = Line::new(format!("spoke {i}"), spoke).allow_hover(false);
        plot.line(spoke.color(faint.gamma_multiply(0.25)).width(1.0));
        if (a - light).cos() > ARROW_ROOM.cos() {
            continue;
        }
        let (theta_o, phi) = plane.direction(setting.theta_i, a);
        let [x, y] = place(plane, a, 1.12);
        let words = degrees(if plane == Plane::Around { phi } else { theta_o }, 0);
        let words = Text::new(format!("angle {i}"), PlotPoint::new(x, y), RichText::new(words).size(10.0));
        plot.text(words.color(faint).allow_hover(false));
    }
    let [from, to] = [1.22, 1.01].map(|r| PlotPoints::new(vec![place(plane, light, r)]));
    plot.arrows(Arrows::new("light", from, to).color(text).allow_hover(false));
    let [x, y] = place(plane, light + 0.5 * ARROW_ROOM, 1.14);
    let words = Text::new("light's name", PlotPoint::new(x, y), RichText::new("light").size(10.0));
    plot.text(words.color(text).allow_hover(false));
}

fn degrees(radians: f64, decimals: usize) -> String {
    // No minus before what is rounded to 0.
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

/// A power of ten as it is printed.
fn power_of_ten(power: i32) -> String {
    if (-4..=4).contains(&power) { format!("{}", 10f64.powi(power)) } else { format!("1e{power}") }
}
