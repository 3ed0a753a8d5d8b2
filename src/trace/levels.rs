//! §4 The volume's levels that a scene needs, and how they share one texture.

use std::sync::Arc;

use super::{Attenuation, Lookup, Prefilter, Trace, extinction};
use crate::mapping::Quad;
use crate::mapping::shell::Shell;
use crate::volume::{LevelAtlas, PyramidSpec, VolumeTexture, level_count};

/// Specification of the levels of volume `number`, from which rays through those of `quads` and `shells` that
/// show it are traced.
pub fn pyramid_spec(
    trace: &Trace,
    quads: &[Quad],
    shells: &[Arc<Shell>],
    number: u32,
    volume: &VolumeTexture,
) -> PyramidSpec {
    let filtered = trace.filter == Prefilter::Pyramid;
    PyramidSpec {
        coverage_bits: filtered.then(|| coverage_bits(trace, quads, shells, number, volume)),
        interpolated: trace.lookup == Lookup::Trilinear,
    }
}

/// Layout of those levels in one texture, for a volume of `size` cells.
pub fn level_atlas(trace: &Trace, size: [u32; 3]) -> LevelAtlas {
    let count = match trace.filter {
        Prefilter::None => 1,
        Prefilter::Pyramid => level_count(size),
    };
    LevelAtlas { size, count }
}

/// Optical depth across the depth of one cell, in bits (−log₂ T) per unit of its ρ code. The pyramid computes
/// the coverage of its cells with it. Path-length attenuation takes the mean thickness over the quads of
/// volume `number` that are not mist, and over its shells.
fn coverage_bits(
    trace: &Trace,
    quads: &[Quad],
    shells: &[Arc<Shell>],
    number: u32,
    volume: &VolumeTexture,
) -> f32 {
    let extinction = extinction(&trace.attenuation, volume.alpha);
    if matches!(trace.attenuation, Attenuation::PerCell { .. }) {
        return extinction;
    }
    let own = quads.iter().filter(|quad| quad.mist == 0.0 && quad.material.volume == number);
    let of_shells = shells.iter().filter(|shell| shell.volume == number).map(|shell| shell.mean_thickness());
    let strands = own.map(|quad| f64::from(quad.material.thickness_m)).chain(of_shells);
    let (count, sum) = strands.fold((0.0, 0.0), |(count, sum), thickness| (count + 1.0, sum + thickness));
    extinction * (sum / f64::max(count, 1.0)) as f32 / volume.size[2] as f32
}
