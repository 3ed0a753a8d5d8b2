//! The rules by which a parameter switches others off.

use crate::light::{LightKind, ReflectionKind, Visibility, VolumeReflection};
use crate::mapping::shell::Side;
use crate::scene::Values;
use crate::scene::build::EnvironmentKind;
use crate::scene::measured::Builder;
use crate::scene::meshes::{Carrier, Projection};
use crate::scene::param::{COLORS, HAIR_COLOR, key_of_volume, split_volume_key};
use crate::trace::AttenuationKind;
use crate::volume::ReflectBy;

/// Parameters that only have an effect where another one, the switch, has a certain value. Rules on keys of
/// the volume `water` hold for the keys of every volume.
pub(super) struct Rule {
    /// Patterns of their keys.
    pub keys: &'static [&'static str],
    /// Key of the switch. A `*` is the same name as in the keys.
    pub switch: &'static str,
    /// Values of the switch under which they have an effect, in words.
    pub needs: &'static str,
    /// Whether they have an effect, by the values and the key of the switch.
    pub works: fn(&Values, &str) -> bool,
}

fn is(values: &Values, switch: &str, word: &str) -> bool {
    values.text(switch) == word
}

/// Keys of a volume whose size the scene chooses.
const OF_BUILT: &[&str] = &["volume.flow", "volume.nx", "volume.ny", "volume.nz"];

/// Keys of a volume that is made of curves, or of a file of cells.
const OF_CURVES: &[&str] = &[
    "curves.across",
    "curves.breathe",
    "curves.bundles",
    "curves.deep",
    "curves.levels",
    "curves.loose",
    "curves.radius",
    "curves.wander",
    "volume.crest",
    "volume.file",
];

/// Keys of curves, and of strands along the flow of a simulation.
const OF_STRANDS: &[&str] =
    &["volume.coherence", "volume.coverage", "volume.k_noise", "volume.strand_length"];

/// Keys of curves, hairs, and strands along the flow of a simulation.
const OF_THREADS: &[&str] = &["curves.amplitude", "curves.h", "volume.seed"];

/// Keys of a volume that is made of the grids of a simulation.
const OF_GRIDS: &[&str] = &[
    "volume.fine",
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
    "volume.strands",
    "volume.velocity",
    "volume.velocity_at",
    "volume.velocity_scale",
    "volume.voxels",
];

/// Keys of k_d and k_s, which fibres of hair do without.
const OF_SHADES: &[&str] = &[
    "cloth.yarn_shade",
    "fur.hair_shade",
    "tress.strand_shade",
    "volume.k_d",
    "volume.k_noise",
    "volume.k_s",
];

/// Keys of a volume of curves that a file of cells does without.
const OF_CELLS: &[&str] = &[
    "volume.coherence",
    "volume.coverage",
    "volume.crest",
    "volume.k_d",
    "volume.k_noise",
    "volume.strand_length",
];

/// Need of strands where `volume.builder` is `flow`.
const STRANDS: &str = "a number above 0, because volume.builder is \"flow\"";
/// Need of a colour that follows another.
const FIRST: &str = "a colour, because the ramp ends at a gap";

/// Builder of the volume `name`.
pub(super) fn builder(values: &Values, name: &str) -> Builder {
    values.choice(&key_of_volume(name, "volume.builder"), Builder::from_word)
}

/// Whether there are strands in the volume with this key of their number: always, but in a simulation.
fn has_strands(values: &Values, key: &str) -> bool {
    let is_flow = split_volume_key(key).is_some_and(|(name, _)| builder(values, name) == Builder::Flow);
    !is_flow || values.int(key) > 0
}

/// Whether the volume with this key of its file takes its cells from there.
fn has_own_cells(values: &Values, key: &str) -> bool {
    let is_of_curves =
        split_volume_key(key).is_some_and(|(name, _)| builder(values, name) == Builder::Curves);
    is_of_curves && !values.text(key).is_empty()
}

