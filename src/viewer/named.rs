//! Parts of a scene that have names, such as lights and meshes. The functions take a scene's values and
//! return new ones.

use crate::scene::{Place, Raw, Values};

/// A part being renamed in its list.
pub(super) struct Renaming {
    /// Its name.
    pub name: String,
    /// The name as typed so far.
    pub text: String,
    /// Why the typed name was refused.
    pub fault: Option<String>,
    /// Whether the text field has been given the keyboard.
    pub focused: bool,
}

impl Renaming {
    /// Starts renaming a part.
    pub fn new(name: &str) -> Renaming {
        Renaming { name: name.into(), text: name.into(), fault: None, focused: false }
    }
}

/// Returns a name that no part of `section` has: `wanted`, or the first free one of wanted-2, wanted-3, …. A
/// number at the end of `wanted` is replaced, so that `sun-2` gives `sun-3`, not `sun-2-2`.
pub(super) fn free_name(values: &Values, section: &str, wanted: &str) -> String {
    let is_taken = |name: &str| values.has_under(&format!("{section}.{name}"));
    if !is_taken(wanted) {
        return wanted.into();
    }
    let is_number = |tail: &str| !tail.is_empty() && tail.bytes().all(|b| b.is_ascii_digit());
    let stem = match wanted.rsplit_once('-') {
        Some((stem, tail)) if !stem.is_empty() && is_number(tail) => stem,
        _ => wanted,
    };
    let numbered = (2..).map(|n| format!("{stem}-{n}")).find(|name| !is_taken(name));
    numbered.unwrap_or_default()
}

/// A name of another program as part of a key: with underscores for what a key should not hold. `none` stands
/// for a name of which nothing is left.
pub(super) fn key_part(name: &str, none: &str) -> String {
    let name = name.replace(|c: char| !(c.is_alphanumeric() || c == '-'), "_");
    match name.trim_matches('_') {
        "" => none.into(),
        name => name.into(),
    }
}

/// Removes a part and the animation tracks that move it.
pub(super) fn remove(values: &Values, section: &str, name: &str) -> Values {
    let mut remaining = values.clone();
    remaining.clear_under(&format!("{section}.{name}"));
    tracks(values, section, name).iter().for_each(|(track, _)| remaining.clear_under(track));
    remaining
}

/// Duplicates a part without the animation tracks that move it. Returns the new values and the copy's name.
pub(super) fn duplicate(values: &Values, section: &str, name: &str) -> (Values, String) {
    let copy = free_name(values, section, name);
    let mut extended = values.clone();
    extended.copy_under(values, &format!("{section}.{name}"), &format!("{section}.{copy}"));
    (extended, copy)
}

/// Renames a part, also in the animation tracks that move it. `noun` names such parts to the user.
///
/// # Errors
/// Why the part cannot have this name, as a sentence for the user.
pub(super) fn rename(
    values: &Values,
    section: &str,
    noun: &str,
    name: &str,
    new: &str,
) -> Result<Values, String> {
    if new.is_empty() {
        return Err(format!("a {noun} needs a name"));
    }
    if new.contains('.') || new.chars().any(char::is_control) {
        return Err("a name cannot contain dots or line breaks".into());
    }
    if new == name {
        return Ok(values.clone());
    }
    if values.has_under(&format!("{section}.{new}")) {
        return Err(format!("another {noun} is named {new}"));
    }
    let mut renamed = values.clone();
    renamed.clear_under(&format!("{section}.{name}"));
    renamed.copy_under(values, &format!("{section}.{name}"), &format!("{section}.{new}"));
    for (track, what) in tracks(values, section, name) {
        let key = Raw::Text(format!("{section}.{new}.{what}"));
        let set = renamed.set(&format!("{track}.key"), &key, &Place("viewer".into()));
        set.map_err(|e| e.to_string())?;
    }
    Ok(renamed)
}

/// The animation tracks that move a part, each with the part of its key after the name.
fn tracks(values: &Values, section: &str, name: &str) -> Vec<(String, String)> {
    let tracks = values.names("animate.tracks").into_iter().map(|i| format!("animate.tracks.{i}"));
    let of_part = tracks.filter_map(|track| {
        let key = values.text(&format!("{track}.key"));
        let own = key.strip_prefix(section)?.strip_prefix('.')?;
        let what = own.strip_prefix(name)?.strip_prefix('.')?;
        Some((track, what.to_owned()))
    });
    of_part.collect()
}
