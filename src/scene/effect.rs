//! Settings that have no effect, because another parameter switches off what they belong to.

mod rules;
mod told;

use super::Values;
use super::measured::Builder;
use super::meshes::{self, Carrier};
use super::names::full_key;
use super::param::{Param, key_of_volume, matches, split_volume_key};
use super::read::split;
use super::sequence::{self, Sequence};
use super::volumes;
use rules::{RULES, Rule, builder};
pub(super) use told::told;

/// Returns the first rule by which a key has no effect, with its switch, whose key is full.
fn rule(values: &Values, key: &str) -> Option<(&'static Rule, String)> {
    rules(values, key).next()
}

/// Returns the rules by which a key has no effect, each with its switch, whose key is full.
fn rules(values: &Values, key: &str) -> impl Iterator<Item = (&'static Rule, String)> {
    let of_volume = split_volume_key(key);
    let own = of_volume.map_or(key, |(_, of_water)| of_water);
    let is_of_key = move |rule: &&Rule| rule.keys.iter().any(|pattern| matches(pattern, own));
    RULES.iter().filter(is_of_key).filter_map(move |rule| {
        let name = key.split('.').nth(1).unwrap_or_default();
        let switch = match of_volume {
            Some((volume, _)) if split_volume_key(rule.switch).is_some() => {
                key_of_volume(volume, rule.switch)
            }
            _ => rule.switch.replace('*', name),
        };
        (!(rule.works)(values, &switch)).then_some((rule, switch))
    })
}

/// Whether the way in which a volume is made takes no notice of a key: of a key of grids in a volume of
/// curves, of a key of curves in one of grids, and of the number of a file where no name has a place for it.
pub fn is_of_other_builder(values: &Values, key: &str) -> bool {
    rules(values, key).any(|(rule, _)| ["volume.builder", "volume.strands"].contains(&rule.switch))
        || without_sequence(values, key).is_some()
}

/// Returns why the value of a key has no effect; `None` where it has one.
pub fn without_effect(values: &Values, key: &str) -> Option<String> {
    if let Some(why) = volumes::without_effect(values, key) {
        return Some(why);
    }
    if let Some(why) = without_volume(values, key).or_else(|| without_water(values, key)) {
        return Some(why);
    }
    if let Some(why) = without_sequence(values, key).or_else(|| without_fibres(values, key)) {
        return Some(why);
    }
    let (rule, switch) = rule(values, key)?;
    let is_missing = !values.is_set(&switch) && Param::find(&switch).is_some_and(Param::is_optional);
    let now = if is_missing { "not set".into() } else { values.get(&switch).to_toml() };
    Some(format!("{key} has no effect while {switch} is {now}: it needs {}", rule.needs))
}

/// Returns why the number of a volume's file has no effect: no name has a place for it.
fn without_sequence(values: &Values, key: &str) -> Option<String> {
    let (volume, _) = split_volume_key(key).filter(|(_, own)| *own == "volume.frame")?;
    let file = sequence::key_of(values, volume);
    let is_single = Sequence::of(values, volume, None).is_none();
    is_single
        .then(|| format!("{key} has no effect: {file} has no #### in its name, in the place of a number"))
}

/// Keys of meshes that place the volume.
const OF_COVERS: [&str; 3] = ["meshes.*.projection", "meshes.*.projection_size", "meshes.*.uv"];

/// Returns why a key that places the volume on a mesh has no effect: no part of the mesh carries one.
fn without_volume(values: &Values, key: &str) -> Option<String> {
    let name = key.split('.').nth(1).filter(|_| OF_COVERS.iter().any(|pattern| matches(pattern, key)))?;
    let is_bare = meshes::materials_of(values, name).is_empty();
    is_bare.then(|| format!("{key} has no effect: no part of the mesh has a material of the scene"))
}

/// Keys of the light of fibres.
const OF_FIBRES: [&str; 5] = ["hair.*", "light.p", "light.reflection", "light.scattering", "strand.*"];

/// Returns why a key of the light of fibres has no effect: all volumes of the scene are skin.
fn without_fibres(values: &Values, key: &str) -> Option<String> {
    let is_of_fibres = OF_FIBRES.iter().any(|pattern| matches(pattern, key));
    let is_skin = |name: &String| builder(values, name) == Builder::Skin;
    (is_of_fibres && volumes::shown(values).iter().all(is_skin)).then(|| {
        format!(
            "{key} has no effect: the scene's volumes are skin, whose light scatters many times by itself"
        )
    })
}

/// Keys of the film of water on rocks and meshes.
const OF_FILMS: [&str; 4] = ["meshes.*.wet", "meshes.*.wet_reach", "rocks.*.wet", "rocks.*.wet_reach"];

/// Returns why a key of the film of water has no effect: the scene has nothing that wets.
fn without_water(values: &Values, key: &str) -> Option<String> {
    let wets = |material: &String| {
        let own = |what: &str| format!("materials.{material}.{what}");
        let volume = volumes::volume_of(values, material);
        match values.choice(&own("carrier"), Carrier::from_word) {
            Carrier::Face => values.float(&own("mist")) == 0.0,
            // Fur, cloth and rock are no water. A volume that the scene lacks is refused.
            Carrier::Shell => [Builder::Curves, Builder::Flow].contains(&builder(values, &volume)),
        }
    };
    let is_dry = || values.names("pools").is_empty() && !volumes::used_materials(values).iter().any(wets);
    (OF_FILMS.iter().any(|pattern| matches(pattern, key)) && is_dry()).then(|| {
        format!(
            "{key} has no effect: the scene has no water that wets, which is a quad, sheet or splash without \
             mist, a shell of water, or a pool"
        )
    })
}

/// Parameters of the picture as shown, which EXR files do not hold.
const OF_SHOWN_PICTURES: [&str; 10] = [
    "image.exposure",
    "image.bloom",
    "image.bloom_radius",
    "image.temperature",
    "image.tint",
    "image.tone",
    "image.dither",
    "image.vignette",
    "image.grain",
    "image.grain_seed",
];

/// Returns a sentence for each `--set` that has no effect on files of these kinds: pictures `as_shown`, and
/// those of `linear` light.
pub fn settings_without_file(values: &Values, sets: &[String], as_shown: bool, linear: bool) -> Vec<String> {
    let keys = sets.iter().filter_map(|setting| full_key(split(setting)?.0, values).ok());
    let why = |key: &str| match key {
        "image.primaries" if !linear => Some("pictures as shown are sRGB; add --linear or write .exr"),
        key if !as_shown && OF_SHOWN_PICTURES.contains(&key) => {
            Some("EXR files hold the light before it; add -o FILE.png")
        }
        _ => None,
    };
    let mut said: Vec<String> =
        keys.filter_map(|key| Some(format!("{key} has no effect: {}", why(&key)?))).collect();
    said.dedup();
    said
}

/// Returns a sentence for each `--set` without effect, and for each sweep, whose pictures would be equal.
/// `values` are those with all settings.
pub fn settings_without_effect(values: &Values, sets: &[String], sweeps: &[String]) -> Vec<String> {
    let key = |setting: &String| full_key(split(setting)?.0, values).ok();
    let swept: Vec<String> = sweeps.iter().filter_map(key).collect();
    let set = sets.iter().filter_map(key);
    let mut said: Vec<String> = set
        .chain(swept.clone())
        // A switch that is swept is on in other pictures.
        .filter(|key| rule(values, key).is_none_or(|(_, switch)| !swept.contains(&switch)))
        .filter_map(|key| without_effect(values, &key))
        .collect();
    said.dedup();
    said
}
