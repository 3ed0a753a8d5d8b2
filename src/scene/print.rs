//! Prints of a resolved scene: a scene file that gives the same picture, and JSON with everything that an
//! independent program needs to compute the image.

use std::collections::HashMap;
use std::fmt::Write;

use glam::{DVec3, Vec3};
use serde_json::{Map, Value as Json, json};

use super::param::{PARAMS, Param, WATER};
use super::read::VERSION;
use super::{Recipe, Scene, SceneMesh, Values, build, meshes};
use crate::light::Light;
use crate::light::environment::{ANGULAR_RADIUS, Environment};
use crate::mapping::Quad;
use crate::picture::camera::{sample_numbers, sample_offset};
use crate::picture::{Camera, Image};
use crate::place::{Mesh, Vertex};

impl Values {
    /// Returns every concrete key of the values, in the table's order.
    pub fn keys(&self) -> Vec<String> {
        let mut keys = self.known_keys();
        // An absent list has no value to print.
        keys.retain(|key| self.is_set(key) || !Param::find(key).is_some_and(Param::is_optional));
        keys
    }

    /// Returns every key that `--set` can give, absent lists among them, in the table's order.
    pub fn known_keys(&self) -> Vec<String> {
        let mut keys = Vec::new();
        for param in PARAMS {
            match param.key.split_once(".*.") {
                None => keys.push(param.key.to_owned()),
                Some((section, rest)) => {
                    let mut names = self.names(section);
                    if section == "materials" && !names.iter().any(|n| n == "water") {
                        names.push("water".into());
                    }
                    for name in names {
                        let key = |rest: &str| format!("{section}.{name}.{rest}");
                        match rest.strip_suffix(".*") {
                            None => keys.push(key(rest)),
                            Some(table) => {
                                let own = self.names(&key(table)).into_iter();
                                keys.extend(own.map(|own| key(&format!("{table}.{own}"))));
                            }
                        }
                    }
                }
            }
        }
        keys
    }

    /// Prints the values as a scene file with every default filled in.
    pub fn to_toml(&self) -> String {
        let mut text = format!("version = {VERSION}\n");
        let mut keys = self.keys();
        // The sort by table is stable; `a.b.c` belongs to table `a.b`.
        let table = |key: &str| key.rsplit_once('.').map_or(String::new(), |(t, _)| t.to_owned());
        let mut tables: HashMap<String, usize> = HashMap::new();
        for key in &keys {
            let next = tables.len();
            tables.entry(table(key)).or_insert(next);
        }
        keys.sort_by_cached_key(|key| tables.get(&table(key)).copied());
        let mut open = String::new();
        for key in &keys {
            let own_table = table(key);
            if own_table != open {
                // Writing to a String cannot fail.
                let _ = match own_table.split_once('.') {
                    Some(("quads", _)) => writeln!(text, "\n[[quads]]"),
                    Some(("animate", track)) if track.starts_with("tracks.") => {
                        writeln!(text, "\n[[animate.tracks]]")
                    }
                    Some((section, name)) => match name.strip_suffix(".materials") {
                        Some(mesh) if section == "meshes" => {
                            writeln!(text, "\n[{section}.{}.materials]", quoted(mesh))
                        }
                        _ => writeln!(text, "\n[{section}.{}]", quoted(name)),
                    },
                    None => writeln!(text, "\n[{own_table}]"),
                };
                open = own_table;
            }
            let name = quoted(&meshes::written(key));
            let _ = writeln!(text, "{name} = {}", self.get(key).to_toml());
        }
        text
    }
}

impl Scene {
    /// Returns every concrete key of this scene, in the table's order.
    ///
    /// # Panics
    /// After [`Scene::edit`], as no keys describe it.
    pub fn keys(&self) -> Vec<String> {
        self.written().keys()
    }

    /// Prints the scene as a scene file with every default filled in.
    ///
    /// # Panics
    /// After [`Scene::edit`], as no scene file describes it.
    pub fn to_toml(&self) -> String {
        self.written().to_toml()
    }

