use glam::DVec3;
use taki::model::{Face, ImageSource, Model, Wrap};

use super::{Folder, check};

fn model(text: &str) -> Model {
    let model = Folder::new(&[("a.obj", text.as_bytes())]).model("a.obj");
    check(&model);
    model
}

fn error(text: &str) -> String {
    Folder::new(&[("a.obj", text.as_bytes())]).error("a.obj").to_string()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn quads_stay_quads_and_other_polygons_become_triangles() {
    let text = format!("{SQUARE}v 0.5 2 0\nv 0.6 0.4 0\nf 1 2 3 4\nf 1 2 3 5 4\nf 1 2 3\nf 1 2 3 6\n");
    let primitive = &model(&text).meshes[0].primitives[0];
    let faces = primitive.faces();
    assert_eq!(faces[0], Face::Quad([0, 1, 2, 3]));
    assert!(faces[1..].iter().all(|face| matches!(face, Face::Triangle(_))), "{faces:?}");
    // 2 of the quad, 3 of the pentagon, 1 of the triangle, 2 of the last quad, which is not convex.
    assert_eq!(primitive.triangles.len(), 8);
    let area: f32 = primitive
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| glam::Vec3::from(primitive.positions[i as usize]));
            (b - a).cross(c - a).z / 2.0
        })
        .sum();
    assert!((area - (1.0 + 1.5 + 0.5 + 0.4)).abs() < 1e-6, "{area}");
}

#[test]
fn a_concave_polygon_is_covered_once() {
    // A comb of 3 teeth, in a plane that leans.
    let mut points = vec![[0.0, 0.0]];
    for i in 0..3 {
        let x = f64::from(i);
        points.extend([[x + 0.2, 3.0], [x + 0.8, 3.0], [x + 0.9, 0.5]]);
    }
    points.push([3.0, 0.0]);
    points.reverse();
    let lines = points.iter().map(|[x, y]| format!("v {x} {y} {}\n", 2.0 * x + y));
    let corners: String = (1..=points.len()).map(|i| format!(" {i}")).collect();
    let primitive = &model(&format!("{}f{corners}\n", lines.collect::<String>())).meshes[0].primitives[0];
    let areas = primitive.triangles.iter().map(|t| {
        let [a, b, c] = t.map(|i| glam::Vec3::from(primitive.positions[i as usize]));
        (b - a).cross(c - a).z / 2.0
    });
    let areas: Vec<f32> = areas.collect();
    let turned = points.iter().zip(points.iter().cycle().skip(1));
    let whole: f64 = turned.map(|(a, b)| (a[0] * b[1] - a[1] * b[0]) / 2.0).sum();
    assert!(areas.iter().all(|area| *area > 0.0) || areas.iter().all(|area| *area < 0.0), "{areas:?}");
    assert!((f64::from(areas.iter().sum::<f32>()) - whole).abs() < 1e-5, "{areas:?} {whole}");
    assert_eq!(areas.len(), points.len() - 2);
}

#[test]
fn a_file_of_triangles_has_its_quads_found() {
    let primitive = &model(&format!("{SQUARE}f 1 2 3\nf 1 3 4\n")).meshes[0].primitives[0];
    assert_eq!(primitive.faces(), [Face::Quad([0, 1, 2, 3])]);
    // A file that has quads says which they are.
    let primitive = &model(&format!("{SQUARE}f 1 2 3\nf 1 3 4\nf 1 2 3 4\n")).meshes[0].primitives[0];
    assert_eq!(primitive.faces().len(), 3);
}

#[test]
fn v_runs_down_as_in_gltf() {
    let text = format!("{SQUARE}vt 0 0\nvt 0.25 0.75\nvt 1\nf 1/1 2/2 3/3\n");
    let uvs = &model(&text).meshes[0].primitives[0].uvs;
    assert_eq!(uvs[0], [[0.0, 1.0], [0.25, 0.25], [1.0, 1.0]]);
}

