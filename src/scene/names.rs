//! Keys as users write them: in full, by their last part alone, or misspelt.

use super::meshes;
use super::param::{Kind, PARAMS, Param, WATER, last_part, matches, split_volume_key};
use super::remove::{NUMBERED, REMOVE};
use super::value::{Place, Raw, Values, check};
use super::volumes::used_materials;
use crate::util::error::Error;

/// Sections whose keys have a name of the scene's choice as their second part.
pub const NAMED: [&str; 9] =
    ["boxes", "lights", "materials", "meshes", "pools", "rocks", "sheets", "splashes", "volumes"];

/// Least likeness of a key to a misspelt one that makes it worth a suggestion.
const ALIKE: f64 = 0.7;
/// Least likeness of the last part of a key to another one of its own table, such as `width` and `widths`,
/// that makes that one likelier than a key of the right name in another table.
const ALIKE_IN_TABLE: f64 = 0.9;

/// Words that other programs use for parameters, by the patterns of the keys. The words stand in the same
/// table.
const OTHER_WORDS: &[(&str, &[&str])] = &[
    ("animate.fps", &["frame_rate", "framerate", "rate"]),
    ("camera.eye", &["from", "location", "origin", "pos", "position"]),
    ("camera.fov", &["focal_length", "lens", "zoom"]),
    ("camera.target", &["at", "aim", "center", "centre", "interest", "look_at", "lookat", "to"]),
    ("boxes.*.position", &["at", "center", "centre", "location", "origin", "pos", "translation"]),
    ("boxes.*.size", &["scale", "sides"]),
    ("boxes.*.turn", &["rotate", "rotation"]),
    ("boxes.*.volume", &["material"]),
    ("meshes.*.file", &["model", "path", "source"]),
    ("meshes.*.position", &["at", "location", "origin", "pos", "translation"]),
    ("meshes.*.scale", &["size"]),
    ("meshes.*.turn", &["rotate", "rotation"]),
    ("environment.file", &["hdr", "hdri", "image", "map", "path", "texture"]),
    ("environment.intensity", &["brightness", "energy", "power", "strength"]),
    ("environment.turn", &["azimuth", "rotate", "rotation"]),
    ("hair.beta_m", &["roughness", "roughness_m"]),
    ("hair.beta_n", &["radial_roughness", "roughness_n"]),
    ("hair.eta", &["ior"]),
    ("hair.redness", &["melanin_redness"]),
    ("hair.tilt", &["alpha", "offset"]),
    ("image.exposure", &["brightness", "ev"]),
    ("image.samples", &["aa", "antialiasing", "spp"]),
    ("lights.*.direction", &["rotation", "target"]),
    ("lights.*.intensity", &["brightness", "energy", "power", "strength"]),
    ("materials.*.thickness", &["depth"]),
    ("rocks.*.color", &["albedo", "base_color", "diffuse"]),
    ("volume.alpha", &["density", "opacity"]),
    ("volume.seed", &["random", "random_seed", "rng"]),
    ("volumes.*.alpha", &["density", "opacity"]),
    ("volumes.*.seed", &["random", "random_seed", "rng"]),
];

/// Returns the full key that `name` stands for: `name` itself, or the one key of the scene that ends with it,
/// such as `rocks.wall.show` for `wall.show`.
/// Parameters that a scene has once take precedence over those of lights, rocks and materials, and all of
/// them over those of the animation. Switches come last: `alpha` is the paper's α, not that of the image.
///
/// # Errors
/// The candidates, where `name` can mean several.
pub fn full_key(name: &str, values: &Values) -> std::result::Result<String, String> {
    if name.is_empty() || Param::find(name).is_some() {
        return Ok(name.into());
    }
    let mut keys = ending_with(name, values);
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

/// Returns the keys of the scene whose last parts are `name`.
fn ending_with(name: &str, values: &Values) -> Vec<String> {
    let ends = |key: &String| key.strip_suffix(name).is_some_and(|rest| rest.ends_with('.'));
    values.known_keys().into_iter().filter(ends).collect()
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
        _ => return unknown(key, None, values, nearest(key, values.known_keys()), place),
    };
    Error::input(format!("{}: unknown key {key:?}", place.0), advice)
}

/// Keys of a scene file that stand before its tables.
pub(super) const AT_THE_TOP: [&str; 3] = ["version", "base", REMOVE];

