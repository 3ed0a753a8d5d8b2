//! The list of meshes. Each has a switch, its name, what its parts become, and its parameters.

use eframe::egui;
use egui::collapsing_header::CollapsingState;
use egui::{Align, ComboBox, Layout, Ui};

use super::list::{self, Line};
use super::{Context, NAME_WIDTH, ParameterPanel, matches, name};
use crate::scene::{PARAMS, PartSummary, Raw, SceneMesh};
use crate::viewer::document::Document;
use crate::viewer::meshes::{self, Meshes};

/// Choice of a part that adds a material for a shell.
const NEW_SHELL: &str = "new shell…";

/// The user's command in the entry of one mesh.
enum Command {
    Switch,
    InList(list::Command),
}

/// The user's choice of what a part becomes.
enum Choice {
    Word(String),
    NewShell,
}

impl ParameterPanel {
    /// Shows the group of the meshes. Returns the number of their parameters that are shown, but at least 1
    /// without a search.
    pub(super) fn meshes(&mut self, ui: &mut Ui, context: &mut Context) -> usize {
        let names = context.document.values().names("meshes");
        let entries: Vec<(String, Vec<String>)> = names
            .iter()
            .map(|mesh| (mesh.clone(), keys(mesh, &context.search)))
            .filter(|(mesh, keys)| !keys.is_empty() || has_part(context.document, mesh, &context.search))
            .collect();
        if entries.is_empty() && context.is_searching() {
            return 0;
        }
        let id = ui.make_persistent_id(("group", "Meshes"));
        let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, !names.is_empty());
        if context.is_searching() || context.meshes.unfold.is_some() {
            state.set_open(true);
        }
        let mut reset = false;
        let header = state.show_header(ui, |ui| {
            ui.strong("Meshes").on_hover_text("Meshes of other programs, and what their parts become");
            ui.weak(names.len().to_string());
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if context.document.section_differs("meshes") {
                    let button = ui.small_button("⟲").on_hover_text("Reset Meshes");
                    name(&button, "Reset Meshes");
                    reset = button.clicked();
                    ui.weak("changed");
                }
            });
        });
        header.body_unindented(|ui| {
            if names.is_empty() {
                ui.weak("Drop a .glb, .gltf or .obj on the window.");
            }
            for (mesh, keys) in &entries {
                let to_unfold = context.meshes.unfold.as_ref() == Some(mesh);
                if !to_unfold && list::is_out_of_sight(ui, entries.len(), fold_id(ui, mesh)) {
                    ui.add_space(ui.spacing().interact_size.y);
                    continue;
                }
                self.mesh(ui, context, mesh, keys, names.len() == 1);
            }
            ui.add_space(6.0);
        });
        if reset {
            context.document.reset_section("meshes");
        }
        let shown: usize = entries.iter().map(|(_, keys)| keys.len()).sum();
        shown.max(usize::from(!context.is_searching() || !entries.is_empty()))
    }

    /// Shows the entry of one mesh with its parts and parameters, and applies the user's command.
    fn mesh(&mut self, ui: &mut Ui, context: &mut Context, mesh: &str, keys: &[String], only_one: bool) {
        let id = fold_id(ui, mesh);
        let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, only_one);
        let unfolded = context.meshes.unfold.take_if(|unfold| unfold == mesh).is_some();
        if unfolded || context.is_searching() {
            state.set_open(true);
        }
        let mut command = None;
        let header = state.show_header(ui, |ui| command = entry(ui, context.document, context.meshes, mesh));
        let (_, header, _) = header.body(|ui| {
            self.parts(ui, context, mesh);
            for key in keys {
                self.row(ui, context, key);
            }
            ui.add_space(4.0);
        });
        if unfolded {
            // With its parts below it.
            header.response.scroll_to_me(Some(Align::TOP));
        }
        if let Some(command) = command {
            let is_open = CollapsingState::load_with_default_open(ui.ctx(), id, only_one).is_open();
            self.fault = apply(ui, context, mesh, command, is_open);
        }
    }

    /// The parts of a mesh, each with what it becomes.
    fn parts(&mut self, ui: &mut Ui, context: &mut Context, name: &str) {
        let document = &mut *context.document;
        let Some(mesh) = meshes::find(document, name).cloned() else {
            if !meshes::is_shown(document.values(), name) {
                ui.weak("Hidden: its parts are listed when it is shown.");
            }
            return;
        };
        let parts = mesh.parts();
        let matching = |part: &&PartSummary| matches_part(part, &meshes::key_of(name, part), &context.search);
        let mut chosen = None;
        for (i, part) in parts.iter().enumerate().filter(|(_, part)| matching(part)) {
            chosen = part_row(ui, document, name, part, i).map(|choice| (part, choice)).or(chosen);
        }
        let result = match chosen {
            Some((part, Choice::Word(word))) => {
                document.set(&meshes::key_of(name, part), &Raw::Text(word), None)
            }
            Some((part, Choice::NewShell)) => meshes::add_shell(document, &mesh, part),
            None => return,
        };
        self.fault = result.err().map(|e| e.to_string());
    }
}

