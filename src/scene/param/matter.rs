//! Parameters of matter that is made of threads: fur, cloth, hair, and strands of a file.

use super::Cost::Volume;
use super::Kind::{Float, Int, Text};
use super::{Group, p};

pub(super) const FUR: Group = Group {
    title: "Fur",
    about: "Hairs of a volume with `volume.builder=fur`. They stand on the skin, the face z = nz, and end \
         above it. `curves.h` and `curves.amplitude` (here of a hair's length) bend them. `volume.color` to \
         `volume.color_4` run from root to tip.",
    params: &[
        p("fur.hairs", "", "", Int(1, 10_000_000, 4000), Volume)
            .slider(100.0, 50_000.0)
            .doc("Number of hairs on one copy of the volume, undercoat included.")
            .when("Raise it for a dense coat; lower it where the skin should shine through."),
        p("fur.hair_length", "", "depths", Float(0.01, 1.0, 0.85), Volume)
            .doc("Mean length of the guard hairs, as a fraction of the depth nz.")
            .when("Leave room for longer hairs above 1 − 2 × `fur.hair_spread`; they are cut at the depth."),
        p("fur.hair_spread", "", "", Float(0.0, 1.0, 0.12), Volume)
            .doc("Relative standard deviation of the lengths.")
            .when("Raise it for a shaggy coat; lower it for a shorn one."),
        p("fur.hair_width", "", "widths", Float(1e-6, 0.5, 0.008), Volume)
            .slider(0.0005, 0.05)
            .doc("Diameter of a hair at its root, as a fraction of the volume's width nx.")
            .when("Lower it with more `fur.hairs`. Below one cell, 1/nx, cells thin out in proportion."),
        p("fur.taper", "", "", Float(0.0, 1.0, 0.8), Volume)
            .doc("Share of its diameter that a hair loses from root to tip.")
            .when("Raise it for pointed hairs and a soft outline; lower it for bristles."),
        p("fur.lean", "", "lengths", Float(-10.0, 10.0, 0.0), Volume)
            .slider(-2.0, 2.0)
            .doc(
                "Distance by which a tip leans down the flow, v, as a fraction of the hair's length; half of \
                 it for the undercoat.",
            )
            .when("Raise it to comb the fur; lower it below 0 to comb it the other way."),
        p("fur.undercoat", "", "", Float(0.0, 1.0, 0.6), Volume)
            .doc("Share of the hairs that belong to the undercoat, which has the first colour.")
            .when("Raise it for a plush coat; set 0 for grass or bristles."),
        p("fur.undercoat_length", "", "", Float(0.01, 1.0, 0.5), Volume)
            .doc("Length of the undercoat relative to that of guard hairs.")
            .when("Lower it to let guard hairs stand apart."),
        p("fur.clumps", "", "", Int(0, 65536, 0), Volume)
            .slider(0.0, 400.0)
            .doc("Number of clumps in which hairs gather. 0 lets each stand alone.")
            .when("Set it to a twentieth of the hairs or less for a coat with locks, such as a bear's."),
        p("fur.clumping", "", "", Float(0.0, 1.0, 0.5), Volume)
            .doc("Share of the way to the middle of its clump that the tip of a hair is drawn.")
            .when("Raise it for wet, pointed locks; lower it for fluff."),
        p("fur.hair_shade", "", "", Float(0.0, 1.0, 0.12), Volume)
            .doc("Relative standard deviation of k_d from hair to hair.")
            .when("Raise it for a grizzled coat; lower it for an even one."),
    ],
};

pub(super) const CLOTH: Group = Group {
    title: "Cloth",
    about: "Yarns of a volume with `volume.builder=cloth`. The warp runs along v and the weft along u; they \
         pass over and under one another in the middle of the depth. `volume.color` is the colour of the \
         warp, and the last of the others that of the weft.",
    params: &[
        p("cloth.weave", "", "", Text("plain"), Volume)
            .doc(
                "Yarns that lie on top: `plain`, `twill` (a diagonal, as in denim), `satin` (the warp floats \
                 over four), or rows of 0 and 1, where 1 is the warp on top, such as `110/011/101`.",
            )
            .when("Choose satin for sheen, twill for jeans, plain for linen."),
        p("cloth.warp", "", "yarns", Int(1, 4096, 20), Volume)
            .slider(1.0, 64.0)
            .doc("Number of yarns of the warp on one copy of the volume: a multiple of the weave's columns.")
            .when("Raise it for finer cloth, and `volume.nx` with it: 6 cells a yarn show its fibres."),
        p("cloth.weft", "", "yarns", Int(1, 4096, 20), Volume)
            .slider(1.0, 64.0)
            .doc("Number of yarns of the weft on one copy of the volume: a multiple of the weave's rows.")
            .when("Raise it for finer cloth, and `volume.ny` with it."),
        p("cloth.yarn", "", "pitches", Float(0.02, 2.0, 0.95), Volume)
            .doc("Diameter of a yarn, as a fraction of the distance between neighbours.")
            .when("Lower it for gauze, whose holes show what is behind."),
        p("cloth.crimp", "", "diameters", Float(0.0, 2.0, 0.4), Volume)
            .doc("Distance of a yarn's middle from that of the cloth where it lies on top, in its diameters.")
            .when("Raise it for bulky cloth; the depth nz needs room for it and for half a yarn."),
        p("cloth.fibres", "", "", Int(1, 10_000, 40), Volume)
            .slider(1.0, 200.0)
            .doc("Number of fibres in a yarn.")
            .when("Raise it with thinner fibres for smooth yarns."),
        p("cloth.fibre_width", "", "diameters", Float(0.001, 1.0, 0.25), Volume)
            .doc("Diameter of a fibre, as a fraction of the yarn's.")
            .when("Lower it for loose yarns that let light through."),
        p("cloth.twist", "", "turns", Float(-20.0, 20.0, 0.25), Volume)
            .slider(-2.0, 2.0)
            .doc("Turns of the fibres around their yarn, from one crossing to the next.")
            .when("Lower it to 0 for silk, whose fibres lie along the yarn and shine; raise it for wool."),
        p("cloth.fuzz", "", "", Float(0.0, 100.0, 0.0), Volume)
            .slider(0.0, 10.0)
            .doc("Number of stray fibres at each crossing, which stand off the cloth.")
            .when("Raise it for wool and flannel."),
        p("cloth.yarn_shade", "", "", Float(0.0, 1.0, 0.06), Volume)
            .doc("Relative standard deviation of k_d from yarn to yarn.")
            .when("Raise it for slub linen and worn denim."),
    ],
};

