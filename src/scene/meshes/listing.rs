//! What the meshes of a scene hold, for `taki scene` and the viewer.

use std::fmt::Write;

use glam::Vec2;
use serde_json::{Value as Json, json};

use super::SceneMesh;
use super::names::{shown, written};
use crate::scene::print::quoted;

/// Most nodes and materials that a listing names.
const MOST: usize = 64;

/// A material of a mesh's file, and what its parts become.
#[derive(Clone, Debug, PartialEq)]
pub struct PartSummary {
    /// Name in the file; empty for parts without a material.
    pub material: String,
    /// Key of the scene by which the material is named. `None` for parts without one: they become what
    /// `meshes.*.material` says.
    pub key: Option<String>,
    /// Triangles with all instances.
    pub triangles: u128,
    /// Least and greatest texture coordinates of each set.
    pub uvs: Vec<[Vec2; 2]>,
    /// Word for what the parts become.
    pub becomes: String,
}

impl SceneMesh {
    /// Lists the materials of the file that are shown.
    pub fn parts(&self) -> Vec<PartSummary> {
        let materials = self.loaded.summary().materials.iter();
        let last = self.becomes.len() - 1;
        materials
            .map(|own| PartSummary {
                key: own.material.and_then(|i| self.keys[i].clone()),
                triangles: own.triangles,
                uvs: own.uvs.clone(),
                becomes: self.becomes[own.material.unwrap_or(last)].word().into(),
                material: own.name.clone(),
            })
            .collect()
    }

    /// Lists the mesh in comments of a scene file.
    pub(in crate::scene) fn comments(&self) -> String {
        let summary = self.loaded.summary();
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "\n# mesh {}: {}, {} nodes with a mesh, {} triangles",
            self.name,
            plain(&self.file.display().to_string()),
            summary.nodes.len(),
            summary.triangles
        );
        if let Some([low, high]) = summary.bounds {
            let size = (high - low) * self.scale;
            let _ = write!(text, ", {:.4} × {:.4} × {:.4} m", size.x, size.y, size.z);
        }
        text.push('\n');
        for node in summary.nodes.iter().take(MOST) {
            let places = if node.instances == 1 { String::new() } else { format!(" × {}", node.instances) };
            let _ = writeln!(text, "#   node {}: {} triangles{places}", plain(&node.name), node.triangles);
        }
        let more = summary.nodes.len().saturating_sub(MOST);
        if more > 0 {
            let _ = writeln!(text, "#   and {more} more nodes");
        }
        for part in self.parts().iter().take(MOST) {
            let name = match &part.key {
                Some(key) => {
                    let (name, key) = (plain(&part.material), quoted(&written(key)));
                    let key = if key == name { String::new() } else { format!(" (key {key})") };
                    format!("material {name}{key}")
                }
                None => "without a material".into(),
            };
            let _ = write!(text, "#   {name}: {} triangles, {}", part.triangles, part.becomes);
            for (set, [low, high]) in part.uvs.iter().enumerate() {
                let _ = write!(text, "; uv {set}: u {} to {}, v {} to {}", low.x, high.x, low.y, high.y);
            }
            text.push_str(if part.uvs.is_empty() { "; no texture coordinates\n" } else { "\n" });
        }
        for (what, names) in
            [("camera", &summary.cameras), ("light", &summary.lights), ("animation", &summary.animations)]
        {
            for name in names.iter().take(MOST) {
                let _ = writeln!(text, "#   {what} {}", plain(name));
            }
        }
        text
    }

    /// Lists the mesh in JSON.
    pub(in crate::scene) fn json(&self) -> Json {
        let summary = self.loaded.summary();
        let range = |[low, high]: &[Vec2; 2]| json!({"u": [low.x, high.x], "v": [low.y, high.y]});
        json!({
            "name": self.name,
            "file": self.file.display().to_string(),
            "triangles": summary.triangles as u64,
            "nodes": summary.nodes.iter().map(|node| json!({
                "name": node.name, "triangles": node.triangles, "instances": node.instances,
            })).collect::<Vec<_>>(),
            "materials": self.parts().iter().map(|part| json!({
                "name": part.material,
                "key": part.key.as_deref().map(shown),
                "triangles": part.triangles as u64,
                "becomes": part.becomes,
                "uvs": part.uvs.iter().map(range).collect::<Vec<_>>(),
            })).collect::<Vec<_>>(),
            "cameras": summary.cameras,
            "lights": summary.lights,
            "animations": summary.animations,
            "notes": self.loaded.model.notes,
        })
    }
}

/// A text of a file on one line.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
