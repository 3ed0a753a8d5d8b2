//! Presets: the scene files in `assets/scenes/`, which the program contains.

use std::path::Path;

/// A preset: name, description, text of the scene file.
type Preset = (&'static str, &'static str, &'static str);

/// Meshes of the presets, by the path that a scene names them by.
const MESHES: &[(&str, &[u8])] = &[
    ("taki:cliff.glb", include_bytes!("../../assets/meshes/cliff.glb")),
    ("taki:bear.glb", include_bytes!("../../assets/meshes/bear.glb")),
    ("taki:hair.glb", include_bytes!("../../assets/meshes/hair.glb")),
    ("taki:cloth.glb", include_bytes!("../../assets/meshes/cloth.glb")),
    ("taki:slope.glb", include_bytes!("../../assets/meshes/slope.glb")),
    ("taki:sugar.glb", include_bytes!("../../assets/meshes/sugar.glb")),
    ("taki:hand.glb", include_bytes!("../../assets/meshes/hand.glb")),
    ("taki:torus.glb", include_bytes!("../../assets/meshes/torus.glb")),
    ("taki:pour.glb", include_bytes!("../../assets/meshes/pour.glb")),
];

/// Returns the content of a preset's mesh.
pub fn mesh(path: &Path) -> Option<&'static [u8]> {
    MESHES.iter().find(|(name, _)| Path::new(name) == path).map(|(_, bytes)| *bytes)
}

/// The presets in the order of the list; the first is the default scene.
const PRESETS: &[Preset] = &[
    (
        "waterfall",
        "a fall over a rough cliff, by daylight",
        include_str!("../../assets/scenes/waterfall.toml"),
    ),
    (
        "evening",
        "the same under a clear sky, before sunset",
        include_str!("../../assets/scenes/evening.toml"),
    ),
    (
        "cascade",
        "a stairway of rock: water from ledge to ledge, with splashes",
        include_str!("../../assets/scenes/cascade.toml"),
    ),
    (
        "curtain",
        "a thin veil before the mouth of a grotto, against the low sun",
        include_str!("../../assets/scenes/curtain.toml"),
    ),
    ("spout", "a jet from a bamboo spout into a basin", include_str!("../../assets/scenes/spout.toml")),
    (
        "night",
        "a fall lit by lamps behind it and at its foot",
        include_str!("../../assets/scenes/night.toml"),
    ),
    (
        "cliff",
        "water over a cliff that was modelled in Blender",
        include_str!("../../assets/scenes/cliff.toml"),
    ),
    ("torus", "fur on a ring: hairs on a mesh", include_str!("../../assets/scenes/torus.toml")),
    ("cloth", "twill and satin, draped over balls", include_str!("../../assets/scenes/cloth.toml")),
    (
        "bear",
        "a bear of ellipsoids in fur, after Kajiya and Kay's",
        include_str!("../../assets/scenes/bear.toml"),
    ),
    ("hair", "long hair, parted and in locks", include_str!("../../assets/scenes/hair.toml")),
    (
        "slope",
        "rock and grass of a mountainside, before a valley",
        include_str!("../../assets/scenes/slope.toml"),
    ),
    ("sugar", "lumps and a heap of sugar: grains", include_str!("../../assets/scenes/sugar.toml")),
    (
        "skin",
        "an open hand before the low sun, red at its edges",
        include_str!("../../assets/scenes/skin.toml"),
    ),
    ("pour", "water of a simulation that pours over a ledge", include_str!("../../assets/scenes/pour.toml")),
    (
        "fig5",
        "the paper's figure 5: a 40×40×40 volume on 8 quads",
        include_str!("../../assets/scenes/fig5.toml"),
    ),
    ("fig6", "figure 6: as 5, with larger density", include_str!("../../assets/scenes/fig6.toml")),
    ("fig7", "figure 7: as 5, with less complex curves", include_str!("../../assets/scenes/fig7.toml")),
    (
        "front",
        "the benchmark: one unit quad seen from the front",
        include_str!("../../assets/scenes/front.toml"),
    ),
];

/// Bases that are no scenes by themselves: name and text.
const BASES: &[(&str, &str)] = &[("water", include_str!("../../assets/bases/water.toml"))];

/// Name of the scene that is rendered when none is given.
pub const DEFAULT: &str = PRESETS[0].0;

/// Returns the text of a preset's scene file.
pub fn text(name: &str) -> Option<&'static str> {
    PRESETS.iter().find(|p| p.0 == name).map(|p| p.2)
}

/// Returns the text of a base: that of a preset, or of one of the bases that are no scenes by themselves.
pub fn base(name: &str) -> Option<&'static str> {
    let own = BASES.iter().find(|base| base.0 == name).map(|base| base.1);
    own.or_else(|| text(name))
}

/// Returns the presets' names.
pub fn names() -> impl Iterator<Item = &'static str> {
    PRESETS.iter().map(|p| p.0)
}

/// Returns the preset whose name is nearest to a misspelt one.
pub fn nearest(name: &str) -> Option<&'static str> {
    let name = name.to_lowercase();
    let alike = |preset: &&str| strsim::jaro_winkler(preset, &name);
    names().max_by(|a, b| alike(a).total_cmp(&alike(b))).filter(|near| alike(near) > 0.7)
}

/// Returns a sentence that lists the presets.
pub fn listed() -> String {
    format!("presets: {}", names().collect::<Vec<_>>().join(", "))
}

/// Returns a sentence that lists what a base may be.
pub fn listed_bases() -> String {
    let others = BASES.iter().map(|base| base.0).collect::<Vec<_>>().join(", ");
    format!("{}; or {others}, the look alone", listed())
}

/// Returns the presets' names and descriptions.
pub fn list() -> impl Iterator<Item = (&'static str, &'static str)> {
    PRESETS.iter().map(|p| (p.0, p.1))
}
