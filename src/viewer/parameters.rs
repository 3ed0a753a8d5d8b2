//! The parameter panel: every entry of the parameter table as a widget.

use std::collections::HashMap;

use eframe::egui;
use egui::{Align, Color32, ComboBox, DragValue, Layout, Response, RichText, Slider, SliderClamping, Ui};
use rand::RngExt;

use super::document::Document;
use super::navigate;
use crate::scene::{Cost, Kind, Param, Raw, Value};

/// Groups of the panel: title, what it is about, sections of keys.
const GROUPS: [(&str, &str, &[&str]); 8] = [
    ("Curves", "The spatial fractal curves that give every cell its flow direction", &["curves"]),
    ("Volume", "The volume texture: cells, density, reflection", &["volume"]),
    ("Mapping", "How the volume lies on the quads", &["materials", "quads"]),
    ("Light", "Walk, attenuation, reflection and lights", &["trace", "light", "lights"]),
    (
        "Surroundings",
        "Rock, background and the light of the environment",
        &["rocks", "background", "environment", "sky"],
    ),
    ("Camera", "Where the picture is seen from", &["camera"]),
    ("Image", "Size, samples and tone of the picture", &["image"]),
    ("Animation", "What taki batch makes of the scene in time; ▶ plays the flow alone", &["animate"]),
];

/// Width of the names.
const NAME_WIDTH: f32 = 104.0;
/// Room for the number beside a slider, and for the marks at the end of a row.
const VALUE_WIDTH: f32 = 64.0;
const MARKS_WIDTH: f32 = 60.0;

/// The panel's own state.
#[derive(Default)]
pub struct ParameterPanel {
    /// Only parameters with this text in key, symbol or description are shown.
    pub search: String,
    fault: Option<String>,
}

/// What the panel says about costs.
#[derive(Clone, Copy, Default)]
pub struct Costs {
    /// Seconds the last volume took.
    pub volume_seconds: f64,
}

