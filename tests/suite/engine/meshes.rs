//! Meshes of other programs on both engines: faces as quads, opaque parts with the file's colours, shells.

use serde_json::json;
use taki::engine::{cpu, overlap};
use taki::output::frame::{Difference, Tolerance};
use taki::picture::Frame;
use taki::scene::Scene;
use taki::util::monitor::Unwatched;

use super::gpu::{assert_parity, both, renderer};
use crate::model::{Doc, SQUARE, floats, shorts};
use crate::scene::meshes::{Folder, PLACE};

fn on_cpu(scene: &Scene) -> Frame {
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    cpu::render(scene, &volumes, &scene.mesh(), true, &Unwatched).expect("a frame")
}

fn difference(a: &Frame, b: &Frame, relative: f32) -> Difference {
    let rgb = |frame: &Frame| frame.radiance.iter().map(|r| [r[0], r[1], r[2]]).collect::<Vec<_>>();
    Difference::new(a.width, &rgb(a), &rgb(b), Tolerance { relative, absolute: 1e-5 })
}

/// The quad of `front` in OBJ, whose v runs up, cut by `faces`.
fn plane(faces: &str) -> String {
    format!(
        "v -0.5 -0.5 0.5\nv 0.5 -0.5 0.5\nv 0.5 0.5 0.5\nv -0.5 0.5 0.5\n\
         vt 0 1\nvt 1 1\nvt 1 0\nvt 0 0\nusemtl Water\n{faces}"
    )
}

/// The scene of that file as faces of `water`.
const MESH: &str = "[meshes.a]\nfile = \"a.obj\"\nmaterial = \"water\"\n";

#[test]
fn a_plane_of_one_face_is_the_quad_of_a_scene_to_the_bit() {
    let folder = Folder::new();
    folder.write("a.obj", plane("f 1/1 2/2 3/3 4/4\n"));
    let own = PLACE.replace("remove = [\"quads\"]\n", "");
    for sets in [
        &["materials.water.repeat_u=1.7", "materials.water.repeat_v=0.6"][..],
        &["light.visibility=cached"],
        &["light.visibility=march", "materials.water.mist=0.4"],
    ] {
        let sets = [sets, &["camera.eye=[1.2,0.7,2.5]"]].concat();
        let (quad, mesh) = (folder.scene(&own, &sets), folder.scene(&format!("{PLACE}{MESH}"), &sets));
        assert_eq!(quad.quads, mesh.quads);
        let [quad, mesh] = [quad, mesh].map(|scene| on_cpu(&scene));
        assert!(quad.radiance == mesh.radiance && quad.counts == mesh.counts, "{sets:?}");
        assert!(quad.counts.iter().map(|c| c[0]).sum::<u32>() > 1000);
    }
}

#[test]
fn a_plane_of_triangles_is_the_quad_but_for_rounding() {
    let folder = Folder::new();
    // The second begins with another corner, so that the two are no pair.
    folder.write("a.obj", plane("f 1/1 2/2 3/3\nf 3/3 4/4 1/1\n"));
    let own = PLACE.replace("remove = [\"quads\"]\n", "");
    let sets = ["camera.eye=[1.2,0.7,2.5]", "materials.water.repeat_u=1.7", "light.visibility=march"];
    let (quad, mesh) = (folder.scene(&own, &sets), folder.scene(&format!("{PLACE}{MESH}"), &sets));
    assert_eq!(mesh.quads.len(), 2);
    assert!(mesh.quads.iter().all(|quad| quad.is_triangle() && quad.map.is_parallelogram()));
    assert_eq!(overlap::sheets(&mesh), 1, "they stand side by side");
    let [quad, mesh] = [quad, mesh].map(|scene| on_cpu(&scene));
    let far = difference(&quad, &mesh, 1e-3);
    // A pixel on the cut may lie in neither or both of what the rasteriser snaps; none does here.
    assert!(far.share_outside() < 2e-3, "{far:?}");
    let other =
        folder.scene(&format!("{PLACE}{MESH}"), &[&sets[..], &["materials.water.repeat_v=1.3"]].concat());
    assert!(
        difference(&quad, &on_cpu(&other), 1e-3).share_outside() > 0.05,
        "another map is another picture"
    );
}

