//! 20,000 mutations of each kind of file: the reader answers with a whole model or an error.

use std::io::Write;
use std::path::Path;

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use serde_json::json;
use taki::model::Model;

use super::{Doc, Folder, check, floats, read};

/// Memory that a mutated file may take, bytes.
const MEMORY: u64 = 1 << 20;

/// Numbers that break things.
const NUMBERS: [&str; 12] = [
    "0",
    "-1",
    "1",
    "255",
    "65536",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "1e38",
    "1e308",
    "-0.0",
    "nan",
];

fn below(random: &mut Pcg64Mcg, most: usize) -> usize {
    (random.next_u64() % most.max(1) as u64) as usize
}

/// Changes a file in one of five ways.
fn mutate(random: &mut Pcg64Mcg, file: &[u8]) -> Vec<u8> {
    let mut out = file.to_vec();
    let at = below(random, out.len());
    match below(random, 5) {
        0 => (0..1 + below(random, 8)).for_each(|_| {
            let at = below(random, file.len());
            out[at] = random.next_u64() as u8;
        }),
        1 => out.truncate(at),
        2 => {
            let end = (at + 1 + below(random, 40)).min(out.len());
            let part = out[at..end].to_vec();
            match below(random, 2) {
                0 => drop(out.drain(at..end)),
                _ => drop(out.splice(at..at, part)),
            }
        }
        _ => {
            // The first number at or after a place.
            let digit = |byte: &u8| byte.is_ascii_digit();
            let Some(start) = out[at..].iter().position(digit).map(|i| at + i) else { return out };
            let end = out[start..].iter().position(|byte| !digit(byte)).map_or(out.len(), |i| start + i);
            let number = NUMBERS[below(random, NUMBERS.len())];
            out.splice(start..end, number.bytes());
        }
    }
    out
}

/// Bytes that the lists of a model hold.
fn held(model: &Model) -> usize {
    let primitives = model.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let primitives = primitives.map(|p| {
        let normals = p.normals.as_ref().map_or(0, |list| list.capacity() * 12);
        let colors = p.colors.as_ref().map_or(0, |list| list.capacity() * 16);
        let uvs: usize = p.uvs.iter().map(|set| set.capacity() * 8).sum();
        p.positions.capacity() * 12 + p.triangles.capacity() * 12 + normals + colors + uvs
    });
    let instances = model.nodes.iter().map(|node| node.instances.capacity() * 96);
    primitives.sum::<usize>() + instances.sum::<usize>()
}

/// Writes a file in place. Disks are slow to make files empty and fill them again.
fn overwrite(path: &Path, bytes: &[u8]) {
    let mut file = std::fs::OpenOptions::new().write(true).open(path).expect("a file");
    file.write_all(bytes).expect("written");
    file.set_len(bytes.len() as u64).expect("cut");
}

/// Reads 20,000 mutations of one of the files, the others being whole. Returns how many were still models.
fn read_mutations(seed: u64, files: &[(&str, &[u8])], model: &str) -> usize {
    let folder = Folder::new(files);
    let whole = read(&folder.path(model), MEMORY).expect("the whole file is a model");
    check(&whole);
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut models = 0;
    for i in 0..20_000 {
        let (name, bytes) = files[if i % 8 == 7 { files.len() - 1 } else { 0 }];
        overwrite(&folder.path(name), &mutate(&mut random, bytes));
        if let Ok(model) = read(&folder.path(model), MEMORY) {
            check(&model);
            assert!(held(&model) as u64 <= MEMORY, "mutation {i}: {} bytes", held(&model));
            models += 1;
        }
        if files.len() > 1 {
            overwrite(&folder.path(name), bytes);
        }
    }
    models
}

/// A square with all that the reader knows.
fn rich() -> Doc {
    let mut doc = Doc::square();
    let (indices, values) = (doc.view(&[1, 0, 3, 0]), doc.view(&floats(&[2.0, 0.0, 0.0, 3.0, 3.0, 0.0])));
    doc.json["accessors"][0]["sparse"] = json!({
        "count": 2, "indices": {"bufferView": indices, "componentType": 5123},
        "values": {"bufferView": values}
    });
    let colors = doc.add("VEC4", 5121, 4, &[255; 16]);
    let normals = doc.add("VEC3", 5126, 4, &floats(&[0.0, 0.0, 1.0].repeat(4)));
    doc.primitive()["attributes"]["COLOR_0"] = json!(colors);
    doc.primitive()["attributes"]["NORMAL"] = json!(normals);
    let places = doc.add("VEC3", 5126, 3, &floats(&[0.0; 9]));
    let times = doc.add("SCALAR", 5126, 3, &floats(&[0.0, 1.0, 2.0]));
    doc.json["cameras"] = json!([{"perspective": {"yfov": 0.7}}]);
    doc.json["nodes"] = json!([
        {"children": [1, 2], "rotation": [0, 0, 0, 1]},
        {"mesh": 0, "translation": [1, 2, 3],
            "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}},
        {"camera": 0, "scale": [1, 1, 1], "extensions": {"KHR_lights_punctual": {"light": 0}}}
    ]);
    doc.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}});
    doc.json["extensionsRequired"] = json!(["KHR_lights_punctual"]);
    doc.json["images"] = json!([{"bufferView": 0}]);
    doc.json["textures"] = json!([{"source": 0}]);
    doc.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": 0}});
    doc.json["animations"] = json!([{
        "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}],
        "samplers": [{"input": times, "output": places}]
    }]);
    doc
}

#[test]
fn mutated_glb_files_are_read_or_refused() {
    let models = read_mutations(1, &[("m.glb", &rich().glb())], "m.glb");
    assert!((1000..19_000).contains(&models), "{models} models");
}

#[test]
fn mutated_gltf_files_are_read_or_refused() {
    let mut doc = rich();
    doc.json["buffers"][0]["uri"] = json!("m.bin");
    let text = doc.json.to_string();
    let models = read_mutations(2, &[("m.gltf", text.as_bytes()), ("m.bin", &doc.bin)], "m.gltf");
    assert!((1000..19_000).contains(&models), "{models} models");
}

#[test]
fn mutated_obj_files_are_read_or_refused() {
    let obj = "mtllib m.mtl\no Rock\nv 0 0 0 1 1 1\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 0\n\
               vt 0 0\nvt 1 0\nvt 1 1\n\
               vn 0 0 1\nusemtl A\nf 1/1/1 2/2/1 3/3/1 4/1/1\nf 1 2 3 \\\n4 5\nusemtl B\nf -1 -2 -3\nl 1 2\n\
               o Tree\ng part\nf 1/1 2/2 3/3\n";
    let library = "newmtl A\nKd 0.5 0.5 0.5\nNs 100\nmap_Kd -s 2 2 2 m.png\nnewmtl B\nPr 0.5\nd 0.5\n";
    let files = [("m.obj", obj.as_bytes()), ("m.mtl", library.as_bytes())];
    let models = read_mutations(3, &files, "m.obj");
    assert!((1000..19_000).contains(&models), "{models} models");
}
