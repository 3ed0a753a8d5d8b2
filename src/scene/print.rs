//! The scene fully resolved: as a scene file that gives the same picture, and as JSON with everything
//! an independent program needs to compute the image.

use std::collections::HashMap;
use std::fmt::Write;

use serde_json::{Map, Value as Json, json};

use super::Scene;
use super::param::{PARAMS, Param};
use super::read::VERSION;
use crate::light::Light;

impl Scene {
    /// Every concrete key of this scene, in the table's order.
    pub fn keys(&self) -> Vec<String> {
        let mut keys = Vec::new();
        for param in PARAMS {
            match param.key.split_once(".*.") {
                None => keys.push(param.key.to_owned()),
                Some((section, rest)) => {
                    let mut names = self.values.names(section);
                    if section == "materials" && !names.iter().any(|n| n == "water") {
                        names.push("water".into());
                    }
                    keys.extend(names.iter().map(|name| format!("{section}.{name}.{rest}")));
                }
            }
        }
        // A list that is not given has nothing to say.
        keys.retain(|key| self.values.is_set(key) || !Param::find(key).is_some_and(Param::is_list));
        keys
    }

    /// The scene as a scene file with every default filled in.
    pub fn to_toml(&self) -> String {
        let mut text = format!("version = {VERSION}\n");
        let mut keys = self.keys();
        // A stable sort by table: `a.b.c` belongs to table `a.b`.
        let table = |key: &str| key.rsplit_once('.').map_or(String::new(), |(t, _)| t.to_owned());
        let mut tables: HashMap<String, usize> = HashMap::new();
        for key in &keys {
            let next = tables.len();
            tables.entry(table(key)).or_insert(next);
        }
        keys.sort_by_cached_key(|key| tables.get(&table(key)).copied());
        let mut open = String::new();
        for key in &keys {
            let this = table(key);
            if this != open {
                // Infallible: writing to a String.
                let _ = match this.split_once('.') {
                    Some(("quads", _)) => writeln!(text, "\n[[quads]]"),
                    Some(("animate", track)) if track.starts_with("tracks.") => {
                        writeln!(text, "\n[[animate.tracks]]")
                    }
                    Some((section, name)) => writeln!(text, "\n[{section}.{}]", quoted(name)),
                    None => writeln!(text, "\n[{this}]"),
                };
                open = this;
            }
            let name = key.rsplit('.').next().unwrap_or(key);
            let _ = writeln!(text, "{name} = {}", self.values.get(key).to_toml());
        }
        text
    }

