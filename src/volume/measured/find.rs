//! Grids of a file that a measured volume is made of.

use std::path::Path;

use super::VelocityNames;
use crate::grid::{self, Bounds, Summary};
use crate::util::error::{Error, Result};
use glam::DAffine3;

/// Names of grids as a scene gives them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// Name of the density's grid.
    pub density: String,
    /// Name of the velocity's grid, `none`, or nothing for one of the usual names.
    pub velocity: String,
    /// Name of the grid that k follows, or of that of k_d.
    pub second: Option<String>,
    /// Name of the grid of k_s.
    pub specular: Option<String>,
    /// Whether the density may have no active samples, as before the first smoke of a simulation. It then
    /// covers the voxel at index 0.
    pub may_be_empty: bool,
}

/// Usual names of the velocity.
const VELOCITY: [&str; 3] = ["velocity", "vel", "v"];
/// Usual names of its components, with those in front of them.
const PARTS: [[&str; 3]; 5] =
    [["_x", "_y", "_z"], [".x", ".y", ".z"], ["x", "y", "z"], ["X", "Y", "Z"], ["_X", "_Y", "_Z"]];
/// Components with names of their own.
const UVW: [&str; 3] = ["u", "v", "w"];
/// Word for no velocity.
const NONE: &str = "none";

/// Finds the grids of a file. Returns their names, the voxels that the density covers, and its transform.
///
/// # Errors
/// [`Error::Input`] where the file has no such grids, or the density is empty or not affine; those of
/// [`grid::list`] and [`grid::read`].
pub fn find_measured(path: &Path, wanted: &Wanted, budget: u64) -> Result<(VelocityNames, Bounds, DAffine3)> {
    let all = grid::list(path, budget)?;
    let density = named(path, &all, &wanted.density, "volume.grid")?;
    if let Some(second) = &wanted.second {
        let key = if wanted.specular.is_some() { "volume.reflect" } else { "volume.reflect_grid" };
        named(path, &all, second, key)?;
    }
    if let Some(specular) = &wanted.specular {
        named(path, &all, specular, "volume.reflect")?;
    }
    let velocity = velocity(path, &all, &wanted.velocity)?;
    let bounds = match density.bounds {
        Some(bounds) => Some(bounds),
        // Some files do not say.
        None => grid::read(path, &density.name, budget)?.bounds(),
    };
    let fault = |what: &str, fix: &str| {
        Error::input(format!("{}: the grid {:?} {what}", path.display(), density.name), fix)
    };
    let empty = wanted.may_be_empty.then_some(Bounds { min: [0; 3], max: [0; 3] });
    let bounds = bounds.filter(|bounds| bounds.size().iter().all(|&n| n > 0)).or(empty).ok_or_else(|| {
        fault("has no active samples", "name another grid, or export a frame that has matter")
    })?;
    let to_world = density.to_world.filter(|to_world| {
        let volume = to_world.matrix3.determinant();
        to_world.is_finite() && volume.is_finite() && volume != 0.0
    });
    let to_world = to_world.ok_or_else(|| {
        fault(
            "has no affine transform to the world",
            "resample it to a grid of boxes in the program that wrote it",
        )
    })?;
    Ok((velocity, bounds, to_world))
}

/// Returns the grid of a name. `key` is the key that gives it.
fn named<'a>(path: &Path, all: &'a [Summary], name: &str, key: &str) -> Result<&'a Summary> {
    let Some(found) = all.iter().find(|own| own.name == name) else {
        return Err(Error::input(
            format!("{}: there is no grid {name:?}", path.display()),
            format!("set {key} to one of its grids: {}", list(all)),
        ));
    };
    match &found.refusal {
        None => Ok(found),
        Some(why) => {
            Err(Error::input(format!("{}: the grid {name:?} cannot be read", path.display()), why.clone()))
        }
    }
}

/// Lists the names of grids.
fn list(all: &[Summary]) -> String {
    let names: Vec<String> = all.iter().take(8).map(|own| own.name.chars().take(32).collect()).collect();
    match names.is_empty() {
        true => "it has none".into(),
        false => names.join(", ") + if all.len() > 8 { " and others" } else { "" },
    }
}

/// Whether a grid holds vectors, by the words of its format.
fn is_vector(own: &Summary) -> bool {
    own.kind.to_ascii_lowercase().contains("vec") || own.kind.ends_with("× 3")
}

/// Finds the grids of the velocity.
fn velocity(path: &Path, all: &[Summary], wanted: &str) -> Result<VelocityNames> {
    let find = |name: &str| all.iter().find(|own| own.name == name && own.refusal.is_none());
    let vector = |name: &str| find(name).filter(|own| is_vector(own));
    let components = |names: [String; 3]| {
        let have = names.iter().all(|name| find(name).is_some_and(|own| !is_vector(own)));
        have.then_some(VelocityNames::Components(names))
    };
    let parts_of =
        |name: &str| PARTS.iter().find_map(|parts| components(parts.map(|p| format!("{name}{p}"))));
    match wanted {
        NONE => Ok(VelocityNames::None),
        "" => Ok(VELOCITY
            .iter()
            .find_map(|name| vector(name).map(|own| VelocityNames::Vector(own.name.clone())))
            .or_else(|| VELOCITY.iter().find_map(|name| parts_of(name)))
            .or_else(|| components(UVW.map(str::to_owned)))
            .unwrap_or_default()),
        name => {
            if let Some(own) = vector(name) {
                return Ok(VelocityNames::Vector(own.name.clone()));
            }
            if let Some(parts) = parts_of(name) {
                return Ok(parts);
            }
            let own = named(path, all, name, "volume.velocity")?;
            Err(Error::input(
                format!("{}: the grid {name:?} holds {}, and no vectors", path.display(), own.kind),
                format!(
                    "name a grid of vectors, or export {name}_x, {name}_y and {name}_z; volume.velocity=none \
                     leaves the velocity out"
                ),
            ))
        }
    }
}