impl ParameterPanel {
    /// Shows the panel and applies what is changed in it.
    pub fn show(&mut self, ui: &mut Ui, document: &mut Document, costs: Costs) {
        ui.horizontal(|ui| {
            let hint = egui::TextEdit::singleline(&mut self.search).hint_text("Search parameters");
            let field = ui.add(hint.desired_width(ui.available_width() - 44.0));
            name(&field, "Search parameters");
            let clear = ui.add_enabled(!self.search.is_empty(), egui::Button::new("✖"));
            if clear.on_hover_text("Show all").clicked() {
                self.search.clear();
            }
        });
        if let Some(fault) = &self.fault {
            ui.colored_label(ui.visuals().error_fg_color, fault);
        }
        let keys = document.scene().keys();
        let search = self.search.trim().to_lowercase();
        let mut shown = 0;
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            // The scroll bar lies over the contents: it is not to hide the marks.
            ui.set_max_width(ui.available_width() - 8.0);
            for (title, about, sections) in GROUPS {
                let of_group = |key: &&String| sections.contains(&key.split('.').next().unwrap_or(""));
                let mut found: Vec<&String> =
                    keys.iter().filter(of_group).filter(|key| matches(key, &search)).collect();
                together(&mut found);
                shown += found.len();
                if !found.is_empty() {
                    self.group(ui, document, costs, (title, about), &found, !search.is_empty());
                }
            }
            if shown == 0 {
                ui.label("No parameter has this in its name or description.");
            }
        });
    }

    fn group(
        &mut self,
        ui: &mut Ui,
        document: &mut Document,
        costs: Costs,
        (title, about): (&str, &str),
        keys: &[&String],
        searching: bool,
    ) {
        let changed: Vec<String> =
            keys.iter().filter(|key| document.differs(key)).map(|key| key.to_string()).collect();
        let id = ui.make_persistent_id(("group", title));
        let open_at_first = matches!(title, "Curves" | "Volume" | "Light");
        let mut state =
            egui::collapsing_header::CollapsingState::load_with_default_open(ui.ctx(), id, open_at_first);
        if searching {
            state.set_open(true);
        }
        let mut reset = false;
        let header = state.show_header(ui, |ui| {
            ui.strong(title).on_hover_text(about);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if !changed.is_empty() {
                    let button = ui.small_button("⟲").on_hover_text(format!("Reset {title}"));
                    name(&button, &format!("Reset {title}"));
                    reset = button.clicked();
                    ui.weak(format!("{} changed", changed.len()));
                }
            });
        });
        header.body_unindented(|ui| {
            let mut open = String::new();
            for key in keys {
                let place = place(key);
                if place != open && place.contains('.') {
                    ui.add_space(4.0);
                    ui.label(RichText::new(place.replace('.', " · ")).italics());
                }
                open = place.into();
                self.row(ui, document, costs, key);
                let environment = document.scene().environment.as_ref();
                if let Some(environment) = environment.filter(|_| *key == "environment.lights") {
                    ui.weak(environment.words());
                }
            }
            ui.add_space(6.0);
        });
        if reset {
            document.reset(&changed);
        }
    }

    fn row(&mut self, ui: &mut Ui, document: &mut Document, costs: Costs, key: &str) {
        let Some(param) = Param::find(key) else { return };
        let value = document.values().get(key);
        let mut edit = None;
        if let Value::Corners(corners) = &value {
            self.corners(ui, document, key, param, corners);
            return;
        }
        ui.horizontal(|ui| {
            let label = egui::Label::new(short(key, param)).truncate().sense(egui::Sense::click());
            let label = ui
                .allocate_ui_with_layout(
                    egui::vec2(NAME_WIDTH, ui.spacing().interact_size.y),
                    Layout::left_to_right(Align::Center),
                    |ui| {
                        ui.set_min_width(NAME_WIDTH);
                        ui.add(label)
                    },
                )
                .inner;
            label.on_hover_ui(|ui| tooltip(ui, key, param, costs)).context_menu(|ui| {
                if ui.button("Copy the key").clicked() {
                    ui.ctx().copy_text(key.to_owned());
                }
                if ui.button("Copy as --set").clicked() {
                    ui.ctx().copy_text(format!("--set {key}={}", document.values().get(key).to_toml()));
                }
                if ui.button("Set to the default").clicked() {
                    document.reset_to_default(key);
                }
            });
            edit = widget(ui, document, key, param, &value);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let mark = ui.label(RichText::new("⏺").color(cost_color(ui, param.cost)).small());
                mark.on_hover_text(cost_words(param.cost, costs));
                if document.differs(key) {
                    let was = document.saved_value(key).to_toml();
                    let button = ui.small_button("⟲").on_hover_text(format!("Back to {was}"));
                    name(&button, &format!("Reset {key}"));
                    if button.clicked() {
                        document.reset(&[key.to_owned()]);
                    }
                }
            });
        });
        if let (Kind::Point(_), Value::Triple(t), true) = (param.kind, &value, key.ends_with(".direction")) {
            edit = edit.or(direction_angles(ui, key, *t));
        }
        self.apply(document, key, edit);
    }

    fn apply(&mut self, document: &mut Document, key: &str, edit: Option<Raw>) {
        if let Some(raw) = edit {
            self.fault = document.set(key, &raw, Some(key)).err().map(|e| e.to_string());
        }
    }

    fn corners(
        &mut self,
        ui: &mut Ui,
        document: &mut Document,
        key: &str,
        param: &Param,
        corners: &[[f64; 3]; 4],
    ) {
        let mut new = *corners;
        let mut changed = false;
        let header = egui::CollapsingHeader::new(short(key, param)).id_salt(key).show(ui, |ui| {
            for (corner, letter) in new.iter_mut().zip(["A", "B", "C", "D"]) {
                ui.horizontal(|ui| {
                    ui.label(letter);
                    changed |= triple(ui, &format!("{key} {letter}"), corner, 0.02);
                });
            }
        });
        header.header_response.on_hover_ui(|ui| tooltip(ui, key, param, Costs::default()));
        if changed {
            let raw = Raw::List(new.iter().map(|p| list(*p)).collect());
            self.apply(document, key, Some(raw));
        }
    }
}