pub(super) const HAIR: Group = Group {
    title: "Long hair",
    about: "Strands of a volume with `volume.builder=hair`. They run along v, from the root to the tip, and \
         leave the skin, the face z = nz, at their roots. `curves.h` and `curves.amplitude` bend each of \
         them. `volume.color` to `volume.color_4` run from root to tip. A copy of the volume is as long as \
         the hair, so let v grow from 0 to 1 on the mesh.",
    params: &[
        p("tress.strand_count", "", "", Int(1, 10_000_000, 6000), Volume)
            .slider(100.0, 50_000.0)
            .doc("Number of strands on one copy of the volume.")
            .when("Raise it for thick hair; lower it where the skin should show."),
        p("tress.reach", "", "lengths", Float(0.01, 1.0, 0.9), Volume)
            .doc("Mean way of a strand from root to tip, as a fraction of the flow length ny.")
            .when("Leave room for longer strands above 1 − 2 × `tress.reach_spread`; they are cut at ny."),
        p("tress.reach_spread", "", "", Float(0.0, 1.0, 0.05), Volume)
            .doc("Relative standard deviation of the reach.")
            .when("Raise it for layered or ragged ends; lower it for a blunt cut."),
        p("tress.strand_width", "", "widths", Float(1e-6, 0.5, 0.004), Volume)
            .slider(0.0005, 0.05)
            .doc("Diameter of a strand at its root, as a fraction of the volume's width nx.")
            .when("Lower it with more `tress.strand_count`. Below one cell, 1/nx, cells thin out."),
        p("tress.thinning", "", "", Float(0.0, 1.0, 0.5), Volume)
            .doc("Share of its diameter that a strand loses from root to tip.")
            .when("Raise it for soft ends."),
        p("tress.locks", "", "", Int(0, 65536, 60), Volume)
            .slider(0.0, 400.0)
            .doc("Number of locks in which strands gather. 0 lets each hang alone.")
            .when("Raise it for fine locks; a hundredth of the strands is a usual number."),
        p("tress.gathering", "", "", Float(0.0, 1.0, 0.5), Volume)
            .doc("Share of the way to the middle of its lock that the tip of a strand is drawn.")
            .when("Raise it for wet or oiled hair with pointed locks; lower it for brushed hair."),
        p("tress.stray", "", "", Float(0.0, 1.0, 0.06), Volume)
            .doc("Share of the strands that belong to no lock.")
            .when("Raise it for unruly hair."),
        p("tress.wave", "", "widths", Float(0.0, 1.0, 0.0), Volume)
            .slider(0.0, 0.1)
            .doc(
                "Amplitude of the waves of a lock across the flow, as a fraction of the volume's width nx; \
                 half of it in the depth.",
            )
            .when("Raise it for wavy hair and curls; leave it at 0 for straight hair."),
        p("tress.waves", "", "", Float(0.0, 200.0, 4.0), Volume)
            .slider(0.0, 20.0)
            .doc("Mean number of waves along the flow length ny.")
            .when("Raise it with a larger `tress.wave` for curls."),
        p("tress.strand_shade", "", "", Float(0.0, 1.0, 0.15), Volume)
            .doc("Relative standard deviation of k_d from strand to strand.")
            .when("Raise it for streaks; lower it for dyed hair."),
    ],
};

pub(super) const IMPORT: Group = Group {
    title: "Strands of a file",
    about: "Strands of a volume with `volume.builder=strands`, which `volume.source` names: a file .hair in \
         the format of Cem Yuksel's models, or curves of USD (.usdc, .usda, .usd, .usdz). The cells are \
         cubes, and a box around the volume stands where the strands stand. A file of USD says its unit and \
         which axis points up; turn a .hair whose z axis points up with `volume.up=z`. `volume.color` to \
         `volume.color_4` run from root to tip.",
    params: &[
        p("import.longest", "", "cells", Int(3, 4096, 256), Volume)
            .slider(32.0, 512.0)
            .doc("Number of cells along the longest side of the strands' bounds.")
            .when("Raise it until single strands show; memory grows with its cube."),
        p("import.file_unit", "", "m", Float(1e-6, 1e6, 1.0), Volume)
            .slider(0.001, 1.0)
            .doc(
                "Length of the file's unit. Unless it is set, that of a file of USD is its metersPerUnit, \
                 or a centimetre where it has none.",
            )
            .when("Set 0.01 for a file in centimetres, and 0.0254 for one in inches."),
        p("import.strand_diameter", "", "m", Float(0.0, 1.0, 0.0), Volume)
            .slider(0.0, 0.01)
            .doc("Diameter of all strands. 0 takes that of each point from the file.")
            .when("Set it where the file has no thickness, or few strands stand for many."),
    ],
};
