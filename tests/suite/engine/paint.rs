//! Textures, roughness and relief of opaque parts on both engines, pixel by pixel against float64.

use std::f64::consts::PI;
use std::io::Cursor;

use glam::{DMat2, DVec2, DVec3, Vec3};
use image::{ImageFormat, Rgb, RgbImage};
use serde_json::{Value, json};
use taki::engine::cpu;
use taki::model::Wrap;
use taki::picture::{Camera, Frame};
use taki::place::{MeshShade, Vertex, wet_albedo};
use taki::scene::Scene;
use taki::util::monitor::Unwatched;

use super::gpu::{assert_parity, both, renderer};
use crate::model::{Doc, floats};
use crate::place::paint::{bilinear, linear, noise};
use crate::scene::meshes::{Folder, PLACE};

const SCENE: &str = "[meshes.a]\nfile = \"a.glb\"\n";

/// A scene that sees the square face-on, in light from everywhere alone.
const FACE_ON: [&str; 7] = [
    "light.ambient=[1,1,1]",
    "lights.key.intensity=0",
    "camera.eye=[0.5,0.5,1.5]",
    "camera.target=[0.5,0.5,0]",
    "camera.fov=30",
    "image.width=64",
    "image.height=64",
];

fn png(image: &RgbImage) -> Vec<u8> {
    let mut png = Vec::new();
    image.write_to(&mut Cursor::new(&mut png), ImageFormat::Png).unwrap();
    png
}

/// Adds images with one sampler, and a texture for each.
fn add_textures(doc: &mut Doc, images: &[&RgbImage], sampler: Value) {
    let views: Vec<usize> = images.iter().map(|image| doc.view(&png(image))).collect();
    let view = |view: &usize| json!({"bufferView": view, "mimeType": "image/png"});
    doc.json["images"] = views.iter().map(view).collect();
    doc.json["samplers"] = json!([sampler]);
    doc.json["textures"] = (0..images.len()).map(|i| json!({"source": i, "sampler": 0})).collect();
}

fn on_cpu(scene: &Scene) -> Frame {
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    cpu::render(scene, &volumes, &scene.mesh(), true, &Unwatched).expect("a frame")
}

/// Pictures of a scene by each engine that there is.
fn frames(name: &str, scene: &Scene) -> Vec<Frame> {
    match renderer(name) {
        Some(mut renderer) => {
            let frames = both(&mut renderer, scene);
            assert_parity(name, &frames);
            frames.into()
        }
        None => vec![on_cpu(scene)],
    }
}

/// Where the ray of each pixel meets the plane z = 0, and the pixel's width there.
fn on_plane(scene: &Scene) -> Vec<(DVec3, DVec3)> {
    let [width, height] = [scene.image.width, scene.image.height];
    let [forward, right, up] = scene.camera.rays(width, height);
    let eye = scene.camera.eye_local() + scene.camera.origin;
    let point = |i: u32| {
        let at = Camera::image_point(width, height, [i % width, i / width], [0.5; 2]).as_dvec2();
        let d = forward + right * at.x + up * at.y;
        (eye - d * (eye.z / d.z), -d.normalize())
    };
    (0..width * height).map(point).collect()
}

fn rgb(frame: &Frame, i: usize) -> DVec3 {
    let [r, g, b, _] = frame.radiance[i].map(f64::from);
    DVec3::new(r, g, b)
}

/// Share of pixels on the square that differ from the truth by more than `most`, and the number of pixels.
fn wrong(frame: &Frame, scene: &Scene, most: f64, truth: impl Fn(DVec3, DVec3) -> DVec3) -> (f64, usize) {
    let (mut wrong, mut count) = (0, 0);
    for (i, (p, e)) in on_plane(scene).into_iter().enumerate() {
        if p.x.min(p.y) > 0.01 && p.x.max(p.y) < 0.99 {
            let differs = (rgb(frame, i) - truth(p, e)).abs().max_element() > most;
            (wrong, count) = (wrong + usize::from(differs), count + 1);
        }
    }
    (wrong as f64 / count as f64, count)
}

