//! Meshes of other programs in scene files: what their parts become, and every slip. Reference truth.

use std::f64::consts::FRAC_PI_2;
use std::fs;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec2, Vec3};
use serde_json::json;
use taki::light::Light;
use taki::mapping::shell::{Shell, Side, SurfaceMesh};
use taki::scene::{Animation, Limits, Scene, Source};
use taki::util::monitor::Unwatched;
use tempfile::{TempDir, tempdir};

use crate::cli::faults::{run, taki};
use crate::model::{Doc, floats};

/// A folder with a scene and the models of the tests.
pub struct Folder(pub TempDir);

impl Folder {
    pub fn new() -> Folder {
        let folder = Folder(tempdir().unwrap());
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/model");
        for name in ["blender.glb", "blender.obj", "blender.mtl", "trimesh.glb"] {
            fs::copy(data.join(name), folder.path(name)).unwrap();
        }
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).unwrap();
    }

    pub fn load(&self, text: &str, sets: &[&str]) -> taki::Result<Scene> {
        self.load_with(text, sets, &Limits::default())
    }

    pub fn load_with(&self, text: &str, sets: &[&str], limits: &Limits) -> taki::Result<Scene> {
        self.write("s.toml", text);
        let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
        Scene::load(&self.path("s.toml"), &sets, limits)
    }

    pub fn scene(&self, text: &str, sets: &[&str]) -> Scene {
        self.load(text, sets).unwrap_or_else(|e| panic!("{text}\n{sets:?}: {e}"))
    }

    fn fault(&self, text: &str, sets: &[&str], words: &[&str]) {
        let e = self.load(text, sets).expect_err("refused");
        let said = format!("{e:?}");
        assert_eq!(e.exit_code(), if said.starts_with("Memory") { 33 } else { 65 }, "{said}");
        for word in words {
            assert!(said.contains(word), "{said}: no {word:?}");
        }
    }
}

