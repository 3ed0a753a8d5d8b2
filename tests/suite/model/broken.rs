//! Files that break their format: each is refused with the place of its fault.

use serde_json::{Value, json};

use super::{Doc, Folder, SQUARE, floats, read, shorts};

/// Changes the square, and returns the error.
fn changed(change: impl FnOnce(&mut Doc)) -> String {
    let mut doc = Doc::square();
    change(&mut doc);
    doc.error()
}

fn set(pointer: &str, value: Value) -> String {
    changed(|doc| match doc.json.pointer_mut(pointer) {
        Some(place) => *place = value,
        None => {
            let (parent, member) = pointer.rsplit_once('/').expect("a path");
            doc.json.pointer_mut(parent).expect("a parent")[member] = value;
        }
    })
}

#[test]
fn every_index_that_leads_nowhere_is_named() {
    for (pointer, place, words) in [
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            "meshes[0].primitives[0].attributes.POSITION",
            "accessors[9]",
        ),
        (
            "/meshes/0/primitives/0/attributes/TEXCOORD_0",
            "meshes[0].primitives[0].attributes.TEXCOORD_0",
            "accessors[9]",
        ),
        ("/meshes/0/primitives/0/indices", "meshes[0].primitives[0].indices", "accessors[9]"),
        ("/meshes/0/primitives/0/material", "meshes[0].primitives[0].material", "materials[9]"),
        ("/accessors/0/bufferView", "meshes[0].primitives[0].attributes.POSITION", "bufferViews[9]"),
        ("/bufferViews/0/buffer", "bufferViews[0]", "buffers[9]"),
        ("/nodes/0/mesh", "nodes[0].mesh", "meshes[9]"),
        ("/nodes/0/camera", "nodes[0].camera", "cameras[9]"),
        ("/scene", "scene", "scenes[9]"),
        ("/scenes/0/nodes/0", "scenes[0].nodes[0]", "nodes[9]"),
    ] {
        let error = set(pointer, json!(9));
        assert!(error.contains(&format!("model.glb: {place}")), "{pointer}: {error}");
        assert!(error.contains(&format!("{words} does not exist")), "{pointer}: {error}");
    }
}

#[test]
fn what_reaches_past_its_end_is_named() {
    for (pointer, value, words) in [
        (
            "/accessors/0/count",
            5,
            "POSITION: accessor 0 reads past the end of bufferView 0: 60 bytes from byte 0, there are 48",
        ),
        ("/accessors/0/byteOffset", 4, "accessor 0 reads past the end of bufferView 0"),
        (
            "/bufferViews/0/byteLength",
            4000,
            "bufferViews[0]: 4000 bytes from byte 0 reach past the end of buffers[0]",
        ),
        ("/buffers/0/byteLength", 4000, "buffers[0]: it should have 4000 bytes"),
        ("/bufferViews/0/byteStride", 8, "elements of 12 bytes, bufferView 0 a stride of 8"),
    ] {
        let error = set(pointer, json!(value));
        assert!(error.contains(words), "{error}");
    }
    for (pointer, value) in [("/accessors/0/byteOffset", u64::MAX), ("/bufferViews/0/byteOffset", u64::MAX)] {
        let error = set(pointer, json!(value));
        assert!(error.contains("past the end"), "{error}");
    }
}