#[test]
fn indices_count_from_the_start_or_the_end_and_lines_go_on() {
    let text = format!("\u{feff}# a comment\r\n{SQUARE}vn 0 0 2\r\nf -4//-1 \\\r\n  -3//1 3//1\r\n");
    let primitive = &model(&text).meshes[0].primitives[0];
    assert_eq!(primitive.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
    assert_eq!(primitive.normals, Some(vec![[0.0, 0.0, 1.0]; 3]));
    assert!(primitive.uvs.is_empty());
}

#[test]
fn objects_are_nodes_and_groups_where_there_is_no_object() {
    let names = |text: &str| -> Vec<String> {
        model(&format!("{SQUARE}{text}")).nodes.iter().map(|node| node.name.clone()).collect()
    };
    assert_eq!(
        names("o Rock\ng part\nf 1 2 3\ng other\nf 1 2 4\no Tree top\nf 1 2 3\n"),
        ["Rock", "Tree top"]
    );
    assert_eq!(names("g a\nf 1 2 3\ng b c\nf 1 2 4\ng d\n"), ["a", "b c"]);
    assert_eq!(names("f 1 2 3\n"), [""]);
}

#[test]
fn materials_keep_their_names_even_without_their_library() {
    let text = format!(
        "mtllib none.mtl\n{SQUARE}usemtl Rock\nf 1 2 3\nusemtl Wet stone\nf 1 3 4\nusemtl Rock\nf 2 3 4\n"
    );
    let model = model(&text);
    let names: Vec<&str> = model.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["Rock", "Wet stone"]);
    let primitives = &model.meshes[0].primitives;
    assert_eq!(primitives.len(), 2);
    assert_eq!((primitives[0].material, primitives[0].triangles.len()), (Some(0), 2));
    assert!(model.notes[0].contains("none.mtl"), "{:?}", model.notes);
}

#[test]
fn a_library_gives_colour_roughness_and_texture() {
    let library = "newmtl A\nKd 0.5 0.25 0.125\nNs 422.5\nd 0.5\nmap_Kd -o 0.25 0.125 0 -s 2 3 1 \
                   -clamp on tex a.png\n\
                   newmtl B\nNs 0\nPr 0.25\nPm 1\nKd 0.5\nmap_Kd ..\\tex a.png\nmap_Bump -bm 1 x.png\n";
    let obj = format!("mtllib sub/a b.mtl\n{SQUARE}usemtl A\nf 1 2 3\nusemtl B\nf 1 3 4\n");
    let folder = Folder::new(&[
        ("a.obj", obj.as_bytes()),
        ("sub/a b.mtl", library.as_bytes()),
        ("sub/tex a.png", b"1"),
        ("tex a.png", b"2"),
    ]);
    let model = folder.model("a.obj");
    check(&model);
    let [a, b] = &model.materials[..] else { panic!("two materials") };
    assert_eq!((a.base_color, a.metallic), ([0.5, 0.25, 0.125, 0.5], 0.0));
    assert!((a.roughness - 0.35).abs() < 1e-6, "{}", a.roughness);
    assert!(a.says_roughness && b.says_roughness);
    assert_eq!((b.base_color, b.roughness, b.metallic), ([0.5, 0.5, 0.5, 1.0], 0.25, 1.0));
    let texture = a.base_color_texture.as_ref().expect("a texture");
    assert_eq!(texture.wrap, [Wrap::Clamp; 2]);
    // The file's (u, v) = (0.5, 0.25) leads to (1.25, 0.875); v is turned before and after.
    assert_eq!(texture.transform.apply([0.5, 0.75]), [1.25, 0.125]);
    let real = |name: &str| ImageSource::File(folder.path(name).canonicalize().expect("a file"));
    assert_eq!(model.images, [real("sub/tex a.png"), real("tex a.png")]);
    assert_eq!(b.base_color_texture.as_ref().map(|texture| texture.image), Some(1));
}

#[test]
fn colours_of_vertices_become_linear() {
    let text = "v 0 0 0 0.7353 0.5371 1\nv 1 0 0 0 0 0\nv 0 1 0 1 1 1\nv 5 5 5\nf 1 2 3\n";
    let colors = model(text).meshes[0].primitives[0].colors.clone().expect("colours");
    let near = |a: f32, b: f32| (a - b).abs() < 1e-3;
    assert!(near(colors[0][0], 0.5) && near(colors[0][1], 0.25) && colors[0][3] == 1.0, "{colors:?}");
}

