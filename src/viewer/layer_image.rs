//! Pictures of a frame's layers in readable colours, with a legend.

use eframe::egui::{self, Color32, Pos2, Rect, RichText, Sense, Stroke, Vec2};
use rayon::prelude::*;

use crate::picture::{Frame, Layer, Surface};

/// Colour of a value that is infinite or not a number. No colour map contains it.
const NON_FINITE: [u8; 4] = [255, 0, 255, 255];
/// Colours of the checkerboard drawn where a layer has no value.
const NOTHING: [[u8; 4]; 2] = [[40, 40, 44, 255], [50, 50, 55, 255]];
/// Side of a square of the checkerboard, pixels.
const CHECKER_PIXELS: usize = 8;
/// Values that a range is estimated from: enough for its percentiles, quick to sort.
const RANGE_SAMPLES: usize = 1 << 15;
/// Pixels per parallel task.
const PIXELS_PER_TASK: usize = 1 << 14;

/// A layer as a picture.
pub struct LayerImage {
    /// sRGB bytes R, G, B, A, in rows from the top left.
    pub pixels: Vec<[u8; 4]>,
    /// Meaning of the colours.
    pub legend: Legend,
}

/// Meaning of the colours of a layer's picture.
#[derive(Clone, Copy, Debug)]
pub enum Legend {
    /// No legend: the layer is the picture itself, or has no value anywhere.
    None,
    /// One number.
    Scale {
        /// Value drawn with the map's colour at 0. Lower values have the same colour.
        low: f32,
        /// Value drawn with the map's colour at 1. Higher values have the same colour.
        high: f32,
        /// Unit of `low` and `high`. May be empty.
        unit: &'static str,
        /// Colour map: sRGB of (value − low)/(high − low).
        map: fn(f32) -> [u8; 3],
    },
    /// Texture coordinates: u is red, v is green.
    Uv,
    /// Unit normal n as the colour n/2 + 1/2: x is red, y green, z blue.
    Normal,
    /// One colour per quad. Holds the largest quad number in the picture, counted from 1.
    Quads(u32),
}

/// Draws `layer` of `frame`, which has `samples` samples per pixel.
///
/// Values that are not finite are magenta, also in the `rgb` layer. Pixels without a value (no quad, no
/// surface, no cell) show a dark checkerboard, whose colours no map contains. It also shows through a picture
/// with alpha.
pub fn layer_image(frame: &Frame, layer: Layer, samples: u32) -> LayerImage {
    let samples = samples.max(1) as f32;
    let radiance = |i: usize| frame.radiance.get(i).copied().unwrap_or([0.0; 4]);
    if matches!(layer, Layer::Rgb | Layer::Rgba) {
        let pixels = draw(frame, |i| {
            let is_finite = radiance(i).iter().all(|x| x.is_finite());
            Some(if is_finite { frame.picture[i] } else { NON_FINITE })
        });
        return LayerImage { pixels, legend: Legend::None };
    }
    let none = || LayerImage { pixels: draw(frame, |_| None), legend: Legend::None };
    match (layer, &frame.surface) {
        (Layer::Cells, _) => {
            let value = |i: usize| match frame.counts[i][0] {
                0 => None,
                cells => Some(cells as f32 / samples),
            };
            let (_, high) = robust_range(frame, value);
            scale_image(frame, [0.0, high], "cells", heat, value)
        }
        (Layer::Transmittance, _) => {
            let value = |i: usize| {
                let t = radiance(i)[3];
                // Where no cell was walked there is nothing that could transmit light.
                if frame.counts[i][0] == 0 && t == 1.0 { None } else { Some(t) }
            };
            scale_image(frame, [0.0, 1.0], "", sequential, value)
        }
        (_, None) => none(),
        (Layer::Depth, Some(surface)) => {
            let value = |i: usize| match surface.depth[i] {
                0.0 => None,
                depth => Some(depth),
            };
            let (low, high) = robust_range(frame, value);
            scale_image(frame, [low, high], "m", near_is_bright, value)
        }
        (Layer::Uv, Some(surface)) => {
            let pixels = draw(frame, |i| (surface.quad[i] != 0).then(|| finite(&surface.uv[i], uv_colour)));
            LayerImage { pixels, legend: Legend::Uv }
        }
        (Layer::Normal, Some(surface)) => {
            let pixels = draw(frame, |i| {
                let n = surface.normal[i];
                (n != [0.0; 3]).then(|| finite(&n, direction_colour))
            });
            LayerImage { pixels, legend: Legend::Normal }
        }
        (Layer::Quad, Some(surface)) => quad_image(frame, surface),
        (Layer::Rgb | Layer::Rgba, Some(_)) => none(),
    }
}

