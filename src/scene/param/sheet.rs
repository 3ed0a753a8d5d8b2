//! Sheets of falling water.

use super::Cost::*;
use super::Kind::*;
use super::{Group, p};

pub(super) const SHEETS: Group = Group {
    title: "Sheets",
    about: "A sheet is a band of falling water along a profile that runs from above the lip down to the \
         foot. taki cuts it into quads that share their corners, their texture and their erosion. Erosion \
         takes the same amount from every density ρ, so faint strands vanish first and borders run along \
         strands.",
    params: &[
        p("sheets.*.points", "", "m", Series, Uniform)
            .doc(
                "Profile of the sheet: at least two points from over the lip down to the foot, joined by \
                 a smooth curve.",
            )
            .when("Begin it upstream of the lip; add points where the water should keep clear of the rock."),
        p("sheets.*.widths", "", "m", Series, Uniform)
            .doc(
                "Width of the sheet at each of its points, or one width for all. Without any it is 1 m \
                 wide.",
            )
            .when("Let the widths grow downwards when falling water should spread."),
        p("sheets.*.across", "", "", Point([1.0, 0.0, 0.0]), Uniform)
            .doc("Direction of the sheet's rows, across the flow. All rows are parallel to it.")
            .when("Turn it when the fall does not face along the z axis."),
        p("sheets.*.material", "", "", Text("water"), Uniform)
            .doc(
                "Name of the sheet's material. Its `materials.*.repeat_u` and `materials.*.repeat_v` \
                 count copies of the volume over the whole sheet.",
            )
            .when("Name another material for another thickness, for finer strands, or for mist."),
        p("sheets.*.segments", "", "", Int(1, 1024, 16), Uniform)
            .slider(1.0, 64.0)
            .doc("Number of quads along the flow.")
            .when("Raise it when the bend over the lip looks angular; lower it to save quads."),
        p("sheets.*.columns", "", "", Int(1, 256, 1), Uniform)
            .slider(1.0, 32.0)
            .doc("Smallest number of quads across the flow. Eroded sides add further columns.")
            .when("Raise it for mist that fades on all sides, and for round sheets: a tube needs 3 or more."),
        p("sheets.*.round", "", "turns", Float(0.0, 1.0, 0.0), Uniform)
            .doc(
                "Bend of the sheet across the flow, in `sheets.*.columns` pieces: 0 is flat, 0.5 half a \
                 tube, 1 a tube. A tube needs a whole number for `materials.*.repeat_u`.",
            )
            .when("Raise it for jets and spouts; leave it at 0 for falls."),
        p("sheets.*.v0", "v₀", "m/s", Float(0.01, 100.0, 1.0), Uniform)
            .slider(0.05, 5.0)
            .doc("Speed of the water at the first point. From there it falls freely.")
            .when(
                "Lower it for streaks that lengthen strongly from lip to foot; raise it for a fast stream \
                 whose streaks keep their length.",
            ),
        p("sheets.*.stretch", "", "", Float(0.0, 1.0, 1.0), Uniform)
            .doc(
                "Position of the texture along the flow: 0 spreads it evenly, 1 spreads it by the time of \
                 the free fall, so that streaks grow longer and run faster as they fall.",
            )
            .when("Lower it to 0 for mist and for water that slides at an even speed; keep 1 for free fall."),
        p("sheets.*.offset_u", "", "widths", Float(-1e4, 1e4, 0.0), Uniform)
            .slider(0.0, 1.0)
            .doc("Place across the volume at which the sheet begins.")
            .when("Change it when two sheets show the same strands."),
        p("sheets.*.offset_v", "", "lengths", Float(-1e4, 1e4, 0.0), Uniform)
            .slider(0.0, 1.0)
            .doc("Place along the volume's flow at which the sheet begins.")
            .when("Change it when two sheets show the same streaks at the same height."),
        p("sheets.*.edge", "", "", Float(0.0, 1.0, 0.0), Uniform)
            .doc(
                "Share of the half width over which the sides are eroded, so that they end along strands. \
                 0 leaves the sides straight.",
            )
            .when("Raise it when a sheet shows straight borders; 1 suits thin jets and mist."),
        p("sheets.*.breakup", "", "", Float(0.0, 1.0, 0.0), Uniform)
            .doc(
                "Erosion at the foot. Erosion grows with the square of the distance from the head, so the \
                 water breaks up as it falls.",
            )
            .when("Raise it for high falls that dissolve into strands; lower it for short or heavy ones."),
        p("sheets.*.fade", "", "", Float(0.0, 1.0, 0.0), Uniform)
            .doc("Share of the way over which the foot fades to nothing.")
            .when("Raise it when the foot ends in a hard line at a pool or a rock."),
        p("sheets.*.tear", "", "", Float(0.0, 1.0, 0.0), Uniform)
            .doc(
                "Share of the water that is torn into threads and drops. Holes open where the fall has \
                 stretched the sheet thin, by 1/(speed × width), and grow with time; so the lip stays whole. \
                 They fall with the water.",
            )
            .when("Raise it to 0.5 or more for high falls; leave it at 0 for thick and short ones."),
        p("sheets.*.tear_size", "", "m", Float(1e-3, 1e4, 0.1), Uniform)
            .slider(0.01, 1.0)
            .doc("Width of a hole where the sheet has its mean width. Holes are eight times as long.")
            .when("Set it to the distance of the fall's threads; the finest are a quarter of it."),
        p("sheets.*.surge", "", "", Float(0.0, 1.0, 0.0), Uniform)
            .doc(
                "Largest share of the water that a lull between two surges lacks. Surges travel down with \
                 the water and return with the volume, so loops close. They differ from sheet to sheet, by \
                 the sheet's name.",
            )
            .when("Raise it to about 0.5 when a fall is too even to be alive; leave it at 0 for mist."),
        p("sheets.*.surges", "", "", Int(1, 64, 3), Uniform)
            .slider(1.0, 12.0)
            .doc("Number of surges in one copy of the volume along the flow.")
            .when("Raise it for quick, short pulses; keep at least two segments for each surge in view."),
        p("sheets.*.head", "", "", Float(0.0, 1.0, 0.0), Uniform)
            .doc("Share of the way over which the head grows from nothing.")
            .when("Raise it for mist, and for sheets whose beginning is in view."),
    ],
};
