//! Slips and faults around meshes, each with one true message. Reference truth.

use std::fs;

use serde_json::json;
use taki::scene::{Scene, presets, without_effect};
use taki::volume::VolumeTexture;

use super::meshes::{Folder, PLACE};
use crate::cli::faults::{run, taki};
use crate::model::{Doc, SQUARE, floats};

const NO_VOLUMES: &[VolumeTexture] = &[];

fn warnings(scene: &Scene) -> Vec<String> {
    scene.warnings(NO_VOLUMES)
}

/// A scene with the mesh `a`, and more in its table.
fn with_mesh(more: &str) -> String {
    format!("{PLACE}[meshes.a]\nfile = \"a.glb\"\n{more}")
}

/// A folder with a mesh.
fn folder(doc: &Doc) -> Folder {
    let folder = Folder::new();
    folder.write("a.glb", doc.glb());
    folder
}

/// Text of the error of a scene with the mesh `a`.
fn fault(folder: &Folder, more: &str, sets: &[&str]) -> String {
    format!("{:?}", folder.load(&with_mesh(more), sets).expect_err("refused"))
}

/// A square whose materials have these names, one primitive each.
fn named(names: &[&str]) -> Doc {
    let mut doc = Doc::square();
    let primitive = doc.primitive().clone();
    let with = |i: usize| {
        let mut own = primitive.clone();
        own["material"] = json!(i);
        own
    };
    doc.json["meshes"][0]["primitives"] = (0..names.len()).map(with).collect();
    doc.json["materials"] = names.iter().map(|name| json!({"name": name})).collect();
    doc
}

fn words(scene: &Scene) -> Vec<(String, String)> {
    scene.meshes[0].parts().into_iter().map(|part| (part.material, part.becomes)).collect()
}

fn pairs(want: &[(&str, &str)]) -> Vec<(String, String)> {
    want.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect()
}

#[test]
fn parts_without_a_name_are_told_in_words() {
    let mut bare = Doc::square();
    bare.primitive().as_object_mut().expect("a primitive").remove("material");
    for (mut doc, words) in [
        (named(&["", "Leaf"]), "the parts with a material without a name of"),
        (named(&["Leaf"]), "the parts \"Leaf\" of"),
        (bare, "the parts without a material of"),
    ] {
        for primitive in doc.json["meshes"][0]["primitives"].as_array_mut().expect("primitives") {
            primitive["attributes"].as_object_mut().expect("attributes").remove("TEXCOORD_0");
        }
        let said = fault(&folder(&doc), "material = \"water\"\n", &[]);
        assert!(said.contains(&words.replace('"', "\\\"")) && said.contains("no texture"), "{said}");
    }
}

#[test]
fn a_printed_scene_warns_of_nothing_that_the_scene_does_not() {
    let folder = Folder::new();
    for (name, _) in presets() {
        let scene = Scene::preset(name).unwrap();
        let printed = folder.scene(&scene.to_toml(), &[]);
        assert_eq!(warnings(&printed), warnings(&scene), "{name}");
    }
    // Water that is not every scene's is told.
    let printed = Scene::preset("torus").unwrap().to_toml();
    let other = printed.replace("[materials.water]\nthickness = 0.4", "[materials.water]\nthickness = 0.3");
    assert_ne!(other, printed);
    let told = warnings(&folder.scene(&other, &[]));
    assert!(told.iter().any(|w| w.contains("nothing has the material water")), "{told:?}");
}

#[test]
fn a_name_with_dots_wants_quotes() {
    let folder = folder(&named(&["Rock.001", "base"]));
    for more in [
        "[meshes.a.materials]\nRock.001 = \"none\"\n",
        "[meshes.a.materials.Rock]\n001 = \"none\"\n",
        "[meshes.a.materials]\nRock.base = \"none\"\n",
    ] {
        let said = fault(&folder, more, &[]);
        assert!(said.contains("s.toml:1") && said.contains("put a name with dots in quotes"), "{said}");
        assert!(said.contains("or write Rock_"), "{said}");
    }
    let said = fault(&folder, "", &["meshes.a.materials.Rock.001=none"]);
    assert!(said.contains("\\\"Rock.001\\\", or write Rock_001"), "{said}");
    for line in ["\"Rock.001\" = \"none\"\n", "Rock_001 = \"none\"\n"] {
        let scene = folder.scene(&with_mesh(&format!("[meshes.a.materials]\n{line}")), &[]);
        assert_eq!(words(&scene), pairs(&[("Rock.001", "none"), ("base", "opaque")]));
    }
    let scene = folder.scene(&with_mesh(""), &["meshes.a.materials.\"Rock.001\"=none"]);
    assert_eq!(words(&scene)[0].1, "none");
}

