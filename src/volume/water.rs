//! §2 Builder of volumes of gushing water (the paper's §2.2). Spatial fractal curves run from the face y = 0
//! to their twins on y = ny and give every cell they pass its direction. ρ and k are random in every cell, or
//! follow the strands.

use std::sync::Arc;

use super::flow::{self, Flow};
use super::storage::check_sparse;
use super::{Cells, VolumeTexture};
use crate::util::cache::{Cache, key};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::random::{self, Family, Stream};
use crate::volume::WaterSpec;

impl WaterSpec {
    /// Whether ρ and k can be computed from packed cells alone ([`set_density_and_reflection`]). If so, a
    /// change of k_d, k_s or their noise only packs the cells again and walks no curve.
    pub fn density_is_of_cells(&self) -> bool {
        self.structure.coherence == 0.0 && self.structure.coverage == 0.0
    }

    /// Bytes that building takes for each cell beside its vector: more than 0 if ρ follows the strands, or if
    /// cells keep lines.
    pub fn strand_bytes(&self) -> usize {
        let noise = if self.structure.coherence > 0.0 { size_of::<[f32; 2]>() } else { 0 };
        noise + if self.structure.lines { flow::LINE_BYTES } else { 0 }
    }
}

/// Builds the volume texture in dense storage.
///
/// # Errors
/// Returns an error if `monitor` ends the work.
pub fn build_water(spec: &WaterSpec, monitor: &dyn Monitor) -> Result<VolumeTexture> {
    let flow = Flow::new(spec, monitor)?;
    let mut cells = flow.cells().into();
    let follows_strands = !spec.density_is_of_cells();
    set(spec, &mut cells, follows_strands.then_some(&flow));
    Ok(VolumeTexture { size: spec.size, alpha: spec.alpha, cells })
}

/// Builds the same volume in sparse storage. Memory grows with the number of cells that curves pass: the
/// curves are walked once to mark those cells, and once more to add up their contributions.
///
/// # Errors
/// Returns [`crate::Error::Memory`] if the cells that curves pass need more than `memory` bytes, and an error
/// if `monitor` ends the work.
pub fn build_sparse_water(spec: &WaterSpec, memory: u64, monitor: &dyn Monitor) -> Result<VolumeTexture> {
    check_sparse(spec, 0, memory)?;
    let marks = flow::marked(spec, monitor)?;
    check_sparse(spec, marks.count(), memory)?;
    let mut bricks = marks.bricks();
    let flow = Flow::packed(spec, &bricks, monitor)?;
    bricks.fill(flow.cells());
    let mut cells = bricks.into();
    let follows_strands = !spec.density_is_of_cells();
    set(spec, &mut cells, follows_strands.then_some(&flow));
    Ok(VolumeTexture { size: spec.size, alpha: spec.alpha, cells })
}

/// Estimates how many cells a water volume stores in sparse storage.
pub fn expected_cells(spec: &WaterSpec) -> u64 {
    flow::expected_cells(spec)
}

/// Returns the volume of [`build_water`], from `cache` if it is there.
///
/// # Errors
/// Returns an error if `monitor` ends the work.
pub fn kept_water(spec: &WaterSpec, cache: &Cache, monitor: &dyn Monitor) -> Result<VolumeTexture> {
    let count = spec.size.iter().map(|&n| n as usize).product();
    // The cells do not depend on α, so neither does the key.
    let key = key("volume", BUILDER_VERSION, &WaterSpec { alpha: 0.0, ..*spec });
    let build = || {
        let volume = build_water(spec, monitor)?;
        Ok(Arc::unwrap_or_clone(volume.cells.dense().expect("the storage is dense").clone()))
    };
    let cells = cache.get("volumes", &key, count, build)?;
    Ok(VolumeTexture { size: spec.size, alpha: spec.alpha, cells: cells.into() })
}

/// Version of the builder, part of the key of volumes on disk. Raise it with every change of the cells that a
/// specification builds; a test compares their checksums.
pub const BUILDER_VERSION: u32 = 1;

/// Sets elements 1 and 3 of every cell with a direction: ρ = clamp(N(0,1) + 0.5, 0, 1) (before α) and
/// k = clamp(base + noise, 0, 1). Gives the builder's cells if [`WaterSpec::density_is_of_cells`] holds.
pub fn set_density_and_reflection(spec: &WaterSpec, cells: &mut Cells) {
    set(spec, cells, None);
}

/// Sets ρ, k_d and k_s of every cell with a direction; with `flow`, ρ follows the strands.
///
/// With coherence c the normal number of ρ is (c·strand + (1 − c)·cell)/√(c² + (1 − c)²). It has variance 1
/// again, so ρ keeps its distribution. Coverage then multiplies ρ by 1 − coverage·e^(−length of the strands
/// in the cell), so that strands end softly.
pub(super) fn set(spec: &WaterSpec, cells: &mut Cells, flow: Option<&Flow>) {
    let family = Family::new(spec.seed, Stream::Cell);
    let structure = &spec.structure;
    let (c, d) = (structure.coherence, 1.0 - structure.coherence);
    let root = (c * c + d * d).sqrt();
    // `stored` is the cell's index in the sums of `flow`. Random numbers follow from the linear index
    // `index`, so they do not depend on the storage.
    cells.change(|index, stored, cell| {
        if !cell.has_direction() {
            return cell;
        }
        let mut rng = family.member(index);
        let mut normal = || random::normal(&mut rng);
        let mut rho = normal();
        if let Some(flow) = flow {
            rho = (c * flow.noise(stored) + d * rho) / root;
        }
        rho += 0.5;
        let crest = structure.crest * (rho.clamp(0.0, 1.0) - 0.5);
        let k_d = spec.k_d + normal() * spec.k_noise + crest;
        let k_s = spec.k_s + normal() * spec.k_noise;
        if let Some(flow) = flow {
            let length = flow.directions[stored].length();
            rho = rho.clamp(0.0, 1.0) * (1.0 - structure.coverage * (-length).exp());
        }
        cell.with_density(rho, k_d, k_s)
    });
}
