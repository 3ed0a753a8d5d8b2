//! Widgets that show and edit the value of one parameter.

use eframe::egui;
use egui::{Align, ComboBox, DragValue, Layout, Slider, SliderClamping, Ui};
use rand::RngExt;

use super::{MARKS_WIDTH, NAME_WIDTH, VALUE_WIDTH, name};
use crate::scene::{Kind, Param, Raw, Value, WATER, key_of_volume, numbers_in, split_volume_key};
use crate::viewer::document::Document;
use crate::viewer::meshes::choices;
use crate::viewer::navigate;

/// A vector as a value of a scene file.
pub(super) fn list(p: [f64; 3]) -> Raw {
    Raw::List(p.into_iter().map(Raw::Float).collect())
}

/// Parses a typed number. Many people write a comma as its decimal mark.
fn typed_number(text: &str) -> Option<f64> {
    let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    text.replace('−', "-").replace(',', ".").parse().ok()
}

/// Shows three numbers in one row. Returns whether one of them was changed.
pub(super) fn triple(ui: &mut Ui, key: &str, t: &mut [f64; 3], speed: f64) -> bool {
    let mut changed = false;
    let width = ((ui.available_width() - MARKS_WIDTH) / 3.0 - ui.spacing().item_spacing.x).max(36.0);
    for (x, axis) in t.iter_mut().zip(["x", "y", "z"]) {
        let drag = DragValue::new(x).speed(speed).max_decimals(3).update_while_editing(false).clip_text(true);
        let drag = drag.custom_parser(typed_number);
        let response = ui.add_sized([width, ui.spacing().interact_size.y], drag);
        name(&response, &format!("{key} {axis}"));
        changed |= response.changed();
    }
    changed
}

/// Shows the azimuth and elevation of a direction as sliders. Returns the direction that they were changed
/// to.
pub(super) fn direction_angles(ui: &mut Ui, key: &str, t: [f64; 3]) -> Option<Raw> {
    let mut angles = navigate::angles(t.into());
    let mut changed = false;
    for (angle, (label, range)) in
        angles.iter_mut().zip([("azimuth", -180.0..=180.0), ("elevation", -89.0..=89.0)])
    {
        ui.horizontal(|ui| {
            ui.add_space(10.0);
            ui.allocate_ui_with_layout(
                egui::vec2(NAME_WIDTH - 10.0, ui.spacing().interact_size.y),
                Layout::left_to_right(Align::Center),
                |ui| {
                    ui.set_min_width(ui.available_width());
                    ui.weak(label);
                },
            );
            ui.spacing_mut().slider_width = slider_width(ui);
            let before = *angle;
            let slider = Slider::new(angle, range).suffix("°").max_decimals(1).update_while_editing(false);
            let response = ui.add(slider.custom_parser(typed_number));
            name(&response, &format!("{key} {label}"));
            // A slider rounds its value to one decimal, which alone is no change.
            changed |= response.changed() && (*angle - before).abs() > 0.051;
        });
    }
    changed.then(|| navigate::raw(navigate::direction(angles)))
}

fn slider_width(ui: &Ui) -> f32 {
    (ui.available_width() - VALUE_WIDTH - MARKS_WIDTH).max(40.0)
}

/// A parameter whose value is shown as a widget.
pub(super) struct Field<'a> {
    pub(super) document: &'a Document,
    pub(super) key: &'a str,
    pub(super) param: &'a Param,
}