    /// Lists the meshes as comments of a scene file: their nodes, and their materials with what each becomes.
    /// Boxes follow, with their places and cells.
    pub fn comments(&self) -> String {
        let boxes = self.boxes.iter().map(|own| own.comment(&self.recipes[own.volume as usize]));
        self.meshes.iter().map(SceneMesh::comments).chain(boxes).collect()
    }

    /// Prints the scene as JSON: its parameters as in the scene file, and under `derived` the values computed
    /// from them (camera basis, unit vectors to lights, the opaque mesh with normals and albedo).
    ///
    /// # Panics
    /// After [`Scene::edit`], as no parameters describe it.
    pub fn to_json(&self) -> Json {
        let mut root = Map::new();
        root.insert("taki".into(), json!(env!("CARGO_PKG_VERSION")));
        root.insert("version".into(), json!(VERSION));
        root.insert("name".into(), json!(self.name));
        for key in self.keys() {
            insert(&mut root, &key, &meshes::written(&key), self.written().get(&key).to_json());
        }
        if let Some(Json::Object(quads)) = root.remove("quads") {
            root.insert("quads".into(), numbered_list(quads));
        }
        root.insert("derived".into(), self.derived_json());
        Json::Object(root)
    }

    fn derived_json(&self) -> Json {
        let origin = self.camera.origin;
        let water = build::water(self.written(), WATER);
        let boxes = self.boxes.iter().map(|own| own.json(&self.recipes[own.volume as usize]));
        let file = self.recipes.iter().find(|recipe| recipe.name == WATER).and_then(|r| r.file.as_ref());
        json!({
            "curves": {
                "levels": water.shape.levels,
                "sigma_g_cells": water.shape.sigma_g_cells,
            },
            "volumes": self.recipes.iter().map(volume_json).collect::<Vec<_>>(),
            "quads": self.quads.iter().map(|quad| quad_json(quad, origin)).collect::<Vec<_>>(),
            "volume_file": file.map(|p| p.display().to_string()),
            "camera": camera_json(&self.camera, &self.image),
            "lights": lights_json(&self.lights, origin),
            "environment": self.environment.as_ref().map(|e| environment_json(e, &self.environment_lights)),
            "mesh": mesh_json(&self.mesh(), origin),
            "meshes": self.meshes.iter().map(SceneMesh::json).collect::<Vec<_>>(),
            "boxes": boxes.collect::<Vec<_>>(),
        })
    }
}

/// Returns a position in the world, metres, with the digits of a float32 and no more.
fn in_world(position: Vec3, origin: DVec3) -> [f64; 3] {
    let decimal = |x: f32| x.to_string().parse().unwrap_or(f64::NAN);
    [0, 1, 2].map(|c| origin[c] + decimal(position[c]))
}

fn volume_json(recipe: &Recipe) -> Json {
    let shape = &recipe.water.shape;
    json!({
        "name": recipe.name,
        "levels": shape.levels,
        "sigma_g_cells": shape.sigma_g_cells,
        "file": recipe.file.as_ref().map(|p| p.display().to_string()),
        "size": recipe.knows_size().then_some(recipe.water.size),
    })
}

fn quad_json(quad: &Quad, origin: DVec3) -> Json {
    let [a, b, c, _] = quad.corners;
    let corners = match quad.is_triangle() {
        true => [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[u, v]| quad.map.point_world(u, v)),
        false => quad.corners,
    };
    json!({
        "corners": corners.map(|c| in_world(c, origin)),
        // What is drawn of it, where it is a triangle.
        "triangle": quad.is_triangle().then(|| [a, b, c].map(|c| in_world(c, origin))),
        "thickness": quad.material.thickness_m,
        // Copies of the volume before the quad's corner A, and on the quad.
        "offset": quad.offset.to_array(),
        "extent": [quad.material.repeat_u, quad.material.repeat_v],
        "erosion": quad.erosion,
        // Shares that are torn at v = 0 and v = 1.
        "torn": quad.tear.open,
        "mist": quad.mist,
        // Index in the list of volumes.
        "volume": quad.material.volume,
    })
}

