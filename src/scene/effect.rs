//! Settings that have no effect, because another parameter switches off what they belong to.

use super::Values;
use super::build::EnvironmentKind;
use super::measured::Builder;
use super::meshes::{self, Carrier, Projection};
use super::names::full_key;
use super::param::{key_of_volume, matches, split_volume_key};
use super::read::split;
use super::sequence::{self, Sequence};
use super::volumes;
use crate::light::{LightKind, ReflectionKind, Visibility};
use crate::mapping::shell::Side;
use crate::trace::AttenuationKind;
use crate::volume::{ReflectBy, Run};

/// Parameters that only have an effect where another one, the switch, has a certain value. Rules on keys of
/// the volume `water` hold for the keys of every volume.
struct Rule {
    /// Patterns of their keys.
    keys: &'static [&'static str],
    /// Key of the switch. A `*` is the same name as in the keys.
    switch: &'static str,
    /// Values of the switch under which they have an effect, in words.
    needs: &'static str,
    /// Whether they have an effect, by the values and the key of the switch.
    works: fn(&Values, &str) -> bool,
}

fn is(values: &Values, switch: &str, word: &str) -> bool {
    values.text(switch) == word
}

/// Keys of a volume that is made of curves, or of a file of cells.
const OF_CURVES: &[&str] = &[
    "curves.across",
    "curves.breathe",
    "curves.bundles",
    "curves.deep",
    "curves.lean",
    "curves.levels",
    "curves.loose",
    "curves.radius",
    "curves.run",
    "curves.wander",
    "volume.crest",
    "volume.file",
    "volume.flow",
    "volume.nx",
    "volume.ny",
    "volume.nz",
];

/// Keys of curves, and of strands along the flow of a simulation.
const OF_STRANDS: &[&str] = &[
    "curves.amplitude",
    "curves.h",
    "volume.coherence",
    "volume.coverage",
    "volume.k_noise",
    "volume.seed",
    "volume.strand_length",
];

/// Keys of a volume that is made of the grids of a simulation.
const OF_GRIDS: &[&str] = &[
    "volume.cells",
    "volume.grid",
    "volume.level_set_unit",
    "volume.origin",
    "volume.reflect",
    "volume.reflect_grid",
    "volume.reflect_high",
    "volume.reflect_k_d",
    "volume.reflect_k_s",
    "volume.reflect_low",
    "volume.rho",
    "volume.rho_scale",
    "volume.source",
    "volume.strands",
    "volume.up",
    "volume.velocity",
    "volume.velocity_at",
    "volume.velocity_scale",
    "volume.voxels",
];

