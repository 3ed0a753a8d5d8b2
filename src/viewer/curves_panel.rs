//! The curves inspector: draws the spatial fractal curves (§1) as lines in the volume's box, to show the
//! effect of h, amplitude and levels.

mod view;

use std::ops::Range;

use eframe::egui::{self, Color32, Pos2, Sense, Stroke, Vec2};
use glam::Vec3;

use super::layer_image::heat;
use super::volume_panel::axis_colour;
use crate::volume::{WaterSpec, curve_points};
use view::{Projection, View};

/// Most segments of all curves together. They take a few milliseconds to tessellate.
const MAX_SEGMENTS: usize = 20_000;
/// Segments drawn as one polyline, in one shade.
const RUN: usize = 8;
/// Most curves shown.
const MAX_CURVES: usize = 200;
/// Most curves whose levels are shown. More would hide one another.
const MAX_LEVEL_CURVES: usize = 4;

/// The curves inspector: the view, the settings, and the points of the curves shown.
pub struct CurvesPanel {
    view: View,
    count: usize,
    show_levels: bool,
    level: u32,
    points: Option<Points>,
}

/// Points of some curves, in cells. Each curve has 2^levels segments.
struct Points {
    /// The volume and the number of curves that the points were made for.
    spec: WaterSpec,
    count: usize,
    /// Levels drawn, at most those of `spec`.
    levels: u32,
    curves: Vec<Vec<Vec3>>,
}

impl Default for CurvesPanel {
    fn default() -> Self {
        CurvesPanel { view: View::default(), count: 24, show_levels: false, level: 2, points: None }
    }
}

impl CurvesPanel {
    /// Shows the panel for the curves of `spec`.
    pub fn show(&mut self, ui: &mut egui::Ui, spec: &WaterSpec) {
        self.update_points(spec);
        self.canvas(ui, spec);
        ui.add_space(4.0);
        self.controls(ui, spec);
        if self.show_levels {
            self.level_label(ui, spec);
        }
        let scales: Vec<String> =
            (1..=spec.shape.levels.min(5)).map(|n| format!("{:.2}", spec.shape.scale(n))).collect();
        let more = if spec.shape.levels > 5 { ", …" } else { "" };
        ui.label(format!("S(n) = 2^(−n·h), h = {:.2}:  {}{more}", spec.shape.h, scales.join(", ")))
            .on_hover_text(
                "Scale of the displacement at levels 1, 2, 3, …: a small h is rough, a large h is smooth",
            );
    }

    fn update_points(&mut self, spec: &WaterSpec) {
        let all = spec.across as usize * spec.deep as usize;
        let count = self.count.min(all).max(1);
        let is_current = |p: &Points| p.spec == *spec && p.count == count;
        if !self.points.as_ref().is_some_and(is_current) {
            self.points = Some(Points::new(spec, count));
        }
    }

    fn canvas(&mut self, ui: &mut egui::Ui, spec: &WaterSpec) {
        let width = ui.available_width();
        let size = Vec2::new(width, (0.95 * width).clamp(200.0, 460.0));
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Spatial fractal curves"));
        self.view.steer(ui, &response);
        if !ui.is_rect_visible(rect) {
            return;
        }
        let visuals = ui.visuals();
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 4.0, visuals.extreme_bg_color);
        let projection = Projection::new(&self.view, rect, Vec3::from_array(spec.size.map(|n| n as f32)));
        let ink = Ink {
            dark: visuals.dark_mode,
            paper: visuals.extreme_bg_color,
            text: visuals.text_color(),
            weak: visuals.weak_text_color(),
        };
        let edge = Stroke::new(1.0, ink.weak.gamma_multiply(0.7));
        let (behind, in_front) = projection.edges();
        for ends in behind {
            painter.line_segment(ends, Stroke::new(1.0, ink.weak.gamma_multiply(0.4)));
        }
        if let Some(points) = &self.points {
            if self.show_levels {
                let (explained, rest) = points.explained();
                draw_curves(&painter, &projection, points, rest, &ink, 0.25);
                draw_curves(&painter, &projection, points, explained.clone(), &ink, 1.0);
                draw_levels(&painter, &projection, points, explained, &ink, self.level.min(points.levels));
            } else {
                draw_curves(&painter, &projection, points, points.curves.iter().collect(), &ink, 1.0);
            }
        }
        for ends in in_front {
            painter.line_segment(ends, edge);
        }
        draw_axes(&painter, &projection, spec, &ink);
        let hint = "drag to turn · scroll to zoom · double click to reset";
        if rect.width() >= 280.0 {
            let at = rect.min + Vec2::new(9.0, 6.0);
            painter.text(at, egui::Align2::LEFT_TOP, hint, egui::FontId::proportional(11.0), ink.weak);
        }
        response.on_hover_cursor(egui::CursorIcon::Grab);
    }

    fn controls(&mut self, ui: &mut egui::Ui, spec: &WaterSpec) {
        let all = spec.across as usize * spec.deep as usize;
        ui.spacing_mut().slider_width = (ui.available_width() - 170.0).clamp(60.0, 300.0);
        let range = 1..=all.clamp(1, MAX_CURVES);
        ui.add(egui::Slider::new(&mut self.count, range).text("Curves shown"))
            .on_hover_text(format!("Some of the {all} curves of the volume, spread evenly over their grid"));
        let levels = self.points.as_ref().map_or(0, |p| p.levels);
        ui.checkbox(&mut self.show_levels, "Show levels")
            .on_hover_text("The recursion: each level displaces the midpoints of the level before it");
        if self.show_levels {
            let slider = egui::Slider::new(&mut self.level, 0..=levels).text("Level");
            ui.add(slider);
        }
    }

    fn level_label(&self, ui: &mut egui::Ui, spec: &WaterSpec) {
        let n = self.level.min(spec.shape.levels);
        let segments = 1u32 << n.min(31);
        let text = if n == 0 {
            format!("Level 0: the straight line from y = 0 to y = {}", spec.size[1])
        } else {
            let sigma = spec.shape.sigma_g_cells * spec.shape.scale(n);
            format!("Level {n}: {segments} segments, midpoints moved by {sigma:.2} cells (σ)")
        };
        ui.label(text);
    }
}