/// A scene without surfaces of its own, before its meshes.
pub const PLACE: &str = "version = 1
base = \"front\"
remove = [\"quads\"]
[volume]
nx = 12
ny = 10
nz = 8
[image]
width = 48
height = 36
samples = 1
";

/// The cliff that Blender exported: 8 quads of rock, 8 of water, and three plants of 6 quads.
const CLIFF: &str = "[materials.fur]
thickness = 0.1
carrier = \"shell\"
[meshes.cliff]
file = \"blender.glb\"
[meshes.cliff.materials]
Fall = \"water\"
";

fn cliff(more: &str) -> String {
    format!("{PLACE}{CLIFF}{more}")
}

/// Numbers of quads, shells and opaque triangles.
fn counts(scene: &Scene) -> [usize; 3] {
    let triangles = scene.triangles.iter().map(|own| own.vertices.len() / 3).sum();
    [scene.quads.len(), scene.shells.len(), triangles]
}

#[test]
fn the_names_of_the_files_materials_choose_what_parts_become() {
    let folder = Folder::new();
    let of = |more: &str| counts(&folder.scene(&cliff(more), &[]));
    assert_eq!(of(""), [8, 0, 16 + 36]);
    assert_eq!(of("\"Wet stone\" = \"none\"\nLeaf = \"none\"\n"), [8, 0, 0]);
    assert_eq!(of("Wet_stone = \"none\"\nLeaf = \"water\"\n"), [8 + 18, 0, 0]);
    // The mesh under a shell is opaque.
    assert_eq!(of("Leaf = \"fur\"\n"), [8, 1, 16 + 36]);
    assert_eq!(counts(&folder.scene(&cliff("Leaf = \"fur\"\n"), &["materials.fur.skin=false"])), [8, 1, 16]);
    let sets = ["meshes.cliff.material=none"];
    assert_eq!(counts(&folder.scene(&cliff(""), &sets)), [8, 0, 0]);
    let sets = ["meshes.cliff.material=fur", "meshes.cliff.materials.Fall=none", "materials.fur.skin=false"];
    assert_eq!(counts(&folder.scene(&cliff(""), &sets)), [0, 1, 0]);
    assert_eq!(counts(&folder.scene(&cliff(""), &["meshes.cliff.show=hidden"])), [0, 0, 0]);
    let holdout = folder.scene(&cliff(""), &["meshes.cliff.show=holdout"]);
    assert!(holdout.triangles.iter().all(|own| own.holdout));
}

#[test]
fn a_printed_scene_with_meshes_is_the_same_scene() {
    let folder = Folder::new();
    let text = cliff(
        "\"Wet stone\" = \"none\"\n[meshes.\"old cliff\"]\nfile = \"blender.obj\"\ncolor = [0.1, 0.2, 0.3]\n",
    );
    let scene = folder.scene(&text, &[]);
    let printed = scene.to_toml();
    assert!(
        printed.contains("[meshes.cliff.materials]\nFall = \"water\"\n\"Wet stone\" = \"none\"\n"),
        "{printed}"
    );
    let again = folder.scene(&printed, &[]);
    assert_eq!(again.to_toml(), printed);
    assert_eq!((&again.quads, counts(&again)), (&scene.quads, counts(&scene)));
    let vertices = |scene: &Scene| scene.triangles.iter().map(|own| own.vertices.clone()).collect::<Vec<_>>();
    assert!(vertices(&again) == vertices(&scene));
    assert!(scene.triangles[1].vertices.iter().all(|v| v.albedo == [0.1, 0.2, 0.3]));
    assert_eq!(scene.triangles[0].vertices[0].albedo, [0.0, 1.0, 0.0], "no colour was asked for");
    let mut references = scene.references().into_iter().map(|(key, _)| key).collect::<Vec<_>>();
    references.sort();
    assert_eq!(references, ["meshes.cliff.file", "meshes.old cliff.file"]);
}

#[test]
fn every_slip_is_told_with_the_way_out() {
    let folder = Folder::new();
    let fault = |more: &str, sets: &[&str], words: &[&str]| folder.fault(&cliff(more), sets, words);
    fault("Leef = \"none\"\n", &[], &["Leef", "did you mean Leaf", "Wet_stone, Fall, Leaf"]);
    fault("Leaf = \"wter\"\n", &[], &["s.toml:", "meshes.cliff.materials.Leaf", "did you mean water"]);
    fault("", &["meshes.cliff.materials.Leaf=wter"], &["no such material", "did you mean water"]);
    fault("", &["meshes.cliff.material=opak"], &["opak", "opaque"]);
    fault("", &["meshes.clif.scale=2"], &["no clif in meshes", "cliff"]);
    fault("[meshes.b]\nposition = [0, 0, 0]\n", &[], &["meshes.b has no file"]);
    fault("[meshes.b]\n", &[], &["meshes.b has no file"]);
    fault("[meshes.b]\nfile = \"../b.glb\"\n", &[], &["meshes.b.file"]);
    fault("[meshes.b]\nfile = \"s.toml\"\n", &[], &["neither glTF nor OBJ"]);
    fault("[meshes.b]\nmodel = \"s.glb\"\n", &[], &["did you mean meshes.b.file"]);
    fault("", &["meshes.cliff.color=[2,0,0]"], &["reflects more light"]);
    fault("", &["meshes.cliff.uv=1"], &["1 sets of texture coordinates", "meshes.cliff.uv to 0 to 0"]);
    fault("", &["quads.0.material=fur"], &["no 0 in quads"]);
    fault(
        "[splashes.a]\nmaterial = \"fur\"\n",
        &[],
        &["a shell lies on a mesh", "materials.fur.carrier=face"],
    );
    let fur = "Leaf = \"fur\"\n";
    fault(fur, &["trace.attenuation=per-cell"], &["mesh cliff, material fur", "path-length"]);
    fault(fur, &["materials.fur.mist=0.5"], &["cannot be mist"]);
    fault(fur, &["materials.fur.thickness_from=color"], &["paint the vertices"]);
    let trimesh = "[meshes.b]\nfile = \"trimesh.glb\"\nmaterial = \"water\"\n";
    fault(trimesh, &[], &["no texture coordinates", "meshes.b.projection", "box, planar, cylinder"]);
    fault("", &["camera.from=clif"], &["no mesh clif", "did you mean cliff"]);
    fault("", &["camera.from=cliff/Camra"], &["no camera Camra", "Camera"]);
    fault("[meshes.b]\nfile = \"trimesh.glb\"\n", &["camera.from=b"], &["no camera", "camera.eye"]);
}

#[test]
fn memory_is_known_before_it_is_taken() {
    let folder = Folder::new();
    let e = folder
        .load_with(&cliff(""), &[], &Limits { memory: 4096, ..Limits::default() })
        .expect_err("too little");
    assert_eq!(e.exit_code(), 33, "{e:?}");
}

#[test]
fn a_file_is_read_once_and_its_surfaces_stay_while_nothing_of_them_changes() {
    let folder = Folder::new();
    let limits = Limits::default();
    let text = cliff("Leaf = \"fur\"\n");
    let load = |sets: &[&str]| folder.load_with(&text, sets, &limits).unwrap();
    let shared = |a: &Scene, b: &Scene| {
        [
            std::sync::Arc::ptr_eq(&a.meshes[0].loaded, &b.meshes[0].loaded),
            std::sync::Arc::ptr_eq(&a.shells[0], &b.shells[0]),
            std::sync::Arc::ptr_eq(&a.triangles[0].vertices, &b.triangles[0].vertices),
        ]
    };
    let first = load(&[]);
    assert_eq!(shared(&first, &load(&["camera.eye=[0,0,9]", "trace.sigma=3"])), [true; 3]);
    assert_eq!(shared(&first, &load(&["meshes.cliff.position=[1,0,0]"])), [true, false, false]);
    assert_eq!(shared(&first, &load(&["materials.fur.thickness=0.2"])), [true, false, false]);
    // An edit of the file is seen.
    folder.write("blender.glb", fs::read(folder.path("trimesh.glb")).unwrap());
    let now = folder.load_with(&format!("{PLACE}[meshes.cliff]\nfile = \"blender.glb\"\n"), &[], &limits);
    assert_eq!(counts(&now.unwrap())[2], 92);
}

#[test]
fn place_turn_and_scale_move_a_mesh_and_its_shells() {
    let folder = Folder::new();
    let text = cliff("Leaf = \"fur\"\n");
    let rest = folder.scene(&text, &[]);
    let sets = ["meshes.cliff.position=[3,4,5]", "meshes.cliff.turn=[0,90,0]", "meshes.cliff.scale=2"];
    let moved = folder.scene(&text, &sets);
    let origin = |scene: &Scene| scene.camera.origin;
    // A turn by 90° about y takes z to x and x to −z.
    let want = |p: Vec3| {
        let p = p.as_dvec3() + origin(&rest);
        DVec3::new(2.0 * p.z + 3.0, 2.0 * p.y + 4.0, -2.0 * p.x + 5.0)
    };
    let near = |a: Vec3, b: DVec3| {
        let a = a.as_dvec3() + origin(&moved);
        assert!(a.distance(b) < 1e-5, "{a} {b}");
    };
    for (a, b) in rest.quads.iter().zip(&moved.quads) {
        a.corners.iter().zip(b.corners).for_each(|(a, b)| near(b, want(*a)));
        assert_eq!(a.material, b.material);
    }
    for (a, b) in rest.triangles[0].vertices.iter().zip(moved.triangles[0].vertices.iter()) {
        near(b.position.into(), want(a.position.into()));
        let n = Vec3::from(a.normal);
        assert!(Vec3::from(b.normal).distance(Vec3::new(n.z, n.y, -n.x)) < 1e-5);
    }
    let inner = |scene: &Scene, i: usize| scene.shells[0].points[2 * i + 1];
    (0..rest.shells[0].vertices()).for_each(|i| near(inner(&moved, i), want(inner(&rest, i))));
    // The thickness is in metres, whatever the scale.
    let height = |scene: &Scene| scene.shells[0].points[0].distance(scene.shells[0].points[1]);
    assert!((height(&moved) - height(&rest)).abs() < 1e-5);
}

#[test]
fn a_mirrored_instance_is_no_surface_turned_inside_out() {
    let folder = Folder::new();
    let mut doc = Doc::square();
    doc.json["nodes"][0]["scale"] = json!([-1.0, 1.0, 1.0]);
    folder.write("a.glb", doc.glb());
    let text = format!(
        "{PLACE}[materials.fur]\ncarrier = \"shell\"\n[meshes.a]\nfile = \"a.glb\"\nmaterial = \"fur\"\n"
    );
    let scene = folder.scene(&text, &[]);
    let shell = &scene.shells[0];
    let up = shell.points[0] - shell.points[1];
    assert!(up.z > 0.39, "{up}");
    assert!(scene.triangles[0].vertices.iter().all(|v| v.normal == [0.0, 0.0, 1.0]));
    let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(scene.triangles[0].vertices[i].position));
    assert!((b - a).cross(c - a).z > 0.0);
}

