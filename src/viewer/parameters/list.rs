//! The line of a thing that has a name, in the list of lights or meshes: its name and its buttons.

use eframe::egui;
use egui::collapsing_header::CollapsingState;
use egui::{Align, Button, Layout, Rect, Response, Ui};

use super::name;
use crate::viewer::named::Renaming;

/// In a longer list, folded entries that are scrolled out of sight are skipped. Otherwise each frame would
/// lay out thousands of buttons.
const MAX_LAID_OUT: usize = 200;

/// The user's command in the entry of one thing.
pub(super) enum Command {
    Select,
    BeginRenaming,
    Rename(String),
    KeepName,
    Duplicate,
    Remove,
}

/// One line of a list.
pub(super) struct Line<'a> {
    /// Word for such things, with a capital.
    pub noun: &'static str,
    /// Name of the thing.
    pub name: &'a str,
    /// Tooltip of the name.
    pub tip: &'static str,
    pub selected: bool,
}

impl Line<'_> {
    /// Shows the name, or the field in which it is edited, and at the end of the line the buttons.
    pub fn show(&self, ui: &mut Ui, renaming: &mut Option<Renaming>) -> Option<Command> {
        let mut command = None;
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            for (sign, verb, action) in [
                ("🗑", "Remove", Command::Remove),
                ("🗐", "Duplicate", Command::Duplicate),
                ("✏", "Rename", Command::BeginRenaming),
            ] {
                if clicked(ui.small_button(sign), format!("{verb} {}", self.name)) {
                    command = Some(action);
                }
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let renaming = renaming.as_mut().filter(|renaming| renaming.name == self.name);
                let from_name = match renaming {
                    Some(renaming) => name_field(ui, renaming),
                    None => self.name_button(ui),
                };
                if from_name.is_some() {
                    command = from_name;
                }
            });
        });
        command
    }

    /// The name as a button that selects.
    fn name_button(&self, ui: &mut Ui) -> Option<Command> {
        let button = ui.add(Button::selectable(self.selected, self.name).truncate());
        let command = if button.double_clicked() {
            Some(Command::BeginRenaming)
        } else {
            button.clicked().then_some(Command::Select)
        };
        name(&button, &format!("{} {}", self.noun, self.name));
        button.on_hover_text(self.tip);
        command
    }
}

/// The text field for the name of a thing that is being renamed.
fn name_field(ui: &mut Ui, renaming: &mut Renaming) -> Option<Command> {
    let field = egui::TextEdit::singleline(&mut renaming.text);
    let mut field = ui.add(field.desired_width(ui.available_width()));
    name(&field, &format!("Name of {}", renaming.name));
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

/// The switch with the sign of an eye. Returns whether it was clicked.
pub(super) fn eye(ui: &mut Ui, on: bool, label: String) -> bool {
    clicked(ui.add(Button::selectable(on, "👁").small()), label)
}

fn clicked(response: Response, label: String) -> bool {
    name(&response, &label);
    response.on_hover_text(label).clicked()
}

/// Ends a renaming with its `result`: folds the entry of the new name as the old one was, or keeps the field
/// open with the reason. Returns the reason where the field is closed.
pub(super) fn renamed(
    ui: &Ui,
    renaming: &mut Option<Renaming>,
    result: Result<(), String>,
    (new_id, is_open): (egui::Id, bool),
) -> Option<String> {
    let Err(fault) = result else {
        *renaming = None;
        let mut state = CollapsingState::load_with_default_open(ui.ctx(), new_id, is_open);
        state.set_open(is_open);
        state.store(ui.ctx());
        return None;
    };
    match renaming.as_mut().filter(|renaming| !renaming.focused) {
        Some(renaming) => {
            renaming.fault = Some(fault);
            None
        }
        None => {
            *renaming = None;
            Some(fault)
        }
    }
}

/// Whether the next row of a list of `count`, a folded entry, can be left out because it is out of sight.
pub(super) fn is_out_of_sight(ui: &Ui, count: usize, id: egui::Id) -> bool {
    let row = Rect::from_min_size(ui.cursor().min, ui.spacing().interact_size);
    let open = CollapsingState::load(ui.ctx(), id).is_some_and(|state| state.is_open());
    count > MAX_LAID_OUT && !open && !ui.is_rect_visible(row)
}
