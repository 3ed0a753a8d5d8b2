//! Names of a file's materials in the keys of a scene, and what the parts with each become.

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use super::{Becomes, NONE, OPAQUE, is_word};
use crate::model::{Model, find_name, folded_name};
use crate::scene::Values;
use crate::scene::param::{MESH_MATERIAL, matches};
use crate::scene::print::quoted;
use crate::scene::quads::unknown_material;
use crate::util::error::{Error, Result};

/// Stands for a dot of a material's name in a key, whose own dots part it. It looks like a dot.
const DOT: char = '\u{2024}';

/// Returns the last part of a key for a material of this name.
pub(in crate::scene) fn in_key(name: &str) -> String {
    name.replace('.', &DOT.to_string())
}

/// Returns the name that the last part of a key stands for.
fn from_key(part: &str) -> String {
    part.replace(DOT, ".")
}

/// Whether a key is that of what a material of a mesh's file becomes.
fn is_of_material(key: &str) -> bool {
    matches(MESH_MATERIAL, key)
}

/// Returns the last part of a key as it is written in a scene file, without quotes.
pub(in crate::scene) fn written(key: &str) -> String {
    let last = key.rsplit('.').next().unwrap_or(key);
    if is_of_material(key) { from_key(last) } else { last.into() }
}

/// Returns a key as a user writes it.
pub(super) fn shown(key: &str) -> String {
    match key.rsplit_once('.') {
        Some((table, last)) if last.contains(DOT) => format!("{table}.{}", quoted(&from_key(last))),
        _ => key.into(),
    }
}

/// Returns the key of a `--set` whose last part, the name of a material, stands in quotes; other keys as they
/// are.
pub(in crate::scene) fn unquoted(key: &str) -> String {
    let parts = key.strip_suffix('"').and_then(|rest| rest.split_once(".materials.\""));
    match parts.filter(|(mesh, _)| mesh.starts_with("meshes.")) {
        Some((mesh, name)) => format!("{mesh}.materials.{}", in_key(name)),
        None => key.into(),
    }
}

/// Returns the keys that name the same materials as `key`, which has underscores for blanks and dots, in
/// another spelling. A later `key` stands in their place.
pub(in crate::scene) fn other_spellings(values: &Values, key: &str) -> Vec<String> {
    let Some((table, name)) = key.rsplit_once('.').filter(|_| is_of_material(key)) else { return Vec::new() };
    if folded_name(&from_key(name)) != name || values.is_set(key) {
        return Vec::new();
    }
    let names = values.names(table).into_iter();
    let same = names.filter(|other| folded_name(&from_key(other)) == name);
    same.map(|other| format!("{table}.{other}")).collect()
}

/// Returns advice on a key whose last part is a material's name with a dot outside of quotes.
pub(in crate::scene) fn dotted(key: &str) -> Option<String> {
    let parts: Vec<&str> = key.split('.').collect();
    let ["meshes", _, "materials", name @ ..] = &parts[..] else { return None };
    let name = name.join(".");
    let is_name = name.contains('.') && !name.split('.').any(str::is_empty);
    is_name.then(|| format!("put a name with dots in quotes, {name:?}, or write {}", folded_name(&name)))
}

/// What the parts of a mesh become.
pub(super) struct Named {
    /// What those with each material become, and last those without one.
    pub becomes: Vec<Becomes>,
    /// Key of each material, as the scene has it or may have it; `None` for one without a name.
    pub keys: Vec<Option<String>>,
}

