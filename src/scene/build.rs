//! Builders of a scene's parts. They take values that the table accepted and check them against one another.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use super::param::{HAIR_COLOR, key_of_volume, split_volume_key};
use super::{Limits, MAX_LIGHTS, Place, Raw, Values, measured, meshes, presets, sequence, volumes};
use crate::curve::{CurveShape, levels_for};
use crate::grid;
use crate::light::environment::{Environment, Settings, Sky, Source};
use crate::light::haze::Haze;
use crate::light::strand::StrandParams;
use crate::light::strand::hair::{Hair, Pigment};
use crate::light::strand::water::Water;
use crate::light::{Background, Cone, Light, LightKind, Reflection, ReflectionKind, Scattering, Visibility};
use crate::picture::{AutoExposure, Camera, Dither, Filter, Gamut, Image, Lens, Look, Tone};
use crate::trace::{Attenuation, AttenuationKind, Lookup, Prefilter, Trace};
use crate::util::error::{Error, Result};
use crate::util::unit::unit;
use crate::util::words::words;
use crate::volume::{Storage, StorageChoice, Structure, WaterSpec, check_npz, storage_of};

/// Source of a scene's environment, if it has one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EnvironmentKind {
    /// No environment.
    None,
    /// The sky of the parameters `sky.*`.
    Sky,
    /// The map in `environment.file`.
    File,
}

words! { EnvironmentKind { None => "none", Sky => "sky", File => "file" } }

/// Returns the recipe of the scene's volume `name`.
pub(super) fn water(v: &Values, name: &str) -> WaterSpec {
    let count = |key: &str| v.count(&key_of_volume(name, key));
    let float = |key: &str| v.float(&key_of_volume(name, key));
    let size = [count("volume.nx"), count("volume.ny"), count("volume.nz")];
    let levels = match count("curves.levels") {
        0 => levels_for(size[1]).min(16),
        n => n,
    };
    WaterSpec {
        size,
        across: count("curves.across"),
        deep: count("curves.deep"),
        shape: CurveShape {
            h: float("curves.h"),
            sigma_g_cells: float("curves.amplitude") * size[1] as f32,
            levels,
        },
        structure: structure(v, name),
        seed: v.int(&key_of_volume(name, "volume.seed")) as u64,
        alpha: float("volume.alpha"),
        k_d: float("volume.k_d"),
        k_s: float("volume.k_s"),
        k_noise: float("volume.k_noise"),
    }
}

/// Returns the fine structure of the water. Lengths are fractions of the volume, so a look survives a change
/// of resolution.
fn structure(v: &Values, name: &str) -> Structure {
    let count = |key: &str| v.count(&key_of_volume(name, key));
    let float = |key: &str| v.float(&key_of_volume(name, key));
    let bundles = count("curves.bundles");
    // Without bundles their parameters are 0, so that they do not tell equal volumes apart.
    let of_bundles = |key: &str| if bundles > 0 { float(key) } else { 0.0 };
    Structure {
        bundles,
        radius_cells: of_bundles("curves.radius") * count("volume.nx") as f32,
        wander_cells: of_bundles("curves.wander") * count("volume.ny") as f32,
        breathe: of_bundles("curves.breathe"),
        loose: of_bundles("curves.loose"),
        coherence: float("volume.coherence"),
        strand_length: float("volume.strand_length"),
        coverage: float("volume.coverage"),
        crest: float("volume.crest"),
        lines: v.choice("trace.lookup", Lookup::from_word) == Lookup::Strand,
    }
}

/// Returns the resolved path of the file of the volume `name`, if the scene names one.
pub(super) fn volume_file(
    v: &Values,
    name: &str,
    folder: Option<&Path>,
    limits: &Limits,
) -> Result<Option<PathBuf>> {
    let key = key_of_volume(name, "volume.file");
    match v.text(&key) {
        file if file.is_empty() || measured::reads_source(v, name) => Ok(None),
        _ => {
            let file = sequence::file(v, name, &key, folder, limits)?;
            check_npz(&file)?;
            Ok(Some(file))
        }
    }
}

