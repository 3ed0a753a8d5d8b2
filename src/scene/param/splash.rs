//! Splashes where water hits.

use super::Cost::*;
use super::Kind::*;
use super::{Param, p};

pub(super) const TABLE: &[Param] = &[
    p(
        "splashes.*.from",
        "",
        "m",
        Point([0.0, 0.0, 0.0]),
        Uniform,
        "Where water hits: one end of a line, from which arcs of drops are thrown up.",
    ),
    p(
        "splashes.*.to",
        "",
        "m",
        Point([0.0, 0.0, 0.0]),
        Uniform,
        "The other end; without it all start at one point.",
    ),
    p(
        "splashes.*.material",
        "",
        "",
        Text("water"),
        Uniform,
        "Material of the arcs; its copies are those of each.",
    ),
    p("splashes.*.count", "", "", Int(1, 1024, 12), Uniform, "Arcs.").slider(1.0, 48.0),
    p("splashes.*.segments", "", "", Int(1, 64, 6), Uniform, "Quads along each arc."),
    p(
        "splashes.*.drop",
        "h",
        "m",
        Float(1e-3, 1e4, 3.0),
        Uniform,
        "Height of the fall that ends here: water hits at √(2 g h).",
    )
    .slider(0.1, 20.0),
    p(
        "splashes.*.restitution",
        "",
        "",
        Float(0.01, 1.0, 0.35),
        Uniform,
        "Share of that speed that the fastest drops leave with; none rises above its square times the height.",
    ),
    p(
        "splashes.*.elevation",
        "",
        "°",
        Float(0.0, 90.0, 60.0),
        Uniform,
        "Mean angle above the horizon at which drops leave.",
    ),
    p("splashes.*.spread", "", "°", Float(0.0, 90.0, 18.0), Uniform, "Largest difference from that angle."),
    p(
        "splashes.*.toward",
        "",
        "",
        Point([0.0, 0.0, 1.0]),
        Uniform,
        "Direction of the middle of the fan, along the ground.",
    ),
    p(
        "splashes.*.fan",
        "",
        "°",
        Float(0.0, 180.0, 180.0),
        Uniform,
        "Angle of the fan on either side of that direction; 180: a crown.",
    ),
    p("splashes.*.width", "", "m", Float(1e-3, 1e4, 0.4), Uniform, "Mean width of an arc at its end.")
        .slider(0.05, 2.0),
    p("splashes.*.seed", "", "", Int(0, i64::MAX, 1), Uniform, "Seed of the arcs."),
];
