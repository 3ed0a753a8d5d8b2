//! Sums over the curves in each cell they pass; direction and density are computed from them.

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use super::bricks::{BRICK, Bricks, Marks, parted};
use super::bundle::curve_points;
use super::ripple::Ripple;
use super::spec::WaterSpec;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::random::{Family, Stream};
use crate::walk::{Walk, floor_cell};

/// Curves a task builds before it hands its contributions over.
const CURVES_PER_TASK: usize = 64;
/// Tasks whose contributions are held at once; with 600 cells a curve these are about 40 MB.
const TASKS_PER_ROUND: usize = 64;
/// Number of curves sampled to estimate how many cells all curves pass.
const SAMPLE_CURVES: usize = 32;

/// Part of a curve inside one cell: index of the cell within its slab, length × direction in cells.
type Contribution = (u32, Vec3);

/// Contributions of one task to one slab.
#[derive(Clone, Default)]
struct Bucket {
    parts: Vec<Contribution>,
    /// The strands' noise in each of them; none where ρ does not follow the strands.
    noises: Vec<f32>,
}

/// Sums over the curves, cell by cell.
pub(super) struct Flow {
    /// Length inside the cell × direction, cells.
    pub directions: Vec<Vec3>,
    /// Length × noise of the strand, and length²; empty where ρ does not follow the strands.
    pub strands: Vec<[f32; 2]>,
}

impl Flow {
    /// Noise of the strands in a cell: their mean by length, made one of variance 1 again.
    pub fn noise(&self, index: usize) -> f32 {
        self.strands.get(index).map_or(0.0, |[sum, squares]| sum / squares.max(1e-30).sqrt())
    }

    /// Walks all curves, for every cell.
    pub fn new(spec: &WaterSpec, monitor: &dyn Monitor) -> Result<Flow> {
        let [nx, ny, nz] = spec.size.map(|n| n as usize);
        let layers_per_slab = nz.div_ceil(16);
        let slab = nx * ny * layers_per_slab;
        let lengths: Vec<usize> =
            (0..nz.div_ceil(layers_per_slab)).map(|i| slab.min(nx * ny * nz - i * slab)).collect();
        let place = |cell: IVec3| {
            let z = cell.z as usize;
            let in_slab = ((z % layers_per_slab) * ny + cell.y as usize) * nx + cell.x as usize;
            (z / layers_per_slab, in_slab as u32)
        };
        Flow::summed(spec, &lengths, place, [0, 1], monitor)
    }

    /// Computes the sums of [`Flow::new`] for the cells that `bricks` will store, in storage order.
    pub fn packed(spec: &WaterSpec, bricks: &Bricks, monitor: &dyn Monitor) -> Result<Flow> {
        let layers = bricks.layers();
        let layers_per_slab = layers.len().div_ceil(16);
        let lengths: Vec<usize> = layers.chunks(layers_per_slab).map(|part| part.iter().sum()).collect();
        let sums = lengths.iter().scan(0, |sum, length| {
            *sum += length;
            Some(*sum - length)
        });
        let firsts: Vec<usize> = sums.collect();
        let place = |cell: IVec3| {
            let [x, y, z] = cell.to_array().map(|c| c as u32);
            let slab = (z / BRICK) as usize / layers_per_slab;
            let place = bricks.place(x, y, z).expect("it was marked by the same walk");
            (slab, (place - firsts[slab]) as u32)
        };
        Flow::summed(spec, &lengths, place, [1, 2], monitor)
    }

    /// Walks all curves. `place` says in which slab a cell is, of those with these `lengths`, and where in
    /// it; this is round `round` of `rounds`.
    ///
    /// They are walked in parallel; their contributions are added slab by slab in z, within a slab in
    /// the curves' order, so the sums depend neither on the number of threads nor on the slabs.
    fn summed(
        spec: &WaterSpec,
        lengths: &[usize],
        place: impl Fn(IVec3) -> (usize, u32) + Sync,
        [before, rounds]: [u64; 2],
        monitor: &dyn Monitor,
    ) -> Result<Flow> {
        let coherent = spec.structure.coherence > 0.0;
        let cells = lengths.iter().sum();
        let mut directions = vec![Vec3::ZERO; cells];
        let mut strands = vec![[0.0; 2]; if coherent { cells } else { 0 }];
        let slabs = lengths.len();
        let curves = spec.across as usize * spec.deep as usize;
        let starts: Vec<usize> = (0..curves).step_by(CURVES_PER_TASK).collect();
        for (round, tasks) in starts.chunks(TASKS_PER_ROUND).enumerate() {
            let done = (round * TASKS_PER_ROUND * CURVES_PER_TASK) as u64;
            monitor.progress("curves", before * curves as u64 + done, rounds * curves as u64)?;
            let tasks: Vec<Vec<Bucket>> = tasks
                .par_iter()
                .map(|&first| {
                    let mut buckets = vec![Bucket::default(); slabs];
                    let (mut points, mut noise) = (Vec::new(), Vec::new());
                    for curve in first..(first + CURVES_PER_TASK).min(curves) {
                        curve_points(spec, curve, &mut points);
                        if coherent {
                            strand_noise(spec, curve, points.len() - 1, &mut noise);
                        }
                        walk_curve(spec, &points, &mut |cell: IVec3, part: Vec3, segment: usize| {
                            let (slab, in_slab) = place(cell);
                            let bucket = &mut buckets[slab];
                            bucket.parts.push((in_slab, part));
                            if coherent {
                                bucket.noises.push(noise[segment]);
                            }
                        });
                    }
                    buckets
                })
                .collect();
            parted(&mut directions, lengths).into_par_iter().enumerate().for_each(|(slab, cells)| {
                for &(index, v) in tasks.iter().flat_map(|buckets| &buckets[slab].parts) {
                    cells[index as usize] += v;
                }
            });
            if !coherent {
                continue;
            }
            parted(&mut strands, lengths).into_par_iter().enumerate().for_each(|(slab, cells)| {
                for bucket in tasks.iter().map(|buckets| &buckets[slab]) {
                    for (&(index, v), w) in bucket.parts.iter().zip(&bucket.noises) {
                        let [sum, squares] = &mut cells[index as usize];
                        *sum += v.length() * w;
                        *squares += v.length_squared();
                    }
                }
            });
        }
        Ok(Flow { directions, strands })
    }
}