    /// The scene as JSON: parameters as in the scene file, and under `derived` what follows from them
    /// (camera basis, unit lights, the rock mesh with normals and albedo).
    pub fn to_json(&self) -> Json {
        let mut root = Map::new();
        root.insert("taki".into(), json!(env!("CARGO_PKG_VERSION")));
        root.insert("version".into(), json!(VERSION));
        root.insert("name".into(), json!(self.name));
        for key in self.keys() {
            insert(&mut root, &key, self.values.get(&key).to_json());
        }
        // A list, as in the scene file.
        if let Some(Json::Object(quads)) = root.remove("quads") {
            let mut numbered: Vec<(u64, Json)> =
                quads.into_iter().map(|(n, quad)| (n.parse().unwrap_or(u64::MAX), quad)).collect();
            numbered.sort_by_key(|(n, _)| *n);
            root.insert("quads".into(), numbered.into_iter().map(|(_, quad)| quad).collect());
        }
        let camera = &self.camera;
        let lights = |lights: &[Light]| -> Vec<Json> {
            lights
            .iter()
            .map(|light| match light {
                Light::Directional { to_light, intensity } => {
                    json!({"kind": "directional", "to_light": to_light.to_array(), "intensity": intensity.to_array()})
                }
                Light::Point { position, intensity } => {
                    json!({"kind": "point", "position": position.to_array(), "intensity": intensity.to_array()})
                }
                Light::Spot { position, intensity, cone } => json!({
                    "kind": "spot", "position": position.to_array(), "intensity": intensity.to_array(),
                    "axis": cone.axis.to_array(), "cos_edge": cone.cos_edge, "inverse_soft": cone.inverse_soft,
                }),
            })
            .collect()
        };
        let environment = self.environment.as_ref().map(|environment| {
            json!({
                "map": {
                    "width": environment.map.width,
                    "height": environment.map.height,
                    "crc32": format!("{:08x}", environment.map.checksum()),
                },
                // Columns of u are looked up this much further right.
                "turn": environment.turn,
                "intensity": environment.intensity,
                "irradiance": environment.irradiance.0.map(|c| c.to_array()),
                "irradiance_error": environment.irradiance_error(),
                "lights": lights(&self.environment_lights),
                "lights_error": environment.error(),
                "sun": environment.sun.map(|sun| json!({
                    "to_sun": sun.to_sun.to_array(),
                    "radiance": sun.radiance.to_array(),
                    "angular_radius": crate::light::environment::ANGULAR_RADIUS,
                })),
            })
        });
        let mesh = self.mesh();
        let column =
            |get: fn(&crate::place::Vertex) -> [f32; 3]| mesh.vertices.iter().map(get).collect::<Vec<_>>();
        root.insert(
            "derived".into(),
            json!({
                "curves": {
                    "levels": self.water.shape.levels,
                    "sigma_g_cells": self.water.shape.sigma_g_cells,
                },
                "quads": self.quads.iter().map(|quad| json!({
                    "corners": quad.corners.map(|c| c.to_array()),
                    "thickness": quad.material.thickness_m,
                    // Copies of the volume before its corner A, and on it.
                    "offset": quad.offset.to_array(),
                    "extent": [quad.material.repeat_u, quad.material.repeat_v],
                    "erosion": quad.erosion,
                    "mist": quad.mist,
                })).collect::<Vec<_>>(),
                "volume_file": self.volume_file.as_ref().map(|p| p.display().to_string()),
                "camera": {
                    "eye": camera.eye.to_array(),
                    "right": camera.right.to_array(),
                    "up": camera.up.to_array(),
                    "forward": camera.forward.to_array(),
                    "tan_half_fov": camera.tan_half_fov,
                    "near": camera.near,
                    "sample_offsets": (0..self.image.samples)
                        .map(|s| crate::picture::camera::sample_offset(&self.image, s))
                        .collect::<Vec<_>>(),
                },
                "lights": lights(&self.lights),
                "environment": environment,
                "mesh": {
                    "positions": column(|v| v.position),
                    "normals": column(|v| v.normal),
                    "albedos": column(|v| v.albedo),
                    // Occlusion, shadow and film of water of each.
                    "shades": column(|v| [v.occlusion, v.shadow, v.wet]),
                    // Number of the pool that it belongs to, plus 1; 0: rock.
                    "pools": mesh.vertices.iter().map(|v| v.pool).collect::<Vec<_>>(),
                    "triangles": mesh.triangles(&vec![1; mesh.tiles.len()]),
                },
            }),
        );
        Json::Object(root)
    }
}

/// A name as a TOML key: bare where it may be, else a string with JSON's escapes, which TOML shares but
/// for U+007F.
fn quoted(name: &str) -> String {
    if name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_') {
        name.into()
    } else {
        json!(name).to_string().replace('\u{7f}', "\\u007f")
    }
}

fn insert(map: &mut Map<String, Json>, key: &str, value: Json) {
    match key.split_once('.') {
        None => {
            map.insert(key.into(), value);
        }
        Some((first, rest)) => {
            let slot = map.entry(first).or_insert_with(|| Json::Object(Map::new()));
            if let Json::Object(inner) = slot {
                insert(inner, rest, value);
            }
        }
    }
}
