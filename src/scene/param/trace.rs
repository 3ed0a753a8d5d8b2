//! Materials, the quads that the volume is mapped onto, and the walk through it.

use super::Cost::*;
use super::Kind::*;
use super::{Group, p};
use crate::scene::meshes::{Carrier, SIDES, ThicknessFrom};
use crate::trace::{AttenuationKind, Lookup, Prefilter};

pub(super) const MATERIALS_AND_QUADS: Group = Group {
    title: "Materials and quads",
    about: "A material says how the volume lies on quads, sheets and splashes; the material `water` always \
         exists. A quad is a flat piece of water given by its corners; sheets and splashes make their \
         own.",
    params: &[
        p("materials.*.thickness", "H", "m", Float(1e-4, 1e4, 0.4), Uniform)
            .slider(0.01, 10.0)
            .doc("Depth of one volume below the face of the quads.")
            .when("Raise it for a deep, full body of water; lower it for a thin film."),
        p("materials.*.repeat_u", "", "", Float(1e-3, 1e4, 1.0), Uniform)
            .slider(0.1, 20.0)
            .doc("Number of copies of the volume along u, across the flow.")
            .when("Raise it for narrower strands; lower it for broader ones, as on a narrow sheet."),
        p("materials.*.repeat_v", "", "", Float(1e-3, 1e4, 1.0), Uniform)
            .slider(0.1, 20.0)
            .doc("Number of copies of the volume along v, along the flow.")
            .when("Raise it for shorter streaks; lower it for longer ones, as on a short sheet."),
        p("materials.*.mist", "", "", Float(0.0, 4.0, 0.0), Uniform)
            .doc(
                "Ψ of droplets without a direction, which fill the volume in place of its strands. 0 \
                 keeps the strands.",
            )
            .when("Set it to 0.25 to 0.5 for mist; raise it when the mist looks too dark."),
        p("materials.*.facing", "", "", Switch(false), Uniform)
            .doc(
                "Whether sheets of mist turn about the vertical to face the camera. What the sheet's `edge`, \
                 `head` and `fade` leave is squared then, so that it ends softly. A cloud of drops looks \
                 alike from all sides; a sheet that stands still would show its edge from aside.",
            )
            .when("Switch it on for spray that the camera may see from any side."),
        p("materials.*.billow", "", "", Float(0.0, 1.0, 0.0), Uniform)
            .doc(
                "Strength of the billows in mist, which thin and thicken it. 0 keeps it even, as mist on \
                  meshes is.",
            )
            .when("Raise it for spray beside falling water; lower it for a calm veil."),
        p("materials.*.billow_size", "", "m", Float(1e-3, 1e4, 1.0), Uniform)
            .slider(0.05, 10.0)
            .doc("Size of the billows. The finer ones in them are 2.7 times smaller.")
            .when("Lower it in small scenes; raise it for wide clouds of spray."),
        p("materials.*.billow_rise", "", "m", Float(-1e4, 1e4, 2.0), Uniform)
            .slider(-5.0, 10.0)
            .doc("Distance that the billows rise while `volume.flow` grows by 1. Loops close with any value.")
            .when("Raise it for quick spray; set it below 0 for mist that sinks."),
        p("materials.*.volume", "", "", Text("water"), Upload)
            .doc("Name of the volume that the material shows: `water`, or one of `volumes`.")
            .when("Name another volume for other matter beside the water, such as grass on the bank."),
        p("materials.*.carrier", "", "", Choice(Carrier::WORDS), Upload)
            .doc(
                "What carries the volume on a mesh. `face`: each face carries it as a quad does, with copies \
                 that go on beside and behind it. `shell`: the volume fills the space between the mesh and \
                 its offset, and ends there.",
            )
            .when(
                "Choose `shell` for fur, grass and all that needs a silhouette; keep `face` for thin water. \
                 Quads, sheets and splashes are faces.",
            ),
        p("materials.*.side", "", "", Choice(SIDES), Upload)
            .doc("Side of the mesh on which a shell lies.")
            .when("Choose `inward` for matter that fills the mesh, such as foam or ice."),
        p("materials.*.skin", "", "", Switch(true), Upload)
            .doc(
                "Whether the mesh under an outward shell is opaque: it is drawn, and no light comes through \
                 it.",
            )
            .when("Turn it off for matter without a body, such as a cloud."),
        p("materials.*.thickness_from", "", "", Choice(ThicknessFrom::WORDS), Upload)
            .doc("What scales the thickness of a shell: nothing, or the red of the vertices' `color`.")
            .when("Choose `color` and paint vertices darker where fur is shorter; black is bald."),
        p("quads.*.corners", "A B C D", "m", Corners, Upload)
            .doc(
                "Corners at (u,v) = (0,0), (1,0), (1,1) and (0,1). They lie in one plane and are convex; \
                 v runs down the flow.",
            )
            .when("Add quads for a form that sheets do not have, as in the paper's figures."),
        p("quads.*.material", "", "", Text("water"), Upload)
            .doc("Name of the quad's material.")
            .when("Name another material for another thickness or other strands."),
    ],
};