/// Applies `colour` to each pixel. A pixel without a colour, or with alpha below 255, shows the checkerboard.
fn draw(frame: &Frame, colour: impl Fn(usize) -> Option<[u8; 4]> + Sync) -> Vec<[u8; 4]> {
    let width = frame.width.max(1) as usize;
    let pixels = frame.picture.len();
    let nothing = |i: usize| NOTHING[(i % width / CHECKER_PIXELS + i / width / CHECKER_PIXELS) % 2];
    (0..pixels)
        .into_par_iter()
        .with_min_len(PIXELS_PER_TASK)
        .map(|i| match colour(i) {
            Some(colour) if colour[3] == 255 => colour,
            Some(colour) => over(colour, nothing(i)),
            None => nothing(i),
        })
        .collect()
}

/// A colour with alpha over an opaque one, mixed as displays mix them: in encoded values.
fn over([r, g, b, a]: [u8; 4], below: [u8; 4]) -> [u8; 4] {
    let mix = |c: u8, below: u8| {
        ((u32::from(c) * u32::from(a) + u32::from(below) * u32::from(255 - a) + 127) / 255) as u8
    };
    [mix(r, below[0]), mix(g, below[1]), mix(b, below[2]), 255]
}

/// The colour of a value, or [`NON_FINITE`].
fn finite<const N: usize>(value: &[f32; N], colour: impl Fn([f32; N]) -> [u8; 3]) -> [u8; 4] {
    if value.iter().all(|x| x.is_finite()) { opaque(colour(*value)) } else { NON_FINITE }
}

fn opaque([r, g, b]: [u8; 3]) -> [u8; 4] {
    [r, g, b, 255]
}

fn quad_image(frame: &Frame, surface: &Surface) -> LayerImage {
    let quads = surface.quad.par_iter().with_min_len(PIXELS_PER_TASK).copied().max().unwrap_or(0);
    let pixels = draw(frame, |i| match surface.quad[i] {
        0 => None,
        quad => Some(opaque(quad_colour(quad - 1))),
    });
    LayerImage { pixels, legend: if quads == 0 { Legend::None } else { Legend::Quads(quads) } }
}

fn scale_image(
    frame: &Frame,
    [low, high]: [f32; 2],
    unit: &'static str,
    map: fn(f32) -> [u8; 3],
    value: impl Fn(usize) -> Option<f32> + Sync,
) -> LayerImage {
    // The maps are splines and polynomials: too slow for each of a million pixels, so they are tabulated.
    let table: Vec<[u8; 4]> = (0..=1023).map(|i| opaque(map(i as f32 / 1023.0))).collect();
    let to_table = if high > low { 1023.0 / (high - low) } else { 0.0 };
    let pixels = draw(frame, |i| {
        let value = value(i)?;
        if !value.is_finite() {
            return Some(NON_FINITE);
        }
        Some(table[((value - low) * to_table + 0.5).clamp(0.0, 1023.0) as usize])
    });
    // A frame without values has no range: then low > high.
    let legend = if low <= high { Legend::Scale { low, high, unit, map } } else { Legend::None };
    LayerImage { pixels, legend }
}