/// A strip that is bent, with oblique, mirrored and curved coordinates, in triangles that are no pairs and in
/// quads.
fn bent(is_split: bool) -> String {
    let (mut text, mut faces) = (String::new(), String::new());
    for i in 0..=6 {
        let angle = i as f32 * 0.35 - 1.0;
        for y in [-0.6f32, 0.0, 0.6] {
            let (x, z) = (angle.sin(), angle.cos() - 0.6);
            text += &format!("v {x} {y} {z}\nvt {} {}\n", 1.0 - i as f32 / 6.0, y * 0.8 + 0.1 * angle + 0.5);
        }
    }
    for i in 0..6 {
        for j in 1..=2 {
            let [a, b, c, d] =
                [i * 3 + j, i * 3 + j + 3, i * 3 + j + 4, i * 3 + j + 1].map(|n| format!("{n}/{n}"));
            faces += &match is_split {
                true => format!("f {a} {b} {c}\nf {c} {d} {a}\n"),
                false => format!("f {a} {b} {c} {d}\n"),
            };
        }
    }
    text + "usemtl Water\n" + &faces
}

#[test]
fn faces_agree_on_both_engines() {
    let Some(mut renderer) = renderer("faces of meshes") else { return };
    let folder = Folder::new();
    for is_split in [false, true] {
        folder.write("a.obj", bent(is_split));
        let rock = "[meshes.rock]\nfile = \"blender.glb\"\nposition = [0, -0.9, -0.5]\nscale = 0.3\n\
                    turn = [10, 20, 30]\n[meshes.rock.materials]\nFall = \"water\"\n";
        let text = format!("{PLACE}{MESH}{rock}");
        for sets in [
            &["light.visibility=march", "camera.eye=[1.5,0.9,3]"][..],
            &["light.visibility=cached", "materials.water.repeat_v=2.5"],
            &["lights.key.kind=point", "lights.key.position=[0.4,0.3,2]", "image.samples=3"],
            &["materials.water.mist=0.5", "light.visibility=march"],
        ] {
            let scene = folder.scene(&text, &[sets, &["materials.water.thickness=0.1"]].concat());
            let frames = both(&mut renderer, &scene);
            assert_parity(&format!("split {is_split}, {sets:?}"), &frames);
            assert!(frames[1].counts.iter().map(|c| c[0]).sum::<u32>() > 1000, "{sets:?}");
        }
    }
}

#[test]
fn opaque_parts_have_the_colours_of_their_material_and_vertices() {
    let folder = Folder::new();
    let mut doc = Doc::square();
    doc.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorFactor": [0.5, 0.8, 1.0, 1.0]});
    let colors = [0.5, 1.0, 0.25, 1.0, 1.0, 1.0, 0.1, 0.2, 0.3, 1.0, 0.0, 0.5];
    let accessor = doc.add("VEC3", 5126, 4, &floats(&colors));
    doc.primitive()["attributes"]["COLOR_0"] = json!(accessor);
    folder.write("a.glb", doc.glb());
    let text = format!("{PLACE}[meshes.a]\nfile = \"a.glb\"\n");
    let scene = folder.scene(&text, &[]);
    for vertex in scene.triangles[0].vertices.iter() {
        let i = SQUARE.as_chunks::<3>().0.iter().position(|p| *p == vertex.position).expect("a corner");
        for c in 0..3 {
            let want = [0.5, 0.8, 1.0][c] * colors[3 * i + c];
            assert!((vertex.albedo[c] - want).abs() < 1e-6, "{i} {c}: {} {want}", vertex.albedo[c]);
        }
    }
    let plain = folder.scene(&text, &["meshes.a.color=[0.2,0.4,0.6]"]);
    assert!(plain.triangles[0].vertices.iter().all(|v| v.albedo == [0.2, 0.4, 0.6]));
    // An opaque white square under light from everywhere has its albedo for radiance.
    let sets = [
        "meshes.a.color=[0.2,0.4,0.6]",
        "light.ambient=[1,1,1]",
        "lights.key.intensity=0",
        "camera.eye=[0.5,0.5,1.5]",
        "camera.target=[0.5,0.5,0]",
    ];
    let frame = on_cpu(&folder.scene(&text, &sets));
    let middle = frame.radiance[frame.radiance.len() / 2 + frame.width as usize / 2];
    assert!((middle[0] - 0.2).abs() < 1e-3 && (middle[2] - 0.6).abs() < 1e-3, "{middle:?}");
}