#[test]
fn a_square_shows_its_texture_pixel_by_pixel() {
    let image = noise(6, 5);
    let folder = Folder::new();
    let turned = json!({"offset": [0.3, -0.2], "rotation": 0.4, "scale": [1.5, 0.7]});
    for (sampler, wrap, nearest, transform) in [
        (json!({}), [Wrap::Repeat; 2], false, json!({})),
        (json!({"wrapS": 33648, "wrapT": 33071}), [Wrap::Mirror, Wrap::Clamp], false, turned.clone()),
        (json!({"magFilter": 9728}), [Wrap::Repeat; 2], true, turned),
        (json!({"wrapS": 33071}), [Wrap::Clamp, Wrap::Repeat], false, json!({"offset": [700.25, -90.5]})),
    ] {
        let mut doc = Doc::square();
        add_textures(&mut doc, &[&image], sampler.clone());
        doc.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
        let of = |name: &str, i: usize, missing: f64| transform[name][i].as_f64().unwrap_or(missing);
        let offset = DVec2::new(of("offset", 0, 0.0), of("offset", 1, 0.0));
        let scale = DVec2::new(of("scale", 0, 1.0), of("scale", 1, 1.0));
        // u' = u cos + v sin, v' = v cos − u sin.
        let turn = DMat2::from_angle(-transform["rotation"].as_f64().unwrap_or(0.0));
        doc.json["materials"][0]["pbrMetallicRoughness"] = json!({
            "baseColorFactor": [0.5, 0.8, 1.0, 1.0],
            "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": transform}},
        });
        folder.write("a.glb", doc.glb());
        let scene = folder.scene(&format!("{PLACE}{SCENE}"), &FACE_ON);
        let truth = |p: DVec3, _| {
            let uv = turn * (DVec2::new(p.x, 1.0 - p.y) * scale) + offset;
            bilinear(&image, uv.to_array(), wrap, nearest) * DVec3::new(0.5, 0.8, 1.0)
        };
        for frame in frames("texture", &scene) {
            let (share, count) = wrong(&frame, &scene, 1e-3, truth);
            // On an edge between texels that are not interpolated, rounding decides.
            assert!(share < if nearest { 5e-3 } else { 1e-3 }, "{sampler}: {share}");
            assert!(count > 1000, "{count}");
        }
        let plain = folder
            .scene(&format!("{PLACE}{SCENE}"), &[&FACE_ON[..], &["meshes.a.color=[0.2,0.4,0.6]"]].concat());
        let (share, _) = wrong(&on_cpu(&plain), &plain, 1e-5, |_, _| DVec3::new(0.2, 0.4, 0.6));
        assert_eq!(share, 0.0, "a colour of the scene replaces all");
    }
}

/// A level of a pyramid whose sides are powers of two, float64.
fn halved(texels: &[DVec3], side: usize) -> Vec<DVec3> {
    let half = side / 2;
    let at = |x: usize, y: usize| texels[y * side + x];
    let mean = |i: usize| {
        let (x, y) = (i % half * 2, i / half * 2);
        (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)) / 4.0
    };
    (0..half * half).map(mean).collect()
}

