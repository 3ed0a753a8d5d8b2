//! Recipes of volumes that were measured in simulations.

use std::path::Path;

use super::build::confine;
use super::param::key_of_volume;
use super::{Limits, Values};
use crate::util::error::{Error, Result};
use crate::util::words::words;
use crate::volume::{
    MeasuredSpec, ReflectBy, RhoRule, StrandSpec, VelocityAt, VelocityNames, Wanted, find_measured,
};

/// Most cells along a side of a measured volume.
const MOST_CELLS: u64 = 4096;

/// What the cells of a volume are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Builder {
    /// Spatial fractal curves.
    Curves,
    /// Grids of a simulation.
    Flow,
}

words! { Builder { Curves => "curves", Flow => "flow" } }

/// Whether the volume `name` is made of the grids of a simulation.
pub(super) fn is_measured(v: &Values, name: &str) -> bool {
    v.choice(&key_of_volume(name, "volume.builder"), Builder::from_word) == Builder::Flow
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
    let path = confine(&key("volume.source"), Path::new(&file), folder, &limits.allow_paths)?;
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
        second: (reflect == ReflectBy::Grid).then_some(second),
    };
    let (velocity, bounds, to_world) = find_measured(&path, &wanted, limits.memory)?;
    let strands = strands(v, name);
    if strands.is_some() && velocity == VelocityNames::None {
        return Err(Error::input(
            format!("{} without a velocity in {}", key("volume.strands"), path.display()),
            format!("name its grid in {}, or set {} to 0", key("volume.velocity"), key("volume.strands")),
        ));
    }
    let voxels = bounds.size();
    let longest = voxels.into_iter().max().unwrap_or(1);
    let cells = match v.count(&key("volume.cells")) {
        0 => longest,
        n if strands.is_some() => n.into(),
        n => u64::from(n).min(longest),
    };
    if cells > MOST_CELLS {
        return Err(Error::input(
            format!("{}: the grid {:?} has {longest} voxels along a side", path.display(), wanted.density),
            format!("set {} to {MOST_CELLS} or less, or crop the grid", key("volume.cells")),
        ));
    }
    let size = voxels.map(|n| ((n as f64 * cells as f64 / longest as f64).round() as u32).max(1));
    Ok(Some(MeasuredSpec {
        path,
        density: wanted.density,
        velocity,
        second: wanted.second,
        bounds,
        to_world,
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