/// One part of a mesh: its name, a menu of what it can become, and its number of triangles.
fn part_row(ui: &mut Ui, document: &Document, mesh: &str, part: &PartSummary, i: usize) -> Option<Choice> {
    let key = meshes::key_of(mesh, part);
    let now = document.values().is_set(&key).then(|| document.values().text(&key));
    // A part without a key of its own has that of the whole mesh.
    let now = now.unwrap_or_else(|| document.values().text(&format!("meshes.{mesh}.material")));
    let mut choice = None;
    ui.horizontal(|ui| {
        let title = match part.material.as_str() {
            "" => "without a material",
            material => material,
        };
        let size = egui::vec2(NAME_WIDTH, ui.spacing().interact_size.y);
        ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_width(NAME_WIDTH);
            ui.add(egui::Label::new(title).truncate()).on_hover_text(format!("{title}: {key}"));
        });
        let combo = ComboBox::from_id_salt((&key, i)).selected_text(&now).show_ui(ui, |ui| {
            for word in meshes::choices(document.values()) {
                if ui.selectable_label(word == now, &word).clicked() && word != now {
                    choice = Some(Choice::Word(word));
                }
            }
            let tip = "Add a material whose volume fills a shell over this part";
            if ui.selectable_label(false, NEW_SHELL).on_hover_text(tip).clicked() {
                choice = Some(Choice::NewShell);
            }
        });
        // The whole mesh has a row of its own, further down.
        let label = if part.key.is_some() { key } else { format!("Parts of {mesh} without a material") };
        name(&combo.response, &label);
        let count =
            if part.triangles == 1 { "1 triangle".into() } else { format!("{} triangles", part.triangles) };
        // A longer line would push the marks of all rows under the scroll bar.
        ui.add(egui::Label::new(egui::RichText::new(&count).weak().small()).truncate()).on_hover_text(count);
    });
    choice
}

/// Whether a part's name or key has all words of the search text.
fn matches_part(part: &PartSummary, key: &str, search: &str) -> bool {
    let text = format!("{} {key}", part.material).to_lowercase();
    search.split_whitespace().all(|word| text.contains(word)) || matches(key, search)
}

/// Applies a command to a mesh, whose entry in the list is open or folded. Returns why it failed, if it did.
fn apply(ui: &Ui, context: &mut Context, mesh: &str, command: Command, is_open: bool) -> Option<String> {
    let (document, meshes) = (&mut *context.document, &mut *context.meshes);
    match command {
        Command::Switch => return meshes.switch(document, mesh).err().map(|e| e.to_string()),
        Command::InList(list::Command::Select) => {
            let selected = meshes.selected() == Some(mesh);
            meshes.select((!selected).then_some(mesh));
        }
        Command::InList(list::Command::BeginRenaming) => meshes.begin_renaming(mesh),
        Command::InList(list::Command::Rename(new)) => {
            let result = meshes.rename(document, mesh, &new);
            return list::renamed(ui, &mut meshes.renaming, result, (fold_id(ui, &new), is_open));
        }
        Command::InList(list::Command::KeepName) => meshes.renaming = None,
        Command::InList(list::Command::Duplicate) => meshes.duplicate(document, mesh),
        Command::InList(list::Command::Remove) => {
            return meshes.remove(document, mesh).err().map(|e| e.to_string());
        }
    }
    None
}

/// The line of one mesh: its switch, name, and buttons. Returns the user's command.
fn entry(ui: &mut Ui, document: &Document, meshes: &mut Meshes, mesh: &str) -> Option<Command> {
    let shown = meshes::is_shown(document.values(), mesh);
    let switched = list::eye(ui, shown, format!("{} {mesh}", if shown { "Hide" } else { "Show" }));
    let line = Line {
        noun: "Mesh",
        name: mesh,
        tip: "Click to select it, then move, turn or size it in the picture; double click to rename it",
        selected: meshes.selected() == Some(mesh),
    };
    let in_list = line.show(ui, &mut meshes.renaming).map(Command::InList);
    in_list.or(switched.then_some(Command::Switch))
}

/// The keys of a mesh that match the search. What its parts become is shown by their names instead.
fn keys(mesh: &str, search: &str) -> Vec<String> {
    let parts = PARAMS.iter().filter_map(|param| param.key.strip_prefix("meshes.*."));
    let keys = parts.filter(|what| !what.contains('*')).map(|what| format!("meshes.{mesh}.{what}"));
    keys.filter(|key| matches(key, search)).collect()
}

/// Whether a part of a mesh matches the search.
fn has_part(document: &Document, mesh: &str, search: &str) -> bool {
    let parts = meshes::find(document, mesh).map(SceneMesh::parts).unwrap_or_default();
    parts.iter().any(|part| matches_part(part, &meshes::key_of(mesh, part), search))
}

/// Id under which egui keeps whether the entry of a mesh is folded.
fn fold_id(ui: &Ui, mesh: &str) -> egui::Id {
    ui.make_persistent_id(("mesh", mesh))
}
