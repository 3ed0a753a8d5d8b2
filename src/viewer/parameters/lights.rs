//! The list of lights: each with a switch, its colour, its name, and the parameters its kind has.

use eframe::egui;
use egui::collapsing_header::CollapsingState;
use egui::{Align, Button, Layout, Rect, Response, Ui};

use super::widget::color_button;
use super::{Costs, ParameterPanel, matches, name};
use crate::scene::{PARAMS, Raw};
use crate::viewer::document::Document;
use crate::viewer::lights::{Lights, edit};

/// Of more lights than this those that are folded and scrolled away are left out: every frame would lay out
/// thousands of buttons.
const MANY: usize = 200;

/// What is asked of one light.
enum Ask {
    Select,
    Switch,
    Color(Raw),
    BeginRenaming,
    Rename(String),
    KeepName,
    Duplicate,
    Remove,
}

impl ParameterPanel {
    /// The group of the lights; how many parameters of theirs are shown.
    pub(super) fn lights(
        &mut self,
        ui: &mut Ui,
        document: &mut Document,
        lights: &mut Lights,
        costs: Costs,
        search: &str,
    ) -> usize {
        let names = document.values().names("lights");
        let found: Vec<(String, Vec<String>)> = names
            .iter()
            .map(|light| (light.clone(), keys(document, light, search)))
            .filter(|(_, keys)| search.is_empty() || !keys.is_empty())
            .collect();
        if found.is_empty() && !search.is_empty() {
            return 0;
        }
        let id = ui.make_persistent_id(("group", "Lights"));
        let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, true);
        if !search.is_empty() || lights.unfold.is_some() {
            state.set_open(true);
        }
        let (mut kind, mut reset) = (None, false);
        let header = state.show_header(ui, |ui| {
            ui.strong("Lights").on_hover_text("What shines on the water and the rock");
            ui.weak(names.len().to_string());
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let menu = ui.menu_button("➕", |ui| kind = add_menu(ui));
                name(&menu.response, "Add a light");
                menu.response.on_hover_text("Add a light");
                if document.section_differs("lights") {
                    let button = ui.small_button("⟲").on_hover_text("Reset Lights");
                    name(&button, "Reset Lights");
                    reset = button.clicked();
                    ui.weak("changed");
                }
            });
        });
        header.body_unindented(|ui| {
            if names.is_empty() {
                ui.weak("No light but the surroundings'.");
            }
            for (light, keys) in &found {
                let to_unfold = lights.unfold.as_ref() == Some(light);
                if found.len() > MANY && !to_unfold && is_out_of_sight(ui, light) {
                    ui.add_space(ui.spacing().interact_size.y);
                    continue;
                }
                self.light(ui, document, lights, costs, (light, keys, !search.is_empty(), names.len() == 1));
            }
            ui.add_space(6.0);
        });
        if reset {
            document.reset_section("lights");
        }
        if let Some(kind) = kind {
            self.fault = lights.add(document, kind).err().map(|e| e.to_string());
        }
        found.iter().map(|(_, keys)| keys.len()).sum::<usize>().max(usize::from(search.is_empty()))
    }

    fn light(
        &mut self,
        ui: &mut Ui,
        document: &mut Document,
        lights: &mut Lights,
        costs: Costs,
        (light, keys, searching, alone): (&str, &[String], bool, bool),
    ) {
        let id = fold(ui, light);
        let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, alone);
        if searching {
            state.set_open(true);
        }
        let unfolded = lights.unfold.take_if(|unfold| unfold == light).is_some();
        if unfolded {
            state.set_open(true);
        }
        let mut ask = None;
        let header = state.show_header(ui, |ui| ask = entry(ui, document, lights, light));
        let (_, header, _) = header.body(|ui| {
            for key in keys {
                self.row(ui, document, costs, key);
            }
            ui.add_space(4.0);
        });
        if unfolded {
            header.response.scroll_to_me(None);
        }
        let Some(ask) = ask else { return };
        let open = CollapsingState::load_with_default_open(ui.ctx(), id, alone).is_open();
        self.fault = match ask {
            Ask::Select => {
                let selected = lights.selected() == Some(light);
                lights.select((!selected).then_some(light));
                None
            }
            Ask::Switch => lights.switch(document, light).err().map(|e| e.to_string()),
            Ask::Color(raw) => {
                let key = format!("lights.{light}.color");
                document.set(&key, &raw, Some(&key)).err().map(|e| e.to_string())
            }
            Ask::BeginRenaming => {
                lights.begin_renaming(light);
                None
            }
            Ask::Rename(new) => match lights.rename(document, light, &new) {
                Ok(()) => {
                    lights.renaming = None;
                    let mut state = CollapsingState::load_with_default_open(ui.ctx(), fold(ui, &new), open);
                    state.set_open(open);
                    state.store(ui.ctx());
                    None
                }
                Err(fault) => match lights.renaming.as_mut().filter(|renaming| !renaming.begun) {
                    Some(renaming) => {
                        renaming.fault = Some(fault);
                        None
                    }
                    None => {
                        lights.renaming = None;
                        Some(fault)
                    }
                },
            },
            Ask::KeepName => {
                lights.renaming = None;
                None
            }
            Ask::Duplicate => {
                lights.duplicate(document, light);
                None
            }
            Ask::Remove => {
                lights.remove(document, light);
                None
            }
        };
    }
}

