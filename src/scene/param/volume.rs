//! The volume texture: its curves and cells.

use super::Cost::*;
use super::Kind::*;
use super::{Param, p};

pub(super) const TABLE: &[Param] = &[
    p(
        "curves.across",
        "",
        "",
        Int(1, 65536, 32),
        Volume,
        "Columns of the jitter grid of curve ends on the face y = 0, across the flow.",
    )
    .slider(1.0, 128.0),
    p("curves.deep", "", "", Int(1, 65536, 32), Volume, "Rows of the jitter grid, into the surface.")
        .slider(1.0, 128.0),
    p(
        "curves.h",
        "h",
        "",
        Float(0.0, 8.0, 0.9),
        Volume,
        "Complexity of the spatial fractal curves: small is rough, large is smooth.",
    )
    .slider(0.0, 3.0),
    p(
        "curves.amplitude",
        "",
        "flow lengths",
        Float(0.0, 1.0, 0.05),
        Volume,
        "Standard deviation of g as a fraction of the flow length ny.",
    )
    .slider(0.0, 0.3),
    p(
        "curves.levels",
        "",
        "",
        Int(0, 16, 0),
        Volume,
        "Depth of the recursion; 0: as deep as makes the leaf segments half a cell.",
    ),
    p(
        "curves.bundles",
        "",
        "",
        Int(0, 65536, 0),
        Volume,
        "Parent curves that the curves gather around; 0: every curve goes its own way, as in the paper.",
    )
    .slider(0.0, 64.0),
    p(
        "curves.radius",
        "",
        "widths",
        Float(0.0, 1.0, 0.03),
        Volume,
        "Standard deviation of the curves' distance from their parent, as a fraction of the volume's width nx.",
    )
    .slider(0.0, 0.2),
    p(
        "curves.wander",
        "",
        "flow lengths",
        Float(0.0, 1.0, 0.08),
        Volume,
        "Standard deviation of g of the parents, as curves.amplitude of the curves.",
    )
    .slider(0.0, 0.3),
    p(
        "curves.breathe",
        "",
        "",
        Float(0.0, 2.0, 0.4),
        Volume,
        "How much bundles part and gather along their way: the relative standard deviation of their width.",
    ),
    p("curves.loose", "", "", Float(0.0, 1.0, 0.15), Volume, "Share of the curves that belong to no bundle."),
    p("volume.nx", "nx", "cells", Int(1, 1_000_000, 40), Volume, "Cells across the flow.").slider(1.0, 256.0),
    p("volume.ny", "ny", "cells", Int(1, 1_000_000, 40), Volume, "Cells along the flow.").slider(1.0, 256.0),
    p("volume.nz", "nz", "cells", Int(1, 1_000_000, 40), Volume, "Cells into the surface.")
        .slider(1.0, 256.0),
    p(
        "volume.storage",
        "",
        "",
        Choice(&["auto", "dense", "sparse"]),
        Volume,
        "How cells are stored: all (dense), those that strands pass (sparse), or sparse only where all would not fit --memory (auto). Pictures do not depend on it.",
    ),
    p("volume.seed", "", "", Int(0, i64::MAX, 1), Volume, "Seed of all randomness of the volume."),
    p(
        "volume.coherence",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Volume,
        "From density independent in every cell, as in the paper (0), to density that strands carry along (1).",
    ),
    p(
        "volume.strand_length",
        "",
        "flow lengths",
        Float(0.005, 1.0, 0.08),
        Volume,
        "Correlation length of the density along a strand, as a fraction of the flow length ny.",
    )
    .slider(0.005, 0.5),
    p(
        "volume.coverage",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Volume,
        "From density whole in every cell that a strand touches, as in the paper (0), to density by the length of the strands in it (1).",
    ),
    p(
        "volume.crest",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Upload,
        "How much k_d grows from the thinnest cells to the densest: foam is bright.",
    ),
    p("volume.alpha", "α", "", Float(0.0, 1.0, 1.0), Uniform, "Scale of the density ρ."),
    p(
        "volume.flow",
        "",
        "lengths",
        Float(-1e6, 1e6, 0.0),
        Uniform,
        "Moves the volume down the flow by this many of its lengths; every whole number gives the same picture.",
    )
    .slider(0.0, 1.0),
    p("volume.k_d", "k_d", "", Float(0.0, 1.0, 0.5), Upload, "Base of the diffuse reflection coefficient."),
    p("volume.k_s", "k_s", "", Float(0.0, 1.0, 0.5), Upload, "Base of the specular reflection coefficient."),
    p(
        "volume.k_noise",
        "",
        "",
        Float(0.0, 1.0, 0.1),
        Upload,
        "Standard deviation of the normal noise added to k_d and k_s.",
    ),
    p(
        "volume.file",
        "",
        "",
        Text(""),
        Volume,
        "Takes the volume texture from this .npz file instead of building it.",
    ),
];
