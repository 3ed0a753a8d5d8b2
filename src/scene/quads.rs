//! Builders of the volume's quads: the scene's own, those of its sheets and those of its splashes.

use glam::{DVec3, Quat, Vec2, Vec3};
use xxhash_rust::xxh3::xxh3_64;

use super::meshes::Carrier;
use super::names::likeliest;
use super::param::{POINT_MAX, WATER};
use super::read::MAX_QUADS;
use super::volumes::{used_materials, volume_of};
use super::{Recipe, Values};
use crate::mapping::{Billow, Ends, Material, Quad, Sheet, SheetFault, Splash, Surges, Tears};
use crate::util::error::{Error, Result};
use crate::util::unit::unit;

/// Length of the holes between the threads of a fall and between the drops of a splash, in their widths.
const THREADS: f32 = 8.0;
const DROPS: f32 = 2.0;

/// Materials of a scene.
struct Materials<'a> {
    /// Names of those with a table.
    names: Vec<String>,
    /// Volumes that they show.
    recipes: &'a [Recipe],
    /// Eye that mist may face, metres.
    eye: Vec3,
}

impl Materials<'_> {
    /// Returns the number of the volume `name`.
    fn volume(&self, name: &str) -> u32 {
        let number = self.recipes.iter().position(|recipe| recipe.name == name);
        number.expect("a volume that a quad shows has a recipe") as u32
    }
}

/// Returns the quads, relative to `origin`. Those whose material asks for it are turned towards `eye`.
/// `recipes` are those of the volumes that they show.
pub(super) fn quads(v: &Values, origin: DVec3, eye: Vec3, recipes: &[Recipe]) -> Result<Vec<Quad>> {
    let mut quads = Vec::new();
    let materials = &Materials { names: v.names("materials"), recipes, eye };
    for i in v.names("quads") {
        let key = format!("quads.{i}.corners");
        if !v.is_set(&key) {
            return Err(Error::input(
                format!("quad {i} has no corners"),
                format!("give {key} four points A, B, C, D"),
            ));
        }
        let (material, mist) = material(v, materials, &format!("quad {i}"), &format!("quads.{i}.material"))?;
        let quad = Quad::new(v.local_corners(&key, origin), material).map_err(|fault| {
            Error::input(
                format!("quad {i} ({key}) {}", fault.words()),
                "a quad needs four corners A, B, C, D in one plane, convex, in order around it",
            )
        })?;
        quads.push(Quad { mist, ..quad });
    }
    for name in v.names("sheets") {
        sheet_quads(v, origin, materials, &name, &mut quads)?;
    }
    for name in v.names("splashes") {
        splash_quads(v, origin, materials, &name, &mut quads)?;
    }
    Ok(quads)
}

/// Returns advice on the name of a material; `None` where the scene has it. Every scene has `water`.
pub(super) fn unknown_material(name: &str, materials: &[String]) -> Option<String> {
    let others = materials.iter().map(String::as_str).filter(|other| *other != "water");
    let known: Vec<&str> = std::iter::once("water").chain(others).collect();
    (!known.contains(&name)).then(|| match likeliest(name, known.iter().copied()) {
        Some(near) => format!("did you mean {near}? Otherwise add [materials.{name}]"),
        None => format!("add [materials.{name}], or use one of these: {}", known.join(", ")),
    })
}

/// Returns a warning about each material of the user's own that nothing has.
pub(super) fn unused_materials(v: &Values) -> Vec<String> {
    let used = used_materials(v);
    let names = v.names("materials").into_iter();
    let unused = names.filter(|name| {
        let path = format!("materials.{name}");
        // A scene without water of its own uses none of the materials of its base, and a printed scene has
        // the water that every scene has.
        let is_every_scenes = name == WATER && is_default(v, &path);
        !used.is_empty() && !is_every_scenes && !used.contains(name) && !v.has_base_under(&path)
    });
    let warning = |name: String| {
        let fix = match likeliest(&name, used.iter().map(String::as_str)) {
            Some(near) => format!("did you mean {near}?"),
            None => format!("give a sheet, splash, quad or mesh material = {name:?}"),
        };
        format!("nothing has the material {name}: {fix}")
    };
    unused.map(warning).collect()
}

/// Whether all keys of the table `path` have their defaults.
fn is_default(v: &Values, path: &str) -> bool {
    let plain = Values::default();
    let is_own = |key: &String| key.strip_prefix(path).is_some_and(|rest| rest.starts_with('.'));
    v.keys().iter().filter(|key| is_own(key)).all(|key| v.get(key) == plain.get(key))
}

/// Returns the material that `key` names, and its mist. `what` names the user of the material in messages.
fn material(v: &Values, materials: &Materials, what: &str, key: &str) -> Result<(Material, f32)> {
    let name = v.text(key);
    if let Some(fix) = unknown_material(&name, &materials.names) {
        return Err(Error::input(format!("{what} ({key}) has the unknown material {name:?}"), fix));
    }
    let float = |what: &str| v.float(&format!("materials.{name}.{what}"));
    let carrier = format!("materials.{name}.carrier");
    if v.choice(&carrier, Carrier::from_word) == Carrier::Shell {
        return Err(Error::input(
            format!(
                "{what} ({key}) has the material {name}, whose carrier is a shell: a shell lies on a mesh"
            ),
            format!("give it another material, or set {carrier}=face"),
        ));
    }
    let material = Material {
        thickness_m: float("thickness"),
        repeat_u: float("repeat_u"),
        repeat_v: float("repeat_v"),
        volume: materials.volume(&volume_of(v, &name)),
        billow: match float("billow") {
            0.0 => Billow::default(),
            strength => {
                Billow { strength, inverse_size: 1.0 / float("billow_size"), rise: float("billow_rise") }
            }
        },
    };
    Ok((material, float("mist")))
}