#[test]
fn a_shell_is_that_of_the_files_mesh() {
    let folder = Folder::new();
    let mut doc = Doc::square();
    let colors =
        doc.add("VEC3", 5126, 4, &floats(&[0.5, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.25, 0.0, 0.0]));
    doc.primitive()["attributes"]["COLOR_0"] = json!(colors);
    folder.write("a.glb", doc.glb());
    let text = format!(
        "{PLACE}[materials.fur]\ncarrier = \"shell\"\nthickness = 0.5\nrepeat_u = 3\nrepeat_v = 2\n\
         [meshes.a]\nfile = \"a.glb\"\nmaterial = \"fur\"\n"
    );
    let surface = |shares: [f32; 4]| SurfaceMesh {
        positions: crate::model::SQUARE.as_chunks::<3>().0.iter().map(|p| Vec3::from(*p)).collect(),
        uv: [[0.0, 2.0], [3.0, 2.0], [0.0, 0.0], [3.0, 0.0]].map(Vec2::from).to_vec(),
        thickness: shares.map(|share| 0.5 * share).to_vec(),
        triangles: vec![[0, 1, 3], [0, 3, 2]],
    };
    // Vertices are numbered in the order of their triangles.
    let points = |shell: &Shell| {
        let mut points: Vec<[u32; 3]> = shell.points.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
        points.sort();
        points
    };
    let made = |sets: &[&str]| folder.scene(&text, sets).shells[0].clone();
    for (sets, shares, side) in [
        (&[][..], [1.0; 4], Side::Outward),
        (&["materials.fur.side=inward"][..], [1.0; 4], Side::Inward),
        (&["materials.fur.thickness_from=color"][..], [0.5, 1.0, 0.0, 0.25], Side::Outward),
    ] {
        let shell = made(sets);
        let want = Shell::new(&surface(shares), side).unwrap();
        assert_eq!(points(&shell), points(&want), "{sets:?}");
        let area = |shell: &Shell| {
            shell.prisms.iter().map(|p| (p.uv[1] - p.uv[0]).perp_dot(p.uv[2] - p.uv[0]).abs()).sum::<f32>()
        };
        assert_eq!(area(&shell), area(&want));
        assert_eq!(shell.skin, side == Side::Outward);
    }
    assert!(!made(&["materials.fur.skin=false"]).skin);
}

