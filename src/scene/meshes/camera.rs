//! Cameras and lights of a mesh's file.

use glam::{DAffine3, DVec3, Vec3};

use super::{SceneMesh, listed, named};
use crate::light::{Cone, Light};
use crate::model::{CameraLens, LightKind, find_name};
use crate::scene::Values;
use crate::scene::param::POINT_MAX;
use crate::scene::value::{Place, Raw};
use crate::util::error::{Error, Result};

/// Distance from the eye to the point that a camera of a file looks at, metres. A file has no such point.
const TARGET_M: f64 = 10.0;

/// Intensity that a light of one lux or candela has. Exporters multiply watts by the 683 lm/W of green light.
const PER_LUX: f32 = 1.0 / 683.0;

/// Returns the values with the camera that `camera.from` names in their camera's place, and without that key.
/// Without the key they stay as they are. `time` is that of the file's animation, s.
///
/// # Errors
/// [`Error::Input`] where there is no such mesh or camera, or the camera has no perspective.
pub(in crate::scene) fn with_camera(v: &Values, meshes: &[SceneMesh], time: f64) -> Result<Option<Values>> {
    const KEY: &str = "camera.from";
    let text = v.text(KEY);
    if text.is_empty() {
        return Ok(None);
    }
    let (mesh, name) = named(meshes, &text, KEY)?;
    let model = &mesh.loaded.model;
    let bad = |what: String, fix: String| Err(Error::input(format!("{KEY} = {text:?}: {what}"), fix));
    let with: Vec<(usize, usize)> =
        model.nodes.iter().enumerate().filter_map(|(i, node)| Some((i, node.camera?))).collect();
    let names = || with.iter().map(|&(node, _)| model.nodes[node].name.as_str());
    let of_cameras = || with.iter().map(|&(_, camera)| model.cameras[camera].name.as_str());
    let found = match name {
        "" => (!with.is_empty()).then_some(0),
        name => find_name(name, names()).ok().or_else(|| find_name(name, of_cameras()).ok()),
    };
    let Some(&(node, camera)) = found.map(|i| &with[i]) else {
        let what = format!(
            "{} has no {}",
            mesh.file.display(),
            match name {
                "" => "camera".to_owned(),
                name => format!("camera {name}"),
            }
        );
        let near = find_name(name, names()).err().flatten();
        return bad(
            what,
            match (with.is_empty(), near) {
                (true, _) => "export it with its cameras, or give camera.eye and camera.target".into(),
                (false, Some(near)) => format!("did you mean {near}?"),
                (false, None) => format!("it has {}", listed(names())),
            },
        );
    };
    let CameraLens::Perspective { fov_y, .. } = model.cameras[camera].lens else {
        return bad(
            "the camera has parallel rays".into(),
            "make it a perspective camera in the program that made it".into(),
        );
    };
    let moved = (0..model.animations.len()).find(|&animation| model.is_moved(animation, node));
    let world = moved.map_or(model.nodes[node].world, |animation| model.world_at(animation, node, time));
    let world = mesh.place * world;
    let (Some(forward), Some(up)) = (direction(&world, DVec3::NEG_Z), direction(&world, DVec3::Y)) else {
        return bad("its node has no direction".into(), "remove the scale of 0 from the camera".into());
    };
    let mut values = v.clone();
    let place = Place(format!("{KEY} = {text:?}"));
    let point = |p: DVec3| Raw::List(p.to_array().map(Raw::Float).to_vec());
    let eye = world.translation;
    values.set("camera.eye", &point(eye), &place)?;
    values.set("camera.target", &point(eye + forward * TARGET_M), &place)?;
    values.set("camera.up", &point(up), &place)?;
    values.set("camera.fov", &Raw::Float(fov_y.to_degrees()), &place)?;
    values.clear_under(KEY);
    Ok(Some(values))
}

/// A direction of a node in the world.
fn direction(world: &DAffine3, own: DVec3) -> Option<DVec3> {
    world.transform_vector3(own).try_normalize()
}

/// Returns the lights of the meshes' files that shine, relative to `origin`.
///
/// # Errors
/// [`Error::Input`] for a light that is infinitely bright.
pub(in crate::scene) fn lights(meshes: &[SceneMesh], origin: DVec3) -> Result<Vec<Light>> {
    let mut lights = Vec::new();
    for mesh in meshes.iter().filter(|mesh| mesh.lights) {
        let model = &mesh.loaded.model;
        for node in &model.nodes {
            let Some(light) = node.light.map(|i| &model.lights[i]) else { continue };
            let world = mesh.place * node.world;
            let Some(to_light) = direction(&world, DVec3::Z).map(|d| d.as_vec3()) else { continue };
            let intensity = Vec3::from(light.color) * light.intensity * PER_LUX;
            if !intensity.is_finite() {
                return Err(Error::input(
                    format!("mesh {}: the light {} is infinitely bright", mesh.name, node.name),
                    "lower its power in the program that made it",
                ));
            }
            if intensity == Vec3::ZERO {
                continue;
            }
            let at = world.translation;
            let far = !at.is_finite() || at.abs().max_element() > POINT_MAX;
            if far && !matches!(light.kind, LightKind::Directional) {
                return Err(Error::input(
                    format!("mesh {}: the light {} is too far from the scene's origin", mesh.name, node.name),
                    format!("move it to within ±{POINT_MAX:e} m in the program that made it"),
                ));
            }
            let position = (world.translation - origin).as_vec3();
            lights.push(match light.kind {
                LightKind::Directional => Light::Directional { to_light, intensity },
                LightKind::Point => Light::Point { position, intensity },
                LightKind::Spot { inner, outer } => {
                    let softness = (1.0 - inner / outer.max(1e-4)).clamp(0.0, 1.0);
                    let cone = Cone::new(to_light, outer.to_degrees().clamp(0.01, 90.0), softness);
                    Light::Spot { position, intensity, cone }
                }
            });
        }
    }
    Ok(lights)
}
