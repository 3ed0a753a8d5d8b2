//! The parameter panel, which shows a widget for each parameter of the scene.

pub mod lights;
mod list;
mod lobes;
mod meshes;
mod overview;
mod widget;

use std::collections::HashMap;

use eframe::egui;
use egui::collapsing_header::CollapsingState;
use egui::{Align, Color32, Layout, Response, RichText, Ui};

use super::document::Document;
use super::lights::Lights;
use super::meshes::Meshes;
use super::viewport::Selection;
use crate::scene::{Cost, Kind, Param, Raw, Scene, Value, WATER, is_of_other_builder, split_volume_key};
use lobes::LobesPlot;
use overview::Overview;
use widget::{Field, direction_angles, list, triple};

/// A group of the panel.
struct Group {
    title: &'static str,
    /// Tooltip of the title.
    about: &'static str,
    /// First parts of the keys in the group.
    sections: &'static [&'static str],
}

/// The groups of the panel, in order.
const GROUPS: [Group; 11] = [
    group("Curves", "The spatial fractal curves that give each cell its flow direction", &["curves"]),
    group(
        "Volume",
        "The volume texture: cells, density, reflection",
        &["volume", "fur", "cloth", "tress", "import", "mountain", "grains", "skin"],
    ),
    group("Volumes", "Other volumes beside the water, each with its curves", &["volumes"]),
    group(
        "Mapping",
        "How the volumes are mapped onto the quads",
        &["materials", "sheets", "splashes", "quads", "boxes"],
    ),
    group("Meshes", "", MESHES),
    group(
        "Light",
        "The walk through the cells, attenuation and reflection",
        &["trace", "light", "strand", "hair"],
    ),
    group("Lights", "", LIGHTS),
    group(
        "Surroundings",
        "Rock, pools, background, haze and environment light",
        &["rocks", "pools", "background", "haze", "environment", "sky"],
    ),
    group("Camera", "Position and view of the camera", &["camera"]),
    group("Image", "Size, samples and tone of the picture", &["image"]),
    group("Animation", "The animation that taki batch renders; ▶ plays only the flow", &["animate"]),
];

const fn group(title: &'static str, about: &'static str, sections: &'static [&'static str]) -> Group {
    Group { title, about, sections }
}

/// Sections of the groups that are shown as lists of lights and of meshes.
const LIGHTS: &[&str] = &["lights"];
const MESHES: &[&str] = &["meshes"];

/// Width of the names, points.
const NAME_WIDTH: f32 = 104.0;
/// Width of the number beside a slider, points.
const VALUE_WIDTH: f32 = 64.0;
/// Width of the marks at the end of a row, points.
const MARKS_WIDTH: f32 = 60.0;

/// State of the panel.
#[derive(Default)]
pub struct ParameterPanel {
    /// Search text. The panel shows only parameters that have all its words in their key, symbol,
    /// descriptions or cost.
    pub search: String,
    /// Why the last edit was refused.
    fault: Option<String>,
    lobes: LobesPlot,
    overview: Overview,
}

/// Measured costs that the panel's tooltips mention.
#[derive(Clone, Copy, Default)]
pub struct Costs {
    /// Time that the last volume took, seconds.
    pub volume_seconds: f64,
}

/// The scene that the panel edits, and the settings of one frame.
struct Context<'a> {
    document: &'a mut Document,
    lights: &'a mut Lights,
    meshes: &'a mut Meshes,
    costs: Costs,
    /// The search text, trimmed and in lower case.
    search: String,
}

impl Context<'_> {
    fn is_searching(&self) -> bool {
        !self.search.is_empty()
    }
}