#[test]
fn a_projection_has_copies_of_its_size() {
    let folder = Folder::new();
    let text =
        format!("{PLACE}[meshes.a]\nfile = \"trimesh.glb\"\nmaterial = \"water\"\nprojection_size = 0.25\n");
    for kind in ["box", "planar", "cylinder"] {
        let scene =
            folder.scene(&text, &[&format!("meshes.a.projection={kind}"), "materials.water.repeat_u=2"]);
        // Those of the sphere, which are not seen edge-on.
        for quad in scene.quads.iter().filter(|quad| quad.is_triangle()) {
            let metres = quad.map.f.length() / quad.material.repeat_v;
            assert!(metres > 0.2499, "{kind}: {metres}");
            if kind == "box" {
                let size = Vec2::new(quad.map.e.length() / quad.material.repeat_u * 2.0, metres);
                // The slope of a face stretches its copies, by less than √3 along each axis.
                assert!(size.max_element() < 0.25 * 1.74, "{size}");
            }
        }
        assert!(scene.quads.len() > if kind == "planar" { 60 } else { 85 }, "{kind}: {}", scene.quads.len());
    }
}

#[test]
fn cameras_of_a_file_are_those_of_the_scene_and_move() {
    let folder = Folder::new();
    let text = cliff("");
    let sets = ["camera.from=cliff", "meshes.cliff.position=[10,0,0]"];
    let scene = folder.scene(&text, &sets);
    assert!(scene.camera.eye.distance(DVec3::new(10.0, 2.0, 8.0)) < 1e-5, "{}", scene.camera.eye);
    assert!(scene.camera.forward.distance(DVec3::NEG_Z) < 1e-6 && scene.camera.up.distance(DVec3::Y) < 1e-6);
    let by_name = folder.scene(&text, &["camera.from=cliff/Camera"]);
    assert!(by_name.camera.eye.distance(DVec3::new(0.0, 2.0, 8.0)) < 1e-5);
    assert_eq!(by_name.camera.tan_half_fov, scene.camera.tan_half_fov);
    assert!((scene.camera.tan_half_fov - 0.2).abs() < 0.1, "{}", scene.camera.tan_half_fov);
    // Its keys lie at 0 and 4 frames of 24 a second.
    folder.write("s.toml", &text);
    let sets = ["camera.from=cliff", "animate.fps=24", "animate.frames=5"].map(String::from);
    let animation = Animation::load(&folder.path("s.toml"), &sets, &Limits::default()).unwrap();
    let eyes = [0, 4, 9].map(|frame| animation.at(frame).unwrap().camera.eye.x);
    assert!(
        (eyes[0]).abs() < 1e-5 && (eyes[1] - 4.0).abs() < 1e-5 && (eyes[2] - 4.0).abs() < 1e-5,
        "{eyes:?}"
    );
    // The frame's own scene holds the camera in numbers.
    let frame = animation.at(2).unwrap();
    let printed = folder.scene(&frame.to_toml(), &[]);
    assert_eq!(printed.camera, frame.camera);
    let sets = ["camera.from=cliff", "animate.turn=8"].map(String::from);
    let e = Animation::load(&folder.path("s.toml"), &sets, &Limits::default()).expect_err("both move it");
    assert!(e.to_string().contains("both move the camera"), "{e}");
}