/// A sphere in glTF without coordinates.
fn ball() -> Vec<u8> {
    let mut doc = Doc::empty();
    let (mut points, mut indices) = (Vec::new(), Vec::new());
    let (columns, rows) = (24u16, 12u16);
    for j in 0..=rows {
        let polar = f32::from(j) / f32::from(rows) * std::f32::consts::PI;
        for i in 0..columns {
            let turn = f32::from(i) / f32::from(columns) * std::f32::consts::TAU;
            points.extend([polar.sin() * turn.sin(), polar.cos(), polar.sin() * turn.cos()]);
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let at = |di: u16, dj: u16| (j + dj) * columns + (i + di) % columns;
            if j > 0 {
                indices.extend([at(0, 0), at(0, 1), at(1, 0)]);
            }
            if j + 1 < rows {
                indices.extend([at(1, 0), at(0, 1), at(1, 1)]);
            }
        }
    }
    let position = doc.add("VEC3", 5126, points.len() / 3, &floats(&points));
    let accessor = doc.add("SCALAR", 5123, indices.len(), &shorts(&indices));
    doc.json["meshes"] =
        json!([{"primitives": [{"attributes": {"POSITION": position}, "indices": accessor}]}]);
    doc.json["nodes"][0]["mesh"] = json!(0);
    doc.glb()
}

/// A coarse sphere in OBJ with the normals of a smooth one, its faces wound one way or the other.
fn smooth_ball(turned: bool) -> String {
    let (columns, rows) = (8, 6);
    let (mut points, mut normals, mut faces) = (String::new(), String::new(), String::new());
    for j in 0..=rows {
        let polar = j as f32 / rows as f32 * std::f32::consts::PI;
        for i in 0..columns {
            let turn = i as f32 / columns as f32 * std::f32::consts::TAU;
            let [x, y, z] = [polar.sin() * turn.sin(), polar.cos(), polar.sin() * turn.cos()];
            points += &format!("v {x} {y} {z}\n");
            normals += &format!("vn {x} {y} {z}\n");
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let at = |di: usize, dj: usize| (j + dj) * columns + (i + di) % columns + 1;
            let [a, b, c, d] = [at(0, 0), at(0, 1), at(1, 1), at(1, 0)].map(|n| format!("{n}//{n}"));
            faces += &if turned { format!("f {d} {c} {b} {a}\n") } else { format!("f {a} {b} {c} {d}\n") };
        }
    }
    points + &normals + &faces
}

