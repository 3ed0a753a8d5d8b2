use std::f64::consts::FRAC_PI_2;

use glam::DVec3;
use serde_json::json;
use taki::model::{AlphaMode, CameraLens, Face, ImageSource, LightKind, Primitive, Wrap};

use super::{Doc, Folder, SQUARE, check, floats, shorts};

fn only(doc: &Doc) -> Primitive {
    let model = doc.model();
    check(&model);
    model.meshes[0].primitives[0].clone()
}

#[test]
fn a_glb_a_gltf_with_buffer_and_one_with_a_data_uri_are_the_same() {
    let doc = Doc::square();
    let text = |uri: &str| {
        let mut json = doc.json.clone();
        json["buffers"][0]["uri"] = json!(uri);
        json.to_string().into_bytes()
    };
    let coded = base64(&doc.bin);
    let folder = Folder::new(&[
        ("a.glb", &doc.glb()),
        ("b.gltf", &text("a%20b.bin")),
        ("a b.bin", &doc.bin),
        ("c.gltf", &text(&format!("data:application/octet-stream;base64,{coded}"))),
        ("d.gltf", &text(&format!("DATA:;base64,{}", coded.trim_end_matches('=')))),
    ]);
    let first = folder.model("a.glb");
    assert_eq!(first.meshes[0].primitives[0].triangles, [[0, 1, 3], [0, 3, 2]]);
    assert_eq!(first.meshes[0].primitives[0].positions.as_flattened(), SQUARE);
    assert_eq!(first.materials[0].name, "Wet stone");
    for other in ["b.gltf", "c.gltf", "d.gltf"] {
        assert_eq!(folder.model(other).meshes, first.meshes, "{other}");
    }
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for chunk in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, i| bits << 8 | u32::from(*chunk.get(i).unwrap_or(&0)));
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i) & 63) as usize] as char;
            out.push(if i <= chunk.len() { letter } else { '=' });
        }
    }
    out
}

#[test]
fn strips_fans_and_lists_without_indices_are_triangles_of_one_winding() {
    let square = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    for (mode, positions, expected) in [
        (5, square.to_vec(), vec![[0, 1, 2], [1, 3, 2]]),
        (6, vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0], vec![[1, 2, 0], [2, 3, 0]]),
        (4, square[..9].to_vec(), vec![[0, 1, 2]]),
    ] {
        let mut doc = Doc::square();
        let position = doc.add("VEC3", 5126, positions.len() / 3, &floats(&positions));
        *doc.primitive() = json!({"attributes": {"POSITION": position}, "mode": mode});
        let primitive = only(&doc);
        assert_eq!(primitive.triangles, expected, "mode {mode}");
        for t in &primitive.triangles {
            let [a, b, c] = t.map(|i| glam::Vec3::from(primitive.positions[i as usize]));
            assert!((b - a).cross(c - a).z > 0.0, "mode {mode}: {t:?}");
        }
    }
}

#[test]
fn of_several_sets_of_colours_the_first_is_used_with_a_note() {
    let mut doc = Doc::square();
    for (name, red) in [("COLOR_0", 0.25), ("COLOR_1", 1.0)] {
        let colors = doc.add("VEC3", 5126, 4, &floats(&[red, 0.5, 0.5].repeat(4)));
        doc.primitive()["attributes"][name] = json!(colors);
    }
    assert_eq!(only(&doc).colors.expect("colours")[0][0], 0.25);
    let notes = doc.model().notes;
    assert!(notes.len() == 1 && notes[0].contains("COLOR_0 is used"), "{notes:?}");
}

#[test]
fn points_and_lines_are_left_out_with_a_note() {
    let mut doc = Doc::square();
    let mut points = doc.primitive().clone();
    points["mode"] = json!(1);
    doc.json["meshes"][0]["primitives"].as_array_mut().expect("a list").push(points);
    let model = doc.model();
    assert_eq!(model.meshes[0].primitives.len(), 1);
    assert!(model.notes[0].contains("1 primitives of points or lines"), "{:?}", model.notes);
}