impl Points {
    fn new(spec: &WaterSpec, count: usize) -> Self {
        let most = (MAX_SEGMENTS / count.max(1)).max(1).ilog2();
        let levels = spec.shape.levels.min(most);
        // Fewer levels give points of the same curves.
        let mut coarse = *spec;
        coarse.shape.levels = levels;
        let curve = |curve: usize| {
            let mut points = Vec::new();
            curve_points(&coarse, curve, &mut points);
            points
        };
        let curves = spread(spec.across, spec.deep, count).into_iter().map(curve).collect();
        Points { spec: *spec, count, levels, curves }
    }

    /// The few curves whose levels are shown, and the other curves.
    fn explained(&self) -> (Vec<&Vec<Vec3>>, Vec<&Vec<Vec3>>) {
        let all = self.curves.len();
        let few = all.min(MAX_LEVEL_CURVES);
        let numbers: Vec<usize> = (0..few).map(|i| (2 * i + 1) * all / (2 * few)).collect();
        let curves = |explained: bool| {
            let chosen = (0..all).filter(|i| numbers.contains(i) == explained);
            chosen.map(|i| &self.curves[i]).collect()
        };
        (curves(true), curves(false))
    }
}

/// Numbers of `count` curves that are spread evenly over the jitter grid.
fn spread(across: u32, deep: u32, count: usize) -> Vec<usize> {
    let all = across as usize * deep as usize;
    if count >= all {
        return (0..all).collect();
    }
    let mut chosen = std::collections::BTreeSet::new();
    // Roberts' R2 sequence keeps its points apart for any count.
    let mut i = 0u32;
    while chosen.len() < count && i < 64 * MAX_CURVES as u32 {
        let index = |step: f64, n: u32| ((0.5 + step * i as f64).fract() * n as f64) as usize % n as usize;
        let (column, row) = (index(0.754_877_666_25, across), index(0.569_840_290_998, deep));
        chosen.insert(row * across as usize + column);
        i += 1;
    }
    chosen.into_iter().collect()
}

/// Colours of the drawing in the current theme.
struct Ink {
    dark: bool,
    paper: Color32,
    text: Color32,
    weak: Color32,
}

impl Ink {
    /// Colour of a line at `depth`, from 0 (far) to 1 (near).
    fn shade(&self, depth: f32) -> Color32 {
        let (far, near) = if self.dark {
            (Color32::from_rgb(58, 94, 126), Color32::from_rgb(168, 226, 255))
        } else {
            (Color32::from_rgb(160, 190, 214), Color32::from_rgb(6, 58, 112))
        };
        far.lerp_to_gamma(near, depth.clamp(0.0, 1.0))
    }

    /// Colour of level `n` of `levels`, of other hues than the curves.
    fn level(&self, n: u32, levels: u32) -> Color32 {
        let t = n as f32 / levels.max(1) as f32;
        // Light colours in the dark theme, dark ones in the light theme.
        let [r, g, b] = heat(if self.dark { 0.6 + 0.38 * t } else { 0.25 + 0.4 * t });
        Color32::from_rgb(r, g, b)
    }
}