#[test]
fn lights_of_a_file_shine_if_asked() {
    let folder = Folder::new();
    let off = folder.scene(&cliff(""), &[]);
    let on = folder.scene(&cliff(""), &["meshes.cliff.lights=true", "meshes.cliff.position=[1,0,0]"]);
    assert_eq!(on.lights.len(), off.lights.len() + 3);
    // Blender's sun of 1 W/m², which it writes as 683 lx.
    let sun = on.lights.iter().skip(off.lights.len()).find_map(|light| match light {
        Light::Directional { to_light, intensity } => Some((*to_light, *intensity)),
        _ => None,
    });
    let (to_light, intensity) = sun.expect("a sun");
    assert!(to_light.distance(Vec3::Y) < 1e-5, "{to_light}");
    assert!((intensity - Vec3::ONE).abs().max_element() < 1e-4, "{intensity}");
    let spot = on.lights.iter().find_map(|light| match light {
        Light::Spot { position, cone, .. } => Some((*position, *cone)),
        _ => None,
    });
    let (position, cone) = spot.expect("a spot");
    assert!(
        (position.as_dvec3() + on.camera.origin).distance(DVec3::new(1.0, 5.0, 0.0)) < 1e-5,
        "{position}"
    );
    assert!((f64::from(cone.cos_edge) - (FRAC_PI_2 / 4.0).cos()).abs() < 1e-5, "{}", cone.cos_edge);
}

#[test]
fn a_scene_of_meshes_alone_is_measured_from_them() {
    let folder = Folder::new();
    let sets =
        ["meshes.cliff.position=[1e6,0,-1e6]", "camera.eye=[1e6,0,-999990]", "camera.target=[1e6,0,-1e6]"];
    let scene = folder.scene(&cliff("Leaf = \"fur\"\n"), &sets);
    assert!(scene.camera.origin.distance(DVec3::new(1e6, 0.0, -1e6)) < 64.0, "{}", scene.camera.origin);
    let near = |p: Vec3| assert!(p.length() < 64.0, "{p}");
    scene.quads.iter().flat_map(|quad| quad.corners).for_each(near);
    scene.shells[0].points.iter().copied().for_each(near);
}