impl Field<'_> {
    /// Shows the widget of `value`. Returns the value that it was changed to.
    pub(super) fn show(&self, ui: &mut Ui, value: &Value) -> Option<Raw> {
        let key = self.key;
        ui.spacing_mut().slider_width = slider_width(ui);
        match (self.param.kind, value) {
            (Kind::Float(min, max, default), Value::Float(x)) => self.float(ui, [min, max, default], *x),
            (Kind::Int(min, max, default), Value::Int(x)) => self.int(ui, [min, max, default], *x),
            (Kind::Choice(options), Value::Text(text)) => {
                self.choice(ui, options.iter().map(ToString::to_string), text)
            }
            (Kind::Switch(_), Value::Switch(on)) => {
                let mut new = *on;
                name(&ui.checkbox(&mut new, ""), key);
                (new != *on).then_some(Raw::Switch(new))
            }
            (Kind::Color(_), Value::Triple(t)) => color(ui, key, *t),
            (Kind::Point(_), Value::Triple(t)) => {
                let mut new = *t;
                let length = t.iter().map(|x| x * x).sum::<f64>().sqrt();
                triple(ui, key, &mut new, (length * 0.005).max(0.005)).then(|| list(new))
            }
            (Kind::Text(_), Value::Text(text))
                if key.starts_with("meshes.") && key.ends_with(".material") =>
            {
                self.choice(ui, choices(self.document.values()).into_iter(), text)
            }
            (Kind::Text(_), Value::Text(text)) if key.ends_with(".material") => {
                let mut materials = self.document.values().names("materials");
                if !materials.iter().any(|material| material == "water") {
                    materials.push("water".into());
                }
                self.choice(ui, materials.into_iter(), text)
            }
            (Kind::Text(_), Value::Text(text)) if key.starts_with("materials.") => {
                let volumes = self.document.values().names("volumes");
                self.choice(ui, std::iter::once(WATER.to_owned()).chain(volumes), text)
            }
            (Kind::Text(_), Value::Text(text)) => self.text(ui, text),
            (Kind::Frames | Kind::Series, list) => {
                // Keyframes can be edited only in the scene file.
                let label = egui::Label::new(egui::RichText::new(list.to_toml()).weak()).truncate();
                name(&ui.add(label), key);
                None
            }
            _ => None,
        }
    }

    fn float(&self, ui: &mut Ui, [min, max, default]: [f64; 3], x: f64) -> Option<Raw> {
        let mut new = x;
        let (low, high) = self.param.slider.unwrap_or((min, max));
        let slider = Slider::new(&mut new, low..=high)
            .logarithmic(is_logarithmic(low, high, default))
            .smallest_positive((high * 1e-4).min(default.abs() * 0.1).max(1e-6))
            .clamping(SliderClamping::Never)
            .max_decimals(4)
            .custom_parser(typed_number)
            .update_while_editing(false)
            .suffix(self.suffix());
        let response = ui.add(slider);
        name(&response, self.key);
        // A typed number may exceed the slider's range, but not the parameter's.
        (response.changed() && new != x).then(|| Raw::Float(new.clamp(min, max)))
    }

    fn int(&self, ui: &mut Ui, [min, max, default]: [i64; 3], x: i64) -> Option<Raw> {
        let mut new = x;
        let files = self.numbers_of_files(ui);
        let response = match self.param.slider {
            _ if let Some([first, last]) = files => ui.add(
                Slider::new(&mut new, first..=last)
                    .clamping(SliderClamping::Never)
                    .update_while_editing(false),
            ),
            Some((low, high)) => ui.add(
                Slider::new(&mut new, low as i64..=high as i64)
                    .logarithmic(is_logarithmic(low, high, default as f64))
                    .clamping(SliderClamping::Never)
                    .update_while_editing(false)
                    .suffix(if self.param.unit == "cells" { String::new() } else { self.suffix() }),
            ),
            None if max <= 64 => ui.add(Slider::new(&mut new, min..=max).update_while_editing(false)),
            None => {
                let drag = DragValue::new(&mut new).range(min..=max).update_while_editing(false);
                ui.add_sized([VALUE_WIDTH, ui.spacing().interact_size.y], drag)
            }
        };
        name(&response, self.key);
        if self.key.ends_with(".seed") {
            let dice = ui.button("🎲").on_hover_text("Another random seed");
            name(&dice, &format!("Dice {}", self.key));
            if dice.clicked() {
                new = i64::from(rand::rng().random::<u32>() >> 4);
            }
        }
        (new != x).then(|| Raw::Int(new.clamp(min, max)))
    }

    fn choice(&self, ui: &mut Ui, options: impl Iterator<Item = String>, text: &str) -> Option<Raw> {
        let mut new = text.to_owned();
        let combo = ComboBox::from_id_salt(self.key).selected_text(text).show_ui(ui, |ui| {
            for option in options {
                ui.selectable_value(&mut new, option.clone(), option);
            }
        });
        name(&combo.response, self.key);
        (new != text).then_some(Raw::Text(new))
    }

    fn text(&self, ui: &mut Ui, text: &str) -> Option<Raw> {
        // The text is applied when the field is left, because half a path is not a valid path.
        let id = ui.make_persistent_id(("text", self.key));
        let mut typed = ui.data_mut(|d| d.get_temp::<String>(id)).unwrap_or_else(|| text.to_owned());
        let width = ui.available_width() - MARKS_WIDTH;
        let is_volume_file = split_volume_key(self.key).is_some_and(|(_, own)| own == "volume.file");
        let field = egui::TextEdit::singleline(&mut typed)
            .hint_text(if is_volume_file { "built" } else { "" })
            .desired_width(width);
        let response = ui.add(field);
        name(&response, self.key);
        if response.has_focus() {
            ui.data_mut(|d| d.insert_temp(id, typed.clone()));
            return None;
        }
        let entered = ui.data_mut(|d| d.remove_temp::<String>(id));
        entered.filter(|new| new != text).map(Raw::Text)
    }

    /// Numbers of the first and the last file that a volume's number of a file can choose, if it has several.
    /// The folder is read once for each name.
    fn numbers_of_files(&self, ui: &Ui) -> Option<[i64; 2]> {
        let (volume, _) = split_volume_key(self.key).filter(|(_, own)| *own == "volume.frame")?;
        let (scene, values) = (self.document.scene(), self.document.values());
        let recipe = scene.recipes.iter().find(|own| own.name == volume && own.is_sequence)?;
        let folder = recipe.file.as_ref()?.parent()?;
        let names =
            ["source", "file"].map(|own| values.text(&key_of_volume(volume, &format!("volume.{own}"))));
        let id = egui::Id::unique((self.key, folder, names));
        let read = || numbers_in(values, volume, folder).filter(|[first, last]| first < last);
        ui.data_mut(|data| *data.get_temp_mut_or_insert_with(id, read))
    }

    /// The unit after a number, if it is short. The tooltip shows long units.
    fn suffix(&self) -> String {
        match self.param.unit {
            "" => String::new(),
            "°" => "°".into(),
            unit if unit.len() <= 4 => format!(" {unit}"),
            _ => String::new(),
        }
    }
}

