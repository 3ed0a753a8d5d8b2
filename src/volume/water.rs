//! §2.2 The builder for gushing water: spatial fractal curves from the face y = 0 to their twins on
//! y = ny give every cell they pass its direction; ρ and k are random per cell, or follow the strands.

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
    /// Whether ρ and k need no more than packed cells ([`set_density_and_reflection`]), so that a change of k's
    /// base costs a re-packing only.
    pub fn density_is_of_cells(&self) -> bool {
        self.structure.coherence == 0.0 && self.structure.coverage == 0.0
    }

    /// Bytes per cell that building needs where ρ follows the strands.
    pub fn strand_bytes(&self) -> usize {
        if self.structure.coherence > 0.0 { size_of::<[f32; 2]>() } else { 0 }
    }
}

/// Builds the volume texture, all cells stored.
pub fn build_water(spec: &WaterSpec, monitor: &dyn Monitor) -> Result<VolumeTexture> {
    let flow = Flow::new(spec, monitor)?;
    let cells: Vec<Cell> = flow.directions.par_iter().map(|&v| Cell::from_direction(v)).collect();
    let mut cells = cells.into();
    let of_cells = spec.density_is_of_cells();
    set(spec, &mut cells, (!of_cells).then_some(&flow));
    Ok(VolumeTexture { size: spec.size, alpha: spec.alpha, cells })
}

/// The same cells, stored in bricks. Memory grows with the cells that curves pass: they are walked
/// once to note which, once more to add up what they leave there.
///
/// # Errors
/// Where the cells that are passed need more than `memory` bytes.
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

/// About as many cells as a water volume stores in bricks.
pub fn expected_cells(spec: &WaterSpec) -> u64 {
    flow::expected_cells(spec)
}

/// As [`build_water`], or from `cache`.
pub fn kept_water(spec: &WaterSpec, cache: &Cache, monitor: &dyn Monitor) -> Result<VolumeTexture> {
    let count = spec.size.iter().map(|&n| n as usize).product();
    // α is not in the cells.
    let key = key("volume", BUILDER_VERSION, &WaterSpec { alpha: 0.0, ..*spec });
    let build = || {
        let volume = build_water(spec, monitor)?;
        Ok(Arc::unwrap_or_clone(volume.cells.dense().expect("all cells are stored").clone()))
    };
    let cells = cache.get("volumes", &key, count, build)?;
    Ok(VolumeTexture { size: spec.size, alpha: spec.alpha, cells: cells.into() })
}

/// Version of the builder: part of the key of volumes on disk. Raise it with every change of the cells that a spec
/// gives; a test compares their checksums.
pub const BUILDER_VERSION: u32 = 1;

/// Elements 1 and 3: ρ = clamp(N(0,1) + 0.5, 0, 1) (before α) and k = clamp(base + noise, 0, 1) in
/// every cell with a direction. Needs no curves, where [`WaterSpec::density_is_of_cells`].
pub fn set_density_and_reflection(spec: &WaterSpec, cells: &mut Cells) {
    set(spec, cells, None);
}

/// With coherence c the normal number of ρ is (c·strand + (1 − c)·cell)/√(c² + (1 − c)²), again one of
/// variance 1, so that the distribution of ρ stays; coverage then multiplies ρ with
/// 1 − coverage·e^(−length of the strands in the cell), so that strands end softly.
fn set(spec: &WaterSpec, cells: &mut Cells, flow: Option<&Flow>) {
    let family = Family::new(spec.seed, Stream::Cell);
    let structure = &spec.structure;
    let (c, d) = (structure.coherence, 1.0 - structure.coherence);
    let root = (c * c + d * d).sqrt();
    // `place`: in the sums of `flow`. Random numbers are those of the cell's linear index, wherever it is stored.
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