#[test]
fn normals_of_a_smooth_mesh_stay_on_their_side_at_its_outline() {
    let mut renderer = renderer("normals at outlines");
    let folder = Folder::new();
    let text = format!("{PLACE}[meshes.ball]\nfile = \"ball.obj\"\nmaterial = \"opaque\"\n");
    let sets = ["camera.eye=[0,0,4]", "camera.target=[0,0,0]", "camera.fov=32", "image.height=48"];
    for turned in [false, true] {
        folder.write("ball.obj", smooth_ball(turned));
        let scene = folder.scene(&text, &sets);
        let frames = match &mut renderer {
            Some(renderer) => both(renderer, &scene).to_vec(),
            None => vec![on_cpu(&scene)],
        };
        for frame in frames {
            let surface = frame.surface.as_ref().expect("layers");
            let (mut covered, mut leaning) = (0, 0);
            for (i, n) in surface.normal.iter().map(|n| glam::Vec3::from(*n)).enumerate() {
                if n == glam::Vec3::ZERO {
                    continue;
                }
                let (x, y) = (i % frame.width as usize, i / frame.width as usize);
                let out = glam::vec2(x as f32 - 23.5, 23.5 - y as f32);
                covered += 1;
                leaning += usize::from(n.z < 0.4);
                assert!((n.length() - 1.0).abs() < 1e-3, "{n}");
                // The middle of the ball is seen from the front; around it, normals lean outwards.
                let outwards = n.truncate().dot(out.normalize_or_zero());
                assert!(out.length() < 12.0 || outwards > 0.3, "turned {turned}, {x} {y}: {n}");
            }
            assert!(covered > 500 && leaning > 20, "{covered} {leaning}");
        }
    }
}

#[test]
fn a_shell_has_a_silhouette_on_both_engines() {
    let folder = Folder::new();
    folder.write("ball.glb", ball());
    let text = format!(
        "{PLACE}[materials.fur]\nthickness = 0.3\ncarrier = \"shell\"\n[meshes.ball]\nfile = \"ball.glb\"\n\
         scale = 0.5\nmaterial = \"fur\"\nprojection = \"box\"\nprojection_size = 0.5\n"
    );
    let sets = [
        "trace.sigma=20",
        "camera.eye=[0,0,4]",
        "camera.fov=40",
        "image.height=48",
        "light.visibility=march",
    ];
    let scene = folder.scene(&text, &sets);
    let frame = on_cpu(&scene);
    // Tangent of the angle to a pixel's middle, and the radii of what is seen there: the opaque ball hides
    // what lies within 0.5, and the fur ends at 0.8.
    let (mut inside, mut fur, mut outside) = ([0; 2], [0; 2], [0; 2]);
    for (i, cells) in frame.counts.iter().enumerate() {
        let [x, y] = [i % 48, i / 48].map(|k| (k as f64 + 0.5) / 24.0 - 1.0);
        let tangent = x.hypot(y) * 20f64.to_radians().tan();
        let closest = 4.0 * tangent / (1.0 + tangent * tangent).sqrt();
        let seen = match closest {
            ..0.47 => &mut inside,
            0.53..0.74 => &mut fur,
            0.82.. => &mut outside,
            _ => continue,
        };
        seen[usize::from(cells[0] > 0)] += 1;
    }
    assert!(inside[0] == 0 && fur[0] == 0 && outside[1] == 0, "{inside:?} {fur:?} {outside:?}");
    assert!(inside[1] > 150 && fur[1] > 150 && outside[0] > 500, "{inside:?} {fur:?} {outside:?}");
    let light = |closest: std::ops::Range<usize>| {
        frame.radiance[24 * 48..][closest].iter().map(|r| r[0]).sum::<f32>()
    };
    assert!(light(20..28) > 0.0);
    let bald = on_cpu(&folder.scene(&text, &[&sets[..], &["materials.fur.skin=false"]].concat()));
    assert!(bald.counts != frame.counts, "without a skin rays walk through the ball");
    let Some(mut renderer) = renderer("shells") else { return };
    // A projection puts corners and edges of the mesh on planes between cells, where rounding decides on
    // which side a ray runs. `engine::shells` compares the engines where it does not.
    let [gpu, cpu] = both(&mut renderer, &scene);
    let differs = |(a, b): (&[f32; 4], &[f32; 4])| (0..4).any(|c| (a[c] - b[c]).abs() > 1e-3 * b[c].max(0.1));
    let count = gpu.radiance.iter().zip(&cpu.radiance).filter(|&pair| differs(pair)).count();
    assert!(count * 200 <= cpu.radiance.len(), "{count}");
}
