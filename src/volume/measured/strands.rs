//! Strands along a measured flow: the paper's method (§2.1 and §2.2) with measured directions.
//!
//! In the paper, fractal curves run straight from one face of the volume to the other. Here each runs along a
//! path of the flow: a place with matter is drawn, and the velocity is followed from there both ways, until
//! the matter ends. The fractal's displacement moves the points of the path sideways. What the curves then
//! do to the cells that they pass is what they do in a volume of water. A cell between strands is empty.
//!
//! Simulations are coarse, and threads of water are fine. So the cells may be smaller than the voxels.

use glam::{DMat3, DVec3, Vec3, Vec4};
use rand::{Rng, RngExt};
use rayon::prelude::*;

use super::build::{Density, Measured};
use super::field::{Field, Source, curl};
use super::{MeasuredSpec, ReflectBy, StrandSpec};
use crate::curve::{CurveShape, levels_for, spatial_fractal_curve};
use crate::grid::BlockData;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::random::{Family, Stream};
use crate::volume::flow::Flow;
use crate::volume::storage::check_budget;
use crate::volume::water::set;
use crate::volume::{Cell, Cells, Structure, WaterSpec};

/// Step along a path, voxels.
const STEP: f64 = 0.5;
/// Most steps from a seed one way, in lengths of the volume's longest side. A path in an eddy has no end.
const MOST_SIDES: f64 = 2.0;
/// Share of the largest density below which a path ends.
const LEAST_DENSITY: f64 = 0.02;
/// Distance from the faces of the volume that strands keep, cells. Beyond a face a curve would enter again on
/// the other side.
const MARGIN: f32 = 1e-3;
/// Bytes that building takes for each cell beside the cell and its direction: sums of noise, and the cell in
/// two more places.
const MORE_BYTES: usize = 8 + 2 * size_of::<Cell>();
/// Voxels around the volume whose values are known. At the faces, half a voxel beyond its last samples,
/// differences reach one voxel farther.
const AROUND: i32 = 2;
/// Largest depth of recursion of a curve.
const MOST_LEVELS: u32 = 16;

/// The flow that strands follow.
struct Paths<'a> {
    spec: &'a MeasuredSpec,
    own: &'a StrandSpec,
    /// Density as seeds and paths see it, in voxels.
    density: Density,
    /// Density's values and velocity at the voxels. `None` without velocity.
    voxels: Option<Voxels>,
    /// Voxels from which strands may start, block by block, and the sum of the density up to the end of each
    /// block.
    seeds: Vec<(Seeds<'a>, f64)>,
    /// Largest density of a voxel.
    largest: f64,
}

/// Values at the voxels of a volume and [`AROUND`] it, in an array: a path looks up some ten places a voxel,
/// and finds them ten times as fast as in a grid's tree.
struct Voxels {
    /// Index of the first voxel.
    first: [i32; 3],
    size: [usize; 3],
    /// Velocity in indices per second, and the value of the density's grid.
    values: Vec<[f32; 4]>,
}

impl Voxels {
    fn new(spec: &MeasuredSpec, grids: &Measured) -> Option<Voxels> {
        let field = Field::new(&grids.velocity, spec.to_world, spec.velocity_at)?;
        let source = Source::new(&grids.density, spec.to_world, DVec3::ZERO);
        let first = spec.bounds.min.map(|i| i.saturating_sub(AROUND));
        let size = spec.bounds.size().map(|n| n as usize + 2 * AROUND as usize);
        let index_from_world = spec.to_world.matrix3.inverse();
        let mut values = vec![[0.0; 4]; size.iter().product()];
        values.par_chunks_mut(size[0] * size[1]).enumerate().for_each(|(z, layer)| {
            let (mut field, mut source) = (field.clone(), source.clone());
            for (i, value) in layer.iter_mut().enumerate() {
                let at = [i % size[0], i / size[0], z];
                let index = [0, 1, 2].map(|a| first[a].saturating_add(at[a] as i32));
                let v = (index_from_world * field.at(index)).as_vec3();
                *value = [v.x, v.y, v.z, source.at(index)[0]];
            }
        });
        Some(Voxels { first, size, values })
    }