#[test]
fn a_small_picture_shows_coarser_levels() {
    let side = 256;
    let image = noise(side, side);
    let folder = Folder::new();
    let mut doc = Doc::square();
    add_textures(&mut doc, &[&image], json!({}));
    doc.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": 0}});
    folder.write("a.glb", doc.glb());
    let scene = folder.scene(&format!("{PLACE}{SCENE}"), &FACE_ON);
    let mut levels = vec![image.pixels().map(|p| DVec3::from(p.0.map(linear))).collect::<Vec<_>>()];
    for k in 0..8 {
        levels.push(halved(&levels[k], side as usize >> k));
    }
    let look_up = |level: usize, uv: DVec2| {
        let n = side as i64 >> level;
        let at = uv * n as f64 - 0.5;
        let get = |x: i64, y: i64| levels[level][(y.rem_euclid(n) * n + x.rem_euclid(n)) as usize];
        let (i, j) = (at.x.floor() as i64, at.y.floor() as i64);
        let row = |j: i64| get(i, j).lerp(get(i + 1, j), at.x - at.x.floor());
        row(j).lerp(row(j + 1), at.y - at.y.floor())
    };
    let pixel = 2.0 * 15f64.to_radians().tan() / 64.0;
    let truth = |p: DVec3, _| {
        // A pixel's width across the view. The square is seen aslant by so little that one lookup is enough.
        let level = (1.5 * pixel * f64::from(side)).log2();
        let uv = DVec2::new(p.x, 1.0 - p.y);
        look_up(level as usize, uv).lerp(look_up(level as usize + 1, uv), level.fract())
    };
    for frame in frames("levels", &scene) {
        // Codes of coarser levels are rounded, by 0.0045 in linear light at most.
        let (share, count) = wrong(&frame, &scene, 6e-3, truth);
        assert!(share < 1e-3 && count > 1000, "{share} of {count}");
    }
}

#[test]
fn a_floor_of_checks_fades_to_its_mean_without_moire() {
    let image = RgbImage::from_fn(32, 32, |x, y| Rgb([255 * ((x / 4 + y / 4) % 2) as u8; 3]));
    let folder = Folder::new();
    let mut doc = Doc::square();
    add_textures(&mut doc, &[&image], json!({}));
    doc.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
    let transform = json!({"KHR_texture_transform": {"scale": [100, 100]}});
    doc.json["materials"][0]["pbrMetallicRoughness"] =
        json!({"baseColorTexture": {"index": 0, "extensions": transform}});
    folder.write("a.glb", doc.glb());
    let text = format!("{PLACE}{SCENE}scale = 100\nposition = [-50, 0, 2]\nturn = [-90, 0, 0]\n");
    let sets = [
        "light.ambient=[1,1,1]",
        "lights.key.intensity=0",
        "camera.eye=[0,1.2,0]",
        "camera.target=[0,0.9,-5]",
        "camera.fov=50",
        "image.width=120",
        "image.height=80",
    ];
    for frame in frames("checks", &folder.scene(&text, &sets)) {
        let row = |y: usize| (0..120).map(move |x| y * 120 + x);
        let (mut far, mut near) = (0, 0f64);
        for y in 0..80 {
            let values: Vec<f64> = row(y).map(|i| rgb(&frame, i).x).collect();
            let depth = f64::from(frame.surface.as_ref().expect("asked for").depth[y * 120 + 60]);
            let mean = values.iter().sum::<f64>() / 120.0;
            let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 120.0).sqrt();
            match depth {
                25.0..80.0 => {
                    far += 1;
                    assert!((mean - 0.5).abs() < 0.01 && spread < 0.02, "{y} at {depth} m: {mean} {spread}");
                }
                // A row on the border of two rows of checks is grey.
                0.1..3.0 => near = near.max(spread),
                _ => {}
            }
        }
        assert!(far >= 2 && near > 0.4, "{far} {near}");
    }
}

/// Radiance of a surface with gloss under a directional light of intensity 1, float64.
fn gloss(albedo: DVec3, roughness: f64, metallic: f64, [n, e, l]: [DVec3; 3]) -> DVec3 {
    let h = (e + l).normalize();
    let a = roughness * roughness;
    let tan2 = |d: DVec3| 1.0 / n.dot(d).powi(2) - 1.0;
    let normals = a * a / (PI * n.dot(h).powi(4) * (a * a + tan2(h)).powi(2));
    let lambda = |d: DVec3| (-1.0 + (1.0 + a * a * tan2(d)).sqrt()) / 2.0;
    let f0 = DVec3::splat(0.04).lerp(albedo, metallic);
    let fresnel = f0 + (DVec3::ONE - f0) * (1.0 - l.dot(h)).powi(5);
    let passes = |d: DVec3| 0.96 * (1.0 - (1.0 - 0.9 * a) * (1.0 - n.dot(d)).powi(5));
    let diffuse = albedo * ((1.0 - metallic) * passes(e) * passes(l) / 0.96);
    let mirrored = fresnel * (PI * normals / (1.0 + lambda(e) + lambda(l)) / (4.0 * n.dot(e) * n.dot(l)));
    (diffuse + mirrored) * n.dot(l)
}

