//! Values that hide something or have no effect, which the scene tells wherever they come from.

use super::rules::builder;
use super::without_effect;
use crate::scene::Values;
use crate::scene::measured::Builder;
use crate::scene::param::{COLORS, Param, key_of_volume, split_volume_key};
use crate::scene::volumes;
use crate::trace::{AttenuationKind, Lookup};

/// Returns a warning about each value by which the scene shows less than it seems to.
pub(in crate::scene) fn told(values: &Values) -> Vec<String> {
    let mut told: Vec<String> = transparent(values).into_iter().collect();
    told.extend(without_lines(values));
    told.extend(without_motion(values));
    told.extend(volumes::shown(values).iter().filter_map(|name| crowded(values, name)));
    told.extend(of_volumes(values));
    told
}

/// Returns a warning where no volume hides anything.
fn transparent(values: &Values) -> Option<String> {
    let (key, more) = match values.choice("trace.attenuation", AttenuationKind::from_word) {
        AttenuationKind::PathLength => ("trace.sigma", "1.5 ÷ its edge in metres"),
        AttenuationKind::PerCell => ("trace.tau", "1.5"),
    };
    let has_volume = !volumes::used_materials(values).is_empty() || !values.names("boxes").is_empty();
    (has_volume && values.float(key) == 0.0).then(|| {
        format!(
            "{key} = 0 makes all volumes transparent; a cell hides most of what lies behind it from {more} on"
        )
    })
}

/// Returns a warning where rays look for the strands of cells, and no volume keeps any.
fn without_lines(values: &Values) -> Option<String> {
    let keeps_lines = |name: &String| {
        builder(values, name) == Builder::Curves
            && values.text(&key_of_volume(name, "volume.file")).is_empty()
    };
    let shown = volumes::shown(values);
    let looks = values.choice("trace.lookup", Lookup::from_word) == Lookup::Strand;
    (looks && !shown.is_empty() && !shown.iter().any(keeps_lines)).then(|| {
        "trace.lookup = \"strand\" finds no strands, which only volumes of curves keep: cells are shown as \
         with nearest; set trace.lookup=trilinear for close views"
            .to_string()
    })
}

/// Returns a warning where the shutter is open, and nothing is shown that moves meanwhile.
fn without_motion(values: &Values) -> Option<String> {
    let moves =
        !values.names("pools").is_empty() || volumes::shown(values).iter().any(|name| name == "water");
    (values.float("camera.shutter") > 0.0 && !moves)
        .then(|| "camera.shutter moves the volume water and pools, of which the scene shows none".to_string())
}

/// Returns a warning about a volume with more clumps or locks than hairs.
fn crowded(values: &Values, name: &str) -> Option<String> {
    let gathers = |key: &str| values.float(&key_of_volume(name, key)) > 0.0;
    let keys = match builder(values, name) {
        Builder::Fur if gathers("fur.clumping") => ["fur.clumps", "fur.hairs"],
        Builder::Hair => ["tress.locks", "tress.strand_count"],
        _ => return None,
    };
    let [many, of] = keys.map(|key| key_of_volume(name, key));
    let [number, hairs] = [&many, &of].map(|key| values.int(key));
    (number > hairs).then(|| {
        format!(
            "{many} = {number} is more than {of} = {hairs}, so hairs hardly gather: lower it to a twentieth \
             of them or less"
        )
    })
}

/// Returns a warning about each key of a shown volume that has no effect: those that the user gave a value
/// of their own, and colours behind a gap of the ramp, which a removed colour leaves.
fn of_volumes(values: &Values) -> Vec<String> {
    let shown = volumes::shown(values);
    let is_meant = |key: &String| {
        let Some((name, own)) = split_volume_key(key) else { return false };
        let is_given = values.is_set_by_user(key) && !is_default(values, key);
        shown.iter().any(|other| other == name) && (is_given || COLORS.contains(&own))
    };
    let keys = values.0.keys().map(ToString::to_string).filter(is_meant);
    keys.filter_map(|key| without_effect(values, &key)).collect()
}

/// Whether a key has the value that it has by itself. A printed scene has all of them.
fn is_default(values: &Values, key: &str) -> bool {
    let has_default = Param::find(key).is_some_and(|param| !param.is_optional());
    has_default && values.get(key) == Values::default().get(key)
}
