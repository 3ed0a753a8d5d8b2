//! The list of lights. Each has a switch, its colour, its name, and the parameters of its kind.

use eframe::egui;
use egui::collapsing_header::CollapsingState;
use egui::{Align, Layout, Ui};

use super::list::{self, Line};
use super::widget::color_button;
use super::{Context, ParameterPanel, matches, name};
use crate::scene::{PARAMS, Raw};
use crate::viewer::document::Document;
use crate::viewer::lights::{Lights, edit};

/// The user's command in the entry of one light.
enum Command {
    Switch,
    Color(Raw),
    InList(list::Command),
}

impl ParameterPanel {
    /// Shows the group of the lights. Returns the number of their parameters that are shown, but at least 1
    /// without a search.
    pub(super) fn lights(&mut self, ui: &mut Ui, context: &mut Context) -> usize {
        let names = context.document.values().names("lights");
        let entries: Vec<(String, Vec<String>)> = names
            .iter()
            .map(|light| (light.clone(), keys(context.document, light, &context.search)))
            .filter(|(_, keys)| !context.is_searching() || !keys.is_empty())
            .collect();
        if entries.is_empty() && context.is_searching() {
            return 0;
        }
        let id = ui.make_persistent_id(("group", "Lights"));
        let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, true);
        if context.is_searching() || context.lights.unfold.is_some() {
            state.set_open(true);
        }
        let (mut kind, mut reset) = (None, false);
        let header = state.show_header(ui, |ui| {
            ui.strong("Lights").on_hover_text("Lights that shine on the water and the rock");
            ui.weak(names.len().to_string());
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let menu = ui.menu_button("➕", |ui| kind = add_menu(ui));
                name(&menu.response, "Add a light");
                menu.response.on_hover_text("Add a light");
                if context.document.section_differs("lights") {
                    let button = ui.small_button("⟲").on_hover_text("Reset Lights");
                    name(&button, "Reset Lights");
                    reset = button.clicked();
                    ui.weak("changed");
                }
            });
        });
        header.body_unindented(|ui| {
            if names.is_empty() {
                ui.weak("No lights except the surroundings.");
            }
            for (light, keys) in &entries {
                let to_unfold = context.lights.unfold.as_ref() == Some(light);
                if !to_unfold && list::is_out_of_sight(ui, entries.len(), fold_id(ui, light)) {
                    ui.add_space(ui.spacing().interact_size.y);
                    continue;
                }
                self.light(ui, context, light, keys, names.len() == 1);
            }
            ui.add_space(6.0);
        });
        if reset {
            context.document.reset_section("lights");
        }
        if let Some(kind) = kind {
            self.fault = context.lights.add(context.document, kind).err().map(|e| e.to_string());
        }
        let shown: usize = entries.iter().map(|(_, keys)| keys.len()).sum();
        shown.max(usize::from(!context.is_searching()))
    }

    /// Shows the entry of one light with its parameters, and applies the user's command.
    fn light(&mut self, ui: &mut Ui, context: &mut Context, light: &str, keys: &[String], only_one: bool) {
        let id = fold_id(ui, light);
        let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, only_one);
        if context.is_searching() {
            state.set_open(true);
        }
        let unfolded = context.lights.unfold.take_if(|unfold| unfold == light).is_some();
        if unfolded {
            state.set_open(true);
        }
        let mut command = None;
        let header = state.show_header(ui, |ui| command = entry(ui, context.document, context.lights, light));
        let (_, header, _) = header.body(|ui| {
            for key in keys {
                self.row(ui, context, key);
            }
            ui.add_space(4.0);
        });
        if unfolded {
            header.response.scroll_to_me(None);
        }
        if let Some(command) = command {
            let is_open = CollapsingState::load_with_default_open(ui.ctx(), id, only_one).is_open();
            self.fault = apply(ui, context, light, command, is_open);
        }
    }
}

/// Applies a command to a light, whose entry in the list is open or folded. Returns why it failed, if it did.
fn apply(ui: &Ui, context: &mut Context, light: &str, command: Command, is_open: bool) -> Option<String> {
    let (document, lights) = (&mut *context.document, &mut *context.lights);
    match command {
        Command::Switch => return lights.switch(document, light).err().map(|e| e.to_string()),
        Command::Color(raw) => {
            let key = format!("lights.{light}.color");
            return document.set(&key, &raw, Some(&key)).err().map(|e| e.to_string());
        }
        Command::InList(list::Command::Select) => {
            let selected = lights.selected() == Some(light);
            lights.select((!selected).then_some(light));
        }
        Command::InList(list::Command::BeginRenaming) => lights.begin_renaming(light),
        Command::InList(list::Command::Rename(new)) => {
            let result = lights.rename(document, light, &new);
            return list::renamed(ui, &mut lights.renaming, result, (fold_id(ui, &new), is_open));
        }
        Command::InList(list::Command::KeepName) => lights.renaming = None,
        Command::InList(list::Command::Duplicate) => lights.duplicate(document, light),
        Command::InList(list::Command::Remove) => lights.remove(document, light),
    }
    None
}

/// Shows a menu of the kinds of light. Returns the kind that was chosen.
pub fn add_menu(ui: &mut Ui) -> Option<&'static str> {
    let mut chosen = None;
    for kind in edit::kinds() {
        let about = match *kind {
            "directional" => "Parallel light from infinitely far away, like the sun",
            "point" => "Light from a point in all directions",
            "spot" => "Light from a point within a cone",
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

/// The line of one light: its switch, colour, name, and buttons. Returns the user's command.
fn entry(ui: &mut Ui, document: &Document, lights: &mut Lights, light: &str) -> Option<Command> {
    let key = |what: &str| format!("lights.{light}.{what}");
    let on = document.values().float(&key("intensity")) > 0.0;
    let switched = list::eye(ui, on, format!("Switch {light} {}", if on { "off" } else { "on" }));
    let color = document.values().triple(&key("color")).to_array().map(f64::from);
    let picked = color_button(ui, &format!("Colour of {light}"), color);
    let line = Line {
        noun: "Light",
        name: light,
        tip: "Click to select it, then move or turn it in the picture; double click to rename it",
        selected: lights.selected() == Some(light),
    };
    let in_list = line.show(ui, &mut lights.renaming).map(Command::InList);
    in_list.or(switched.then_some(Command::Switch)).or(picked.map(Command::Color))
}

/// The keys that a light of its kind has and that match the search.
fn keys(document: &Document, light: &str, search: &str) -> Vec<String> {
    let kind = document.values().text(&format!("lights.{light}.kind"));
    let parts = PARAMS.iter().filter_map(|param| param.key.strip_prefix("lights.*."));
    let keys = parts.filter(|what| edit::takes(&kind, what)).map(|what| format!("lights.{light}.{what}"));
    keys.filter(|key| matches(key, search)).collect()
}

/// Id under which egui keeps whether the entry of a light is folded.
fn fold_id(ui: &Ui, light: &str) -> egui::Id {
    ui.make_persistent_id(("light", light))
}
