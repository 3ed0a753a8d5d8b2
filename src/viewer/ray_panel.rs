//! The pixel inspector: shows the cells that a pixel's ray walks behind the face, as curves over the depth
//! and as a table.

use eframe::egui::{
    Align, Color32, Grid, Label, Layout, Rangef, RichText, ScrollArea, TextStyle, TextWrapMode, Ui, Vec2b,
    vec2,
};
use egui_extras::{Column, TableBuilder, TableRow};
use egui_plot::{AxisHints, HoverPosition, Line, Plot, PlotPoints, Span, VLine};
use glam::Vec3;

use crate::engine::cpu::ray::{RayReport, RayStep};

/// Rec. 709 weights of linear RGB.
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);
/// Height of a plot without its axis, points. Three plots and some rows of the table fit on a laptop's
/// screen.
const PLOT_HEIGHT: f32 = 76.0;
/// Height of the depth axis with its figures and label, points.
const AXIS_HEIGHT: f32 = 34.0;
/// Width of the figures beside a plot, points. It is the same for all plots, so that their depths line up.
const FIGURES_WIDTH: f32 = 48.0;
/// Text size of the table's figures and the plots' titles, points. A larger one would make the table too
/// wide.
const SMALL: f32 = 11.0;
/// Name of the column that is shown only if the ray meets several faces.
const FACE: &str = "face";
/// Columns of the table: head, width in points, and tooltip.
const COLUMNS: [(&str, f32, &str); 11] = [
    ("#", 22.0, "Number of the cell along the ray, from 0"),
    (FACE, 30.0, "Number of the face in front of the cell, from 0, in the order above"),
    ("x  y  z", 58.0, "Indices of the cell in the volume"),
    ("from – to m", 96.0, "Distances at which the ray enters and leaves the cell, metres behind its face"),
    ("ρ", 36.0, "Density, α·ρ"),
    ("T", 36.0, "Transmittance before the cell"),
    ("radiance", 134.0, "Linear RGB that the cell adds towards the eye, including ambient light"),
    ("V", 36.0, "Visibility of each light: the share of its light that reaches the cell"),
    ("v", 112.0, "Direction of the flow in the volume"),
    ("k_d", 30.0, "Diffuse reflection coefficient"),
    ("k_s", 30.0, "Specular reflection coefficient"),
];

/// Shows a pixel's report in the available space.
pub fn show(ui: &mut Ui, report: &RayReport) {
    headline(ui, report);
    if report.steps.is_empty() {
        ui.add_space(8.0);
        ui.label("No water covers this pixel. Its ray goes straight to the rock or the background.");
        return;
    }
    // The row under the pointer marks its cell in the plots. The depth under the pointer in a plot selects
    // its row.
    let pointed_row = ui.scope_id().with("pointed row");
    let row: Option<usize> = ui.data(|data| data.get_temp(pointed_row)).flatten();
    let marked = row.and_then(|row| report.steps.get(row));
    let depth = plots(ui, report, marked);
    let selected = depth.and_then(|m| {
        report.steps.iter().position(|step| {
            let [enter, exit] = report.behind_nearest_m(step);
            (enter..exit).contains(&(m as f32))
        })
    });
    ui.add_space(4.0);
    let rows = rows(ui, report);
    let hovered = table(ui, report, &rows, selected);
    if hovered != row {
        ui.data_mut(|data| data.insert_temp(pointed_row, hovered));
        ui.request_repaint();
    }
}

/// Shows a checkbox for empty cells. Returns the cells that the table lists: those with water, or all of
/// them.
fn rows(ui: &mut Ui, report: &RayReport) -> Vec<usize> {
    let key = ui.scope_id().with("empty too");
    let mut all: bool = ui.data(|data| data.get_temp(key)).unwrap_or(false);
    let wet: Vec<usize> = (0..report.steps.len()).filter(|&i| report.steps[i].rho > 0.0).collect();
    ui.horizontal(|ui| {
        ui.label(RichText::new(format!("{} cells, {} with water", report.steps.len(), wet.len())).strong());
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.checkbox(&mut all, "list empty cells").changed() {
                ui.data_mut(|data| data.insert_temp(key, all));
            }
        });
    });
    if all { (0..report.steps.len()).collect() } else { wet }
}

/// Shows the pixel in a few figures.
fn headline(ui: &mut Ui, report: &RayReport) {
    let [x, y] = report.pixel;
    ui.heading(format!("Pixel {x}, {y}"));
    ui.add_space(2.0);
    let pair = |ui: &mut Ui, name: &str, value: String| {
        ui.label(RichText::new(name).weak());
        ui.add(Label::new(value).wrap_mode(TextWrapMode::Extend));
    };
    Grid::new("headline").num_columns(4).spacing([12.0, 4.0]).show(ui, |ui| {
        pair(ui, "radiance", triple(report.radiance));
        pair(ui, "transmittance", figure(report.transmittance));
        ui.end_row();
        pair(ui, "behind", triple(report.behind));
        pair(ui, "depth", report.face().map_or("–".into(), |f| format!("{:.3} m", f.depth_m)));
        ui.end_row();
        for (i, face) in report.faces.iter().enumerate() {
            let [u, v] = face.uv;
            pair(ui, "quad", format!("{}   u {u:.4}   v {v:.4}", face.quad));
            if i == 0 {
                pair(ui, "cells", format!("{}, {} on the way to lights", report.cells[0], report.cells[1]));
            } else {
                pair(ui, &format!("face {i}"), format!("{:.3} m", face.depth_m));
            }
            ui.end_row();
        }
    });
    if report.filtered {
        ui.label(
            RichText::new("Computed from the volume's own cells, without trace.filter and trace.lookup")
                .weak(),
        );
    }
}

