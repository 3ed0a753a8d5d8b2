//! Files that other programs wrote: `tests/data/model/make.py` makes them again.

use std::path::PathBuf;

use glam::{DVec3, Vec2};
use taki::model::{Face, LightKind, Model, find_name};

use super::{check, read};

fn model(name: &str) -> Model {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/model").join(name);
    let model = read(&path, 1 << 20).expect("a whole file");
    check(&model);
    model
}

fn quads(model: &Model) -> (usize, usize) {
    let primitives = model.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let faces: Vec<Face> = primitives.flat_map(|primitive| primitive.faces()).collect();
    let quads = faces.iter().filter(|face| matches!(face, Face::Quad(_))).count();
    (quads, faces.len() - quads)
}

#[test]
fn a_scene_of_blender_in_gltf_has_all_its_parts() {
    for name in ["blender.glb", "blender.gltf"] {
        let model = model(name);
        let summary = model.summary();
        assert_eq!((summary.triangles, summary.stored_triangles, summary.instances), (68, 44, 4));
        // 16 quads of the cliff and 6 of the plant.
        assert_eq!(quads(&model), (22, 0));
        assert_eq!(model.notes, Vec::<String>::new());
        let [low, high] = summary.bounds.expect("a box");
        assert!(low.distance(DVec3::new(-2.0, -0.1, -2.055_883)) < 1e-5, "{low}");
        assert!(high.distance(DVec3::new(2.1, 4.0, 0.1)) < 1e-5, "{high}");
        let water = summary.materials.iter().find(|material| material.name == "Fall").expect("water");
        assert_eq!(
            (water.triangles, water.uvs.as_slice()),
            (16, &[[Vec2::new(0.25, 0.0), Vec2::new(0.75, 1.0)]][..])
        );
        let stone = find_name("Wet_stone", model.materials.iter().map(|material| material.name.as_str()));
        let stone = &model.materials[stone.expect("a material")];
        assert_eq!((stone.base_color, stone.roughness), ([0.5, 0.25, 0.125, 1.0], 0.5));
        let eye = model.nodes.iter().position(|node| node.camera.is_some()).expect("a camera");
        assert!(model.is_moved(0, eye));
        let ends = model.animations[0].range().expect("keys").map(f64::from);
        let [first, last] = ends.map(|time| model.world_at(0, eye, time).translation);
        assert!(first.distance(DVec3::new(0.0, 2.0, 8.0)) < 1e-5, "{first}");
        assert!(last.distance(DVec3::new(4.0, 2.0, 8.0)) < 1e-5, "{last}");
        // It looks along −Z of the world, which is Blender's +Y.
        let ahead = model.world_at(0, eye, 0.0).transform_vector3(DVec3::NEG_Z);
        assert!(ahead.distance(DVec3::NEG_Z) < 1e-6, "{ahead}");
        let is = |kind: fn(&LightKind) -> bool| model.lights.iter().any(|light| kind(&light.kind));
        assert!(is(|kind| matches!(kind, LightKind::Directional)) && is(|kind| *kind == LightKind::Point));
        assert!(is(|kind| matches!(kind, LightKind::Spot { .. })));
    }
}

#[test]
fn the_same_scene_in_obj_has_the_same_surfaces_and_coordinates() {
    let (obj, gltf) = (model("blender.obj"), model("blender.glb"));
    assert_eq!(quads(&obj), (34, 0));
    let (a, b) = (obj.summary(), gltf.summary());
    assert_eq!(a.triangles, b.triangles);
    for (a, b) in a.bounds.expect("a box").into_iter().zip(b.bounds.expect("a box")) {
        assert!(a.distance(b) < 1e-5, "{a} {b}");
    }
    for material in &b.materials {
        let names = a.materials.iter().map(|material| material.name.as_str());
        let other = &a.materials[find_name(&material.name, names).expect("the same material")];
        assert_eq!((other.triangles, other.uvs.len()), (material.triangles, 1), "{}", material.name);
        for (a, b) in other.uvs[0].iter().zip(material.uvs[0]) {
            assert!(a.distance(b) < 1e-5, "{}: {a} {b}", material.name);
        }
    }
    let stone = obj.materials.iter().find(|material| material.name == "Wet_stone").expect("a material");
    assert_eq!(stone.base_color, [0.5, 0.25, 0.125, 1.0]);
    assert!((stone.roughness - 0.5).abs() < 1e-6, "{}", stone.roughness);
}

#[test]
fn a_scene_of_trimesh_is_read() {
    let model = model("trimesh.glb");
    let summary = model.summary();
    assert_eq!((summary.triangles, summary.instances), (12 + 80, 2));
    assert_eq!(summary.bounds, Some([DVec3::NEG_ONE, DVec3::ONE]));
}