pub(super) const TRACE: Group = Group {
    title: "Trace",
    about: "A view ray walks from cell to cell through copies of the volume, and through one sheet after \
         another. These parameters set how much light a cell takes away, and how far and how finely rays \
         look.",
    params: &[
        p("trace.attenuation", "", "", Choice(AttenuationKind::WORDS), Uniform)
            .doc(
                "Attenuation of a cell: `path-length` gives τ_k = σ·ρ·Δs, where Δs is the length of the \
                 ray inside the cell in metres; `per-cell` gives τ_k = τ·ρ, whatever that length is.",
            )
            .when(
                "Choose `per-cell` to reproduce the paper; keep `path-length` otherwise: it does not \
                 depend on the number of cells.",
            ),
        p("trace.sigma", "σ", "1/m", Float(0.0, 1e5, 10.0), Uniform)
            .slider(0.0, 200.0)
            .doc("Extinction at ρ = 1, with `trace.attenuation=path-length`.")
            .when(
                "Raise it when too much shows through the water; lower it for a veil. A scene of half the \
                 size needs twice as much.",
            ),
        p("trace.tau", "τ", "", Float(0.0, 1e3, 0.1), Uniform)
            .slider(0.0, 2.0)
            .doc("Optical depth of one cell at ρ = 1, with `trace.attenuation=per-cell`.")
            .when(
                "Raise it when too much shows through the water; lower it for a veil. A volume of twice \
                 as many layers needs half as much.",
            ),
        p("trace.max_cells", "", "cells", Int(1, 65536, 512), Uniform)
            .slider(1.0, 2048.0)
            .doc(
                "Largest number of cells that a view ray may meet in one sheet; each sheet behind it counts \
                 anew. The same limit holds for each light ray.",
            )
            .when(
                "Raise it for large volumes and grazing views, where rays would end inside the water; \
                 lower it to limit the time.",
            ),
        p("trace.early_end", "", "", Float(0.0, 1.0, 1.0 / 1024.0), Uniform)
            .doc("Transmittance below which a view ray ends. 0 never ends it early.")
            .when("Raise it to save time in dense water; lower it to 0 for exact sums."),
        p("trace.layers", "", "sheets", Int(1, 16, 4), Uniform)
            .doc(
                "Largest number of quads that one view ray goes through, the nearest first. Those behind \
                 are left out.",
            )
            .when("Raise it when water behind other water disappears; lower it to save time."),
        p("trace.filter", "", "", Choice(Prefilter::WORDS), Upload)
            .doc(
                "Filter against aliasing: `pyramid` walks coarser levels of the volume where a pixel sees \
                 many cells; `none` always walks the volume's own cells.",
            )
            .when(
                "Choose `pyramid` when distant water flickers or looks grainy; it takes more memory and \
                 time.",
            ),
        p("trace.lookup", "", "", Choice(Lookup::WORDS), Volume)
            .doc(
                "Values that a ray finds in a cell: `nearest` takes the cell's own, `trilinear` \
                 interpolates ρ, k and v between eight cells. `strand` takes the cell's own too, but where a \
                 pixel sees less than a cell of water, the ray meets the strands that made the cells, as \
                 threads with soft edges. Shells and volumes from files have no such strands.",
            )
            .when(
                "Choose `strand` for water seen from near by, where cells show as blocks; what is further \
                 away stays as it is. `trilinear` blurs any volume; the walk takes 2 to 5 times as long.",
            ),
    ],
};