fn camera_json(camera: &Camera, image: &Image) -> Json {
    json!({
        "eye": camera.eye.to_array(),
        "right": camera.right.to_array(),
        "up": camera.up.to_array(),
        "forward": camera.forward.to_array(),
        "tan_half_fov": camera.tan_half_fov,
        "near": camera.near,
        "sample_offsets": sample_numbers(image).map(|s| sample_offset(image, s)).collect::<Vec<_>>(),
    })
}

fn lights_json(lights: &[Light], origin: DVec3) -> Vec<Json> {
    lights.iter().map(|light| light_json(light, origin)).collect()
}

fn light_json(light: &Light, origin: DVec3) -> Json {
    let kind = light.kind().word();
    match light {
        Light::Directional { to_light, intensity } => {
            json!({"kind": kind, "to_light": to_light.to_array(), "intensity": intensity.to_array()})
        }
        Light::Point { position, intensity } => {
            json!({"kind": kind, "position": in_world(*position, origin), "intensity": intensity.to_array()})
        }
        Light::Spot { position, intensity, cone } => json!({
            "kind": kind, "position": in_world(*position, origin), "intensity": intensity.to_array(),
            "axis": cone.axis.to_array(), "cos_edge": cone.cos_edge, "inverse_soft": cone.inverse_soft,
        }),
    }
}

fn environment_json(environment: &Environment, lights: &[Light]) -> Json {
    json!({
        "map": {
            "width": environment.map.width,
            "height": environment.map.height,
            "crc32": format!("{:08x}", environment.map.checksum()),
        },
        // Lookups of a column u are shifted to the right by this much.
        "turn": environment.turn,
        "intensity": environment.intensity,
        "irradiance": environment.irradiance.0.map(|c| c.to_array()),
        "irradiance_error": environment.irradiance_error(),
        "lights": lights_json(lights, DVec3::ZERO),
        "lights_error": environment.error(),
        "sun": environment.sun.map(|sun| json!({
            "to_sun": sun.to_sun.to_array(),
            "radiance": sun.radiance.to_array(),
            "angular_radius": ANGULAR_RADIUS,
        })),
    })
}

fn mesh_json(mesh: &Mesh, origin: DVec3) -> Json {
    let column = |get: fn(&Vertex) -> [f32; 3]| mesh.vertices.iter().map(get).collect::<Vec<_>>();
    json!({
        "positions": mesh.vertices.iter().map(|v| in_world(v.position.into(), origin)).collect::<Vec<_>>(),
        "normals": column(|v| v.normal),
        "albedos": column(|v| v.albedo),
        // Occlusion, shadow and film of water of each vertex.
        "shades": column(|v| [v.occlusion, v.shadow, v.wet]),
        // Number of the vertex's pool plus 1; 0 for rock.
        "pools": mesh.vertices.iter().map(|v| v.pool).collect::<Vec<_>>(),
        "triangles": mesh.triangles(&vec![1; mesh.tiles.len()]),
    })
}

/// Turns an object whose keys are numbers into the list of its values, as in the scene file.
fn numbered_list(object: Map<String, Json>) -> Json {
    let mut numbered: Vec<(u64, Json)> =
        object.into_iter().map(|(number, value)| (number.parse().unwrap_or(u64::MAX), value)).collect();
    numbered.sort_by_key(|(number, _)| *number);
    numbered.into_iter().map(|(_, value)| value).collect()
}

/// Returns a name as a TOML key: bare where TOML allows that, otherwise a JSON string. TOML has the escapes
/// of JSON but also requires one for U+007F.
pub(super) fn quoted(name: &str) -> String {
    if name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_') {
        name.into()
    } else {
        json!(name).to_string().replace('\u{7f}', "\\u007f")
    }
}

/// Sets a dotted key, whose last part is called `last`, and makes the objects on its way.
fn insert(map: &mut Map<String, Json>, key: &str, last: &str, value: Json) {
    match key.split_once('.') {
        None => {
            map.insert(last.into(), value);
        }
        Some((first, rest)) => {
            let slot = map.entry(first).or_insert_with(|| Json::Object(Map::new()));
            if let Json::Object(inner) = slot {
                insert(inner, rest, last, value);
            }
        }
    }
}