#[test]
fn names_with_the_same_underscores_are_told_apart_by_quotes() {
    let folder = folder(&named(&["a b", "a.b", "c d"]));
    let table = |lines: &str| format!("[meshes.a.materials]\n{lines}");
    let of = |lines: &str, sets: &[&str]| folder.scene(&with_mesh(&table(lines)), sets);
    let plain =
        |first: &str, second: &str, third: &str| pairs(&[("a b", first), ("a.b", second), ("c d", third)]);
    assert_eq!(words(&of("\"a b\" = \"none\"\n", &[])), plain("none", "opaque", "opaque"));
    assert_eq!(words(&of("\"a.b\" = \"none\"\n", &[])), plain("opaque", "none", "opaque"));
    let both = of("\"a.b\" = \"none\"\n\"a b\" = \"water\"\n\"c.d\" = \"none\"\n", &[]);
    assert_eq!(words(&both), plain("water", "none", "none"));
    // What is printed is read again, in TOML and in JSON.
    assert_eq!(words(&folder.scene(&both.to_toml(), &[])), words(&both));
    assert_eq!(both.to_json()["meshes"]["a"]["materials"]["a.b"], json!("none"));
    for said in [
        fault(&folder, &table("a_b = \"none\"\n"), &[]),
        fault(&folder, "", &["meshes.a.materials.a_b=none"]),
    ] {
        assert!(said.contains("meshes.a.materials.a_b") && said.contains("several materials"), "{said}");
        assert!(said.contains("put the name in quotes") && said.contains("a.b"), "{said}");
    }
    // A later setting stands in the place of an earlier one, however that was spelt.
    let set = of("\"c d\" = \"none\"\n", &["meshes.a.materials.c_d=water"]);
    assert_eq!(words(&set), plain("opaque", "opaque", "water"));
    let set = of("c_d = \"none\"\n", &["meshes.a.materials.\"c d\"=water"]);
    assert_eq!(words(&set), plain("opaque", "opaque", "water"));
    // The keys that a listing gives are keys of a scene.
    for part in both.meshes[0].parts() {
        let mut values = both.values().unwrap().clone();
        let key = part.key.expect("a name");
        values
            .set(&key, &taki::scene::Raw::Text("opaque".into()), &taki::scene::Place("test".into()))
            .unwrap();
        let limits = taki::scene::Limits::default();
        let scene = Scene::from_values("s", values, Some(folder.0.path()), &limits).unwrap();
        let becomes = words(&scene).into_iter().find(|(name, _)| *name == part.material).unwrap().1;
        assert_eq!(becomes, "opaque", "{key}");
    }
    let text = both.comments();
    for line in ["material a b (key \"a b\"):", "material a.b (key \"a.b\"):", "material c d (key \"c.d\"):"]
    {
        assert!(text.contains(line), "{text}");
    }
}

#[test]
fn a_mesh_in_place_of_a_scene_is_told_with_the_way_to_show_it() {
    let folder = folder(&Doc::square());
    folder.write("b.GLTF", b"{}");
    folder.write("c.obj", b"v 0 0 0\n");
    folder.write("d.toml", Doc::square().glb());
    for name in ["a.glb", "b.GLTF", "c.obj", "d.toml"] {
        for command in ["render", "scene", "batch"] {
            let mut arguments = vec![command];
            arguments.extend(if command == "batch" { ["-o", "p.####.png"].as_slice() } else { &[] });
            let said = run(taki(arguments).arg(name).current_dir(folder.0.path()));
            said.refused(65, &["is a mesh, not a scene", "[meshes.NAME]", "file ="]);
        }
    }
}