/// A curve over the depth.
struct Curve {
    name: &'static str,
    points: Vec<[f64; 2]>,
    color: Color32,
    /// A value that the axis includes besides 0.
    includes: Option<f64>,
}

/// The curves of a report: density, transmittance and radiance over the depth.
fn curves(report: &RayReport, dark: bool) -> [Curve; 3] {
    let color = |on_dark: [u8; 3], on_light: [u8; 3]| {
        let [r, g, b] = if dark { on_dark } else { on_light };
        Color32::from_rgb(r, g, b)
    };
    let mut transmittance: Vec<[f64; 2]> =
        report.steps.iter().map(|s| [report.behind_nearest_m(s)[0] as f64, s.transmittance as f64]).collect();
    if let Some(last) = report.steps.last() {
        transmittance.push([report.behind_nearest_m(last)[1] as f64, report.transmittance as f64]);
    }
    [
        Curve {
            name: "density α·ρ",
            points: step_curve(report, |s| s.rho),
            color: color([110, 180, 255], [20, 100, 190]),
            includes: None,
        },
        Curve {
            name: "transmittance T",
            points: transmittance,
            color: color([255, 170, 90], [190, 90, 0]),
            includes: Some(1.0),
        },
        Curve {
            name: "radiance added (luminance)",
            points: step_curve(report, |s| s.radiance.dot(LUMINANCE)),
            color: color([150, 220, 130], [40, 130, 30]),
            includes: None,
        },
    ]
}

/// Plots the curves below one another, with the cell `marked`. Returns the depth under the pointer, metres.
fn plots(ui: &mut Ui, report: &RayReport, marked: Option<&RayStep>) -> Option<f64> {
    let axis =
        if report.faces.len() > 1 { "metres behind the nearest face" } else { "metres behind the face" };
    let mark = marked.map(|step| report.behind_nearest_m(step).map(f64::from));
    let weak = ui.visuals().weak_text_color();
    let curves = curves(report, ui.visuals().dark_mode);
    let mut depth = None;
    let last = curves.len() - 1;
    for (i, curve) in curves.into_iter().enumerate() {
        ui.add_space(4.0);
        let peak = curve.points.iter().map(|p| p[1] as f32).fold(0.0, f32::max);
        let title = format!("{}, up to {}", curve.name, figure(peak));
        ui.label(RichText::new(title).size(SMALL).color(curve.color));
        let plot = depth_plot(ui, &curve, (i == last).then_some(axis));
        let shown = plot.show(ui, |plot| {
            if let Some([enter, exit]) = mark {
                plot.span(Span::new("", enter..=exit).fill(weak.gamma_multiply(0.25)).border_width(0.0));
                plot.vline(VLine::new("", enter).color(weak).allow_hover(false));
            }
            let line = Line::new(curve.name, PlotPoints::new(curve.points)).color(curve.color);
            // A hover band would round off the steps.
            plot.line(line.allow_band(false).fill(0.0).fill_alpha(0.15));
            plot.pointer_coordinate().filter(|_| plot.response().hovered())
        });
        depth = depth.or(shown.inner.map(|p| p.x));
    }
    depth
}

/// The plot of one curve. All plots share their depth axis and cursor. Only the last one shows the axis, with
/// this label.
fn depth_plot(ui: &Ui, curve: &Curve, depth_axis: Option<&'static str>) -> Plot<'static> {
    let group = ui.scope_id().with("depth");
    let axis_height = if depth_axis.is_some() { AXIS_HEIGHT } else { 0.0 };
    let plot = Plot::new(curve.name)
        .height(PLOT_HEIGHT + axis_height)
        // Half of the axis's last figure extends beyond the plot.
        .width(ui.available_width() - 10.0)
        .link_axis(group, Vec2b::new(true, false))
        .link_cursor(group, Vec2b::new(true, false))
        .show_axes(Vec2b::new(depth_axis.is_some(), true))
        .custom_x_axes(vec![
            AxisHints::new_x().label(depth_axis.unwrap_or("")).label_spacing(Rangef::new(24.0, 32.0)),
        ])
        .custom_y_axes(vec![
            AxisHints::new_y().min_thickness(FIGURES_WIDTH).label_spacing(Rangef::new(12.0, 18.0)),
        ])
        // The wheel scrolls the panel.
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .allow_drag(Vec2b::new(true, false))
        .allow_zoom(Vec2b::new(true, false))
        .set_margin_fraction(vec2(0.0, 0.08))
        .include_y(0.0)
        .label_formatter(move |at| {
            let (HoverPosition::NearDataPoint { position, .. } | HoverPosition::Elsewhere { position }) = at;
            Some(format!("{:.4} m\n{}", position.x, figure(position.y as f32)))
        });
    match curve.includes {
        Some(value) => plot.include_y(value),
        None => plot,
    }
}

/// A step curve with each cell's value from where the ray enters the cell to where it leaves it. The value is
/// 0 between sheets.
fn step_curve(report: &RayReport, value: impl Fn(&RayStep) -> f32) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut face = 0;
    for step in &report.steps {
        let [enter, exit] = report.behind_nearest_m(step).map(f64::from);
        if step.face != face {
            face = step.face;
            points.extend(points.last().map(|&[metres, _]| [metres, 0.0]));
            points.push([enter, 0.0]);
        }
        points.extend([enter, exit].map(|metres| [metres, value(step) as f64]));
    }
    points
}