/// Adds the quads of a sheet.
fn sheet_quads(
    v: &Values,
    origin: DVec3,
    materials: &Materials,
    name: &str,
    quads: &mut Vec<Quad>,
) -> Result<()> {
    let sheet = sheet(v, origin, materials, name)?;
    let count = sheet.segments as usize * (sheet.borders().len() - 1);
    if quads.len() + count > MAX_QUADS {
        return Err(Error::input(
            format!("sheet {name} makes {count} quads, with the others {}", quads.len() + count),
            format!(
                "lower segments or columns of sheets, or use fewer of them: a scene has at most {MAX_QUADS} \
                 quads"
            ),
        ));
    }
    let made = sheet.quads().map_err(|SheetFault { segment, column, fault }| {
        Error::input(
            format!("sheet {name}: quad {segment} along, {column} across {}", fault.words()),
            format!(
                "sheets.{name}.points must run across sheets.{name}.across; the rounder the sheet, the less \
                 they may bend"
            ),
        )
    })?;
    quads.extend(made);
    Ok(())
}

/// Adds the quads of a splash.
fn splash_quads(
    v: &Values,
    origin: DVec3,
    materials: &Materials,
    name: &str,
    quads: &mut Vec<Quad>,
) -> Result<()> {
    let key = |what: &str| format!("splashes.{name}.{what}");
    let float = |what: &str| v.float(&key(what));
    let toward = v.triple(&key("toward"));
    let Some(toward) = unit(toward.with_y(0.0)) else {
        return Err(Error::input(
            format!("splash {name}: {} = {toward} has no direction along the ground", key("toward")),
            "give a vector that is not vertical",
        ));
    };
    let (material, mist) = material(v, materials, &format!("splash {name}"), &key("material"))?;
    let local = |what: &str| v.local_point(&key(what), origin);
    let splash = Splash {
        line: [local("from"), local(if v.is_set(&key("to")) { "to" } else { "from" })],
        drop_m: float("drop"),
        restitution: float("restitution"),
        elevation: float("elevation"),
        spread: float("spread"),
        toward,
        fan: float("fan"),
        count: v.count(&key("count")),
        segments: v.count(&key("segments")),
        width: float("width"),
        seed: v.int(&key("seed")) as u64,
        tears: Tears { strength: float("tear"), size: float("tear_size"), length: DROPS },
        material,
        mist,
    };
    let count: usize =
        splash.arcs().iter().map(|arc| arc.segments as usize * (arc.borders().len() - 1)).sum();
    if quads.len() + count > MAX_QUADS {
        return Err(Error::input(
            format!("splash {name} makes {count} quads, with the others {}", quads.len() + count),
            format!(
                "lower {} or segments, or use fewer sheets: a scene has at most {MAX_QUADS} quads",
                key("count")
            ),
        ));
    }
    for arc in splash.arcs() {
        let made = arc.quads().map_err(|SheetFault { segment, fault, .. }| {
            Error::input(
                format!("splash {name}: quad {segment} of an arc {}", fault.words()),
                format!(
                    "bring {} nearer to the other water, or raise its drop, restitution or width",
                    key("from")
                ),
            )
        })?;
        quads.extend(made);
    }
    Ok(())
}

/// Turns a sheet about the vertical through its middle until its rows are at right angles to the view, by at
/// most a quarter.
fn facing(points: Vec<Vec3>, across: Vec3, eye: Vec3) -> (Vec<Vec3>, Vec3) {
    let middle = points.iter().sum::<Vec3>() / points.len() as f32;
    let level = |v: Vec3| unit(v.with_y(0.0));
    let (Some(rows), Some(view)) = (level(across), level(eye - middle)) else {
        // From above, or with rows that stand upright, no turn helps.
        return (points, across);
    };
    let wanted = Vec3::Y.cross(view);
    let wanted = if wanted.dot(rows) < 0.0 { -wanted } else { wanted };
    let turn = Quat::from_rotation_arc(rows, wanted);
    (points.iter().map(|p| middle + turn * (*p - middle)).collect(), turn * across)
}

fn sheet(v: &Values, origin: DVec3, materials: &Materials, name: &str) -> Result<Sheet> {
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
    let local = |p: &Vec<f64>| (DVec3::from_slice(p) - origin).as_vec3();
    let points: Vec<Vec3> = points.iter().map(local).collect();
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
    let faces = mist > 0.0 && v.is_on(&format!("materials.{}.facing", v.text(&key("material"))));
    let (points, across) = if faces { facing(points, across, materials.eye) } else { (points, across) };
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
            is_soft: faces,
        },
        surges: Surges::new(
            float("surge"),
            v.count(&key("surges")),
            f64::from(materials.recipes[material.volume as usize].flow),
            xxh3_64(name.as_bytes()),
        ),
        tears: Tears { strength: float("tear"), size: float("tear_size"), length: THREADS },
        material,
        mist,
    })
}
