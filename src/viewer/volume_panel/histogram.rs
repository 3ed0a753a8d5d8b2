//! Histogram of ρ over the flow cells, compared to the theory ρ = clamp(N(0,1) + ½, 0, 1)·α.

use eframe::egui::{self, Color32};
use egui_plot::{Bar, BarChart, Line, MarkerShape, Plot, PlotPoints, Points};

use super::{BINS, Counts, short};

/// Φ(−½): the probability that N(0,1) + ½ is below 0, and that it is above 1.
const CLAMPED_SHARE: f64 = 0.308_537_538_7;
/// Distance of the clamped ends' bars from 0 and α, in widths of the steps between.
const END_DISTANCE: f64 = 0.75;

/// Colours of the histogram in the current theme.
struct Colours {
    ends: Color32,
    between: Color32,
    theory: Color32,
}

impl Colours {
    fn new(dark: bool) -> Colours {
        let colour = |dark_rgb: (u8, u8, u8), light_rgb: (u8, u8, u8)| {
            let (r, g, b) = if dark { dark_rgb } else { light_rgb };
            Color32::from_rgb(r, g, b)
        };
        Colours {
            ends: colour((70, 140, 190), (60, 120, 175)),
            between: colour((95, 175, 165), (50, 140, 130)),
            theory: colour((255, 190, 90), (190, 90, 0)),
        }
    }
}

/// Shows the histogram: shares of the flow cells in %.
pub(super) fn show(ui: &mut egui::Ui, counts: &Counts) {
    // Without density the axis still needs a length.
    let alpha = if counts.statistics.alpha > 0.0 { counts.statistics.alpha as f64 } else { 1.0 };
    let colours = Colours::new(ui.visuals().dark_mode);
    title(ui, &colours);
    let bars = bars(counts, alpha, &colours);
    let (curve, ends) = theory(alpha, &colours);
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
            bars.into_iter().for_each(|chart| plot.bar_chart(chart));
            plot.line(curve);
            plot.points(ends);
        });
}

/// Positions of the bars of the clamped ends.
fn end_positions(alpha: f64) -> [f64; 2] {
    let step = alpha / BINS as f64;
    [-END_DISTANCE * step, alpha + END_DISTANCE * step]
}

/// The bars of the clamped ends, and the bars between them.
fn bars(counts: &Counts, alpha: f64, colours: &Colours) -> [BarChart; 2] {
    let total = counts.rho.total().max(1) as f64;
    let percent = |n: u64| 100.0 * n as f64 / total;
    let step = alpha / BINS as f64;
    let bar = |x: f64, n: u64, name: String, fill: Color32| {
        Bar::new(x, percent(n)).width(step * 0.92).name(name).fill(fill).stroke(egui::Stroke::NONE)
    };
    let [low_end, high_end] = end_positions(alpha);
    let at_ends = vec![
        bar(low_end, counts.rho.at_zero, "ρ = 0".into(), colours.ends),
        bar(high_end, counts.rho.at_alpha, "ρ = α".into(), colours.ends),
    ];
    let between = counts.rho.between.iter().enumerate().map(|(i, &n)| {
        let (low, high) = (i as f64 * step, (i + 1) as f64 * step);
        bar((low + high) / 2.0, n, format!("ρ {} to {}", short(low), short(high)), colours.between)
    });
    let tip = |bar: &Bar, _: &BarChart| format!("{}\n{:.2} %", bar.name, bar.value);
    [
        BarChart::new("ρ = 0, ρ = α", at_ends).color(colours.ends).element_formatter(Box::new(tip)),
        BarChart::new("between", between.collect()).color(colours.between).element_formatter(Box::new(tip)),
    ]
}

/// The shares that theory predicts: a curve between the ends, and a point at each end.
fn theory(alpha: f64, colours: &Colours) -> (Line<'static>, Points<'static>) {
    let normal: PlotPoints = (0..=40)
        .map(|i| {
            let t = i as f64 / 40.0;
            let density = (-0.5 * (t - 0.5) * (t - 0.5)).exp() / std::f64::consts::TAU.sqrt();
            [t * alpha, 100.0 * density / BINS as f64]
        })
        .collect();
    let ends: PlotPoints = end_positions(alpha).iter().map(|&x| [x, 100.0 * CLAMPED_SHARE]).collect();
    let curve = Line::new("theory", normal).color(colours.theory).width(2.0).allow_hover(false);
    let ends = Points::new("theory", ends)
        .shape(MarkerShape::Diamond)
        .color(colours.theory)
        .radius(5.0)
        .allow_hover(false);
    (curve, ends)
}

/// The title, and the meaning of the colours beside or below it.
fn title(ui: &mut egui::Ui, colours: &Colours) {
    let keys = [(colours.ends, "ρ = 0, ρ = α"), (colours.between, "between"), (colours.theory, "theory")];
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
}
