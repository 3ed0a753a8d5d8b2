//! The parts of a scene, made from values that passed the table and checked against one another.

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::{Limits, MAX_LIGHTS, Place, Raw, Values};
use crate::light::environment::{Environment, Settings, Sky, Source};
use crate::light::haze::Haze;
use crate::light::strand::StrandParams;
use crate::light::{Cone, Light, Scattering};
use crate::picture::{AutoExposure, Camera, Filter, Look, Tone};
use crate::util::error::{Error, Result};
use crate::util::unit::unit;
use crate::volume::{StorageChoice, Structure};

pub(super) fn environment(v: &Values, folder: Option<&Path>, limits: &Limits) -> Result<Option<Environment>> {
    let source = match v.text("environment.kind").as_str() {
        "sky" => {
            let ground = v.triple("sky.ground");
            if ground.max_element() > 1.0 {
                return Err(Error::input(
                    format!("sky.ground = {ground} sends back more light than it gets"),
                    "an albedo is at most 1 in each component",
                ));
            }
            Source::Sky(Sky {
                elevation: v.float("sky.elevation"),
                turbidity: v.float("sky.turbidity"),
                ground,
                sun: v.float("sky.sun"),
            })
        }
        "file" => match v.text("environment.file") {
            file if file.is_empty() => {
                return Err(Error::input(
                    "environment.kind = \"file\" without a file",
                    "give environment.file an equirectangular .hdr or .exr",
                ));
            }
            file => Source::File(confine("environment.file", Path::new(&file), folder, &limits.allow_paths)?),
        },
        _ => return Ok(None),
    };
    let settings = Settings {
        intensity: v.float("environment.intensity"),
        turn: v.float("environment.turn"),
        azimuth: v.float("sky.azimuth"),
        lights: v.count("environment.lights"),
    };
    Environment::new(source, settings, &limits.environments, limits.memory).map(Some)
}

/// The scene's own lights, and the `sun` of its environment, for which `others` more will stand.
pub(super) fn lights(v: &Values, sun: Option<Light>, others: usize) -> Result<Vec<Light>> {
    let mut lights = Vec::new();
    for name in v.names("lights") {
        let key = |what: &str| format!("lights.{name}.{what}");
        let intensity = v.triple(&key("color")) * v.float(&key("intensity"));
        if !intensity.is_finite() {
            return Err(Error::input(
                format!("light {name} is infinitely bright"),
                "lower its color or intensity",
            ));
        }
        let position = || v.triple(&key("position"));
        let to_light = || {
            let direction = v.triple(&key("direction"));
            unit(direction).ok_or_else(|| {
                Error::input(
                    format!("{} = {direction} has no direction", key("direction")),
                    "give a vector towards the light",
                )
            })
        };
        let light = match v.text(&key("kind")).as_str() {
            "point" => Light::Point { position: position(), intensity },
            "spot" => {
                let cone = Cone::new(to_light()?, v.float(&key("angle")), v.float(&key("softness")));
                Light::Spot { position: position(), intensity, cone }
            }
            _ => Light::Directional { to_light: to_light()?, intensity },
        };
        if intensity != Vec3::ZERO {
            lights.push(light);
        }
    }
    lights.extend(sun);
    if lights.len() + others > MAX_LIGHTS {
        return Err(Error::input(
            format!("the scene has {} lights, those of its environment included", lights.len() + others),
            format!("at most {MAX_LIGHTS}"),
        ));
    }
    Ok(lights)
}

/// Lengths are fractions of the volume, so that a look survives a change of resolution.
pub(super) fn structure(v: &Values) -> Structure {
    let bundles = v.count("curves.bundles");
    Structure {
        bundles,
        // What is not used does not make volumes differ.
        radius_cells: if bundles > 0 { v.float("curves.radius") * v.count("volume.nx") as f32 } else { 0.0 },
        wander_cells: if bundles > 0 { v.float("curves.wander") * v.count("volume.ny") as f32 } else { 0.0 },
        breathe: if bundles > 0 { v.float("curves.breathe") } else { 0.0 },
        loose: if bundles > 0 { v.float("curves.loose") } else { 0.0 },
        coherence: v.float("volume.coherence"),
        strand_length: v.float("volume.strand_length"),
        coverage: v.float("volume.coverage"),
        crest: v.float("volume.crest"),
    }
}

/// Coarse levels are made of all cells: with them sparse storage is refused, and not chosen.
pub(super) fn storage(v: &Values) -> Result<StorageChoice> {
    let pyramid = v.text("trace.filter") == "pyramid";
    match v.text("volume.storage").as_str() {
        "sparse" if pyramid => Err(Error::input(
            "volume.storage = \"sparse\" with trace.filter = \"pyramid\": coarse levels are made of all cells",
            "set trace.filter=none, or volume.storage=dense",
        )),
        "sparse" => Ok(StorageChoice::Sparse),
        "auto" if !pyramid => Ok(StorageChoice::Auto),
        _ => Ok(StorageChoice::Dense),
    }
}