/// Whether a slider over this range is easier to use on a logarithmic scale.
fn is_logarithmic(low: f64, high: f64, default: f64) -> bool {
    let wide = high / low.max(1.0) >= 64.0;
    let small = default > 0.0 && default < 0.02 * high;
    low >= 0.0 && (wide || small)
}

/// Shows a linear colour as a button and, for a component above 1, a factor. Returns the colour that it was
/// changed to.
fn color(ui: &mut Ui, key: &str, t: [f64; 3]) -> Option<Raw> {
    let picked = color_button(ui, key, t);
    let factor = brightness(t);
    let mut scale = factor;
    if factor > 1.0 {
        let drag = DragValue::new(&mut scale).range(1.0..=1e4).speed(0.02).prefix("× ").max_decimals(3);
        name(&ui.add(drag), &format!("{key} factor"));
    }
    ui.weak(format!("{:.3} {:.3} {:.3}", t[0], t[1], t[2]));
    picked.or((scale != factor).then(|| list(t.map(|x| x / factor * scale))))
}

/// A button that opens a picker of a linear colour. The picked colour keeps the factor of the old one.
pub(super) fn color_button(ui: &mut Ui, label: &str, t: [f64; 3]) -> Option<Raw> {
    let factor = brightness(t);
    let mut rgb = t.map(|x| (x / factor) as f32);
    let button = ui.color_edit_button_rgb(&mut rgb);
    name(&button, label);
    // The open picker converts the colour to a hue and back. The rounding of that is no change.
    let moved = |(new, old): (&f32, &f64)| (f64::from(*new) - old / factor).abs() > 1e-5;
    let picked = button.changed() && rgb.iter().zip(&t).any(moved);
    picked.then(|| list(rgb.map(|x| f64::from(x) * factor)))
}

/// The factor of a colour: its largest component, at least 1.
fn brightness(t: [f64; 3]) -> f64 {
    t.into_iter().fold(1.0, f64::max)
}
