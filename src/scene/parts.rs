//! The parts of a scene, made from values that passed the table and checked against one another.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec2, Vec3};

use super::param::POINT_MAX;
use super::read::MAX_QUADS;
use super::sheet::{Ends, Sheet, SheetFault};
use super::{
    AutoExposure, Camera, Cone, Filter, Light, Limits, Look, MAX_LIGHTS, Place, Quad, Raw, Scattering, Tone,
    Values,
};
use crate::environment::{Environment, Settings, Sky, Source};
use crate::error::{Error, Result};
use crate::haze::Haze;
use crate::mapping::Material;
use crate::strand::StrandParams;
use crate::volume::Structure;

pub(super) fn quads(v: &Values) -> Result<Vec<Quad>> {
    let mut quads = Vec::new();
    let materials = v.names("materials");
    for i in v.names("quads") {
        let key = format!("quads.{i}.corners");
        if !v.is_set(&key) {
            return Err(Error::input(
                format!("quad {i} has no corners"),
                format!("give {key} four points A, B, C, D"),
            ));
        }
        let (material, mist) = material(v, &materials, &format!("quad {i}"), &format!("quads.{i}.material"))?;
        let quad = Quad::new(v.corners(&key), material).map_err(|fault| {
            Error::input(
                format!("quad {i} ({key}) {}", fault.words()),
                "a quad needs four corners A, B, C, D in one plane, convex, in order around it",
            )
        })?;
        quads.push(Quad { mist, ..quad });
    }
    for name in v.names("sheets") {
        sheet_quads(v, &materials, &name, &mut quads)?;
    }
    Ok(quads)
}

/// The material that `key` of `what` names, and its mist.
fn material(v: &Values, materials: &[String], what: &str, key: &str) -> Result<(Material, f32)> {
    let name = v.text(key);
    if name != "water" && !materials.contains(&name) {
        let known = materials.join(", ");
        return Err(Error::input(
            format!("{what} ({key}) has the unknown material {name:?}"),
            format!("add [materials.{name}] or use one of: water {known}"),
        ));
    }
    let of = |what: &str| v.float(&format!("materials.{name}.{what}"));
    let material =
        Material { thickness_m: of("thickness"), repeat_u: of("repeat_u"), repeat_v: of("repeat_v") };
    Ok((material, of("mist")))
}

/// Adds the quads of a sheet.
fn sheet_quads(v: &Values, materials: &[String], name: &str, quads: &mut Vec<Quad>) -> Result<()> {
    let sheet = sheet(v, materials, name)?;
    let count = sheet.segments as usize * (sheet.borders().len() - 1);
    if quads.len() + count > MAX_QUADS {
        return Err(Error::input(
            format!("sheet {name} makes {count} quads, with the others {}", quads.len() + count),
            format!("lower sheets.{name}.segments or columns: a scene has at most {MAX_QUADS} quads"),
        ));
    }
    let made = sheet.quads().map_err(|SheetFault { segment, column, fault }| {
        Error::input(
            format!("sheet {name}: quad {segment} along, {column} across {}", fault.words()),
            format!(
                "sheets.{name}.points must go across sheets.{name}.across, and the more it is round, the less they \
                 may bend"
            ),
        )
    })?;
    quads.extend(made);
    Ok(())
}

fn sheet(v: &Values, materials: &[String], name: &str) -> Result<Sheet> {
    let key = |what: &str| format!("sheets.{name}.{what}");
    let bad = |what: String, fix: String| Err(Error::input(format!("sheet {name}: {what}"), fix));
    let points = v.series(&key("points"));
    let far = |x: &f64| x.abs() > POINT_MAX;
    if points.len() < 2 || points.iter().any(|p| p.len() != 3 || p.iter().any(far)) {
        return bad(
            "it has no profile".into(),
            format!("give {} at least two points of three numbers, ±{POINT_MAX:e}", key("points")),
        );
    }
    let points: Vec<Vec3> = points.iter().map(|p| DVec3::new(p[0], p[1], p[2]).as_vec3()).collect();
    let size = points.iter().map(|p| p.distance(points[0])).fold(0.0, f32::max);
    if let Some(i) = points.windows(2).position(|p| p[0].distance(p[1]) <= 1e-5 * size) {
        return bad(
            format!("points {i} and {} are the same", i + 1),
            format!("remove one from {}", key("points")),
        );
    }
    let mut widths: Vec<f32> = Vec::new();
    for width in v.series(&key("widths")) {
        match width[..] {
            [width] if width > 0.0 && width <= POINT_MAX => widths.push(width as f32),
            _ => return bad("a width is no number above 0".into(), format!("correct {}", key("widths"))),
        }
    }
    if widths.len() < 2 {
        widths = vec![widths.first().copied().unwrap_or(1.0); points.len()];
    }
    if widths.len() != points.len() {
        return bad(
            format!("{} widths and {} points", widths.len(), points.len()),
            format!("give {} one for each point, or one for all", key("widths")),
        );
    }
    let Some(across) = unit(v.triple(&key("across"))) else {
        return bad(format!("{} has no direction", key("across")), "give a vector across the flow".into());
    };
    let (material, mist) = material(v, materials, &format!("sheet {name}"), &key("material"))?;
    let (round, columns) = (v.float(&key("round")), v.count(&key("columns")));
    if round == 1.0 && (columns < 3 || material.repeat_u.fract() != 0.0) {
        return bad(
            format!("a tube of {columns} columns with {} copies of the volume around it", material.repeat_u),
            "a tube needs 3 columns or more, and a whole number for repeat_u of its material".into(),
        );
    }
    let float = |what: &str| v.float(&key(what));
    Ok(Sheet {
        points,
        widths,
        across,
        segments: v.count(&key("segments")),
        columns,
        round,
        v0: float("v0"),
        stretch: float("stretch"),
        offset: Vec2::new(float("offset_u"), float("offset_v")),
        ends: Ends {
            edge: float("edge"),
            breakup: float("breakup"),
            fade: float("fade"),
            head: float("head"),
        },
        material,
        mist,
    })
}

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

/// Normalised in float64, so that neither tiny nor huge vectors lose their direction.
fn unit(v: Vec3) -> Option<Vec3> {
    let d = v.as_dvec3();
    (d.length() > 1e-12).then(|| d.normalize().as_vec3())
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