/// A scene that sees the square aslant, under one light from a direction.
const ASLANT: [&str; 11] = [
    "light.ambient=[0,0,0]",
    "background.zenith=[0,0,0]",
    "background.horizon=[0,0,0]",
    "lights.key.direction=[-0.3,0.5,1]",
    "lights.key.color=[1,1,1]",
    "lights.key.intensity=1",
    "camera.eye=[0.9,0.1,1.2]",
    "camera.target=[0.5,0.5,0]",
    "camera.fov=40",
    "image.width=64",
    "image.height=64",
];

#[test]
fn roughness_and_metal_come_from_factors_and_texture() {
    let folder = Folder::new();
    let light = DVec3::new(-0.3, 0.5, 1.0).normalize();
    let image = RgbImage::from_pixel(2, 2, Rgb([9, 128, 51]));
    for (roughness, metallic, has_texture) in [(0.5, 0.0, false), (0.3, 0.7, false), (0.8, 1.0, true)] {
        let mut doc = Doc::square();
        let mut look = json!({
            "baseColorFactor": [0.5, 0.7, 0.2, 1.0], "roughnessFactor": roughness, "metallicFactor": metallic,
        });
        if has_texture {
            add_textures(&mut doc, &[&image], json!({}));
            look["metallicRoughnessTexture"] = json!({"index": 0});
        }
        doc.json["materials"][0]["pbrMetallicRoughness"] = look;
        folder.write("a.glb", doc.glb());
        let scene = folder.scene(&format!("{PLACE}{SCENE}"), &ASLANT);
        let factors = if has_texture { [128.0 / 255.0, 51.0 / 255.0] } else { [1.0; 2] };
        let truth = |_, e: DVec3| {
            let albedo = DVec3::new(0.5, 0.7, 0.2);
            gloss(albedo, roughness * factors[0], metallic * factors[1], [DVec3::Z, e, light])
        };
        for frame in frames("gloss", &scene) {
            let (share, count) = wrong(&frame, &scene, 2e-3, truth);
            assert!(share < 1e-3 && count > 500, "{roughness} {metallic}: {share} of {count}");
        }
    }
}

#[test]
fn relief_turns_the_normal_along_u_and_against_v() {
    let folder = Folder::new();
    let light = DVec3::new(-0.3, 0.5, 1.0).normalize();
    let code = [166, 90, 230];
    let image = RgbImage::from_pixel(2, 2, Rgb(code));
    let [x, y, z] = code.map(|code| f64::from(code) / 127.5 - 1.0);
    // u runs along x, and v runs down. With mirrored coordinates u runs against x.
    for (uvs, along_u) in
        [([0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0], 1.0), ([1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], -1.0)]
    {
        for scale in [1.0, 0.4] {
            let mut doc = Doc::square();
            let accessor = doc.add("VEC2", 5126, 4, &floats(&uvs));
            doc.primitive()["attributes"]["TEXCOORD_0"] = json!(accessor);
            add_textures(&mut doc, &[&image], json!({}));
            doc.json["materials"][0]["normalTexture"] = json!({"index": 0, "scale": scale});
            doc.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorFactor": [0.5, 0.7, 0.2, 1]});
            folder.write("a.glb", doc.glb());
            let scene = folder.scene(&format!("{PLACE}{SCENE}"), &ASLANT);
            let n = DVec3::new(x * scale * along_u, y * scale, z).normalize();
            for frame in frames("relief", &scene) {
                let truth = |_, _| DVec3::new(0.5, 0.7, 0.2) * n.dot(light).max(0.0);
                let (share, count) = wrong(&frame, &scene, 1e-4, truth);
                assert!(share == 0.0 && count > 500, "{along_u} {scale}: {share} of {count}");
            }
        }
    }
}