/// The error for an unknown key in a scene file, which may name lights and other things as it likes. It
/// suggests the nearest key that the scene has so far, or one that has the misspelt key's own name. `raw` is
/// the value of the key.
pub fn unknown_key_in_file(key: &str, raw: &Raw, values: &Values, place: &Place) -> Error {
    if let Some(advice) = meshes::dotted(key) {
        return Error::input(format!("{}: unknown key {key}", place.0), advice);
    }
    if let Some(top) = AT_THE_TOP.iter().find(|top| last_part(key) == **top) {
        let what = format!("{}: unknown key {key}", place.0);
        return Error::input(what, format!("write the line {top} = … above the first table"));
    }
    if let Some(advice) = brackets(key, raw) {
        return Error::input(format!("{}: unknown key {key}", place.0), advice);
    }
    let parts: Vec<&str> = key.split('.').collect();
    let named = PARAMS.iter().filter_map(|param| {
        let pattern: Vec<&str> = param.key.split('.').collect();
        // A material of a mesh may have any name, so its pattern is no evidence of what was meant.
        let alike = pattern.last() != Some(&"*") || pattern[0] == parts[0];
        let fits = pattern.contains(&"*") && pattern.len() == parts.len() && alike;
        let whole = || pattern.iter().zip(&parts).map(|(want, own)| if *want == "*" { own } else { want });
        fits.then(|| whole().copied().collect::<Vec<&str>>().join("."))
    });
    let named: Vec<String> = named.collect();
    let near = nearest(key, values.known_keys().into_iter().chain(named));
    unknown(key, Some(raw), values, near, place)
}

fn unknown(key: &str, raw: Option<&Raw>, values: &Values, near: Option<String>, place: &Place) -> Error {
    let mean = |key: String| format!("did you mean {key}?");
    let fix = misplaced(key)
        .or_else(|| word_of_choice(key, raw))
        .or_else(|| in_the_part_of_its_name(key, values).map(mean))
        .or_else(|| in_the_same_table(key).map(mean))
        .or_else(|| size_of_the_picture(key))
        .or_else(|| elsewhere(key, raw, values))
        .or_else(|| own_table(key))
        .or_else(|| near.map(mean))
        .unwrap_or_else(|| "docs/parameters.md lists every key".into());
    Error::input(format!("{}: unknown key {key}", place.0), fix)
}

/// Returns advice on a table of a scene file whose header has the wrong brackets, or no name.
fn brackets(key: &str, raw: &Raw) -> Option<String> {
    let parts: Vec<&str> = key.split('.').collect();
    if let [section, last] = parts[..]
        && NAMED.contains(&section)
        && Param::find(&format!("{section}.NAME.{last}")).is_some()
    {
        return Some(own_header(section));
    }
    let Raw::List(items) = raw else { return None };
    let tables = !items.is_empty() && items.iter().all(|item| matches!(item, Raw::Other("a table")));
    let is_table = PARAMS.iter().any(|param| {
        let pattern: Vec<&str> = param.key.split('.').collect();
        let fits = pattern.iter().zip(&parts).all(|(want, own)| *want == "*" || want == own);
        pattern.len() > parts.len() && fits
    });
    let single = tables && is_table && !NAMED.contains(&key);
    single.then(|| format!("write [{key}] in single brackets"))
}

/// Returns advice on a key that is a word of a choice in the same table, such as `holdout = true`.
fn word_of_choice(key: &str, raw: Option<&Raw>) -> Option<String> {
    let (table, word) = key.rsplit_once('.')?;
    if let Some(Raw::Switch(false)) = raw {
        return None;
    }
    PARAMS.iter().find_map(|param| {
        let own = last_part(param.key);
        let Kind::Choice(words) = param.kind else { return None };
        let here = words.contains(&word) && matches(param.key, &format!("{table}.{own}"));
        here.then(|| format!("write {own} = {word:?}"))
    })
}