#[test]
fn interleaved_attributes_are_read_by_their_stride() {
    let mut doc = Doc::square();
    let rows: Vec<f32> =
        (0..4).flat_map(|i| [&SQUARE[3 * i..3 * i + 3], &[0.25 * i as f32, 0.5]].concat()).collect();
    let view = doc.view(&floats(&rows));
    doc.json["bufferViews"][view]["byteStride"] = json!(20);
    let part = |kind: &str, offset: usize| {
        let mut accessor = json!({"bufferView": view, "byteOffset": offset, "count": 4, "type": kind});
        accessor["componentType"] = json!(5126);
        accessor
    };
    let position = super::push(&mut doc.json["accessors"], part("VEC3", 0));
    let uv = super::push(&mut doc.json["accessors"], part("VEC2", 12));
    doc.primitive()["attributes"] = json!({"POSITION": position, "TEXCOORD_0": uv});
    let primitive = only(&doc);
    assert_eq!(primitive.positions.as_flattened(), SQUARE);
    assert_eq!(primitive.uvs[0], [[0.0, 0.5], [0.25, 0.5], [0.5, 0.5], [0.75, 0.5]]);
}

#[test]
fn a_sparse_accessor_changes_its_base_and_without_a_base_zeros() {
    let mut doc = Doc::square();
    let (indices, values) = (doc.view(&shorts(&[1, 3])), doc.view(&floats(&[2.0, 0.0, 0.0, 3.0, 3.0, 0.0])));
    let sparse = json!({
        "count": 2, "indices": {"bufferView": indices, "componentType": 5123},
        "values": {"bufferView": values}
    });
    doc.json["accessors"][0]["sparse"] = sparse;
    let with_base = only(&doc);
    assert_eq!(with_base.positions, [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [3.0, 3.0, 0.0]]);
    let accessor = doc.json["accessors"][0].as_object_mut().expect("an object");
    accessor.remove("bufferView");
    let zeros = only(&doc);
    assert_eq!(zeros.positions, [[0.0; 3], [2.0, 0.0, 0.0], [0.0; 3], [3.0, 3.0, 0.0]]);
    assert_eq!(zeros.triangles, [[0, 1, 3]], "the other has lost its area");
}

#[test]
fn quantized_positions_are_integers_or_normalised_ones() {
    for (component, normalized, bytes, expected) in [
        (5122, false, shorts(&[-2_i16 as u16, 300, 7]), [-2.0, 300.0, 7.0]),
        (5122, true, shorts(&[32767, -32768_i16 as u16, 0]), [1.0, -1.0, 0.0]),
        (5123, true, shorts(&[65535, 0, 13107]), [1.0, 0.0, 0.2]),
        (5120, false, vec![-5_i8 as u8, 127, 0], [-5.0, 127.0, 0.0]),
        (5121, true, vec![255, 0, 51], [1.0, 0.0, 0.2]),
    ] {
        let mut doc = Doc::square();
        let row: Vec<u8> = bytes.iter().copied().chain([0; 8]).take(8).collect();
        let view = doc.view(&[row.clone(), vec![0; 24]].concat());
        doc.json["bufferViews"][view]["byteStride"] = json!(8);
        doc.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let accessor = json!({
            "bufferView": view, "componentType": component, "count": 4, "type": "VEC3",
            "normalized": normalized
        });
        let position = super::push(&mut doc.json["accessors"], accessor);
        doc.primitive()["attributes"] = json!({"POSITION": position});
        assert_eq!(only(&doc).positions[0], expected, "{component} {normalized}");
    }
}

#[test]
fn indices_of_every_width_name_the_same_corners() {
    let corners = [0_u8, 1, 3, 0, 3, 2];
    let wide: Vec<u8> = corners.iter().flat_map(|i| u32::from(*i).to_le_bytes()).collect();
    for (component, bytes) in [(5121, corners.to_vec()), (5125, wide)] {
        let mut doc = Doc::square();
        let indices = doc.add("SCALAR", component, 6, &bytes);
        doc.primitive()["indices"] = json!(indices);
        assert_eq!(only(&doc).triangles, [[0, 1, 3], [0, 3, 2]]);
    }
}