#[test]
fn a_material_that_says_nothing_of_roughness_is_lambertian() {
    let folder = Folder::new();
    let light = DVec3::new(-0.3, 0.5, 1.0).normalize();
    for look in [
        json!({"baseColorFactor": [0.5, 0.7, 0.2, 1.0]}),
        json!({"baseColorFactor": [0.5, 0.7, 0.2, 1.0], "metallicFactor": 0}),
    ] {
        let mut doc = Doc::square();
        doc.json["materials"][0]["pbrMetallicRoughness"] = look.clone();
        folder.write("a.glb", doc.glb());
        let scene = folder.scene(&format!("{PLACE}{SCENE}"), &ASLANT);
        assert!(scene.triangles[0].painting.is_none(), "{look}: as before, and as fast");
        let (share, _) = wrong(&on_cpu(&scene), &scene, 1e-5, |_, _| DVec3::new(0.5, 0.7, 0.2) * light.z);
        assert_eq!(share, 0.0, "{look}");
    }
}

#[test]
fn rock_beside_a_painted_mesh_keeps_its_bytes() {
    let folder = Folder::new();
    let mut doc = Doc::square();
    add_textures(&mut doc, &[&noise(8, 8)], json!({}));
    doc.json["materials"][0]["pbrMetallicRoughness"] =
        json!({"baseColorTexture": {"index": 0}, "roughnessFactor": 0.4});
    folder.write("a.glb", doc.glb());
    let rock = "[rocks.r]\ncorners = [[-2,-2,-1],[2,-2,-1],[2,2,-1],[-2,2,-1]]\nlevels = 4\nwet = 0.0\n";
    let sets = ["camera.eye=[0.3,0.2,3]", "camera.target=[0.3,0.2,0]", "image.width=64", "image.height=64"];
    let with = folder.scene(&format!("{PLACE}{rock}{SCENE}"), &sets);
    let without = folder.scene(&format!("{PLACE}{rock}"), &sets);
    for (with, without) in frames("rock", &with).iter().zip(frames("rock", &without)) {
        let depth = |frame: &Frame, i: usize| frame.surface.as_ref().expect("asked for").depth[i];
        let is_rock = |i: usize| depth(with, i) == depth(&without, i);
        let (rock, square): (Vec<usize>, Vec<usize>) = (0..64 * 64).partition(|&i| is_rock(i));
        assert!(rock.len() > 1500 && square.len() > 300, "{} {}", rock.len(), square.len());
        assert!(rock.iter().all(|&i| with.radiance[i] == without.radiance[i]));
    }
}

#[test]
fn a_film_of_water_darkens_the_texture_itself() {
    let image = noise(6, 5);
    let folder = Folder::new();
    let mut doc = Doc::square();
    add_textures(&mut doc, &[&image], json!({}));
    doc.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": 0}});
    folder.write("a.glb", doc.glb());
    let dark = ["background.zenith=[0,0,0]", "background.horizon=[0,0,0]"];
    let mut scene = folder.scene(&format!("{PLACE}{SCENE}"), &[&FACE_ON[..], &dark].concat());
    let own = &mut scene.edit().triangles[0];
    let wet = own.vertices.iter().map(|vertex| Vertex { wet: 0.75, ..*vertex });
    own.vertices = std::sync::Arc::new(wet.collect());
    // The vertices keep what they have.
    own.shade = MeshShade::default();
    let truth = |p: DVec3, _| {
        let dry = bilinear(&image, [p.x, 1.0 - p.y], [Wrap::Repeat; 2], false);
        // Ångström 1925: what the film reflects back to the ground is 0.474.
        dry.lerp(0.98 * 0.526 * dry / (1.0 - 0.474 * dry), 0.75)
    };
    for frame in frames("film", &scene) {
        let (share, count) = wrong(&frame, &scene, 1e-3, truth);
        assert!(share < 1e-3 && count > 1000, "{share} of {count}");
    }
}

