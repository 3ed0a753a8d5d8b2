//! V at the vertices of a shell, eight values side by side. Twin of `Integrator::visibility_below`: every
//! value has the bits that it gets alone.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};
use glam::Vec3;

use super::cells::Store;
use super::hits::in_tile;
use super::rows::Rows;
use super::walk::Walk;
use crate::engine::cpu::integrate::shell_light::ENOUGH_BITS;
use crate::engine::cpu::integrate::{FrameVolume, Integrator};
use crate::light::Light;
use crate::mapping::shell::{End, LanePaths, LaneSegments, Shell, ShellPath};
use crate::trace::lookup::Level;
use crate::util::lanes::{LANES, Lanes3, Mask, Stored, lanes_of};
use crate::util::powers::exp2;

/// Values of V of one light in one shell.
pub struct Fill<'a> {
    pub shell: &'a Shell,
    pub volume: &'a FrameVolume,
    /// Cells of the volume.
    pub store: Store<'a>,
    pub light: &'a Light,
    /// Layers between which V is interpolated.
    pub layers: usize,
    pub max_cells: u32,
}

/// Light rays on their way from the vertices.
#[derive(Default)]
struct Rays {
    /// Number of each ray's value.
    values: [usize; LANES],
    /// Distance of the light, metres.
    far: Stored,
    /// Σ ρ code × metres.
    depth: Stored,
    /// Cells walked.
    cells: [i32; LANES],
    /// Parameters where the rays leave their tetrahedra, and the cells that they pass there.
    end: Stored,
    rows: Rows,
}

impl<'a> Fill<'a> {
    /// Values of V of light number `i` in shell number `number`. `None` if the volume is too large for lanes.
    pub fn new(integrator: &'a Integrator, number: usize, i: usize, layers: usize) -> Option<Self> {
        let shell = &*integrator.scene.shells[number];
        let volume = integrator.volume_of(shell);
        let store = Store::new(&Level::new(&volume.levels, 0))?;
        let light = &integrator.lights[i];
        Some(Fill { shell, volume, store, light, layers, max_cells: integrator.scene.trace.max_cells })
    }

    /// Returns the values with these numbers: vertex by vertex, from the outer to the inner surface.
    #[inline(always)]
    pub fn values<S: Simd>(&self, simd: S, numbers: Range<usize>) -> Vec<f32> {
        let first = numbers.start;
        let mut out = vec![1.0; numbers.len()];
        let mut next = numbers;
        let (mut paths, mut segments) = (LanePaths::default(), LaneSegments::default());
        let (mut rays, mut on_way) = (Rays::default(), 0u8);
        loop {
            for lane in lanes_of(!on_way) {
                on_way |= u8::from(self.start(lane, &mut paths, &mut rays, &mut next)) << lane;
            }
            if on_way == 0 {
                return out;
            }
            let goes_on = paths.next(simd, on_way, &mut segments);
            let enters = self.through(simd, on_way, &segments, &mut rays);
            for lane in lanes_of(on_way & !(goes_on & enters)) {
                let leaves = segments.end[lane] == End::Inner && enters >> lane & 1 == 1;
                if self.shell.skin && leaves && segments.t[1].0[lane] < rays.far.0[lane] {
                    rays.depth.0[lane] = f32::INFINITY;
                }
                out[rays.values[lane] - first] = exp2(-self.volume.extinction * rays.depth.0[lane]);
            }
            on_way &= goes_on & enters;
        }
    }

    /// Gives a lane the ray of the next value, or of a later one that has a way. Returns whether there is
    /// any.
    fn start(
        &self,
        lane: usize,
        paths: &mut LanePaths<'a>,
        rays: &mut Rays,
        next: &mut Range<usize>,
    ) -> bool {
        for k in next {
            let (vertex, layer) = (k / (self.layers + 1), k % (self.layers + 1));
            let depth = layer as f32 / self.layers as f32;
            let (point, tetrahedron) = self.shell.below_vertex(vertex, depth);
            let to_light = self.light.at(point).0;
            let path = ShellPath::inside(self.shell, tetrahedron, point, to_light);
            if path.is_some_and(|path| paths.start(lane, &path)) {
                rays.values[lane] = k;
                rays.far.0[lane] = self.light.distance(point);
                rays.depth.0[lane] = 0.0;
                rays.cells[lane] = 0;
                return true;
            }
        }
        false
    }

    /// Walks through a tetrahedron in each of the lanes `bits`. Returns those that had not ended before it.
    #[inline(always)]
    fn through<S: Simd>(&self, simd: S, bits: u8, segments: &LaneSegments, rays: &mut Rays) -> u8 {
        let zero = f32x8::splat(simd, 0.0);
        let far = rays.far.load(simd);
        let depth = rays.depth.load(simd);
        let count = i32x8::load_array_ref(simd, &rays.cells);
        let most = i32x8::splat(simd, self.max_cells.min(i32::MAX as u32) as i32);
        let [t_in, t_out] = [segments.t[0].load(simd), segments.t[1].load(simd)];
        let enough = f32x8::splat(simd, ENOUGH_BITS / self.volume.extinction);
        let ended = t_in.simd_ge(far) | count.simd_ge(most) | depth.simd_ge(enough);
        let enters = Mask::from_bitmask(simd, bits.into()) & !ended;
        let mut mapped = 0u8;
        for lane in lanes_of(enters.to_bitmask() as u8) {
            mapped |= u8::from(self.shell.is_mapped(segments.prism[lane])) << lane;
        }

        let n = Vec3::from_array(self.volume.size.map(|n| n as f32));
        let [from, to] = [segments.at[0].load(simd).scaled(n), segments.at[1].load(simd).scaled(n)];
        let length = t_out - t_in;
        let is_long = length.simd_gt(zero);
        let straight = Lanes3::splat(simd, Vec3::Z);
        let direction = to.minus(from).over(length).or(is_long, straight);
        let before = (-t_in).max(zero);
        let t_end = t_out.min(far) - t_in - before;
        let [nx, ny] = [f32x8::splat(simd, n.x), f32x8::splat(simd, n.y)];
        let x = in_tile(simd, from.x, nx) + direction.x * before;
        let y = in_tile(simd, from.y - self.volume.flow_cells, ny) + direction.y * before;
        let origin =
            Lanes3 { x: in_tile(simd, x, nx), y: in_tile(simd, y, ny), z: from.z + direction.z * before };
        let mut walk = Walk::new(simd, &self.store.units, origin, direction);
        let mut active = Mask::from_bitmask(simd, mapped.into());
        rays.end.store(t_end);
        while active.any_true() {
            let bits = active.to_bitmask() as u8;
            let counted = i32x8::load_array_ref(simd, &rays.cells);
            active = rays.rows.walk(simd, &mut walk, active, t_end, most - counted);
            for lane in lanes_of(bits) {
                let Rays { rows, depth, end, cells, .. } = &mut *rays;
                let (end, mut own) = (end.0[lane], depth.0[lane]);
                rows.cells(lane, &self.store, |row, cell| {
                    let [enter, leave] = rows.crossing(lane, row, end);
                    own += cell.rho_code() as f32 * (leave - enter);
                });
                depth.0[lane] = own;
                cells[lane] += rows.count[lane];
            }
        }
        enters.to_bitmask() as u8
    }
}
