//! Meshes of other programs.

use super::Cost::*;
use super::Kind::*;
use super::{Group, p};
use crate::place::Show;
use crate::scene::meshes::Projection;

/// Key of the albedo that replaces that of the file.
pub(super) const COLOR: &str = "meshes.*.color";
/// Key of what one of the file's materials becomes.
pub(in crate::scene) const MATERIAL: &str = "meshes.*.materials.*";

pub(super) const MESHES: Group = Group {
    title: "Meshes",
    about: "A mesh is a file of another program: glTF 2.0 or OBJ. The names of the file's \
         materials choose what its parts become: opaque, nothing, or surfaces that carry the volume of one \
         of the scene's `materials`.",
    params: &[
        p("meshes.*.file", "", "", Text(""), Upload)
            .doc(
                "Path of the file. Like all paths of a scene, it and the files that it names lie in the \
                 folder of the scene.",
            )
            .when("Set it to what you exported; a .glb holds everything in one file."),
        p("meshes.*.position", "", "m", Point([0.0, 0.0, 0.0]), Upload)
            .doc("Place of the file's origin in the scene.")
            .when("Move it to put the mesh where the water is."),
        p("meshes.*.turn", "", "°", Point([0.0, 0.0, 0.0]), Upload)
            .doc("Turn about the x, then the y, then the z axis of the scene.")
            .when("Set [0, 90, 0] to turn the mesh by a quarter about the upright axis."),
        p("meshes.*.scale", "", "", Float(1e-6, 1e6, 1.0), Upload)
            .slider(0.01, 100.0)
            .doc("Factor on the size of the mesh.")
            .when("Set it to 0.01 for a file in centimetres."),
        p("meshes.*.material", "", "", Text("opaque"), Upload)
            .doc(
                "What becomes of parts whose material no key `meshes.*.materials.*` names: `opaque`, `none`, \
                 or the name of one of the scene's materials.",
            )
            .when("Name a material to put its volume on everything else; choose `none` to leave it out."),
        p(MATERIAL, "", "", Text("opaque"), Upload)
            .doc(
                "What becomes of the parts with this material of the file. The key is the material's name; \
                 underscores stand for its blanks and dots.",
            )
            .when("Name the part that water or fur belongs on. `taki scene` lists the names."),
        p("meshes.*.show", "", "", Choice(Show::WORDS), Upload)
            .doc(
                "What the picture shows of the opaque parts, as `rocks.*.show`. `hidden` leaves the whole \
                 mesh out.",
            )
            .when("Choose `holdout` for a stand-in of what a photograph shows."),
        p("meshes.*.uv", "", "", Int(0, 15, 0), Upload)
            .doc("Number of the set of texture coordinates that places the volume.")
            .when("Set it to 1 when the first set of the file is for textures or light maps."),
        p("meshes.*.projection", "", "", Choice(Projection::WORDS), Upload)
            .doc(
                "Texture coordinates in place of the file's: none; by the axis that a triangle faces most \
                 (`box`), along z (`planar`), or around the y axis (`cylinder`), all of the mesh's own axes.",
            )
            .when("Choose one for a mesh without texture coordinates; flowing water looks better with them."),
        p("meshes.*.projection_size", "", "m", Float(1e-3, 1e4, 1.0), Upload)
            .slider(0.05, 10.0)
            .doc("Width and height of a copy of the volume in a projection.")
            .when("Raise it for coarser matter; lower it for finer."),
        p(COLOR, "", "", Color([0.5, 0.5, 0.5]), Upload)
            .doc(
                "Albedo of all opaque parts in place of the file's colours, textures and roughness, linear \
                 RGB.",
            )
            .when("Give one to a mesh without colours, or to look at its shape alone."),
        p("meshes.*.wet", "", "", Float(0.0, 1.0, 0.0), Upload)
            .doc(
                "Strength of the film of water on the opaque parts near quads that are not mist and near \
                 shells of water, below them, and at pools.",
            )
            .when("Raise it to 1 for rock that water runs over or splashes; leave it at 0 for dry things."),
        p("meshes.*.wet_reach", "", "m", Float(1e-3, 1e4, 1.0), Upload)
            .slider(0.05, 5.0)
            .doc(
                "Distance from falling water at which the opaque parts are dry. Below the water it is four \
                 times as far.",
            )
            .when("Raise it for a broad wet margin; lower it in small scenes."),
        p("meshes.*.occlusion", "", "", Float(0.0, 1.0, 1.0), Upload)
            .doc(
                "Share of the surroundings' light that the opaque parts lose where meshes or rocks hide \
                 them. Only meshes and rocks with a value above 0 hide them.",
            )
            .when("Lower it when corners are too dark; set 0 while you move a large mesh, to see it sooner."),
        p("meshes.*.shadow", "", "", Float(0.0, 1.0, 1.0), Upload)
            .doc(
                "Share of the light of the brightest directional light, the sky's sun included, that the \
                 opaque parts lose in the shadow of meshes and rocks. Only those with a value above 0 cast \
                 it.",
            )
            .when("Lower it when shadows are too hard; set 0 for a backdrop that should cast none."),
        p("meshes.*.lights", "", "", Switch(false), Uniform)
            .doc(
                "Whether the lights of the file (KHR_lights_punctual) shine. 683 lx or cd become an \
                 intensity of 1, so that watts of Blender keep their numbers.",
            )
            .when("Turn it on to take the light of the other program over."),
    ],
};