/// The range of the finite values, cut off at outliers. It extends at most half the distance between the 2nd
/// and the 98th percentile beyond these. Without values low > high.
fn robust_range(frame: &Frame, value: impl Fn(usize) -> Option<f32> + Sync) -> (f32, f32) {
    let finite = |i: usize| value(i).filter(|v| v.is_finite());
    let pixels = frame.picture.len();
    let (least, most) = (0..pixels)
        .into_par_iter()
        .with_min_len(PIXELS_PER_TASK)
        .filter_map(finite)
        .map(|v| (v, v))
        .reduce(|| (f32::INFINITY, f32::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    // An odd step does not stay in one column of the picture.
    let mut some: Vec<f32> = (0..pixels).step_by((pixels / RANGE_SAMPLES) | 1).filter_map(finite).collect();
    some.sort_unstable_by(f32::total_cmp);
    let at = |share: f32| some.get(((some.len() as f32 - 1.0) * share).round() as usize).copied();
    match (at(0.02), at(0.98)) {
        (Some(low), Some(high)) => {
            let beyond = 0.5 * (high - low);
            (least.max(low - beyond), most.min(high + beyond))
        }
        _ => (least, most),
    }
}

fn gradient(gradient: colorous::Gradient, t: f32) -> [u8; 3] {
    let colour = gradient.eval_continuous(t.clamp(0.0, 1.0) as f64);
    [colour.r, colour.g, colour.b]
}

/// Colour map from dark violet over green to yellow, with even steps of lightness.
pub(super) fn sequential(t: f32) -> [u8; 3] {
    gradient(colorous::VIRIDIS, t)
}

/// Colour map from dark violet over red to yellow, for costs.
pub(super) fn heat(t: f32) -> [u8; 3] {
    // The darkest tenth of the gradient looks too much like the checkerboard.
    gradient(colorous::INFERNO, 0.1 + 0.9 * t)
}

/// Colour map for depth: near is light, far is dark.
fn near_is_bright(t: f32) -> [u8; 3] {
    gradient(colorous::MAGMA, 1.0 - 0.85 * t)
}

fn byte(x: f32) -> u8 {
    (x.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn uv_colour([u, v]: [f32; 2]) -> [u8; 3] {
    [byte(u), byte(v), 0]
}

/// Colour of a unit direction: n/2 + 1/2 of each component.
pub(super) fn direction_colour(n: [f32; 3]) -> [u8; 3] {
    n.map(|x| byte(0.5 * x + 0.5))
}

/// Colour of quad number `quad`, counted from 0. The hue turns by the golden angle and the lightness repeats
/// every three quads, so that neither the next quad nor the one in the next row looks similar.
pub fn quad_colour(quad: u32) -> [u8; 3] {
    let hue = (quad as f32 * 0.618_034 + 0.58).fract();
    let (saturation, value) = [(0.62, 0.95), (0.80, 0.62), (0.38, 0.85)][quad as usize % 3];
    let [r, g, b] = egui::ecolor::rgb_from_hsv((hue, saturation, value));
    // HSV hues are evenly spread in encoded values, so the result is taken as sRGB, not as linear RGB.
    [byte(r), byte(g), byte(b)]
}

/// Text colours on the legend's dark ground.
const INK: Color32 = Color32::from_gray(235);
const FAINT_INK: Color32 = Color32::from_gray(175);
/// Size of the colour bar, points.
const BAR: Vec2 = Vec2::new(150.0, 12.0);
/// Side of the uv square and diameter of the normal ball, points.
const SQUARE: f32 = 36.0;
/// Most quads with a swatch of their own.
const MAX_SWATCHES: u32 = 12;

/// Shows the meaning of the colours of `layer` on one line, readable over any picture in either theme. Shows
/// nothing for [`Legend::None`].
pub fn show_legend(ui: &mut egui::Ui, layer: Layer, legend: &Legend) {
    if let Legend::None = legend {
        return;
    }
    let frame = egui::Frame::new()
        .fill(Color32::from_black_alpha(190))
        .corner_radius(5)
        .inner_margin(egui::Margin::symmetric(9, 6));
    frame.show(ui, |ui| {
        let height = match legend {
            Legend::Uv | Legend::Normal => SQUARE,
            Legend::None | Legend::Scale { .. } | Legend::Quads(_) => BAR.y + 6.0,
        };
        let row = egui::Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(Vec2::new(ui.available_width(), height), row, |ui| {
            ui.spacing_mut().item_spacing = Vec2::new(7.0, 0.0);
            ui.label(RichText::new(layer.name()).color(INK).strong());
            match *legend {
                Legend::None => {}
                Legend::Scale { low, high, unit, map } => {
                    let decimals = decimals(low, high, unit);
                    ui.label(RichText::new(format!("{low:.decimals$}")).color(INK));
                    colour_bar(ui, BAR, map)
                        .on_hover_text("values beyond the ends have the colours of the ends");
                    let gap = if unit.is_empty() { "" } else { " " };
                    ui.label(RichText::new(format!("{high:.decimals$}{gap}{unit}")).color(INK));
                }
                Legend::Uv => uv_square(ui),
                Legend::Normal => normal_ball(ui),
                Legend::Quads(count) => quad_swatches(ui, count),
            }
        });
    });
}

/// Number of decimals that resolves a hundredth of the range.
fn decimals(low: f32, high: f32, unit: &str) -> usize {
    if unit == "cells" {
        return 0;
    }
    let step = (high - low).abs().max(1e-4) / 100.0;
    (-step.log10().floor()).clamp(1.0, 4.0) as usize
}

/// A bar of the map's colours from 0 on the left to 1 on the right.
pub(super) fn colour_bar(ui: &mut egui::Ui, size: Vec2, map: fn(f32) -> [u8; 3]) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let mut mesh = egui::Mesh::default();
    let steps = 32;
    for i in 0..=steps {
        let t = i as f32 / steps as f32;
        let [r, g, b] = map(t);
        let x = rect.left() + t * rect.width();
        for y in [rect.top(), rect.bottom()] {
            mesh.colored_vertex(Pos2::new(x, y), Color32::from_rgb(r, g, b));
        }
        if i > 0 {
            let n = 2 * i;
            mesh.add_triangle(n - 2, n - 1, n);
            mesh.add_triangle(n - 1, n, n + 1);
        }
    }
    ui.painter().add(mesh);
    outline(ui, rect);
    response
}

fn outline(ui: &egui::Ui, rect: Rect) {
    let stroke = Stroke::new(1.0, Color32::from_white_alpha(60));
    ui.painter().rect_stroke(rect, 0.0, stroke, egui::StrokeKind::Outside);
}

fn uv_square(ui: &mut egui::Ui) {
    let (rect, _) = ui.allocate_exact_size(Vec2::splat(SQUARE), Sense::hover());
    let mut mesh = egui::Mesh::default();
    for [u, v] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
        let [r, g, b] = uv_colour([u, v]);
        mesh.colored_vertex(rect.lerp_inside(Vec2::new(u, v)), Color32::from_rgb(r, g, b));
    }
    mesh.add_triangle(0, 1, 2);
    mesh.add_triangle(1, 2, 3);
    ui.painter().add(mesh);
    outline(ui, rect);
    ui.vertical(|ui| {
        ui.label(RichText::new("u to the right: red").color(INK));
        ui.label(RichText::new("v down: green").color(INK));
    });
}

/// A ball seen from +z, with x to the right and y up. Each point has the colour of its normal.
fn normal_ball(ui: &mut egui::Ui) {
    let (rect, _) = ui.allocate_exact_size(Vec2::splat(SQUARE), Sense::hover());
    let (rings, spokes) = (8u32, 32u32);
    let mut mesh = egui::Mesh::default();
    for ring in 0..=rings {
        let tilt = ring as f32 / rings as f32 * std::f32::consts::FRAC_PI_2;
        for spoke in 0..spokes {
            let (s, c) = (spoke as f32 / spokes as f32 * std::f32::consts::TAU).sin_cos();
            let n = [tilt.sin() * c, tilt.sin() * s, tilt.cos()];
            let [r, g, b] = direction_colour(n);
            let offset = Vec2::new(n[0], -n[1]) * rect.width() * 0.5;
            mesh.colored_vertex(rect.center() + offset, Color32::from_rgb(r, g, b));
            if ring > 0 {
                let here = ring * spokes + spoke;
                let next = ring * spokes + (spoke + 1) % spokes;
                mesh.add_triangle(here - spokes, here, next);
                mesh.add_triangle(here - spokes, next, next - spokes);
            }
        }
    }
    ui.painter().add(mesh);
    let stroke = Stroke::new(1.0, Color32::from_white_alpha(60));
    ui.painter().circle_stroke(rect.center(), rect.width() * 0.5, stroke);
    ui.vertical(|ui| {
        ui.label(RichText::new("world x right: red, y up: green,").color(INK));
        ui.label(RichText::new("z towards you: blue").color(INK));
    });
}

fn quad_swatches(ui: &mut egui::Ui, count: u32) {
    ui.spacing_mut().item_spacing.x = 3.0;
    for quad in 0..count.min(MAX_SWATCHES) {
        let (rect, response) = ui.allocate_exact_size(Vec2::new(15.0, 15.0), Sense::hover());
        let [r, g, b] = quad_colour(quad);
        ui.painter().rect_filled(rect, 2.0, Color32::from_rgb(r, g, b));
        response.on_hover_text(format!("quad {}", quad + 1));
    }
    let text = if count > MAX_SWATCHES { format!(" … {count}") } else { format!(" 1…{count}") };
    ui.label(RichText::new(text).color(FAINT_INK));
}
