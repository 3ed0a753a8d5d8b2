//! Functions that add, remove, duplicate and rename lights. Each takes a scene's values and returns new ones.

use glam::DVec3;

use crate::scene::{Kind, Param, Place, Raw, Values};
use crate::util::error::Result;
use crate::viewer::navigate::{Pose, raw};

/// The kinds of light, as spelt in scene files.
pub fn kinds() -> &'static [&'static str] {
    match Param::find("lights.NAME.kind").map(|param| param.kind) {
        Some(Kind::Choice(words)) => words,
        _ => &[],
    }
}

/// Whether a light of this kind has the parameter `what`, the last part of a light's key.
pub fn takes(kind: &str, what: &str) -> bool {
    match what {
        "direction" => kind != "point",
        "position" => kind != "directional",
        "angle" | "softness" => kind == "spot",
        _ => true,
    }
}

/// Returns a name that no light has: `wanted`, or the first free one of wanted-2, wanted-3, …. A number at
/// the end of `wanted` is replaced, so that `sun-2` gives `sun-3`, not `sun-2-2`.
pub fn free_name(values: &Values, wanted: &str) -> String {
    if !is_taken(values, wanted) {
        return wanted.into();
    }
    let is_number = |tail: &str| !tail.is_empty() && tail.bytes().all(|b| b.is_ascii_digit());
    let stem = match wanted.rsplit_once('-') {
        Some((stem, tail)) if !stem.is_empty() && is_number(tail) => stem,
        _ => wanted,
    };
    let numbered = (2..).map(|n| format!("{stem}-{n}")).find(|name| !is_taken(values, name));
    numbered.unwrap_or_default()
}

fn is_taken(values: &Values, name: &str) -> bool {
    values.has_under(&format!("lights.{name}"))
}

/// Adds a light at a position where the camera sees its effect: in front of the target, above it and to the
/// left. It is as bright at the target as a directional light of intensity 1. Returns the new values and the
/// light's name.
///
/// # Errors
/// If the parameter table has no such kind, or the position is out of range.
pub fn add(values: &Values, kind: &str, pose: &Pose) -> Result<(Values, String)> {
    let name = free_name(values, if kind == "directional" { "sun" } else { kind });
    let [right, up, forward] = pose.axes();
    let towards = (up * 0.8 - right * 0.5 - forward * 0.6).normalize();
    // Halfway from the middle of the picture to its upper border at any field of view, but at most half the
    // distance to the eye.
    let distance = pose.eye.distance(pose.target) * (0.7 * pose.tan_half_fov).min(0.5);
    let mut values = values.clone();
    let mut set = |what: &str, raw: Raw| {
        let key = format!("lights.{name}.{what}");
        if takes(kind, what) { values.set(&key, &raw, &Place("viewer".into())) } else { Ok(()) }
    };
    set("kind", Raw::Text(kind.into()))?;
    set("direction", round(towards, 0.01))?;
    // Rounds to the power of ten below a hundredth of the distance, so that the numbers have few digits.
    let step = 10f64.powf((distance * 0.01).max(1e-6).log10().floor());
    set("position", round(pose.target + towards * distance, step))?;
    let square = if kind == "directional" { 1.0 } else { distance * distance };
    set("intensity", Raw::Float(two_digits(square).clamp(1e-3, 1e9)))?;
    Ok((values, name))
}

/// Removes a light and the animation tracks that move it.
pub fn remove(values: &Values, name: &str) -> Values {
    let mut remaining = values.clone();
    remaining.clear_under(&format!("lights.{name}"));
    tracks(values, name).iter().for_each(|(track, _)| remaining.clear_under(track));
    remaining
}

/// Duplicates a light without the animation tracks that move it. Returns the new values and the copy's name.
pub fn duplicate(values: &Values, name: &str) -> (Values, String) {
    let copy = free_name(values, name);
    let mut extended = values.clone();
    extended.copy_under(values, &format!("lights.{name}"), &format!("lights.{copy}"));
    (extended, copy)
}

/// Renames a light, also in the animation tracks that move it.
///
/// # Errors
/// Why the light cannot have this name, as a sentence for the user.
pub fn rename(values: &Values, name: &str, new: &str) -> std::result::Result<Values, String> {
    if new.is_empty() {
        return Err("a light needs a name".into());
    }
    if new.contains('.') || new.chars().any(char::is_control) {
        return Err("a name cannot contain dots or line breaks".into());
    }
    if new == name {
        return Ok(values.clone());
    }
    if is_taken(values, new) {
        return Err(format!("another light is named {new}"));
    }
    let mut renamed = values.clone();
    renamed.clear_under(&format!("lights.{name}"));
    renamed.copy_under(values, &format!("lights.{name}"), &format!("lights.{new}"));
    for (track, what) in tracks(values, name) {
        let key = Raw::Text(format!("lights.{new}.{what}"));
        let set = renamed.set(&format!("{track}.key"), &key, &Place("viewer".into()));
        set.map_err(|e| e.to_string())?;
    }
    Ok(renamed)
}

/// The animation tracks that move a light, each with the part of its key after the light's name.
fn tracks(values: &Values, name: &str) -> Vec<(String, String)> {
    let tracks = values.names("animate.tracks").into_iter().map(|i| format!("animate.tracks.{i}"));
    let of_light = tracks.filter_map(|track| {
        let key = values.text(&format!("{track}.key"));
        let what = key.strip_prefix("lights.")?.strip_prefix(name)?.strip_prefix('.')?;
        Some((track, what.to_owned()))
    });
    of_light.collect()
}

/// Rounds a vector to multiples of `step`.
fn round(v: DVec3, step: f64) -> Raw {
    raw(DVec3::from_array(v.to_array().map(|x| (x / step).round() * step)))
}

/// Rounds to two significant digits.
fn two_digits(x: f64) -> f64 {
    let step = 10f64.powf(x.max(1e-30).log10().floor() - 1.0);
    (x / step).round() * step
}