/// The part of a key before its last: `lights.sun` of `lights.sun.color`.
fn place(key: &str) -> &str {
    key.rsplit_once('.').map_or("", |(place, _)| place)
}

/// Brings what belongs to one light, quad or rock together, in the order in which they first appear: the
/// table goes parameter by parameter.
fn together(keys: &mut [&String]) {
    let mut first = HashMap::new();
    for (i, key) in keys.iter().enumerate() {
        first.entry(place(key)).or_insert(i);
    }
    keys.sort_by_key(|key| first.get(place(key)).copied());
}

fn matches(key: &str, search: &str) -> bool {
    let Some(param) = Param::find(key) else { return false };
    let text = format!("{key} {} {} {}", param.symbol, param.doc, param.cost.word()).to_lowercase();
    search.split_whitespace().all(|word| text.contains(word))
}

/// The last part of a key, with the paper's symbol.
fn short(key: &str, param: &Param) -> String {
    let last = key.rsplit('.').next().unwrap_or(key);
    match param.symbol {
        "" => last.into(),
        symbol if symbol == last => last.into(),
        symbol => format!("{last} {symbol}"),
    }
}

/// Gives a widget the name that screen readers and tests know it by.
pub fn name(response: &Response, label: &str) {
    response.ctx.accesskit_node_builder(response.id, |node| node.set_label(label.to_owned()));
}

fn tooltip(ui: &mut Ui, key: &str, param: &Param, costs: Costs) {
    ui.set_max_width(320.0);
    ui.strong(key);
    ui.label(param.doc);
    let unit = if param.unit.is_empty() { String::new() } else { format!(" {}", param.unit) };
    ui.weak(format!("{}{unit}; default {}", param.range(), param.default_words()));
    ui.weak(cost_words(param.cost, costs));
}

/// The colour of a cost's mark.
pub fn cost_color(ui: &Ui, cost: Cost) -> Color32 {
    let dark = ui.visuals().dark_mode;
    match (cost, dark) {
        (Cost::Uniform, true) => Color32::from_rgb(96, 190, 120),
        (Cost::Uniform, false) => Color32::from_rgb(30, 130, 60),
        (Cost::Upload, true) => Color32::from_rgb(224, 180, 80),
        (Cost::Upload, false) => Color32::from_rgb(165, 110, 0),
        (Cost::Volume, true) => Color32::from_rgb(232, 120, 96),
        (Cost::Volume, false) => Color32::from_rgb(190, 60, 35),
    }
}

fn cost_words(cost: Cost, costs: Costs) -> String {
    match cost {
        Cost::Uniform => "A change costs a few bytes: only the picture is rendered again.".into(),
        Cost::Upload => "A change costs an upload: what is built is packed again and sent to the GPU.".into(),
        Cost::Volume if costs.volume_seconds > 0.0 => format!(
            "A change builds the volume again; the last build took {:.0} ms.",
            costs.volume_seconds * 1e3
        ),
        Cost::Volume => "A change builds the volume again.".into(),
    }
}

fn list(p: [f64; 3]) -> Raw {
    Raw::List(p.into_iter().map(Raw::Float).collect())
}

/// Three numbers in one row; whether one changed.
fn triple(ui: &mut Ui, key: &str, t: &mut [f64; 3], speed: f64) -> bool {
    let mut changed = false;
    let width = ((ui.available_width() - MARKS_WIDTH) / 3.0 - ui.spacing().item_spacing.x).max(36.0);
    for (x, axis) in t.iter_mut().zip(["x", "y", "z"]) {
        let drag = DragValue::new(x).speed(speed).max_decimals(3).update_while_editing(false).clip_text(true);
        let response = ui.add_sized([width, ui.spacing().interact_size.y], drag);
        name(&response, &format!("{key} {axis}"));
        changed |= response.changed();
    }
    changed
}

