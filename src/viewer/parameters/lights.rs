//! The list of lights. Each has a switch, its colour, its name, and the parameters of its kind.

use eframe::egui;
use egui::collapsing_header::CollapsingState;
use egui::{Align, Button, Layout, Rect, Response, Ui};

use super::widget::color_button;
use super::{Context, ParameterPanel, matches, name};
use crate::scene::{PARAMS, Raw};
use crate::viewer::document::Document;
use crate::viewer::lights::{Lights, Renaming, edit};

/// In a longer list, folded entries that are scrolled out of sight are skipped. Otherwise each frame would
/// lay out thousands of buttons.
const MAX_LAID_OUT: usize = 200;

/// The user's command in the entry of one light.
enum Command {
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
                if entries.len() > MAX_LAID_OUT && !to_unfold && is_out_of_sight(ui, light) {
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
        Command::Select => {
            let selected = lights.selected() == Some(light);
            lights.select((!selected).then_some(light));
        }
        Command::Switch => return lights.switch(document, light).err().map(|e| e.to_string()),
        Command::Color(raw) => {
            let key = format!("lights.{light}.color");
            return document.set(&key, &raw, Some(&key)).err().map(|e| e.to_string());
        }
        Command::BeginRenaming => lights.begin_renaming(light),
        Command::Rename(new) => match lights.rename(document, light, &new) {
            Ok(()) => {
                lights.renaming = None;
                let id = fold_id(ui, &new);
                let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, is_open);
                state.set_open(is_open);
                state.store(ui.ctx());
            }
            Err(fault) => match lights.renaming.as_mut().filter(|renaming| !renaming.focused) {
                Some(renaming) => renaming.fault = Some(fault),
                None => {
                    lights.renaming = None;
                    return Some(fault);
                }
            },
        },
        Command::KeepName => lights.renaming = None,
        Command::Duplicate => lights.duplicate(document, light),
        Command::Remove => lights.remove(document, light),
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
    let mut command = None;
    let clicked = |response: Response, label: String| {
        name(&response, &label);
        response.on_hover_text(label).clicked()
    };
    let key = |what: &str| format!("lights.{light}.{what}");
    let on = document.values().float(&key("intensity")) > 0.0;
    let eye = ui.add(Button::selectable(on, "👁").small());
    if clicked(eye, format!("Switch {light} {}", if on { "off" } else { "on" })) {
        command = Some(Command::Switch);
    }
    let color = document.values().triple(&key("color")).to_array().map(f64::from);
    let picked = color_button(ui, &format!("Colour of {light}"), color);
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        for (sign, verb, action) in [
            ("🗑", "Remove", Command::Remove),
            ("🗐", "Duplicate", Command::Duplicate),
            ("✏", "Rename", Command::BeginRenaming),
        ] {
            if clicked(ui.small_button(sign), format!("{verb} {light}")) {
                command = Some(action);
            }
        }
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            let renaming = lights.renaming.as_mut().filter(|renaming| renaming.light == light);
            let from_name = match renaming {
                Some(renaming) => name_field(ui, renaming),
                None => name_button(ui, lights.selected() == Some(light), light),
            };
            if from_name.is_some() {
                command = from_name;
            }
        });
    });
    command.or(picked.map(Command::Color))
}

/// The name of a light as a button that selects the light.
fn name_button(ui: &mut Ui, selected: bool, light: &str) -> Option<Command> {
    let button = ui.add(Button::selectable(selected, light).truncate());
    let command = if button.double_clicked() {
        Some(Command::BeginRenaming)
    } else {
        button.clicked().then_some(Command::Select)
    };
    name(&button, &format!("Light {light}"));
    button
        .on_hover_text("Click to select it, then move or turn it in the picture; double click to rename it");
    command
}

/// The text field for the name of a light that is being renamed.
fn name_field(ui: &mut Ui, renaming: &mut Renaming) -> Option<Command> {
    let field = egui::TextEdit::singleline(&mut renaming.text);
    let mut field = ui.add(field.desired_width(ui.available_width()));
    name(&field, &format!("Name of {}", renaming.light));
    if !renaming.focused {
        renaming.focused = true;
        field.request_focus();
    }
    if let Some(fault) = &renaming.fault {
        field = field.highlight();
        field.show_tooltip_text(fault);
    }
    if field.changed() {
        renaming.fault = None;
    }
    if !field.lost_focus() {
        return None;
    }
    let pressed = |key| ui.input(|i| i.key_pressed(key));
    // After Enter, a refused name stays in the field, which gets the focus again. After a click elsewhere it
    // does not.
    renaming.focused = !pressed(egui::Key::Enter);
    let new = renaming.text.trim().to_owned();
    Some(if pressed(egui::Key::Escape) { Command::KeepName } else { Command::Rename(new) })
}

/// The keys that a light of its kind has and that match the search.
fn keys(document: &Document, light: &str, search: &str) -> Vec<String> {
    let kind = document.values().text(&format!("lights.{light}.kind"));
    let parts = PARAMS.iter().filter_map(|param| param.key.strip_prefix("lights.*."));
    let keys = parts.filter(|what| edit::takes(&kind, what)).map(|what| format!("lights.{light}.{what}"));
    keys.filter(|key| matches(key, search)).collect()
}

/// Whether the next row, the folded entry of `light`, is scrolled out of sight.
fn is_out_of_sight(ui: &Ui, light: &str) -> bool {
    let row = Rect::from_min_size(ui.cursor().min, ui.spacing().interact_size);
    let open = CollapsingState::load(ui.ctx(), fold_id(ui, light)).is_some_and(|state| state.is_open());
    !open && !ui.is_rect_visible(row)
}

/// Id under which egui keeps whether the entry of a light is folded.
fn fold_id(ui: &Ui, light: &str) -> egui::Id {
    ui.make_persistent_id(("light", light))
}
