//! The volume texture: its curves and cells.

use super::Cost::*;
use super::Kind::*;
use super::{Group, p};
use crate::light::VolumeReflection;
use crate::scene::measured::Builder;
use crate::volume::{LevelSetUnit, ReflectBy, RhoRule, StorageChoice, Up, VelocityAt};

/// Place of the grid, if it is not the file's: of the water and of other volumes.
pub(super) const ORIGIN: &str = "volume.origin";
pub(super) const ORIGIN_OF_OTHERS: &str = "volumes.*.origin";

pub(super) const CURVES: Group = Group {
    title: "Curves",
    about: "Spatial fractal curves run from the face y = 0 of the volume to the points opposite on y = ny. \
         Each cell takes its flow direction from the curves that pass it. These parameters set how many \
         curves there are, how rough they are, and whether they gather into bundles.",
    params: &[
        p("curves.across", "", "", Int(1, 65536, 32), Volume)
            .slider(1.0, 128.0)
            .doc("Columns of the jittered grid of curve starts on the face y = 0, across the flow.")
            .when(
                "Raise it for denser water with finer gaps; lower it for single strands. Raise it in \
                 proportion to `volume.nx` to keep the water as dense.",
            ),
        p("curves.deep", "", "", Int(1, 65536, 32), Volume)
            .slider(1.0, 128.0)
            .doc("Rows of the jittered grid of curve starts, into the surface.")
            .when(
                "Raise it when the water looks like a single layer of strands; lower it together with \
                 `volume.nz` for a thin sheet.",
            ),
        p("curves.h", "h", "", Float(0.0, 8.0, 0.9), Volume)
            .slider(0.0, 3.0)
            .doc(
                "Complexity h of the curves: each level of the recursion displaces 2^(−h) times as far as \
                 the one before. A small h is rough, a large h is smooth.",
            )
            .when("Lower it for rough, tangled water; raise it for smooth, glassy threads."),
        p("curves.amplitude", "", "flow lengths", Float(0.0, 1.0, 0.05), Volume)
            .slider(0.0, 0.3)
            .doc(
                "Standard deviation of g, the displacement of midpoints, as a fraction of the flow length \
                 ny.",
            )
            .when("Raise it for strands that wander and cross; lower it for straight, parallel ones."),
        p("curves.levels", "", "", Int(0, 16, 0), Volume)
            .doc(
                "Depth of the recursion: a curve has 2^levels segments. 0 chooses the depth at which a \
                 segment spans at most half a cell.",
            )
            .when(
                "Leave it at 0 for pictures; set a small number to see the first steps of the recursion, \
                 or for strands of straight pieces.",
            ),
        p("curves.bundles", "", "", Int(0, 65536, 0), Volume)
            .slider(0.0, 64.0)
            .doc(
                "Number of parent curves that the curves gather around. With 0 every curve is \
                 independent, as in the paper.",
            )
            .when(
                "Set it to about 5 to 20 when the water should part and let the rock show through; more \
                 bundles leave smaller gaps.",
            ),
        p("curves.radius", "", "widths", Float(0.0, 1.0, 0.03), Volume)
            .slider(0.0, 0.2)
            .doc(
                "Standard deviation of a curve's distance from its parent, as a fraction of the volume's \
                 width nx.",
            )
            .when("Lower it for tight ropes with clear gaps; raise it to let bundles merge into one sheet."),
        p("curves.wander", "", "flow lengths", Float(0.0, 1.0, 0.08), Volume)
            .slider(0.0, 0.3)
            .doc(
                "Standard deviation of g, the displacement of midpoints, for the parent curves, as a \
                 fraction of the flow length ny.",
            )
            .when(
                "Raise it to let whole bundles swing from side to side; lower it to let them fall \
                 straight.",
            ),
        p("curves.breathe", "", "", Float(0.0, 2.0, 0.4), Volume)
            .doc("Relative variation (standard deviation) of a bundle's width along the flow.")
            .when("Raise it when bundles look like cables of constant width; lower it for even ropes."),
        p("curves.loose", "", "", Float(0.0, 1.0, 0.15), Volume)
            .doc("Share of the curves that belong to no bundle.")
            .when("Raise it to fill the gaps between bundles with fine threads; lower it for clear gaps."),
    ],
};