#[test]
fn a_vertex_under_a_film_keeps_its_factor_where_a_texture_is_darkened_in_its_place() {
    let folder = Folder::new();
    for is_textured in [true, false] {
        let mut doc = Doc::square();
        doc.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorFactor": [0.4, 0.4, 0.4, 1.0]});
        if is_textured {
            add_textures(&mut doc, &[&noise(6, 5)], json!({}));
            doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
        }
        folder.write("a.glb", doc.glb());
        let water = "[[quads]]\ncorners = [[0,1,0.3],[1,1,0.3],[1,0,0.3],[0,0,0.3]]\n";
        let scene = folder.scene(&format!("{PLACE}{SCENE}{water}"), &["meshes.a.wet=0.8"]);
        let mesh = scene.mesh();
        assert!(mesh.vertices.len() > 1000 && mesh.vertices.iter().all(|vertex| vertex.wet > 0.3));
        for Vertex { albedo: [red, ..], wet, .. } in mesh.vertices.iter() {
            let darkened = 0.4 + (wet_albedo(Vec3::splat(0.4)).x - 0.4) * wet;
            let truth = if is_textured { 0.4 } else { darkened };
            assert!((red - truth).abs() < 1e-5, "{is_textured} {red} {truth} {wet}");
        }
    }
}

#[test]
fn coordinates_without_meaning_are_no_panic() {
    let folder = Folder::new();
    for (uv, scale) in [(1e9f32, 1.0f32), (-3e38, 1.0), (0.5, 3e38), (1e30, 1e30)] {
        let mut doc = Doc::square();
        let uvs = [uv, 1.0, -uv, 0.3, 0.2, uv, 1.0, 0.0];
        let accessor = doc.add("VEC2", 5126, 4, &floats(&uvs));
        doc.primitive()["attributes"]["TEXCOORD_0"] = json!(accessor);
        let image = noise(5, 3);
        add_textures(&mut doc, &[&image, &image, &image], json!({"wrapS": 33071}));
        let transform = json!({"KHR_texture_transform": {"scale": [scale, -scale]}});
        let used = |index: u32| json!({"index": index, "extensions": transform});
        doc.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
        doc.json["materials"][0]["pbrMetallicRoughness"] =
            json!({"baseColorTexture": used(0), "metallicRoughnessTexture": used(1)});
        doc.json["materials"][0]["normalTexture"] = used(2);
        folder.write("a.glb", doc.glb());
        let scene = folder.scene(&format!("{PLACE}{SCENE}"), &FACE_ON);
        let mut all = vec![on_cpu(&scene)];
        if let Some(mut renderer) = renderer("coordinates") {
            all.push(both(&mut renderer, &scene)[0].clone());
        }
        assert!(all.iter().all(|frame| frame.non_finite_pixels() == 0), "{uv} {scale}");
    }
}

#[test]
fn a_missing_image_is_told_with_its_place() {
    let folder = Folder::new();
    let mut doc = Doc::square();
    let view = doc.view(b"no picture");
    doc.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
    doc.json["textures"] = json!([{"source": 0}]);
    doc.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": 0}});
    folder.write("a.glb", doc.glb());
    let text = format!("{PLACE}{SCENE}");
    let why = folder.load(&text, &[]).expect_err("no image").to_string();
    assert!(why.contains("images[0]"), "{why}");
    assert!(folder.load(&text, &["meshes.a.color=[1,1,1]"]).is_ok(), "nobody needs the image");
}