fn direction_angles(ui: &mut Ui, key: &str, t: [f64; 3]) -> Option<Raw> {
    let mut angles = navigate::angles(t.into());
    let mut changed = false;
    for (angle, (word, range)) in
        angles.iter_mut().zip([("azimuth", -180.0..=180.0), ("elevation", -89.0..=89.0)])
    {
        ui.horizontal(|ui| {
            ui.add_space(10.0);
            ui.allocate_ui_with_layout(
                egui::vec2(NAME_WIDTH - 10.0, ui.spacing().interact_size.y),
                Layout::left_to_right(Align::Center),
                |ui| {
                    ui.set_min_width(ui.available_width());
                    ui.weak(word);
                },
            );
            ui.spacing_mut().slider_width = slider_width(ui);
            let before = *angle;
            let slider = Slider::new(angle, range).suffix("°").max_decimals(1).update_while_editing(false);
            let response = ui.add(slider);
            name(&response, &format!("{key} {word}"));
            // A slider rounds what it is given: that alone is no change.
            changed |= response.changed() && (*angle - before).abs() > 0.051;
        });
    }
    changed.then(|| navigate::raw(navigate::direction(angles)))
}

fn slider_width(ui: &Ui) -> f32 {
    (ui.available_width() - VALUE_WIDTH - MARKS_WIDTH).max(40.0)
}

