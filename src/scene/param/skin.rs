//! Parameters of skin.

use super::Cost::{Uniform, Volume};
use super::Kind::{Float, Int};
use super::{Group, p};

pub(super) const SKIN: Group = Group {
    title: "Skin",
    about: "Skin, of a volume with `volume.builder=skin`: an epidermis over a dermis, both of which scatter \
         light many times, below a rough surface. A shell shows it, on a mesh whose metres are metres: \
         `trace.sigma=4300` is the extinction of real skin. `volume.color` to `volume.color_4` stand in the \
         place of melanin and blood: they are the albedos of freckles, epidermis, dermis and flushed dermis.",
    params: &[
        p("skin.melanin", "", "", Float(0.0, 1.0, 0.03), Uniform)
            .slider(0.0, 0.4)
            .doc("Share of the epidermis that melanosomes fill.")
            .when("Set it to 0.01 to 0.06 for light, 0.11 to 0.16 for brown, 0.18 to 0.43 for dark skin."),
        p("skin.blood", "", "", Float(0.0, 1.0, 0.008), Uniform)
            .slider(0.0, 0.05)
            .doc("Share of the dermis that blood fills.")
            .when("Raise it for cheeks, lips and palms; lower it for pale skin."),
        p("skin.oxygen", "", "", Float(0.0, 1.0, 0.75), Uniform)
            .doc("Share of the blood's haemoglobin that carries oxygen.")
            .when("Lower it for bluish skin; raise it to 1 for rosy skin."),
        p("skin.epidermis", "", "depths", Float(0.0, 1.0, 0.025), Volume)
            .slider(0.0, 0.2)
            .doc(
                "Thickness of the epidermis, as a fraction of the depth nz. It may be thinner than a cell. \
                 On most of the body it is 0.06 to 0.1 mm.",
            )
            .when("Raise it for soles and palms."),
        p("skin.plates", "", "", Int(0, 10_000, 20), Volume)
            .slider(0.0, 100.0)
            .doc(
                "Number of plates across the volume's width nx; fine lines lie between them. Each has half \
                 as wide plates on it. 0 is a smooth surface.",
            )
            .when("Choose it so that a plate is 0.5 to 1 mm wide, and at least four cells."),
        p("skin.furrow", "", "depths", Float(0.0, 1.0, 0.02), Volume)
            .slider(0.0, 0.2)
            .doc("Depth of the lines between plates, as a fraction of the depth nz.")
            .when("Raise it for old skin, knuckles and elbows."),
        p("skin.freckles", "", "", Float(0.0, 1.0, 0.0), Volume)
            .doc("Share of the area with freckles, which have four times the melanin.")
            .when("Raise it with care: copies of the volume repeat them."),
        p("skin.flush", "", "", Float(0.0, 1.0, 0.15), Volume)
            .doc("Unevenness of the blood: places have up to three times as much.")
            .when("Raise it for blotches of cold or heat."),
        p("skin.eta", "η", "", Float(1.0, 3.0, 1.4), Uniform)
            .slider(1.0, 2.0)
            .doc("Index of refraction of skin, relative to the air.")
            .when("Set it to 1 for matter without a surface; wax has 1.44, marble 1.5."),
        p("skin.roughness", "", "", Float(0.02, 1.0, 0.35), Uniform)
            .doc("Roughness α of the surface (Trowbridge and Reitz, also known as GGX).")
            .when("Lower it for oily and wet skin; raise it for dry and powdered skin."),
    ],
};