    /// Bytes of the values of a recipe.
    fn bytes(spec: &MeasuredSpec) -> u128 {
        spec.bounds.size().map(|n| u128::from(n) + 2 * AROUND as u128).iter().product::<u128>()
            * size_of::<[f32; 4]>() as u128
    }

    /// Interpolated velocity in indices per second, and value of the density's grid, at a place in voxels.
    fn at(&self, place: DVec3) -> (DVec3, f32) {
        let at = place - DVec3::from_array(self.first.map(f64::from));
        let most = DVec3::from_array(self.size.map(|n| n as f64 - 1.001));
        let at = at.clamp(DVec3::ZERO, most);
        let low = at.floor();
        let [i, j, k] = low.to_array().map(|c| c as usize);
        let share = (at - low).as_vec3();
        let (row, layer) = (self.size[0], self.size[0] * self.size[1]);
        let first = i + j * row + k * layer;
        let mut sum = Vec4::ZERO;
        for (corner, step) in
            [0, 1, row, row + 1, layer, layer + 1, layer + row, layer + row + 1].iter().enumerate()
        {
            let of = |axis: usize| if corner >> axis & 1 == 1 { share[axis] } else { 1.0 - share[axis] };
            sum += Vec4::from_array(self.values[first + step]) * (of(0) * of(1) * of(2));
        }
        (sum.truncate().as_dvec3(), sum.w)
    }

    /// Length of the curl of the interpolated velocity at a place in voxels, 1/s, by differences across two
    /// voxels. `to_world` gives the metres per index. It changes smoothly between the voxels.
    fn vorticity(&self, place: DVec3, to_world: DMat3) -> f64 {
        let velocity = |at: DVec3| to_world * self.at(at).0;
        curl(DVec3::AXES.map(|a| (velocity(place + a) - velocity(place - a)) * 0.5), to_world)
    }
}

/// Voxels of a block inside the volume.
struct Seeds<'a> {
    data: BlockData<'a>,
    /// First index, and number of voxels along each axis.
    first: [i32; 3],
    count: [u32; 3],
}

impl Seeds<'_> {
    /// Index of each voxel with its density.
    fn voxels(&self, density: Density) -> impl Iterator<Item = ([i32; 3], f64)> {
        let [nx, ny, nz] = self.count;
        let index = move |i: u32| {
            let at = [i % nx, i / nx % ny, i / nx / ny];
            [0, 1, 2].map(|a| self.first[a] + at[a] as i32)
        };
        (0..nx * ny * nz).map(move |i| (index(i), density.in_block(&self.data, index(i))))
    }
}

/// Builds the cells with strands in dense storage: returns them, with ρ as a share of that of the largest
/// density, and the largest density.
///
/// # Errors
/// [`Error::Memory`] where the sums over the strands take more than `budget` bytes; errors of `monitor`.
pub(super) fn cells(
    spec: &MeasuredSpec,
    own: &StrandSpec,
    grids: &Measured,
    budget: u64,
    monitor: &dyn Monitor,
) -> Result<(Vec<Cell>, f64)> {
    let voxels = Voxels::bytes(spec);
    let left = u128::from(budget).checked_sub(voxels).ok_or_else(|| {
        Error::memory(
            "the voxels that strands run through",
            voxels,
            budget,
            "raise --memory, or crop the grid",
        )
    })?;
    check_budget(spec.size, MORE_BYTES, left as u64)?;
    let paths = Paths::new(spec, own, grids);
    let water = WaterSpec {
        size: spec.size,
        across: own.count,
        deep: 1,
        shape: CurveShape { h: own.h, sigma_g_cells: 0.0, levels: 0 },
        structure: Structure {
            coherence: own.coherence,
            strand_length: own.strand_length,
            coverage: own.coverage,
            ..Structure::default()
        },
        seed: own.seed,
        alpha: 1.0,
        k_d: spec.k[0][0],
        k_s: spec.k[0][1],
        k_noise: own.k_noise,
    };
    let draw = |strand: usize, points: &mut Vec<Vec3>| paths.strand(strand, points);
    let flow = Flow::along(&water, draw, monitor)?;
    let mut made: Cells = flow.cells().into();
    set(&water, &mut made, (!water.density_is_of_cells()).then_some(&flow));
    let made = made.dense().expect("the storage is dense");
    Ok((paths.thinned(grids, made), paths.largest))
}