#[test]
fn values_of_a_wrong_kind_are_named() {
    for (pointer, value, words) in [
        ("/accessors/0/componentType", json!(7), "accessor 0 has the unknown componentType 7"),
        ("/accessors/0/componentType", json!("x"), "accessors[0].componentType"),
        ("/accessors/0/count", json!(-1), "accessors[0].count"),
        ("/accessors/0/type", json!("MAT4"), "the type MAT4"),
        ("/accessors/0/type", json!("VEC2"), "accessor 0 has 2 components, [3] are needed"),
        ("/accessors/1/count", json!(3), "accessor 1 has 3 elements, POSITION 4"),
        ("/accessors/2/componentType", json!(5122), "accessor 2 has no unsigned integers"),
        ("/meshes/0/primitives/0/mode", json!(9), "primitives[0].mode: 9 is no mode"),
        ("/accessors/2/count", json!(5), "5 corners are no whole triangles"),
        ("/nodes/0/rotation", json!([0, 0, 0, 0]), "nodes[0].rotation"),
        ("/nodes/0/matrix", json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]), "nodes[0].matrix"),
        ("/nodes/0/scale", json!([1, 2]), "nodes[0].scale"),
        ("/nodes/0/children", json!([0]), "nodes[0]: it is its own ancestor"),
        ("/materials/0/alphaMode", json!("SOME"), "materials[0].alphaMode: SOME"),
        ("/materials/0/pbrMetallicRoughness", json!({"baseColorFactor": [-1, 0, 0, 1]}), "materials[0]"),
        ("/asset/version", json!("1.0"), "it is glTF 1.0; export the model as glTF 2.0"),
        ("/cameras", json!([{"type": "perspective"}]), "cameras[0]"),
        ("/cameras", json!([{"perspective": {"yfov": 4}}]), "cameras[0].perspective: yfov = 4"),
        (
            "/extensions",
            json!({"KHR_lights_punctual": {"lights": [{"type": "area"}]}}),
            "lights[0].type: area",
        ),
    ] {
        let error = set(pointer, value);
        assert!(error.contains(words), "{pointer}: {error}");
    }
    let error =
        changed(|doc| drop(doc.json["meshes"][0].as_object_mut().expect("a mesh").remove("primitives")));
    assert!(error.contains("meshes[0]") && error.contains("primitives"), "{error}");
    let error =
        changed(|doc| doc.json["nodes"] = json!([{"children": [1]}, {"children": [2]}, {"children": [1]}]));
    assert!(error.contains("nodes[1] is already in nodes[0]"), "{error}");
}

#[test]
fn corners_beyond_the_vertices_and_positions_that_are_not_finite_are_refused() {
    let error = changed(|doc| {
        let indices = doc.add("SCALAR", 5123, 3, &shorts(&[0, 1, 4]));
        doc.primitive()["indices"] = json!(indices);
    });
    assert!(error.contains("indices: index 2 is 4, there are 4 vertices"), "{error}");
    for bad in [f32::NAN, f32::INFINITY] {
        let error = changed(|doc| {
            let mut positions = SQUARE;
            positions[7] = bad;
            let position = doc.add("VEC3", 5126, 4, &floats(&positions));
            doc.primitive()["attributes"]["POSITION"] = json!(position);
        });
        assert!(error.contains("attributes.POSITION: vertex 2 is not finite"), "{error}");
    }
}

#[test]
fn sparse_indices_must_rise_and_stay_within_the_accessor() {
    for indices in [[3_u16, 1], [1, 1], [1, 4]] {
        let error = changed(|doc| {
            let (indices, values) = (doc.view(&shorts(&indices)), doc.view(&floats(&[0.0; 6])));
            doc.json["accessors"][0]["sparse"] = json!({"count": 2,
                "indices": {"bufferView": indices, "componentType": 5123}, "values": {"bufferView": values}});
        });
        assert!(error.contains("accessor 0, sparse: the indices do not rise"), "{error}");
    }
}

#[test]
fn animations_that_cannot_be_sampled_are_refused() {
    for (times, values, words) in [
        (vec![0.0, 0.0], 2, "the times do not rise"),
        (vec![0.0, f32::NAN], 2, "the times do not rise"),
        (vec![0.0, 1.0], 1, "1 values of 2 keys"),
        (vec![], 0, "0 values of 0 keys"),
    ] {
        let error = changed(|doc| {
            let input = doc.add("SCALAR", 5126, times.len(), &floats(&times));
            let output = doc.add("VEC3", 5126, values, &floats(&vec![0.0; 3 * values]));
            doc.json["animations"] = json!([{
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                "samplers": [{"input": input, "output": output}]
            }]);
        });
        assert!(error.contains("animations[0].channels[0]") && error.contains(words), "{error}");
    }
}

#[test]
fn a_broken_container_is_named_by_its_byte() {
    let whole = Doc::square().glb();
    let folder = Folder::new(&[]);
    let error = |bytes: &[u8]| {
        folder.write("a.glb", bytes);
        folder.error("a.glb").to_string()
    };
    for length in 0..whole.len() {
        let text = error(&whole[..length]);
        assert!(text.contains("a.glb"), "{length}: {text}");
    }
    let with = |at: usize, value: u32| {
        let mut bytes = whole.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        error(&bytes)
    };
    assert!(with(4, 1).contains("byte 4: it is a container of version 1"));
    assert!(with(8, 1 << 30).contains("byte 8: the file should have 1073741824 bytes"));
    assert!(with(12, u32::MAX).contains("byte 12: a chunk of 4294967295 bytes reaches past the end"));
    assert!(with(16, 7).contains("there is no chunk of JSON"));
    assert!(error(b"{\"asset\": {\"version\": \"2.0\"}} x").contains("the document"));
    assert!(error(b"").contains("the document"));
}

