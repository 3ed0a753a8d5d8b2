//! Functions that add, remove, duplicate and rename lights. Each takes a scene's values and returns new ones.

use glam::DVec3;

use crate::scene::{Kind, Param, Place, Raw, Values};
use crate::util::error::Result;
use crate::viewer::named;
use crate::viewer::navigate::{Pose, raw};

/// Section of scene files that holds the lights.
const SECTION: &str = "lights";

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
    named::free_name(values, SECTION, wanted)
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
    named::remove(values, SECTION, name)
}

/// Duplicates a light without the animation tracks that move it. Returns the new values and the copy's name.
pub fn duplicate(values: &Values, name: &str) -> (Values, String) {
    named::duplicate(values, SECTION, name)
}

/// Renames a light, also in the animation tracks that move it.
///
/// # Errors
/// Why the light cannot have this name, as a sentence for the user.
pub fn rename(values: &Values, name: &str, new: &str) -> std::result::Result<Values, String> {
    named::rename(values, SECTION, "light", name, new)
}

/// Rounds a vector to multiples of `step`.
fn round(v: DVec3, step: f64) -> Raw {
    raw(DVec3::from_array(v.to_array().map(|x| (x / step).round() * step)))
}

/// Rounds to two significant digits.
pub(in crate::viewer) fn two_digits(x: f64) -> f64 {
    let step = 10f64.powf(x.max(1e-30).log10().floor() - 1.0);
    (x / step).round() * step
}