/// The widget of one value; what it was changed to.
fn widget(ui: &mut Ui, document: &Document, key: &str, param: &Param, value: &Value) -> Option<Raw> {
    let suffix = match param.unit {
        "" => String::new(),
        "°" => "°".into(),
        unit if unit.len() <= 4 => format!(" {unit}"),
        // Long units stand in the tooltip.
        _ => String::new(),
    };
    ui.spacing_mut().slider_width = slider_width(ui);
    match (param.kind, value) {
        (Kind::Float(min, max, default), Value::Float(x)) => {
            let mut new = *x;
            let (low, high) = param.slider.unwrap_or((min, max));
            let slider = Slider::new(&mut new, low..=high)
                .logarithmic(is_logarithmic(low, high, default))
                .smallest_positive((high * 1e-4).min(default.abs() * 0.1).max(1e-6))
                .clamping(SliderClamping::Never)
                .max_decimals(4)
                .update_while_editing(false)
                .suffix(suffix);
            let response = ui.add(slider);
            name(&response, key);
            // Typed numbers may lie beyond the slider, but not beyond what is allowed.
            (response.changed() && new != *x).then(|| Raw::Float(new.clamp(min, max)))
        }
        (Kind::Int(min, max, default), Value::Int(x)) => {
            let mut new = *x;
            let response = match param.slider {
                Some((low, high)) => ui.add(
                    Slider::new(&mut new, low as i64..=high as i64)
                        .logarithmic(is_logarithmic(low, high, default as f64))
                        .clamping(SliderClamping::Never)
                        .update_while_editing(false)
                        .suffix(if param.unit == "cells" { "" } else { &suffix }),
                ),
                None if max <= 64 => ui.add(Slider::new(&mut new, min..=max).update_while_editing(false)),
                None => {
                    let drag = DragValue::new(&mut new).range(min..=max).update_while_editing(false);
                    ui.add_sized([VALUE_WIDTH, ui.spacing().interact_size.y], drag)
                }
            };
            name(&response, key);
            if key.ends_with(".seed") {
                let dice = ui.button("🎲").on_hover_text("Another random seed");
                name(&dice, &format!("Dice {key}"));
                if dice.clicked() {
                    new = i64::from(rand::rng().random::<u32>() >> 4);
                }
            }
            (new != *x).then(|| Raw::Int(new.clamp(min, max)))
        }
        (Kind::Choice(words), Value::Text(word)) => {
            let mut new = word.clone();
            let combo = ComboBox::from_id_salt(key).selected_text(word).show_ui(ui, |ui| {
                for option in words {
                    ui.selectable_value(&mut new, (*option).to_owned(), *option);
                }
            });
            name(&combo.response, key);
            (new != *word).then_some(Raw::Text(new))
        }
        (Kind::Color(_), Value::Triple(t)) => color(ui, key, *t),
        (Kind::Point(_), Value::Triple(t)) => {
            let mut new = *t;
            let length = t.iter().map(|x| x * x).sum::<f64>().sqrt();
            triple(ui, key, &mut new, (length * 0.005).max(0.005)).then(|| list(new))
        }
        (Kind::Text(_), Value::Text(text)) if key.ends_with(".material") => {
            let mut new = text.clone();
            let combo = ComboBox::from_id_salt(key).selected_text(text).show_ui(ui, |ui| {
                let mut names = document.values().names("materials");
                if !names.iter().any(|n| n == "water") {
                    names.push("water".into());
                }
                for option in names {
                    ui.selectable_value(&mut new, option.clone(), option);
                }
            });
            name(&combo.response, key);
            (new != *text).then_some(Raw::Text(new))
        }
        (Kind::Text(_), Value::Text(text)) => {
            // Half a path is no path: the field keeps what is typed until it is left.
            let id = ui.make_persistent_id(("text", key));
            let mut typed = ui.data_mut(|d| d.get_temp::<String>(id)).unwrap_or_else(|| text.clone());
            let width = ui.available_width() - MARKS_WIDTH;
            let field = egui::TextEdit::singleline(&mut typed)
                .hint_text(if key == "volume.file" { "built" } else { "" })
                .desired_width(width);
            let response = ui.add(field);
            name(&response, key);
            if response.has_focus() {
                ui.data_mut(|d| d.insert_temp(id, typed.clone()));
                return None;
            }
            let entered = ui.data_mut(|d| d.remove_temp::<String>(id));
            entered.filter(|new| new != text).map(Raw::Text)
        }
        (Kind::Frames | Kind::Series, list) => {
            // Keyframes are written in the scene file.
            let label = egui::Label::new(egui::RichText::new(list.to_toml()).weak()).truncate();
            name(&ui.add(label), key);
            None
        }
        _ => None,
    }
}

/// Whether a slider over this range is easier with equal ratios than with equal steps.
fn is_logarithmic(low: f64, high: f64, default: f64) -> bool {
    let wide = high / low.max(1.0) >= 64.0;
    let small = default > 0.0 && default < 0.02 * high;
    low >= 0.0 && (wide || small)
}

/// A linear colour: the button holds its hue, the factor its brightness past 1.
fn color(ui: &mut Ui, key: &str, t: [f64; 3]) -> Option<Raw> {
    let factor = t.iter().copied().fold(1.0, f64::max);
    let mut rgb = t.map(|x| (x / factor) as f32);
    let mut scale = factor;
    let button = ui.color_edit_button_rgb(&mut rgb);
    name(&button, key);
    // The open picker turns the colour into hue and back: what that rounds is no change.
    let moved = |(new, old): (&f32, &f64)| (f64::from(*new) - old / factor).abs() > 1e-5;
    let picked = button.changed() && rgb.iter().zip(&t).any(moved);
    if factor > 1.0 {
        let drag = DragValue::new(&mut scale).range(1.0..=1e4).speed(0.02).prefix("× ").max_decimals(3);
        name(&ui.add(drag), &format!("{key} factor"));
    }
    ui.weak(format!("{:.3} {:.3} {:.3}", t[0], t[1], t[2]));
    let new = rgb.map(|x| f64::from(x) * scale);
    (picked || scale != factor).then(|| list(new))
}
