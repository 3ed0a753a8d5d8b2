//! §2.2 The builder for gushing water: spatial fractal curves from the face y = 0 to the same points of the
//! face y = ny give every cell they pass its direction. ρ and k are random in each cell, or follow the
//! strands.

use std::sync::Arc;

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use super::flow::{self, Flow};
use super::storage::check_sparse;
use super::{Cell, Cells, VolumeTexture};
use crate::util::cache::{Cache, key};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::random::{Family, Stream};
use crate::volume::WaterSpec;

impl WaterSpec {
    /// Returns whether ρ and k depend on the packed cells alone. If so, [`set_density_and_reflection`]
    /// applies a new base of k without walking the curves again.
    pub fn density_is_of_cells(&self) -> bool {
        self.structure.coherence == 0.0 && self.structure.coverage == 0.0
    }

    /// Returns the extra bytes per cell that building needs if ρ follows the strands, else 0.
    pub fn strand_bytes(&self) -> usize {
        if self.structure.coherence > 0.0 { size_of::<[f32; 2]>() } else { 0 }
    }
}

/// Builds the volume texture with dense storage.
///
/// # Errors
/// Any error with which `monitor` stops the work.
pub fn build_water(spec: &WaterSpec, monitor: &dyn Monitor) -> Result<VolumeTexture> {
    let flow = Flow::new(spec, monitor)?;
    let cells: Vec<Cell> = flow.directions.par_iter().map(|&v| Cell::from_direction(v)).collect();
    let mut cells = cells.into();
    let of_cells = spec.density_is_of_cells();
    set(spec, &mut cells, (!of_cells).then_some(&flow));
    Ok(VolumeTexture { size: spec.size, alpha: spec.alpha, cells })
}

/// Builds the same cells as [`build_water`], stored in bricks. Memory grows with the number of cells that the
/// curves pass. The curves are walked twice: first to mark those cells, then to sum their contributions.
///
/// # Errors
/// An error if the cells need more than `memory` bytes, or if `monitor` stops the work.
pub fn build_sparse_water(spec: &WaterSpec, memory: u64, monitor: &dyn Monitor) -> Result<VolumeTexture> {
    check_sparse(spec, 0, memory)?;
    let marks = flow::marked(spec, monitor)?;
    check_sparse(spec, marks.count(), memory)?;
    let mut bricks = marks.bricks();
    let flow = Flow::packed(spec, &bricks, monitor)?;
    bricks.fill(flow.directions.par_iter().map(|&v| Cell::from_direction(v)).collect());
    let mut cells = bricks.into();
    let of_cells = spec.density_is_of_cells();
    set(spec, &mut cells, (!of_cells).then_some(&flow));
    Ok(VolumeTexture { size: spec.size, alpha: spec.alpha, cells })
}

/// Estimates the number of cells that a water volume stores in bricks.
pub fn expected_cells(spec: &WaterSpec) -> u64 {
    flow::expected_cells(spec)
}

/// Reads the volume of `spec` from `cache`, or builds it with [`build_water`].
///
/// # Errors
/// Any error with which `monitor` stops the work.
pub fn kept_water(spec: &WaterSpec, cache: &Cache, monitor: &dyn Monitor) -> Result<VolumeTexture> {
    let count = spec.size.iter().map(|&n| n as usize).product();
    // The cells do not contain α.
    let key = key("volume", BUILDER_VERSION, &WaterSpec { alpha: 0.0, ..*spec });
    let build = || {
        let volume = build_water(spec, monitor)?;
        Ok(Arc::unwrap_or_clone(volume.cells.dense().expect("all cells are stored").clone()))
    };
    let cells = cache.get("volumes", &key, count, build)?;
    Ok(VolumeTexture { size: spec.size, alpha: spec.alpha, cells: cells.into() })
}

/// Version of the builder, part of the key of cached volumes. Raise it with every change of the cells that a
/// spec gives; a test compares their checksums.
pub const BUILDER_VERSION: u32 = 1;

/// Elements 1 and 3: ρ = clamp(N(0,1) + 0.5, 0, 1) (before α) and k = clamp(base + noise, 0, 1) in
/// every cell with a direction. Correct only if [`WaterSpec::density_is_of_cells`]: it uses no curves.
pub fn set_density_and_reflection(spec: &WaterSpec, cells: &mut Cells) {
    set(spec, cells, None);
}

/// Sets ρ, k_d and k_s of every cell with a direction.
///
/// With coherence c the normal variate of ρ is (c·strand + (1 − c)·cell)/√(c² + (1 − c)²). Its variance is 1
/// again, so the distribution of ρ stays. Coverage then multiplies ρ by 1 − coverage·e^(−l), where l is the
/// length of the strands in the cell, so that strands end softly.
fn set(spec: &WaterSpec, cells: &mut Cells, flow: Option<&Flow>) {
    let family = Family::new(spec.seed, Stream::Cell);
    let structure = &spec.structure;
    let (c, d) = (structure.coherence, 1.0 - structure.coherence);
    let root = (c * c + d * d).sqrt();
    // `place` indexes the sums of `flow`. The random numbers depend on the linear index, not on the storage.
    cells.change(|index, place, cell| {
        if !cell.has_direction() {
            return cell;
        }
        let mut rng = family.member(index);
        let mut normal = || normal_rand(&mut rng);
        let mut rho = normal();
        if let Some(flow) = flow {
            rho = (c * flow.noise(place) + d * rho) / root;
        }
        rho += 0.5;
        let crest = structure.crest * (rho.clamp(0.0, 1.0) - 0.5);
        let k_d = spec.k_d + normal() * spec.k_noise + crest;
        let k_s = spec.k_s + normal() * spec.k_noise;
        if let Some(flow) = flow {
            let length = flow.directions[place].length();
            rho = rho.clamp(0.0, 1.0) * (1.0 - structure.coverage * (-length).exp());
        }
        cell.with_density(rho, k_d, k_s)
    });
}

/// The paper's normal_rand(): mean 0, variance 1.
fn normal_rand(rng: &mut Pcg64Mcg) -> f32 {
    StandardNormal.sample(rng)
}
