//! Further volumes beside `water`. Each has the keys of the groups of a volume, such as Curves and Fur, in a
//! table.

use std::str::from_utf8;

use super::ground::{GRAINS, MOUNTAIN};
use super::matter::{CLOTH, FUR, HAIR, IMPORT};
use super::skin::SKIN;
use super::volume::{CURVES, VOLUME};
use super::{Group, Param, last_part};

/// Name of the volume whose keys are those of the tables `[curves]` and `[volume]`.
pub const WATER: &str = "water";

pub(super) const VOLUMES: Group = Group {
    title: "Volumes",
    about: "Volumes of other matter beside `water`, each under a name such as `fur`. A volume has every key \
         of `curves`, `volume`, `fur`, `cloth`, `tress`, `import`, `mountain`, `grains` and `skin` in one \
         table; where a description names one of those keys, it means the key of the same volume. A material \
         says with `materials.*.volume` which volume it shows. A volume that no surface shows is not built.",
    params: &PARAMS,
};

/// Prefix of the keys.
const PREFIX: &[u8] = b"volumes.*.";
/// Groups whose keys every volume has.
const GROUPS: [&[Param]; 9] = [
    CURVES.params,
    VOLUME.params,
    FUR.params,
    CLOTH.params,
    HAIR.params,
    IMPORT.params,
    MOUNTAIN.params,
    GRAINS.params,
    SKIN.params,
];
const COUNT: usize = {
    let (mut sum, mut group) = (0, 0);
    while group < GROUPS.len() {
        (sum, group) = (sum + GROUPS[group].len(), group + 1);
    }
    sum
};

/// Parameter number `i` of these groups.
const fn source(mut i: usize) -> &'static Param {
    let mut group = 0;
    while i >= GROUPS[group].len() {
        (i, group) = (i - GROUPS[group].len(), group + 1);
    }
    &GROUPS[group][i]
}

/// Position of the last part of a key.
const fn last_part_at(key: &str) -> usize {
    let mut at = key.len();
    while key.as_bytes()[at - 1] != b'.' {
        at -= 1;
    }
    at
}

/// Bytes of the key of parameter number `i`.
const fn length(i: usize) -> usize {
    PREFIX.len() + source(i).key.len() - last_part_at(source(i).key)
}

const fn length_of_all() -> usize {
    let (mut sum, mut i) = (0, 0);
    while i < COUNT {
        (sum, i) = (sum + length(i), i + 1);
    }
    sum
}

/// All keys, one after the other.
const KEYS: &[u8] = &{
    let mut all = [0; length_of_all()];
    let (mut at, mut i) = (0, 0);
    while i < COUNT {
        let (key, mut k) = (source(i).key, 0);
        let last = last_part_at(key);
        while k < length(i) {
            all[at + k] = if k < PREFIX.len() { PREFIX[k] } else { key.as_bytes()[last + k - PREFIX.len()] };
            k += 1;
        }
        (at, i) = (at + length(i), i + 1);
    }
    all
};

const PARAMS: [Param; COUNT] = {
    let mut params = [*source(0); COUNT];
    let (mut at, mut i) = (0, 0);
    while i < COUNT {
        let (_, rest) = KEYS.split_at(at);
        let (key, _) = rest.split_at(length(i));
        let Ok(key) = from_utf8(key) else { panic!("a key is UTF-8") };
        params[i] = Param { key, ..*source(i) };
        (at, i) = (at + length(i), i + 1);
    }
    params
};

/// Returns the key by which the volume `name` has the parameter that the volume `water` has by `key`, such as
/// `volume.nx` or `curves.across`.
pub fn key_of_volume(name: &str, key: &str) -> String {
    if name == WATER { key.into() } else { format!("volumes.{name}.{}", last_part(key)) }
}

/// Returns the name of the volume that a key belongs to, and the key by which `water` has the parameter.
/// `None` for a key of anything else.
pub fn split_volume_key(key: &str) -> Option<(&str, &'static str)> {
    let of_water = (0..COUNT).map(|i| source(i).key);
    match key.strip_prefix("volumes.") {
        Some(rest) => {
            let (name, last) = rest.rsplit_once('.')?;
            of_water.into_iter().find(|own| last_part(own) == last).map(|own| (name, own))
        }
        None => of_water.into_iter().find(|own| *own == key).map(|own| (WATER, own)),
    }
}
