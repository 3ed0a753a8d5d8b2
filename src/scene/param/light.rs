//! Reflection, scattering, visibility and lights.

use super::Cost::*;
use super::Kind::*;
use super::{Group, p};
use crate::light::{AngleFrame, LightKind, ReflectionKind, Scattering, Visibility};

pub(super) const LIGHT: Group = Group {
    title: "Light",
    about: "Light reaches a cell from every light of the scene, attenuated by the water on its way, and the \
         cell reflects a part of it to the eye. These parameters choose the models of both. The defaults \
         are the paper's, except for `light.frame`.",
    params: &[
        p("light.frame", "", "", Choice(AngleFrame::WORDS), Uniform)
            .doc(
                "Space in which angles are measured: `world`, or `texture`, the volume's own space as in \
                 the paper.",
            )
            .when(
                "Choose `texture` only to reproduce the paper; `world` keeps highlights right where the \
                 volume is stretched.",
            ),
        p("light.visibility", "V", "", Choice(Visibility::WORDS), Uniform)
            .doc(
                "Attenuation between a cell and a light: `march` walks from one to the other for every \
                 cell of every ray, or once for every cell of the volume where that gives the same; `cached` \
                 always makes the walk once for every cell and keeps the result; `none` leaves it out.",
            )
            .when(
                "Choose `cached` for several lights or an environment; choose `none` for quick drafts; \
                 the water is then lit evenly all the way through.",
            ),
        p("light.cache", "", "MiB", Int(1, 65536, 512), Uniform)
            .slider(16.0, 4096.0)
            .doc(
                "Most memory that the light volumes of `light.visibility=cached` may take. A cell takes 1 \
                 byte in each of them, or 4 with `light.scattering=multiple`. At most half of `--memory` \
                 counts.",
            )
            .when(
                "Raise it when taki refuses a scene because of it, or when shadows look doubled; lower it \
                 to save memory.",
            ),
        p("light.reflection", "Ψ", "", Choice(ReflectionKind::WORDS), Uniform)
            .doc(
                "Reflection of a cell: `kajiya-kay` takes the paper's fibres, with k_d, k_s and p; \
                 `strand` takes strands of water with air between them, `hair` takes hairs with pigments \
                 and scales.",
            )
            .when(
                "Choose `strand` when light should shine through the water, as the light of a low sun \
                 behind a fall; choose `hair` for hair and fur with two highlights and a glow from behind.",
            ),
        p("light.scattering", "", "", Choice(Scattering::WORDS), Uniform)
            .doc(
                "Scattering in the volume: `single` follows light that is scattered once, `multiple` any \
                 number of times. `multiple` cannot be combined with `light.visibility=none` or with boxes.",
            )
            .when("Choose `multiple` when thick water is too dark; shadows are filled and foam turns white."),
        p("light.p", "p", "", Float(1.0, 1e4, 20.0), Uniform)
            .slider(1.0, 200.0)
            .doc(
                "Exponent of the specular term of `light.reflection=kajiya-kay`. Whole numbers up to 255 \
                 are fastest.",
            )
            .when("Raise it for narrow, sharp highlights; lower it for a broad sheen."),
        p("light.ambient", "", "", Color([0.1, 0.1, 0.1]), Uniform)
            .doc(
                "Light from everywhere, added in every cell and on rocks and pools. With \
                 `light.reflection=hair`, cells give back the hairs' own share of each colour.",
            )
            .when(
                "Raise it when shadows are too black; lower it to 0 under an environment, which fills \
                 them itself.",
            ),
        p("light.occlusion", "", "", Float(0.0, 1.0, 0.0), Upload)
            .doc(
                "Share of the surroundings' light that water on quads loses where rocks and meshes with \
                 `occlusion` above 0 hide them. Volumes in boxes and on shells do without it.",
            )
            .when("Raise it when water in a gorge or a cave is as bright as under the open sky."),
        p("light.shadow", "", "", Float(0.0, 1.0, 0.0), Upload)
            .doc(
                "Share of the brightest directional light that water on quads loses in the shadow of \
                 rocks and meshes with `shadow` above 0, and strength of the shadow that the water \
                 casts on them and on the pools beside them. Without such a rock or mesh it has no \
                 effect. Volumes in boxes and on shells do without it.",
            )
            .when("Raise it to 1 when the sun shines through rock on water, or water casts no shadow."),
    ],
};

pub(super) const STRAND: Group = Group {
    title: "Strand",
    about: "These parameters have an effect with `light.reflection=strand`. A cell then holds dielectric \
         cylinders of water along its flow, and bubbles of air between them.",
    params: &[
        p("strand.radius", "", "m", Float(1e-5, 1.0, 5e-4), Uniform)
            .slider(1e-5, 0.1)
            .doc("Radius of a strand of water. The thicker the strand, the more light it absorbs.")
            .when("Raise it for bluer water; at half a millimetre the water has almost no colour."),
        p("strand.roughness_m", "β_m", "", Float(0.1, 1.0, 0.3), Uniform)
            .doc("Roughness along the strands. Small values reflect a sharp cone of light.")
            .when("Lower it for sharp glints; raise it for a soft, even sheen."),
        p("strand.roughness_n", "β_n", "", Float(0.1, 1.0, 0.2), Uniform)
            .doc("Roughness around the strands. Small values show the bow at 42°.")
            .when("Lower it to show the bow; raise it to spread light evenly around the strands."),
        p("strand.absorption", "", "", Float(0.0, 1e4, 1.0), Uniform)
            .slider(0.0, 100.0)
            .doc("Absorption in the strands, as a multiple of pure water's.")
            .when("Raise it to tint the water blue; lower it to 0 for strands without colour."),
        p("strand.aeration", "", "", Float(0.0, 1.0, 0.5), Uniform)
            .doc(
                "Share of the light that meets bubbles of air instead of strands, in a cell with k_d = \
                 k_s. In other cells the share grows with the ratio k_d : k_s.",
            )
            .when("Raise it for white, foaming water; lower it for clear water that passes most light."),
        p("strand.g", "g", "", Float(-0.99, 0.99, 0.8), Uniform)
            .doc(
                "Mean cosine of the scattering by bubbles: 0 sends light everywhere alike, values near 1 \
                 send it straight on.",
            )
            .when(
                "Raise it for foam that glows in front of the light; lower it for foam that is bright on \
                 its lit side.",
            ),
    ],
};