/// Returns the storage that the scene asks for, for the volume `name`. Coarse levels are made from all cells,
/// so with them sparse storage is refused and automatic storage is dense.
pub(super) fn asked_storage(v: &Values, name: &str) -> Result<StorageChoice> {
    let pyramid = v.choice("trace.filter", Prefilter::from_word) == Prefilter::Pyramid;
    let key = key_of_volume(name, "volume.storage");
    match v.choice(&key, StorageChoice::from_word) {
        StorageChoice::Sparse if pyramid => Err(Error::input(
            format!(
                "{key} = \"sparse\" with trace.filter = \"pyramid\": coarse levels are made from all cells"
            ),
            format!("set trace.filter=none, or {key}=dense"),
        )),
        StorageChoice::Auto if pyramid => Ok(StorageChoice::Dense),
        asked => Ok(asked),
    }
}

/// Returns the storage of a water volume within `memory` bytes, of which the picture needs `beside` for other
/// things, and checks the number of its curve points.
pub(super) fn water_storage(
    water: &WaterSpec,
    asked: StorageChoice,
    memory: u64,
    beside: u64,
) -> Result<Storage> {
    let curves = water.across as u128 * water.deep as u128;
    let points = curves << water.shape.levels;
    if points > 1 << 36 {
        return Err(Error::input(
            format!("curves.across × curves.deep × 2^levels makes {points} curve points"),
            "lower curves.across, curves.deep or curves.levels: at most 6.8e10",
        ));
    }
    storage_of(water, asked, memory, beside)
}

pub(super) fn image(v: &Values) -> Image {
    Image {
        width: v.count("image.width"),
        height: v.count("image.height"),
        samples: v.count("image.samples"),
        filter: v.choice("image.filter", Filter::from_word),
        alpha: v.is_on("image.alpha"),
        shift: [0.0; 2],
        rock_error: v.float("image.rock_error"),
        gamut: v.choice("image.primaries", Gamut::from_word),
        look: look(v),
    }
}

fn look(v: &Values) -> Look {
    Look {
        exposure: v.float("image.exposure"),
        auto_exposure: v.choice("image.auto_exposure", AutoExposure::from_word),
        bloom: v.float("image.bloom"),
        bloom_radius: v.float("image.bloom_radius"),
        temperature: v.float("image.temperature"),
        tint: v.float("image.tint"),
        tone: v.choice("image.tone", Tone::from_word),
        dither: v.choice("image.dither", Dither::from_word),
        vignette: v.float("image.vignette"),
        grain: v.float("image.grain"),
        grain_seed: v.count("image.grain_seed"),
    }
}

pub(super) fn trace(v: &Values) -> Trace {
    Trace {
        attenuation: match v.choice("trace.attenuation", AttenuationKind::from_word) {
            AttenuationKind::PathLength => Attenuation::PathLength { sigma: v.float("trace.sigma") },
            AttenuationKind::PerCell => Attenuation::PerCell { tau: v.float("trace.tau") },
        },
        max_cells: v.count("trace.max_cells"),
        early_end: v.float("trace.early_end"),
        layers: v.count("trace.layers"),
        filter: v.choice("trace.filter", Prefilter::from_word),
        lookup: v.choice("trace.lookup", Lookup::from_word),
    }
}

