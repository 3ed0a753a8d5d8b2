//! Rays of the lanes in one tetrahedron of a shell, in cells.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::cells::Store;
use super::hits::in_tile;
use super::walk::{LaneUnits, Units};
use crate::engine::cpu::integrate::Integrator;
use crate::mapping::shell::LaneSegments;
use crate::trace::Prefilter;
use crate::trace::lookup::Level;
use crate::util::lane_powers::log2;
use crate::util::lanes::{Floats, LANES, Lanes3, Stored, Stored3, floor_cell};

/// Numbers of the lanes' rays.
#[derive(Default)]
pub struct Rays {
    pub d: Stored3,
    /// Origin of the path, and its distance from the eye, metres.
    pub origin: Stored3,
    pub metres: Stored,
    /// Distance of the opaque scene from the path's origin, and parameter where the ray begins, metres.
    pub t_end: Stored,
    pub t_begin: Stored,
    pub transmittance: Stored,
    /// Cells walked.
    pub cells: [i32; LANES],
    /// Number of cells of the volume along x, y and z.
    pub n: Stored3,
    pub flow_cells: Stored,
    pub extinction: Stored,
    /// Number of the coarsest level.
    pub coarsest: Stored,
    /// Volume of a cell of the tetrahedron, m³.
    pub cell: Stored,
}

/// Parts of the rays in their tetrahedra.
pub struct Way<S: Simd> {
    /// Where they begin, inside the tile, and their directions per metre, in cells.
    pub start: Lanes3<S>,
    pub direction: Lanes3<S>,
    /// Metres.
    pub length: Floats<S>,
    /// Share of the coarser of the two levels.
    pub share: Floats<S>,
    /// Number of the finer one.
    pub level: [u32; LANES],
}

impl Rays {
    /// Maps the segments to cells.
    #[inline(always)]
    pub fn way<S: Simd>(&self, simd: S, segments: &LaneSegments, integrator: &Integrator) -> Way<S> {
        let splat = |x: f32| f32x8::splat(simd, x);
        let n = self.n.load(simd);
        let [from, to] = [segments.at[0].load(simd).by(n), segments.at[1].load(simd).by(n)];
        let [t_in, t_out] = [segments.t[0].load(simd), segments.t[1].load(simd)];
        let length = t_out - t_in;
        let direction = to.minus(from).over(length);
        let start = Lanes3 {
            x: in_tile(simd, from.x, n.x),
            y: in_tile(simd, from.y - self.flow_cells.load(simd), n.y),
            z: from.z,
        };
        let mut way = Way { start, direction, length, share: splat(0.0), level: [0; LANES] };
        if integrator.scene.trace.filter != Prefilter::None {
            let forward = Lanes3::splat(simd, integrator.scene.camera.forward.as_vec3());
            let cell_area = self.cell.load(simd) * direction.dot(direction).sqrt();
            let c = self.d.load(simd).dot(forward);
            let t = self.metres.load(simd) + t_in;
            let across = splat(integrator.footprint) * (c * c * c) * (t * t) / cell_area;
            let exact = splat(0.5) * log2(simd, across.max(splat(1e-30)));
            let exact = exact.max(splat(0.0)).min(self.coarsest.load(simd));
            let whole = floor_cell(simd, exact);
            way.share = exact - whole.to_float::<f32x8<S>>();
            way.level = whole.to_array().map(|level| level as u32);
        }
        way
    }
}

/// Levels that the lanes walk through.
pub struct Levels<S: Simd> {
    pub units: LaneUnits<S>,
    pub scale: Lanes3<S>,
}

impl<S: Simd> Levels<S> {
    #[inline(always)]
    pub fn new(simd: S, levels: &[(usize, Level, Store)], numbers: &[usize; LANES]) -> Self {
        let (_, level, store) = &levels[numbers[0]];
        if *numbers == [numbers[0]; LANES] {
            let units = LaneUnits::splat(simd, &store.units);
            return Levels { units, scale: Lanes3::splat(simd, level.scale) };
        }
        let units: [Units; LANES] = numbers.map(|number| levels[number].2.units);
        let scale = Stored3::from_fn(|lane| levels[numbers[lane]].1.scale);
        Levels { units: LaneUnits::new(simd, &units), scale: scale.load(simd) }
    }
}