#[test]
fn vertices_that_a_primitive_does_not_use_are_not_kept() {
    let mut doc = Doc::square();
    let mut far = SQUARE.to_vec();
    far.splice(0..0, vec![9.0; 3000]);
    let position = doc.add("VEC3", 5126, far.len() / 3, &floats(&far));
    for (corners, used) in [(vec![1000, 1001, 1003, 1000, 1003, 1002], 4), (vec![1000, 1001, 1003], 3)] {
        let indices = doc.add("SCALAR", 5123, corners.len(), &shorts(&corners));
        *doc.primitive() = json!({"attributes": {"POSITION": position}, "indices": indices});
        let primitive = only(&doc);
        assert_eq!(primitive.positions.len(), used);
        assert_eq!(primitive.positions[0], [0.0; 3]);
        assert_eq!(primitive.positions[used - 1], [1.0, 1.0, 0.0]);
    }
}

#[test]
fn triangles_without_area_are_left_out_and_counted() {
    let mut doc = Doc::square();
    let indices = doc.add("SCALAR", 5123, 12, &shorts(&[0, 0, 1, 0, 1, 3, 2, 2, 2, 0, 3, 2]));
    doc.primitive()["indices"] = json!(indices);
    let model = doc.model();
    assert_eq!(model.meshes[0].primitives[0].triangles, [[0, 1, 3], [0, 3, 2]]);
    assert_eq!(model.degenerate, 2);
    assert!(model.notes[0].contains("2 triangles without area"), "{:?}", model.notes);
    assert_eq!(model.summary().degenerate, 2);
}

#[test]
fn colours_normals_and_several_sets_of_coordinates_are_read() {
    let mut doc = Doc::square();
    let colors = doc.add("VEC4", 5121, 4, &[255, 0, 51, 102].repeat(4));
    let normals = doc.add("VEC3", 5126, 4, &floats(&[0.0, 0.0, 2.0].repeat(4)));
    let second = doc.add("VEC2", 5123, 4, &shorts(&[65535, 0].repeat(4)));
    doc.json["accessors"][second]["normalized"] = json!(true);
    let attributes = doc.primitive()["attributes"].as_object_mut().expect("an object");
    attributes.extend([
        ("COLOR_0".into(), json!(colors)),
        ("NORMAL".into(), json!(normals)),
        ("TEXCOORD_1".into(), json!(second)),
    ]);
    let primitive = only(&doc);
    assert_eq!(primitive.colors.expect("colours")[3], [1.0, 0.0, 0.2, 0.4]);
    assert_eq!(primitive.normals.expect("normals")[0], [0.0, 0.0, 1.0]);
    assert_eq!(primitive.uvs.len(), 2);
    assert_eq!(primitive.uvs[1][2], [1.0, 0.0]);
}

#[test]
fn normals_without_a_direction_are_left_out_with_a_note() {
    for value in [0.0, f32::NAN, f32::INFINITY] {
        let mut doc = Doc::square();
        let normals = doc.add("VEC3", 5126, 4, &floats(&[value; 12]));
        doc.primitive()["attributes"]["NORMAL"] = json!(normals);
        let model = doc.model();
        assert_eq!(model.meshes[0].primitives[0].normals, None);
        assert!(model.notes[0].contains("attributes.NORMAL"), "{:?}", model.notes);
    }
}

#[test]
fn a_node_far_away_keeps_its_digits() {
    let mut doc = Doc::square();
    doc.json["nodes"] = json!([
        {"name": "Map", "translation": [4_500_000.125, 0.0, 0.0], "children": [1]},
        {"name": "Rock", "translation": [0.001, 0.0, 0.0], "scale": [2.0, 1.0, 1.0], "mesh": 0}
    ]);
    let model = doc.model();
    check(&model);
    assert_eq!(model.nodes[1].parent, Some(0));
    let right = model.nodes[1].instances[0].transform_point3(DVec3::X);
    assert!((right.x - 4_500_002.126).abs() < 1e-8, "{right}");
    let summary = model.summary();
    assert_eq!(summary.nodes[0].name, "Rock");
    assert_eq!((summary.triangles, summary.instances), (2, 1));
    assert!((summary.bounds.expect("a box")[0].x - 4_500_000.126).abs() < 1e-8);
}