#[test]
fn too_many_faces_are_refused_with_the_way_out() {
    let folder = Folder::new();
    // 257 × 256 squares of a grid.
    let (columns, rows) = (257, 256);
    let mut text = String::new();
    for y in 0..=rows {
        for x in 0..=columns {
            text += &format!("v {x} {y} 0\nvt {x} {y}\n");
        }
    }
    for y in 0..rows {
        for x in 0..columns {
            let at = |dx: usize, dy: usize| (y + dy) * (columns + 1) + x + dx + 1;
            let corners = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
            text += &format!("f {}\n", corners.map(|i| format!("{i}/{i}")).join(" "));
        }
    }
    folder.write("a.obj", text);
    let scene = format!("{PLACE}[materials.fur]\ncarrier = \"shell\"\n[meshes.a]\nfile = \"a.obj\"\n");
    folder.fault(
        &scene,
        &["meshes.a.material=water"],
        &["131584 triangles", "65536", "carrier = \\\"shell\\\""],
    );
    assert_eq!(folder.scene(&scene, &["meshes.a.material=fur"]).shells[0].prisms.len(), 131_584);
}

#[test]
fn what_a_scene_lists_of_its_meshes_is_a_comment_or_json() {
    let folder = Folder::new();
    folder.write("s.toml", cliff(""));
    let said = run(taki(["scene"]).arg(folder.path("s.toml")));
    let text = said.done();
    for line in [
        "blender.glb, 2 nodes with a mesh, 68 triangles",
        "#   node Cliff: 32 triangles",
        "#   material Fall: 16 triangles, water; uv 0: u 0.25 to 0.75, v 0 to 1",
        "#   material Wet stone (key Wet_stone): 16 triangles, opaque",
        "#   camera Camera",
        "#   light Spot",
    ] {
        assert!(text.contains(line), "{text}: no {line:?}");
    }
    folder.write("t.toml", text);
    run(taki(["scene"]).arg(folder.path("t.toml"))).done();
    let json = run(taki(["scene", "--json"]).arg(folder.path("s.toml")));
    let json: serde_json::Value = serde_json::from_str(json.done()).unwrap();
    assert_eq!(json["meshes"]["cliff"]["materials"]["Fall"], json!("water"));
    let mesh = &json["derived"]["meshes"][0];
    assert_eq!((&mesh["name"], &mesh["triangles"]), (&json!("cliff"), &json!(68)));
    let fall = mesh["materials"].as_array().unwrap().iter().find(|m| m["name"] == "Fall").unwrap();
    assert_eq!(fall["becomes"], "water");
    assert_eq!(fall["uvs"][0]["u"], json!([0.25, 0.75]));
}

#[test]
fn a_picture_of_a_mesh_asks_for_its_file_again() {
    let folder = Folder::new();
    folder.write("s.toml", cliff(""));
    let picture = folder.path("a.png");
    run(taki(["render", "--engine", "cpu"]).arg(folder.path("s.toml")).arg("-o").arg(&picture)).done();
    let text = Source::find(&picture).unwrap().text;
    assert!(!text.contains("blender.glb"), "{text}");
    let again = folder.path("b.png");
    run(taki(["render", "--engine", "cpu"]).arg(&picture).arg("-o").arg(&again))
        .refused(65, &["mesh cliff has no file", "meshes.cliff.file"]);
    let set = format!("meshes.cliff.file={}", folder.path("blender.glb").display());
    let mut command = taki(["render", "--engine", "cpu"]);
    run(command.arg(&picture).arg("--set").arg(set).arg("-o").arg(&again)).done();
    assert!(fs::read(&picture).unwrap() == fs::read(&again).unwrap());
}

#[test]
fn values_without_effect_are_told() {
    let folder = Folder::new();
    let scene = folder.scene(&cliff(""), &[]);
    let told = |sets: &[&str], key: &str| {
        let scene = folder.scene(&cliff(""), sets);
        taki::scene::without_effect(scene.values().unwrap(), key)
    };
    assert!(told(&["materials.water.skin=false"], "materials.water.skin").unwrap().contains("shell"));
    assert_eq!(told(&["materials.fur.skin=false"], "materials.fur.skin"), None);
    assert!(told(&["materials.fur.side=inward"], "materials.fur.skin").unwrap().contains("outward"));
    assert!(told(&[], "meshes.cliff.projection_size").unwrap().contains("box"));
    assert!(told(&["camera.from=cliff"], "camera.eye").unwrap().contains("camera.from"));
    let warnings = scene.warnings(&scene.volumes(1 << 30, &Unwatched).unwrap());
    assert!(warnings.iter().any(|w| w.contains("nothing has the material fur")), "{warnings:?}");
}
