//! The parameter panel: every entry of the parameter table as a widget.

pub mod lights;
mod lobes;
mod overview;
mod widget;

use std::collections::HashMap;

use eframe::egui;
use egui::{Align, Color32, Layout, Response, RichText, Ui};

use super::document::Document;
use super::lights::Lights;
use crate::scene::{Cost, Kind, Param, Raw, Value};
use lobes::LobesPlot;
use overview::Overview;
use widget::{direction_angles, list, triple, widget};

/// Groups of the panel: title, what it is about, sections of keys.
const GROUPS: [(&str, &str, &[&str]); 9] = [
    ("Curves", "The spatial fractal curves that give every cell its flow direction", &["curves"]),
    ("Volume", "The volume texture: cells, density, reflection", &["volume"]),
    ("Mapping", "How the volume lies on the quads", &["materials", "sheets", "splashes", "quads"]),
    ("Light", "Walk, attenuation and reflection", &["trace", "light", "strand"]),
    ("Lights", "", LIGHTS),
    (
        "Surroundings",
        "Rock, pools, background, haze and the light of the environment",
        &["rocks", "pools", "background", "haze", "environment", "sky"],
    ),
    ("Camera", "Where the picture is seen from", &["camera"]),
    ("Image", "Size, samples and tone of the picture", &["image"]),
    ("Animation", "What taki batch makes of the scene in time; ▶ plays the flow alone", &["animate"]),
];

/// The group that is a list of its own.
const LIGHTS: &[&str] = &["lights"];

/// Width of the names.
const NAME_WIDTH: f32 = 104.0;
/// Room for the number beside a slider, and for the marks at the end of a row.
const VALUE_WIDTH: f32 = 64.0;
const MARKS_WIDTH: f32 = 60.0;

/// The panel's own state.
#[derive(Default)]
pub struct ParameterPanel {
    /// Only parameters with these words in their key, symbol, description or cost are shown.
    pub search: String,
    fault: Option<String>,
    lobes: LobesPlot,
    overview: Overview,
}

/// What the panel says about costs.
#[derive(Clone, Copy, Default)]
pub struct Costs {
    /// Seconds the last volume took.
    pub volume_seconds: f64,
}

impl ParameterPanel {
    /// Shows the panel and applies what is changed in it.
    pub fn show(&mut self, ui: &mut Ui, document: &mut Document, lights: &mut Lights, costs: Costs) {
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
                if sections == LIGHTS {
                    shown += self.lights(ui, document, lights, costs, &search);
                    continue;
                }
                let of_group = |key: &&String| sections.contains(&key.split('.').next().unwrap_or(""));
                let mut found: Vec<&String> =
                    keys.iter().filter(of_group).filter(|key| matches(key, &search)).collect();
                together(&mut found);
                shown += found.len();
                if !found.is_empty() {
                    self.group(ui, (document, lights), costs, (title, about), &found, !search.is_empty());
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
        (document, lights): (&mut Document, &Lights),
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
                match (key.as_str(), environment) {
                    ("environment.kind", Some(environment)) => {
                        self.overview.show(ui, environment, &document.scene().image);
                    }
                    ("environment.lights", Some(environment)) => {
                        ui.weak(environment.words());
                    }
                    _ => {}
                }
            }
            if keys.iter().any(|key| *key == "light.reflection") {
                self.lobes.show(ui, document.scene(), document.values(), lights.selected());
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
    let words = [param.symbol, param.doc, param.when, param.cost.word()].join(" ");
    let text = format!("{key} {}", plain(&words)).to_lowercase();
    search.split_whitespace().all(|word| text.contains(word))
}

/// The table's words without the backticks of Markdown.
fn plain(words: &str) -> String {
    words.replace('`', "")
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
    ui.label(plain(param.doc));
    ui.label(plain(param.when));
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
