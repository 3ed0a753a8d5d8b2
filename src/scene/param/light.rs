//! Reflection, scattering, visibility and lights.

use super::Cost::*;
use super::Kind::*;
use super::{Param, p};

pub(super) const TABLE: &[Param] = &[
    p(
        "light.frame",
        "",
        "",
        Choice(&["world", "texture"]),
        Uniform,
        "Where angles are measured: in the world, or in the volume's own space as in the paper.",
    ),
    p(
        "light.visibility",
        "V",
        "",
        Choice(&["march", "cached", "none"]),
        Uniform,
        "Attenuation between light and cell: an exact walk from the cell's centre, the same walked once for every cell and kept, or none.",
    ),
    p(
        "light.cache",
        "",
        "MiB",
        Int(1, 65536, 512),
        Uniform,
        "Most memory that visibility cached may take, in light volumes of a byte a cell, or four where light is scattered more than once.",
    )
    .slider(16.0, 4096.0),
    p(
        "light.reflection",
        "Ψ",
        "",
        Choice(&["kajiya-kay", "strand"]),
        Uniform,
        "How a cell reflects: as the paper's fibres, with k_d, k_s and p; or as strands of water with air between them.",
    ),
    p(
        "light.scattering",
        "",
        "",
        Choice(&["single", "multiple"]),
        Uniform,
        "How often light is scattered in the volume: once, or as often as it is.",
    ),
    p(
        "strand.radius",
        "",
        "m",
        Float(1e-5, 1.0, 5e-4),
        Uniform,
        "Radius of a strand of water; the light that goes through it is absorbed on as long a way.",
    )
    .slider(1e-5, 0.1),
    p(
        "strand.roughness_m",
        "β_m",
        "",
        Float(0.1, 1.0, 0.3),
        Uniform,
        "Roughness along the strands: small is a sharp cone of light.",
    ),
    p(
        "strand.roughness_n",
        "β_n",
        "",
        Float(0.1, 1.0, 0.2),
        Uniform,
        "Roughness around the strands: small shows the bow.",
    ),
    p(
        "strand.absorption",
        "",
        "",
        Float(0.0, 1e4, 1.0),
        Uniform,
        "Absorption in the strands, in units of pure water's.",
    )
    .slider(0.0, 100.0),
    p(
        "strand.aeration",
        "",
        "",
        Float(0.0, 1.0, 0.5),
        Uniform,
        "Share of the light that meets air bubbles instead of strands, in a cell with k_d = k_s; it grows with k_d : k_s.",
    ),
    p(
        "strand.g",
        "g",
        "",
        Float(-0.99, 0.99, 0.8),
        Uniform,
        "Mean cosine of the scattering by bubbles: 0 sends light everywhere alike, towards 1 straight on.",
    ),
    p(
        "light.p",
        "p",
        "",
        Float(1.0, 1e4, 20.0),
        Uniform,
        "Exponent of the specular term; whole numbers up to 255 are fastest.",
    )
    .slider(1.0, 200.0),
    p(
        "light.ambient",
        "",
        "",
        Color([0.1, 0.1, 0.1]),
        Uniform,
        "Light from everywhere, added in every cell.",
    ),
    p("lights.*.kind", "", "", Choice(&["directional", "point", "spot"]), Uniform, "Kind of light."),
    p(
        "lights.*.direction",
        "l",
        "",
        Point([0.5, 0.8, 0.6]),
        Uniform,
        "Towards a directional light, or against the beam of a spot light; of any length but zero.",
    ),
    p("lights.*.position", "", "m", Point([0.0, 10.0, 10.0]), Uniform, "Where a point or spot light is."),
    p(
        "lights.*.angle",
        "",
        "°",
        Float(0.01, 90.0, 30.0),
        Uniform,
        "Half angle of a spot light's cone, from the beam to where the light ends.",
    ),
    p(
        "lights.*.softness",
        "",
        "",
        Float(0.0, 1.0, 0.2),
        Uniform,
        "Outer share of a spot light's angle in which its light fades away.",
    ),
    p("lights.*.color", "", "", Color([1.0, 1.0, 1.0]), Uniform, "Colour of the light."),
    p(
        "lights.*.intensity",
        "I",
        "",
        Float(0.0, 1e9, 1.0),
        Uniform,
        "Factor on the colour; of a point or spot light at a distance of 1 m, falling with its square.",
    )
    .slider(0.0, 100.0),
];