impl ParameterPanel {
    /// Shows the panel and applies the user's edits.
    pub fn show(&mut self, ui: &mut Ui, document: &mut Document, selection: Selection, costs: Costs) {
        ui.horizontal(|ui| {
            let hint = egui::TextEdit::singleline(&mut self.search).hint_text("Search parameters");
            let field = ui.add(hint.desired_width(ui.available_width() - 44.0));
            name(&field, "Search parameters");
            let clear = ui.add_enabled(!self.search.is_empty(), egui::Button::new("✖"));
            if clear.on_hover_text("Show all parameters").clicked() {
                self.search.clear();
            }
        });
        if let Some(fault) = &self.fault {
            ui.colored_label(ui.visuals().error_fg_color, fault);
        }
        let keys = document.scene().keys();
        let search = self.search.trim().to_lowercase();
        let order = order(document.scene());
        let Selection { lights, meshes } = selection;
        let mut context = Context { document, lights, meshes, costs, search };
        let mut shown = 0;
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            // The scroll bar is drawn over the contents, and must not hide the marks.
            ui.set_max_width(ui.available_width() - 8.0);
            for group in order {
                if group.sections == LIGHTS {
                    shown += self.lights(ui, &mut context);
                    continue;
                }
                if group.sections == MESHES {
                    shown += self.meshes(ui, &mut context);
                    continue;
                }
                let in_group = |key: &&String| group.sections.contains(&key.split('.').next().unwrap_or(""));
                // What another builder would take has no row.
                let values = context.document.values();
                let in_group = keys.iter().filter(in_group).filter(|key| !is_of_other_builder(values, key));
                let matching = in_group.filter(|key| matches(key, &context.search));
                let mut keys: Vec<&String> = matching.collect();
                sort_by_parent(&mut keys);
                keys.sort_by_cached_key(|key| !has_shown_volume(context.document.scene(), key));
                shown += keys.len();
                if !keys.is_empty() {
                    self.group(ui, &mut context, group, &keys);
                }
            }
            if shown == 0 {
                ui.label("No parameter matches the search.");
            }
        });
    }

    fn group(&mut self, ui: &mut Ui, context: &mut Context, group: &Group, keys: &[&String]) {
        let title = group.title;
        let changed: Vec<String> =
            keys.iter().filter(|key| context.document.differs(key)).map(|key| key.to_string()).collect();
        // A group of a volume that no surface shows is another one, and folded at first.
        let is_shown = keys.iter().any(|key| has_shown_volume(context.document.scene(), key));
        let id = ui.make_persistent_id(("group", title, is_shown));
        let open_at_first = match title {
            "Curves" | "Volume" => is_shown,
            "Volumes" => is_shown && !shows_water(context.document.scene()),
            title => title == "Light",
        };
        let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, open_at_first);
        if context.is_searching() {
            state.set_open(true);
        }
        let mut reset = false;
        let header = state.show_header(ui, |ui| {
            ui.strong(title).on_hover_text(group.about);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if !changed.is_empty() {
                    let button = ui.small_button("⟲").on_hover_text(format!("Reset {title}"));
                    name(&button, &format!("Reset {title}"));
                    reset = button.clicked();
                    ui.weak(format!("{} changed", changed.len()));
                }
            });
        });
        header.body_unindented(|ui| self.group_body(ui, context, keys));
        if reset {
            context.document.reset(&changed);
        }
    }

    /// The rows of a group, with a heading for each light, quad or rock, and the pictures that belong to a
    /// row.
    fn group_body(&mut self, ui: &mut Ui, context: &mut Context, keys: &[&String]) {
        let mut heading = String::new();
        for key in keys {
            let parent = parent(key);
            if parent != heading && parent.contains('.') {
                ui.add_space(4.0);
                ui.label(RichText::new(parent.replace('.', " · ")).italics());
            }
            heading = parent.into();
            self.row(ui, context, key);
            let scene = context.document.scene();
            match (key.as_str(), &scene.environment) {
                ("environment.kind", Some(environment)) => {
                    self.overview.show(ui, environment, &scene.image);
                }
                ("environment.lights", Some(environment)) => {
                    ui.weak(environment.words());
                }
                _ => {}
            }
        }
        if keys.iter().any(|key| *key == "light.reflection") {
            let document = &context.document;
            self.lobes.show(ui, document.scene(), document.values(), context.lights.selected());
        }
        ui.add_space(6.0);
    }

    /// One parameter: its name, its widget, and its marks.
    fn row(&mut self, ui: &mut Ui, context: &mut Context, key: &str) {
        let Some(param) = Param::find(key) else { return };
        let (document, costs) = (&mut *context.document, context.costs);
        let value = document.values().get(key);
        if let Value::Corners(corners) = &value {
            self.corners(ui, document, key, param, corners);
            return;
        }
        let mut edit = None;
        ui.horizontal(|ui| {
            key_label(ui, document, key, param, costs);
            edit = Field { document, key, param }.show(ui, &value);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let mark = ui.label(RichText::new("⏺").color(cost_color(ui, param.cost)).small());
                mark.on_hover_text(cost_text(param.cost, costs));
                if document.differs(key) {
                    let saved = document.saved_value(key).to_toml();
                    let button = ui.small_button("⟲").on_hover_text(format!("Reset to {saved}"));
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

    /// The four corners of a quad, under a fold of their own.
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
        let header = egui::CollapsingHeader::new(short_name(key, param)).id_salt(key).show(ui, |ui| {
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

/// The groups in their order, with those of the water last where no surface shows it.
fn order(scene: &Scene) -> Vec<&'static Group> {
    let of_water = |group: &&Group| ["curves", "volume"].contains(&group.sections[0]);
    let (water, others): (Vec<&Group>, Vec<&Group>) = GROUPS.iter().partition(of_water);
    match shows_water(scene) {
        true => GROUPS.iter().collect(),
        false => others.into_iter().chain(water).collect(),
    }
}

/// Whether a surface shows the volume `water`.
fn shows_water(scene: &Scene) -> bool {
    scene.recipes.iter().any(|recipe| recipe.name == WATER)
}

/// Whether a surface shows the volume that a key belongs to; true for other keys.
fn has_shown_volume(scene: &Scene, key: &str) -> bool {
    split_volume_key(key).is_none_or(|(name, _)| scene.recipes.iter().any(|recipe| recipe.name == name))
}

/// The name of a parameter, with a tooltip and a context menu.
fn key_label(ui: &mut Ui, document: &mut Document, key: &str, param: &Param, costs: Costs) {
    let label = egui::Label::new(short_name(key, param)).truncate().sense(egui::Sense::click());
    let size = egui::vec2(NAME_WIDTH, ui.spacing().interact_size.y);
    let label = ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_width(NAME_WIDTH);
        ui.add(label)
    });
    label.inner.on_hover_ui(|ui| tooltip(ui, key, param, costs)).context_menu(|ui| {
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
}

/// A key without its last part: `lights.sun` of `lights.sun.color`.
fn parent(key: &str) -> &str {
    key.rsplit_once('.').map_or("", |(parent, _)| parent)
}

/// Sorts the keys of each light, quad or rock together, in the order in which these first appear. The
/// parameter table lists them parameter by parameter instead.
fn sort_by_parent(keys: &mut [&String]) {
    let mut first = HashMap::new();
    for (i, key) in keys.iter().enumerate() {
        first.entry(parent(key)).or_insert(i);
    }
    keys.sort_by_key(|key| first.get(parent(key)).copied());
}

/// Whether a parameter has all words of the search text.
fn matches(key: &str, search: &str) -> bool {
    let Some(param) = Param::find(key) else { return false };
    let words = [param.symbol, param.doc, param.when, param.cost.word()].join(" ");
    let text = format!("{key} {}", plain(&words)).to_lowercase();
    search.split_whitespace().all(|word| text.contains(word))
}

/// Text of the parameter table without Markdown's backticks.
fn plain(words: &str) -> String {
    words.replace('`', "")
}

/// The last part of a key, with the paper's symbol.
fn short_name(key: &str, param: &Param) -> String {
    let last = key.rsplit('.').next().unwrap_or(key);
    match param.symbol {
        "" => last.into(),
        symbol if symbol == last => last.into(),
        symbol => format!("{last} {symbol}"),
    }
}

/// Sets the name by which screen readers and tests find a widget.
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
    ui.weak(cost_text(param.cost, costs));
}

/// Colour of the mark of a cost.
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

fn cost_text(cost: Cost, costs: Costs) -> String {
    match cost {
        Cost::Uniform => "A change uploads a few bytes and renders the picture again.".into(),
        Cost::Upload => "A change packs existing data again and uploads it to the GPU.".into(),
        Cost::Volume if costs.volume_seconds > 0.0 => {
            format!("A change rebuilds the volume. The last build took {:.0} ms.", costs.volume_seconds * 1e3)
        }
        Cost::Volume => "A change rebuilds the volume.".into(),
    }
}