#[test]
fn what_lies_too_far_away_is_refused_with_its_node() {
    let far = |change: &dyn Fn(&mut Doc), sets: &[&str]| {
        let mut doc = Doc::square();
        change(&mut doc);
        fault(&folder(&doc), "", sets)
    };
    let told = |said: &str| {
        assert!(said.contains("mesh a") && said.contains("a.glb") && said.contains("node Node"), "{said}");
        assert!(said.contains("meshes.a.scale"), "{said}");
    };
    told(&far(&|doc| doc.json["nodes"][0]["scale"] = json!([1e30, 1e30, 1e30]), &[]));
    told(&far(&|doc| doc.json["nodes"][0]["translation"] = json!([0, 1e39, 0]), &[]));
    told(&far(&|doc| doc.json["nodes"][0]["scale"] = json!([1e200, 1e200, 1e200]), &[]));
    told(&far(&|_| {}, &["meshes.a.scale=1e6", "meshes.a.position=[9.9e6,0,0]"]));
    let vertices = |doc: &mut Doc| {
        let position = doc.add("VEC3", 5126, 4, &floats(&SQUARE.map(|x| 1e30 * x)));
        doc.primitive()["attributes"]["POSITION"] = json!(position);
    };
    told(&far(&vertices, &[]));
    // Products of parents.
    let said = far(
        &|doc| {
            doc.json["nodes"] = json!([
                {"name": "Top", "scale": [1e200, 1e200, 1e200], "children": [1]},
                {"name": "Node", "scale": [1e200, 1e200, 1e200], "mesh": 0}
            ]);
        },
        &[],
    );
    assert!(said.contains("nodes[1]") && said.contains("not finite"), "{said}");
    let here = Folder::new();
    here.write("a.obj", "v 0 0 0\nv 1e39 0 0\nv 0 1 0\nf 1 2 3\n");
    let said =
        format!("{:?}", here.load(&format!("{PLACE}[meshes.a]\nfile = \"a.obj\"\n"), &[]).expect_err("far"));
    assert!(said.contains("line 2") && said.contains("no finite number"), "{said}");
    // What is far in the file may be near in the scene.
    let mut doc = Doc::square();
    doc.json["nodes"][0]["scale"] = json!([1e9, 1e9, 1e9]);
    folder(&doc).scene(&with_mesh("scale = 1e-6\n"), &[]);
}

#[test]
fn a_texture_without_its_coordinates_is_told() {
    let mut doc = named(&["Rock", "Moss"]);
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(2, 2).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let view = doc.view(png.get_ref());
    doc.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
    doc.json["textures"] = json!([{"source": 0}]);
    let with = |set: u32| json!({"baseColorTexture": {"index": 0, "texCoord": set}});
    doc.json["materials"][0]["pbrMetallicRoughness"] = with(7);
    doc.json["materials"][1]["pbrMetallicRoughness"] = with(0);
    let here = folder(&doc);
    let told = |more: &str| warnings(&here.scene(&with_mesh(more), &[]));
    let said = told("");
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(
        said[0].contains("material Rock: its texture uses set 7") && said[0].contains("the mesh has 1"),
        "{said:?}"
    );
    assert_eq!(told("color = [0.1, 0.1, 0.1]\n"), [""; 0]);
    assert_eq!(told("[meshes.a.materials]\nRock = \"none\"\n"), [""; 0]);
    doc.json["meshes"][0]["primitives"][1]["attributes"].as_object_mut().unwrap().remove("TEXCOORD_0");
    let said = warnings(&folder(&doc).scene(&with_mesh(""), &[]));
    assert!(
        said.iter().any(|w| w.contains("material Moss: its texture uses set 0") && w.contains("has 0")),
        "{said:?}"
    );
}

