//! Splashes where water hits.

use super::Cost::*;
use super::Kind::*;
use super::{Group, p};

pub(super) const SPLASHES: Group = Group {
    title: "Splashes",
    about: "A splash throws up arcs of drops along a line where water hits. The drops leave with a share of \
         the speed of impact and fly parabolas; each arc is a short sheet whose borders are eroded.",
    params: &[
        p("splashes.*.from", "", "m", Point([0.0, 0.0, 0.0]), Uniform)
            .doc("One end of the line where water hits.")
            .when("Put it at the foot of a fall, just above the pool or the ledge that the water meets."),
        p("splashes.*.to", "", "m", Point([0.0, 0.0, 0.0]), Uniform)
            .doc("Other end of the line where water hits. Without it all arcs start at one point.")
            .when("Set it for a broad fall; leave it out for a single jet."),
        p("splashes.*.material", "", "", Text("water"), Uniform)
            .doc(
                "Name of the arcs' material. Its `materials.*.repeat_u` and `materials.*.repeat_v` count \
                 copies of the volume over each arc.",
            )
            .when("Name a thinner material than the fall's when the spray looks too heavy."),
        p("splashes.*.count", "", "", Int(1, 1024, 12), Uniform)
            .slider(1.0, 48.0)
            .doc("Number of arcs.")
            .when("Raise it for a denser splash or a longer line; lower it to save quads."),
        p("splashes.*.segments", "", "", Int(1, 64, 6), Uniform)
            .doc("Number of quads along each arc.")
            .when("Raise it when large arcs look angular; lower it to save quads."),
        p("splashes.*.drop", "h", "m", Float(1e-3, 1e4, 3.0), Uniform)
            .slider(0.1, 20.0)
            .doc("Height of the fall that ends here. Water hits at √(2·g·h).")
            .when("Set it to the real height of the fall; raise it for a stronger splash."),
        p("splashes.*.restitution", "", "", Float(0.01, 1.0, 0.35), Uniform)
            .doc(
                "Speed of the fastest drops as a share of the speed of impact. No drop rises higher than \
                 the square of this share times `splashes.*.drop`.",
            )
            .when("Raise it when drops should fly higher and further; lower it for a flat splash."),
        p("splashes.*.elevation", "", "°", Float(0.0, 90.0, 60.0), Uniform)
            .doc("Mean angle above the horizon at which drops leave.")
            .when("Raise it for a steep crown; lower it for spray that flies outwards."),
        p("splashes.*.spread", "", "°", Float(0.0, 90.0, 18.0), Uniform)
            .doc("Largest difference of an arc's angle from `splashes.*.elevation`.")
            .when("Raise it for an untidy splash; lower it for an even crown."),
        p("splashes.*.toward", "", "", Point([0.0, 0.0, 1.0]), Uniform)
            .doc("Direction of the middle of the fan, along the ground.")
            .when("Turn it away from the wall that the water falls along."),
        p("splashes.*.fan", "", "°", Float(0.0, 180.0, 180.0), Uniform)
            .doc("Angle of the fan on either side of its middle. 180 is a whole crown.")
            .when("Lower it to about 45 in front of a wall; keep 180 for a jet that hits open water."),
        p("splashes.*.width", "", "m", Float(1e-3, 1e4, 0.4), Uniform)
            .slider(0.05, 2.0)
            .doc("Mean width of an arc at its end.")
            .when("Raise it for broad sheets of spray; lower it for thin jets of drops."),
        p("splashes.*.tear", "", "", Float(0.0, 1.0, 0.0), Uniform)
            .doc("Share of the water that is torn into drops where arcs have spread. Their foot stays whole.")
            .when("Raise it to 1 for spray; leave it at 0 for smooth sheets."),
        p("splashes.*.tear_size", "", "m", Float(1e-3, 1e4, 0.03), Uniform)
            .slider(0.005, 0.2)
            .doc("Width of a hole. Holes are twice as long.")
            .when("Set it to the distance between drops."),
        p("splashes.*.seed", "", "", Int(0, i64::MAX, 1), Uniform)
            .doc("Seed of the arcs' randomness.")
            .when("Change it for another arrangement of the arcs."),
    ],
};