#[test]
fn rotation_and_matrix_are_the_same_transform() {
    let half = (FRAC_PI_2 / 2.0).sin();
    for node in [
        json!({"mesh": 0, "translation": [1, 2, 3], "rotation": [0.0, half, 0.0, half], "scale": [1, 1, 2]}),
        json!({"mesh": 0, "matrix": [0, 0, -1, 0, 0, 1, 0, 0, 2, 0, 0, 0, 1, 2, 3, 1]}),
    ] {
        let mut doc = Doc::square();
        doc.json["nodes"][0] = node;
        let world = doc.model().nodes[0].world;
        assert!(world.transform_point3(DVec3::X).distance(DVec3::new(1.0, 2.0, 2.0)) < 1e-12);
        assert!(world.transform_point3(DVec3::Z).distance(DVec3::new(3.0, 2.0, 3.0)) < 1e-12);
    }
}

#[test]
fn instances_of_a_mesh_stand_at_their_places_in_the_world() {
    let mut doc = Doc::square();
    let places = doc.add("VEC3", 5126, 3, &floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0]));
    let turns = doc.add("VEC4", 5122, 3, &shorts(&[0, 0, 0, 32767].repeat(3)));
    doc.json["accessors"][turns]["normalized"] = json!(true);
    let scales = doc.add("VEC3", 5126, 3, &floats(&[2.0; 9]));
    doc.json["nodes"][0]["translation"] = json!([0, 10, 0]);
    doc.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {
        "TRANSLATION": places, "ROTATION": turns, "SCALE": scales, "_ID": 0
    }}});
    let model = doc.model();
    check(&model);
    let instances = &model.nodes[0].instances;
    assert_eq!(instances.len(), 3);
    assert_eq!(instances[2].transform_point3(DVec3::X), DVec3::new(4.0, 10.0, 0.0));
    let summary = model.summary();
    assert_eq!((summary.triangles, summary.stored_triangles, summary.instances), (6, 2, 3));
    assert_eq!(summary.bounds, Some([DVec3::new(0.0, 10.0, 0.0), DVec3::new(4.0, 12.0, 0.0)]));
}

#[test]
fn nodes_outside_the_scene_are_not_shown() {
    let mut doc = Doc::square();
    doc.json["nodes"] = json!([{"name": "Shown", "mesh": 0}, {"name": "Hidden", "mesh": 0}]);
    let model = doc.model();
    assert_eq!((model.nodes[0].mesh, model.nodes[1].mesh), (Some(0), None));
    assert!(model.notes[0].contains("1 nodes with meshes"), "{:?}", model.notes);
}

#[test]
fn a_material_and_its_textures_are_read() {
    let mut doc = Doc::square();
    let image = doc.view(b"no picture");
    doc.json["images"] = json!([{"bufferView": image, "mimeType": "image/png"}, {"uri": "a.ktx2"}]);
    doc.json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}]);
    doc.json["textures"] = json!([
        {"source": 0, "sampler": 0},
        {"extensions": {"EXT_texture_webp": {"source": 0}}},
        {"extensions": {"KHR_texture_basisu": {"source": 1}}}
    ]);
    doc.json["extensionsRequired"] = json!(["KHR_texture_transform", "KHR_materials_clearcoat"]);
    doc.json["materials"] = json!([
        {"name": "A", "doubleSided": true, "alphaMode": "MASK", "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.25, 0.125, 1], "roughnessFactor": 0.75, "metallicFactor": 0.5,
            "baseColorTexture": {"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform": {
                "offset": [0.25, 0.5], "rotation": FRAC_PI_2, "scale": [2, 4], "texCoord": 1
            }}}
        }, "normalTexture": {"index": 1, "scale": 0.5}},
        {"name": "B", "pbrMetallicRoughness": {"baseColorTexture": {"index": 2}}}
    ]);
    let model = doc.model();
    check(&model);
    let a = &model.materials[0];
    assert_eq!((a.base_color, a.roughness, a.metallic), ([0.5, 0.25, 0.125, 1.0], 0.75, 0.5));
    assert!(a.says_roughness && !model.materials[1].says_roughness);
    assert_eq!((a.double_sided, a.alpha, a.normal_scale), (true, AlphaMode::Mask { cutoff: 0.5 }, 0.5));
    let texture = a.base_color_texture.as_ref().expect("a texture");
    assert_eq!((texture.image, texture.set, texture.nearest), (0, 1, true));
    assert_eq!(texture.wrap, [Wrap::Clamp, Wrap::Mirror]);
    // (0.5, 0.25) scaled is (1, 1); turned by 90° (u' = v, v' = −u) it is (1, −1).
    let [u, v] = texture.transform.apply([0.5, 0.25]);
    assert!((u - 1.25).abs() < 1e-6 && (v + 0.5).abs() < 1e-6, "{u} {v}");
    assert_eq!(a.normal_texture.as_ref().map(|texture| texture.image), Some(0));
    assert!(model.notes.iter().any(|note| note.contains("KHR_materials_clearcoat")), "{:?}", model.notes);
    // What the images are is found only when one is decoded.
    let why = model.images[0].decode(1 << 20).expect_err("no picture").to_string();
    assert!(why.contains("images[0]"), "{why}");
    let why = model.images[1].decode(1 << 20).expect_err("not read").to_string();
    assert!(why.contains("KTX2") && why.contains("images[1]"), "{why}");
}