/// Marks every cell that a curve passes.
pub(super) fn marked(spec: &WaterSpec, monitor: &dyn Monitor) -> Result<Marks> {
    let marks = Marks::new(spec.size);
    let curves = spec.across as usize * spec.deep as usize;
    let starts: Vec<usize> = (0..curves).step_by(CURVES_PER_TASK).collect();
    for (round, tasks) in starts.chunks(TASKS_PER_ROUND).enumerate() {
        let done = (round * TASKS_PER_ROUND * CURVES_PER_TASK) as u64;
        monitor.progress("curves", done, 2 * curves as u64)?;
        tasks.par_iter().for_each(|&first| {
            let mut points = Vec::new();
            for curve in first..(first + CURVES_PER_TASK).min(curves) {
                curve_points(spec, curve, &mut points);
                walk_curve(spec, &points, &mut |cell: IVec3, _: Vec3, _: usize| marks.add(cell));
            }
        });
    }
    Ok(marks)
}

/// Estimates the number of cells that the curves pass, from a sample and as if all cells were hit
/// independently.
pub(super) fn expected_cells(spec: &WaterSpec) -> u64 {
    let curves = spec.across as usize * spec.deep as usize;
    let looked: Vec<usize> = (0..curves).step_by(curves.div_ceil(SAMPLE_CURVES)).collect();
    let passed: u64 = looked
        .par_iter()
        .map(|&curve| {
            let (mut points, mut passed) = (Vec::new(), 0);
            curve_points(spec, curve, &mut points);
            walk_curve(spec, &points, &mut |_: IVec3, _: Vec3, _: usize| passed += 1);
            passed
        })
        .sum();
    let all = spec.size.iter().map(|&n| f64::from(n)).product::<f64>();
    let passed = passed as f64 / looked.len() as f64 * curves as f64;
    (all * -(-passed / all).exp_m1()) as u64
}

/// The noise that a curve carries, at the start of each of its segments.
fn strand_noise(spec: &WaterSpec, curve: usize, segments: usize, noise: &mut Vec<f32>) {
    let mut rng = Family::new(spec.seed, Stream::Strand).member(curve as u64);
    noise.clear();
    Ripple::new(spec.structure.strand_length, &mut rng).sample(segments, noise);
}

/// Reports each cell the curve passes, its part there and the segment that came in; parts of
/// neighbouring segments inside one cell come as one. x and y wrap; what leaves in z is dropped.
fn walk_curve(spec: &WaterSpec, points: &[Vec3], report: &mut impl FnMut(IVec3, Vec3, usize)) {
    let size = IVec3::from_array(spec.size.map(|n| n as i32));
    let mut open: Option<(IVec3, Vec3, usize)> = None;
    let mut add = |cell: IVec3, part: Vec3, segment: usize| match &mut open {
        Some((last, sum, _)) if *last == cell => *sum += part,
        _ => {
            if let Some((last, sum, first)) = open.replace((cell, part, segment))
                && (0..size.z).contains(&last.z)
            {
                report(last, sum, first);
            }
        }
    };
    for (segment, ends) in points.windows(2).enumerate() {
        let d = ends[1] - ends[0];
        let cell = cell_of(ends[0]);
        if cell == cell_of(ends[1]) {
            // Many segments lie in one cell: the walk would find just that.
            add(IVec3::new(cell.x.rem_euclid(size.x), cell.y.rem_euclid(size.y), cell.z), d, segment);
            continue;
        }
        for crossing in Walk::new(size, ends[0], d, 1.0) {
            add(crossing.cell, d * (crossing.t_exit - crossing.t_enter), segment);
        }
    }
    if let Some((cell, sum, first)) = open
        && (0..size.z).contains(&cell.z)
    {
        report(cell, sum, first);
    }
}

#[inline]
fn cell_of(p: Vec3) -> IVec3 {
    IVec3::new(floor_cell(p.x), floor_cell(p.y), floor_cell(p.z))
}