#[test]
fn a_map_in_metres_keeps_its_digits() {
    let text =
        "v 500000.25 4500000.5 12.125\nv 500001.25 4500000.5 12.125\nv 500000.25 4500001.5 12.625\nf 1 2 3\n";
    let model = model(text);
    let at = |i: usize| {
        let local = glam::Vec3::from(model.meshes[0].primitives[0].positions[i]).as_dvec3();
        model.nodes[0].instances[0].transform_point3(local)
    };
    assert_eq!(at(0), DVec3::new(500_000.25, 4_500_000.5, 12.125));
    assert_eq!(at(2), DVec3::new(500_000.25, 4_500_001.5, 12.625));
    assert!(model.meshes[0].primitives[0].positions[0][0].abs() < 2.0);
}

#[test]
fn what_is_not_a_surface_is_left_out_with_a_note() {
    let model = model(&format!("{SQUARE}l 1 2\np 1\nf 1 2\nf 1 1 2\nf 1 2 3\nsurf 0 1 0 1 1 2\n"));
    let notes = model.notes.join("\n");
    assert!(notes.contains("3 points or lines") && notes.contains("free form"), "{notes}");
    assert_eq!((model.degenerate, model.meshes[0].primitives[0].triangles.len()), (1, 1));
}

#[test]
fn faults_are_named_by_their_line() {
    for (line, words) in [
        ("v 0 0", "line 5: v: 2 numbers, 3 are needed"),
        ("v 0 0 x", "line 5: v: \"x\" is no finite number"),
        ("v 0 0 nan", "line 5: v: \"nan\" is no finite number"),
        ("v 0 0 1e99", "line 5: v: \"1e99\" is no finite number"),
        ("vt", "line 5: vt: 0 numbers"),
        ("vn 1 0", "line 5: vn: 2 numbers"),
        ("f 1 2 5", "line 5: f: index 5, there are 4 lines of v so far"),
        ("f 1 2 0", "line 5: f: index 0"),
        ("f 1 2 -5", "line 5: f: index -5"),
        ("f 1/1 2/1 3/1", "line 5: f: index 1, there are 0 lines of vt so far"),
        ("f 1//1 2//1 3//1", "0 lines of vn so far"),
        ("f 1 2 x", "line 5: f: \"x\" is no index"),
        ("f /1 2 3", "line 5: f"),
        ("f 1/1/1/1 2 3", "line 5: f"),
        ("f 99999999999999999999 2 3", "is no index"),
    ] {
        let error = error(&format!("{SQUARE}{line}\n"));
        assert!(error.contains("a.obj: ") && error.contains(words), "{line}: {error}");
    }
    let obj = format!("mtllib a.mtl\n{SQUARE}f 1 2 3\n");
    for (library, words) in [
        ("newmtl A\nKd 1 x 1", "a.mtl: line 2: Kd: \"x\" is no finite number"),
        ("newmtl A\nNs", "a.mtl: line 2: Ns: a number is missing"),
        ("newmtl A\nmap_Kd -wrong a.png", "a.mtl: line 2: the option -wrong"),
    ] {
        let folder = Folder::new(&[("a.obj", obj.as_bytes()), ("a.mtl", library.as_bytes())]);
        let error = folder.error("a.obj").to_string();
        assert!(error.contains(words), "{library}: {error}");
    }
}

#[test]
fn a_concave_polygon_of_too_many_corners_is_refused() {
    let points = (0..2000).map(|i| {
        let (radius, angle) = (1.0 + f64::from(i % 2), f64::from(i) * std::f64::consts::TAU / 2000.0);
        format!("v {} {} 0\n", radius * angle.cos(), radius * angle.sin())
    });
    let corners: String = (1..=2000).map(|i| format!(" {i}")).collect();
    let error = error(&format!("{}f{corners}\n", points.collect::<String>()));
    assert!(error.contains("line 2001: f: a concave polygon of 2000 corners"), "{error}");
}