pub(super) fn camera(v: &Values) -> Result<Camera> {
    let (eye, target, up) = (v.triple("camera.eye"), v.triple("camera.target"), v.triple("camera.up"));
    let forward = unit(target - eye)
        .ok_or_else(|| Error::input("camera.eye and camera.target are the same point", "move one of them"))?;
    let right = unit(forward.cross(unit(up).unwrap_or(Vec3::ZERO))).ok_or_else(|| {
        Error::input("camera.up is zero or along the view", "turn it away from the view direction")
    })?;
    Ok(Camera {
        eye,
        right,
        up: right.cross(forward),
        forward,
        tan_half_fov: (v.float("camera.fov").to_radians() * 0.5).tan(),
        near: v.float("camera.near"),
    })
}

pub(super) fn haze(v: &Values) -> Haze {
    Haze {
        density: v.float("haze.density"),
        color: v.triple("haze.color"),
        height: v.float("haze.scale_height"),
        level: v.float("haze.level"),
        far: v.float("haze.far"),
    }
}

pub(super) fn filter(v: &Values) -> Filter {
    match v.text("image.filter").as_str() {
        "gaussian" => Filter::Gaussian,
        "blackman-harris" => Filter::BlackmanHarris,
        _ => Filter::Box,
    }
}

pub(super) fn look(v: &Values) -> Look {
    Look {
        exposure: v.float("image.exposure"),
        auto_exposure: match v.text("image.auto_exposure").as_str() {
            "average" => AutoExposure::Average,
            "highlights" => AutoExposure::Highlights,
            _ => AutoExposure::None,
        },
        bloom: v.float("image.bloom"),
        bloom_radius: v.float("image.bloom_radius"),
        temperature: v.float("image.temperature"),
        tint: v.float("image.tint"),
        tone: match v.text("image.tone").as_str() {
            "none" => Tone::None,
            "agx" => Tone::Agx,
            _ => Tone::Filmic,
        },
    }
}

pub(super) fn strand(v: &Values) -> StrandParams {
    StrandParams {
        radius_m: v.float("strand.radius"),
        roughness_m: v.float("strand.roughness_m"),
        roughness_n: v.float("strand.roughness_n"),
        absorption: v.float("strand.absorption"),
        aeration: v.float("strand.aeration"),
        g: v.float("strand.g"),
    }
}

pub(super) fn scattering(v: &Values) -> Result<Scattering> {
    if v.text("light.scattering") == "single" {
        return Ok(Scattering::Single);
    }
    if v.text("light.visibility") == "none" {
        return Err(Error::input(
            "light.scattering = \"multiple\" with light.visibility = \"none\": there is no light left to scatter",
            "use light.visibility=cached or march",
        ));
    }
    Ok(Scattering::Multiple)
}

/// Puts the whole path in place of the reference `key`, if the scene has one that it uses.
///
/// # Errors
/// Where it leads out of the scene's folder, or nowhere.
pub fn resolve(values: &mut Values, key: &str, folder: Option<&Path>, allowed: &[PathBuf]) -> Result<()> {
    let file = values.text(key);
    let unused = key == "environment.file" && values.text("environment.kind") != "file";
    if file.is_empty() || unused {
        return Ok(());
    }
    let whole = confine(key, Path::new(&file), folder, allowed)?;
    let whole = whole.into_os_string().into_string().map_err(|path| {
        Error::input(format!("{key}: {} is not UTF-8", path.display()), "rename its folders")
    })?;
    values.set(key, &Raw::Text(whole), &Place("the scene".into()))
}

/// Resolves a reference inside the scene's folder (or an allowed one), following links.
pub(super) fn confine(key: &str, file: &Path, folder: Option<&Path>, allowed: &[PathBuf]) -> Result<PathBuf> {
    let Some(folder) = folder else { return Ok(file.to_owned()) };
    let joined = folder.join(file);
    let real = joined.canonicalize().map_err(|e| {
        Error::input(
            format!("{key} = {:?}: {} {e}", file.display().to_string(), joined.display()),
            "check the path",
        )
    })?;
    let inside = std::iter::once(folder)
        .chain(allowed.iter().map(PathBuf::as_path))
        .filter_map(|dir| dir.canonicalize().ok())
        .any(|dir| real.starts_with(dir));
    if !inside {
        return Err(Error::input(
            format!("{key} = {:?} leads out of the scene's folder", file.display().to_string()),
            format!("allow it with --allow-path {}", real.parent().unwrap_or(&real).display()),
        ));
    }
    Ok(real)
}