impl Named {
    /// Reads what the materials of a file become. A key that is a name of the file names that material alone.
    /// In other keys, underscores stand for blanks and dots.
    ///
    /// # Errors
    /// [`Error::Input`] where the file has no material of a key's name, or several.
    pub fn new(v: &Values, mesh: &str, file: &Path, model: &Model) -> Result<Named> {
        let (table, default) = (format!("meshes.{mesh}.materials"), format!("meshes.{mesh}.material"));
        let names = || model.materials.iter().map(|material| material.name.as_str());
        // A file may have very many materials.
        let mut alike: HashMap<String, BTreeSet<&str>> = HashMap::new();
        names().for_each(|name| {
            alike.entry(folded_name(name)).or_default().insert(name);
        });
        let mut becomes = vec![becomes(v, &default)?; model.materials.len() + 1];
        let mut keys: Vec<Option<String>> = vec![None; model.materials.len()];
        let (mut folded_keys, mut exact_keys) = (Vec::new(), Vec::new());
        for part in v.names(&table) {
            let key = format!("{table}.{part}");
            let own = self::becomes(v, &key)?;
            let is_it = |name: &str| !name.is_empty() && in_key(name) == part;
            if names().any(is_it) {
                let found: Vec<usize> = places(names(), is_it);
                exact_keys.push((key, own, found));
                continue;
            }
            let wanted = from_key(&part);
            let folded = folded_name(&wanted);
            let meant = alike.get(&folded);
            match meant.map_or(0, BTreeSet::len) {
                0 => return Err(unknown(&shown(&key), &wanted, file, &default, names())),
                1 => folded_keys.push((key, own, places(names(), |name| folded_name(name) == folded))),
                _ => {
                    let listed: Vec<String> =
                        meant.into_iter().flatten().take(8).map(|name| format!("{name:?}")).collect();
                    return Err(Error::input(
                        format!("{}: {} has several materials of this name", shown(&key), file.display()),
                        format!("put the name in quotes: {}", listed.join(" or ")),
                    ));
                }
            }
        }
        // A name in full goes before one with underscores.
        for (key, own, found) in folded_keys.into_iter().chain(exact_keys) {
            for i in found {
                becomes[i] = own.clone();
                keys[i] = Some(key.clone());
            }
        }
        for (key, name) in keys.iter_mut().zip(names()).filter(|(_, name)| !name.is_empty()) {
            let folded = folded_name(name);
            let part = if alike[&folded].len() == 1 { folded } else { in_key(name) };
            key.get_or_insert_with(|| format!("{table}.{part}"));
        }
        Ok(Named { becomes, keys })
    }
}

/// Returns the places in a list of the names that are wanted.
fn places<'a>(names: impl Iterator<Item = &'a str>, is_wanted: impl Fn(&str) -> bool) -> Vec<usize> {
    names.enumerate().filter(|(_, name)| is_wanted(name)).map(|(i, _)| i).collect()
}

/// Reads what the word of a key stands for.
fn becomes(v: &Values, key: &str) -> Result<Becomes> {
    let word = v.text(key);
    match unknown_material(&word, &v.names("materials")).filter(|_| !is_word(&word)) {
        None => Ok(Becomes::new(word)),
        Some(fix) => Err(Error::input(
            format!("{} = {word:?}: the scene has no such material", shown(key)),
            format!("{fix}; a part can also be {OPAQUE}, or {NONE}"),
        )),
    }
}

/// The error for a material that the file does not have.
fn unknown<'a>(
    key: &str,
    wanted: &str,
    file: &Path,
    default: &str,
    names: impl Iterator<Item = &'a str>,
) -> Error {
    let names: Vec<&str> = names.filter(|name| !name.is_empty()).collect();
    let near = find_name(wanted, names.iter().copied()).err().flatten().map(folded_name);
    let fix = match (near, &names[..]) {
        (_, []) => format!("its materials have no names; set {default} for all of them"),
        (Some(near), _) => format!("did you mean {near}? It has {}", listed(names.iter().copied())),
        (None, _) => format!("it has {}", listed(names.iter().copied())),
    };
    Error::input(format!("{key}: {} has no material {wanted}", file.display()), fix)
}

/// Joins at most 16 names of a file, as keys. Empty ones are left out.
pub(super) fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.filter(|name| !name.is_empty()).map(folded_name).collect();
    match names.len() {
        0 => "none with a name".into(),
        1..=16 => names.join(", "),
        n => format!("{} and {} more", names[..16].join(", "), n - 16),
    }
}