/// Returns the key that is meant where a table has the name of one part of the scene, such as `[sun]` for
/// `[lights.sun]`.
fn in_the_part_of_its_name(key: &str, values: &Values) -> Option<String> {
    let (name, rest) = key.split_once('.')?;
    let mut parts = NAMED.iter().filter(|section| values.names(section).iter().any(|part| part == name));
    let (section, None) = (parts.next()?, parts.next()) else { return None };
    let key = format!("{section}.{key}");
    let in_part = |last: &str| format!("{section}.{name}.{last}");
    match Param::find(&key) {
        Some(_) => Some(key),
        None => in_the_same_table(&key).or_else(|| {
            let keys = PARAMS.iter().filter_map(|param| param.key.strip_prefix(section)?.strip_prefix(".*."));
            likeliest(rest, keys).map(in_part)
        }),
    }
}

/// Returns the key that is meant where its own table has one that is spelt nearly so, or that other programs
/// call so.
fn in_the_same_table(key: &str) -> Option<String> {
    let key = key.to_lowercase();
    let (table, last) = key.rsplit_once('.')?;
    // The key of a parameter in this table, if it has the parameter.
    let own = |pattern: &str| {
        let full = format!("{table}.{}", last_part(pattern));
        matches(pattern, &full).then_some(full)
    };
    let alike = PARAMS.iter().filter_map(|param| {
        let full = own(param.key)?;
        let alike = strsim::jaro_winkler(last, last_part(&full));
        (last_part(&full).len() > 1 && alike > ALIKE_IN_TABLE).then_some((alike, full))
    });
    let alike = alike.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, full)| full);
    let mut meant = OTHER_WORDS.iter().filter(|(_, words)| words.contains(&last));
    alike.or_else(|| meant.find_map(|(pattern, _)| own(pattern)))
}

/// Returns advice on a key that stands in the wrong table. Keys of a table with a similar name go first, then
/// those that allow the value, and then those that a scene has once.
fn elsewhere(key: &str, raw: Option<&Raw>, values: &Values) -> Option<String> {
    let (key, first) = (key.to_lowercase(), |key: &str| key.split('.').next().unwrap_or("").to_lowercase());
    // Between keys of one letter, such as `curves.g` and `curves.h`, a slip of the finger is likelier.
    let short = |key: &str| last_part(key).len() == 1;
    if short(&key) && key.contains('.') && keys_within(&first(&key)).into_iter().any(short) {
        return None;
    }
    let absent = PARAMS.iter().filter_map(|param| {
        let (section, rest) = param.key.split_once(".*.")?;
        let always = ["materials", "volumes"].contains(&section);
        let absent = NAMED.contains(&section) && !always && !values.has_under(section);
        absent.then(|| format!("{section}.NAME.{rest}"))
    });
    let mut keys: Vec<String> = values.known_keys().into_iter().chain(absent).collect();
    keys.retain(|other| last_part(other) == last_part(&key));
    let fits = |other: &String| {
        Param::find(other).is_some_and(|param| raw.is_none_or(|raw| check(param, raw).is_ok()))
    };
    let alike = |other: &String| strsim::jaro_winkler(&first(&key), &first(other)) > 0.85;
    let still = |other: &String| !other.starts_with("animate.");
    let once = |other: &String| PARAMS.iter().any(|param| param.key == other);
    let wishes: [&dyn Fn(&String) -> bool; 4] = [&alike, &fits, &still, &once];
    for wish in wishes {
        if keys.iter().any(wish) {
            keys.retain(wish);
        }
    }
    if keys.iter().all(alike) {
        let score = |other: &String| strsim::jaro_winkler(&key, other);
        keys = keys.into_iter().max_by(|a, b| score(a).total_cmp(&score(b))).into_iter().collect();
    }
    if keys.len() > 1 {
        let pattern = |param: &Param| param.key.replace("quads.*", "quads.0").replace('*', "NAME");
        keys = keys.iter().filter_map(|key| Param::find(key)).map(pattern).collect();
        keys.dedup();
    }
    (!keys.is_empty()).then(|| format!("did you mean {}?", keys.join(" or ")))
}

/// Returns advice on a key that is the size of the picture.
fn size_of_the_picture(key: &str) -> Option<String> {
    let (section, last) = key.rsplit_once('.')?;
    let is_meant = ["size", "resolution"].contains(&last) && !section.starts_with("boxes");
    is_meant.then(|| "write image.width and image.height".into())
}

/// Returns advice on a key that is the name of a table.
fn own_table(key: &str) -> Option<String> {
    let (_, last) = key.rsplit_once('.')?;
    if NAMED.contains(&last) || NUMBERED.contains(&last) {
        return Some(own_header(last));
    }
    let keys = keys_within(last);
    (!keys.is_empty()).then(|| format!("[{last}] is a table of its own, with the keys {}", listed(&keys)))
}