const RULES: &[Rule] = &[
    Rule {
        keys: &["environment.file"],
        switch: "environment.kind",
        needs: "file",
        works: |v, switch| is(v, switch, EnvironmentKind::File.word()),
    },
    Rule {
        keys: &["environment.intensity", "environment.lights", "environment.turn"],
        switch: "environment.kind",
        needs: "sky or file",
        works: |v, switch| !is(v, switch, EnvironmentKind::None.word()),
    },
    Rule {
        keys: &["sky.*"],
        switch: "environment.kind",
        needs: "sky",
        works: |v, switch| is(v, switch, EnvironmentKind::Sky.word()),
    },
    Rule {
        keys: &["strand.*"],
        switch: "light.reflection",
        needs: "strand",
        works: |v, switch| is(v, switch, ReflectionKind::Strand.word()),
    },
    Rule {
        keys: &["trace.sigma"],
        switch: "trace.attenuation",
        needs: "path-length",
        works: |v, switch| is(v, switch, AttenuationKind::PathLength.word()),
    },
    Rule {
        keys: &["trace.tau"],
        switch: "trace.attenuation",
        needs: "per-cell",
        works: |v, switch| is(v, switch, AttenuationKind::PerCell.word()),
    },
    Rule {
        keys: &["light.cache"],
        switch: "light.visibility",
        needs: "cached",
        works: |v, switch| is(v, switch, Visibility::Cached.word()),
    },
    Rule {
        keys: &["lights.*.position"],
        switch: "lights.*.kind",
        needs: "point or spot",
        works: |v, switch| !is(v, switch, LightKind::Directional.word()),
    },
    Rule {
        keys: &["lights.*.direction"],
        switch: "lights.*.kind",
        needs: "directional or spot",
        works: |v, switch| !is(v, switch, LightKind::Point.word()),
    },
    Rule {
        keys: &["lights.*.angle", "lights.*.softness"],
        switch: "lights.*.kind",
        needs: "spot",
        works: |v, switch| is(v, switch, LightKind::Spot.word()),
    },
    Rule {
        keys: &["camera.eye", "camera.target", "camera.up", "camera.fov"],
        switch: "camera.from",
        needs: "no mesh, whose camera stands in their place",
        works: |v, switch| v.text(switch).is_empty(),
    },
    Rule {
        keys: &["materials.*.side", "materials.*.thickness_from"],
        switch: "materials.*.carrier",
        needs: "shell",
        works: |v, switch| is(v, switch, Carrier::Shell.word()),
    },
    Rule {
        keys: &["materials.*.skin"],
        switch: "materials.*.carrier",
        needs: "shell",
        works: |v, switch| is(v, switch, Carrier::Shell.word()),
    },
    Rule {
        keys: &["materials.*.skin"],
        switch: "materials.*.side",
        needs: "outward",
        works: |v, switch| is(v, switch, Side::Outward.word()),
    },
    Rule {
        keys: &["meshes.*.projection_size"],
        switch: "meshes.*.projection",
        needs: "box, planar or cylinder",
        works: |v, switch| !is(v, switch, Projection::None.word()),
    },
    Rule {
        keys: &["meshes.*.uv"],
        switch: "meshes.*.projection",
        needs: "none, because a projection has its own coordinates",
        works: |v, switch| is(v, switch, Projection::None.word()),
    },
    Rule {
        keys: &["meshes.*.wet_reach"],
        switch: "meshes.*.wet",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["rocks.*.wet_reach"],
        switch: "rocks.*.wet",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["haze.color", "haze.far", "haze.level", "haze.scale_height"],
        switch: "haze.density",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["background.*"],
        switch: "environment.kind",
        needs: "none, because the environment is seen in its place",
        works: |v, switch| is(v, switch, EnvironmentKind::None.word()),
    },
    Rule {
        keys: &["image.filter"],
        switch: "image.samples",
        needs: "2 or more",
        works: |v, switch| v.int(switch) > 1,
    },
    Rule {
        keys: &["image.bloom_radius"],
        switch: "image.bloom",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["curves.breathe", "curves.loose", "curves.radius", "curves.wander"],
        switch: "curves.bundles",
        needs: "a number above 0",
        works: |v, switch| v.int(switch) > 0,
    },
    Rule {
        keys: &["curves.lean"],
        switch: "curves.run",
        needs: "out",
        works: |v, switch| is(v, switch, Run::Out.word()),
    },
    Rule {
        keys: OF_CURVES,
        switch: "volume.builder",
        needs: "curves",
        works: |v, switch| is(v, switch, Builder::Curves.word()),
    },
    Rule {
        keys: OF_STRANDS,
        switch: "volume.strands",
        needs: "a number above 0, because volume.builder is \"flow\"",
        works: |v, switch| {
            let builder = format!("{}.builder", switch.rsplit_once('.').map_or("", |(head, _)| head));
            is(v, &builder, Builder::Curves.word()) || v.int(switch) > 0
        },
    },
    Rule {
        keys: OF_GRIDS,
        switch: "volume.builder",
        needs: "flow",
        works: |v, switch| is(v, switch, Builder::Flow.word()),
    },
    Rule {
        keys: &["volume.reflect_grid"],
        switch: "volume.reflect",
        needs: "grid",
        works: |v, switch| is(v, switch, ReflectBy::Grid.word()),
    },
    Rule {
        keys: &["volume.reflect_high", "volume.reflect_k_d", "volume.reflect_k_s", "volume.reflect_low"],
        switch: "volume.reflect",
        needs: "speed, vorticity or grid",
        works: |v, switch| {
            ![ReflectBy::Even, ReflectBy::Stored].iter().any(|word| is(v, switch, word.word()))
        },
    },
    Rule {
        keys: &["curves.*", "volume.nx", "volume.ny", "volume.nz", "volume.seed"],
        switch: "volume.file",
        needs: "no file, because a file brings its own cells",
        works: |v, switch| v.text(switch).is_empty(),
    },
    Rule {
        keys: &["animate.frames"],
        switch: "animate.loop",
        needs: "0, because a loop is as long as it says",
        works: |v, switch| v.int(switch) == 0,
    },
];

/// Returns the rule by which a key has no effect, with its switch, whose key is full.
fn rule(values: &Values, key: &str) -> Option<(&'static Rule, String)> {
    let of_volume = split_volume_key(key);
    let own = of_volume.map_or(key, |(_, of_water)| of_water);
    RULES.iter().filter(|rule| rule.keys.iter().any(|pattern| matches(pattern, own))).find_map(|rule| {
        let name = key.split('.').nth(1).unwrap_or_default();
        let switch = match of_volume {
            Some((volume, _)) => key_of_volume(volume, rule.switch),
            None => rule.switch.replace('*', name),
        };
        (!(rule.works)(values, &switch)).then_some((rule, switch))
    })
}

/// Returns why the value of a key has no effect; `None` where it has one.
pub fn without_effect(values: &Values, key: &str) -> Option<String> {
    if let Some(why) = volumes::without_effect(values, key) {
        return Some(why);
    }
    if let Some(why) = without_volume(values, key).or_else(|| without_water(values, key)) {
        return Some(why);
    }
    if let Some(why) = without_sequence(values, key) {
        return Some(why);
    }
    let (rule, switch) = rule(values, key)?;
    let now = values.get(&switch).to_toml();
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

/// Keys of the film of water on rocks and meshes.
const OF_FILMS: [&str; 4] = ["meshes.*.wet", "meshes.*.wet_reach", "rocks.*.wet", "rocks.*.wet_reach"];

/// Returns why a key of the film of water has no effect: the scene has nothing that wets.
fn without_water(values: &Values, key: &str) -> Option<String> {
    let wets = |material: &String| {
        let own = |what: &str| format!("materials.{material}.{what}");
        let volume = volumes::volume_of(values, material);
        let run = || values.choice(&key_of_volume(&volume, "curves.run"), Run::from_word);
        match values.choice(&own("carrier"), Carrier::from_word) {
            Carrier::Face => values.float(&own("mist")) == 0.0,
            // Fibres that stand out of a surface are no water. A volume that the scene lacks is refused.
            Carrier::Shell => run() == Run::Along,
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
const OF_SHOWN_PICTURES: [&str; 7] = [
    "image.exposure",
    "image.bloom",
    "image.bloom_radius",
    "image.temperature",
    "image.tint",
    "image.tone",
    "image.dither",
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
