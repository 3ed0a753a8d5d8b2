//! Sheets of falling water.

use super::Cost::*;
use super::Kind::*;
use super::{Param, p};

pub(super) const TABLE: &[Param] = &[
    p(
        "sheets.*.points",
        "",
        "m",
        Series,
        Uniform,
        "Profile of a sheet: points from over the lip down to the foot, joined by a smooth curve.",
    ),
    p(
        "sheets.*.widths",
        "",
        "m",
        Series,
        Uniform,
        "Width of the sheet at each of its points, or one for all; 1 m if there is none.",
    ),
    p("sheets.*.across", "", "", Point([1.0, 0.0, 0.0]), Uniform, "Direction of its rows, across the flow."),
    p(
        "sheets.*.material",
        "",
        "",
        Text("water"),
        Uniform,
        "Material of the sheet; its copies are those of the whole sheet.",
    ),
    p("sheets.*.segments", "", "", Int(1, 1024, 16), Uniform, "Quads along the flow.").slider(1.0, 64.0),
    p("sheets.*.columns", "", "", Int(1, 256, 1), Uniform, "Quads across, at least.").slider(1.0, 32.0),
    p(
        "sheets.*.round",
        "",
        "turns",
        Float(0.0, 1.0, 0.0),
        Uniform,
        "How far the sheet is bent across the flow, by its columns: 0 flat, 0.5 half a tube, 1 a tube.",
    ),
    p("sheets.*.v0", "v₀", "m/s", Float(0.01, 100.0, 1.0), Uniform, "Speed of the water at the first point.")
        .slider(0.05, 5.0),
    p(
        "sheets.*.stretch",
        "",
        "",
        Float(0.0, 1.0, 1.0),
        Uniform,
        "From a texture laid evenly along the flow (0) to one laid by the time of the free fall (1): streaks grow longer and run faster as they fall.",
    ),
    p(
        "sheets.*.offset_u",
        "",
        "widths",
        Float(-1e4, 1e4, 0.0),
        Uniform,
        "Where across the volume the sheet begins.",
    )
    .slider(0.0, 1.0),
    p(
        "sheets.*.offset_v",
        "",
        "lengths",
        Float(-1e4, 1e4, 0.0),
        Uniform,
        "Where along the volume's flow the sheet begins.",
    )
    .slider(0.0, 1.0),
    p(
        "sheets.*.edge",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Uniform,
        "Share of the half width over which the sides are eroded, so that they end along strands; 0: straight sides.",
    ),
    p(
        "sheets.*.breakup",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Uniform,
        "Erosion at the foot: the water breaks up as it falls, with the square of the way.",
    ),
    p(
        "sheets.*.fade",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Uniform,
        "Share of the way over which the foot fades away.",
    ),
    p(
        "sheets.*.head",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Uniform,
        "Share of the way over which the head comes in.",
    ),
];