/// Returns the keys of a table.
fn keys_within(table: &str) -> Vec<&'static str> {
    let within = |key: &&str| key.strip_prefix(table).is_some_and(|rest| rest.starts_with('.'));
    PARAMS.iter().map(|param| param.key).filter(within).collect()
}

/// Returns the one of `names` that a misspelt one is most like, if it is.
pub fn likeliest<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.to_lowercase();
    let alike = |other: &str| strsim::jaro_winkler(&name, &other.to_lowercase());
    names.filter(|other| alike(other) > 0.8).max_by(|a, b| alike(a).total_cmp(&alike(b)))
}

/// Returns advice on the header of one part of a section, such as one light.
fn own_header(section: &str) -> String {
    let header = match NUMBERED.contains(&section) {
        true => format!("[[{section}]]"),
        false => format!("[{section}.NAME]"),
    };
    format!("each of them has a table of its own: {header}")
}

/// Returns advice on a key that is unknown because a table or a name was written in another way.
fn misplaced(key: &str) -> Option<String> {
    let parts: Vec<&str> = key.split('.').collect();
    if NAMED.contains(&key) || NUMBERED.contains(&key) {
        return Some(own_header(key));
    }
    if let Some(advice) = meshes::dotted(key) {
        return Some(advice);
    }
    let named = NAMED.contains(&parts[0]);
    if named && parts[1..].contains(&"") {
        return Some(format!("give it a name: [{}.NAME]", parts[0]));
    }
    if let ["volumes", name, "curves" | "volume", last] = parts[..]
        && Param::find(&format!("volumes.{name}.{last}")).is_some()
    {
        return Some(format!("write volumes.{name}.{last}: a volume has all its keys in one table"));
    }
    let last = format!("{}.*.{}", parts[0], parts[parts.len() - 1]);
    if named && parts.len() > 3 && PARAMS.iter().any(|param| param.key == last) {
        let name = parts[1..parts.len() - 1].join(".");
        return Some(format!("the name {name:?} has a dot; choose one without"));
    }
    let unnumbered = |list: &&&str| {
        key.strip_prefix(**list)
            .and_then(|rest| rest.strip_prefix('.'))
            .is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_digit()))
    };
    if let Some(list) = NUMBERED.iter().find(unnumbered) {
        return Some(own_header(list));
    }
    let keys = keys_within(key);
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
            let score = score.max(strsim::jaro_winkler(&key, last_part(&low)));
            // As in `full_key`, a switch comes last.
            let is_switch = Param::find(&candidate).is_some_and(|p| matches!(p.kind, Kind::Switch(_)));
            (score - if is_switch { 1e-6 } else { 0.0 }, candidate)
        })
        .filter(|(score, _)| *score > ALIKE)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// The fault of a key in a table `volumes.water`, and the way out; `None` for another key. The keys of the
/// volume `water` have tables of their own.
pub(super) fn in_table_of_water(key: &str) -> Option<(String, String)> {
    let last = key.strip_prefix("volumes.")?.strip_prefix(WATER)?;
    let of_water = |last: &str| split_volume_key(&format!("volumes.{WATER}.{last}")).map(|(_, own)| own);
    let fix = match last.strip_prefix('.').and_then(of_water) {
        Some(own) => format!("write {own}: the keys of the volume {WATER} are in [curves] and [volume]"),
        None if last.is_empty() || last.starts_with('.') => {
            format!("the keys of the volume {WATER} are in [curves] and [volume]")
        }
        None => return None,
    };
    Some((format!("there is no table volumes.{WATER}"), fix))
}

/// Checks that the scene has the name in `key`, so that a misspelt one does not add a second light. The error
/// is the fault and the list of the names there are.
pub fn check_names(values: &Values, key: &str) -> std::result::Result<(), (String, String)> {
    let mut parts = key.split('.');
    let (Some(section), Some(name)) = (parts.next(), parts.next()) else { return Ok(()) };
    if let Some(fault) = in_table_of_water(key) {
        return Err(fault);
    }
    if !NAMED.contains(&section) && section != "quads" {
        return Ok(());
    }
    let mut names = values.names(section);
    if section == "materials" {
        names.extend(used_materials(values));
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
