//! The quads the volume is mapped onto, and the walk through it.

use super::Cost::*;
use super::Kind::*;
use super::{Param, p};

pub(super) const TABLE: &[Param] = &[
    p(
        "materials.*.thickness",
        "H",
        "m",
        Float(1e-4, 1e4, 0.4),
        Uniform,
        "Depth of one volume under the face of the quads.",
    )
    .slider(0.01, 10.0),
    p(
        "materials.*.repeat_u",
        "",
        "",
        Float(1e-3, 1e4, 1.0),
        Uniform,
        "Copies of the volume along u, across the flow.",
    )
    .slider(0.1, 20.0),
    p(
        "materials.*.repeat_v",
        "",
        "",
        Float(1e-3, 1e4, 1.0),
        Uniform,
        "Copies of the volume along v, along the flow.",
    )
    .slider(0.1, 20.0),
    p(
        "materials.*.mist",
        "",
        "",
        Float(0.0, 4.0, 0.0),
        Uniform,
        "Ψ of droplets without a direction, which fill the volume in place of its strands; 0: a material of strands.",
    ),
    p(
        "quads.*.corners",
        "A B C D",
        "m",
        Corners,
        Upload,
        "Corners at (u,v) = (0,0) (1,0) (1,1) (0,1): convex, planar; v runs down the flow.",
    ),
    p("quads.*.material", "", "", Text("water"), Upload, "Name of the quad's material."),
    p(
        "trace.attenuation",
        "",
        "",
        Choice(&["path-length", "per-cell"]),
        Uniform,
        "How a cell attenuates: τ_k = σ·ρ·Δs over the metres inside it, or τ_k = τ·ρ however short the way.",
    ),
    p(
        "trace.sigma",
        "σ",
        "1/m",
        Float(0.0, 1e5, 10.0),
        Uniform,
        "Extinction at ρ = 1, for path-length attenuation.",
    )
    .slider(0.0, 200.0),
    p(
        "trace.tau",
        "τ",
        "",
        Float(0.0, 1e3, 0.1),
        Uniform,
        "Optical depth of one cell at ρ = 1, for per-cell attenuation.",
    )
    .slider(0.0, 2.0),
    p(
        "trace.max_cells",
        "",
        "cells",
        Int(1, 65536, 512),
        Uniform,
        "Most cells one view ray, and one light ray, may meet.",
    )
    .slider(1.0, 2048.0),
    p(
        "trace.early_end",
        "",
        "",
        Float(0.0, 1.0, 1.0 / 1024.0),
        Uniform,
        "A view ray ends where its transmittance falls below this; 0: never.",
    ),
    p(
        "trace.layers",
        "",
        "sheets",
        Int(1, 16, 4),
        Uniform,
        "Most quads one view ray goes through, the nearest first; those behind are left out.",
    ),
    p(
        "trace.filter",
        "",
        "",
        Choice(&["none", "pyramid"]),
        Upload,
        "pyramid: where a pixel sees many cells, coarser levels of the volume are walked, so that nothing aliases.",
    ),
    p(
        "trace.lookup",
        "",
        "",
        Choice(&["nearest", "trilinear"]),
        Uniform,
        "nearest: cells are blocks; trilinear: ρ, k and v are interpolated between eight cells, for close views.",
    ),
];