#[test]
fn an_image_is_decoded_within_its_memory() {
    let mut png = std::io::Cursor::new(Vec::new());
    let picture = image::RgbaImage::from_pixel(40, 30, image::Rgba([1, 2, 3, 255]));
    picture.write_to(&mut png, image::ImageFormat::Png).expect("a picture");
    let mut doc = Doc::square();
    let view = doc.view(png.get_ref());
    doc.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
    let model = doc.model();
    assert!(matches!(model.images[0], ImageSource::Bytes { .. }));
    assert_eq!(model.images[0].decode(1 << 20).expect("a picture").to_rgba8(), picture);
    let error = model.images[0].decode(10_000).expect_err("too little");
    assert_eq!(error.exit_code(), 33, "{error}");
}

#[test]
fn an_image_asks_for_what_its_decoding_takes() {
    // 3 bytes a texel as decoded; 3 in the first coarser level and less than 1 in the next.
    let mut png = std::io::Cursor::new(Vec::new());
    let picture = image::RgbImage::from_pixel(1024, 1024, image::Rgb([1, 2, 3]));
    picture.write_to(&mut png, image::ImageFormat::Png).expect("a picture");
    let bytes = std::sync::Arc::new(png.into_inner());
    let source = ImageSource::Bytes { place: "a.png".into(), bytes };
    assert_eq!(source.decode((7 << 20) + (1 << 17)).expect("a picture").to_rgb8(), picture);
    let error = source.decode(6 << 20).expect_err("too little");
    assert_eq!(error.exit_code(), 33, "{error}");
}

#[test]
fn cameras_and_lights_are_read() {
    let mut doc = Doc::square();
    doc.json["extensionsRequired"] = json!(["KHR_lights_punctual"]);
    doc.json["cameras"] = json!([
        {"name": "P", "type": "perspective", "perspective": {"yfov": 0.7, "aspectRatio": 1.5, "znear": 0.1}},
        {"name": "O", "type": "orthographic", "orthographic": {"xmag": 2, "ymag": 1, "znear": 0, "zfar": 9}}
    ]);
    doc.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "directional", "color": [1, 0.5, 0.25], "intensity": 3},
        {"type": "point", "range": 10},
        {"type": "spot", "name": "S", "spot": {"innerConeAngle": 0.1}}
    ]}});
    doc.json["nodes"] = json!([
        {"name": "Eye", "camera": 0}, {"name": "Lamp", "extensions": {"KHR_lights_punctual": {"light": 2}}}
    ]);
    doc.json["scenes"] = json!([{"nodes": [0, 1]}]);
    let model = doc.model();
    check(&model);
    assert_eq!(model.cameras[0].lens, CameraLens::Perspective { fov_y: 0.7, aspect: Some(1.5) });
    assert_eq!(model.cameras[1].lens, CameraLens::Orthographic { half_width: 2.0, half_height: 1.0 });
    assert_eq!((model.nodes[0].camera, model.nodes[1].light), (Some(0), Some(2)));
    assert_eq!((model.lights[0].color, model.lights[0].intensity), ([1.0, 0.5, 0.25], 3.0));
    assert_eq!((model.lights[1].kind, model.lights[1].range), (LightKind::Point, Some(10.0)));
    let LightKind::Spot { inner, outer } = model.lights[2].kind else { panic!("no spot") };
    assert!(inner == 0.1 && (outer - std::f32::consts::FRAC_PI_4).abs() < 1e-6);
    let summary = model.summary();
    assert_eq!((summary.cameras, summary.lights), (vec!["Eye".into()], vec!["Lamp".into()]));
}

