//! How ρ is spread over the flow cells, beside ρ = clamp(N(0,1) + ½, 0, 1)·α.

use eframe::egui;
use egui_plot::{Bar, BarChart, Line, MarkerShape, Plot, PlotPoints, Points};

use super::{BINS, Counts, short};

/// Φ(−½): the share a standard normal + ½ has below 0, and as much above 1.
const CLAMPED_SHARE: f64 = 0.308_537_538_7;
/// Distance of the clamped ends' bars from 0 and α, in steps of the bars between.
const END_DISTANCE: f64 = 0.75;

/// The histogram: shares in % of the flow cells.
pub(super) fn show(ui: &mut egui::Ui, counts: &Counts) {
    let total = counts.rho.total().max(1) as f64;
    let percent = |n: u64| 100.0 * n as f64 / total;
    // Without density the axis still needs a length.
    let alpha = if counts.statistics.alpha > 0.0 { counts.statistics.alpha as f64 } else { 1.0 };
    let step = alpha / BINS as f64;
    let ends = [-END_DISTANCE * step, alpha + END_DISTANCE * step];
    let dark = ui.visuals().dark_mode;
    let colour = |dark_rgb: (u8, u8, u8), light_rgb: (u8, u8, u8)| {
        let (r, g, b) = if dark { dark_rgb } else { light_rgb };
        egui::Color32::from_rgb(r, g, b)
    };
    let ends_colour = colour((70, 140, 190), (60, 120, 175));
    let between_colour = colour((95, 175, 165), (50, 140, 130));
    let theory_colour = colour((255, 190, 90), (190, 90, 0));

    let bar = |x: f64, n: u64, name: String, fill: egui::Color32| {
        Bar::new(x, percent(n)).width(step * 0.92).name(name).fill(fill).stroke(egui::Stroke::NONE)
    };
    let at_ends = vec![
        bar(ends[0], counts.rho.at_zero, "ρ = 0".into(), ends_colour),
        bar(ends[1], counts.rho.at_alpha, "ρ = α".into(), ends_colour),
    ];
    let between = counts.rho.between.iter().enumerate().map(|(i, &n)| {
        let (low, high) = (i as f64 * step, (i + 1) as f64 * step);
        bar((low + high) / 2.0, n, format!("ρ {} to {}", short(low), short(high)), between_colour)
    });
    let words = |bar: &Bar, _: &BarChart| format!("{}\n{:.2} %", bar.name, bar.value);
    let normal: PlotPoints = (0..=40)
        .map(|i| {
            let t = i as f64 / 40.0;
            let density = (-0.5 * (t - 0.5) * (t - 0.5)).exp() / std::f64::consts::TAU.sqrt();
            [t * alpha, 100.0 * density / BINS as f64]
        })
        .collect();
    let theory_ends: PlotPoints = ends.iter().map(|&x| [x, 100.0 * CLAMPED_SHARE]).collect();

    let charts = (
        BarChart::new("ρ = 0, ρ = α", at_ends).color(ends_colour).element_formatter(Box::new(words)),
        BarChart::new("between", between.collect()).color(between_colour).element_formatter(Box::new(words)),
        Line::new("theory", normal).color(theory_colour).width(2.0).allow_hover(false),
        Points::new("theory", theory_ends)
            .shape(MarkerShape::Diamond)
            .color(theory_colour)
            .radius(5.0)
            .allow_hover(false),
    );
    let keys = [(ends_colour, "ρ = 0, ρ = α"), (between_colour, "between"), (theory_colour, "theory")];
    let key = |ui: &mut egui::Ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        for (colour, name) in keys {
            let [r, g, b, _] = colour.to_array();
            super::swatch(ui, [r, g, b]);
            ui.label(name);
        }
    };
    let one_line = ui.available_width() >= super::ONE_LINE_WIDTH;
    ui.horizontal(|ui| {
        ui.label(egui::RichText::new("Flow cells by ρ").strong());
        if one_line {
            ui.add_space(6.0);
            key(ui);
        }
    });
    if !one_line {
        ui.horizontal(key);
    }
    Plot::new("rho histogram")
        .height(160.0)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .include_y(0.0)
        .include_y(35.0)
        .x_axis_label("ρ, from 0 to α")
        .x_grid_spacer(move |_| {
            (0..=4)
                .map(|i| egui_plot::GridMark { value: alpha * i as f64 / 4.0, step_size: alpha / 4.0 })
                .collect()
        })
        .x_axis_formatter(|mark, _| short(mark.value))
        .y_axis_formatter(
            |mark, _| if mark.value < 0.0 { String::new() } else { format!("{} %", mark.value) },
        )
        .show(ui, move |plot| {
            plot.bar_chart(charts.0);
            plot.bar_chart(charts.1);
            plot.line(charts.2);
            plot.points(charts.3);
        });
}