#[test]
fn a_mesh_that_shows_nothing_has_one_true_message() {
    // A base without rock.
    let empty = "version = 1\n[meshes.a]\nfile = \"a.glb\"\n[lights.a]\n";
    let told = |doc: &Doc, more: &str| warnings(&folder(doc).scene(&format!("{empty}{more}"), &[]));
    let mut doc = Doc::square();
    let position = doc.add("VEC3", 5126, 4, &floats(&[1.0; 12]));
    doc.primitive()["attributes"]["POSITION"] = json!(position);
    let said = told(&doc, "");
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("none of its 2 triangles has an area"), "{said:?}");
    for more in ["", "[meshes.a.materials]\n\"Wet stone\" = \"water\"\n"] {
        let mut doc = Doc::square();
        doc.json["nodes"][0]["scale"] = json!([0, 0, 0]);
        let said = told(&doc, more);
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(said[0].contains("the scale of the node Node is 0"), "{said:?}");
    }
    let fur = "[materials.fur]\ncarrier = \"shell\"\n[meshes.a.materials]\n\"Wet stone\" = \"fur\"\n";
    let mut doc = Doc::square();
    doc.json["nodes"][0]["scale"] = json!([0, 1, 0]);
    assert!(told(&doc, fur)[0].contains("is 0"));
    // A mesh that is flattened is still seen.
    doc.json["nodes"][0]["scale"] = json!([1, 1, 0]);
    assert_eq!(told(&doc, ""), [""; 0]);
    let said = told(&Doc::square(), "[meshes.a.materials]\n\"Wet stone\" = \"none\"\n");
    assert_eq!(said, ["the meshes show nothing: all their parts are none"]);
}

#[test]
fn films_and_coordinates_without_effect_are_told() {
    let here = folder(&Doc::square());
    let told = |more: &str, sets: &[&str], key: &str| {
        without_effect(here.scene(&with_mesh(more), sets).values().unwrap(), key)
    };
    let dry = |more: &str, sets: &[&str], key: &str| {
        let why = told(more, sets, key).unwrap_or_default();
        assert!(why.contains("no water that wets"), "{more} {sets:?}: {why}");
    };
    let wet =
        |more: &str, sets: &[&str], key: &str| assert_eq!(told(more, sets, key), None, "{more} {sets:?}");
    let quad = "[[quads]]\ncorners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n";
    let shell = "material = \"fur\"\n[materials.fur]\ncarrier = \"shell\"\n";
    let pool = "[pools.p]\ncorners = [[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0]]\n";
    dry("", &["meshes.a.wet=1"], "meshes.a.wet");
    dry("", &["meshes.a.wet=1"], "meshes.a.wet_reach");
    dry(quad, &["meshes.a.wet=1", "materials.water.mist=0.5"], "meshes.a.wet");
    dry(shell, &["meshes.a.wet=1", "volume.builder=fur"], "meshes.a.wet");
    wet(shell, &["meshes.a.wet=1"], "meshes.a.wet");
    wet(quad, &["meshes.a.wet=1"], "meshes.a.wet_reach");
    wet(pool, &["meshes.a.wet=1"], "meshes.a.wet");
    let why = told(quad, &[], "meshes.a.wet_reach").unwrap();
    assert!(why.contains("meshes.a.wet is 0"), "{why}");
    for key in ["meshes.a.uv", "meshes.a.projection", "meshes.a.projection_size"] {
        let why = told("", &[], key).unwrap_or_default();
        assert!(why.contains("no part of the mesh has a material of the scene"), "{key}: {why}");
    }
    assert_eq!(told("material = \"water\"\n", &[], "meshes.a.uv"), None);
    let set = |more: &str, set: &str| {
        let scene = here.scene(&with_mesh(more), &[set]);
        taki::scene::settings_without_effect(scene.values().unwrap(), &[set.into()], &[])
    };
    assert_eq!(set("", "meshes.a.wet=1").len(), 1);
    assert_eq!(set(quad, "meshes.a.wet=1"), [""; 0]);
}

#[test]
fn an_unknown_material_is_told_in_whole_sentences() {
    let lines = "[meshes.a.materials]\nXyz = \"none\"\n";
    let said = fault(&folder(&named(&["Rock"])), lines, &[]);
    assert!(said.contains("has no material Xyz") && said.contains("\"it has Rock\""), "{said}");
    let said = fault(&folder(&named(&["", ""])), lines, &[]);
    assert!(said.contains("its materials have no names; set meshes.a.material"), "{said}");
}

#[test]
fn an_empty_image_is_called_empty() {
    let mut doc = Doc::square();
    doc.json["images"] = json!([{"uri": "a.png"}]);
    doc.json["textures"] = json!([{"source": 0}]);
    doc.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": 0}});
    let here = folder(&doc);
    fs::write(here.path("a.png"), b"").unwrap();
    let said = fault(&here, "", &[]);
    assert!(said.contains("a.png: the image is empty"), "{said}");
}