/// Key of the colour that takes the place of a hair's pigments.
pub const HAIR_COLOR: &str = "hair.color";

pub(super) const HAIR: Group = Group {
    title: "Hair",
    about: "These parameters have an effect with `light.reflection=hair`. A cell then holds hairs along its \
         direction, which runs from root to tip: dielectric fibres with pigments inside and tilted scales \
         outside. k_d and k_s have no effect on them.",
    params: &[
        p("hair.melanin", "", "", Float(0.0, 100.0, 1.3), Uniform)
            .slider(0.0, 10.0)
            .doc(
                "Concentration of both melanins together, which absorb light in the hair: 0 is white, 0.1 \
                 light blond, 0.3 blond, 1 brown, 3 dark brown, 8 black.",
            )
            .when("Raise it for darker hair; lower it for lighter hair."),
        p("hair.redness", "", "", Float(0.0, 1.0, 0.2), Uniform)
            .doc("Share of pheomelanin, the red melanin, in `hair.melanin`. The rest is eumelanin.")
            .when("Raise it to 0.5 for ginger and to 1 for red hair; lower it to 0 for ashen hair."),
        p(HAIR_COLOR, "C", "", Color([1.0, 1.0, 1.0]), Uniform)
            .doc(
                "Colour of a mass of hairs after light has been scattered among them, linear RGB up to 1, \
                 in the place of melanin. The absorption of a hair is made from it. Hair has the colour of \
                 its melanin without it.",
            )
            .when("Set it for dyed hair and for the fur of animals."),
        p("hair.eta", "η", "", Float(1.1, 3.0, 1.55), Uniform)
            .doc("Index of refraction of a hair.")
            .when("Raise it for a stronger white highlight; lower it to 1.33 for fibres that seem wet."),
        p("hair.tilt", "α", "°", Float(-10.0, 10.0, 3.0), Uniform)
            .doc(
                "Angle by which scales on a hair are tilted, their outer ends to the tip. They turn what is \
                 reflected outside by 2α towards the root, and what comes back from the inside by 3α \
                 towards the tip. On a head the white highlight so lies nearer to the tips than the \
                 coloured one.",
            )
            .when(
                "Raise it to part the two highlights; set it to 0 for smooth fibres, and below 0 where \
                 directions run from tip to root.",
            ),
        p("hair.beta_m", "β_m", "", Float(0.1, 1.0, 0.3), Uniform)
            .doc("Roughness along the hair. Small values give two sharp highlights.")
            .when("Lower it for shiny hair; raise it for dull, dry hair."),
        p("hair.beta_n", "β_n", "", Float(0.1, 1.0, 0.3), Uniform)
            .doc("Roughness around the hair. Small values keep the light that comes through together.")
            .when("Lower it for a strong glow in front of a light; raise it for soft, even hair."),
    ],
};

pub(super) const LIGHTS: Group = Group {
    title: "Lights",
    about: "Each light has a name of your choice. A white surface that faces a directional light of colour 1 \
         and intensity 1 has a radiance of 1.",
    params: &[
        p("lights.*.kind", "", "", Choice(LightKind::WORDS), Uniform)
            .doc(
                "Kind of light: `directional` comes from infinitely far, `point` from one place into all \
                 directions, `spot` from one place into a cone.",
            )
            .when("Choose `directional` for sun and moon, `point` for lanterns, and `spot` for beams."),
        p("lights.*.direction", "l", "", Point([0.5, 0.8, 0.6]), Uniform)
            .doc(
                "Direction towards a directional light, or against the beam of a spot light. Its length \
                 must not be 0.",
            )
            .when("Turn it to the side of the view for relief, and behind the water to let the water glow."),
        p("lights.*.position", "", "m", Point([0.0, 10.0, 10.0]), Uniform)
            .doc("Position of a point or spot light.")
            .when("Move it close to what it should light, or behind a fall that it should shine through."),
        p("lights.*.angle", "", "°", Float(0.01, 90.0, 30.0), Uniform)
            .doc("Half angle of a spot light's cone, from the beam to where the light ends.")
            .when("Lower it for a narrow beam; raise it to light a larger part of the scene."),
        p("lights.*.softness", "", "", Float(0.0, 1.0, 0.2), Uniform)
            .doc("Outer share of a spot light's angle over which its light fades away.")
            .when("Raise it for a beam with a soft edge; lower it for a sharp one."),
        p("lights.*.color", "", "", Color([1.0, 1.0, 1.0]), Uniform)
            .doc("Colour of the light, linear RGB.")
            .when("Choose it reddish for a low sun or a lamp, bluish for the moon."),
        p("lights.*.intensity", "I", "", Float(0.0, 1e9, 1.0), Uniform)
            .slider(0.0, 100.0)
            .doc(
                "Factor on the colour. For a point or spot light it is the intensity at a distance of 1 \
                 m, and the light falls with the square of the distance.",
            )
            .when("Raise it when what the light shines on is too dark; 0 switches the light off."),
    ],
};