impl<'a> Paths<'a> {
    fn new(spec: &'a MeasuredSpec, own: &'a StrandSpec, grids: &'a Measured) -> Paths<'a> {
        let density = Density::of(&grids.density, 1.0);
        let [min, max] = [spec.bounds.min, spec.bounds.max];
        let (mut seeds, mut sum, mut largest) = (Vec::new(), 0.0, 0.0f64);
        for block in grids.density.blocks() {
            let first = [0, 1, 2].map(|a| block.origin[a].max(min[a]));
            let last = [0, 1, 2].map(|a| (block.origin[a] + (block.side as i32 - 1)).min(max[a]));
            if (0..3).any(|a| last[a] < first[a]) {
                continue;
            }
            let count = [0, 1, 2].map(|a| (last[a] - first[a] + 1) as u32);
            let own = Seeds { data: block.data, first, count };
            let before = sum;
            for (_, mass) in own.voxels(density) {
                sum += mass;
                largest = largest.max(mass);
            }
            if sum > before {
                seeds.push((own, sum));
            }
        }
        Paths { spec, own, density, voxels: Voxels::new(spec, grids), seeds, largest }
    }

    /// Draws a place, in voxels, in proportion to the density. The places of all strands are spread evenly.
    fn seed(&self, strand: usize, rng: &mut impl Rng) -> Option<DVec3> {
        let total = self.seeds.last()?.1;
        let wanted = (strand as f64 + rng.random::<f64>()) / f64::from(self.own.count) * total;
        let block = self.seeds.partition_point(|(_, end)| *end <= wanted).min(self.seeds.len() - 1);
        let mut sum = if block > 0 { self.seeds[block - 1].1 } else { 0.0 };
        let mut index = None;
        for (next, mass) in self.seeds[block].0.voxels(self.density).filter(|(_, mass)| *mass > 0.0) {
            index = Some(next);
            sum += mass;
            if sum > wanted {
                break;
            }
        }
        let aside = DVec3::new(rng.random(), rng.random(), rng.random()) - 0.5;
        index.map(|index| DVec3::from_array(index.map(f64::from)) + aside)
    }

    /// Follows the flow from a place, forwards or backwards (Runge and Kutta's method of order 4). Adds the
    /// places behind the first one.
    fn follow(&self, voxels: &Voxels, from: DVec3, step: f64, way: &mut Vec<DVec3>) {
        let sides = self.spec.bounds.size().into_iter().max().unwrap_or(1) as f64;
        let least = LEAST_DENSITY * self.largest;
        // Per voxel of way; none where nothing flows.
        let direction = |at: DVec3| voxels.at(at).0.try_normalize();
        let mut at = from;
        for _ in 0..(MOST_SIDES * sides / STEP) as usize {
            let Some(k1) = direction(at) else { return };
            let Some(k2) = direction(at + k1 * (0.5 * step)) else { return };
            let Some(k3) = direction(at + k2 * (0.5 * step)) else { return };
            let Some(k4) = direction(at + k3 * step) else { return };
            at += (k1 + 2.0 * (k2 + k3) + k4) * (step / 6.0);
            if !self.holds(at) || self.density.at(voxels.at(at).1) < least {
                return;
            }
            way.push(at);
        }
    }

    /// Whether a place, in voxels, is inside the volume.
    fn holds(&self, at: DVec3) -> bool {
        let [low, high] = self.ends();
        at.cmpge(low).all() && at.cmple(high).all()
    }

    /// Corners of the volume, in voxels.
    fn ends(&self) -> [DVec3; 2] {
        let [min, max] =
            [self.spec.bounds.min, self.spec.bounds.max].map(|i| DVec3::from_array(i.map(f64::from)));
        [min - 0.5, max + 0.5]
    }

    /// Writes the points of a strand, in cells. None for a strand that goes nowhere.
    fn strand(&self, strand: usize, points: &mut Vec<Vec3>) {
        points.clear();
        let mut rng = Family::new(self.own.seed, Stream::Curve).member(strand as u64);
        let Some(voxels) = &self.voxels else { return };
        let Some(seed) = self.seed(strand, &mut rng) else { return };
        let mut way = Vec::new();
        self.follow(voxels, seed, -STEP, &mut way);
        way.reverse();
        way.push(seed);
        self.follow(voxels, seed, STEP, &mut way);
        let [low, high] = self.ends();
        let size = DVec3::from_array(self.spec.size.map(f64::from));
        let way: Vec<Vec3> = way.into_iter().map(|at| ((at - low) / (high - low) * size).as_vec3()).collect();
        let length: f32 = way.windows(2).map(|ends| ends[0].distance(ends[1])).sum();
        if length < 1.0 {
            return;
        }
        let shape = CurveShape {
            h: self.own.h,
            sigma_g_cells: self.own.amplitude * length,
            levels: levels_for(length as u32).min(MOST_LEVELS),
        };
        spatial_fractal_curve(&shape, Vec3::ZERO, Vec3::Y * length, &mut rng, points);
        bend(&way, length, points);
        let most = size.as_vec3() - MARGIN;
        points.iter_mut().for_each(|point| *point = point.clamp(Vec3::splat(MARGIN), most));
    }

    /// Multiplies ρ by the density at each cell, and moves k by what it follows there.
    fn thinned(&self, grids: &Measured, cells: &[Cell]) -> Vec<Cell> {
        let spec = self.spec;
        let [nx, ny, _] = spec.size.map(|n| n as usize);
        let [low, high] = self.ends();
        let size = DVec3::from_array(spec.size.map(f64::from));
        let step = (high - low) / size;
        let fine = Density::of(&grids.density, step.min_element());
        let whole = spec.rho_of(self.largest).max(f64::MIN_POSITIVE);
        let of_layer = |(z, cells): (usize, &[Cell])| {
            let mut second = grids.second.as_ref().map(|grid| Source::new(grid, spec.to_world, DVec3::ZERO));
            let of_cell = |(i, cell): (usize, &Cell)| {
                let Some(voxels) = self.voxels.as_ref().filter(|_| cell.rho_code() > 0) else {
                    return Cell::default();
                };
                let at = [i % nx, i / nx, z].map(|c| c as f64 + 0.5);
                let place = low + DVec3::from_array(at) * step;
                let (v, density) = voxels.at(place);
                let share = spec.rho_of(fine.at(density)) / whole;
                let value = match (spec.reflect, &mut second) {
                    (ReflectBy::Speed, _) => (spec.to_world.matrix3 * v).length(),
                    (ReflectBy::Vorticity, _) => voxels.vorticity(place, spec.to_world.matrix3),
                    (ReflectBy::Grid, Some(grid)) => f64::from(grid.between(place)[0]),
                    _ => 0.0,
                };
                let (k, [from, to]) = (cell.k(), [spec.k[0], spec.reflected(value)]);
                let thin = cell.with_density(
                    cell.rho() * share as f32,
                    k.0 + (to[0] - from[0]),
                    k.1 + (to[1] - from[1]),
                );
                if thin.rho_code() == 0 { Cell::default() } else { thin }
            };
            cells.iter().enumerate().map(of_cell).collect::<Vec<_>>()
        };
        cells.par_chunks(nx * ny).enumerate().flat_map_iter(of_layer).collect()
    }
}

/// Lays a curve that runs along y from 0 to `length` along a way of that length: its y is the place on the
/// way, its x and z lie across it. The axes across are carried along without a twist.
fn bend(way: &[Vec3], length: f32, points: &mut [Vec3]) {
    let along = |i: usize| (way[i + 1] - way[i]).try_normalize();
    let mut tangent = (0..way.len() - 1).find_map(along).unwrap_or(Vec3::Y);
    let (mut x, _) = tangent.any_orthonormal_pair();
    let (mut i, mut passed) = (0, 0.0);
    let last = points.len() - 1;
    for (k, point) in points.iter_mut().enumerate() {
        // The curve's own way along y has eddies; the way's place is even.
        let wanted = length * k as f32 / last as f32;
        while i + 2 < way.len() && passed + way[i].distance(way[i + 1]) < wanted {
            passed += way[i].distance(way[i + 1]);
            i += 1;
        }
        tangent = along(i).unwrap_or(tangent);
        x = (x - tangent * x.dot(tangent))
            .try_normalize()
            .unwrap_or_else(|| tangent.any_orthonormal_pair().0);
        let at = way[i] + tangent * (wanted - passed);
        let off = *point - Vec3::Y * wanted;
        *point = at + x * off.x + tangent * off.y + x.cross(tangent) * off.z;
    }
}
