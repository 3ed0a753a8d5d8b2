//! Keys as users write them: in full, by their last part alone, or misspelt.

use super::param::{Kind, PARAMS, Param, last_part};
use super::remove::{NUMBERED, REMOVE};
use super::value::{Place, Values};
use crate::util::error::Error;

/// Sections whose keys have a name of the scene's choice as their second part.
pub const NAMED: [&str; 6] = ["lights", "materials", "pools", "rocks", "sheets", "splashes"];

/// Least likeness of a key to a misspelt one that makes it worth a suggestion.
const ALIKE: f64 = 0.7;

/// Returns the full key that `name` stands for: `name` itself, or the one key of the scene that ends with it.
/// Parameters that a scene has once take precedence over those of lights, rocks and materials, and all of
/// them over those of the animation. Switches come last: `alpha` is the paper's α, not that of the image.
///
/// # Errors
/// The candidates, where `name` can mean several.
pub fn full_key(name: &str, values: &Values) -> std::result::Result<String, String> {
    if name.is_empty() || name.contains('.') {
        return Ok(name.into());
    }
    let mut keys: Vec<String> =
        values.known_keys().into_iter().filter(|key| last_part(key) == name).collect();
    let is_switch = |key: &String| Param::find(key).is_some_and(|p| matches!(p.kind, Kind::Switch(_)));
    if !keys.iter().all(is_switch) {
        keys.retain(|key| !is_switch(key));
    }
    let (animated, still): (Vec<&str>, Vec<&str>) =
        keys.iter().map(String::as_str).partition(|key| key.starts_with("animate."));
    let all = if still.is_empty() { animated } else { still };
    let single = |key: &&str| PARAMS.iter().any(|param| param.key == *key);
    let once: Vec<&str> = all.iter().copied().filter(single).collect();
    match (once.as_slice(), all.as_slice()) {
        ([key], _) | ([], [key]) => Ok((*key).into()),
        // The caller finds that the key is unknown.
        ([], []) => Ok(name.into()),
        (_, several) => Err(format!("{name} can mean {}; write one of them in full", listed(several))),
    }
}

/// Joins at most eight keys.
fn listed(keys: &[&str]) -> String {
    match keys.len() {
        0..=8 => keys.join(", "),
        n => format!("{} and {} more", keys[..8].join(", "), n - 8),
    }
}

/// The error for a key that `--set` or `--sweep` cannot give in this scene. It suggests the nearest key that
/// the scene has.
pub fn unknown_key(key: &str, values: &Values, place: &Place) -> Error {
    let advice = match key {
        "" => "write the key before the =",
        "base" => "name the preset in place of the scene, such as taki render fig5",
        "version" => "a scene file alone has a version",
        REMOVE => "give --remove NAME",
        _ => return unknown(key, nearest(key, values.known_keys()), place),
    };
    Error::input(format!("{}: unknown key {key:?}", place.0), advice)
}

/// Keys of a scene file that stand before its tables.
pub(super) const AT_THE_TOP: [&str; 3] = ["version", "base", REMOVE];

/// The error for an unknown key in a scene file, which may name lights and other things as it likes. It
/// suggests the nearest key that the scene has so far, or one that has the misspelt key's own name.
pub fn unknown_key_in_file(key: &str, values: &Values, place: &Place) -> Error {
    if let Some(top) = AT_THE_TOP.iter().find(|top| last_part(key) == **top) {
        let what = format!("{}: unknown key {key}", place.0);
        return Error::input(what, format!("write the line {top} = … above the first table"));
    }
    let parts: Vec<&str> = key.split('.').collect();
    let named = PARAMS.iter().filter_map(|param| {
        let pattern: Vec<&str> = param.key.split('.').collect();
        let fits = pattern.contains(&"*") && pattern.len() == parts.len();
        let whole = || pattern.iter().zip(&parts).map(|(want, own)| if *want == "*" { own } else { want });
        fits.then(|| whole().copied().collect::<Vec<&str>>().join("."))
    });
    let named: Vec<String> = named.collect();
    unknown(key, nearest(key, values.known_keys().into_iter().chain(named)), place)
}

fn unknown(key: &str, near: Option<String>, place: &Place) -> Error {
    let fix = match (misplaced(key), near) {
        (Some(advice), _) => advice,
        (None, Some(near)) => format!("did you mean {near}?"),
        (None, None) => "docs/parameters.md lists every key".into(),
    };
    Error::input(format!("{}: unknown key {key}", place.0), fix)
}

/// Returns advice on a key that is unknown because a table or a name was written in another way.
fn misplaced(key: &str) -> Option<String> {
    let parts: Vec<&str> = key.split('.').collect();
    if NAMED.contains(&key) {
        return Some(format!("each of them has a table of its own: [{key}.NAME]"));
    }
    if NUMBERED.contains(&key) {
        return Some(format!("each of them has a table of its own: [[{key}]]"));
    }
    let named = NAMED.contains(&parts[0]);
    if named && parts[1..].contains(&"") {
        return Some(format!("give it a name: [{}.NAME]", parts[0]));
    }
    let last = format!("{}.*.{}", parts[0], parts[parts.len() - 1]);
    if named && parts.len() > 3 && PARAMS.iter().any(|param| param.key == last) {
        let name = parts[1..parts.len() - 1].join(".");
        return Some(format!("the name {name:?} has a dot; choose one without"));
    }
    let within = |param: &&Param| param.key.strip_prefix(key).is_some_and(|rest| rest.starts_with('.'));
    let keys: Vec<&str> = PARAMS.iter().filter(within).map(|param| param.key).collect();
    (!keys.is_empty()).then(|| format!("it is a table, with the keys {}", listed(&keys)))
}

/// Returns the candidate nearest to a misspelt key.
fn nearest(key: &str, candidates: impl IntoIterator<Item = String>) -> Option<String> {
    let key = key.to_lowercase();
    candidates
        .into_iter()
        .filter(|candidate| Param::find(candidate).is_some())
        .map(|candidate| {
            // The commonest slip is in a bare last part, such as `sgima` for `trace.sigma`.
            let low = candidate.to_lowercase();
            let score = strsim::jaro_winkler(&key, &low);
            (score.max(strsim::jaro_winkler(&key, last_part(&low))), candidate)
        })
        .filter(|(score, _)| *score > ALIKE)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// Checks that the scene has the name in `key`, so that a misspelt one does not add a second light. The error
/// is the fault and the list of the names there are.
pub fn check_names(values: &Values, key: &str) -> std::result::Result<(), (String, String)> {
    let mut parts = key.split('.');
    let (Some(section), Some(name)) = (parts.next(), parts.next()) else { return Ok(()) };
    if !NAMED.contains(&section) && section != "quads" {
        return Ok(());
    }
    let mut names = values.names(section);
    if section == "materials" {
        for user in ["quads", "sheets", "splashes"] {
            names.extend(values.names(user).iter().map(|n| values.text(&format!("{user}.{n}.material"))));
        }
    }
    if names.iter().any(|n| n == name) {
        return Ok(());
    }
    names.sort_unstable();
    names.dedup();
    let known =
        if names.is_empty() { "there are none".into() } else { format!("there are: {}", names.join(", ")) };
    Err((format!("the scene has no {name} in {section}"), known))
}
