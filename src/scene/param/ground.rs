//! Parameters of matter that lies on a surface: a face of rock with grass, and loose grains.

use super::Cost::Volume;
use super::Kind::{Float, Int};
use super::{Group, p};

pub(super) const MOUNTAIN: Group = Group {
    title: "Mountain",
    about: "A near face of a mountain, of a volume with `volume.builder=mountain`: rock fills it from the \
         skin, the face z = nz, up to a fractal height of roughness `curves.h`; stones lie in its hollows, \
         moss on what is flat, and grass grows where soil gathers. v leads down the slope. `volume.color` \
         to `volume.color_4` are light rock, dark rock and soil, moss and the roots of grass, and its tips.",
    params: &[
        p("mountain.relief", "", "depths", Float(0.0, 1.0, 0.11), Volume)
            .slider(0.0, 0.3)
            .doc(
                "Standard deviation of the rock's height, as a fraction of the depth nz. The mean height is \
                 2.4 times as much.",
            )
            .when("Raise it for deep clefts; the rest of the depth is room for grass."),
        p("mountain.block_size", "", "widths", Float(0.001, 1.0, 0.3), Volume)
            .slider(0.02, 1.0)
            .doc("Size of the largest forms of the rock, as a fraction of the volume's width nx.")
            .when("Lower it for rubble; raise it for a few large slabs, which show that copies repeat."),
        p("mountain.fracture", "", "", Float(0.0, 1.0, 0.7), Volume)
            .doc("Share of the relief that is broken into blocks with flat faces and cracks.")
            .when("Raise it for limestone and slate; lower it for rock that ice or water has rounded."),
        p("mountain.beds", "", "", Float(0.0, 1.0, 0.4), Volume)
            .doc("Share by which the blocks lie in beds: they are long, and their edges are ledges.")
            .when("Raise it for layered rock with grass on its ledges; lower it for granite."),
        p("mountain.scree", "", "", Float(0.0, 0.9, 0.1), Volume)
            .doc("Share of the area that stones cover.")
            .when("Raise it below cliffs and in gullies."),
        p("mountain.stone_size", "", "widths", Float(0.0001, 0.5, 0.03), Volume)
            .slider(0.005, 0.1)
            .doc("Radius of the largest stones, as a fraction of nx. Small ones are more numerous.")
            .when("Raise it for boulders; 2 cells are the least that shows a stone's form."),
        p("mountain.moss", "", "", Float(0.0, 1.0, 0.2), Volume)
            .doc("Share of the rock without soil that moss covers: short fuzz on what is flat.")
            .when("Raise it for wet and northern slopes."),
        p("mountain.soil", "", "", Float(0.0, 1.0, 0.45), Volume)
            .doc("Share of the area with soil, on ledges and in hollows. Grass grows there alone.")
            .when("Raise it for a meadow with a few rocks; lower it for a cliff with tufts."),
        p("mountain.blades", "", "", Int(0, 10_000_000, 8000), Volume)
            .slider(0.0, 50_000.0)
            .doc("Number of blades of grass on one copy of the volume, most of them in tufts of 40.")
            .when("Raise it with `mountain.soil`, so that the earth does not show."),
        p("mountain.blade_length", "", "depths", Float(0.01, 2.0, 0.3), Volume)
            .slider(0.05, 1.0)
            .doc("Mean length of a blade, as a fraction of the depth nz.")
            .when("Lower it for grazed grass. Blades are cut where they leave the volume."),
        p("mountain.blade_width", "", "widths", Float(1e-6, 0.5, 0.0015), Volume)
            .slider(0.0002, 0.02)
            .doc("Width of a blade at its root, as a fraction of nx.")
            .when(
                "Lower it with more `mountain.blades`. Below one cell, 1/nx, cells thin out in proportion.",
            ),
        p("mountain.blade_lean", "", "heights", Float(-10.0, 10.0, 0.5), Volume)
            .slider(-2.0, 2.0)
            .doc("Distance by which a blade's tip leans down the slope, as a fraction of its height.")
            .when("Raise it for long grass that hangs; lower it below 0 for wind from below."),
    ],
};

pub(super) const GRAINS: Group = Group {
    title: "Grains",
    about: "Loose grains of a volume with `volume.builder=grains`: each has any direction, and there are no \
         strands. Water of particles alone looks so. With two colours or more a grain has a place on the \
         ramp by chance.",
    params: &[
        p("grains.filled", "", "", Float(0.0, 1.0, 0.5), Volume)
            .doc("Share of the grains that are filled; the others are gaps.")
            .when("Raise it to 1 for a solid lump; lower it for spray."),
        p("grains.settled", "", "", Float(0.0, 1.0, 0.0), Volume)
            .doc("Share by which the filled grains become fewer from the skin, z = nz, to the outer face.")
            .when("Raise it to 1 for grains that are strewn on a surface, with a soft outline."),
        p("grains.grain_size", "", "cells", Float(1.0, 1000.0, 1.0), Volume)
            .slider(1.0, 16.0)
            .doc("Mean distance from grain to grain. At 1 each cell is a grain.")
            .when("Raise it for crystals with faces, of several cells each."),
        p("grains.grain_shade", "", "", Float(0.0, 2.0, 0.2), Volume)
            .slider(0.0, 1.0)
            .doc("Relative standard deviation of k_d and k_s from grain to grain.")
            .when("Raise it for sparkle; lower it for even dust."),
    ],
};