/// Draws the curves, far ones first. Parts outside the volume in z, which the volume drops, are faint.
fn draw_curves(
    painter: &egui::Painter,
    projection: &Projection,
    points: &Points,
    curves: Vec<&Vec<Vec3>>,
    ink: &Ink,
    faint: f32,
) {
    let nz = points.spec.size[2] as f32;
    let outside = |p: Vec3| p.z < 0.0 || p.z > nz;
    let mut runs: Vec<(f32, Vec<Pos2>, Color32)> = Vec::new();
    for curve in curves {
        let mut start = 0;
        while start + 1 < curve.len() {
            let run = run_from(curve, start, outside);
            let run_points = curve[run.start..=run.end].iter();
            let projected: Vec<(Pos2, f32)> = run_points.map(|&p| projection.project(p)).collect();
            let depth = projected.iter().map(|p| p.1).sum::<f32>() / projected.len() as f32;
            let fade = if outside(curve[start]) { 0.3 } else { 1.0 };
            let colour = ink.shade(depth).gamma_multiply(faint * fade);
            start = run.end;
            runs.push((depth, projected.into_iter().map(|p| p.0).collect(), colour));
        }
    }
    runs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    for (depth, line, colour) in runs {
        painter.line(line, Stroke::new(0.8 + 0.7 * depth.clamp(0.0, 1.0), colour));
    }
}

/// The segments from point `start` drawn as one polyline: at most [`RUN`], all inside the volume or all
/// outside.
fn run_from(curve: &[Vec3], start: usize, outside: impl Fn(Vec3) -> bool) -> Range<usize> {
    let last = (start + RUN).min(curve.len() - 1);
    let is_outside = outside(curve[start]);
    let end = (start + 1..=last).find(|&i| outside(curve[i]) != is_outside).unwrap_or(last);
    start..end
}

/// Draws levels 0 to `level` of a few curves, coarser ones fainter, with dots at the midpoints that `level`
/// displaced.
fn draw_levels(
    painter: &egui::Painter,
    projection: &Projection,
    points: &Points,
    curves: Vec<&Vec<Vec3>>,
    ink: &Ink,
    level: u32,
) {
    for curve in curves {
        for n in 0..=level {
            let stride = 1usize << (points.levels - n);
            let line: Vec<Pos2> = curve.iter().step_by(stride).map(|&p| projection.project(p).0).collect();
            let age = (level - n) as f32;
            let colour = ink.level(n, points.levels).gamma_multiply(0.75f32.powf(age).max(0.25));
            let width = if n == level { 2.2 } else { 1.3 };
            // More dots would merge into the line. From level 1 on, every second point is a displaced
            // midpoint.
            if n == level && line.len() <= 65 {
                let first = if n == 0 { 0 } else { 1 };
                for at in line.iter().skip(first).step_by(1 + first) {
                    painter.circle_filled(*at, 3.2, colour);
                }
            }
            painter.line(line, Stroke::new(width, colour));
        }
    }
}

/// Draws the axes from the corner where x, y and z are 0, each with its number of cells, and the flow
/// direction.
fn draw_axes(painter: &egui::Painter, projection: &Projection, spec: &WaterSpec, ink: &Ink) {
    let size = Vec3::from_array(spec.size.map(|n| n as f32));
    let font = egui::FontId::proportional(13.0);
    let write = |at: Pos2, text: String, colour: Color32| {
        // The label of an axis that leaves the canvas stays at the canvas's edge.
        let room = painter.clip_rect().shrink2(Vec2::new(22.0, 10.0));
        let at = if room.is_positive() { room.clamp(at) } else { at };
        let galley = painter.layout_no_wrap(text, font.clone(), colour);
        let rect = egui::Align2::CENTER_CENTER.anchor_size(at, galley.size());
        painter.rect_filled(rect.expand(2.0), 3.0, ink.paper.gamma_multiply(0.75));
        painter.galley(rect.min, galley, colour);
    };
    let origin = projection.project(Vec3::ZERO).0;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let mut end = Vec3::ZERO;
        end[axis] = size[axis];
        let tip = projection.project(end).0;
        let colour = axis_colour(axis, ink.dark);
        painter.line_segment([origin, tip], Stroke::new(2.0, colour));
        let along = (tip - origin).normalized();
        write(tip + along * 20.0, format!("{name} {}", spec.size[axis]), colour);
    }
    // The arrow lies beside the y axis, away from the middle of the box.
    let middle = projection.project(size * 0.5).0;
    let start = projection.project(Vec3::new(0.0, size.y * 0.3, 0.0)).0;
    let end = projection.project(Vec3::new(0.0, size.y * 0.7, 0.0)).0;
    let along = (end - start).normalized();
    let mut aside = along.rot90();
    if aside.dot(start - middle) < 0.0 {
        aside = -aside;
    }
    let (start, end) = (start + aside * 16.0, end + aside * 16.0);
    painter.arrow(start, end - start, Stroke::new(2.0, ink.text));
    write(start + (end - start) * 0.5 + aside * 20.0, "flow".into(), ink.text);
}