/// Keys of the ramp's colours.
pub const COLORS: [&str; 4] = ["volume.color", "volume.color_2", "volume.color_3", "volume.color_4"];

pub(super) const VOLUME: Group = Group {
    title: "Volume",
    about: "The volume texture is a box of nx × ny × nz cells whose copies join without a seam across and \
         along the flow. Each cell holds a density ρ, a flow direction v, and the reflection coefficients \
         k_d and k_s.",
    params: &[
        p("volume.nx", "nx", "cells", Int(1, 1_000_000, 40), Volume)
            .slider(1.0, 256.0)
            .doc("Number of cells across the flow.")
            .when("Raise it for finer strands; lower it to save memory and time."),
        p("volume.ny", "ny", "cells", Int(1, 1_000_000, 40), Volume)
            .slider(1.0, 256.0)
            .doc("Number of cells along the flow.")
            .when("Raise it when strands show steps along the flow; lower it to save memory and time."),
        p("volume.nz", "nz", "cells", Int(1, 1_000_000, 40), Volume)
            .slider(1.0, 256.0)
            .doc("Number of cells into the surface.")
            .when(
                "Lower it for thin sheets, for which 10 to 14 are enough; raise it for thick water, and \
                 `trace.max_cells` with it.",
            ),
        p("volume.storage", "", "", Choice(StorageChoice::WORDS), Volume)
            .doc(
                "Storage of the cells: `dense` keeps all of them, `sparse` only the blocks that strands \
                 pass. `auto` is sparse only where dense does not fit into `--memory`. Pictures do not \
                 depend on it. `sparse` cannot be combined with `trace.filter=pyramid`.",
            )
            .when(
                "Leave it at `auto`; choose `sparse` for volumes of 256 cells a side or more that are \
                 mostly empty.",
            ),
        p("volume.seed", "", "", Int(0, i64::MAX, 1), Volume)
            .doc("Seed of all randomness in the volume. Equal seeds give equal volumes, bit for bit.")
            .when("Change it for other water of the same kind."),
        p("volume.coherence", "", "", Float(0.0, 1.0, 0.0), Volume)
            .doc(
                "Dependence of the density on the strands: 0 draws ρ independently in every cell, as in \
                 the paper; 1 keeps the density of a strand from cell to cell.",
            )
            .when("Raise it when the water looks like grain instead of streaks; lower it for fine spray."),
        p("volume.strand_length", "", "flow lengths", Float(0.005, 1.0, 0.08), Volume)
            .slider(0.005, 0.5)
            .doc(
                "Correlation length of the density along a strand, as a fraction of the flow length ny. \
                 It has an effect where `volume.coherence` is above 0.",
            )
            .when("Raise it for long, unbroken streaks; lower it for water that breaks into short pieces."),
        p("volume.coverage", "", "", Float(0.0, 1.0, 0.0), Volume)
            .doc(
                "Dependence of the density on the length of the strands in a cell: 0 gives the whole \
                 density to every cell that a strand touches, as in the paper; 1 thins the cells that \
                 strands only clip.",
            )
            .when(
                "Raise it when single cells stand out as specks or blocks; lower it for hard, full \
                 strands.",
            ),
        p("volume.crest", "", "", Float(0.0, 1.0, 0.0), Upload)
            .doc("Difference of k_d between the densest cells and the thinnest.")
            .when("Raise it to make dense foam bright and thin water dark; set 0 for an even k_d."),
        p("volume.alpha", "α", "", Float(0.0, 1.0, 1.0), Uniform)
            .doc("Factor on the density ρ of all cells.")
            .when(
                "Lower it for a transparent veil; raise it for dense water. If 1 is not dense enough, \
                 raise `trace.sigma` or `trace.tau`.",
            ),
        p("volume.flow", "", "lengths", Float(-1e6, 1e6, 0.0), Uniform)
            .slider(0.0, 1.0)
            .doc(
                "Distance by which the volume has moved down the flow, in lengths of the volume. Every \
                 whole number gives the same picture.",
            )
            .when("Change it to choose the moment of a still; in an animation `animate.speed` moves it."),
        p("volume.k_d", "k_d", "", Float(0.0, 1.0, 0.5), Upload)
            .doc(
                "Diffuse reflection coefficient of the cells, before noise is added. With \
                 `light.reflection=strand` only its ratio to `volume.k_s` counts.",
            )
            .when(
                "Raise it for white, foaming water; lower it for clear water that shows little but \
                 highlights.",
            ),
        p("volume.k_s", "k_s", "", Float(0.0, 1.0, 0.5), Upload)
            .doc("Specular reflection coefficient of the cells, before noise is added.")
            .when("Raise it for bright highlights along the strands; lower it for matt, milky water."),
        p("volume.reflection", "", "", Choice(VolumeReflection::WORDS), Uniform)
            .doc(
                "Reflection of the cells: that of `light.reflection` (`scene`), or the paper's fibres \
                 (`kajiya-kay`), which may have colours.",
            )
            .when("Set it to `kajiya-kay` for cloth or fur beside hair or water of another model."),
        p(COLORS[0], "", "", Color([1.0, 1.0, 1.0]), Uniform)
            .doc(
                "Colour of what the cells reflect diffusely, and first of up to four on a ramp. Along it \
                 lie the cells of `volume.builder=fur`, `hair` and `strands` from root to tip, those of \
                 `cloth` from warp to weft, those of `mountain` from rock to grass, those of `grains` by \
                 chance, those of `skin` by their tissue, and those of `flow` and of a file by their k_s; \
                 all cells then have the k_s of `volume.k_s`. Highlights keep the colour of the light. \
                 Cells are white without it, but those of skin.",
            )
            .when("Set it for fur, cloth or soil; water is white, and takes its colour from light and sky."),
        p(COLORS[1], "", "", Color([1.0, 1.0, 1.0]), Uniform)
            .doc("Second colour of the ramp.")
            .when("Set it where the colour changes, such as from root to tip."),
        p(COLORS[2], "", "", Color([1.0, 1.0, 1.0]), Uniform)
            .doc("Third colour of the ramp.")
            .when("Set it for bands of colour, as in the hair of wild animals."),
        p(COLORS[3], "", "", Color([1.0, 1.0, 1.0]), Uniform)
            .doc("Fourth colour of the ramp.")
            .when("Set it for a tip of its own, such as a light one."),
        p("volume.k_noise", "", "", Float(0.0, 1.0, 0.1), Upload)
            .doc("Standard deviation of the normal noise that is added to k_d and k_s in every cell.")
            .when("Raise it for sparkle from cell to cell; lower it for even water."),
        p("volume.file", "", "", Text(""), Volume)
            .doc("Path of an .npz file that holds the volume texture. Without one the volume is built.")
            .when("Set it to render cells of your own; `taki volume build` writes an example of the format."),
        p("volume.frame", "", "", Int(-1_000_000_000, 1_000_000_000, 0), Volume)
            .slider(0.0, 240.0)
            .doc(
                "Number of the file where the name in `volume.source` or `volume.file` has `####` (or \
                 `%04d`, `$F4`, `@@@@`) in the place of one. In an animation it is the number of frame 0, \
                 and each frame takes one more; a track of it takes the files that the track says.",
            )
            .when("Set it to the number of the first file of a sequence, or to that of a still."),
        p("volume.builder", "", "", Choice(Builder::WORDS), Volume)
            .doc(
                "What the cells are made of: spatial fractal curves as in the paper (`curves`), hairs on a \
                 skin (`fur`), woven yarns (`cloth`), long hair along v (`hair`), the strands of a file in \
                 `volume.source` (`strands`), a near face of rock with grass (`mountain`), loose grains \
                 (`grains`), skin (`skin`), or the grids of a simulation in `volume.source` (`flow`).",
            )
            .when(
                "Choose `fur`, `cloth`, `hair`, `mountain` or `skin` for a shell over a mesh, and `strands`, \
                 or `flow` for smoke or water that another program computed, in a box.",
            ),
        p("volume.source", "", "", Text(""), Volume)
            .doc(
                "Path of a simulation's file: OpenVDB (.vdb), NanoVDB (.nvdb) or arrays of NumPy (.npz); \
                 with `volume.builder=strands`, of a file of hair (.hair) or of curves (.usdc, .usda, .usd, \
                 .usdz). Like all paths of a scene, it lies in the folder of the scene. With `####` in its \
                 name it is a sequence, of which `volume.frame` chooses the file.",
            )
            .when("Set it to a frame of the simulation. `taki scene` lists what was found in it."),
        p("volume.grid", "", "", Text("density"), Volume)
            .doc("Name of the grid in `volume.source` whose numbers become the density ρ.")
            .when("Name the grid of smoke, spray or water; of a level set the inside is even."),
        p("volume.velocity", "", "", Text(""), Volume)
            .doc(
                "Name of the grid of vectors whose directions become v, or of three grids without their \
                 endings such as `_x`, `_y`, `_z`. Without a name one is taken that is called `velocity`, \
                 `vel` or `v`, or `u`, `v` and `w` together; `none` leaves it out. Cells without velocity \
                 have the direction of y.",
            )
            .when("Name it if the file has another name for it."),
        p("volume.velocity_at", "", "", Choice(VelocityAt::WORDS), Volume)
            .doc(
                "Place of the velocity's samples: at the centres of voxels (`centre`), at their lower \
                 corners (`node`), or each component on the lower face across its axis (`staggered`). \
                 `auto` is `staggered` if the file says so, and `centre` otherwise.",
            )
            .when("Choose one if the file does not say it; a wrong one moves the flow by half a voxel."),
        p("volume.velocity_scale", "", "m/s", Float(1e-6, 1e6, 1.0), Volume)
            .slider(0.0, 2.0)
            .doc("Speed that a velocity of 1 in the file stands for.")
            .when(
                "Set it where speed or vorticity choose k and the file is not in m/s. Blender's fluids are \
                 in voxels per 0.4 s: set it to the edge of a voxel / 0.4.",
            ),
        p("volume.level_set_unit", "", "", Choice(LevelSetUnit::WORDS), Volume)
            .doc(
                "Unit of the distances where `volume.grid` is a level set: `metres`, or edges of a voxel \
                 (`voxels`). `auto` finds it by how much they change from voxel to voxel at the surface.",
            )
            .when("Choose `voxels` if water looks like bricks, and `metres` if it looks like fog."),
        p("volume.up", "", "", Choice(Up::WORDS), Volume)
            .doc(
                "Axis of the file in `volume.source` that points up. With `z` the box is turned: the file's \
                 (x, y, z) is (x, z, −y) in the scene. Unless it is set, that of a file of USD is its \
                 upAxis.",
            )
            .when("Choose `z` for files of Blender and of other programs whose z axis points up."),
        p(ORIGIN, "", "m", Point([0.0, 0.0, 0.0]), Volume)
            .doc(
                "Place of the lower corner of the voxel at index (0, 0, 0), in the axes of the file. Without \
                 it, that is where the file puts it.",
            )
            .when("Set it to the lower corner of a Blender domain, which is not in its files."),
        p("volume.voxels", "", "voxels", Int(1, 64, 1), Volume)
            .slider(1.0, 16.0)
            .doc(
                "Voxels along an edge of a cell of a volume with `volume.builder=flow`, before `volume.fine` \
                 cuts the cells. Cells take the shares of the voxels that overlap them, so the amount of \
                 matter stays. The faces of the cells stand at multiples of it, so the cells of every file \
                 of a sequence have the same size and the same places.",
            )
            .when("Raise it to save memory and time."),
        p("volume.fine", "", "", Int(1, 64, 1), Volume)
            .slider(1.0, 8.0)
            .doc(
                "Number of cells into which each cell is cut along each edge: with `volume.voxels=1`, cells \
                 along an edge of a voxel. Without `volume.strands` finer cells show nothing more.",
            )
            .when(
                "Raise it to 2 to 4 for `volume.strands` finer than the voxels; every step costs its cube in \
                 memory. 3 with `volume.voxels=2` makes cells of two thirds of a voxel.",
            ),
        p("volume.strands", "", "", Int(0, 1_000_000, 0), Volume)
            .slider(0.0, 20_000.0)
            .doc(
                "Number of strands along the velocity in a volume with `volume.builder=flow`. Each starts \
                 where there is density and runs both ways until that ends; `curves.h` and \
                 `curves.amplitude` (here of a strand's length) bend it, and `volume.coherence`, \
                 `volume.strand_length` and `volume.coverage` are those of curves. Cells between strands \
                 are empty, and there may be more cells than voxels. 0 shows the density evenly.",
            )
            .when("Set some thousands for threads of water finer than the simulation."),
        p("volume.rho", "", "", Choice(RhoRule::WORDS), Volume)
            .doc(
                "How ρ follows from the density of `volume.grid`: `volume.rho_scale` × density (`linear`), \
                 or 1 − e^(−`volume.rho_scale` × density × edge of a cell) (`opacity`).",
            )
            .when("Choose `opacity` for numbers without an upper end, such as sums of particles."),
        p("volume.rho_scale", "", "", Float(0.0, 1e6, 1.0), Volume)
            .slider(0.0, 10.0)
            .doc(
                "Factor on the density. With `volume.rho=linear`, light falls by \
                 e^(−`trace.sigma` × `volume.rho_scale` × density) in each metre.",
            )
            .when("Raise it for thicker smoke; lower it for a veil."),
        p("volume.reflect", "", "", Choice(ReflectBy::WORDS), Volume)
            .doc(
                "What k_d and k_s follow in a volume with `volume.builder=flow`: nothing (`even`), the \
                 speed, the vorticity, or the grid `volume.reflect_grid`; `stored` takes them from the grids \
                 `kd` and `ks`, as `taki volume build` writes them. The others change from `volume.k_d` \
                 and `volume.k_s` at `volume.reflect_low` to `volume.reflect_k_d` and `volume.reflect_k_s` \
                 at `volume.reflect_high`.",
            )
            .when("Choose `grid` with a grid of foam or age, or `vorticity` for foam where water churns."),
        p("volume.reflect_grid", "", "", Text(""), Volume)
            .doc("Name of the grid that k_d and k_s follow with `volume.reflect=grid`.")
            .when("Name a grid of numbers, such as foam, age or temperature."),
        p("volume.reflect_low", "", "", Float(-1e9, 1e9, 0.0), Volume)
            .slider(0.0, 10.0)
            .doc("Speed (m/s), vorticity (1/s) or number of the grid up to which k is even.")
            .when("Raise it to keep calm parts as they are."),
        p("volume.reflect_high", "", "", Float(-1e9, 1e9, 1.0), Volume)
            .slider(0.0, 10.0)
            .doc("Speed (m/s), vorticity (1/s) or number of the grid from which on k is even again.")
            .when("Set it to what the liveliest parts have."),
        p("volume.reflect_k_d", "", "", Float(0.0, 1.0, 1.0), Volume)
            .doc("Diffuse reflection coefficient at `volume.reflect_high`.")
            .when("Raise it for white foam."),
        p("volume.reflect_k_s", "", "", Float(0.0, 1.0, 0.0), Volume)
            .doc("Specular reflection coefficient at `volume.reflect_high`.")
            .when("Lower it for matt foam."),
    ],
};
