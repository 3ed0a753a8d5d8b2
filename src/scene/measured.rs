//! Recipes of volumes that were measured in simulations.

use std::path::Path;

use glam::{DAffine3, DVec3};

use super::param::key_of_volume;
use super::sequence::{self, Sequence};
use super::{Limits, Values};
use crate::grid::Bounds;
use crate::util::error::{Error, Result};
use crate::util::words::words;
use crate::volume::{
    LevelSetUnit, MeasuredSpec, ReflectBy, RhoRule, StrandSpec, Up, VelocityAt, VelocityNames, Wanted,
    find_measured,
};

/// Most cells along a side of a measured volume.
const MOST_CELLS: u64 = 4096;

/// Grids with k_d and k_s, as volumes are written.
const STORED: [&str; 2] = ["kd", "ks"];

/// What the cells of a volume are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Builder {
    /// Spatial fractal curves.
    Curves,
    /// Hairs on a skin.
    Fur,
    /// Woven yarns.
    Cloth,
    /// Long hair along the flow.
    Hair,
    /// Strands of a file.
    Strands,
    /// Rock, scree, moss and grass.
    Mountain,
    /// Loose grains.
    Grains,
    /// Skin.
    Skin,
    /// Grids of a simulation.
    Flow,
}

words! {
    Builder {
        Curves => "curves", Fur => "fur", Cloth => "cloth", Hair => "hair", Strands => "strands",
        Mountain => "mountain", Grains => "grains", Skin => "skin", Flow => "flow",
    }
}

/// Whether the volume `name` is made of the grids of a simulation.
pub(super) fn is_measured(v: &Values, name: &str) -> bool {
    v.choice(&key_of_volume(name, "volume.builder"), Builder::from_word) == Builder::Flow
}

/// Whether the volume `name` is made of the file in `volume.source`.
pub(super) fn reads_source(v: &Values, name: &str) -> bool {
    let builder = v.choice(&key_of_volume(name, "volume.builder"), Builder::from_word);
    [Builder::Flow, Builder::Strands].contains(&builder)
}