pub(super) const RULES: &[Rule] = &[
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
        keys: &["hair.*"],
        switch: "light.reflection",
        needs: "hair",
        works: |v, switch| is(v, switch, ReflectionKind::Hair.word()),
    },
    Rule {
        keys: &["hair.melanin", "hair.redness"],
        switch: HAIR_COLOR,
        needs: "no colour, which stands in the place of melanin",
        works: |v, switch| !v.is_set(switch),
    },
    Rule {
        keys: &["volume.k_d", "volume.k_s"],
        switch: "volume.builder",
        needs: "a builder other than skin, whose light has no such coefficients",
        works: |v, switch| !is(v, switch, Builder::Skin.word()),
    },
    Rule {
        keys: &["volume.reflection"],
        switch: "volume.builder",
        needs: "a builder other than skin, which has a light of its own",
        works: |v, switch| !is(v, switch, Builder::Skin.word()),
    },
    Rule {
        keys: OF_SHADES,
        switch: "volume.reflection",
        needs: "kajiya-kay, because hairs have no such coefficients",
        works: |v, switch| {
            let is_hair = is(v, "light.reflection", ReflectionKind::Hair.word());
            !is_hair || is(v, switch, VolumeReflection::KajiyaKay.word())
        },
    },
    Rule {
        keys: &["volume.reflection"],
        switch: "light.reflection",
        needs: "strand or hair",
        works: |v, switch| !is(v, switch, ReflectionKind::KajiyaKay.word()),
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
        keys: OF_BUILT,
        switch: "volume.builder",
        needs: "a builder that leaves the size to the scene",
        works: |v, switch| ![Builder::Flow, Builder::Strands].iter().any(|b| is(v, switch, b.word())),
    },
    Rule {
        keys: &["volume.source", "volume.up"],
        switch: "volume.builder",
        needs: "flow or strands",
        works: |v, switch| [Builder::Flow, Builder::Strands].iter().any(|b| is(v, switch, b.word())),
    },
    Rule {
        keys: OF_CURVES,
        switch: "volume.builder",
        needs: "curves",
        works: |v, switch| is(v, switch, Builder::Curves.word()),
    },
    Rule {
        keys: OF_STRANDS,
        switch: "volume.builder",
        needs: "curves or flow",
        works: |v, switch| {
            [Builder::Curves, Builder::Flow].iter().any(|builder| is(v, switch, builder.word()))
        },
    },
    Rule {
        keys: &["curves.h"],
        switch: "volume.builder",
        needs: "curves, fur, hair, mountain or flow",
        works: |v, switch| {
            let smooth = [Builder::Cloth, Builder::Grains, Builder::Strands, Builder::Skin];
            !smooth.iter().any(|builder| is(v, switch, builder.word()))
        },
    },
    Rule {
        keys: &["curves.amplitude"],
        switch: "volume.builder",
        needs: "curves, fur, hair or flow",
        works: |v, switch| {
            let bends = [Builder::Curves, Builder::Fur, Builder::Hair, Builder::Flow];
            bends.iter().any(|builder| is(v, switch, builder.word()))
        },
    },
    Rule {
        keys: &["mountain.*"],
        switch: "volume.builder",
        needs: "mountain",
        works: |v, switch| is(v, switch, Builder::Mountain.word()),
    },
    Rule {
        keys: &["mountain.blade_lean", "mountain.blade_length", "mountain.blade_width"],
        switch: "mountain.blades",
        needs: "a number above 0",
        works: |v, switch| v.int(switch) > 0,
    },
    Rule {
        keys: &["mountain.blades"],
        switch: "mountain.soil",
        needs: "a number above 0, because grass grows on soil",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["mountain.beds"],
        switch: "mountain.fracture",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["mountain.stone_size"],
        switch: "mountain.scree",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["grains.*"],
        switch: "volume.builder",
        needs: "grains",
        works: |v, switch| is(v, switch, Builder::Grains.word()),
    },
    Rule {
        keys: &["skin.*"],
        switch: "volume.builder",
        needs: "skin",
        works: |v, switch| is(v, switch, Builder::Skin.word()),
    },
    Rule {
        keys: &["skin.furrow"],
        switch: "skin.plates",
        needs: "a number above 0",
        works: |v, switch| v.int(switch) > 0,
    },
    Rule {
        keys: &["skin.blood", "skin.melanin", "skin.oxygen"],
        switch: COLORS[0],
        needs: "no colour, which stands in the place of melanin and blood",
        works: |v, switch| !v.is_set(switch),
    },
    Rule {
        keys: &["cloth.*"],
        switch: "volume.builder",
        needs: "cloth",
        works: |v, switch| is(v, switch, Builder::Cloth.word()),
    },
    Rule {
        keys: OF_STRANDS,
        switch: "volume.strands",
        needs: STRANDS,
        works: |v, switch| has_strands(v, switch),
    },
    Rule {
        keys: OF_THREADS,
        switch: "volume.strands",
        needs: STRANDS,
        works: |v, switch| has_strands(v, switch),
    },
    Rule {
        keys: &["fur.*"],
        switch: "volume.builder",
        needs: "fur",
        works: |v, switch| is(v, switch, Builder::Fur.word()),
    },
    Rule {
        keys: &["tress.*"],
        switch: "volume.builder",
        needs: "hair",
        works: |v, switch| is(v, switch, Builder::Hair.word()),
    },
    Rule {
        keys: &["import.*"],
        switch: "volume.builder",
        needs: "strands",
        works: |v, switch| is(v, switch, Builder::Strands.word()),
    },
    Rule {
        keys: &["volume.seed"],
        switch: "volume.builder",
        needs: "a builder that draws at random",
        works: |v, switch| !is(v, switch, Builder::Strands.word()),
    },
    Rule {
        keys: &["tress.gathering", "tress.stray", "tress.wave"],
        switch: "tress.locks",
        needs: "a number above 0",
        works: |v, switch| v.int(switch) > 0,
    },
    Rule {
        keys: &["tress.waves"],
        switch: "tress.wave",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["fur.clumping"],
        switch: "fur.clumps",
        needs: "a number above 0",
        works: |v, switch| v.int(switch) > 0,
    },
    Rule {
        keys: &["fur.undercoat_length"],
        switch: "fur.undercoat",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule { keys: &[COLORS[1]], switch: COLORS[0], needs: FIRST, works: |v, switch| v.is_set(switch) },
    Rule { keys: &[COLORS[2]], switch: COLORS[1], needs: FIRST, works: |v, switch| v.is_set(switch) },
    Rule { keys: &[COLORS[3]], switch: COLORS[2], needs: FIRST, works: |v, switch| v.is_set(switch) },
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
        keys: OF_CELLS,
        switch: "volume.file",
        needs: "no file, because a file brings its own cells",
        works: |v, switch| !has_own_cells(v, switch),
    },
    Rule {
        keys: &["volume.k_s"],
        switch: "volume.file",
        needs: "no file or a colour, because a file brings its own k_s",
        works: |v, switch| {
            let name = split_volume_key(switch).map_or("", |(name, _)| name);
            !has_own_cells(v, switch) || v.is_set(&key_of_volume(name, COLORS[0]))
        },
    },
    Rule {
        keys: &["sheets.*.surges"],
        switch: "sheets.*.surge",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["sheets.*.tear_size"],
        switch: "sheets.*.tear",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["splashes.*.tear_size"],
        switch: "splashes.*.tear",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &[
            "materials.*.billow",
            "materials.*.billow_rise",
            "materials.*.billow_size",
            "materials.*.facing",
        ],
        switch: "materials.*.mist",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["materials.*.billow_rise", "materials.*.billow_size"],
        switch: "materials.*.billow",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["rocks.*.grain", "rocks.*.moss"],
        switch: "rocks.*.kind",
        needs: "a kind of stone",
        works: |v, switch| !is(v, switch, "plain"),
    },
    Rule {
        keys: &["pools.*.current", "pools.*.drift", "pools.*.foam_life"],
        switch: "pools.*.waves",
        needs: "field",
        works: |v, switch| is(v, switch, "field"),
    },
    Rule {
        keys: &["image.grain_seed"],
        switch: "image.grain",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["camera.focus"],
        switch: "camera.f_number",
        needs: "a number above 0",
        works: |v, switch| v.float(switch) > 0.0,
    },
    Rule {
        keys: &["camera.shutter"],
        switch: "animate.speed",
        needs: "another number than 0",
        works: |v, switch| {
            let moves = |i: &String| v.text(&format!("animate.tracks.{i}.key")) == "volume.flow";
            v.float(switch) != 0.0 || v.names("animate.tracks").iter().any(moves)
        },
    },
    Rule {
        keys: &["animate.frames"],
        switch: "animate.loop",
        needs: "0, because a loop is as long as it says",
        works: |v, switch| v.int(switch) == 0,
    },
];
