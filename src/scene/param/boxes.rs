//! Boxes that a volume fills once.

use super::Cost::*;
use super::Kind::*;
use super::{Group, p};

/// Place of the middle, if it is not where the volume's file puts it.
pub(super) const POSITION: &str = "boxes.*.position";
/// Lengths of the sides, if they are not those of the volume's file.
pub(super) const SIZE: &str = "boxes.*.size";

pub(super) const BOXES: Group = Group {
    title: "Boxes",
    about: "A box is a body that one volume fills once: smoke, spray, or water measured in a simulation. \
         Rays enter through any of its six faces, and the eye may be inside. A box around a volume with \
         `volumes.*.builder=flow` has the place and the size that its file says.",
    params: &[
        p("boxes.*.volume", "", "", Text("water"), Upload)
            .doc("Name of the volume in the box. Its x, y and z run along the sides of the box.")
            .when("Name a volume of `volumes`."),
        p(POSITION, "", "m", Point([0.0, 0.0, 0.0]), Upload)
            .doc(
                "Place of the middle of the box. Without it, the middle is where the volume's file puts it, \
                 and 0 for other volumes.",
            )
            .when("Give it to move the box from where the simulation was."),
        p("boxes.*.turn", "", "°", Point([0.0, 0.0, 0.0]), Upload)
            .doc(
                "Turn about the x, then the y, then the z axis of the scene, around the middle of the box, \
                 after the turn that the volume's file has.",
            )
            .when("Turn smoke to the wind. For a file whose z axis points up, set `volume.up`."),
        p(SIZE, "", "m", Point([1.0, 1.0, 1.0]), Upload)
            .doc(
                "Lengths of the sides along x, y and z of the volume. Without them, they are those of the \
                 volume's file; the cells of other volumes are cubes, and the longest side is 1 m.",
            )
            .when("Give it to scale the box, or for a volume without a size of its own."),
    ],
};