/// The kinds to choose from; the one that is chosen.
pub fn add_menu(ui: &mut Ui) -> Option<&'static str> {
    let mut chosen = None;
    for kind in edit::kinds() {
        let about = match *kind {
            "directional" => "From infinitely far, as the sun",
            "point" => "From a point, to all sides",
            "spot" => "From a point, in a cone",
            _ => "",
        };
        let button = ui.button(format!("Add {kind}")).on_hover_text(about);
        if button.clicked() {
            chosen = Some(*kind);
            ui.close();
        }
    }
    chosen
}

/// The line of one light.
fn entry(ui: &mut Ui, document: &Document, lights: &mut Lights, light: &str) -> Option<Ask> {
    let mut ask = None;
    let clicked = |response: Response, words: String| {
        name(&response, &words);
        response.on_hover_text(words).clicked()
    };
    let key = |what: &str| format!("lights.{light}.{what}");
    let on = document.values().float(&key("intensity")) > 0.0;
    let eye = ui.add(Button::selectable(on, "👁").small());
    if clicked(eye, format!("Switch {light} {}", if on { "off" } else { "on" })) {
        ask = Some(Ask::Switch);
    }
    let color = document.values().triple(&key("color")).to_array().map(f64::from);
    let chip = color_button(ui, &format!("Colour of {light}"), color);
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        for (sign, word, what) in [
            ("🗑", "Remove", Ask::Remove),
            ("🗐", "Duplicate", Ask::Duplicate),
            ("✏", "Rename", Ask::BeginRenaming),
        ] {
            if clicked(ui.small_button(sign), format!("{word} {light}")) {
                ask = Some(what);
            }
        }
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            if let Some(renaming) = lights.renaming.as_mut().filter(|renaming| renaming.light == light) {
                let field = egui::TextEdit::singleline(&mut renaming.text);
                let mut field = ui.add(field.desired_width(ui.available_width()));
                name(&field, &format!("Name of {light}"));
                if !renaming.begun {
                    renaming.begun = true;
                    field.request_focus();
                }
                if let Some(fault) = &renaming.fault {
                    field = field.highlight();
                    field.show_tooltip_text(fault);
                }
                if field.changed() {
                    renaming.fault = None;
                }
                if field.lost_focus() {
                    let pressed = |key| ui.input(|i| i.key_pressed(key));
                    // A name that is refused is written on, unless something else was clicked.
                    renaming.begun = !pressed(egui::Key::Enter);
                    let new = renaming.text.trim().to_owned();
                    ask = Some(if pressed(egui::Key::Escape) { Ask::KeepName } else { Ask::Rename(new) });
                }
                return;
            }
            let selected = lights.selected() == Some(light);
            let button = ui.add(Button::selectable(selected, light).truncate());
            if button.double_clicked() {
                ask = Some(Ask::BeginRenaming);
            } else if button.clicked() {
                ask = Some(Ask::Select);
            }
            name(&button, &format!("Light {light}"));
            button.on_hover_text("Select, to move or turn it in the picture; double click to rename");
        });
    });
    ask.or(chip.map(Ask::Color))
}

/// The keys of a light that mean anything for its kind and match the search.
fn keys(document: &Document, light: &str, search: &str) -> Vec<String> {
    let kind = document.values().text(&format!("lights.{light}.kind"));
    let parts = PARAMS.iter().filter_map(|param| param.key.strip_prefix("lights.*."));
    let keys = parts.filter(|what| edit::takes(&kind, what)).map(|what| format!("lights.{light}.{what}"));
    keys.filter(|key| matches(key, search)).collect()
}

fn is_out_of_sight(ui: &Ui, light: &str) -> bool {
    let row = Rect::from_min_size(ui.cursor().min, ui.spacing().interact_size);
    let open = CollapsingState::load(ui.ctx(), fold(ui, light)).is_some_and(|state| state.is_open());
    !open && !ui.is_rect_visible(row)
}

/// What the entry of a light is known by while it is folded and unfolded.
fn fold(ui: &Ui, light: &str) -> egui::Id {
    ui.make_persistent_id(("light", light))
}