/// Whether a column is shown.
fn is_shown(report: &RayReport, name: &str) -> bool {
    name != FACE || report.faces.len() > 1
}

/// Shows the table of the cells `rows`, with the cell `selected` highlighted. Returns the cell under the
/// pointer.
fn table(ui: &mut Ui, report: &RayReport, rows: &[usize], selected: Option<usize>) -> Option<usize> {
    let mut hovered = None;
    let row_height = ui.text_style_height(&TextStyle::Monospace) + 2.0;
    let columns = || COLUMNS.into_iter().filter(|(name, ..)| is_shown(report, name));
    ScrollArea::horizontal().id_salt("cells").show(ui, |ui| {
        ui.spacing_mut().item_spacing.x = 5.0;
        let height = ui.available_height();
        let mut table = TableBuilder::new(ui)
            .id_salt("cells")
            .striped(true)
            .resizable(true)
            .auto_shrink(false)
            .min_scrolled_height(3.0 * row_height)
            .max_scroll_height(height)
            .cell_layout(Layout::right_to_left(Align::Center));
        for (_, width, _) in columns() {
            table = table.column(Column::initial(width).at_least(width.min(36.0)).clip(true));
        }
        if let Some(row) = selected.and_then(|number| rows.iter().position(|&row| row == number)) {
            table = table.scroll_to_row(row, None);
        }
        let table = table.header(row_height + 2.0, |mut header| {
            for (name, _, tip) in columns() {
                header.col(|ui| {
                    let name = RichText::new(name).size(SMALL + 1.0).strong();
                    ui.add(Label::new(name).wrap_mode(TextWrapMode::Extend)).on_hover_text(tip);
                });
            }
        });
        table.body(|body| {
            body.rows(row_height, rows.len(), |mut row| {
                let number = rows[row.index()];
                row.set_selected(selected == Some(number));
                fill_row(&mut row, report, number);
                if row.response().hovered() {
                    hovered = Some(number);
                }
            });
        });
    });
    hovered
}

fn fill_row(row: &mut TableRow, report: &RayReport, number: usize) {
    let step = &report.steps[number];
    for ((name, ..), text) in COLUMNS.into_iter().zip(cells(number, step)) {
        if !is_shown(report, name) {
            continue;
        }
        row.col(|ui| {
            // Empty cells are less prominent.
            let text = RichText::new(text).monospace().size(SMALL);
            let text = if step.rho > 0.0 { text } else { text.weak() };
            ui.add(Label::new(text).wrap_mode(TextWrapMode::Extend).selectable(false));
        });
    }
}

/// Texts of one row of the table, in the order of [`COLUMNS`].
fn cells(number: usize, step: &RayStep) -> [String; 11] {
    let [x, y, z] = step.cell;
    let occupied = step.rho > 0.0;
    let if_occupied = |text: String| if occupied { text } else { String::new() };
    [
        number.to_string(),
        step.face.to_string(),
        format!("{x:>2} {y:>2} {z:>2}"),
        format!("{:.4}–{:.4}", step.enter_m, step.exit_m),
        if_occupied(format!("{:.3}", step.rho)),
        format!("{:.3}", step.transmittance),
        if_occupied(triple(step.radiance)),
        step.visibility.iter().map(|v| format!("{v:.3}")).collect::<Vec<_>>().join(" "),
        if_occupied(format!("{:>5.2} {:>5.2} {:>5.2}", step.v.x, step.v.y, step.v.z)),
        if_occupied(format!("{:.2}", step.k_d)),
        if_occupied(format!("{:.2}", step.k_s)),
    ]
}

fn triple(x: Vec3) -> String {
    format!("{} {} {}", figure(x.x), figure(x.y), figure(x.z))
}

/// A number of any size with two to five significant digits.
fn figure(x: f32) -> String {
    match x.abs() {
        0.0 => "0".into(),
        a if !(1e-3..1e4).contains(&a) => format!("{x:.1e}"),
        a if a < 10.0 => format!("{x:.4}"),
        a if a < 100.0 => format!("{x:.3}"),
        _ => format!("{x:.1}"),
    }
}