/// Returns the recipe of the measured volume `name`; `None` for a volume of curves.
pub(super) fn measured(
    v: &Values,
    name: &str,
    folder: Option<&Path>,
    limits: &Limits,
) -> Result<Option<MeasuredSpec>> {
    if !is_measured(v, name) {
        return Ok(None);
    }
    let key = |key: &str| key_of_volume(name, key);
    let float = |own: &str| v.float(&key(own));
    let file = v.text(&key("volume.source"));
    if file.is_empty() {
        return Err(Error::input(
            format!("{} = \"flow\" without a file", key("volume.builder")),
            format!("give {} the .vdb, .nvdb or .npz of a simulation", key("volume.source")),
        ));
    }
    let path = sequence::file(v, name, &key("volume.source"), folder, limits)?;
    let is_sequence = Sequence::of(v, name, folder).is_some();
    let reflect = v.choice(&key("volume.reflect"), ReflectBy::from_word);
    let second = v.text(&key("volume.reflect_grid"));
    if reflect == ReflectBy::Grid && second.is_empty() {
        return Err(Error::input(
            format!("{} = \"grid\" without a grid", key("volume.reflect")),
            format!("name one in {}", key("volume.reflect_grid")),
        ));
    }
    let wanted = Wanted {
        density: v.text(&key("volume.grid")),
        velocity: v.text(&key("volume.velocity")),
        second: match reflect {
            ReflectBy::Grid => Some(second),
            ReflectBy::Stored => Some(STORED[0].into()),
            _ => None,
        },
        specular: (reflect == ReflectBy::Stored).then(|| STORED[1].into()),
        may_be_empty: is_sequence,
    };
    let (velocity, bounds, to_world) = find_measured(&path, &wanted, limits.memory)?;
    let strands = strands(v, name);
    if strands.is_some() && velocity == VelocityNames::None {
        return Err(Error::input(
            format!("{} without a velocity in {}", key("volume.strands"), path.display()),
            format!("name its grid in {}, or set {} to 0", key("volume.velocity"), key("volume.strands")),
        ));
    }
    if strands.is_some() && reflect == ReflectBy::Stored {
        return Err(Error::input(
            format!("{} = \"stored\" with strands, which have k of their own", key("volume.reflect")),
            format!("set {} to another word, or {} to 0", key("volume.reflect"), key("volume.strands")),
        ));
    }
    let [edge_key, fine_key] = ["volume.voxels", "volume.fine"].map(key);
    let [edge, fine] = [&edge_key, &fine_key].map(|key| v.count(key));
    let bounds = whole_cells(bounds, edge).ok_or_else(|| {
        Error::input(
            format!("{}: the grid {:?} reaches the greatest index", path.display(), wanted.density),
            format!("set {edge_key}=1"),
        )
    })?;
    let cells = bounds.size().map(|n| n / u64::from(edge) * u64::from(fine));
    let longest = cells.into_iter().max().unwrap_or(1);
    if longest > MOST_CELLS {
        return Err(Error::input(
            format!("{}: the grid {:?} has {longest} cells along a side", path.display(), wanted.density),
            format!("at most {MOST_CELLS}: lower {fine_key}, or raise {edge_key}, or crop the grid"),
        ));
    }
    let size = cells.map(|n| n as u32);
    Ok(Some(MeasuredSpec {
        path,
        density: wanted.density,
        velocity,
        second: wanted.second,
        specular: wanted.specular,
        bounds,
        to_world,
        scene_from_file: scene_from_file(v, name, to_world),
        level_set_unit: v.choice(&key("volume.level_set_unit"), LevelSetUnit::from_word),
        velocity_scale: float("volume.velocity_scale"),
        size,
        rho: v.choice(&key("volume.rho"), RhoRule::from_word),
        rho_scale: float("volume.rho_scale"),
        velocity_at: v.choice(&key("volume.velocity_at"), VelocityAt::from_word),
        reflect,
        reflect_range: [float("volume.reflect_low"), float("volume.reflect_high")],
        k: [
            [float("volume.k_d"), float("volume.k_s")],
            [float("volume.reflect_k_d"), float("volume.reflect_k_s")],
        ],
        alpha: float("volume.alpha"),
        strands,
    }))
}

/// Returns the turn and the shift from the world of a volume's file to that of the scene.
fn scene_from_file(v: &Values, name: &str, to_world: DAffine3) -> DAffine3 {
    let [up, origin] = ["volume.up", "volume.origin"].map(|key| key_of_volume(name, key));
    let turn = DAffine3::from_mat3(v.choice(&up, Up::from_word).scene_from_file());
    match v.is_set(&origin) {
        true => {
            let corner = to_world.transform_point3(DVec3::splat(-0.5));
            turn * DAffine3::from_translation(v.point(&origin) - corner)
        }
        false => turn,
    }
}

/// Returns the strands of the measured volume `name`, if it has any.
fn strands(v: &Values, name: &str) -> Option<StrandSpec> {
    let float = |own: &str| v.float(&key_of_volume(name, own));
    let count = v.count(&key_of_volume(name, "volume.strands"));
    (count > 0).then(|| StrandSpec {
        count,
        h: float("curves.h"),
        amplitude: float("curves.amplitude"),
        coherence: float("volume.coherence"),
        strand_length: float("volume.strand_length"),
        coverage: float("volume.coverage"),
        k_noise: float("volume.k_noise"),
        seed: v.int(&key_of_volume(name, "volume.seed")) as u64,
    })
}

/// Returns bounds that reach out to multiples of `edge`; `None` where these are no indices.
fn whole_cells(bounds: Bounds, edge: u32) -> Option<Bounds> {
    let edge = i64::from(edge);
    let low = |x: i32| i32::try_from(i64::from(x).div_euclid(edge) * edge).ok();
    let high = |x: i32| i32::try_from((i64::from(x).div_euclid(edge) + 1) * edge - 1).ok();
    let all =
        |from: [i32; 3], to: &dyn Fn(i32) -> Option<i32>| Some([to(from[0])?, to(from[1])?, to(from[2])?]);
    Some(Bounds { min: all(bounds.min, &low)?, max: all(bounds.max, &high)? })
}