#[test]
fn an_animated_camera_is_sampled_in_every_interpolation() {
    let mut doc = Doc::square();
    doc.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.7}}]);
    doc.json["nodes"] = json!([{"name": "Rig", "children": [1]}, {"name": "Eye", "camera": 0}]);
    let times = doc.add("SCALAR", 5126, 2, &floats(&[1.0, 3.0]));
    let line = doc.add("VEC3", 5126, 2, &floats(&[0.0, 0.0, 0.0, 4.0, 0.0, 0.0]));
    let (s, zero) = (0.5_f32.sqrt(), 0.0);
    let turn = doc.add("VEC4", 5126, 2, &floats(&[zero, zero, zero, 1.0, zero, s, zero, s]));
    // Tangents of 2 at both keys of a spline from 0 to 4 over 2 s: the straight line.
    let spline =
        [[2.0, 0.0, 0.0], [0.0; 3], [2.0, 0.0, 0.0], [2.0, 0.0, 0.0], [4.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    let cubic = doc.add("VEC3", 5126, 6, &floats(spline.as_flattened()));
    let animation = |output: usize, path: &str, node: usize, how: &str| {
        json!({"name": how, "channels": [
            {"sampler": 0, "target": {"node": node, "path": path}},
            {"sampler": 0, "target": {"path": "pointer"}}
        ], "samplers": [{"input": times, "output": output, "interpolation": how}]})
    };
    doc.json["animations"] = json!([
        animation(line, "translation", 1, "LINEAR"),
        animation(line, "translation", 0, "STEP"),
        animation(cubic, "translation", 1, "CUBICSPLINE"),
        animation(turn, "rotation", 0, "LINEAR"),
        animation(line, "scale", 0, "LINEAR")
    ]);
    doc.json["nodes"][1]["translation"] = json!([0, 0, 1]);
    let model = doc.model();
    check(&model);
    let at = |animation: usize, time: f64| model.world_at(animation, 1, time).translation;
    for (time, x) in [(0.0, 0.0), (1.5, 1.0), (2.0, 2.0), (3.0, 4.0), (9.0, 4.0)] {
        assert!(at(0, time).distance(DVec3::new(x, 0.0, 0.0)) < 1e-9, "linear at {time}");
        assert!(at(2, time).distance(DVec3::new(x, 0.0, 0.0)) < 1e-9, "cubic at {time}");
        let held = if time < 3.0 { 0.0 } else { 4.0 };
        assert!(at(1, time).distance(DVec3::new(held, 0.0, 1.0)) < 1e-9, "step at {time}");
    }
    // Half of a quarter turn about +Y leads +Z towards +X.
    assert!(at(3, 2.0).distance(DVec3::new(0.5_f64.sqrt(), 0.0, 0.5_f64.sqrt())) < 1e-6);
    assert_eq!(model.animations[0].range(), Some([1.0, 3.0]));
    assert!(model.is_moved(1, 1) && !model.is_moved(0, 0));
    assert!(model.notes[0].contains("5 channels"), "{:?}", model.notes);
}

#[test]
fn the_quads_of_blender_are_found_again() {
    assert_eq!(only(&Doc::square()).faces(), [Face::Quad([0, 1, 3, 2])]);
}

#[test]
fn skins_and_morphs_are_ignored_with_a_note() {
    let mut doc = Doc::square();
    doc.json["nodes"][0]["skin"] = json!(0);
    doc.json["meshes"][0]["weights"] = json!([0.5]);
    doc.primitive()["targets"] = json!([{"POSITION": 0}]);
    let notes = doc.model().notes.join("\n");
    assert!(notes.contains("skins") && notes.contains("morph"), "{notes}");
}