#[test]
fn compressed_geometry_is_refused_with_the_way_out() {
    for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let error = changed(|doc| doc.json["extensionsRequired"] = json!([name]));
        assert!(error.contains(&format!("compressed with {name}")), "{error}");
        assert!(error.contains("npx @gltf-transform/cli copy in.glb out.glb"), "{error}");
    }
    // The same where the file does not say that the extension is required.
    let error = changed(|doc| {
        doc.primitive()["extensions"] = json!({"KHR_draco_mesh_compression": {"bufferView": 0}});
        doc.json["accessors"][0].as_object_mut().expect("an object").remove("bufferView");
    });
    assert!(error.contains("meshes[0].primitives[0]: the geometry is compressed with KHR_draco"), "{error}");
    let error = changed(|doc| {
        let buffer = super::push(&mut doc.json["buffers"], json!({"byteLength": 48}));
        let view = json!({"buffer": buffer, "byteLength": 48, "extensions": {"EXT_meshopt_compression": {}}});
        doc.json["bufferViews"][0] = view;
    });
    assert!(error.contains("bufferViews[0]: the geometry is compressed with EXT_meshopt"), "{error}");
}

#[test]
fn an_unknown_extension_that_the_file_needs_is_refused_by_its_name() {
    let error = changed(|doc| doc.json["extensionsRequired"] = json!(["ACME_curved_triangles"]));
    assert!(error.contains("needs the extension ACME_curved_triangles"), "{error}");
    let mut doc = Doc::square();
    doc.json["extensionsUsed"] = json!(["ACME_curved_triangles"]);
    assert_eq!(doc.model().notes, Vec::<String>::new());
}

#[test]
fn memory_is_counted_before_it_is_taken() {
    // A file of 700 bytes that asks for 12 GiB of zeros.
    let mut doc = Doc::empty();
    doc.json["accessors"] = json!([{"componentType": 5126, "count": 1_000_000_000, "type": "VEC3"}]);
    doc.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": 0}}]}]);
    let error = doc.read().expect_err("too much");
    assert_eq!(error.exit_code(), 33, "{error}");
    assert!(error.to_string().contains("meshes[0].primitives[0] needs"), "{error}");
    assert!(error.to_string().contains("--memory"), "{error}");
    // Instances of nothing.
    let mut doc = Doc::square();
    let places = json!({"componentType": 5126, "count": 1_000_000_000, "type": "VEC3"});
    let places = super::push(&mut doc.json["accessors"], places);
    doc.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    let error = doc.read().expect_err("too much");
    assert!(error.to_string().contains("1000000000 instances"), "{error}");
    // A document of empty nodes, each 3 bytes of text and some hundred in memory.
    let text = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}{{}}]}}", "{},".repeat(400_000));
    let folder = Folder::new(&[("a.gltf", text.as_bytes())]);
    let error = folder.error("a.gltf");
    assert!(error.to_string().contains("the document of"), "{error}");
    // A file that is larger than the budget, by its size alone.
    let error = read(&folder.path("a.gltf"), 1000).expect_err("too large");
    assert!(error.to_string().contains("the file"), "{error}");
    let corners = "f 1 1 1 1 1 1 1 1\n".repeat(100_000);
    let folder = Folder::new(&[("a.obj", format!("v 0 0 0\n{corners}").as_bytes())]);
    let error = folder.error("a.obj");
    assert!(error.exit_code() == 33 && error.to_string().contains("the geometry of"), "{error}");
}

#[test]
fn what_is_no_model_is_refused_with_a_hint() {
    let folder = Folder::new(&[("a.stl", b"solid"), ("b.obj", b"<html></html>"), ("c.txt", b"hello")]);
    for (name, words) in
        [("a.stl", "neither glTF nor OBJ"), ("b.obj", "no vertex"), ("c.txt", ".glb, .gltf or .obj")]
    {
        let error = folder.error(name);
        assert!(error.exit_code() == 65 && error.to_string().contains(words), "{error}");
    }
    assert!(folder.error("none.glb").to_string().contains("there is no file"));
    assert!(folder.error(".").to_string().contains("not a regular file"));
}