/// Returns the environment, if the scene has one.
pub(super) fn environment(v: &Values, folder: Option<&Path>, limits: &Limits) -> Result<Option<Environment>> {
    let source = match v.choice("environment.kind", EnvironmentKind::from_word) {
        EnvironmentKind::None => return Ok(None),
        EnvironmentKind::Sky => {
            let ground = v.triple("sky.ground");
            if ground.max_element() > 1.0 {
                return Err(Error::input(
                    format!("sky.ground = {ground} reflects more light than it receives"),
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
        EnvironmentKind::File => match v.text("environment.file") {
            file if file.is_empty() => {
                return Err(Error::input(
                    "environment.kind = \"file\" without a file",
                    "give environment.file an equirectangular .hdr or .exr",
                ));
            }
            file => Source::File(confine("environment.file", Path::new(&file), folder, &limits.allow_paths)?),
        },
    };
    let settings = Settings {
        intensity: v.float("environment.intensity"),
        turn: v.float("environment.turn"),
        azimuth: v.float("sky.azimuth"),
        lights: v.count("environment.lights"),
    };
    Environment::new(source, settings, &limits.environments, limits.memory).map(Some)
}

/// Returns the scene's own lights, relative to `origin`, those `of_meshes`, and the `sun` of its environment.
/// `others` is the number of directional lights that stand for the rest of the environment; they count
/// towards [`MAX_LIGHTS`].
pub(super) fn lights(
    v: &Values,
    origin: DVec3,
    of_meshes: Vec<Light>,
    sun: Option<Light>,
    others: usize,
) -> Result<Vec<Light>> {
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
        let position = || v.local_point(&key("position"), origin);
        let to_light = || {
            let direction = v.triple(&key("direction"));
            unit(direction).ok_or_else(|| {
                Error::input(
                    format!("{} = {direction} has no direction", key("direction")),
                    "give a vector towards the light",
                )
            })
        };
        let light = match v.choice(&key("kind"), LightKind::from_word) {
            LightKind::Directional => Light::Directional { to_light: to_light()?, intensity },
            LightKind::Point => Light::Point { position: position(), intensity },
            LightKind::Spot => {
                let cone = Cone::new(to_light()?, v.float(&key("angle")), v.float(&key("softness")));
                Light::Spot { position: position(), intensity, cone }
            }
        };
        if intensity != Vec3::ZERO {
            lights.push(light);
        }
    }
    lights.extend(of_meshes);
    lights.extend(sun);
    if lights.len() + others > MAX_LIGHTS {
        return Err(Error::input(
            format!("the scene has {} lights, including those of its environment", lights.len() + others),
            format!("at most {MAX_LIGHTS}"),
        ));
    }
    Ok(lights)
}

pub(super) fn camera(v: &Values, origin: DVec3) -> Result<Camera> {
    let [eye, target, up] = ["camera.eye", "camera.target", "camera.up"].map(|key| v.point(key));
    let unit = |v: DVec3| (v.length() > 1e-12).then(|| v.normalize());
    let forward = unit(target - eye)
        .ok_or_else(|| Error::input("camera.eye and camera.target are the same point", "move one of them"))?;
    let right = unit(forward.cross(unit(up).unwrap_or(DVec3::ZERO))).ok_or_else(|| {
        Error::input("camera.up is zero or along the view", "turn it away from the view direction")
    })?;
    Ok(Camera {
        origin,
        eye,
        right,
        up: right.cross(forward),
        forward,
        tan_half_fov: (v.float("camera.fov").to_radians() * 0.5).tan(),
        near: v.float("camera.near"),
    })
}

/// Returns the lens of the camera; `None` where it is a pinhole.
pub(super) fn lens(v: &Values, camera: &Camera) -> Option<Lens> {
    let [f_number, focus] = ["camera.f_number", "camera.focus"].map(|key| f64::from(v.float(key)));
    let focus = if focus > 0.0 { focus } else { camera.eye.distance(v.point("camera.target")) };
    (f_number > 0.0).then(|| Lens::new(camera.tan_half_fov.into(), f_number, focus))
}

pub(super) fn haze(v: &Values, origin: DVec3) -> Haze {
    Haze {
        density: v.float("haze.density"),
        color: v.triple("haze.color"),
        height: v.float("haze.scale_height"),
        level: (v.coordinate("haze.level") - origin.y) as f32,
        far: v.float("haze.far"),
    }
}

/// Returns the background, linear radiance.
pub(super) fn background(v: &Values) -> Background {
    Background { zenith: v.triple("background.zenith"), horizon: v.triple("background.horizon") }
}

pub(super) fn reflection(v: &Values) -> Result<Reflection> {
    Ok(match v.choice("light.reflection", ReflectionKind::from_word) {
        ReflectionKind::KajiyaKay => Reflection::KajiyaKay,
        ReflectionKind::Strand => Reflection::Strand(strand(v)),
        ReflectionKind::Hair => Reflection::Hair(hair(v)?),
    })
}

fn hair(v: &Values) -> Result<StrandParams> {
    let pigment = if v.is_set(HAIR_COLOR) {
        let color = v.triple(HAIR_COLOR);
        if color.max_element() > 1.0 {
            return Err(Error::input(
                format!("{HAIR_COLOR} = {color} reflects more light than it receives"),
                "choose components of at most 1; for more light raise lights.*.intensity",
            ));
        }
        Pigment::Color(color.as_dvec3())
    } else {
        Pigment::Melanin(v.float("hair.melanin"), v.float("hair.redness"))
    };
    let hair = Hair {
        eta: v.float("hair.eta"),
        tilt_degrees: v.float("hair.tilt"),
        roughness_m: v.float("hair.beta_m"),
        roughness_n: v.float("hair.beta_n"),
        pigment,
    };
    Ok(hair.strand())
}

fn strand(v: &Values) -> StrandParams {
    let water = Water {
        radius_m: v.float("strand.radius"),
        roughness_m: v.float("strand.roughness_m"),
        roughness_n: v.float("strand.roughness_n"),
        absorption: v.float("strand.absorption"),
        aeration: v.float("strand.aeration"),
        g: v.float("strand.g"),
    };
    water.strand()
}

pub(super) fn scattering(v: &Values) -> Result<Scattering> {
    let scattering = v.choice("light.scattering", Scattering::from_word);
    let visibility = v.choice("light.visibility", Visibility::from_word);
    if scattering == Scattering::Multiple && visibility == Visibility::None {
        return Err(Error::input(
            "light.scattering = \"multiple\" with light.visibility = \"none\": no light is left to scatter",
            "use light.visibility=cached or march",
        ));
    }
    Ok(scattering)
}

/// Replaces the reference `key` by its full path. A reference that the scene does not have or does not use
/// stays as it is.
///
/// # Errors
/// [`Error::Input`] where the file does not exist, lies outside the scene's folder and `allowed`, or has a
/// path that is not UTF-8.
pub fn resolve(values: &mut Values, key: &str, folder: Option<&Path>, allowed: &[PathBuf]) -> Result<()> {
    let file = values.text(key);
    let is_source = split_volume_key(key).map(|(name, own)| (name, own == "volume.source"));
    let is_other =
        is_source.is_some_and(|(name, is_source)| is_source != measured::reads_source(values, name));
    let unused = key == "environment.file"
        && values.choice("environment.kind", EnvironmentKind::from_word) != EnvironmentKind::File;
    let hidden = split_volume_key(key).is_some_and(|(name, _)| !volumes::is_shown(values, name));
    let is_left_out = meshes::is_hidden(values, key);
    if file.is_empty() || unused || is_other || hidden || is_left_out {
        return Ok(());
    }
    let numbered = match is_source {
        Some(_) => sequence::resolve(key, Path::new(&file), folder, allowed)?,
        None => None,
    };
    let whole = numbered.map_or_else(|| confine(key, Path::new(&file), folder, allowed), Ok)?;
    let whole = whole.into_os_string().into_string().map_err(|path| {
        Error::input(format!("{key}: {} is not UTF-8", path.display()), "rename its folders")
    })?;
    values.set(key, &Raw::Text(whole), &Place("the scene".into()))
}

/// Resolves a reference inside the scene's folder or an allowed one, and follows links. Without a folder the
/// reference is trusted. The meshes and grids of presets are no files, and stay as they are.
pub(super) fn confine(key: &str, file: &Path, folder: Option<&Path>, allowed: &[PathBuf]) -> Result<PathBuf> {
    let is_own = presets::mesh(file).is_some() || grid::own(file).is_some();
    let Some(folder) = folder.filter(|_| !is_own) else { return Ok(file.to_owned()) };
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
